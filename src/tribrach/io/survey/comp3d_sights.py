"""Comp3D's plain observations in a survey."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach.geodesy.site import EllipsoidSite
from tribrach.io.survey.comp3d_control import INNER, grid_axes
from tribrach.io.survey.comp3d_points import PointRecord
from tribrach.io.survey.comp3d_project import Project
from tribrach.io.survey.comp3d_records import SightRecord
from tribrach.io.survey.comp3d_tables import Tables
from tribrach.network.observations.azimuth import Azimuths
from tribrach.network.observations.base import Observations
from tribrach.network.observations.direction import Directions
from tribrach.network.observations.height_difference import HeightDifferences
from tribrach.network.observations.horizontal_distance import HorizontalDistances
from tribrach.network.observations.local_offset import LocalOffsets
from tribrach.network.observations.slope_distance import SlopeDistances
from tribrach.network.observations.zenith import ZenithAngles

__all__ = ["TOO_CLOSE", "Distances", "add_sight", "coincident"]

Array = NDArray[np.float64]

#: points closer than this [m] have no direction between them
TOO_CLOSE = 1e-6

_KINDS: dict[int, type[Observations]] = {
    1: SlopeDistances,
    2: HorizontalDistances,
    3: SlopeDistances,
    5: Directions,
    6: ZenithAngles,
    7: Directions,
    8: Azimuths,
    14: LocalOffsets,
    15: LocalOffsets,
}


class Distances:
    """Distances [m] between points, for sigmas that depend on them: measured, else computed.

    A distance that is switched off is still closer than approximate coordinates.
    """

    def __init__(self, sights: list[SightRecord], known: dict[str, Array]) -> None:
        self._known = known
        measured: dict[frozenset[str], list[float]] = {}
        for sight in sights:
            if sight.code in (1, 3) and sight.value > 0:
                measured.setdefault(frozenset(sight.names), []).append(sight.value)
        self._measured = {pair: float(np.median(values)) for pair, values in measured.items()}

    def __call__(self, start: str, end: str) -> float | None:
        """Distance between two points, None if nothing tells."""
        measured = self._measured.get(frozenset((start, end)))
        if measured is not None or not {start, end} <= self._known.keys():
            return measured
        return max(float(np.linalg.norm(self._known[start] - self._known[end])), TOO_CLOSE)


def coincident(sight: SightRecord, points: dict[str, PointRecord], known: dict[str, Array]) -> bool:
    """True if both ends are given at one place that the observation cannot be made between."""
    if sight.off or sight.code in (2, 4, 14, 15) or not set(sight.names) <= points.keys():
        return False
    chord = known[sight.end] - known[sight.start]
    chord[2] += sight.height_target - sight.height_instrument
    flat = float(np.hypot(chord[0], chord[1]))
    return flat < TOO_CLOSE and (sight.angular or abs(chord[2]) < TOO_CLOSE)


def add_sight(
    tables: Tables,
    sight: SightRecord,
    sigma: float,
    project: Project,
    site: EllipsoidSite,
    places: dict[str, Array],
) -> None:
    """Add one observation; places are approximate coordinates (3,) in W."""
    columns: dict[str, object] = {"start": sight.start, "end": sight.end}
    off = sight.off
    if sight.code == 8 and project.inner_constraints:
        off = off or INNER
    if sight.code == 4:
        columns |= {"height_start": sight.height_instrument, "height_end": sight.height_target}
        kind: type[Observations] = HeightDifferences
    else:
        columns["height_instrument"] = sight.height_instrument
        columns["height_target"] = sight.height_target
        kind = _KINDS[sight.code]
    radius = site.curvature_radius or 1.0
    if sight.code in (5, 7):
        columns["orientation"] = sight.circle
    elif sight.code == 6:
        columns["refraction"] = project.refraction
    elif sight.code == 2:
        columns["reduction"] = radius / (radius + _height(sight.end, places, site))
    elif sight.code in (14, 15):
        columns["azimuth"] = _azimuth(sight.code - 14, places.get(sight.start), site)
        columns["reduction"] = radius / (radius + _height(sight.start, places, site))
    tables.put(kind, sight.value, sigma, sight.line.source, columns, off=off)


def _height(name: str, places: dict[str, Array], site: EllipsoidSite) -> float:
    """Height [m] of a point, zero if its place is unknown."""
    return float(site.height(places[name][None])[0]) if name in places else 0.0


def _azimuth(axis: int, x: Array | None, site: EllipsoidSite) -> float:
    """Azimuth [rad] of the grid's east (0) or north (1) at a place, as at the centre if unknown."""
    if x is None:
        return float(np.pi / 2 * (1 - axis))
    east, north, _ = site.axes(x[None])[0] @ grid_axes(x, site)[axis]
    return float(np.arctan2(east, north))
