import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.instruments.beam import Beam
from tribrach.instruments.neighbours import (
    RangeCorrelation,
    SharedNoise,
    effective_number,
    lattice_factor,
    overlap_share,
)
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.project.instrument import Instrument


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
    assert np.array_equal(lattice_factor(np.array([0.0, 0.4, 1.0])), [1, 1, 1])
    number = effective_number(np.array([100.0, 0.0]), 0.01, np.array(5e-5))
    assert np.array_equal(number, [100, 0])


def test_dense_scans_have_one_point_per_footprint() -> None:
    ratio = np.array([5.9, 6.1, 50.0])
    assert lattice_factor(ratio) == pytest.approx(np.pi / 4 * ratio**2, rel=4e-3)
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
    assert factor == pytest.approx(lattice_factor(np.array([diameter / step]))[0], rel=0.2)


def test_lattices_with_two_pitches() -> None:
    square = np.array([0.7, 2.5, 5.3, 9.0])
    assert lattice_factor(square, square) == pytest.approx(lattice_factor(square), rel=4e-3)
    # one dense axis only: overlaps along a line, whose integral is 8 / (3 pi) of the diameter
    line = lattice_factor(np.array([40.0]), np.array([0.5]))[0]
    assert line == pytest.approx(40 * 8 / (3 * np.pi), rel=0.01)
    # both dense: the area of the disc over that of a cell
    assert lattice_factor(np.array([20.0]), np.array([7.0]))[0] == pytest.approx(
        np.pi / 4 * 140, rel=4e-3
    )


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_covariance_of_a_fit_is_that_of_all_pairs(share: float) -> None:
    rng = np.random.default_rng(5)
    angles = np.stack(np.meshgrid(np.arange(25), np.arange(18)), axis=-1).reshape(-1, 2) * 4e-4
    directions = np.column_stack([np.ones(len(angles)), angles])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    rows = np.column_stack([np.ones(len(angles)), angles * 100, rng.normal(size=len(angles))])
    neighbours = RangeCorrelation(share, 1.5e-3)
    away = np.linalg.norm(directions[:, None] - directions[None], axis=2)
    full = rows.T @ neighbours.correlation(away) @ rows
    found = rows.T @ rows + neighbours.summed(directions, rows)
    assert found == pytest.approx(full, rel=1e-6, abs=1e-6 * np.abs(full).max())
    if share == 1.0:
        # a wide patch: the mean's variance grows by the factor of its lattice, less at the rim
        grown = found[0, 0] / len(angles)
        assert 0.75 < grown / neighbours.factor(4e-4, 4e-4) < 1.0


def test_sums_over_very_many_pairs_are_those_of_some(monkeypatch: pytest.MonkeyPatch) -> None:
    angles = np.stack(np.meshgrid(np.arange(60), np.arange(60)), axis=-1).reshape(-1, 2) * 4e-4
    directions = np.column_stack([np.ones(len(angles)), angles])
    rows = np.column_stack([np.ones(len(angles)), angles * 100])
    neighbours = RangeCorrelation(0.6, 2e-3)
    whole = neighbours.summed(directions, rows)
    monkeypatch.setattr("tribrach.instruments.neighbours._PAIRS", 10_000)
    assert neighbours.summed(directions, rows) == pytest.approx(whole, rel=0.02)


def test_what_neighbours_share_by_instrument() -> None:
    figures = {"range_mm": 1.0, "scan_angle_arcsec": 8.0, "beam_exit_mm": 3.0}
    silent = Instrument.model_validate(figures).noise()
    assert silent is not None
    assert silent.estimated_shared is None
    assert silent.shared == SharedNoise(1.0, 0.0, Beam(0.003))
    told = Instrument.model_validate(
        figures | {"shared_share": 0.4, "shared_angle_mrad": 0.5}
    ).noise()
    assert told is not None
    assert told.estimated_shared == told.shared == SharedNoise(0.4, 5e-4, Beam(0.003))
    assert told.shared.at(20.0) == RangeCorrelation(0.4, 5e-4)
    assert "neighbours share 0.4 of the variance of ranges over 0.5 mrad" in told.words
    assert silent.shared.diameter(np.array([7.0]))[0] == pytest.approx(0.003)
    number = effective_number(np.array([1e5]), 0.01, np.array([1e-4]), 0.01)
    assert number[0] == pytest.approx(1e5 / (1 + 0.01 * 999), rel=5e-3)


def test_shares_that_are_none_are_refused() -> None:
    with pytest.raises(InputError, match=r"share 1\.2 of their variance"):
        ScanNoise(0.001, 0.0, 1e-5, 1e-5, shared_share=1.2)
    with pytest.raises(InputError, match="shared_share"):
        ScanNoise(0.001, 0.0, 1e-5, 1e-5, shared_share=-0.1)
