"""Text of points: dialects, named columns, guesses, compressed files."""

import bz2
import gzip
import lzma
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.io.scans.scan_files import lines, same, whole, written
from tribrach.errors import InputError
from tribrach.io.scans import text as text_module
from tribrach.io.scans.formats import read_scans

FINITE = st.floats(-1e8, 1e8)
DIALECTS = [" ", "\t", ",", ";", " ; ", ", ", "   "]


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(FINITE, FINITE, st.floats(-9e3, 9e3), FINITE), min_size=1, max_size=20),
    st.sampled_from(DIALECTS),
    st.sampled_from(["x y z gain", "//X Y Z gain", "# x y z gain", None]),
    st.sampled_from(["\n", "\r\n", "\n\n"]),
    st.integers(1, 25),
)
def test_every_dialect_comes_back(
    rows: list[tuple[float, ...]], blank: str, names: str | None, end: str, size: int
) -> None:
    text = lines(rows).replace(" ", blank)
    if names is not None:
        text = names.replace(" ", blank if names[0] == "x" else " ") + "\n" + text
    with tempfile.TemporaryDirectory() as folder:
        (scan,) = read_scans(written(Path(folder), "a.txt", text.replace("\n", end)))
        got = whole(scan, size)
    assert scan.records == len(rows)
    assert np.array_equal(got.xyz, np.array(rows)[:, :3])
    name = "intensity" if names is None else "gain"
    kind = np.float32 if names is None else np.float64
    assert np.array_equal(got.values[name], np.array(rows)[:, 3].astype(kind))
    assert bool(scan.warnings) == (names is None)


def test_columns_by_their_names(tmp_path: Path) -> None:
    text = "Easting;Northing;Height;R;G;B;scalar_Intensity;Nx;quality\n1;2;3;255;0;128;0,5;1;7\n"
    (scan,) = read_scans(written(tmp_path, "a.csv", text))
    assert scan.names == ("red", "green", "blue", "intensity", "normal_x", "quality")
    got = whole(scan)
    assert np.array_equal(got.xyz, [[1, 2, 3]])
    assert got.values["intensity"][0] == 0.5
    assert [int(got.values[c][0]) for c in ("red", "green", "blue")] == [65535, 0, 257 * 128]


@pytest.mark.parametrize(
    ("row", "names"),
    [
        ("1.5 2 3 10 20 30", "red green blue"),
        ("1.5 2 3 0.6 0 0.8", "normal_x normal_y normal_z"),
        ("1.5 2 3 10 20 30 0.5", "red green blue intensity"),
        ("1.5 2 3 -7 10 20 30", "intensity red green blue"),
        ("1.5 2 3 0.5 0.1", "intensity column_5"),
        ("1.5 2 3 10 20 30 0.6 0 0.8", "red green blue normal_x normal_y normal_z"),
    ],
)
def test_columns_by_what_they_hold(tmp_path: Path, row: str, names: str) -> None:
    (scan,) = read_scans(written(tmp_path, "a.xyz", f"{row}\n{row}\n"))
    assert scan.names == tuple(names.split())
    assert len(whole(scan)) == 2


@pytest.mark.parametrize(
    ("top", "words"),
    [("255 3 1", 257 * 255), ("60000 3 1", 60000), ("1.0 0.25 0", 65535)],
)
def test_colours_fill_sixteen_bits(tmp_path: Path, top: str, words: int) -> None:
    (scan,) = read_scans(written(tmp_path, "a.txt", f"x y z r g b\n1 2 3 {top}\n"))
    assert whole(scan).values["red"][0] == words


