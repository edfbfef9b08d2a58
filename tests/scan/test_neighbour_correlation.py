import numpy as np
import pytest

from tests.scan.correlated_grids import patch_grid
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.instruments.neighbours import RangeCorrelation, overlap_share
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.scan import neighbour_correlation as module
from tribrach.scan.neighbour_correlation import neighbour_correlation, smooth_correlation
from tribrach.scan.noise_law import fit_noise
from tribrach.scan.observed_noise import patch_residuals
from tribrach.simulate import scene as sc
from tribrach.simulate.scanner import ScanGrid, Scanner, scan

PITCH = np.array([4e-4, 3e-4])


def test_what_a_surface_takes_up_is_that_of_dense_matrices() -> None:
    rng = np.random.default_rng(1)
    i, j = (at.ravel() for at in np.mgrid[:9, :7])
    kept = rng.random(len(i)) < 0.8
    i, j = i[kept], j[kept]
    patch = module._Patch.of(rng.normal(size=len(i)), i, j, 1)
    assert patch is not None
    widths = np.array([9e-4, 2.1e-3])
    sums = patch.sums(PITCH, widths)
    design = np.column_stack([np.ones(len(i)), i, j])
    left = np.eye(len(i)) - design @ np.linalg.solve(design.T @ design, design.T)
    down, beside = np.abs(i[:, None] - i), np.abs(j[:, None] - j)
    away = np.hypot(down * PITCH[0], beside * PITCH[1])
    covariances = [np.eye(len(i)), *(overlap_share(away / w) for w in widths)]
    for k, (a, b) in enumerate(module._LAGS):
        at = (down == a) & (beside == b)
        assert sums.pairs[k] == at.sum()
        for c, covariance in enumerate(covariances):
            expected = np.sum(at * (left @ covariance @ left))
            assert sums.expected[k, c] == pytest.approx(expected, abs=1e-9)
            assert sums.plain[k, c] == pytest.approx(np.sum(at * covariance), abs=1e-9)


def test_independent_points_are_not_taken_for_alike() -> None:
    told, shifts = 0, []
    for seed in range(8):
        grid = patch_grid(np.random.default_rng(seed), 0.0, 0.0, size=6, patches=60)
        found = neighbour_correlation(*grid, PITCH, degree=1)
        assert found is not None
        told += found.told
        shifts.append(found.correlation[:2] / found.correlation_sigma[:2])
        # residuals of planes through windows of six are alike to -0.08 at the nearest lags
        raw = _products(*grid)
        assert raw < found.correlation[:2].mean() - 0.04
    assert told == 0
    assert abs(np.mean(shifts)) < 1.0


def _products(residual: object, row: object, column: object, patch: object) -> float:
    """Mean product of neighbours in a row over the mean square, nothing put right."""
    residual, row, column, patch = map(np.asarray, (residual, row, column, patch))
    beside = (np.diff(row) == 0) & (np.diff(column) == 1) & (np.diff(patch) == 0)
    return float(np.mean((residual[1:] * residual[:-1])[beside]) / np.mean(residual**2))


@pytest.mark.parametrize(
    ("share", "width", "degree"), [(0.3, 2, 2), (0.6, 4, 2), (0.6, 2, 1), (0.3, 4, 1)]
)
def test_share_width_and_effective_number_come_back(
    share: float, width: float, degree: int
) -> None:
    pitch = np.array([3e-4, 3e-4])
    shares, factors, nearest = [], [], []
    for seed in range(3):
        grid = patch_grid(np.random.default_rng(100 + seed), share, width, size=12)
        found = neighbour_correlation(*grid, pitch, degree=degree)
        assert found is not None
        assert found.told
        shares.append(found.share)
        factors.append(found.factor)
        nearest.append(found.nearest)
    true = RangeCorrelation(share, width * 3e-4)
    assert np.mean(nearest) == pytest.approx(true.correlation(np.array(3e-4)), abs=0.03)
    assert np.mean(factors) == pytest.approx(true.factor(3e-4, 3e-4), rel=0.1)
    assert np.mean(shares) == pytest.approx(share, abs=0.1)


