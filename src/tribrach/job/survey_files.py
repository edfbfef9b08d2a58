"""From the files of a project to a survey: work frame, points, observations, GNSS sessions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tribrach._types import Array, Progress
from tribrach.calibration.calibrated import scanned_stations
from tribrach.errors import InputError, RefusalCollector
from tribrach.geodesy.epochs import Passage, Realisation
from tribrach.geodesy.geoid_grid import GeoidGrid
from tribrach.geodesy.proj_grids import geoid_names, vertical_name
from tribrach.geodesy.projection import ProjectedGrid
from tribrach.geodesy.site import EllipsoidSite, FlatSite, ecef_from_geodetic
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.gnss.sessions import SessionResult
from tribrach.io.csv_rows import ListForm
from tribrach.io.geoid_files import read_geoid
from tribrach.io.gnss import files as gnss_files
from tribrach.io.levels import files as levels
from tribrach.io.survey import totalstation
from tribrach.io.survey.csv import tables as csv_tables
from tribrach.io.survey.csv.file import CsvTable, read_table
from tribrach.io.survey.csv.matrix import read_matrix
from tribrach.io.survey.csv.reader import Context
from tribrach.io.survey.formats import carried_words, format_of, read_files
from tribrach.io.survey.starnet import reader as starnet
from tribrach.job.calibrations import Calibrations
from tribrach.job.geoid_sigma import apply_geoid_sigma
from tribrach.job.gnss_observations import (
    add_sessions,
    compute_sessions,
    gnss_context,
    job_realisation,
    passage,
    stated_passage,
)
from tribrach.job.lever_arms import lever_arms_of
from tribrach.job.whose_instrument import Instruments
from tribrach.network.identity import names_apart
from tribrach.network.survey import Survey
from tribrach.project.model import Project
from tribrach.project.sections import EpochKeys, ListKeys, ObservationFile, PointFile
from tribrach.units import MM, carried_angles

#: keys of files whose coordinates have a frame and an epoch
GNSS_KEYS = {*EpochKeys.model_fields, "point", "base", "sigma_factor", "stations"}


@dataclass(frozen=True)
class ReadFiles:
    """What the files of a project say, before its other sections come to it."""

    survey: Survey  #: points, observations and GNSS baselines
    context: Context  #: the work frame and the lever arms by station
    #: frame and epoch of the job, of the site or of the first file that brought them
    realisation: Realisation | None
    sessions: tuple[SessionResult, ...]  #: GNSS sessions whose baselines were computed


def read_survey_files(
    instruments: Instruments,
    calibrations: Calibrations,
    sessions: tuple[SessionResult, ...] | None,
    progress: Progress,
) -> ReadFiles:
    """Read all files of points and observations and compute the GNSS sessions of a project."""
    reader = _Reader(instruments, calibrations)
    with RefusalCollector() as refused:
        reader.all(refused)
    project, survey = instruments.project, reader.survey
    if project.gnss.sessions:
        if sessions is None:
            folder = project.folder
            sessions = compute_sessions(project.gnss, survey, folder, reader.job, progress)
        add_sessions(survey, sessions, reader.job)
    return ReadFiles(survey, reader.context, reader.job, sessions or ())


def readable_survey(instruments: Instruments, refused: RefusalCollector) -> Survey:
    """Survey of the readable files of a project; refusals are noted."""
    with refused.record():
        reader = _Reader(instruments, Calibrations(instruments))
        reader.all(refused)
        return reader.survey
    return Survey()


def starnet_plan(project: Project) -> list[Path]:
    """Files of planned observations that are STAR*NET's, which bring their own points."""
    if project.plan is None:
        return []
    paths = [project.folder / name for name in project.plan.observations]
    return [path for path in paths if format_of(path) == "starnet"]


