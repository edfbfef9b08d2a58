"""The content of DynAdjust's files as plain records, one for each entry.

The DynaML and the DNA reader fill the same records; :mod:`tribrach.io.survey.dynadjust.assembly`
makes a survey of them. Numbers are in the file's units: metres, ECEF; angles already in radians.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import isfinite, pi

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.units import from_dms, too_large

#: DynAdjust's measurement types
TYPES = {
    "A": "horizontal angle",
    "B": "geodetic azimuth",
    "C": "chord on the ellipsoid",
    "D": "direction set",
    "E": "arc on the ellipsoid",
    "G": "GNSS baseline",
    "H": "orthometric height",
    "I": "astronomic latitude",
    "J": "astronomic longitude",
    "K": "astronomic azimuth",
    "L": "height difference",
    "M": "distance at sea level",
    "P": "geodetic latitude",
    "Q": "geodetic longitude",
    "R": "ellipsoidal height",
    "S": "slope distance",
    "V": "zenith angle",
    "X": "GNSS baseline cluster",
    "Y": "GNSS point cluster",
    "Z": "vertical angle",
}


#: types that become observations, beside G, X and Y: number of stations and angular or not
SIGHTS = {
    "A": (3, True),
    "B": (2, True),
    "C": (2, False),
    "D": (2, True),
    "E": (2, False),
    "H": (1, False),
    "I": (1, True),
    "J": (1, True),
    "K": (2, True),
    "L": (2, False),
    "M": (2, False),
    "P": (1, True),
    "Q": (1, True),
    "R": (1, False),
    "S": (2, False),
    "V": (2, True),
    "Z": (2, True),
}


ARCSEC = pi / 180 / 3600


#: reason of measurements that carry the ignore flag
IGNORED = "ignored in the file"


@dataclass(frozen=True)
class RecordPlace:
    """Place of a record, for sources and error messages."""

    file: str  #: name of the file
    line: int | None = None  #: from 1, None if not known

    def __str__(self) -> str:
        return self.file if self.line is None else f"{self.file}:{self.line}"

    def error(self, what: str, cure: str | None = None) -> InputError:
        """The error of this place."""
        return InputError(what, file=self.file, line=self.line, cure=cure)

    @contextmanager
    def named(self) -> Iterator[None]:
        """Give errors raised inside the block, which do not know the file, this place."""
        try:
            yield
        except InputError as error:
            raise self.error(error.what, error.cure) from error


@dataclass(frozen=True)
class StationRecord:
    """A station."""

    name: str  #: of the station
    constraints: str  #: three letters such as ``CCF``
    type: str  #: of the coordinates: XYZ, LLH, LLh or UTM
    values: tuple[str, str, str]  #: three texts as in the file
    zone: str  #: of a projection
    place: RecordPlace  #: of the record
    #: of the constrained values [m], 0 where they are held
    sigmas: tuple[float, float, float] = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Entry:
    """One baseline or point of a cluster."""

    #: names of the stations
    first: str
    second: str
    values: tuple[str, str, str]  #: three texts as in the file
    variance: tuple[float, ...]  #: XX, XY, XZ, YY, YZ, ZZ
    blocks: Sequence[Array]  #: 3x3 covariances with each of the entries that follow
    ignored: bool  #: it carries the ignore flag
    place: RecordPlace  #: of the record


@dataclass(frozen=True)
class GnssCluster:
    """A GNSS measurement."""

    type: str  #: G (baseline), X (baselines) or Y (points)
    coordinates: str  #: type of the coordinates
    entries: Sequence[Entry]  #: its baselines or points
    scales: tuple[float, float, float, float]  #: of the covariances: V, P, L and H
    #: of the coordinates
    frame: str
    epoch: str
    place: RecordPlace  #: of the record

    def covariance(self) -> Array:
        """Covariance (3n, 3n) as given, before scaling."""
        n = len(self.entries)
        out = np.zeros((3 * n, 3 * n))
        for k, entry in enumerate(self.entries):
            if len(entry.blocks) != n - 1 - k:
                raise entry.place.error(
                    f"{len(entry.blocks)} covariance blocks follow where the cluster of {n} "
                    f"needs {n - 1 - k}"
                )
            xx, xy, xz, yy, yz, zz = entry.variance
            rows = slice(3 * k, 3 * k + 3)
            out[rows, rows] = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
            for j, block in enumerate(entry.blocks, start=k + 1):
                out[rows, 3 * j : 3 * j + 3] = block
                out[3 * j : 3 * j + 3, rows] = block.T
        return out


@dataclass(frozen=True)
class TerrestrialRecord:
    """A terrestrial measurement."""

    type: str  #: letter of the measurement type
    names: tuple[str, ...]  #: of the stations
    #: in metres or radians
    value: float
    sigma: float
    #: in metres
    height_instrument: float
    height_target: float
    ignored: bool  #: it carries the ignore flag
    place: RecordPlace  #: of the record
    set_name: str = ""  #: name of the set of directions


@dataclass
class Records:
    """All records of one file."""

    file: str  #: its name
    #: defaults of the file
    frame: str
    epoch: str
    #: the records
    stations: list[StationRecord] = field(default_factory=list)
    clusters: list[GnssCluster] = field(default_factory=list)
    sights: list[TerrestrialRecord] = field(default_factory=list)
    #: geoid height [m] and deflections xi, eta [rad] by the name of the station
    geoid: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)  #: sentences

    def refuse(self, kind: str, ignored: bool, place: RecordPlace) -> None:
        """Warn of a measurement of an unread type if it is ignored, else refuse it."""
        name = TYPES.get(kind, "unknown")
        if not ignored:
            raise place.error(
                f"measurement type {kind} ({name}) is not read",
                "set its ignore flag in the file, or leave it out",
            )
        self.warnings.append(f"{place}: ignored measurement of type {kind} ({name}) is not read")


def number(text: str, what: str, place: RecordPlace) -> float:
    """A finite number."""
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not isfinite(value):
        raise place.error(f"{what} is {text.strip()!r}, not a number")
    if too_large(value):
        raise place.error(f"{what} is {text.strip()}, beyond any measurement")
    return value


def packed_dms(text: str, what: str, place: RecordPlace) -> float:
    """Angle [rad] of a text ``ddd.mmsssss``: degrees, two digits of minutes, then seconds."""
    number(text, what, place)
    plain = text.strip()
    sign = -1.0 if plain.startswith("-") else 1.0
    degrees, _, fraction = plain.lstrip("+-").partition(".")
    fraction = fraction.ljust(4, "0")
    if not (degrees or "0").isdigit() or not fraction.isdigit():
        raise place.error(f"{what} is {plain!r}, not degrees.minutesseconds")
    minutes, seconds = int(fraction[:2]), float(f"{fraction[2:4]}.{fraction[4:] or 0}")
    try:
        return sign * from_dms(int(degrees or 0), minutes, seconds, plain)
    except ValueError as error:
        raise place.error(
            f"{what}: {error}",
            "write angles as degrees.minutesseconds, such as 145.5741 for 145 degrees 57' 41\"",
        ) from None
