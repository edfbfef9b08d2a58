"""Calibration models of scanners: what each parameter does to range and angles.

``true = measured + Delta(R, H, V; c, k)`` with range R [m], horizontal angle H (counter-clockwise)
and zenith angle V [rad], face k = +1 front, -1 back. Every model is linear in its parameters c,
``Delta = B c``; a model is a list of named columns of B (3 rows: range, H, V). Angles are always
zenith angles, except where a model exists to reproduce a publication (method sections 4.1, 4.3).

Models go by name: ``nist`` has all 18 parameters of the panoramic model, ``high-end`` the ten that
two stations and two faces can separate (Medic et al. 2019; method section 4.1), ``paper`` and
``paper-elevation`` the eight of Sabzali & Pilgrim (2023), ``lichti`` the additive set. A
*panoramic* scanner has a mirror that looks on over the zenith and a back face; a *hybrid* one
turns full circle with one face only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError

#: range, H, V (complex where differentiated), face -> contributions to range, H, V
Column = Callable[[Any, Any, Any, Any], tuple[Any, Any, Any]]
Unit = Literal["m", "rad", "1"]
Architecture = Literal["panoramic", "hybrid"]

#: names that :func:`find_model` knows
MODELS = ("nist", "high-end", "paper", "paper-elevation", "lichti")
#: the default of high-end panoramic scanners: x7 stands for x5z; x1n, x5n and x5z for their sums
HIGH_END = ("x10", "x2", "x1z", "x3", "x7", "x6", "x1n", "x4", "x9n", "x9z")
#: the order in which parameters are kept where not all can be: plain physical meaning first
ORDER = (
    "x10", "x2", "x4", "x6", "x3", "x7", "x1n", "x1z", "x9n", "x9z", "x5n", "x5z",
    "x8x", "x8y", "x11a", "x11b", "x12a", "x12b",
    "a1", "a3", "a5", "a4", "a2", "E_R", "E_V", "E_H",
    "A0", "B6", "B7", "C0", "A2", "B2", "B3", "B4", "B5", "C2", "C5", "C6",
    "B8", "C4", "A3", "A4", "A5", "A6", "A7", "A8", "B9", "B10", "C1", "C3", "A1",
)  # fmt: skip
#: parameters in metres; the others are angles, except for the scales A1 and C1
_METRES = {
    "x1n", "x1z", "x2", "x3", "x10", "E_R", "a1", "a2", "a4",
    "A0", "A2", "A3", "A4", "A5", "A6", "A7", "A8", "B8", "C4",
}  # fmt: skip
#: parameters that are always refused, with the reason
_NEVER = {
    "B1": "a scale of the horizontal circle cannot be: the circle closes after a full turn",
}


#: what each parameter is (Muralikrishnan et al. 2015; Sabzali and Pilgrim 2023; Lichti 2007)
_MEANINGS = {
    "x1n": "beam offset, first component",
    "x1z": "beam offset, second component",
    "x2": "offset of the trunnion axis",
    "x3": "mirror offset",
    "x4": "index of the vertical circle",
    "x5n": "beam tilt, first component",
    "x5z": "beam tilt, second component",
    "x6": "mirror tilt (collimation)",
    "x7": "tilt of the trunnion axis",
    "x8x": "eccentricity of the horizontal circle, x",
    "x8y": "eccentricity of the horizontal circle, y",
    "x9n": "eccentricity of the vertical circle, first component",
    "x9z": "eccentricity of the vertical circle, second component",
    "x10": "range zero",
    "x11a": "second order of the horizontal circle, cosine",
    "x11b": "second order of the horizontal circle, sine",
    "x12a": "second order of the vertical circle, cosine",
    "x12b": "second order of the vertical circle, sine",
    "E_R": "constant of the range",
    "E_H": "constant of the horizontal angle",
    "E_V": "constant of the vertical angle",
    "a1": "range zero",
    "a2": "offset of the trunnion axis",
    "a3": "index of the vertical circle",
    "a4": "mirror offset",
    "a5": "mirror tilt (collimation)",
    "A0": "range zero",
    "A1": "range scale",
    "A2": "vertical offset of the laser axis",
    "A3": "cyclic range error, first unit length, sine",
    "A4": "cyclic range error, first unit length, cosine",
    "A5": "cyclic range error, second unit length, sine",
    "A6": "cyclic range error, second unit length, cosine",
    "A7": "range with the horizontal angle, empirical, sine",
    "A8": "range with the horizontal angle, empirical, cosine",
    "B2": "eccentricity of the horizontal circle, sine",
    "B3": "eccentricity of the horizontal circle, cosine",
    "B4": "horizontal circle not square to its axis, sine",
    "B5": "horizontal circle not square to its axis, cosine",
    "B6": "collimation axis error",
    "B7": "trunnion axis error",
    "B8": "horizontal eccentricity of the collimation axis",
    "B9": "horizontal angle with the elevation, empirical, sine",
    "B10": "horizontal angle with the elevation, empirical, cosine",
    "C0": "index of the vertical circle",
    "C1": "scale of the vertical circle",
    "C2": "eccentricity of the vertical circle, sine",
    "C3": "vertical circle not square to its axis, sine",
    "C4": "vertical eccentricity of the collimation axis",
    "C5": "elevation with the horizontal angle, empirical, sine",
    "C6": "elevation with the horizontal angle, empirical, cosine",
}


@dataclass(frozen=True)
class CalibrationModel:
    """A calibration model."""

    name: str  #: as in reports
    parameters: tuple[str, ...]  #: names of its parameters
    #: the column of each parameter: (range, H, V, face) to its contributions to range, H, V
    functions: tuple[Column, ...]
    key: str = ""  #: what :func:`find_model` knows it by, empty if it does not
    #: of the modulation of the range [m], where the model has them
    unit_lengths: tuple[float, ...] = ()
    #: start and turn of the head [rad], where a tilt drifts with it
    sweep: tuple[float, ...] = ()

    def select(self, parameters: Sequence[str]) -> CalibrationModel:
        """The model with some of its parameters only, in the given order."""
        unknown = [p for p in parameters if p not in self.parameters]
        if unknown:
            raise InputError(
                f"calibration model {self.name} has no parameter {unknown[0]}",
                cure=f"choose from {', '.join(self.parameters)}",
            )
        chosen = tuple(self.functions[self.parameters.index(p)] for p in parameters)
        return replace(self, parameters=tuple(parameters), functions=chosen)

    def joined(self, other: CalibrationModel) -> CalibrationModel:
        """A model with the parameters of both, each once."""
        new = [k for k, name in enumerate(other.parameters) if name not in self.parameters]
        return replace(
            self,
            parameters=(*self.parameters, *(other.parameters[k] for k in new)),
            functions=(*self.functions, *(other.functions[k] for k in new)),
            sweep=self.sweep or other.sweep,
        )

    def columns(self, r: Any, h: Any, v: Any, face: Any) -> NDArray[Any]:
        """The matrix ``B`` (n, 3, k) at readings.

        ``r`` (n,): ranges [m]; ``h``, ``v`` (n,): horizontal and zenith angles [rad]; all three may
        be complex; ``face`` (n,): +1 front, -1 back.
        """
        kind = np.result_type(r, h, v, float)
        out = np.zeros((len(r), 3, len(self.functions)), dtype=kind)
        for k, function in enumerate(self.functions):
            for row, part in enumerate(function(r, h, v, face)):
                out[:, row, k] = part
        return out

    def delta(self, polar: Array, face: Array, c: Array) -> Array:
        """Corrections ``Delta`` (n, 3) of range [m], H and V [rad].

        ``polar`` (n, 3): range [m], H and V [rad]; ``face`` (n,): +1 front, -1 back; ``c`` (n, k):
        parameters at each reading.
        """
        r, h, v = polar.T
        b = self.columns(r, h, v, face)
        delta: Array = np.einsum("nik,nk->ni", b, c)
        return delta

    def derivative(self, polar: Array, face: Array, c: Array) -> Array:
        """Derivative ``dDelta/d(R, H, V)`` (n, 3, 3), exact to rounding (complex step).

        ``polar`` (n, 3): range [m], H and V [rad]; ``face`` (n,): +1 front, -1 back; ``c`` (n, k):
        parameters at each reading.
        """
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
    return CalibrationModel("NIST", tuple(table), tuple(table.values()), "nist")


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
    return CalibrationModel("paper eight", tuple(table), tuple(table.values()), "paper")


def _paper_eight_elevation() -> CalibrationModel:
    """The same equations with the elevation in place of the zenith angle, as printed.

    They are degenerate (a2 is a vertical shift of the scanner) and serve to reproduce the
    publication only. Corrections of the elevation change the sign of those of V.
    """
    table: dict[str, Column] = {}
    zenith = _paper_eight()
    for name, function in zip(zenith.parameters, zenith.functions, strict=True):
        table[name] = _with_elevation(function)
    columns = tuple(table.values())
    return CalibrationModel("paper eight, elevation", tuple(table), columns, "paper-elevation")


def _with_elevation(function: Column) -> Column:
    """A column written for the elevation, as one for the zenith angle."""

    def column(r: Any, h: Any, v: Any, k: Any) -> tuple[Any, Any, Any]:
        range_part, h_part, elevation_part = function(r, h, np.pi / 2 - v, k)
        return range_part, h_part, -elevation_part

    return column


def lichti(unit_1: float, unit_2: float) -> CalibrationModel:
    """The additive parameters of Lichti (2006, 2007).

    They are written for the raw circle: ``measured = model + sum`` in horizontal angle ``th`` and
    elevation ``al``, which runs on over the zenith on the back face. A1 is a scale of ranges and
    can be determined by external lengths only. Method section 4.2.

    ``unit_1``, ``unit_2``: unit lengths of the modulation of the range [m], for A3 to A6.
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
    units = (unit_1, unit_2)
    return CalibrationModel("Lichti", tuple(table), tuple(table.values()), "lichti", units)


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


