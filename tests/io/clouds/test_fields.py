"""Any finite value of any type comes back through every format, or is refused in a sentence."""

from collections.abc import Callable
from pathlib import Path

import laspy
import numpy as np
import pytest

from tests.io.scans.scan_files import whole
from tribrach.errors import InputError
from tribrach.io.clouds.formats import WRITERS
from tribrach.io.scans.formats import read_scans
from tribrach.questions.convert import convert_scans

COUNT = 130
XYZ = np.round(
    np.random.default_rng(5).uniform(
        [691_230, 5_334_560, 520], [691_250, 5_334_580, 524], (COUNT, 3)
    ),
    4,
)
TYPES = ("float32", "float64", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64",
         "uint64")  # fmt: skip
#: types of PLY
PLY = {"f4": "float", "f8": "double", "i1": "char", "u1": "uchar", "i2": "short", "u2": "ushort",
       "i4": "int", "u4": "uint"}  # fmt: skip


def extremes(kind: str) -> np.ndarray:
    """Values all over a type, its ends among them, not finite ones too."""
    rng, dtype = np.random.default_rng(2), np.dtype(kind)
    if dtype.kind == "f":
        info = np.finfo(dtype)
        out = rng.normal(size=COUNT).astype(dtype)
        out[:7] = [0, info.tiny, info.max / 2, -info.max / 2, 1 / 3, np.nan, np.inf]
        return out
    ends = np.iinfo(dtype)
    whole_numbers = rng.integers(ends.min, ends.max, COUNT, dtype=dtype, endpoint=True)
    whole_numbers[:2] = ends.min, ends.max
    return whole_numbers


def table(values: np.ndarray) -> np.ndarray:
    names = ("x", "y", "z", "v")
    out = np.zeros(COUNT, [(n, "<f8") for n in names[:3]] + [("v", values.dtype.newbyteorder("<"))])
    for k, name in enumerate(names[:3]):
        out[name] = XYZ[:, k]
    out["v"] = values
    return out


def ply(path: Path, name: str, values: np.ndarray) -> None:
    kind = PLY.get(values.dtype.str[1:])
    if kind is None:
        pytest.skip("PLY has no such type")
    properties = "".join(f"property double {axis}\n" for axis in "xyz")
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {COUNT}\n{properties}"
    path.write_bytes(f"{head}property {kind} {name}\nend_header\n".encode() + bytes(table(values)))


def pcd(path: Path, name: str, values: np.ndarray) -> None:
    letter = {"f": "F", "i": "I", "u": "U"}[values.dtype.kind]
    head = (
        f"VERSION 0.7\nFIELDS x y z {name}\nSIZE 8 8 8 {values.dtype.itemsize}\n"
        f"TYPE F F F {letter}\nCOUNT 1 1 1 1\nWIDTH {COUNT}\nHEIGHT 1\n"
        f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {COUNT}\nDATA binary\n"
    )
    path.write_bytes(head.encode() + bytes(table(values)))


def las(path: Path, name: str, values: np.ndarray) -> None:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = [1e-4] * 3, np.floor(XYZ[0])
    header.add_extra_dim(laspy.ExtraBytesParams(name, values.dtype))
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = XYZ.T
    cloud[name] = values
    cloud.write(str(path))


def text(path: Path, name: str, values: np.ndarray) -> None:
    rows = zip(*XYZ.T.tolist(), values.tolist(), strict=True)
    lines = (";".join(map(repr, row)) for row in rows)
    path.write_text("\n".join([f"x;y;z;{name}", *lines]) + "\n")


def exact(values: np.ndarray) -> list[object]:
    """As Python has them, where whole numbers and doubles are compared exactly."""
    return ["nan" if v != v else v for v in values.tolist()]


@pytest.mark.parametrize("suffix", sorted(WRITERS))
@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize(("source", "make"), [("a.ply", ply), ("a.pcd", pcd), ("a.las", las),
                                              ("a.laz", las), ("a.txt", text)])  # fmt: skip
def test_values_come_back_or_are_refused(
    tmp_path: Path,
    source: str,
    make: Callable[[Path, str, np.ndarray], None],
    kind: str,
    suffix: str,
) -> None:
    names = ["deviation", "time"]
    if make is not las:  # which has these in its own types
        names += ["intensity", "return_number"]
    for name in names:
        make(tmp_path / source, name, extremes(kind))
        carried(tmp_path / source, name, suffix)


def carried(path: Path, name: str, suffix: str) -> None:
    """Convert a file and compare, unless it is refused."""
    out = path.with_name(f"{name}{suffix}")
    try:
        (scan,) = read_scans(path)
        before = whole(scan)
        convert_scans((scan,), out, placed=False, step=None, progress=lambda *_: None)
    except InputError:
        return
    (again,) = read_scans(out)
    after = whole(again)
    assert len(after) == len(before)
    # COPC sorts the points
    orders = [np.lexsort(np.round(part.xyz, 3).T) for part in (before, after)]
    assert np.abs(before.xyz[orders[0]] - after.xyz[orders[1]]).max() <= 5.1e-5
    field = name if name in before.values else next(n for n in before.values if name in n)
    one, other = before.values[field][orders[0]], after.values[field][orders[1]]
    if name == "intensity" and suffix != ".ply":
        assert len(np.unique(one)) == len(np.unique(other))
        assert (np.argsort(one, kind="stable") == np.argsort(other, kind="stable")).all()
        return
    assert exact(one) == exact(other)
