"""Sigmas of baselines against their pieces: closed forms, simulated phases, real sessions."""

from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.linalg import toeplitz
from scipy.stats import chi2

from tribrach.gnss.baseline import (
    Baseline,
    Processing,
    compute_baseline,
    doubts_of_orbits,
    effect_of_orbits,
)
from tribrach.gnss.engine import engines
from tribrach.gnss.phase_noise import DoubleDifferences, phase_noise
from tribrach.gnss.pieces import piece_scatter, piece_spans
from tribrach.gnss.sessions import Occupation, Session, run_sessions
from tribrach.instruments.gnss_solutions import sigma_factor
from tribrach.io.gnss.orbit_files import Orbits
from tribrach.report.baseline import baseline_headline

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
    assert baseline_headline(known).endswith("sigma 0.2 mm")
    doubtful = baseline_headline(replace(known, orbit_effect=effect))
    assert doubtful.endswith(
        f"sigma 0.2 mm without the orbits ({1e3 * effect:.1f} mm by the accuracy that they state)"
    )
    wide = replace(known, covariance=np.eye(3) * 1e-4, orbit_effect=effect)
    assert "orbits" not in baseline_headline(wide)


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


@dataclass(frozen=True)
class Process:
    """Correlated noise: its correlation over k seconds, and phases of eight satellites."""

    duration: float
    white: float

    def correlation(self, n: int, interval: float) -> np.ndarray:
        r = (1 - self.white) * np.exp(-np.arange(n) * interval / self.duration)
        r[0] = 1
        return r


@pytest.mark.parametrize("process", [Process(150, 0), Process(90, 0.3), Process(1, 0)])
def test_noise_of_simulated_phases(process: Process) -> None:
    """Scale and inflation come back: the variance of a mean over the whole and over a quarter."""
    rng = np.random.default_rng(24)
    n, interval, pairs, scale = 480, 30.0, 8, 0.6
    root = np.linalg.cholesky(toeplitz(process.correlation(n, interval)))
    found = []
    for _ in range(12):
        u = scale * (root @ rng.normal(size=(n, pairs)))
        sigma = 0.006 + 0.01 * rng.random((n, pairs))
        noise = phase_noise(
            DoubleDifferences(
                np.repeat(1e9 + interval * np.arange(n), pairs),
                np.tile(np.arange(pairs), n),
                (u * sigma).ravel(),
                sigma.ravel(),
            ),
            interval,
        )
        assert noise is not None
        found.append([noise.factor(n), noise.factor(n // 4)])
    true = [
        scale * np.sqrt(toeplitz(process.correlation(m, interval)).sum() / m) for m in (n, n // 4)
    ]
    np.testing.assert_allclose(np.mean(found, axis=0), true, rtol=0.08)


def test_a_few_minutes_of_long_correlation_do_not_show_the_noise() -> None:
    """Two satellites over two minutes: nearly one observation each."""
    t = np.arange(0, 120.0, 1.0)
    both = np.tile(t, 2)
    pairs = np.repeat([0, 1], len(t))
    slow = np.where(pairs == 0, 0.004, -0.006)
    assert phase_noise(DoubleDifferences(both, pairs, slow, np.full(240, 0.01)), 1.0) is None


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
        assert np.abs(error).max() < 0.0005
        assert error @ np.linalg.solve(found.covariance, error) < chi2.ppf(0.95, 3)


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
    # air is taken to stay alike for minutes at least
    assert found.factor >= found.noise.scale * sigma_factor(30, 115) - 1e-12


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
    session = Session("s", (Occupation("A", base), Occupation("B", rover)), tuple(orbits))
    run_sessions(
        [session],
        {"A": np.array(BASE_3040)},
        Processing(),
        lambda what, done, total: seen.append((what, done, total)),
    )
    told = [(done, total) for what, done, total in seen if what == "pieces of the session"]
    assert told == [(k, 4) for k in range(5)]
    assert ("GNSS baselines", 1, 1) in seen
