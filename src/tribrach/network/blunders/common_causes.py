"""Names mistakes that are one bias of several observations, before anything is switched off.

A wrong height of instrument sits in every sight of a set-up, a wrong height of
target in every sight to a prism, a target that was moved in all that one instrument saw of it. Each
cause i is a bias ``C_i b`` of the observations, and ``T_i = b^T (C^T P Q_vv P C) b`` is chi-square
of as many degrees of freedom if it is not there (Baarda 1968; method section 3.4). The most
improbable one is taken, what it explains is set aside, and the rest is tested again. Single
observations compete, so that a common cause is named only where it says more than its worst
observation does.

A set-up that is wrong stands out of the others. Where all of them are a little wrong in the same
way, as when repeated readings share errors that their sigmas count as independent, none is: causes
are measured at the scatter of the causes of their sort, and what is then no mistake is told as one
pattern.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from tribrach._types import Array, Index, Mask
from tribrach.network.adjustment import Adjustment
from tribrach.network.blunders.clearing import fits
from tribrach.network.blunders.suspects import find_suspects
from tribrach.network.network import Network
from tribrach.network.reliability import weigh
from tribrach.network.significance import log_significance, sidak
from tribrach.observations.base import wrap
from tribrach.observations.declaration import End
from tribrach.observations.sights import Sights
from tribrach.statistics import chi2

__all__ = ["CommonCause", "CommonCauses", "Pattern", "common_causes"]

#: significance of all common causes together
_ALPHA = 0.001
#: rounds in which common causes are looked for, and single observations that compete in each
_ROUNDS, _SINGLE = 6, 40
#: causes whose logarithms of significance differ by less than this cannot be told apart
_ALIKE = 3.0
#: causes at most, and numbers at most in the columns of all of them
_MOST, _NUMBERS = 400, 8_000_000
#: what errors of a sort have in common where nearly all are off
_HEIGHTS, _TARGETS = "heights of instruments", "heights of targets"
_PLACES = "places of targets between total station and scanner"
_SHARED = {
    _HEIGHTS: (
        "refraction, heights that nobody measured, or an axis and a prism of unlike height in one "
        "tribrach"
    ),
    _TARGETS: "refraction, or a rod or prism whose height is not what its label says",
    _PLACES: "an offset between what the two instruments see as the centre of a target",
}
#: causes of one sort from which on their scatter is known
_SCATTER = 4
#: scatter of causes from which on it is told
_WIDE = 1.5
#: redundancy below which a network must fit without the causes that are named
_REDUNDANT = 15
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
    given
        False for a height that nobody gave: it cannot be too low.
    """

    words: str
    size: Array
    sigma: Array
    statistic: float
    rest: float
    alternatives: tuple[str, ...] = ()
    given: bool = True

    def sentence(self) -> str:
        """All of it in one sentence."""
        if not self.given:
            size, sigma = 1e3 * self.size[0], 1e3 * self.sigma[0]
            much = f"its sights fit with {size:+.1f} mm ± {sigma:.1f} mm"
        elif len(self.size) == 1:
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
class Pattern:
    """Causes of one sort that many set-ups or targets have a little of, and none for itself.

    Attributes
    ----------
    sort
        What would have to be changed.
    count
        How many causes of the sort there are.
    scatter
        Their robust scatter in their own sigmas; 1 is chance.
    middle, largest
        Median and largest of their absolute sizes [m].
    same_sign
        How many of those with one size have the more frequent sign.
    worst
        The clearest of them in words, at most three.
    """

    sort: str
    count: int
    scatter: float
    middle: float
    largest: float
    same_sign: int
    worst: tuple[str, ...]

    def sentence(self) -> str:
        """All of it in one sentence."""
        sign = f", {self.same_sign} of {self.count} with the same sign" * bool(self.same_sign)
        return (
            f"The observations would fit better with other {self.sort} in most cases, by "
            f"{1e3 * self.middle:.1f} mm in the middle and {1e3 * self.largest:.1f} mm at most"
            f"{sign}: {self.scatter:.1f} times what their sigmas say, most at "
            f"{', '.join(self.worst)}. Where so many are off, none of them is shown to be a "
            f"mistake: what they share may be {_SHARED[self.sort]}, and readings that were "
            "repeated share it too, though their sigmas count them as independent. Look for it, or "
            "give these observations larger sigmas; until then such heights and places are less "
            "certain than their standard deviations say"
        )


