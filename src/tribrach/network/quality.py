"""How far can the result be trusted? Global test, redundancy, blunder tests, reliability.

All figures are in the general form for correlated observations (method section 3.4; Baarda 1968,
Pope 1976): with ``P`` the weights, ``Pv`` the weighted residuals and ``S = P Q_vv P``,

* ``w = (Pv)_i / sqrt(S_ii)``, standard normal without blunders;
* ``tau = w / sigma0_posterior``;
* estimated gross error ``g = -(Pv)_i / S_ii`` (for ``l = true + g``);
* minimal detectable bias ``delta0 / sqrt(S_ii)``;
* redundancy number ``r_i = (Q_vv P)_ii``; their sum is the redundancy.

Nothing of size n x n is formed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.stats import chi2, norm, t

from tribrach.network.adjustment import Adjustment

__all__ = [
    "BlockTests",
    "GlobalTest",
    "Quality",
    "assess",
    "noncentrality",
    "redundancy_class",
    "sidak",
    "tau_critical",
]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: redundancy numbers below this leave an observation without any control
UNCONTROLLED = 1e-8


def noncentrality(alpha0: float = 0.001, power: float = 0.8) -> float:
    """``delta0``: shift of w found with the given power at significance ``alpha0``; 4.132."""
    return float(norm.ppf(1 - alpha0 / 2) + norm.ppf(power))


def tau_critical(dof: int, alpha: float) -> float:
    """Two-sided critical value of Pope's tau with redundancy ``dof`` at significance ``alpha``.

    ``t sqrt(r) / sqrt(r - 1 + t^2)`` with t of r - 1 degrees of freedom; sqrt(r) is its bound.
    """
    if dof < 2:
        return float(np.sqrt(max(dof, 0)))
    quantile = t.ppf(1 - alpha / 2, dof - 1)
    return float(quantile * np.sqrt(dof) / np.sqrt(dof - 1 + quantile**2))


def sidak(alpha: float, count: int) -> float:
    """Significance of one of ``count`` tests so that all together have ``alpha``."""
    return float(1 - (1 - alpha) ** (1 / max(count, 1)))


def redundancy_class(r: float) -> str:
    """A redundancy number in words: uncontrolled, poor, weak, good, very good."""
    for limit, word in ((0.01, "uncontrolled"), (0.1, "poor"), (0.3, "weak"), (0.7, "good")):
        if r < limit:
            return word
    return "very good"


@dataclass(frozen=True)
class GlobalTest:
    """Chi-square test of the a-priori sigma0.

    lower and upper are the two-sided limits of ``v^T P v``; only exceeding the upper one rejects,
    since a too small value means cautious sigmas and no blunder.
    """

    vtpv: float
    dof: int
    alpha: float
    lower: float
    upper: float

    @property
    def passed(self) -> bool | None:
        """None without redundancy."""
        return None if self.dof <= 0 else self.vtpv <= self.upper

    def sentence(self) -> str:
        """The verdict in words."""
        if self.dof <= 0:
            return "no redundancy: nothing is checked"
        limits = f"{self.vtpv:.2f} against {self.lower:.2f} to {self.upper:.2f}"
        level = f"at {100 * (1 - self.alpha):g} % with redundancy {self.dof}"
        if self.vtpv > self.upper:
            return f"the global test fails ({limits} {level}): blunders, or sigmas too small"
        if self.vtpv < self.lower:
            return f"the global test passes ({limits} {level}); the sigmas look too large"
        return f"the global test passes ({limits} {level})"


@dataclass(frozen=True)
class BlockTests:
    """Tests of whole observations with several values (vectors, targets, poses).

    table, item (b,) say which; statistic (b,) is chi-square with ``width`` (b,) degrees of
    freedom, critical (b,) its limit at alpha0; NaN where the block is not controlled.
    """

    table: Index
    item: Index
    width: Index
    statistic: Array
    critical: Array


@dataclass(frozen=True)
class Quality:
    """Quality figures; arrays (n,) are in the order of ``adjustment.rows``.

    mdb and gross_error are in the unit of the value (metres or radians); external (n,) is the
    largest displacement [m] of any position that an undetected error of size MDB causes,
    external_position (n,) the position index where; ``external_exact`` is False where only the
    observation's own ends were looked at (large networks).
    """

    global_test: GlobalTest
    redundancy: Array
    w: Array
    tau: Array
    gross_error: Array
    mdb: Array
    external: Array
    external_position: Index
    external_exact: bool
    blocks: BlockTests
    w_critical: float
    tau_critical: float
    alpha0: float
    power: float
    confidence: float

    @property
    def controlled(self) -> NDArray[np.bool_]:
        """Values (n,) that the others control at all."""
        return np.isfinite(self.w)


#: networks up to this many values times unknowns get their external reliability everywhere
EXACT_LIMIT = 30_000_000


def assess(
    adjustment: Adjustment,
    *,
    alpha: float = 0.05,
    alpha0: float = 0.001,
    power: float = 0.8,
    confidence: float = 0.95,
) -> Quality:
    """Quality of an adjustment.

    alpha : significance of the global test; alpha0, power : of the single blunder test;
    confidence : of ellipses and intervals derived from it.
    """
    whitener = adjustment.whitener
    weighted = sp.csr_array(whitener.T @ adjustment.design)
    pull = whitener.T @ adjustment.whitened_residuals
    weight = np.asarray(whitener.multiply(whitener).sum(axis=0)).ravel()
    s = weight - adjustment.cofactor.row_forms(weighted)
    redundancy = _redundancy(adjustment, weighted, weight)
    good = s > UNCONTROLLED * weight
    safe = np.where(good, s, 1.0)
    w = np.where(good, pull / np.sqrt(safe), np.nan)
    factor = adjustment.posterior_factor
    delta0 = noncentrality(alpha0, power)
    mdb = np.where(good, delta0 / np.sqrt(safe), np.nan)
    external, where, exact = _external(adjustment, weighted, mdb)
    return Quality(
        global_test=global_test(adjustment, alpha),
        redundancy=redundancy,
        w=w,
        tau=w / np.sqrt(factor) if factor > 0 else np.full(len(w), np.nan),
        gross_error=np.where(good, -pull / safe, np.nan),
        mdb=mdb,
        external=external,
        external_position=where,
        external_exact=exact,
        blocks=block_tests(adjustment, weighted, pull, alpha0),
        w_critical=float(norm.ppf(1 - alpha0 / 2)),
        tau_critical=tau_critical(adjustment.dof, alpha0),
        alpha0=alpha0,
        power=power,
        confidence=confidence,
    )


def global_test(adjustment: Adjustment, alpha: float = 0.05) -> GlobalTest:
    """Test of ``v^T P v`` against its redundancy."""
    dof = adjustment.dof
    if dof <= 0:
        return GlobalTest(adjustment.vtpv, dof, alpha, 0.0, np.inf)
    lower, upper = (float(chi2.ppf(p, dof)) for p in (alpha / 2, 1 - alpha / 2))
    return GlobalTest(adjustment.vtpv, dof, alpha, lower, upper)


def _redundancy(adjustment: Adjustment, weighted: sp.csr_array, weight: Array) -> Array:
    """``r_i = 1 - A_i Q (P A)_i^T`` (n,)."""
    plain = adjustment.assembly.joint_whitener is None and all(
        o.rows == 1 for o in adjustment.network.observations
    )
    forms = adjustment.cofactor.row_forms
    if plain:
        return 1 - forms(adjustment.design)
    # bilinear forms by polarisation, both rows brought to the same size
    root = sp.diags_array(np.sqrt(weight))
    raw = root @ adjustment.assembly.design(adjustment.state, whitened=False)
    other = sp.diags_array(1 / np.sqrt(weight)) @ weighted
    total, difference = sp.csr_array(raw + other), sp.csr_array(raw - other)
    return 1 - (forms(total) - forms(difference)) / 4


def _external(
    adjustment: Adjustment, weighted: sp.csr_array, mdb: Array
) -> tuple[Array, Index, bool]:
    """Largest displacement of a position by an undetected error in each value."""
    n, u = weighted.shape
    if n * u > EXACT_LIMIT:
        return (*_external_at_ends(adjustment, weighted, mdb), False)
    layout = adjustment.layout
    columns = layout.position_columns(np.arange(len(adjustment.state.positions)))
    place = adjustment.reduced[columns]
    largest, where = np.zeros(n), np.zeros(n, dtype=np.int64)
    for part in np.array_split(np.arange(n), max(1, n // 500)):
        shift = adjustment.cofactor.solve(weighted[part].toarray().T) * np.nan_to_num(mdb[part])
        shift = np.vstack([shift, np.zeros((1, len(part)))])[place]
        length = np.sqrt((shift**2).sum(axis=1))
        where[part] = length.argmax(axis=0)
        largest[part] = length.max(axis=0)
    return np.where(np.isfinite(mdb), largest, np.nan), where, True


def _external_at_ends(
    adjustment: Adjustment, weighted: sp.csr_array, mdb: Array
) -> tuple[Array, Index]:
    """The same, looked for among the positions that each value touches."""
    layout = adjustment.layout
    positions = len(adjustment.state.positions)
    owner = np.full(layout.size, -1, dtype=np.int64)
    columns = layout.position_columns(np.arange(positions))
    owner[columns] = np.arange(positions)[:, None]
    owner = owner[adjustment.free_columns]
    n = weighted.shape[0]
    largest, where = np.zeros(n), np.zeros(n, dtype=np.int64)
    count = np.diff(weighted.indptr)
    for width in np.unique(count[count > 0]):
        rows = np.flatnonzero(count == width)
        place = weighted.indptr[rows][:, None] + np.arange(width)
        cols = weighted.indices[place].astype(np.int64)
        shift = np.einsum("nij,nj->ni", adjustment.cofactor.blocks(cols), weighted.data[place])
        mine = owner[cols]
        same = (mine[:, :, None] == mine[:, None, :]) & (mine >= 0)[:, :, None]
        length = np.sqrt(np.einsum("nij,nj->ni", same, shift**2))
        best = length.argmax(axis=1)
        line = np.arange(len(rows))
        where[rows] = np.maximum(mine[line, best], 0)
        largest[rows] = length[line, best] * np.nan_to_num(mdb[rows])
    return np.where(np.isfinite(mdb), largest, np.nan), where


def block_tests(
    adjustment: Adjustment, weighted: sp.csr_array, pull: Array, alpha0: float
) -> BlockTests:
    """Test every observation that has several values as a whole.

    ``T = (E^T P v)^T (E^T S E)^-1 (E^T P v)`` is chi-square; its degrees of freedom are the
    number of values.
    """
    rows = adjustment.rows
    tables, items, widths, statistics = [], [], [], []
    for number, o in enumerate(adjustment.network.observations):
        mine = np.flatnonzero(rows.table == number)
        if o.rows == 1 or len(mine) == 0:
            continue
        block = mine.reshape(-1, o.rows)
        tables.append(np.full(len(block), number))
        items.append(rows.item[block[:, 0]])
        widths.append(np.full(len(block), o.rows))
        statistics.append(_block_statistics(adjustment, weighted, pull, block))
    if not tables:
        empty = np.empty(0, dtype=np.int64)
        return BlockTests(empty, empty, empty, np.empty(0), np.empty(0))
    width = np.concatenate(widths)
    return BlockTests(
        np.concatenate(tables),
        np.concatenate(items),
        width,
        np.concatenate(statistics),
        np.asarray(chi2.ppf(1 - alpha0, width), dtype=float),
    )


def _block_statistics(
    adjustment: Adjustment, weighted: sp.csr_array, pull: Array, block: Index
) -> Array:
    """Statistics (b,) of blocks of rows (b, m)."""
    m = block.shape[1]
    whitener = sp.csc_array(adjustment.whitener)
    gram = np.empty((len(block), m, m))
    forms = adjustment.cofactor.row_forms
    single = [forms(sp.csr_array(weighted[block[:, k]])) for k in range(m)]
    for i in range(m):
        for j in range(i, m):
            mine, other = whitener[:, block[:, i]], whitener[:, block[:, j]]
            p = np.asarray(mine.multiply(other).sum(axis=0)).ravel()
            both = sp.csr_array(weighted[block[:, i]] + weighted[block[:, j]])
            cross = single[i] if i == j else (forms(both) - single[i] - single[j]) / 2
            gram[:, i, j] = gram[:, j, i] = p - cross
    size = np.sqrt(np.abs(np.einsum("bii->bi", gram)))
    size[size == 0] = 1.0
    unit = gram / size[:, :, None] / size[:, None, :]
    good = np.linalg.eigvalsh(unit)[:, 0] > 1e-7
    unit[~good] = np.eye(m)
    y = pull[block] / size
    statistic = np.einsum("bi,bi->b", y, np.linalg.solve(unit, y[:, :, None])[:, :, 0])
    return np.where(good, statistic, np.nan)
