"""The relative pose of each pair of stations by itself, tested against the network.

The observations that two stations have in common (planes, targets, a registration of their clouds)
give a relative pose of their own, with the other stations left out. Its difference q to the
adjusted relative pose has the covariance ``C_pair - C_adjusted``, because the adjustment is the
best linear unbiased estimate from all observations, those of the pair among them (Hausman 1978,
Econometrica 46, 1251). ``q^T (C_pair - C_adjusted)^+ q`` is then chi-square with as many degrees of
freedom as directions that the pair holds and others control. Metres and radians; q is a shift of
the second station's place and a left turn, about the axes of the world.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from heapq import nlargest
from itertools import combinations

import numpy as np
import scipy.sparse as sp

from tribrach._types import Array, Index
from tribrach.answers import Result
from tribrach.comparison.station_pair import StationPair
from tribrach.network.adjustment import Adjustment
from tribrach.observations.base import Observations, Use
from tribrach.observations.declaration import End
from tribrach.statistics import chi2

#: turns count with this lever against shifts [m]
_LEVER = 10.0
#: directions whose normal is this share of the largest are held by the pair
_HELD = 1e-9
#: directions in which the network knows no more than the pair itself say nothing
_CONTROLLED = 1e-3
#: probability that a good pair is called an outlier
ALPHA = 0.001
#: pairs of one kind that are tested, at most
MOST = 3000


@dataclass(frozen=True)
class Edge(Result, also=("outlying",), maybe=("overlap", "conflict")):
    """Two stations and one kind of observations that they have in common."""

    #: names of the stations
    first: str
    second: str
    kind: str  #: name of the observation kind
    count: int  #: number of surfaces, targets or registrations in common
    rms: float  #: root mean square of the adjusted residuals of their lengths [m]
    held: int  #: number of the six directions that they hold
    #: shift of the pair's own relative pose against the adjusted one, along what it holds [m]
    shift: float
    shift_sigma: float  #: predicted for the shift [m]
    #: turn of the pair's own relative pose against the adjusted one, along what it holds [rad]
    turn: float
    turn_sigma: float  #: predicted for the turn [rad]
    statistic: float | None  #: test statistic, None where nothing controls the pair
    limit: float | None  #: its limit, None where nothing controls the pair
    freedom: int  #: degrees of freedom of the test, 0 where nothing controls the pair
    #: shares of the views of both stations that overlap, and that contradict each other
    overlap: float | None = None
    conflict: float | None = None

    @property
    def outlying(self) -> bool:
        """True if the network contradicts the pair."""
        return self.statistic is not None and self.limit is not None and self.statistic > self.limit

    @property
    def ratio(self) -> float | None:
        """Test statistic over its limit."""
        if self.statistic is None or self.limit is None:
            return None
        return self.statistic / self.limit


def edges(adjustment: Adjustment, alpha: float = ALPHA, most: int = MOST) -> list[Edge]:
    """Compare all pairs of stations that share observations with the network, kind by kind."""
    out = []
    for number, observations in enumerate(adjustment.network.observations):
        pairs = _pairs(adjustment, number, observations)
        for first, second, rows, count in nlargest(most, pairs, key=lambda pair: pair[3]):
            edge = _edge(adjustment, first, second, rows, count, observations.kind, alpha)
            if edge is not None:
                out.append(edge)
    return sorted(out, key=lambda edge: (edge.first, edge.second, edge.kind))


def _pairs(
    adjustment: Adjustment, number: int, observations: Observations
) -> Iterator[tuple[int, int, Index, int]]:
    """Pose indices, rows of the design and what they have in common, for one table."""
    first, second = observations.end_field(End.FROM), observations.end_field(End.TO)
    if not observations.facts.common_to_stations or first is None or second is None:
        return
    rows = np.flatnonzero(adjustment.rows.table == number)
    item = adjustment.rows.item[rows]
    start = np.asarray(getattr(observations, first.name))
    end = np.asarray(getattr(observations, second.name))
    if second.family == "pose":
        for k in np.flatnonzero(observations.use == Use.ACTIVE):
            yield int(start[k]), int(end[k]), rows[item == k], 1
        return
    poses, shared = start[item], end[item]
    for a, b in combinations(np.unique(poses).tolist(), 2):
        common = np.intersect1d(shared[poses == a], shared[poses == b])
        if len(common):
            chosen = np.isin(shared, common) & ((poses == a) | (poses == b))
            yield a, b, rows[chosen], len(common)


def _edge(
    adjustment: Adjustment,
    first: int,
    second: int,
    rows: Index,
    count: int,
    kind: str,
    alpha: float,
) -> Edge | None:
    """The pair's own relative pose against the adjusted one."""
    layout = adjustment.layout
    names = layout.names["pose"]
    own = adjustment.reduced[layout.columns("pose", second)]
    other = adjustment.reduced[layout.columns("pose", first)]
    ends = first, second
    if (own < 0).any():
        # the second station holds the frame: the pair is the pose of the first
        own, other, first, second = other, own, second, first
    if (own < 0).any():
        return None
    other = other[other >= 0]
    design = sp.csr_array(adjustment.design[rows])
    normal, right = _reduced(design, -adjustment.whitened_residuals[rows], own, other)
    scale = np.array([1.0, 1.0, 1.0, *[1 / _LEVER] * 3])
    value, vector = np.linalg.eigh(normal * scale[:, None] * scale)
    good = value > _HELD * max(value[-1], 1e-300)
    if not good.any():
        return None
    # coordinates along what is held, in units in which turns count with the lever
    basis = vector[:, good]
    step = (basis.T @ (scale * right)) / value[good]
    pair = StationPair.from_adjustment(adjustment, names[first], names[second])
    whole = pair.relative(pair.second) / scale[:, None] / scale
    known = basis.T @ whole @ basis
    statistic, freedom, excess = _test(step, 1 / value[good], known)
    q = scale * (basis @ step)
    spread = scale[:, None] * (basis @ excess @ basis.T) * scale
    limit = float(chi2.ppf(1 - alpha, freedom)) if freedom else None
    return Edge(
        names[ends[0]],
        names[ends[1]],
        kind,
        count,
        _rms(adjustment, rows),
        int(good.sum()),
        float(np.linalg.norm(q[:3])),
        float(np.sqrt(np.trace(spread[:3, :3]))),
        float(np.linalg.norm(q[3:])),
        float(np.sqrt(np.trace(spread[3:, 3:]))),
        statistic if freedom else None,
        limit,
        freedom,
    )


