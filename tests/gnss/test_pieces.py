"""Sigmas of baselines against their pieces: closed forms, simulated phases, real sessions."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.stats import chi2

from tribrach.gnss import pieces as pieces_module
from tribrach.gnss.baseline import (
    Baseline,
    Processing,
    compute_baseline,
    doubts_of_orbits,
    effect_of_orbits,
)
from tribrach.gnss.engine import engines
from tribrach.gnss.fixed_phases import (
    ClockFreePhases,
    PhaseWeights,
    clock_free,
    decimal_variance,
    learned_weights,
    phase_variance,
    sight_lines,
)
from tribrach.gnss.outcome import RunOutcome, outcome_of, outcome_standing, standing_place
from tribrach.gnss.phase_noise import SLOW, PhaseNoise, phase_noise, usual_noise
from tribrach.gnss.pieces import piece_scatter, piece_spans
from tribrach.gnss.sessions import Occupation, ReceiverSession, run_sessions
from tribrach.instruments.gnss_solutions import sigma_factor
from tribrach.io.gnss.orbit_files import Orbits
from tribrach.io.gnss.solution_file import PhaseResiduals, SatelliteUse, Solution

from .test_baseline import (
    BASE_3040,
    SPIRENT_BASE,
    SPIRENT_ROVER,
    geonet,
    spirent,
)

PANA = (4201030.6890, 175603.7900, 4780030.2470)
needs_engine = pytest.mark.skipif(not engines(), reason="RTKLIB is not installed")


def test_scatter_of_pieces_is_that_of_their_weighted_mean() -> None:
    """Against the adjustment of all coordinates with its whole covariance matrix."""
    rng = np.random.default_rng(21)
    roots = rng.normal(size=(6, 3, 3))
    blocks = roots @ roots.transpose(0, 2, 1) + 0.1 * np.eye(3)
    values = rng.normal(size=(6, 3)) + np.array(PANA)
    found = piece_scatter(list(values), list(blocks))
    assert found is not None
    design = np.tile(np.eye(3), (6, 1))
    weight = np.zeros((18, 18))
    for k in range(6):
        weight[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = np.linalg.inv(blocks[k])
    y = (values - values[0]).ravel()
    x = np.linalg.solve(design.T @ weight @ design, design.T @ weight @ y)
    v = y - design @ x
    assert found.statistic == pytest.approx(v @ weight @ v, rel=1e-8)
    assert found.dof == 15
    assert found.limit == pytest.approx(24.996, abs=1e-3)  # table of chi-square


def test_pieces_that_agree_narrow_nothing_and_others_widen() -> None:
    rng = np.random.default_rng(22)
    blocks = [1e-6 * np.eye(3)] * 8
    small = piece_scatter(list(1e-5 * rng.normal(size=(8, 3))), blocks)
    assert small is not None
    assert small.ratio < 0.05
    assert small.factor == 1
    assert "sigmas hold" not in small.sentence()
    factor = float(small.sentence().split("by a factor of ")[1].split(";")[0])
    assert factor == pytest.approx(1 / small.ratio, rel=0.01)
    assert "float" not in small.sentence()
    right = piece_scatter(list(1e-3 * rng.normal(size=(8, 3))), blocks, floating=8)
    assert right is not None
    assert "sigmas hold" in right.sentence()
    assert "8 of these pieces have float ambiguities and state 1.7 mm" in right.sentence()
    large = piece_scatter(list(3e-3 * rng.normal(size=(8, 3))), blocks, cut=9)
    assert large is not None
    assert large.factor == large.ratio == pytest.approx(3, rel=0.35)
    assert "8 of 9 pieces" in large.sentence()
    assert f"widened by {large.factor:.2f}" in large.sentence()
    assert piece_scatter([np.zeros(3)] * 2, blocks[:2]) is None


def test_a_headline_names_orbits_that_do_more_than_the_sigma() -> None:
    base = np.array(SPIRENT_BASE)
    known = Baseline(
        base=base, rover=base + np.array([2004.0, 0, 0]), covariance=np.eye(3) * 1e-8,
        formal=np.eye(3), factor=1.0, factor_source="given", ambiguities="fixed",
        fixed_share=1.0, epochs=600,
        epochs_common=600, ratio=99.0, satellites=9.0, start=1.3e9, end=1.3e9 + 600, interval=1.0,
        systems="GE", engine="test",
    )  # fmt: skip
    # 25 m at 20 000 km, over the length of the baseline
    orbits = cast("Orbits", SimpleNamespace(coarse=("E01", "E02"), precise=None, accuracy=25.0))
    effect = effect_of_orbits(orbits, ["E02", "G01"], known.length)
    assert effect == pytest.approx(2.5e-3, rel=0.15)
    (said,) = doubts_of_orbits(orbits, ["E02", "G01"], known.length)
    assert f"by {1e3 * effect:.1f} mm" in said
    assert effect_of_orbits(orbits, ["G01"], known.length) == 0.0
    assert known.headline.endswith("sigma 0.2 mm")
    doubtful = replace(known, orbit_effect=effect).headline
    assert doubtful.endswith(
        f"sigma 0.2 mm without the orbits ({1e3 * effect:.1f} mm by the accuracy that they state)"
    )
    wide = replace(known, covariance=np.eye(3) * 1e-4, orbit_effect=effect)
    assert "orbits" not in wide.headline


def test_pieces_with_right_sigmas_are_accused_in_five_of_a_hundred() -> None:
    rng = np.random.default_rng(23)
    root = np.array([[1.0, 0, 0], [0.4, 0.7, 0], [-0.2, 0.1, 2.0]]) * 1e-3
    blocks = [root @ root.T] * 6
    trials = [piece_scatter(list(rng.normal(size=(6, 3)) @ root.T), blocks) for _ in range(1000)]
    accused = sum(not t.agree for t in trials if t is not None)
    assert 30 <= accused <= 72  # 50 with a standard deviation of 7
    generous = sum(t.generous for t in trials if t is not None)
    assert 10 <= generous <= 40  # 25 with a standard deviation of 5


@pytest.mark.parametrize(
    ("minutes", "interval", "count"),
    [(60, 30, 4), (90, 30, 6), (240, 30, 10), (10, 1, 4), (7, 1, 0), (15, 30, 0)],
)
def test_spans_of_pieces(minutes: float, interval: float, count: int) -> None:
    times = 1e9 + np.arange(0, 60 * minutes, interval)
    spans = piece_spans(times)
    assert len(spans) == count
    inside = [((times > a) & (times < b)).sum() for a, b in spans]
    assert sum(inside) == (len(times) if count else 0)
    if count:
        assert max(inside) - min(inside) <= 1


def simulated(
    rng: np.random.Generator,
    n: int,
    interval: float,
    satellites: int,
    noise: PhaseNoise,
) -> ClockFreePhases:
    """Phases of one frequency with a law, their clocks and coordinates taken out again."""
    lag = interval * np.arange(n)
    r = noise.shares[0, 1:] @ np.exp(-lag / noise.times[0][:, None])
    r[0] = 1
    root = np.sqrt(noise.variance[0]) * np.linalg.cholesky(toeplitz(r))
    u = root @ rng.normal(size=(n, satellites))
    # satellites that stand all around, 20 to 80 degrees high
    azimuth = 2.4 * np.arange(satellites)
    high = np.radians(20 + 60 * ((0.62 * np.arange(satellites)) % 1))
    toward = np.stack(
        [np.cos(high) * np.sin(azimuth), np.cos(high) * np.cos(azimuth), np.sin(high)], axis=1
    )
    weight = 1 / np.sqrt(phase_variance(high))
    free = np.eye(satellites) - np.outer(weight, weight) / (weight @ weight)
    order = np.arange(satellites)
    return ClockFreePhases(
        np.repeat(1e9 + lag, satellites),
        np.tile(order, n),
        (u @ free).ravel(),
        np.tile(free @ (-toward * weight[:, None]), (n, 1)),
        np.full(n * satellites, 1 - 1 / satellites),
        np.zeros(n * satellites),
        np.zeros(n * satellites),
        0.0,
    )


def law(variance: float, new: float, fast: float, time: float) -> PhaseNoise:
    shares = np.array([[new, fast, 1 - new - fast]])
    return PhaseNoise(np.ones(1), np.array([variance]), shares, np.array([[time, SLOW]]), 30.0, 480)


def test_means_of_spans_are_those_of_the_whole_correlation_matrix() -> None:
    noise = law(0.4, 0.2, 0.5, 90.0)
    lag = 30.0 * np.abs(np.subtract.outer(np.arange(60), np.arange(60)))
    whole = 0.5 * np.exp(-lag / 90) + 0.3 * np.exp(-lag / SLOW) + 0.2 * np.eye(60)
    starts, counts = [2, 20, 45], [18, 20, 15]
    means = np.zeros((3, 60))
    for row, start, n in zip(means, starts, counts, strict=True):
        row[start : start + n] = 1 / n
    np.testing.assert_allclose(
        noise.means(starts, counts), 0.4 * means @ whole @ means.T, rtol=1e-10
    )
    assert noise.factor(60) == pytest.approx(np.sqrt(0.4 * whole.sum() / 60), rel=1e-10)


LAWS = [law(0.36, 0.02, 0.96, 150.0), law(0.2, 0.3, 0.5, 90.0), law(0.5, 0.05, 0.45, 100.0)]


@pytest.mark.parametrize("truth", LAWS)
def test_noise_of_simulated_phases(truth: PhaseNoise) -> None:
    """Four hours tell what their law does to the whole and to a quarter.

    A slow part that four hours do not exclude counts with what it would do, hence more upwards.
    """
    rng = np.random.default_rng(24)
    found = []
    for _ in range(3):
        noise = phase_noise(simulated(rng, 480, 30.0, 8, truth), 30.0, 480)
        assert noise is not None
        found.append([noise.factor(480), noise.factor(120)])
    true = [truth.factor(480), truth.factor(120)]
    ratio = np.mean(found, axis=0) / true
    assert (ratio > 0.85).all()
    assert (ratio < 1.25).all()


@pytest.mark.slow
@pytest.mark.parametrize("truth", LAWS)
@pytest.mark.parametrize(("epochs", "low", "high"), [(480, 0.55, 1.5), (20, 0.15, 1.1)])
def test_coordinates_of_simulated_sessions_have_the_sigma_that_phases_tell(
    truth: PhaseNoise, epochs: int, low: float, high: float
) -> None:
    """Squared errors over stated variances, mean of many sessions of four hours or ten minutes.

    Ten minutes hardly tell a law: what the engine assumes, which is more than these phases have,
    and slow parts that are not excluded make their sigma up to twice as large as their errors.
    """
    rng = np.random.default_rng(25)
    trials = 20 if epochs > 100 else 150
    total = 0.0
    for _ in range(trials):
        phases = simulated(rng, epochs, 30.0, 8, truth)
        found = phases.coordinates()
        assert found is not None
        noise = phase_noise(phases.moved(found[0]), 30.0, epochs)
        assert noise is not None
        stated = found[1] * noise.factor(epochs) ** 2
        total += found[0] @ np.linalg.solve(stated, found[0])
    assert low < total / (3 * trials) < high


def test_coordinates_of_phases_are_those_of_least_squares() -> None:
    """A shift put into phases comes back, and what is left does not depend on it."""
    rng = np.random.default_rng(26)
    phases = simulated(rng, 40, 30.0, 7, law(0.3, 0.3, 0.5, 100.0))
    first = phases.coordinates()
    assert first is not None
    given = np.array([0.004, -0.002, 0.007])
    second = phases.moved(-given).coordinates()
    assert second is not None
    np.testing.assert_allclose(second[0] - first[0], given, atol=1e-12)
    left = phases.moved(first[0])
    np.testing.assert_allclose(left.design.T @ left.values, 0, atol=1e-9)
    one, two = (phase_noise(p, 30.0, 40) for p in (phases, phases.moved(given)))
    assert one is not None
    assert two is not None
    assert one.factor(40) == pytest.approx(two.factor(40), rel=1e-6)


def engine_run(
    rng: np.random.Generator, epochs: int, own: float, place: np.ndarray, printed: np.ndarray
) -> tuple[Solution, SatelliteUse]:
    """What the engine would write of phases with noise of receivers and of their last decimals.

    Parameters
    ----------
    rng
        Of the noise.
    epochs
        One a second, nine satellites, two frequencies.
    own
        Standard deviation against what the engine assumes.
    place : (3,)
        True place of the rover [m].
    printed : (epochs, 3)
        Places of the epochs that the solution has, to which residuals belong [m].
    """
    n = 9
    time = np.repeat(1.3e9 + np.arange(epochs), 2 * n)
    satellite = np.tile(np.repeat(np.arange(n), 2), epochs)
    frequency = np.tile([1, 2], n * epochs).astype(np.int64)
    azimuth, high = 2.4 * satellite, np.radians(15 + 70 * ((0.62 * satellite) % 1))
    blank = PhaseResiduals(
        time, np.char.mod("G%02d", satellite), frequency, azimuth, high, np.zeros(len(time))
    )
    sigma = np.sqrt(own**2 * phase_variance(high) + decimal_variance(frequency))
    toward = sight_lines(blank, place)
    row = np.repeat(np.arange(epochs), 2 * n)
    single = sigma * rng.normal(size=len(time))
    single -= np.einsum("ni,ni->n", toward, place - printed[row])
    # differences to the highest satellite of the epoch and frequency
    best = int(np.argmax(high[: 2 * n : 2]))
    reference = single.reshape(epochs, n, 2)[:, best : best + 1, :]
    double = (reference - single.reshape(epochs, n, 2)).reshape(-1)
    covariance = np.tile(np.eye(3) * 1e-6, (epochs, 1, 1))
    solution = Solution(
        "ecef", printed, covariance, 1.3e9 + np.arange(epochs, dtype=float),
        np.ones(epochs, dtype=np.int64), np.full(epochs, n), np.full(epochs, 99.0),
        np.full(3, np.nan), np.arange(epochs), True,
    )  # fmt: skip
    names = tuple(np.unique(blank.satellites).tolist())
    return solution, SatelliteUse(names, 1e-4, replace(blank, residuals=double))


@pytest.mark.parametrize(
    ("own", "low", "high"), [(0.0, 0.0, 0.05), (0.015, 0.45, 0.75), (0.5, 0.998, 1.0)]
)
def test_decimals_of_phases_are_told_from_noise_that_grows_to_the_horizon(
    own: float, low: float, high: float
) -> None:
    """Share of the engine's part in the mean variance: nothing, about 0.6, nearly all."""
    place = np.array(SPIRENT_ROVER)
    run = engine_run(np.random.default_rng(31), 300, own, place, np.tile(place, (300, 1)))
    assert run[1].phases is not None
    free = clock_free(run[1].phases, run[0], np.arange(300), place)
    assert free is not None
    found = free.coordinates()
    assert found is not None
    weights = learned_weights(free.moved(found[0]))
    assert low <= weights.engine <= high
    # the mean over the phases is what the engine assumes
    ratio = weights.variance(run[1].phases.elevation, run[1].phases.frequencies)
    ratio = ratio / phase_variance(run[1].phases.elevation)
    assert ratio.mean() == pytest.approx(1, rel=1e-9)


