"""Sections about what was measured, what is done with it and where it goes.

Sections with a subject of their own have a file each beside this one.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from datetime import datetime
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
    """Keys of files whose coordinates may be of another frame or epoch than the project."""

    frame: str | None = None  #: Reference frame of the coordinates, that of the site if not given.
    #: Decimal year that they hold for, that of the site if not given.
    epoch: float | None = Field(default=None, gt=1900, lt=2200)
    #: Velocity of the marks in ECEF [m/year].
    velocity_m_per_year: tuple[float, float, float] | None = None
    plate: str | None = None  #: Instead of a velocity, their plate in PROJ's motion model.

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
        """Motion of the marks; None if not stated."""
        if self.velocity_m_per_year is not None:
            return Motion(velocity=np.array(self.velocity_m_per_year))
        return None if self.plate is None else Motion(plate=self.plate)

    def realisation(self, job: Realisation | None) -> Realisation | None:
        """Frame and epoch of the file; what it leaves out is that of the job."""
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
    """Keys of files that hold lists: how they are written, where the file does not tell."""

    #: Our names of columns (``point``, ``easting``, ``sigma_n_mm``) and their heads or numbers
    #: (from 1) in the file.
    columns: dict[str, str | int] = Field(default_factory=dict)
    decimal: Literal[".", ","] | None = None  #: What stands before decimals.
    #: What stands between cells: a character, or semicolon, comma, tab, bar or blank.
    separator: str | None = None
    encoding: str | None = None  #: Name of the encoding, such as ``cp1250``.
    sheet: str | None = None  #: Name of the sheet of a spreadsheet.

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
    """A list of coordinates and what they are for, unless its column ``role`` says it."""

    file: str  #: The file.
    #: What its points are for.
    role: Literal["control", "fixed", "approximate", "check"] = "control"
    #: Standard deviations, in each of easting and northing, and in height, of points without sigmas
    #: in the file.
    sigma_plan_mm: PositiveFloat | None = None
    sigma_up_mm: PositiveFloat | None = None
    sigma_source: str = ""  #: Source of these; the report names ``assumed ...``.
    #: A CSV file with the covariance matrix of its control coordinates.
    covariance: str | None = None


class ObservationFile(EpochKeys, ListKeys, Section):
    """A file of observations, or several that belong together."""

    #: The file, or the files; one of both is given.
    file: str | None = None
    files: tuple[str, ...] = ()
    #: Format where the suffix misleads.
    format: (
        Literal[
            "csv",
            "gama",
            "dynaml",
            "dna",
            "ngs",
            "comp3d",
            "starnet",
            "riscan",
            "totalstation",
            "levels",
            "gnss",
        ]
        | None
    ) = None
    #: Name of the instrument, for files without standard deviations and for calibrations.
    instrument: str | None = None
    #: Marks of a solution of RTKLIB, which has no names.
    point: str = ""
    base: str = ""
    #: Factor on the formal standard deviations of a GNSS solution.
    sigma_factor: PositiveFloat | None = None
    #: Stations of a SINEX file that are wanted, all of them if not given.
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
    """A sight of the scanner's telescope to a mark."""

    to: str  #: Name of the mark.
    #: Horizontal angle, counter-clockwise from the x axis of the scanner.
    horizontal_deg: float = Field(ge=-360, le=360)
    height_target_m: float = 0.0  #: Height of the target over the mark.
    pointings: int = Field(default=1, ge=1)  #: Number of pointings that were averaged.
    #: Of the horizontal angle; default: 60 arcsec over the magnification and the root of the
    #: pointings.
    sigma_arcsec: PositiveFloat | None = None


