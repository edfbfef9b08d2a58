"""Which estimated unknowns are hard to tell apart? (method section 3.4)"""

from __future__ import annotations

import numpy as np

from tribrach.network.adjustment import Adjustment
from tribrach.report.content import CorrelationRow

__all__ = ["correlations"]

#: at most this many unknowns are compared, and this many pairs listed
MOST_UNKNOWNS = 1500
MOST_PAIRS = 300


def correlations(adjustment: Adjustment, limit: float = 0.7) -> tuple[CorrelationRow, ...]:
    """Pairs of unknowns other than point coordinates with ``|rho| > limit``, strongest first.

    Points are left out: how their coordinates go together shows in their ellipses. In networks
    with more than :data:`MOST_UNKNOWNS` such unknowns the list is empty.
    """
    layout = adjustment.layout
    columns = adjustment.free_columns
    chosen = np.flatnonzero(columns >= 3 * layout.count("point"))
    if len(chosen) < 2 or len(chosen) > MOST_UNKNOWNS:
        return ()
    unit = np.zeros((len(columns), len(chosen)))
    unit[chosen, np.arange(len(chosen))] = 1.0
    q = adjustment.cofactor.solve(unit)[chosen]
    sigma = np.sqrt(np.maximum(np.diag(q), 0.0))
    good = sigma > 1e-12 * sigma.max(initial=0.0)
    size = np.where(good, sigma, np.inf)
    rho = np.triu(q / np.outer(size, size), 1)
    i, j = np.nonzero(np.abs(rho) > limit)
    order = np.argsort(-np.abs(rho[i, j]))[:MOST_PAIRS]
    label = [layout.label(int(c)) for c in columns[chosen]]
    return tuple(
        CorrelationRow(label[a], label[b], float(rho[a, b]))
        for a, b in zip(i[order], j[order], strict=True)
    )
