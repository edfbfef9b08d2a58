"""Motions of rigid parts between two clouds, from distances along normals, with their covariance.

A part that moves as one body by q = (q_t, q_r) about its middle changes the distance along the
normal n at X by ``a q`` with ``a = [n ; (X - X_0) x n]`` (method section 12.8). Each distance has
an error of its own, from the points of its cylinders, and what the stations of both clouds do to
all points alike, ``r e`` with the joint covariance S of both:

    L = A q + R e + v,      q = G L,      G = (A^T W A)^+ A^T W
    C = f (A^T W A)^+ + (G R) S (G R)^T + systematic angles

The stations move the part as a rigid body too, so that these weights are those of the joint
covariance. Motions that leave every distance as it was (those of a plane in itself) are not seen,
and are said to be so. Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tribrach._types import Array, Index, Mask
from tribrach.answers import Matrix, Number, Result, Vector
from tribrach.cloud.shared_part import angle_slopes
from tribrach.comparison.m3c2_ep import M3C2EP
from tribrach.comparison.predicted import multiplicity
from tribrach.comparison.station_pair import StationPair, along_normals
from tribrach.statistics import MAD_TO_SIGMA, chi2

#: a motion that the distances show less than this share of the best seen one is not seen: normals
#: of a flat surface scatter by some degrees at its edges
UNSEEN = 0.05
#: distances further off than so many of their sigmas are no part of the body
_OFF = 3.5
#: fewer distances carry no motion
FEWEST = 4
#: a face whose normal is as near to the vertical lies [cosine]
_LYING = 0.9
#: a component is seen if no more than this share of it is in motions that are not
_WITHIN = 0.1

#: motions of a part in the frame of its face: along the normal, along the face to the right as
#: seen from outside and upwards (east and north on the ground); how far the upper and the right
#: end go outwards per metre; the turn within the face
COMPONENTS = ("out", "right", "up", "tilt", "turn", "spin")


@dataclass(frozen=True, eq=False)
class PlaceDistances:
    """Distances of a later cloud from an earlier one at m places."""

    #: (m, 3), where they hold [m], and unit normals
    core: Array
    normals: Array
    #: (m,), distances and their sigmas from points alone, neighbours in common included [m]
    values: Array
    sigma: Array
    site: Index  #: (m,), number of the site of each
    pair: StationPair  #: the stations of both clouds

    def __len__(self) -> int:
        return len(self.values)

    def some(self, rows: Index | Mask) -> PlaceDistances:
        """The distances of some rows or flags."""
        return PlaceDistances(
            self.core[rows],
            self.normals[rows],
            self.values[rows],
            self.sigma[rows],
            self.site[rows],
            self.pair,
        )

    @cached_property
    def by_stations(self) -> Array:
        """Derivatives (m, 12 + k) of the distances by the unknowns of both stations."""
        moved = self.pair.displacements(self.core)
        out: Array = np.einsum("mi,mij->mj", self.normals, moved)
        return out

    @cached_property
    def by_angles(self) -> Array:
        """Effect (m, 2 for each side) of one sigma of systematic angles on the distances."""
        sides = [angle_slopes(self.core, side.placement) for side in self.pair.sides or ()]
        if not sides:
            return np.zeros((len(self), 0))
        out: Array = np.einsum("mi,mik->mk", self.normals, np.concatenate(sides, axis=2))
        return out


def distances_of(
    found: M3C2EP, pair: StationPair, diameter: float, rows: Mask, site: int = 0
) -> PlaceDistances:
    """Distances as observations of motions; cylinders that share points count for less."""
    core, normals = found.core[rows], found.normals.vectors[rows]
    # where the points of the later cloud are: at borders they lie to one side of the axis
    places = found.second.place[rows]
    shared = multiplicity(core, normals, diameter) if len(core) else 1.0
    sigma = np.sqrt(max(shared, 1.0)) * found.sigma_random[rows]
    number: Index = np.full(len(core), site, dtype=np.int64)
    return PlaceDistances(places, normals, found.distance[rows], sigma, number, pair)


@dataclass(frozen=True)
class Components(Result):
    """A motion in the frame of the face; null for what the distances do not show."""

    out: Number  #: along the normal, which looks towards the scanner of B [m]
    #: along the face, to the right as seen from outside and upwards (east and north of ground) [m]
    right: Number
    up: Number
    tilt: Number  #: how much further out the upper (northern) end is, per metre [m/m]
    turn: Number  #: the same of the right (eastern) end [m/m]
    spin: Number  #: about the normal [rad]


@dataclass(frozen=True, eq=False)
class PartMotion(
    Result,
    without=(
        *("kept", "misfit", "redundancy", "values", "seen", "parameters", "cofactor", "gain"),
        *("own", "basis", "lever", "solver"),
    ),
    also=("distances", "left_out", "statistic", "dof", "components", "unseen"),
):
    """A motion as one body, at its middle."""

    #: middle [m] and mean normal
    middle: Vector
    normal: Vector
    kept: Mask  #: distances (m,) that go along with each other; the others are not used
    #: ``v^T W v`` of those used, and redundancy
    misfit: float
    redundancy: int
    values: Array  #: the :data:`COMPONENTS` (6,) [m, rad]; NaN where they are not seen
    covariance: Matrix  #: of the components in their order
    seen: Mask  #: which of them the distances show (6,)
    #: the motion in the r directions that are seen (r,), all in metres, and their covariance
    parameters: Array
    cofactor: Array
    gain: Array  #: what the unknowns of both stations do to them (r, 12 + k)
    own: Array  #: the part of their covariance that is not of the stations (r, r)
    basis: Array  #: these directions among the scaled components (6, r)
    lever: float  #: length that turns are scaled by [m]
    solver: Array  #: what each distance does to them (r, count)

    @property
    def distances(self) -> int:
        """Distances used."""
        return int(self.kept.sum())

    @property
    def left_out(self) -> int:
        """Distances that do not go along with the others."""
        return int((~self.kept).sum())

    @cached_property
    def statistic(self) -> float:
        """``p^T C^-1 p``; chi-square with as many degrees of freedom as motions are seen."""
        return float(self.parameters @ np.linalg.solve(self.cofactor, self.parameters))

    @property
    def dof(self) -> int:
        """Motions that are seen: degrees of freedom of the statistic."""
        return len(self.parameters)

    @property
    def components(self) -> Components:
        """In the frame of the face."""
        return Components(*self.values.tolist())

    @property
    def unseen(self) -> list[str]:
        """Components that the distances do not show."""
        return [name for name, seen in zip(COMPONENTS, self.seen, strict=True) if not seen]

    def columns(self, part: PlaceDistances) -> Array:
        """Derivatives (m, 6) of distances by the scaled components."""
        rows = components(part.core, part.normals, self.middle, face_axes(self.normal))
        out: Array = rows * _scale(self.lever)
        return out

    def moves(self, part: PlaceDistances) -> Array:
        """Derivatives (m, r) of distances by the motions that are seen."""
        out: Array = self.columns(part) @ self.basis
        return out

    def in_words(self, parameters: Array, cofactor: Array) -> tuple[Array, Array]:
        """Components (6,) and their covariance (6, 6) from what is seen; NaN for what is not."""
        by = _scale(self.lever)[:, None] * self.basis
        whole = by @ cofactor @ by.T
        values = np.where(self.seen, by @ parameters, np.nan)
        return values, np.where(np.outer(self.seen, self.seen), whole, np.nan)

    def limit(self, alpha: float) -> float:
        """Limit of the statistic."""
        return float(chi2.ppf(1 - alpha, self.dof))

    def detectable(self, alpha: float, power: float) -> float:
        """Shift outwards [m] that would have been found with this power."""
        shift = np.zeros(6)
        shift[0] = 1.0
        direction = self.basis.T @ shift
        weight = float(direction @ np.linalg.solve(self.cofactor, direction))
        needed = float(chi2.noncentrality(self.limit(alpha), self.dof, power))
        return float(np.sqrt(needed / weight)) if weight > 0 else float("inf")


def face_axes(normal: Array) -> Array:
    """Normal, right from outside, up (3, 3) of a face; east and north for one that lies."""
    if abs(normal[2]) > _LYING:
        right = np.array([1.0, 0.0, 0.0]) - normal[0] * normal
    else:
        right = np.cross([0.0, 0.0, 1.0], normal)
    right = right / np.linalg.norm(right)
    up = np.cross(normal, right)
    if abs(normal[2]) > _LYING and up[1] < 0:
        up = -up
    return np.stack([normal, right, up])


def components(core: Array, normals: Array, middle: Array, axes: Array) -> Array:
    """Derivatives (m, 6) of distances along normals by the :data:`COMPONENTS` of a part.

    The tilt carries a place a metre further up outwards by a metre per metre, the turn one a metre
    further to the right.
    """
    out, right, up = axes
    turns = np.stack([np.cross(up, out), np.cross(right, out), out])
    rows = along_normals(core, normals, middle)
    moves: Array = np.concatenate([rows[:, :3] @ axes.T, rows[:, 3:] @ turns.T], axis=1)
    return moves


def part_motion(part: PlaceDistances, factor: float = 1.0) -> PartMotion | None:
    """The motion of a part, robust against distances that are not on it (method section 12.8)."""
    kept = _kept(part, factor)
    found = None if kept is None else _fitted(part.some(kept), factor)
    return None if kept is None or found is None else replace(found, kept=kept)


def _kept(part: PlaceDistances, factor: float) -> Mask | None:
    """Which distances (m,) go along with the others; None if too few do."""
    kept = np.ones(len(part), dtype=bool)
    for _ in range(10):
        motion = _fitted(part.some(kept), factor)
        if motion is None:
            return None
        v = part.values - motion.moves(part) @ motion.parameters
        spread = MAD_TO_SIGMA * float(np.median(np.abs(v[kept]) / part.sigma[kept]))
        off = np.abs(v) > _OFF * max(spread, np.sqrt(factor)) * part.sigma
        if (off == ~kept).all():
            break
        if (~off).sum() < FEWEST:
            return None
        kept = ~off
    return kept


def relative_motion(
    part: PlaceDistances, motion: PartMotion, stable: PartMotion
) -> PartMotion | None:
    """Motion of a part against one that is taken as still (section 12.8); stations cancel."""
    some = part.some(motion.kept)
    hidden = np.eye(6) - stable.basis @ stable.basis.T
    needed = stable.columns(some) @ hidden
    if np.linalg.norm(motion.solver @ needed, axis=1).max() > _WITHIN:
        return None
    carried = motion.solver @ stable.moves(some)
    gain = motion.gain - carried @ stable.gain
    own = motion.own + carried @ stable.own @ carried.T
    cofactor = own + gain @ some.pair.covariance @ gain.T
    cofactor = (cofactor + cofactor.T) / 2
    p = motion.parameters - carried @ stable.parameters
    values, spread = motion.in_words(p, cofactor)
    return replace(
        motion,
        values=values,
        covariance=spread,
        parameters=p,
        cofactor=cofactor,
        gain=gain,
        own=own,
    )


def _fitted(part: PlaceDistances, factor: float) -> PartMotion | None:
    """Least squares of one part."""
    if len(part) < FEWEST:
        return None
    weight = 1.0 / part.sigma**2
    middle = np.average(part.core, axis=0, weights=weight)
    normal = np.average(part.normals, axis=0, weights=weight)
    if np.linalg.norm(normal) < 0.5:
        # faces that look away from each other have no common outside: that of most of them
        moment = (part.normals * weight[:, None]).T @ part.normals
        normal = np.linalg.eigh(moment)[1][:, -1]
        normal = normal * (np.sign(normal[np.argmax(np.abs(normal))]) or 1.0)
    normal = normal / np.linalg.norm(normal)
    axes = face_axes(normal)
    lever = float(np.sqrt(((part.core - middle) ** 2).sum(axis=1).mean())) or 1.0
    moves = components(part.core, part.normals, middle, axes) * _scale(lever)
    root = np.sqrt(weight)
    _, size, right = np.linalg.svd(moves * root[:, None], full_matrices=False)
    rank = int((size > UNSEEN * size[0]).sum())
    if len(part) < rank + 1:
        return None
    basis = right[:rank].T
    projected = moves @ basis
    inverse = np.linalg.inv(projected.T @ (weight[:, None] * projected))
    solver = inverse @ (projected * weight[:, None]).T
    p = solver @ part.values
    v = part.values - projected @ p
    gain = solver @ part.by_stations
    own = factor * inverse + _angles(solver, part.by_angles)
    cofactor = own + gain @ part.pair.covariance @ gain.T
    hidden = np.eye(6) - basis @ basis.T
    empty = np.full(6, np.nan)
    motion = PartMotion(
        middle=middle,
        normal=normal,
        kept=np.ones(len(part), dtype=bool),
        misfit=float(weight @ v**2),
        redundancy=len(part) - rank,
        values=empty,
        covariance=np.full((6, 6), np.nan),
        seen=np.linalg.norm(hidden, axis=0) <= _WITHIN,
        parameters=p,
        cofactor=(cofactor + cofactor.T) / 2,
        gain=gain,
        own=(own + own.T) / 2,
        basis=basis,
        lever=lever,
        solver=solver,
    )
    values, spread = motion.in_words(p, motion.cofactor)
    return replace(motion, values=values, covariance=spread)


def _scale(lever: float) -> Array:
    """What turns scaled to metres are in radians; shifts stay (6,)."""
    return np.array([1, 1, 1, 1 / lever, 1 / lever, 1 / lever])


def _angles(gain: Array, slopes: Array) -> Array:
    """What systematic angles add to the covariance (r, r): bounds of method section 5.10."""
    bound = np.zeros(len(gain))
    for column in slopes.T:
        moved = gain * column
        bound += np.maximum(moved, 0.0).sum(axis=1) ** 2 + np.minimum(moved, 0.0).sum(axis=1) ** 2
    out: Array = np.diag(bound)
    return out
