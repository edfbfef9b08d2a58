"""Makes surfels of a scan: pieces of surface, each the mean and the plane of a cube of points.

The normal is the direction of least spread of the points in the cube, towards the scanner. Cubes
with too few points for a plane, or rough ones, are joined into cubes of twice the size, up to 8 or
16 times; what is no plane then (edges, leaves) is left out. All points of a scan take part, so that
its noise is averaged; errors that neighbours share remain and are accounted for in
:mod:`~tribrach.registration.clouds.relative_covariance`. Scanner frame, metres.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.geometry.pose import Pose
from tribrach.kernels import in_threads, njit


@dataclass(frozen=True)
class SurfelGates:
    """Which cubes of points are pieces of surface.

    Chosen by hand with test_surfels, benchmarks/registration.
    """

    fewest_points: int = 6  #: points that make a plane
    merges: int = 3  #: times that cubes with too few points are merged
    #: thickness over the lesser width of points that are still a plane
    most_thickness_widths: float = 0.2
    least_width_ratio: float = 0.12  #: lesser over greater width of points that are no line


GATES = SurfelGates()


#: what surfels are pieces of: planes, round bodies of known curvature, or what is neither
FLAT, ROUND, UNKNOWN = 0, 1, 2


#: n, x, y, z, xx, xy, xz, yy, yz, zz
MOMENTS = 10


#: bits of each of the three numbers of a cube
_BITS = 20


_HALF = 1 << (_BITS - 1)


_MASK = (1 << _BITS) - 1


#: more cubes than this are merged into larger ones while they are filled: 300 MB
_MOST = 2_000_000


_ROOM = 1 << 14


@dataclass(frozen=True, eq=False)
class CubeSums:
    """Points of a scan summed up in cubes of one size: counts, first and second moments.

    Cubes lie on a lattice about the scanner; moments are about the middle of each cube, so that
    nothing is lost far away. Cubes merge into cubes of twice the size exactly.
    """

    size: float  #: edge of the cubes [m]
    keys: Index  #: (m,), keys that hold the three lattice numbers of each cube
    moments: Array  #: (m, 10), count and moments about the middle of each cube

    def __len__(self) -> int:
        return len(self.keys)

    @property
    def middles(self) -> Array:
        """Middles (m, 3) of the cubes [m]."""
        numbers = np.stack([self.keys >> (2 * _BITS), self.keys >> _BITS, self.keys], axis=1)
        return np.asarray(((numbers & _MASK) - _HALF + 0.5) * self.size, dtype=np.float64)

    def subset(self, chosen: NDArray[np.bool_] | Index) -> CubeSums:
        """Some of the cubes."""
        return CubeSums(self.size, self.keys[chosen], self.moments[chosen])


class CellSum:
    """Sums points of a scan in at most ``most`` cubes; their edge doubles where more are needed."""

    def __init__(self, size: float, most: int = _MOST) -> None:
        self.size, self._most, self._count = size, most, 0
        self._keys: Index = np.empty(0, dtype=np.int64)
        self._moments: Array = np.zeros((0, MOMENTS))
        self._table: Index = np.empty(0, dtype=np.int64)
        self._restart(CubeSums(size, np.empty(0, dtype=np.int64), np.zeros((0, MOMENTS))))

    def add(self, xyz: Array) -> None:
        """Add points; those not finite or beyond 500,000 cubes are left out."""
        xyz = np.ascontiguousarray(xyz)
        first = 0
        while first < len(xyz):
            first, self._count = _add(
                xyz, first, self.size, self._table, self._keys, self._moments, self._count
            )
            if first < len(xyz):
                self._restart(self.cells)
            while self._count > self._most:
                self._restart(coarser(self.cells))

    @property
    def cells(self) -> CubeSums:
        """The cubes so far."""
        n = self._count
        return CubeSums(self.size, self._keys[:n].copy(), self._moments[:n].copy())

    def _restart(self, cells: CubeSums) -> None:
        """Go on from cubes with room for as many again."""
        self.size, self._count = cells.size, len(cells)
        room = max(_ROOM, 2 * len(cells))
        self._keys, self._moments = np.empty(room, dtype=np.int64), np.zeros((room, MOMENTS))
        self._keys[: self._count], self._moments[: self._count] = cells.keys, cells.moments
        self._table = np.full(1 << (2 * room - 1).bit_length(), -1, dtype=np.int64)
        _enter(self._keys, self._count, self._table)


def coarser(cells: CubeSums) -> CubeSums:
    """Merge cubes into cubes of twice the size with the same points."""
    return CubeSums(2 * cells.size, *_merged(cells.keys, cells.moments, cells.size))


@njit(cache=True, nogil=True)
def _slot(key, table, keys):  # type: ignore[no-untyped-def]
    """Place of a key in the table, or the empty place where it belongs."""
    mask = len(table) - 1
    hashed = np.uint64(key) * np.uint64(0x9E3779B97F4A7C15)
    at = np.int64((hashed >> np.uint64(20)) & np.uint64(mask))
    while table[at] >= 0 and keys[table[at]] != key:
        at = (at + 1) & mask
    return at


@njit(cache=True, nogil=True)
def _enter(keys, count, table):  # type: ignore[no-untyped-def]
    for number in range(count):
        table[_slot(keys[number], table, keys)] = number


@njit(cache=True, nogil=True)
def _add(xyz, first, size, table, keys, moments, count):  # type: ignore[no-untyped-def]
    """Sum up points from ``first`` on until there is no room; next point, number of cubes."""
    cell = np.empty(3, dtype=np.int64)
    d = np.empty(3)
    for n in range(first, len(xyz)):
        inside = True
        for axis in range(3):
            number = np.floor(xyz[n, axis] / size)
            # NaN is not inside either
            inside = inside and abs(number) < _HALF - 1
            if inside:
                cell[axis] = np.int64(number)
                d[axis] = xyz[n, axis] - (number + 0.5) * size
        if not inside:
            continue
        key = ((cell[0] + _HALF) << (2 * _BITS)) | ((cell[1] + _HALF) << _BITS)
        key |= cell[2] + _HALF
        at = _slot(key, table, keys)
        if table[at] < 0:
            if count == len(keys):
                return n, count
            table[at] = count
            keys[count] = key
            count += 1
        m = moments[table[at]]
        m[0] += 1.0
        for axis in range(3):
            m[1 + axis] += d[axis]
        m[4] += d[0] * d[0]
        m[5] += d[0] * d[1]
        m[6] += d[0] * d[2]
        m[7] += d[1] * d[1]
        m[8] += d[1] * d[2]
        m[9] += d[2] * d[2]
    return len(xyz), count


@njit(cache=True, nogil=True)
def _merged(keys, moments, size):  # type: ignore[no-untyped-def]
    """Index and moments of cubes of twice the size."""
    table = np.full(1, -1, dtype=np.int64)
    room = 1
    while room < 2 * len(keys) + 2:
        room *= 2
    table = np.full(room, -1, dtype=np.int64)
    out_keys = np.empty(len(keys), dtype=np.int64)
    out = np.zeros((len(keys), MOMENTS))
    count = 0
    s = np.empty(3)
    for n in range(len(keys)):
        key = np.int64(0)
        for axis in range(3):
            number = ((keys[n] >> ((2 - axis) * _BITS)) & _MASK) - _HALF
            half = number >> 1
            s[axis] = (0.5 if number & 1 else -0.5) * size
            key = (key << _BITS) | (half + _HALF)
        at = _slot(key, table, out_keys)
        if table[at] < 0:
            table[at] = count
            out_keys[count] = key
            count += 1
        m, o = moments[n], out[table[at]]
        o[0] += m[0]
        k = 4
        for i in range(3):
            o[1 + i] += m[1 + i] + m[0] * s[i]
            for j in range(i, 3):
                o[k] += m[k] + s[i] * m[1 + j] + s[j] * m[1 + i] + m[0] * s[i] * s[j]
                k += 1
    return out_keys[:count].copy(), out[:count].copy()


@dataclass(frozen=True, eq=False)
class Surfels:
    """Pieces of surface."""

    center: Array  #: (n, 3), means of the points [m]
    normal: Array  #: (n, 3), unit normals
    count: Array  #: (n,), numbers of points
    thickness: Array  #: (n,), standard deviations of the points along the normal [m]
    width: Array  #: (n, 2), standard deviations along the surface, the lesser first [m]
    size: Array  #: (n,), edges of the cubes [m]
    spread: Array  #: (n, 3, 3), covariances of the points in the cubes [m^2]
    form: NDArray[np.int8]  #: (n,), what they are pieces of: ``FLAT``, ``ROUND`` or ``UNKNOWN``
    #: (n, 3), unit gradients ``g`` of the surfaces ``g . x + x^T Q x / 2 = const`` at the means:
    #: of round bodies without the lean of their planes
    #: (:mod:`~tribrach.registration.clouds.curvature`), the normals of others.
    gradient: Array
    #: (n, 3, 3), second derivatives ``Q`` of these surfaces, zero where they are not round [1/m]
    bend: Array
    stands_for: float = 1.0  #: how many surfels each one stands for, where they were thinned
    two_sided: bool = False  #: true if it is not known which side of them a scanner can see

    def __len__(self) -> int:
        return len(self.center)

    @property
    def area(self) -> Array:
        """Area (n,) of the surface that each stands for, approximately [m^2]."""
        area: Array = self.stands_for * self.size**2
        return area

    @property
    def sigma_offset(self) -> Array:
        """Sigma (n,) of the mean along the normal, from the scatter of the points [m]."""
        sigma: Array = self.thickness / np.sqrt(self.count)
        return sigma

    @property
    def sigma_normal(self) -> Array:
        """Sigma (n,) of the normal about its weaker axis [rad]."""
        sigma: Array = self.sigma_offset / self.width[:, 0]
        return sigma

    def placed(self, pose: Pose) -> Surfels:
        """Carry the surfels into another frame."""
        return Surfels(
            pose @ self.center,
            self.normal @ pose.rotation.T,
            self.count,
            self.thickness,
            self.width,
            self.size,
            pose.rotation @ self.spread @ pose.rotation.T,
            self.form,
            self.gradient @ pose.rotation.T,
            pose.rotation @ self.bend @ pose.rotation.T,
            self.stands_for,
            self.two_sided,
        )

    def subset(self, chosen: NDArray[np.bool_] | NDArray[np.int64]) -> Surfels:
        """Some of the surfels."""
        return Surfels(
            self.center[chosen],
            self.normal[chosen],
            self.count[chosen],
            self.thickness[chosen],
            self.width[chosen],
            self.size[chosen],
            self.spread[chosen],
            self.form[chosen],
            self.gradient[chosen],
            self.bend[chosen],
            self.stands_for,
            self.two_sided,
        )

    def facing(self, other: Surfels, cosine: Array) -> Array:
        """Cosines (n,) between normals of surfels and of others, without sign where it is none."""
        return np.abs(cosine) if self.two_sided or other.two_sided else cosine

    def thinned(self, most: int) -> Surfels:
        """Thin the surfels evenly in the order of the scan, each one then standing for several."""
        if len(self) <= most:
            return self
        some = self.subset(np.linspace(0, len(self) - 1, most).astype(np.int64))
        return replace(some, stands_for=self.stands_for * len(self) / most)


def surfels_of(cells: CubeSums, merges: int = GATES.merges) -> Surfels:
    """Make surfels of the cubes of a scan, with normals towards the origin.

    ``merges`` is how often cubes that are no plane are joined into cubes of twice the size.
    """
    parts = []
    for level in range(merges + 1):
        enough = np.flatnonzero(cells.moments[:, 0] >= GATES.fewest_points)
        columns, flat = _planes(cells.subset(enough))
        parts.append([column[flat] for column in columns])
        if level < merges:
            rest = np.ones(len(cells), dtype=bool)
            rest[enough[flat]] = False
            cells = coarser(cells.subset(rest))
    center, normal, count, thickness, width, size, spread = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )
    form, bend = np.full(len(center), FLAT, dtype=np.int8), np.zeros((len(center), 3, 3))
    return Surfels(center, normal, count, thickness, width, size, spread, form, normal, bend)


def _planes(cells: CubeSums) -> tuple[tuple[Array, ...], NDArray[np.bool_]]:
    """Columns of the surfels of cubes with enough points, and which of them are flat."""
    table = np.empty((len(cells), 18))
    in_threads(_fitted, len(cells), cells.moments, table)
    center = cells.middles + table[:, :3]
    normal = table[:, 3:6]
    away = np.einsum("ni,ni->n", normal, center) > 0
    normal = np.where(away[:, None], -normal, normal)
    thickness, width = table[:, 6], table[:, 7:9]
    flat = (thickness < GATES.most_thickness_widths * width[:, 0]) & (
        width[:, 0] > GATES.least_width_ratio * width[:, 1]
    )
    size = np.full(len(cells), cells.size)
    spread = table[:, 9:].reshape(-1, 3, 3)
    return (center, normal, cells.moments[:, 0], thickness, width, size, spread), flat


@njit(cache=True, nogil=True)
def _fitted(first, last, moments, out):  # type: ignore[no-untyped-def]
    """Mean from the middle, normal, thickness, widths and spread (m, 18) of cubes."""
    for n in range(first, last):
        m = moments[n]
        count = m[0]
        mean = m[1:4] / count
        spread = np.empty((3, 3))
        k = 4
        for i in range(3):
            for j in range(i, 3):
                spread[i, j] = m[k] / count - mean[i] * mean[j]
                spread[j, i] = spread[i, j]
                k += 1
        values, vectors = np.linalg.eigh(spread)
        out[n, :3] = mean
        out[n, 3:6] = vectors[:, 0]
        # three parameters of the plane are estimated from the same points
        out[n, 6] = np.sqrt(max(values[0], 1e-12) * count / max(count - 3.0, 1.0))
        out[n, 7] = np.sqrt(max(values[1], 1e-12))
        out[n, 8] = np.sqrt(max(values[2], 1e-12))
        out[n, 9:] = spread.ravel()
