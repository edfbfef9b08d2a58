"""E57 out and in again, judged by pye57's own reader where frames and poses are concerned."""

from pathlib import Path

import numpy as np
import pye57
import pytest
from scipy.spatial.transform import Rotation

from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.scans.formats import read_scans
from tribrach.scan.scan import Field

FIELDS = (
    Field("intensity", "float32", 0.0, 2.0),
    Field("red", "uint16"),
    Field("green", "uint16"),
    Field("blue", "uint16"),
    Field("time", "float64"),
    Field("return_number", "uint8"),
    Field("number_of_returns", "uint8"),
    Field("row", "int32"),
    Field("column", "int32"),
    Field("normal_x", "float32"),
    Field("normal_y", "float32"),
    Field("normal_z", "float32"),
    Field("sigma_x", "float32", description="sigma of e [m]"),
    Field("classification", "uint8"),
    Field("odd name/1", "uint32", description="counts"),
    Field("signed", "int16"),
    Field("amplitude", "float64"),
)
POSE = Pose(
    Rotation.from_euler("zyx", [37.0, 0.5, -0.2], degrees=True).as_matrix(),
    np.array([590_123.456789, 2_331_987.654321, 12.345678]),
)
STEP = 1e-4


def points(n: int, seed: int = 1) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    rng = np.random.default_rng(seed)
    normals = rng.normal(size=(n, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    kinds = {
        "intensity": rng.uniform(0, 2, n),
        **{c: rng.integers(0, 65536, n) for c in ("red", "green", "blue")},
        "time": rng.uniform(0, 1e9, n),
        "return_number": rng.integers(1, 4, n),
        "number_of_returns": rng.integers(3, 5, n),
        "row": rng.integers(-5, 2000, n),
        "column": rng.integers(0, 4000, n),
        **dict(zip(("normal_x", "normal_y", "normal_z"), normals.T, strict=True)),
        "sigma_x": rng.uniform(1e-3, 1e-2, n),
        "classification": rng.integers(0, 256, n),
        "odd name/1": rng.integers(0, 2**32, n),
        "signed": rng.integers(-32768, 32768, n),
        "amplitude": rng.normal(size=n),
    }
    types = {f.name: f.dtype for f in FIELDS}
    return rng.uniform(-80, 80, (n, 3)), {k: v.astype(types[k]) for k, v in kinds.items()}


def test_a_round_trip_keeps_everything(tmp_path: Path) -> None:
    path = tmp_path / "cloud.e57"
    header = CloudHeader("S 1 <&>", FIELDS, STEP, crs="EPSG:32648", epoch=2020.5, pose=POSE)
    parts = [points(1000, 1), points(1, 2), points(0, 3), points(777, 4)]
    with create(path, header) as writer:
        for xyz, values in parts:
            writer.write(xyz, values)
    (scan,) = read_scans(path)
    chunks = list(scan.chunks(500))
    assert scan.name == "S 1 <&>"
    assert scan.origin == "stated"
    assert scan.warnings == ()
    assert scan.records == 1778 == sum(map(len, chunks))
    xyz = np.concatenate([p[0] for p in parts])
    assert np.abs(np.concatenate([c.xyz for c in chunks]) - xyz).max() < 0.5001 * STEP
    for field in FIELDS:
        truth = np.concatenate([p[1][field.name] for p in parts])
        name = field.name.replace(" ", "_").replace("/", "_")
        read = np.concatenate([c.values[name] for c in chunks])
        assert read.dtype == field.dtype, name
        assert (read == truth).all(), name
    by_name = {f.name: f for f in scan.fields}
    assert by_name["sigma_x"].description == "sigma of e [m]"
    assert by_name["odd_name_1"].description == "counts"
    assert (by_name["intensity"].low, by_name["intensity"].high) == (0.0, 2.0)
    rows, columns = (np.concatenate([p[1][k] for p in parts]) for k in ("row", "column"))
    assert scan.grid == (np.ptp(rows) + 1, np.ptp(columns) + 1)
    assert scan.bounds == pytest.approx(np.stack([xyz.min(0), xyz.max(0)]), abs=STEP)
    assert scan.crs is not None
    assert "UTM zone 48N" in scan.crs


def test_another_reader_places_the_points_to_the_step(tmp_path: Path) -> None:
    """World coordinates of UTM size by pye57 against the pose applied here."""
    path = tmp_path / "cloud.e57"
    xyz, values = points(5000)
    with create(path, CloudHeader("S1", FIELDS[:4], STEP, pose=POSE)) as writer:
        writer.write(xyz, values)
    file = pye57.E57(str(path))
    data = file.read_scan(0, ignore_missing_fields=True)
    header = file.get_header(0)
    assert header.rotation_matrix == pytest.approx(POSE.rotation, abs=1e-15)
    assert (header.translation == POSE.translation).all()
    world = np.stack([data[f"cartesian{a}"] for a in "XYZ"], axis=1)
    assert np.abs(world - POSE @ xyz).max() < 0.5 * np.sqrt(3) * STEP + 2e-9
    assert file.root["coordinateMetadata"].value() == ""
    file.close()


def test_the_same_points_are_the_same_bytes(tmp_path: Path) -> None:
    header = CloudHeader("S1", FIELDS, STEP, pose=POSE)
    for name, seed in (("a.e57", 1), ("b.e57", 1), ("c.e57", 2)):
        with create(tmp_path / name, header) as writer:
            writer.write(*points(3000, seed))
    a, b, c = ((tmp_path / f"{k}.e57").read_bytes() for k in "abc")
    assert a == b
    guids = {read_scans(tmp_path / f"{k}.e57")[0].facts["guid"] for k in "ac"}
    assert len(guids) == 2
    assert a != c


def test_coordinates_beside_an_offset(tmp_path: Path) -> None:
    """Without a pose points may be in the world; the offset makes them fit the integers."""
    path, offset = tmp_path / "a.e57", np.array([590_000.0, 2_331_000.0, 0.0])
    xyz = offset + points(100)[0]
    with create(path, CloudHeader("S1", (), 1e-5, offset)) as writer:
        writer.write(xyz, {})
    (scan,) = read_scans(path)
    assert np.abs(next(scan.chunks()).xyz - xyz).max() < 0.5001e-5
    assert scan.pose is None
    assert scan.origin == "unknown"
    assert "far from (0, 0, 0)" in scan.warnings[0]


def test_no_points_are_a_scan_too(tmp_path: Path) -> None:
    path = tmp_path / "a.e57"
    with create(path, CloudHeader("S1", FIELDS, STEP)):
        pass
    (scan,) = read_scans(path)
    assert list(scan.chunks()) == []
    assert "the scan holds no points" in scan.warnings


def _interrupted(path: Path, header: CloudHeader) -> None:
    with create(path, header) as writer:
        writer.write(*points(10))
        raise KeyboardInterrupt


def test_what_fails_leaves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "cloud.e57"
    path.write_bytes(b"old")
    with pytest.raises(KeyboardInterrupt):
        _interrupted(path, CloudHeader("S", FIELDS, STEP))
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("xyz", "said"),
    [(1e6, r"do not fit steps of 0\.1 mm"), (np.nan, "is not a number")],
)
def test_coordinates_that_do_not_fit(tmp_path: Path, xyz: float, said: str) -> None:
    with (
        pytest.raises(InputError, match=said),
        create(tmp_path / "a.e57", CloudHeader("S", (), STEP)) as writer,
    ):
        writer.write(np.array([[xyz, 0.0, 0.0]]), {})
    assert not list(tmp_path.iterdir())


def test_blocks_do_not_show(tmp_path: Path) -> None:
    """More points at once than the writer hands on at a time."""
    xyz = np.random.default_rng(0).uniform(-9, 9, (230_001, 3))
    for name, pieces in (("a.e57", 1), ("b.e57", 5)):
        with create(tmp_path / name, CloudHeader("S", (), STEP)) as writer:
            for part in np.array_split(xyz, pieces):
                writer.write(part, {})
    read = [np.concatenate([c.xyz for c in read_scans(tmp_path / f"{k}.e57")[0].chunks(70_000)])
            for k in "ab"]  # fmt: skip
    assert np.abs(read[0] - xyz).max() < 0.5001 * STEP
    assert (read[0] == read[1]).all()
