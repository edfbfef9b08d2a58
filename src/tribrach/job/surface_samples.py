"""Some points of every scan with their normals, taken once and remembered."""

from __future__ import annotations

from collections.abc import Sequence

from tribrach._types import Progress
from tribrach.job.each import Item, each
from tribrach.job.scans import StationScan
from tribrach.job.state import Remembered
from tribrach.job.visits import Wish
from tribrach.scan.scan import Scan
from tribrach.scan.surface_sample import SurfaceSample, surface_sample


class SurfaceSamples:
    """Some points of scans with normals, taken or recalled when first asked for."""

    def __init__(self, state: Remembered, progress: Progress) -> None:
        self._state, self._progress = state, progress
        self._known: dict[str, SurfaceSample] = {}

    def of(self, scans: Sequence[StationScan]) -> dict[str, SurfaceSample]:
        """The samples of scans by their names."""
        new = [scan for scan in scans if scan.name not in self._known]
        items = [sample_wish(scan).item for scan in new]
        taken = each(_taken, items, state=self._state, progress=self._progress)
        self._known |= {scan.name: sample for scan, sample in zip(new, taken, strict=True)}
        return {scan.name: self._known[scan.name] for scan in scans}


def sample_wish(scan: StationScan) -> Wish:
    """Some points of a scan as a product."""
    item = Item(
        f"surface-{scan.name}",
        f"sample of {scan.name}",
        (scan.scan,),
        source=scan.scan.path,
        cost=scan.scan.records or 0,
    )
    return Wish(_taken, item)


def _taken(scan: Scan, *, progress: Progress) -> SurfaceSample:
    """The sample of a scan, without progress messages."""
    return surface_sample(scan)
