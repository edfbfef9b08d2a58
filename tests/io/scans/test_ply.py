"""PLY as text and in both byte orders, its header line by line."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.io.scans.scan_files import same, whole, written
from tribrach.errors import InputError
from tribrach.io.scans.formats import read_scans

PROPERTIES = {
    "double x": "f8",
    "float y": "f4",
    "int z": "i4",
    "uchar red": "u1",
    "uint8 green": "u1",
    "uchar blue": "u1",
    "float scalar_Intensity": "f4",
    "float32 nx": "f4",
    "ushort label": "u2",
}
NAMES = ("red", "green", "blue", "intensity", "normal_x", "label")
ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}


def header(kind: str, count: int, before: str = "", after: str = "") -> str:
    lines = [
        "ply",
        f"format {kind} 1.0",
        "comment made here",
        before,
        f"element vertex {count}",
        *[f"property {words}" for words in PROPERTIES],
        after,
        "end_header",
    ]
    return "\n".join(line for line in lines if line) + "\n"


def records(n: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    out = np.zeros(n, dtype=[(p.split()[1], t) for p, t in PROPERTIES.items()])
    for name in out.dtype.names or ():
        kind = out.dtype[name].kind
        out[name] = rng.normal(0, 1e3, n) if kind == "f" else rng.integers(0, 256, n)
    return out


def body(data: np.ndarray, kind: str) -> bytes:
    if kind == "ascii":
        return "".join(" ".join(repr(v.item()) for v in record) + "\n" for record in data).encode()
    return data.astype(data.dtype.newbyteorder(ORDERS[kind])).tobytes()


def ply(data: np.ndarray, kind: str, tail: bytes = b"", **parts: str) -> bytes:
    return header(kind, len(data), **parts).encode() + body(data, kind) + tail


@settings(max_examples=30, deadline=None)
@given(st.sampled_from(list(ORDERS)), st.integers(0, 60), st.integers(0, 2**31), st.integers(1, 70))
def test_every_kind_comes_back(kind: str, n: int, seed: int, size: int) -> None:
    data = records(n, seed)
    with tempfile.TemporaryDirectory() as folder:
        (scan,) = read_scans(written(Path(folder), "a.ply", ply(data, kind)))
        got, later = whole(scan, size), whole(scan, size, start=n // 2)
    assert (scan.records, scan.names) == (n, NAMES)
    assert scan.facts == {"comment": "made here"}
    if n == 0:
        assert len(got) == 0
        return
    for k, axis in enumerate("xyz"):
        assert np.array_equal(got.xyz[:, k], data[axis])
    for name in ("red", "green", "blue"):
        assert np.array_equal(got.values[name], data[name] * np.uint16(257))
    assert np.array_equal(got.values["intensity"], data["scalar_Intensity"])
    assert np.array_equal(got.values["normal_x"], data["nx"])
    assert got.values["label"].dtype == np.uint16
    assert np.array_equal(got.values["label"], data["label"])
    assert np.array_equal(later.xyz, got.xyz[n // 2 :])


FACES = "element face 2\nproperty list uchar int vertex_indices"


@pytest.mark.parametrize("kind", list(ORDERS))
def test_faces_behind_and_elements_before(tmp_path: Path, kind: str) -> None:
    data = records(5)
    face = {
        "ascii": b"3 0 1 2\n3 1 2 3\n",
        "binary_little_endian": b"\x03" + bytes(12) + b"\x03" + bytes(12),
        "binary_big_endian": b"\x03" + bytes(12) + b"\x03" + bytes(12),
    }[kind]
    path = written(tmp_path, "a.ply", ply(data, kind, face, after=FACES))
    (scan,) = read_scans(path)
    assert np.array_equal(whole(scan, 3).xyz[:, 0], data["x"])
    camera = "element camera 1\nproperty float fx\nproperty uchar k"
    text = header(kind, 5, before=camera).encode()
    text += (b"1.5 7\n" if kind == "ascii" else bytes(5)) + body(data, kind)
    (scan,) = read_scans(written(tmp_path, "b.ply", text))
    assert np.array_equal(whole(scan, 2).xyz[:, 0], data["x"])


@pytest.mark.parametrize("kind", list(ORDERS))
def test_counts_must_fit(tmp_path: Path, kind: str) -> None:
    data = records(50)
    good = ply(data, kind)
    for cut in (len(header(kind, 50)), len(good) - 200, len(good) // 2):
        with pytest.raises(InputError):
            [len(c) for s in read_scans(written(tmp_path, "a.ply", good[:cut])) for c in s.chunks()]
    more = good + body(records(1), kind)
    with pytest.raises(InputError, match=r"more or fewer lines|longer than its header"):
        read_scans(written(tmp_path, "a.ply", more))
    absurd = good.replace(b"vertex 50", b"vertex 5000000000000000000000")
    with pytest.raises(InputError, match="states 5000000000000000000000 points and the file holds"):
        read_scans(written(tmp_path, "a.ply", absurd))


def test_values_that_are_no_numbers_and_windows_ends(tmp_path: Path) -> None:
    data = records(9)
    data["x"][3], data["y"][5] = np.nan, np.inf
    for kind in ("ascii", "binary_big_endian"):
        text = header(kind, 9).replace("\n", "\r\n").encode() + body(data, kind)
        (scan,) = read_scans(written(tmp_path, "a.ply", text))
        got = whole(scan, 4)
        assert (len(got), got.dropped) == (7, 2)
        same(got, whole(scan, 9))


def test_odd_numbers_warn_of_nothing(tmp_path: Path) -> None:
    data = records(3)
    data["y"].view(np.uint32)[1] = 0x7FA00000  # a signalling NaN
    (scan,) = read_scans(written(tmp_path, "a.ply", ply(data, "binary_little_endian")))
    assert whole(scan).dropped == 1
    text = ply(records(3), "ascii").decode().splitlines()
    text[-1] = "1e300 2 3 nan 0 0 1e300 0 0"
    (scan,) = read_scans(written(tmp_path, "b.ply", "\n".join(text)))
    with pytest.raises(InputError, match="the value nan does not lie within 0 and 255"):
        whole(scan)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("ply\nformat ascii 1.0\nelement vertex 1\n", "no end"),
        ("ply\nformat ebcdic 1.0\nend_header\n", r"a\.ply:2.*'format ebcdic 1\.0'"),
        ("ply\nelement vertex 0\nend_header\n", "does not say its format"),
        ("ply\nformat ascii 1.0\nend_header\n", "no element vertex"),
        ("ply\nformat ascii 1.0\nelement vertex -1\nend_header\n", "not understood"),
        ("ply\nformat ascii 1.0\nelement vertex 1\nproperty real x\nend_header\n", "real x"),
        ("ply\nformat ascii 1.0\nproperty float x\nend_header\n", "not understood"),
        ("ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nend_header\n", "no columns"),
        (
            "ply\nformat ascii 1.0\nelement vertex 0\nproperty list uchar int x\nend_header\n",
            "lists of values are not read",
        ),
        (
            "ply\nformat binary_big_endian 1.0\nelement f 1\nproperty list uchar int x\n"
            "element vertex 0\nend_header\n",
            "varying length",
        ),
    ],
)
def test_a_wrong_header_is_a_sentence(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        read_scans(written(tmp_path, "a.ply", text))


def test_a_header_without_end_is_not_read_for_ever(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no end"):
        read_scans(written(tmp_path, "a.ply", "ply\n" + "comment x\n" * 100_000 + "end_header\n"))


@pytest.mark.data
def test_a_real_one(shared_data: Path) -> None:
    (scan,) = read_scans(shared_data / "scans/formats/slope/XYZ_RGB_Intensity.ply")
    assert len(whole(scan, 10_000)) == 54_202
    assert scan.names == ("red", "green", "blue", "intensity")
