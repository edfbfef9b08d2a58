"""Fits how the differences between clouds depend on range and incidence.

Each quantity against each cause: a quadratic whose last term is put to a t-test, a straight line
where it fails; against both causes together the physical model ``a + b D + c / cos I`` (method
section 5.4). Causes that go together are named, for then no fit can part their effects. Values are
in the units of the table; incidence in radians only inside the physical model.

A linear model is fitted by ordinary least squares with QR of the scaled columns; ``t = value /
sigma`` against Student's distribution; ``R^2 = 1 - v^T v / sum (y - mean y)^2`` and the same
adjusted for the number of terms, ``1 - (1 - R^2) (n - 1) / (n - u)``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from scipy.linalg import qr, solve_triangular

from tribrach._types import Array
from tribrach.answers import Number, Result, Vector
from tribrach.errors import InputError
from tribrach.statistics import t as student
from tribrach.units import UNITS

#: columns whose rest is smaller than this depend on the others
_DEPENDENT = 1e-9
#: residuals below this share of the spread are rounding, not scatter
_ROUNDING = 1e-12
#: causes correlated more than this cannot be told apart in words either
ALIKE = 0.8
#: units of angles, and their names in the table of units
_ANGLES = {"deg": "deg", "°": "deg", "gon": "gon", "rad": "rad"}


@dataclass(frozen=True)
class Term(Result):
    """A coefficient of a fitted model."""

    name: str
    #: estimate and standard deviation, in units of the columns
    value: Number
    sigma: Number
    t: Number  #: value over sigma
    p: Number  #: two-sided probability of as much by chance


@dataclass(frozen=True)
class RegressionFit(Result, also=("dof",)):
    """A fitted model of one quantity."""

    model: str  #: ``line``, ``quadratic`` or ``physical``
    #: names of the quantity and of its causes
    y: str
    x: tuple[str, ...]
    terms: tuple[Term, ...]  #: coefficients
    n: int  #: number of rows
    #: share of the variance that the model explains
    r2: Number
    adjusted_r2: Number
    scatter: Number  #: standard deviation of the residuals, in units of y
    fitted: Vector = field(repr=False)  #: what the model gives for each row

    @property
    def dof(self) -> int:
        """Redundancy."""
        return self.n - len(self.terms)

    @property
    def values(self) -> Array:
        """The coefficients (u,)."""
        return np.array([term.value for term in self.terms])


def fit_terms(
    model: str, y_name: str, x: Sequence[str], y: Array, columns: dict[str, Array]
) -> RegressionFit:
    """Fit ``y`` (n,) as a combination of named columns (n,)."""
    n, u = len(y), len(columns)
    on = ", ".join(x)
    if n <= u:
        raise InputError(
            f"{n} rows cannot carry {u} coefficients of {y_name} against {on}",
            cure=f"give at least {u + 1} rows",
        )
    spread = float(np.sum((y - y.mean()) ** 2))
    if spread <= (_ROUNDING * np.abs(y).max(initial=0.0)) ** 2 * n:
        raise InputError(f"{y_name} is the same in every row", cure="give values that vary")
    design = np.stack(list(columns.values()), axis=1)
    scale = np.linalg.norm(design, axis=0)
    q, r = qr(design / np.where(scale > 0, scale, 1.0), mode="economic")
    if np.abs(np.diag(r)).min() < _DEPENDENT:
        raise InputError(
            f"the values of {on} are too few or too alike for {y_name} as a {model}",
            cure="give rows at more different values",
        )
    value = solve_triangular(r, q.T @ y) / scale
    fitted: Array = design @ value
    rest = y - fitted
    squares = float(rest @ rest)
    scatter = float(np.sqrt(max(squares, _ROUNDING**2 * spread) / (n - u)))
    sigma = scatter * np.linalg.norm(solve_triangular(r, np.eye(u)), axis=1) / scale
    t = value / sigma
    p = 2 * student.sf(np.abs(t), n - u)
    terms = zip(columns, value.tolist(), sigma.tolist(), t.tolist(), p.tolist(), strict=True)
    r2 = 1 - squares / spread
    return RegressionFit(
        model=model,
        y=y_name,
        x=tuple(x),
        terms=tuple(Term(*term) for term in terms),
        n=n,
        r2=r2,
        adjusted_r2=1 - (1 - r2) * (n - 1) / (n - u),
        scatter=scatter,
        fitted=fitted,
    )


@dataclass(frozen=True)
class Relation(Result, also=("t_curvature", "curved", "chosen")):
    """One quantity against one cause: both fits, and whether the curvature is significant."""

    y: str
    x: str
    quadratic: RegressionFit
    line: RegressionFit
    t_limit: Number  #: of the absolute t of the quadratic term

    @property
    def t_curvature(self) -> Number:
        """The t of the quadratic term."""
        return self.quadratic.terms[2].t

    @property
    def curved(self) -> bool:
        """True if the quadratic term is significant."""
        return abs(self.t_curvature) > self.t_limit

    @property
    def taken(self) -> RegressionFit:
        """The quadratic where its last term is significant, else the line."""
        return self.quadratic if self.curved else self.line

    @property
    def chosen(self) -> str:
        """The model that is taken."""
        return self.taken.model


@dataclass(frozen=True)
class CauseCorrelation(Result, also=("inflation",)):
    """Two causes and their correlation."""

    a: str
    b: str
    value: Number

    @property
    def inflation(self) -> Number:
        """Inflation of variances if both are fitted together, ``1 / (1 - r^2)``."""
        return float(1 / max(1 - self.value**2, 1e-12))


@dataclass(frozen=True)
class Regression(Result, without=("remarks",)):
    """Regressions of quantities on causes."""

    rows: int  #: their number
    #: of the tests
    confidence: float
    relations: tuple[Relation, ...]
    #: one fit for each quantity, none without a range and an incidence
    physical: tuple[RegressionFit, ...]
    correlations: tuple[CauseCorrelation, ...]
    remarks: tuple[str, ...] = ()  #: what was taken for granted


def regress(
    values: Mapping[str, Array],
    x: Sequence[str],
    y: Sequence[str],
    units: Mapping[str, str] | None = None,
    confidence: float = 0.95,
) -> Regression:
    """Fit quantities against causes; ``confidence`` is that of the t-test of the quadratic term.

    The cause in ``deg``, ``gon`` or ``rad``, or whose name begins with ``inc``, is the incidence.
    """
    units = units or {}
    n = len(values[y[0]])
    limit = float(student.ppf(0.5 + confidence / 2, max(n - 3, 1)))
    relations = [_relation(values, b, a, limit) for a in x for b in y]
    correlations = [
        CauseCorrelation(a, b, float(np.corrcoef(values[a], values[b])[0, 1]))
        for a, b in combinations(x, 2)
    ]
    angle, remarks = _incidence(x, units)
    others = [name for name in x if name != angle]
    physical: tuple[RegressionFit, ...] = ()
    if angle is not None and len(others) == 1 and n > 3:
        inverse = _inverse_cosine(angle, values[angle], units.get(angle, ""))
        physical = tuple(_physical(values, b, others[0], angle, inverse) for b in y)
    else:
        remarks = []
    return Regression(
        n, confidence, tuple(relations), physical, tuple(correlations), tuple(remarks)
    )


def _relation(values: Mapping[str, Array], y: str, x: str, limit: float) -> Relation:
    """Quadratic and line of one pair."""
    a, b = values[x], values[y]
    one = np.ones(len(a))
    line = {"constant": one, x: a}
    quadratic = fit_terms("quadratic", y, [x], b, {**line, f"{x}²": a**2})
    return Relation(y, x, quadratic, fit_terms("line", y, [x], b, line), limit)


def _physical(
    values: Mapping[str, Array], y: str, length: str, angle: str, inverse: Array
) -> RegressionFit:
    """``a + b D + c / cos I``."""
    one = np.ones(len(inverse))
    columns = {"constant": one, length: values[length], f"1/cos {angle}": inverse}
    return fit_terms("physical", y, [length, angle], values[y], columns)


def _incidence(x: Sequence[str], units: Mapping[str, str]) -> tuple[str | None, list[str]]:
    """The cause that is the incidence angle, and what was taken for granted about it."""
    for name in x:
        if units.get(name, "") in _ANGLES:
            return name, []
    for name in x:
        if name.lower().startswith(("inc", "ia")) and not units.get(name, ""):
            return name, [f"{name} has no unit and is taken as degrees."]
    return None, []


def _inverse_cosine(name: str, angle: Array, unit: str) -> Array:
    """``1 / cos I`` (n,) of angles (n,) in their unit."""
    radians = angle * UNITS[_ANGLES.get(unit, "deg")]
    if (np.abs(radians) >= np.pi / 2 - 1e-6).any():
        raise InputError(
            f"{name} reaches {np.abs(angle).max():g}, a beam along the surface",
            cure="give the angle between beam and normal, below 90 degrees",
        )
    inverse: Array = 1 / np.cos(radians)
    return inverse
