"""PLY out and in again: every bit of every field, nothing half-written."""

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.io.scans.scan_files import whole
from tribrach.errors import InputError
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
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
    Field("normal_x", "float32"),
    Field("sigma_x", "float32", description="sigma of e [m]"),
    Field("my own", "int16"),
)
UTM = np.array([590_000.0, 2_331_000.0, 0.0])


def points(n: int, seed: int = 1) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    rng = np.random.default_rng(seed)
    values = {}
    for field in FIELDS:
        kind = np.dtype(field.dtype)
        column = rng.normal(0, 9, n) if kind.kind == "f" else rng.integers(0, 200, n)
        values[field.name] = column.astype(kind)
    return UTM + rng.uniform(-80, 80, (n, 3)), values


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(0, 300), max_size=4), st.integers(1, 400))
def test_a_round_trip_keeps_every_bit(sizes: list[int], size: int) -> None:
    facts = {"scanner": "SN 1\nß: x", "crs": "not this"}
    header = CloudHeader("S 1", FIELDS, 1e-4, UTM, crs="EPSG:32648", epoch=2020.5, facts=facts)
    parts = [points(n, seed) for seed, n in enumerate(sizes)]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.ply"
        with create(path, header) as writer:
            for xyz, values in parts:
                writer.write(xyz, values)
        (scan,) = read_scans(path)
        got = whole(scan, size)
        head = path.read_bytes().split(b"end_header\n")[0]
    assert scan.records == sum(sizes) == len(got)
    assert max(map(len, head.split(b"\n"))) < 256
    assert scan.crs is not None
    assert 'ID["EPSG",32648]' in scan.crs
    assert "UTM zone 48N" in scan.crs
    assert (scan.facts["epoch"], scan.facts["name"]) == ("2020.5", "S 1")
    assert scan.facts["field sigma_x"] == "sigma of e [m]"
    names = [f.name.replace(" ", "_") for f in FIELDS]
    assert list(scan.names) == names
    if len(got):
        assert np.array_equal(got.xyz, np.concatenate([p[0] for p in parts]))
        for field, name in zip(FIELDS, names, strict=True):
            column = np.concatenate([p[1][field.name] for p in parts])
            assert got.values[name].dtype == column.dtype
            assert np.array_equal(got.values[name], column), name


def _written(path: Path, header: CloudHeader, *parts: dict[str, np.ndarray] | None) -> None:
    """Four points for each part; Ctrl-C where there is none."""
    with create(path, header) as writer:
        for part in parts:
            if part is None:
                raise KeyboardInterrupt
            writer.write(np.ones((4, 3)), part)


def test_fields_of_several_values_and_absent_ones(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    fields = (Field("hist", "float32"), Field("flag", "uint8"))
    hist = np.arange(12, dtype=np.float32).reshape(4, 3)
    with create(path, CloudHeader("a", fields)) as writer:
        writer.write(np.ones((4, 3)), {"hist": hist})
    (scan,) = read_scans(path)
    assert scan.names == ("hist_0", "hist_1", "hist_2", "flag")
    got = whole(scan)
    assert np.array_equal(got.values["hist_1"], hist[:, 1])
    assert not got.values["flag"].any()
    with pytest.raises(InputError, match="another number of values"):
        _written(path, CloudHeader("a", fields), {"hist": hist}, {"hist": hist[:, :2]})
    assert list(tmp_path.iterdir()) == [path]


def test_the_header_counts_and_the_bytes_repeat(tmp_path: Path) -> None:
    lengths = set()
    for n in (0, 7, 12_345):
        for name in ("a.ply", "b.ply"):
            with create(tmp_path / name, CloudHeader("S", FIELDS)) as writer:
                writer.write(*points(n))
        data = (tmp_path / "a.ply").read_bytes()
        assert data == (tmp_path / "b.ply").read_bytes()
        head, _, rest = data.partition(b"end_header\n")
        assert f"\nelement vertex {n}\n".encode() in head
        lengths.add(len(head))
        assert len(rest) == n * (24 + 4 + 6 + 8 + 1 + 4 + 4 + 4 + 2)
    assert len(lengths) == 1


def test_what_fails_leaves_nothing(tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    with pytest.raises(InputError, match="not a number"), create(path, CloudHeader("a")) as writer:
        writer.write(np.array([[1.0, np.nan, 2.0]]), {})
    with pytest.raises(KeyboardInterrupt):
        _written(path, CloudHeader("a"), {}, None)
    assert not list(tmp_path.iterdir())
