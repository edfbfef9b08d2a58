import tracemalloc

import numpy as np
import pytest

from tests.comparison.two_stations import NOISE, from_station, observed, patch, placement
from tribrach.cloud.covariance import covariances
from tribrach.comparison.cloud_parts import CloudChunk, centred, plain, whole
from tribrach.comparison.m3c2 import M3C2Settings, m3c2
from tribrach.errors import InputError

LOW, HIGH = np.full(3, -1.0), np.full(3, 1.0)


def test_points_within_the_box_relative_to_the_origin() -> None:
    rng = np.random.default_rng(1)
    xyz, random = rng.uniform(-3, 3, (1000, 3)) + 5e6, rng.uniform(size=(1000, 6))
    parts = list(centred(whole(xyz, random, most=100), np.full(3, 5e6), LOW, HIGH, most=15))
    assert len(parts) > 2
    assert max(len(p.xyz) for p in parts) <= 15
    inside = (np.abs(xyz - 5e6) <= 1).all(axis=1)
    assert np.array_equal(np.concatenate([p.xyz for p in parts]), xyz[inside] - 5e6)
    assert np.array_equal(np.concatenate([p.random for p in parts]), random[inside])
    assert list(centred(whole(xyz), np.zeros(3), LOW, HIGH)) == []


def test_covariances_of_some_parts_only_are_none() -> None:
    xyz = np.zeros((3, 3))

    def mixed():
        yield CloudChunk(xyz, np.ones((3, 6)))
        yield CloudChunk(xyz)

    (joined,) = centred(mixed, np.zeros(3), LOW, HIGH)
    assert len(joined.xyz) == 6
    assert joined.random is None


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_coordinates_that_are_no_numbers(bad) -> None:
    xyz = np.zeros((5, 3))
    xyz[3, 1] = bad
    with pytest.raises(InputError, match="not a number"):
        list(centred(whole(xyz), np.zeros(3), LOW, HIGH))


def test_scans_come_with_the_random_part_alone() -> None:
    rng = np.random.default_rng(2)
    where = placement(0, np.array([1e-3, 0, 0, 0, 0, 1e-4]))
    seen = observed(rng, 0, patch(rng, [0, 0, 0], (0, -1, 0.1), 50))
    cosine = np.linspace(0.3, 1, 50)
    (chunk,) = from_station(lambda: [(seen, cosine)], where)()
    assert chunk.xyz == pytest.approx(where.pose @ seen)
    station = covariances(seen, where, cosine) - chunk.random
    assert (station[:, :3] > 0).all()
    beam = (chunk.xyz - where.pose.translation) / np.linalg.norm(seen, axis=1)[:, None]
    c = chunk.random[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)
    along = np.einsum("ni,nij,nj->n", beam, c, beam)
    sigma = NOISE.range_sigma(np.linalg.norm(seen, axis=1), cosine)
    assert np.sqrt(along) == pytest.approx(sigma, rel=1e-6)


def test_memory_does_not_grow_with_the_cloud() -> None:
    def stream(chunks):
        def points():
            rng = np.random.default_rng(3)
            for _ in range(chunks):
                yield rng.uniform(-1.2, 1.2, (20_000, 3))

        return plain(points)

    peaks = []
    for chunks in (2, 10, 100):
        tracemalloc.start()
        total = sum(len(p.xyz) for p in centred(stream(chunks), np.zeros(3), LOW, HIGH, 50_000))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert total == pytest.approx(20_000 * chunks / 1.2**3, rel=0.05)
    assert peaks[2] < 1.1 * peaks[1]


def test_distances_do_not_depend_on_the_chunks() -> None:
    rng = np.random.default_rng(5)
    a, b = (rng.uniform(-1, 1, (20_000, 3)) * [1, 1, 3e-3] for _ in "ab")
    core = a[np.abs(a[:, :2]).max(axis=1) < 0.8][:60]
    settings = M3C2Settings([0.2], 0.15, 0.05)
    one = m3c2(whole(a), whole(b), core, settings)
    many = m3c2(whole(a, most=333), whole(b, most=97), core, settings)
    assert many.distance == pytest.approx(one.distance, abs=1e-12)
    assert np.array_equal(many.first.count, one.first.count)
