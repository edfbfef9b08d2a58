"""What single reference points do from cycle to cycle beyond the errors of their sights.

A prism on a rail or a bracket follows the sun by millimetres and comes back. That is no error of
the readings, so wider sigmas of all sights would be wrong for every other point, and it is no
displacement that lasts. Its covariance is learned for each point by itself from what recurs within
a day (method section 12.6).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import cache

import numpy as np
from scipy.special import bdtrc

from tribrach._types import Array, Index
from tribrach.epochs.congruence import Congruence
from tribrach.epochs.differences import Difference
from tribrach.statistics import chi2

#: values of the running median at least, and half of what it spans [days]
_VALUES, _HALF_DAY = 6, 0.5
#: clocks of cycles differ by minutes from day to day [days]
_LATE = 0.01
#: degrees of freedom of the distribution by which outliers lose weight
_FREEDOM = 5.0
#: rounds of the estimation, and the relative change that ends it
_ROUNDS, _CHANGE = 30, 0.01
#: probability that a point without wander is said to have some, of all points together
_CHANCE = 0.01
#: what one cycle can say for a wander, as twice the logarithm of likelihoods: one sight that is far
#: off is no wander
_MOST_SAID = 6.0


def shared_factor(differences: Sequence[Difference]) -> float:
    """Factor of the variances of all sights over the stated ones; below 1 if smaller.

    Each point is tested against the others in every difference of two cycles. The median over the
    cycles says what a point does, the median over the points what most of them share: that is in
    the sights. A point does more by itself if more of its cycles are beyond that than chance
    explains. The one that is furthest out is left aside and the others are looked at again, as
    long as a majority is left.
    """
    names = {name for changes in differences for name in changes.names}
    aside: set[str] = set()
    while True:
        ratios = _ratios(differences, aside)
        if not ratios:
            return 1.0
        factor = float(np.median([np.median(values) for values in ratios.values()]))
        beyond = max(factor, 1.0)
        out = {
            float(np.median(values)): name
            for name, values in ratios.items()
            if bdtrc(sum(v > beyond for v in values) - 1, len(values), 0.5) < _CHANCE
        }
        if not out or len(names) - len(aside) - 1 < max(4, len(names) // 2 + 1):
            return factor
        aside.add(out[max(out)])


def _ratios(differences: Sequence[Difference], aside: Collection[str]) -> dict[str, list[float]]:
    """Tests of each point against the others, over the median that they have by chance."""
    out: dict[str, list[float]] = {}
    for changes in differences:
        width = len(changes.axes)
        chosen = [k for k, name in enumerate(changes.names) if name not in aside]
        rows = changes.rows(chosen)
        form = Congruence(
            changes.values[chosen].ravel(),
            changes.covariance[np.ix_(rows, rows)],
            changes.basis[rows],
            width,
        )
        if form.dof < 2 * width:
            continue
        falls = form.decrease(np.arange(len(chosen))[:, None])
        middle = float(chi2.ppf(0.5, width))
        for k, fall in zip(chosen, falls.tolist(), strict=True):
            if np.isfinite(fall):
                out.setdefault(changes.names[k], []).append(fall / middle)
    return out


def with_wander(
    changes: Difference, wander: Mapping[str, Array], share: float | Mapping[str, float]
) -> Array:
    """Covariance of differences with the wander of their points.

    ``share`` says how much of the covariance of one cycle is in a difference: ``1 + 1/b`` against a
    baseline of b other cycles.
    """
    out = changes.covariance.copy()
    width = len(changes.axes)
    for k, name in enumerate(changes.names):
        if name in wander:
            rows = slice(k * width, (k + 1) * width)
            factor = share if isinstance(share, int | float) else share[name]
            out[rows, rows] += factor * wander[name]
    return out


def learned_wander(
    differences: Sequence[Difference], days: Array, names: Sequence[str]
) -> dict[str, Array]:
    """Covariance of the daily wander of each point, by expectation and maximisation.

    In every cycle the motions of the whole are estimated with the weights of sights and wander
    together; what a point does is its best prediction, about a running median over a day, so that
    steps and drifts are not in it. Cycles far out lose weight as in a distribution of Student. A
    point has a wander only where its likelihood ratio says so: noise of the sights is none.

    Method section 12.6.
    """
    if not names or not differences:
        return {}
    width, names = len(differences[0].axes), list(names)
    limit = float(chi2.ppf(1 - 2 * _CHANCE / len(names), width * (width + 1) / 2))
    while names:
        found, said = _learned(differences, days, names)
        kept = [name for name, ratio in zip(names, said, strict=True) if ratio > limit]
        if len(kept) == len(names):
            return dict(zip(names, found / _consistency(width), strict=True))
        # without those that stand still the others are estimated anew
        names = kept
    return {}


def _learned(
    differences: Sequence[Difference], days: Array, names: Sequence[str]
) -> tuple[Array, Array]:
    """Covariances (k, d, d) of the wander of points, and their likelihood ratios (k,) against none.

    The ratio is twice the logarithm, of restricted likelihoods (the motions are eliminated), with
    the wander of the others as it is.
    """
    width = len(differences[0].axes)
    number = {name: k for k, name in enumerate(names)}
    typical = float(np.median(np.diag(differences[0].covariance)))
    found = np.repeat(typical * np.eye(width)[None], len(names), axis=0)
    said = np.zeros(len(names))
    for _ in range(_ROUNDS):
        forms = [_form(changes, dict(zip(names, found, strict=True))) for changes in differences]
        moved = np.full((len(differences), len(names), width), np.nan)
        for i, (changes, form) in enumerate(zip(differences, forms, strict=True)):
            left = changes.values - (changes.basis @ _motion(form)).reshape(-1, width)
            for k, name in enumerate(changes.names):
                if name in number:
                    moved[i, number[name]] = left[k]
        slow, count = _running_median(moved, days)
        new, said = _round(differences, forms, slow, count, number, found)
        change = np.abs(new - found).max() / found.max()
        found = new
        if change < _CHANGE:
            break
    return found, said


def _form(changes: Difference, wander: Mapping[str, Array]) -> Congruence:
    return Congruence(
        changes.values.ravel(),
        with_wander(changes, wander, 1.0),
        changes.basis,
        len(changes.axes),
    )


def _motion(form: Congruence) -> Array:
    """Estimated size of the motions; none where the networks leave none open."""
    return form.shift if form.rank else np.zeros(0)


def _running_median(moved: Array, days: Array) -> tuple[Array, Index]:
    """Median (n, p, d) over a day or some values, whichever is longer, and its values (n, p)."""
    n = len(days)
    slow, count = np.zeros_like(moved), np.zeros(moved.shape[:2], dtype=np.int64)
    for i in range(n):
        # half open: a day with both of its ends would have one hour twice, and a median that sways
        near = (days - days[i] > _LATE - _HALF_DAY) & (days - days[i] <= _HALF_DAY + _LATE)
        low = max(0, min(i - _VALUES // 2 + 1, n - _VALUES))
        near[low : low + _VALUES] = True
        part = moved[near]
        known = np.isfinite(part[:, :, 0])
        count[i] = known.sum(axis=0)
        seen = count[i] > 0
        slow[i, seen] = np.nanmedian(part[:, seen], axis=0)
    return slow, count


def _round(
    differences: Sequence[Difference],
    forms: Sequence[Congruence],
    slow: Array,
    count: Index,
    number: Mapping[str, int],
    found: Array,
) -> tuple[Array, Array]:
    """One round: predictions of the wander, their covariance, and what speaks for each wander."""
    width = found.shape[1]
    inverse = np.linalg.inv(found + 1e-6 * np.trace(found, axis1=1, axis2=2).max() * np.eye(width))
    total, cycles = np.zeros_like(found), np.zeros(len(found))
    said = np.zeros(len(found))
    for i, (changes, form) in enumerate(zip(differences, forms, strict=True)):
        about = np.zeros((len(changes.names), width))
        for k, name in enumerate(changes.names):
            if name in number:
                about[k] = slow[i, number[name]]
        pull = form.weights @ (form.values - about.ravel())
        for k, name in enumerate(changes.names):
            p = number.get(name, -1)
            if p < 0 or count[i, p] < 3:
                continue
            rows = slice(k * width, (k + 1) * width)
            guess = found[p] @ pull[rows]
            unsure = found[p] - found[p] @ form.weights[rows, rows] @ found[p]
            size = float(guess @ inverse[p] @ guess + np.trace(inverse[p] @ unsure))
            weight = (_FREEDOM + width) / (_FREEDOM + size)
            lost = count[i, p] / (count[i, p] - 1)
            total[p] += weight * lost * np.outer(guess, guess) + unsure
            cycles[p] += 1
            # without R of this point P becomes P + P R (I - P R)^-1 P
            without = np.eye(width) - form.weights[rows, rows] @ found[p]
            ratio = float(pull[rows] @ found[p] @ np.linalg.solve(without, pull[rows]))
            said[p] += min(ratio + float(np.linalg.slogdet(without)[1]), _MOST_SAID)
    new = np.where(cycles[:, None, None] > 0, total / np.maximum(cycles, 1)[:, None, None], found)
    return (new + np.swapaxes(new, 1, 2)) / 2, said


@cache
def _consistency(width: int) -> float:
    """What the weighted estimate is of the covariance of normal values."""
    x = chi2.ppf((np.arange(4000) + 0.5) / 4000, width)
    c = 1.0
    for _ in range(200):
        c *= float(np.mean((_FREEDOM + width) / (_FREEDOM + x / c) * x / c)) / width
    return c
