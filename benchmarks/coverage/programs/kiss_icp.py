"""The registration of KISS-ICP from the approximate poses; it has no covariance."""

from importlib.metadata import version

from kiss_icp.config import KISSConfig
from kiss_icp.mapping import get_voxel_hash_map
from kiss_icp.registration import get_registration

from benchmarks.coverage.programs import Found
from benchmarks.coverage.scenes import Scene

SETTINGS = f"KISS-ICP {version('kiss-icp')}, map of 0.25 m, from the approximate poses"


def register(scene: Scene) -> dict[str, Found | str]:
    """Each scan by itself on the map of the first."""
    config = KISSConfig()
    config.mapping.voxel_size = 0.25
    fit = get_registration(config)
    known = get_voxel_hash_map(config)
    known.add_points(scene.points(scene.scans[0]))
    out: dict[str, Found | str] = {}
    for scan in scene.scans[1:]:
        points, pose = scene.points(scan), scene.approximate(scan)
        for reach in (1.0, 0.3):
            pose = fit.align_points_to_map(points, known, pose, reach, reach / 3)
        out[scan] = Found(pose)
    return out
