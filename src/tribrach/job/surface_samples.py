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

__all__ = ["sample_wish", "samples_of"]


def samples_of(
    scans: Sequence[StationScan], state: Remembered, progress: Progress
) -> dict[str, SurfaceSample]:
    """Take some points of scans with their normals, those of unchanged scans from the last run.

    Parameters
    ----------
    scans
        The scans.
    state
        Where samples are remembered.
    progress
        Told of what is done.

    Returns
    -------
    dict of str to SurfaceSample
        By the names of the scans.

    Raises
    ------
    InputError
        The points of a scan cannot be read.
    """
    items = [sample_wish(scan).item for scan in scans]
    taken = each(_taken, items, state=state, progress=progress)
    return {scan.name: sample for scan, sample in zip(scans, taken, strict=True)}


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
    """The sample of a scan, whose steps nobody is told of."""
    return surface_sample(scan)
