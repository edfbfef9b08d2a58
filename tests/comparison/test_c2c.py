"""Distances of simulated surfaces: figures, floor, what is left after it, local planes."""

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from tests.comparison.clouds import cloud_to_cloud, in_memory, lattice_floor, random_floor
from tribrach.comparison.c2c import C2C, Sample, Tally, plane_distances
from tribrach.comparison.nearest import Neighbours

UTM = np.array([505_123.4, 2_331_456.7, 20.0])
ACROSS, UP = 0.020, 0.025
INTO, OFF = np.array([0.2, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])


def wall(across: float, up: float, noise: float, seed: int, offset: float = 0.0) -> np.ndarray:
    """A wall of 4 by 4 m in columns, in the plane y = offset, noise across it."""
    rng = np.random.default_rng(seed)
    x, z = np.meshgrid(np.arange(0, 4, across), np.arange(0, 4, up), indexing="ij")
    return np.column_stack([x.ravel(), offset + noise * rng.normal(size=x.size), z.ravel()])


def inner(points: np.ndarray) -> np.ndarray:
    """Points away from the border."""
    x, _, z = points.T
    return points[(x > 0.2) & (x < 3.8) & (z > 0.2) & (z < 3.8)]


def other(noise: float, seed: int, offset: float = 0.0) -> np.ndarray:
    """The wall from a station whose points are in no step with those of the reference."""
    points = wall(0.0173, 0.0241, noise, seed, offset)
    turn, back = np.cos(0.4), np.sin(0.4)
    points[:, 0], points[:, 2] = (
        turn * points[:, 0] - back * points[:, 2] + 0.8,
        back * points[:, 0] + turn * points[:, 2] - 0.8,
    )
    return inner(points)


def compared(noise: float, offset: float = 0.0, shift: np.ndarray | float = 0.0, **more) -> C2C:
    """A wall from two stations."""
    a, b = other(noise, 1, offset), wall(ACROSS, UP, noise, 2)
    return cloud_to_cloud(in_memory(a + shift), in_memory(b + shift), 0.2, **more)


def test_figures_are_those_of_the_distances() -> None:
    a, b = inner(wall(0.0173, 0.0241, 0.003, 1)), wall(ACROSS, UP, 0.003, 2)
    expected = cKDTree(b).query(a)[0]
    near = expected[expected <= 0.012]
    found = cloud_to_cloud(in_memory(a), in_memory(b), 0.012)
    assert found.n == len(near)
    assert found.beyond == pytest.approx(1 - len(near) / len(a))
    assert found.mean == pytest.approx(near.mean(), rel=1e-9)
    assert found.std == pytest.approx(near.std(), rel=1e-9)
    assert found.rms == pytest.approx(np.sqrt((near**2).mean()), rel=1e-9)
    assert found.median == pytest.approx(np.median(near), abs=2e-6)
    assert found.q95 == pytest.approx(np.quantile(near, 0.95), abs=2e-6)
    assert any("cuts distances" in sentence for sentence in found.notes)


@pytest.mark.parametrize("shift", [0.0, UTM])
def test_without_errors_there_is_nothing_but_the_floor(shift: np.ndarray | float) -> None:
    found = compared(0.0, shift=shift)
    floor = lattice_floor(ACROSS, UP)
    assert found.floor_model == "lattice"
    assert found.floor is not None
    assert (found.floor.mean, found.floor.std, found.floor.rms) == pytest.approx(
        (floor.mean, floor.std, floor.rms), rel=1e-6
    )
    assert found.mean == pytest.approx(floor.mean, rel=0.01)
    assert found.std == pytest.approx(floor.std, rel=0.01)
    assert found.rms == pytest.approx(floor.rms, rel=0.01)
    assert found.pitch_b is not None
    assert found.pitch_a is not None
    assert (found.pitch_b.across, found.pitch_b.up) == pytest.approx((ACROSS, UP), rel=1e-5)
    assert (found.pitch_a.across, found.pitch_a.up) == pytest.approx((0.0173, 0.0241), rel=1e-4)
    assert found.local_plane is not None
    assert found.local_plane.rms < 1e-8
    assert found.debiased_rms is None or found.debiased_rms < 0.1 * floor.rms


