"""The project: what a surveyor writes in TOML, and the same thing as a Python object."""

from __future__ import annotations

from pathlib import Path
from typing import Self

from pydantic import Field, PrivateAttr, ValidationError, model_validator

from tribrach._types import Progress
from tribrach.errors import InputError
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.gnss.sessions import SessionResult
from tribrach.job.assembly import SurveyReader
from tribrach.job.gnss_observations import compute_sessions
from tribrach.network.height_recipe import height_recipe
from tribrach.network.network import Network
from tribrach.network.observed_part import observed_part
from tribrach.network.survey import Survey
from tribrach.project import toml_file
from tribrach.project.calibration import CalibrationSection
from tribrach.project.gnss import GnssSection
from tribrach.project.instrument import Instrument
from tribrach.project.plan import PlanSection
from tribrach.project.sections import (
    AdjustmentSection,
    CloudSection,
    ComparisonSection,
    DatumSection,
    LeverArm,
    ObservationFile,
    OutputSection,
    PointFile,
    RegistrationSection,
    ScaleBar,
    ScanFile,
    Section,
    StationSection,
    TargetSection,
)
from tribrach.project.site import SiteSection

__all__ = ["Project"]


class Project(Section):
    """One survey job: site, datum, instruments, files, what to do and where to put it.

    truth : truth file of a simulated project, which the report then compares everything with.

    Files are relative to the project's folder. What the project names is read wherever it is;
    results are only written inside the folder, unless the caller names another.
    """

    title: str = "Untitled project"
    confidence: float = Field(default=0.95, gt=0.5, lt=1)
    facts: dict[str, str] = Field(default_factory=dict)
    truth: str | None = None
    site: SiteSection = SiteSection()
    datum: DatumSection = DatumSection()
    instruments: dict[str, Instrument] = Field(default_factory=dict)
    points: tuple[PointFile, ...] = ()
    observations: tuple[ObservationFile, ...] = ()
    scans: tuple[ScanFile, ...] = ()
    targets: TargetSection = TargetSection()
    registration: RegistrationSection = RegistrationSection()
    cloud: CloudSection = CloudSection()
    comparison: tuple[ComparisonSection, ...] = ()
    stations: dict[str, StationSection] = Field(default_factory=dict)
    lever_arms: dict[str, LeverArm] = Field(default_factory=dict)
    scale_bars: tuple[ScaleBar, ...] = ()
    calibration: CalibrationSection | None = None
    plan: PlanSection | None = None
    gnss: GnssSection = GnssSection()
    adjustment: AdjustmentSection = AdjustmentSection()
    output: OutputSection = OutputSection()
    _folder: Path = PrivateAttr(default=Path())
    _file: Path | None = PrivateAttr(default=None)
    _text: str = PrivateAttr(default="")
    _baselines: tuple[SessionResult, ...] | None = PrivateAttr(default=None)

    @model_validator(mode="after")
    def _one_epoch(self) -> Self:
        """Clouds hold for the epoch of the site: writing another would not move them."""
        wish, given = self.cloud.epoch, self.site.epoch
        if wish is not None and given is not None and wish != given:
            raise ValueError(f"the epoch of clouds is {wish}, that of the site {given}: leave one")
        return self

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a project file.

        Raises
        ------
        InputError : unreadable, not UTF-8, not TOML, a key that is unknown, missing or wrong; all
            with the line.
        """
        path = Path(path)
        data, text = toml_file.load(path)
        try:
            project = cls.model_validate(data)
        except ValidationError as error:
            raise toml_file.refused(error, cls, path, text) from error
        project._folder, project._file, project._text = path.parent, path, text
        measured = project.observations or project.scans or project.gnss.sessions
        if not measured and project.plan is None:
            raise project.error((), "nothing is measured", "add [[observations]] or [[scans]]")
        return project

    def at(self, folder: str | Path) -> Self:
        """The same project with its files in a folder."""
        moved = self.model_copy()
        moved._folder, moved._baselines = Path(folder), None
        return moved

    @property
    def folder(self) -> Path:
        """Folder that the files are relative to."""
        return self._folder

    @property
    def results(self) -> Path:
        """Folder of the results.

        Raises
        ------
        InputError : it lies outside of the project's folder.
        """
        folder = self._folder / self.output.folder
        if not folder.resolve().is_relative_to(self._folder.resolve()):
            raise self.error(
                ("output", "folder"),
                f"output.folder {self.output.folder} lies outside of the project",
                "name a folder inside of it, or give another on the command line",
            )
        return folder

    def survey(
        self,
        further: Survey | None = None,
        progress: Progress = lambda what, done, total: None,
    ) -> Survey:
        """Everything that was measured and given, by name; further : what scans add to it.

        Baselines of GNSS sessions are computed the first time.

        Raises
        ------
        InputError : what a file or a section says wrong, with its line.
        """
        return SurveyReader(self, self._folder, self.error, progress).read(further)

    def baselines(
        self, survey: Survey, progress: Progress = lambda what, done, total: None
    ) -> tuple[SessionResult, ...]:
        """Baselines of the GNSS sessions, started at points of a survey; computed once.

        Raises
        ------
        InputError : what a file says wrong, or a flat site.
        """
        if self._baselines is None:
            self._baselines = compute_sessions(self.gnss, survey, self._folder, progress)
        return self._baselines

    @property
    def computed_sessions(self) -> tuple[SessionResult, ...]:
        """GNSS sessions whose baselines have been computed."""
        return self._baselines or ()

    def frame(self) -> WorkFrame:
        """The work frame of the site.

        Raises
        ------
        InputError : as :meth:`survey`.
        """
        assembly = SurveyReader(self, self._folder, self.error)
        assembly.read()
        return assembly.context.frame

    def network(
        self,
        further: Survey | None = None,
        progress: Progress = lambda what, done, total: None,
    ) -> Network:
        """The least-squares network of the project; further : what scans add to it.

        Raises
        ------
        InputError : as :meth:`survey`, and a datum that names what the network does not have.
        """
        return self.network_of(self.survey(further, progress), whole=further is not None)

    def network_of(self, survey: Survey, *, whole: bool = False) -> Network:
        """The network of a survey of this project; whole : with what scans add to it.

        Raises
        ------
        InputError : as :meth:`network`.
        """
        network = observed_part(survey).network()
        # without its scans a project has no heights to take from them
        if self.adjustment.heights == "recipe" and (whole or not self.scans):
            network = self._by_recipe(network)
        if "datum" not in self.model_fields_set:
            return network
        try:
            return network.with_datum(network.datum)
        except InputError as error:
            raise self.error(("datum",), error.what, error.cure) from error

    def _by_recipe(self, network: Network) -> Network:
        """The network with heights of GNSS marks by the recipe.

        Raises
        ------
        InputError : no levelled station sees two of them.
        """
        wish = self.adjustment
        try:
            return height_recipe(network, wish.height_station, wish.height_mark)
        except InputError as error:
            raise self.error(("adjustment", "heights"), error.what, error.cure) from error

    def error(self, keys: tuple[str | int, ...], what: str, cure: str | None = None) -> InputError:
        """An error about what a key of the project file says."""
        line = toml_file.line_of(self._text, keys)
        record = ".".join(str(key) for key in keys) if self._file is None else None
        return InputError(what, file=self._file, line=line, record=record, cure=cure)