@dataclass(frozen=True)
class CommonCauses:
    """What was found.

    Attributes
    ----------
    named
        Mistakes, the clearest first.
    pattern
        What is no mistake of one set-up or target; of several sorts the one that scatters most.
    """

    named: tuple[CommonCause, ...] = ()
    pattern: Pattern | None = None


@dataclass(frozen=True)
class _Cause:
    """Columns (n, k) of whitened observations; what they leave in the residuals (n, k)."""

    words: str
    columns: Array
    left: Array
    items: frozenset[tuple[int, int]]
    sort: str = ""
    place: str = ""
    given: bool = True

    @property
    def common(self) -> bool:
        """True if it is no single observation."""
        return bool(self.sort)


def common_causes(adjustment: Adjustment) -> CommonCauses:
    """Find the mistakes that explain what is wrong, the clearest first.

    Parameters
    ----------
    adjustment
        The adjusted network.

    Returns
    -------
    CommonCauses
        Empty for a network that fits.
    """
    if adjustment.dof < 2 or not find_suspects(weigh(adjustment)):
        return CommonCauses()
    candidates = _Candidates(adjustment)
    causes = list(candidates.all())
    limit = float(np.log(sidak(_ALPHA, candidates.count)))
    residual, basis = adjustment.whitened_residuals, np.zeros((adjustment.n_observations, 0))
    taken: list[int] = []
    similar: dict[int, tuple[str, ...]] = {}
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
        taken.append(best)
        basis = _joined(basis, causes[best].left)
        residual = _without(adjustment.whitened_residuals, basis)
        close = np.flatnonzero(score < score[best] + _ALIKE)
        others = [causes[k] for k in close if k != best and causes[k].common]
        similar[best] = tuple(o.words for o in others if not o.items <= causes[best].items)[:3]
    return _Judgement(adjustment, causes, limit, taken).done(similar)


