"""The distributions of statistical tests: chi-square, F, Student's t, normal.

``scipy.stats`` has them and a hundred others, and takes longer to load than a network of a hundred
points takes to adjust; these are the same closed forms of incomplete gamma and beta functions
(Abramowitz and Stegun 1972, chapters 6 and 26), and give the same digits. Names are those of
``scipy.stats``: ``ppf`` is the quantile of a probability, ``sf`` the probability of the upper tail.
Arguments are numbers or arrays that broadcast; a degree of freedom of zero gives NaN.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.special import chdtrc, chndtrinc, fdtrc, fdtri, gammaincinv, ndtr, ndtri, stdtr, stdtrit

from tribrach._types import Array, Index

#: standard deviation of a normal variable over its median absolute deviation, 1 / Phi^-1(3/4)
MAD_TO_SIGMA = 1.4826


class _ChiSquare:
    """Chi-square with dof degrees of freedom."""

    def ppf(self, p: Any, dof: Any) -> Any:
        """Quantile of the probability p."""
        return 2 * gammaincinv(np.asarray(dof) / 2, p)

    def sf(self, x: Any, dof: Any) -> Any:
        """Probability of a larger value than x."""
        return chdtrc(dof, np.maximum(x, 0.0))

    def noncentrality(self, x: Any, dof: Any, p: Any) -> Any:
        """The non-centrality with which x is exceeded with probability p."""
        return chndtrinc(x, dof, 1 - np.asarray(p))


class _Fisher:
    """F with the degrees of freedom of numerator and denominator."""

    def ppf(self, p: Any, numerator: Any, denominator: Any) -> Any:
        """Quantile of the probability p."""
        return fdtri(numerator, denominator, p)

    def sf(self, x: Any, numerator: Any, denominator: Any) -> Any:
        """Probability of a larger value than x."""
        return fdtrc(numerator, denominator, np.maximum(x, 0.0))


class _Student:
    """Student's t with dof degrees of freedom."""

    def ppf(self, p: Any, dof: Any) -> Any:
        """Quantile of the probability p."""
        return stdtrit(dof, p)

    def sf(self, x: Any, dof: Any) -> Any:
        """Probability of a larger value than x."""
        return stdtr(dof, np.negative(x))


class _Normal:
    """Normal with mean 0 and standard deviation 1."""

    def ppf(self, p: Any) -> Any:
        """Quantile of the probability p."""
        return ndtri(p)

    def sf(self, x: Any) -> Any:
        """Probability of a larger value than x."""
        return ndtr(np.negative(x))

    def isf(self, p: Any) -> Any:
        """The value that is exceeded with the probability p, exact for the smallest p."""
        return -ndtri(p)

    def pdf(self, x: Any) -> Any:
        """Density at x."""
        return np.exp(-np.square(x) / 2) / np.sqrt(2 * np.pi)


chi2, f, t, norm = _ChiSquare(), _Fisher(), _Student(), _Normal()


def robust_sigma(values: npt.NDArray[Any], *, about: float | None = None) -> float:
    """Sigma by the median absolute deviation (Hampel 1974); half of the values may be wrong."""
    middle = np.median(values) if about is None else about
    deviation = np.abs(values - middle) if middle else np.abs(values)
    return float(MAD_TO_SIGMA * np.median(deviation))


def largest_first(values: Array) -> Index:
    """Indices (n,) of values (n,) from the largest on; those that agree to seven digits keep order.

    Values that are equal by symmetry differ in their last digits, by the order in which sums were
    taken: a list that people read must not depend on that.
    """
    order: Index = np.argsort(-np.asarray(values).astype(np.float32), kind="stable")
    return order
