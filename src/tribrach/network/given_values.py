"""Given values of a network, and what they have to do with its unknowns.

Two networks that use the same given values (control with one list of coordinates) share what these
are wrong by. Coordinates that either measured for itself are no control and are never shared,
however their digits fall. With l_s what both were given, and x the unknowns of either,

    cov(x_1, x_2) = cov(x_1, l_s) C_s^-1 cov(l_s, x_2),      cov(x, l) = Q A^T P C

which is exact to first order if nothing else is common to both (method section 12.4).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from tribrach._types import Array, Index
from tribrach.network.network import is_given
from tribrach.observations.base import Use
from tribrach.observations.declaration import Role

if TYPE_CHECKING:
    from tribrach.network.adjustment import Adjustment

#: given values are one where they agree to a nanometre
_DIGITS = 9


def given_rows(
    adjustment: Adjustment, roles: Collection[Role] = (Role.GIVEN, Role.PRIOR)
) -> dict[str, int]:
    """Rows of given values by kind, ends, component and value; measured coordinates are none."""
    network, rows = adjustment.network, adjustment.rows
    out: dict[str, int] = {}
    for table, o in enumerate(network.observations):
        facts = type(o).facts
        if facts.role not in roles or not (o.use == Use.ACTIVE).any():
            continue
        if facts.listed_as_control and not is_given(type(o), o.group):
            continue
        for row in np.flatnonzero(rows.table == table).tolist():
            item, part = int(rows.item[row]), int(rows.row[row])
            ident = network.ids[table][item].rsplit(":", 2)[0]
            values: Any = o.values
            value = float(values[item, part] if values.ndim > 1 else values[item])
            out[f"{type(o).kind} {ident} {part} {value:.{_DIGITS}f}"] = row
    return out


def with_given(adjustment: Adjustment, rows: Index, columns: Index) -> tuple[Array, Array]:
    """Covariance of unknowns with given values, and of these among themselves, a priori.

    Method section 12.4.

    ``rows`` (m,): of the given values among all observed values; ``columns`` (k,): of the full
    tangent vector. Returns ``cross`` (k, m): ``Q A^T P C``; zero where an unknown is fixed;
    ``covariance`` (m, m): C of the given values.
    """
    linked, whole = _correlated(adjustment, rows)
    right = adjustment.design.T @ adjustment.whitener[:, linked].toarray()
    solved = adjustment.cofactor.solve(np.asarray(right))
    place = adjustment.reduced[columns]
    gains = np.where((place >= 0)[:, None], solved[place], 0.0)
    at = np.searchsorted(linked, rows)
    covariance: Array = whole[np.ix_(at, at)]
    return gains @ whole[:, at], (covariance + covariance.T) / 2


def common_values(
    first: Sequence[str], one: Array, second: Sequence[str], two: Array
) -> tuple[Index, Index]:
    """Which given values two results share: of one name and value, with one covariance.

    Points are shared whose every component is alike, and only if half of what both were given is:
    lists that agree in a few numbers are different lists.

    ``first``, ``second``: what was given to either, as the keys of :func:`given_rows`; ``one``,
    ``two`` (m1, m1): covariances of both. Returns rows of the first and of the second, in one
    order; no rows where their correlations differ.
    """
    there = {key: k for k, key in enumerate(second)}
    pairs = [(k, there[key]) for k, key in enumerate(first) if key in there]
    # the same value with another sigma is not one and the same information
    pairs = [(i, j) for i, j in pairs if np.isclose(one[i, i], two[j, j], rtol=1e-6, atol=0)]
    found = np.array(_of_one_list(first, second, pairs), dtype=np.int64).reshape(-1, 2)
    i, j = found.T
    a, b = one[np.ix_(i, i)], two[np.ix_(j, j)]
    scale = np.sqrt(np.outer(np.diag(a), np.diag(a)))
    if not (np.abs(a - b) <= 1e-6 * scale).all():
        return i[:0], j[:0]
    return i, j


def _of_one_list(
    first: Sequence[str], second: Sequence[str], pairs: list[tuple[int, int]]
) -> list[tuple[int, int]]:
    """Pairs of alike values whose points are alike as a whole, in lists that agree."""
    values = [Counter(map(_owner, keys)) for keys in (first, second)]
    alike = Counter(_owner(first[i]) for i, _ in pairs)
    whole = {name for name, n in alike.items() if n == values[0][name] == values[1][name]}
    if 2 * len(whole) < len(values[0].keys() & values[1].keys()):
        return []
    return [(i, j) for i, j in pairs if _owner(first[i]) in whole]


def _owner(key: str) -> str:
    """The point or parameter that a key of :func:`given_rows` belongs to."""
    words = key.split(" ")
    return words[1].partition(":")[2] if len(words) > 1 else key


def through_given(first: Array, second: Array, covariance: Array) -> Array:
    """Covariance (k1, k2) of unknowns of two networks through what both were given.

    Method section 12.4.

    ``first``, ``second`` (k1, m): covariances of the unknowns with the m given values that both
    share; ``covariance`` (m, m): of these values.
    """
    if not len(covariance):
        return np.zeros((len(first), len(second)))
    scale = np.sqrt(np.diag(covariance))
    # coordinates held without any uncertainty carry none over
    some = scale > 0
    unit = covariance[np.ix_(some, some)] / np.outer(scale[some], scale[some])
    one, two = (side[:, some] / scale[some] for side in (first, second))
    out: Array = one @ np.linalg.pinv(unit, rcond=1e-12, hermitian=True) @ two.T
    return out


def _correlated(adjustment: Adjustment, rows: Index) -> tuple[Index, Array]:
    """All values that correlate with some rows, and their covariance, from ``W C W^T = I``."""
    w = adjustment.whitener
    linked = np.unique(rows)
    while True:
        touched = np.unique(w[:, linked].nonzero()[0])
        wider = np.unique(w[touched].nonzero()[1])
        if len(wider) == len(linked):
            break
        linked = np.union1d(linked, wider)
    block = w[touched][:, linked].toarray()
    return linked, np.linalg.inv(block.T @ block)
