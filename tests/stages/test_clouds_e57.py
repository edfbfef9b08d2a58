"""Clouds in E57: copies keep every point, others the scanner frame; both lie where they must."""

from pathlib import Path

import numpy as np
import pye57
import pytest
from scipy.spatial.transform import Rotation

from tribrach.cloud.placement import Placement
from tribrach.errors import InputError
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.scans.formats import read_scans
from tribrach.project.sections import CloudSection
from tribrach.scan.scan import Field
from tribrach.stages.clouds import Cloud
from tribrach.stages.scans import StationScan

NOISE = ScanNoise(1.2e-3, 1e-5, 4e-5, 4e-5, 4e-3, 3e-4)
FIELDS = (
    Field("intensity", "float32", 0, 65535),
    *(Field(f"normal_{a}", "float32") for a in "xyz"),
)


def source(path: Path, seed: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """A scan in its frame."""
    rng = np.random.default_rng(seed)
    xyz, normals = rng.uniform(-30, 30, (2000, 3)), rng.normal(size=(2000, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    values = {f"normal_{a}": normals[:, k].astype(np.float32) for k, a in enumerate("xyz")}
    values["intensity"] = rng.integers(0, 65536, 2000).astype(np.float32)
    with create(path, CloudHeader(path.stem, FIELDS, 1e-4)) as writer:
        writer.write(xyz, values)
    return xyz, values


def station(path: Path, seed: int) -> tuple[StationScan, Placement]:
    rng = np.random.default_rng(seed)
    pose = Pose(
        Rotation.from_euler("z", seed).as_matrix(),
        np.array([590_000.0, 2_331_000.0, 9.0]) + rng.uniform(-50, 50, 3),
    )
    a = rng.normal(size=(6, 6)) * 1e-4
    scan = read_scans(path)[0]
    one = StationScan(path.stem, path.stem, scan, NOISE, True, {})
    return one, Placement(path.stem, pose, a @ a.T, NOISE)


def write(paths: list[Path], target: Path) -> list[Placement]:
    """A cloud of scans in the work frame."""
    made = [station(path, k + 1) for k, path in enumerate(paths)]
    frame, wish = OutputFrame(WorkFrame()), CloudSection(format=target.suffix[1:])
    scans, places = [one for one, _ in made], [where for _, where in made]
    Cloud(target.stem, scans, places, frame, wish).write(target, lambda *_: None)
    return places


def placed(path: Path, index: int = 0) -> np.ndarray:
    """World coordinates as another reader makes them."""
    file = pye57.E57(str(path))
    data = file.read_scan(index, ignore_missing_fields=True)
    file.close()
    return np.stack([data[f"cartesian{a}"] for a in "XYZ"], axis=1)


@pytest.mark.parametrize("suffix", [".las", ".e57"])
def test_points_lie_where_they_must(tmp_path: Path, suffix: str) -> None:
    path, out = tmp_path / f"S1{suffix}", tmp_path / "out.e57"
    xyz, values = source(path, 1)
    (where,) = write([path], out)
    assert np.abs(placed(out) - where.pose @ xyz).max() < 3e-4
    (scan,) = read_scans(out)
    chunk = next(scan.chunks())
    assert np.abs(chunk.xyz - xyz).max() < 2e-4
    for axis in "xyz":
        name = f"normal_{axis}"
        assert (chunk.values[name] == values[name]).all()


def test_the_sigmas_are_those_of_other_formats(tmp_path: Path) -> None:
    path = tmp_path / "S1.las"
    source(path, 1)
    for suffix in (".e57", ".las"):
        write([path], tmp_path / f"out{suffix}")
    e57, las = (next(read_scans(tmp_path / f"out{k}")[0].chunks()) for k in (".e57", ".las"))
    for name in ("sigma_x", "sigma_y", "sigma_z"):
        assert (e57.values[name] == las.values[name]).all()
    by_name = {f.name: f for f in read_scans(tmp_path / "out.e57")[0].fields}
    assert by_name["sigma_x"].description == "sigma of e [m]"


def test_a_copy_has_the_points_of_the_source(tmp_path: Path) -> None:
    path, out = tmp_path / "S1.e57", tmp_path / "out.e57"
    source(path, 1)
    write([path], out)
    assert path.read_bytes()[1024:30_000] == out.read_bytes()[1024:30_000]


def test_one_scan_of_several_is_written_alone(tmp_path: Path) -> None:
    """A copy of the whole file would show the other scan where it is not."""
    path, out = tmp_path / "both.e57", tmp_path / "out.e57"
    file = pye57.E57(str(path), mode="w")
    rng = np.random.default_rng(0)
    xyz = rng.uniform(-9, 9, (2, 500, 3))
    for k, points in enumerate(xyz):
        data = {f"cartesian{a}": points[:, i] for i, a in enumerate("XYZ")}
        file.write_scan_raw(data, name=f"S{k}")
    file.close()
    (where,) = write([path], out)
    assert len(read_scans(out)) == 1
    assert np.abs(placed(out) - where.pose @ xyz[0]).max() < 3e-4


def test_scans_of_several_files_are_not_merged(tmp_path: Path) -> None:
    paths = [tmp_path / "S1.las", tmp_path / "S2.e57"]
    for k, path in enumerate(paths):
        source(path, k)
    with pytest.raises(InputError, match="one scan per file"):
        write(paths, tmp_path / "out.e57")
    assert sorted(tmp_path.iterdir()) == paths
