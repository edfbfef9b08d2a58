"""Prepares a scan for registration: fine and coarse surfels with their search trees, and its view.

One pass over the points in chunks; of a scan of any size no more than its surfels stays in memory.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp
from tribrach.kernels import njit
from tribrach.registration.clouds.curvature import formed
from tribrach.registration.clouds.fine import Indexed
from tribrach.registration.clouds.surfels import CellSum, CubeSums, Surfels, coarser, surfels_of


@dataclass(frozen=True)
class PreparedScanGates:
    """How fine surfels and views are, and how many are kept.

    Chosen by hand with test_surfels, benchmarks/registration.
    """

    #: rows of the finest image of ranges, twice as many columns: half a degree
    view_rows: int = 360
    least_rows: int = 45  #: ... and of the coarsest
    pixel_points: float = 6.0  #: points in a seen pixel, on the average, that let no gaps appear
    #: edges of the cubes: fine ones for the last tenths, coarse ones for the search [m]
    fine_m: float = 0.1
    coarse_m: float = 0.4
    #: no scan is coarser than this share of its radius: rooms and models have small cubes
    coarse_radii: float = 0.04
    radius_quantile: float = 0.9  #: the radius of a scan holds this share of its surface
    #: surfels that are kept at most: for the fit, for the choice between places, for the search
    most_fine: int = 100_000
    most_some: int = 15_000
    most_coarse: int = 12_000
    #: times that fine cubes are merged, once more in a scan with fewer surfels than the second
    fine_merges: int = 3
    sparse_surfels: int = 3000
    coarse_merges: int = 2  #: times that coarse cubes are merged
    fewest_surfels: int = 50  #: fewer surfels are no scan to register


GATES = PreparedScanGates()


#: what a scanner says of a place: it never looked there, something is before it, it is no more
#: than the margin from what was seen, the beams went through it
UNSEEN, BEHIND, AT_SURFACE, SEEN_THROUGH = 0, 1, 2, 3


class RangeView:
    """How far a scanner saw in every direction; anything nearer there was not in its way.

    A coarse image of the smallest and largest range, ``nearest`` and ``farthest`` (r, 2 r) [m], in
    every half degree of H and V, or in every degree of a scan with few points. A surface that
    another scan places clearly nearer than anything in that direction contradicts the pose: the
    beams went through it. Directions without points (sky, glass) say nothing. Scanner frame.
    """

    def __init__(self) -> None:
        self.nearest = np.full((GATES.view_rows, 2 * GATES.view_rows), np.inf)
        self.farthest = np.zeros((GATES.view_rows, 2 * GATES.view_rows))
        self._points = 0

    @classmethod
    def settled(cls, nearest: Array, farthest: Array) -> Self:
        """A view that is settled, from its images."""
        view = cls()
        view.nearest, view.farthest = nearest, farthest
        return view

    @property
    def blind(self) -> bool:
        """True if nothing was seen, as of models."""
        return not np.isfinite(self.nearest).any()

    def add(self, xyz: Array) -> None:
        """Add points, before :meth:`settle`."""
        self._points += len(xyz)
        _fill(np.ascontiguousarray(xyz), self.nearest, self.farthest)

    def settle(self) -> None:
        """Join pixels until each holds enough points."""
        while len(self.nearest) > GATES.least_rows:
            if self._points >= GATES.pixel_points * np.isfinite(self.nearest).sum():
                return
            rows = len(self.nearest) // 2
            self.nearest = self.nearest.reshape(rows, 2, 2 * rows, 2).min(axis=(1, 3))
            self.farthest = self.farthest.reshape(rows, 2, 2 * rows, 2).max(axis=(1, 3))

    def judge(self, points: Array, margin: Array) -> NDArray[np.int8]:
        """What the scanner saw at places with margins [m]: ``UNSEEN``, ``BEHIND``, ... for each."""
        return np.asarray(_judged(points, margin, self.nearest, self.farthest))


@njit(cache=True, nogil=True)
def _pixel(x, y, z, rows):  # type: ignore[no-untyped-def]
    """Row, column and range of a place in an image of so many rows."""
    flat = np.hypot(x, y)
    step = np.pi / rows
    row = min(int(np.arctan2(flat, z) / step), rows - 1)
    column = int((np.arctan2(y, x) + np.pi) / step) % (2 * rows)
    return row, column, np.hypot(flat, z)


@njit(cache=True, nogil=True)
def _fill(xyz, nearest, farthest):  # type: ignore[no-untyped-def]
    for n in range(len(xyz)):
        if not np.isfinite(xyz[n, 0] + xyz[n, 1] + xyz[n, 2]):
            continue
        row, column, far = _pixel(xyz[n, 0], xyz[n, 1], xyz[n, 2], len(nearest))
        if far < nearest[row, column]:
            nearest[row, column] = far
        if far > farthest[row, column]:
            farthest[row, column] = far


@njit(cache=True, nogil=True)
def _judged(points, margin, nearest, farthest):  # type: ignore[no-untyped-def]
    """The verdicts (n,), by the pixel and its eight neighbours."""
    out = np.empty(len(points), dtype=np.int8)
    rows, columns = nearest.shape
    for n in range(len(points)):
        row, column, far = _pixel(points[n, 0], points[n, 1], points[n, 2], rows)
        low, high, here = np.inf, 0.0, nearest[row, column]
        for i in range(max(row - 1, 0), min(row + 2, rows)):
            for j in range(column - 1, column + 2):
                low = min(low, nearest[i, j % columns])
                high = max(high, farthest[i, j % columns])
        if not np.isfinite(here):
            out[n] = UNSEEN
        elif far < low - margin[n]:
            out[n] = SEEN_THROUGH
        elif far > high + margin[n]:
            out[n] = BEHIND
        else:
            out[n] = AT_SURFACE
    return out


#: turn of the cubes: a floor or wall that runs along faces of cubes would be cut by them, its noise
#: above in one cube and below in the other
ASKEW = Pose(exp(np.array([0.37, 0.53, 0.29])), np.zeros(3))


@dataclass(frozen=True, eq=False)
class PreparedScan:
    """Surfels and view of a scan, in the scanner frame."""

    name: str  #: name of the scan
    points: int  #: number of its points
    fine: Indexed  #: surfels for the fit
    some: Indexed  #: some of these, for the choice between places
    coarse: Indexed  #: surfels for the search
    view: RangeView  #: how far the scanner saw in every direction

    @property
    def radius(self) -> float:
        """Distance from the scanner within which nine tenths of the surface lie [m]."""
        return float(
            np.quantile(np.linalg.norm(self.coarse.surfels.center, axis=1), GATES.radius_quantile)
        )


@dataclass(frozen=True, eq=False)
class SurfacesOfScan:
    """What a prepared scan is made of besides its search trees, which are quickly made."""

    points: int  #: number of points of the scan
    #: for the fit and for the search
    fine: Surfels
    coarse: Surfels
    #: (r, 2 r), smallest and largest range in every direction [m]
    nearest: Array
    farthest: Array

    def indexed(self, name: str) -> PreparedScan:
        """The scan of a name with its search trees."""
        whole = Indexed.of(self.fine)
        most = GATES.most_some
        some = whole if len(self.fine) <= most else Indexed.of(self.fine.thinned(most))
        view = RangeView.settled(self.nearest, self.farthest)
        return PreparedScan(name, self.points, whole, some, Indexed.of(self.coarse), view)


def prepare(name: str, chunks: Iterable[Array], size: float = GATES.fine_m) -> PreparedScan:
    """Prepare a scan from chunks of points, which :func:`surfaces` describes."""
    return surfaces(name, chunks, size).indexed(name)


def surfaces(name: str, chunks: Iterable[Array], size: float = GATES.fine_m) -> SurfacesOfScan:
    """Find the surfels and the view of a scan from chunks of points."""
    total, view, cubes = 0, RangeView(), CellSum(size)
    for xyz in chunks:
        cubes.add(ASKEW @ xyz)
        view.add(xyz)
        total += len(xyz)
    view.settle()
    cells = cubes.cells
    fine = upright(cells, GATES.fine_merges)
    if len(fine) < GATES.sparse_surfels:
        fine = upright(cells, GATES.fine_merges + 1)
    fine = formed(fine, GATES.most_fine)
    radius = (
        float(np.quantile(np.linalg.norm(fine.center, axis=1), GATES.radius_quantile))
        if len(fine)
        else 0.0
    )
    while cells.size < min(GATES.coarse_m, GATES.coarse_radii * radius) - 1e-6:
        cells = coarser(cells)
    coarse = upright(cells, GATES.coarse_merges)
    while len(coarse) > GATES.most_coarse:
        cells = coarser(cells)
        coarse = upright(cells, GATES.coarse_merges)
    if len(fine) < GATES.fewest_surfels or len(coarse) < GATES.fewest_surfels:
        raise InputError(
            f"scan {name} has {total} points that make {len(fine)} pieces of surface, too few to "
            "register it",
            cure="give the whole scan, with surfaces in it",
        )
    return SurfacesOfScan(total, fine, coarse, view.nearest, view.farthest)


def upright(cells: CubeSums, merges: int) -> Surfels:
    """Surfels of cubes that stand askew, in the scanner's frame.

    ``merges`` is how often cubes that are no plane are joined.
    """
    return surfels_of(cells, merges).placed(ASKEW.inverse)
