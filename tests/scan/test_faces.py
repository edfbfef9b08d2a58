"""Faces from the order of a grid: both layouts that keep them, and those that do not."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.instruments.calibration import NIST
from tribrach.instruments.correction import Correction
from tribrach.scan.prepared import corrected_scan, head_turn, seen_from, sides
from tribrach.scan.scan import Chunk, Field, Scan

FIELDS = (Field("row", "int32"), Field("column", "int32"), Field("intensity", "float32"))


@dataclass(frozen=True)
class Listed(Scan):
    parts: list = field(default_factory=list)

    def stored(self, size=0, start=0):
        yield from self.parts


def panoramic(turn: float, columns: int = 90, first: float = 0.0, sense: float = 1.0):
    """A mirror that goes over the zenith: xyz, row, column, true face."""
    v = np.radians(np.linspace(-150, 150, 151))
    c, r = np.meshgrid(np.arange(columns), np.arange(len(v)), indexing="ij")
    head = first + sense * turn * c / columns
    raw = v[r]
    h = np.where(raw >= 0, head, head + np.pi)
    zenith = np.abs(raw)
    far = 5 + np.sin(3 * h) + np.cos(2 * zenith)
    flat = far * np.sin(zenith)
    xyz = np.stack([flat * np.cos(h), flat * np.sin(h), far * np.cos(zenith)], axis=-1)
    return xyz.reshape(-1, 3), r.ravel(), c.ravel(), np.where(raw >= 0, 1.0, -1.0).ravel()


def scan_of(xyz, row, column, fields=FIELDS) -> Listed:
    values = {"row": row, "column": column, "intensity": np.arange(len(xyz), dtype=np.float32)}
    half = len(xyz) // 2
    parts = [
        Chunk(xyz[a:b], {k: v[a:b] for k, v in values.items()})
        for a, b in ((0, half), (half, len(xyz)))
    ]
    return Listed("S", Path("s.e57"), records=len(xyz), fields=fields, origin="stated", parts=parts)


@pytest.mark.parametrize("turn", [180.0, 360.0])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_faces_of_half_and_full_turns(turn: float, sense: float) -> None:
    first = 0.02 if sense > 0 else np.pi - 0.02
    xyz, row, column, face = panoramic(np.radians(turn), first=first, sense=sense)
    off = np.hypot(xyz[:, 0], xyz[:, 1]) > 1e-6
    found = head_turn(scan_of(xyz, row, column)).faces(xyz, column)
    np.testing.assert_array_equal(found[off], face[off])


def test_half_a_turn_is_the_makers_dome() -> None:
    xyz, row, column, _ = panoramic(np.pi, first=0.001)
    found = head_turn(scan_of(xyz, row, column)).faces(xyz, column)
    h = np.arctan2(xyz[:, 1], xyz[:, 0]) % (2 * np.pi)
    clear = np.abs(np.sin(h)) > 0.05
    np.testing.assert_array_equal(found[clear] < 0, h[clear] >= np.pi)


def test_a_scan_of_two_faces_becomes_two() -> None:
    xyz, row, column, face = panoramic(2 * np.pi)
    front, back = sides(scan_of(xyz, row, column))
    assert (front.name, back.name) == ("S front", "S back")
    for side, k in ((front, 1.0), (back, -1.0)):
        chunks = list(side.chunks())
        got = np.concatenate([chunk.xyz for chunk in chunks])
        number = np.concatenate([chunk.values["intensity"] for chunk in chunks]).astype(int)
        assert sum(chunk.dropped for chunk in chunks) == (face != k).sum()
        np.testing.assert_array_equal(got, xyz[number])
        assert (face[number] == k).all()


def test_columns_of_one_direction_have_lost_the_faces() -> None:
    xyz, row, _, _ = panoramic(2 * np.pi)
    h = np.arctan2(xyz[:, 1], xyz[:, 0]) % (2 * np.pi)
    by_direction = np.floor(h / (2 * np.pi) * 90 + 1e-9).astype(int)
    with pytest.raises(InputError, match="sorted the points by direction"):
        head_turn(scan_of(xyz, row, by_direction))


def test_a_cloud_without_a_grid_is_refused() -> None:
    xyz, row, column, _ = panoramic(np.pi)
    with pytest.raises(InputError, match=r"no rows and columns.*face = "):
        head_turn(scan_of(xyz, row, column, fields=(Field("intensity", "float32"),)))


def test_columns_that_mean_nothing_are_refused() -> None:
    xyz, row, _, _ = panoramic(np.pi)
    noise = np.random.default_rng(1).integers(0, 90, len(xyz))
    with pytest.raises(InputError, match="do not lie in one plane"):
        head_turn(scan_of(xyz, row, noise))


def test_without_the_place_of_the_scanner_it_is_refused() -> None:
    xyz, row, column, _ = panoramic(np.pi)
    with pytest.raises(InputError, match="where the scanner stood"):
        head_turn(replace(scan_of(xyz, row, column), origin="unknown"))


def test_a_scan_can_be_moved_parted_and_corrected_at_once() -> None:
    """In the order that the steps need: faces and corrections are seen from the scanner."""
    at = (500.0, -200.0, 30.0)
    xyz, row, column, face = panoramic(2 * np.pi)
    correction = Correction(NIST.select(["x4"]), np.array([1e-3]), "back")
    whole = replace(scan_of(xyz, row, column), origin="unknown", scanner=(0.0, 0.0, 0.0))
    moved = seen_from(replace(whole, parts=[_moved(c, at) for c in whole.parts]), at)
    back = corrected_scan(sides(moved)[1], correction)
    got = np.concatenate([chunk.xyz for chunk in back.chunks()])
    number = np.concatenate([chunk.values["intensity"] for chunk in back.chunks()]).astype(int)
    off = np.hypot(xyz[number, 0], xyz[number, 1]) > 1e-6
    assert (face[number][off] == -1).all()
    expected = correction.corrected(xyz[number])
    np.testing.assert_allclose(got[off], expected[off], atol=1e-9)
    assert not back.as_stored
    assert whole.as_stored
    # a second correction takes the place of the first
    plain = corrected_scan(back, replace(correction, values=np.zeros(1)))
    again = np.concatenate([chunk.xyz for chunk in plain.chunks()])
    np.testing.assert_allclose(again, xyz[number], atol=1e-9)


def _moved(chunk: Chunk, by: tuple[float, float, float]) -> Chunk:
    return replace(chunk, xyz=chunk.xyz + by)
