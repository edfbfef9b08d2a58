"""Settings of a STAR*NET project: units, kind of job, grid, refraction and instruments.

They stand in the project file (``.snproj``, ``.prj``); the heading of a listing repeats those that
decide about the results, so that a job of which only data and listing were kept can be computed
again. Project files give lengths in metres and angles in arc seconds, whatever the units of the
project.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from pyproj import CRS
from pyproj.exceptions import CRSError

from tribrach.errors import InputError
from tribrach.geodesy.proj_grids import offline
from tribrach.io.opened_files import lines_of
from tribrach.io.survey.starnet.recognition import is_listing
from tribrach.io.survey.starnet.text import LINEAR_UNITS, text_of
from tribrach.units import SEC, too_large

#: refraction is written as the part of the angle at the centre of the Earth that the ray is bent
#: by: half of the coefficient of the method
REFRACTION_PER_UNIT = 2.0


@dataclass(frozen=True)
class StandardErrors:
    """Standard errors of an instrument; these where neither project nor file gives any."""

    #: of distances [m] and [m/m]
    distance: float = 0.0075
    distance_ppm: float = 2e-6
    #: of angles [rad]
    angle: float = 4 * SEC
    direction: float = 3 * SEC
    azimuth: float = 4 * SEC
    zenith: float = 10 * SEC
    #: of height differences of single sights [m] and [m/m]
    rise: float = 0.015240
    rise_ppm: float = 0.0
    #: of centring in plan at either end, and of either height [m]
    instrument: float = 0.0
    target: float = 0.0
    vertical: float = 0.0


@dataclass(frozen=True)
class StarnetSettings:
    """What a project says about all of its data."""

    source: str = ""  #: file that they are from, empty if none says them
    kind: str = "3D"  #: ``2D``, ``3D`` or ``LEV``
    unit: float = 1.0  #: unit of lengths [m]
    gon: bool = False  #: angles are gon and not degrees
    east_first: bool = False  #: coordinates are written east, north
    from_at_to: bool = False  #: angles are written from-at-to, not at-from-to
    #: horizontal distances and height differences, not slope distances and zenith angles
    delta: bool = False
    grid: str | None = None  #: name of the grid of a grid job, None of a local one
    crs: str | None = None  #: the same for PROJ, None if the name is not known
    elevation: float = 0.0  #: of all points of a job in plan [m]
    scale: float = 1.0  #: length in a local system over length on the ground
    geoid: float = 0.0  #: geoid height of all points [m]
    #: north and east component of the deflection of the vertical [rad]
    deflection: tuple[float, float] = (0.0, 0.0)
    #: coefficient k of the method, twice what STAR*NET writes
    refraction: float = 0.07 * REFRACTION_PER_UNIT
    radius: float = 6372000.0  #: of the Earth, for local jobs [m]
    default: StandardErrors = StandardErrors()  #: standard errors where no instrument is named
    #: others by name, in capitals
    instruments: Mapping[str, StandardErrors] = field(default_factory=dict)
    #: of a height difference levelled over a metre [m], or over one turn
    levelling: float = 0.0015 / math.sqrt(1000)
    by_turns: bool = False
    propagated: bool = False  #: constant and ppm of distances are added in squares
    west_positive: bool = True  #: sign of longitudes
    #: on standard errors of vectors in plan and height; of centring in plan and height [m]
    gnss_factor: tuple[float, float] = (1.0, 1.0)
    gnss_centring: tuple[float, float] = (0.0, 0.0)
    #: standard errors of vectors without: constant [m] and [m/m]
    gnss_default: tuple[float, float] = (0.005, 0.0)
    #: standard errors of what is fixed [m] and [rad]
    fixed_length: float = 1e-7
    fixed_angle: float = 1.0001e-3 * SEC
    confidence: float = 0.95  #: of ellipses
    files: tuple[str, ...] = ()  #: data files that are used, as named
    refusals: tuple[str, ...] = ()  #: what the project asks for and is not done
    warnings: tuple[str, ...] = ()  #: what has no effect


def read_settings(path: Path) -> StarnetSettings:
    """Settings of a project file, or of the heading of a listing."""
    text = text_of(path)
    settings = _of_listing(text, path) if is_listing(text) else _of_project(text, path)
    crs = None if settings.grid is None else grid_of(settings.grid)
    if settings.grid is not None and crs is None:
        raise InputError(
            f"the grid {settings.grid} is not known here",
            file=path,
            cure="write its EPSG code in its place, such as EPSG:26919",
        )
    return replace(settings, source=path.name, crs=crs)


# Project files: sections in brackets, lines of a key and a value.

_HEADING = re.compile(r"^\[(\w+)\]\s*$")
_FILE = re.compile(r'^(\d+)\s+"(.*)"\s*$')
_YES = ("1", "Y", "YES", "TRUE")


class _Values:
    """Keys and values of one section of a project file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.values: dict[str, tuple[str, int]] = {}

    def error(self, key: str, what: str, cure: str | None = None) -> InputError:
        return InputError(what, file=self.path, line=self.values[key][1], cure=cure)

    def text(self, key: str, default: str = "") -> str:
        return self.values.get(key, (default, 0))[0]

    def number(self, key: str, default: float) -> float:
        if key not in self.values:
            return default
        word = self.text(key)
        try:
            value = float(word)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self.error(key, f"{key} is {word!r}, not a number")
        if too_large(value):
            raise self.error(key, f"{key} is {word}, beyond any measurement")
        return value

    def size(self, key: str, default: float) -> float:
        value = self.number(key, default)
        if value < 0:
            raise self.error(key, f"{key} is {value:g}, below zero")
        return value

    def yes(self, key: str) -> bool:
        return self.text(key, "0").upper() in _YES


