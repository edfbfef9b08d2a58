"""A predicted network that observations are added to and taken from without factoring it again.

With the covariance Q of the unknowns that matter, rows B that a group adds (own unknowns
eliminated, :mod:`~tribrach.planning.blocks`) and ``S = I + B Q B^T``,

* ``Q' = Q - Q B^T S^-1 B Q`` (Woodbury); with ``S = I - B Q B^T`` and a plus what is left when a
  group goes;
* share of its weight that the others control, of a value with derivatives f Q:
  ``s' = s + f B^T S^-1 B f^T``, of the group's own values ``diag(S^-1) - leverage``;
* effect of an error of one sigma: ``f' = f - f B^T S^-1 B Q``.

All groups are judged at once. The figures of what is chosen in the end are computed from a new
factor, see :mod:`~tribrach.planning.prediction`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.network.adjustment import Adjustment
from tribrach.network.reliability import UNCONTROLLED, weigh
from tribrach.planning.blocks import Blocks
from tribrach.planning.prediction import (
    Criterion,
    largest_sigma,
    parameter_columns,
    position_columns,
    redundancy_rows,
)

#: unknowns whose joint covariance is kept, and numbers of the effects of all values on them
LARGEST, LARGEST_EFFECTS = 6000, 60_000_000
#: bytes of one step of judging
_MEMORY = 48_000_000
#: pivots of S below this mean that a group cannot be spared
_SPARED = 1e-9


@dataclass(frozen=True)
class Scores:
    """What the criterion becomes with each of c groups."""

    value: Array  #: (c,), the criterion afterwards, NaN where the group cannot come or go
    worse: Array  #: (c,), the same with the sign that grows with disadvantage
    mean: Array  #: (c,), mean of the figures whose extreme the criterion is, to decide ties

    def best(self) -> int | None:
        """The best group; None if there is none."""
        order = self.order()
        return int(order[0]) if len(order) else None

    def order(self) -> Index:
        """Groups that are possible, the best first."""
        possible = np.flatnonzero(np.isfinite(self.value))
        # the criterion to six digits, so that ties go by the mean
        coarse = np.array([float(f"{value:.6g}") for value in self.worse[possible]])
        return np.asarray(possible[np.lexsort((self.mean[possible], coarse))], dtype=np.int64)


@dataclass(frozen=True)
class Prospect:
    """Covariance and effects of a design, as far as groups that come or go change them."""

    criterion: Criterion  #: what designs are judged by
    columns: Index  #: (k,), columns of the full tangent vector that are kept
    covariance: Array  #: (k, k), covariance of the kept columns
    #: (n,), share of its weight that is controlled, of every active value; empty where the
    #: criterion does not need it
    share: Array
    #: (n, k), effect of an error of one sigma in every active value on the kept columns; empty as
    #: ``share``
    effect: Array
    points: Index  #: (p, 3), places of the named positions among the kept columns, -1 where held
    #: places of the scalars, and of the stations, whose correlations count
    parameters: Index
    partners: Index

    def value(self) -> float:
        """The criterion as it stands."""
        nothing = Blocks(
            number=np.zeros(1, dtype=np.int64),
            rows=np.zeros((1, 1, 1)),
            columns=np.full((1, 1), -1),
            leverage=np.zeros((1, 1)),
            line=np.full((1, 1), -1),
            determined=np.ones(1, dtype=bool),
        )
        return float(self.judge(nothing).value[0])

    def judge(self, blocks: Blocks, sign: int = 1) -> Scores:
        """Compute the criterion with each group come or gone; its values stay in the redundancy."""
        parts = [
            self._judge(blocks.take(np.arange(i, min(i + step, len(blocks)))), sign)
            for step in [self._step(blocks)]
            for i in range(0, len(blocks), step)
        ]
        value = np.concatenate([np.zeros(0), *(p.value for p in parts)])
        worse = np.concatenate([np.zeros(0), *(p.worse for p in parts)])
        return Scores(value, worse, np.concatenate([np.zeros(0), *(p.mean for p in parts)]))

    def _step(self, blocks: Blocks) -> int:
        """Groups that are judged at once."""
        k, w = blocks.rows.shape[1:]
        wide: int = {
            "sigma": self.points.size,
            "redundancy": len(self.share),
            "undetected": len(self.share) * (2 + self.points.size // 3 * 4),
            "correlation": len(self.parameters) * 8 + len(self.partners) * 8,
        }[self.criterion.kind]
        each = int(8 * (k * k + k * w + w * w + wide * (1 + max(k, w)) + 1))
        return max(1, _MEMORY // each)

    def _judge(self, blocks: Blocks, sign: int) -> Scores:
        """Scores of groups that are judged at once."""
        lower, possible = self._pivots(blocks, sign)
        kind = self.criterion.kind
        if kind == "sigma":
            value, mean = self._sigmas(blocks, lower, sign)
        elif kind == "correlation":
            value, mean = self._correlations(blocks, lower, sign)
        else:
            value, mean = self._reliability(blocks, lower, sign)
        value = np.where(possible & blocks.determined, value, np.nan)
        return Scores(value, -value if kind == "redundancy" else value, mean)

    def _pivots(self, blocks: Blocks, sign: int) -> tuple[Array, NDArray[np.bool_]]:
        """``L^-1`` (c, k, k) with ``S = L L^T``; False (c,) where S is not positive."""
        q = self._gather(blocks.columns[:, :, None], blocks.columns[:, None, :])
        form = blocks.rows @ q @ blocks.rows.transpose(0, 2, 1)
        k = form.shape[1]
        s = np.eye(k) + sign * (form + form.transpose(0, 2, 1)) / 2
        if sign > 0:
            return np.linalg.inv(np.linalg.cholesky(s)), np.ones(len(s), dtype=bool)
        value, vector = np.linalg.eigh(s)
        good = value[:, 0] > _SPARED
        root = np.sqrt(np.where(value > _SPARED, value, np.inf))
        return vector.transpose(0, 2, 1) / root[:, :, None], good

    @cached_property
    def _padded(self) -> Array:
        """The covariance with a last row and column of zeros, which the index -1 finds."""
        return np.pad(self.covariance, (0, 1))

    def _gather(self, i: Index, j: Index) -> Array:
        """Entries of the covariance, zero where an index is negative."""
        return np.asarray(self._padded[i, j])

    def _loads(self, blocks: Blocks, lower: Array, kept: Index) -> Array:
        """``L^-1 B Q`` (c, k, m) of kept columns (m,)."""
        q = self._padded[:, kept][blocks.columns]
        return np.asarray((lower @ blocks.rows) @ q)

    def _sigmas(self, blocks: Blocks, lower: Array, sign: int) -> tuple[Array, Array]:
        """Largest sigma (c,) at the named positions, and the mean of their variances."""
        c, p = len(blocks), len(self.points)
        # coordinates first, so that sums over rows run along memory
        load = self._loads(blocks, lower, self.points.T.ravel()).reshape(c, -1, 3, p)
        change = np.empty((c, p, 3, 3))
        for i in range(3):
            for j in range(i + 1):
                change[:, :, i, j] = np.einsum("ckp,ckp->cp", load[:, :, i], load[:, :, j])
                change[:, :, j, i] = change[:, :, i, j]
        now = self._gather(self.points[:, :, None], self.points[:, None, :])
        after = now - sign * change
        return largest_sigma(after).max(axis=1), np.einsum("cpii->c", after) / p

    def _correlations(self, blocks: Blocks, lower: Array, sign: int) -> tuple[Array, Array]:
        """Largest correlation (c,) of parameters with each other and stations, mean square."""
        own = len(self.parameters)
        both = np.concatenate([self.parameters, self.partners])
        load = self._loads(blocks, lower, both)
        after = self._gather(both[:own, None], both[None, :]) - sign * np.einsum(
            "cki,ckj->cij", load[:, :, :own], load, optimize=True
        )
        variance = self.covariance[both, both] - sign * np.einsum("cki,cki->ci", load, load)
        rho = after**2 / variance[:, :own, None] / variance[:, None, :]
        rho[:, np.arange(own), np.arange(own)] = 0.0
        return np.sqrt(rho.max(axis=(1, 2))), rho.mean(axis=(1, 2))

    def _reliability(self, blocks: Blocks, lower: Array, sign: int) -> tuple[Array, Array]:
        """Smallest redundancy or largest undetected effect (c,), and the mean of all values."""
        half = lower @ blocks.rows
        seen = np.where(blocks.columns[:, None, :] >= 0, half, 0.0)
        # f B^T L^-T (c, k, n)
        touch = seen @ self.effect[:, blocks.columns].transpose(1, 2, 0)
        share = self.share + sign * np.einsum("ckn,ckn->cn", touch, touch)
        gone = np.zeros(share.shape, dtype=bool)
        if sign < 0:
            group, row = np.nonzero(blocks.line >= 0)
            gone[group, blocks.line[group, row]] = True
        own = np.einsum("cki,cki->ci", lower, lower)
        own = np.where(blocks.line >= 0, own - blocks.leverage, 1.0)
        if self.criterion.kind == "redundancy":
            left = np.where(gone, 1.0, share)
            least = np.minimum(left.min(axis=1), own.min(axis=1)) if sign > 0 else left.min(axis=1)
            return least, -left.mean(axis=1)
        kept = self.points.ravel()
        load = self._loads(blocks, lower, kept)
        now = np.where(kept >= 0, self.effect[:, kept], 0.0)
        moved = now - sign * np.einsum("ckn,ckm->cnm", touch, load, optimize=True)
        worst = self._undetected(moved, share)
        worst = np.where(gone, 0.0, worst)
        if sign > 0:
            new = np.einsum("cki,ckm->cim", lower, load)
            worst = np.concatenate([worst, self._undetected(new, own)], axis=1)
        return worst.max(axis=1), worst.mean(axis=1)

    def _undetected(self, effect: Array, share: Array) -> Array:
        """Largest displacement (c, n) of a named position by an undetected error in each value."""
        c, n, m = effect.shape
        length = np.sqrt((effect.reshape(c, n, m // 3, 3) ** 2).sum(axis=3)).max(axis=2)
        return np.asarray(self.criterion.delta0 * length / np.sqrt(np.maximum(share, UNCONTROLLED)))

    def changed(self, blocks: Blocks, which: int, sign: int = 1) -> Prospect:
        """Let one group come or go.

        New values join the others; the values of a group that went keep their places, with a share
        of 1 and without effect.
        """
        one = blocks.take(np.array([which]))
        lower, _ = self._pivots(one, sign)
        used = one.columns[0] >= 0
        half = (lower @ one.rows)[0][:, used]
        columns = one.columns[0][used]
        load = half @ self.covariance[columns]
        covariance = self.covariance - sign * load.T @ load
        covariance = (covariance + covariance.T) / 2
        if len(self.share) == 0:
            return replace(self, covariance=covariance)
        touch = half @ self.effect[:, columns].T
        share = self.share + sign * (touch**2).sum(axis=0)
        effect = self.effect - sign * touch.T @ load
        line = one.line[0]
        if sign < 0:
            share[line[line >= 0]], effect[line[line >= 0]] = 1.0, 0.0
            return replace(self, covariance=covariance, share=share, effect=effect)
        real = line >= 0
        own = (lower[0] ** 2).sum(axis=0) - one.leverage[0]
        # whitened values: P v = v, their effect on the network is S^-1 B Q
        new = lower[0].T @ load
        return replace(
            self,
            covariance=covariance,
            share=np.concatenate([share, own[real]]),
            effect=np.concatenate([effect, new[real]]),
        )


def prospect(adjustment: Adjustment, criterion: Criterion, further: Index) -> Prospect:
    """Compute what is needed to judge groups that come to a predicted network or leave it."""
    _, points = position_columns(adjustment.layout, criterion.names)
    parameters, partners = np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    if criterion.kind == "correlation":
        parameters, partners = parameter_columns(adjustment.layout, criterion)
        if len(parameters) == 0:
            raise InputError(
                "there are no parameters whose correlations could be judged",
                cure="plan with calibration parameters, or choose another criterion",
            )
    wanted = np.concatenate([points.ravel(), parameters, partners, np.ravel(further)])
    wanted = np.unique(wanted[wanted >= 0])
    columns = wanted[adjustment.reduced[wanted] >= 0]
    system = weigh(adjustment)
    n = len(system.s) if criterion.kind in ("redundancy", "undetected") else 0
    if len(columns) > LARGEST or n * len(columns) > LARGEST_EFFECTS:
        raise InputError(
            f"the design has {len(columns)} unknowns that change with it"
            + (f" and {n} observed values" if n else ""),
            cure=f"plan at most {LARGEST} at once, or judge by the sigma",
        )
    root = np.sqrt(system.weight)
    rows, share = sp.csr_array(sp.diags_array(1 / root) @ system.rows), system.s / system.weight
    if criterion.kind == "redundancy":
        rows, share = redundancy_rows(system)
    covariance, effect = _dense(adjustment, columns, rows if n else None)
    place = np.full(adjustment.layout.size + 1, -1, dtype=np.int64)
    place[columns] = np.arange(len(columns))
    return Prospect(
        criterion=criterion,
        columns=columns,
        covariance=covariance,
        share=share if n else np.zeros(0),
        effect=effect,
        points=place[points],
        parameters=place[parameters][place[parameters] >= 0],
        partners=place[partners][place[partners] >= 0],
    )


def _dense(
    adjustment: Adjustment, columns: Index, rows: sp.csr_array | None
) -> tuple[Array, Array]:
    """Covariance (k, k) of columns and ``rows Q`` (n, k), some columns at a time."""
    index = adjustment.reduced[columns]
    covariance = np.empty((len(index), len(index)))
    count = 0 if rows is None else rows.shape[0]
    effect = np.empty((count, len(index)))
    for part in np.array_split(np.arange(len(index)), max(1, len(index) // 200)):
        unit = np.zeros((adjustment.n_unknowns, len(part)))
        unit[index[part], np.arange(len(part))] = 1.0
        solved = adjustment.cofactor.solve(unit)
        covariance[:, part] = solved[index]
        if rows is not None:
            effect[:, part] = rows @ solved
    return (covariance + covariance.T) / 2, effect
