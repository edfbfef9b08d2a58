"""Some points of every scan with their normals, taken once and remembered."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

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
    taken = each(_facts, items, _from_facts, state=state, progress=progress)
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
    return Wish(_facts, item)


def _from_facts(item: Item, facts: dict[str, Any]) -> SurfaceSample:
    """A sample from plain numbers."""
    normals = np.array(facts["normals"]).reshape(-1, 3)
    normals[(normals == 0).all(axis=1)] = np.nan
    light = facts["intensity"]
    return SurfaceSample(
        np.array(facts["xyz"]).reshape(-1, 3),
        normals,
        None if light is None else np.array(light, dtype=np.float64),
    )


def _facts(scan: Scan, *, progress: Progress) -> dict[str, Any]:
    """A sample as plain numbers; unknown normals are zero, unknown intensities None."""
    sample = surface_sample(scan)
    normals = np.nan_to_num(sample.normals)
    light = None
    if sample.intensity is not None:
        light = [value if np.isfinite(value) else None for value in sample.intensity.tolist()]
    return {"xyz": sample.xyz.tolist(), "normals": normals.tolist(), "intensity": light}
