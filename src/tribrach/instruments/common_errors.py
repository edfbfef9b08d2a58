"""What a scanner gets wrong alike at all points of a station, besides its calibration.

A zero and a scale of the ranges belong to the instrument; a coefficient of refraction belongs to
the air of a station on its day. Each is one number with a standard deviation, and a column like
those of a calibration: ``true = measured + Delta``, zero a: ``Delta_R = a``, range scale m:
``Delta_R = m R``; coefficient k: the ray is bent down, ``Delta_V = k R sin V / (2 E)`` with the
radius E of the Earth (method section 5.10).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tribrach.errors import InputError
from tribrach.instruments.calibration import MODELS, CalibrationModel, find_model
from tribrach.instruments.tilt_drift import Sweep, drift_model, is_drift

#: names of the effects
RANGE_SCALE, REFRACTION, RANGE_ZERO = "range scale", "refraction", "range zero"
#: of them those that all stations of an instrument have alike
OF_INSTRUMENT = (RANGE_SCALE, RANGE_ZERO)
#: mean radius of the Earth [m]
_EARTH = 6371000.0
#: all as columns of a model, linear in each of them
COMMON = CalibrationModel(
    "common",
    (RANGE_SCALE, REFRACTION, RANGE_ZERO),
    (
        lambda r, h, v, k: (r, 0, 0),
        lambda r, h, v, k: (0, 0, r * np.sin(v) / (2 * _EARTH)),
        lambda r, h, v, k: (np.ones_like(r), 0, 0),
    ),
)


@dataclass(frozen=True)
class CommonErrors:
    """Standard deviations of effects that no number of points makes smaller."""

    instrument: str  #: name of the scanner; all its stations have one zero and one scale
    range_scale: float = 0.0  #: of the scale of its ranges
    refraction: float = 0.0  #: of the coefficient of refraction, drawn anew at each station
    range_zero: float = 0.0  #: of the zero of its ranges [m]

    @property
    def effects(self) -> dict[str, float]:
        """Those that are not zero, with their standard deviations."""
        every = {
            RANGE_SCALE: self.range_scale,
            REFRACTION: self.refraction,
            RANGE_ZERO: self.range_zero,
        }
        return {name: sigma for name, sigma in every.items() if sigma > 0}


def effects_model(
    name: str | None,
    effects: Sequence[str],
    unit_lengths: Sequence[float] = (),
    sweep: Sequence[float] = (),
) -> CalibrationModel:
    """The model of a calibration, of tilts that drift, and of common errors together.

    ``name``: of the calibration model, one of :data:`~tribrach.instruments.calibration.MODELS`;
    None without a calibration; ``unit_lengths``: of the modulation of the range [m]; ``sweep``:
    start and turn of the head [rad].
    """
    drift = tuple(effect for effect in effects if is_drift(effect))
    own = [effect for effect in effects if effect not in (*COMMON.parameters, *drift)]
    common = COMMON.select([effect for effect in effects if effect in COMMON.parameters])
    if drift:
        if len(sweep) != 2 or not sweep[1]:
            raise InputError("a tilt drifts and nothing says how the head turned")
        common = drift_model(Sweep(*sweep), drift).joined(common)
    if not own:
        return common
    return find_model(name or MODELS[0], own, unit_lengths).joined(common)