class _Reader:
    """Reads the files of a project into one survey."""

    def __init__(self, instruments: Instruments, calibrations: Calibrations) -> None:
        self.project = project = instruments.project
        self.instruments, self.calibrations = instruments, calibrations
        self.job = job_realisation(project.site)
        self.stated = stated_passage(project.site, self.job)
        self.context = Context(
            frame=self._frame(), lever_arms=lever_arms_of(project), geocentric=self.stated
        )
        self.survey = Survey(site=self.context.frame.site)
        #: what tells files of one name apart
        self.labels = names_apart(
            project.folder / name
            for name in (
                *(part.file for part in project.points),
                *(name for entry in project.observations for name in entry.names),
                *(() if project.plan is None else project.plan.observations),
            )
        )

    def all(self, refused: RefusalCollector) -> None:
        """Read all files; what is wrong in one of them is noted, and the others are read."""
        for part in (self.points, self.observations, self.planned):
            with refused.record():
                part()

    def points(self) -> None:
        """Files of points."""
        with RefusalCollector() as refused:
            for k, part in enumerate(self.project.points):
                with refused.record():
                    self._points(k, part)
        apply_geoid_sigma(self.project, self.survey)

    def _points(self, k: int, part: PointFile) -> None:
        """One file of points."""
        carry = self._passage(part, ("points", k))
        path = self.project.folder / part.file
        matrix = None
        if part.covariance is not None:
            matrix = read_matrix(self.project.folder / part.covariance)
        label = self.labels[path]
        plan, up = part.sigma_plan_mm, part.sigma_up_mm
        context = replace(
            self.context,
            role=part.role,
            carry=carry,
            label=label,
            matrix=matrix,
            sigma_plan=None if plan is None else plan * MM,
            sigma_up=None if up is None else up * MM,
            sigma_source=part.sigma_source,
        )
        self.survey.merge(csv_tables.read(path, context, part.form))

    def planned(self) -> None:
        """Points that files of planned observations bring."""
        paths = starnet_plan(self.project)
        if paths:
            survey = starnet.read(paths, self.labels, part="points")
            self._bring(survey, paths[0].name)
            self.survey.merge(survey)

    def observations(self) -> None:
        """Files of observations; readings of calibrated scanners get their models."""
        with RefusalCollector() as refused:
            for k, entry in enumerate(self.project.observations):
                with refused.record():
                    self._entry(k, entry)

    def _entry(self, k: int, entry: ObservationFile) -> None:
        """One entry of observations."""
        with carried_angles() as carried:
            part = self._observations(k, entry)
        part.warnings += carried_words(carried, entry.names[0])
        scanned = scanned_stations(part)
        if entry.instrument is not None:
            self.instruments.learn(scanned, entry.instrument, ("observations", k, "instrument"))
        self.calibrations.apply(part, scanned)
        self.survey.merge(part)

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
            such = "".join(f", which is {name} for PROJ," for name in geoid_names(site.crs)[:1])
            raise self.project.error(
                ("site", "crs"),
                f"{site.crs} has heights of {system}, which are not ellipsoidal",
                f"give geoid_grid{such} or geoid_height_m, or the crs without its heights",
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
        return None if name is None else read_geoid(self.project.folder / name)

    def _centre(self) -> Array:
        """E, N, height (3,) in the middle of the first file of points, to 10 m."""
        if not self.project.points:
            raise self.project.error(
                ("site",), "a projected site needs points", "add a section [[points]]"
            )
        table = self._first_points()
        if table.has("e", "n", "u") or not _geocentric(table):
            centre: Array = np.nanmean(table.columns("e", "n", "u"), axis=0).round(-1)
            return centre
        assert self.project.site.crs is not None
        middle = EllipsoidSite.centred(_positions(table))
        plan = ProjectedGrid(self.project.site.crs, 0.0, 0.0).plan(
            middle.latitude, middle.longitude
        )
        return np.array([*plan, middle.ellipsoidal_height]).round(-1)

    def _first_points(self) -> CsvTable:
        """The first file of points."""
        part = self.project.points[0]
        return read_table(self.project.folder / part.file, part.form)

    def _geocentric_centre(self) -> EllipsoidSite:
        """The middle of the first file of points, which has no other coordinates than these."""
        if not self.project.points:
            raise self.project.error(
                ("site",),
                "a site without an origin needs points",
                "add latitude_deg and longitude_deg, or a section [[points]]",
            )
        table = self._first_points()
        return EllipsoidSite.centred(_positions(table))

    def _passage(self, part: EpochKeys, keys: tuple[str | int, ...]) -> Passage | None:
        """The way of coordinates of a file to the frame and epoch of the site."""
        try:
            carry = passage(part, self.job)
        except InputError as error:
            raise self.project.error(keys, error.what, error.cure) from error
        if carry is not None and not isinstance(self.context.frame.site, EllipsoidSite):
            raise self.project.error(
                keys,
                "coordinates of another frame or epoch need a place on the ellipsoid, and the site "
                "is flat",
                "give the site latitude_deg and longitude_deg, a crs, or a frame",
            )
        return carry

    def _observations(self, k: int, entry: ObservationFile) -> Survey:
        """The survey of one entry of observations."""
        paths = [self.project.folder / name for name in entry.names]
        kinds = [entry.format or format_of(path) for path in paths]
        if set(kinds) == {"csv"}:
            context = replace(self.context, carry=self._passage(entry, ("observations", k)))
            parts = []
            with RefusalCollector() as refused:
                for path in paths:
                    with refused.record():
                        parts.append(self._csv(k, path, context, entry.form))
            for other in parts[1:]:
                parts[0].merge(other)
            return parts[0]
        if stray := entry.model_fields_set & set(ListKeys.model_fields):
            raise self.project.error(
                ("observations", k, min(stray)),
                f"{min(stray)} says nothing about {entry.names[0]}",
                "it belongs to tables: CSV files and spreadsheets",
            )
        if set(kinds) == {"totalstation"}:
            precision = self.instruments.precision(self.instruments.of_file(k))
            known = [n for n, p in self.survey.points.items() if np.isfinite(p.xyz).all()]
            site, alone = self.survey.site, not self.project.points
            return totalstation.read(
                paths, precision, alone=alone, site=site, known=known, labels=self.labels
            )
        if set(kinds) == {"levels"}:
            precision = self.instruments.precision(self.instruments.of_file(k))
            survey = levels.read(paths, precision, self.labels)
            levels.leave_to(
                survey, [n for n, p in self.survey.points.items() if np.isfinite(p.xyz).any()]
            )
            return survey
        if set(kinds) == {"gnss"}:
            return self._gnss_files(k, entry, paths)
        if stray := entry.model_fields_set & GNSS_KEYS:
            raise self.project.error(
                ("observations", k, min(stray)),
                f"{min(stray)} says nothing about {entry.names[0]}",
                "it belongs to CSV files of GNSS positions, and to pos, snx, gvx and asc files",
            )
        survey = read_files(paths, entry.format, self.labels)
        self._bring(survey, entry.names[0])
        return survey

    def _csv(self, k: int, path: Path, context: Context, form: ListForm) -> Survey:
        """One table of an entry, with the sigmas of its instrument where it has none."""
        table = read_table(path, form)
        stations = table.words.get("station", [])
        precision = self.instruments.precision(self.instruments.of_file(k, stations))
        return csv_tables.survey_of(
            table, replace(context, precision=precision, label=self.labels[path])
        )

    def _bring(self, survey: Survey, name: str) -> None:
        """The work frame of a file that brings one becomes that of the job."""
        if survey.site == FlatSite():
            return
        if self.project.site.model_fields_set:
            raise self.project.error(
                ("site",),
                f"{name} brings a work frame of its own",
                "leave the section site out",
            )
        self._adopt(survey)

    def _adopt(self, survey: Survey) -> None:
        """The work frame, reference frame and epoch that a file brings become those of the job."""
        grid = survey.reference.grid
        frame = WorkFrame(survey.site) if grid is None else grid.work
        self.context = replace(self.context, frame=frame)
        self.survey.site = survey.site
        if self.job is None and survey.reference.frame is not None:
            self.job = Realisation(survey.reference.frame, survey.reference.epoch)

    def _gnss_files(self, k: int, entry: ObservationFile, paths: list[Path]) -> Survey:
        """Vectors and positions of other programs; without a site they bring one."""
        known = [n for n, p in self.survey.points.items() if np.isfinite(p.xyz).all()]
        placed = bool(self.project.site.model_fields_set) or self.survey.site != FlatSite()
        try:
            context = gnss_context(
                entry, self.survey.site, self.job, self.stated, known, placed=placed
            )
        except InputError as error:
            raise self.project.error(("observations", k), error.what, error.cure) from error
        survey = gnss_files.read(paths, context, self.labels)
        if not placed and known:
            raise self.project.error(
                ("observations", k),
                "geocentric vectors need a place on the ellipsoid, and the points are Cartesian",
                "give the project a section [site] with a frame, an origin or a crs",
            )
        if not placed:
            self._adopt(survey)
        return survey


def _geocentric(table: CsvTable) -> bool:
    """Are there coordinates that need no site to be understood?"""
    return table.has("latitude", "longitude", "u") or table.has("ecef_x", "ecef_y", "ecef_z")


def _positions(table: CsvTable) -> Array:
    """ECEF (n, 3) [m] of geographic or geocentric coordinates."""
    if table.has("latitude", "longitude", "u"):
        return ecef_from_geodetic(*table.columns("latitude", "longitude", "u").T)
    return table.columns("ecef_x", "ecef_y", "ecef_z")
