"""Start values with nothing known but a little control.

The peer is one linearisation (the design matrix) of the same network, which no method avoids.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from benchmarks.figures import Figure, Growth, cost_of, run
from tribrach.geometry import rotation
from tribrach.network.assembly import Assembly
from tribrach.network.start.start_values import find_start
from tribrach.network.survey import Survey
from tribrach.observations.scanner import TargetCentres
from tribrach.observations.sights import Directions, SlopeDistances, ZenithAngles


def grid(side: int) -> tuple[Survey, np.ndarray]:
    """Set-ups on a grid that sight their neighbours; three corners are control."""
    rng = np.random.default_rng(1)
    e, n = (a.ravel() * 100.0 for a in np.meshgrid(np.arange(side), np.arange(side)))
    truth = np.c_[e, n, rng.uniform(0, 20, side**2)] + rng.normal(0, 3, (side**2, 3))
    index = np.arange(side**2).reshape(side, side)
    pairs = [(index[:, :-1], index[:, 1:]), (index[:-1], index[1:])]
    one = np.concatenate([np.c_[a.ravel(), b.ravel()] for a, b in pairs])
    both = np.concatenate([one, one[:, ::-1]])
    names = np.array([f"P{i}" for i in range(side**2)], dtype=object)
    survey = Survey()
    for i in range(side**2):
        known = i in (0, side - 1, side**2 - 1)
        survey.point(names[i], truth[i] if known else [np.nan] * 3, free=(not known,) * 3)
    u = truth[both[:, 1]] - truth[both[:, 0]]
    ends = {"start": names[both[:, 0]], "end": names[both[:, 1]]}
    reading = np.arctan2(u[:, 0], u[:, 1]) - rng.uniform(-3, 3, side**2)[both[:, 0]]
    circles = np.array([f"o{i}" for i in both[:, 0]], dtype=object)
    noise = rng.normal(size=(3, len(both)))
    survey.add(
        Directions, values=reading + 1e-5 * noise[0], sigma=1e-5, orientation=circles, **ends
    )
    length = np.linalg.norm(u, axis=1)
    survey.add(SlopeDistances, values=length + 0.002 * noise[1], sigma=0.002, **ends)
    zenith = np.arctan2(np.hypot(u[:, 0], u[:, 1]), u[:, 2])
    survey.add(ZenithAngles, values=zenith + 1e-5 * noise[2], sigma=1e-5, **ends)
    return survey, truth


def scanners(stations: int, targets: int, seen: int = 8) -> tuple[Survey, np.ndarray]:
    """Targets seen from their nearest stations, which stand anyhow; four targets are control."""
    rng = np.random.default_rng(2)
    truth = rng.uniform(0, 1000, (targets, 3)) * [1, 1, 0.03]
    t = rng.uniform(0, 1000, (stations, 3)) * [1, 1, 0.03]
    r = rotation.exp(rng.uniform(-2, 2, (stations, 3)))
    far = np.linalg.norm(truth[:, None, :2] - t[None, :, :2], axis=2)
    station = np.argsort(far, axis=1)[:, :seen].ravel()
    target = np.repeat(np.arange(targets), seen)
    u = np.einsum("nji,nj->ni", r[station], truth[target] - t[station])
    survey = Survey()
    for i in range(targets):
        survey.point(f"T{i}", truth[i] if i < 4 else [np.nan] * 3, free=(i >= 4,) * 3)
    for i in range(stations):
        survey.station(f"S{i}")
    survey.add(
        TargetCentres,
        values=u + rng.normal(0, 0.002, u.shape),
        sigma=np.full(u.shape, 0.002),
        station=[f"S{i}" for i in station],
        target=[f"T{i}" for i in target],
    )
    return survey, truth


def found(name: str, survey: Survey, truth: np.ndarray) -> Figure:
    """Find start values of a network."""
    network = survey.network()
    state, cost = cost_of(lambda: find_start(network), 2)
    assembly = Assembly(network.with_start(state))
    _, design = cost_of(lambda: assembly.design(state), 3)
    error = np.linalg.norm(state.points - truth, axis=1).max()
    told = f"errors up to {error:.3f} m"
    return Figure("start values from nothing", name, cost, "one linearisation", design, told)


def measure(*sides: float) -> Iterator[Figure | Growth]:
    """Grids of these sides, and scanners with as many targets as three thousand to a hundred."""
    grids = [found(f"grid {side:.0f} x {side:.0f}", *grid(int(side))) for side in sides]
    yield from grids
    seconds = tuple(figure.ours.processor for figure in grids)
    yield Growth("start values of grids", "points", tuple(side**2 for side in sides), seconds)
    stations = int(3 * sides[-1])
    name = f"{stations} scanners, {10 * stations} targets"
    yield found(name, *scanners(stations, 10 * stations))


if __name__ == "__main__":
    run(measure, full=(25, 50, 100), small=(10, 20))
