"""Recognises what a file has for beams that came back from nothing, by the ranges.

Some scanners write a point for every beam. Where nothing came back it stands at zero, at one place
for all, or in the direction of the beam at the largest range of the instrument: a shell about the
scanner that goes with it from station to station, and would hold any two scans on top of each
other.

A shell is the last thing that a scan has: many points at one range, hardly any beyond, far fewer
before. A wall, a board, the last ring of a beam on the ground can be that too, but they lie in a
plane: a plane has no more than a thin ring, or one small disc, at one range. Points at the largest
range of which a few planes hold less than half are a shell. Of a dome that is scanned from its
middle this cannot be told; whoever scans one keeps the points.

All is found in the coordinates of the file. Metres.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Mask
from tribrach.kernels import njit
from tribrach.scan.scan import NoReturn, Scan
from tribrach.scan.unit_doubt import unit_doubt


@dataclass(frozen=True)
class NoReturnGates:
    """When points are taken for beams without return (by hand: test_no_return)."""

    #: points of one range or at one place, at least, and their share of the scan
    least_points: int = 30
    least_share: float = 1e-3
    #: width of a shell: share of its range, at least [m], and the most that it may grow to [widths]
    width_share: float = 5e-4
    least_width_m: float = 0.003
    most_widths: float = 4.0
    contrast: float = 10.0  #: points of a shell over those of the same width before it
    before_widths: int = 20  #: widths that lie before it and are compared
    #: share of the scan, and of the shell, that may lie beyond it
    beyond_share: float = 1e-3
    beyond_of_shell: float = 0.2
    #: planes that are sought in it, share of it that they may hold, and distance that is on a plane
    #: [widths]
    planes: int = 4
    planar_share: float = 0.5
    planar_widths: float = 0.5
    #: points that are looked at for planes, and triples that propose one
    looked_at: int = 3000
    triples: int = 400
    #: points that are compared to find places that repeat, and how much more often than the others
    compared: int = 300_000
    repeats: float = 20.0
    most_places: int = 20  #: places at most


GATES = NoReturnGates()

#: classes of the ranges: relative width, and smallest and largest range [m]
_CLASS, _NEAREST, _FARTHEST = 1e-4, 1e-3, 1e7
_CLASSES = int(np.log(_FARTHEST / _NEAREST) / _CLASS) + 1
#: odd multipliers of the hash of a point
_MIX = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], dtype=np.uint64)


def screened(scan: Scan) -> Scan:
    """Read a scan once, leave out beams without return and doubt whether the rest is metres."""
    return scan.screened(find_no_return(scan))


def find_no_return(scan: Scan) -> NoReturn:
    """Find what a scan has for beams without return, and what speaks against metres."""
    origin = np.array(scan.scanner)
    known = scan.origin != "unknown"
    ranges, some, total = np.zeros(_CLASSES, dtype=np.int64), _Some(), 0
    for chunk in scan.measured():
        total += len(chunk)
        some.add(chunk.xyz)
        if known:
            _count(np.ascontiguousarray(chunk.xyz), origin, ranges)
    least = max(float(GATES.least_points), GATES.least_share * total)
    places = some.repeated(least / max(total, 1))
    shell = _last(ranges, least) if known else None
    zeros = int(ranges[0]) if known else 0
    found = NoReturn(total=total)
    if places or shell is not None or zeros:
        found = _confirmed(scan, places, shell, zeros > 0, total, least)
    points = some.points
    kept = points[found.marks(points, origin) == NoReturn.RETURN]
    return replace(found, doubt=unit_doubt(scan, kept))


def _confirmed(
    scan: Scan,
    places: tuple[tuple[float, float, float], ...],
    shell: tuple[float, float] | None,
    at_scanner: bool,
    total: int,
    least: float,
) -> NoReturn:
    """Read again what was suspected: shells that are planes are none, and all are counted."""
    found = NoReturn(places=places, shell=shell, at_scanner=at_scanner)
    origin = np.array(scan.scanner)
    counts, members = np.zeros(3, dtype=np.int64), []
    for chunk in scan.measured():
        marks = found.marks(chunk.xyz, origin)
        counts += np.bincount(marks, minlength=4)[1:]
        members.append(chunk.xyz[marks == NoReturn.SHELL] - origin)
    if shell is not None and counts[2] >= least:
        points = np.concatenate(members)
        if _planar(points, shell[1] - shell[0]) > GATES.planar_share:
            shell, counts[2] = None, 0
    else:
        shell, counts[2] = None, 0
    return NoReturn(
        places=places,
        shell=shell,
        at_scanner=at_scanner,
        zeros=int(counts[0]),
        repeated=int(counts[1]),
        in_shell=int(counts[2]),
        total=total,
    )


@njit(cache=True, nogil=True)
def _count(xyz, origin, ranges):  # type: ignore[no-untyped-def]
    """Count the ranges by classes; the first one holds zeros alone."""
    for n in range(len(xyz)):
        x, y, z = xyz[n, 0] - origin[0], xyz[n, 1] - origin[1], xyz[n, 2] - origin[2]
        far = np.sqrt(x * x + y * y + z * z)
        if far == 0.0:
            ranges[0] += 1
        elif far < _FARTHEST:
            at = int(np.log(max(far, _NEAREST) / _NEAREST) / _CLASS)
            ranges[min(max(at, 1), len(ranges) - 1)] += 1


def _edge(number: float) -> float:
    """Range at which a class begins [m]."""
    return float(_NEAREST * np.exp(number * _CLASS))


def _last(ranges: NDArray[np.int64], least: float) -> tuple[float, float] | None:
    """Ranges [m] between which the scan ends with far more points than before; None if nowhere."""
    counts = ranges.copy()
    counts[0] = 0
    used = np.flatnonzero(counts)
    total = int(counts.sum())
    if not len(used) or total < least:
        return None
    sums = np.concatenate([[0], np.cumsum(counts)])

    def inside(low: int, high: int) -> int:
        return int(sums[min(max(high, 0), _CLASSES)] - sums[min(max(low, 0), _CLASSES)])

    top = int(used[-1]) + 1
    # the shell is where no more lies beyond than strays do
    first = int(np.searchsorted(sums, total * (1 - GATES.beyond_share), side="right")) - 1
    share = max(GATES.width_share, GATES.least_width_m / _edge(first))
    width = max(int(np.ceil(share / _CLASS)), 2)
    starts = np.arange(max(first - width, 1), max(top - width, 1) + 1)
    held = np.array([inside(s, s + width) for s in starts.tolist()])
    low = int(starts[np.argmax(held)])
    count, high = int(held.max()), low + width
    before = GATES.before_widths * width
    usual = inside(low - width - before, low - width) / GATES.before_widths
    if count < least or count < GATES.contrast * usual:
        return None
    # noise and rounding make it wider
    step = max(width // 4, 1)
    few = max(0.01 * count, 2.0 * usual * step / width)
    while high - low < GATES.most_widths * width and inside(high, high + step) > few:
        high += step
    while high - low < GATES.most_widths * width and inside(low - step, low) > few:
        low -= step
    count = inside(low, high)
    beyond = inside(high + step, _CLASSES)
    if beyond > min(GATES.beyond_share * total, GATES.beyond_of_shell * count):
        return None
    # the few of its points that are farther off
    return _edge(low - 2 * step), _edge(high + 2 * step)


def _planar(points: Array, width: float) -> float:
    """Share of points (n, 3) that a few planes hold [widths of the shell, m]."""
    rng = np.random.default_rng(0)
    if len(points) > GATES.looked_at:
        points = points[np.sort(rng.choice(len(points), GATES.looked_at, replace=False))]
    left = points
    for _ in range(GATES.planes):
        if len(left) < 4:
            break
        best = np.zeros(len(left), dtype=bool)
        for three in rng.integers(0, len(left), (GATES.triples, 3)):
            a, b, c = left[three]
            normal = np.cross(b - a, c - a)
            size = float(np.linalg.norm(normal))
            if size == 0:
                continue
            on: Mask = np.abs((left - a) @ (normal / size)) < GATES.planar_widths * width
            best = on if on.sum() > best.sum() else best
        left = left[~best]
    return 1 - len(left) / max(len(points), 1)


class _Some:
    """Points from all over a scan, as many as can be compared, whatever its size."""

    def __init__(self) -> None:
        self._kept: list[Array] = []
        self._stride, self._ahead, self._count = 1, 0, 0

    def add(self, xyz: Array) -> None:
        """Take every so many of points (n, 3)."""
        taken = xyz[self._ahead :: self._stride]
        self._ahead = (self._ahead - len(xyz)) % self._stride
        self._kept.append(taken.copy())
        self._count += len(taken)
        while self._count > GATES.compared:
            # what follows is taken half as often; the phase of the start is kept
            whole = np.concatenate(self._kept)
            self._ahead += self._stride * (len(whole) % 2)
            self._kept = [whole[::2]]
            self._stride *= 2
            self._count = len(self._kept[0])

    @property
    def points(self) -> Array:
        """The points (n, 3) that were taken."""
        return np.concatenate(self._kept) if self._kept else np.zeros((0, 3))

    def repeated(self, share: float) -> tuple[tuple[float, float, float], ...]:
        """Places that hold at least this share of the points, and far more than any other."""
        points = self.points
        if not len(points):
            return ()
        _, first, counts = np.unique(point_hashes(points), return_index=True, return_counts=True)
        usual = float(np.quantile(counts, 0.99))
        # of a thinned scan fewer need to be seen
        least = max(GATES.least_points / self._stride, share * len(points), GATES.repeats * usual)
        many = np.flatnonzero(counts >= max(least, 3.0))
        many = many[np.argsort(-counts[many])][: GATES.most_places]
        return tuple((float(x), float(y), float(z)) for x, y, z in points[first[many]])


def point_hashes(xyz: Array) -> NDArray[np.uint64]:
    """Mix the bits of coordinates; equal points have equal numbers."""
    bits = np.ascontiguousarray(xyz + 0.0).view(np.uint64)
    mixed = np.zeros(len(xyz), dtype=np.uint64)
    for k in range(3):
        mixed = (mixed ^ bits[:, k]) * _MIX[k]
        mixed ^= mixed >> np.uint64(29)
    return mixed
