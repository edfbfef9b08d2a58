"""Names mistakes that are one bias of several observations, before anything is switched off.

A wrong height of instrument sits in every sight of a set-up, a wrong height of
target in every sight to a prism, a target that was moved in all that one instrument saw of it. Each
cause i is a bias ``C_i b`` of the observations, and ``T_i = b^T (C^T P Q_vv P C) b`` is chi-square
of as many degrees of freedom if it is not there (Baarda 1968; method section 3.4). The most
improbable one is taken, what it explains is set aside, and the rest is tested again. Single
observations compete, so that a common cause is named only where it says more than its worst
observation does. A test touches the rows of its cause and their unknowns, not the network.

A set-up that is wrong stands out of the others. Where all of them are a little wrong in the same
way, as when repeated readings share errors that their sigmas count as independent, none is: causes
are measured at the scatter of the causes of their sort, and what is then no mistake is told as one
pattern.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
import scipy.sparse as sp

from tribrach._types import Array, Index, Mask
from tribrach.network.adjustment import Adjustment
from tribrach.network.blunders.clearing import fits
from tribrach.network.blunders.suspects import find_suspects
from tribrach.network.linear import group_products
from tribrach.network.network import Network
from tribrach.network.reliability import weigh
from tribrach.network.significance import log_significance, sidak
from tribrach.observations.base import wrap
from tribrach.observations.declaration import End
from tribrach.observations.sights import Sights
from tribrach.sentences import Sentence, joined
from tribrach.statistics import chi2, largest_first

#: significance of all common causes together
_ALPHA = 0.001
#: rounds in which common causes are looked for, and single observations that compete in each
_ROUNDS, _SINGLE = 6, 40
#: causes whose logarithms of significance differ by less than this cannot be told apart
_ALIKE = 3.0
#: common causes at most: those with the most observations whose tests are large
_MOST = 400
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
#: sorts that are heights over a point, and the largest error of one [m]
_RODS, _TALLEST = (_HEIGHTS, _TARGETS), 20.0
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
    """A mistake that explains several observations."""

    words: str  #: what is wrong
    size: Array  #: (k,), what is to be added to it [m]
    sigma: Array  #: (k,), standard deviation of the size [m]
    statistic: float  #: T, chi-square of k degrees of freedom
    rest: float  #: ``v^T P v`` without it
    alternatives: tuple[str, ...] = ()  #: causes in words that explain as much
    given: bool = True  #: false for a height that nobody gave: it cannot be too low

    def sentence(self) -> str:
        """All of it in one sentence."""
        if not self.given:
            size, sigma = 1e3 * self.size[0], 1e3 * self.sigma[0]
            much = Sentence(
                "its sights fit with {size:+1} mm ± {sigma:1} mm", size=size, sigma=sigma
            )
        elif len(self.size) == 1:
            side = "low" if self.size[0] > 0 else "high"
            much = Sentence(
                "{size:mm1} ± {own.sigma[0]:mm1} too {side}",
                size=abs(self.size[0]),
                own=self,
                side=side,
            )
        else:
            parts = joined(
                ", ",
                (
                    Sentence("{a} {value:+1}", a=a, value=1000.0 * x)
                    for a, x in zip("ENU", self.size, strict=True)
                ),
            )
            much = Sentence(
                "{length:mm1} ({parts} mm)", length=np.linalg.norm(self.size), parts=parts
            )
        also = f"; it could as well be {' or '.join(self.alternatives)}" * bool(self.alternatives)
        return Sentence(
            "Several observations are wrong in the way of one mistake: {own.words}, {much} "
            "(test {own.statistic:1}, chi-square of {size}){also}",
            own=self,
            much=much,
            size=len(self.size),
            also=also,
        )


@dataclass(frozen=True)
class Pattern:
    """Causes of one sort that many set-ups or targets have a little of, and none for itself."""

    sort: str  #: what would have to be changed
    count: int  #: how many causes of the sort there are
    scatter: float  #: their robust scatter in their own sigmas; 1 is chance
    #: median and largest of their absolute sizes [m]
    middle: float
    largest: float
    same_sign: int  #: how many of those with one size have the more frequent sign
    worst: tuple[str, ...]  #: the clearest of them in words, at most three

    def sentence(self) -> str:
        """All of it in one sentence."""
        sign = f", {self.same_sign} of {self.count} with the same sign" * bool(self.same_sign)
        return Sentence(
            "The observations would fit better with other {own.sort} in most cases, by "
            "{own.middle:mm1} in the middle and {own.largest:mm1} at most{sign}: "
            "{own.scatter:1} times what their sigmas say, most at {worst}. Where so many "
            "are off, none of them is shown to be a mistake: what they share may be "
            "{value}, and readings that were repeated share it too, though their sigmas "
            "count them as independent. Look for it, or give these observations larger "
            "sigmas; until then such heights and places are less certain than their "
            "standard deviations say",
            own=self,
            sign=sign,
            worst=", ".join(self.worst),
            value=_SHARED[self.sort],
        )


@dataclass(frozen=True)
class CommonCauses:
    """Common causes that were named."""

    named: tuple[CommonCause, ...] = ()  #: mistakes, the clearest first
    #: what is no mistake of one set-up or target; of several sorts the one that scatters most
    pattern: Pattern | None = None


@dataclass(frozen=True)
class _Cause:
    """A cause, the observations that it is in, and its columns of all causes' columns."""

    words: str
    members: dict[int, Index]
    columns: slice
    sort: str = ""
    place: str = ""
    given: bool = True

    @property
    def common(self) -> bool:
        """True if it concerns several observations."""
        return bool(self.sort)

    @cached_property
    def items(self) -> frozenset[tuple[int, int]]:
        """Its observations (table, item)."""
        return frozenset((t, int(i)) for t, items in self.members.items() for i in items)


