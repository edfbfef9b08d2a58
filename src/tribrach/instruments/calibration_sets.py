"""Calibration models by name, the units of their parameters, and which are taken first.

``nist`` has all 18 parameters of the panoramic model, ``high-end`` the ten that two stations and
two faces can part (Medic et al. 2019; method section 4.1), ``paper`` and ``paper-elevation`` the
eight of Sabzali & Pilgrim (2023), ``lichti`` the additive set. A *panoramic* scanner has a mirror
that looks on over the zenith and a back face; a *hybrid* one turns full circle with one face only.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Literal

from tribrach.errors import InputError
from tribrach.instruments.calibration import (
    NIST,
    PAPER_EIGHT,
    PAPER_EIGHT_ELEVATION,
    CalibrationModel,
    lichti,
)

__all__ = ["HIGH_END", "MODELS", "ORDER", "Architecture", "Unit", "find_model", "unit_of"]

Unit = Literal["m", "rad", "1"]
Architecture = Literal["panoramic", "hybrid"]

MODELS = ("nist", "high-end", "paper", "paper-elevation", "lichti")

#: the default of high-end panoramic scanners: x7 stands for x5z, x1n, x5n and x5z for their sums
HIGH_END = ("x10", "x2", "x1z", "x3", "x7", "x6", "x1n", "x4", "x9n", "x9z")

#: parameters of plain physical meaning first: what is kept where not all can be
ORDER = (
    "x10", "x2", "x4", "x6", "x3", "x7", "x1n", "x1z", "x9n", "x9z", "x5n", "x5z",
    "x8x", "x8y", "x11a", "x11b", "x12a", "x12b",
    "a1", "a3", "a5", "a4", "a2", "E_R", "E_V", "E_H",
    "A0", "B6", "B7", "C0", "A2", "B2", "B3", "B4", "B5", "C2", "C5", "C6",
    "B8", "C4", "A3", "A4", "A5", "A6", "A7", "A8", "B9", "B10", "C1", "C3", "A1",
)  # fmt: skip

_METRES = {
    "x1n", "x1z", "x2", "x3", "x10", "E_R", "a1", "a2", "a4",
    "A0", "A2", "A3", "A4", "A5", "A6", "A7", "A8", "B8", "C4",
}  # fmt: skip

#: why a parameter is refused whatever is measured
_NEVER = {
    "B1": "a scale of the horizontal circle cannot be: the circle closes after a full turn",
}


def unit_of(parameter: str) -> Unit:
    """Unit of a parameter: metres, radians, or none for the scales A1 and C1."""
    if parameter in ("A1", "C1"):
        return "1"
    return "m" if parameter in _METRES else "rad"


def find_model(
    name: str, parameters: Sequence[str] = (), unit_lengths: Sequence[float] = ()
) -> CalibrationModel:
    """A model by its name, with some of its parameters only if any are named.

    unit_lengths : of the modulation of the range [m], for the terms A3 to A6 of ``lichti``.

    Raises
    ------
    InputError : an unknown model or parameter, a parameter named twice, unit lengths that are
        missing or that the model does not have.
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
    """The additive set; without unit lengths there are no terms that need them."""
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
    return whole.select([p for p in whole.parameters if p not in cyclic])


@cache
def _lichti_of(first: float, second: float) -> CalibrationModel:
    """One object per pair, so that observations of one instrument stay together."""
    return lichti(first, second)
