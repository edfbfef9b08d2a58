"""Places all stations as one rigid body: registered among each other first, then placed as a whole.

This is the published chain: cloud registration makes a model, and a rigid motion (six parameters;
four if the scans are levelled) fits it to the places of antennas and control. A rigid motion cannot
take up the bending of the model; adjusting everything together can. Both are computed so that the
difference is seen (method section 7.3).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.survey import Survey
from tribrach.registration.outer_places import OuterPlace, places_to_check, places_to_hold
from tribrach.transformation.fit import CommonPoints, TransformationFit, fit_points
from tribrach.transformation.models import find_model
from tribrach.transformation.weights import Spread


class TooFewPlaces(InputError):
    """Raised where fewer places are known without scans than a rigid motion needs."""


@dataclass(frozen=True, eq=False)
class RigidModel:
    """A model of stations and where it was placed."""

    model: Adjustment  #: stations and points among themselves, a free network
    #: fit of the model to the places, held and checked ones in the order of ``places``
    fit: TransformationFit
    places: tuple[OuterPlace, ...]  #: the places

    def pose(self, station: str) -> Pose:
        """Pose of a station in the work frame."""
        state, t = self.model.state, self.fit.transformation
        k = self.model.layout.index("pose", station)
        return Pose(t.rotation @ state.pose_r[k], t(state.pose_t[k][None])[0])

    def covariance(self, station: str) -> Array:
        """A-priori covariance of a station's pose: E, N, U [m] and left rotation increments [rad].

        It is that of the placement and of the station within the model (inner constraints over all
        stations). What bends the model beyond its stated sigmas is in neither.
        """
        k = self.model.layout.index("pose", station)
        t = self.fit.transformation
        at = t.jacobian(self.model.state.pose_t[k][None])[0]
        turn = np.zeros((3, at.shape[1]))
        if t.model.turn == "free":
            turn[:, 3:6] = np.eye(3)
        else:
            turn[2, 3] = 1.0
        by_fit = np.concatenate([at, turn])
        both = np.kron(np.eye(2), t.rotation)
        inner = both @ self.model.covariance(station) @ both.T
        out: Array = by_fit @ self.fit.covariance @ by_fit.T + inner
        return out

    def differences(self, check: bool) -> Array:
        """Measured minus placed coordinates of the places."""
        chosen = self.fit.points.check if check else self.fit.points.used
        return self.fit.difference[chosen]


def rigid_model(survey: Survey, arms: Mapping[str, Array] | None = None) -> RigidModel:
    """Place the stations of a survey as one rigid model on its antennas, marks and control.

    ``arms`` are lever arms in the scanner frame that replace those of the survey [m].
    """
    inner = survey.of_stations()
    levelled = any(table.kind.facts.levels_station for table in inner.tables())
    model = adjust(inner.network())
    points = set(model.layout.names["point"])
    held, covariance = places_to_hold(survey, points)
    checked = places_to_check(survey, points)
    places = (*held, *checked)
    if len(held) < (2 if levelled else 3):
        raise TooFewPlaces(
            f"{len(held)} places are known without scans, too few for a rigid model",
            cure="measure antennas or control points of more stations",
        )
    known = {name: vector for name, (vector, _) in survey.vectors.items()} | dict(arms or {})
    n, m = len(held), len(places)
    whole = np.zeros((3 * m, 3 * m))
    whole[: 3 * n, : 3 * n] = covariance
    for k, place in enumerate(checked, start=n):
        whole[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = place.covariance
    common = CommonPoints(
        tuple(place.name for place in places),
        np.array([_in_model(model, place, known) for place in places]),
        np.array([place.xyz for place in places]),
        Spread(),
        Spread(joint=whole),
        np.arange(m) < n,
        np.arange(m) >= n,
        ("",) * m,
    )
    return RigidModel(model, fit_points(common, find_model(4 if levelled else 6, 3)), places)


def _in_model(model: Adjustment, place: OuterPlace, arms: Mapping[str, Array]) -> Array:
    """Where a place is in the model (3,)."""
    if not place.station:
        out: Array = model.state.points[model.layout.index("point", place.name)]
        return out
    k = model.layout.index("pose", place.station)
    end: Array = model.state.pose_t[k] + model.state.pose_r[k] @ arms[place.arm]
    return end