@dataclass(frozen=True)
class _Tests:
    """Tests of causes (m,): chi-square, degrees of freedom, sizes and their sigmas (m, 3 or so)."""

    statistic: Array
    freedom: Index
    size: Array
    sigma: Array

    def score(self, scale: float = 1.0) -> Array:
        """Logarithms of the significance (m,), 0 where nothing can be tested."""
        out = log_significance(self.statistic / scale, np.maximum(self.freedom, 1))
        return np.where(self.freedom > 0, out, 0.0)


class _Causes:
    """All causes as sparse columns of whitened observations, and what the residuals show of them.

    With ``M = I - A Q A^T``, which is a projection, ``C_i^T M C_i`` needs the few unknowns that a
    cause touches and ``C_i^T v`` its own rows; what others explain, an orthonormal basis B of
    columns ``M C_j``, is taken out by ``C_i^T B``.
    """

    def __init__(self, adjustment: Adjustment, causes: list[_Cause], columns: sp.csc_array) -> None:
        self.adjustment, self.all, self.columns = adjustment, causes, columns
        width = np.array([c.columns.stop - c.columns.start for c in causes], dtype=np.int64)
        first = np.array([c.columns.start for c in causes], dtype=np.int64)
        squared = np.asarray(columns.multiply(columns).sum(axis=0)).ravel()
        self._scale = np.sqrt(np.where(squared > 0, squared, 1.0))
        touched = sp.csc_array(adjustment.design.T @ columns)
        self._of_width: list[tuple[Index, Index, Array]] = []
        for w in np.unique(width):
            which = np.flatnonzero(width == w)
            place = first[which][:, None] + np.arange(w)
            own = columns[:, place.ravel()]
            form = group_products(own, own, int(w))
            form -= adjustment.cofactor.forms(touched[:, place.ravel()], int(w))
            self._of_width.append((which, place, form))
        self._left: dict[int, Array] = {}

    def left(self, k: int) -> Array:
        """What a cause leaves in the residuals (n, w)."""
        if k not in self._left:
            a, columns = self.adjustment, self.columns[:, self.all[k].columns].toarray()
            self._left[k] = columns - a.design @ a.cofactor.solve(a.design.T @ columns)
        return self._left[k]

    def basis(self, chosen: list[int]) -> Array:
        """Orthonormal basis (n, k) of the residuals that some causes leave."""
        basis = np.zeros((self.adjustment.n_observations, 0))
        return _joined(basis, np.hstack([self.left(k) for k in chosen])) if chosen else basis

    def tests(self, residual: Array, basis: Array) -> _Tests:
        """Every cause, given a basis that is set aside and the residuals without it."""
        pull, other = self.columns.T @ residual, self.columns.T @ basis
        count, widest = len(self.all), max((f.shape[1] for _, _, f in self._of_width), default=0)
        statistic, freedom = np.zeros(count), np.zeros(count, dtype=np.int64)
        size, sigma = np.zeros((count, widest)), np.zeros((count, widest))
        for which, place, form in self._of_width:
            scale, w = self._scale[place], place.shape[1]
            aside = other[place]
            unit = form - aside @ aside.swapaxes(1, 2)
            values, vectors = np.linalg.eigh(unit / scale[:, :, None] / scale[:, None, :])
            seen = values > _UNSEEN
            over = np.where(seen, 1 / np.where(seen, values, 1.0), 0.0)
            inverse = (vectors * over[:, None, :]) @ vectors.swapaxes(1, 2)
            along = pull[place] / scale
            shift = np.einsum("kij,kj->ki", inverse, along)
            statistic[which] = np.einsum("ki,ki->k", along, shift)
            freedom[which] = seen.sum(axis=1)
            size[which, :w] = -shift / scale
            sigma[which, :w] = np.sqrt(np.einsum("kii->ki", inverse)) / scale
        return _Tests(statistic, freedom, size, sigma)

    def width(self, k: int) -> int:
        """Columns of a cause."""
        return int(self.all[k].columns.stop - self.all[k].columns.start)