def _rms(adjustment: Adjustment, rows: Index) -> float:
    """Root mean square [m] of the residuals of these rows that are lengths."""
    tables, at = adjustment.network.observations, adjustment.rows
    units = [tables[t].units[r] for t, r in zip(at.table[rows], at.row[rows], strict=True)]
    lengths = rows[np.array(units) == "m"]
    return float(np.sqrt(np.mean(adjustment.residuals[lengths] ** 2))) if len(lengths) else 0.0


def _reduced(
    design: sp.csr_array, misclosure: Array, own: Index, other: Index
) -> tuple[Array, Array]:
    """Normal matrix (6, 6) and right side (6,) of the second pose with the first one held.

    Unknowns that both stations see are eliminated; those of instruments keep their adjusted values.
    """
    used = np.unique(design.indices)
    matrix = design[:, used].toarray()
    place = {int(c): k for k, c in enumerate(used)}
    own_columns = np.zeros((len(matrix), 6))
    for k, column in enumerate(own):
        if int(column) in place:
            own_columns[:, k] = matrix[:, place[int(column)]]
    rest = matrix[:, ~np.isin(used, np.concatenate([own, other]))]
    shared = rest[:, (rest != 0).any(axis=0)]
    if shared.shape[1]:
        size = np.linalg.norm(shared, axis=0)
        q, r = np.linalg.qr(shared / size)
        q = q[:, np.abs(np.diag(r)) > 1e-10]
        own_columns = own_columns - q @ (q.T @ own_columns)
        misclosure = misclosure - q @ (q.T @ misclosure)
    return own_columns.T @ own_columns, own_columns.T @ misclosure


def _test(step: Array, alone: Array, known: Array) -> tuple[float, int, Array]:
    """Statistic, degrees of freedom and covariance (r, r) of a difference (r,).

    ``alone`` are variances of the pair's own estimate, ``known`` is the covariance of the adjusted
    one.
    """
    root = np.sqrt(alone)
    share = known / root[:, None] / root
    value, vector = np.linalg.eigh(0.5 * (share + share.T))
    free = np.maximum(1 - value, 0.0)
    good = free > _CONTROLLED
    along = vector.T @ (step / root)
    statistic = float(np.sum(along[good] ** 2 / free[good]))
    excess = (vector * np.where(good, free, 0.0)) @ vector.T * root[:, None] * root
    return statistic, int(good.sum()), np.asarray(excess)
