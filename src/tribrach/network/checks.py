"""What do the adjusted unknowns say about values that did not take part?

For a value held out (or switched off) ``d = h(x) - l`` has the covariance ``C + A Q A^T``; a
difference beyond it tells of an error in the value or in the network.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach.distributions import chi2
from tribrach.network.adjustment import Adjustment
from tribrach.network.blocks import BlockTests
from tribrach.network.observations.base import Observations, Use

__all__ = ["check_covariances", "check_tests", "prediction_statistics"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]


def check_covariances(adjustment: Adjustment, o: Observations, items: Index) -> Array:
    """Covariance (k, rows, rows) of ``h(x) - l`` for values held out: ``C + A Q A^T``."""
    own = o.covariance[items]
    if len(items) == 0:
        return own
    design = _design(adjustment, o, items)
    out = own.copy()
    n, rows = len(items), o.rows
    for part in np.array_split(np.arange(n), max(1, n // 200)):
        mine = design[(part[:, None] * rows + np.arange(rows)).ravel()]
        form = mine @ adjustment.cofactor.solve(mine.toarray().T)
        local = np.arange(len(part) * rows).reshape(-1, rows)
        out[part] += form[local[:, :, None], local[:, None, :]]
    return out


def _design(adjustment: Adjustment, o: Observations, items: Index) -> sp.csr_array:
    """Derivatives (k * rows, u) of chosen observations by the free columns."""
    n, rows = len(items), o.rows
    data, line, columns = [], [], []
    for block in o.jacobian(adjustment.state):
        place = np.where(block.columns < 0, -1, adjustment.reduced[block.columns])[items]
        values = block.values[items]
        row = np.arange(n * rows).reshape(n, rows, 1)
        row, place = (np.broadcast_to(a, values.shape) for a in (row, place[:, None, :]))
        keep = place >= 0
        data.append(values[keep])
        line.append(row[keep])
        columns.append(place[keep])
    triple = (np.concatenate(data), (np.concatenate(line), np.concatenate(columns)))
    return sp.csr_array(sp.coo_array(triple, shape=(n * rows, adjustment.n_unknowns)))


def prediction_statistics(adjustment: Adjustment, o: Observations, items: Index) -> Array:
    """``d^T (C + A Q A^T)^-1 d`` (k,), chi-square with as many degrees of freedom as rows.

    Correlations with values that took part (joint covariances) are not used.
    """
    difference = o.misclosure(adjustment.state)[items]
    covariance = check_covariances(adjustment, o, items)
    # lengths and angles together: to unit diagonal first
    size = np.sqrt(np.einsum("kii->ki", covariance))
    unit = covariance / size[:, :, None] / size[:, None, :]
    d = difference / size
    statistic: Array = np.einsum("ki,ki->k", d, np.linalg.solve(unit, d[:, :, None])[:, :, 0])
    return statistic


def check_tests(adjustment: Adjustment, alpha0: float = 0.001) -> BlockTests:
    """Test of every observation held out as a check against what the network predicts for it."""
    parts = []
    for table, o in enumerate(adjustment.network.observations):
        items = np.flatnonzero(o.use == Use.CHECK)
        if len(items) == 0:
            continue
        unknown = np.full(len(items), np.nan)
        freedom = np.full(len(items), o.rows)
        parts.append(
            BlockTests(
                table=np.full(len(items), table),
                item=items,
                freedom=freedom,
                redundancy=unknown,
                statistic=prediction_statistics(adjustment, o, items),
                critical=np.asarray(chi2.ppf(1 - alpha0, freedom), dtype=float),
                gross_error=unknown,
                mdb=unknown,
            )
        )
    return BlockTests.join(parts)