def unit_of(parameter: str) -> Unit:
    """Unit of a parameter: metres, radians, or one for the scales A1 and C1."""
    if parameter in ("A1", "C1"):
        return "1"
    return "m" if parameter in _METRES else "rad"


def meaning_of(parameter: str) -> str:
    """A parameter in words of makers, such as ``collimation axis error`` (method section 4.1)."""
    return _MEANINGS.get(parameter, "drift of the tilt during a scan")


def find_model(
    name: str, parameters: Sequence[str] = (), unit_lengths: Sequence[float] = ()
) -> CalibrationModel:
    """A model by its name, with some of its parameters only if any are named.

    ``parameters``: those to keep, in this order; all if empty; ``unit_lengths``: two unit lengths
    of the modulation of the range [m], for the terms A3 to A6 of ``lichti``.
    """
    if name not in MODELS:
        raise InputError(
            f"there is no calibration model {name}", cure=f"choose from {', '.join(MODELS)}"
        )
    for parameter in parameters:
        if name == "lichti" and parameter in _NEVER:
            raise InputError(f"parameter {parameter} is refused: {_NEVER[parameter]}")
        if list(parameters).count(parameter) > 1:
            raise InputError(f"parameter {parameter} is named twice", cure="name it once")
    if name == "lichti":
        model = _lichti(parameters, unit_lengths)
    elif unit_lengths:
        raise InputError(f"calibration model {name} has no unit lengths", cure="leave them out")
    else:
        model = {
            "nist": NIST,
            "high-end": NIST.select(HIGH_END),
            "paper": PAPER_EIGHT,
            "paper-elevation": PAPER_EIGHT_ELEVATION,
        }[name]
    if not parameters:
        return model
    whole = NIST if name == "high-end" else model
    return whole.select(tuple(parameters))


def _lichti(parameters: Sequence[str], unit_lengths: Sequence[float]) -> CalibrationModel:
    """The additive model; without unit lengths its cyclic terms are left out."""
    if len(unit_lengths) not in (0, 2) or any(not u > 0 for u in unit_lengths):
        raise InputError(
            "the additive set has two unit lengths above zero",
            cure="give both in metres, or none and no parameters A3 to A6",
        )
    if unit_lengths:
        return _lichti_of(float(unit_lengths[0]), float(unit_lengths[1]))
    cyclic = ("A3", "A4", "A5", "A6")
    wanted = [p for p in parameters if p in cyclic]
    if wanted:
        raise InputError(
            f"parameter {wanted[0]} needs the unit lengths of the range finder",
            cure="give unit_lengths_m",
        )
    whole = _lichti_of(1.0, 1.0)
    plain = whole.select([p for p in whole.parameters if p not in cyclic])
    return replace(plain, unit_lengths=())


@cache
def _lichti_of(first: float, second: float) -> CalibrationModel:
    """One object per pair of unit lengths, so that observations of one instrument stay together."""
    return lichti(first, second)
