"""Says what else would explain a misfit as well as the observation with the largest test.

A test value is large wherever the error of another observation reaches. Before an observation is
switched off, every other one, and every coordinate that is held without error, is asked whether it
would do (method section 3.4). It would if

* the two tests are correlated by more than 0.9, or
* its error is nearly as probable, and with it the first observation no longer fails.

It is no rival where both would lead to the same coordinates: of the two directions of a set-up,
either takes the same angle away. Less correlated tests may differ by a sigma there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from tribrach._types import Array, Index
from tribrach.network.adjustment import Adjustment
from tribrach.network.blunders.suspects import Key, Suspect, find_suspects
from tribrach.network.given_coordinates import coordinate_words, given_coordinates
from tribrach.network.network import Network, is_given
from tribrach.network.reliability import WeightedResiduals, correlations_of_tests, weigh
from tribrach.network.separability import LIMIT
from tribrach.network.significance import log_significance
from tribrach.observations.declaration import End

#: explanations whose logarithms of significance differ by less than this cannot be told apart
ALIKE = 3.0
#: observations that are asked, the most correlated and the most improbable first
_ASKED = 24
#: displacements that differ by less than this share are the same
_SAME = 0.1
#: share of a bias that must be left in the residuals to be tested at all
_SEEN = 1e-7
#: tests that are correlated by more than this are one test
_ONE = 0.999
#: the median of the size of a standard normal value
_MEDIAN = 0.6745


@dataclass(frozen=True)
class Rivals:
    """What would explain a misfit as well as one observation, and what depends on the choice."""

    words: tuple[str, ...]  #: in words, the most correlated first
    keys: tuple[Key, ...]  #: (table, item) of those that are observations
    #: points and stations that the error moves by more than their sigma, those that it moves most
    #: first
    touched: tuple[str, ...]

    def __bool__(self) -> bool:
        return bool(self.words)


def rivals_of(adjustment: Adjustment, suspect: Suspect) -> Rivals:
    """Everything else that explains what a suspect does."""
    system = weigh(adjustment)
    rho = np.nan_to_num(correlations_of_tests(system, np.array([suspect.row]))[:, 0])
    candidates = _candidates(system, suspect, np.abs(rho))
    rows = [_rows_of(system, suspect.key), *(c.rows for c in candidates)]
    causes = _Causes(adjustment, rows)
    held = causes.held
    unit = _unit(system, suspect, rho)
    own = float(log_significance(suspect.chi_square / unit, suspect.freedom))
    words: list[str] = []
    keys: list[Key] = []
    members, one_test = [0], False
    for number in range(1, causes.count):
        size, freedom = causes.test(number)
        near = freedom > 0 and float(log_significance(size / unit, freedom)) < own + ALIKE
        alike = causes.correlation(number) > LIMIT
        enough = near and causes.test_beside(number) <= suspect.critical_chi_square * unit
        place = number - 1 - len(candidates)
        given = candidates[number - 1].given if place < 0 else -1
        if (alike or enough) and not causes.same_place(number, given, sigmas=not alike):
            members.append(number)
            one_test |= alike
            words.append(candidates[number - 1].words if place < 0 else held[place])
            keys += [candidates[number - 1].key] if place < 0 else []
    touched = causes.touched(members)
    if not (touched or one_test):
        return Rivals((), (), ())
    return Rivals(tuple(dict.fromkeys(words)), tuple(keys), touched)


@dataclass(frozen=True)
class _Candidate:
    """Another observation that is asked."""

    words: str
    key: Key
    rows: Index
    given: int  #: the position that it gives, -1 for what is measured


def _candidates(system: WeightedResiduals, suspect: Suspect, rho: Array) -> list[_Candidate]:
    """The other observations that could be rivals."""
    rows, network = system.adjustment.rows, system.adjustment.network
    order = np.argsort(-rho, kind="stable")
    partners = order[rho[order] > LIMIT][: 4 * _ASKED]
    keys: dict[Key, None] = {(int(rows.table[r]), int(rows.item[r])): None for r in partners}
    keys = dict.fromkeys(list(keys)[: _ASKED + 1])
    keys.update((s.key, None) for s in find_suspects(system)[: _ASKED + 1])
    keys.pop(suspect.key, None)
    out = []
    for t, i in keys:
        o = network.observations[t]
        at = o.end_field(End.AT) if is_given(type(o), o.group) else None
        position = -1 if at is None else int(np.asarray(getattr(o, at.name))[i])
        words = Network.describe(o, i, system.adjustment.state)
        out.append(_Candidate(words, (t, i), _rows_of(system, (t, i)), position))
    return out


def _rows_of(system: WeightedResiduals, key: Key) -> Index:
    """Rows of an observation."""
    rows = system.adjustment.rows
    out: Index = np.flatnonzero((rows.table == key[0]) & (rows.item == key[1]))
    return out


def _unit(system: WeightedResiduals, suspect: Suspect, rho: Array) -> float:
    """Variance of unit weight that most test values show beside the suspect, at least one."""
    other = system.controlled & (np.abs(rho) < _ONE)
    w = (system.w[other] - rho[other] * system.w[suspect.row]) / np.sqrt(1 - rho[other] ** 2)
    return max(1.0, float(np.median(np.abs(w)) / _MEDIAN) ** 2) if len(w) else 1.0


class _Causes:
    """Errors of some observations, and of coordinates that are held, as biases side by side."""

    def __init__(self, adjustment: Adjustment, groups: Sequence[Index]) -> None:
        own = sp.csc_array(adjustment.whitener)[:, np.concatenate(groups)]
        given = given_coordinates(adjustment)
        chosen = [k for k in np.flatnonzero(given.controlled) if given.items[k].held]
        columns = sp.csc_array(sp.hstack([own, given.columns[:, chosen]]))
        #: coordinates that are held, in words
        self.held = [coordinate_words([given.items[k]]) for k in chosen]
        self._adjustment = adjustment
        size = np.sqrt(np.asarray(columns.multiply(columns).sum(axis=0)).ravel())
        columns = columns @ sp.diags_array(1 / np.where(size > 0, size, 1.0))
        seen = (adjustment.design.T @ columns).toarray()
        self._effect = adjustment.cofactor.solve(seen)
        self._left: Array = (columns.T @ columns).toarray() - seen.T @ self._effect
        self._pull: Array = columns.T @ adjustment.whitened_residuals
        ends = np.cumsum([0, *(len(g) for g in groups), *([1] * len(chosen))])
        self._members = [np.arange(a, b) for a, b in pairwise(ends)]
        self._place = adjustment.reduced[
            adjustment.layout.position_columns(np.arange(len(adjustment.state.positions)))
        ]

    @property
    def count(self) -> int:
        """The number of causes; the first is the suspect."""
        return len(self._members)

    def test(self, number: int) -> tuple[float, int]:
        """Chi-square of a cause and its degrees of freedom."""
        inverse, rank = self._inverse(self._members[number])
        pull = self._pull[self._members[number]]
        return float(pull @ inverse @ pull), rank

    def test_beside(self, number: int) -> float:
        """Chi-square of the first cause if another one is wrong as well."""
        other = self._members[number]
        both = np.concatenate([self._members[0], other])
        with_both, alone = self._inverse(both)[0], self._inverse(other)[0]
        pull, rest = self._pull[both], self._pull[other]
        return float(pull @ with_both @ pull - rest @ alone @ rest)

    def correlation(self, number: int) -> float:
        """The largest correlation of tests of a cause with those of the first one."""
        root = np.sqrt(np.maximum(np.diag(self._left), _SEEN))
        i, j = self._members[0], self._members[number]
        return float(np.abs(self._left[np.ix_(i, j)] / np.outer(root[i], root[j])).max())

    def same_place(self, number: int, given: int, *, sigmas: bool) -> bool:
        """True if a cause moves all positions as the first one does, but for the one it gives.

        To a share of the displacement, or to the sigmas of the positions.
        """
        own, other = self._displacement(0), self._displacement(number)
        if given >= 0:
            own[given] = other[given] = 0.0
        if sigmas and (np.linalg.norm(own - other, axis=1) <= self._sigma).all():
            return True
        largest = max(np.abs(own).max(initial=0.0), np.abs(other).max(initial=0.0))
        return bool(np.abs(own - other).max(initial=0.0) <= _SAME * largest)

    def touched(self, members: Sequence[int]) -> tuple[str, ...]:
        """Positions that one of some causes moves by more than their sigma."""
        moved = np.zeros(len(self._place))
        for number in members:
            moved = np.maximum(moved, np.linalg.norm(self._displacement(number), axis=1))
        order = np.argsort(-moved, kind="stable")
        chosen = [int(k) for k in order if moved[k] > self._sigma[k]]
        return tuple(self._adjustment.layout.position_name(k) for k in chosen)

    @cached_property
    def _sigma(self) -> Array:
        """Standard deviations of the positions (P,) [m]."""
        covariance = self._adjustment.position_covariances()
        out: Array = np.sqrt(np.maximum(np.trace(covariance, axis1=1, axis2=2), 0.0))
        return out

    def _displacement(self, number: int) -> Array:
        """What a cause moves the positions by (P, 3) [m]."""
        members = self._members[number]
        error = self._inverse(members)[0] @ self._pull[members]
        # a last row of zeros stands for the components that are fixed
        shift = np.append(self._effect[:, members] @ error, 0.0)
        out: Array = shift[self._place]
        return out

    def _inverse(self, members: Index) -> tuple[Array, int]:
        """Inverse and rank of the information that the residuals have on biases."""
        values, vectors = np.linalg.eigh(self._left[np.ix_(members, members)])
        seen = values > _SEEN
        return (vectors[:, seen] / values[seen]) @ vectors[:, seen].T, int(seen.sum())
