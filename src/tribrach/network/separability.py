"""Names blunders that cannot be told from each other (method section 3.4).

Two test values that are strongly correlated rise together whichever of the two observations is
wrong. The correlation of w_i and w_j is ``S_ij / sqrt(S_ii S_jj)`` with ``S = P Q_vv P`` (Förstner
1983).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tribrach._types import Array, Index
from tribrach.network.network import Network
from tribrach.network.quality import Quality
from tribrach.network.reliability import (
    WeightedResiduals,
    correlations_of_tests,
    weigh,
)
from tribrach.network.solved import SolvedSystem
from tribrach.sentences import Sentence
from tribrach.statistics import largest_first

#: pairs above this correlation are named
LIMIT = 0.9
#: at most this many suspects are compared with all others
SUSPECTS = 50
#: observations that a sentence names
NAMED = 4


def confusable(adjustment: SolvedSystem, quality: Quality) -> list[str]:
    """A sentence for each suspicious value that could as well be another observation's error."""
    size = np.nan_to_num(np.abs(quality.w))
    suspicious = np.flatnonzero(size > quality.w_critical)
    suspicious = suspicious[largest_first(size[suspicious])][:SUSPECTS]
    if len(suspicious) == 0:
        return []
    other, suspect, rho = _beyond(weigh(adjustment), suspicious)
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


def partners(system: WeightedResiduals, row: int) -> tuple[str, ...]:
    """Observations in words whose tests are correlated beyond the limit with that of a row."""
    other, _, rho = _beyond(system, np.array([row]))
    order = largest_first(np.abs(rho))
    words = (describe_row(system.adjustment, int(r)) for r in other[order])
    return tuple(dict.fromkeys(words))


def describe_row(adjustment: SolvedSystem, row: int) -> str:
    """The observation that a row belongs to, in words."""
    rows = adjustment.rows
    o = adjustment.network.observations[rows.table[row]]
    return Network.describe(o, int(rows.item[row]), adjustment.state)


def _beyond(system: WeightedResiduals, chosen: Index) -> tuple[Index, Index, Array]:
    """Rows, chosen rows and correlations beyond the limit, between different observations."""
    rho = np.nan_to_num(correlations_of_tests(system, chosen))
    other, place = np.nonzero(np.abs(rho) > LIMIT)
    row, rows = chosen[place], system.adjustment.rows
    apart = (rows.table[other] != rows.table[row]) | (rows.item[other] != rows.item[row])
    return other[apart], row[apart], np.clip(rho[other, place], -1.0, 1.0)[apart]
