"""Any value of any field through every writer comes back as it was, or is refused."""

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.io.scans.scan_files import whole
from tribrach.errors import InputError
from tribrach.io.clouds.formats import WRITERS
from tribrach.io.scans.formats import read_scans
from tribrach.questions.convert import convert_scans
from tribrach.scan.scan import CHUNK, Chunk, Field, Scan

TYPES = ("u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8", "bool", "3f4", "5u1")
#: names of fields: some of our own, some of LAS, some of neither
NAMES = (
    *("intensity", "time", "return_number", "number_of_returns", "row", "normal_x", "red"),
    *("classification", "user_data", "scan_angle", "synthetic", "point_source_id", "x_t"),
    *("M3C2 distance", "Höhe über Grund", "r", "a" * 40, "x", "time_2", "nir", "amplitude"),
)
#: fields that the table of `tribrach.scan.scan` gives a type
OURS = {"intensity": "f4", "time": "f8", "return_number": "u1", "number_of_returns": "u1"}
OURS |= {"row": "i4", "normal_x": "f4", "red": "u2"}
SUFFIXES = sorted(WRITERS)


@dataclass(frozen=True)
class Given(Scan):
    """A scan in memory."""

    points: Chunk = field(default_factory=lambda: Chunk(np.zeros((0, 3)), {}))

    def stored(self, size: int = CHUNK, start: int = 0) -> Iterator[Chunk]:
        if start < len(self.points):
            yield self.points


def quiet(what: str, done: int, total: int | None) -> None:
    """No display."""


@st.composite
def columns(draw: st.DrawFn) -> tuple[str, np.ndarray]:
    """A field with values of all sizes."""
    name = draw(st.sampled_from([n for n in NAMES if n != "x"]))
    kind = np.dtype(OURS.get(name, draw(st.sampled_from(TYPES))))
    base, shape = kind.base, (7, *kind.shape)
    elements: Any = {"allow_nan": True, "allow_infinity": False} if base.kind == "f" else {}
    return name, draw(arrays(base, shape, elements=elements))


def scan_of(xyz: np.ndarray, values: dict[str, np.ndarray]) -> Given:
    fields = tuple(Field(name, column.dtype.name) for name, column in values.items())
    values = values | {"number": np.arange(len(xyz), dtype=np.int32)}
    return Given(
        "a",
        Path("a.src"),
        records=len(xyz),
        fields=(*fields, Field("number", "int32")),
        points=Chunk(xyz, values),
    )


def back(path: Path) -> Chunk:
    """Points in the order of their numbers."""
    (scan,) = read_scans(path)
    found = whole(scan)
    order = np.argsort(found.values["number"])
    return Chunk(found.xyz[order], {n: v[order] for n, v in found.values.items()})


def same_values(found: np.ndarray, given: np.ndarray) -> bool:
    """Equal numbers; NaN is NaN."""
    a, b = np.asarray(found), np.asarray(given)
    if a.dtype.kind in "iub" and b.dtype.kind in "iub":
        return [int(v) for v in a] == [int(v) for v in b]
    return np.array_equal(a.astype(float), b.astype(float), equal_nan=True)


@pytest.mark.parametrize("suffix", SUFFIXES)
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(columns(), st.integers(0, 2**32 - 1), st.sampled_from([0.0, 5e5, -7e6]))
def test_values_come_back_or_are_refused(
    suffix: str, column: tuple[str, np.ndarray], seed: int, far: float
) -> None:
    name, values = column
    xyz = far + np.round(np.random.default_rng(seed).uniform(-50, 50, (7, 3)), 4)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"a{suffix}"
        try:
            convert_scans(
                [scan_of(xyz, {name: values})], path, placed=False, step=None, progress=quiet
            )
        except InputError:
            assert not path.exists()
            return
        found = back(path)
    assert np.abs(found.xyz - xyz).max() <= 1e-8
    parts = values.reshape(7, -1).T
    names = [name] if values.ndim == 1 else [f"{name}_{k}" for k in range(len(parts))]
    for one, part in zip(names, parts, strict=True):
        kept = [v for n, v in found.values.items() if same_values(v, part)]
        assert kept, (one, part, found.values)
        if one in found.values and one in OURS:
            assert same_values(found.values[one], part)


