"""AC-06 and AC-07: the floor of lattices in closed form, by Monte Carlo, and measured on points."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.spatial import cKDTree

from tests.comparison.clouds import lattice_floor, random_floor
from tribrach.comparison.nearest import Neighbours
from tribrach.comparison.sampling_floor import (
    lattice_mean,
    lattice_square,
    pattern,
)
from tribrach.io.number_table import read_numbers
from tribrach.units import UNITS

UTM = np.array([505_123.4, 2_331_456.7, 20.0])


def lattice(across: float, up: float, noise: float = 0.0, shift: float = 0.0, count: int = 110):
    """A wall in the plane y = 0, its points noisy across it; ``shift`` shears the rows."""
    rng = np.random.default_rng(4)
    i, j = (k.ravel().astype(float) for k in np.meshgrid(np.arange(count), np.arange(count)))
    return np.column_stack([i * across + j * shift, noise * rng.normal(size=len(i)), j * up])


def middle(points: np.ndarray, count: int = 300) -> np.ndarray:
    """Places on the wall away from its border."""
    rng = np.random.default_rng(5)
    low, high = points.min(axis=0), points.max(axis=0)
    places = low + rng.uniform(0.25, 0.75, (count, 3)) * (high - low)
    places[:, 1] = 0.0
    return places


def test_square() -> None:
    floor = lattice_floor(1.0, 1.0)
    assert floor.mean == pytest.approx(0.382598, abs=5e-7)
    assert floor.std == pytest.approx(0.142427, abs=5e-7)
    assert floor.rms == pytest.approx(1 / np.sqrt(6))
    assert floor.mean == pytest.approx((np.sqrt(2) + np.log1p(np.sqrt(2))) / 6)


@pytest.mark.parametrize("ratio", [0.2, 0.7, 1.0, 3.0, 8.0])
def test_rectangles_against_integrals_and_monte_carlo(ratio: float) -> None:
    area = ratio
    mean = dblquad(lambda y, x: np.hypot(x, y), -ratio / 2, ratio / 2, -0.5, 0.5)[0] / area
    floor = lattice_floor(ratio, 1.0)
    assert floor.mean == pytest.approx(mean, rel=1e-7)
    rng = np.random.default_rng(1)
    points = lattice(ratio, 1.0, count=41)[:, [0, 2]]
    places = rng.uniform(10, 30, (100_000, 2)) * [ratio, 1.0]  # whole cells
    found = cKDTree(points).query(places)[0]
    assert found.mean() == pytest.approx(floor.mean, abs=4 * floor.std / np.sqrt(len(found)))
    assert found.std() == pytest.approx(floor.std, rel=0.02)
    assert np.sqrt((found**2).mean()) == pytest.approx(floor.rms, rel=0.01)


def test_incidence_stretches_one_pitch() -> None:
    tilted = lattice_floor(0.0231, 0.0231, np.radians(60))
    assert tilted.mean == pytest.approx(lattice_floor(0.0462, 0.0231).mean)
    assert tilted.rms == pytest.approx(0.0231 * np.sqrt(5 / 12))


def test_points_at_random() -> None:
    """Mean 0.5 s and RMS s / sqrt(pi) of a Poisson process, simulated."""
    rng = np.random.default_rng(2)
    points, places = rng.uniform(0, 1, (60_000, 2)), rng.uniform(0.05, 0.95, (60_000, 2))
    found, floor = cKDTree(points).query(places)[0] * np.sqrt(60_000), random_floor(1.0)
    assert floor.mean == 0.5
    assert found.mean() == pytest.approx(0.5, rel=0.01)
    assert found.std() == pytest.approx(floor.std, rel=0.02)
    assert np.sqrt((found**2).mean()) == pytest.approx(floor.rms, rel=0.01)


def test_one_published_site() -> None:
    """Pitch 11 mm at 10 m: floor 8.8 and 3.3 mm at 21 m; at 21 m and 22 degrees the RMS of
    12.6 mm leaves 7.8 mm for the pair, 5.5 mm for a scan."""
    pitch = 1.1e-3 * 21
    flat, tilted = lattice_floor(pitch, pitch), lattice_floor(pitch, pitch, np.radians(22))
    assert (1e3 * flat.mean, 1e3 * flat.std) == pytest.approx((8.8, 3.3), abs=0.05)
    assert 1e3 * tilted.rms == pytest.approx(9.8, abs=0.05)
    left = np.sqrt(11.6**2 + 4.8**2 - (1e3 * tilted.rms) ** 2)
    assert (left, left / np.sqrt(2)) == pytest.approx((7.8, 5.5), abs=0.05)


@pytest.mark.data
def test_published_sites(shared_data: Path) -> None:
    """AC-07: pitch, range and incidence alone give the means of Table 3."""
    path = shared_data / "papers" / "sixteen_sites.csv"
    if not path.is_file():
        pytest.skip("the published rows of the sixteen test sites are not among the shared data")
    table = read_numbers(path, ["range", "incidence", "mean", "std"])
    length = table.values["range"] * UNITS[table.units["range"]]
    angle = table.values["incidence"] * UNITS[table.units["incidence"]]
    pitch = 1.1e-3 * length
    mean = 1e3 * lattice_mean(pitch, pitch / np.cos(angle))
    square = 1e6 * lattice_square(pitch, pitch / np.cos(angle))
    assert np.corrcoef(mean, table.values["mean"])[0, 1] == pytest.approx(0.986, abs=0.004)
    assert (table.values["mean"] / mean).mean() == pytest.approx(1.04, abs=0.02)
    ratio = table.values["std"] / np.sqrt(square - mean**2)
    assert ratio.mean() == pytest.approx(1.04, abs=0.05)


@pytest.mark.parametrize(
    ("across", "up", "noise"),
    [(0.01, 0.01, 0.0), (0.01, 0.025, 0.002), (0.04, 0.01, 0.0), (0.01, 0.01, 0.006)],
)
def test_pitch_of_a_lattice(across: float, up: float, noise: float) -> None:
    points = lattice(across, up, noise)
    found = pattern(Neighbours(points + UTM), middle(points) + UTM)
    assert found.known.mean() > 0.45  # noisy places take more neighbours and are thinned
    assert found.lattice[found.known].mean() > 0.95
    assert np.median(found.pitch[found.lattice], axis=0) == pytest.approx([across, up], rel=2e-3)
    expected = lattice_floor(across, up)
    assert found.mean[found.lattice] == pytest.approx(expected.mean, rel=0.03)
    assert np.abs(found.normal[found.known, 1]).mean() > 0.99


def test_rows_that_are_out_of_step() -> None:
    """A sheared lattice has the rectangle of its cell's area along the shorter side."""
    points = lattice(0.01, 0.02, shift=0.003)
    found = pattern(Neighbours(points), middle(points, 100))
    inner = found.lattice
    assert inner.mean() > 0.9
    assert np.median(found.pitch[inner], axis=0) == pytest.approx([0.01, 0.02], rel=1e-6)


