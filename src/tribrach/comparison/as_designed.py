"""Points against the model of what was meant: deviations by place and by element, and verdicts.

Every point is compared with the nearest face, along its normal. Places of half a metre of a face
have mean deviations with one joint covariance: the noise of their points, and what the points share
by the pose of their station. An element is within its tolerance, not within it, or that cannot be
told, at a stated risk (ISO 14253-1, JCGM 106; method section 9.6). Metres; the frame of the model.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from tribrach._types import Array, Index, Mask
from tribrach.answers import Table, Vector
from tribrach.cloud.placement import Placement
from tribrach.cloud.shared_part import angle_slopes, slopes
from tribrach.errors import InputError
from tribrach.geometry.mesh import Mesh
from tribrach.geometry.triangle_tree import Nearest, TriangleTree
from tribrach.geometry.triangles import covering_pieces
from tribrach.instruments.neighbours import effective_number
from tribrach.statistics import norm

Verdict = Literal["within", "not within", "cannot tell", "not seen"]


@dataclass(frozen=True)
class DesignGates:
    """Which points are of a face, and what a place is (by hand: test_as_designed)."""

    #: the way from the face to the point is along its normal to this [cosine]; others lie beyond an
    #: edge
    along_cosine: float = 0.9
    fewest_points: int = 10  #: fewer points make no place
    #: steps of the distances within the limit, and robust sigmas beyond which points of a place are
    #: of something else
    steps: int = 256
    outlying: float = 4.0
    #: independent points in a place of a scanner whose beam nobody knows, at most
    independent: float = 25.0
    flat_cosine: float = 0.9995  #: normals of a flat element are alike to this [cosine]
    standing: float = 0.5  #: normals of what stands are lower than this [sine of the slope]
    #: draws of the largest of several deviations, and places beyond which a bound takes their place
    draws: int = 4000
    most_places: int = 1500
    wide_sigmas: float = 3.0  #: a tolerance so many sigmas wide is passed at one of its limits only
    samples: float = 4.0  #: samples of a face to a place, along an edge


GATES = DesignGates()
#: bits of a key: element, three lattice numbers, side
_LATTICE = 13
#: columns of sums before those of shared effects: n, d, d^2, own variance, x, y, z, normal
_FIXED = 10


@dataclass(frozen=True)
class DeviationLimits:
    """Deviations that are allowed [m]."""

    lower: float
    upper: float


class Design:
    """A model that clouds are compared with.

    Of faces whose sides the model does not tell, the scanner's side counts; ``place`` is the edge
    [m] of what is compared.
    """

    def __init__(self, mesh: Mesh, scanner: Array | None = None, place: float = 0.5) -> None:
        mesh, known = mesh.outwards()
        self.sides_known = known or scanner is not None
        if not known and scanner is not None:
            away = np.einsum("ni,ni->n", mesh.across, scanner - mesh.triangles[:, 0]) < 0
            turned = np.where(away[:, None, None], mesh.triangles[:, ::-1], mesh.triangles)
            mesh = Mesh(turned, mesh.element, mesh.names, mesh.crs, mesh.sentences)
        self.mesh, self.place = mesh, place
        self.normals = mesh.normals
        self.tree = TriangleTree(mesh)
        low, high = mesh.corners
        self._low = low
        if (high - low).max() / place >= 1 << _LATTICE or len(mesh.names) >= 1 << 20:
            raise InputError(
                f"the model has more than {1 << _LATTICE} places along an axis",
                cure="give a larger --place-m, or the model of one building",
            )
        self._faces = _Faces(mesh, place)

    def keys(self, triangle: Index, places: Array) -> Index:
        """Numbers (n,) of the places of an element that points on triangles are in."""
        normal = self.normals[triangle]
        axis = np.argmax(np.abs(normal), axis=1)
        side = 2 * axis + (normal[np.arange(len(axis)), axis] > 0)
        # a hair inwards, so that a face on a border of the lattice is on one side of it
        inside = places - 1e-4 * self.place * normal
        cell = np.floor((inside - self._low) / self.place).astype(np.int64) + 1
        large, of_face = self._faces.cells(triangle, places)
        cell, side = np.where(large[:, None], of_face, cell), np.where(large, 7, side)
        out = self.mesh.element[triangle]
        for k in range(3):
            out = (out << _LATTICE) | np.clip(cell[:, k], 0, (1 << _LATTICE) - 1)
        return np.asarray(out << 3 | side)

    def element_of(self, keys: Index) -> Index:
        """Numbers (n,) of the elements of places."""
        return keys >> (3 * _LATTICE + 3)

    def surface(self) -> tuple[Index, Array]:
        """Places (k,) of the whole model, and how much of it they are [m^2]."""
        mesh, size = self.mesh, self.place / GATES.samples
        sides = mesh.triangles - np.roll(mesh.triangles, 1, axis=1)
        small = (np.linalg.norm(sides, axis=2) <= size).all(axis=1)
        one = np.flatnonzero(small)
        key = [self.keys(one, mesh.triangles[one].mean(axis=1))]
        area = [mesh.areas[one]]
        for number in np.unique(mesh.element[~small]):
            chosen = mesh.element == number
            for xyz, areas in covering_pieces(mesh.triangles[chosen & ~small], size):
                near = self.tree.nearest(xyz)
                mine = chosen[near.triangle]
                key.append(self.keys(near.triangle[mine], near.place[mine]))
                area.append(areas[mine])
        keys, place = np.unique(np.concatenate(key), return_inverse=True)
        covered = np.bincount(place.ravel(), np.concatenate(area), len(keys))
        return keys, covered.astype(np.float64)


class _Faces:
    """Flat faces that are larger than a place: each is divided evenly, along its own edges."""

    def __init__(self, mesh: Mesh, place: float) -> None:
        face = mesh.by_faces().element
        count = int(face.max()) + 1
        sums = [np.bincount(face, column, count) for column in mesh.across.T]
        normal = np.stack(sums, axis=1).astype(np.float64)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        lies = np.abs(normal[:, 2]) > 1 - 1e-9
        right = np.cross([0.0, 0.0, 1.0], np.where(lies[:, None], [0.0, 1.0, 0.0], normal))
        right /= np.linalg.norm(right, axis=1, keepdims=True)
        self._axes = np.stack([right, np.cross(normal, right)], axis=1)
        corners = np.einsum("tck,tak->tca", mesh.triangles - mesh.corners[0], self._axes[face])
        low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
        np.minimum.at(low, face, corners.min(axis=1))
        np.maximum.at(high, face, corners.max(axis=1))
        self._many = np.maximum(np.round((high - low) / place), 1.0)
        self._steps = np.maximum(high - low, 1e-300) / self._many
        self._low, self._origin, self._face = low, mesh.corners[0], face
        # numbers of faces within their elements
        element = np.zeros(count, dtype=np.int64)
        element[face] = mesh.element
        order = np.argsort(element, kind="stable")
        first = np.searchsorted(element[order], element[order])
        self._number = np.empty(count, dtype=np.int64)
        self._number[order] = np.arange(count) - first
        self._large = ((high - low) >= place).all(axis=1) & (self._number < 1 << _LATTICE)

    def cells(self, triangle: Index, places: Array) -> tuple[Mask, Index]:
        """Which places (n, 3) are of large faces, and the cells (n, 3) of these."""
        face = self._face[triangle]
        along = np.einsum("nk,nak->na", places - self._origin, self._axes[face]) - self._low[face]
        cell = np.clip(np.floor(along / self._steps[face]), 0, self._many[face] - 1)
        return self._large[face], np.column_stack([self._number[face], cell.astype(np.int64)])


class DesignSums:
    """Sums up points by place and distance, chunk by chunk; memory grows with the surface.

    Points beyond ``limit`` are of something else [m]. ``shared`` is the covariance of a shift and
    turn about ``middle``, where the user states it instead of a placement.
    """

    def __init__(
        self,
        design: Design,
        limit: float,
        placement: Placement | None = None,
        shared: Array | None = None,
        middle: Array | None = None,
    ) -> None:
        self.design, self.limit, self.placement = design, limit, placement
        self._stated, self._middle = shared, middle
        self.points, self.far, self.beyond = 0, 0, 0
        self._keys: Index = np.empty(0, dtype=np.int64)
        self._sums: Array = np.empty((0, _FIXED + len(self.covariance)))

    @property
    def covariance(self) -> Array:
        """Covariance of the errors that all points share; () if there are none."""
        if self.placement is None:
            return np.zeros((0, 0)) if self._stated is None else self._stated
        own, share = self.placement.covariance, self.placement.calibration
        k = 0 if share is None else len(share.own)
        out = np.zeros((8 + k, 8 + k))
        out[:6, :6] = own
        if share is not None:
            out[6 : 6 + k, 6 : 6 + k] = share.own
            out[:6, 6 : 6 + k], out[6 : 6 + k, :6] = share.cross, share.cross.T
        # the systematic part of the angles, at one sigma
        out[6 + k :, 6 + k :] = np.eye(2)
        return out

    @property
    def pose_known(self) -> bool:
        """True if what all points share is known."""
        return self.placement is not None or self._stated is not None

    def rows(self, xyz: Array, normal: Array) -> Array:
        """Derivatives (n, q) of distances along normals by what points share."""
        if self.placement is not None:
            both = [slopes(xyz, self.placement), angle_slopes(xyz, self.placement)]
            return np.asarray(np.einsum("ni,nij->nj", normal, np.concatenate(both, axis=2)))
        if self._stated is None or self._middle is None:
            return np.zeros((len(xyz), 0))
        return np.concatenate([normal, np.cross(xyz - self._middle, normal)], axis=1)

    def own_variance(self, xyz: Array, normal: Array) -> Array:
        """Variances (n,) of the distances by the noise of their points [m^2]; NaN if unknown."""
        place = self.placement
        if place is None or place.noise is None:
            return np.full(len(xyz), np.nan)
        beam = xyz - place.pose.translation
        length = np.linalg.norm(beam, axis=1)
        cosine = np.abs(np.einsum("ni,ni->n", beam, normal)) / np.maximum(length, 1e-9)
        along = place.noise.range_sigma(length)
        across = length * np.hypot(place.noise.horizontal, place.noise.vertical) / np.sqrt(2)
        across = np.hypot(across, place.noise.beam_diameter(length) / 4)
        return np.asarray((along * cosine) ** 2 + across**2 * (1 - cosine**2))

    def compared(self, xyz: Array) -> tuple[Mask, Index, Array]:
        """Which points (n,) are of a face, the triangles (n,) and signed distances (n,) [m]."""
        found = self.design.tree.nearest(xyz, self.limit)
        return self._parted(found)[1], found.triangle, found.signed

    @staticmethod
    def _parted(found: Nearest) -> tuple[Mask, Mask]:
        """Which points (n,) are near the model, and which of them above a face of it."""
        near = found.triangle >= 0
        # a point on a face has no way to it
        return near, near & ((found.facing >= GATES.along_cosine) | (np.abs(found.signed) < 1e-6))

    def add(self, xyz: Array) -> None:
        """Add points (n, 3) [m]."""
        xyz = xyz[np.isfinite(xyz).all(axis=1)]
        found = self.design.tree.nearest(xyz, self.limit)
        near, used = self._parted(found)
        self.points += len(xyz)
        self.far += int((~near).sum())
        self.beyond += int((near & ~used).sum())
        if not used.any():
            return
        triangle, d, x = found.triangle[used], found.signed[used], xyz[used]
        normal = self.design.normals[triangle]
        step = np.clip((d / self.limit + 1) * (GATES.steps / 2), 0, GATES.steps - 1)
        key = self.design.keys(triangle, found.place[used]) * GATES.steps + step.astype(np.int64)
        ones = np.ones(len(d))
        columns = np.column_stack(
            [ones, d, d**2, self.own_variance(x, normal), x, normal, self.rows(x, normal)]
        )
        self._merge(key, columns)

    def _merge(self, key: Index, columns: Array) -> None:
        """Add rows to the sums of their keys."""
        keys = np.concatenate([self._keys, key])
        self._keys, number = np.unique(keys, return_inverse=True)
        rows = np.concatenate([self._sums, columns])
        self._sums = np.stack(
            [np.bincount(number.ravel(), column, len(self._keys)) for column in rows.T], axis=1
        )

    def places(self) -> DesignPlaces:
        """Mean deviations of places with enough points, those of other things left out."""
        cell = self._keys // GATES.steps
        first = np.flatnonzero(np.diff(cell, prepend=-1))
        n = self._sums[:, 0]
        value = self._sums[:, 1] / n
        number = np.cumsum(np.diff(cell, prepend=-1) != 0) - 1
        total = np.add.reduceat(n, first) if len(first) else np.empty(0)
        passed = np.cumsum(n)
        before = passed[first] - n[first]
        low, middle, high = (
            value[np.minimum(np.searchsorted(passed, before + q * total), len(n) - 1)]
            for q in (0.16, 0.5, 0.84)
        )
        reach = np.maximum(GATES.outlying * (high - low) / 2, 4 * self.limit / GATES.steps)
        kept = np.abs(value - middle[number]) <= reach[number]
        sums = np.zeros((len(first), self._sums.shape[1]))
        np.add.at(sums, number[kept], self._sums[kept])
        enough = sums[:, 0] >= GATES.fewest_points
        sums, whole, keys = sums[enough], total[enough], cell[first][enough]
        count = sums[:, 0]
        mean = sums / count[:, None]
        scatter = np.maximum(mean[:, 2] - mean[:, 1] ** 2, 0.0) * count / (count - 1)
        own = np.where(np.isnan(mean[:, 3]), scatter, np.maximum(scatter, mean[:, 3]))
        own = own / self._independent(count, mean[:, 4:7], mean[:, 7:10])
        return DesignPlaces(
            self.design, keys, count, whole - count, mean[:, 1], own, scatter, mean[:, 4:7],
            mean[:, 7:10], mean[:, _FIXED:], self.covariance,
        )  # fmt: skip

    def _independent(self, count: Array, at: Array, normal: Array) -> Array:
        """How many of the points (m,) of places are independent."""
        place = self.placement
        if place is None or place.noise is None:
            return np.minimum(count, GATES.independent)
        beam = at - place.pose.translation
        length = np.linalg.norm(beam, axis=1)
        cosine = np.abs(np.einsum("ni,ni->n", beam, normal)) / np.maximum(length, 1e-9)
        disc = np.pi / 4 * place.noise.beam_diameter(length) ** 2 / np.maximum(cosine, 0.05)
        share = place.noise.shared_share
        return effective_number(count, self.design.place**2, disc, 1.0 if share is None else share)


@dataclass(frozen=True, eq=False)
class DesignPlaces:
    """Deviations of m places of a model."""

    design: Design
    keys: Index  #: (m,), numbers of the places
    #: (m,), points, and those that were left out
    count: Array
    left_out: Array
    #: (m,), mean deviations, positive outwards [m], and their variances by own noise [m^2]
    deviation: Array
    own: Array
    scatter: Array  #: (m,), variances of single points about the means [m^2]
    #: (m, 3), means of points [m], and of normals
    at: Array
    normal: Array
    #: (m, q), derivatives by what is shared, and its covariance (q, q)
    rows: Array
    shared: Array

    def of(self, element: int) -> DesignPlaces:
        """The places of an element."""
        mine = self.design.element_of(self.keys) == element
        return DesignPlaces(
            self.design, self.keys[mine], self.count[mine], self.left_out[mine],
            self.deviation[mine], self.own[mine], self.scatter[mine], self.at[mine],
            self.normal[mine], self.rows[mine], self.shared,
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.keys)

    @property
    def sigma(self) -> Array:
        """Sigmas (m,) of the deviations [m]."""
        shared = np.einsum("mi,ij,mj->m", self.rows, self.shared, self.rows)
        return np.asarray(np.sqrt(self.own + np.maximum(shared, 0.0)))

    def combined(self, weights: Array) -> tuple[Array, Array]:
        """Values (k,) and sigmas (k,) of sums of deviations with weights (k, m)."""
        rows = weights @ self.rows
        variance = np.einsum("ki,ij,kj->k", rows, self.shared, rows) + weights**2 @ self.own
        return weights @ self.deviation, np.sqrt(np.maximum(variance, 0.0))


def judge(places: DesignPlaces, limits: DeviationLimits, risk: float) -> tuple[Verdict, float]:
    """Verdict whether all seen places of an element are within limits, and guard factor of sigma.

    ``risk`` is the largest probability of either wrong verdict (method section 9.6).
    """
    if not len(places):
        return "not seen", float("nan")
    d, u = places.deviation, places.sigma
    inner = float(norm.ppf(1 - risk))
    if ((d + inner * u <= limits.upper) & (d - inner * u >= limits.lower)).all():
        return "within", inner
    outer = _largest(places, limits, risk)
    if ((d - outer * u > limits.upper) | (d + outer * u < limits.lower)).any():
        return "not within", outer
    return "cannot tell", outer


def _largest(places: DesignPlaces, limits: DeviationLimits, risk: float) -> float:
    """What the largest of the deviations over their sigmas exceeds with the risk."""
    m, u = len(places), places.sigma
    if m == 1:
        return float(norm.ppf(1 - risk))
    wide = limits.upper - limits.lower > GATES.wide_sigmas * 2 * float(u.max())
    if m > GATES.most_places:
        return float(norm.ppf(1 - risk / (m if wide else 2 * m)))
    rng = np.random.default_rng(m)
    values, vectors = np.linalg.eigh(places.shared) if len(places.shared) else (None, None)
    z = rng.normal(size=(GATES.draws, m)) * np.sqrt(places.own)
    if values is not None:
        half = places.rows @ (vectors * np.sqrt(np.maximum(values, 0.0)))
        z += rng.normal(size=(GATES.draws, half.shape[1])) @ half.T
    z /= u
    if wide:
        # each place passes the limit that is nearer to it
        middle = (limits.lower + limits.upper) / 2
        z = z * np.where(places.deviation >= middle, 1.0, -1.0)
    else:
        z = np.abs(z)
    # never less than of one place; the next larger draw, as there are so many only
    top = np.sort(z.max(axis=1))[min(int(np.ceil((1 - risk) * GATES.draws)), GATES.draws - 1)]
    return max(float(top), float(norm.ppf(1 - risk)))


def point_verdicts(d: Array, sigma: Array, lower: Array, upper: Array, risk: float) -> Index:
    """Verdicts (n,) on single points: 1 within, 2 not within, 0 cannot tell."""
    reach = float(norm.ppf(1 - risk)) * sigma
    out = np.zeros(len(d), dtype=np.int64)
    out[(d + reach <= upper) & (d - reach >= lower)] = 1
    out[(d - reach > upper) | (d + reach < lower)] = 2
    return out


@dataclass(frozen=True)
class ElementTable(Table):
    """Elements of a model as built; lengths in metres, slopes in metres per metre."""

    element: tuple[str, ...]
    #: within, not within, cannot tell, not seen; empty without a tolerance
    verdict: tuple[str, ...]
    #: limits of the deviation
    lower: Vector
    upper: Vector
    guard: Vector  #: factor of the sigma that the verdict took
    #: area [m^2], and the share of it that was seen
    area: Vector
    seen: Vector
    #: points, those that were left out as of other things, and places
    points: Vector
    left_out: Vector
    places: Vector
    #: mean deviation, positive outwards, with its sigma
    mean: Vector
    sigma: Vector
    #: smallest and largest deviation of a place, with the sigma of that place
    lowest: Vector
    lowest_sigma: Vector
    highest: Vector
    highest_sigma: Vector
    #: slope of a flat element against the model with its sigma: upwards of what stands, north of
    #: what lies; positive outwards at the upper, or the northern, end
    tilt: Vector
    tilt_sigma: Vector
    #: the same to the right, seen from outside, or east
    turn: Vector
    turn_sigma: Vector
    #: as-built inclination from the plumb line of a standing flat element, positive overhanging
    plumb: Vector
    flatness: Vector  #: deviations of places from the plane through them: largest less smallest


def element_table(
    sums: DesignSums, limits: Mapping[str, DeviationLimits], risk: float
) -> tuple[ElementTable, DesignPlaces]:
    """Deviations and verdicts of all elements, the worst first."""
    places = sums.places()
    keys, areas = sums.design.surface()
    element = sums.design.element_of(keys)
    seen = np.isin(keys, places.keys)
    rows = [
        _row(places.of(k), name, areas[element == k], seen[element == k], limits.get(name), risk)
        for k, name in enumerate(sums.design.mesh.names)
    ]
    if not sums.pose_known:
        told = {"within", "not within", "cannot tell"}
        rows = [row | ({"verdict": ""} if row["verdict"] in told else {}) for row in rows]
    rows.sort(key=_worst)
    columns: dict[str, Any] = {
        name: tuple(row[name] for row in rows)
        if name in ("element", "verdict")
        else np.array([row[name] for row in rows], dtype=float)
        for name in ElementTable.__annotations__
    }
    return ElementTable(**columns), places


def _worst(row: dict[str, Any]) -> tuple[int, float]:
    """Where a row stands: what is not within first, by how far it is off."""
    order = ("not within", "cannot tell", "within", "", "not seen")
    off = np.nanmax([abs(float(row["lowest"])), abs(float(row["highest"])), 0.0])
    return order.index(str(row["verdict"])), -float(off)


def _row(
    places: DesignPlaces,
    name: str,
    areas: Array,
    seen: Mask,
    limits: DeviationLimits | None,
    risk: float,
) -> dict[str, Any]:
    """One element."""
    nan = float("nan")
    row: dict[str, Any] = dict.fromkeys(ElementTable.__annotations__, nan)
    verdict, guard = ("", nan) if limits is None else judge(places, limits, risk)
    row |= {
        "element": name,
        "verdict": verdict if len(places) else "not seen",
        "guard": guard,
        "area": float(areas.sum()),
        "seen": float(areas[seen].sum() / areas.sum()) if areas.sum() else nan,
        "points": float(places.count.sum()),
        "left_out": float(places.left_out.sum()),
        "places": float(len(places)),
    }
    if limits is not None:
        row |= {"lower": limits.lower, "upper": limits.upper}
    if not len(places):
        return row
    d, u = places.deviation, places.sigma
    mean, sigma = places.combined(np.full((1, len(d)), 1 / len(d)))
    low, high = int(np.argmin(d)), int(np.argmax(d))
    row |= {
        "mean": mean[0], "sigma": sigma[0], "lowest": d[low], "lowest_sigma": u[low],
        "highest": d[high], "highest_sigma": u[high],
    }  # fmt: skip
    return row | _slopes(places)


def _slopes(places: DesignPlaces) -> dict[str, Any]:
    """Tilt, turn, plumb and flatness of a flat element; nothing of others."""
    normal = places.normal.mean(axis=0)
    length = float(np.linalg.norm(normal))
    normal = normal / max(length, 1e-12)
    if length < GATES.flat_cosine or len(places) < 4:
        return {}
    stands = abs(normal[2]) < GATES.standing
    up = np.array([0.0, 0.0, 1.0]) if stands else np.array([0.0, 1.0, 0.0])
    up = up - (up @ normal) * normal
    up /= np.linalg.norm(up)
    right = np.cross(up, normal) if stands else np.cross(up, np.array([0.0, 0.0, 1.0]))
    offset = places.at - places.at.mean(axis=0)
    design = np.column_stack([np.ones(len(places)), offset @ up, offset @ right])
    if np.linalg.matrix_rank(design, tol=0.1 * places.design.place) < 3:
        return {}
    solve = np.linalg.pinv(design)
    value, sigma = places.combined(solve)
    rest = places.deviation - design @ value
    out: dict[str, Any] = {
        "tilt": value[1], "tilt_sigma": sigma[1], "turn": value[2], "turn_sigma": sigma[2],
        "flatness": float(np.ptp(rest)),
    }  # fmt: skip
    if stands:
        # an outward normal that points down overhangs
        out["plumb"] = float(value[1] - normal[2] / np.hypot(normal[0], normal[1]))
    return out
