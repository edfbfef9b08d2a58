"""The sections of a project file, one model each; units stand in the names of the keys."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

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
from tribrach.instruments.precision import Precision
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.instruments.sheets import Figure, find_sheet
from tribrach.network.network import Datum
from tribrach.project.epoch_keys import EpochKeys, check_reference
from tribrach.units import SEC

__all__ = [
    "AdjustmentSection",
    "Backsight",
    "CloudSection",
    "ComparisonSection",
    "DatumSection",
    "Deflection",
    "Instrument",
    "ObservationFile",
    "OutputSection",
    "PointFile",
    "RegistrationSection",
    "ScaleBar",
    "ScanFile",
    "Section",
    "SiteSection",
    "Station",
    "TargetSection",
    "parse_datum",
]

MM = 1e-3


class Section(BaseModel):
    """A table of the project file: no other keys than these, and not changed once read."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True)


class Deflection(Section):
    """Deflection of the vertical at the site: xi towards north, eta towards east.

    grid : file of geoid heights whose slope is the deflection, instead of numbers; sigma : of
    either component, an error that all stations share.
    """

    xi_arcsec: float | None = Field(default=None, ge=-120, le=120)
    eta_arcsec: float | None = Field(default=None, ge=-120, le=120)
    grid: str | None = None
    sigma_arcsec: NonNegativeFloat = 10.0

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        """Numbers or a grid."""
        if self.grid is not None and (self.xi_arcsec, self.eta_arcsec) != (None, None):
            raise ValueError("give xi_arcsec and eta_arcsec, or a grid, not both")
        return self


class SiteSection(Section):
    """Where the work frame is.

    ``flat``: coordinates are Cartesian E, N, U, with crs only for the warning of what that costs;
    ``geodetic``: E, N, U around an origin on GRS80; ``projected``: easting, northing and height of
    a crs, converted point by point. geoid_height_m, or a geoid_grid point by point, makes given
    heights ellipsoidal. deflection says
    how the plumb line of levelled scanners leans against the third axis of the frame. frame names
    the reference frame of geocentric coordinates, epoch the time that coordinates in a dynamic one
    hold for; a geodetic site with a frame and no origin is centred on its geocentric points.
    """

    kind: Literal["flat", "geodetic", "projected"] = "flat"
    curvature_radius_m: PositiveFloat | None = None
    latitude_deg: float | None = Field(default=None, ge=-90, le=90)
    longitude_deg: float | None = Field(default=None, ge=-360, le=360)
    height_m: float = 0.0
    crs: str | None = None
    geoid_height_m: float = 0.0
    geoid_grid: str | None = None
    deflection: Deflection | None = None
    frame: str | None = None
    epoch: float | None = Field(default=None, gt=1900, lt=2200)

    @model_validator(mode="before")
    @classmethod
    def _infer(cls, data: Any) -> Any:
        """The kind follows from the keys if it is not given."""
        if isinstance(data, dict) and "kind" not in data:
            if "latitude_deg" in data or "longitude_deg" in data:
                return data | {"kind": "geodetic"}
            if "crs" in data:
                return data | {"kind": "projected"}
            if "frame" in data:
                return data | {"kind": "geodetic"}
        return data

    @model_validator(mode="after")
    def _complete(self) -> Self:
        """Each kind has the keys it needs."""
        half = (self.latitude_deg is None) != (self.longitude_deg is None)
        nowhere = self.latitude_deg is None and self.frame is None
        if self.kind == "geodetic" and (half or nowhere):
            raise ValueError("a geodetic site needs latitude_deg and longitude_deg")
        if self.kind == "projected" and self.crs is None:
            raise ValueError("a projected site needs crs, such as EPSG:5897")
        if self.geoid_grid is not None and self.kind == "flat":
            raise ValueError("geoid_grid needs a place on the ellipsoid, and the site is flat")
        if self.geoid_grid is not None and self.geoid_height_m:
            raise ValueError("give either geoid_grid or geoid_height_m")
        check_reference(self.crs, self.frame, self.epoch)
        return self


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


