"""LAS and LAZ out and in again: coordinates to half a step, every field, nothing half-written."""

import tempfile
from pathlib import Path
from typing import Any, BinaryIO

import laspy
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tribrach.errors import InputError
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader, single_resolution, step_for
from tribrach.io.scans.formats import read_scans
from tribrach.scan.scan import Field

FIELDS = (
    Field("intensity", "float32", 0.0, 1.0),
    Field("red", "uint16"),
    Field("green", "uint16"),
    Field("blue", "uint16"),
    Field("time", "float64"),
    Field("return_number", "uint8"),
    Field("row", "int32"),
    Field("sigma_x", "float32", description="sigma of e [m]"),
)
UTM = np.array([590_000.0, 2_331_000.0, 0.0])


def points(n: int, seed: int = 1) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    rng = np.random.default_rng(seed)
    xyz = UTM + rng.uniform(-80, 80, (n, 3))
    return xyz, {
        "intensity": rng.uniform(0, 1, n).astype(np.float32),
        "red": rng.integers(0, 65536, n).astype(np.uint16),
        "green": rng.integers(0, 65536, n).astype(np.uint16),
        "blue": rng.integers(0, 65536, n).astype(np.uint16),
        "time": rng.uniform(0, 1e9, n),
        "return_number": rng.integers(1, 4, n).astype(np.uint8),
        "row": rng.integers(-5, 99, n).astype(np.int32),
        "sigma_x": rng.uniform(1e-3, 1e-2, n).astype(np.float32),
    }


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_a_round_trip_keeps_everything(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"cloud{suffix}"
    header = CloudHeader("S1", FIELDS, 1e-4, UTM, crs="EPSG:32648", epoch=2020.5)
    parts = [points(1000, 1), points(1, 2), points(0, 3), points(777, 4)]
    with create(path, header) as writer:
        for xyz, values in parts:
            writer.write(xyz, values)
    (scan,) = read_scans(path)
    chunks = list(scan.chunks(500))
    assert scan.records == 1778 == sum(map(len, chunks))
    xyz = np.concatenate([p[0] for p in parts])
    assert np.abs(np.concatenate([c.xyz for c in chunks]) - xyz).max() < 0.5001e-4
    for name in ("red", "green", "blue", "time", "return_number", "row", "sigma_x"):
        given_values = np.concatenate([p[1][name] for p in parts])
        assert (np.concatenate([c.values[name] for c in chunks]) == given_values).all(), name
    intensity = np.concatenate([c.values["intensity"] for c in chunks])
    assert (intensity == np.concatenate([p[1]["intensity"] for p in parts])).all()
    assert scan.crs is not None
    assert "UTM zone 48N" in scan.crs
    assert scan.bounds == pytest.approx(np.stack([xyz.min(0), xyz.max(0)]), abs=1e-4)
    with laspy.open(path) as file:
        assert file.header.global_encoding.wkt
        assert b"2020.5" in next(v for v in file.header.vlrs if v.user_id == "tribrach").record_data


def test_the_same_points_are_the_same_bytes(tmp_path: Path) -> None:
    header = CloudHeader("S1", FIELDS, 1e-4, UTM)
    for name in ("a.laz", "b.laz"):
        with create(tmp_path / name, header) as writer:
            writer.write(*points(3000))
    assert (tmp_path / "a.laz").read_bytes() == (tmp_path / "b.laz").read_bytes()
    with laspy.open(tmp_path / "a.laz") as file:
        assert file.header.creation_date is None  # tomorrow's file is the same, too


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_chunks_leave_no_trace(tmp_path: Path, suffix: str) -> None:
    """Points that come in other chunks make the same file, whose limits are true or not stated."""
    xyz, values = points(60_000)
    for name, sizes in (("a", [60_000]), ("b", [1, 49_999, 10_000])):
        with create(tmp_path / f"{name}{suffix}", CloudHeader("S1", FIELDS, 1e-4, UTM)) as writer:
            for start, size in zip(np.cumsum([0, *sizes]), sizes, strict=False):
                part = slice(start, start + size)
                writer.write(xyz[part], {k: v[part] for k, v in values.items()})
    assert (tmp_path / f"a{suffix}").read_bytes() == (tmp_path / f"b{suffix}").read_bytes()
    with laspy.open(tmp_path / f"a{suffix}") as file:
        for struct in file.header.vlrs.get("ExtraBytesVlr")[0].extra_bytes_structs:
            assert struct.min is None or struct.min[0] == values[struct.format_name()].min()


def _interrupted(path: Path, header: CloudHeader) -> None:
    """Ctrl-C between two chunks."""
    with create(path, header) as writer:
        writer.write(*points(10))
        raise KeyboardInterrupt


def test_what_fails_leaves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "cloud.laz"
    path.write_bytes(b"old")
    header = CloudHeader("S", FIELDS, 1e-4, UTM)
    with pytest.raises(KeyboardInterrupt):
        _interrupted(path, header)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


class Disk:
    """Counts what is written to files that are opened like clouds; full after some writes."""

    def __init__(self, room: float) -> None:
        self.room, self.writes = room, 0

    def opening(self, opened: Any) -> Any:
        def opens(path: Path, mode: str = "r", **options: Any) -> Any:
            stream = opened(path, mode, **options)
            return Limited(stream, self) if mode == "w+b" else stream

        return opens


class Limited:
    def __init__(self, stream: BinaryIO, disk: Disk) -> None:
        self._stream, self._disk = stream, disk

    def write(self, data: bytes) -> int:
        self._disk.writes += 1
        if self._disk.writes > self._disk.room:
            raise OSError(28, "No space left on device")
        return self._stream.write(data)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def written(path: Path, disk: Disk, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(Path, "open", disk.opening(Path.open))
        with create(path, CloudHeader("S", FIELDS, 1e-4, UTM)) as writer:
            writer.write(*points(1000))


@pytest.mark.parametrize("suffix", [".las", ".laz", ".copc.laz"])
def test_a_full_disk_is_said(tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A compressor only says that a write failed; the sentence says why, whichever write it is."""
    free = Disk(np.inf)
    written(tmp_path / f"whole{suffix}", free, monkeypatch)
    (tmp_path / f"whole{suffix}").unlink()
    for room in range(free.writes):
        with pytest.raises(InputError, match=r"cannot be written \(No space left on device"):
            written(tmp_path / f"a{suffix}", Disk(room), monkeypatch)
        assert list(tmp_path.iterdir()) == []


def test_an_overflow_is_said_and_not_wrapped(tmp_path: Path) -> None:
    far = np.array([[1e6, 0.0, 0.0]])
    with (
        pytest.raises(InputError, match=r"do not fit steps of 0\.1 mm"),
        create(tmp_path / "a.las", CloudHeader("S", (), 1e-4)) as writer,
    ):
        writer.write(far, {})
    assert not list(tmp_path.iterdir())


def test_bits_beyond_their_place_are_said(tmp_path: Path) -> None:
    header = CloudHeader("S1", FIELDS, 1e-4, UTM)
    xyz, values = points(10)
    values["return_number"][3] = 16
    with (
        pytest.raises(InputError, match=r"a\.laz: a value does not fit the bits .*16.*15"),
        create(tmp_path / "a.laz", header) as writer,
    ):
        writer.write(xyz, values)
    assert not list(tmp_path.iterdir())


def test_unknown_suffixes_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"use .*\.las.*\.copc\.laz"):
        create(tmp_path / "a.xyzzy", CloudHeader("S"))


@given(st.floats(1e-7, 1.0))
def test_steps_are_round_and_fine_enough(sigma: float) -> None:
    step = step_for(sigma)
    assert 1e-6 <= step <= 1e-3
    assert step <= max(sigma / 10, 1e-6) * (1 + 1e-9)
    assert f"{step:e}"[0] in "125"


def test_float32_resolution() -> None:
    """A quarter of a metre at a northing of 2,331 km, half a metre in ECEF (method 1.4)."""
    assert single_resolution(2_331_107.0) == 0.25
    assert single_resolution(5_000_000.0) == 0.5


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 20_000))
@example(227)  # as long as the header of LAS 1.2: laspy reads a 1.4 header of no points there
@example(375)
@example(1000)
def test_a_cut_file_is_a_sentence_or_whole(cut: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.laz"
        with create(path, CloudHeader("S", FIELDS, 1e-4, UTM)) as writer:
            writer.write(*points(500))
        data = path.read_bytes()
        path.write_bytes(data[: min(cut, len(data) - 1)])
        with pytest.raises(InputError):
            sum(len(c) for s in read_scans(path) for c in s.chunks())
