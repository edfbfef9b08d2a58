"""Sites are chosen on flat surfaces that both clouds have, and spread over range and incidence."""

import numpy as np
import pytest

from tribrach.comparison.sites import choose_sites

SCANNERS = [np.array([0.0, -20.0, 1.5]), np.array([12.0, -15.0, 1.6])]
FAR = np.array([505_000.0, 2_331_000.0, 0.0])


def wall(rng: np.random.Generator, x: tuple[float, float], n: int) -> tuple[np.ndarray, np.ndarray]:
    """Points of the wall y = 0, 6 m high, with their normals."""
    points = np.column_stack([rng.uniform(*x, n), 2e-3 * rng.normal(size=n), rng.uniform(0, 6, n)])
    return points, np.tile([0.0, -1.0, 0.0], (n, 1))


def bush(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Points in a ball of 1 m with normals of all directions."""
    normals = rng.normal(size=(n, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    return np.array([5.0, -3.0, 1.5]) + rng.uniform(-1, 1, (n, 3)), normals


@pytest.mark.parametrize("shift", [np.zeros(3), FAR])
def test_sites_lie_on_the_part_of_the_wall_that_both_see(shift: np.ndarray) -> None:
    rng = np.random.default_rng(2)
    clouds = []
    for x in ((-20.0, 10.0), (-5.0, 30.0)):
        parts = [wall(rng, x, 6000), bush(rng, 3000)]
        points, normals = (np.concatenate(side) for side in zip(*parts, strict=True))
        normals[::50] = np.nan
        clouds.append((points + shift, normals))
    found = choose_sites(clouds, [s + shift for s in SCANNERS], 12)
    assert len(found) == 12
    assert [site.name for site in found] == [str(k) for k in range(1, 13)]
    centers = np.array([site.center - shift for site in found])
    assert np.abs(centers[:, 1]).max() < 0.01
    assert centers[:, 0].min() > -6.0
    assert centers[:, 0].max() < 11.0
    assert all(site.radius == 1.0 for site in found)
    ranges = [max(np.linalg.norm(c - s) for s in SCANNERS) for c in centers]
    assert np.ptp(ranges) > 2.0
    assert len(np.unique(centers.round(2), axis=0)) == 12


def test_nothing_flat_nothing_chosen() -> None:
    rng = np.random.default_rng(3)
    clouds = [bush(rng, 4000), bush(rng, 4000)]
    assert choose_sites(clouds, SCANNERS) == []
    assert choose_sites([wall(rng, (0, 5), 500), wall(rng, (50, 60), 500)], SCANNERS) == []
