"""Examines a fit: columns, tests of points, check points, scale, models, what was removed.

Are columns of coordinates exchanged, or one of the systems left-handed? All orders and signs of the
axes of A are tried with the turns that the model allows. Where one of them fits far better than the
columns as they stand, the input is named as wrong and nothing is put right silently. Is one of the
systems in another unit? Its scale tells. Metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.errors import AdjustmentError, InputError
from tribrach.geometry.alignment import upright_rms
from tribrach.geometry.axis_orders import AxisOrder, axis_orders
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
from tribrach.units import OTHER_LENGTHS

#: so many times better must another order of the axes fit before it is named
_RATIO = 5.0
#: share of the points that may be switched off
_MOST = 1 / 3
#: points that tell the unit of a system, and how near the scale must be
_FEW, _NEAR = 3, 0.005
#: points flatter than this share of their extent fit their mirror image as well
_FLAT = 1e-3
#: rms [m], order, turn that is left [rad], is the last axis upright?
_Order = tuple[float, AxisOrder, float, bool]
#: significance of the global test and of single check points
ALPHA, CHECK = 0.05, 0.99


@dataclass(frozen=True, eq=False)
class Outcome:
    """A fit with all of its tests and remarks."""

    fit: TransformationFit  #: without the points that were removed
    tests: PointTests  #: of the used points
    checks: CheckResult | None  #: None if there are none
    scale: ScaleTest | None  #: None where it is not determined
    rungs: tuple[Rung, ...]  #: other models
    odd: tuple[str, ...]  #: what looks wrong with the columns, in sentences
    #: what snooping did, in sentences, and names of the points that it removed
    steps: tuple[str, ...]
    removed: tuple[str, ...]


def examine(points: CommonPoints, model: Model, titles: tuple[str, ...], *, snoop: bool) -> Outcome:
    """Fit a transformation and examine it."""
    used = points.used
    odd = tuple(axis_sentences(points.a[used], points.b[used], model, titles))
    odd = odd or tuple(unit_sentences(points.a[used], points.b[used]))
    fit = fit_points(points, model)
    steps: tuple[str, ...] = ()
    removed: tuple[str, ...] = ()
    # exchanged columns and other units make every point suspicious
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
    """What looks wrong with columns of points ``a``, ``b`` (n, d) that belong together [m]."""
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
        _rms, order, turn, _ = min(alike, key=_likely)
        head = "only as a mirror image" if order.mirrors else "only with other axes"
        return [
            Sentence(
                "the points fit {head} (root mean square {best:mg3} instead of "
                "{plain.rms:mg3}, more than {ratio:g} times as much): {named} in one of both "
                "systems; a turn of {turn:degrees1} is left then",
                head=head,
                best=best,
                plain=plain,
                ratio=_RATIO,
                named=order.words(titles),
                turn=turn,
            )
        ]
    up = plain.transformation.rotation[-1, -1]
    turned = d == 3 and model.turn == "free" and up < -0.5
    if turned and upright_rms(a, b) > _RATIO * plain.rms + 1e-6:
        return [
            "the points fit only upside down: if heights go up in both systems, two columns "
            f"({titles[0]} and {titles[1]}) look exchanged in one of them"
        ]
    return []


def unit_sentences(a: Array, b: Array) -> list[str]:
    """Say if of ``a``, ``b`` (n, d) [m] one is in another unit, by distances between points."""
    pairs = np.triu_indices(len(a), 1)
    own, other = (np.linalg.norm((x[:, None] - x)[pairs], axis=1) for x in (a, b))
    seen = (own > 0) & (other > 0)
    if len(a) < _FEW or not seen.any():
        return []
    ratio = other[seen] / own[seen]
    middle = float(np.median(ratio))
    for unit, size in OTHER_LENGTHS.items():
        for name, factor in (("A", size), ("B", 1 / size)):
            if abs(middle / factor - 1) < _NEAR:
                return [
                    Sentence(
                        "the points of B lie {middle:g4} times as far apart as those of A: it "
                        "looks as if {name} were in {unit} and the other in metres; bring both "
                        "into metres",
                        middle=middle,
                        name=name,
                        unit=unit,
                    )
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
    for order in axis_orders(d):
        if flat and model.turn == "free" and order.mirrors:
            continue
        try:
            transformation = start(model, order(a), b)
        except InputError:
            return None
        left = b - transformation(order(a))
        rms = float(np.sqrt((left**2).sum(axis=1).mean()))
        cosine = (np.trace(transformation.rotation) - (d - 2)) / 2
        turn = float(np.arccos(np.clip(cosine, -1, 1)))
        if order.plain:
            plain = _Plain(transformation, rms)
        else:
            upright = bool(d == 2 or transformation.rotation[2, 2] > 0.7)
            orders.append((rms, order, turn, upright))
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


def _likely(tried: _Order) -> tuple[bool, bool, int, float]:
    """The less, the likelier: tilted, reversed, many columns, a large turn."""
    _, order, turn, upright = tried
    return not upright, min(order.signs) < 0, order.changes, turn
