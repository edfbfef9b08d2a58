"""What STAR*NET's data lines say, as plain records: metres and radians, names, standard errors.

A standard error is a number, or one of the words that stand in its place: fixed (``!``), free
(``*``: compared, without influence), or the default of the instrument (``&``, or nothing at all).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import NamedTuple

from tribrach.io.survey.starnet.settings import StandardErrors


class SigmaMark(Enum):
    """Words in the place of a standard error."""

    FIXED = "!"
    FREE = "*"
    DEFAULT = "&"


#: a standard error [m or rad], or a word in its place
Sigma = float | SigmaMark


class Quantity(Enum):
    """What a sight measures."""

    DIRECTION = "direction"
    ANGLE = "angle"
    BEARING = "bearing"
    SLOPE = "slope distance"
    LEVEL_DISTANCE = "horizontal distance"
    ZENITH = "zenith angle"
    RISE = "height difference"


@dataclass(frozen=True)
class Given:
    """Coordinates of a point."""

    name: str  #: of the point
    #: [m], or longitude and latitude [rad]; None where not given
    east: float | None
    north: float | None
    height: float | None
    sigmas: tuple[Sigma, Sigma, Sigma]  #: of east, north, height
    geographic: bool  #: east and north are longitude and latitude
    ellipsoidal: bool  #: the height is over the ellipsoid
    source: str  #: ``file:line``


class Sight(NamedTuple):
    """One observation of an instrument."""

    quantity: Quantity
    value: float | None  #: [m or rad], None if it is only planned
    sigma: Sigma
    #: instrument, target, and backsight of an angle
    at: str
    to: str
    back: str
    heights: tuple[float, float]  #: of instrument and target [m]
    errors: StandardErrors  #: standard errors of the instrument
    set_name: str  #: of the set of directions
    refraction: float
    length: float | None  #: horizontal length that the same line gives [m], None if it gives none
    rise: float  #: height difference along it [m]
    centring: bool  #: a standard error that is given grows by centring as well
    propagated: bool  #: constant and ppm of a distance are added in squares
    scale: float  #: length in the local system over length on the ground
    source: str
    on_grid: bool = False  #: a horizontal distance on the grid (.GRID DISTANCES)


@dataclass(frozen=True)
class Level:
    """A levelled height difference [m] with its standard error [m or a word]."""

    #: its ends
    at: str
    to: str
    value: float | None  #: [m], None if it is only planned
    sigma: Sigma  #: standard error
    default: float  #: standard error by length or turns [m]
    source: str  #: ``file:line``


@dataclass
class Vector:
    """A GNSS vector."""

    #: its ends
    at: str
    to: str
    delta: tuple[float, float, float] | None  #: geocentric [m], None if it is only planned
    covariances: bool  #: both are variances and covariances
    factor: tuple[float, float]  #: on standard errors in plan and height
    centring: tuple[float, float]  #: in plan and height [m]
    default: tuple[float, float]  #: standard error: constant [m] and [m/m]
    heights: tuple[float, float]  #: of the antennas [m]
    source: str  #: ``file:line``
    #: standard errors (or variances) of X, Y, Z as written, empty if not given
    deviations: tuple[float, ...] = ()
    #: correlations (or covariances) XY, XZ, YZ as written, empty if not given
    couplings: tuple[float, ...] = ()


@dataclass(frozen=True)
class SideShot:
    """A point that is computed from the adjusted network and takes no part in it."""

    name: str  #: of the point
    sights: tuple[Sight, ...]  #: numbers of its observations in the records
    source: str  #: ``file:line``


@dataclass
class StarnetRecords:
    """Everything that the data files of one job say."""

    kind: str  #: ``2D``, ``3D`` or ``LEV``
    given: list[Given] = field(default_factory=list)  #: coordinates
    #: observations
    sights: list[Sight] = field(default_factory=list)
    levels: list[Level] = field(default_factory=list)
    vectors: list[Vector] = field(default_factory=list)
    shots: list[SideShot] = field(default_factory=list)
    #: standard errors of the default instrument were used although nothing gives them
    assumed: set[str] = field(default_factory=set)
    codes: list[tuple[str, str]] = field(default_factory=list)  #: points and their descriptions
    face_two: list[str] = field(default_factory=list)  #: where zenith angles of face two stand
    warnings: list[str] = field(default_factory=list)  #: what has no effect
