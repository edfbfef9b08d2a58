"""Two files of points into a transformation with its tests: the result, which is the file too.

``b = shift_at_centre + matrix (a - centre)``; ``covariance`` is that of the parameters in the order
of ``parameters``. Metres and radians.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from tribrach.answers import Form, Matrix, Number, Result, Vector
from tribrach.errors import InputError
from tribrach.io.point_list import PointList, read_point_list, refuse_dimensions
from tribrach.io.transformation_file import KIND, SCHEMA
from tribrach.transformation.fit import CommonPoints
from tribrach.transformation.model_choice import Rung, ScaleTest
from tribrach.transformation.models import find_model
from tribrach.transformation.outcome import CHECK, Outcome, examine
from tribrach.transformation.weights import Spread

Use = Literal["used", "check", "off"]


@dataclass(frozen=True)
class FittedParameter(Result):
    """A parameter with its unit."""

    name: str
    unit: str
    value: float
    sigma: Number


@dataclass(frozen=True)
class UnitWeight(Result):
    """Sigma of unit weight; null without redundancy."""

    posterior: float | None
    dof: int
    vtpv: float


@dataclass(frozen=True, eq=False)
class CommonPoint(Result):
    """A common point: differences ``b - T(a)`` and residuals [m]."""

    name: str
    use: Use
    difference: Vector
    residual_a: Vector
    residual_b: Vector
    redundancy: Number
    test: Number
    limit: Number
    reason: str

    @property
    def verdict(self) -> str:
        """Does it fit?"""
        if self.use == "off":
            return ""
        fits = "agrees" if self.test <= self.limit else "does not fit"
        return fits if math.isfinite(self.test) else "not controlled"


@dataclass(frozen=True, eq=False)
class FittedTransformation(Result, also=("kind",), without=("outcome", "alone")):
    """A transformation by common points."""

    outcome: Outcome
    alone: tuple[tuple[str, ...], tuple[str, ...]]  #: names that only A and only B have
    #: number of its parameters
    model: int
    dimension: int
    words: str
    centre: Vector
    shift_at_centre: Vector
    rotation: Matrix
    factors: Vector
    matrix: Matrix
    shift_at_origin: Vector
    parameters: tuple[FittedParameter, ...]
    covariance: Matrix | None
    covariance_at_origin: Matrix | None
    covariance_is: Literal["prior", "posterior"]
    sigma0: UnitWeight
    rms_of_fit: float
    check_rmse: Vector | None
    scale_test: ScaleTest | None
    models: tuple[Rung, ...]
    points: tuple[CommonPoint, ...]
    removed: tuple[str, ...]
    from_: str
    to: str

    @property
    def kind(self) -> str:
        """What the file is."""
        return KIND


#: the file of a transformation
FORM = Form("transform", FittedTransformation, SCHEMA, warnings=list[str])


def fit_files(
    a: Path, b: Path, count: int | None, check: Sequence[str] = (), *, snoop: bool = False
) -> FittedTransformation:
    """The transformation of the points of file a to those of the same name in file b.

    count : parameters, 7 in space and 4 in the plane if None; check : names held out.
    """
    one, two = read_point_list(a), read_point_list(b)
    refuse_dimensions(one, two)
    given, alone = _common(one, two, check)
    model = find_model(count or (7 if one.dimension == 3 else 4), one.dimension)
    outcome = examine(given, model, one.titles, snoop=snoop)
    fit, t, checks = outcome.fit, outcome.fit.transformation, outcome.checks
    known = bool(np.isfinite(fit.covariance).all())
    sigma = np.sqrt(np.diag(fit.covariance))
    return FittedTransformation(
        outcome=outcome,
        alone=alone,
        model=t.model.count,
        dimension=t.model.dimension,
        words=t.model.words,
        centre=t.centre,
        shift_at_centre=t.shift,
        rotation=t.rotation,
        factors=t.factors,
        matrix=t.matrix,
        shift_at_origin=t.at_origin,
        parameters=tuple(
            FittedParameter(name, unit, float(value), float(s) if known else math.nan)
            for (name, unit), value, s in zip(t.model.parameters, t.values, sigma, strict=True)
        ),
        covariance=fit.covariance if known else None,
        covariance_at_origin=fit.origin_covariance if known else None,
        covariance_is="prior" if given.weighted else "posterior",
        sigma0=UnitWeight(fit.sigma0, fit.dof, fit.vtpv),
        rms_of_fit=fit.rms,
        check_rmse=None if checks is None else checks.rmse,
        scale_test=outcome.scale,
        models=outcome.rungs,
        points=tuple(_points(outcome)),
        removed=outcome.removed,
        from_=a.name,
        to=b.name,
    )


def _points(outcome: Outcome) -> Iterator[CommonPoint]:
    """All common points with the test of each."""
    fit, tests, checks = outcome.fit, outcome.tests, outcome.checks
    rows = np.full((len(fit.points.names), 3), np.nan)
    rows[fit.points.used] = np.stack([tests.redundancy, tests.statistic, tests.limit], axis=1)
    if checks is not None:
        rows[checks.place, 1:] = np.stack([checks.statistic, checks.limit(CHECK)], axis=1)
    rows[~np.isfinite(rows[:, 1]), 1:] = np.nan
    for k, name in enumerate(fit.points.names):
        use: Use = "used" if fit.points.used[k] else "check" if fit.points.check[k] else "off"
        vectors = fit.difference[k], fit.residual_a[k], fit.residual_b[k]
        redundancy, test, limit = rows[k].tolist()
        yield CommonPoint(name, use, *vectors, redundancy, test, limit, fit.points.reasons[k])


def _common(
    one: PointList, two: PointList, check: Sequence[str]
) -> tuple[CommonPoints, tuple[tuple[str, ...], tuple[str, ...]]]:
    """Points that both files have, in the order of A; the others by name."""
    there = {name: k for k, name in enumerate(two.names)}
    rows = [k for k, name in enumerate(one.names) if name in there]
    if not rows:
        raise InputError(
            f"no point has a name that is also in {two.path.name}",
            file=one.path,
            cure="name the same points alike in both files",
        )
    mates = [there[one.names[k]] for k in rows]
    names = tuple(one.names[k] for k in rows)
    strange = [name for name in check if name not in names]
    if strange:
        raise InputError(
            f"check point {strange[0]} is not in both files",
            file=one.path,
            cure="name common points",
        )
    uses = [{one.use[k], two.use[m]} for k, m in zip(rows, mates, strict=True)]
    off = np.array(["off" in use for use in uses])
    held = np.array(["check" in use for use in uses]) | np.isin(names, list(check))
    reasons = tuple(one.reasons[k] or two.reasons[m] for k, m in zip(rows, mates, strict=True))

    def spread(source: PointList, at: list[int]) -> Spread:
        return Spread(None if source.covariance is None else source.covariance[at])

    points = CommonPoints(
        names,
        one.xyz[rows],
        two.xyz[mates],
        spread(one, rows),
        spread(two, mates),
        ~off & ~held,
        held & ~off,
        reasons,
    )
    known = set(names)
    alone = tuple(tuple(n for n in part.names if n not in known) for part in (one, two))
    return points, (alone[0], alone[1])