class StationSection(Section):
    """A scanner station: how it was set up and what it carries."""

    levelled: bool = False  #: True if its compensator kept it upright.
    #: Standard deviation of the compensator, the instrument's if not given.
    levelling_arcsec: PositiveFloat | None = None
    instrument: str | None = None  #: Name of the instrument.
    #: Names of the lever arms of the antennas or prisms on the scanner.
    lever_arm: tuple[str, ...] = ()
    #: Names of these in observations to them, in the same order.
    mounted_point: tuple[str, ...] = ()
    #: How far its tilt may drift from the beginning to the end of a scan, a standard deviation:
    #: unknowns about both axes, from targets.
    tilt_drift_arcsec: PositiveFloat | None = None
    tilt_drift_pieces: int = Field(default=1, ge=1, le=9)  #: Straight pieces of time that it has.
    #: Where the scan began and how far the head turned counter-clockwise, if no points say it.
    sweep_start_deg: float | None = Field(default=None, ge=-360, le=360)
    sweep_deg: float | None = Field(default=None, ge=-400, le=400)
    #: Azimuth of an axis of the scanner as its compass shows it, clockwise from north.
    heading_deg: float | None = Field(default=None, ge=-360, le=360)
    heading_axis: Literal["x", "y"] = "x"  #: The axis.
    #: Its standard deviation, ``compass_deg`` of the instrument if not given.
    sigma_heading_deg: PositiveFloat | None = None
    occupies: str | None = None  #: The mark that the scanner stands over.
    height_m: float = 0.0  #: Height of its centre over this mark.
    backsights: tuple[Backsight, ...] = ()  #: Sights of its telescope.

    @model_validator(mode="after")
    def _each_with_its_arm(self) -> Self:
        """Every mounted point has a lever arm; a sigma of a heading has a heading."""
        if len(self.mounted_point) not in (0, len(self.lever_arm)):
            raise ValueError(
                "no lever arm says where each of mounted_point is: give lever_arm as many names, "
                "in the same order"
            )
        if (self.sweep_start_deg is None) != (self.sweep_deg is None) or self.sweep_deg == 0:
            raise ValueError("give sweep_start_deg and a sweep_deg that is not zero together")
        if self.sigma_heading_deg is not None and self.heading_deg is None:
            raise ValueError("sigma_heading_deg is given without heading_deg")
        return self


class ScaleBar(Section):
    """A known length between two points or stations, held exactly with ``sigma_mm = 0``."""

    start: str = Field(alias="from")
    end: str = Field(alias="to")
    length_m: PositiveFloat
    sigma_mm: NonNegativeFloat


class HeightSection(Section):
    """A height of instrument or target that is an unknown of all sights made with it."""

    #: The mark it stands over; one of both is given.
    instrument_at: str | None = None
    target_at: str | None = None
    seen_from: tuple[str, ...] = ()  #: Of a target: only in sights from these marks.
    sights_to: tuple[str, ...] = ()  #: Of an instrument: only in sights to these marks.
    files: tuple[str, ...] = ()  #: Only in sights of these files; of all files if not given.
    #: Measured height or start value; default: the height in the files.
    height_m: float | None = Field(default=None, gt=-1e4, lt=1e4)
    #: Standard deviation of the measured height; without it the height is unknown.
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
    """Known values of the axes of a telescope; the others are unknowns.

    A value with a sigma is observed, with a sigma of zero held, without one it is where to start
    from.
    """

    #: Of the elevation axis from the azimuth axis, positive ahead.
    offset_m: float | None = Field(default=None, gt=-100, lt=100)
    sigma_offset_mm: NonNegativeFloat | None = None
    #: Of the axes, positive where the right end of the elevation axis is high.
    non_orthogonality_arcsec: float | None = Field(default=None, ge=-7200, le=7200)
    sigma_non_orthogonality_arcsec: NonNegativeFloat | None = None
    #: How the azimuth axis leans.
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
    """Options of the adjustment."""

    snoop: bool = False  #: Blunders are switched off, one by one.
    #: Reweighting that points at blunders.
    robust: Literal["none", "huber", "danish", "igg3"] = "none"
    vce: bool = False  #: Variance components are estimated.
    posterior: bool = False  #: Covariances are scaled by the a-posteriori variance factor.
    #: Heights of GNSS marks are weighed by the network, or follow a recipe to compare with it.
    heights: Literal["network", "recipe"] = "network"
    height_mark: str | None = None  #: The mark whose height the recipe keeps.
    height_station: str | None = None  #: The levelled scan that gives the recipe all other heights.

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.heights == "network" and (self.height_mark or self.height_station):
            raise ValueError('height_mark and height_station need heights = "recipe"')
        return self