def test_a_few_phases_keep_the_weights_of_the_engine() -> None:
    assert learned_weights(simulated(np.random.default_rng(33), 1, 1.0, 6, LAWS[0])) == (
        PhaseWeights(1.0, 0.0)
    )


def outcomes(
    rng: np.random.Generator, place: np.ndarray, decimal: float
) -> tuple[RunOutcome, RunOutcome]:
    """First run, written with a decimal, and the one that stands, of phases of pure rounding."""
    base = np.array(SPIRENT_BASE)
    state = rng.bit_generator.state
    solution, used = engine_run(rng, 80, 0.0, place, np.tile(place, (80, 1)))
    written = np.round(place / decimal) * decimal
    first = outcome_of(replace(solution, values=np.tile(written, (80, 1))), used, base, air=True)
    assert first is not None
    rng.bit_generator.state = state
    stand = standing_place(first)
    again, residuals = engine_run(rng, 80, 0.0, place, np.tile(stand, (80, 1)))
    again = replace(again, values=np.tile(np.round(stand, 4), (80, 1)))
    return first, outcome_standing(first, again, residuals, base, air=True)


def test_residuals_against_a_place_that_stands_lose_the_last_decimal() -> None:
    """Of 100 runs whose phases are exact to a thousandth of a cycle, in three axes.

    The place of the first run is off by its decimal, and the second has the covariance of
    independent phases with equal weights: chi-square of all is that of 300 degrees of freedom.
    """
    rng = np.random.default_rng(32)
    total, before = 0.0, 0.0
    for _ in range(100):
        place = np.array(SPIRENT_ROVER) + rng.uniform(-1e-3, 1e-3, 3)
        first, stands = outcomes(rng, place, 1e-4)
        assert (first.rounding > 0).all()
        assert first.noticed(0.012)
        assert not first.noticed(5.0)
        assert (stands.rounding == 0).all()
        assert stands.phases is not None
        scale = float(stands.phases.values @ stands.phases.values) / stands.phases.freedom.sum()
        error = stands.place - place
        total += error @ np.linalg.solve(scale * stands.formal, error)
        away = first.place - place
        before += away @ np.linalg.solve(scale * stands.formal, away)
    assert chi2.ppf(0.01, 300) < total < chi2.ppf(0.99, 300)
    assert before > 2 * chi2.ppf(0.99, 300)


