"""Candidates of a plan per second: rank-k updates of one covariance against a new factor for each.

Scanner stations in a hall see targets in two faces, with calibration unknowns and inner
constraints; places of one more target are judged by the largest sigma of all points. The peer
linearises and factors the network with each candidate in it, once, and takes the same covariances
from it; reading and naming are not counted.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp

from benchmarks.figures import Cost, Figure, cost_of, run
from tribrach.geometry.polar import polar_from_xyz
from tribrach.instruments.calibration import NIST
from tribrach.network.assembly import Assembly
from tribrach.network.datum import Cofactor, open_motions, point_numbers
from tribrach.network.defects import datum_mask
from tribrach.network.network import Datum, Network
from tribrach.network.survey import Survey
from tribrach.observations.scanner import ScannerPolar
from tribrach.planning.blocks import Blocks, join
from tribrach.planning.groups import coming, prospect_for
from tribrach.planning.prediction import (
    Criterion,
    largest_sigma,
    position_columns,
    predict,
    with_parameters,
    with_predicted_values,
)
from tribrach.planning.prospect import Prospect

MODEL = NIST.select(["x10", "x2", "x3", "x4", "x6"])
SIGMA = np.array([1.2e-3, 4e-5, 4e-5])
#: candidates that the peer refactors
PEER = 12


def sights(survey: Survey, stations: np.ndarray, names: list[str], xyz: np.ndarray) -> None:
    """Every station sees all named targets in two faces."""
    for k, place in enumerate(stations):
        polar = polar_from_xyz(xyz - place)
        for face in (1.0, -1.0):
            survey.add(
                ScannerPolar,
                values=polar,
                sigma=np.tile(SIGMA, (len(polar), 1)),
                station=[f"S{k}"] * len(polar),
                target=names,
                face=np.full(len(polar), face),
                model=MODEL,
                parameters=np.tile(np.array(MODEL.parameters, dtype=object), (len(polar), 1)),
            )


def hall(stations: int, targets: int) -> tuple[Survey, np.ndarray]:
    """The survey and the places of its stations."""
    rng = np.random.default_rng(0)
    at = rng.uniform(0, 1, (stations, 3)) * [60, 40, 1]
    xyz = rng.uniform(0, 1, (targets, 3)) * [60, 40, 8] + [0, 0, 1.5]
    survey = Survey(datum=Datum("free", tuple(f"T{k}" for k in range(targets))))
    for k, place in enumerate(at):
        survey.station(f"S{k}", translation=place, rotation=np.eye(3))
    for k, place in enumerate(xyz):
        survey.point(f"T{k}", place)
    sights(survey, at, [f"T{k}" for k in range(targets)], xyz)
    return survey, at


def candidates(survey: Survey, at: np.ndarray, places: np.ndarray) -> Survey:
    """The survey with further targets."""
    names = [f"C{k}" for k in range(len(places))]
    for name, place in zip(names, places, strict=True):
        survey.point(name, place)
    sights(survey, at, names, places)
    return survey


def by_factor(network: Network, criterion: Criterion) -> float:
    """The largest sigma from one linearisation and one factor of the whole network."""
    assembly = Assembly(network)
    state, free = network.start, assembly.free_columns
    design, (constraints, _) = assembly.design(state), assembly.constraints(state)
    motions = open_motions(design, state, free, constraints)
    datum = datum_mask(network, free)
    points = point_numbers(state.layout, free)
    normal = sp.csc_array(design.T @ design)
    cofactor = Cofactor(normal, points, constraints, motions.basis, datum)
    _, columns = position_columns(state.layout, criterion.names)
    return float(largest_sigma(cofactor.blocks(assembly.reduced[columns])).max())


def measure(stations: float, targets: float, places: float) -> Iterator[Figure]:
    """Judge so many places."""
    stations, targets, count = int(stations), int(targets), int(places)
    survey, at = hall(stations, targets)
    criterion = Criterion("sigma", tuple(f"T{k}" for k in range(targets)))
    base = predict(survey.network())
    rng = np.random.default_rng(1)
    where = rng.uniform(0, 1, (count, 3)) * [60, 40, 8] + [0, 0, 1.5]

    bare = Survey()
    for k, place in enumerate(at):
        bare.station(f"S{k}", translation=place, rotation=np.eye(3))
    further = candidates(bare, at, where).network()
    groups = {f"C{k}": k for k in range(count)}

    def prepare() -> tuple[Prospect, Blocks]:
        now = prospect_for(base, criterion, [further])
        return now, join(coming(base, now, further, groups))

    (now, blocks), prepared = cost_of(prepare, 2)
    values, judged = cost_of(lambda: now.judge(blocks).value, 2)
    apart, wall, processor = 0.0, 0.0, 0.0
    for k in range(PEER):
        wide = candidates(hall(stations, targets)[0], at, where[k : k + 1]).network()
        wide = with_predicted_values(with_parameters(wide))
        exact, cost = cost_of(lambda wide=wide: by_factor(wide, criterion))
        wall, processor = wall + cost.wall, processor + cost.processor
        mine = values[blocks.number.tolist().index(k)]
        apart = max(apart, abs(mine - exact) / exact)
    theirs = Cost(wall * count / PEER, processor * count / PEER)
    size = f"{stations} stations, {targets} targets, {count} places"
    peer = f"a new factor for each, from {PEER} of them"
    told = f"figures apart by {apart:.1e} at most"
    yield Figure("places of a target judged", size, judged, peer, theirs, told)
    whole = Cost(prepared.wall + judged.wall, prepared.processor + judged.processor)
    yield Figure("the same with preparation", size, whole, peer, theirs)


if __name__ == "__main__":
    run(measure, full=(4, 60, 5000), small=(4, 40, 500))