def _of_project(text: str, path: Path) -> StarnetSettings:
    """Settings of a project file."""
    sections, library, files = _sections(text, path)
    if "adjustment" not in sections:
        raise InputError(
            "there is no section [Adjustment]", file=path, cure="give a project file of STAR*NET"
        )
    job, instrument = sections["adjustment"], sections.get("instrument", _Values(path))
    kind = job.text("adjustment_type", "3D").upper()
    if kind not in ("2D", "3D") and not kind.startswith("LEV"):
        raise job.error("adjustment_type", f"the adjustment_type {kind} is not known")
    unit = job.text("linear_units", "Meters").upper()
    if unit not in LINEAR_UNITS:
        raise job.error("linear_units", f"the linear_units {unit} are not known")
    turns = instrument.text("level_section_type", "LENGTH").upper().startswith("TURN")
    refusals, warnings = _not_done(job)
    alt = job.yes("gps_factor_alt_vert"), job.yes("gps_centering_alt_vert")
    grid = job.yes("local_or_grid_adjustment")
    factor = job.size("gps_factor_horiz", 1.0) if job.yes("gps_factor") else 1.0
    centring = job.size("gps_centering_horiz", 0.0) if job.yes("gps_centering") else 0.0
    return StarnetSettings(
        kind=kind[:3],
        unit=LINEAR_UNITS[unit],
        gon=job.text("angle_output_units", "DMS").upper().startswith("G"),
        east_first=job.text("coordinate_order", "NE").upper() == "EN",
        from_at_to=job.text("angle_station_order", "At-From-To").upper() == "FROM-AT-TO",
        delta=job.text("3D_input_mode", "Slope/Zenith").upper().startswith("H"),
        grid=job.text("coordinate_system_name") if grid else None,
        elevation=job.number("project_elevation", 0.0),
        scale=1.0 if grid else job.number("scale_factor", 1.0),
        geoid=job.number("geoid_height", 0.0),
        deflection=(
            job.number("vert_defl_north", 0.0) * SEC,
            job.number("vert_defl_east", 0.0) * SEC,
        ),
        refraction=job.number("index_of_refraction", 0.07) * REFRACTION_PER_UNIT,
        radius=job.size("earth_radius_meters", 6372000.0),
        default=_standard_errors(instrument),
        instruments={name: _standard_errors(part) for name, part in library.items()},
        levelling=instrument.size("level_std_err", 0.0015 / math.sqrt(1000)),
        by_turns=turns,
        west_positive=not job.yes("longitude_convention"),
        gnss_factor=(factor, job.size("gps_factor_vert", 1.0) if alt[0] else factor),
        gnss_centring=(centring, job.size("gps_centering_vert", 0.0) if alt[1] else centring),
        gnss_default=(
            job.size("gps_defaults_stderr", 0.005),
            job.size("gps_defaults_ppm", 0.0) * 1e-6,
        ),
        fixed_length=job.size("fixed_linear_std_err", 1e-7),
        fixed_angle=job.size("fixed_angular_std_err", 1.0001e-3) * SEC,
        confidence=job.size("ell_percent_confidence", 95.0) / 100,
        files=files,
        refusals=refusals,
        warnings=warnings,
    )


