"""Tests of whole observations that have several values: vectors, targets, relative poses.

``T = y^T S^+ y`` with ``y = E^T P v`` and ``S = E^T P Q_vv P E`` is chi-square with as many degrees
of freedom as the block has directions that the other observations control (method section 3.4).
The eigenvalues of S against ``E^T P E`` are those directions' redundancies; they say which are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach.distributions import chi2
from tribrach.network.reliability import WeightedResiduals
from tribrach.network.significance import block_noncentrality

__all__ = ["BlockTests", "block_tests", "joint_tests"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: redundancy of a direction that counts as controlled
CONTROLLED = 1e-7
#: largest joint covariance that is tested as one block
LARGEST_JOINT = 300


@dataclass(frozen=True)
class BlockTests:
    """Chi-square tests of blocks.

    table, item (b,) say which observations (for joint covariances: table -1 and the number of the
    covariance); freedom (b,) degrees of freedom, redundancy (b,) trace of the block's part of R;
    statistic (b,), NaN where nothing controls the block; critical (b,) limit at alpha0;
    gross_error (b,) length of the estimated error and mdb (b,) of the longest error that may stay
    undetected, in any direction [m], NaN unless all values are lengths and all are controlled.
    """

    table: Index
    item: Index
    freedom: Index
    redundancy: Array
    statistic: Array
    critical: Array
    gross_error: Array
    mdb: Array

    @property
    def rejected(self) -> NDArray[np.bool_]:
        """Blocks (b,) beyond their limit."""
        return np.nan_to_num(self.statistic) > self.critical

    @classmethod
    def join(cls, parts: list[BlockTests]) -> BlockTests:
        """All blocks of several sets, in their order."""
        whole = ("table", "item", "freedom")
        empty = {name: np.empty(0, dtype=np.int64) for name in whole}
        return cls(
            **{
                name: np.concatenate(
                    [empty.get(name, np.empty(0)), *(getattr(part, name) for part in parts)]
                )
                for name in cls.__dataclass_fields__
            }
        )


def block_tests(system: WeightedResiduals, alpha0: float = 0.001, power: float = 0.8) -> BlockTests:
    """Test every active observation that has several values as a whole."""
    rows = system.adjustment.rows
    parts = []
    for number, o in enumerate(system.adjustment.network.observations):
        mine = np.flatnonzero(rows.table == number)
        if o.rows == 1 or len(mine) == 0:
            continue
        block = mine.reshape(-1, o.rows)
        table, item = np.full(len(block), number), rows.item[block[:, 0]]
        metric = set(o.units) == {"m"}
        parts.append(_tests(system, block, table, item, metric, alpha0, power))
    return BlockTests.join(parts)


def joint_tests(system: WeightedResiduals, alpha0: float = 0.001, power: float = 0.8) -> BlockTests:
    """Test the active values of each joint covariance (a GNSS session, say) as a whole."""
    adjustment = system.adjustment
    rows, tables = adjustment.rows, adjustment.network.observations
    first = np.cumsum([0] + [o.values.size for o in tables])
    width = np.array([o.rows for o in tables])
    number = np.full(first[-1], -1, dtype=np.int64)
    number[first[rows.table] + rows.item * width[rows.table] + rows.row] = np.arange(len(rows))
    parts = []
    for k, joint in enumerate(adjustment.network.joint):
        mine = number[first[joint.table] + joint.item * width[joint.table] + joint.row]
        mine = mine[mine >= 0]
        if 0 < len(mine) <= LARGEST_JOINT:
            units = {tables[t].units[r] for t, r in zip(joint.table, joint.row, strict=True)}
            table, item = np.array([-1]), np.array([k])
            parts.append(_tests(system, mine[None], table, item, units == {"m"}, alpha0, power))
    return BlockTests.join(parts)


def _tests(
    system: WeightedResiduals,
    block: Index,
    table: Index,
    item: Index,
    metric: bool,
    alpha0: float,
    power: float,
) -> BlockTests:
    """Tests of blocks of rows (b, m)."""
    m = block.shape[1]
    p, s = _gram(system, block)
    # S in the metric of P: eigenvalues are redundancies between 0 and 1
    inverse = np.linalg.inv(np.linalg.cholesky(p))
    unit = inverse @ s @ inverse.transpose(0, 2, 1)
    value, vector = np.linalg.eigh((unit + unit.transpose(0, 2, 1)) / 2)
    good = value > CONTROLLED
    safe = np.where(good, value, 1.0)
    along = np.einsum("bij,bi->bj", vector, np.einsum("bij,bj->bi", inverse, system.pull[block]))
    along = np.where(good, along, 0.0)
    freedom = good.sum(axis=1)
    statistic = np.where(freedom > 0, (along**2 / safe).sum(axis=1), np.nan)
    error = np.einsum("bji,bj->bi", inverse, np.einsum("bij,bj->bi", vector, along / safe))
    whole = metric & (freedom == m)
    return BlockTests(
        table=table,
        item=item,
        freedom=freedom,
        redundancy=value.sum(axis=1),
        statistic=statistic,
        critical=np.where(freedom > 0, chi2.ppf(1 - alpha0, np.maximum(freedom, 1)), np.inf),
        gross_error=np.where(whole, np.sqrt((error**2).sum(axis=1)), np.nan),
        mdb=_longest(s, whole, block_noncentrality(m, alpha0, power)),
    )


def _longest(s: Array, whole: NDArray[np.bool_], delta0: float) -> Array:
    """Longest error with ``g^T S g = delta0^2`` (b,) where the block is wholly controlled."""
    out = np.full(len(s), np.nan)
    if whole.any():
        out[whole] = delta0 / np.sqrt(np.linalg.eigvalsh(s[whole])[:, 0])
    return out


def _gram(system: WeightedResiduals, block: Index) -> tuple[Array, Array]:
    """``E^T P E`` and ``E^T P Q_vv P E`` (b, m, m) of blocks of rows (b, m)."""
    b, m = block.shape
    whitener = sp.csc_array(system.adjustment.whitener)
    p, form = np.empty((b, m, m)), np.empty((b, m, m))
    if b == 1:
        mine = system.rows[block[0]]
        p[0] = (whitener[:, block[0]].T @ whitener[:, block[0]]).toarray()
        form[0] = mine @ system.adjustment.cofactor.solve(mine.toarray().T)
        return p, p - form
    forms = system.adjustment.cofactor.row_forms
    single = [system.weight[block[:, k]] - system.s[block[:, k]] for k in range(m)]
    for i in range(m):
        for j in range(i, m):
            mine, other = whitener[:, block[:, i]], whitener[:, block[:, j]]
            p[:, i, j] = p[:, j, i] = np.asarray(mine.multiply(other).sum(axis=0)).ravel()
            if i == j:
                form[:, i, i] = single[i]
                continue
            both = sp.csr_array(system.rows[block[:, i]] + system.rows[block[:, j]])
            cross = (forms(both) - single[i] - single[j]) / 2
            form[:, i, j] = form[:, j, i] = cross
    return p, p - form