def test_a_run_that_stands_and_does_not_fix_changes_nothing() -> None:
    place = np.array(SPIRENT_ROVER)
    base = np.array(SPIRENT_BASE)
    solution, used = engine_run(np.random.default_rng(34), 80, 0.0, place, np.tile(place, (80, 1)))
    first = outcome_of(solution, used, base, air=True)
    assert first is not None
    few = replace(solution, quality=np.where(np.arange(80) < 39, 1, 2))
    assert outcome_standing(first, few, used, base, air=True) is first
    assert outcome_standing(first, solution, None, base, air=True) is first
    many = replace(solution, quality=np.where(np.arange(80) < 41, 1, 2))
    assert outcome_standing(first, many, used, base, air=True) is not first
    # residuals of other integers belong to a place far away
    far = engine_run(np.random.default_rng(34), 80, 0.0, place, np.tile(place + 1.0, (80, 1)))
    assert outcome_standing(first, *far, base, air=True) is first


def test_a_few_phases_do_not_show_the_noise() -> None:
    phases = simulated(np.random.default_rng(27), 4, 1.0, 4, LAWS[0])
    assert phase_noise(phases, 1.0, 4) is None
    assert usual_noise(phases, 1.0, 4) is not None


def test_float_ambiguities_leave_the_usual_correlation() -> None:
    phases = simulated(np.random.default_rng(28), 120, 30.0, 8, law(4.0, 0.9, 0.05, 60.0))
    noise = usual_noise(phases, 30.0, 120)
    assert noise is not None
    assert noise.factor(120) / noise.scale == pytest.approx(sigma_factor(30.0, 120), rel=1e-9)
    # toward what the engine assumes, by five independent ones
    assert 1.6 < noise.scale < 2.0
    assert "float ambiguities" in noise.sentence()


