"""Some points of every scan with their normals, taken once and remembered."""

from __future__ import annotations

from typing import Any

import numpy as np

from tribrach.job.scans import StationScan
from tribrach.job.state import Remembered
from tribrach.scan.scan import Scan
from tribrach.scan.surface_sample import SurfaceSample, surface_sample

__all__ = ["sample_of"]


def sample_of(scan: StationScan, state: Remembered) -> SurfaceSample:
    """Take some points of a scan with their normals, those of an unchanged scan from the last run.

    Raises
    ------
    InputError
        The points of the scan cannot be read.
    """
    key = state.key(_facts, scan.scan)
    facts = state.recall(f"surface-{scan.name}", key)
    if facts is None:
        facts = _facts(scan.scan)
        state.remember(f"surface-{scan.name}", key, facts)
    normals = np.array(facts["normals"]).reshape(-1, 3)
    normals[(normals == 0).all(axis=1)] = np.nan
    light = facts["intensity"]
    return SurfaceSample(
        np.array(facts["xyz"]).reshape(-1, 3),
        normals,
        None if light is None else np.array(light, dtype=np.float64),
    )


def _facts(scan: Scan) -> dict[str, Any]:
    """A sample as plain numbers; unknown normals are zero, unknown intensities None."""
    sample = surface_sample(scan)
    normals = np.nan_to_num(sample.normals)
    light = None
    if sample.intensity is not None:
        light = [value if np.isfinite(value) else None for value in sample.intensity.tolist()]
    return {"xyz": sample.xyz.tolist(), "normals": normals.tolist(), "intensity": light}