def _sections(
    text: str, path: Path
) -> tuple[dict[str, _Values], dict[str, _Values], tuple[str, ...]]:
    """Sections by name, instruments of the library by name, data files that are in use."""
    sections: dict[str, _Values] = {}
    library: dict[str, _Values] = {}
    files: list[str] = []
    name, current = "", _Values(path)
    for number, line in enumerate(lines_of(text), start=1):
        line = line.strip()
        if not line or line.startswith("#"):
            continue
        heading = _HEADING.match(line)
        if heading:
            name = heading[1].lower()
            current = sections.setdefault(name, _Values(path))
            continue
        listed = _FILE.match(line)
        if name == "datafilelist" and listed:
            # the lowest bit is the check mark of the list, the next one an open window
            files += [listed[2]] if int(listed[1]) & 1 else []
            continue
        key, _, value = line.partition(" ")
        if name == "instrumentlibrary" and key == "instrument_name":
            current = library.setdefault(value.strip().upper(), _Values(path))
        current.values[key] = (value.strip(), number)
    return sections, library, tuple(files)


def _standard_errors(part: _Values) -> StandardErrors:
    """Standard errors of an instrument of a project file."""
    basis = StandardErrors()
    return StandardErrors(
        distance=part.size("distance_std_err", basis.distance),
        distance_ppm=part.size("edm_ppm", basis.distance_ppm * 1e6) * 1e-6,
        angle=part.size("angle_std_err", basis.angle / SEC) * SEC,
        direction=part.size("direction_std_err", basis.direction / SEC) * SEC,
        azimuth=part.size("azimuth_std_err", basis.azimuth / SEC) * SEC,
        zenith=part.size("zenith_std_err", basis.zenith / SEC) * SEC,
        rise=part.size("delta_elev_std_err", basis.rise),
        rise_ppm=part.size("delta_elev_ppm", 0.0) * 1e-6,
        instrument=part.size("instrument_centering_error", 0.0),
        target=part.size("target_centering_error", 0.0),
        vertical=part.size("vertical_centering_error", 0.0),
    )


def _not_done(job: _Values) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """What a project file asks for and is not done, and what has no effect."""
    refusals = []
    if job.yes("gps_transformations"):
        refusals.append("transformations of GPS vectors (gps_transformations) are not computed")
    warnings = []
    if job.yes("geoid_modeling"):
        warnings.append("its geoid model is not read: its heights are taken with the geoid height")
    if not job.yes("local_or_grid_adjustment") and job.number("common_datum_reduction", 0.0):
        warnings.append("its reduction of distances to a common elevation is not done")
    if job.yes("vert_defl_modeling"):
        warnings.append("its model of deflections of the vertical is not read")
    return tuple(refusals), tuple(warnings)


# Listings: a heading with lines of a name, a colon and a value.

_OPTION = re.compile(r"^\s{6,}(\S.*?)\s*: +(\S.*?)\s*$")
_INSTRUMENT = re.compile(r"^ {6}Project (Default Instrument|Library Instrument (\S+))\s*$")
_END = re.compile(r"^ +Summary of (Unadjusted|Inconsistent)")
_DEFLECTION = re.compile(r"N=\s*(\S+)\s+E=\s*(\S+)")