def test_pieces_that_share_their_noise_are_compared_by_their_joint_covariance() -> None:
    """Against the whole matrix, and in the mean over pieces that were drawn from it."""
    rng = np.random.default_rng(29)
    k = 6
    between = LAWS[2].alike([20 * i for i in range(k)], [20] * k)
    assert 0.3 < between[0, 1] < 0.9
    root = np.linalg.cholesky(between)
    blocks = [np.diag([1.0, 4.0, 9.0]) * 1e-6] * k
    sigma = np.array([1e-3, 2e-3, 3e-3])
    joint, apart = [], []
    for _ in range(400):
        values = list((root @ rng.normal(size=(k, 3))) * sigma)
        one, two = piece_scatter(values, blocks, correlation=between), piece_scatter(values, blocks)
        assert one is not None
        assert two is not None
        joint.append(one.statistic / one.dof)
        apart.append(two.statistic / two.dof)
    assert np.mean(joint) == pytest.approx(1, abs=0.05)
    assert np.mean(apart) < 0.7
    assert one.ratio_sigma == pytest.approx(1 / np.sqrt(30))
    assert f"{one.ratio:.2f} +- 0.18 times" in one.figures()


def pana(folder: Path, day: str, number: str) -> tuple[Path, Path, list[Path]]:
    there = folder / "gnss" / "rgp_pana_ignf" / day
    base, rover = (there / f"{name}{number}z.23o.gz" for name in ("pana", "ignf"))
    return base, rover, [there / f"pana{number}z.23n.gz"]


