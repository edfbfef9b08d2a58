"""Is the stated covariance the covariance of the solutions?

Each network is adjusted many times with new observation errors drawn from its own stochastic
model. The sample covariance must agree with the stated one within chi-square 99.9 % bounds, and
the 95 % ellipsoids must cover the truth in 95 % of the cases. The thin runs take 150 solutions;
``-m slow`` takes 2,000 and holds coverage to 1.5 percentage points.
"""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse.linalg as sla
from scipy.stats import chi2

from tests.network.networks import constrained_network, mixed_network, scanner_network
from tribrach.network.adjustment import adjust
from tribrach.network.assembly import Assembly
from tribrach.network.network import Datum, Network
from tribrach.network.survey import Survey
from tribrach.observations.unknowns import State


def free_scanners() -> Survey:
    survey, _ = scanner_network(np.random.default_rng(7), targets=8, stations=3)
    return survey


def redraw(network: Network, truth: State, rng: np.random.Generator) -> Network:
    """The network observed anew: true values plus errors ``W^-1 z``."""
    assembly = Assembly(network)
    errors = sla.spsolve_triangular(
        assembly.whitener.tocsr(), rng.standard_normal(len(assembly.rows)), lower=True
    )
    observations, first = [], 0
    for o in network.observations:
        size = o.values.size
        errors_here = errors[first : first + size].reshape(o.values.shape)
        first += size
        observations.append(replace(o, values=o.predict(truth) + errors_here))
    return replace(network, observations=tuple(observations), start=truth)


def true_network(survey: Survey) -> tuple[Network, State]:
    """A network whose truth is its own adjusted state, and which starts there."""
    network = survey.network()
    truth = adjust(network).state
    return network, truth


def solutions(survey: Survey, count: int, seed: int) -> tuple[np.ndarray, np.ndarray, list]:
    """Deviations (count, u) of the point coordinates, their stated covariance, point columns."""
    network, truth = true_network(survey)
    rng = np.random.default_rng(seed)
    deviations, vtpv, stated = [], [], None
    for _ in range(count):
        adjustment = adjust(redraw(network, truth, rng))
        deviations.append((adjustment.state.positions - truth.positions).ravel())
        vtpv.append(adjustment.vtpv)
        if stated is None:
            columns = adjustment.layout.position_columns(np.arange(len(truth.positions))).ravel()
            stated = adjustment.covariance_columns(columns, columns)
            dof = adjustment.dof
    return np.array(deviations), stated, [np.array(vtpv), dof]


NETWORKS = {
    "levelling, total station and GNSS": mixed_network,
    "free scanner network": free_scanners,
    "network with constraints": constrained_network,
}


def check(name: str, count: int, coverage_tolerance: float) -> None:
    deviations, stated, (vtpv, dof) = solutions(NETWORKS[name](), count, seed=11)
    moving = np.diag(stated) > 1e-16
    deviations, stated = deviations[:, moving], stated[np.ix_(moving, moving)]
    # every variance on its own
    ratio = count * (deviations**2).mean(axis=0) / np.diag(stated)
    # 99.9 % for the whole family of tests (Sidak), two-sided
    tail = (1 - 0.999 ** (1 / len(ratio))) / 2
    assert (ratio > chi2.ppf(tail, count)).all()
    assert (ratio < chi2.ppf(1 - tail, count)).all()
    # the whole matrix: whitened deviations are standard normal in its range
    values, vectors = np.linalg.eigh(stated)
    good = values > 1e-9 * values.max()
    white = deviations @ vectors[:, good] / np.sqrt(values[good])
    total, freedom = (white**2).sum(), white.size
    assert chi2.ppf(0.0005, freedom) < total < chi2.ppf(0.9995, freedom)
    # ellipsoids of single points
    inside = []
    for start in range(0, moving.size, 3):
        columns = np.flatnonzero(np.isin(np.flatnonzero(moving), np.arange(start, start + 3)))
        if len(columns) == 3:
            inverse = np.linalg.inv(stated[np.ix_(columns, columns)])
            d = deviations[:, columns]
            inside.append(np.einsum("ni,ij,nj->n", d, inverse, d) < chi2.ppf(0.95, 3))
    assert abs(np.mean(inside) - 0.95) < coverage_tolerance
    assert chi2.ppf(0.0005, dof * count) < vtpv.sum() < chi2.ppf(0.9995, dof * count)


@pytest.mark.parametrize("name", NETWORKS)
def test_stated_covariance_is_the_sample_covariance(name: str) -> None:
    check(name, 150, 0.03)


@pytest.mark.slow
@pytest.mark.parametrize("name", NETWORKS)
def test_stated_covariance_is_the_sample_covariance_of_2000(name: str) -> None:
    check(name, 2000, 0.015)


def test_the_datum_of_a_free_network_does_not_matter_for_coverage() -> None:
    survey = free_scanners()
    survey.datum = Datum("free", ("T0", "T1", "T2", "T3"))
    deviations, stated, _ = solutions(survey, 60, seed=5)
    ratio = 60 * (deviations**2).mean(axis=0) / np.diag(stated)
    assert (ratio < chi2.ppf(1 - 1e-6, 60)).all()
