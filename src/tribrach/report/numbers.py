"""How numbers are written: the one place for units, digits, and what is no number.

Lengths in metres, their residuals and sigmas in millimetres; angles in gon with residuals in
mgon, or in degrees, minutes and seconds with residuals in arc seconds. What is NaN or infinite
inside is None in a report and null in its JSON.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tribrach._types import Array
from tribrach.report.tables import Cell, number_cell
from tribrach.sentences import Sentence
from tribrach.units import SEC, UNITS, format_angle


def number(value: float) -> float | None:
    """A float, None for NaN and infinities; minus zero loses its sign."""
    value = float(value)
    return value + 0.0 if math.isfinite(value) else None


def numbers(values: Iterable[float]) -> tuple[float | None, ...]:
    """Floats, None for NaN and infinities."""
    # items of a list are floats already, those of an array become so one by one
    items = values.tolist() if isinstance(values, np.ndarray) else values
    return tuple([number(value) for value in items])


def triple(values: Array) -> tuple[float | None, float | None, float | None]:
    """Three floats, None for NaN."""
    a, b, c = values.tolist()
    return (number(a), number(b), number(c))


def matrix(values: Array) -> tuple[tuple[float | None, ...], ...]:
    """Rows of floats, None for NaN."""
    return tuple([numbers(row) for row in values.tolist()])


def triples(values: Array) -> list[tuple[float | None, float | None, float | None]]:
    """:func:`triple` of many (n, 3) at once."""
    if not np.isfinite(values).all():
        return [triple(row) for row in values]
    return [(a, b, c) for a, b, c in (values + 0.0).tolist()]


def matrices(values: Array) -> list[tuple[tuple[float | None, ...], ...]]:
    """:func:`matrix` of many (n, r, c) at once."""
    if not np.isfinite(values).all():
        return [matrix(block) for block in values]
    return [tuple([tuple(row) for row in block]) for block in (values + 0.0).tolist()]


def sigmas(covariance: Array) -> Array:
    """Standard deviations (..., k) of covariances (..., k, k); NaN where a value is held."""
    variance = np.einsum("...ii->...i", covariance)
    return np.sqrt(np.where(variance > 0, variance, np.nan))


@dataclass(frozen=True)
class Style:
    """Formats values and small quantities by unit."""

    angle: Literal["gon", "deg"] = "gon"  #: how angles are written

    def value(self, value: float | None, unit: str, *, full_circle: bool = False) -> str:
        """A measured or estimated value: metres, the angle unit, or a plain number."""
        if value is None or math.isnan(value):
            return ""
        if unit == "rad":
            turned = value % (2 * math.pi) if full_circle else value
            return self._angle(turned)
        return _fixed(value, 4) if unit == "m" else f"{value:.8g}"

    def _angle(self, value: float) -> str:
        if self.angle == "gon":
            return format_angle(value, "gon", 5)
        return format_angle(value, "dms", 1)

    @staticmethod
    def ratio(value: float) -> str:
        """A measured ratio in percent, to the ppm in which its sigma stands."""
        return f"{_fixed(100 * value, 4)} %"

    def value_unit(self, unit: str) -> str:
        """Unit of :meth:`value`."""
        return {"m": "m", "rad": "gon" if self.angle == "gon" else "° ′ ″"}.get(unit, "")

    def scale(self, unit: str) -> float:
        """Factor from metres, radians or one to the unit of :meth:`small`."""
        if unit == "rad":
            return 1 / (UNITS["mgon"] if self.angle == "gon" else SEC)
        return 1e3 if unit == "m" else 1e6

    def small(self, value: float | None, unit: str, digits: int = 2) -> str:
        """A residual, sigma or bias in :meth:`small_unit`; a digit more where it tells more."""
        if value is None or math.isnan(value):
            return ""
        scaled = value * self.scale(unit)
        return _fixed(scaled, _digits(scaled, digits)) if abs(scaled) < 1e7 else f"{scaled:.3g}"

    def said(self, value: float, unit: str, digits: int = 2) -> Sentence:
        """A quantity as :meth:`small` has it, in a sentence."""
        size = abs(value * self.scale(unit))
        form = f"{_digits(size, digits)}" if size < 1e7 else "g3"
        return Sentence(f"{{value:{self.small_unit(unit)}{form}}}", value=value + 0.0)

    def small_unit(self, unit: str) -> str:
        """Unit of :meth:`small`."""
        return {"m": "mm", "rad": "mgon" if self.angle == "gon" else "″"}.get(unit, "ppm")

    @staticmethod
    def plain(value: float | None, digits: int = 2) -> str:
        """A number without a unit."""
        return "" if value is None or math.isnan(value) else _fixed(value, digits)


def _digits(value: float, digits: int) -> int:
    """One digit more for what is small, and none for what is zero but for rounding."""
    return digits + (0.05 <= abs(value) * 10.0**digits < 5.0)


def _fixed(value: float, digits: int) -> str:
    """Fixed digits; what rounds to zero has no sign."""
    text = f"{value:.{digits}f}"
    return text.lstrip("-") if float(text) == 0 else text


def chance(p: float) -> str:
    """A probability of a test as tables have it: two digits, and none below a ten-thousandth."""
    if p < 1e-4:
        return "< 0.0001"
    return f"{p:.{min(4, max(2, 1 - math.floor(math.log10(p))))}f}"


def counted(n: int, noun: str, plural: str = "") -> str:
    """A number of things in words: 1 loop, 2 loops; 1 patch, 2 patches."""
    return f"{n} {noun}" if n == 1 else f"{n} {plural or f'{noun}s'}"


def fixed_cell(value: float | None, digits: int, mark: str = "") -> Cell:
    """A number with fixed digits as a cell; empty if there is none."""
    return number_cell(value, "" if value is None else _fixed(value, digits), mark)


def three_digits(value: float, *, zeros: bool = False) -> str:
    """A figure with three digits, without powers of ten: 0.0123; ``zeros`` stay: 2.40."""
    if abs(value) >= 999.5:
        return f"{float(f'{value:.3g}'):.0f}"
    return f"{value:#.3g}".rstrip(".") if zeros else f"{value:.3g}"


def mm_cell(value: float | None, digits: int = 2) -> Cell:
    """A length [m] as a cell in millimetres, which sorts by metres."""
    return number_cell(value, "" if value is None else _fixed(1e3 * value, digits))


def percent_cell(share: float | None, digits: int = 1) -> Cell:
    """A share as a cell in per cent."""
    return number_cell(share, "" if share is None else f"{100 * share:.{digits}f}")
