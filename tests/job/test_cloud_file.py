"""Clouds in files as streams, placed by their own poses; scanners found beside them."""

import json
from pathlib import Path

import numpy as np
import pye57
import pytest
from scipy.spatial.transform import Rotation

from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.job.cloud_file import open_cloud, refuse_other_frames

PLACE = np.array([505_010.5, 2_331_020.25, 7.0])
TURN = Rotation.from_euler("z", 0.7)


def e57(path: Path, scans: int = 1) -> np.ndarray:
    """Scans placed by their poses; their points in the world."""
    rng = np.random.default_rng(1)
    file, world = pye57.E57(str(path), mode="w"), []
    x, y, z, w = TURN.as_quat()
    for k in range(scans):
        xyz = rng.uniform(-9, 9, (400, 3))
        data = {f"cartesian{a}": xyz[:, i] for i, a in enumerate("XYZ")}
        file.write_scan_raw(
            data, name=f"S{k}", rotation=np.array([w, x, y, z]), translation=PLACE + k
        )
        world.append(TURN.apply(xyz) + PLACE + k)
    file.close()
    return np.concatenate(world)


def las(path: Path) -> Path:
    with create(path, CloudHeader(path.stem)) as writer:
        writer.write(np.random.default_rng(2).uniform(0, 5, (300, 3)), {})
    return path


def poses(folder: Path, *names: str) -> None:
    matrix = np.eye(4)
    rows = []
    for k, name in enumerate(names):
        matrix[:3, 3] = PLACE + k
        rows.append({"scan": name, "file": "raw.e57", "world_from_scanner": matrix.tolist()})
    (folder / "poses.json").write_text(json.dumps({"scans": rows}))


def test_points_are_placed_by_the_pose_of_the_file(tmp_path: Path) -> None:
    world = e57(tmp_path / "a.e57")
    cloud = open_cloud(tmp_path / "a.e57")
    for _ in range(2):  # a stream begins anew
        assert np.concatenate(list(cloud.stream())) == pytest.approx(world, abs=1e-6)
    assert cloud.scanner == pytest.approx(PLACE)
    assert cloud.records == 400


def test_several_scans_have_no_one_scanner(tmp_path: Path) -> None:
    world = e57(tmp_path / "a.e57", 3)
    cloud = open_cloud(tmp_path / "a.e57")
    assert np.concatenate(list(cloud.stream())) == pytest.approx(world, abs=1e-6)
    assert cloud.scanner is None
    assert cloud.records == 1200


@pytest.mark.parametrize(
    ("file", "names", "found"),
    [
        ("S2.laz", ("S1", "S2", "S10"), 1),
        ("S1.copc.laz", ("S1", "S2"), 0),
        ("S1.2.laz", ("S1", "S1.2"), 1),
        ("S1_left.ply", ("S1", "S1 left"), 1),
        ("S3.laz", ("S1", "S2"), None),
        ("cloud.laz", ("S1", "S2"), None),
    ],
)
def test_the_scan_is_found_by_the_name_of_the_cloud(
    tmp_path: Path, file: str, names: tuple[str, ...], found: int | None
) -> None:
    assert open_cloud(las(tmp_path / file)).scanner is None
    poses(tmp_path, *names)
    scanner = open_cloud(tmp_path / file).scanner
    if found is None:
        assert scanner is None
    else:
        assert scanner == pytest.approx(PLACE + found)


def test_frames_that_nobody_names_are_not_refused(tmp_path: Path) -> None:
    a, b = open_cloud(las(tmp_path / "a.las")), open_cloud(las(tmp_path / "b.las"))
    refuse_other_frames(a, b)
