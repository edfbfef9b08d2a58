"""Self-calibration of many stations: time split, memory, growth with the number of stations.

Every station sees every target on one of two faces; the ten parameters of the high-end model, inner
constraints, no start values. Each size runs in a process of its own, so that its peak memory is its
own. Every step is compared with one linearisation (design and normal matrix), which no method can
avoid.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator
from typing import Any, TypeVar

import numpy as np
import scipy.sparse as sp

from benchmarks.figures import Cost, Figure, Growth, cost_of, run
from tribrach.calibration.calibrated import StationModel, calibrate_survey
from tribrach.calibration.correlations import calibration_correlations
from tribrach.calibration.datum_effects import datum_effects
from tribrach.calibration.estimability import estimability, propose
from tribrach.calibration.self_calibration import calibration_names
from tribrach.calibration.significance import omitted_parameters
from tribrach.geometry.polar import polar_from_xyz
from tribrach.geometry.rotation import exp
from tribrach.instruments.calibration import HIGH_END, NIST
from tribrach.network.adjustment import adjust
from tribrach.network.assembly import Assembly
from tribrach.network.network import Datum, Network
from tribrach.network.start.start_values import find_start
from tribrach.network.survey import Survey
from tribrach.observations.scanner import ScannerPolar
from tribrach.units import SEC

TRUTH = np.array(
    [1.1e-3, 4e-4, -1e-4, 2.5e-4, -5 * SEC, 6 * SEC, 1e-4, 14 * SEC, 4 * SEC, -6 * SEC]
)
MODEL = NIST.select(HIGH_END)
LIMIT = "one linearisation"

Result = TypeVar("Result")


def hall(stations: int, targets: int, seed: int = 0) -> Network:
    """Targets on the surfaces of a hall of 40 x 30 x 12 m, readings with noise, nothing else."""
    rng = np.random.default_rng(seed)
    low, high = np.array([-20.0, -15.0, -2.0]), np.array([20.0, 15.0, 10.0])
    x = rng.uniform(low, high, (targets, 3))
    side = rng.integers(0, 3, targets)
    x[np.arange(targets), side] = np.where(rng.random(targets) < 0.5, low[side], high[side])
    names = np.array([f"T{i}" for i in range(targets)], dtype=object)
    survey = Survey()
    for j in range(stations):
        t = rng.uniform([-15, -10, -0.5], [15, 10, 0.5])
        turn = exp(np.array([0.01, -0.02, rng.uniform(-3, 3)]))
        g = polar_from_xyz((x - t) @ turn)
        seen = (g[:, 0] > 0.5) & (np.sin(g[:, 2]) > 0.02)
        g, face = g[seen], rng.choice([1.0, -1.0], int(seen.sum()))
        sigma = np.column_stack([0.0012 + 1e-5 * g[:, 0], np.full((len(g), 2), 8 * SEC)])
        values = g - MODEL.delta(g, face, np.tile(TRUTH, (len(g), 1)))
        survey.station(f"S{j}")
        survey.add(
            ScannerPolar,
            values=values + sigma * rng.normal(size=g.shape),
            sigma=sigma,
            station=f"S{j}",
            target=names[seen],
            face=face,
        )
    given = StationModel(MODEL, "scanner")
    calibrate_survey(survey, {f"S{j}": given for j in range(stations)})
    survey.datum = Datum("free")
    return survey.network()


def taken(stations: int, targets: int) -> dict[str, Any]:
    """Cost of every step."""
    costs: dict[str, Cost] = {}

    def step(what: str, work: Callable[[], Result]) -> Result:
        result, costs[what] = cost_of(work)
        return result

    network = hall(stations, targets)
    names = calibration_names(network)
    state = step("start values", lambda: find_start(network))
    network = network.with_start(state)

    def linearised() -> None:
        design = Assembly(network).design(state)
        sp.csc_array(sp.csr_array(design.T) @ design)

    step(LIMIT, linearised)
    step("open combinations", lambda: estimability(network, state))
    step("proposal of parameters", lambda: propose(network, state, names))
    adjustment = step("adjustment", lambda: adjust(network))
    step("tests of other parameters", lambda: omitted_parameters(adjustment, NIST))
    step("correlations", lambda: calibration_correlations(adjustment, names))
    step("other datums", lambda: datum_effects(adjustment, names))
    sigma = np.sqrt([adjustment.covariance(name)[0, 0] for name in names])
    errors = (adjustment.state.scalars - TRUTH) / sigma
    return {
        "values": adjustment.n_observations,
        "costs": costs,
        "worst": float(np.abs(errors).max()),
    }


def measure(stations: float, targets: float) -> Iterator[Figure | Growth]:
    """A quarter, half and all of the stations."""
    pool = multiprocessing.get_context("spawn")
    with pool.Pool(1, maxtasksperchild=1) as one:
        one.apply(taken, (4, 60))  # compiles and fills the cache
    counts = [max(2, int(stations) // 4), max(3, int(stations) // 2), int(stations)]
    seconds, values = [], []
    for count in counts:
        with pool.Pool(1, maxtasksperchild=1) as one:
            found = one.apply(taken, (count, int(targets)))
        costs: dict[str, Cost] = found["costs"]
        seconds.append(costs["adjustment"].processor)
        values.append(found["values"])
        size = f"{count} stations, {targets:.0f} targets, {found['values']} values"
        told = f"worst parameter {found['worst']:.1f} sigma from the truth"
        limit = costs.pop(LIMIT)
        for what, cost in costs.items():
            yield Figure(f"self-calibration: {what}", size, cost, LIMIT, limit, told)
            told = ""
    yield Growth("self-calibration: adjustment", "values", tuple(values), tuple(seconds))


if __name__ == "__main__":
    run(measure, full=(100, 1000), small=(12, 150))
