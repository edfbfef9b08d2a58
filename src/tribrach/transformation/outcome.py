"""Examines a fit: columns, tests of points, check points, scale, models, what was removed.

Are columns of coordinates exchanged, or one of the systems left-handed? All orders and signs of the
axes of A are tried with the turns that the model allows. Where one of them fits far better than the
columns as they stand, the input is named as wrong and nothing is put right silently. Mirror images
differ by a rotation only: the likely one leaves heights upright, and two exchanged columns are more
common than a reversed one. Metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations, product

import numpy as np

from tribrach._types import Array
from tribrach.errors import AdjustmentError, InputError
from tribrach.sentences import Sentence
from tribrach.transformation.fit import CommonPoints, TransformationFit, fit_points
from tribrach.transformation.model_choice import Rung, ScaleTest, ladder, scale_test
from tribrach.transformation.models import MODELS, Model, Transformation, start
from tribrach.transformation.testing import (
    CheckResult,
    PointTests,
    Snooped,
    check_points,
    point_tests,
    snoop_points,
)

__all__ = ["Outcome", "axis_sentences", "examine"]

#: so many times better must another order of the axes fit before it is named
_RATIO = 5.0
#: share of the points that may be switched off
_MOST = 1 / 3
#: points flatter than this share of their extent fit their mirror image as well
_FLAT = 1e-3
#: rms [m], permutation, signs, turn that is left [rad], is the last axis upright?
_Order = tuple[float, tuple[int, ...], tuple[int, ...], float, bool]
#: significance of the global test and of single check points
ALPHA, CHECK = 0.05, 0.99


@dataclass(frozen=True, eq=False)
class Outcome:
    """A fit and everything that is to be said about it."""

    #: without the points that were removed
    fit: TransformationFit
    #: of the used points
    tests: PointTests
    #: None if there are none
    checks: CheckResult | None
    #: None where it is not determined
    scale: ScaleTest | None
    #: other models
    rungs: tuple[Rung, ...]
    #: what looks wrong with the columns, in sentences
    odd: tuple[str, ...]
    #: what snooping did, in sentences, and names of the points that it removed
    steps: tuple[str, ...]
    removed: tuple[str, ...]


def examine(points: CommonPoints, model: Model, titles: tuple[str, ...], *, snoop: bool) -> Outcome:
    """Fit a transformation and examine it."""
    used = points.used
    odd = tuple(axis_sentences(points.a[used], points.b[used], model, titles))
    fit = fit_points(points, model)
    steps: tuple[str, ...] = ()
    removed: tuple[str, ...] = ()
    # exchanged columns make every point suspicious
    if snoop and not odd:
        snooped = snoop_points(fit)
        refusal = _refusal(fit, snooped)
        if refusal:
            steps = (refusal,)
        else:
            fit, steps, removed = snooped.fit, snooped.steps, snooped.removed
    return Outcome(
        fit=fit,
        tests=point_tests(fit),
        checks=check_points(fit),
        scale=scale_test(fit.points),
        rungs=tuple(ladder(fit.points)),
        odd=odd,
        steps=steps,
        removed=removed,
    )


def _refusal(fit: TransformationFit, snooped: Snooped) -> str:
    """Why nothing is switched off: a larger model fits all points, or too many would go."""
    count, points = len(snooped.removed), fit.points
    if not count:
        return ""
    for model in MODELS:
        more = model.count - fit.model.count
        # as many parameters would explain as much as the points that go
        if model.dimension != points.dimension or not 0 < more < count * points.dimension:
            continue
        try:
            larger = fit_points(points, model)
        except (InputError, AdjustmentError):
            continue
        if larger.dof > 0 and not point_tests(larger).suspicious.any():
            return (
                f"no point is switched off: all of them fit with {model.words} "
                f"(--model {model.count}), which explains as much as {count} wrong "
                f"point{'s' if count > 1 else ''} would"
            )
    used = int(points.used.sum())
    if count > used * _MOST:
        return (
            f"no point is switched off: {count} of {used} would have to go, which is more than a "
            f"third; {fit.model.words} is not what relates these coordinates, or the lists do not "
            "belong together"
        )
    return ""


def axis_sentences(a: Array, b: Array, model: Model, titles: tuple[str, ...]) -> list[str]:
    """Say in words what looks wrong with the columns of coordinates.

    Parameters
    ----------
    a, b : array (n, d)
        Points that belong together [m].
    model
        What may change.
    titles
        Names of the columns.
    """
    d = model.dimension
    if len(a) * d < model.count or model.turn == "affine":
        return _affine(a, b, titles) if model.turn == "affine" else []
    trial = _tried(a, b, model)
    if trial is None:
        return []
    plain, orders = trial
    best = min(rms for rms, *_ in orders)
    if plain.rms > _RATIO * best + 1e-6:
        alike = [order for order in orders if order[0] <= 1.5 * best + 1e-6]
        _rms, moved, signs, turn, _ = min(alike, key=_likely)
        mirrored = _parity(moved, signs) < 0
        head = "only as a mirror image" if mirrored else "only with other axes"
        return [
            Sentence(
                "the points fit {head} (root mean square {best:mg3} instead of "
                "{plain.rms:mg3}, more than {ratio:g} times as much): {named} in one of both "
                "systems; a turn of {turn:degrees1} is left then",
                head=head,
                best=best,
                plain=plain,
                ratio=_RATIO,
                named=_named(moved, signs, titles),
                turn=turn,
            )
        ]
    up = plain.transformation.rotation[-1, -1]
    if d == 3 and model.turn == "free" and up < -0.5:
        return [
            "the points fit only upside down: if heights go up in both systems, two columns "
            f"({titles[0]} and {titles[1]}) look exchanged in one of them"
        ]
    return []


class _Plain:
    """The fit of the columns as they stand, and its RMS [m]."""

    def __init__(self, transformation: Transformation, rms: float) -> None:
        self.transformation, self.rms = transformation, rms


def _tried(a: Array, b: Array, model: Model) -> tuple[_Plain, list[_Order]] | None:
    """The columns as they stand, and every order."""
    d = model.dimension
    spread = np.linalg.svd(a - a.mean(axis=0), compute_uv=False)
    flat = spread[-1] <= _FLAT * spread[0]
    orders: list[_Order] = []
    plain = None
    for moved in permutations(range(d)):
        for signs in product((1, -1), repeat=d):
            if flat and model.turn == "free" and _parity(moved, signs) < 0:
                continue
            try:
                transformation = start(model, a[:, moved] * signs, b)
            except InputError:
                return None
            left = b - transformation(a[:, moved] * signs)
            rms = float(np.sqrt((left**2).sum(axis=1).mean()))
            cosine = (np.trace(transformation.rotation) - (d - 2)) / 2
            turn = float(np.arccos(np.clip(cosine, -1, 1)))
            if moved == tuple(range(d)) and min(signs) > 0:
                plain = _Plain(transformation, rms)
            else:
                orders.append(
                    (rms, moved, signs, turn, bool(d == 2 or transformation.rotation[2, 2] > 0.7))
                )
    return None if plain is None or not orders else (plain, orders)


def _affine(a: Array, b: Array, titles: tuple[str, ...]) -> list[str]:
    """An affine transformation swallows a mirror image: its determinant tells."""
    d = a.shape[1]
    local = a - a.mean(axis=0)
    spread = np.linalg.svd(local, compute_uv=False)
    if len(a) <= d or spread[-1] <= _FLAT * spread[0]:
        return []
    matrix = np.linalg.lstsq(local, b - b.mean(axis=0), rcond=None)[0]
    if np.linalg.det(matrix) > 0:
        return []
    return [
        "the affine transformation mirrors (its determinant is negative): one system is "
        f"left-handed, or two of the columns {', '.join(titles)} are exchanged"
    ]


def _likely(order: _Order) -> tuple[bool, bool, int, float]:
    """The less, the likelier: tilted, reversed, many columns, a large turn."""
    _, moved, signs, turn, upright = order
    return not upright, min(signs) < 0, _changes(moved, signs), turn


def _changes(moved: tuple[int, ...], signs: tuple[int, ...]) -> int:
    """How many columns differ."""
    return sum(k != i or s < 0 for i, (k, s) in enumerate(zip(moved, signs, strict=True)))


def _parity(moved: tuple[int, ...], signs: tuple[int, ...]) -> int:
    """Determinant of the exchange."""
    matrix = np.eye(len(moved))[list(moved)] * np.array(signs)
    return round(float(np.linalg.det(matrix)))


def _named(moved: tuple[int, ...], signs: tuple[int, ...], titles: tuple[str, ...]) -> str:
    """The exchange in words."""
    odd = [titles[i] for i, k in enumerate(moved) if k != i]
    negative = [titles[k] for k, s in zip(moved, signs, strict=True) if s < 0]
    words = []
    if odd:
        words.append(f"the columns {' and '.join(odd)} look exchanged")
        if len(odd) == 2 and not negative:
            words.append(f"or one of {odd[0]} and {odd[1]} reversed")
    if negative:
        verb = "looks" if len(negative) == 1 else "look"
        words.append(f"{' and '.join(negative)} {verb} reversed")
    return ", ".join(words)
