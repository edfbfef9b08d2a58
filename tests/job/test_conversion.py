"""Scans into other formats: names of several files, poses, every field, no halves."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.io.scans.scan_files import whole
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.scans.formats import read_scans
from tribrach.questions.convert import convert_scans
from tribrach.scan.scan import CHUNK, Chunk, Field, Scan

POSE = Pose(
    Rotation.from_euler("zyx", [0.7, -0.3, 0.2]).as_matrix(),
    np.array([590_123.456, 2_331_000.25, 12.5]),
)
NORMALS = ("normal_x", "normal_y", "normal_z")
FIELDS = (
    Field("intensity", "float32", 0.0, 65535.0),
    Field("time", "float64"),
    Field("row", "int32"),
    *(Field(name, "float32") for name in NORMALS),
    Field("sigma_x", "float32", description="sigma of e [m]"),
)
N = 700


@dataclass(frozen=True)
class Given(Scan):
    """A scan in memory."""

    points: Chunk = field(default_factory=lambda: Chunk(np.zeros((0, 3)), {}))

    def stored(self, size: int = CHUNK, start: int = 0) -> Iterator[Chunk]:
        for first in range(start, len(self.points), 300):
            part = slice(first, first + 300)
            values = {name: column[part] for name, column in self.points.values.items()}
            yield Chunk(self.points.xyz[part], values)


def given_scan(name: str = "S1", pose: Pose | None = POSE, seed: int = 1) -> Given:
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(N, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    values = {
        "intensity": rng.integers(0, 65536, N).astype(np.float32),
        "time": rng.uniform(0, 1e6, N),
        "row": rng.integers(0, 1000, N).astype(np.int32),
        **dict(zip(NORMALS, normals.astype(np.float32).T, strict=True)),
        "sigma_x": rng.uniform(1e-3, 1e-2, N).astype(np.float32),
    }
    points = Chunk(rng.uniform(-40, 40, (N, 3)), values)
    return Given(name, Path(f"{name}.src"), records=N, fields=FIELDS, pose=pose, points=points)


def quiet(what: str, done: int, total: int | None) -> None:
    """No display."""


def converted(
    scans: list[Given], path: Path, placed: bool = False, step: float = 1e-4
) -> list[tuple[Path, int]]:
    written = convert_scans(scans, path, placed=placed, step=step, progress=quiet)
    return [(one.path, one.points) for one in written]


def by_time(chunk: Chunk) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Points and values in the order of time: COPC has an order of its own."""
    order = np.argsort(chunk.values["time"])
    return chunk.xyz[order], {name: column[order] for name, column in chunk.values.items()}


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("a.las", "a-2.las"),
        ("a.laz", "a-2.laz"),
        ("a.copc.laz", "a-2.copc.laz"),
        ("site.2024-05.copc.laz", "site.2024-05-2.copc.laz"),
        ("site.v1.las", "site.v1-2.las"),
        ("A.COPC.LAZ", "A-2.COPC.LAZ"),
        ("a.ply", "a-2.ply"),
        ("a.e57", "a-2.e57"),
    ],
)
def test_several_scans_are_numbered_before_the_suffix(
    tmp_path: Path, name: str, expected: str
) -> None:
    scans = [given_scan("S1"), given_scan("S2", seed=2)]
    written = converted(scans, tmp_path / name)
    assert [path.name for path, _ in written] == [expected.replace("-2.", "-1."), expected]
    assert [points for _, points in written] == [N, N]
    assert sorted(tmp_path.iterdir()) == [path for path, _ in written]
    for scan, (path, _) in zip(scans, written, strict=True):
        (found,) = read_scans(path)
        xyz, values = by_time(whole(found))
        expected_xyz, expected_values = by_time(scan.points)
        assert np.abs(xyz - expected_xyz).max() < 0.501e-4
        assert np.array_equal(values["row"], expected_values["row"])
    if "copc" in name.lower():
        assert written[0][0].read_bytes()[377:381] == b"copc"


