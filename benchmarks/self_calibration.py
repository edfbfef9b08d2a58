"""Self-calibration of many stations: time split, memory, growth with the number of stations.

``python benchmarks/self_calibration.py [STATIONS TARGETS]``: every station sees every target on one
of two faces; the ten parameters of the high-end model, inner constraints, no start values. Each
size runs in a process of its own, so that its peak memory is its own. The time of an adjustment is
compared with that of one linearisation (design and normal matrix), which no method can avoid.
Seconds are of the processor, so that other work on the machine does not count.
"""

from __future__ import annotations

import itertools
import multiprocessing
import resource
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sp

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


def run(stations: int, targets: int) -> dict[str, Any]:
    """Seconds of every step and peak memory [MB]."""
    seconds: dict[str, float] = {}

    def timed(what: str, work: Callable[[], Any]) -> Any:
        begin = time.process_time()
        out = work()
        seconds[what] = time.process_time() - begin
        return out

    network = timed("(simulating)", lambda: hall(stations, targets))
    names = calibration_names(network)
    state = timed("start values", lambda: find_start(network))
    network = network.with_start(state)

    def linearised() -> None:
        design = Assembly(network).design(state)
        sp.csc_array(sp.csr_array(design.T) @ design)

    timed("(one linearisation)", linearised)
    timed("open combinations", lambda: estimability(network, state))
    timed("proposal of parameters", lambda: propose(network, state, names))
    adjustment = timed("adjustment", lambda: adjust(network))
    timed("tests of other parameters", lambda: omitted_parameters(adjustment, NIST))
    timed("correlations", lambda: calibration_correlations(adjustment, names))
    timed("other datums", lambda: datum_effects(adjustment, names))
    sigma = np.sqrt([adjustment.covariance(name)[0, 0] for name in names])
    errors = (adjustment.state.scalars - TRUTH) / sigma
    return {
        "values": adjustment.n_observations,
        "unknowns": adjustment.n_unknowns,
        "iterations": adjustment.iterations,
        "seconds": seconds,
        "worst": float(np.abs(errors).max()),
        "megabytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }


def main() -> None:
    stations = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    targets = int(sys.argv[2]) if len(sys.argv) > 2 else 1000
    pool = multiprocessing.get_context("spawn")
    with pool.Pool(1, maxtasksperchild=1) as one:
        one.apply(run, (4, 60))  # compiles and fills the cache
    results = []
    for count in (max(2, stations // 4), max(3, stations // 2), stations):
        with pool.Pool(1, maxtasksperchild=1) as one:
            results.append((count, one.apply(run, (count, targets))))
    for count, found in results:
        print(
            f"{count} stations, {targets} targets: {found['values']} values, {found['unknowns']} "
            f"unknowns, {found['iterations']} iterations, peak memory {found['megabytes']:.0f} MB, "
            f"worst parameter {found['worst']:.1f} sigma from the truth"
        )
        total = sum(s for what, s in found["seconds"].items() if not what.startswith("("))
        unit = found["seconds"]["(one linearisation)"]
        for what, s in found["seconds"].items():
            share = "" if what.startswith("(") else f"{100 * s / total:5.1f} %"
            print(f"  {what:<28} {s:8.2f} s {share:>8}  {s / unit:7.1f} linearisations")
    print("growth of the adjustment, against that of the observations:")
    for (a, one), (b, two) in itertools.pairwise(results):
        ratio = two["seconds"]["adjustment"] / one["seconds"]["adjustment"]
        print(f"  {a} -> {b} stations: {ratio:.2f} times, observations {b / a:.2f} times")


if __name__ == "__main__":
    main()
