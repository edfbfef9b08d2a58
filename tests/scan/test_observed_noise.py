"""Planar patches of scans and the residuals of their points along the beams."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from tests.scan.in_memory import in_memory
from tribrach.geometry.polar import xyz_from_polar
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.scan.coordinate_step import coordinate_step
from tribrach.scan.observed_noise import joined, observed_noise, patch_residuals
from tribrach.units import SEC

SIGMA = 0.002


def wall(seed=1, sigma=SIGMA, turned=0.4, size=150, step=2e-3):
    """A wall at 8 m, its normal turned about the standing axis; points with row and column."""
    rng = np.random.default_rng(seed)
    column, row = np.meshgrid(np.arange(size), np.arange(size))
    column, row = column.ravel(), row.ravel()
    h, v = (column - size / 2) * step, np.pi / 2 + (row - size / 2) * step
    u = xyz_from_polar(np.column_stack([np.ones(len(h)), h, v]))
    normal = np.array([np.cos(turned), np.sin(turned), 0.0])
    rho = 8 * np.cos(turned) / (u @ normal) + sigma * rng.standard_normal(len(h))
    return u * rho[:, None], row, column


@pytest.mark.parametrize("grid", [True, False])
def test_residuals_are_the_noise_along_the_beam(grid):
    xyz, row, column = wall()
    found = patch_residuals(xyz, None, *((row, column) if grid else (None, None)))
    assert found.gridded == grid
    assert len(found) > 0.85 * len(xyz)
    # what is chi-square distributed: squared residuals, with three unknowns for each patch
    points = np.bincount(found.patch)
    assert np.abs(found.redundancies - (points - 3)).max() < 1e-6
    low, high = chi2.ppf([1e-3, 1 - 1e-3], found.redundancies.sum()) * SIGMA**2
    assert low < (found.residual**2).sum() < high
    assert found.step == 0
    assert found.pitch == pytest.approx(np.full((found.patches, 2), 2e-3), rel=0.02)
    assert not found.intense


def test_patches_of_an_exact_plane_have_no_residuals_and_its_slopes():
    xyz, row, column = wall(sigma=0.0)
    found = patch_residuals(xyz, np.ones(len(xyz)), row, column)
    assert np.abs(found.residual).max() < 1e-9
    # the wall stands: only horizontal movements change the range, by the tangent of the incidence
    h = (found.column - 75) * 2e-3
    inside = np.abs(found.row - 75) < 3
    assert np.abs(found.slope[inside, 0] + np.tan(0.4 - h[inside])).max() < 1e-4
    assert np.abs((found.slope**2).sum(axis=1) - (1 / found.cosine**2 - 1)).max() < 1e-9


def test_stated_variance_holds_angles_and_footprint():
    found = patch_residuals(*_swapped(wall(sigma=0.0)))
    noise = ScanNoise(0.001, 1e-5, 10 * SEC, 20 * SEC, 0.004, 3e-4)
    spot = np.hypot(0.004, 3e-4 * found.range) / 4
    across = found.slope**2 * found.range[:, None] ** 2 * (np.array([10, 20]) * SEC) ** 2
    expected = ((0.001 + 1e-5 * found.range) / found.cosine) ** 2 + across.sum(axis=1)
    expected += (found.slope**2).sum(axis=1) * spot**2
    assert found.stated(noise) == pytest.approx(expected, rel=1e-12)
    rounded = replace(found, step=0.002)
    assert rounded.stated(noise) - expected == pytest.approx(4e-6 / 12 / found.cosine**2)


def _swapped(points):
    xyz, row, column = points
    return xyz, None, row, column


def test_bodies_and_edges_are_no_patches():
    """A cylinder of 0.4 m at 3 m with 0.1 mm of noise, and a wall with steps of 1 cm."""
    rng = np.random.default_rng(4)
    size, step = 160, 1.2e-3
    column, row = (a.ravel() for a in np.meshgrid(np.arange(size), np.arange(size)))
    h, v = (column - size / 2) * step, np.pi / 2 + (row - size / 2) * step
    u = xyz_from_polar(np.column_stack([np.ones(len(h)), h, v]))
    flat = np.sin(v)
    b = 3.0 * np.cos(h)
    rho = (b - np.sqrt(b**2 - (9 - 0.16))) / flat + 1e-4 * rng.standard_normal(len(h))
    found = patch_residuals(u * rho[:, None], None, row, column)
    assert found.windows > 10
    assert found.patches == 0
    steps = 3 / u[:, 0] + 0.01 * ((column // 3) % 2) + 1e-4 * rng.standard_normal(len(h))
    found = patch_residuals(u * steps[:, None], None, row, column)
    assert np.median(np.sqrt(found.variances)) > 0.003 if found.patches else True


def test_rounded_coordinates_are_recognised():
    xyz, row, column = wall()
    coarse = np.round(xyz / 0.002) * 0.002
    assert coordinate_step(coarse) == 0.002
    assert coordinate_step(xyz) == 0
    found = patch_residuals(coarse, None, row, column)
    assert found.step == 0.002
    excess = (found.residual**2 - found.rounding * found.redundancy).sum()
    assert np.sqrt(excess / found.redundancy.sum()) == pytest.approx(SIGMA, rel=0.02)


def test_echoes_that_share_a_beam_and_scans_of_unknown_place_are_left_out():
    xyz, row, column = wall()
    several = np.where(column < 75, 1, 2).astype(np.uint8)
    scan = in_memory(xyz, row=row, column=column, number_of_returns=several)
    found = observed_noise(scan)
    assert found.patches > 100
    assert found.column.max() < 75
    assert len(observed_noise(replace(scan, origin="unknown"))) == 0


def test_a_part_of_a_scan_is_read_and_patches_are_numbered_through():
    xyz, row, column = wall(size=200)
    order = np.lexsort((row, column))
    scan = in_memory(xyz[order], row=row[order], column=column[order])
    part = observed_noise(scan, records=20_000)
    assert 8_000 < len(part) <= 20_000
    assert (np.diff(part.patch) >= 0).all()
    assert len(np.unique(part.patch)) == part.patches
    both = joined([part, part])
    assert both.patches == 2 * part.patches
    assert both.variances[part.patches :] == pytest.approx(part.variances)
    assert joined([]).patches == 0


def test_too_few_points_are_no_patches():
    assert patch_residuals(np.zeros((0, 3))).patches == 0
    assert patch_residuals(np.random.default_rng(1).normal(size=(50, 3))).patches == 0
    cloud = np.random.default_rng(1).normal(size=(5000, 3))
    assert patch_residuals(cloud).patches <= 1
