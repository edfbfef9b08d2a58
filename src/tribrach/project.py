"""The project: what a surveyor writes in TOML, and the same thing as a Python object.

Paths in a project file are relative to it. Files outside its folder are read only where the
project file names them so itself.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, PositiveFloat, ValidationError

from tribrach.errors import InputError
from tribrach.geodesy.site import EllipsoidSite, FlatSite, Site
from tribrach.io.survey import csv_observations
from tribrach.io.survey.csv_observations import Sigmas
from tribrach.io.survey.formats import format_of, read_files
from tribrach.network.network import Datum, Network
from tribrach.network.observations.distance import Distances
from tribrach.network.observations.inclination import Inclinations
from tribrach.network.survey import Survey
from tribrach.units import SEC

__all__ = ["Project"]

MM = 1e-3


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class SiteModel(_Model):
    """``flat``: coordinates are Cartesian; ``geodetic``: ENU at an origin on GRS80."""

    kind: Literal["flat", "geodetic"] = "flat"
    curvature_radius_m: PositiveFloat | None = None
    latitude_deg: float | None = Field(default=None, ge=-90, le=90)
    longitude_deg: float | None = Field(default=None, ge=-360, le=360)
    height_m: float = 0.0

    def site(self) -> Site:
        """The site of the network."""
        if self.kind == "flat":
            return FlatSite(self.curvature_radius_m)
        if self.latitude_deg is None or self.longitude_deg is None:
            raise InputError("a geodetic site needs latitude_deg and longitude_deg", record="site")
        origin = np.radians([self.latitude_deg, self.longitude_deg])
        return EllipsoidSite(float(origin[0]), float(origin[1]), self.height_m)


class DatumModel(_Model):
    """Control as given, inner constraints over points, or points held fixed."""

    kind: Literal["control", "free", "fixed"] = "control"
    points: tuple[str, ...] = ()


class InstrumentModel(_Model):
    """Standard deviations of an instrument, used where a file gives none."""

    direction_arcsec: PositiveFloat | None = None
    zenith_arcsec: PositiveFloat | None = None
    distance_mm: PositiveFloat | None = None
    distance_ppm: Annotated[float, Field(ge=0)] = 0.0
    centring_mm: Annotated[float, Field(ge=0)] = 0.0
    height_mm: Annotated[float, Field(ge=0)] = 0.0
    levelling_mm_per_sqrt_km: PositiveFloat | None = None
    target_mm: PositiveFloat | None = None
    tilt_arcsec: PositiveFloat | None = None
    refraction: float = 0.0
    source: str = ""

    def sigmas(self) -> Sigmas:
        """In metres and radians."""

        def scaled(value: float | None, unit: float) -> float | None:
            return None if value is None else value * unit

        return Sigmas(
            direction=scaled(self.direction_arcsec, SEC),
            zenith=scaled(self.zenith_arcsec, SEC),
            distance=scaled(self.distance_mm, MM),
            scale=self.distance_ppm * 1e-6,
            levelling=scaled(self.levelling_mm_per_sqrt_km, MM),
            centring=self.centring_mm * MM,
            height=self.height_mm * MM,
            target=scaled(self.target_mm, MM),
            tilt=scaled(self.tilt_arcsec, SEC),
            refraction=self.refraction,
        )


class PointsModel(_Model):
    """A file of coordinates and what they are for."""

    file: str
    role: Literal["control", "fixed", "approximate", "check"] = "control"


class ObservationsModel(_Model):
    """A file of observations; ``files`` for formats whose files belong together."""

    file: str | None = None
    files: tuple[str, ...] = ()
    instrument: str | None = None


class StationModel(_Model):
    """A scanner station that is levelled by its compensator."""

    name: str
    levelled: bool = True
    sigma_tilt_arcsec: PositiveFloat = 5.0


class ScaleBarModel(_Model):
    """A known length between two points or stations."""

    start: str = Field(alias="from")
    end: str = Field(alias="to")
    length_m: PositiveFloat
    sigma_mm: PositiveFloat


class AdjustmentModel(_Model):
    """What is done besides adjusting."""

    snoop: bool = False
    robust: Literal["none", "huber", "danish", "igg3"] = "none"
    vce: bool = False
    posterior: bool = False


class OutputModel(_Model):
    """Where the results go, and how angles are written."""

    folder: str = "out"
    angle: Literal["gon", "deg"] = "gon"


class Project(_Model):
    """One survey job: site, datum, instruments, files, what to do and where to put it."""

    title: str = "Untitled project"
    confidence: float = Field(default=0.95, gt=0.5, lt=1)
    facts: dict[str, str] = Field(default_factory=dict)
    site: SiteModel = SiteModel()
    datum: DatumModel = DatumModel()
    instruments: dict[str, InstrumentModel] = Field(default_factory=dict)
    points: tuple[PointsModel, ...] = ()
    observations: tuple[ObservationsModel, ...] = Field(min_length=1)
    stations: tuple[StationModel, ...] = ()
    scale_bars: tuple[ScaleBarModel, ...] = ()
    adjustment: AdjustmentModel = AdjustmentModel()
    output: OutputModel = OutputModel()
    folder: Path = Field(default=Path(), exclude=True)

    @classmethod
    def load(cls, path: str | Path) -> Project:
        """Read a project file.

        Raises
        ------
        InputError : unreadable, not TOML, unknown or wrong keys (named with their line).
        """
        path = Path(path)
        try:
            text = path.read_bytes().decode("utf-8-sig")
        except OSError as error:
            raise InputError(
                f"the project cannot be read ({error.strerror})", file=path, cure="check the path"
            ) from error
        except UnicodeDecodeError as error:
            raise InputError(
                "the project is not UTF-8 text", file=path, cure="save it as UTF-8"
            ) from error
        try:
            data = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise InputError(f"the project is not TOML: {error}", file=path) from error
        try:
            return cls.model_validate(data | {"folder": path.parent})
        except ValidationError as error:
            first = error.errors()[0]
            keys = [str(part) for part in first["loc"]]
            raise InputError(
                f"{'.'.join(keys)}: {first['msg'][:1].lower()}{first['msg'][1:]}",
                file=path,
                line=_line_of(text, keys),
                cure="see the documentation of the project file",
            ) from error

    def survey(self) -> Survey:
        """Everything that was measured and given, by name."""
        survey = Survey(site=self.site.site())
        for part in self.points:
            survey.merge(csv_observations.read_coordinates(self.folder / part.file, part.role))
        for entry in self.observations:
            survey.merge(self._read(entry))
        for bar in self.scale_bars:
            survey.add(
                Distances,
                values=[bar.length_m],
                sigma=bar.sigma_mm * MM,
                start=[bar.start],
                end=[bar.end],
                source=["scale_bars"],
                group="scale bar",
            )
        self._level(survey)
        survey.info["title"] = self.title
        if self.datum.kind != "control":
            survey.datum = Datum(self.datum.kind, self.datum.points)
        return survey

    def network(self) -> Network:
        """The least-squares network of the project."""
        survey = self.survey()
        datum = survey.datum
        network = survey.network()
        return network if datum.kind == "control" else network.with_datum(network.datum)

    def _read(self, entry: ObservationsModel) -> Survey:
        names = ([entry.file] if entry.file else []) + list(entry.files)
        if not names:
            raise InputError("an entry of observations names no file", record="observations")
        if entry.instrument is not None and entry.instrument not in self.instruments:
            raise InputError(
                f"instrument {entry.instrument} is not defined",
                record="observations",
                cure=f"add a section [instruments.{entry.instrument}]",
            )
        instrument = self.instruments.get(entry.instrument or "", InstrumentModel())
        paths = [self.folder / name for name in names]
        if all(format_of(path) == "csv" for path in paths):
            first, *others = [csv_observations.read(p, instrument.sigmas()) for p in paths]
            for other in others:
                first.merge(other)
            return first
        return read_files(paths)

    def _level(self, survey: Survey) -> None:
        """Compensated stations: inclination zero with the sigma given."""
        for station in self.stations:
            if station.name not in survey.stations:
                raise InputError(
                    f"station {station.name} is observed by nothing", record="stations",
                    cure="remove it or add its observations",
                )  # fmt: skip
            if station.levelled:
                survey.add(
                    Inclinations,
                    values=[[0.0, 0.0]],
                    sigma=station.sigma_tilt_arcsec * SEC,
                    station=[station.name],
                    source=["stations"],
                )


def _line_of(text: str, keys: list[str]) -> int | None:
    """Line of the last key that the text mentions, as near as TOML lets us say."""
    names = [key for key in keys if not key.isdigit()]
    for name in reversed(names):
        for number, line in enumerate(text.splitlines(), start=1):
            if line.split("=")[0].strip().strip('[]"').split(".")[-1] == name:
                return number
    return None
