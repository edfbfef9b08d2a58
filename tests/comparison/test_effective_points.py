import numpy as np
import pytest

from tribrach.comparison.effective_points import effective_number, overlap_factor, overlap_share


def test_share_of_two_discs_by_monte_carlo() -> None:
    rng = np.random.default_rng(1)
    xy = rng.uniform(-0.5, 0.5, (400_000, 2))
    disc = np.hypot(*xy.T) <= 0.5
    for u in (0.2, 0.5, 0.9):
        other = np.hypot(xy[:, 0] - u, xy[:, 1]) <= 0.5
        expected = (disc & other).sum() / disc.sum()
        assert overlap_share(np.array([u]))[0] == pytest.approx(expected, abs=4e-3)
    assert np.array_equal(overlap_share(np.array([0.0, 1.0, 7.0])), [1, 0, 0])


def test_beams_that_do_not_overlap_are_independent() -> None:
    assert np.array_equal(overlap_factor(np.array([0.0, 0.4, 1.0])), [1, 1, 1])
    number = effective_number(np.array([100.0, 0.0]), 0.01, np.array(5e-5))
    assert np.array_equal(number, [100, 0])


def test_dense_scans_have_one_point_per_footprint() -> None:
    ratio = np.array([5.9, 6.1, 50.0])
    assert overlap_factor(ratio) == pytest.approx(np.pi / 4 * ratio**2, rel=4e-3)
    number = effective_number(np.array([1e5]), 0.01, np.array([1e-4]))
    assert number == pytest.approx(100, rel=4e-3)


def test_variance_of_means_of_points_that_see_an_area() -> None:
    # white texture averaged over discs: the mean over a lattice of discs on a torus
    rng = np.random.default_rng(3)
    fine, step, diameter = 240, 5, 12
    grid = np.minimum(np.arange(fine), fine - np.arange(fine))
    disc = np.hypot(*np.meshgrid(grid, grid)) <= diameter / 2
    kernel = np.fft.rfft2(disc / disc.sum())
    means, singles = [], []
    for _ in range(400):
        seen = np.fft.irfft2(np.fft.rfft2(rng.normal(size=(fine, fine))) * kernel)
        picked = seen[::step, ::step]
        means.append(picked.mean())
        singles.append(picked.var())
    n = (fine / step) ** 2
    factor = n * np.var(means) / np.mean(singles)
    assert factor == pytest.approx(overlap_factor(np.array([diameter / step]))[0], rel=0.2)