def common_causes(adjustment: Adjustment) -> CommonCauses:
    """Find the mistakes that explain what is wrong, the clearest first."""
    if adjustment.dof < 2 or not find_suspects(weigh(adjustment)):
        return CommonCauses()
    candidates = _Candidates(adjustment)
    causes = candidates.all()
    limit = float(np.log(sidak(_ALPHA, candidates.count)))
    residual, basis = adjustment.whitened_residuals, np.zeros((adjustment.n_observations, 0))
    taken: list[int] = []
    similar: dict[int, tuple[str, ...]] = {}
    for _ in range(_ROUNDS):
        score = causes.tests(residual, basis).score()
        best = int(np.argmin(score)) if len(score) else -1
        if best < 0 or score[best] > limit:
            break
        # what one observation explains nearly as well is no common cause
        alone = np.array([not cause.common for cause in causes.all])
        rival = int(np.argmin(np.where(alone, score, 0.0)))
        if alone[rival] and score[rival] < score[best] + _ALIKE:
            best = rival
        taken.append(best)
        basis = _joined(basis, causes.left(best))
        residual = _without(adjustment.whitened_residuals, basis)
        close = np.flatnonzero(score < score[best] + _ALIKE)
        others = [causes.all[k] for k in close if k != best and causes.all[k].common]
        mine = causes.all[best].items
        similar[best] = tuple(o.words for o in others if not o.items <= mine)[:3]
    if not taken:
        return CommonCauses()
    return _Judgement(adjustment, causes, limit, taken).done(similar)


