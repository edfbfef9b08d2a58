"""Formats are added as docs/extending.md says: its own example, and one of text."""

import re
from pathlib import Path

import numpy as np
import pytest

import tribrach.io.scans
from tests.io.scans.scan_files import whole, written
from tribrach.errors import InputError
from tribrach.io.scans.formats import READERS, read_scans

ROOT = Path(__file__).resolve().parents[3]
DIFF = (ROOT / "docs" / "extending" / "scans.diff").read_text()


@pytest.fixture
def kitti(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The package of readers with the page's file and the page's line."""
    line, file = DIFF.split("--- /dev/null\n")
    (suffix, module), *more = re.findall(r'^\+ +"(\.\w+)": "(\w+)",$', line, re.MULTILINE)
    assert not more
    assert len(re.findall(r"^\+(?!\+)", line, re.MULTILINE)) == 1, "one line is added"
    folder = tmp_path / "readers"
    folder.mkdir()
    lines = [text[1:] for text in file.splitlines() if text.startswith("+") and text[:3] != "+++"]
    (folder / f"{module}.py").write_text("\n".join([*lines, ""]))
    monkeypatch.setattr(tribrach.io.scans, "__path__", [*tribrach.io.scans.__path__, str(folder)])
    monkeypatch.setitem(READERS, suffix, module)


@pytest.mark.usefixtures("kitti")
def test_points_of_a_kitti_scan(tmp_path: Path) -> None:
    points = np.random.default_rng(3).uniform(0, 1, (1000, 4)).astype("<f4")
    points[7, 1] = np.nan
    (scan,) = read_scans(written(tmp_path, "000000.bin", points.tobytes()))
    assert (scan.records, scan.origin, scan.names) == (1000, "stated", ("intensity",))
    assert (scan.fields[0].low, scan.fields[0].high) == (0.0, 1.0)
    cloud, kept = whole(scan, 300), np.delete(points, 7, axis=0)
    assert np.array_equal(cloud.xyz, kept[:, :3].astype(float))
    assert np.array_equal(cloud.values["intensity"], kept[:, 3])


@pytest.mark.usefixtures("kitti")
def test_a_cut_kitti_scan_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="ends within a point"):
        read_scans(written(tmp_path, "000000.bin", bytes(np.ones(9, "<f4").tobytes())))


#: a reader of lines of horizontal angle [deg], zenith angle [deg] and range [m]
POLAR = """
import numpy as np

from tribrach.io.scans.columns import arranged
from tribrach.io.scans.origin import scan_name
from tribrach.io.scans.text import Lines
from tribrach.io.unpacking import unpacked
from tribrach.io.scans.text_scan import TextScan

NAMES = ("x", "y", "z")


class PolarScan(TextScan):
    def _numbers(self, lines, block, columns):
        angle, zenith, length = super()._numbers(lines, block, columns)
        angle, zenith = np.radians(angle), np.radians(zenith)
        flat = length * np.sin(zenith)
        return [flat * np.cos(angle), flat * np.sin(angle), length * np.cos(zenith)]


def read(path):
    with unpacked(path) as file:
        records, _ = Lines(file, path).survey()
    types = dict.fromkeys(NAMES, "float64")
    columns = arranged(types, {name: np.zeros(1) for name in NAMES}, path)
    return (
        PolarScan(
            name=scan_name(path), path=path, records=records, origin="stated", types=types,
            columns=columns,
        ),
    )
"""


@pytest.fixture
def polar(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The package of readers with one of text and its line."""
    folder = tmp_path / "readers"
    folder.mkdir()
    (folder / "polar.py").write_text(POLAR)
    monkeypatch.setattr(tribrach.io.scans, "__path__", [*tribrach.io.scans.__path__, str(folder)])
    monkeypatch.setitem(READERS, ".pol", "polar")


@pytest.mark.usefixtures("polar")
def test_lines_of_a_new_format_are_not_taken_for_coordinates(tmp_path: Path) -> None:
    text = "0 90 2\n90 90 3\n0 0 4\n"
    (scan,) = read_scans(written(tmp_path, "a.pol", text))
    assert np.allclose(whole(scan).xyz, [[2, 0, 0], [0, 3, 0], [0, 0, 4]], atol=1e-12)
    (plain,) = read_scans(written(tmp_path, "a.xyz", text))
    assert np.array_equal(whole(plain).xyz, [[0, 90, 2], [90, 90, 3], [0, 0, 4]])
