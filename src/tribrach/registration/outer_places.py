"""Collects places that are known without any scan: antennas on scanners, marks, control points.

They can place a model of stations as one rigid body, or check it (method section 7.3). Work frame,
metres.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from tribrach._types import Array
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.survey import ObservationTable, Survey, as_column
from tribrach.observations.base import Use
from tribrach.observations.control import Coordinates
from tribrach.observations.gnss import Antennas, GnssPositions, MountedPoints


@dataclass(frozen=True, eq=False)
class OuterPlace:
    """A point, or the end of a lever arm of a station, that is known without any scan."""

    name: str  #: name of the place
    xyz: Array  #: (3,), coordinates in the work frame [m]
    covariance: Array  #: (3, 3), their covariance [m^2]
    station: str = ""  #: name of the station whose lever arm ends there, empty for a point
    arm: str = ""  #: name of the lever arm, empty for a point


def places_to_hold(survey: Survey, points: set[str]) -> tuple[list[OuterPlace], Array]:
    """Antennas, and points that marks and control determine, with their joint covariance (3n, 3n).

    All that is measured without scans is adjusted as a network of its own, with the shifts that
    positions of one session share.
    """
    outer, ends = _outer(survey)
    names_to_hold = points | set(ends)
    _control(outer, survey, names_to_hold)
    if not outer.tables():
        return [], np.zeros((0, 0))
    adjustment = adjust(outer.network())
    names = [name for name in adjustment.layout.names["point"] if name in names_to_hold]
    columns = np.concatenate([adjustment.columns(name) for name in names] or [np.zeros(0, int)])
    covariance = adjustment.covariance_columns(columns, columns)
    return [_place(adjustment, name, ends) for name in names], covariance


def _outer(survey: Survey) -> tuple[Survey, dict[str, tuple[str, str]]]:
    """What is measured without scans; stations and lever arms by the names of their antennas."""
    outer = survey.of_marks()
    ends: dict[str, tuple[str, str]] = {}
    for table in survey.tables():
        part = table.active()
        if not part.n or part.kind not in (Antennas, MountedPoints):
            continue
        stations, arms = (_words(part, column) for column in ("station", "lever_arm"))
        if part.kind is MountedPoints:
            names = _words(part, "point")
        else:
            names = [f"{arm} on {station}" for station, arm in zip(stations, arms, strict=True)]
            columns = {k: v for k, v in part.columns.items() if k not in ("station", "lever_arm")}
            outer.add(GnssPositions, group=part.group, position=names, **columns)
            shifts = part.names("vector") - set(arms)
            outer.vectors |= {name: survey.vectors[name] for name in shifts}
        ends |= dict(zip(names, zip(stations, arms, strict=True), strict=True))
    return outer, ends


def _control(outer: Survey, survey: Survey, names: set[str]) -> None:
    """Weighted control points among those that are wanted, as observations."""
    for name, given in survey.points.items():
        if given.covariance is None or name not in names | set(outer.points):
            continue
        outer.points[name] = replace(given, covariance=None)
        outer.add(
            Coordinates,
            values=[given.xyz],
            covariance=[given.covariance],
            position=[name],
            source=[given.source],
            group="control",
        )


def _place(adjustment: Adjustment, name: str, ends: dict[str, tuple[str, str]]) -> OuterPlace:
    xyz = adjustment.state.points[adjustment.layout.index("point", name)]
    station, arm = ends.get(name, ("", ""))
    return OuterPlace(name, xyz, adjustment.covariance(name), station, arm)


def places_to_check(survey: Survey, points: set[str]) -> list[OuterPlace]:
    """Antennas and points that are held out: compared with the model, not used to place it."""
    places: list[OuterPlace] = []
    for table in survey.tables():
        use = as_column(table.columns.get("use", 0), table.n).astype(int)
        if (use == Use.CHECK).any():
            places += _held_out(table.part(use == Use.CHECK))
    return [place for place in places if place.station or place.name in points]


def _held_out(table: ObservationTable) -> Iterator[OuterPlace]:
    """Places of one table of check values."""
    values, covariance = table.columns["values"], table.columns["covariance"]
    if table.kind is Antennas:
        both = zip(_words(table, "station"), _words(table, "lever_arm"), strict=True)
        for (station, arm), xyz, own in zip(both, values, covariance, strict=True):
            yield OuterPlace(f"{arm} on {station}", xyz, own, station, arm)
    elif table.kind is Coordinates:
        for name, xyz, own in zip(_words(table, "position"), values, covariance, strict=True):
            yield OuterPlace(name, xyz, own)


def _words(table: ObservationTable, column: str) -> list[str]:
    return [str(name) for name in as_column(table.columns[column], table.n)]