def _of_listing(text: str, path: Path) -> StarnetSettings:
    """Settings that the heading of a listing repeats."""
    options: dict[str, tuple[str, int]] = {}
    instruments: dict[str, dict[str, tuple[str, int]]] = {}
    current = options
    for number, line in enumerate(lines_of(text), start=1):
        if _END.match(line):
            break
        heading = _INSTRUMENT.match(line)
        if heading:
            current = instruments.setdefault((heading[2] or "").upper(), {})
        option = _OPTION.match(line)
        if option:
            current[option[1]] = (option[2], number)

    def text_value(name: str, default: str) -> str:
        return options.get(name, (default, 0))[0]

    def first(part: Mapping[str, tuple[str, int]], name: str, default: float) -> float:
        if name not in part:
            return default
        word, number = part[name]
        try:
            return float(word.split()[0])
        except ValueError:
            raise InputError(f"{name} is {word!r}", file=path, line=number) from None

    units = text_value("Project Units", "Meters; DMS").upper().replace(" ", "").split(";")
    if units[0] not in LINEAR_UNITS:
        raise InputError(f"the units {units[0]} are not known", file=path)
    unit = LINEAR_UNITS[units[0]]
    grid = text_value("Coordinate System", "LOCAL")
    deflection = _DEFLECTION.search(text_value("Vertical Deflection", ""))
    default = instruments.get("", {})
    turns = "turn" in default.get("Differential Levels", ("", 0))[0].lower()
    # per kilometre or mile
    span = 1.0 if turns else (1000.0 if unit == 1.0 else 5280 * unit)
    levelling = first(default, "Differential Levels", 0.0015) * unit / math.sqrt(span)
    gon = len(units) > 1 and units[1].startswith("GON")

    def errors(part: Mapping[str, tuple[str, int]]) -> StandardErrors:
        return _listed_errors(lambda name, other: first(part, name, other), unit, gon)

    return StarnetSettings(
        kind=text_value("Type of Adjustment", "3D").upper()[:3],
        unit=unit,
        gon=gon,
        east_first=text_value("Input/Output Coordinate Order", "North-East").startswith("East"),
        from_at_to=text_value("Angle Data Station Order", "At-From-To").startswith("From"),
        delta=text_value("Distance/Vertical Data Type", "Slope/Zenith").startswith("Hor"),
        grid=None if grid.upper().startswith("LOCAL") else grid,
        geoid=first(options, "Geoid Height", 0.0) * unit,
        deflection=(0.0, 0.0)
        if deflection is None
        else (float(deflection[1]) * SEC, float(deflection[2]) * SEC),
        refraction=first(options, "Default Coefficient of Refraction", 0.07) * REFRACTION_PER_UNIT,
        default=errors(default),
        instruments={name: errors(part) for name, part in instruments.items() if name},
        levelling=levelling,
        by_turns=turns,
        west_positive="West" in text_value("Longitude Sign Convention", "Positive West"),
    )


def _listed_errors(value: Callable[[str, float], float], unit: float, gon: bool) -> StandardErrors:
    """Standard errors of one instrument of a listing."""
    # angles in gon have theirs in milligon
    angle = math.pi / 200_000 if gon else SEC
    basis = StandardErrors()
    return StandardErrors(
        distance=value("Distances (Constant)", basis.distance / unit) * unit,
        distance_ppm=value("Distances (PPM)", basis.distance_ppm * 1e6) * 1e-6,
        angle=value("Angles", basis.angle / angle) * angle,
        direction=value("Directions", basis.direction / angle) * angle,
        azimuth=value("Azimuths & Bearings", basis.azimuth / angle) * angle,
        zenith=value("Zeniths", basis.zenith / angle) * angle,
        rise=value("Elevation Differences (Constant)", basis.rise / unit) * unit,
        rise_ppm=value("Elevation Differences (PPM)", 0.0) * 1e-6,
        instrument=value("Centering Error Instrument", 0.0) * unit,
        target=value("Centering Error Target", 0.0) * unit,
        vertical=value("Centering Error Vertical", 0.0) * unit,
    )


# Names of grids.

#: grids by the names that STAR*NET has for them
_GRIDS = {"NEWBRUNSWICK83": "EPSG:2953", "PEI83": "EPSG:2954"}
_UTM = re.compile(r"UTM(83|84|27)-(\d{1,2})$")
_MTM = re.compile(r"MTM83-(\d{1,2})$")


def grid_of(name: str) -> str | None:
    """The definition for PROJ of a grid of STAR*NET, None if the name is not known."""
    key = name.upper().replace(" ", "")
    if key in _GRIDS:
        return _GRIDS[key]
    utm = _UTM.match(key)
    if utm is not None and 1 <= int(utm[2]) <= (23 if utm[1] != "84" else 60):
        base = {"83": 26900, "84": 32600, "27": 26700}[utm[1]]
        return f"EPSG:{base + int(utm[2])}"
    mtm = _MTM.match(key)
    if mtm is not None and 2 <= int(mtm[1]) <= 17:
        return f"EPSG:{32180 + int(mtm[1])}"
    try:
        offline()
        return name if CRS.from_user_input(name).is_projected else None
    except CRSError:
        return None


def name_of_grid(crs: str) -> str:
    """STAR*NET's name of a grid, the definition for PROJ itself where it has none that is known."""
    for name, code in _GRIDS.items():
        if crs == code:
            return name
    found = re.match(r"EPSG:(\d+)$", crs)
    number = int(found[1]) if found else 0
    bases = {"UTM83": 26900, "UTM84": 32600, "UTM27": 26700, "MTM83": 32180}
    for grid, base in bases.items():
        zone = number - base
        if 1 <= zone <= 60 and grid_of(f"{grid}-{zone}") == crs:
            return f"{grid}-{zone}"
    return crs
