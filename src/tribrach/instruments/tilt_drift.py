"""Tilt of a scanner that drifts while its head turns, as parameters by time.

A scanner whose tripod settles, or whose compensator follows late, leans otherwise at the end of a
scan than at its beginning. The time of a point follows from its horizontal angle, as the head
turns evenly. Tilts about x and y of the scanner run in straight pieces of equal time and are zero
in the mean, so that the pose is that of the whole scan (method section 4.5). A parameter is what
one piece adds.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from tribrach.errors import InputError
from tribrach.instruments.calibration import CalibrationModel, Column

_NAME = re.compile(r"tilt_([xy])(\d)of(\d)$")
#: heads that turn by more than this saw every direction once [rad]
_HALF = float(np.radians(200.0))


@dataclass(frozen=True)
class Sweep:
    """How the head of a scanner turned during a scan."""

    start: float  #: horizontal angle where it began [rad]
    turn: float  #: how far it turned, positive counter-clockwise [rad]

    @property
    def period(self) -> float:
        """Angle after which directions come again: a mirror looks behind in half a turn [rad]."""
        return float(np.pi if abs(self.turn) <= _HALF else 2 * np.pi)

    def progress(self, h: Any) -> Any:
        """Share (n,) of the scan that was over at horizontal angles (n,) [rad]; may be complex."""
        ahead = (h - self.start) * np.sign(self.turn)
        ahead = ahead - np.floor(np.real(ahead) / self.period) * self.period
        # a direction just before the start belongs to it, not to what comes after the end
        late = np.real(ahead) > (abs(self.turn) + self.period) / 2
        return (ahead - np.where(late, self.period, 0.0)) / abs(self.turn)


def drift_names(pieces: int) -> tuple[str, ...]:
    """Names of the parameters of a scan."""
    return tuple(f"tilt_{axis}{k + 1}of{pieces}" for k in range(pieces) for axis in "xy")


def is_drift(parameter: str) -> bool:
    """True for the name of such a parameter."""
    return _NAME.match(parameter) is not None


@cache
def drift_model(sweep: Sweep, names: Sequence[str]) -> CalibrationModel:
    """The model of a scan; ``names`` as of :func:`drift_names`, hashable."""
    columns = []
    for name in names:
        found = _NAME.match(name)
        if found is None or not 1 <= int(found[2]) <= int(found[3]):
            raise InputError(f"{name} is no drift of a tilt")
        columns.append(_column(sweep, found[1], int(found[2]) - 1, int(found[3])))
    given = sweep.start, sweep.turn
    return CalibrationModel("tilt drift", tuple(names), tuple(columns), sweep=given)


def _column(sweep: Sweep, axis: str, piece: int, pieces: int) -> Column:
    """A tilt about an axis that one piece of the scan adds, zero in the mean of the scan."""
    mean = 1 - (piece + 0.5) / pieces

    def part(h: Any) -> Any:
        through = sweep.progress(h) * pieces - piece
        inside = (np.real(through) > 0) & (np.real(through) < 1)
        return np.where(inside, through, np.real(through) >= 1) - mean

    def about_x(r: Any, h: Any, v: Any, k: Any) -> tuple[Any, Any, Any]:
        return 0, -np.cos(h) / np.tan(v) * part(h), -np.sin(h) * part(h)

    def about_y(r: Any, h: Any, v: Any, k: Any) -> tuple[Any, Any, Any]:
        return 0, -np.sin(h) / np.tan(v) * part(h), np.cos(h) * part(h)

    return about_x if axis == "x" else about_y