class _Judgement:
    """Which of the causes that explain much stand out of the others of their sort."""

    def __init__(
        self, adjustment: Adjustment, causes: _Causes, limit: float, taken: list[int]
    ) -> None:
        self.adjustment, self.causes, self.limit = adjustment, causes, limit
        self.taken = taken

    def done(self, similar: dict[int, tuple[str, ...]]) -> CommonCauses:
        """Mistakes, and the patterns of those that are none."""
        standing, refused = list(self.taken), list[int]()
        every = self.causes.all
        while True:
            tests = self._tests(standing)
            rows = self._rows(standing)
            scale = {
                sort: max(1.0, rows, self._scatter(sort, standing, tests))
                for sort in {every[k].sort for k in standing}
            }
            score = {
                k: float(tests.score(scale[every[k].sort])[k]) for k in standing if every[k].common
            }
            # a cause that does not stand out is one of the others, which then scatter more
            weakest = max(score, key=lambda k: score[k], default=None)
            if weakest is None or score[weakest] <= self.limit:
                break
            standing.remove(weakest)
            refused.append(weakest)
        named = []
        residual, basis = self.adjustment.whitened_residuals, self.causes.basis([])
        for k in (k for k in self.taken if k in standing):
            cause, w = every[k], self.causes.width(k)
            test = self.causes.tests(_without(residual, basis), basis)
            basis = _joined(basis, self.causes.left(k))
            rest = float(np.square(_without(residual, basis)).sum())
            if cause.common and cause.sort in _RODS and abs(test.size[k, 0]) > _TALLEST:
                # no tripod and no rod is as high: something else is wrong
                return CommonCauses()
            if cause.common:
                also, statistic = similar.get(k, ()), float(test.statistic[k])
                size, sigma = test.size[k, :w], test.sigma[k, :w]
                named.append(
                    CommonCause(cause.words, size, sigma, statistic, rest, also, cause.given)
                )
        fitting = self._fits(basis)
        # with little redundancy, readings that are set aside as well make anything fit
        few = self.adjustment.dof < _REDUNDANT
        if few and not self._fits(self.causes.basis([k for k in standing if every[k].common])):
            return CommonCauses()
        # in a network that does not fit other mistakes may scatter these causes
        sorts = dict.fromkeys(every[k].sort for k in refused if fitting)
        patterns = [self._pattern(s, standing) for s in sorts]
        told = [p for p in patterns if p.scatter > _WIDE]
        return CommonCauses(tuple(named), max(told, key=lambda p: p.scatter, default=None))

    def _fits(self, basis: Array) -> bool:
        """True if the network passes its global test without what a basis explains."""
        rest = _without(self.adjustment.whitened_residuals, basis)
        return fits(float(rest @ rest), self.adjustment.dof - basis.shape[1])

    def _tests(self, standing: list[int]) -> _Tests:
        """Every cause, given those that stand, of which it may be one."""
        residual, basis = self.adjustment.whitened_residuals, self.causes.basis(standing)
        tests = self.causes.tests(_without(residual, basis), basis)
        for k in standing:
            others = self.causes.basis([m for m in standing if m != k])
            own = self.causes.tests(_without(residual, others), others)
            for values, mine in ((tests.statistic, own.statistic), (tests.freedom, own.freedom),
                                 (tests.size, own.size), (tests.sigma, own.sigma)):  # fmt: skip
                values[k] = mine[k]
        return tests

    def _others(self, sort: str, standing: list[int], tests: _Tests) -> Index:
        """The causes of a sort that can be tested and do not stand."""
        members = [k for k, c in enumerate(self.causes.all) if c.sort == sort and k not in standing]
        chosen = np.array(members, dtype=np.int64)
        return chosen[tests.freedom[chosen] > 0]

    def _scatter(self, sort: str, standing: list[int], tests: _Tests) -> float:
        """Robust variance factor of the other causes of a sort; 1 for too few of them."""
        others = self._others(sort, standing, tests)
        ratio = tests.statistic[others] / chi2.ppf(0.5, tests.freedom[others])
        return float(np.median(ratio)) if len(ratio) >= _SCATTER else 1.0

    def _rows(self, standing: list[int]) -> float:
        """Robust variance factor of all residuals if the rest does not fit, else 1."""
        adjustment, basis = self.adjustment, self.causes.basis(standing)
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
        members = self._others(sort, standing, tests)
        size = np.linalg.norm(tests.size[members], axis=1)
        single = [float(tests.size[k, 0]) for k in members if self.causes.width(k) == 1]
        positive = sum(x > 0 for x in single)
        worst = members[np.argsort(-tests.statistic[members], kind="stable")][:3]
        return Pattern(
            sort=sort,
            count=len(members),
            scatter=float(np.sqrt(self._scatter(sort, standing, tests))),
            middle=float(np.median(size)),
            largest=float(size.max()),
            same_sign=max(positive, len(single) - positive),
            worst=tuple(self.causes.all[k].place for k in worst),
        )


def _without(residual: Array, basis: Array) -> Array:
    """Residuals without what a basis explains."""
    out: Array = residual - basis @ (basis.T @ residual)
    return out


def _joined(basis: Array, columns: Array) -> Array:
    """An orthonormal basis of both."""
    u, s, _ = np.linalg.svd(np.hstack([basis, columns]), full_matrices=False)
    joined: Array = u[:, s > 1e-9 * s[0]]
    return joined


#: rows, columns (counted from the first of its own) and derivatives of the bias of a cause
_Triples = tuple[Index, Index, Array]


@dataclass(frozen=True)
class _Groups:
    """Common causes before their tests: the observations that each is in."""

    owner: Index  #: (k,), cause of each observation, in the order of the tables
    #: (k,), the observation
    table: Index
    item: Index
    large: Index  #: (g,), how many observations of each cause have large test values
    #: makes one of them of its number and its items by table
    cause: Callable[[int, dict[int, Index]], tuple[_Cause, _Triples]]

    @classmethod
    def of(
        cls,
        parts: list[tuple[int, Index, Index]],
        count: int,
        large: list[Mask],
        cause: Callable[[int, dict[int, Index]], tuple[_Cause, _Triples]],
    ) -> _Groups:
        """Groups of tables, each with the owners (n,) of some of its items (n,)."""
        empty = np.empty(0, dtype=np.int64)
        owner, item = (np.concatenate([empty, *(p[k] for p in parts)]) for k in (1, 2))
        table = np.repeat([t for t, _, _ in parts], [len(items) for _, _, items in parts])
        bad = np.concatenate([np.empty(0, dtype=bool), *(large[t][items] for t, _, items in parts)])
        suspicious = np.bincount(owner[bad], minlength=count)
        return cls(owner, table.astype(np.int64), item, suspicious, cause)

    def made(self, chosen: Index) -> Iterator[tuple[_Cause, _Triples]]:
        """Chosen causes (k,)."""
        order = np.argsort(self.owner, kind="stable")
        ends = np.searchsorted(self.owner[order], np.arange(len(self.large) + 1))
        for g in chosen.tolist():
            mine = order[ends[g] : ends[g + 1]]
            tables = self.table[mine]
            members = {t: self.item[mine[tables == t]] for t in dict.fromkeys(tables.tolist())}
            yield self.cause(g, members)


