"""Sigma of a baseline, checked by splitting its session.

The session is cut into four to ten pieces in time, each is computed by itself, and the scatter of
their coordinates is compared with what their covariance states: the sum

    q = (x - A m)^T C^-1 (x - A m),        m = (A^T C^-1 A)^-1 A^T C^-1 x

over the coordinates x of all pieces (A repeats the identity) is chi-square distributed with
3 (k - 1) degrees of freedom where the covariance holds. Neighbours share what stays alike longer
than the step from one to the next: blocks of C are ``C_i^(1/2) r_ij C_j^(1/2)`` with the
correlation r of their means. ``sqrt(q/(3 (k - 1)))`` is the scatter over what is stated, with a
standard deviation of ``1/sqrt(6 (k - 1))`` of its own. Beyond the 95 % limit all sigmas of the
baseline are widened by this ratio; a small scatter narrows nothing, because pieces do not see all,
but below the 2.5 % limit sigmas are said to be larger than the pieces need.

They see what differs between them: noise, multipath and air that change in minutes, wrong
integers. They do not see what stays for the whole session or returns in each of them: offsets and
heights of antennas, phase centres, the coordinates of the base, orbits, the frame. Method section
7.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from tribrach._types import Array
from tribrach.answers import Result, Vector
from tribrach.sentences import Sentence
from tribrach.statistics import chi2

#: a piece is to last this long [s] where the session allows for it
PIECE = 900.0
#: pieces that a session is cut into
FEWEST, MOST = 4, 10
#: a shorter piece than this [s], or one of fewer epochs, has no solution of its own
SHORTEST, EPOCHS = 120.0, 10
#: pieces that agree are within this limit
LEVEL = 0.95
#: sigmas are larger than pieces need where q is below this quantile of what right sigmas give
TOO_SMALL = 0.025
#: what the scatter of pieces does not show
UNSEEN = (
    "heights and phase centres of antennas, the coordinates of the base, orbits and frame stay the "
    "same in all pieces and are not in their scatter"
)


@dataclass(frozen=True, eq=False)
class PieceScatter(
    Result,
    also=("ratio", "factor"),
    without=("floating",),
    keys={"pieces": "solved", "factor": "widened"},
):
    """How far the pieces of a session scatter, against what they state; X, Y, Z [m]."""

    #: how many gave a solution, and how many there were
    pieces: int
    cut: int
    sigma: Vector  #: standard deviation of one piece, from the scatter
    stated: Vector  #: that which the pieces state, root of the mean square
    #: the sum q, its degrees of freedom and its 95 % limit
    statistic: float
    dof: int
    limit: float
    floating: int = 0  #: how many of the pieces have float ambiguities

    @property
    def ratio(self) -> float:
        """Scatter over what is stated."""
        return float(np.sqrt(self.statistic / self.dof))

    @property
    def ratio_sigma(self) -> float:
        """Standard deviation of the ratio where it is one."""
        return float(1 / np.sqrt(2 * self.dof))

    @property
    def agree(self) -> bool:
        """True if the pieces scatter no more than their covariances let expect."""
        return self.statistic <= self.limit

    @property
    def generous(self) -> bool:
        """True if the pieces scatter less than right sigmas would let them (2.5 %)."""
        return self.statistic < float(chi2.ppf(TOO_SMALL, self.dof))

    @property
    def factor(self) -> float:
        """On the sigmas of the baseline: 1 where the pieces agree, never less."""
        return 1.0 if self.agree else self.ratio

    @property
    def scatter(self) -> float:
        """Standard deviation of one piece in space [m]."""
        return float(np.linalg.norm(self.sigma))

    def figures(self) -> str:
        """What the pieces tell, in figures."""
        count = f"{self.pieces} pieces of the session"
        if self.pieces < self.cut:
            count = f"{self.pieces} of {self.cut} pieces of the session (the others solve less)"
        return Sentence(
            "{count} scatter by {own.scatter:mm1} in space (standard deviation), "
            "{own.ratio:2} +- {own.ratio_sigma:2} times what they state (chi-square "
            "{own.statistic:1} with {own.dof} degrees of freedom, limit {own.limit:1})",
            count=count,
            own=self,
        )

    def sentence(self) -> str:
        """The same, with what follows from it, and why pieces without integers state much."""
        return self._verdict() + self._float()

    def _float(self) -> str:
        """What pieces with float ambiguities state, and why; nothing where there are none."""
        if not self.floating:
            return ""
        stated = 1e3 * float(np.linalg.norm(self.stated))
        return Sentence(
            "; {own.floating} of these pieces have float ambiguities and state {stated:1} "
            "mm in space each: without integers only the motion of the satellites "
            "separates ambiguities from coordinates, so that a piece is much less certain "
            "than its share of the session",
            own=self,
            stated=stated,
        )

    def _verdict(self) -> str:
        """The figures and what they say of the sigmas."""
        if self.generous:
            factor = 1 / max(self.ratio, 1e-3)
            return Sentence(
                "{figures}: sigmas are larger than the pieces need, by a factor of "
                "{factor:g3}; they stay so, since pieces do not see all",
                figures=self.figures(),
                factor=factor,
            )
        if self.agree:
            return f"{self.figures()}: sigmas hold"
        return Sentence(
            "{figures}: noise, multipath and air that change in minutes or wrong integers "
            "are larger than the phases show, and sigmas are widened by {own.factor:2}",
            figures=self.figures(),
            own=self,
        )


def piece_spans(times: Array) -> list[tuple[float, float]]:
    """First and last time [s] of four to ten pieces of equally many epochs; none if too short."""
    n = len(times)
    if n < 2:
        return []
    interval = float(np.median(np.diff(times)))
    duration = float(times[-1] - times[0]) + interval
    count = int(np.clip(duration // PIECE, FEWEST, MOST))
    if duration / count < SHORTEST or n // count < EPOCHS:
        return []
    edges = [round(k * n / count) for k in range(count + 1)]
    half = interval / 2
    return [(float(times[a]) - half, float(times[b - 1]) + half) for a, b in pairwise(edges)]


def piece_scatter(
    values: Sequence[Array],
    covariance: Sequence[Array],
    cut: int | None = None,
    floating: int = 0,
    correlation: Array | None = None,
) -> PieceScatter | None:
    """Scatter of values (k, 3) [m] of pieces against covariances (k, 3, 3); None below three.

    ``cut``: how many pieces there were; ``correlation`` (k, k): between pieces, None for none.
    """
    k = len(values)
    if k < FEWEST - 1:
        return None
    # around their mean, for the sake of the digits
    x, c = np.asarray(values, dtype=float), np.asarray(covariance, dtype=float)
    x = x - x.mean(axis=0)
    size, axes = np.linalg.eigh(c)
    roots = (axes * np.sqrt(size)[:, None, :]) @ axes.transpose(0, 2, 1)
    # whitened by the roots of the blocks, what is left of the covariance is the correlation
    white = np.linalg.inv(roots)
    values_white = np.einsum("kij,kj->ki", white, x)
    between = np.eye(k) if correlation is None else correlation
    weight = np.kron(np.linalg.inv(between), np.eye(3))
    design = white.reshape(3 * k, 3)
    y = values_white.ravel()
    mean = np.linalg.solve(design.T @ weight @ design, design.T @ weight @ y)
    rest = y - design @ mean
    statistic = float(rest @ weight @ rest)
    apart = x - mean
    dof = 3 * (k - 1)
    return PieceScatter(
        k,
        k if cut is None else cut,
        np.sqrt(np.square(apart).sum(axis=0) / (k - 1)),
        np.sqrt(np.einsum("kii->ki", c).mean(axis=0)),
        statistic,
        dof,
        float(chi2.ppf(LEVEL, dof)),
        floating,
    )