@pytest.mark.parametrize("suffix", [".las", ".laz", ".copc.laz", ".ply", ".e57"])
@pytest.mark.parametrize("placed", [False, True])
def test_every_field_is_kept_and_poses_are_applied(
    tmp_path: Path, suffix: str, placed: bool
) -> None:
    """Truth from the pose; E57 keeps points in the scanner frame and the pose beside them."""
    scan = given_scan()
    path = tmp_path / f"a{suffix}"
    assert converted([scan], path, placed) == [(path, N)]
    (found,) = read_scans(path)
    moved = placed and suffix != ".e57"
    xyz, values = by_time(whole(found))
    expected_xyz, expected = by_time(scan.points)
    normals = np.stack([expected[name] for name in NORMALS], axis=1)
    if moved:
        expected_xyz = expected_xyz @ POSE.rotation.T + POSE.translation
        normals = normals @ POSE.rotation.T
    assert np.abs(xyz - expected_xyz).max() < 0.501e-4
    assert np.stack([values[n] for n in NORMALS], axis=1) == pytest.approx(normals, abs=1e-6)
    for name in ("intensity", "time", "row", "sigma_x"):
        assert np.array_equal(values[name], expected[name]), name
    if suffix == ".e57":
        assert found.pose is not None
        assert found.pose.rotation == pytest.approx(POSE.rotation, abs=1e-12)
        assert found.pose.translation == pytest.approx(POSE.translation, abs=1e-9)


@pytest.mark.parametrize("step", [1e-5, 1e-3])
def test_the_step_is_that_asked_for(tmp_path: Path, step: float) -> None:
    scan = given_scan()
    converted([scan], tmp_path / "a.laz", step=step)
    (found,) = read_scans(tmp_path / "a.laz")
    off = np.abs(by_time(whole(found))[0] - by_time(scan.points)[0]).max()
    assert 0.4 * step < off < 0.501 * step


def test_a_scan_without_pose_is_not_placed(tmp_path: Path) -> None:
    scan = given_scan(pose=None)
    with pytest.raises(InputError, match="scan S1 has no pose to be placed by"):
        converted([scan], tmp_path / "a.laz", placed=True)
    assert not list(tmp_path.iterdir())
    assert converted([scan], tmp_path / "a.laz") == [(tmp_path / "a.laz", N)]


def test_no_source_is_overwritten(tmp_path: Path) -> None:
    """Nor by the second of several files, whose name is made up."""
    converted([given_scan()], tmp_path / "a-2.las")
    before = (tmp_path / "a-2.las").read_bytes()
    scans = list(read_scans(tmp_path / "a-2.las"))
    with pytest.raises(InputError, match="overwrite its source"):
        convert_scans(scans, tmp_path / "." / "a-2.las", placed=False, step=1e-4, progress=quiet)
    with pytest.raises(InputError, match=r"a-2\.las: the file would overwrite its source"):
        convert_scans(2 * scans, tmp_path / "a.las", placed=False, step=1e-4, progress=quiet)
    assert (tmp_path / "a-2.las").read_bytes() == before
    assert list(tmp_path.iterdir()) == [tmp_path / "a-2.las"]


def test_progress_and_ctrl_c(tmp_path: Path) -> None:
    heard = []

    def hear(what: str, done: int, total: int | None) -> None:
        heard.append((what, done, total))
        if len(heard) == 5:
            raise KeyboardInterrupt

    scans = [given_scan("S1"), given_scan("S2")]
    with pytest.raises(KeyboardInterrupt):
        convert_scans(scans, tmp_path / "a.copc.laz", placed=False, step=1e-4, progress=hear)
    assert heard == [
        *(("S1", done, N) for done in (300, 600, 700)),
        *(("S2", done, N) for done in (300, 600)),
    ]
    assert [path.name for path in tmp_path.iterdir()] == ["a-1.copc.laz"]


def test_no_scans_make_no_files(tmp_path: Path) -> None:
    assert converted([], tmp_path / "a.laz") == []
    assert not list(tmp_path.iterdir())


# the cubes of COPC are 6 m high, which 32 bits do not divide into steps of 1e-9
@pytest.mark.parametrize(("suffix", "step"), [(".laz", 1e-9), (".e57", 1e-9), (".copc.laz", 1e-8)])
def test_degrees_without_a_reference_system_keep_their_digits(
    tmp_path: Path, suffix: str, step: float
) -> None:
    near, middle = np.random.default_rng(1).uniform(-1, 1, (200, 3)), np.array([11.5, 48.1, 520.0])
    near *= [4e-5, 3e-5, 3.0]
    scan = Given("d", tmp_path / "d.ply", records=200, points=Chunk(near + middle, {}))
    convert_scans([scan], tmp_path / f"d{suffix}", placed=False, step=None, progress=quiet)
    (back,) = read_scans(tmp_path / f"d{suffix}")
    off = np.abs(np.sort(whole(back).xyz, axis=0) - np.sort(scan.points.xyz, axis=0))
    assert (off.max(axis=0) <= [0.51 * step, 0.51 * step, 6e-5]).all()
