"""Small projects of scans with spheres: five in a few windows of directions, and their list."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tests.targets.scenes import directions, ellipsoid, scan
from tribrach.geometry.pose import Pose
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader

RADIUS = 0.1
#: no two of their distances are alike
SPHERES = np.array(
    [[4.0, 1.0, 0.2], [-3.0, 4.5, 0.9], [-5.0, -2.0, -0.4], [1.5, -4.2, 1.3], [2.5, 5.5, -0.9]]
)
POSE = Pose(Rotation.from_euler("z", 0.7).as_matrix(), np.array([1000.0, 2000.0, 50.0]))

PROJECT = """\
title = "Spheres"
[instruments.scanner]
range_mm = 1.0
scan_angle_arcsec = 10.0
[[points]]
file = "control.csv"
[targets]
sphere_radius_m = [0.1]
[cloud]
format = "las"
"""


def points(spheres: np.ndarray = SPHERES, seed: int = 0) -> np.ndarray:
    """Points (n, 3) on spheres and on a wall behind each, scanner frame."""
    rng, out = np.random.default_rng(seed), []
    for center in spheres:
        h, v = np.arctan2(center[1], center[0]), np.arccos(center[2] / np.linalg.norm(center))
        half = 2 * RADIUS / np.linalg.norm(center)
        rays, _, _ = directions((h - half, h + half), (v - half, v + half), 2e-3)
        wall = np.full(len(rays), np.linalg.norm(center) + 1.5)
        out.append(scan(rays, [ellipsoid(rays, center, RADIUS), wall], rng, 5e-4, 2e-5))
    return np.concatenate(out)


def cloud(path: Path, xyz: np.ndarray) -> Path:
    """A file of points without anything else."""
    with create(path, CloudHeader(path.stem, (), 1e-5, np.round(xyz.mean(axis=0)))) as writer:
        writer.write(xyz, {})
    return path


def control(path: Path, xyz: np.ndarray, names: Sequence[str] | None = None) -> Path:
    """A list of points known to 1 mm."""
    named = [f"T{k}" for k in range(len(xyz))] if names is None else names
    rows = [
        f"{name},{e:.5f},{n:.5f},{u:.5f},1,1,1" for name, (e, n, u) in zip(named, xyz, strict=True)
    ]
    head = "point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm"
    path.write_text("\n".join([head, *rows]) + "\n")
    return path


def project(folder: Path, *scans: str, more: str = "") -> Path:
    """A project with a list of all spheres and these files of scans, which may not exist yet."""
    control(folder / "control.csv", POSE @ SPHERES)
    path = folder / "job.toml"
    entries = "".join(f'[[scans]]\nfile = "{file}"\norigin = "scanner"\n' for file in scans)
    path.write_text(PROJECT + more + entries)
    return path
