"""How numbers are written for people: one place for units and digits.

Lengths in metres, their residuals and sigmas in millimetres; angles in gon with residuals in
mgon, or in degrees, minutes and seconds with residuals in arc seconds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from tribrach.units import SEC, UNITS, format_angle

__all__ = ["Style"]

#: kinds whose values are read on a full circle
_CIRCLE = {"direction", "azimuth", "angle", "orientation", "heading"}


@dataclass(frozen=True)
class Style:
    """Formats values and small quantities by unit; ``angle`` is ``gon`` or ``deg``."""

    angle: Literal["gon", "deg"] = "gon"

    def value(self, value: float | None, unit: str, kind: str = "") -> str:
        """A measured or estimated value: metres, the angle unit, or a plain number."""
        if value is None:
            return ""
        if unit == "rad":
            turned = value % (2 * math.pi) if kind in _CIRCLE else value
            return self._angle(turned)
        return f"{value:.4f}" if unit == "m" else f"{value:.8g}"

    def _angle(self, value: float) -> str:
        if self.angle == "gon":
            return format_angle(value, "gon", 5)
        return format_angle(value, "dms", 1)

    def value_unit(self, unit: str) -> str:
        """Unit of :meth:`value`."""
        return {"m": "m", "rad": "gon" if self.angle == "gon" else "° ′ ″"}.get(unit, "")

    def scale(self, unit: str) -> float:
        """Factor from metres, radians or one to the unit of :meth:`small`."""
        if unit == "rad":
            return 1 / (UNITS["mgon"] if self.angle == "gon" else SEC)
        return 1e3 if unit == "m" else 1e6

    def small(self, value: float | None, unit: str, digits: int = 2) -> str:
        """A residual, sigma or bias in :meth:`small_unit`; more digits where all would be zero."""
        if value is None:
            return ""
        scaled = value * self.scale(unit)
        if scaled and abs(scaled) < 0.5 * 10.0 ** (1 - digits):
            digits = digits + 1
        return _fixed(scaled, digits) if abs(scaled) < 1e7 else f"{scaled:.3g}"

    def small_unit(self, unit: str) -> str:
        """Unit of :meth:`small`."""
        return {"m": "mm", "rad": "mgon" if self.angle == "gon" else "″"}.get(unit, "ppm")

    @staticmethod
    def plain(value: float | None, digits: int = 2) -> str:
        """A number without a unit."""
        return "" if value is None else _fixed(value, digits)


def _fixed(value: float, digits: int) -> str:
    """Fixed digits; what rounds to zero has no sign."""
    text = f"{value:.{digits}f}"
    return text.lstrip("-") if float(text) == 0 else text