@pytest.mark.parametrize("noise", [0.0015, 0.002, 0.0025])
def test_debiased_rms_gives_the_noise_back(noise: float) -> None:
    """Two clouds of the same noise, over several draws of both."""
    squares = []
    for seed in range(3):
        a, b = other(noise, 2 * seed), wall(ACROSS, UP, noise, 2 * seed + 1)
        found = cloud_to_cloud(in_memory(a), in_memory(b), 0.2)
        assert found.debiased_rms is not None
        squares.append(found.debiased_rms**2)
        assert not any("too small" in sentence for sentence in found.notes)
    # the nearest of several noisy points is a little nearer than the surface
    assert np.sqrt(np.mean(squares)) == pytest.approx(noise * np.sqrt(2), rel=0.08)
    assert np.sqrt(np.mean(squares)) < noise * np.sqrt(2)


def test_noise_as_large_as_the_pitch_is_called_too_small() -> None:
    found = compared(0.012)
    assert found.debiased_rms is not None
    assert found.debiased_rms < 0.9 * 0.012 * np.sqrt(2)
    assert any("too small" in sentence for sentence in found.notes)


def test_offset_comes_through() -> None:
    found = compared(0.001, offset=0.004)
    assert found.debiased_rms == pytest.approx(np.sqrt(0.004**2 + 2 * 0.001**2), rel=0.05)
    assert found.local_plane is not None
    assert found.local_plane.mean == pytest.approx(0.004, abs=1e-4)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_planes_are_signed_towards_the_viewpoint(side: float) -> None:
    found = compared(0.001, 0.005, UTM, viewpoint=UTM + np.array([2.0, 30 * side, 2.0]))
    assert found.local_plane is not None
    assert found.local_plane.mean == pytest.approx(0.005 * side, abs=1e-4)
    assert found.local_plane.median == pytest.approx(0.005 * side, abs=2e-4)
    # noise of the points and of planes through sixteen of them
    assert found.local_plane.std == pytest.approx(0.001 * np.sqrt(1 + 1 / 16), rel=0.04)


def test_planes_do_not_go_beyond_the_border() -> None:
    b = wall(0.01, 0.01, 0.0005, 3)[:40_000]
    beside = np.column_stack([np.full(50, -0.06), np.full(50, 0.01), np.linspace(1, 3, 50)])
    tree = Neighbours(b)
    assert np.isnan(plane_distances(tree, beside, 0.2)).all()
    assert np.isfinite(plane_distances(tree, beside + INTO, 0.2)).all()
    assert np.isnan(plane_distances(tree, beside + INTO + OFF, 0.2)).all()
    assert np.isnan(plane_distances(Neighbours(b[:5]), beside, 0.2)).all()


def test_points_at_random_have_a_measured_floor() -> None:
    rng = np.random.default_rng(4)
    a, b = (np.column_stack([*rng.uniform(0, 2, (2, n)), np.zeros(n)]) for n in (30_000, 40_000))
    found = cloud_to_cloud(in_memory(a), in_memory(b), 0.2)
    floor = random_floor(0.01)
    assert found.floor_model == "measured"
    assert found.floor is not None
    assert found.floor.mean == pytest.approx(floor.mean, rel=0.05)
    assert found.mean == pytest.approx(floor.mean, rel=0.02)
    assert any("no lattice" in sentence for sentence in found.notes)


def test_nothing_near() -> None:
    found = cloud_to_cloud(in_memory(wall(0.1, 0.1, 0, 1, 5.0)), in_memory(wall(0.1, 0.1, 0, 2)), 1)
    assert (found.n, found.beyond, found.mean, found.floor) == (0, 1.0, None, None)
    assert found.notes == ("no point of the compared cloud has a neighbour within the limit",)


