"""Sections about what was measured, what is done with it and where it goes.

Sections with a subject of their own have a file each beside this one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from typing import Annotated, Any, Literal, Self, get_args, get_origin

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    NonNegativeFloat,
    PositiveFloat,
    ValidationInfo,
    field_validator,
    model_validator,
)

from tribrach.errors import InputError
from tribrach.geodesy.epochs import PLATES, Motion, Realisation
from tribrach.io.csv_rows import SEPARATORS, ListForm
from tribrach.io.delivery.names import TEMPLATE, DeliveryFormat
from tribrach.network.network import Datum
from tribrach.units import LARGEST

# What all sections of a project file have in common; units stand in the names of the keys.


class Section(BaseModel):
    """A table of the project file: no other keys than these, and not changed once read.

    One value where a list is asked for is a list of one.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)

    @model_validator(mode="before")
    @classmethod
    def _one_is_a_list(cls, data: Any) -> Any:
        """One value, or one table, where a list is asked for is a list of one."""
        if not isinstance(data, Mapping):
            return data
        alone = {
            key: (value,)
            for key, value in data.items()
            if not isinstance(value, list | tuple) and key in _lists_of(cls)
        }
        return {**data, **alone} if alone else data

    @field_validator("*", mode="before")
    @classmethod
    def _measurable(cls, value: object, info: ValidationInfo) -> object:
        """No number is true or false, none is larger than any measurement, and none is infinite."""
        if _holds_boolean(value) and not _asks_for_boolean(cls, str(info.field_name)):
            raise ValueError("true and false are no value of this key")
        for number in _numbers_in(value):
            if not abs(number) <= LARGEST:
                shown = (
                    f"{number:.3g}" if isinstance(number, float) else "an integer of many digits"
                )
                raise ValueError(f"{shown} is beyond any measurement")
        return value


