"""What stays alike within a session: learned from repetitions, else that of a data sheet."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from tribrach.gnss.baseline import Baseline, Processing, compute_baseline
from tribrach.gnss.engine import engines
from tribrach.gnss.session_part import SessionPart
from tribrach.gnss.sessions import SessionResult, with_repeats

from .test_baseline import SPIRENT_BASE, spirent
from .test_pieces import PANA, pana

BASES = {
    "Paris": PANA,
    "Quito": (1272867.3, -6252772.0, -23801.8),
    "Oslo": (3174710.0, 602550.0, 5486090.0),
}
VECTORS = {("A", "B"): (663.5, 2285.0, -658.5), ("A", "C"): (-4000.0, 1500.0, 900.0)}
OWN = np.diag([0.0012, 0.0008, 0.0015]) ** 2
#: of a day along an axis, in the mean: days have one to three times that variance
NOISE = float(np.sqrt(2 * np.trace(OWN) / 3))


def sessions(
    place: tuple[float, float, float], days: int, sigmas: tuple[float, float], seed: int
) -> list[SessionResult]:
    """Days on which B, and C in the other direction, stand against A."""
    rng = np.random.default_rng(seed)
    base = np.array(place)
    out = []
    for day in range(days):
        found = []
        for (a, b), vector in VECTORS.items():
            own = OWN * (1 + day % 3)
            length = float(np.linalg.norm(vector))
            true = own + SessionPart(*sigmas, "").covariance(base)
            rover = base + vector + rng.multivariate_normal(np.zeros(3), true)
            turned = b == "C" and day % 2 == 1
            one = Baseline(
                base=rover if turned else base, rover=base if turned else rover, covariance=own,
                formal=own, factor=1.0, factor_source="", ambiguities="fixed", fixed_share=1.0,
                epochs=480, epochs_common=480, ratio=50.0, satellites=8.0, start=0.0, end=1.0,
                interval=30.0, systems="G", engine="", names=(b, a) if turned else (a, b),
            )  # fmt: skip
            found.append(one.with_session(SessionPart.usual(length)))
        blocks = np.array([b.covariance for b in found])
        out.append(SessionResult(str(day), tuple(found), np.kron(np.eye(2), blocks[0])))
    return out


def repetitions(results: list[Baseline]) -> tuple[float, int]:
    """Chi-square of one baseline of several sessions, and its degrees of freedom."""
    sign = [1 if b.names == results[0].names else -1 for b in results]
    x = np.array([s * b.vector for s, b in zip(sign, results, strict=True)])
    weight = np.linalg.inv([b.covariance for b in results])
    rest = x - np.linalg.solve(weight.sum(axis=0), np.einsum("nij,nj->i", weight, x))
    return float(np.einsum("ni,nij,nj->", rest, weight, rest)), 3 * (len(x) - 1)


@pytest.mark.parametrize("place", BASES)
@pytest.mark.parametrize("sigmas", [(0.001, 0.003), (0.0022, 0.005), (0.003, 0.012)])
def test_repeated_days_have_the_chi_square_of_their_sigmas(
    place: str, sigmas: tuple[float, float]
) -> None:
    total, freedom, plan, up = 0.0, 0, [], []
    for seed in range(20):
        results = with_repeats(sessions(BASES[place], 7, sigmas, seed))
        for k in range(2):
            q, dof = repetitions([r.baselines[k] for r in results])
            total, freedom = total + q, freedom + dof
        part = results[0].baselines[0].session_part
        assert part is not None
        plan.append(part.plan)
        up.append(part.up)
    # learned of the same days, whose chi-square is nearly its expectation
    assert 0.7 < total / freedom < 1.15
    for found, true in ((plan, sigmas[0]), (up, sigmas[1])):
        # what is less than the noise of a day is not recovered: there the data sheet has its say
        if true > NOISE:
            assert 0.75 * true < np.sqrt(np.mean(np.square(found))) < 1.25 * true


def test_sessions_without_repetitions_keep_the_data_sheet_and_given_sigmas_stay() -> None:
    once = sessions(PANA, 1, (0.001, 0.01), 0)
    assert with_repeats(once) == tuple(once)
    assert SessionPart.usual(10_000.0).up == pytest.approx(0.0075)
    assert SessionPart.usual(10_000.0).plan == pytest.approx(0.004 / np.sqrt(2))
    assert Processing(atmosphere=False).part(2000.0) is None
    assert Processing(factor=3.0).part(2000.0) is None
    given = Processing(session=(0.001, 0.002)).part(2000.0)
    assert given is not None
    u = np.array(PANA) / np.linalg.norm(PANA)
    covariance = given.covariance(np.array(PANA))
    assert u @ covariance @ u == pytest.approx(4e-6)
    assert np.trace(covariance) == pytest.approx(6e-6)


@pytest.mark.skipif(not engines(), reason="RTKLIB is not installed")
@pytest.mark.data
def test_measured_days_and_a_simulator_within_their_limits(shared_data: Path) -> None:
    """Two days of 2.5 km by the data sheet and as learned; the simulator has no such part."""
    days = [
        compute_baseline(*pana(shared_data, *day), PANA, Processing(frequencies=1, pieces=False))
        for day in (("230910", "253"), ("230913", "256"))
    ]
    named = [replace(b, names=("PANA", "IGNF")) for b in days]
    low, high = chi2.ppf([0.025, 0.975], 3)
    assert low < repetitions(named)[0] < high
    results = with_repeats([SessionResult(str(k), (b,), b.covariance) for k, b in enumerate(named)])
    assert low < repetitions([r.baselines[0] for r in results])[0] < high
    settings = Processing(atmosphere=False, pieces=False)
    assert compute_baseline(*spirent(shared_data), SPIRENT_BASE, settings).session_part is None