class _Candidates:
    """Single observations that the tests reject, and every common cause that there may be."""

    def __init__(self, adjustment: Adjustment) -> None:
        self.adjustment, self.rows = adjustment, adjustment.rows
        self.system = weigh(adjustment)
        #: observations with large test values, by table
        self.large = [np.zeros(len(o), dtype=bool) for o in adjustment.network.observations]
        rows = np.nan_to_num(np.abs(self.system.w)) > 2.0
        for table, large in enumerate(self.large):
            large[self.rows.item[rows & (self.rows.table == table)]] = True
        self.slopes: dict[tuple[str, int], Array] = {}
        #: common causes that there may be
        self.count = 0

    def all(self) -> _Causes:
        """Single observations, then common causes, at most so many."""
        kinds = [self._heights(), self._shifts()]
        number = np.concatenate([np.arange(len(g.large)) for g in kinds])
        kind = np.repeat(np.arange(len(kinds)), [len(g.large) for g in kinds])
        self.count = len(number)
        best = largest_first(np.concatenate([g.large for g in kinds]))[:_MOST]
        made: list[tuple[_Cause, _Triples] | None] = [None] * len(best)
        for k, groups in enumerate(kinds):
            mine = np.flatnonzero(kind[best] == k)
            for place, one in zip(mine, groups.made(number[best[mine]]), strict=True):
                made[place] = one
        return self._joined([*self._single(), *(one for one in made if one is not None)])

    def _joined(self, made: list[tuple[_Cause, _Triples]]) -> _Causes:
        """Causes with their whitened columns."""
        causes, first, parts = list[_Cause](), 0, list[_Triples]()
        for cause, (rows, columns, values) in made:
            width = cause.columns.stop
            causes.append(replace(cause, columns=slice(first, first + width)))
            parts.append((rows, columns + first, values))
            first += width
        n = len(self.rows)
        raw = _sparse(
            [p for p, c in zip(parts, causes, strict=True) if c.sort != _PLACES], n, first
        )
        # derivatives by the place of a target are those of the design, whitened already
        white = _sparse(
            [p for p, c in zip(parts, causes, strict=True) if c.sort == _PLACES], n, first
        )
        whole = sp.csc_array(self.adjustment.whitener @ raw + white)
        return _Causes(self.adjustment, causes, whole)

    def _single(self) -> Iterator[tuple[_Cause, _Triples]]:
        """Whole observations that the tests reject."""
        tables = self.adjustment.network.observations
        # what sights share is a common cause under another name
        found = [s for s in find_suspects(self.system) if not tables[s.key[0]].facts.nuisance]
        for suspect in found[:_SINGLE]:
            table, item = suspect.key
            o = tables[table]
            rows = self._rows_of(table, np.array([item])).ravel()
            words = Network.describe(o, item, self.adjustment.state)
            cause = _Cause(words, {table: np.array([item])}, slice(0, len(rows)))
            yield cause, (rows, np.arange(len(rows)), np.ones(len(rows)))

    def _rows_of(self, table: int, items: Index) -> Index:
        """Rows (k, m) of observations; -1 where they take no part."""
        row = np.arange(self.adjustment.network.observations[table].rows)
        return self.adjustment.assembly.row_numbers(table, items[:, None], row)

    def _heights(self) -> _Groups:
        """Heights of instruments by set-up, of targets by set-up and at all."""
        parts, keys = list[tuple[int, Index, Index]](), list[Array]()
        count = 0
        for table, o in enumerate(self.adjustment.network.observations):
            if not isinstance(o, Sights):
                continue
            for target, at, heights in (
                (0.0, o.start, o.height_instrument),
                (1.0, o.end, o.height_target),
            ):
                pairs = np.column_stack([np.full(len(o), target), at, np.round(heights, 4)])
                each, which = np.unique(pairs, axis=0, return_inverse=True)
                # a target without a height is seen where it is
                items = (
                    np.flatnonzero(which.ravel() >= 0)
                    if not target
                    else np.flatnonzero(pairs[:, 2])
                )
                parts.append((table, count + which.ravel()[items], items))
                keys.append(each)
                count += len(each)
        every = np.concatenate([np.empty((0, 3)), *keys])
        distinct, first, group = np.unique(every, axis=0, return_index=True, return_inverse=True)
        used = np.zeros(len(distinct), dtype=bool)
        for _, owner, _ in parts:
            used[group.ravel()[owner]] = True
        # in the order in which they come
        order = np.argsort(first)
        order = order[used[order]]
        rank = np.full(len(distinct), -1)
        rank[order] = np.arange(len(order))
        parts = [(table, rank[group.ravel()[owner]], items) for table, owner, items in parts]
        return _Groups.of(parts, len(order), self.large, partial(self._height, distinct[order]))

    def _height(
        self, every: Array, number: int, members: dict[int, Index]
    ) -> tuple[_Cause, _Triples]:
        """A wrong height of an instrument or of a target."""
        is_target, at, height = every[number]
        what, name = "target" if is_target else "instrument", self.adjustment.layout.position_name
        size = Sentence("{height:4} m", height=height) if height else "none is given"
        rows, slopes = list[Index](), list[Array]()
        for table, items in members.items():
            place = self._rows_of(table, items)
            rows.append(place[place >= 0])
            slopes.append(self._slope(f"height_{what}", table)[items][place >= 0])
        row = np.concatenate(rows)
        cause = _Cause(
            words=Sentence(
                "the height of {what} at {name} ({size})", what=what, name=name(int(at)), size=size
            ),
            members=members,
            columns=slice(0, 1),
            sort=_TARGETS if is_target else _HEIGHTS,
            place=name(int(at)),
            given=bool(height),
        )
        return cause, (row, np.zeros(len(row), dtype=np.int64), np.concatenate(slopes))

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

    def _shifts(self) -> _Groups:
        """Places that total stations and scanners do not see as one."""
        observations, layout = self.adjustment.network.observations, self.adjustment.layout
        count = len(self.adjustment.state.positions)
        sighted, scanned = np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
        for o in observations:
            if isinstance(o, Sights):
                sighted[o.end] = True
            elif o.facts.names_target and (target := o.end_field(End.TO)) is not None:
                scanned[np.asarray(getattr(o, target.name))] = True
        columns = self.adjustment.reduced[layout.position_columns(np.arange(count))]
        both = np.flatnonzero(sighted & scanned & (columns >= 0).all(axis=1))
        rank = np.full(count, -1)
        rank[both] = np.arange(len(both))
        parts = list[tuple[int, Index, Index]]()
        for table, o in enumerate(observations):
            if isinstance(o, Sights):
                items = np.flatnonzero(rank[o.end] >= 0)
                parts.append((table, rank[o.end[items]], items))
        return _Groups.of(parts, len(both), self.large, partial(self._shift, both, columns[both]))

    def _shift(
        self, places: Index, columns: Index, number: int, members: dict[int, Index]
    ) -> tuple[_Cause, _Triples]:
        """A target that is not in one place, with derivatives of its sights by that place."""
        name = self.adjustment.layout.position_name(int(places[number]))
        rows = [self._rows_of(table, items).ravel() for table, items in members.items()]
        inside = np.sort(np.concatenate(rows))
        inside = inside[inside >= 0]
        part = sp.coo_array(self.adjustment.design[inside][:, columns[number]])
        cause = _Cause(
            words=f"target {name} is not in one place, total station less scanner",
            members=members,
            columns=slice(0, 3),
            sort=_PLACES,
            place=name,
        )
        return cause, (inside[part.row], part.col.astype(np.int64), part.data)


def _sparse(parts: list[_Triples], rows: int, columns: int) -> sp.csr_array:
    """A sparse matrix of the entries of some causes."""
    if not parts:
        return sp.csr_array((rows, columns))
    i, j, values = (np.concatenate(part) for part in zip(*parts, strict=True))
    return sp.csr_array(sp.coo_array((values, (i, j)), shape=(rows, columns)))
