"""Start values by trial, where no figure can be put together and the observations fix all the same.

Two figures that share a hinge, or directions that cross from points of which none is placed, have
no step that leads from one place to the next. If the network has full rank at generic places, the
points without a start are thrown around the others and the network is adjusted from there. A
solution counts if the network passes its global test with redundancy, and is taken only if several
throws lead to it and none to another that fits (method section 3.1).
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace

import numpy as np

from tribrach.errors import TribrachError
from tribrach.network.assembly import Assembly
from tribrach.network.defects import closed_elsewhere
from tribrach.network.network import Network
from tribrach.network.solved import SolvedSystem
from tribrach.sentences import Sentence
from tribrach.statistics import chi2

#: throws, those that must lead to one solution, and how far they go in sizes of the network
_THROWS, _AGREE, _WIDTH = 24, 3, 0.7
#: points that are thrown at most
_MOST = 12
#: significance of the global test that a solution must pass
_ALPHA = 0.001
#: share of the size of the network within which two solutions are one
_SAME = 1e-3


def tried_starts(
    network: Network,
    unplaced: Collection[tuple[str, str]],
    solve: Callable[[Network], SolvedSystem],
) -> Network | None:
    """A network with the only start that leads to a solution that fits; None without one.

    ``unplaced``: family and name of each unknown without a start; ``solve``: adjusts a network.
    """
    layout, points = network.start.layout, network.start.points
    lost = [layout.index("point", name) for family, name in unplaced if family == "point"]
    placed = np.isfinite(points[:, :2]).all(axis=1)
    if {family for family, _ in unplaced} - {"point", "scalar"} or placed.sum() < 2:
        return None
    assembly = Assembly(network)
    if not 0 < len(lost) <= _MOST or network.count() <= len(assembly.free_columns):
        return None
    if not closed_elsewhere(assembly, network.start):
        return None
    around = np.nan_to_num(points[placed])
    centre, extent = around.mean(axis=0), np.ptp(around, axis=0)
    extent[:2] = extent[:2].max()
    generator = np.random.default_rng(0)
    found: list[tuple[SolvedSystem, int]] = []
    for _ in range(_THROWS):
        thrown = centre + _WIDTH * extent * generator.standard_normal(points.shape)
        start = points.copy()
        start[lost] = np.where(np.isnan(points[lost]), thrown[lost], points[lost])
        try:
            trial = solve(network.with_start(replace(network.start, points=start)))
        except TribrachError:
            continue
        if trial.dof < 1 or trial.vtpv > float(chi2.ppf(1 - _ALPHA, trial.dof)):
            continue
        place = trial.state.points[lost, :2]
        for k, (other, hits) in enumerate(found):
            if np.abs(other.state.points[lost, :2] - place).max() < _SAME * extent[0]:
                found[k] = (other, hits + 1)
                break
        else:
            found.append((trial, 1))
    if len(found) != 1 or found[0][1] < _AGREE:
        return None
    words = Sentence(
        "start values were found by trial: {hits} of {throws} throws of {names} lead to this "
        "solution and none to another that fits; a rough coordinate of one would confirm it",
        hits=found[0][1],
        throws=_THROWS,
        names=", ".join(layout.position_name(k) for k in lost),
    )
    solved = network.with_start(found[0][0].state)
    return replace(solved, warnings=(*network.warnings, words))
