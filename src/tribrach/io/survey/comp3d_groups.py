"""Comp3D's subframes, baselines, rotation axes and equalities in a survey."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach.geodesy.site import EllipsoidSite
from tribrach.io.survey.comp3d_records import AxisRecord, EqualRecord, FrameEntry, FrameRecord
from tribrach.io.survey.comp3d_starts import AxisStart
from tribrach.io.survey.comp3d_tables import Tables
from tribrach.network.observations.base import Observations
from tribrach.network.observations.common_value import EqualDistances, EqualHeightDifferences
from tribrach.network.observations.frame_sight import (
    FrameAngles,
    FrameCoordinates,
    FrameDistances,
)
from tribrach.network.observations.gnss_baseline import GnssBaselines
from tribrach.network.observations.inclination import Inclinations
from tribrach.network.observations.rotation_axis import AxisFeet, AxisPlanes, AxisRadii
from tribrach.network.observations.target_centre import TargetCentres
from tribrach.network.survey import Survey

__all__ = ["add_axis", "add_baselines", "add_equal", "add_frame"]

Array = NDArray[np.float64]
_OFF = "its sigma is negative in the file"


def add_frame(tables: Tables, frame: FrameRecord, station: str, known: dict[str, Array]) -> None:
    """Add the targets of a subframe seen from a station, and that it is levelled if it is."""
    origin = known.get(frame.origin)
    for entry in frame.entries:
        _add_entry(tables, frame, entry, station, _distance(frame, entry, origin, known))
    if frame.levelled:
        tables.put(Inclinations, 0.0, 1.0, frame.line.source, {"station": station}, hard=True)
    if station != frame.origin:
        ends = {"start": frame.origin, "end": station}
        tables.put(GnssBaselines, 0.0, 1.0, frame.line.source, ends, hard=True)


def _distance(
    frame: FrameRecord, entry: FrameEntry, origin: Array | None, known: dict[str, Array]
) -> float:
    """Distance [m] to a target for its sigmas: measured, else computed, else 1 m."""
    if frame.code == 11:
        return float(np.linalg.norm(entry.values))
    if entry.values[2] > 0:
        return entry.values[2]
    if origin is not None and entry.target in known:
        return float(np.linalg.norm(known[entry.target] - origin))
    return 1.0


def _add_entry(
    tables: Tables, frame: FrameRecord, entry: FrameEntry, station: str, distance: float
) -> None:
    source = entry.line.source
    ends: dict[str, object] = {"station": station, "target": entry.target}
    scales = (distance,) * 3 if frame.code == 11 else (1 / distance, 1 / distance, distance)
    sigmas = np.array(entry.own) + np.array(entry.by_distance) * scales
    if frame.code == 11 and not any(entry.off) and entry.height == 0:
        tables.put(TargetCentres, entry.values, sigmas, source, ends)
        return
    for i in range(3):
        columns = ends | {"height_target": entry.height}
        kind: type[Observations] = FrameDistances
        if frame.code == 11:
            kind = FrameCoordinates
            columns["axis"] = i
        elif i < 2:
            kind = FrameAngles
            columns["circle"] = i
        elif entry.values[i] <= 0:
            # a ray without a distance
            continue
        tables.put(kind, entry.values[i], sigmas[i], source, columns, off=entry.off[i])


def add_baselines(tables: Tables, frame: FrameRecord, site: EllipsoidSite) -> None:
    """Add baselines, turned from ECEF into W with their covariances."""
    turn = site.w_from_ecef
    for entry in frame.entries:
        xx, xy, xz, yy, yz, zz = entry.covariance
        covariance = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        columns: dict[str, object] = {"start": frame.origin, "end": entry.target}
        columns |= {"height_start": frame.height, "height_end": entry.height}
        tables.put(
            GnssBaselines,
            turn @ np.array(entry.values),
            turn @ covariance @ turn.T,
            entry.line.source,
            columns,
            off=entry.off[0],
        )


def add_axis(survey: Survey, tables: Tables, axis: AxisRecord, start: AxisStart) -> None:
    """Add a rotation axis: two slopes, a place and a radius for each target, its feet."""
    name = f"axis {axis.origin} ({axis.line.source})"
    slopes = {f"slope_{i}": f"slope {i} of {name}" for i in (1, 2)}
    ends: dict[str, object] = {"origin": axis.origin, "main": start.main, **slopes}
    for slope, value in zip(slopes.values(), start.slopes, strict=True):
        survey.scalars[slope] = (value, True)
    for target, along in start.along.items():
        survey.scalars[f"place of {target} on {name}"] = (along, True)
        survey.scalars[f"radius of {target} on {name}"] = (start.radius[target], True)
    for circle in axis.circles:
        place, size = (f"{what} of {circle.target} on {name}" for what in ("place", "radius"))
        here = ends | {"along": place, "point": circle.point}
        for kind, sigma, more in (
            (AxisRadii, circle.sigma_radius, {"radius": size}),
            (AxisPlanes, circle.sigma_plane, {}),
        ):
            off = "" if sigma > 0 else _OFF
            tables.put(kind, 0.0, abs(sigma), circle.line.source, here | more, off=off)
    for point, line in axis.feet:
        tables.put(AxisFeet, 0.0, 1.0, line.source, ends | {"point": point}, hard=True)


def add_equal(
    survey: Survey, tables: Tables, equal: EqualRecord, known: dict[str, Array], site: EllipsoidSite
) -> None:
    """Add pairs with a common value, which starts as the mean of the pairs that are known."""
    kind = EqualHeightDifferences if equal.code == 21 else EqualDistances
    values = []
    for pair in equal.pairs:
        if {pair.start, pair.end} <= known.keys():
            ends = np.array([known[pair.start], known[pair.end]])
            heights = site.height(ends)
            values.append(
                heights[1] - heights[0] if equal.code == 21 else np.linalg.norm(ends[1] - ends[0])
            )
        columns = {"start": pair.start, "end": pair.end, "common": equal.name}
        off = "" if pair.sigma > 0 else _OFF
        tables.put(kind, 0.0, abs(pair.sigma), pair.line.source, columns, off=off)
    survey.scalars[equal.name] = (float(np.mean(values)) if values else 0.0, True)