class _Judgement:
    """Which of the causes that explain much stand out of the others of their sort."""

    def __init__(
        self, adjustment: Adjustment, causes: list[_Cause], limit: float, taken: list[int]
    ) -> None:
        self.adjustment, self.causes, self.limit = adjustment, causes, limit
        self.taken = taken

    def done(self, similar: dict[int, tuple[str, ...]]) -> CommonCauses:
        """Mistakes, and the patterns of those that are none."""
        standing, refused = list(self.taken), list[int]()
        while True:
            tests = self._tests(standing)
            rows = self._rows(standing)
            scale = {
                sort: max(1.0, rows, self._scatter(sort, standing, tests))
                for sort in {self.causes[k].sort for k in standing}
            }
            score = {
                k: float(log_significance(tests[k][0] / scale[self.causes[k].sort], tests[k][1]))
                if tests[k][1]
                else 0.0
                for k in standing
                if self.causes[k].common
            }
            # a cause that does not stand out is one of the others, which then scatter more
            weakest = max(score, key=lambda k: score[k], default=None)
            if weakest is None or score[weakest] <= self.limit:
                break
            standing.remove(weakest)
            refused.append(weakest)
        named = []
        residual, basis = self.adjustment.whitened_residuals, self._basis([])
        for k in (k for k in self.taken if k in standing):
            cause = self.causes[k]
            statistic, _, size, sigma = _test(cause, _without(residual, basis), basis)
            basis = _joined(basis, cause.left)
            rest = float(np.square(_without(residual, basis)).sum())
            if cause.common:
                also = similar.get(k, ())
                named.append(
                    CommonCause(cause.words, size, sigma, statistic, rest, also, cause.given)
                )
        fitting = self._fits(basis)
        # with little redundancy, readings that are set aside as well make anything fit
        few = self.adjustment.dof < _REDUNDANT
        if few and not self._fits(self._basis([k for k in standing if self.causes[k].common])):
            return CommonCauses()
        # in a network that does not fit other mistakes may scatter these causes
        sorts = dict.fromkeys(self.causes[k].sort for k in refused if fitting)
        patterns = [self._pattern(s, standing) for s in sorts]
        told = [p for p in patterns if p.scatter > _WIDE]
        return CommonCauses(tuple(named), max(told, key=lambda p: p.scatter, default=None))

    def _fits(self, basis: Array) -> bool:
        """True if the network passes its global test without what a basis explains."""
        rest = _without(self.adjustment.whitened_residuals, basis)
        return fits(float(rest @ rest), self.adjustment.dof - basis.shape[1])

    def _basis(self, chosen: list[int]) -> Array:
        """An orthonormal basis of some causes."""
        basis = np.zeros((self.adjustment.n_observations, 0))
        return _joined(basis, np.hstack([self.causes[k].left for k in chosen])) if chosen else basis

    def _tests(self, standing: list[int]) -> list[tuple[float, int, Array, Array]]:
        """Every cause, given those that stand, of which it may be one."""
        residual, basis = self.adjustment.whitened_residuals, self._basis(standing)
        tests = [_test(cause, _without(residual, basis), basis) for cause in self.causes]
        for k in standing:
            others = self._basis([m for m in standing if m != k])
            tests[k] = _test(self.causes[k], _without(residual, others), others)
        return tests

    def _scatter(
        self, sort: str, standing: list[int], tests: list[tuple[float, int, Array, Array]]
    ) -> float:
        """Robust variance factor of the other causes of a sort; 1 for too few of them."""
        ratio = [
            tests[k][0] / float(chi2.ppf(0.5, tests[k][1]))
            for k, cause in enumerate(self.causes)
            if cause.sort == sort and k not in standing and tests[k][1]
        ]
        return float(np.median(ratio)) if len(ratio) >= _SCATTER else 1.0

    def _rows(self, standing: list[int]) -> float:
        """Robust variance factor of all residuals if the rest does not fit, else 1."""
        adjustment, basis = self.adjustment, self._basis(standing)
        if self._fits(basis):
            return 1.0
        residual = _without(adjustment.whitened_residuals, basis)
        left = 1 - adjustment.cofactor.row_forms(adjustment.design) - np.square(basis).sum(axis=1)
        seen = left > _UNSEEN
        ratio = np.square(residual[seen]) / left[seen]
        return float(np.median(ratio) / chi2.ppf(0.5, 1)) if len(ratio) else 1.0

    def _pattern(self, sort: str, standing: list[int]) -> Pattern:
        """All causes of a sort but those that are mistakes."""
        tests = self._tests(standing)
        members = [
            k for k, c in enumerate(self.causes) if c.sort == sort and k not in standing
            and tests[k][1]
        ]  # fmt: skip
        size = np.array([np.linalg.norm(tests[k][2]) for k in members])
        single = [float(tests[k][2][0]) for k in members if len(tests[k][2]) == 1]
        positive = sum(x > 0 for x in single)
        worst = sorted(members, key=lambda k: -tests[k][0])[:3]
        return Pattern(
            sort=sort,
            count=len(members),
            scatter=float(np.sqrt(self._scatter(sort, standing, tests))),
            middle=float(np.median(size)),
            largest=float(size.max()),
            same_sign=max(positive, len(single) - positive),
            worst=tuple(self.causes[k].place for k in worst),
        )


def _without(residual: Array, basis: Array) -> Array:
    """Residuals without what a basis explains."""
    out: Array = residual - basis @ (basis.T @ residual)
    return out


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


@dataclass(frozen=True)
class _Group:
    """A common cause before its test."""

    words: str
    sort: str
    place: str
    members: dict[int, Index]
    columns: Callable[[], Array]
    given: bool = True


