"""Calibration models of scanners as column generators.

``true = measured + Delta(R, H, V; c, k)`` with range R [m], horizontal angle H (counter-clockwise)
and zenith angle V [rad], face k = +1 front, -1 back. Every model is linear in its parameters c,
``Delta = B c``; a model is a list of named columns of B (3 rows: range, H, V). Angles are zenith
angles always, except where a model exists to reproduce a publication (method sections 4.1, 4.3).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError

__all__ = ["NIST", "PAPER_EIGHT", "PAPER_EIGHT_ELEVATION", "CalibrationModel", "lichti"]

Array = NDArray[np.float64]
#: range, H, V (complex where differentiated), face -> contributions to range, H, V
Column = Callable[[Any, Any, Any, Any], tuple[Any, Any, Any]]


@dataclass(frozen=True)
class CalibrationModel:
    """Named parameters and the column of each."""

    name: str
    parameters: tuple[str, ...]
    functions: tuple[Column, ...]

    def select(self, parameters: Sequence[str]) -> CalibrationModel:
        """The model with some of its parameters only.

        Raises
        ------
        InputError : a parameter that the model does not have.
        """
        unknown = [p for p in parameters if p not in self.parameters]
        if unknown:
            raise InputError(
                f"calibration model {self.name} has no parameter {unknown[0]}",
                cure=f"choose from {', '.join(self.parameters)}",
            )
        chosen = tuple(self.functions[self.parameters.index(p)] for p in parameters)
        return CalibrationModel(self.name, tuple(parameters), chosen)

    def joined(self, other: CalibrationModel) -> CalibrationModel:
        """Both parameter lists, each parameter once."""
        new = [k for k, name in enumerate(other.parameters) if name not in self.parameters]
        return CalibrationModel(
            self.name,
            (*self.parameters, *(other.parameters[k] for k in new)),
            (*self.functions, *(other.functions[k] for k in new)),
        )

    def columns(self, r: Any, h: Any, v: Any, face: Any) -> NDArray[Any]:
        """``B`` (n, 3, k) at ranges, horizontal and zenith angles (n,) and faces (n,) of +-1."""
        kind = np.result_type(r, h, v, float)
        out = np.zeros((len(r), 3, len(self.functions)), dtype=kind)
        for k, function in enumerate(self.functions):
            for row, part in enumerate(function(r, h, v, face)):
                out[:, row, k] = part
        return out

    def delta(self, polar: Array, face: Array, c: Array) -> Array:
        """``Delta`` (n, 3) at polar coordinates (n, 3) with parameters (n, k)."""
        r, h, v = polar.T
        b = self.columns(r, h, v, face)
        delta: Array = np.einsum("nik,nk->ni", b, c)
        return delta

    def derivative(self, polar: Array, face: Array, c: Array) -> Array:
        """``dDelta/d(R, H, V)`` (n, 3, 3), exact to rounding (complex step)."""
        out = np.empty((len(polar), 3, 3))
        step = 1e-30
        for axis in range(3):
            moved = polar.astype(complex)
            moved[:, axis] += 1j * step
            r, h, v = moved.T
            b = self.columns(r, h, v, face)
            out[:, :, axis] = np.einsum("nik,nk->ni", b.imag, c) / step
        return out


def _nist() -> CalibrationModel:
    """The 18-parameter panoramic model (Muralikrishnan et al. 2015; method section 4.1)."""
    sin, cos, tan = np.sin, np.cos, np.tan
    table: dict[str, Column] = {
        "x1n": lambda r, h, v, k: (0, -1 / r, k * cos(v) / r),
        "x1z": lambda r, h, v, k: (0, -k / (r * tan(v)), -sin(v) / r),
        "x2": lambda r, h, v, k: (k * sin(v), 0, k * cos(v) / r),
        "x3": lambda r, h, v, k: (0, k / (r * sin(v)), 0),
        "x4": lambda r, h, v, k: (0, 0, k),
        "x5n": lambda r, h, v, k: (0, -1, k * cos(v)),
        "x5z": lambda r, h, v, k: (0, -k / tan(v), -sin(v)),
        "x6": lambda r, h, v, k: (0, 2 * k / sin(v), 0),
        "x7": lambda r, h, v, k: (0, -k / tan(v), 0),
        "x8x": lambda r, h, v, k: (0, k * sin(h), 0),
        "x8y": lambda r, h, v, k: (0, -k * cos(h), 0),
        "x9n": lambda r, h, v, k: (0, 0, k * cos(v)),
        "x9z": lambda r, h, v, k: (0, 0, -sin(v)),
        "x10": lambda r, h, v, k: (1, 0, 0),
        "x11a": lambda r, h, v, k: (0, cos(2 * h), 0),
        "x11b": lambda r, h, v, k: (0, sin(2 * h), 0),
        "x12a": lambda r, h, v, k: (0, 0, k * cos(2 * v)),
        "x12b": lambda r, h, v, k: (0, 0, sin(2 * v)),
    }
    return CalibrationModel("NIST", tuple(table), tuple(table.values()))


def _paper_eight() -> CalibrationModel:
    """Three constants and five physical parameters (Sabzali & Pilgrim 2023), zenith angles."""
    sin, cos = np.sin, np.cos
    table: dict[str, Column] = {
        "E_R": lambda r, h, v, k: (1, 0, 0),
        "E_H": lambda r, h, v, k: (0, 1, 0),
        "E_V": lambda r, h, v, k: (0, 0, 1),
        "a1": lambda r, h, v, k: (1, 0, 0),
        "a2": lambda r, h, v, k: (k * sin(v), 0, k * cos(v) / r),
        "a3": lambda r, h, v, k: (0, 0, k),
        "a4": lambda r, h, v, k: (0, k / (r * sin(v)), 0),
        "a5": lambda r, h, v, k: (0, 2 * k / sin(v), 0),
    }
    return CalibrationModel("paper eight", tuple(table), tuple(table.values()))


def _paper_eight_elevation() -> CalibrationModel:
    """The same equations with the elevation in place of the zenith angle, as printed.

    They are degenerate (a2 is a vertical shift of the scanner) and serve to reproduce the
    publication only. Corrections of the elevation change the sign of those of V.
    """
    table: dict[str, Column] = {}
    zenith = _paper_eight()
    for name, function in zip(zenith.parameters, zenith.functions, strict=True):
        table[name] = _with_elevation(function)
    return CalibrationModel("paper eight, elevation", tuple(table), tuple(table.values()))


def _with_elevation(function: Column) -> Column:
    def column(r: Any, h: Any, v: Any, k: Any) -> tuple[Any, Any, Any]:
        range_part, h_part, elevation_part = function(r, h, np.pi / 2 - v, k)
        return range_part, h_part, -elevation_part

    return column


def lichti(unit_1: float, unit_2: float) -> CalibrationModel:
    """The additive parameters of Lichti (2006, 2007) with unit lengths [m] of the range modulation.

    They are written for the raw circle: ``measured = model + sum`` in horizontal angle ``th`` and
    elevation ``al``, which runs on over the zenith on the back face. A1 is a scale of ranges and is
    seen by external lengths only. Method section 4.2.
    """
    sin, cos, tan = np.sin, np.cos, np.tan
    one, two = 4 * np.pi / unit_1, 4 * np.pi / unit_2
    rows: tuple[dict[str, Callable[[Any, Any, Any], Any]], ...] = (
        {
            "A0": lambda r, th, al: np.ones_like(r),
            "A1": lambda r, th, al: r,
            "A2": lambda r, th, al: sin(al),
            "A3": lambda r, th, al: sin(one * r),
            "A4": lambda r, th, al: cos(one * r),
            "A5": lambda r, th, al: sin(two * r),
            "A6": lambda r, th, al: cos(two * r),
            "A7": lambda r, th, al: sin(4 * th),
            "A8": lambda r, th, al: cos(4 * th),
        },
        {
            "B2": lambda r, th, al: sin(th),
            "B3": lambda r, th, al: cos(th),
            "B4": lambda r, th, al: sin(2 * th),
            "B5": lambda r, th, al: cos(2 * th),
            "B6": lambda r, th, al: 1 / cos(al),
            "B7": lambda r, th, al: tan(al),
            "B8": lambda r, th, al: 1 / r,
            "B9": lambda r, th, al: sin(al),
            "B10": lambda r, th, al: cos(al),
        },
        {
            "C0": lambda r, th, al: np.ones_like(al),
            "C1": lambda r, th, al: al,
            "C2": lambda r, th, al: sin(al),
            "C3": lambda r, th, al: sin(2 * al),
            "C4": lambda r, th, al: 1 / r,
            "C5": lambda r, th, al: sin(2 * th),
            "C6": lambda r, th, al: cos(2 * th),
        },
    )
    table = {
        name: _on_raw_circle(row, function)
        for row, functions in enumerate(rows)
        for name, function in functions.items()
    }
    return CalibrationModel("Lichti", tuple(table), tuple(table.values()))


def _on_raw_circle(row: int, function: Callable[[Any, Any, Any], Any]) -> Column:
    """An additive term of one row, in raw angles, as corrections of the folded readings."""

    def column(r: Any, h: Any, v: Any, k: Any) -> tuple[Any, Any, Any]:
        part = function(r, h + np.where(k < 0, np.pi, 0.0), np.pi / 2 - k * v)
        # the folded zenith angle falls with the raw elevation in front and grows with it behind
        return (-part, 0, 0) if row == 0 else (0, -part, 0) if row == 1 else (0, 0, k * part)

    return column


NIST = _nist()
PAPER_EIGHT = _paper_eight()
PAPER_EIGHT_ELEVATION = _paper_eight_elevation()
