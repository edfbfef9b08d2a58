"""Light that comes back from a range: the lidar equation with its reduction at short range.

Method section 5.6. A rough surface that fills the beam returns light by ``1 / rho^2``; close to the
instrument its image is out of focus and partly on the mirror that sends the beam out, so that less
of it falls on the detector (Höfle and Pfeifer 2007; Kaasalainen et al. 2011; Fang et al. 2015).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import minimize_scalar

from tribrach._types import Array
from tribrach.errors import InputError


@dataclass(frozen=True)
class FallOff:
    """Light received as a function of the range, 1 where it is strongest."""

    blind: float  #: range up to which nothing falls on the detector [m]
    #: from there, range within which the image is so far out of focus that a share of ``1 - 1/e``
    #: of it or less falls on the detector [m]
    focus: float

    def __post_init__(self) -> None:
        """Refuse ranges that are none."""
        if not (0 <= self.blind < np.inf and 0 < self.focus < np.inf):
            raise InputError(
                f"light that falls off from {self.blind:g} m and {self.focus:g} m on",
                cure="give zero or more for the first and more than zero for the second",
            )

    def at(self, length: Array) -> Array:
        """Shares of the light at the best range."""
        return np.asarray(self._received(length) / self._most)

    @cached_property
    def best(self) -> float:
        """Range from which most light comes back [m]."""
        found = minimize_scalar(
            lambda x: -float(self._received(np.array([self.blind + x]))[0]),
            bounds=(0.0, 2 * (self.blind + self.focus)),
            method="bounded",
        )
        return self.blind + float(found.x)

    @cached_property
    def _most(self) -> float:
        return float(self._received(np.array([self.best]))[0])

    def _received(self, length: Array) -> Array:
        """``eta(rho) / rho^2`` (n,)."""
        beyond = np.maximum(length - self.blind, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            light = -np.expm1(-((beyond / self.focus) ** 2)) / np.square(length)
        return np.where(beyond > 0, light, 0.0)
