"""Packed files are unpacked as far as their size justifies it, in every packing."""

import bz2
import gzip
import importlib.util
import lzma
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.gnss.rinex_samples import rinex_3
from tribrach.errors import InputError
from tribrach.io import unpacking
from tribrach.io.gnss.observation_file import read_observations
from tribrach.io.gnss.orbit_files import read_orbits
from tribrach.io.scans.formats import read_scans
from tribrach.io.unpacking import unpacked, unpacked_bytes

PACK: dict[str, Callable[[bytes], bytes]] = {
    "gzip": gzip.compress,
    "xz": lzma.compress,
    "bzip2": bz2.compress,
}
HATANAKA = pytest.mark.skipif(
    importlib.util.find_spec("hatanaka") is None, reason="hatanaka is not installed"
)


@pytest.mark.parametrize("pack", PACK)
def test_content_is_what_was_packed(pack: str, tmp_path: Path) -> None:
    data = "".join(f"{k} {k * k % 977} {k % 13}\n" for k in range(5000)).encode()
    path = tmp_path / "a"
    path.write_bytes(PACK[pack](data))
    assert unpacked_bytes(path) == data
    with unpacked(path) as file:
        assert file.read(10) == data[:10]
        assert file.read() == data[10:]
        assert file.seek(100) == 100
        assert b"".join(file) == data[100:]


@pytest.mark.parametrize("pack", PACK)
@pytest.mark.parametrize("read", [read_scans, read_observations, lambda path: read_orbits([path])])
def test_bombs_are_refused(pack: str, read: Callable[[Path], object], tmp_path: Path) -> None:
    path = tmp_path / "a.xyz"
    # packed data may follow each other
    path.write_bytes(PACK[pack](b"1 2 3\n" * 1_000_000) * 8)
    with pytest.raises(InputError, match=r"a\.xyz: unpacked, the file has more than \d+ MB"):
        read(path)


@HATANAKA
def test_bombs_of_compress_and_of_hatanaka(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import hatanaka
    import ncompress

    path = tmp_path / "a.Z"
    path.write_bytes(ncompress.compress(b"\0" * 50_000_000))
    with pytest.raises(InputError, match="unpacked, the file has more than"):
        read_observations(path)
    names = tuple(f"G{k:02d}" for k in range(1, 33))
    compact = hatanaka.rnx2crx(rinex_3(100, names).encode())
    path.write_bytes(gzip.compress(compact))
    assert len(read_observations(path).times) == 100
    monkeypatch.setattr(unpacking, "_FREE", 100_000)
    monkeypatch.setattr(unpacking, "_EXPANSION", 1)
    with pytest.raises(InputError, match="unpacked, the file has more than"):
        read_observations(path)


@HATANAKA
def test_compact_rinex_with_a_gap_is_refused(tmp_path: Path) -> None:
    import hatanaka

    lines = hatanaka.rnx2crx(rinex_3(6).encode()).splitlines(keepends=True)
    path = tmp_path / "a.crx"
    first = next(k for k, line in enumerate(lines) if line.startswith(b">"))
    path.write_bytes(b"".join(lines[: first + 6] + lines[first + 9 :]))
    with pytest.raises(InputError, match="the compact RINEX is damaged or ends too soon"):
        read_observations(path)
