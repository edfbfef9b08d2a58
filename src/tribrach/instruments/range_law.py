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

#: the law is continued to intensities weaker than those it was estimated from by this factor
_WEAKER = 10.0


@dataclass(frozen=True)
class RangeLaw(Result):
    """Standard deviation of a range as a function of its intensity."""

    a: float  #: factor of the power [m] at an intensity of one
    b: float  #: exponent, zero or negative: more light is less noise
    c: float  #: what no light takes away [m]
    #: intensities that the law was estimated from, above zero. It is continued to weaker ones down
    #: to a tenth of ``low``, where a constant would understate, and constant beyond
    low: float
    high: float
    #: a term that the power is multiplied with: factors at intensities that grow, linear in the
    #: logarithm of the intensity between them and constant beyond. None for the power alone
    knots: tuple[float, ...] = ()
    factors: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what gives no standard deviation."""
        figures = (self.a, self.b, self.c, self.low, self.high, *self.knots, *self.factors)
        wrong = ""
        if not np.isfinite(figures).all():
            wrong = "figures that are no numbers"
        elif self.a < 0 or self.c < 0 or self.b > 0:
            wrong = f"a = {self.a:g}, b = {self.b:g}, c = {self.c:g}"
        elif not 0 < self.low < self.high:
            wrong = f"intensities from {self.low:g} to {self.high:g}"
        elif len(self.knots) != len(self.factors) or len(self.knots) == 1:
            wrong = f"{len(self.knots)} knots and {len(self.factors)} factors"
        elif self.knots and not (
            min(*self.knots, *self.factors) > 0 and (np.diff(self.knots) > 0).all()
        ):
            wrong = "knots that do not grow, or factors of zero or below"
        else:
            with np.errstate(over="ignore"):
                sigmas = self.sigma(np.array([self.high, self.weakest, *self.knots]))
            if not (min(sigmas) > 0 and max(sigmas) < np.inf):
                wrong = f"sigmas from {min(sigmas):g} to {max(sigmas):g} m"
        if wrong:
            raise InputError(
                f"the law of the noise of ranges has {wrong}",
                cure="give a and c of zero or above, not both zero, b of zero or below, and "
                "intensities above zero, the lower one first",
            )

    def sigma(self, intensity: ArrayLike) -> Array:
        """Sigmas of ranges (n,) [m] at intensities (n,) as in the file; NaN where these are."""
        light = np.clip(np.asarray(intensity, dtype=np.float64), self.weakest, self.high)
        out: Array = self.a * light**self.b + self.c
        if self.knots:
            with np.errstate(invalid="ignore"):
                out = out * np.interp(np.log(light), np.log(self.knots), self.factors)
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
        inside = [k for k in self.knots if self.low < k < self.high]
        sigmas = self.sigma(np.array([self.high, self.low, *inside]))
        return float(sigmas.min()), float(sigmas.max())

    @property
    def words(self) -> str:
        """The law in words, for facts and reports."""
        return Sentence(
            "ranges {form} for intensities I from {span}",
            form=Sentence("{own.a:mmg3} · I^{own.b:g3} + {own.c:mmg3}", own=self)
            if not self.knots
            else Sentence(
                "({own.a:mmg3} · I^{own.b:g3} + {own.c:mmg3}) times {least:g2} to {most:g2} at "
                "{count} knots",
                own=self,
                least=min(self.factors),
                most=max(self.factors),
                count=len(self.knots),
            ),
            span=span(self.low, self.high),
        )
