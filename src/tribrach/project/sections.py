"""Sections about what was measured, what is done with it and where it goes.

Sections with a subject of their own have a file each beside this one.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    NonNegativeFloat,
    PositiveFloat,
    field_validator,
    model_validator,
)

from tribrach.errors import InputError
from tribrach.geodesy.epochs import PLATES, Motion, Realisation
from tribrach.network.network import Datum

__all__ = [
    "AdjustmentSection",
    "Backsight",
    "CloudSection",
    "ComparisonSection",
    "DatumSection",
    "EpochKeys",
    "LeverArm",
    "ObservationFile",
    "OutputSection",
    "PointFile",
    "RegistrationSection",
    "ScaleBar",
    "ScanFile",
    "Section",
    "StationSection",
    "TargetSection",
    "parse_datum",
]

# What all sections of a project file have in common; units stand in the names of the keys.


class Section(BaseModel):
    """A table of the project file: no other keys than these, and not changed once read."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)


class EpochKeys(BaseModel):
    """Keys of files whose coordinates may be of another frame or epoch than the project.

    velocity_m_per_year : of the marks in ECEF, or plate : their plate in PROJ's motion model.
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
        InputError : it names a frame or epoch and the job has none.
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


class PointFile(EpochKeys, Section):
    """A CSV file of coordinates and what they are for, unless its column ``role`` says it."""

    file: str
    role: Literal["control", "fixed", "approximate", "check"] = "control"


class ObservationFile(EpochKeys, Section):
    """A file of observations, or ``files`` that belong together; format if the suffix misleads.

    point, base : marks of a solution of RTKLIB, which has no names; sigma_factor on its formal
    standard deviations.
    """

    file: str | None = None
    files: tuple[str, ...] = ()
    format: (
        Literal["csv", "gama", "dynaml", "dna", "comp3d", "riscan", "totalstation", "gnss"] | None
    ) = None
    instrument: str | None = None
    point: str = ""
    base: str = ""
    sigma_factor: PositiveFloat | None = None

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
    """A sight of the scanner's telescope: its horizontal angle, counter-clockwise from its x axis.

    sigma of one pointing is 60" over the instrument's magnification unless given here.
    """

    to: str
    horizontal_deg: float = Field(ge=-360, le=360)
    height_target_m: float = 0.0
    pointings: int = Field(default=1, ge=1)
    sigma_arcsec: PositiveFloat | None = None


class StationSection(Section):
    """A scanner station: levelled by its compensator or not, and the antenna on it.

    occupies : the mark that it stands over, its centre height_m above it; backsights : sights of
    its telescope.
    mounted_point : name of the antenna or prism in observations that are made to it and not to the
    station.
    The sigma of the compensator is the instrument's levelling_arcsec unless given here.
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


class AdjustmentSection(Section):
    """What is done besides adjusting.

    heights : of GNSS marks, weighed by the network or by a recipe to compare with it, which keeps
    that of height_mark and takes the others from the levelled scan of height_station.
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
    """Folder of the results inside the project's, and how angles are written."""

    folder: Annotated[str, Field(min_length=1)] = "out"
    angle: Literal["gon", "deg"] = "gon"


# The section ``[datum]`` of a project, and the same in one string.


def parse_datum(words: str) -> Datum:
    """A datum from ``control``, ``free``, ``free:A,B`` or ``fixed:A,B``.

    Raises
    ------
    InputError : anything else.
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

    Either its components with their sigmas (``sigma_mm`` for all, or one for each; a component of
    sigma 0 is held), or the file of a lever arm that another project found. mounting : how well it
    goes back to its place, used where points are mounted on stations.
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

    scan : its name in a file with several, all of them if not given; station : where it was taken,
    the name of the scan if not given; origin : says that the scanner is at (0, 0, 0) where the
    format does not, or where it is among placed points, x, y, z [m] of the file; names : targets by
    name, each near x, y, z [m] of the scanner frame; face : that measured the points, for a
    calibration: front, back, in ``dome`` the back where H is above 180 degrees, or as the
    ``order`` of rows and columns tells, which makes two scans of one.
    """

    file: str
    scan: str | None = None
    station: str | None = None
    instrument: str | None = None
    origin: Literal["scanner"] | tuple[float, float, float] | None = None
    names: dict[str, tuple[float, float, float]] = Field(default_factory=dict)
    face: Literal["front", "back", "dome", "order"] = "front"


class TargetSection(Section):
    """Which targets to look for in every scan; without a size none of that kind.

    floor : standard deviation that no centre falls below, in each coordinate.
    """

    sphere_radius_m: tuple[PositiveFloat, ...] = ()
    checkerboard_side_m: tuple[PositiveFloat, ...] = ()
    disc_radius_m: tuple[PositiveFloat, ...] = ()
    floor_mm: NonNegativeFloat = 0.3

    @property
    def wanted(self) -> bool:
        """True if there is anything to look for."""
        return bool(self.sphere_radius_m or self.checkerboard_side_m or self.disc_radius_m)


class RegistrationSection(Section):
    """What ties the stations to each other: any of targets, planes and clouds, all in one network.

    plane_area : planes of a scan smaller than this are not used; plane_floor : standard deviation
    that no plane falls below, for what a fit does not see of a surface; cloud_floor : the same of
    shift and turn between two clouds.
    """

    by: tuple[Literal["targets", "planes", "clouds"], ...] = ("targets",)
    plane_area_m2: PositiveFloat = 0.5
    plane_floor_mm: NonNegativeFloat = 0.3
    cloud_floor_mm: NonNegativeFloat = 1.0
    cloud_floor_arcsec: NonNegativeFloat = 10.0

    @field_validator("by")
    @classmethod
    def _each_once(cls, by: tuple[str, ...]) -> tuple[str, ...]:
        if not by or len(set(by)) != len(by):
            raise ValueError("by names one or more of targets, planes, clouds, each once")
        return by


class CloudSection(Section):
    """How clouds leave, or that none are wanted with ``write = false``.

    frame : ``work``, ``projected`` or ``ecef``, the site's own if not given; correlations and
    incidence add fields; e57 of an E57 source keeps its points byte for byte and gets new poses.
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

    b is the reference; sites : CSV file of balls or boxes in the frame of the clouds, chosen from
    the scans if not given; limit : longest distance that is compared.
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