def test_planes_hide_variance_that_neighbours_share() -> None:
    grid = patch_grid(np.random.default_rng(7), 0.6, 5.0, size=8, patches=150)
    found = neighbour_correlation(*grid, np.array([3e-4, 3e-4]), degree=1)
    assert found is not None
    variance = np.sum(grid[0] ** 2) / (len(grid[0]) - 3 * 150)
    # errors of 2 mm were put in; single patches show less
    assert variance < 0.8 * 0.002**2
    assert variance * found.lost == pytest.approx(0.002**2, rel=0.15)
    assert "points count as one" in found.sentence()
    assert found.keys["shared_share"] == pytest.approx(found.share, abs=5e-4)


def test_bows_of_surfaces_are_not_shared_errors_if_they_are_taken_out() -> None:
    residual, row, column, patch = patch_grid(
        np.random.default_rng(8), 0.0, 0.0, size=10, filled=1.0
    )
    bow = 2e-4 * ((row % 10 - 4.5) ** 2 - 8.25)
    plane = neighbour_correlation(residual + bow, row, column, patch, PITCH, degree=1)
    bowed = neighbour_correlation(residual + bow, row, column, patch, PITCH)
    assert plane is not None
    assert bowed is not None
    assert plane.told
    assert not bowed.told
    assert "nothing that neighbours share" in bowed.sentence()
    assert bowed.factor == 1.0


def test_too_little_to_tell_and_wrong_input() -> None:
    grid = patch_grid(np.random.default_rng(9), 0.0, 0.0, patches=5)
    assert neighbour_correlation(*grid, PITCH) is None
    with pytest.raises(InputError, match="different lengths"):
        neighbour_correlation(grid[0][1:], *grid[1:], PITCH)
    with pytest.raises(InputError, match="pitch"):
        neighbour_correlation(*grid, np.array([0.0, 1.0]))


def test_errors_alike_over_whole_patches_are_said_to_reach_as_far_or_farther() -> None:
    residual, row, column, patch = patch_grid(np.random.default_rng(3), 0.7, 9.0, size=9)
    found = neighbour_correlation(residual, row, column, patch, np.array([3e-4, 3e-4]), degree=1)
    assert found is not None
    assert found.told
    assert found.angle > 6 * 3e-4
    assert (found.angle >= found.widest) == ("mrad or more, by" in found.sentence())


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_what_a_simulated_scanner_shares_is_found_in_its_scans(share: float) -> None:
    angle, step = 1.8e-3, 6e-4
    noise = ScanNoise(0.001, 0.0, 1e-5, 1e-5, 0.002, 1e-4, shared_share=share, shared_angle=angle)
    wall = sc.Scene.of([sc.rectangle((6, 0, 0), (-1, 0, 0), 8, 6, 0.6)])
    grid = ScanGrid.window((-0.2, 0.25), (1.5, 1.64), step)
    parts = list(scan(wall, Pose(np.eye(3), np.zeros(3)), Scanner(noise), grid, 11))
    xyz, row, column = (
        np.concatenate([getattr(p, n) for p in parts]) for n in ("xyz", "row", "column")
    )
    found = smooth_correlation(fit_noise(patch_residuals(xyz, None, row, column)))
    assert found is not None
    assert found.told == (share > 0)
    assert found.share == pytest.approx(share, abs=0.1)
    # rows and columns are as far apart as the steps of a window at the horizon
    assert found.pitch == pytest.approx([step, step], rel=0.05)
    true = noise.shared.at(5.0)
    assert found.nearest == pytest.approx([float(true.correlation(np.array(step)))] * 2, abs=0.06)
    assert found.factor == pytest.approx(true.factor(step, step), rel=0.2)
