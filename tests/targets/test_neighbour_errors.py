"""Stated sigmas of planes, boards, spheres and means whose points share errors with neighbours."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from tests.scan.correlated_grids import shared_errors
from tribrach._types import Array
from tribrach.instruments.neighbours import RangeCorrelation, SharedNoise, effective_number
from tribrach.targets.discs.fit import distance
from tribrach.targets.planes import _correlation
from tribrach.targets.prints.plane import fit_board_plane
from tribrach.targets.spheres.fit import fit_sphere

#: step of the grid [rad], discs of four steps, range [m], noise of a range [m]
STEP, PIXELS, AWAY, SIGMA = 4e-4, 4.0, 8.0, 0.002
#: correlation of nearest neighbours, and the share of the variance that makes it
OVERLAP = float(RangeCorrelation(1.0, PIXELS).correlation(np.array(1.0)))
CASES = [0.0, 0.3, 0.6]


def known(correlation: float) -> SharedNoise:
    return SharedNoise(correlation / OVERLAP, PIXELS * STEP)


def grid(rows: int, columns: int) -> Array:
    """Unit vectors (rows * columns, 3) around X."""
    v = np.pi / 2 + STEP * (np.arange(rows) - rows / 2)
    h = STEP * (np.arange(columns) - columns / 2)
    v, h = (a.ravel() for a in np.meshgrid(v, h, indexing="ij"))
    return np.column_stack([np.sin(v) * np.cos(h), np.sin(v) * np.sin(h), np.cos(v)])


def errors(rng: np.random.Generator, shape: tuple[int, int], correlation: float) -> Array:
    """Errors of ranges (rows * columns,) [m]."""
    share = correlation / OVERLAP
    own = np.sqrt(1 - share) * rng.standard_normal(shape)
    if share > 0:
        own += np.sqrt(share) * shared_errors(rng, shape, PIXELS)
    return SIGMA * own.ravel()


def board(rng: np.random.Generator, correlation: float, shared: SharedNoise | None) -> float:
    """Squared error of a board's plane over its covariance, three degrees of freedom."""
    shape = 28, 32
    beams = grid(*shape)
    normal = np.array([-0.8, 0.5, 0.3]) / np.linalg.norm([0.8, 0.5, 0.3])
    near = np.array([AWAY, 0.0, 0.0])
    true = normal @ near / (beams @ normal)
    xyz = beams * (true + errors(rng, shape, correlation))[:, None]
    bright = (np.arange(len(beams)) // shape[1] % 8 < 4) ^ (np.arange(len(beams)) % 8 < 4)
    plane = fit_board_plane(xyz, bright, near, 0.0, shared)
    assert plane is not None
    shift = (near - plane.origin) @ normal
    error = np.array([shift, *(plane.axes @ (plane.normal - normal))])
    # slopes are of the plane over the axes, a normal turns against them
    error[1:] *= -1
    error[0] = -shift / (plane.normal @ normal)
    return float(error @ np.linalg.solve(plane.cofactor, error))


def sphere(rng: np.random.Generator, correlation: float, shared: SharedNoise | None) -> float:
    """Squared error of a sphere's centre over its covariance, three degrees of freedom."""
    shape, radius = (44, 44), 0.06
    beams, center = grid(*shape), np.array([AWAY, 0.001, -0.002])
    b = beams @ center
    inside = radius**2 - center @ center + b**2
    met = inside > (0.3 * radius) ** 2
    true = b - np.sqrt(np.maximum(inside, 0))
    xyz = (beams * (true + errors(rng, shape, correlation))[:, None])[met]
    fit = fit_sphere(
        xyz, center + 0.002, radius, sigma_range=SIGMA, sigma_angle=1e-6, shared=shared
    )
    error = fit.center - center
    return float(error @ np.linalg.solve(fit.random, error))


def disc(rng: np.random.Generator, correlation: float, shared: SharedNoise | None) -> float:
    """Squared error of a disc's distance over its variance."""
    shape = 24, 24
    beams = grid(*shape)
    error = errors(rng, shape, correlation)
    place = AWAY * beams[:, 1:]
    bright = np.hypot(*place.T) < 0.02
    at = None if shared is None else shared.at(AWAY)
    found, sigma = distance(
        place, error, bright, np.ones(len(bright), dtype=bool), 0.03, SIGMA, at, AWAY * beams
    )
    return (found / sigma) ** 2


def mean(rng: np.random.Generator, correlation: float, shared: SharedNoise | None) -> float:
    """Squared mean of the points of a cylinder over its variance."""
    shape = 34, 34
    at = AWAY * STEP * (np.stack(np.meshgrid(*map(np.arange, shape)), axis=-1) - 16.5)
    in_it = (np.hypot(at[..., 0], at[..., 1]) < 15 * AWAY * STEP).ravel()
    error = errors(rng, shape, correlation)[in_it]
    number = float(len(error))
    if shared is not None:
        area = np.pi * (15 * AWAY * STEP) ** 2
        footprint = np.pi / 4 * shared.diameter(np.array([AWAY])) ** 2
        number = effective_number(np.array([number]), area, footprint, shared.share)[0]
    return float(error.mean() ** 2 / (SIGMA**2 / number))


FREEDOM = {board: 3, sphere: 3, disc: 1, mean: 1}


@pytest.mark.parametrize("correlation", CASES)
@pytest.mark.parametrize("of", list(FREEDOM), ids=lambda of: of.__name__)
def test_sigmas_hold_where_neighbours_are_known(of, correlation: float) -> None:
    _holds(of, correlation, 25)


@pytest.mark.slow
@pytest.mark.parametrize("correlation", CASES)
@pytest.mark.parametrize("of", list(FREEDOM), ids=lambda of: of.__name__)
def test_sigmas_hold_where_neighbours_are_known_in_many_trials(of, correlation: float) -> None:
    _holds(of, correlation, 1000)


def _holds(of, correlation: float, trials: int) -> None:
    """Squares are as many as chi-square allows in 999 of 1000 cases, and within a tenth."""
    shared = known(correlation)
    total = sum(of(np.random.default_rng(k), correlation, shared) for k in range(trials))
    freedom = FREEDOM[of] * trials
    low, high = chi2.ppf([0.0005, 0.9995], freedom)
    assert 0.9 * low < total < 1.1 * high


def test_counting_all_points_is_too_sure() -> None:
    for of, freedom in FREEDOM.items():
        total = sum(of(np.random.default_rng(k), 0.6, None) for k in range(15))
        # discs look at their own residuals, the others state a third of the true sigma
        assert total / (15 * freedom) > (1.2 if of is disc else 5.0)


@pytest.mark.parametrize("correlation", CASES)
def test_planes_tell_from_their_residuals_how_alike_neighbours_are(correlation: float) -> None:
    shape = 110, 110
    flat = np.stack(np.meshgrid(np.arange(110.0), np.arange(110.0)), axis=-1).reshape(-1, 2)
    seen = [
        _correlation(flat, errors(np.random.default_rng(k), shape, correlation)) for k in range(12)
    ]
    share = known(correlation).share
    assert np.mean(seen) == pytest.approx(RangeCorrelation(share, PIXELS).factor(1, 1), rel=0.2)
