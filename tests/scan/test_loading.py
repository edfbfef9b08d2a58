import tracemalloc
from dataclasses import dataclass, field, replace
from pathlib import Path

import laspy
import numpy as np
import pytest

from tests.scan.in_memory import in_memory
from tribrach.errors import InputError
from tribrach.instruments.calibration import find_model
from tribrach.instruments.correction import Correction
from tribrach.io.scans.formats import read_scans
from tribrach.scan import loading
from tribrach.scan.face import HeadTurn, ScanFace
from tribrach.scan.loading import hold, laid_out, load
from tribrach.scan.no_return import find_no_return
from tribrach.scan.prepared import seen_from
from tribrach.scan.scan import CHUNK, Chunk, NoReturn, Scan
from tribrach.scan.surface_sample import surface_sample


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


def two_faces(rng, n=1_200):
    """Points about a scanner, those of a column on both sides of the standing axis."""
    column = np.arange(n) // 40
    ahead = 0.1 + np.pi * column / (n // 40)
    h = ahead + np.pi * (np.arange(n) % 2)
    v = rng.uniform(0.5, 2.5, n)
    far = np.where(rng.random(n) < 0.3, 7.0, rng.uniform(4, 6, n))
    flat = far * np.sin(v)
    xyz = np.stack([flat * np.cos(h), flat * np.sin(h), far * np.cos(v)], axis=1)
    light = rng.uniform(0, 255, n).astype(np.float32)
    return in_memory(xyz, intensity=light, row=np.arange(n) % 40, column=column)


SHELL = NoReturn(shell=(6.9999, 7.0001), at_scanner=True, zeros=1, in_shell=9, total=1200)


def as_the_project_knows(scan):
    turn = HeadTurn(0.1, np.pi / 30, 30)
    model = find_model("nist")
    values = np.full(len(model.parameters), 1e-4)
    shifted = seen_from(scan, (0.5, -0.2, 0.1))
    return {
        "as stored": scan,
        "shifted": shifted,
        "one face": replace(scan, face=ScanFace(turn, -1.0)),
        "corrected": replace(shifted, correction=Correction(model, values, "front")),
        "all": replace(
            shifted, face=ScanFace(turn, 1.0), correction=Correction(model, values, "front")
        ),
    }


@pytest.mark.parametrize("way", ["as stored", "shifted", "one face", "corrected", "all"])
@pytest.mark.parametrize("beams", [None, SHELL])
@pytest.mark.parametrize("stored", [True, False])
def test_what_is_held_is_what_is_read(way, beams, stored):
    scan = as_the_project_knows(two_faces(np.random.default_rng(4)))[way]
    known = replace(scan, no_return=beams)
    held = hold(scan, stored=True).without(beams) if stored else hold(known)
    same_chunks(held.chunks(), known.chunks(CHUNK))
    same_chunks(held.stored(), known.stored(CHUNK))
    # blocks from elsewhere
    for size, start in ((100, 0), (200, 350), (500, 1100)):
        same_chunks(held.chunks(size, start), known.chunks(size, start))
    cloud, image = laid_out(held)
    direct = np.concatenate([c.xyz for c in known.chunks()])
    np.testing.assert_array_equal(cloud.xyz, direct)
    assert laid_out(held)[1] is image
    np.testing.assert_array_equal(image.index, laid_out(known)[1].index)


def same_chunks(some, others):
    for one, other in zip(some, others, strict=True):
        np.testing.assert_array_equal(one.xyz, other.xyz)
        assert one.dropped == other.dropped
        for name, values in one.values.items():
            if name in ("intensity", "row", "column"):
                np.testing.assert_array_equal(values, other.values[name])


def test_a_las_file_is_decoded_once(tmp_path):
    file = laspy.LasData(laspy.LasHeader(point_format=0))
    rng = np.random.default_rng(3)
    file.x, file.y, file.z = rng.uniform(-9, 9, (3, 3_000))
    file.intensity = rng.integers(0, 1000, 3_000)
    file.write(tmp_path / "some.laz")
    (scan,) = read_scans(tmp_path / "some.laz")
    held = hold(scan, stored=True)
    direct = surface_sample(scan), find_no_return(scan)
    blocks = list(scan.chunks(700, 600))
    (tmp_path / "some.laz").unlink()
    again = surface_sample(held), find_no_return(held)
    np.testing.assert_array_equal(direct[0].xyz, again[0].xyz)
    np.testing.assert_array_equal(direct[0].normals, again[0].normals)
    np.testing.assert_array_equal(direct[0].intensity, again[0].intensity)
    assert direct[1] == again[1]
    same_chunks(held.without(None).chunks(700, 600), blocks)
