from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
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
