"""Stations that carry antennas or prisms: their lever arms, and their rigid model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach.errors import AdjustmentError
from tribrach.job.antenna_lever_arms import EstimatedLeverArm, lever_arms
from tribrach.job.rigid_placing import place_rigidly
from tribrach.network.adjustment import Adjustment
from tribrach.network.survey import Survey
from tribrach.observations.base import Use
from tribrach.observations.gnss import Antennas
from tribrach.registration.rigid_model import RigidModel, TooFewPlaces
from tribrach.sentences import Sentence

#: an error so many times larger in height than in plan looks like a wrong antenna height
_UPRIGHT = 3.0


def height_sentences(adjustment: Adjustment) -> list[str]:
    """Antennas that are switched off and stand too high or too low, in words."""
    out = list[str]()
    for o in adjustment.network.observations:
        if not isinstance(o, Antennas):
            continue
        gap, names = o.misclosure(adjustment.state), adjustment.layout.names["pose"]
        for k in np.flatnonzero(o.use == Use.OFF):
            plan, up = float(np.hypot(gap[k, 0], gap[k, 1])), float(gap[k, 2])
            if abs(up) > _UPRIGHT * max(plan, float(o.sigma[k, 2])):
                side = "above" if up > 0 else "below"
                out.append(
                    Sentence(
                        "The antenna on {names}, which is switched off, was measured {up:mm0} "
                        "{side} where all the rest puts it, and only {plan:mm0} beside: look at "
                        "its height.",
                        names=names[o.station[k]],
                        up=abs(up),
                        side=side,
                        plan=plan,
                    )
                )
    return out


@dataclass(frozen=True)
class CarriedAntennas:
    """Adjusted stations that carry antennas or prisms."""

    lever_arms: tuple[EstimatedLeverArm, ...]  #: those that were estimated
    #: antennas that were switched off and stand too high or too low, a sentence each
    heights: tuple[str, ...]
    rigid: RigidModel | None = None  #: all stations as one rigid body
    obstacle: str = ""  #: why there is no such body, "" where there is nothing to be said


def carried_antennas(
    survey: Survey, adjustment: Adjustment, factor: float = 1.0
) -> CarriedAntennas | None:
    """Lever arms and the rigid model; None where no station carries an antenna or prism."""
    if not any(o.facts.places_station and len(o) for o in adjustment.network.observations):
        return None
    arms = tuple(lever_arms(adjustment, factor))
    heights = tuple(height_sentences(adjustment))
    try:
        return CarriedAntennas(arms, heights, place_rigidly(survey, adjustment))
    except TooFewPlaces:  # a single scan, say: there is nothing to compare with
        return CarriedAntennas(arms, heights)
    except AdjustmentError as error:
        return CarriedAntennas(arms, heights, obstacle=str(error.headline))
