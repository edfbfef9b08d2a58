"""Terrestrial measurements of DynAdjust's files as observations.

Angles, azimuths, directions, zenith and vertical angles refer to the ellipsoid's normal;
DynAdjust models no refraction and neither is any assumed here. Orthometric heights and their
differences are taken as ellipsoidal, for lack of a geoid model.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Any

import numpy as np

from tribrach.io.survey.dynadjust_records import IGNORED, Sight
from tribrach.network.observations.angle import Angles
from tribrach.network.observations.azimuth import Azimuths
from tribrach.network.observations.base import Observations, Use
from tribrach.network.observations.direction import Directions
from tribrach.network.observations.height import Heights
from tribrach.network.observations.height_difference import HeightDifferences
from tribrach.network.observations.slope_distance import SlopeDistances
from tribrach.network.observations.zenith import ZenithAngles
from tribrach.network.survey import Survey

__all__ = ["add_sights"]

_KINDS: dict[str, type[Observations]] = {
    "A": Angles,
    "B": Azimuths,
    "D": Directions,
    "H": Heights,
    "L": HeightDifferences,
    "R": Heights,
    "S": SlopeDistances,
    "V": ZenithAngles,
    "Z": ZenithAngles,
}


def add_sights(survey: Survey, sights: Sequence[Sight]) -> None:
    """Add all terrestrial measurements.

    Raises
    ------
    InputError : a standard deviation that is not positive.
    """
    for kind in dict.fromkeys(sight.type for sight in sights):
        _add(survey, kind, [sight for sight in sights if sight.type == kind])
    if any(sight.type in "HL" and not sight.ignored for sight in sights):
        survey.warnings.append(
            "measured heights and height differences are orthometric; they are taken as "
            "ellipsoidal, no geoid model is read"
        )


def _add(survey: Survey, kind: str, sights: Sequence[Sight]) -> None:
    ignored = np.array([sight.ignored for sight in sights])
    values = np.array([sight.value for sight in sights])
    survey.add(
        _KINDS[kind],
        # a vertical angle is counted from the horizon
        values=pi / 2 - values if kind == "Z" else values,
        sigma=np.array([sight.sigma for sight in sights]),
        source=[str(sight.place) for sight in sights],
        use=np.where(ignored, Use.OFF, Use.ACTIVE).astype(np.int8),
        reason=np.where(ignored, IGNORED, "").astype(object),
        **_fields(kind, sights),
    )


def _fields(kind: str, sights: Sequence[Sight]) -> dict[str, Any]:
    """The fields of the kind that name stations and heights."""
    first = [sight.names[0] for sight in sights]
    if kind in "HR":
        return {"position": first}
    out: dict[str, Any] = {"start": first, "end": [sight.names[1] for sight in sights]}
    if kind == "L":
        return out
    out["height_instrument"] = np.array([sight.height_instrument for sight in sights])
    out["height_target"] = np.array([sight.height_target for sight in sights])
    if kind == "A":
        out["foresight"] = [sight.names[2] for sight in sights]
    if kind == "D":
        out["orientation"] = [sight.set_name for sight in sights]
    return out