@needs_engine
@pytest.mark.data
@pytest.mark.parametrize("case", ["geonet", "day 10", "day 13", "spirent"])
def test_pieces_of_measured_sessions_scatter_as_stated(shared_data: Path, case: str) -> None:
    """Between 0.5 and 1.2 times what the law of the whole session states for them."""
    files, base, settings = {
        "geonet": (geonet(shared_data), BASE_3040, Processing()),
        "day 10": (pana(shared_data, "230910", "253"), PANA, Processing(frequencies=1)),
        "day 13": (pana(shared_data, "230913", "256"), PANA, Processing(frequencies=1)),
        "spirent": (spirent(shared_data), SPIRENT_BASE, Processing(atmosphere=False)),
    }[case]
    found = compute_baseline(*files, base, settings)
    assert found.ambiguities == "fixed"
    assert found.pieces is not None
    assert found.pieces.pieces == found.pieces.cut == (10 if "day" in case else 4)
    assert 0.5 < found.pieces.ratio < 1.2
    assert found.pieces.agree
    assert not any("pieces" in text for text in found.warnings)
    if case == "spirent":
        error = found.rover - SPIRENT_ROVER
        # least squares of the phases: the engine's last line is 0.26 mm off
        assert np.abs(error).max() < 0.00002
        # its pieces, whose last decimal would move them by up to 0.025 mm
        assert found.pieces.sigma.max() < 0.00001
        assert error @ np.linalg.solve(found.covariance, error) < chi2.ppf(0.95, 3)


