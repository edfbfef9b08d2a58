"""A 3D grid network of directions, zeniths, distances and some GNSS, at several sizes.

The peer is a measure of what cannot be avoided: one factorisation of the normal matrix by qdldl for
each iteration, and one selected inverse. (The adjustment itself factors by fronts, which is faster
than qdldl where networks are large.) Against it stand the adjustment with the covariance of every
point, and the whole command with reading, tests of all observations and JSON.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import qdldl
import scipy.sparse as sp

from benchmarks.figures import Cost, Figure, Growth, cost_of, run, whole_process
from benchmarks.network_files import grid, write_grid
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.linear import SparseFactor

#: what no method avoids
LIMIT = "factorisations by qdldl and a selected inverse"
#: how often each of both is measured
_REPEATS = 3


def adjusted(side: int) -> Figure:
    """One grid in this process; the peer is qdldl on its normal matrix and a selected inverse."""
    network = grid(side)

    def whole() -> Adjustment:
        adjustment = adjust(network)
        adjustment.position_covariances()
        return adjustment

    adjustment, cost = cost_of(whole)
    normal = sp.csc_array(adjustment.design.T @ adjustment.design)
    scale = 1 / np.sqrt(normal.diagonal())
    unit = sp.csc_matrix(normal.multiply(scale[:, None]).multiply(scale))
    # the least of some: a measure that other programs disturb would flatter what is held to it
    _, factoring = cost_of(lambda: qdldl.Solver(unit).factors(), _REPEATS)
    factors = iter([SparseFactor(normal, scale) for _ in range(_REPEATS)])
    one = np.array([0])
    _, selecting = cost_of(lambda: next(factors).entries(one, one), _REPEATS)
    times = adjustment.iterations
    limit = Cost(
        times * factoring.wall + selecting.wall, times * factoring.processor + selecting.processor
    )
    size = f"{side * side} points, {network.count()} values, {adjustment.n_unknowns} unknowns"
    told = f"{times} iterations, {side * side / cost.wall:,.0f} points a second"
    return Figure("grid network with all 3x3 covariances", size, cost, LIMIT, limit, told)


def by_command(side: int, folder: Path, limit: Cost) -> Figure:
    """``tribrach adjust FILE --json``: reading, tests and reports besides."""
    file = folder / f"grid{side}.gkf"
    count = write_grid(side, file)
    words = [sys.executable, "-m", "tribrach", "adjust", str(file), "--json"]
    # byte code is in a folder of its own, as an installer leaves it beside the sources
    kept = {"PYTHONPYCACHEPREFIX": str(folder / "bytecode"), "PYTHONDONTWRITEBYTECODE": ""}
    cost = whole_process([*words, str(folder / "out.json"), "--quiet", "--overwrite"], **kept)
    size = f"{side * side} points, {count} values"
    told = f"JSON of {(folder / 'out.json').stat().st_size / 1e6:.0f} MB"
    return Figure("tribrach adjust FILE --json", size, cost, LIMIT, limit, told)


def measure(*sides: float) -> Iterator[Figure | Growth]:
    """Adjustments in this process, then whole commands with the same limits."""
    adjusted(16)  # compiled code is loaded before anything is timed
    inside = [adjusted(int(side)) for side in sides]
    yield from inside
    with tempfile.TemporaryDirectory() as folder:
        by_command(32, Path(folder), Cost(1.0, 1.0))  # byte code is written
        commands = [
            by_command(int(side), Path(folder), found.theirs or found.ours)
            for side, found in zip(sides, inside, strict=True)
        ]
    yield from commands
    points = tuple(side**2 for side in sides)
    for figures in (inside, commands):
        seconds = tuple(figure.ours.processor for figure in figures)
        yield Growth(figures[0].what, "points", points, seconds)


if __name__ == "__main__":
    run(measure, full=(45, 71, 142), small=(12, 20))
