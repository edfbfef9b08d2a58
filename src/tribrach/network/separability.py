"""Names blunders that cannot be told from each other (method section 3.4).

Two test values that are strongly correlated rise together whichever of the two observations is
wrong. The correlation of w_i and w_j is ``S_ij / sqrt(S_ii S_jj)`` with ``S = P Q_vv P`` (Förstner
1983).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.network.network import Network
from tribrach.network.quality import Quality
from tribrach.network.reliability import (
    WeightedResiduals,
    correlations_of_tests,
    solutions_affordable,
    weigh,
)
from tribrach.network.solved import SolvedSystem
from tribrach.sentences import Sentence
from tribrach.statistics import largest_first

#: pairs above this correlation are named
LIMIT = 0.9
#: weights correlated beyond this a priori are looked at whatever their redundancy
TIED = 0.3
#: rows compared with all others at a time
BATCH = 200
#: at most this many suspects are compared with all others
SUSPECTS = 50
#: observations that a sentence names
NAMED = 4


@dataclass(frozen=True)
class ConfusablePair:
    """Two values whose tests are strongly correlated."""

    #: rows of the adjustment
    first: int
    second: int
    correlation: float  #: of their test values


@dataclass(frozen=True)
class Separability:
    """Pairs of values of different observations, the strongest correlation first."""

    #: (k,), rows of the adjustment
    first: Index
    second: Index
    correlation: Array  #: (k,), correlation of their test values
    #: false where only the least controlled values of a large network were compared with all
    #: others
    complete: bool

    def __len__(self) -> int:
        return len(self.first)

    def __iter__(self) -> Iterator[ConfusablePair]:
        pairs = zip(self.first, self.second, self.correlation, strict=True)
        return (ConfusablePair(int(a), int(b), float(rho)) for a, b, rho in pairs)


def separability(adjustment: SolvedSystem, limit: float = LIMIT) -> Separability:
    """Find pairs of values with ``|rho| > limit``; components of one vector are no pairs.

    With ``m = S_ii / P_ii``, values that are uncorrelated a priori have ``rho^2 <= (1 - m_i) /
    m_j``, so every pair beyond the limit has a member with ``m < 1 / (1 + limit^2)``. Only those,
    and values correlated a priori, meet all others.
    """
    system = weigh(adjustment)
    share = np.where(system.controlled, system.s / system.weight, np.inf)
    weak = (share < 1 / (1 + limit**2)) | (system.controlled & _tied(system))
    candidates = np.flatnonzero(weak)
    candidates = candidates[np.argsort(share[candidates], kind="stable")]
    most = solutions_affordable(adjustment)
    chosen = candidates[:most]
    parts = np.array_split(chosen, max(1, len(chosen) // BATCH))
    blocks = [_beyond(system, part, limit) for part in parts]
    first, second, rho = (np.concatenate(part) for part in zip(*blocks, strict=True))
    low, high = np.minimum(first, second), np.maximum(first, second)
    _, once = np.unique(np.stack([low, high]), axis=1, return_index=True)
    once = once[largest_first(np.abs(rho[once]))]
    return Separability(low[once], high[once], rho[once], len(candidates) <= most)


def confusable(adjustment: SolvedSystem, quality: Quality, limit: float = LIMIT) -> list[str]:
    """A sentence for each suspicious value that could as well be another observation's error."""
    size = np.nan_to_num(np.abs(quality.w))
    suspicious = np.flatnonzero(size > quality.w_critical)
    suspicious = suspicious[largest_first(size[suspicious])][:SUSPECTS]
    if len(suspicious) == 0:
        return []
    other, suspect, rho = _beyond(weigh(adjustment), suspicious, limit)
    pairs: dict[tuple[int, int], float] = {}
    # a sight that is alone in seeing a mark says of its centring what it says of itself
    shared = [o.facts.nuisance for o in adjustment.network.observations]
    of_readings = ~np.array(shared, dtype=bool)[adjustment.rows.table]
    for a, b, value in zip(suspect, other, rho, strict=True):
        if not (of_readings[a] and of_readings[b]):
            continue
        pairs.setdefault((int(min(a, b)), int(max(a, b))), float(value))
    return [_alike(adjustment, group, pairs) for group in _groups(pairs)]


def _groups(pairs: Mapping[tuple[int, int], float]) -> list[list[int]]:
    """Rows that hang together by pairs, those with the strongest pair first."""
    groups: list[set[int]] = []
    for pair in sorted(pairs, key=lambda one: -abs(pairs[one])):
        touched = [group for group in groups if group & set(pair)]
        groups = [group for group in groups if group not in touched]
        groups.append(set(pair).union(*touched))
    return [sorted(group) for group in groups]


def _alike(
    adjustment: SolvedSystem, group: Sequence[int], pairs: Mapping[tuple[int, int], float]
) -> str:
    """Rows whose tests say the same, in a sentence."""
    words = list(dict.fromkeys(describe_row(adjustment, row) for row in group))
    if len(words) <= 2:
        value = max((v for pair, v in pairs.items() if set(pair) <= set(group)), key=abs)
        return Sentence(
            "cannot tell whether {words} is wrong: their test values have the correlation "
            "{value:+2}",
            words=" or ".join(words),
            value=value,
        )
    most = f" and {len(words) - NAMED} more" if len(words) > NAMED else ""
    least = min(abs(v) for pair, v in pairs.items() if set(pair) <= set(group))
    return Sentence(
        "cannot tell which of {words} is wrong, {words2}{most}: their test values are "
        "correlated by {least:2} or more",
        words=len(words),
        words2="; ".join(words[:NAMED]),
        most=most,
        least=least,
    )


def partners(system: WeightedResiduals, row: int, limit: float = LIMIT) -> tuple[str, ...]:
    """Observations in words whose tests are correlated beyond the limit with that of a row."""
    other, _, rho = _beyond(system, np.array([row]), limit)
    order = largest_first(np.abs(rho))
    words = (describe_row(system.adjustment, int(r)) for r in other[order])
    return tuple(dict.fromkeys(words))


def describe_row(adjustment: SolvedSystem, row: int) -> str:
    """The observation that a row belongs to, in words."""
    rows = adjustment.rows
    o = adjustment.network.observations[rows.table[row]]
    return Network.describe(o, int(rows.item[row]), adjustment.state)


def _beyond(system: WeightedResiduals, chosen: Index, limit: float) -> tuple[Index, Index, Array]:
    """Rows, chosen rows and correlations beyond the limit, between different observations."""
    rho = np.nan_to_num(correlations_of_tests(system, chosen))
    other, place = np.nonzero(np.abs(rho) > limit)
    row, rows = chosen[place], system.adjustment.rows
    apart = (rows.table[other] != rows.table[row]) | (rows.item[other] != rows.item[row])
    return other[apart], row[apart], np.clip(rho[other, place], -1.0, 1.0)[apart]


def _tied(system: WeightedResiduals) -> NDArray[np.bool_]:
    """Rows (n,) whose weights are correlated with those of another observation."""
    out = np.zeros(len(system.s), dtype=bool)
    if system.adjustment.assembly.joint_whitener is None:
        return out
    whitener = system.adjustment.whitener
    root = sp.diags_array(1 / np.sqrt(system.weight))
    unit = sp.coo_array(root @ (whitener.T @ whitener) @ root)
    strong = (np.abs(unit.data) > TIED) & (unit.row != unit.col)
    out[unit.row[strong]] = True
    return out
