import tracemalloc
from dataclasses import dataclass, field
from pathlib import Path

import laspy
import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.io.scans.formats import read_scans
from tribrach.scan import loading
from tribrach.scan.loading import load
from tribrach.scan.scan import Chunk, Scan


@dataclass(frozen=True)
class Listed(Scan):
    """A scan that yields given chunks."""

    parts: list = field(default_factory=list)

    def stored(self, size=0, start=0):
        yield from self.parts


def part(n, **values):
    return Chunk(np.arange(3.0 * n).reshape(n, 3), values)


def test_chunks_become_one_cloud():
    one = part(2, intensity=np.array([1, 2], np.uint16), row=np.array([0, 1]), column=np.zeros(2))
    two = part(1, intensity=np.array([3.5]), row=np.array([2]), column=np.zeros(1))
    loaded = load(Listed("S", Path("s.xyz"), parts=[one, two]))
    assert loaded.xyz.shape == (3, 3)
    np.testing.assert_array_equal(loaded.intensity, np.array([1, 2, 3.5], np.float32))
    assert loaded.row.dtype == np.int32
    assert loaded.row.tolist() == [0, 1, 2]


def test_a_field_that_a_chunk_lacks_is_none():
    loaded = load(Listed("S", Path("s.xyz"), parts=[part(2, intensity=np.ones(2)), part(1)]))
    assert loaded.intensity is None
    assert loaded.column is None


def test_too_many_points_and_none_are_refused():
    with pytest.raises(InputError, match="more than 2 points"):
        load(Listed("S", Path("s.xyz"), parts=[part(2), part(2)]), limit=2)
    with pytest.raises(InputError, match="no valid points"):
        load(Listed("S", Path("s.xyz")))


def test_arrays_grow_with_the_scan_and_end_with_it(monkeypatch):
    monkeypatch.setattr(loading, "_FIRST", 2)
    for records in (None, 3, 9, 20):
        parts = [part(n, intensity=np.full(n, n), row=np.arange(n)) for n in (1, 4, 4, 0)]
        parts[2].values["column"] = np.arange(4)
        loaded = load(Listed("S", Path("s.xyz"), records=records, parts=parts))
        np.testing.assert_array_equal(loaded.xyz, np.concatenate([p.xyz for p in parts]))
        assert loaded.intensity.tolist() == [1, 4, 4, 4, 4, 4, 4, 4, 4]
        assert loaded.row.tolist() == [0, 0, 1, 2, 3, 0, 1, 2, 3]
        assert loaded.column is None


def test_points_of_a_scan_take_no_second_copy():
    count, size = 40, 100_000
    parts = [part(size, intensity=np.ones(size, np.float32)) for _ in range(count)]
    whole = count * size * (24 + 4)
    tracemalloc.start()
    load(Listed("S", Path("s.xyz"), records=count * size, parts=parts))
    assert tracemalloc.get_traced_memory()[1] < 1.2 * whole
    tracemalloc.stop()


def test_a_header_of_too_many_points_is_enough(tmp_path):
    header = laspy.LasHeader(point_format=0)
    file = laspy.LasData(header)
    file.x = file.y = file.z = np.arange(5.0)
    file.write(tmp_path / "five.las")
    (scan,) = read_scans(tmp_path / "five.las")
    assert scan.certain_points == 5
    # its points are never looked for
    (tmp_path / "five.las").unlink()
    with pytest.raises(InputError, match="more than 4 points"):
        load(scan, limit=4)