def test_few_points_and_no_surface() -> None:
    rng = np.random.default_rng(5)
    bush = rng.uniform(0, 1, (4000, 3))
    found = cloud_to_cloud(in_memory(bush[:20] + 0.01), in_memory(bush), 0.2)
    assert found.floor is None or found.floor.rms > 0
    assert any("only 20 points" in sentence for sentence in found.notes)
    alone = cloud_to_cloud(in_memory(bush[:40] + 0.01), in_memory(bush[:40]), 0.2)
    assert alone.floor is None
    assert alone.debiased_rms is None
    assert any("floor is not known" in sentence for sentence in alone.notes)


def shuffled(points: np.ndarray, size: int):
    """A stream in chunks."""

    def chunks() -> Iterator[np.ndarray]:
        return (points[k : k + size] for k in range(0, len(points), size))

    return chunks


@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 1000), size=st.sampled_from([2500, 6000]))
def test_tiles_say_what_the_whole_says(seed: int, size: int) -> None:
    a, b = inner(wall(0.0373, 0.0441, 0.002, seed)), wall(0.04, 0.045, 0.002, seed + 1)
    whole = cloud_to_cloud(in_memory(a), in_memory(b), 0.04)
    tiles = cloud_to_cloud(shuffled(a, 1700), shuffled(b, 1900), 0.04, size=size)
    assert tiles.n == whole.n
    assert (tiles.tally.bins == whole.tally.bins).all()
    assert (tiles.mean, tiles.std, tiles.rms) == pytest.approx((whole.mean, whole.std, whole.rms))
    assert (tiles.median, tiles.q95) == pytest.approx((whole.median, whole.q95), abs=1e-12)
    assert tiles.floor is not None
    assert whole.floor is not None
    assert tiles.floor.mean == pytest.approx(whole.floor.mean, rel=0.01)
    assert tiles.local_plane is not None
    assert whole.local_plane is not None
    assert tiles.local_plane.std == pytest.approx(whole.local_plane.std, rel=0.05)


@given(
    values=st.lists(st.floats(0, 0.3), min_size=1, max_size=60),
    cuts=st.integers(1, 20),
)
def test_tally_is_numpy(values: list[float], cuts: int) -> None:
    d = np.array(values)
    tally = Tally(0.0, 0.2)
    for k in range(0, len(d), cuts):
        tally.add(d[k : k + cuts])
    near = d[d <= 0.2]
    assert (tally.count, tally.beyond) == (len(near), len(d) - len(near))
    if len(near):
        assert tally.mean == pytest.approx(near.mean(), abs=1e-12)
        assert tally.std == pytest.approx(near.std(), abs=1e-9)
        low, high = np.quantile(near, [0.5, 0.5], method="lower"), np.quantile(near, 0.5)
        assert low[0] - 1.1e-5 <= tally.quantile(0.5) <= max(high, near.max()) + 1.1e-5
        assert tally.histogram(100)[1].sum() == len(near)


def test_tally_keeps_its_digits_with_large_means() -> None:
    rng = np.random.default_rng(1)
    d = 1e4 + rng.normal(0, 1e-4, 100_000)
    tally = Tally(9e3, 1.1e4)
    for part in np.array_split(d, 7):
        tally.add(part)
    assert tally.std == pytest.approx(d.std(), rel=1e-6)


@given(st.lists(st.integers(0, 40), max_size=30), st.integers(1, 50))
def test_sample_is_every_so_many_th(sizes: list[int], most: int) -> None:
    rows = np.arange(sum(sizes), dtype=float)[:, None]
    sample, start = Sample(most, 1), 0
    for size in sizes:
        sample.add(rows[start : start + size])
        start += size
    assert len(sample.rows) <= most
    assert (sample.rows == rows[:: sample.step]).all()
