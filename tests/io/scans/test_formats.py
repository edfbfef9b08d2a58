"""Files are read by what they are, and one cloud is the same from every format."""

import gzip
import shutil
from pathlib import Path

import numpy as np
import pytest

from tests.io.scans.scan_files import whole, written
from tests.io.scans.test_ptx import header
from tribrach.errors import InputError
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.scans.formats import READERS, read_scans

PCD = (
    "# .PCD v.7\nVERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\n"
    "POINTS 1\nDATA ascii\n1 2 3\n"
)
PLY = (
    "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
    "property float z\nend_header\n1 2 3\n"
)
TEXTS = {
    "PtxScan": header(1, 1) + "\n1 2 3 0.5\n",
    "PtsScan": "1\n1 2 3\n",
    "PlyTextScan": PLY,
    "PcdTextScan": PCD,
    "XyzScan": "1;2;3\n",
}


@pytest.mark.parametrize("kind", list(TEXTS))
@pytest.mark.parametrize("name", ["a", "a.ptx", "a.pts", "a.ply", "a.laz", "a.e57", "a.xyz", "a.q"])
def test_content_comes_before_the_suffix(tmp_path: Path, kind: str, name: str) -> None:
    (scan,) = read_scans(written(tmp_path, name, TEXTS[kind]))
    assert type(scan).__name__ == kind
    assert np.array_equal(whole(scan).xyz, [[1, 2, 3]])


@pytest.mark.parametrize("suffix", [".las", ".laz", ".ply", ".e57"])
def test_binary_files_without_suffix(tmp_path: Path, suffix: str) -> None:
    xyz = np.array([[1.0, 2, 3], [-4, 5, 6]])
    with create(tmp_path / f"a{suffix}", CloudHeader("a")) as writer:
        writer.write(xyz, {})
    for name in ("b", "b.txt", "b.pcd"):
        shutil.copy(tmp_path / f"a{suffix}", tmp_path / name)
        (scan,) = read_scans(tmp_path / name)
        assert np.abs(whole(scan).xyz - xyz).max() < 1e-4


@pytest.mark.parametrize("suffix", ["", ".doc", *READERS])
def test_what_is_nothing_is_refused_in_words(tmp_path: Path, suffix: str) -> None:
    rng = np.random.default_rng(5)
    for content in (
        b"",
        b"\0" * 5000,
        rng.bytes(5000),
        b"<xml><point/></xml>\n" * 50,
        "ein Text über Punkte\n".encode() * 50,
        b"LASF",
        b"ASTM-E57",
        b"ply\n",
        b"VERSION .7\n",
    ):
        with pytest.raises(InputError) as caught:
            sum(map(len, read_scans(written(tmp_path, f"a{suffix}", content))[0].chunks()))
        assert "Traceback" not in str(caught.value)
        assert str(caught.value).endswith(".")


def test_names_and_compression(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_scans(tmp_path / "none.las")
    with pytest.raises(InputError, match=r"only text is read from compressed files; unpack it"):
        read_scans(written(tmp_path, "a.ply.gz", gzip.compress(PLY.encode())))
    with pytest.raises(InputError, match=r"suffix '\.doc' are not known"):
        read_scans(written(tmp_path, "a.doc", b"\1\2\3"))


@pytest.mark.data
def test_one_slope_in_every_format(shared_data: Path) -> None:
    """54,202 points in one order: floats of a grid of 8 decimals, and steps of 1 mm in LAS."""
    paths = sorted((shared_data / "scans/formats/slope").glob("XYZ*"))
    assert len(paths) == 6
    clouds = {}
    for path in paths:
        (scan,) = read_scans(path)
        clouds[path.name] = whole(scan, 20_000).xyz
        assert scan.records == len(clouds[path.name]) == 54_202
        assert scan.origin == "unknown"
    for name, xyz in clouds.items():
        tolerance = 0.5001e-3 if name.endswith(("las", "laz")) else 0.5001e-8
        assert np.abs(xyz - clouds["XYZ_RGB_Intensity.txt"]).max() < tolerance, name


@pytest.mark.data
def test_every_file_at_hand_ends_right_or_with_a_sentence(shared_data: Path) -> None:
    paths = [p for p in (shared_data / "scans/formats").rglob("*") if p.is_file()]
    sentences = [_sentence(path) for path in paths]
    assert len(paths) > 30
    assert 5 < sum(map(bool, sentences)) < 15
    assert [
        s for p, s in zip(paths, sentences, strict=True) if s and not s.startswith(str(p))
    ] == []


def _sentence(path: Path) -> str:
    """What reading a whole file has to say; empty if all records are there."""
    try:
        scans = [(scan.records, whole(scan, 100_000)) for scan in read_scans(path)]
    except InputError as error:
        return str(error)
    assert all(records == len(got) + got.dropped for records, got in scans)
    return ""
