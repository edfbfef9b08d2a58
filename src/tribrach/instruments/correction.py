"""A calibration applied to the points of a scan: ``true = measured + Delta(measured)``.

Points (n, 3) in the scanner frame [m]. Nearer than 0.3 m and within half a degree of the standing
axis the corrections are those at these limits, because closer they would grow without bound.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from tribrach._types import Array
from tribrach.geometry.polar import NEAREST, POLE, polar_from_xyz, xyz_by_polar, xyz_from_polar
from tribrach.instruments.calibration import CalibrationModel

#: which face measured a point: always the front, or the back where H is above 180 degrees
Faces = Literal["front", "back", "dome"]
#: points whose columns are in memory at a time
_BLOCK = 50_000


@dataclass(frozen=True, eq=False)
class Correction:
    """Calibration of one scan."""

    model: CalibrationModel  #: the calibration model
    values: Array  #: (k,), its parameters [m, rad or 1]
    #: which face measured the points: always ``front``, always ``back``, or ``dome``: the back
    #: where H is above 180 degrees
    faces: Faces = "front"
    #: of the air that ranges were read in: they are ``1 + scale`` times as long [1]
    scale: float = 0.0

    def face(self, h: Array) -> Array:
        """Faces (n,) of +1 or -1 at horizontal angles (n,) [rad]."""
        if self.faces == "dome":
            return np.where(h % (2 * np.pi) >= np.pi, -1.0, 1.0)
        return np.full(len(h), 1.0 if self.faces == "front" else -1.0)

    def corrected(self, xyz: Array) -> Array:
        """Points (n, 3) [m] without the errors of the scanner."""
        xyz = xyz * (1.0 + self.scale) if self.scale else xyz
        used = np.flatnonzero(self.values)
        if len(used) == 0 or len(xyz) == 0:
            return xyz
        model = self.model.select([self.model.parameters[k] for k in used])
        out = np.empty_like(xyz)
        for first in range(0, len(xyz), _BLOCK):
            part = slice(first, first + _BLOCK)
            polar = polar_from_xyz(xyz[part])
            safe = _limited(polar)
            r, h, v = safe.T
            b = model.columns(r, h, v, self.face(polar[:, 1]))
            out[part] = xyz_from_polar(polar + b @ self.values[used])
        return out

    def raw(self, xyz: Array) -> Array:
        """Points as the scanner read them, which :meth:`corrected` brings to ``xyz`` (n, 3)."""
        out = xyz
        for _ in range(4):
            out = out + (xyz - self.corrected(out))
        return out

    def jacobian(self, xyz: Array) -> Array:
        """Derivatives (n, 3, k) of the corrected coordinates by the parameters."""
        by_polar, columns = self.factors(xyz)
        out: Array = by_polar @ columns
        return out

    def factors(self, xyz: Array) -> tuple[Array, Array]:
        """The two factors of :meth:`jacobian`.

        ``xyz`` (n, 3): points [m]. Returns ``by_polar`` (n, 3, 3): derivatives of the coordinates
        by range and angles; ``columns`` (n, 3, k): derivatives of range and angles by the
        parameters.
        """
        polar = polar_from_xyz(xyz)
        r, h, v = _limited(polar).T
        return xyz_by_polar(polar), self.model.columns(r, h, v, self.face(polar[:, 1]))


def _limited(polar: Array) -> Array:
    """Readings no nearer, and no closer to the axis, than the model is defined."""
    return np.stack(
        [
            np.maximum(polar[:, 0], NEAREST),
            polar[:, 1],
            np.clip(polar[:, 2], POLE, np.pi - POLE),
        ],
        axis=1,
    )