def _numbers_in(value: object) -> Iterator[int | float]:
    """Numbers of a value and of the lists in it; tables check their own."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        yield value
    elif isinstance(value, list | tuple):
        for item in value:
            yield from _numbers_in(item)


def _holds_boolean(value: object) -> bool:
    """True for true and false, and for lists and tables that hold one."""
    if isinstance(value, Mapping):
        value = list(value.values())
    if isinstance(value, list | tuple):
        return any(_holds_boolean(item) for item in value)
    return isinstance(value, bool)


@cache
def _lists_of(model: type[BaseModel]) -> frozenset[str]:
    """Keys of fields that are lists of any length."""
    return frozenset(
        key
        for name, field in model.model_fields.items()
        if get_origin(field.annotation) is tuple and get_args(field.annotation)[1:] == (...,)
        for key in (name, field.alias or name)
    )


@cache
def _asks_for_boolean(model: type[BaseModel], name: str) -> bool:
    """True if a field takes true and false, or tables, which check their own."""
    pending: list[Any] = [model.model_fields[name].annotation]
    while pending:
        kind = pending.pop()
        if kind is bool or kind is Any or isinstance(kind, bool):
            return True
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            return True
        pending += get_args(kind)
    return False


class EpochKeys(BaseModel):
    """Keys of files whose coordinates may be of another frame or epoch than the project.

    Attributes
    ----------
    frame
        Reference frame of the coordinates, that of the site if not given.
    epoch
        Decimal year that they hold for, that of the site if not given.
    velocity_m_per_year
        Velocity of the marks in ECEF [m/year].
    plate
        Instead of a velocity, their plate in PROJ's motion model.
    """

    frame: str | None = None
    epoch: float | None = Field(default=None, gt=1900, lt=2200)
    velocity_m_per_year: tuple[float, float, float] | None = None
    plate: str | None = None

    @model_validator(mode="after")
    def _one_motion(self) -> Self:
        """A velocity or a plate, not both; a plate that is known."""
        if self.plate is not None and self.velocity_m_per_year is not None:
            raise ValueError("give either plate or velocity_m_per_year")
        if self.plate is not None and self.plate.upper() not in PLATES:
            raise ValueError(f"plate {self.plate!r} is none of {', '.join(PLATES)}")
        speed = self.velocity_m_per_year
        if speed is not None and not max(abs(v) for v in speed) < 1:
            raise ValueError("a velocity of a metre a year or more is none: it is in m, not mm")
        return self

    @property
    def motion(self) -> Motion | None:
        """How the marks move, None if it is not said."""
        if self.velocity_m_per_year is not None:
            return Motion(velocity=np.array(self.velocity_m_per_year))
        return None if self.plate is None else Motion(plate=self.plate)

    def realisation(self, job: Realisation | None) -> Realisation | None:
        """Frame and epoch of the file; what it leaves out is that of the job.

        Raises
        ------
        InputError
            It names a frame or epoch and the job has none.
        """
        if self.frame is None and self.epoch is None:
            return job
        if job is None:
            raise InputError(
                "the file has a frame or an epoch and the site has none",
                cure="add frame and epoch to the section site",
            )
        epoch = job.epoch if self.epoch is None else self.epoch
        return Realisation(self.frame or job.frame, epoch)


class ListKeys(BaseModel):
    """Keys of files that hold lists: how they are written, where the file does not tell.

    Attributes
    ----------
    columns
        Our names of columns (``point``, ``easting``, ``sigma_n_mm``) and their heads or numbers
        (from 1) in the file.
    decimal
        What stands before decimals.
    separator
        What stands between cells: a character, or semicolon, comma, tab, bar or blank.
    encoding
        Name of the encoding, such as ``cp1250``.
    sheet
        Name of the sheet of a spreadsheet.
    """

    columns: dict[str, str | int] = Field(default_factory=dict)
    decimal: Literal[".", ","] | None = None
    separator: str | None = None
    encoding: str | None = None
    sheet: str | None = None

    @field_validator("separator")
    @classmethod
    def _one_character(cls, value: str | None) -> str | None:
        if value is None or value in SEPARATORS or (len(value) == 1 and value not in '"\r\n'):
            return value
        raise ValueError(f"{value!r} is no separator; give one character, or {_or(SEPARATORS)}")

    @field_validator("encoding")
    @classmethod
    def _known_encoding(cls, value: str | None) -> str | None:
        try:
            "".encode(value or "utf-8")
        except (LookupError, UnicodeError):
            raise ValueError(
                f"{value!r} is no encoding that is known; such are utf-8, utf-16, cp1252, cp1250, "
                "latin-1, cp850"
            ) from None
        return value

    @property
    def form(self) -> ListForm:
        """The same for the readers."""
        return ListForm(self.columns, self.decimal, self.separator, self.encoding, self.sheet)


def _or(words: Iterable[str]) -> str:
    """Words with "or" before the last."""
    *first, last = words
    return f"{', '.join(first)} or {last}"


class PointFile(EpochKeys, ListKeys, Section):
    """A list of coordinates and what they are for, unless its column ``role`` says it.

    Attributes
    ----------
    file
        The file.
    role
        What its points are for.
    sigma_plan_mm, sigma_up_mm
        Standard deviations, in each of easting and northing, and in height, of points without
        sigmas in the file.
    sigma_source
        Source of these; the report names ``assumed ...``.
    covariance
        A CSV file with the covariance matrix of its control coordinates.
    """

    file: str
    role: Literal["control", "fixed", "approximate", "check"] = "control"
    sigma_plan_mm: PositiveFloat | None = None
    sigma_up_mm: PositiveFloat | None = None
    sigma_source: str = ""
    covariance: str | None = None


class ObservationFile(EpochKeys, ListKeys, Section):
    """A file of observations, or several that belong together.

    Attributes
    ----------
    file, files
        The file, or the files; one of both is given.
    format
        Format where the suffix misleads.
    instrument
        Name of the instrument, for files without standard deviations and for calibrations.
    point, base
        Marks of a solution of RTKLIB, which has no names.
    sigma_factor
        Factor on the formal standard deviations of a GNSS solution.
    stations
        Stations of a SINEX file that are wanted, all of them if not given.
    """

    file: str | None = None
    files: tuple[str, ...] = ()
    format: (
        Literal[
            "csv",
            "gama",
            "dynaml",
            "dna",
            "comp3d",
            "starnet",
            "riscan",
            "totalstation",
            "levels",
            "gnss",
        ]
        | None
    ) = None
    instrument: str | None = None
    point: str = ""
    base: str = ""
    sigma_factor: PositiveFloat | None = None
    stations: tuple[str, ...] = ()

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if (self.file is None) == (not self.files):
            raise ValueError("give either file or files")
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """The files as typed."""
        return self.files if self.file is None else (self.file,)


class Backsight(Section):
    """A sight of the scanner's telescope to a mark.

    Attributes
    ----------
    to
        Name of the mark.
    horizontal_deg
        Horizontal angle, counter-clockwise from the x axis of the scanner.
    height_target_m
        Height of the target over the mark.
    pointings
        Number of pointings that were averaged.
    sigma_arcsec
        Of the horizontal angle; default: 60 arcsec over the magnification and the root of the
        pointings.
    """

    to: str
    horizontal_deg: float = Field(ge=-360, le=360)
    height_target_m: float = 0.0
    pointings: int = Field(default=1, ge=1)
    sigma_arcsec: PositiveFloat | None = None


class StationSection(Section):
    """A scanner station: how it was set up and what it carries.

    Attributes
    ----------
    levelled
        True if its compensator kept it upright.
    levelling_arcsec
        Standard deviation of the compensator, the instrument's if not given.
    instrument
        Name of the instrument.
    lever_arm
        Name of the lever arm of the antenna or prism on the scanner.
    mounted_point
        Name of the antenna or prism in observations to it.
    occupies
        The mark that the scanner stands over.
    height_m
        Height of its centre over this mark.
    backsights
        Sights of its telescope.
    """

    levelled: bool = False
    levelling_arcsec: PositiveFloat | None = None
    instrument: str | None = None
    lever_arm: str | None = None
    mounted_point: str | None = None
    occupies: str | None = None
    height_m: float = 0.0
    backsights: tuple[Backsight, ...] = ()


class ScaleBar(Section):
    """A known length between two points or stations, held exactly with ``sigma_mm = 0``."""

    start: str = Field(alias="from")
    end: str = Field(alias="to")
    length_m: PositiveFloat
    sigma_mm: NonNegativeFloat


class HeightSection(Section):
    """A height of instrument or target that is an unknown of all sights made with it.

    Attributes
    ----------
    instrument_at, target_at
        The mark it stands over; one of both is given.
    seen_from
        Of a target: only in sights from these marks.
    sights_to
        Of an instrument: only in sights to these marks.
    files
        Only in sights of these files; of all files if not given.
    height_m
        Measured height or start value; default: the height in the files.
    sigma_mm
        Standard deviation of the measured height; without it the height is unknown.
    """

    instrument_at: str | None = None
    target_at: str | None = None
    seen_from: tuple[str, ...] = ()
    sights_to: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    height_m: float | None = Field(default=None, gt=-1e4, lt=1e4)
    sigma_mm: PositiveFloat | None = None

    @model_validator(mode="after")
    def _one_end(self) -> Self:
        if (self.instrument_at is None) == (self.target_at is None):
            raise ValueError("give either instrument_at or target_at")
        if self.target_at is None and self.seen_from:
            raise ValueError("seen_from is of targets; an instrument has sights_to")
        if self.instrument_at is None and self.sights_to:
            raise ValueError("sights_to is of instruments; a target has seen_from")
        return self


class TelescopeSection(Section):
    """What is known of the axes of a telescope; what is not given is unknown.

    A value with a sigma is observed, with a sigma of zero held, without one it is where to start
    from.

    Attributes
    ----------
    offset_m, sigma_offset_mm
        Of the elevation axis from the azimuth axis, positive ahead.
    non_orthogonality_arcsec, sigma_non_orthogonality_arcsec
        Of the axes, positive where the right end of the elevation axis is high.
    tilt_east_arcsec, tilt_north_arcsec, sigma_tilt_arcsec
        How the azimuth axis leans.
    """

    offset_m: float | None = Field(default=None, gt=-100, lt=100)
    sigma_offset_mm: NonNegativeFloat | None = None
    non_orthogonality_arcsec: float | None = Field(default=None, ge=-7200, le=7200)
    sigma_non_orthogonality_arcsec: NonNegativeFloat | None = None
    tilt_east_arcsec: float | None = Field(default=None, ge=-7200, le=7200)
    tilt_north_arcsec: float | None = Field(default=None, ge=-7200, le=7200)
    sigma_tilt_arcsec: NonNegativeFloat | None = None

    @model_validator(mode="after")
    def _values(self) -> Self:
        pairs = (
            ("offset_m", "sigma_offset_mm"),
            ("non_orthogonality_arcsec", "sigma_non_orthogonality_arcsec"),
            ("tilt_east_arcsec", "sigma_tilt_arcsec"),
            ("tilt_north_arcsec", "sigma_tilt_arcsec"),
        )
        for value, sigma in pairs:
            if getattr(self, sigma) is not None and getattr(self, value) is None:
                raise ValueError(f"{sigma} is given without {value}")
        return self


class AdjustmentSection(Section):
    """What is done besides adjusting.

    Attributes
    ----------
    snoop
        Blunders are switched off, one by one.
    robust
        Reweighting that points at blunders.
    vce
        Variance components are estimated.
    posterior
        Covariances are scaled by the a-posteriori variance factor.
    heights
        Heights of GNSS marks are weighed by the network, or follow a recipe to compare with
        it.
    height_mark
        The mark whose height the recipe keeps.
    height_station
        The levelled scan that gives the recipe all other heights.
    """

    snoop: bool = False
    robust: Literal["none", "huber", "danish", "igg3"] = "none"
    vce: bool = False
    posterior: bool = False
    heights: Literal["network", "recipe"] = "network"
    height_mark: str | None = None
    height_station: str | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.heights == "network" and (self.height_mark or self.height_station):
            raise ValueError('height_mark and height_station need heights = "recipe"')
        return self


class OutputSection(Section):
    """Folder of the results inside the project's, and how numbers are written in reports.

    Attributes
    ----------
    folder
        Folder of the results, inside the project's.
    angle
        Unit of angles.
    decimal
        Between a whole number and its fraction.
    thousands
        Between groups of three digits, in numbers of five digits and more.
    epoch
        True to write epoch.json, the coordinates with their joint covariance, for later epochs.
    deliver
        Formats of offices that the result is written in besides: dxf, landxml, gpkg, geojson,
        kml, xlsx, csv, list.
    drawing_scale
        Denominator of the scale that texts of a drawing print at, such as 500.
    list_template
        Line of a list for each point.
    """

    folder: Annotated[str, Field(min_length=1)] = "out"
    angle: Literal["gon", "deg"] = "gon"
    epoch: bool = False
    deliver: tuple[DeliveryFormat, ...] = ()
    drawing_scale: PositiveFloat | None = None
    list_template: Annotated[str, Field(min_length=1)] = TEMPLATE
    decimal: Literal[".", ","] = "."
    thousands: Literal["", " ", "'", ".", ","] = ""

    @model_validator(mode="after")
    def _two_signs(self) -> Self:
        if self.decimal == self.thousands:
            raise ValueError("decimal and thousands are the same sign: change one of them")
        return self


# The section ``[datum]`` of a project, and the same in one string.


def parse_datum(words: str) -> Datum:
    """A datum from ``control``, ``free``, ``free:A,B`` or ``fixed:A,B``.

    Raises
    ------
    InputError
        Anything else.
    """
    kind, _, rest = words.partition(":")
    kind, names = kind.strip(), tuple(n.strip() for n in rest.split(",") if n.strip())
    if kind == "control" and not names:
        return Datum("control")
    if kind == "free":
        return Datum("free", names)
    if kind == "fixed" and names:
        return Datum("fixed", names)
    raise InputError(f"{words!r} is no datum", cure="write control, free, free:A,B,C or fixed:A,B")


class DatumSection(Section):
    """Control as given, inner constraints over points, or points held at their coordinates.

    Also written as one string, ``datum = "free:A,B"``.

    Attributes
    ----------
    kind
        Control, free or fixed.
    points
        Names of the points that carry a free or fixed datum.
    """

    kind: Literal["control", "free", "fixed"] = "control"
    points: tuple[str, ...] = ()

    @model_validator(mode="before")
    @classmethod
    def _from_words(cls, data: Any) -> Any:
        if not isinstance(data, str):
            return data
        try:
            datum = parse_datum(data)
        except InputError as error:
            raise ValueError(f"{error.what}; {error.cure}") from error
        return {"kind": datum.kind, "points": datum.names}

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.kind == "fixed" and not self.points:
            raise ValueError("a fixed datum names its points")
        if self.kind == "control" and self.points:
            raise ValueError("the datum control takes no points: the files of points say which")
        return self


# The sections ``[lever_arms.NAME]`` of a project.


class LeverArm(Section):
    """An antenna or prism on a scanner, in the scanner frame.

    Either components with their standard deviations, or the file of a lever arm that another
    project estimated.

    Attributes
    ----------
    file
        File of a lever arm.
    x_m, y_m, z_m
        Its components.
    sigma_mm
        Standard deviation of all components; one of 0 is held.
    sigma_x_mm, sigma_y_mm, sigma_z_mm
        Standard deviation of one component.
    mounting_mm
        How well it goes back to its place, where points are mounted on stations.
    """

    file: str | None = None
    x_m: float | None = None
    y_m: float | None = None
    z_m: float | None = None
    sigma_mm: NonNegativeFloat | None = None
    sigma_x_mm: NonNegativeFloat | None = None
    sigma_y_mm: NonNegativeFloat | None = None
    sigma_z_mm: NonNegativeFloat | None = None
    mounting_mm: NonNegativeFloat = 0.1

    @model_validator(mode="after")
    def _complete(self) -> Self:
        """A file, or numbers."""
        numbers = (self.x_m, self.y_m, self.z_m)
        single = (self.sigma_x_mm, self.sigma_y_mm, self.sigma_z_mm)
        given = [v is not None for v in (*numbers, self.sigma_mm, *single)]
        if self.file is not None:
            if any(given):
                raise ValueError("a lever arm has a file or numbers, not both")
            return self
        if any(v is None for v in numbers):
            raise ValueError("a lever arm needs x_m, y_m and z_m, or a file")
        if self.sigma_mm is None and any(v is None for v in single):
            raise ValueError("a lever arm needs sigma_mm, or sigma_x_mm, sigma_y_mm, sigma_z_mm")
        return self


# Sections about scans: their files, targets, registration, clouds and comparisons.


class ScanFile(Section):
    """A file of scans.

    Attributes
    ----------
    file
        The file.
    scan
        Name of one scan in a file with several, all of them if not given.
    station
        Where it was taken, the name of the scan if not given.
    instrument
        Name of the scanner.
    origin
        Says that the scanner is at (0, 0, 0) where the format does not, or where it stood
        among placed points, x, y, z [m] of the file.
    names
        Targets by name, each near x, y, z [m] of the scanner frame.
    face
        The face that measured the points, for a calibration: front, back, in ``dome`` the
        back where H is above 180 degrees, or as the ``order`` of rows and columns tells,
        which makes two scans of one.
    no_return
        Leave out or keep points of beams without return (zeros, repeated places, a shell).
    unit
        What the coordinates of the file are counted in, such as mm or ft, where it does not say.
    columns
        Columns of a file of text, such as ``number y x z - code``, ``-`` for one to leave out.
    decimal
        What stands before decimals in a file of text.
    temperature_c, pressure_hpa, humidity_percent
        The air at the scanner: ranges are corrected from the reference air of the instrument.
    air
        ``header`` takes what is not given of it from the header of the file (E57).
    sigma_temperature_c, sigma_pressure_hpa
        Standard deviations of the air along the beams, a scale that all points share.
    """

    file: str
    scan: str | None = None
    station: str | None = None
    instrument: str | None = None
    origin: Literal["scanner"] | tuple[float, float, float] | None = None
    names: dict[str, tuple[float, float, float]] = Field(default_factory=dict)
    face: Literal["front", "back", "dome", "order"] = "front"
    no_return: Literal["leave out", "keep"] = "leave out"
    unit: str | None = None
    columns: str | None = None
    decimal: Literal["point", "comma"] | None = None
    temperature_c: float | None = Field(default=None, ge=-60, le=80)
    pressure_hpa: float | None = Field(default=None, ge=300, le=1200)
    humidity_percent: float | None = Field(default=None, ge=0, le=100)
    air: Literal["header"] | None = None
    sigma_temperature_c: NonNegativeFloat = 1.0
    sigma_pressure_hpa: NonNegativeFloat = 1.0

    @model_validator(mode="after")
    def _both_of_air(self) -> Self:
        """Temperature and pressure come together."""
        if self.air is None and (self.temperature_c is None) != (self.pressure_hpa is None):
            raise ValueError("give temperature_c and pressure_hpa together")
        return self


class TargetSection(Section):
    """Which targets to look for in every scan; without a size none of that kind.

    Attributes
    ----------
    sphere_radius_m, checkerboard_side_m, disc_radius_m
        Sizes of the targets.
    floor_mm
        Standard deviation added to every centre, in each coordinate; default: 0.3 for checkerboards
        and discs, none for spheres.
    sphere_tolerance_mm
        Standard deviation of the radius of a sphere as made (method section 6.5).
    orientation_mm
        Standard deviation of a board's centre, in each coordinate, by its viewing angle, at 28
        points per degree.
    """

    sphere_radius_m: tuple[PositiveFloat, ...] = ()
    checkerboard_side_m: tuple[PositiveFloat, ...] = ()
    disc_radius_m: tuple[PositiveFloat, ...] = ()
    floor_mm: NonNegativeFloat | None = None
    sphere_tolerance_mm: NonNegativeFloat = 0.2
    orientation_mm: NonNegativeFloat = 0.4

    @property
    def print_floor_mm(self) -> float:
        """Floor of the centres of checkerboards and discs."""
        return 0.3 if self.floor_mm is None else self.floor_mm

    @property
    def wanted(self) -> bool:
        """True if there is anything to look for."""
        return bool(self.sphere_radius_m or self.checkerboard_side_m or self.disc_radius_m)


class RegistrationSection(Section):
    """What ties the stations to each other: any of targets, planes and clouds, all in one network.

    Attributes
    ----------
    by
        What ties them.
    plane_area_m2
        Planes of a scan smaller than this are not used.
    plane_floor_mm
        Least standard deviation of a plane, for what a fit does not see.
    cloud_floor_mm, cloud_floor_arcsec
        The same of shift and turn between two clouds.
    approximate
        Poses beside the scans or in their headers are proposals among others for clouds.
    poses
        Lists of approximate poses, or folders of files with one each, instead of these.
    pose_sigma_m, pose_sigma_deg
        What approximate poses may be wrong by, one relative to another.
    cloud_pairs
        Pairs of stations to try by clouds and planes: ``proposed`` (promising ones, and those for
        loops) or ``all``.
    """

    by: tuple[Literal["targets", "planes", "clouds"], ...] = ("targets",)
    plane_area_m2: PositiveFloat = 0.5
    plane_floor_mm: NonNegativeFloat = 0.3
    cloud_floor_mm: NonNegativeFloat = 1.0
    cloud_floor_arcsec: NonNegativeFloat = 10.0
    approximate: bool = True
    poses: tuple[str, ...] = ()
    pose_sigma_m: PositiveFloat = 0.25
    pose_sigma_deg: PositiveFloat = 1.25
    cloud_pairs: Literal["proposed", "all"] = "proposed"

    @field_validator("by")
    @classmethod
    def _each_once(cls, by: tuple[str, ...]) -> tuple[str, ...]:
        if not by or len(set(by)) != len(by):
            raise ValueError("by names one or more of targets, planes, clouds, each once")
        return by


class CloudSection(Section):
    """How clouds leave, or that none are wanted with ``write = false``.

    Attributes
    ----------
    write
        True if clouds are written.
    format
        Their format; e57 of an E57 source keeps its points byte for byte and gets new
        poses.
    frame
        ``work``, ``projected`` or ``ecef``, the site's own if not given.
    merged
        True for one file of all scans.
    correlations, incidence
        True for further fields of every point.
    epoch
        Decimal year that the coordinates hold for, that of the site if not given.
    """

    write: bool = True
    format: Literal["laz", "las", "copc", "ply", "e57"] = "laz"
    frame: Literal["work", "projected", "ecef"] | None = None
    merged: bool = False
    correlations: bool = False
    incidence: bool = False
    epoch: float | None = Field(default=None, gt=1900, lt=2200)


class ComparisonSection(Section):
    """Two scans, or the scans of two stations, against each other on test sites.

    Attributes
    ----------
    a, b
        The scans or stations; b is the reference.
    sites
        CSV file of balls or boxes in the frame of the clouds, chosen from the scans if not
        given.
    limit_mm
        Longest distance that is compared.
    method
        c2c, m3c2 or both.
    """

    a: str
    b: str
    sites: str | None = None
    limit_mm: PositiveFloat = 200.0
    method: Literal["c2c", "m3c2", "both"] = "both"

    @model_validator(mode="after")
    def _two(self) -> Self:
        if self.a == self.b:
            raise ValueError(f"{self.a} is compared with itself; name two scans or stations")
        return self
