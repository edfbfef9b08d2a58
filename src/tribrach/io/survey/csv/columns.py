"""Which columns may a CSV file have, and what do they say?

A measured column is a quantity and its unit, ``slope_distance_m``; the unit must be there. Key
columns hold names. Which keys and quantities a file has decides what kind of table it is; a column
that its kind does not know is refused, so that nothing typed is silently left out.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass, field

__all__ = [
    "COVARIANCE",
    "KINDS",
    "LOCAL",
    "NUMBERS",
    "QUANTITIES",
    "WORDS",
    "Kind",
    "nearest",
    "units_of",
]

LENGTH = ("m", "mm", "cm", "km", "ft", "usft")


ANGLE = ("gon", "deg", "dms", "rad", "mrad", "mgon", "cc", "arcmin", "arcsec")


VARIANCE = ("m2", "mm2")


_LENGTHS = (
    "slope_distance", "horizontal_distance", "height_difference", "distance", "height_instrument",
    "height_target", "antenna_height", "rod", "eccentricity", "length", "range", "e", "n", "u",
    "easting", "northing", "height", "x", "y", "z", "de", "dn", "du", "dx", "dy", "dz", "ecef_x",
    "ecef_y", "ecef_z",
)  # fmt: skip


_ANGLES = (
    "direction", "angle", "azimuth", "zenith", "horizontal", "latitude", "longitude", "tilt_x",
    "tilt_y", "tilt", "bubble",
)  # fmt: skip


COVARIANCE = ("cxx", "cxy", "cxz", "cyy", "cyz", "czz")


LOCAL = ("cee", "cen", "ceu", "cnn", "cnu", "cuu")


#: quantities and the units each may have, the usual ones first
QUANTITIES: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(_LENGTHS, LENGTH),
    **dict.fromkeys(_ANGLES, ANGLE),
    **dict.fromkeys((*COVARIANCE, *LOCAL), VARIANCE),
    "sigma": LENGTH + ANGLE,
    "sigma_across": LENGTH,
    "prism_constant": LENGTH,
}


for _name in (*_LENGTHS, *_ANGLES):
    _units = QUANTITIES[_name]
    # nobody writes a sigma in degrees, minutes and seconds
    _usual = dict.fromkeys(("arcsec", "mgon", "mm", *_units))
    QUANTITIES[f"sigma_{_name}"] = tuple(u for u in _usual if u in _units and u != "dms")


#: columns of plain numbers
NUMBERS = (
    "face", "repetitions", "atmosphere_ppm", "temperature_c", "pressure_hpa", "humidity_percent",
)  # fmt: skip


#: columns of names and words
WORDS = (
    "from", "to", "at", "point", "gnss", "station", "scan", "target", "mark", "set", "use",
    "reason", "group", "role", "comment", "setup", "code", "kind",
)  # fmt: skip


_COMMON = ("use", "reason", "group", "comment")


@dataclass(frozen=True)
class Kind:
    """A kind of table: what it must have, what it may have, and other names of its columns."""

    name: str
    needs: tuple[str, ...]
    words: tuple[str, ...] = ()
    numbers: tuple[str, ...] = ()
    aliases: dict[str, str] = field(default_factory=dict)

    def knows(self, column: str) -> bool:
        """True if tables of this kind may have the column (by its quantity)."""
        return column in (*self.words, *self.numbers, *_COMMON) or column in self.aliases


def _with_sigma(*names: str) -> tuple[str, ...]:
    return (*names, *(f"sigma_{name}" for name in names))


#: x, y, z and easting, northing, height are other names of e, n, u; likewise their sigmas
_AXES = {"x": "e", "y": "n", "z": "u", "easting": "e", "northing": "n", "height": "u"}


_PLACES = _AXES | {f"sigma_{a}": f"sigma_{b}" for a, b in _AXES.items()}


_PLACES |= dict(zip(COVARIANCE, LOCAL, strict=True))


_GEODETIC = ("latitude", "longitude", "ecef_x", "ecef_y", "ecef_z")


_HEIGHTS = ("height_instrument", "height_target")


_CORRECTIONS = (
    "prism_constant", "atmosphere_ppm", "temperature_c", "pressure_hpa", "humidity_percent",
)  # fmt: skip


_SIGHTS = _with_sigma(
    "direction", "zenith", "slope_distance", "horizontal_distance", "distance", "azimuth",
    "height_difference",
)  # fmt: skip


#: what planned observations have sigmas of
_PLANNED = (
    "direction", "zenith", "slope_distance", "horizontal_distance", "distance", "azimuth",
    "height_difference", "e", "n", "u",
)  # fmt: skip


#: the kinds of table; the first whose needs are all there is taken
KINDS: tuple[Kind, ...] = (
    Kind(
        "scanner polar observations",
        ("station", "target", "range", "horizontal", "zenith"),
        ("station", "target", "set"),
        (*_with_sigma("range", "horizontal", "zenith"), "face"),
    ),
    Kind(
        "scanner targets",
        ("station", "target", "x", "y", "z"),
        ("station", "target", "set"),
        (*_with_sigma("x", "y", "z"), *COVARIANCE, "sigma_range", "sigma_across", "face"),
    ),
    Kind(
        "readings of a total station",
        ("station", "target", "direction"),
        ("station", "target", "setup", "set", "code"),
        ("direction", "zenith", "slope_distance", "face", *_HEIGHTS, *_CORRECTIONS),
    ),
    Kind(
        "targets on rods",
        ("mark", "target", "rod"),
        ("mark", "target"),
        ("rod", "sigma_rod", "bubble", "eccentricity"),
    ),
    Kind(
        "inclinations",
        ("station", "tilt_x", "tilt_y"),
        ("station",),
        ("tilt_x", "tilt_y", "sigma_tilt"),
    ),
    Kind(
        "GNSS positions",
        ("gnss",),
        ("gnss", "set"),
        (*_with_sigma("e", "n", "u"), *LOCAL, *_GEODETIC, "antenna_height"),
        _PLACES,
    ),
    Kind(
        "coordinates",
        ("point",),
        ("point", "role"),
        (*_with_sigma("e", "n", "u"), *LOCAL, *_GEODETIC),
        _PLACES,
    ),
    Kind(
        "angles",
        ("at", "from", "to", "angle"),
        ("at", "from", "to"),
        (*_with_sigma("angle"), "sigma", "repetitions", *_HEIGHTS),
    ),
    Kind(
        "vectors in the work frame",
        ("from", "to", "de", "dn", "du"),
        ("from", "to"),
        (*_with_sigma("de", "dn", "du"), *LOCAL),
    ),
    Kind(
        "geocentric vectors",
        ("from", "to", "dx", "dy", "dz"),
        ("from", "to"),
        (*_with_sigma("dx", "dy", "dz"), *COVARIANCE),
    ),
    Kind(
        "planned observations",
        ("from", "to", "kind"),
        ("from", "to", "kind", "set"),
        (
            *(f"sigma_{name}" for name in _PLANNED),
            "length",
            "repetitions",
            *_HEIGHTS,
        ),
    ),
    Kind(
        "sights",
        ("from", "to"),
        ("from", "to", "set"),
        (*_SIGHTS, "sigma", "length", "repetitions", *_HEIGHTS),
    ),
)


def units_of(quantity: str) -> str:
    """The units of a quantity in words."""
    return ", ".join(QUANTITIES[quantity])


def nearest(name: str) -> str | None:
    """The known column name that is written most like this one."""
    names = [f"{quantity}_{unit}" for quantity, units in QUANTITIES.items() for unit in units]
    found = difflib.get_close_matches(name, [*WORDS, *NUMBERS, *names], 1)
    return found[0] if found else None
