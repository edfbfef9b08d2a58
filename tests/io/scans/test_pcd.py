"""PCD in its three encodings, against files that pypcd4 writes."""

from pathlib import Path

import numpy as np
import pytest
from pypcd4 import Encoding, MetaData, PointCloud
from scipy.spatial.transform import Rotation

from tests.io.scans.scan_files import same, whole, written
from tribrach.errors import InputError
from tribrach.io.scans.formats import read_scans

ENCODINGS = (Encoding.ASCII, Encoding.BINARY, Encoding.BINARY_COMPRESSED)
NAMES = ("x", "y", "z", "intensity", "rgb", "ring")
TYPES = (np.float32, np.float64, np.float32, np.float32, np.uint32, np.uint16)
TURN = Rotation.from_rotvec([0.1, -0.2, 0.9])
VIEW = (590_000.5, 2_331_000.25, 12.0, *TURN.as_quat()[[3, 0, 1, 2]])


def cloud(n: int = 999) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(4)
    return (
        *[rng.normal(0, 8, n).round(3).astype(t) for t in TYPES[:3]],
        rng.integers(0, 99, n).astype(np.float32),
        rng.integers(0, 2**24, n).astype(np.uint32),
        rng.integers(0, 64, n).astype(np.uint16),
    )


def save(path: Path, columns: tuple[np.ndarray, ...], encoding: Encoding, **parts: object) -> Path:
    n = len(columns[0])
    given = {"width": n, "height": 1, "viewpoint": (0, 0, 0, 1, 0, 0, 0)} | parts
    meta = MetaData(
        fields=NAMES,
        size=tuple(np.dtype(t).itemsize for t in TYPES),
        type=tuple({"f": "F", "u": "U"}[np.dtype(t).kind] for t in TYPES),
        count=(1,) * len(NAMES),
        points=n,
        data=encoding,
        **given,
    )
    record = np.empty(n, dtype=list(zip(NAMES, TYPES, strict=True)))
    for name, column in zip(NAMES, columns, strict=True):
        record[name] = column
    PointCloud(meta, record).save(path, encoding=encoding)
    return path


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_what_another_library_writes(tmp_path: Path, encoding: Encoding) -> None:
    columns = cloud()
    (scan,) = read_scans(save(tmp_path / "a.pcd", columns, encoding))
    assert (scan.records, scan.pose, scan.origin, scan.grid) == (999, None, "assumed", None)
    assert scan.names == ("intensity", "red", "green", "blue", "ring")
    got = whole(scan, 100)
    tolerance = 1e-9 if encoding is not Encoding.ASCII else 1e-6
    assert np.abs(got.xyz - np.stack(columns[:3], axis=1)).max() < tolerance
    assert np.array_equal(got.values["intensity"], columns[3])
    assert np.array_equal(got.values["red"], (columns[4] >> 16) * 257)
    assert np.array_equal(got.values["blue"], (columns[4] & 255) * 257)
    assert np.array_equal(got.values["ring"], columns[5])
    same(whole(scan, 100, start=321), whole(scan, 999, start=321))
    assert np.array_equal(whole(scan, 100, start=321).xyz, got.xyz[321:])


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_viewpoint_grid_and_nan(tmp_path: Path, encoding: Encoding) -> None:
    columns = cloud(12)
    columns[0][[2, 7]] = np.nan
    path = save(tmp_path / "a.pcd", columns, encoding, viewpoint=VIEW, width=4, height=3)
    (scan,) = read_scans(path)
    assert scan.grid == (3, 4)
    assert scan.pose is not None
    assert scan.pose.translation == pytest.approx(VIEW[:3])
    assert scan.pose.rotation == pytest.approx(TURN.as_matrix(), abs=1e-6)
    got = whole(scan, 5)
    kept = np.delete(np.arange(12), [2, 7])
    assert got.dropped == 2
    assert np.array_equal(got.values["row"], kept // 4)
    assert np.array_equal(got.values["column"], kept % 4)
    assert {"row", "column"} <= set(scan.names)


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_counts_must_fit(tmp_path: Path, encoding: Encoding) -> None:
    path = save(tmp_path / "a.pcd", cloud(), encoding)
    good = path.read_bytes()
    start = good.index(b"DATA")
    for cut in (start, start + 30, (start + len(good)) // 2, len(good) - 50):
        path.write_bytes(good[:cut])
        with pytest.raises(InputError):
            sum(map(len, read_scans(path)[0].chunks()))
    many = good.replace(b"WIDTH 999\n", b"WIDTH 9990000000000\n").replace(
        b"POINTS 999\n", b"POINTS 9990000000000\n"
    )
    with pytest.raises(InputError, match="states 9990000000000 points"):
        read_scans(written(tmp_path, "a.pcd", many))
    with pytest.raises(InputError, match="999 x 1 are not 998 POINTS"):
        read_scans(written(tmp_path, "a.pcd", good.replace(b"POINTS 999\n", b"POINTS 998\n")))


def test_damaged_compression_never_leaves_its_memory(tmp_path: Path) -> None:
    path = save(tmp_path / "a.pcd", cloud(), Encoding.BINARY_COMPRESSED)
    good = path.read_bytes()
    start = good.index(b"compressed\n") + 19
    rng = np.random.default_rng(0)
    ends = set()
    for _ in range(60):
        bad = bytearray(good)
        for at in rng.integers(start, len(good), 20):
            bad[at] = rng.integers(0, 256)
        path.write_bytes(bytes(bad))
        try:
            ends.add(sum(map(len, read_scans(path)[0].chunks())) <= 999)
        except InputError as error:
            ends.add("damaged" in str(error))
    assert ends == {True}


def test_fields_of_several_values_and_padding(tmp_path: Path) -> None:
    text = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z _ hist\nSIZE 4 4 4 1 4\nTYPE F F F U F\n"
        "COUNT 1 1 1 2 3\nWIDTH 2\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n"
        "1 2 3 0 0 7 8 9\n4 5 6 0 0 1 2 3\n"
    )
    (scan,) = read_scans(written(tmp_path, "a.pcd", text))
    assert scan.names == ("hist",)
    assert np.array_equal(whole(scan).values["hist"], [[7, 8, 9], [1, 2, 3]])


def test_coordinates_of_several_values_are_refused(tmp_path: Path) -> None:
    text = (
        "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 2 1 1\nWIDTH 1\nHEIGHT 1\n"
        "POINTS 1\nDATA ascii\n1 2 3 4\n"
    )
    with pytest.raises(InputError, match="several values for one point"):
        read_scans(written(tmp_path, "a.pcd", text))


@pytest.mark.parametrize(
    ("line", "other"),
    [
        ("TYPE F F F", "TYPE F F Q"),
        ("SIZE 4 4 4", "SIZE 4 4 5"),
        ("SIZE 4 4 4", "SIZE 4 4"),
        ("WIDTH 1", "WIDTH -1"),
        ("WIDTH 1", "BREADTH 1"),
        ("DATA ascii", "DATA zipped"),
        ("FIELDS x y z", "FIELDS a b c"),
        ("COUNT 1 1 1", "COUNT 1 1 999999999"),
        ("VIEWPOINT 0 0 0 1 0 0 0", "VIEWPOINT 0 0 0 0 0 0 0"),
    ],
)
def test_a_wrong_header_is_a_sentence(tmp_path: Path, line: str, other: str) -> None:
    text = (
        "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\n"
        "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 1\nDATA ascii\n1 2 3\n"
    )
    assert len(whole(read_scans(written(tmp_path, "a.pcd", text))[0])) == 1
    with pytest.raises(InputError, match=r"not understood|no columns"):
        read_scans(written(tmp_path, "a.pcd", text.replace(line, other)))


@pytest.mark.data
def test_an_empty_one(shared_data: Path) -> None:
    with pytest.raises(InputError, match="the file is empty"):
        read_scans(shared_data / "scans/formats/slope/empty.pcd")


def test_fields_without_values_and_stored_data(tmp_path: Path) -> None:
    """Drivers pad with fields of count 0; what LZF does not shorten is stored."""
    points = np.random.default_rng(8).normal(size=(40, 3)).astype("<f4")
    head = "VERSION 0.7\nFIELDS x y _ z pad\nSIZE 4 4 1 4 2\nTYPE F F U F U\nCOUNT 1 1 0 1 0\n"
    head += "WIDTH 40\nHEIGHT 1\nPOINTS 40\nDATA "
    plain = written(tmp_path, "a.pcd", f"{head}binary\n".encode() + points.tobytes())
    assert np.array_equal(whole(read_scans(plain)[0]).xyz, points)
    columns = np.ascontiguousarray(points.T).tobytes()
    sizes = np.array([len(columns)] * 2, dtype="<u4").tobytes()
    content = f"{head}binary_compressed\n".encode() + sizes + columns
    stored = written(tmp_path, "b.pcd", content)
    assert np.array_equal(whole(read_scans(stored)[0]).xyz, points)
