"""The congruence test, and which points do not take part in the congruence.

Everything rests on the matrix that is left of the weights once the motions of the whole are taken
out (method section 12.2); the datum in which the differences were given then plays no part.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import comb

import numpy as np
from scipy.special import ncfdtrinc

from tribrach._types import Array, Index
from tribrach.answers import Number, Result
from tribrach.errors import AdjustmentError
from tribrach.statistics import chi2, f

#: eigenvalues of the scaled covariance below this share of the largest are none
_SINGULAR = 1e-11
#: a group of points whose weights are worse conditioned cannot be estimated beside the motions
_LOOSE = 1e-9
#: combinations of one size that are all looked at
_MOST = 20_000
#: hypotheses less likely than the best by more than this factor are no partners of it
LIKELIHOOD = 20.0


@dataclass(frozen=True)
class Limits:
    """Limits of statistics: a priori by chi-square, or with an estimated variance by F."""

    alpha: float = 0.05  #: probability of a false alarm of one test
    factor: float = 1.0  #: what statistics are divided by; 1 a priori
    dof: int = 0  #: degrees of freedom of that factor; 0 a priori

    def limit(self, dof: int, alpha: float | None = None) -> float:
        """Limit of a statistic ``d^T Q^+ d / factor`` with so many degrees of freedom."""
        probability = 1 - (self.alpha if alpha is None else alpha)
        if self.dof:
            return float(dof * f.ppf(probability, dof, self.dof))
        return float(chi2.ppf(probability, dof))

    def significance(self, statistic: float, dof: int) -> float:
        """Probability of a larger statistic if nothing moved."""
        if dof == 0:
            return 1.0
        if self.dof:
            return float(f.sf(statistic / dof, dof, self.dof))
        return float(chi2.sf(statistic, dof))

    def noncentrality(self, dof: int, power: float, alpha: float | None = None) -> float:
        """``lambda0`` that is found with this power; of non-central F with estimated variance."""
        limit = self.limit(dof, alpha)
        if not self.dof:
            return float(chi2.noncentrality(limit, dof, power))
        return float(ncfdtrinc(dof, self.dof, 1 - power, limit / dof))


@dataclass(frozen=True)
class CongruenceTest(Result, also=("passed",)):
    """``T = d^T Q^+ d`` against its limit."""

    statistic: float
    dof: int
    limit: Number  #: null where nothing is left to be tested
    significance: Number  #: probability of a larger one if nothing moved

    @property
    def passed(self) -> bool:
        """True if the points are congruent as far as the test can tell."""
        return not self.statistic > self.limit


class Congruence:
    """The quadratic form of differences with the motions of the whole taken out.

    The basis (k, m) are motions of the whole that are no displacement; the covariance is singular
    in what they span alone. ``width`` is how many differences a point has.

    Method section 12.2.
    """

    def __init__(
        self,
        values: Array,
        covariance: Array,
        basis: Array,
        width: int,
        names: Sequence[str] = (),
    ) -> None:
        self.width = width
        self.values = values
        scale = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
        # variance along G leaves everything as it is that has G among its unknowns
        typical = float(np.median(scale)) if len(scale) else 1.0
        rounded = covariance + typical**2 * (basis @ basis.T)
        size = np.sqrt(np.maximum(np.diag(rounded), 1e-300))
        value, vector = np.linalg.eigh(rounded / np.outer(size, size))
        if len(value) and value[0] <= _SINGULAR * value[-1]:
            open_ = int((value <= _SINGULAR * value[-1]).sum())
            worst = int(np.argmax(np.abs(vector[:, 0])) // width)
            raise AdjustmentError(
                f"the covariance of the differences is singular in {open_} more "
                f"{'direction' if open_ == 1 else 'directions'} than the motions of the whole",
                [f"most of it is in {names[worst] if names else f'point number {worst + 1}'}"],
            )
        weights = (vector / value) @ vector.T / np.outer(size, size)
        self.rank = int(np.linalg.matrix_rank(basis)) if basis.size else 0
        if self.rank:
            pg = weights @ basis
            self._normal = basis.T @ pg
            self.shift = np.linalg.lstsq(self._normal, pg.T @ values, rcond=1e-12)[0]
            weights = weights - pg @ np.linalg.pinv(self._normal, hermitian=True) @ pg.T
        self.weights: Array = (weights + weights.T) / 2
        self.pull: Array = self.weights @ values

    @property
    def dof(self) -> int:
        """Degrees of freedom of the form."""
        return len(self.values) - self.rank

    @cached_property
    def statistic(self) -> float:
        """``d^T Q^+ d`` in the common datum."""
        return float(self.values @ self.pull)

    def decrease(self, groups: Index) -> Array:
        """Decrease (g,) of the form if the points (g, k) of each group may have moved freely.

        NaN where what is left cannot tell their displacement from a motion of the whole.
        """
        count = len(groups)
        rows = (groups[:, :, None] * self.width + np.arange(self.width)).reshape(count, -1)
        out = np.full(count, np.nan)
        size = rows.shape[1]
        for part in np.array_split(np.arange(count), max(1, count * size**2 // 2_000_000)):
            r = rows[part]
            block = self.weights[r[:, :, None], r[:, None, :]]
            pull = self.pull[r]
            diagonal = np.sqrt(np.maximum(np.einsum("nii->ni", block), 1e-300))
            scaled = block / diagonal[:, :, None] / diagonal[:, None, :]
            good = np.linalg.eigvalsh(scaled)[:, 0] > _LOOSE
            if good.any():
                right = (pull / diagonal)[good]
                solved = np.linalg.solve(scaled[good], right[:, :, None])[:, :, 0]
                out[part[good]] = np.einsum("ni,ni->n", right, solved)
        return out

    def displacement(self, group: Sequence[int]) -> tuple[Array, Array]:
        """Best estimate (k width,) of the displacement of points that moved, and its covariance.

        All others are taken as stable; method section 12.3.
        """
        rows = (np.asarray(group)[:, None] * self.width + np.arange(self.width)).ravel()
        covariance = np.asarray(np.linalg.inv(self.weights[np.ix_(rows, rows)]), dtype=np.float64)
        return covariance @ self.pull[rows], covariance

    def test(self, limits: Limits, group: Sequence[int] = ()) -> CongruenceTest:
        """The global test, of all points or without a group of them."""
        left, dof = self.statistic, self.dof
        if len(group):
            left -= float(self.decrease(np.array([group], dtype=np.int64))[0])
            dof -= len(group) * self.width
        scaled = max(left, 0.0) / limits.factor
        return CongruenceTest(scaled, dof, limits.limit(dof), limits.significance(scaled, dof))


@dataclass(frozen=True)
class Moved:
    """Points that do not take part in the congruence of the others."""

    points: tuple[int, ...]  #: their numbers
    statistic: float  #: ``T`` of what is left without them


@dataclass(frozen=True)
class StabilitySearch:
    """Points that moved and points taken as stable."""

    #: the global test of all of them, and of those that stayed
    before: CongruenceTest
    after: CongruenceTest
    moved: tuple[int, ...]  #: numbers of the points that moved; none if the first test is passed
    #: further groups of the same size that explain it nearly as well: which of them moved cannot
    #: be told
    partners: tuple[Moved, ...]
    resolved: bool  #: false if no group that leaves a majority stable explains the differences
    tried: int  #: combinations that were compared
    #: false where there were too many of a size, and the best were sought step by step
    exhaustive: bool


#: what is left after the largest group is not explained if chance leaves as much this seldom
_UNEXPLAINED = 0.001


def search_moved(form: Congruence, limits: Limits, *, most: int | None = None) -> StabilitySearch:
    """Find the smallest group of points without which the others are congruent.

    Of the groups of one size that with the largest decrease of the form counts: single tests one
    after the other smear several displacements over all points. A larger group takes the place of
    a smaller one only if it explains significantly more; one test in twenty of what is left fails
    although nothing else moved.

    Method section 12.3; Nowel (2020), Velsink (2015).
    """
    n = len(form.values) // form.width
    before = form.test(limits)
    most = (n - 1) // 2 if most is None else min(most, n - 1)
    # what is left must have a redundancy over the datum
    most = min(most, (form.dof - 1) // form.width)
    if before.passed:
        return StabilitySearch(before, before, (), (), True, 0, True)
    tried, exhaustive, passed = 0, True, False
    sizes: list[tuple[Index, Array]] = []
    for size in range(1, most + 1):
        whole = comb(n, size) <= _MOST
        exhaustive &= whole
        previous = () if not sizes else _best(*sizes[-1])[0]
        listed = combinations(range(n), size) if whole else _near(form, previous, n, size)
        groups = np.array(list(listed), dtype=np.int64)
        fall = form.decrease(groups) / limits.factor
        tried += len(groups)
        if np.isnan(fall).all():
            break
        sizes.append((groups, fall))
        left = before.statistic - _best(groups, fall)[1]
        if left <= limits.limit(form.dof - size * form.width):
            passed = True
            break
    chosen = _size(sizes, limits, n, form.width, passed)
    if chosen and not passed:
        left = before.statistic - _best(*sizes[chosen - 1])[1]
        if limits.significance(left, form.dof - chosen * form.width) < _UNEXPLAINED:
            chosen = 0
    if chosen == 0:
        best = _best(*sizes[-1])[0] if sizes else ()
        after = form.test(limits, best)
        return StabilitySearch(before, after, best, (), False, tried, exhaustive)
    groups, fall = sizes[chosen - 1]
    best, most_fall = _best(groups, fall)
    near = np.flatnonzero(most_fall - fall <= 2 * np.log(LIKELIHOOD))
    order = near[np.argsort(-fall[near], kind="stable")]
    partners = (
        Moved(tuple(int(k) for k in groups[g]), before.statistic - float(fall[g])) for g in order
    )
    return StabilitySearch(
        before,
        form.test(limits, best),
        best,
        tuple(p for p in partners if p.points != best),
        True,
        tried,
        exhaustive,
    )


def _best(groups: Index, fall: Array) -> tuple[tuple[int, ...], float]:
    """The group with the largest decrease, and that decrease."""
    first = int(np.nanargmax(fall))
    return tuple(int(k) for k in groups[first]), float(fall[first])


def _size(
    sizes: list[tuple[Index, Array]], limits: Limits, n: int, width: int, passed: bool
) -> int:
    """How many points moved: the least number that no larger one improves on significantly.

    0 if no group explains the differences. Tests count how many groups they are the best of.
    """
    fall = [0.0, *(_best(*size)[1] for size in sizes)]

    def better(small: int, large: int) -> bool:
        """Does the best of the larger groups explain more than chance lets it?"""
        more = large - small
        alpha = limits.alpha / comb(n - small, more)
        return fall[large] - fall[small] > limits.limit(more * width, alpha)

    last = len(sizes)
    for small in range(1, last):
        if better(0, small) and not any(better(small, k) for k in range(small + 1, last + 1)):
            return small
    return last if last and (passed or better(0, last)) else 0


def _near(
    form: Congruence, previous: tuple[int, ...], n: int, size: int
) -> Iterator[tuple[int, ...]]:
    """Groups around the best one of a size less: with one more, then with any one exchanged."""
    others = [k for k in range(n) if k not in previous]
    grown = np.array([sorted((*previous, k)) for k in others], dtype=np.int64)
    seen = {tuple(g) for g in grown.tolist()}
    yield from (tuple(g) for g in grown.tolist())
    best = tuple(grown[int(np.nanargmax(np.nan_to_num(form.decrease(grown), nan=-1.0)))].tolist())
    for _ in range(2 * size):
        swaps = {
            tuple(sorted((*(p for p in best if p != out), k)))
            for out in best
            for k in range(n)
            if k not in best
        } - seen
        if not swaps:
            return
        listed = sorted(swaps)
        seen |= swaps
        yield from listed
        fall = np.nan_to_num(form.decrease(np.array(listed, dtype=np.int64)), nan=-1.0)
        now = float(np.nan_to_num(form.decrease(np.array([best])), nan=-1.0)[0])
        if fall.max() <= now * (1 + 1e-12):
            return
        best = listed[int(np.argmax(fall))]
