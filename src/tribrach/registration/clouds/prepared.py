"""A scan made ready for registration: surfels fine and coarse with their trees, and its view.

One pass over the points in chunks; of a scan of any size no more than its surfels stays in memory.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp
from tribrach.registration.clouds.cells import Cells, CellSum, coarser
from tribrach.registration.clouds.fine import Indexed
from tribrach.registration.clouds.surfels import Surfels, surfels_of
from tribrach.registration.clouds.view import View

__all__ = ["FINE", "PreparedScan", "prepare"]

Array = NDArray[np.float64]

#: edges of the cubes: fine ones for the last tenths, coarse ones for the search [m]
FINE, _COARSE = 0.1, 0.4
#: turn of the cubes: a floor or wall that runs along faces of cubes would be cut by them, its noise
#: above in one cube and below in the other
_ASKEW = Pose(exp(np.array([0.37, 0.53, 0.29])), np.zeros(3))
#: no scan is coarser than this share of its radius: rooms and models have small cubes
_OF_RADIUS = 0.04
#: surfels that are kept, at most
_FINE_MOST, _SOME_MOST, _COARSE_MOST = 100_000, 15_000, 12_000
#: times that cubes are merged; once more for a scan with fewer surfels than this
_MERGES, _SPARSE = 3, 3000
#: fewer are no scan to register
_FEWEST = 50


@dataclass(frozen=True, eq=False)
class PreparedScan:
    """Surfels and view of a scan, scanner frame; points : how many it has.

    fine : for the fit; some : of these, for the choice between places; coarse : for the search.
    """

    name: str
    points: int
    fine: Indexed
    some: Indexed
    coarse: Indexed
    view: View

    @property
    def radius(self) -> float:
        """Within which nine tenths of the surface lie [m]."""
        return float(np.quantile(np.linalg.norm(self.coarse.surfels.center, axis=1), 0.9))


def prepare(name: str, chunks: Iterable[Array], size: float = FINE) -> PreparedScan:
    """A scan from chunks of points (n, 3) [m].

    Raises
    ------
    InputError : too few points, or no surfaces among them.
    """
    total, view, cubes = 0, View(), CellSum(size)
    for xyz in chunks:
        cubes.add(_ASKEW @ xyz)
        view.add(xyz)
        total += len(xyz)
    view.settle()
    cells = cubes.cells
    fine = _upright(cells, _MERGES)
    if len(fine) < _SPARSE:
        fine = _upright(cells, _MERGES + 1)
    fine = fine.thinned(_FINE_MOST)
    radius = float(np.quantile(np.linalg.norm(fine.center, axis=1), 0.9)) if len(fine) else 0.0
    while cells.size < min(_COARSE, _OF_RADIUS * radius) - 1e-6:
        cells = coarser(cells)
    coarse = _upright(cells, 2)
    while len(coarse) > _COARSE_MOST:
        cells = coarser(cells)
        coarse = _upright(cells, 2)
    if len(fine) < _FEWEST or len(coarse) < _FEWEST:
        raise InputError(
            f"scan {name} has {total} points that make {len(fine)} pieces of surface, too few to "
            "register it",
            cure="give the whole scan, with surfaces in it",
        )
    whole = Indexed.of(fine)
    some = whole if len(fine) <= _SOME_MOST else Indexed.of(fine.thinned(_SOME_MOST))
    return PreparedScan(name, total, whole, some, Indexed.of(coarse), view)


def _upright(cells: Cells, merges: int) -> Surfels:
    """Surfels of cubes that stand askew, in the scanner's frame."""
    return surfels_of(cells, merges).placed(_ASKEW.inverse)