@needs_engine
@pytest.mark.data
@pytest.mark.slow
@pytest.mark.parametrize(
    "case", ["geonet", "geonet L1", "day 10", "day 13", "spirent", "spirent L1"]
)
def test_any_number_of_pieces_scatters_as_stated(
    shared_data: Path, case: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Four to ten: each between 0.5 and 1.2."""
    files, base, settings = {
        "geonet": (geonet(shared_data), BASE_3040, Processing(alternatives=False)),
        "geonet L1": (geonet(shared_data), BASE_3040, Processing(frequencies=1)),
        "day 10": (pana(shared_data, "230910", "253"), PANA, Processing(frequencies=1)),
        "day 13": (pana(shared_data, "230913", "256"), PANA, Processing(frequencies=1)),
        "spirent": (spirent(shared_data), SPIRENT_BASE, Processing(atmosphere=False)),
        "spirent L1": (
            spirent(shared_data),
            SPIRENT_BASE,
            Processing(atmosphere=False, frequencies=1),
        ),
    }[case]
    # pieces of a minute as well: what is asked for is the number
    monkeypatch.setattr(pieces_module, "SHORTEST", 30.0)
    for count in range(4, 11):
        monkeypatch.setattr(pieces_module, "FEWEST", count)
        monkeypatch.setattr(pieces_module, "MOST", count)
        found = compute_baseline(*files, base, settings)
        assert found.pieces is not None
        assert found.pieces.cut == count
        assert 0.5 < found.pieces.ratio < 1.2


@needs_engine
@pytest.mark.data
def test_a_given_factor_stays_and_is_called_too_small(shared_data: Path) -> None:
    files = pana(shared_data, "230913", "256")
    found = compute_baseline(*files, PANA, Processing(frequencies=1, factor=0.2))
    np.testing.assert_allclose(found.covariance, 0.04 * found.formal)
    assert found.pieces is not None
    assert not found.pieces.agree
    assert any("the factor 0.2 that is given is too small by" in w for w in found.warnings)


@needs_engine
@pytest.mark.data
def test_pieces_can_be_left_out(shared_data: Path) -> None:
    found = compute_baseline(*geonet(shared_data), BASE_3040, Processing(pieces=False))
    assert found.pieces is None
    assert found.noise is not None
    assert found.noise.learned
    assert found.factor == pytest.approx(found.noise.factor(115))


@needs_engine
@pytest.mark.data
def test_air_that_the_engine_computes_with_is_taken_out(shared_data: Path) -> None:
    """GPS alone: 1.5 mm over two kilometres would stay, and Galileo alone has 2.6 mm."""
    for systems, worst in (("G", 0.00015), ("E", 0.00015)):
        settings = Processing(atmosphere=False, systems=systems, frequencies=1, pieces=False)
        found = compute_baseline(*spirent(shared_data), SPIRENT_BASE, settings)
        assert found.systems == systems
        assert found.ambiguities == "fixed"
        assert np.abs(found.rover - SPIRENT_ROVER).max() < worst


@needs_engine
@pytest.mark.data
def test_pieces_show_how_far_they_are(shared_data: Path) -> None:
    """A run of a session tells of each piece: hours of fast epochs take their time."""
    base, rover, orbits = geonet(shared_data)
    seen: list[tuple[str, int, int | None]] = []
    session = ReceiverSession("s", (Occupation("A", base), Occupation("B", rover)), tuple(orbits))
    run_sessions(
        [session],
        {"A": np.array(BASE_3040)},
        Processing(),
        lambda what, done, total: seen.append((what, done, total)),
    )
    told = [(done, total) for what, done, total in seen if what == "pieces of the session"]
    assert told == [(k, 4) for k in range(5)]
    assert ("GNSS baselines", 1, 1) in seen
