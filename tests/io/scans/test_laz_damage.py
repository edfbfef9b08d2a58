"""Damaged LAZ files are refused before the decoder reserves what they claim.

A decoder that is told of chunks or layers of gigabytes ends the process, so that the files are read
in a process of their own whose memory is measured.
"""

import struct
import subprocess
import sys
from pathlib import Path

import laspy
import lazrs
import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.io.scans.formats import read_scans

READ = """
import random, resource, sys
from pathlib import Path
from tribrach.errors import InputError
from tribrach.io.scans.formats import read_scans

whole = Path(sys.argv[1]).read_bytes()
place = Path(sys.argv[2])
begin, count = int(sys.argv[3]), int(sys.argv[4])
for scan in read_scans(Path(sys.argv[1])):
    for chunk in scan.stored():
        pass
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
rng = random.Random(begin)
kinds = set()
for number in range(count):
    broken = bytearray(whole)
    for _ in range(rng.choice([1, 1, 2, 4])):
        at = rng.randrange(begin, len(broken))
        broken[at] = rng.choice([0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)])
    if rng.random() < 0.1:
        del broken[rng.randrange(begin, len(broken)) :]
    place.write_bytes(broken)
    try:
        for scan in read_scans(place):
            for chunk in scan.stored():
                pass
        kinds.add("read")
    except InputError as error:
        kinds.add("refused")
grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
print(sorted(kinds), grown // 1024)
"""


def cloud(path: Path, point_format: int, count: int = 700) -> Path:
    header = laspy.LasHeader(point_format=point_format, version="1.4")
    header.scales, header.offsets = [0.001] * 3, [0.0] * 3
    header.add_extra_dims([laspy.ExtraBytesParams("sigma_x", "float32")])
    las = laspy.LasData(header)
    rng = np.random.default_rng(point_format)
    las.x, las.y, las.z = rng.uniform(-10, 10, (3, count))
    las.intensity = rng.integers(0, 60000, count)
    las.sigma_x = rng.uniform(1e-3, 2e-3, count).astype(np.float32)
    las.write(path)
    return path


def read_all(path: Path) -> int:
    return sum(len(chunk.xyz) for scan in read_scans(path) for chunk in scan.stored())


@pytest.mark.parametrize("point_format", range(11))
def test_whole_files_of_every_kind_of_point(point_format: int, tmp_path: Path) -> None:
    assert read_all(cloud(tmp_path / "a.laz", point_format)) == 700


@pytest.mark.parametrize("backend", [laspy.LazBackend.Lazrs, laspy.LazBackend.LazrsParallel])
def test_many_chunks(tmp_path: Path, backend: laspy.LazBackend) -> None:
    source = laspy.read(cloud(tmp_path / "a.laz", 7, 120_000))
    source.write(tmp_path / "b.laz", laz_backend=backend)
    assert read_all(tmp_path / "b.laz") == 120_000


def _of_record(data: bytes) -> int:
    """Where the content of the record on compression begins."""
    return data.index(b"laszip encoded") - 2 + 54


@pytest.mark.parametrize("chunk", [0, 2, 100_000_000, 400_000_000, 0x7FFFFFFF, 0xFFFFFFFE])
@pytest.mark.parametrize("point_format", [3, 7])
def test_sizes_of_chunks(chunk: int, point_format: int, tmp_path: Path) -> None:
    path = cloud(tmp_path / "a.laz", point_format)
    data = bytearray(path.read_bytes())
    struct.pack_into("<I", data, _of_record(data) + 12, chunk)
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"a\.laz: ") as refused:
        read_all(path)
    assert "copy the file again" in str(refused.value)
    words = "in 1 chunks, and 350 are needed" if chunk == 2 else f"in chunks of {chunk}"
    assert words in str(refused.value)


@pytest.mark.parametrize("layer", range(10))
def test_sizes_of_layers(layer: int, tmp_path: Path) -> None:
    path = cloud(tmp_path / "a.laz", 7)
    data = bytearray(path.read_bytes())
    begin, width = struct.unpack_from("<I", data, 96)[0], struct.unpack_from("<H", data, 105)[0]
    at = begin + 8 + width + 4 + 4 * layer
    struct.pack_into("<I", data, at, 0xFF000000)
    path.write_bytes(data)
    with pytest.raises(InputError, match="the layers of chunk 1 have"):
        read_all(path)


@pytest.mark.parametrize("compressor", [0, 1, 2, 4])
def test_layers_that_the_file_denies(compressor: int, tmp_path: Path) -> None:
    path = cloud(tmp_path / "a.laz", 7)
    data = bytearray(path.read_bytes())
    struct.pack_into("<H", data, _of_record(data), compressor)
    path.write_bytes(data)
    with pytest.raises(InputError, match="compressed in layers, and the file denies it"):
        read_all(path)


def test_a_width_that_is_another(tmp_path: Path) -> None:
    path = cloud(tmp_path / "a.laz", 7)
    data = bytearray(path.read_bytes())
    at = _of_record(data) + 34 + 2
    struct.pack_into("<H", data, at, 60_000)
    path.write_bytes(data)
    with pytest.raises(InputError, match="its compressed parts have"):
        read_scans(path)


@pytest.mark.parametrize("point_format", [1, 3, 7, 8])
def test_a_thousand_wrong_bytes(point_format: int, tmp_path: Path) -> None:
    path = cloud(tmp_path / "a.laz", point_format, 300)
    words = [sys.executable, "-c", READ, str(path), str(tmp_path / "b.laz"), "90", "250"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    kinds, grown = done.stdout.rsplit(maxsplit=1)
    assert "refused" in kinds
    assert int(grown) < 300


@pytest.mark.parametrize("name", sorted(["laz_abort", "panic"]))
def test_files_that_ended_the_process(name: str, shared_data: Path) -> None:
    folder = shared_data / "faults" / name
    for path in sorted(folder.glob("*.laz")):
        with pytest.raises(InputError, match=path.name):
            read_all(path)


@pytest.mark.parametrize("length", [2**31 - 1, -5])
def test_a_table_of_chunks_longer_than_the_file(
    length: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Points that lie one after another have no layers; their decoder believed the table."""
    path = cloud(tmp_path / "a.laz", 1)
    with path.open("r+b") as file:
        with laspy.open(file, closefd=False) as las:
            begin = las.header.offset_to_point_data
            vlr = lazrs.LazVlr(las.header.vlrs.get("LasZipVlr")[0].record_data)
        file.seek(begin)
        file.seek(int.from_bytes(file.read(8), "little"))
        file.truncate()
        lazrs.write_chunk_table(file, [(700, length % 2**64)], vlr)
    with pytest.raises(InputError, match=r"table of chunks tells of more bytes than the"):
        read_all(path)
    assert capfd.readouterr().err == ""
