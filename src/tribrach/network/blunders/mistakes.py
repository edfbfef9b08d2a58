"""Names blunders that sit in several observations at once, before anything is switched off.

Common causes: a wrong height of instrument sits in every sight of a set-up, a wrong height of
target in every sight to a prism, a target that was moved in all that one instrument saw of it. Each
cause i is a bias ``C_i b`` of the observations, and ``T_i = b^T (C^T P Q_vv P C) b`` is chi-square
of as many degrees of freedom if it is not there (Baarda 1968; method section 3.4). The most
improbable one is taken, what it explains is set aside, and the rest is tested again. Single
observations compete, so that a common cause is named only where it says more than its worst
observation does.

Exchanged names: two names that changed places put two targets metres away at once; tests of single
observations cannot tell which pair it was, since everything around is distorted. The network is
adjusted again with each pair exchanged; the pair without which it fits is the answer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from tribrach._types import Array, Index, Mask
from tribrach.errors import InputError, NotConverged, TribrachError
from tribrach.network.adjustment import Adjustment, Options, adjust
from tribrach.network.blunders.snooping import switch
from tribrach.network.blunders.suspects import find_suspects
from tribrach.network.network import Network
from tribrach.network.reliability import weigh
from tribrach.network.significance import log_significance
from tribrach.observations.base import Observations, Use, wrap
from tribrach.observations.declaration import End
from tribrach.observations.sights import Sights

__all__ = ["common_causes", "first_adjustment", "mistakes", "swapped_names"]

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
#: networks that fit worse than this many times their sigmas are searched for exchanged names
_GROSS = 5.0
#: pairs of names that are tried, and iterations of each attempt
_MOST_SWAPS, _ITERATIONS = 60, 15
#: share of the variance factor that may be left without an exchange, or without one observation
_LEFT = 0.05


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


@dataclass(frozen=True)
class SwappedNames:
    """Two targets whose names were exchanged at a set-up.

    Attributes
    ----------
    setup
        Name of the set-up.
    first, second
        The two names.
    before
        Variance factor with the names as they are, infinite if the network could not be
        adjusted.
    after
        Variance factor with the names exchanged.
    network
        The network with the names exchanged.
    """

    setup: str
    first: str
    second: str
    before: float
    after: float
    network: Network

    def sentence(self) -> str:
        """The finding in one sentence."""
        fits = f"sigma0 falls from {np.sqrt(self.before):.1f} to {np.sqrt(self.after):.2f}"
        if not np.isfinite(self.before):
            fits = f"the network can be adjusted, with sigma0 {np.sqrt(self.after):.2f}"
        return (
            f"The names {self.first} and {self.second} are exchanged at {self.setup}: with them "
            f"the other way round {fits}"
        )


def _hurried(network: Network) -> Adjustment:
    """An adjustment that soon gives up: with the right names few iterations are needed."""
    return adjust(network, options=Options(max_iterations=_ITERATIONS))


def swapped_names(
    network: Network,
    adjustment: Adjustment | None = None,
    run: Callable[[Network], Adjustment] = _hurried,
) -> SwappedNames | None:
    """Find the exchange of two names that makes a network fit.

    Parameters
    ----------
    network
        The network.
    adjustment
        Of the network as it is, None if it could not be adjusted.
    run
        Adjusts a network; gives up soon, since with the right names few iterations are needed.

    Returns
    -------
    SwappedNames or None
        None if no exchange makes the network fit, or it fits already.
    """
    before = np.inf if adjustment is None else adjustment.posterior_factor
    if not before > _GROSS**2 or (adjustment is not None and _one_alone(adjustment, run)):
        return None
    best: SwappedNames | None = None
    for setup, first, second in _pairs(network, adjustment):
        changed = _exchanged(network, setup, first, second)
        try:
            after = run(changed).posterior_factor
        except TribrachError:
            continue
        if after < (_LEFT * before if best is None else best.after):
            name = network.start.layout.position_name
            best = SwappedNames(name(setup), name(first), name(second), before, after, changed)
            if after < 2.0:
                break
    return best


def _one_alone(adjustment: Adjustment, run: Callable[[Network], Adjustment]) -> bool:
    """True if the network fits without its worst observation: then that one was misread."""
    suspects = find_suspects(weigh(adjustment))
    if not suspects:
        return True
    try:
        rest = run(switch(adjustment.network, *suspects[0].key, Use.OFF, "tried without it"))
    except TribrachError:
        return False
    return rest.posterior_factor < _LEFT * adjustment.posterior_factor


def _ends(o: Observations, points: int) -> tuple[Index, Index, str] | None:
    """Positions (n,) of set-up and target, and the field of the target."""
    start, end = o.end_field(End.FROM), o.end_field(End.TO)
    if not o.facts.names_target or start is None or end is None:
        return None
    setup = np.asarray(getattr(o, start.name)) + (points if start.family == "pose" else 0)
    return setup, np.asarray(getattr(o, end.name)), end.name


def _pairs(network: Network, adjustment: Adjustment | None) -> Iterator[tuple[int, int, int]]:
    """Set-up and two targets (positions), the most suspicious pairs first."""
    points = network.start.layout.count("point")
    worst: dict[tuple[int, int], float] = {}
    w = None if adjustment is None else np.nan_to_num(np.abs(weigh(adjustment).w))
    for table, o in enumerate(network.observations):
        ends = _ends(o, points)
        if ends is None:
            continue
        size = np.zeros(len(o))
        if adjustment is not None and w is not None:
            rows = adjustment.rows.table == table
            np.maximum.at(size, adjustment.rows.item[rows], w[rows])
        for k in np.flatnonzero(o.use == Use.ACTIVE):
            key = (int(ends[0][k]), int(ends[1][k]))
            worst[key] = max(worst.get(key, 0.0), float(size[k]))
    setups: dict[int, list[int]] = {}
    for setup, target in worst:
        setups.setdefault(setup, []).append(target)
    pairs = [
        (min(worst[setup, p], worst[setup, q]), setup, p, q)
        for setup, targets in setups.items()
        for p, q in combinations(targets, 2)
    ]
    pairs.sort(key=lambda pair: -pair[0])
    return ((setup, p, q) for _, setup, p, q in pairs[:_MOST_SWAPS])


def _exchanged(network: Network, setup: int, first: int, second: int) -> Network:
    """The network with two targets exchanged in all that was observed from a set-up."""
    points = network.start.layout.count("point")
    changed = []
    for o in network.observations:
        ends = _ends(o, points)
        if ends is None:
            changed.append(o)
            continue
        start, target, field = ends
        swapped = np.where(target == first, second, np.where(target == second, first, target))
        further: dict[str, Any] = {field: np.where(start == setup, swapped, target)}
        changed.append(replace(o, **further))
    return replace(network, observations=tuple(changed))


_CURE = "correct the names in the file"


def first_adjustment(network: Network) -> Adjustment:
    """Adjust a network as it is.

    Parameters
    ----------
    network
        The network.

    Returns
    -------
    Adjustment
        Nothing is switched off.

    Raises
    ------
    InputError
        It does not converge because two names are exchanged.
    AdjustmentError
        It cannot be adjusted for another reason.
    """
    try:
        return adjust(network)
    except NotConverged as error:
        exchange = swapped_names(network)
        if exchange is None:
            raise
        raise InputError(exchange.sentence(), cure=_CURE) from error


def mistakes(adjustment: Adjustment) -> list[str]:
    """Mistakes that explain several bad observations each, in sentences."""
    swapped = swapped_names(adjustment.network, adjustment)
    if swapped is not None:
        return [swapped.sentence()]
    return [cause.sentence() for cause in common_causes(adjustment)]
