"""Natural points that somebody picked in a scan: corners, edges, discs, holes, axes, places.

A place and a radius choose the points. Planes are those of a board's fit (residuals along the
beams, noise told by them); a corner is where three meet, an edge where two do. Along an edge or an
axis the pick holds to its radius only. Points near another face take no part, because beams that
meet both measure neither (method section 8.5).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from pykdtree.kdtree import KDTree
from scipy.optimize import nnls

from tribrach._types import Array, Mask
from tribrach.instruments.neighbours import SharedNoise
from tribrach.statistics import robust_sigma
from tribrach.targets.detection import Detection, Rejected, with_floor
from tribrach.targets.prints.plane import BoardPlane, fit_board_plane

#: what a place can be picked as
PickKind = Literal["corner", "edge", "disc", "hole", "axis", "place"]
KINDS: tuple[PickKind, ...] = get_args(PickKind)


@dataclass(frozen=True)
class PickGates:
    """How natural points are fitted (by hand: test_picks)."""

    fewest_points: int = 30  #: points around a place
    face_points: int = 25  #: points of a face
    face_share: float = 0.05  #: share of the points that a face has at least
    trials: int = 200  #: triples or pairs of points that faces and cylinders are tried with
    neighbours: int = 9  #: points that a normal is taken from
    near_sigmas: float = 4.0  #: points within so many sigmas lie on a face
    guard_sigmas: float = 6.0  #: points nearer than this to another face are left out
    guard_spacings: float = 1.5  #: the same in distances of neighbouring points
    upright: float = 0.15  #: least volume of three unit normals, least sine between two
    #: share of the squares of residuals, and F, from which on a quadric is no face
    bent_share: float = 0.2
    bent: float = 12.0
    axis_spacings: float = 2.0  #: least radius of a cylinder in distances of neighbouring points
    rough: float = 3.0  #: residuals of a cylinder over the noise of neighbours
    sectors: int = 36  #: around a disc or hole
    full: float = 0.6  #: share of the sectors that show its edge
    most_round: float = 0.7  #: share of the edge that lies on the circle
    cornered: float = 7.0  #: F of third and fourth waves in an edge, four degrees of freedom
    round_spacings: float = 3.0  #: least radius in distances of neighbouring points
    trim_sigmas: float = 3.5  #: residuals of a cylinder beyond this take no part
    flattest: float = 0.25  #: cosine of beam and normal from which on points count
    rounds: int = 12  #: rounds of the fit of a cylinder at most


GATES = PickGates()
#: variance of normal values within three sigmas of zero
_TRIMMED = 0.9733
#: least cosine that is divided by
_LEAST_SLOPE = 1e-3


class _Refused(Exception):
    """Why a place is not what it was picked as, without the stop."""


@dataclass(frozen=True)
class NaturalPoint:
    """A place (3,) of a scan [m], what it is picked as, and how far its points lie from it [m]."""

    kind: PickKind
    place: tuple[float, float, float]
    radius: float


def find_pick(
    xyz: Array,
    pick: NaturalPoint,
    *,
    shared: SharedNoise | None = None,
    floor: float = 0.0,
    scan: str = "",
) -> Detection | Rejected:
    """The natural point at a place of a scan.

    ``xyz`` (n, 3): all points in the scanner frame [m]; ``shared``: what neighbours share of their
    noise; ``floor``: added to the covariance, a standard deviation [m].
    """
    place = np.array(pick.place)
    around = xyz[np.linalg.norm(xyz - place, axis=1) <= pick.radius]
    try:
        if len(around) < GATES.fewest_points:
            raise _Refused(f"{len(around)} points are around it")
        center, covariance, used, rms, facts = _FITS[pick.kind](around, place, pick.radius, shared)
        if not np.linalg.norm(center - place) <= pick.radius:
            raise _Refused("it lies outside of the radius")
    except _Refused as why:
        return Rejected(pick.kind, place, f"no {pick.kind} was found: {why}")
    return Detection(
        kind=pick.kind,
        scan=scan,
        center=center,
        covariance=with_floor((covariance + covariance.T) / 2, floor),
        radius=0.0,
        rms=rms,
        points=len(around),
        inliers=used,
        range=float(np.linalg.norm(center)),
        incidence=float("nan"),
        coverage=used / len(around),
        facts=facts,
    )


#: centre (3,), covariance (3, 3), points that counted, rms of the residuals, further numbers
_Fitted = tuple[Array, Array, int, float, dict[str, float]]


def _corner(xyz: Array, place: Array, radius: float, shared: SharedNoise | None) -> _Fitted:
    """Where three planes meet."""
    return _meeting(_faces(xyz, 3, place, radius, shared), len(xyz), None)


def _edge(xyz: Array, place: Array, radius: float, shared: SharedNoise | None) -> _Fitted:
    """The point of the edge of two planes next to the place."""
    return _meeting(_faces(xyz, 2, place, radius, shared), len(xyz), (place, radius))


def _meeting(
    planes: Sequence[BoardPlane], points: int, along: tuple[Array, float] | None
) -> _Fitted:
    """Intersection of three planes, or of two and the plane across their edge at a place."""
    normals = np.array([plane.normal for plane in planes])
    offsets = np.array([plane.offset for plane in planes])
    if along is not None:
        across = np.cross(*normals)
        size = np.linalg.norm(across)
        if size < GATES.upright:
            raise _Refused("the two faces lie in one plane")
        normals = np.vstack([normals, across / size])
        offsets = np.append(offsets, normals[2] @ along[0])
    if abs(np.linalg.det(normals)) < GATES.upright:
        raise _Refused("the faces do not meet in one point")
    center = np.linalg.solve(normals, offsets)
    sigma = [p.sigma(p.axes @ (center - p.origin)) for p in planes]
    sigma += [] if along is None else [along[1]]
    root = np.linalg.inv(normals) * np.array(sigma)
    used = sum(int(plane.use.sum()) for plane in planes)
    rms = float(np.sqrt(sum(p.rms**2 * p.use.sum() for p in planes) / used))
    return center, root @ root.T, used, rms, {}


def _faces(
    xyz: Array, count: int, place: Array, radius: float, shared: SharedNoise | None
) -> list[BoardPlane]:
    """The largest planes among points, each from the points that lie on no other."""
    rng = np.random.default_rng(len(xyz))
    normals, noise, spacing = _surroundings(xyz)
    near = GATES.near_sigmas * noise
    rough: list[tuple[Array, float]] = []
    rest = np.ones(len(xyz), dtype=bool)
    for _ in range(count):
        found = _largest_plane(xyz, normals, rest, near, rng)
        if found is None:
            what = {0: "no face is", 1: "one face is", 2: "two faces are"}[len(rough)]
            raise _Refused(f"{what} flat enough and large enough")
        rough.append(found)
        # what lies beside the face on its continuation is of another one, if its normal says so
        turned = np.abs(normals @ found[0]) < 0.8
        rest &= (np.abs(xyz @ found[0] - found[1]) > near) | turned
    planes = []
    guard = max(GATES.guard_sigmas * noise, GATES.guard_spacings * spacing)
    unit = xyz / np.linalg.norm(xyz, axis=1, keepdims=True)
    for k, (normal, offset) in enumerate(rough):
        # where the beam meets the face: the place of the point itself goes with its noise
        slope = unit @ normal
        slope = np.where(np.abs(slope) < _LEAST_SLOPE, _LEAST_SLOPE, slope)
        met = unit * (offset / slope)[:, None]
        own = np.abs(xyz @ normal - offset) < 2 * near
        own &= np.linalg.norm(met - place, axis=1) < 0.97 * radius
        for n, d in (other for j, other in enumerate(rough) if j != k):
            own &= np.abs(met @ n - d) > guard
        if own.sum() < GATES.face_points:
            raise _Refused("a face has too few points away from the others")
        part = xyz[own]
        plane = fit_board_plane(part, np.ones(len(part), bool), part.mean(axis=0), 0.0, shared)
        if plane is None or plane.use.sum() < GATES.face_points:
            raise _Refused("a face is too flat to the beams, or uneven")
        planes.append(_by_its_own_noise(plane, part))
    return planes


def _by_its_own_noise(plane: BoardPlane, xyz: Array) -> BoardPlane:
    """The plane with the noise of all its residuals, which few points tell better than a median."""
    part = xyz[plane.use]
    unit = part / np.linalg.norm(part, axis=1, keepdims=True)
    gap = (part @ plane.normal - plane.offset) / (unit @ plane.normal)
    flat = (part - plane.origin) @ plane.axes.T
    bent = np.column_stack([np.ones(len(gap)), flat, flat**2, flat[:, 0] * flat[:, 1]])
    left = gap - bent @ np.linalg.lstsq(bent, gap, rcond=None)[0]
    share = 1 - left @ left / (gap @ gap)
    if share > GATES.bent_share and share * (len(gap) - 6) > GATES.bent * 3 * (1 - share):
        raise _Refused("a face is curved")
    # least squares of what is within three sigmas, and the spread of its own estimate
    ratio = gap @ gap / (len(gap) - 5) / _TRIMMED / robust_sigma(gap) ** 2
    return replace(plane, cofactor=plane.cofactor * ratio)


def _surroundings(xyz: Array) -> tuple[Array, float, float]:
    """Normals (n, 3), noise across the surface and distance of neighbours [m]."""
    k = min(GATES.neighbours, len(xyz) - 1)
    away, index = KDTree(xyz).query(xyz, k=k)
    local = xyz[index] - xyz[index].mean(axis=1, keepdims=True)
    values, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", local, local))
    # of k points three are used up by the plane
    noise = float(np.sqrt(np.median(values[:, 0]) / max(k - 3, 1)))
    spacing = float(np.median(away[:, 1:5]))
    return vectors[:, :, 0], max(noise, 1e-5), spacing


def _largest_plane(
    xyz: Array, normals: Array, rest: Mask, near: float, rng: np.random.Generator
) -> tuple[Array, float] | None:
    """Normal and offset of the plane that most of the points left lie on, with their normals."""
    left = np.flatnonzero(rest)
    least = max(GATES.face_points, int(GATES.face_share * len(xyz)))
    if len(left) < least:
        return None
    triples = xyz[rng.choice(left, (GATES.trials, 3))]
    tried = np.cross(triples[:, 1] - triples[:, 0], triples[:, 2] - triples[:, 0])
    size = np.linalg.norm(tried, axis=1)
    tried, triples = tried[size > 0] / size[size > 0, None], triples[size > 0]
    if not len(tried):
        return None
    offset = np.einsum("ni,ni->n", tried, triples[:, 0])
    on = np.abs(xyz[left] @ tried.T - offset) < near
    on &= np.abs(normals[left] @ tried.T) > 0.8
    best = int(on.sum(axis=0).argmax())
    normal, d = tried[best], offset[best]
    for _ in range(4):
        members = left[
            (np.abs(xyz[left] @ normal - d) < near) & (np.abs(normals[left] @ normal) > 0.8)
        ]
        if len(members) < least:
            return None
        middle = xyz[members].mean(axis=0)
        part = xyz[members] - middle
        normal = np.linalg.eigh(part.T @ part)[1][:, 0]
        d = normal @ middle
    return normal, float(d)


def _disc(xyz: Array, place: Array, radius: float, shared: SharedNoise | None) -> _Fitted:
    """Centre of a disc, which ends where its plane has no more points."""
    return _round(xyz, place, radius, shared, outer=True)


def _hole(xyz: Array, place: Array, radius: float, shared: SharedNoise | None) -> _Fitted:
    """Centre of a hole, which begins where its plane has no more points."""
    return _round(xyz, place, radius, shared, outer=False)


def _round(
    xyz: Array, place: Array, radius: float, shared: SharedNoise | None, *, outer: bool
) -> _Fitted:
    """Centre of the circle along which a plane ends, from the last point in each direction."""
    (plane,) = _faces(xyz, 1, place, radius, shared)
    flat = plane.project(xyz)
    on = np.abs(xyz @ plane.normal - plane.offset) < GATES.near_sigmas * plane.rms
    flat = flat[on]
    middle = plane.axes @ (place - plane.origin)
    for _ in range(10):
        away = np.linalg.norm(flat - middle, axis=1)
        sector = (np.arctan2(*(flat - middle).T[::-1]) / (2 * np.pi) * GATES.sectors).astype(int)
        sector %= GATES.sectors
        order = np.lexsort((-away if outer else away, sector))
        seen, first = np.unique(sector[order], return_index=True)
        last = flat[order[first]]
        if len(seen) < GATES.full * GATES.sectors:
            raise _Refused("its edge is not seen all around")
        fitted = _circle(last)
        if fitted is None:
            raise _Refused("its edge is no circle")
        before, (middle, size, cofactor, rms) = middle, fitted
        if np.linalg.norm(middle - before) < 1e-7:
            break
    if size > radius or (outer and size > 0.9 * radius):
        raise _Refused("its edge is not within the radius")
    _, _, spacing = _surroundings(xyz)
    if size < GATES.round_spacings * spacing:
        raise _Refused("it is hardly larger than the distances between points")
    if rms > spacing:
        raise _Refused("its edge is no circle")
    root = np.column_stack([plane.axes.T @ np.linalg.cholesky(cofactor), plane.normal])
    root[:, 2] *= plane.sigma(middle)
    facts = {"circle_m": float(size)}
    return plane.at(middle), root @ root.T, len(last), rms, facts


def _circle(edge: Array) -> tuple[Array, float, Array, float] | None:
    """Centre (2,), radius, covariance of the centre (2, 2) and rms of a circle, without strays."""
    use = np.ones(len(edge), dtype=bool)
    middle, size = edge.mean(axis=0), 0.0
    for _ in range(6):
        if use.sum() < GATES.most_round * len(edge):
            return None
        design = np.column_stack([2 * edge[use], np.ones(use.sum())])
        solved = np.linalg.lstsq(design, (edge[use] ** 2).sum(axis=1), rcond=None)[0]
        middle, size = solved[:2], float(np.sqrt(max(solved[2] + solved[:2] @ solved[:2], 0.0)))
        away = edge - middle
        length = np.linalg.norm(away, axis=1)
        gap = length - size
        use = np.abs(gap - np.median(gap[use])) < GATES.trim_sigmas * max(
            robust_sigma(gap[use]), 1e-6
        )
    if _cornered(away[use], gap[use]):
        return None
    rows = np.column_stack([away[use] / length[use, None], np.ones(use.sum())])
    variance = gap[use] @ gap[use] / (use.sum() - 5)
    return middle, size, variance * np.linalg.inv(rows.T @ rows)[:2, :2], float(np.sqrt(variance))


def _cornered(away: Array, gap: Array) -> bool:
    """True if residuals (n,) go around the circle as those of triangles and squares do."""
    around = np.arctan2(away[:, 1], away[:, 0])
    waves = [wave(k * around) for k in (3, 4) for wave in (np.cos, np.sin)]
    rows = np.column_stack([*waves, np.ones(len(gap)), away])
    left = gap - rows @ np.linalg.lstsq(rows, gap, rcond=None)[0]
    rest = left @ left / (len(gap) - rows.shape[1])
    return bool((gap @ gap - left @ left) / 4 > GATES.cornered * rest)


def _axis(xyz: Array, place: Array, radius: float, shared: SharedNoise | None) -> _Fitted:
    """The point of the axis of a cylinder next to the place, from residuals along the beams."""
    middle, axis, size = _cylinder_start(xyz)
    length = np.linalg.norm(xyz, axis=1)
    beam = xyz / length[:, None]
    sigma, use = np.ones(len(xyz)), np.ones(len(xyz), dtype=bool)
    for turn in range(GATES.rounds):
        middle = middle + axis * (axis @ (place - middle))
        cylinder = _Cylinder(middle, axis, size, _across(axis))
        met, slope = cylinder.met(beam)
        gap = length - met
        inside = (slope > GATES.flattest) & (
            np.linalg.norm(beam * met[:, None] - place, axis=1) < 0.97 * radius + size
        )
        near = use & inside
        if not turn and near.any():
            near &= np.abs(gap) < 4 * np.median(np.abs(gap[near]))
        if near.sum() < GATES.fewest_points:
            raise _Refused("too few points lie on it")
        sigma = _beam_sigma(gap, slope, near)
        use = inside & (np.abs(gap) < GATES.trim_sigmas * sigma)
        if use.sum() < GATES.fewest_points:
            raise _Refused("too few points lie on it")
        rows, rest = cylinder.jacobian(beam[use]) / sigma[use, None], gap[use] / sigma[use]
        own = np.linalg.pinv(rows.T @ rows)
        step = own @ (rows.T @ rest)
        middle = middle + step[:2] @ cylinder.across
        axis = axis + step[2:4] @ cylinder.across
        axis, size = axis / np.linalg.norm(axis), size + float(step[4])
        if not 0 < size < 20 * radius:
            raise _Refused("the surface is not round")
        if turn > 2 and np.abs(step[:2]).max() < 1e-6:
            break
    _, noise, spacing = _surroundings(xyz)
    rough = np.sqrt(np.mean((gap * slope)[use] ** 2)) > GATES.rough * noise
    if rough or size < GATES.axis_spacings * spacing:
        raise _Refused("the surface is not round")
    if shared is not None:
        own = own + own @ shared.at(float(length.mean())).summed(beam[use], rows) @ own
    own *= max(rest @ rest / (len(rest) - 7), 1.0)
    middle = middle + axis * (axis @ (place - middle))
    root = np.column_stack([cylinder.across.T @ np.linalg.cholesky(own[:2, :2]), radius * axis])
    rms = float(np.sqrt(np.mean(gap[use] ** 2)))
    return middle, root @ root.T, int(use.sum()), rms, {"cylinder_m": size}


def _beam_sigma(gap: Array, slope: Array, use: Mask) -> Array:
    """Sigmas (n,) along the beams: of ranges, and of angles where surfaces are steep to beams."""
    square = 1 / slope.clip(GATES.flattest) ** 2 - 1
    design = np.column_stack([np.ones(use.sum()), square[use]])
    # medians of steps of the slope: strays count for nothing
    order = np.argsort(square[use])
    groups = [part for part in np.array_split(order, 8) if len(part) > 3]
    level = np.array([robust_sigma(gap[use][part], about=0.0) ** 2 for part in groups])
    mean = np.array([design[part].mean(axis=0) for part in groups])
    parts, _ = nnls(mean / level[:, None].clip(1e-12), np.ones(len(level)))
    out: Array = np.sqrt(parts[0] + parts[1] * square).clip(1e-6)
    return out


@dataclass(frozen=True)
class _Cylinder:
    """A cylinder about the axis through middle."""

    middle: Array  #: (3,), next to the place
    axis: Array  #: (3,), unit vector
    size: float  #: radius [m]
    across: Array  #: (2, 3), unit vectors across the axis

    def met(self, beam: Array) -> tuple[Array, Array]:
        """Where beams (n, 3) meet its near side [m], and the cosines of beam and normal there."""
        flat = beam - np.outer(beam @ self.axis, self.axis)
        middle = self.middle - self.axis * (self.axis @ self.middle)
        a, b = (flat**2).sum(axis=1), flat @ middle
        root = np.sqrt(np.maximum(b**2 - a * (middle @ middle - self.size**2), 0.0))
        return (b - root) / np.maximum(a, 1e-12), root / self.size

    def jacobian(self, beam: Array) -> Array:
        """Derivatives (n, 5) of the ranges by middle, direction and radius."""
        met, slope = self.met(beam)
        off = beam * met[:, None] - self.middle
        along = off @ self.axis
        normal = (off - np.outer(along, self.axis)) / self.size
        # the surface moves along its normal, the range by that over the cosine
        by_middle = normal @ self.across.T
        moved = np.column_stack([by_middle, by_middle * along[:, None], np.ones(len(beam))])
        out: Array = -moved / np.maximum(slope, GATES.flattest)[:, None]
        return out


def _across(axis: Array) -> Array:
    """Two unit vectors (2, 3) at right angles to an axis."""
    other = np.eye(3)[np.abs(axis).argmin()]
    first = np.cross(axis, other)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(axis, first)])


def _cylinder_start(xyz: Array) -> tuple[Array, Array, float]:
    """A place of the axis (3,), its direction (3,) and the radius, from normals of neighbours."""
    rng = np.random.default_rng(len(xyz))
    normals, noise, _ = _surroundings(xyz)
    best: tuple[int, Array, Array, float] | None = None
    for a, b in rng.choice(len(xyz), (2 * GATES.trials, 2)):
        axis = np.cross(normals[a], normals[b])
        size = np.linalg.norm(axis)
        if size < 0.2:
            continue
        axis /= size
        across = _across(axis)
        flat = (xyz[[a, b]]) @ across.T
        n = normals[[a, b]] @ across.T
        # where the normals of both meet
        along = np.linalg.solve(np.stack([n[0], -n[1]], axis=1), flat[1] - flat[0])
        middle = flat[0] + along[0] * n[0]
        gap = np.linalg.norm(xyz @ across.T - middle, axis=1)
        radius = float(np.mean(np.abs(along)))
        on = int((np.abs(gap - radius) < max(4 * noise, 0.03 * radius)).sum())
        if best is None or on > best[0]:
            best = on, middle @ across, axis, radius
    if best is None or best[0] < GATES.fewest_points:
        raise _Refused("the surface is not round")
    return best[1], best[2], best[3]


def _place(xyz: Array, place: Array, radius: float, shared: SharedNoise | None) -> _Fitted:
    """The mean of the points around a place, as sure as they lie apart."""
    center = xyz.mean(axis=0)
    gaps = xyz - center
    covariance = gaps.T @ gaps / (len(xyz) - 1)
    return center, covariance, len(xyz), float(np.sqrt(np.trace(covariance))), {}


_FITS = {
    "corner": _corner,
    "edge": _edge,
    "disc": _disc,
    "hole": _hole,
    "axis": _axis,
    "place": _place,
}
