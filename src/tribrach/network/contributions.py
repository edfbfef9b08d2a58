"""Which observations is the uncertainty of a station made of?

``dx = Q A^T P w`` makes every adjusted unknown a linear function of the observations. Those of
one group alone give ``C_g = Q A_g^T P_g A_g Q``, and since ``Q N Q = Q`` the groups add up to the
covariance exactly: control, targets, levelling and traverse each with its own share. What is held
fixed adds nothing. Values that share a joint covariance stay together in one group, for they have
no shares of their own. Metres and radians of the work frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.network.adjustment import Adjustment
from tribrach.network.network import Network

__all__ = ["CATEGORIES", "Contribution", "by_category", "contributions"]


_CONTROL = ("coordinates", "coordinate", "height")
_GNSS = (
    "gnss_position",
    "gnss_baseline",
    "antenna",
    "vector_prior",
    "vector_component_prior",
)
_TARGETS = ("target_centre", "scanner_polar", "plane", "point_on_plane", "relative_pose")
_TOTAL_STATION = (
    "direction",
    "angle",
    "azimuth",
    "zenith",
    "slope_distance",
    "horizontal_distance",
    "distance",
)
_LINES = ("height_difference",)
_TELESCOPE = ("frame_angle", "frame_distance", "frame_coordinate")
#: what surveyors call the groups, in the order of a budget; a backsight is every sight from the
#: scanner itself, own targets are those in scans of the station, levelling is that of the scanner,
#: centring that of scanners and targets over marks, with their heights
CATEGORIES = (
    "control",
    "GNSS",
    "levelling lines",
    "total station",
    "centring",
    "backsight",
    "own targets",
    "targets of others",
    "levelling",
    "other",
)


@dataclass(frozen=True)
class Contribution:
    """Share of one group in a covariance.

    kind, group : as in the network, names of several with a plus; own : are the observations of
    the station itself? covariance (k, k) of the columns asked for.
    """

    kind: str
    group: str
    own: bool
    covariance: Array

    @property
    def category(self) -> str:
        """The name in :data:`CATEGORIES`."""
        kinds = set(self.kind.split(" + "))
        if kinds <= set(_CONTROL):
            return "control"
        if kinds <= {*_GNSS, *_CONTROL}:
            return "GNSS"
        if kinds <= set(_TARGETS):
            return "own targets" if self.own else "targets of others"
        if kinds == {"inclination"}:
            return "levelling" if self.own else "other"
        if kinds <= set(_TOTAL_STATION):
            return "backsight" if self.own else "total station"
        if kinds <= set(_TELESCOPE):
            return "backsight" if self.own else "other"
        if kinds == {"offset"}:
            return "centring"
        return "levelling lines" if kinds <= set(_LINES) else "other"


def contributions(adjustment: Adjustment, station: str) -> list[Contribution]:
    """Shares (6, 6) of every group in the a-priori covariance of a scanner station.

    Translation E, N, U [m] and left rotation increments [rad], as in ``adjustment.covariance``,
    which is their sum. KeyError if there is no such station.
    """
    influence = _influence(adjustment, adjustment.columns(station))
    layout = adjustment.layout
    labels = _labels(adjustment.network)
    pose = layout.index("pose", station)
    own = _own(adjustment, pose, layout.count("point") + pose)
    merged = _merged(adjustment.network)
    own &= ~merged[adjustment.rows.table]
    out = []
    for label in dict.fromkeys(labels):
        tables = [t for t, other in enumerate(labels) if other == label]
        mine = np.isin(adjustment.rows.table, tables)
        for chosen, is_own in ((mine & own, True), (mine & ~own, False)):
            if chosen.any():
                part = influence[chosen]
                out.append(Contribution(*label, is_own, part.T @ part))
    return out


def by_category(parts: list[Contribution], factor: float = 1.0) -> dict[str, Array]:
    """Sums (k, k) by category, in its order, times a factor (a posteriori variance)."""
    return {
        name: factor * np.sum([p.covariance for p in parts if p.category == name], axis=0)
        for name in CATEGORIES
        if any(p.category == name for p in parts)
    }


def _influence(adjustment: Adjustment, columns: Index) -> Array:
    """``P^(1/2) A Q`` (n, k): what a whitened value does to columns of the tangent vector."""
    place = adjustment.reduced[columns]
    unit = np.zeros((adjustment.n_unknowns, len(columns)))
    free = place >= 0
    unit[place[free], np.flatnonzero(free)] = 1.0
    influence: Array = adjustment.design @ adjustment.cofactor.solve(unit)
    return influence


def _labels(network: Network) -> list[tuple[str, str]]:
    """Kind and group of each table; tables that share a joint covariance have one label."""
    owner = list(range(len(network.observations)))
    for joint in network.joint:
        tables = {owner[t] for t in np.unique(joint.table)}
        owner = [min(tables) if o in tables else o for o in owner]
    labels = []
    for one in owner:
        members = [o for o, other in zip(network.observations, owner, strict=True) if other == one]
        kinds = " + ".join(dict.fromkeys(o.kind for o in members))
        labels.append((kinds, " + ".join(dict.fromkeys(o.group for o in members))))
    return labels


def _merged(network: Network) -> NDArray[np.bool_]:
    """True (tables,) for tables with a joint covariance: their values are not parted by station."""
    out = np.zeros(len(network.observations), dtype=bool)
    for joint in network.joint:
        out[np.unique(joint.table)] = True
    return out


def _own(adjustment: Adjustment, pose: int, position: int) -> NDArray[np.bool_]:
    """True (n,) for rows that were observed from a station, given as pose and as position."""
    parts = [np.zeros(0, dtype=bool)]
    for o, items in zip(adjustment.network.observations, adjustment.assembly.active, strict=True):
        at = np.zeros(len(o), dtype=bool)
        if hasattr(o, "station"):
            at = np.asarray(o.station) == pose
        elif hasattr(o, "start"):
            at = np.asarray(o.start) == (pose if o.kind == "relative_pose" else position)
        parts.append(np.repeat(at[items], o.rows))
    return np.concatenate(parts)
