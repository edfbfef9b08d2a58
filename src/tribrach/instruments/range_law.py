"""Noise of ranges as a law of intensity, ``s_rho = a I^b + c`` (method section 5.2).

What comes back of the light is what a detector sees of a surface: range, incidence and reflectance
act on the noise of a range through it (Wujanz et al. 2017, 2018; Schmitz et al. 2019), so that one
law of the intensity takes the place of figures for each of them. Intensities are those of the file,
whatever they mean there: a law holds for one scanner, one mode of it and one way of exporting.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tribrach._types import Array
from tribrach.answers import Result
from tribrach.errors import InputError
from tribrach.sentences import Sentence
from tribrach.units import span

__all__ = ["RangeLaw"]

#: the law is continued to intensities weaker than those it was estimated from by this factor
_WEAKER = 10.0


@dataclass(frozen=True)
class RangeLaw(Result):
    """Standard deviation of a range as a function of its intensity.

    Attributes
    ----------
    a
        Factor of the power [m] at an intensity of one.
    b
        Exponent, zero or negative: more light is less noise.
    c
        What no light takes away [m].
    low, high
        Intensities that the law was estimated from, above zero. It is continued to weaker ones down
        to a tenth of ``low``, where a constant would understate, and constant beyond.

    Raises
    ------
    InputError
        A figure that no such law has.
    """

    a: float
    b: float
    c: float
    low: float
    high: float

    def __post_init__(self) -> None:
        """Refuse what gives no standard deviation."""
        figures = (self.a, self.b, self.c, self.low, self.high)
        wrong = ""
        if not np.isfinite(figures).all():
            wrong = "figures that are no numbers"
        elif self.a < 0 or self.c < 0 or self.b > 0:
            wrong = f"a = {self.a:g}, b = {self.b:g}, c = {self.c:g}"
        elif not 0 < self.low < self.high:
            wrong = f"intensities from {self.low:g} to {self.high:g}"
        else:
            with np.errstate(over="ignore"):
                best, worst = self.sigma(np.array([self.high, self.weakest]))
            if not (best > 0 and worst < np.inf):
                wrong = f"sigmas from {best:g} to {worst:g} m"
        if wrong:
            raise InputError(
                f"the law of the noise of ranges has {wrong}",
                cure="give a and c of zero or above, not both zero, b of zero or below, and "
                "intensities above zero, the lower one first",
            )

    def sigma(self, intensity: ArrayLike) -> Array:
        """Evaluate the law.

        Parameters
        ----------
        intensity : array_like (n,)
            Intensities as in the file.

        Returns
        -------
        array (n,)
            Standard deviations of ranges [m]; NaN where the intensity is.
        """
        light = np.clip(np.asarray(intensity, dtype=np.float64), self.weakest, self.high)
        out: Array = self.a * light**self.b + self.c
        return out

    @property
    def weakest(self) -> float:
        """Intensity from which downwards the law is constant."""
        return self.low / _WEAKER

    def outside(self, intensity: ArrayLike) -> int:
        """Count intensities (n,) beyond those that the law was estimated from, or unknown."""
        light = np.asarray(intensity)
        return int(len(light) - np.count_nonzero((light >= self.low) & (light <= self.high)))

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest standard deviation between its intensities [m]."""
        best, worst = self.sigma(np.array([self.high, self.low]))
        return float(best), float(worst)

    @property
    def words(self) -> str:
        """The law in words, for facts and reports."""
        return Sentence(
            "ranges {own.a:mmg3} · I^{own.b:g3} + {own.c:mmg3} for intensities I from {span}",
            own=self,
            span=span(self.low, self.high),
        )