class _Candidates:
    """Single observations that the tests reject, and every common cause that there may be."""

    def __init__(self, adjustment: Adjustment) -> None:
        self.adjustment, self.rows = adjustment, adjustment.rows
        self.system = weigh(adjustment)
        self.large: Mask = np.nan_to_num(np.abs(self.system.w)) > 2.0
        self.large_items = {
            int(t): np.unique(self.rows.item[self.large & (self.rows.table == t)])
            for t in np.unique(self.rows.table[self.large])
        }
        self.slopes: dict[tuple[str, int], Array] = {}
        #: common causes that there may be
        self.count = 0

    def all(self) -> Iterator[_Cause]:
        """Single observations, then common causes, at most so many."""
        yield from self._single()
        groups = sorted([*self._heights(), *self._shifts()], key=lambda g: -self._suspicious(g))
        self.count = len(groups)
        most = min(_MOST, max(_NUMBERS // max(len(self.large), 1), 10))
        for g in groups[:most]:
            yield replace(
                self._cause(g.words, self._rows_of(g.members), g.columns()),
                sort=g.sort,
                place=g.place,
                given=g.given,
            )

    def _suspicious(self, group: _Group) -> int:
        """How many of its observations have large test values."""
        return sum(
            int(np.isin(items, self.large_items.get(t, [])).sum())
            for t, items in group.members.items()
        )

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
            yield self._cause(words, inside, self.adjustment.whitener @ unit)

    def _cause(self, words: str, inside: Mask, columns: Array) -> _Cause:
        a = self.adjustment
        left = columns - a.design @ a.cofactor.solve(a.design.T @ columns)
        items = frozenset(zip(self.rows.table[inside].tolist(), self.rows.item[inside].tolist(),
                              strict=True))  # fmt: skip
        return _Cause(words, columns, left, items)

    def _heights(self) -> Iterator[_Group]:
        """Heights of instruments by set-up, of targets by set-up and at all."""
        name = self.adjustment.layout.position_name
        groups: dict[tuple[str, int, float], dict[int, Index]] = {}
        for table, o in enumerate(self.adjustment.network.observations):
            if not isinstance(o, Sights):
                continue
            for what, at, heights in (
                ("instrument", o.start, o.height_instrument),
                ("target", o.end, o.height_target),
            ):
                pairs = np.column_stack([at, np.round(heights, 4)])
                each, which = np.unique(pairs, axis=0, return_inverse=True)
                for k, (place, height) in enumerate(each):
                    # a target without a height is seen where it is
                    if what == "instrument" or height:
                        items = np.flatnonzero(which.ravel() == k)
                        groups.setdefault((what, int(place), float(height)), {})[table] = items
        for (what, place, height), members in groups.items():
            size = f"{height:.4f} m" if height else "none is given"
            yield _Group(
                words=f"the height of {what} at {name(place)} ({size})",
                sort=_HEIGHTS if what == "instrument" else _TARGETS,
                place=name(place),
                members=members,
                columns=partial(self._by_height, f"height_{what}", members),
                given=bool(height),
            )

    def _rows_of(self, members: dict[int, Index]) -> Mask:
        """Rows (n,) of items by table."""
        inside = np.zeros(len(self.rows.table), dtype=bool)
        for table, items in members.items():
            inside |= (self.rows.table == table) & np.isin(self.rows.item, items)
        return inside

    def _by_height(self, what: str, members: dict[int, Index]) -> Array:
        """Whitened derivatives (n, 1) of some sights by a height that they share."""
        column = np.zeros((len(self.rows.table), 1))
        for table, items in members.items():
            slope = self._slope(what, table)
            rows = np.flatnonzero((self.rows.table == table) & np.isin(self.rows.item, items))
            column[rows, 0] = slope[self.rows.item[rows], self.rows.row[rows]]
        whitened: Array = self.adjustment.whitener @ column
        return whitened

    def _slope(self, what: str, table: int) -> Array:
        """Derivatives (n, rows) of the sights of a table by their own heights."""
        if (what, table) not in self.slopes:
            o, state = self.adjustment.network.observations[table], self.adjustment.state
            higher = replace(o, **{what: getattr(o, what) + _STEP})
            change = higher.predict(state) - o.predict(state)
            for row in o.angular:
                change[:, row] = wrap(change[:, row])
            self.slopes[what, table] = change / _STEP
        return self.slopes[what, table]

    def _shifts(self) -> Iterator[_Group]:
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
            columns = self.adjustment.reduced[layout.position_columns(np.array([place]))[0]]
            if (columns < 0).any():
                continue
            name = layout.position_name(place)
            yield _Group(
                words=f"target {name} is not in one place, total station less scanner",
                sort=_PLACES,
                place=name,
                members=by_sights[place],
                columns=partial(self._by_place, by_sights[place], columns),
            )

    def _by_place(self, members: dict[int, Index], columns: Index) -> Array:
        """Whitened derivatives (n, 3) of some sights by the place of their target."""
        part: Array = self.adjustment.design[:, columns].toarray()
        part[~self._rows_of(members)] = 0.0
        return part