class OutputSection(Section):
    """Folder of the results inside the project's, and how numbers are written in reports."""

    #: Folder of the results, inside the project's.
    folder: Annotated[str, Field(min_length=1)] = "out"
    angle: Literal["gon", "deg"] = "gon"  #: Unit of angles.
    #: True to write epoch.json, the coordinates with their joint covariance, for later epochs.
    epoch: bool = False
    #: Formats of offices that the result is written in besides: dxf, landxml, gpkg, geojson, kml,
    #: xlsx, csv, list.
    deliver: tuple[DeliveryFormat, ...] = ()
    #: Denominator of the scale that texts of a drawing print at, such as 500.
    drawing_scale: PositiveFloat | None = None
    list_template: Annotated[str, Field(min_length=1)] = TEMPLATE  #: Line of a list for each point.
    decimal: Literal[".", ","] = "."  #: Between a whole number and its fraction.
    #: Between groups of three digits, in numbers of five digits and more.
    thousands: Literal["", " ", "'", ".", ","] = ""

    @model_validator(mode="after")
    def _two_signs(self) -> Self:
        if self.decimal == self.thousands:
            raise ValueError("decimal and thousands are the same sign: change one of them")
        return self


# The section ``[datum]`` of a project, and the same in one string.


def parse_datum(words: str) -> Datum:
    """A datum from ``control``, ``free``, ``free:A,B`` or ``fixed:A,B``."""
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
    """

    kind: Literal["control", "free", "fixed"] = "control"  #: Control, free or fixed.
    points: tuple[str, ...] = ()  #: Names of the points that carry a free or fixed datum.

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
    """

    file: str | None = None  #: File of a lever arm.
    #: Its components.
    x_m: float | None = None
    y_m: float | None = None
    z_m: float | None = None
    #: Standard deviation of all components; one of 0 is held.
    sigma_mm: NonNegativeFloat | None = None
    #: Standard deviation of one component.
    sigma_x_mm: NonNegativeFloat | None = None
    sigma_y_mm: NonNegativeFloat | None = None
    sigma_z_mm: NonNegativeFloat | None = None
    #: How well it goes back to its place, where points are mounted on stations.
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
    """A file of scans."""

    file: str  #: The file.
    scan: str | None = None  #: Name of one scan in a file with several, all of them if not given.
    station: str | None = None  #: Where it was taken, the name of the scan if not given.
    instrument: str | None = None  #: Name of the scanner.
    #: Says that the scanner is at (0, 0, 0) where the format does not, or where it stood among
    #: placed points, x, y, z [m] of the file.
    origin: Literal["scanner"] | tuple[float, float, float] | None = None
    #: Targets by name, each near x, y, z [m] of the scanner frame.
    names: dict[str, tuple[float, float, float]] = Field(default_factory=dict)
    #: The face that measured the points, for a calibration: front, back, in ``dome`` the back where
    #: H is above 180 degrees, or as the ``order`` of rows and columns tells, which makes two scans
    #: of one.
    face: Literal["front", "back", "dome", "order"] = "front"
    #: Leave out or keep points of beams without return (zeros, repeated places, a shell).
    no_return: Literal["leave out", "keep"] = "leave out"
    #: What the coordinates of the file are counted in, such as mm or ft, where it does not say.
    unit: str | None = None
    #: Columns of a file of text, such as ``number y x z - code``, ``-`` for one to leave out.
    columns: str | None = None
    #: What stands before decimals in a file of text.
    decimal: Literal["point", "comma"] | None = None
    #: The air at the scanner: ranges are corrected from the reference air of the instrument.
    temperature_c: float | None = Field(default=None, ge=-60, le=80)
    pressure_hpa: float | None = Field(default=None, ge=300, le=1200)
    humidity_percent: float | None = Field(default=None, ge=0, le=100)
    #: What is not given of it comes from the ``header`` of the file (E57), or from a table of
    #: ``time``, ``temperature_c``, ``pressure_hpa`` and perhaps ``humidity_percent``.
    air: str | None = None
    #: When the scan began, for this table, if its header does not say so; UTC without an offset.
    time: datetime | None = None
    #: Standard deviations of the air along the beams, a scale that all points share.
    sigma_temperature_c: NonNegativeFloat = 1.0
    sigma_pressure_hpa: NonNegativeFloat = 1.0

    @model_validator(mode="after")
    def _both_of_air(self) -> Self:
        """Temperature and pressure come together."""
        if self.air is None and (self.temperature_c is None) != (self.pressure_hpa is None):
            raise ValueError("give temperature_c and pressure_hpa together")
        return self