def test_floor_of_points_at_random_is_measured() -> None:
    rng = np.random.default_rng(3)
    points = np.column_stack([*rng.uniform(0, 1.5, (2, 22_500)), np.zeros(22_500)])
    places = np.column_stack([*rng.uniform(0.2, 1.3, (2, 1500)), np.zeros(1500)])
    found = pattern(Neighbours(points), places)
    assert found.lattice.mean() < 0.02
    assert found.mean[found.known].mean() == pytest.approx(random_floor(0.01).mean, rel=0.02)
    assert found.square[found.known].mean() == pytest.approx(random_floor(0.01).rms ** 2, rel=0.04)
    assert np.median(found.pitch[found.known]) == pytest.approx(0.01, rel=0.05)


def test_points_shaken_out_of_their_lattice() -> None:
    """Half between both: the floor is measured where the lattice does not fit."""
    rng = np.random.default_rng(6)
    points = lattice(0.01, 0.01)
    points[:, [0, 2]] += rng.normal(0, 0.0025, (len(points), 2))
    places = middle(points, 1500)
    found = pattern(Neighbours(points), places)
    truth = cKDTree(points[:, [0, 2]]).query(rng.uniform(0.3, 0.7, (100_000, 2)) * 1.09)[0]
    assert lattice_floor(0.01, 0.01).mean * 1.03 < truth.mean() < random_floor(0.01).mean
    assert found.mean[found.known].mean() == pytest.approx(truth.mean(), rel=0.03)


def test_no_surface_no_pattern() -> None:
    rng = np.random.default_rng(7)
    bush = rng.uniform(0, 1, (5000, 3))
    assert pattern(Neighbours(bush), bush[:50]).known.mean() < 0.1
    wall = lattice(0.01, 0.01)
    beyond = middle(wall, 20) + np.array([1.2, 0.0, 0.0])
    assert not pattern(Neighbours(wall), beyond).known.any()
    assert not pattern(Neighbours(wall[:20]), wall[:3]).known.any()


def test_limit_cuts_the_floor() -> None:
    points = lattice(0.1, 0.1)
    found = pattern(Neighbours(points), middle(points, 2000), 0.05)
    rng = np.random.default_rng(8)
    d = np.hypot(*rng.uniform(-0.05, 0.05, (2, 100_000)))
    assert found.mean[found.known].mean() == pytest.approx(d[d <= 0.05].mean(), rel=0.02)
