"""Which blunders cannot be told from each other? (method section 3.4)

Two test values that are strongly correlated rise together whichever of the two observations is
wrong. The correlation of w_i and w_j is ``S_ij / sqrt(S_ii S_jj)`` with ``S = P Q_vv P``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach.network.adjustment import Adjustment
from tribrach.network.network import Network
from tribrach.network.quality import UNCONTROLLED, Quality

__all__ = ["SIZE_LIMIT", "Pair", "confusable", "separability"]

Array = NDArray[np.float64]

#: networks with more values than this are not looked through
SIZE_LIMIT = 3000


@dataclass(frozen=True)
class Pair:
    """Two rows of the adjustment whose test values have this correlation."""

    first: int
    second: int
    correlation: float


def separability(adjustment: Adjustment, limit: float = 0.9) -> tuple[Pair, ...] | None:
    """Pairs of single values with ``|rho| > limit``, strongest first; None above the size limit.

    Values of one observation (a vector's components) are not paired with each other.
    """
    n = adjustment.n_observations
    if n > SIZE_LIMIT or adjustment.dof <= 0:
        return None if adjustment.dof > 0 else ()
    whitener = adjustment.whitener
    weighted = sp.csr_array(whitener.T @ adjustment.design).toarray()
    weights = sp.csr_array(whitener.T @ whitener).toarray()
    s = weights - weighted @ adjustment.cofactor.solve(weighted.T)
    diagonal = np.diag(s)
    good = diagonal > UNCONTROLLED * np.diag(weights)
    scale = np.where(good, 1 / np.sqrt(np.where(good, diagonal, 1.0)), 0.0)
    rho = np.triu(s * scale[:, None] * scale, 1)
    rows = adjustment.rows
    same = (rows.table[:, None] == rows.table) & (rows.item[:, None] == rows.item)
    rho[same] = 0.0
    first, second = np.nonzero(np.abs(rho) > limit)
    order = np.argsort(-np.abs(rho[first, second]))
    return tuple(
        Pair(int(first[k]), int(second[k]), float(rho[first[k], second[k]])) for k in order
    )


def confusable(adjustment: Adjustment, quality: Quality, limit: float = 0.9) -> list[str]:
    """A sentence for each suspicious value that could as well be another observation's error."""
    suspicious = np.nan_to_num(np.abs(quality.w)) > quality.w_critical
    if not suspicious.any():
        return []
    rows, network = adjustment.rows, adjustment.network

    def words(row: int) -> str:
        o = network.observations[rows.table[row]]
        return Network.describe(o, int(rows.item[row]), adjustment.state)

    return [
        f"cannot tell whether {words(pair.first)} or {words(pair.second)} is wrong: their test "
        f"values have the correlation {pair.correlation:+.2f}"
        for pair in separability(adjustment, limit) or ()
        if suspicious[pair.first] or suspicious[pair.second]
    ]