class TargetSection(Section):
    """Which targets to look for in every scan; without a size none of that kind."""

    #: Sizes of the targets.
    sphere_radius_m: tuple[PositiveFloat, ...] = ()
    checkerboard_side_m: tuple[PositiveFloat, ...] = ()
    disc_radius_m: tuple[PositiveFloat, ...] = ()
    #: Standard deviation added to every centre, in each coordinate; default: 0.3 for checkerboards
    #: and discs, none for spheres.
    floor_mm: NonNegativeFloat | None = None
    #: Standard deviation of the radius of a sphere as made (method section 6.5).
    sphere_tolerance_mm: NonNegativeFloat = 0.2
    #: Standard deviation of a board's centre, in each coordinate, by its viewing angle, at 28
    #: points per degree.
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
    """What ties stations to each other: any of targets, planes and clouds, all in one network."""

    by: tuple[Literal["targets", "planes", "clouds"], ...] = ("targets",)  #: What ties them.
    plane_area_m2: PositiveFloat = 0.5  #: Planes of a scan smaller than this are not used.
    #: Least standard deviation of a plane, for what a fit does not see.
    plane_floor_mm: NonNegativeFloat = 0.3
    #: The same of shift and turn between two clouds.
    cloud_floor_mm: NonNegativeFloat = 1.0
    cloud_floor_arcsec: NonNegativeFloat = 10.0
    #: Poses beside the scans or in their headers are proposals among others for clouds.
    approximate: bool = True
    #: Lists of approximate poses, or folders of files with one each, instead of these.
    poses: tuple[str, ...] = ()
    #: What approximate poses may be wrong by, one relative to another.
    pose_sigma_m: PositiveFloat = 0.25
    pose_sigma_deg: PositiveFloat = 1.25
    #: Pairs of stations to try by clouds and planes: ``proposed`` (promising ones, and those for
    #: loops) or ``all``.
    cloud_pairs: Literal["proposed", "all"] = "proposed"

    @field_validator("by")
    @classmethod
    def _each_once(cls, by: tuple[str, ...]) -> tuple[str, ...]:
        if not by or len(set(by)) != len(by):
            raise ValueError("by names one or more of targets, planes, clouds, each once")
        return by


class ReferenceSection(EpochKeys, Section):
    """What scans are placed on: an earlier or airborne cloud, a model, terrain."""

    file: str  #: A cloud or a model in the coordinates of the site.
    unit: str | None = None  #: What a model without a unit is counted in: m, mm, ft ...
    #: What all of it is wrong by along each axis; without one it holds the frame.
    shared_mm: NonNegativeFloat = 0.0
    #: What each piece of 10 m is wrong by, each for itself.
    sigma_mm: NonNegativeFloat = 0.0


class CloudSection(Section):
    """How clouds leave, or that none are wanted with ``write = false``."""

    write: bool = True  #: True if clouds are written.
    #: Their format; e57 of an E57 source keeps its points byte for byte and gets new poses.
    format: Literal["laz", "las", "copc", "ply", "e57"] = "laz"
    #: ``work``, ``projected`` or ``ecef``, the site's own if not given.
    frame: Literal["work", "projected", "ecef"] | None = None
    merged: bool = False  #: True for one file of all scans.
    #: True for further fields of every point.
    correlations: bool = False
    incidence: bool = False
    #: Decimal year that the coordinates hold for, that of the site if not given.
    epoch: float | None = Field(default=None, gt=1900, lt=2200)


class ComparisonSection(Section):
    """Two scans, or the scans of two stations, against each other on test sites."""

    #: The scans or stations; b is the reference.
    a: str
    b: str
    #: CSV file of balls or boxes in the frame of the clouds, chosen from the scans if not given.
    sites: str | None = None
    limit_mm: PositiveFloat = 200.0  #: Longest distance that is compared.
    method: Literal["c2c", "m3c2", "both"] = "both"  #: c2c, m3c2 or both.

    @model_validator(mode="after")
    def _two(self) -> Self:
        if self.a == self.b:
            raise ValueError(f"{self.a} is compared with itself; name two scans or stations")
        return self