class Instrument(Section):
    """Standard deviations of an instrument as it is set up, used where a file gives none.

    centring and height are of either end of a sight; target_floor is added to target centres;
    beam_exit and beam_divergence (full angle) give the footprint of a scanner. sheet names a model
    whose data sheet gives all figures that are not given here. calibration : a calibration file,
    whose parameters correct what the scanner measures.
    """

    sheet: str | None = None
    serial: str = ""
    calibration: str | None = None
    direction_arcsec: PositiveFloat | None = None
    zenith_arcsec: PositiveFloat | None = None
    distance_mm: PositiveFloat | None = None
    distance_ppm: NonNegativeFloat = 0.0
    centring_mm: NonNegativeFloat = 0.0
    height_mm: NonNegativeFloat = 0.0
    levelling_mm_per_sqrt_km: PositiveFloat | None = None
    range_mm: PositiveFloat | None = None
    range_ppm: NonNegativeFloat = 0.0
    scan_angle_arcsec: PositiveFloat | None = None
    beam_exit_mm: NonNegativeFloat = 0.0
    beam_divergence_mrad: NonNegativeFloat = 0.0
    target_floor_mm: NonNegativeFloat = 0.0
    levelling_arcsec: PositiveFloat | None = None
    magnification: PositiveFloat | None = None
    gnss_plan_mm: PositiveFloat | None = None
    gnss_up_mm: PositiveFloat | None = None
    gnss_common_share: float = Field(default=0.5, ge=0, lt=1)
    rod_mm: PositiveFloat | None = None
    bubble_arcmin: NonNegativeFloat | None = None
    eccentricity_mm: NonNegativeFloat = 0.0
    refraction: float = 0.13
    source: str = ""

    @field_validator("sheet")
    @classmethod
    def _known(cls, name: str | None) -> str | None:
        try:
            return None if name is None else find_sheet(name).name
        except InputError as error:
            raise ValueError(f"{error.what}; {error.cure}") from error

    @model_validator(mode="before")
    @classmethod
    def _from_sheet(cls, data: Any) -> Any:
        """What is not given comes from the sheet."""
        if not isinstance(data, dict) or not isinstance(data.get("sheet"), str):
            return data
        try:
            return find_sheet(data["sheet"]).values | data
        except InputError:
            return data

    def figures(self) -> list[Figure]:
        """Every figure that is given, with its source: the sheet's, or the project's own words."""
        sheet = None if self.sheet is None else find_sheet(self.sheet)
        known = {} if sheet is None else sheet.values
        out = []
        for key in type(self).model_fields:
            value = getattr(self, key)
            if key not in self.model_fields_set or not isinstance(value, int | float):
                continue
            same = sheet is not None and known.get(key) == value
            own = self.source or "project file"
            out.append(Figure(key, float(value), sheet.source(key) if sheet and same else own))
        return out

    def precision(self) -> Precision:
        """The same in metres and radians."""

        def scaled(value: float | None, unit: float) -> float | None:
            return None if value is None else value * unit

        return Precision(
            direction=scaled(self.direction_arcsec, SEC),
            zenith=scaled(self.zenith_arcsec, SEC),
            distance=scaled(self.distance_mm, MM),
            scale=self.distance_ppm * 1e-6,
            centring=self.centring_mm * MM,
            height=self.height_mm * MM,
            levelling=scaled(self.levelling_mm_per_sqrt_km, MM),
            range=scaled(self.range_mm, MM),
            range_scale=self.range_ppm * 1e-6,
            scan_angle=scaled(self.scan_angle_arcsec, SEC),
            target=self.target_floor_mm * MM,
            tilt=scaled(self.levelling_arcsec, SEC),
            gnss_plan=scaled(self.gnss_plan_mm, MM),
            gnss_up=scaled(self.gnss_up_mm, MM),
            gnss_common=self.gnss_common_share,
            rod=scaled(self.rod_mm, MM),
            bubble=scaled(self.bubble_arcmin, 60 * SEC),
            eccentricity=self.eccentricity_mm * MM,
            refraction=self.refraction,
        )

    def noise(self) -> ScanNoise | None:
        """Noise of single points in metres and radians; None if range or angle are not given."""
        if self.range_mm is None or self.scan_angle_arcsec is None:
            return None
        angle = self.scan_angle_arcsec * SEC
        return ScanNoise(
            self.range_mm * MM,
            self.range_ppm * 1e-6,
            angle,
            angle,
            self.beam_exit_mm * MM,
            self.beam_divergence_mrad * 1e-3,
        )


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


class Station(Section):
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


class OutputSection(Section):
    """Folder of the results inside the project's, and how angles are written."""

    folder: Annotated[str, Field(min_length=1)] = "out"
    angle: Literal["gon", "deg"] = "gon"
