"""Tribrach by its Python, from nothing but the scans."""

from pathlib import Path

import numpy as np

from benchmarks.coverage.programs import Found
from benchmarks.coverage.scenes import Scene
from tribrach import __version__
from tribrach import register as register_scans
from tribrach.errors import InputError

SETTINGS = (
    f"tribrach {__version__} register with its defaults, no approximate poses; its covariance"
)


def register(scene: Scene, poses: Path | None = None) -> dict[str, Found | str]:
    """Poses of the group of the first scan."""
    files = [scene.file(scan) for scan in scene.scans]
    try:
        given = [] if poses is None else [poses]
        found = register_scans(files, approximate=bool(given), poses=given)
    except InputError as error:
        return dict.fromkeys(scene.scans[1:], str(error))
    first = scene.scans[0]
    group = next((g for g in found.groups if g.frame_of == first), None)
    out: dict[str, Found | str] = {}
    for scan in scene.scans[1:]:
        station = None if group is None else group.stations.get(scan)
        if station is None:
            said = [s for p in found.pairs if scan in (p.first, p.second) for s in p.sentences]
            out[scan] = "; ".join(str(s) for s in said) or "not joined to the first scan"
        else:
            matrix = np.array(station.world_from_scanner)
            out[scan] = Found(matrix, np.array(station.covariance))
    return out
