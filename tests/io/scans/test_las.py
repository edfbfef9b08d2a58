"""LAS and LAZ in: chunks, start, damage, and what headers may claim."""

import struct
from pathlib import Path

import laspy
import numpy as np
import pytest

from tests.io.scans.scan_files import same, whole, written
from tribrach.errors import InputError
from tribrach.io.scans.formats import read_scans
from tribrach.scan.scan import Chunk


def las(path: Path, n: int = 120_000, point_format: int = 7, center: float = 0.0) -> Path:
    rng = np.random.default_rng(6)
    header = laspy.LasHeader(point_format=point_format, version="1.4")
    header.scales, header.offsets = np.full(3, 1e-4), np.full(3, center)
    header.add_extra_dim(laspy.ExtraBytesParams("gain", np.float32, "of the receiver"))
    file = laspy.LasData(header)
    file.x, file.y, file.z = center + rng.uniform(-30, 30, (3, n))
    file.intensity = rng.integers(0, 65536, n)
    file.return_number = rng.integers(1, 4, n)
    file.gps_time = rng.uniform(0, 1e6, n)
    file.gain = rng.normal(0, 1, n).astype(np.float32)
    file.write(path)
    return path


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_chunks_are_the_whole(tmp_path: Path, suffix: str) -> None:
    path = las(tmp_path / f"S 1.a{suffix}")
    (scan,) = read_scans(path)
    assert (scan.name, scan.records, scan.origin) == ("S 1.a", 120_000, "assumed")
    expected = laspy.read(path)
    got = whole(scan, 120_000)
    assert np.abs(got.xyz - expected.xyz).max() < 1e-12
    for ours, theirs in (("time", "gps_time"), ("gain", "gain"), ("return_number",) * 2):
        assert np.array_equal(got.values[ours], np.asarray(expected[theirs]))
    assert got.values["intensity"].dtype == np.float32
    same(whole(scan, 9_999), got)
    for start in (1, 50_000, 77_777, 119_999):
        part = whole(scan, 30_000, start=start)
        assert np.array_equal(part.xyz, got.xyz[start:])
        assert np.array_equal(part.values["gain"], got.values["gain"][start:])
    assert len(whole(scan, 1000, start=120_000)) == 0


def test_names_and_origin(tmp_path: Path) -> None:
    far = read_scans(las(tmp_path / "far.copc.laz", 100, center=5e5))[0]
    assert (far.name, far.origin) == ("far", "unknown")
    (empty,) = read_scans(las(tmp_path / "a.las", 0))
    assert (empty.records, empty.origin, empty.bounds) == (0, "unknown", None)
    assert len(whole(empty)) == 0


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_a_truncated_file_is_a_sentence(tmp_path: Path, suffix: str) -> None:
    good = las(tmp_path / f"a{suffix}").read_bytes()
    n = len(good)
    for cut in (3, 100, 226, 380, 1000, n // 10, n // 2, n - 5000, n - 30):
        path = written(tmp_path, f"cut{suffix}", good[:cut])
        with pytest.raises(InputError, match=r"damaged|holds|bytes"):
            sum(len(c) for scan in read_scans(path) for c in scan.chunks(10_000))


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_an_absurd_count_is_not_believed(tmp_path: Path, suffix: str) -> None:
    data = bytearray(las(tmp_path / f"a{suffix}", 5000).read_bytes())
    struct.pack_into("<Q", data, 247, 10**15)
    path = written(tmp_path, f"b{suffix}", bytes(data))
    with pytest.raises(InputError):
        sum(len(c) for scan in read_scans(path) for c in scan.chunks())


@pytest.mark.parametrize(
    ("at", "number", "words"),
    [
        (100, "<I", "4294967295 records, more than fit"),
        (94, "<H", "says that it has 65535 bytes"),
        (96, "<I", "begin at byte 4294967295"),
        (243, "<I", "4294967295 records at byte"),
    ],
)
@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_headers_that_promise_more_than_fits(
    tmp_path: Path, suffix: str, at: int, number: str, words: str
) -> None:
    data = bytearray(las(tmp_path / f"a{suffix}", 500).read_bytes())
    struct.pack_into(number, data, at, 2 ** (8 * struct.calcsize(number)) - 1)
    with pytest.raises(InputError, match=words):
        read_scans(written(tmp_path, f"b{suffix}", bytes(data)))


@pytest.mark.parametrize("streamed", [False, True])
def test_a_huge_table_of_chunks_reserves_no_memory(tmp_path: Path, streamed: bool) -> None:
    data = bytearray(las(tmp_path / "a.laz", 500).read_bytes())
    (begin,) = struct.unpack_from("<I", data, 96)
    (table,) = struct.unpack_from("<q", data, begin)
    struct.pack_into("<I", data, table + 4, 2**32 - 1)
    if streamed:
        struct.pack_into("<q", data, begin, -1)
        data += struct.pack("<q", table)
    with pytest.raises(InputError, match="4294967295 chunks, more than fit"):
        read_scans(written(tmp_path, "b.laz", bytes(data)))


def test_a_long_record_behind_the_points(tmp_path: Path) -> None:
    file = laspy.read(las(tmp_path / "a.las", 500))
    file.evlrs = laspy.vlrs.vlrlist.VLRList([laspy.VLR("somebody", 7, "note", b"abc")])
    file.write(tmp_path / "b.las")
    assert read_scans(tmp_path / "b.las")[0].records == 500
    data = bytearray((tmp_path / "b.las").read_bytes())
    (at,) = struct.unpack_from("<Q", data, 235)
    struct.pack_into("<Q", data, at + 20, 2**63)
    with pytest.raises(InputError, match="a record ends at byte"):
        read_scans(written(tmp_path, "c.las", bytes(data)))


@pytest.mark.data
def test_a_real_one(shared_data: Path) -> None:
    (scan,) = read_scans(shared_data / "scans/vz400i_forest/scan.laz")
    assert (scan.records, scan.origin) == (1_046_843, "assumed")
    assert sum(map(len, scan.chunks(300_000))) == 1_046_843


@pytest.mark.parametrize("off", [-1, 0, 1, 2])
def test_a_count_that_is_off_by_one_is_told(tmp_path: Path, off: int) -> None:
    good = las(tmp_path / "a.las", 300)
    expected = whole(read_scans(good)[0], 400)
    data = bytearray(good.read_bytes())
    struct.pack_into("<Q", data, 247, 300 + off)
    path = written(tmp_path, "b.las", bytes(data))
    if off == 2:
        with pytest.raises(InputError, match="promises 302 points"):
            read_scans(path)
        return
    (scan,) = read_scans(path)
    assert scan.records == 300
    assert len(scan.warnings) == (off != 0)
    same(whole(scan, 400), expected)
    same(
        whole(scan, 400, 290),
        Chunk(expected.xyz[290:], {k: v[290:] for k, v in expected.values.items()}),
    )


@pytest.mark.parametrize("version", [2, 3, 4, 7])
def test_newer_items_are_named_and_not_called_damage(tmp_path: Path, version: int) -> None:
    data = bytearray(las(tmp_path / "a.laz", 300).read_bytes())
    at = data.index(b"laszip encoded") + 16 + 2 + 2 + 32
    at += 34 + 4
    struct.pack_into("<H", data, at, version)
    path = written(tmp_path, "b.laz", bytes(data))
    if version <= 3:
        return
    with pytest.raises(InputError, match="newer version") as caught:
        read_scans(path)
    assert "damaged" not in str(caught.value)
