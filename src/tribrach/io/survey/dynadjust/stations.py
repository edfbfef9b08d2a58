"""DynAdjust's stations: their places, their frame, and their fixed components."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
import pyproj

from tribrach._types import Array
from tribrach.errors import InputError, RefusalCollector
from tribrach.geodesy import frames
from tribrach.geodesy.site import EllipsoidSite, ecef_from_geodetic, enu_rotation
from tribrach.io.survey.dynadjust.records import (
    RecordPlace,
    Records,
    StationRecord,
    number,
    packed_dms,
)
from tribrach.network.survey import Survey
from tribrach.observations.control import DirectedComponents


class Stations:
    """All stations of a network in the reference frame of the first one.

    ``refused``: gathers stations that cannot be right; ``frame``, ``epoch``: names of the network's
    frame and its date; ``ellipsoid``: semi-major axis [m] and flattening; ``ecef``: coordinates
    (3,) [m] by name; ``constrained``: names of stations with at least one fixed component;
    ``geoid``: geoid height [m] and deflections xi, eta [rad] by name, empty without a geoid file.
    """

    def __init__(self, files: Sequence[Records], refused: RefusalCollector) -> None:
        self.refused = refused
        members = [(record, file) for file in files for record in file.stations]
        if not members:
            raise InputError(
                "there are no stations",
                file=files[0].file if files else None,
                cure="give the station file together with the measurement file",
            )
        self.records = [record for record, _ in members]
        self.geoid = {name: values for file in files for name, values in file.geoid.items()}
        self.frame, self.epoch = members[0][1].frame, members[0][1].epoch
        place = members[0][0].place
        with place.named():
            self.year = frames.decimal_year(self.epoch)
            self.ellipsoid = frames.ellipsoid(self.frame)
            self.dynamic = frames.is_dynamic(self.frame)
        places = []
        for record in self.records:
            with refused.record():
                places.append(ecef_of(record, self.ellipsoid, self.geoid_height(record.name)))
        refused.settle()
        xyz = np.array(places)
        for file in files:
            rows = np.array([owner is file for _, owner in members])
            if rows.any() and file.frame != self.frame:
                with file.stations[0].place.named():
                    year = frames.decimal_year(file.epoch)
                    xyz[rows], _ = frames.transform(xyz[rows], file.frame, self.frame, year)
        self.ecef = {record.name: row for record, row in zip(self.records, xyz, strict=True)}
        self.site = EllipsoidSite.centred(xyz, self.ellipsoid)
        self.constrained = {r.name for r in self.records if "C" in r.constraints}

    def geoid_height(self, name: str) -> float:
        """Geoid height at a station [m], 0 where it is not known."""
        return self.geoid.get(name, (0.0, 0.0, 0.0))[0]

    def known(self, names: Sequence[str], place: RecordPlace) -> set[str]:
        """The names as a set, if all of them are stations."""
        for name in names:
            if name not in self.ecef:
                raise place.error(
                    f"station {name or '(no name)'} is in no station file",
                    "add it to the station file",
                )
        return set(names)

    def add_to(self, survey: Survey, active: set[str], ignored: set[str]) -> None:
        """Add stations that are measured as points; the others are named in a warning."""
        unused = []
        for record in self.records:
            letters = record.constraints
            if not re.fullmatch("[CF]{3}", letters):
                self.refused.add(
                    record.place.error(
                        f"constraints of station {record.name} are {letters!r}",
                        "write three letters, C for constrained and F for free, such as CCC or FFC",
                    )
                )
                continue
            if record.name not in active | ignored:
                unused.append(record.name)
                continue
            if record.name not in active:
                letters = "CCC"
                survey.warnings.append(
                    f"station {record.name} is in ignored measurements only: it is held at its "
                    "given coordinates"
                )
            with self.refused.record():
                self._add(survey, record, letters)
        if unused:
            some = ", ".join(unused[:5]) + (", ..." if len(unused) > 5 else "")
            survey.warnings.append(f"{len(unused)} stations are not measured and left out: {some}")

    def _add(self, survey: Survey, record: StationRecord, letters: str) -> None:
        """Add a point with all components free or fixed, or fixed along some directions.

        The letters stand for latitude, longitude and height of geographic coordinates, for east,
        north and height of projected ones and for the axes of geocentric ones.
        """
        ecef = self.ecef[record.name]
        x = self.site.from_ecef(ecef[None])[0]
        given = letters == "CCC"
        weighted = given and min(record.sigmas) > 0
        east, north, up = self.axes(ecef[None])[0]
        axes = {"XYZ": np.eye(3), "UTM": np.array([east, north, up])}.get(
            record.type, np.array([north, east, up])
        )
        axes, sigmas = axes @ self.site.w_from_ecef.T, np.array(record.sigmas)
        survey.point(
            record.name,
            x,
            free=np.full(3, not given or any(sigmas)),
            role="control" if given else "free",
            covariance=axes.T @ np.diag(sigmas**2) @ axes if weighted else None,
            source=str(record.place),
        )
        if weighted or (given and not any(sigmas)):
            return
        constrained = np.array([letter == "C" for letter in letters])
        for hard in (True, False):
            of = constrained & ((sigmas == 0) == hard)
            if of.any():
                survey.add(
                    DirectedComponents,
                    values=axes[of] @ x,
                    sigma=None if hard else sigmas[of],
                    position=[record.name] * int(of.sum()),
                    direction=axes[of],
                    source=[str(record.place)] * int(of.sum()),
                    hard=hard,
                )

    def axes(self, xyz: Array) -> Array:
        """East, north, up as rows (n, 3, 3) at ECEF positions (n, 3)."""
        geodetic = self.geodetic(xyz)
        return enu_rotation(geodetic[:, 0], geodetic[:, 1])

    def geodetic(self, xyz: Array) -> Array:
        """Latitude, longitude [rad] and ellipsoidal height [m] (n, 3) of ECEF (n, 3)."""
        return self.site.geodetic(self.site.from_ecef(xyz))


def ecef_of(
    record: StationRecord, ellipsoid: tuple[float, float], undulation: float = 0.0
) -> Array:
    """ECEF (3,) [m] of a station's coordinates; orthometric heights by the geoid height [m]."""
    first, second, third = record.values
    place = record.place
    height = number(third, "the height", place) if record.type != "XYZ" else 0.0
    if record.type == "XYZ":
        return np.array(
            [
                number(t, f"{c} of station {record.name}", place)
                for t, c in zip(record.values, "XYZ", strict=True)
            ]
        )
    if record.type in ("LLH", "LLh"):
        latitude = packed_dms(first, f"latitude of station {record.name}", place)
        longitude = packed_dms(second, f"longitude of station {record.name}", place)
    elif record.type == "UTM":
        plan = (
            number(first, "the easting", place),
            number(second, "the northing", place),
        )
        longitude, latitude = _utm(record, ellipsoid)(*plan, inverse=True, radians=True)
    else:
        raise place.error(
            f"coordinate type {record.type!r} of station {record.name} is not known",
            "use XYZ, LLH, LLh or UTM",
        )
    # heights beside latitudes, longitudes and grid coordinates are orthometric, but for LLh
    ellipsoidal = height if record.type == "LLh" else height + undulation
    geodetic = np.array([latitude, longitude, ellipsoidal])
    return ecef_from_geodetic(geodetic[0], geodetic[1], geodetic[2], ellipsoid)


def _utm(record: StationRecord, ellipsoid: tuple[float, float]) -> pyproj.Proj:
    """The projection of a zone such as ``S55``; without a letter it is southern, as DynAdjust's."""
    match = re.fullmatch(r"([NSns]?)\s*(\d{1,2})", record.zone.strip())
    if match is None or not 1 <= int(match[2]) <= 60:
        raise record.place.error(
            f"hemisphere and zone of station {record.name} are {record.zone!r}",
            "write them as S55 or N32, or 55 for a southern zone",
        )
    a, f = ellipsoid
    south = match[1].upper() != "N"
    return pyproj.Proj(proj="utm", zone=int(match[2]), south=south, a=a, f=f)