def refused(path: Path, scan: Scan) -> bool:
    """True if the values of a scan do not fit."""
    try:
        convert_scans([scan], path, placed=False, step=None, progress=quiet)
    except InputError:
        return True
    return False


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("low_high", [(0.0, 1.0), (-30.0, 5.0), (0.0, 1e6), (0.25, 0.25)])
def test_intensities_keep_their_values_and_order(
    tmp_path: Path, suffix: str, low_high: tuple[float, float]
) -> None:
    rng = np.random.default_rng(4)
    light = rng.uniform(*low_high, 3000).astype(np.float32)
    xyz = np.round(rng.uniform(-5, 5, (3000, 3)), 4)
    path = tmp_path / f"a{suffix}"
    assert not refused(path, scan_of(xyz, {"intensity": light}))
    (scan,) = read_scans(path)
    found = np.concatenate([np.sort(c.values["intensity"]) for c in scan.chunks()])
    assert np.array_equal(np.sort(found), np.sort(light))


def test_whole_intensities_of_16_bits_need_no_dimension_of_their_own(tmp_path: Path) -> None:
    light = np.arange(500, dtype=np.float32)
    path = tmp_path / "a.laz"
    assert not refused(path, scan_of(np.zeros((500, 3)), {"intensity": light}))
    with laspy.open(path) as file:
        assert [d.name for d in file.header.point_format.extra_dimensions] == ["number"]


@pytest.mark.parametrize("suffix", [".las", ".laz"])
def test_steps_and_offsets_of_the_source_are_kept(tmp_path: Path, suffix: str) -> None:
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = [1e-7, 2e-7, 0.003], [11.0, 48.0, 3.5]
    data = laspy.LasData(header)
    rng = np.random.default_rng(2)
    data.X, data.Y, data.Z = rng.integers(-(2**22), 2**22, (3, 400))
    data.write(tmp_path / "s.laz")
    scans = read_scans(tmp_path / "s.laz")
    ((path, _, cost),) = convert_scans(
        scans, tmp_path / f"a{suffix}", placed=False, step=None, progress=quiet
    )
    assert cost == ""
    with laspy.open(path) as file:
        assert file.header.scales.tolist() == [1e-7, 2e-7, 0.003]
        assert file.header.offsets.tolist() == [11.0, 48.0, 3.5]
        again = file.read()
    assert np.array_equal(again.X, data.X)
    assert np.array_equal(again.Z, data.Z)


@pytest.mark.parametrize("suffix", [s for s in SUFFIXES if s != ".ply"])
def test_a_coarse_step_says_what_it_costs(tmp_path: Path, suffix: str) -> None:
    rng = np.random.default_rng(3)
    xyz = 5e6 + np.round(rng.uniform(-20, 20, (100, 3)), 4)
    ((path, _, cost),) = convert_scans(
        [scan_of(xyz, {})], tmp_path / f"a{suffix}", placed=False, step=1e-2, progress=quiet
    )
    assert "10 mm" in cost
    assert np.abs(back(path).xyz - xyz).max() <= 0.5e-2 + 1e-8


@pytest.mark.parametrize("suffix", [s for s in SUFFIXES if s != ".ply"])
@pytest.mark.parametrize("extent", [1e-3, 1.0, 1e3, 1e6])
def test_steps_suit_the_extent(tmp_path: Path, suffix: str, extent: float) -> None:
    xyz = 4e5 + np.random.default_rng(3).uniform(-extent, extent, (100, 3))
    ((path, _, cost),) = convert_scans(
        [scan_of(xyz, {})], tmp_path / f"a{suffix}", placed=False, step=None, progress=quiet
    )
    assert cost
    assert np.abs(back(path).xyz - xyz).max() <= max(min(1e-4, 2e-5 * extent), extent * 1e-8)
