"""A job: a project that was opened, with all of its survey files read once.

Opening reads the files of points and observations, calibrations and lever arms, and computes the
GNSS sessions. From then on the survey is put together as often as it is needed without reading
anything again: alone, or with what scans add to it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from tribrach._types import Progress
from tribrach.errors import InputError
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geodesy.proj_grids import missing_grid_sentences
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.gnss.sessions import SessionResult
from tribrach.io.opened_files import opened_once
from tribrach.job.calibrations import Calibrations
from tribrach.job.edits import obeyed
from tribrach.job.known_setups import add_known_setups
from tribrach.job.lever_arms import (
    KnownLeverArm,
    add_lever_arms,
    add_mounted_points,
    known_lever_arm,
)
from tribrach.job.plumb_line import PlumbLine, apply_plumb_line, plumb_line
from tribrach.job.shared_heights import add_shared_heights
from tribrach.job.survey_files import ReadFiles, read_survey_files
from tribrach.job.telescopes import add_telescopes
from tribrach.job.whose_instrument import Instruments, Keys
from tribrach.network.facts import Reference
from tribrach.network.height_recipe import height_recipe
from tribrach.network.network import Datum, Network
from tribrach.network.observed_part import observed_part
from tribrach.network.survey import Survey
from tribrach.observations.scanner import Inclinations
from tribrach.observations.sights import Distances
from tribrach.project import Project
from tribrach.project.edits import Edits
from tribrach.sentences import Sentence
from tribrach.units import MM, SEC


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
    if edits.target and not project.scans:
        raise edits.error("target", 0, "the project has no scans", "take the entry out")
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
            for name in dict.fromkeys(files.context.lever_arms.values())
        }
    return Job(project, instruments, calibrations, files, lever_arms, edits, contents)


@dataclass(frozen=True, eq=False, repr=False)
class Job:
    """One opened project."""

    #: the sections of the project file
    project: Project
    #: whose instrument measured at a station, in a file, in a scan
    instruments: Instruments
    #: calibrations of the instruments, known and sought
    calibrations: Calibrations
    #: what the survey files say
    files: ReadFiles
    #: what is known of the lever arms that stations use, by name
    lever_arms: Mapping[str, KnownLeverArm]
    #: what was decided by hand
    edits: Edits = Edits()
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
        self._add_levelling(survey, whole=whole)
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
        return Reference(crs, name, epoch, grid)

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
        """Refuse levelled stations of no stated compensator, before anything long begins."""
        for name, station in self.project.stations.items():
            if station.levelled:
                self._compensator(name)

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
        """Levelled stations: inclination zero with the compensator's sigma.

        whole : all stations must be there; otherwise those that are not are passed over.
        """
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
