"""The columns that a CSV file may have, and their meaning.

A measured column is a quantity and its unit, ``slope_distance_m``; the unit must be there. Key
columns hold names. Which keys and quantities a file has decides what kind of table it is; a column
that its table does not know is refused, so that nothing typed is silently left out.

The quantities that are observed come from the observation kinds
(:class:`~tribrach.observations.declaration.CsvColumns`): a kind of sights between two positions is
a column of the table of sights as soon as it says so.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass, field

from tribrach.observations.base import Observations
from tribrach.observations.control import Coordinates, Offsets
from tribrach.observations.declaration import CsvColumns, Planned
from tribrach.observations.gnss import GnssBaselines, GnssPositions
from tribrach.observations.headings import Headings
from tribrach.observations.instrument_frames import AxisRadii
from tribrach.observations.registry import kinds
from tribrach.observations.scanner import Inclinations, ScannerPolar, TargetCentres
from tribrach.observations.sights import Angles
from tribrach.observations.telescopes import TelescopeTargets

LENGTH = ("m", "mm", "cm", "km", "ft", "usft")


ANGLE = ("gon", "deg", "dms", "rad", "mrad", "mgon", "cc", "arcmin", "arcsec")


VARIANCE = ("m2", "mm2")


_MILLIMETRES = tuple(dict.fromkeys(("mm", *LENGTH)))


#: units of a column by the unit of the row of a kind that it holds
_BY_ROW = {"m": LENGTH, "rad": ANGLE, "1": ("percent", "ppm")}


#: lengths and angles that no kind observes, or that are other names of what it observes
_LENGTHS = (
    "height_instrument", "height_target", "antenna_height", "eccentricity", "length", "easting",
    "northing", "height", "ecef_x", "ecef_y", "ecef_z", "radius", "plane",
)  # fmt: skip


_ANGLES = ("latitude", "longitude", "tilt", "bubble", "elevation")


COVARIANCE = ("cxx", "cxy", "cxz", "cyy", "cyz", "czz")


LOCAL = ("cee", "cen", "ceu", "cnn", "cnu", "cuu")


#: units that people write these in
_USUAL = {
    "horizontal": "deg", "elevation": "deg", "latitude": "deg", "longitude": "deg",
    "tilt_x": "arcsec", "tilt_y": "arcsec", "tilt": "arcsec", "bubble": "arcmin",
    "eccentricity": "mm", "heading": "deg",
}  # fmt: skip


def _quantities() -> dict[str, tuple[str, ...]]:
    """Quantities and their sigmas with the units that each may have, the usual one first."""
    observed = {
        name: _BY_ROW[kind.units[min(row, len(kind.units) - 1)]]
        for kind in kinds()
        for columns in kind.facts.csv
        for row, name in enumerate(columns.values)
    }
    measured = observed | dict.fromkeys(_LENGTHS, LENGTH) | dict.fromkeys(_ANGLES, ANGLE)
    out: dict[str, tuple[str, ...]] = {
        **measured,
        **dict.fromkeys((*COVARIANCE, *LOCAL), VARIANCE),
        "sigma": tuple(dict.fromkeys(("mm", "arcsec", *LENGTH, *ANGLE))),
        "sigma_across": _MILLIMETRES,
        "prism_constant": _MILLIMETRES,
    }
    for name, unit in _USUAL.items():
        out[name] = tuple(dict.fromkeys((unit, *out[name])))
    for name, units in measured.items():
        # nobody writes a sigma in degrees, minutes and seconds
        usual = dict.fromkeys(("arcsec", "mgon", "mm", "ppm", *units))
        out[f"sigma_{name}"] = tuple(u for u in usual if u in units and u != "dms")
    return out


#: quantities and the units each may have, the usual ones first
QUANTITIES = _quantities()


#: columns of plain numbers
NUMBERS = (
    "face", "repetitions", "atmosphere_ppm", "temperature_c", "pressure_hpa", "humidity_percent",
)  # fmt: skip


#: columns of names and words
WORDS = (
    "from", "to", "at", "point", "gnss", "station", "scan", "target", "mark", "set", "use",
    "reason", "group", "role", "comment", "setup", "code", "kind", "height_instrument_of",
    "height_target_of", "telescope", "axis", "foot", "along", "lever_arm",
)  # fmt: skip


_COMMON = ("use", "reason", "group", "comment")


@dataclass(frozen=True)
class TableLayout:
    """A kind of table."""

    name: str  #: in words
    needs: tuple[str, ...]  #: columns that it must have; they tell it from other tables
    #: columns that it may have
    words: tuple[str, ...] = ()
    numbers: tuple[str, ...] = ()
    aliases: dict[str, str] = field(default_factory=dict, hash=False)  #: other names of its columns

    def knows(self, column: str) -> bool:
        """True if tables of this kind may have the column (by its quantity)."""
        return column in (*self.words, *self.numbers, *_COMMON) or column in self.aliases

    def documented(self) -> tuple[str, str, str]:
        """Name, columns it must have and columns it may have, as in the documentation."""
        further = [name for name in (*self.numbers, *self.words) if name not in self.needs]
        has, may = (
            ", ".join(f"`{titled(name)}`" for name in part) for part in (self.needs, further)
        )
        return self.name, has, may


def titled(quantity: str) -> str:
    """A column name of a quantity with its usual unit."""
    return f"{quantity}_{QUANTITIES[quantity][0]}" if quantity in QUANTITIES else quantity


def _with_sigma(*names: str) -> tuple[str, ...]:
    return (*names, *(f"sigma_{name}" for name in names))


def _needs(kind: type[Observations], number: int = 0) -> tuple[str, ...]:
    """All columns of a kind in its first or another table."""
    columns = kind.facts.csv[number]
    return (*columns.keys, *columns.values)


#: kinds that are columns of the table of sights, by quantity
SIGHT_KINDS: dict[str, tuple[type[Observations], CsvColumns]] = {
    columns.values[0]: (kind, columns)
    for kind in kinds()
    for columns in kind.facts.csv
    if columns.is_sight
}


#: x, y, z and easting, northing, height are other names of e, n, u; likewise their sigmas
_AXES = {"x": "e", "y": "n", "z": "u", "easting": "e", "northing": "n", "height": "u"}


_PLACES = _AXES | {f"sigma_{a}": f"sigma_{b}" for a, b in _AXES.items()}


_PLACES |= dict(zip(COVARIANCE, LOCAL, strict=True))


_GEODETIC = ("latitude", "longitude", "ecef_x", "ecef_y", "ecef_z")


_HEIGHTS = ("height_instrument", "height_target")


_CORRECTIONS = (
    "prism_constant", "atmosphere_ppm", "temperature_c", "pressure_hpa", "humidity_percent",
)  # fmt: skip


SCANNER_POLAR = TableLayout(
    "scanner polar observations",
    _needs(ScannerPolar),
    ("station", "target", "set"),
    (*_with_sigma(*ScannerPolar.facts.csv[0].values), "face"),
)


SCANNER_TARGETS = TableLayout(
    "scanner targets",
    _needs(TargetCentres),
    ("station", "target", "set"),
    (
        *_with_sigma(*TargetCentres.facts.csv[0].values),
        *COVARIANCE,
        "sigma_range",
        "sigma_across",
        "face",
    ),
)


READINGS = TableLayout(
    "readings of a total station",
    ("station", "target", "direction"),
    ("station", "target", "setup", "set", "code"),
    ("direction", "zenith", "slope_distance", "face", *_HEIGHTS, *_CORRECTIONS),
)


RODS = TableLayout(
    "targets on rods",
    _needs(Offsets),
    ("mark", "target"),
    (*_with_sigma(*Offsets.facts.csv[0].values), "bubble", "eccentricity"),
)


INCLINATIONS = TableLayout(
    "inclinations",
    _needs(Inclinations),
    ("station",),
    (*Inclinations.facts.csv[0].values, "sigma_tilt"),
)


HEADINGS = TableLayout(
    "headings",
    _needs(Headings),
    ("station", "axis"),
    _with_sigma(*Headings.facts.csv[0].values),
)


POSITIONS = TableLayout(
    "GNSS positions",
    GnssPositions.facts.csv[0].keys,
    ("gnss", "set", "lever_arm"),
    (*_with_sigma(*GnssPositions.facts.csv[0].values), *LOCAL, *_GEODETIC, "antenna_height"),
    _PLACES,
)


COORDINATES = TableLayout(
    "coordinates",
    Coordinates.facts.csv[0].keys,
    ("point", "role"),
    (*_with_sigma(*Coordinates.facts.csv[0].values), *LOCAL, *_GEODETIC),
    _PLACES | {"code": "comment"},
)


ANGLES = TableLayout(
    "angles",
    _needs(Angles),
    Angles.facts.csv[0].keys,
    (*_with_sigma(*Angles.facts.csv[0].values), "sigma", "repetitions", *_HEIGHTS),
)


VECTORS = TableLayout(
    "vectors in the work frame",
    _needs(GnssBaselines),
    ("from", "to"),
    (*_with_sigma(*GnssBaselines.facts.csv[0].values), *LOCAL),
)


GEOCENTRIC_VECTORS = TableLayout(
    "geocentric vectors",
    _needs(GnssBaselines, 1),
    ("from", "to"),
    (*_with_sigma(*GnssBaselines.facts.csv[1].values), *COVARIANCE),
)


PLANNED = TableLayout(
    "planned observations",
    ("from", "to", "kind"),
    ("from", "to", "kind", "set"),
    (
        *(
            f"sigma_{name}"
            for name, (_, columns) in SIGHT_KINDS.items()
            if columns.planned is not Planned.NO
        ),
        *(f"sigma_{name}" for name in GnssPositions.facts.csv[0].values),
        "length",
        "repetitions",
        *_HEIGHTS,
    ),
)


SIGHTS = TableLayout(
    "sights",
    ("from", "to"),
    ("from", "to", "set", *(f"{name}_of" for name in _HEIGHTS)),
    (*_with_sigma(*SIGHT_KINDS), "sigma", "length", "repetitions", *_with_sigma(*_HEIGHTS)),
)


TELESCOPE = TableLayout(
    "targets on a telescope",
    (*TelescopeTargets.facts.csv[0].keys, "azimuth", "elevation"),
    ("telescope", "target", "point", "set"),
    ("azimuth", "elevation", "sigma_azimuth", "sigma_elevation", "sigma"),
)


CIRCLES = TableLayout(
    "circles about an axis",
    AxisRadii.facts.csv[0].keys,
    ("axis", "target", "point", "along", "foot"),
    ("sigma_radius", "sigma_plane"),
)


#: the kinds of table, which no file can be two of (tests/io/survey/test_csv_layouts.py)
LAYOUTS: tuple[TableLayout, ...] = (
    TELESCOPE,
    CIRCLES,
    SCANNER_POLAR,
    SCANNER_TARGETS,
    READINGS,
    RODS,
    INCLINATIONS,
    HEADINGS,
    POSITIONS,
    COORDINATES,
    ANGLES,
    VECTORS,
    GEOCENTRIC_VECTORS,
    PLANNED,
    SIGHTS,
)


def units_of(quantity: str) -> str:
    """The units of a quantity in words."""
    return ", ".join(QUANTITIES[quantity])


def nearest(name: str) -> str | None:
    """The known column name that is written most like this one."""
    names = [f"{quantity}_{unit}" for quantity, units in QUANTITIES.items() for unit in units]
    close = difflib.get_close_matches(name, [*WORDS, *NUMBERS, *names], 1)
    return close[0] if close else None
