"""The stations as one rigid model beside their adjustment.

What published chains deliver can so be compared with what everything adjusted together gives.
"""

from __future__ import annotations

from tribrach._types import Array
from tribrach.network.adjustment import Adjustment
from tribrach.network.survey import Survey
from tribrach.registration.outer_places import OuterPlace
from tribrach.registration.rigid_model import RigidModel, rigid_model


def place_rigidly(survey: Survey, adjustment: Adjustment) -> RigidModel:
    """The rigid model of a survey, with the lever arms of its adjustment."""
    names = adjustment.layout.names["vector"]
    arms = dict(zip(names, adjustment.state.vectors, strict=True))
    return rigid_model(survey, arms)


def adjusted_place(adjustment: Adjustment, place: OuterPlace) -> Array:
    """Place after the adjustment of everything (3,)."""
    state, layout = adjustment.state, adjustment.layout
    if not place.station:
        point: Array = state.points[layout.index("point", place.name)]
        return point
    k = layout.index("pose", place.station)
    arm = state.vectors[layout.index("vector", place.arm)]
    end: Array = state.pose_t[k] + state.pose_r[k] @ arm
    return end