@pytest.mark.parametrize("pack", [gzip.compress, lzma.compress, bz2.compress])
def test_compressed_text(tmp_path: Path, pack: object) -> None:
    table = np.random.default_rng(1).normal(0, 5, (3000, 3))
    plain = read_scans(written(tmp_path, "a.xyz", lines(table)))[0]
    data = pack(lines(table).encode())  # type: ignore[operator]
    (scan,) = read_scans(written(tmp_path, "b.1.xyz.gz", data))
    assert scan.name == "b.1"
    same(whole(scan, 777), whole(plain))
    same(whole(scan, 777, start=1234), whole(plain, start=1234))
    with pytest.raises(InputError, match="damaged or end too soon"):
        read_scans(written(tmp_path, "c.xyz.gz", data[: len(data) // 2]))


def test_chunks_do_not_depend_on_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    table = np.random.default_rng(2).normal(0, 5, (2000, 4))
    text = "X,Y,Z,I\r\n" + lines(table).replace(" ", ",").replace("\n", "\r\n\r\n")
    path = written(tmp_path, "a.csv", text)
    (scan,) = read_scans(path)
    expected = whole(scan)
    for block in (200, 1000, 4097):
        monkeypatch.setattr(text_module, "BLOCK", block)
        (scan,) = read_scans(path)
        assert scan.records == 2000
        same(whole(scan, 333), expected)
        same(whole(scan, 333, start=1500), whole(scan, 10, start=1500))


def test_a_count_before_the_points(tmp_path: Path) -> None:
    (scan,) = read_scans(written(tmp_path, "a.txt", "//X Y Z\n2\n1 2 3\n4 5 6\n"))
    assert len(whole(scan)) == 2
    with pytest.raises(InputError, match="states 4 points and the file holds 2"):
        read_scans(written(tmp_path, "a.txt", "//X Y Z\n4\n1 2 3\n4 5 6\n"))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty"),
        ("\n\n", "no points"),
        ("# only words\n", "no points"),
        ("1 2\n3 4\n", "no points x y z"),
        ("a b c\n1 2 3\n", "names no columns x, y and z"),
        ("x y z i\n1 2 3\n", "4 columns are named .* lines have 3 values"),
        ("\xff\xfe1\x00 \x00", "UTF-16"),
    ],
)
def test_what_is_no_cloud_is_a_sentence(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_scans(written(tmp_path, "a.txt", text.encode("latin-1")))


def test_numbers_are_read_as_any_program_writes_them(tmp_path: Path) -> None:
    cells = [".5 +1.5 5.", "1E+03 -.25e-1 00012", "1e-320 -0 123456789012345678901234567890"]
    (scan,) = read_scans(written(tmp_path, "a.txt", "\n".join([*cells, "1 2 3"])))
    expected = [[float(cell) for cell in line.split()] for line in [*cells, "1 2 3"]]
    assert np.array_equal(whole(scan).xyz, expected)


def test_text_in_many_pieces_comes_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tribrach.io.scans.text_scan._PIECE", 100)
    numbers = np.random.default_rng(1).normal(size=(200, 3))
    (scan,) = read_scans(written(tmp_path, "a.txt", lines([tuple(row) for row in numbers])))
    assert np.array_equal(whole(scan).xyz, numbers)
    path = written(tmp_path, "b.txt", lines([tuple(row) for row in numbers]) + "1 2\n3 4 5 6\n")
    with pytest.raises(InputError, match=r"b\.txt:201.*2 values where 3"):
        whole(read_scans(path)[0])


@pytest.mark.parametrize(
    "cell", ["true", "1_0", "0x10", "[4", "1e", "--1", "1-2", "nanx", "1\x00", "١"]
)
def test_what_is_no_number_is_refused(tmp_path: Path, cell: str) -> None:
    (scan,) = read_scans(written(tmp_path, "a.txt", f"1 2 3\n4 {cell} 6\n7 8 9\n"))
    with pytest.raises(InputError, match=r"a\.txt:2.*is no number"):
        whole(scan)


def test_a_malformed_line_is_named(tmp_path: Path) -> None:
    text = "# made by hand\n\nx,y,z\n" + 30 * "1,2,3\n" + "1,,3\n1,2,,3\n"
    (scan,) = read_scans(written(tmp_path, "a.csv", text))
    with pytest.raises(InputError, match=r"a\.csv:35.*4 values where 3"):
        whole(scan)


def test_a_line_without_end_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(text_module, "BLOCK", 1000)
    with pytest.raises(InputError, match="a line has no end"):
        read_scans(written(tmp_path, "a.xyz", "1 " * 5000))


@pytest.mark.data
def test_real_ones(shared_data: Path) -> None:
    (scan,) = read_scans(shared_data / "targets/nist_spheres/SPH101.xyz")
    assert (len(whole(scan)), scan.origin) == (6474, "assumed")
    paths = sorted((shared_data / "targets/checkerboards").glob("*.txt.xz"))
    assert len({read_scans(path)[0].name for path in paths}) == len(paths) == 11
    (scan,) = read_scans(paths[0])
    assert (scan.name, scan.names) == ("SP1_T1.1", ("red", "green", "blue", "intensity"))
    (scan,) = read_scans(shared_data / "scans/icp_pair/car_cloud400.csv")
    assert (len(whole(scan)), scan.names) == (24989, ("normal_x", "normal_y", "normal_z"))
