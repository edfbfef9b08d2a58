"""A linear model fitted to a few values, with what each of its terms is worth.

Ordinary least squares by QR of the scaled columns; ``t = value / sigma`` against Student's
distribution; ``R^2 = 1 - v^T v / sum (y - mean y)^2`` and the same adjusted for the number of
terms, ``1 - (1 - R^2) (n - 1) / (n - u)``. Units are those of the columns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr, solve_triangular

from tribrach.distributions import t as student
from tribrach.errors import InputError

__all__ = ["Fit", "Term", "fit_terms"]

Array = NDArray[np.float64]

#: columns whose rest is smaller than this depend on the others
_DEPENDENT = 1e-9
#: residuals below this share of the spread are rounding, not scatter
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Term:
    """A coefficient with its standard deviation, its t and the two-sided probability of that."""

    name: str
    value: float
    sigma: float
    t: float
    p: float


@dataclass(frozen=True)
class Fit:
    """A fitted model of ``y``.

    scatter : standard deviation of the residuals, in units of y; fitted (n,) : what the model
    says for each row.
    """

    model: str
    y: str
    x: tuple[str, ...]
    terms: tuple[Term, ...]
    n: int
    r2: float
    adjusted_r2: float
    scatter: float
    fitted: Array = field(repr=False)

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
) -> Fit:
    """Fit ``y`` (n,) as a combination of named columns (n,).

    Raises
    ------
    InputError : too few values, a y that does not vary, columns that depend on each other.
    """
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
    return Fit(
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
