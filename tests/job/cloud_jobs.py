"""Small scans at known stations, for tests of the clouds made of them."""

from pathlib import Path

import numpy as np
import pye57
from scipy.spatial.transform import Rotation

from tribrach.cloud.placement import Placement
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geodesy.projection import ProjectedGrid
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.scans.formats import read_scans
from tribrach.job.clouds import Product, write_clouds
from tribrach.job.scans import StationScan
from tribrach.job.state import Remembered
from tribrach.project.sections import CloudSection

NOISE = ScanNoise(1.2e-3, 1e-5, 4e-5, 4e-5, 4e-3, 3e-4)
UTM = "EPSG:32648"


def several(path: Path, scans: int, seed: int = 0) -> np.ndarray:
    """An E57 file of scans by pye57, the points (scans, 500, 3) of each in its own frame."""
    rng = np.random.default_rng(seed)
    xyz = rng.uniform(-9, 9, (scans, 500, 3))
    file = pye57.E57(str(path), mode="w")
    for k, points in enumerate(xyz):
        data = {f"cartesian{a}": points[:, i] for i, a in enumerate("XYZ")}
        turn, shift = np.array([1.0, 0, 0, 0]), np.full(3, 10.0 * k)
        file.write_scan_raw(data, name=f"S{k}", rotation=turn, translation=shift)
    file.close()
    return xyz


def opened(*paths: Path) -> list[StationScan]:
    """All scans of files, each at a station of the name of its file and scan."""
    return [
        StationScan(f"{path.stem} {scan.name}", f"{path.stem} {scan.name}", scan, NOISE, True, {})
        for path in paths
        for scan in read_scans(path)
    ]


def placed(scans: list[StationScan], far: float = 0.0) -> dict[str, Placement]:
    """A place for each within 50 m, all of them moved by ``far`` along every axis."""
    out = {}
    for k, scan in enumerate(scans):
        rng = np.random.default_rng(k + 1)
        turn = Rotation.from_euler("zyx", [k + 1, 0.01, -0.02]).as_matrix()
        a = rng.normal(size=(6, 6)) * 1e-4
        pose = Pose(turn, far + rng.uniform(-50, 50, 3))
        out[scan.name] = Placement(scan.station, pose, a @ a.T, scan.noise)
    return out


def projected() -> OutputFrame:
    """UTM around a point near its central meridian: 0.04 % shorter than the ground."""
    grid = ProjectedGrid(UTM, 505_000.0, 2_331_000.0, 20.0)
    return OutputFrame(WorkFrame(grid.site, grid), "projected", UTM)


def made(
    scans: list[StationScan],
    places: dict[str, Placement],
    frame: OutputFrame,
    out: Path,
    **wish: object,
) -> list[Product]:
    """The clouds of scans in a folder ``clouds``."""
    state = Remembered(out)
    section = CloudSection.model_validate(wish)
    return write_clouds(scans, places, frame, section, out / "clouds", state, lambda *_: None)
