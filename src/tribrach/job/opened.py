"""A job: a project that was opened, with all of its survey files read once.

Opening reads the files of points and observations, calibrations and lever arms, and computes the
GNSS sessions. From then on the survey is put together as often as it is needed without reading
anything again: alone, or with what scans add to it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from itertools import chain
from pathlib import Path, PurePath
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Progress
from tribrach.errors import InputError
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geodesy.plumb import PlumbField
from tribrach.geodesy.proj_grids import missing_grid_sentences
from tribrach.geodesy.site import EllipsoidSite
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.gnss.sessions import SessionResult
from tribrach.io.geoid_files import read_geoid
from tribrach.io.opened_files import opened_once
from tribrach.io.survey.csv.turning import telescope_unknowns
from tribrach.job.calibrations import Calibrations
from tribrach.job.edits import obeyed
from tribrach.job.headings import add_headings
from tribrach.job.known_setups import add_known_setups
from tribrach.job.lever_arms import (
    KnownLeverArm,
    add_antenna_stations,
    add_lever_arms,
    add_mounted_points,
    known_lever_arm,
)
from tribrach.job.survey_files import ReadFiles, read_survey_files
from tribrach.job.whose_instrument import Instruments, Keys
from tribrach.network.facts import HeightKind, Reference
from tribrach.network.height_recipe import height_recipe
from tribrach.network.identity import file_and_line
from tribrach.network.network import Datum, Network
from tribrach.network.shared_heights import SharedHeight, has_shared_heights, share_heights
from tribrach.network.survey import ObservationTable, Survey, as_column, observed_part
from tribrach.observations.control import ScalarPriors
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.scanner import Inclinations
from tribrach.observations.sights import Distances, Sights
from tribrach.observations.telescopes import TelescopeTargets
from tribrach.project import Project
from tribrach.project.edits import Edits
from tribrach.project.sections import HeightSection, TelescopeSection
from tribrach.sentences import Sentence
from tribrach.units import MM, SEC

_NAMES = ("deflection xi, correction", "deflection eta, correction")


@dataclass(frozen=True)
class PlumbLine:
    """How the plumb line leans against the normal of the work frame."""

    everywhere: PlumbField  #: deflections and geoid heights at any place of the site
    sigma: float  #: of either component, an error that all stations share [rad]; 0 for none
    source: str  #: where the deflection comes from


def plumb_line(project: Project, frame: WorkFrame) -> PlumbLine | None:
    """Find the deflection of the vertical and the geoid that a project names."""
    deflection = project.site.deflection
    levelled = frame if frame.geoid_grid is not None else None
    if deflection is None:
        if levelled is None:
            return None
        return PlumbLine(PlumbField(frame=levelled), 0.0, str(project.site.geoid_grid))
    sigma = deflection.sigma_arcsec * SEC
    if deflection.grid is not None:
        if not isinstance(frame.site, EllipsoidSite):
            raise project.error(
                ("site", "deflection"),
                "a geoid grid needs a place on the ellipsoid, and the site is flat",
                "give the site a latitude and longitude or a crs, or give xi_arcsec and eta_arcsec",
            )
        grid = read_geoid(project.folder / deflection.grid)
        # a grid that is not there or of another region is refused before anything is adjusted
        grid.deflection(frame.site.latitude, frame.site.longitude, frame.site.ellipsoidal_height)
        return PlumbLine(PlumbField(grid=grid, frame=frame), sigma, deflection.grid)
    xi = (deflection.xi_arcsec or 0.0) * SEC
    eta = (deflection.eta_arcsec or 0.0) * SEC
    source = "deflection of the project" if deflection.xi_arcsec is not None else "no deflection"
    return PlumbLine(PlumbField(xi, eta, frame=levelled), sigma, source)


def apply_plumb_line(survey: Survey, plumb: PlumbLine | None) -> None:
    """Tell a survey of the plumb line; two unknowns are its shared error (method section 7.5)."""
    if plumb is None:
        return
    survey.plumb = plumb.everywhere
    leaning = [table for table in survey.tables() if _leans(table, plumb.everywhere)]
    if not (plumb.sigma > 0 and leaning):
        return
    for name in _NAMES:
        survey.scalars[name] = (0.0, True)
    survey.add(
        ScalarPriors,
        values=[0.0, 0.0],
        sigma=plumb.sigma,
        scalar=list(_NAMES),
        source=[plumb.source, plumb.source],
        group="deflection of the vertical",
    )
    for table in leaning:
        for column, name in zip(("xi_error", "eta_error"), _NAMES, strict=True):
            table.columns[column] = np.full(table.n, name, dtype=object)


def _leans(table: ObservationTable, known: PlumbField) -> bool:
    """Do the values of a table depend on the deflection?"""
    if issubclass(table.kind, HeightDifferences):
        # with a geoid the differences of its heights count, not the deflection
        return known.grid is None and known.frame is None
    if issubclass(table.kind, Sights) and not table.kind.along_plumb:
        return False
    return any(item.name == "xi_error" for item in fields(table.kind))


def add_shared_heights(project: Project, survey: Survey, *, whole: bool) -> None:
    """Make the heights that a project names unknowns of a survey."""
    for k, section in enumerate(project.heights):
        shared = _shared(section, k)
        tables = survey.tables()
        rows = {
            i: _rows(section, table) for i, table in enumerate(tables) if has_shared_heights(table)
        }
        try:
            used = share_heights(survey, shared, rows)
        except InputError as error:
            raise project.error(("heights", k), error.what, error.cure) from error
        if not used and whole:
            raise project.error(
                ("heights", k),
                f"no zenith angle and no slope distance was made with the {shared.name}",
                "correct its marks and files, or remove it",
            )


def _shared(section: HeightSection, k: int) -> SharedHeight:
    """The height of a section."""
    words = f"height of instrument at {section.instrument_at}"
    if section.instrument_at is None:
        words = f"height of target over {section.target_at}"
    if section.seen_from:
        words += f" from {', '.join(section.seen_from)}"
    if section.sights_to:
        words += f" to {', '.join(section.sights_to)}"
    if section.files:
        words += f" ({', '.join(section.files)})"
    sigma = None if section.sigma_mm is None else section.sigma_mm * MM
    end: Literal["instrument", "target"] = "target"
    if section.instrument_at is not None:
        end = "instrument"
    return SharedHeight(end, words, section.height_m, sigma, f"heights {k + 1}")


def _rows(section: HeightSection, table: ObservationTable) -> NDArray[np.bool_]:
    """The sights (n,) of a table that a section means."""
    start, end = (_column(table, name) for name in ("start", "end"))
    if section.instrument_at is not None:
        rows = start == section.instrument_at
        others, among = end, section.sights_to
    else:
        rows = end == section.target_at
        others, among = start, section.seen_from
    if among:
        rows &= np.isin(others, among)
    if section.files:
        of = [_is_of(str(source), section.files) for source in table.columns["source"]]
        rows &= np.array(of, dtype=bool)
    out: NDArray[np.bool_] = rows
    return out


def _column(table: ObservationTable, name: str) -> NDArray[Any]:
    return as_column(table.columns[name], table.n).astype(str)


def _is_of(source: str, files: tuple[str, ...]) -> bool:
    """Was an observation written in one of the files, named with or without folders?"""
    name = PurePath(file_and_line(source)[0])
    return any(name == PurePath(one) or name.name == PurePath(one).name == one for one in files)


def add_telescopes(project: Project, survey: Survey, *, whole: bool) -> None:
    """Add what a project knows of the axes of its telescopes to a survey."""
    observed = survey.named(TelescopeTargets, "reference")
    for name, section in project.telescopes.items():
        if name not in observed:
            if not whole:
                continue
            raise project.error(
                ("telescopes", name),
                f"no target stands on the telescope {name}",
                "correct its name, or add a table of its targets",
            )
        unknowns = telescope_unknowns(name)
        for name_of, value, sigma in _known(section):
            if value is None:
                continue
            scalar = unknowns[name_of]
            survey.scalars[scalar] = (value, sigma != 0)
            if sigma:
                survey.add(
                    ScalarPriors,
                    values=[value],
                    sigma=[sigma],
                    scalar=[scalar],
                    source=[f"telescope {name}"],
                    group="axes of telescopes",
                )


def _known(section: TelescopeSection) -> tuple[tuple[str, float | None, float | None], ...]:
    """Field, value and sigma of each unknown of the axes, in metres and radians."""

    def scaled(value: float | None, unit: float) -> float | None:
        return None if value is None else value * unit

    tilt = scaled(section.sigma_tilt_arcsec, SEC)
    skew = section.non_orthogonality_arcsec, section.sigma_non_orthogonality_arcsec
    return (
        ("axis_offset", section.offset_m, scaled(section.sigma_offset_mm, MM)),
        ("axis_skew", scaled(skew[0], SEC), scaled(skew[1], SEC)),
        ("tilt_east", scaled(section.tilt_east_arcsec, SEC), tilt),
        ("tilt_north", scaled(section.tilt_north_arcsec, SEC), tilt),
    )


def open_job(
    project: Project | str | Path,
    progress: Progress = lambda what, done, total: None,
) -> Job:
    """Read the survey files of a project and compute its GNSS sessions.

    Parameters
    ----------
    project : Project or path
        The project or its file.
    progress : Progress
        Told of baselines that are computed.

    Returns
    -------
    Job

    Raises
    ------
    InputError
        What the project or a file says wrong, with its line.
    """
    if not isinstance(project, Project):
        project = Project.load(project)
    edits = project.read_edits()
    for table in ("target", "pick"):
        if getattr(edits, table) and not project.scans:
            raise edits.error(table, 0, "the project has no scans", "take the entry out")
    return _opened(Instruments(project.with_instrument_files()), edits, {}, None, progress)


def _opened(
    instruments: Instruments,
    edits: Edits,
    contents: dict[Path, bytes],
    sessions: tuple[SessionResult, ...] | None,
    progress: Progress,
) -> Job:
    """The job of a project whose files may have been read before."""
    project = instruments.project
    with opened_once(contents):
        calibrations = Calibrations(instruments)
        files = read_survey_files(instruments, calibrations, sessions, progress)
        lever_arms = {
            name: known_lever_arm(name, project.lever_arms[name], project.folder)
            for name in dict.fromkeys(chain.from_iterable(files.context.lever_arms.values()))
        }
    return Job(project, instruments, calibrations, files, lever_arms, edits, contents)


@dataclass(frozen=True, eq=False, repr=False)
class Job:
    """An opened project: its survey, frame and instruments, each read once."""

    project: Project  #: the sections of the project file
    instruments: Instruments  #: whose instrument measured at a station, in a file, in a scan
    calibrations: Calibrations  #: calibrations of the instruments, known and sought
    files: ReadFiles  #: what the survey files say
    #: what is known of the lever arms that stations use, by name
    lever_arms: Mapping[str, KnownLeverArm]
    edits: Edits = Edits()  #: what was decided by hand
    #: bytes of the files that were read, by path, for another reading with other sections
    contents: dict[Path, bytes] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        return f"<Job of {self.project!r}; {len(self.files.sessions)} GNSS sessions>"

    @property
    def folder(self) -> Path:
        """Folder that the files of the project are relative to."""
        return self.project.folder

    @property
    def frame(self) -> WorkFrame:
        """The work frame: of the site, or of the first file that brought one."""
        return self.files.context.frame

    @property
    def sessions(self) -> tuple[SessionResult, ...]:
        """The GNSS sessions whose baselines were computed."""
        return self.files.sessions

    @cached_property
    def survey(self) -> Survey:
        """Everything that was measured and given, without what scans add; not to be changed."""
        return self.surveyed()

    @cached_property
    def plumb(self) -> PlumbLine | None:
        """Deflection of the vertical and geoid of the site, None if the project names none."""
        return plumb_line(self.project, self.frame)

    def error(self, keys: Keys, what: str, cure: str | None = None) -> InputError:
        """Make an error about what a key of the project file says."""
        return self.project.error(keys, what, cure)

    def changed(self, **sections: Any) -> Job:
        """Open the same files with other sections of the project."""
        project = self.project.model_copy(update=sections)
        instruments = self.instruments.changed(project)
        return _opened(
            instruments, self.edits, self.contents, self.sessions, lambda what, done, total: None
        )

    def decided(self, edits: Edits) -> Job:
        """Take other decisions by hand."""
        job = replace(self, edits=edits)
        # what was put together does not depend on them
        for name in ("survey", "plumb"):
            if name in vars(self):
                vars(job)[name] = vars(self)[name]
        return job

    def surveyed(self, further: Survey | None = None) -> Survey:
        """Put the survey together from files and sections."""
        project = self.project
        survey = self.files.survey.copy()
        if further is not None:
            more = further.copy()
            self.calibrations.apply(more, more.stations)
            survey.merge(more)
        self._add_scale_bars(survey)
        add_known_setups(self.instruments, survey, self.edits)
        whole = further is not None or not project.scans
        add_shared_heights(project, survey, whole=whole)
        add_telescopes(project, survey, whole=whole)
        self.calibrations.finish(survey, whole=whole)
        if whole:
            add_antenna_stations(survey, project.stations)
        self._add_levelling(survey, whole=whole)
        add_headings(project, self.instruments, survey)
        apply_plumb_line(survey, self.plumb)
        add_lever_arms(survey, self.lever_arms)
        add_mounted_points(survey, project.stations, project.lever_arms)
        survey.title = project.title
        survey.reference = self._reference.completed(survey.reference)
        survey.warnings += [*self._site_warnings(), *self._shadowed()]
        if project.datum.kind != "control":
            survey.datum = Datum(project.datum.kind, project.datum.points)
        return survey

    def network(self, further: Survey | None = None, *, final: bool = False) -> Network:
        """Build the least-squares network of the job."""
        survey = self.surveyed(further)
        return self.network_of(survey, whole=further is not None, final=final)

    def network_of(
        self,
        survey: Survey,
        *,
        whole: bool = False,
        datum: Datum | None = None,
        final: bool = False,
    ) -> Network:
        """Build the network of a survey of this job, and do what was decided by hand."""
        network = self.measured(survey, whole=whole)
        network = network if datum is None else network.with_datum(datum)
        return obeyed(network, self.edits, whole=final or not self.project.scans)

    def measured(self, survey: Survey, *, whole: bool = False) -> Network:
        """Build the network of a survey of this job, before anything that was decided by hand."""
        project = self.project
        network = observed_part(survey).network()
        # without its scans a project has no heights to take from them
        if project.adjustment.heights == "recipe" and (whole or not project.scans):
            network = self._by_recipe(network)
        if "datum" not in project.model_fields_set:
            return network
        try:
            return network.with_datum(network.datum)
        except InputError as error:
            raise self.error(("datum",), error.what, error.cure) from error

    def _by_recipe(self, network: Network) -> Network:
        """The network with heights of GNSS marks by the recipe."""
        section = self.project.adjustment
        try:
            return height_recipe(network, section.height_station, section.height_mark)
        except InputError as error:
            raise self.error(("adjustment", "heights"), error.what, error.cure) from error

    @property
    def _reference(self) -> Reference:
        """The reference system that the site names, or that a file brought."""
        site, frame = self.project.site, self.frame
        # of the site, or of the grid that a file brought
        crs = site.crs if frame.grid is None else frame.grid.crs
        grid = None if frame.grid is None else OutputFrame(frame, "projected", crs)
        name, epoch = site.frame, site.epoch
        if self.files.realisation is not None:
            name, epoch = self.files.realisation.frame, self.files.realisation.epoch
        heights: HeightKind | None = site.heights
        if heights is None and site.kind != "flat":
            over = site.geoid_grid is not None or site.geoid_height_m
            heights = "geoid" if over else "ellipsoidal"
        return Reference(crs, name, epoch, heights, grid)

    def _site_warnings(self) -> list[str]:
        """What a projected site lacks: grids, and a datum that PROJ knows."""
        site = self.project.site
        if site.kind == "projected" and site.crs is not None:
            sentences = missing_grid_sentences(site.crs) if self.frame.leaves_datum else []
            grid, stated = self.frame.grid, self.files.realisation
            if grid is not None and grid.datum.frame is None and stated is not None:
                sentences.append(
                    Sentence(
                        "what datum {site.crs} belongs to is not known to PROJ: geocentric "
                        "coordinates and vectors in {stated.words} are taken as in it; give the "
                        "grid as an EPSG code if it is another",
                        site=site,
                        stated=stated,
                    )
                )
            return sentences
        return []

    def _shadowed(self) -> Iterator[str]:
        """Instrument files whose figures the project types again, differently."""
        for name, instrument in self.project.instruments.items():
            if instrument.shadowed:
                yield (
                    f"instrument {name}: {', '.join(instrument.shadowed)} of {instrument.file} "
                    f"without effect, as [instruments.{name}] of the project has figures of its own"
                )

    def _add_scale_bars(self, survey: Survey) -> None:
        """Known lengths, exact ones as constraints."""
        for k, bar in enumerate(self.project.scale_bars):
            survey.add(
                Distances,
                values=[bar.length_m],
                sigma=bar.sigma_mm * MM if bar.sigma_mm > 0 else None,
                hard=bar.sigma_mm == 0,
                start=[bar.start],
                end=[bar.end],
                source=[f"scale bar {k + 1}"],
                group="scale bar",
            )

    def refuse_unstated(self) -> None:
        """Refuse compensators without a sigma and drifts without a time, before anything long."""
        for name, station in self.project.stations.items():
            if station.levelled:
                self._compensator(name)
            if station.tilt_drift_arcsec is not None:
                self.calibrations.has(name)

    def _compensator(self, name: str) -> float:
        """Sigma of the compensator of a levelled station [rad]."""
        station = self.project.stations[name]
        tilt = self.instruments.precision(self.instruments.of_station(name)).tilt
        if station.levelling_arcsec is not None:
            tilt = station.levelling_arcsec * SEC
        if tilt is None:
            raise self.error(
                ("stations", name),
                f"the sigma of the compensator of {name} is not given",
                "add levelling_arcsec to the station or its instrument",
            )
        return tilt

    def _add_levelling(self, survey: Survey, *, whole: bool) -> None:
        """Levelled stations: inclination zero with the compensator's sigma; ``whole``: of all."""
        for name, station in self.project.stations.items():
            if name not in survey.stations:
                if not whole:
                    continue
                raise self.error(
                    ("stations", name),
                    f"scanner station {name} is observed by nothing",
                    "remove it or add its observations",
                )
            if not station.levelled:
                continue
            survey.add(
                Inclinations,
                values=[[0.0, 0.0]],
                sigma=self._compensator(name),
                station=[name],
                source=[f"station {name}"],
            )
