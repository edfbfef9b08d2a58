"""Every suspicious thing is said, and nothing is said of a clean scan."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.io.scans.scan_files import lines, written
from tests.io.scans.test_ptx import header
from tribrach.answers import plain
from tribrach.cli import app
from tribrach.geometry.pose import Pose
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.scans.formats import read_scans
from tribrach.io.scans.info import Description, describe
from tribrach.scan.scan import Field


def sphere(rows: int = 100, columns: int = 240, step: float = 5e-3) -> np.ndarray:
    """Points of a grid of H and V at 5 to 7 m, in all digits."""
    h, v = np.meshgrid(step * np.arange(columns), 1.2 + step * np.arange(rows))
    r = 6 + np.sin(7 * h)
    return np.stack(
        [r * np.sin(v) * np.cos(h), r * np.sin(v) * np.sin(h), r * np.cos(v)], axis=-1
    ).reshape(-1, 3)


def described(
    folder: Path, xyz: np.ndarray, name: str = "a.xyz", head: str = "x y z"
) -> Description:
    (scan,) = read_scans(written(folder, name, lines(head, xyz)))
    return describe(scan)


def test_a_clean_scan_says_nothing_wrong(tmp_path: Path) -> None:
    xyz = sphere()
    found = described(tmp_path, xyz)
    assert found.sentences == []
    assert found.title == "a.xyz"
    assert found.step == pytest.approx((5e-3, 5e-3), rel=0.02)
    assert found.ranges == pytest.approx(
        np.quantile(np.linalg.norm(xyz, axis=1), [0, 0.05, 0.5, 0.95, 1])
    )
    rows = dict(found.rows())
    assert rows["points"] == "24000 of 24000 records, 0 hold no point"
    assert rows["scanner"].startswith("at zero, assumed")
    assert rows["pose"] == rows["CRS"] == "none"
    data = plain(found)
    assert np.array_equal(data["bounds"], [xyz.min(axis=0), xyz.max(axis=0)])
    assert json.loads(json.dumps(data, allow_nan=False)) == data


def one(found: Description, words: str) -> None:
    assert len([s for s in found.sentences if words in s]) == 1, found.sentences


def test_what_is_wrong_with_coordinates(tmp_path: Path) -> None:
    xyz = sphere()
    far = (xyz + np.array([4_000_000, 0, 0])).astype(np.float32).astype(float)
    one(described(tmp_path, far), "at 4000007 m they resolve 2.5e+02 mm")
    one(described(tmp_path, far), "Where the scanner stood")
    one(described(tmp_path, xyz.round(2)), "multiples of 10 mm")
    assert described(tmp_path, xyz.round(4)).sentences == []
    beams = "7 of 24007 points (0.029 %) are beams without return"
    one(described(tmp_path, np.vstack([xyz, np.zeros((7, 3))])), beams)
    one(described(tmp_path, np.vstack([xyz, xyz[:6000]])), "20 % of the points are there more")
    some = xyz.copy()
    some[:240] = np.nan
    one(described(tmp_path, some), "240 records (1 %) hold no point")


@pytest.mark.parametrize(("factor", "words"), [(1e4, "km"), (1e200, "e+19")])
def test_coordinates_that_are_no_metres(tmp_path: Path, factor: float, words: str) -> None:
    """Tenths of a millimetre, or garbage: said without overflowing, in every format of lines."""
    xyz = factor * sphere(20, 30, 0.05)
    found = described(tmp_path, xyz)
    (said,) = [s for s in found.sentences if s.endswith("are the coordinates metres?")]
    assert words in said
    text = header(20, 30) + "\n" + "".join(f"{x!r} {y!r} {z!r} 0.5\n" for x, y, z in xyz.tolist())
    (scan,) = read_scans(written(tmp_path, "a.ptx", text.encode()))
    assert any("are the coordinates metres?" in s for s in describe(scan).sentences)


def test_what_is_wrong_with_values(tmp_path: Path) -> None:
    xyz = sphere()
    values = np.column_stack([xyz, np.full(len(xyz), 0.25), np.arange(len(xyz))])
    values[5, 4] = np.nan
    found = described(tmp_path, values, head="x y z intensity gain")
    one(found, "All intensities are 0.25")
    one(found, "1 values of gain are not finite")
    assert dict(found.rows())["field gain"] == "float64, 0 to 23999"


def test_poses(tmp_path: Path) -> None:
    xyz = np.column_stack([sphere(2, 3), np.arange(6) / 6])
    text = lines(header(3, 2, np.eye(3), np.zeros(3)), xyz, header(3, 2), xyz)
    first, second = read_scans(written(tmp_path, "a.ptx", text))
    one(describe(first, among=2), "The pose is the identity although the file has 2 scans")
    assert describe(first).sentences == []
    assert describe(second, among=2).sentences == []
    assert dict(describe(second).rows())["pose"].startswith("590123.4560 2331000.2500 12.5000 m")
    mirror = replace(second, pose=Pose(np.diag([1.0, 1, -1]), np.zeros(3)))
    one(describe(mirror), "The pose mirrors")


def test_headers_that_lie_and_empty_scans(tmp_path: Path) -> None:
    path = tmp_path / "a.las"
    with create(path, CloudHeader("a", (Field("intensity", "float32"),), crs="EPSG:32648")) as w:
        w.write(sphere(), {"intensity": np.arange(24_000, dtype=np.float32)})
    (scan,) = read_scans(path)
    assert describe(scan).sentences == []
    assert dict(describe(scan).rows())["CRS"] == "WGS 84 / UTM zone 48N (EPSG:32648)"
    assert scan.bounds is not None
    lying = replace(scan, bounds=scan.bounds + np.array([[0], [0.5]]))
    one(describe(lying), "differ from the points' by 0.500 m")
    with create(tmp_path / "b.las", CloudHeader("b")) as w:
        w.write(np.zeros((0, 3)), {})
    assert describe(read_scans(tmp_path / "b.las")[0]).sentences == ["The scan has no points."]


@pytest.mark.parametrize(
    ("value", "share", "words"),
    [
        (np.nan, 6, "None of the bounds in the header is a finite number"),
        (np.nan, 2, "Some bounds in the header are not finite numbers"),
        (np.inf, 1, "Some bounds in the header are not finite numbers"),
    ],
)
def test_bounds_that_are_no_numbers(tmp_path: Path, value: float, share: int, words: str) -> None:
    path = tmp_path / "a.las"
    with create(path, CloudHeader("a")) as w:
        w.write(sphere(), {})
    # the six bounds of a LAS header are eight bytes each from byte 179 on
    data = bytearray(path.read_bytes())
    data[179 : 179 + 8 * share] = np.full(share, value).tobytes()
    path.write_bytes(data)
    (scan,) = read_scans(path)
    found = describe(scan)
    one(found, words)
    assert not [s for s in found.sentences if "nan" in s or "differ" in s]
    assert json.loads(json.dumps(plain(found), allow_nan=False)) == plain(found)
    result = CliRunner().invoke(app, ["info", str(path)])
    assert result.exit_code == 0
    assert words in " ".join(result.output.split())


def test_the_command(tmp_path: Path) -> None:
    path = written(tmp_path, "a.xyz", lines(sphere().round(2)))
    out = tmp_path / "a.json"
    result = CliRunner().invoke(app, ["info", str(path), "--json", str(out)])
    assert result.exit_code == 0
    assert "! All coordinates are multiples of 10 mm." in result.output
    assert json.loads(out.read_text())["scans"][0]["points"] == 24_000
