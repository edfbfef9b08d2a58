"""Finds the misalignments that explain what was observed, the clearest first.

Few differences cannot carry a whole calibration model. Parameters come in as long as one is
significant beside those that are in; others that would explain the same nearly as well are named
with it, since the observations do not tell them apart (method sections 4.2 and 4.4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.answers import Estimate, Number, Result
from tribrach.instruments.calibration import meaning_of
from tribrach.statistics import chi2, norm

#: parameters whose effect is the same as that of the one they are named with
ALIASES = {"x9n": ("x5n",), "x7": ("x5z",), "x9z": ("x5z",)}


#: share of a column that must be left beside those that are in
_INDEPENDENT = 1e-6


@dataclass(frozen=True)
class Cause(Estimate, also=("t",)):
    """A misalignment that would explain what was found [m or rad]."""

    parameter: str
    alternatives: tuple[str, ...]  #: others that the observations do not tell from it

    @property
    def words(self) -> str:
        """The parameter in words."""
        return meaning_of(self.parameter)


@dataclass(frozen=True)
class Explanation(Result, without=("dof", "t_limit")):
    """Misalignments, the clearest first, and the sum of squares before and after."""

    causes: tuple[Cause, ...]
    #: weighted sum of squares without and with the causes
    before: Number
    after: Number
    #: degrees of freedom of ``after`` and its chi-square limit
    dof: int
    limit: Number
    t_limit: float  #: from which on a parameter counts

    @property
    def fits(self) -> bool:
        """True if what the causes leave is noise."""
        return self.after <= self.limit


def whitened(covariance: Array, rank: int, *others: Array) -> tuple[Array, ...]:
    """Whiten arrays with ``W C W^T = I`` on ``rank`` directions of C; the rest is rounding."""
    value, vector = np.linalg.eigh((covariance + covariance.T) / 2)
    largest = value[-rank:]
    good = largest > 1e-12 * value.max(initial=0.0)
    root = vector[:, -rank:][:, good].T / np.sqrt(largest[good])[:, None]
    return tuple(root @ other for other in others)


def explain(
    names: Sequence[str],
    columns: Array,
    observed: Array,
    alpha0: float = 0.001,
    alpha: float = 0.05,
) -> Explanation:
    """Choose the parameters that explain observations, one after the other.

    ``columns`` are what parameters of one make. ``alpha0`` is the error probability of each
    parameter, ``alpha`` that of the test of what is left.
    """
    limit = float(norm.ppf(1 - alpha0 / 2))
    rest, chosen = observed.copy(), list[int]()
    basis = np.zeros((len(observed), 0))
    alternatives: list[tuple[str, ...]] = []
    length = np.linalg.norm(columns, axis=0)
    while len(chosen) < min(len(names), len(observed) - 1):
        free = columns - basis @ (basis.T @ columns)
        left = np.linalg.norm(free, axis=0)
        open_ = left > _INDEPENDENT * np.where(length > 0, length, np.inf)
        t = np.where(open_, (free.T @ rest) / np.where(open_, left, 1.0), 0.0)
        best = int(np.argmax(np.abs(t)))
        if not abs(t[best]) > limit:
            break
        # a difference of the sums of squares that chance explains does not decide between two
        close = t[best] ** 2 - t**2 < chi2.ppf(1 - alpha, 1)
        alternatives.append(
            tuple(n for k, n in enumerate(names) if close[k] and k != best and k not in chosen)
        )
        chosen.append(best)
        basis, _ = np.linalg.qr(columns[:, chosen])
        rest = observed - basis @ (basis.T @ observed)
    causes = _estimated(names, columns, observed, chosen, alternatives)
    dof = len(observed) - len(chosen)
    after = float(rest @ rest)
    bound = float(chi2.ppf(1 - alpha, dof)) if dof else 0.0
    return Explanation(causes, float(observed @ observed), after, dof, bound, limit)


def _estimated(
    names: Sequence[str],
    columns: Array,
    observed: Array,
    chosen: list[int],
    alternatives: list[tuple[str, ...]],
) -> tuple[Cause, ...]:
    """The causes by least squares, all together."""
    if not chosen:
        return ()
    part = columns[:, chosen]
    scale = np.linalg.norm(part, axis=0)
    unit = part / scale
    cofactor = np.linalg.inv(unit.T @ unit)
    value = cofactor @ (unit.T @ observed) / scale
    sigma = np.sqrt(np.diag(cofactor)) / scale
    return tuple(
        Cause(float(v), float(s), names[k], (*ALIASES.get(names[k], ()), *others))
        for k, v, s, others in zip(chosen, value, sigma, alternatives, strict=True)
    )
