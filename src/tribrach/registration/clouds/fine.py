"""Aligns one scan with another from an approximate pose, point to plane.

The mean of every surfel is compared with the plane of the nearest one of the other scan, both ways
(Chen and Medioni 1992), or with its round surface where residuals are small enough for that to
matter (method section 2.11). Residuals are weighted by what is known of them and by Tukey's loss
with the gate as its limit; the gate shrinks from 0.2 over 0.05 to 0.015 m, or to 4.5 sigmas of the
residuals where that is more. Directions that the surfaces do not hold are not corrected. Metres and
radians; X_a = T X_b, corrections are turns about and shifts of the middle of the overlap.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pykdtree.kdtree import KDTree
from scipy.linalg import eigh

from tribrach._types import Array, Index
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp
from tribrach.kernels import njit
from tribrach.registration.clouds.surfels import FLAT, ROUND, Surfels
from tribrach.statistics import robust_sigma


@dataclass(frozen=True)
class FineAlignmentGates:
    """How surfels of two scans are matched and fitted (by hand: benchmarks/registration)."""

    #: limits of the residuals, one after the other [m]
    gates_m: tuple[float, ...] = (0.2, 0.05, 0.015)
    #: the last gate is never below this many sigmas of the residuals; a gate is so many sigmas
    gate_sigmas: float = 4.5
    most_steps: int = 20  #: steps at one gate, at most
    settled_m: float = 2e-6  #: smaller steps end a gate [m at the mean lever]
    #: surfels of either scan that are looked up before the last gate: bounds the time
    some_surfels: int = 15_000
    #: matches are looked up again when surfels have moved by this share of their size ...
    moved_sizes: float = 0.05
    gate_shrinks: float = 0.5  #: ... or the gate has shrunk to less than this share
    #: the turn moves the surfel at this quantile of the distances of a scan
    reach_quantile: float = 0.8
    alike_cosine: float = 0.8  #: normals of matches differ by less than this [cosine]
    reach_sizes: float = 1.0  #: a match is no further along the surface than this many sizes
    #: error of single surfels that no scatter tells (waves of surfaces, shares of beams) [m]
    surface_m: float = 5e-4
    rough_share: float = 0.1  #: share of their roughness that does not average out
    #: directions with less than this share of the largest eigenvalue are not moved
    held_share: float = 1e-4
    #: surfels of unknown form take no part where forms matter if the others hold every direction
    #: by at least this share of what holds it
    known_share: float = 0.1
    fewest_matches: int = 10  #: fewer matches make no step


FINE = FineAlignmentGates()


@dataclass(frozen=True, eq=False)
class Indexed:
    """Surfels with their search tree."""

    surfels: Surfels  #: the surfels
    tree: KDTree  #: tree of their means

    @classmethod
    def of(cls, surfels: Surfels) -> Indexed:
        """Build the tree of some surfels."""
        return cls(surfels, KDTree(np.ascontiguousarray(surfels.center), leafsize=16))


@dataclass(frozen=True, eq=False)
class Matches:
    """Matched surfels of two scans a and b, both ways, in the frame of a."""

    first: Index  #: (n,), numbers of the surfels of a
    second: Index  #: (n,), numbers of the surfels of b
    forward: NDArray[np.bool_]  #: (n,), true where the plane is that of a
    point: Array  #: (n, 3), means that are compared with the planes [m]
    normal: Array  #: (n, 3), unit normals of the planes
    residual: Array  #: (n,), distances of the points from the planes [m]
    sigma: Array  #: (n,), sigmas of the residuals [m]

    def __len__(self) -> int:
        return len(self.residual)

    @property
    def about(self) -> tuple[Array, float]:
        """Middle (3,) and lever: what turns are about, and multiplied by [m]."""
        middle = self.point.mean(axis=0)
        return middle, float(np.sqrt(((self.point - middle) ** 2).sum(axis=1).mean()))

    def design(self, about: tuple[Array, float]) -> Array:
        """What a shift of a middle and a turn about it [m] do to the residuals (n, 6)."""
        arm = (self.point - about[0]) / about[1]
        return np.concatenate([self.normal, np.cross(arm, self.normal)], axis=1)

    def subset(self, chosen: NDArray[np.bool_]) -> Matches:
        """Some of the matches."""
        columns = (self.first, self.second, self.forward, self.point, self.normal)
        return Matches(*(c[chosen] for c in (*columns, self.residual, self.sigma)))  # type: ignore[arg-type]


def displaced(pose: Pose, by: Array, about: tuple[Array, float]) -> Pose:
    """A pose after a shift of the middle and a turn about it (6,) [m]."""
    middle, lever = about
    turn = exp(by[3:] / lever)
    return Pose(turn @ pose.rotation, turn @ (pose.translation - middle) + middle + by[:3])


@dataclass(frozen=True, eq=False)
class FineAlignment:
    """An alignment of scan b with scan a."""

    pose: Pose  #: pose of b in a
    matches: Matches  #: matches within the last gate
    gate: float  #: the last gate [m]
    settled: bool  #: true if the iteration settled

    @property
    def rms(self) -> float:
        """Root mean square of the residuals within the gate [m]; NaN without any."""
        r = self.matches.residual
        return float(np.sqrt((r**2).mean())) if len(r) else float("nan")


def align(
    a: Indexed,
    b: Indexed,
    start: Pose,
    gates: Sequence[float] = FINE.gates_m,
    steps: int = FINE.most_steps,
) -> FineAlignment:
    """Move scan b onto scan a from a start within the first of ``gates`` [m], round after round."""
    pose, settled = start, False
    pairs = _Pairs(a, b)
    spread = np.inf
    for number, gate in enumerate(gates):
        least = gate
        gate = max(gate, FINE.gate_sigmas * spread if np.isfinite(spread) else 0.0)
        settled = False
        # until the last gate some surfels will do
        pairs.most = FINE.some_surfels if number < len(gates) - 1 else None
        if number == len(gates) - 1 and pairs.take_forms(pose, gate, least):
            gate = least
        for _ in range(steps):
            pairs.look_up(pose, gate)
            pose, size, spread = _step(pairs, pose, gate)
            if size < FINE.settled_m:
                settled = True
                break
    gate = max(gates[-1], FINE.gate_sigmas * spread if np.isfinite(spread) else 0.0)
    pairs.most = None
    pairs.look_up(pose, gate, anew=True)
    matches = pairs.matches(pose)
    return FineAlignment(pose, matches.subset(np.abs(matches.residual) < gate), gate, settled)


def matched(a: Indexed, b: Indexed, pose: Pose, gate: float) -> Matches:
    """Match two scans as they lie."""
    pairs = _Pairs(a, b)
    pairs.take_forms(pose, gate, FINE.gates_m[-1])
    pairs.look_up(pose, gate, anew=True)
    matches = pairs.matches(pose)
    return matches.subset(np.abs(matches.residual) < gate)


class _Forms(Enum):
    """How surfels are compared."""

    #: all of them as planes
    PLANES = auto()
    #: round ones with their surfaces
    ROUND = auto()
    #: the same, without those of unknown form
    KNOWN = auto()


class _Pairs:
    """Which surfels are compared, as long as the pose does not change much."""

    def __init__(self, a: Indexed, b: Indexed) -> None:
        self.a, self.b = a, b
        self.first = np.empty(0, dtype=np.int64)
        self.second = np.empty(0, dtype=np.int64)
        self.forward = np.empty(0, dtype=bool)
        self.most: int | None = None
        self._pose: Pose | None = None
        self._gate = np.inf
        self._looked: int | None = None
        self._forms = _Forms.PLANES
        self._columns = [_columns(x.surfels, self._forms) for x in (a, b)]
        self._small = float(min(np.median(x.surfels.size) for x in (a, b)))
        self._reach = float(
            np.linalg.norm(np.quantile(np.abs(b.surfels.center), FINE.reach_quantile, axis=0))
        )

    def take_forms(self, pose: Pose, gate: float, least: float) -> bool:
        """Compare with round surfaces from now on if residuals are small enough; True if they are.

        ``gate`` is the one that residuals from planes need, ``least`` the least one [m].

        A piece of a trunk bends by millimetres. That matters where residuals are smaller; in coarse
        scans it does not, and their forms are not known well. Surfels of unknown form may be pieces
        of trunks as well: they are left out if what is left holds the pose.
        """
        if not any((x.surfels.form != FLAT).any() for x in (self.a, self.b)):
            return False
        self._set(_Forms.ROUND)
        self.look_up(pose, gate)
        m = self.matches(pose)
        inside = np.abs(m.residual) < gate
        if inside.sum() < FINE.fewest_matches or (
            FINE.gate_sigmas * robust_sigma(m.residual[inside], about=0.0) > least
        ):
            self._set(_Forms.PLANES)
            return False
        m = m.subset(inside)
        first, second = self.a.surfels.form[m.first], self.b.surfels.form[m.second]
        surface = np.where(m.forward, first, second)
        known = (surface == ROUND) | ((first == FLAT) & (second == FLAT))
        if _hold(m, known):
            self._set(_Forms.KNOWN)
        return True

    def _set(self, forms: _Forms) -> None:
        """Change how surfels are compared."""
        self._forms, self._pose = forms, None
        self._columns = [_columns(x.surfels, forms) for x in (self.a, self.b)]

    def look_up(self, pose: Pose, gate: float, anew: bool = False) -> None:
        """Nearest surfels both ways, where they are not known well enough."""
        known = self._pose is not None and self._looked == self.most
        if not anew and self._pose is not None and known and gate >= FINE.gate_shrinks * self._gate:
            moved = self._pose.inverse @ pose
            turn = np.linalg.norm(moved.rotation - np.eye(3)) / np.sqrt(2)
            far = float(np.linalg.norm(moved.translation) + turn * self._reach)
            if far < FINE.moved_sizes * self._small:
                return
        self._pose, self._gate, self._looked = pose, gate, self.most
        i, one = self._nearest(self.a, self.b.surfels, pose, gate)
        j, two = self._nearest(self.b, self.a.surfels, pose.inverse, gate)
        self.first = np.concatenate([one, j])
        self.second = np.concatenate([i, two])
        self.forward = np.concatenate([np.ones(len(i), dtype=bool), np.zeros(len(j), dtype=bool)])

    def _nearest(
        self, reference: Indexed, surfels: Surfels, pose: Pose, gate: float
    ) -> tuple[Index, Index]:
        """Surfels (k,) that have a match in the reference, and their matches (k,)."""
        if self.most is None or len(surfels) <= self.most:
            nearest = _nearest(reference, surfels, pose, gate, self._forms)
            return np.flatnonzero(nearest >= 0), nearest[nearest >= 0]
        some = np.linspace(0, len(surfels) - 1, self.most).astype(np.int64)
        nearest = _nearest(reference, surfels.subset(some), pose, gate, self._forms)
        return some[nearest >= 0], nearest[nearest >= 0]

    def matches(self, pose: Pose) -> Matches:
        """The comparison at a pose."""
        table = _compared(
            self._columns[0],
            self._columns[1],
            (self.first, self.second, self.forward),
            (pose.rotation, pose.translation),
        )
        return Matches(
            self.first,
            self.second,
            self.forward,
            table[:, :3],
            table[:, 3:6],
            table[:, 6],
            table[:, 7],
        )


def _sigma(s: Surfels) -> Array:
    """Sigma (n,) of the mean of surfels along the normal [m]."""
    return np.asarray(
        np.sqrt(s.sigma_offset**2 + (FINE.rough_share * s.thickness) ** 2 + FINE.surface_m**2)
    )


def _columns(s: Surfels, forms: _Forms) -> tuple[NDArray[Any], ...]:
    """Compared attributes of surfels: mean, normal, their sigmas, form, bend, spread."""
    if forms is _Forms.PLANES:
        normal, form = s.normal, np.full(len(s), FLAT, dtype=np.int8)
    else:
        normal, form = s.gradient, s.form
    return s.center, normal, _sigma(s), s.sigma_normal, form, s.bend, s.spread


def _hold(m: Matches, some: NDArray[np.bool_]) -> bool:
    """True if some of the matches (n,) hold what all of them do, by a share of it."""
    if some.sum() < FINE.fewest_matches:
        return False
    middle, lever = m.about
    whole, part = (
        _normal(m.point, m.normal, m.residual, weight.astype(float), middle, lever)[0]
        for weight in (np.ones(len(m)), some)
    )
    # what nothing holds is held by no share of it
    loose = FINE.held_share * float(np.linalg.eigvalsh(whole)[-1]) * np.eye(6)
    share = eigh(part + FINE.known_share * loose, whole + loose, eigvals_only=True)
    return bool(share[0] >= FINE.known_share)


def _nearest(reference: Indexed, surfels: Surfels, pose: Pose, gate: float, forms: _Forms) -> Index:
    """Index (n,) of the nearest surfel of the reference with a like normal, -1 without one."""
    moved, normal = pose @ surfels.center, surfels.normal @ pose.rotation.T
    limit = float(
        np.hypot(gate, FINE.reach_sizes * max(surfels.size.max(), reference.surfels.size.max()))
    )
    far, nearest = reference.tree.query(
        np.ascontiguousarray(moved), distance_upper_bound=limit, sqr_dists=False
    )
    index = np.where(np.isfinite(far), nearest, 0).astype(np.int64)
    other = reference.surfels
    cosine = np.einsum("ni,ni->n", normal, other.normal[index])
    alike = surfels.facing(other, cosine) > FINE.alike_cosine
    if forms is not _Forms.PLANES:
        # any points on a round body agree with its surface, those of no round one with a plane
        one, two = other.form[index], surfels.form
        flat = (one == FLAT) & (two == FLAT) if forms is _Forms.KNOWN else two != ROUND
        alike &= (one == ROUND) | flat
    reach = np.hypot(gate, FINE.reach_sizes * np.maximum(surfels.size, other.size[index]))
    return np.where(np.isfinite(far) & alike & (far < reach), index, -1)


@njit(cache=True, nogil=True)
def _compared(s, t, pairs, pose):  # type: ignore[no-untyped-def]
    """Point, normal, residual and its sigma (n, 8) of each match, in the frame of a."""
    first, second, forward = pairs
    r, shift = pose
    out = np.empty((len(first), 8))
    p = np.empty(3)
    off = np.empty(3)
    normal = np.empty(3)
    bend, spread = np.empty((3, 3)), np.empty((3, 3))
    for n in range(len(first)):
        i, j = first[n], second[n]
        c, m = t[0][j], t[1][j]
        residual, square = 0.0, 0.0
        for k in range(3):
            p[k] = r[k, 0] * c[0] + r[k, 1] * c[1] + r[k, 2] * c[2] + shift[k]
            if forward[n]:
                normal[k] = s[1][i, k]
            else:
                normal[k] = r[k, 0] * m[0] + r[k, 1] * m[1] + r[k, 2] * m[2]
            off[k] = p[k] - s[0][i, k]
            residual += normal[k] * off[k]
            square += off[k] * off[k]
            out[n, k] = p[k] if forward[n] else s[0][i, k]
        tilt = s[3][i] if forward[n] else t[3][j]
        if (s[4][i] if forward[n] else t[4][j]) != ROUND:
            # both ends of a chord of a round body lie on a line across the mean of their normals
            residual = _across_mean(r, s[1][i], t[1][j], off, normal)
            tilt = 0.5 * np.hypot(s[3][i], t[3][j])
        beside = max(square - residual * residual, 0.0)
        if forward[n] and s[4][i] == ROUND:
            _turned(r, t[6][j], spread)
            residual = _from_round(residual, 1.0, s[5][i], s[6][i], spread, off, normal)
        elif not forward[n] and t[4][j] == ROUND:
            _turned(r, t[5][j], bend)
            _turned(r, t[6][j], spread)
            residual = _from_round(residual, -1.0, bend, spread, s[6][i], off, normal)
        out[n, 3:6] = normal
        out[n, 6] = residual
        # the weaker axis of the plane counts by half: the point lies anywhere around its middle
        out[n, 7] = np.sqrt(s[2][i] ** 2 + t[2][j] ** 2 + 0.5 * beside * tilt**2)
    return out


@njit(cache=True, nogil=True)
def _across_mean(r, one, two, off, normal):  # type: ignore[no-untyped-def]
    """Distance along the mean of two normals, the second in b; the normal becomes that mean."""
    cosine, square, residual = 0.0, 0.0, 0.0
    for k in range(3):
        normal[k] = r[k, 0] * two[0] + r[k, 1] * two[1] + r[k, 2] * two[2]
        cosine += one[k] * normal[k]
    sign = 1.0 if cosine >= 0 else -1.0
    for k in range(3):
        normal[k] = one[k] + sign * normal[k]
        square += normal[k] * normal[k]
    length = max(np.sqrt(square), 1e-12)
    for k in range(3):
        normal[k] /= length
        residual += normal[k] * off[k]
    return residual


@njit(cache=True, nogil=True)
def _from_round(plane, sign, bend, own, other, off, normal):  # type: ignore[no-untyped-def]
    """Distance from a round surface for that from its plane; the normal turns to the gradient.

    Means of points lie behind the surface by their sagittas, which their spreads tell. The sign is
    negative where the other point is that of a, and ``off`` leads from it.
    """
    twice, sagitta, square = 0.0, 0.0, 0.0
    for k in range(3):
        along = 0.0
        for m in range(3):
            along += bend[k, m] * off[m]
            sagitta += bend[k, m] * (other[k, m] - own[k, m])
        twice += along * off[k]
        normal[k] += sign * along
        square += normal[k] * normal[k]
    length = np.sqrt(square)
    for k in range(3):
        normal[k] /= length
    return (plane + sign * 0.5 * (twice + sagitta)) / length


@njit(cache=True, nogil=True)
def _turned(r, matrix, out):  # type: ignore[no-untyped-def]
    """``r matrix r^T``."""
    for a in range(3):
        for b in range(3):
            out[a, b] = 0.0
            for c in range(3):
                for d in range(3):
                    out[a, b] += r[a, c] * matrix[c, d] * r[b, d]


def _step(pairs: _Pairs, pose: Pose, gate: float) -> tuple[Pose, float, float]:
    """One step; the pose, its size [m] and the robust sigma of the residuals within the gate."""
    m = pairs.matches(pose)
    inside = np.abs(m.residual) < gate
    if inside.sum() < FINE.fewest_matches:
        return pose, 0.0, np.inf
    spread = robust_sigma(m.residual[inside], about=0.0)
    middle = m.point[inside].mean(axis=0)
    lever = float(np.sqrt(((m.point[inside] - middle) ** 2).sum(axis=1).mean()))
    weight = np.where(inside, (1 - (m.residual / gate) ** 2) ** 2, 0.0)
    weight /= m.sigma**2 + (gate / FINE.gate_sigmas) ** 2
    normal, right = _normal(m.point, m.normal, m.residual, weight, middle, lever)
    values, vectors = np.linalg.eigh(normal)
    held = values > FINE.held_share * values[-1]
    part = vectors[:, held]
    step = part @ ((part.T @ right) / values[held])
    return displaced(pose, step, (middle, lever)), float(np.linalg.norm(step)), spread


@njit(cache=True, nogil=True)
def _normal(point, normal, residual, weight, middle, lever):  # type: ignore[no-untyped-def]
    """Normal matrix (6, 6) and right side (6,), turns in metres at the lever."""
    out, right = np.zeros((6, 6)), np.zeros(6)
    a = np.empty(6)
    for n in range(len(point)):
        w = weight[n]
        if w <= 0.0:
            continue
        x = (point[n, 0] - middle[0]) / lever
        y = (point[n, 1] - middle[1]) / lever
        z = (point[n, 2] - middle[2]) / lever
        a[0], a[1], a[2] = normal[n, 0], normal[n, 1], normal[n, 2]
        a[3] = y * a[2] - z * a[1]
        a[4] = z * a[0] - x * a[2]
        a[5] = x * a[1] - y * a[0]
        for i in range(6):
            right[i] -= w * a[i] * residual[n]
            for j in range(i, 6):
                out[i, j] += w * a[i] * a[j]
    for i in range(6):
        for j in range(i):
            out[i, j] = out[j, i]
    return out, right
