"""From the sections of a project to a survey: frame, points, observations, stations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Array, Progress
from tribrach.errors import InputError
from tribrach.geodesy.epochs import Realisation
from tribrach.geodesy.geoid_grid import GeoidGrid
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geodesy.proj_grids import missing_grid_sentences, vertical_name
from tribrach.geodesy.projection import ProjectedGrid, flat_warnings
from tribrach.geodesy.site import EllipsoidSite, FlatSite, ecef_from_geodetic
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.instruments.precision import Precision
from tribrach.io.gnss import files as gnss_files
from tribrach.io.survey import totalstation
from tribrach.io.survey.csv import tables as csv_tables
from tribrach.io.survey.csv.file import CsvTable, read_table
from tribrach.io.survey.csv.reader import Context
from tribrach.io.survey.formats import format_of, read_files
from tribrach.job.calibrations import Calibrations
from tribrach.job.gnss_observations import add_sessions, gnss_context, job_realisation, mover
from tribrach.job.known_setups import add_known_setups
from tribrach.job.lever_arms import add_lever_arms, add_mounted_points, lever_arms_of
from tribrach.job.plumb_line import plumb_columns
from tribrach.network.facts import Reference
from tribrach.network.identity import names_apart
from tribrach.network.network import Datum
from tribrach.network.survey import Survey
from tribrach.observations.scanner import Inclinations
from tribrach.observations.sights import Distances
from tribrach.project.sections import EpochKeys, ObservationFile
from tribrach.units import MM

if TYPE_CHECKING:
    from tribrach.project.model import Project

__all__ = ["SurveyReader"]


#: keys of files whose coordinates have a frame and an epoch
GNSS_KEYS = {*EpochKeys.model_fields, "point", "base", "sigma_factor"}


class SurveyReader:
    """Reads the files of a project into one survey.

    locate : line of a key in the project file, for complaints about what it says; progress : of
    baselines that are computed.
    """

    def __init__(
        self,
        project: Project,
        folder: Path,
        locate: Callable[..., InputError],
        progress: Progress = lambda what, done, total: None,
    ) -> None:
        self.project, self.folder, self.error = project, folder, locate
        self.progress, self.job = progress, job_realisation(project.site)
        self.context = Context(frame=self._frame(), lever_arms=self._arms())
        self.survey = Survey(site=self.context.frame.site)
        self.calibrations = Calibrations(project, folder, locate)
        #: what tells files of one name apart
        self.labels = names_apart(
            folder / name
            for name in (
                *(part.file for part in project.points),
                *(name for entry in project.observations for name in entry.names),
            )
        )

    def read(self, further: Survey | None = None) -> Survey:
        """The survey of all sections, and of scans where there are any."""
        self._points()
        for k, entry in enumerate(self.project.observations):
            part = self._observations(k, entry)
            self.calibrations.apply(part, lambda _, name=entry.instrument: name)  # type: ignore[misc]
            self._merge(part)
        if self.project.gnss.sessions:
            add_sessions(self.survey, self.project.baselines(self.survey, self.progress))
        if further is not None:
            self.calibrations.apply(further, self._scanner_of)
            self._merge(further)
        self._scale_bars()
        add_known_setups(self.project, self.survey, self.error)
        # without what scans add, stations that only they observe are not there yet
        whole = further is not None or not self.project.scans
        self.calibrations.finish(self.survey, whole=whole)
        self._stations(whole=whole)
        self._lever_arms()
        project, site = self.project, self.project.site
        self.survey.title = project.title
        self.survey.reference = self._reference().completed(self.survey.reference)
        if site.crs is not None and site.kind == "projected":
            self.survey.warnings += missing_grid_sentences(site.crs)
        if site.kind == "flat":
            given = [point.xyz for point in self.survey.points.values()]
            curved = site.curvature_radius_m is not None
            xyz = np.array(given).reshape(-1, 3)
            self.survey.warnings += flat_warnings(xyz, site.crs, curved=curved)
        if project.datum.kind != "control":
            self.survey.datum = Datum(project.datum.kind, project.datum.points)
        return self.survey

    def _reference(self) -> Reference:
        """The reference system that the site names, or that a file brought."""
        site, frame = self.project.site, self.context.frame
        grid = None if frame.grid is None else OutputFrame(frame, "projected", site.crs)
        name, epoch = site.frame, site.epoch
        if self.job is not None:
            name, epoch = self.job.frame, self.job.epoch
        return Reference(site.crs, name, epoch, grid)

    def _frame(self) -> WorkFrame:
        """The work frame of the site; a projected one is centred on the first points."""
        site = self.project.site
        if site.kind == "flat":
            return WorkFrame(FlatSite(site.curvature_radius_m))
        if site.kind == "geodetic" and site.latitude_deg is None:
            return WorkFrame(self._geocentric_centre(), geoid=site.geoid_height_m)
        if site.kind == "geodetic":
            assert site.latitude_deg is not None
            assert site.longitude_deg is not None
            latitude, longitude = np.radians([site.latitude_deg, site.longitude_deg])
            origin = EllipsoidSite(float(latitude), float(longitude), site.height_m)
            return WorkFrame(origin, None, site.geoid_height_m, self._geoid())
        assert site.crs is not None
        system = vertical_name(site.crs)
        if system is not None and site.geoid_grid is None and not site.geoid_height_m:
            raise self.error(
                ("site", "crs"),
                f"{site.crs} has heights of {system}, which are not ellipsoidal",
                "give geoid_grid or geoid_height_m, or the crs without its heights",
            )
        easting, northing, height = self._centre()
        place = EllipsoidSite(*ProjectedGrid(site.crs, easting, northing).place, 0.0)
        whole = WorkFrame(place, None, site.geoid_height_m, self._geoid())
        above = whole.undulation(np.array([place.latitude]), np.array([place.longitude]))
        grid = ProjectedGrid(site.crs, easting, northing, float(height + above[0]))
        return WorkFrame(grid.site, grid, site.geoid_height_m, whole.geoid_grid)

    def _geoid(self) -> GeoidGrid | None:
        """The geoid grid that the site names."""
        name = self.project.site.geoid_grid
        return None if name is None else GeoidGrid(self.folder / name)

    def _centre(self) -> Array:
        """E, N, height (3,) in the middle of the first file of points, to 10 m."""
        if not self.project.points:
            raise self.error(("site",), "a projected site needs points", "add a section [[points]]")
        table = read_table(self.folder / self.project.points[0].file)
        if table.has("e", "n", "u") or not _geocentric(table):
            centre: Array = np.nanmean(table.columns("e", "n", "u"), axis=0).round(-1)
            return centre
        assert self.project.site.crs is not None
        middle = EllipsoidSite.centred(_positions(table))
        plan = ProjectedGrid(self.project.site.crs, 0.0, 0.0).plan(
            middle.latitude, middle.longitude
        )
        return np.array([*plan, middle.ellipsoidal_height]).round(-1)

    def _geocentric_centre(self) -> EllipsoidSite:
        """The middle of the first file of points, which has no other coordinates than these."""
        if not self.project.points:
            raise self.error(
                ("site",),
                "a site without an origin needs points",
                "add latitude_deg and longitude_deg, or a section [[points]]",
            )
        table = read_table(self.folder / self.project.points[0].file)
        return EllipsoidSite.centred(_positions(table))

    def _points(self) -> None:
        for k, part in enumerate(self.project.points):
            carry = self._mover(part, ("points", k))
            path = self.folder / part.file
            context = replace(self.context, role=part.role, carry=carry, label=self.labels[path])
            self._merge(csv_tables.read(path, context))

    def _mover(
        self, part: EpochKeys, keys: tuple[str | int, ...]
    ) -> Callable[[Array], Array] | None:
        """What takes coordinates of a file to the frame and epoch of the site."""
        try:
            found = mover(part, self.job)
        except InputError as error:
            raise self.error(keys, error.what, error.cure) from error
        if found is not None and not isinstance(self.context.frame.site, EllipsoidSite):
            raise self.error(
                keys,
                "coordinates of another frame or epoch need a place on the ellipsoid, and the site "
                "is flat",
                "give the site latitude_deg and longitude_deg, a crs, or a frame",
            )
        return found

    def _observations(self, k: int, entry: ObservationFile) -> Survey:
        """One entry of observations."""
        paths = [self.folder / name for name in entry.names]
        kinds = [entry.format or format_of(path) for path in paths]
        if set(kinds) == {"csv"}:
            precision = self._precision(entry.instrument, ("observations", k, "instrument"))
            carry = self._mover(entry, ("observations", k))
            context = replace(self.context, precision=precision, carry=carry)
            first, *others = [
                csv_tables.read(path, replace(context, label=self.labels[path])) for path in paths
            ]
            for other in others:
                first.merge(other)
            return first
        if set(kinds) == {"totalstation"}:
            precision = self._precision(entry.instrument, ("observations", k, "instrument"))
            known = [n for n, p in self.survey.points.items() if np.isfinite(p.xyz).all()]
            site, alone = self.survey.site, not self.project.points
            return totalstation.read(
                paths, precision, alone=alone, site=site, known=known, labels=self.labels
            )
        if set(kinds) == {"gnss"}:
            return self._gnss_files(k, entry, paths)
        if stray := entry.model_fields_set & GNSS_KEYS:
            raise self.error(
                ("observations", k, min(stray)),
                f"{min(stray)} says nothing about {entry.names[0]}",
                "it belongs to CSV files of GNSS positions, and to pos, snx and gvx files",
            )
        survey = read_files(paths, entry.format, self.labels)
        if survey.site != FlatSite() and self.project.site.model_fields_set:
            raise self.error(
                ("site",),
                f"{entry.names[0]} brings a work frame of its own",
                "leave the section site out",
            )
        if survey.site != FlatSite():
            self._adopt(survey)
        return survey

    def _adopt(self, survey: Survey) -> None:
        """The work frame, reference frame and epoch that a file brings become those of the job."""
        self.context = replace(self.context, frame=WorkFrame(survey.site))
        self.survey.site = survey.site
        if self.job is None and survey.reference.frame is not None:
            self.job = Realisation(survey.reference.frame, survey.reference.epoch)

    def _gnss_files(self, k: int, entry: ObservationFile, paths: list[Path]) -> Survey:
        """Vectors and positions of other programs; without a site they bring one."""
        known = [n for n, p in self.survey.points.items() if np.isfinite(p.xyz).all()]
        placed = bool(self.project.site.model_fields_set) or self.survey.site != FlatSite()
        try:
            context = gnss_context(entry, self.survey.site, self.job, known, placed=placed)
        except InputError as error:
            raise self.error(("observations", k), error.what, error.cure) from error
        survey = gnss_files.read(paths, context, self.labels)
        if not placed and known:
            raise self.error(
                ("observations", k),
                "geocentric vectors need a place on the ellipsoid, and the points are Cartesian",
                "give the project a section [site] with a frame, an origin or a crs",
            )
        if not placed:
            self._adopt(survey)
        return survey

    def _precision(self, name: str | None, keys: tuple[str | int, ...]) -> Precision:
        """The named instrument; without a name the only one there is, or none."""
        instruments = self.project.instruments
        if name is None:
            only = list(instruments.values())
            return only[0].precision() if len(only) == 1 else Precision()
        if name not in instruments:
            raise self.error(
                keys, f"instrument {name} is not defined", f"add a section [instruments.{name}]"
            )
        return instruments[name].precision()

    def _merge(self, other: Survey) -> None:
        """Add a survey; its warnings and datum come along."""
        self.survey.merge(other)

    def _scanner_of(self, station: str) -> str | None:
        """Instrument named for the scans of a station."""
        named = (s.instrument for s in self.project.scans if s.station in (station, None))
        return next((name for name in named if name is not None), None)

    def _scale_bars(self) -> None:
        for k, bar in enumerate(self.project.scale_bars):
            self.survey.add(
                Distances,
                values=[bar.length_m],
                sigma=bar.sigma_mm * MM if bar.sigma_mm > 0 else None,
                hard=bar.sigma_mm == 0,
                start=[bar.start],
                end=[bar.end],
                source=[f"scale bar {k + 1}"],
                group="scale bar",
            )

    def _stations(self, *, whole: bool) -> None:
        """Levelled stations: inclination zero with the compensator's sigma.

        whole : all stations must be there; otherwise those that are not are passed over.
        """
        plumb = plumb_columns(self.survey, self.project.site.deflection, self.folder, self.error)
        for name, station in self.project.stations.items():
            if name not in self.survey.stations:
                if not whole:
                    continue
                raise self.error(
                    ("stations", name),
                    f"scanner station {name} is observed by nothing",
                    "remove it or add its observations",
                )
            if not station.levelled:
                continue
            keys = ("stations", name, "instrument")
            tilt = self._precision(station.instrument, keys).tilt
            if station.levelling_arcsec is not None:
                tilt = np.radians(station.levelling_arcsec / 3600)
            if tilt is None:
                raise self.error(
                    ("stations", name),
                    f"the sigma of the compensator of {name} is not given",
                    "add levelling_arcsec to the station or its instrument",
                )
            self.survey.add(
                Inclinations,
                values=[[0.0, 0.0]],
                sigma=tilt,
                station=[name],
                source=[f"station {name}"],
                **plumb,
            )

    def _arms(self) -> dict[str, str]:
        """Name of the lever arm by station."""
        return lever_arms_of(self.project.stations, self.project.lever_arms, self.error)

    def _lever_arms(self) -> None:
        """Lever arms that are used, and the points at their ends."""
        project = self.project
        add_lever_arms(self.survey, self.context.lever_arms, project.lever_arms, self.folder)
        add_mounted_points(self.survey, project.stations, project.lever_arms)


def _geocentric(table: CsvTable) -> bool:
    """Are there coordinates that need no site to be understood?"""
    return table.has("latitude", "longitude", "u") or table.has("ecef_x", "ecef_y", "ecef_z")


def _positions(table: CsvTable) -> Array:
    """ECEF (n, 3) [m] of geographic or geocentric coordinates.

    Raises
    ------
    InputError : neither of them, or an empty cell.
    """
    if table.has("latitude", "longitude", "u"):
        return ecef_from_geodetic(*table.columns("latitude", "longitude", "u").T)
    return table.columns("ecef_x", "ecef_y", "ecef_z")
