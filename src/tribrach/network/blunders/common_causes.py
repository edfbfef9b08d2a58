"""Names mistakes that are one bias of several observations, before anything is switched off.

A wrong height of instrument sits in every sight of a set-up, a wrong height of
target in every sight to a prism, a target that was moved in all that one instrument saw of it. Each
cause i is a bias ``C_i b`` of the observations, and ``T_i = b^T (C^T P Q_vv P C) b`` is chi-square
of as many degrees of freedom if it is not there (Baarda 1968; method section 3.4). The most
improbable one is taken, what it explains is set aside, and the rest is tested again. Single
observations compete, so that a common cause is named only where it says more than its worst
observation does.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tribrach._types import Array, Index, Mask
from tribrach.network.adjustment import Adjustment
from tribrach.network.blunders.suspects import find_suspects
from tribrach.network.network import Network
from tribrach.network.reliability import weigh
from tribrach.network.significance import log_significance
from tribrach.observations.base import wrap
from tribrach.observations.declaration import End
from tribrach.observations.sights import Sights

__all__ = ["CommonCause", "common_causes"]

#: significance of all common causes together
_ALPHA = 0.001
#: rounds in which common causes are looked for, and single observations that compete in each
_ROUNDS, _SINGLE = 6, 40
#: causes whose logarithms of significance differ by less than this cannot be told apart
_ALIKE = 3.0
#: causes at most, and numbers at most in the columns of all of them
_MOST, _NUMBERS = 400, 8_000_000
#: step of numerical derivatives by a height [m]
_STEP = 1e-3
#: share of its own size that a bias must leave in the residuals to be tested
_UNSEEN = 1e-6


@dataclass(frozen=True)
class CommonCause:
    """A mistake that explains several observations.

    Attributes
    ----------
    words
        What is wrong.
    size : array (k,)
        What is to be added to it [m].
    sigma : array (k,)
        Standard deviation of the size [m].
    statistic
        T, chi-square of k degrees of freedom.
    rest
        ``v^T P v`` without it.
    alternatives
        Causes in words that explain as much.
    """

    words: str
    size: Array
    sigma: Array
    statistic: float
    rest: float
    alternatives: tuple[str, ...] = ()

    def sentence(self) -> str:
        """All of it in one sentence."""
        if len(self.size) == 1:
            side = "low" if self.size[0] > 0 else "high"
            much = f"{1e3 * abs(self.size[0]):.1f} mm ± {1e3 * self.sigma[0]:.1f} mm too {side}"
        else:
            parts = ", ".join(f"{a} {1e3 * x:+.1f}" for a, x in zip("ENU", self.size, strict=True))
            much = f"{1e3 * np.linalg.norm(self.size):.1f} mm ({parts} mm)"
        also = f"; it could as well be {' or '.join(self.alternatives)}" * bool(self.alternatives)
        return (
            f"Several observations are wrong in the way of one mistake: {self.words}, {much} "
            f"(test {self.statistic:.1f}, chi-square of {len(self.size)}){also}"
        )


@dataclass(frozen=True)
class _Cause:
    """Columns (n, k) of whitened observations; what they leave in the residuals (n, k)."""

    words: str
    common: bool
    columns: Array
    left: Array
    items: frozenset[tuple[int, int]]


def common_causes(adjustment: Adjustment) -> list[CommonCause]:
    """Find the mistakes that explain what is wrong, the clearest first.

    Parameters
    ----------
    adjustment
        The adjusted network.

    Returns
    -------
    list of CommonCause
        Empty for a network that fits.
    """
    if adjustment.dof < 2 or not find_suspects(weigh(adjustment)):
        return []
    causes = list(_Candidates(adjustment).all())
    limit = np.log(_ALPHA / max(len(causes), 1))
    residual, basis = adjustment.whitened_residuals, np.zeros((adjustment.n_observations, 0))
    named: list[CommonCause] = []
    for _ in range(_ROUNDS):
        tests = [_test(cause, residual, basis) for cause in causes]
        score = np.array([log_significance(t[0], t[1]) if t[1] else 0.0 for t in tests])
        best = int(np.argmin(score)) if len(score) else -1
        if best < 0 or score[best] > limit:
            break
        # what one observation explains nearly as well is no common cause
        alone = np.array([not cause.common for cause in causes])
        rival = int(np.argmin(np.where(alone, score, 0.0)))
        if alone[rival] and score[rival] < score[best] + _ALIKE:
            best = rival
        cause, (statistic, _, size, sigma) = causes[best], tests[best]
        basis = _joined(basis, cause.left)
        residual = adjustment.whitened_residuals
        residual = residual - basis @ (basis.T @ residual)
        if cause.common:
            close = np.flatnonzero(score < score[best] + _ALIKE)
            others = [causes[k] for k in close if k != best and causes[k].common]
            words = tuple(o.words for o in others if not o.items <= cause.items)[:3]
            rest = float(residual @ residual)
            named.append(CommonCause(cause.words, size, sigma, statistic, rest, words))
    return named


def _test(cause: _Cause, residual: Array, basis: Array) -> tuple[float, int, Array, Array]:
    """Statistic, degrees of freedom, bias (k,) and its sigma (k,), given what is set aside."""
    left = cause.left - basis @ (basis.T @ cause.left)
    scale = np.linalg.norm(cause.columns, axis=0)
    scale = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh((left / scale).T @ (left / scale))
    seen = values > _UNSEEN
    if not seen.any():
        return 0.0, 0, np.zeros(len(scale)), np.zeros(len(scale))
    inverse = (vectors[:, seen] / values[seen]) @ vectors[:, seen].T
    pull = (left / scale).T @ residual
    size: Array = -(inverse @ pull) / scale
    sigma = np.sqrt(np.diag(inverse)) / scale
    return float(pull @ inverse @ pull), int(seen.sum()), size, sigma


def _joined(basis: Array, columns: Array) -> Array:
    """An orthonormal basis of both."""
    u, s, _ = np.linalg.svd(np.hstack([basis, columns]), full_matrices=False)
    joined: Array = u[:, s > 1e-9 * s[0]]
    return joined


class _Candidates:
    """Causes that touch a suspicious observation."""

    def __init__(self, adjustment: Adjustment) -> None:
        self.adjustment, self.rows = adjustment, adjustment.rows
        self.system = weigh(adjustment)
        self.large: Mask = np.nan_to_num(np.abs(self.system.w)) > 2.0

    def all(self) -> Iterator[_Cause]:
        """Single observations, then common causes, at most so many."""
        yield from self._single()
        groups = sorted(
            [*self._heights(), *self._shifts()], key=lambda g: -int(self.large[g[1]].sum())
        )
        most = min(_MOST, max(_NUMBERS // max(len(self.large), 1), 10))
        for words, rows, columns in groups[:most]:
            yield self._cause(words, True, rows, columns)

    def _single(self) -> Iterator[_Cause]:
        """Whole observations that the tests reject."""
        most = min(_SINGLE, max(_NUMBERS // max(len(self.large), 1), 10))
        for suspect in find_suspects(self.system)[:most]:
            table, item = suspect.key
            inside = (self.rows.table == table) & (self.rows.item == item)
            unit = np.zeros((len(inside), int(inside.sum())))
            unit[np.flatnonzero(inside), np.arange(unit.shape[1])] = 1.0
            o = self.adjustment.network.observations[table]
            words = Network.describe(o, item, self.adjustment.state)
            yield self._cause(words, False, inside, self.adjustment.whitener @ unit)

    def _cause(self, words: str, common: bool, inside: Mask, columns: Array) -> _Cause:
        a = self.adjustment
        left = columns - a.design @ a.cofactor.solve(a.design.T @ columns)
        items = frozenset(zip(self.rows.table[inside].tolist(), self.rows.item[inside].tolist(),
                              strict=True))  # fmt: skip
        return _Cause(words, common, columns, left, items)

    def _heights(self) -> Iterator[tuple[str, Mask, Array]]:
        """Heights of instruments by set-up, of targets by set-up and at all."""
        name = self.adjustment.layout.position_name
        groups: dict[tuple[str, str], dict[int, Index]] = {}
        for table, o in enumerate(self.adjustment.network.observations):
            if not isinstance(o, Sights):
                continue
            hi, ht = np.round(o.height_instrument, 4), np.round(o.height_target, 4)
            keys = {
                "height_instrument": [
                    f"the height of instrument at {name(s)} ({h:.4f} m)"
                    for s, h in zip(o.start, hi, strict=True)
                ],
                "height_target": [
                    f"the height of target at {name(e)} ({h:.4f} m)" if h else ""
                    for e, h in zip(o.end, ht, strict=True)
                ],
            }
            for what, labels in keys.items():
                for label in dict.fromkeys(labels):
                    if label:
                        at = np.flatnonzero(np.array(labels, dtype=object) == label)
                        groups.setdefault((label, what), {})[table] = at
        for (words, what), members in groups.items():
            inside = self._rows_of(members)
            if self.large[inside].any():
                yield words, inside, self._by_height(what, members)

    def _rows_of(self, members: dict[int, Index]) -> Mask:
        """Rows (n,) of items by table."""
        inside = np.zeros(len(self.rows.table), dtype=bool)
        for table, items in members.items():
            inside |= (self.rows.table == table) & np.isin(self.rows.item, items)
        return inside

    def _by_height(self, what: str, members: dict[int, Index]) -> Array:
        """Whitened derivatives (n, 1) of some sights by a height that they share."""
        column = np.zeros((len(self.rows.table), 1))
        state = self.adjustment.state
        for table, items in members.items():
            o = self.adjustment.network.observations[table]
            higher = getattr(o, what) + _STEP
            change = replace(o, **{what: higher}).predict(state) - o.predict(state)
            for row in o.angular:
                change[:, row] = wrap(change[:, row])
            rows = np.flatnonzero((self.rows.table == table) & np.isin(self.rows.item, items))
            column[rows, 0] = change[self.rows.item[rows], self.rows.row[rows]] / _STEP
        whitened: Array = self.adjustment.whitener @ column
        return whitened

    def _shifts(self) -> Iterator[tuple[str, Mask, Array]]:
        """Places that total stations and scanners do not see as one."""
        observations = self.adjustment.network.observations
        by_sights: dict[int, dict[int, Index]] = {}
        by_scans: set[int] = set()
        for table, o in enumerate(observations):
            if isinstance(o, Sights):
                for end in np.unique(o.end):
                    by_sights.setdefault(int(end), {})[table] = np.flatnonzero(o.end == end)
            elif o.facts.names_target and (target := o.end_field(End.TO)) is not None:
                by_scans |= set(np.asarray(getattr(o, target.name)).tolist())
        layout = self.adjustment.layout
        for place in sorted(by_sights.keys() & by_scans):
            rows = self._rows_of(by_sights[place])
            columns = self.adjustment.reduced[layout.position_columns(np.array([place]))[0]]
            if (columns < 0).any() or not self.large[rows].any():
                continue
            part = self.adjustment.design[:, columns].toarray()
            part[~rows] = 0.0
            words = (
                f"target {layout.position_name(place)} is not in one place, total station less "
                "scanner"
            )
            yield words, rows, part
