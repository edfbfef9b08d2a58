"""Clouds in tiles against the same clouds as a whole, and against brute force."""

import pickle
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.comparison.clouds import in_memory
from tribrach.cloud.placement import Placement
from tribrach.comparison.by_tiles import tile_m3c2, tile_m3c2_ep, tile_normals
from tribrach.comparison.cloud_parts import CloudChunk, plain, whole
from tribrach.comparison.core_points import core_normals, core_points
from tribrach.comparison.m3c2 import M3C2Settings, m3c2
from tribrach.comparison.m3c2_ep import m3c2_ep
from tribrach.comparison.nearest import Neighbours, nearest
from tribrach.comparison.predicted import with_random
from tribrach.comparison.sites import ComparisonSite
from tribrach.comparison.station_pair import StationPair
from tribrach.comparison.tiles import tiles
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise


def chunked(points: np.ndarray, size: int):
    """A stream in chunks of a size."""

    def chunks() -> Iterator[np.ndarray]:
        return (points[k : k + size] for k in range(0, len(points), size))

    return chunks


def floor(seed: int, count: int = 30_000) -> np.ndarray:
    """A wavy floor of 20 m by 8 m with light, in no order, far from the origin."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, 20, count), rng.uniform(0, 8, count)
    z = 0.2 * np.sin(x) + rng.normal(0, 0.002, count)
    light = rng.uniform(0, 1, count)
    return np.column_stack([505_000.0 + x, 2_331_000.0 + y, 20.0 + z, light])


@settings(max_examples=15, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    size=st.sampled_from([40, 150, 600, 5000]),
    limit=st.sampled_from([0.01, 0.05, 0.3]),
    flat=st.booleans(),
    chunk=st.integers(30, 900),
)
def test_tiles_give_what_the_whole_gives(
    seed: int, size: int, limit: float, flat: bool, chunk: int
) -> None:
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(0, 3, (900, 3)), rng.uniform(0, 3, (1200, 3))
    if flat:  # more than half of the points share a coordinate
        a[:, 2], b[:700, 0] = 1.0, 0.5
    expected = np.sort(nearest(a, b, limit)[0])
    found = []
    with tiles(chunked(a, chunk), chunked(b, chunk + 7), limit, size=size) as cut:
        assert cut.total == len(a)
        assert (cut.origin == a[0]).all()
        for tile in cut:
            asked = np.concatenate(list(tile.queries()))
            assert len(asked) == tile.asked == sum(len(q) for q in tile.queries())
            assert (cut.numbers(asked) == tile.number).all()
            found.append(Neighbours(tile.reference(limit)).query(asked, limit)[0])
    assert np.sort(np.concatenate(found)) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("margin", [0.0, 0.1, 1.7, 50.0])
def test_any_margin_around_a_tile(margin: float) -> None:
    a, b = floor(1), floor(2)
    with tiles(chunked(a, 1700), chunked(b, 2100), 0.1, size=4000) as cut:
        assert len(list(cut)) >= 8
        for tile in cut:
            low, high = cut.cuts.boxes[tile.number]
            for read, rows in ((tile.compared, a), (tile.reference, b)):
                xyz = rows[:, :3]
                near = ((xyz >= low - margin) & (xyz <= high + margin)).all(axis=1)
                there = read(margin)
                order, truth = np.lexsort(there.T), rows[near]
                assert (there[order] == truth[np.lexsort(truth.T)]).all()


def test_tiles_are_bounded_and_keep_the_order() -> None:
    line = np.column_stack([np.linspace(0, 100, 40_000), np.zeros((40_000, 2))])
    with tiles(chunked(line, 3000), chunked(line, 3000), 0.1, size=5000) as cut:
        sizes = [max(len(tile.reference(0.1)), len(tile.compared(0.1))) for tile in cut]
        for tile in cut:
            assert (np.diff(np.concatenate(list(tile.queries()))[:, 0]) > 0).all()
        assert cut.total == 40_000
        assert sum(tile.asked for tile in cut) == 40_000
        assert [tile.before for tile in cut][1] == next(iter(cut)).asked
    assert len(sizes) >= 8
    assert max(sizes) <= 5500


def test_small_clouds_leave_the_disk_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    with tiles(in_memory(floor(1)), in_memory(floor(2)), 0.1) as cut:
        assert len(list(cut)) == 1


def test_nothing_stays_on_disk_and_a_tile_travels(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with tiles(chunked(floor(1), 900), chunked(floor(2), 900), 0.05, size=4000) as cut:
        assert list(tmp_path.rglob("*.points"))
        # each point lies there once
        held = sum(path.stat().st_size for path in tmp_path.rglob("*.points"))
        assert held == 2 * 30_000 * 4 * 8
        tile = next(iter(cut))
        other = pickle.loads(pickle.dumps(tile))
        assert (other.reference(0.3) == tile.reference(0.3)).all()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("limit", [0.0, -1.0, np.inf, np.nan])
def test_a_limit_that_is_none(limit: float) -> None:
    with (
        pytest.raises(ValueError, match="limit"),
        tiles(in_memory(floor(1)), in_memory(floor(2)), limit),
    ):
        pass


def test_coordinates_that_are_none_are_refused() -> None:
    spoiled = floor(1)
    spoiled[77, 1] = np.inf
    with (
        pytest.raises(InputError, match="not a number"),
        tiles(in_memory(spoiled), in_memory(floor(2)), 0.1),
    ):
        pass


def test_only_what_lies_in_a_site_is_asked_for() -> None:
    a, b = floor(1), floor(2)
    site = ComparisonSite.ball("x", (505_010.0, 2_331_004.0, 20.0), 2.0)
    inside = site.inside(a[:, :3])
    with tiles(chunked(a, 1700), chunked(b, 900), 0.1, site=site, size=4000) as cut:
        asked = np.concatenate(list(cut.queries()))
        assert cut.total == len(asked) == inside.sum()
        assert (cut.origin == a[inside][0, :3]).all()
        assert sum(cut.compared.count(k) for k in range(len(cut.asked))) == len(a)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6), parts=st.integers(1, 40), ordered=st.booleans())
def test_core_points_by_brute_force(seed: int, parts: int, ordered: bool) -> None:
    rng = np.random.default_rng(seed)
    xyz = rng.uniform(-2, 2, (2000, 3))
    if ordered:
        xyz = xyz[np.argsort(xyz[:, 0])]
    origin = xyz[0]
    best: dict[tuple[int, ...], tuple[float, int]] = {}
    for row, point in enumerate((xyz - origin) / 0.4):
        cell = tuple(np.floor(point).astype(int))
        miss = float(((point - np.floor(point) - 0.5) ** 2).sum())
        if cell not in best or miss < best[cell][0]:
            best[cell] = miss, row
    # half a cell apart, those first that are nearest to a middle
    taken: dict[tuple[int, ...], int] = {}
    for cell, (_, row) in sorted(best.items(), key=lambda item: (item[1][0], item[0])):
        others = xyz[list(taken.values())]
        if (np.linalg.norm(xyz[row] - others, axis=1) >= 0.2).all():
            taken[cell] = row
    expected = xyz[[taken[cell] for cell in sorted(taken)]]

    def chunks() -> Iterator[CloudChunk]:
        return (CloudChunk(some) for some in np.array_split(xyz, parts))

    assert (core_points(chunks, 0.4) == expected).all()


@pytest.mark.parametrize("median", [False, True])
def test_distances_along_normals_are_those_of_the_whole(median: bool) -> None:
    a, b = floor(1), floor(2)
    scanner = np.array([505_010.0, 2_331_004.0, 25.0])
    settings_ = M3C2Settings((0.9,), 0.4, 0.1, median=median, scanner=scanner)
    first, second = whole(b[:, :3]), whole(a[:, :3])
    with tiles(chunked(a, 1700), chunked(b, 2100), 0.1, size=4000) as cut:
        assert len(list(cut)) >= 8
        core = core_points(plain(cut.queries), 0.4, origin=cut.origin)
        assert (core == core_points(second, 0.4)).all()
        normals = tile_normals(cut, core, settings_)
        beams = np.full(len(core), 1e-4), np.full(len(core), 2e-4)
        found = tile_m3c2(cut, core, settings_, normals, footprints=beams)
    alone = core_normals(first, core, (0.9,), scanner=scanner)
    truth = m3c2(first, second, core, settings_, normals=alone, footprints=beams)
    assert (normals.count == alone.count).all()
    assert normals.vectors == pytest.approx(alone.vectors, abs=1e-9, nan_ok=True)
    assert (found.first.count == truth.first.count).all()
    assert (found.second.count == truth.second.count).all()
    assert found.distance == pytest.approx(truth.distance, abs=1e-10, nan_ok=True)
    assert found.lod95 == pytest.approx(truth.lod95, abs=1e-9, nan_ok=True)
    assert found.lod95_quadratic == pytest.approx(truth.lod95_quadratic, abs=1e-9, nan_ok=True)


def test_propagated_distances_are_those_of_the_whole() -> None:
    a, b = floor(1), floor(2)
    noise = ScanNoise(1e-3, 1e-5, 4e-5, 4e-5, 4e-3, 3e-4)
    covariance = np.diag([1e-6] * 3 + [1e-9] * 3)
    one, two = (
        Placement(name, Pose(np.eye(3), np.array([x, 2_331_004.0, 25.0])), covariance, noise)
        for name, x in (("B", 505_004.0), ("A", 505_015.0))
    )
    stations = StationPair.independent(one, two)
    settings_ = M3C2Settings((0.9,), 0.4, 0.1, scanner=one.pose.translation)
    with tiles(chunked(a, 1700), chunked(b, 2100), 0.1, size=4000) as cut:
        core = core_points(plain(cut.queries), 0.4, origin=cut.origin)
        normals = tile_normals(cut, core, settings_)
        found = tile_m3c2_ep(cut, core, settings_, normals, stations, (one, two))
    sources = (
        with_random(in_memory(rows), where, core, normals.vectors)
        for rows, where in ((b, one), (a, two))
    )
    truth = m3c2_ep(*sources, core, settings_, stations, normals=normals)
    assert found.distance == pytest.approx(truth.distance, abs=1e-9, nan_ok=True)
    assert found.sigma == pytest.approx(truth.sigma, rel=1e-9, nan_ok=True)
    assert found.lod95_spatial == pytest.approx(truth.lod95_spatial, rel=1e-7, nan_ok=True)
