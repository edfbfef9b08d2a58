"""The project: what a surveyor writes in TOML, and the same thing as a Python object."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Self

from pydantic import Field, PrivateAttr, ValidationError, model_validator

from tribrach.errors import InputError
from tribrach.project import toml_file
from tribrach.project.calibration import CalibrationSection
from tribrach.project.edits import Edits, read_edits
from tribrach.project.epochs import EpochSection
from tribrach.project.gnss import GnssSection
from tribrach.project.instrument import Instrument
from tribrach.project.instrument_file import read_instrument_file
from tribrach.project.plan import PlanSection
from tribrach.project.sections import (
    AdjustmentSection,
    CloudSection,
    ComparisonSection,
    DatumSection,
    HeightSection,
    LeverArm,
    ObservationFile,
    OutputSection,
    PointFile,
    ReferenceSection,
    RegistrationSection,
    ScaleBar,
    ScanFile,
    Section,
    StationSection,
    TargetSection,
    TelescopeSection,
)
from tribrach.project.site import SiteSection

#: longer texts are no names of files
_LONGEST_NAME = 4096


class Project(Section):
    """A project file, data only: site, datum, instruments, files, what to do, where results go.

    Files are relative to the folder of the project. What the project names is read wherever it
    is; results are only written inside the folder, unless the caller names another.
    :func:`~tribrach.job.opened.open_job` reads the files.
    """

    title: str = "Untitled project"  #: Title and further lines of the head of the report.
    #: Probability of ellipses, intervals and ellipsoids.
    confidence: float = Field(default=0.95, gt=0.5, lt=1)
    #: Title and further lines of the head of the report.
    facts: dict[str, str] = Field(default_factory=dict)
    truth: str | None = None  #: Truth file of a simulated project, for comparison in the report.
    edits: str = "edits.toml"  #: File of decisions by hand (:mod:`tribrach.project.edits`).
    #: What is given and measured.
    site: SiteSection = SiteSection()
    datum: DatumSection = DatumSection()
    instruments: dict[str, Instrument] = Field(default_factory=dict)
    points: tuple[PointFile, ...] = ()
    observations: tuple[ObservationFile, ...] = ()
    scans: tuple[ScanFile, ...] = ()
    reference: tuple[ReferenceSection, ...] = ()
    #: What is done with scans.
    targets: TargetSection = TargetSection()
    registration: RegistrationSection = RegistrationSection()
    cloud: CloudSection = CloudSection()
    comparison: tuple[ComparisonSection, ...] = ()
    epochs: tuple[EpochSection, ...] = ()  #: Earlier epochs that the project is compared with.
    #: How scanners were set up, what they carry, known lengths, unknown heights over marks, axes of
    #: telescopes.
    stations: dict[str, StationSection] = Field(default_factory=dict)
    lever_arms: dict[str, LeverArm] = Field(default_factory=dict)
    scale_bars: tuple[ScaleBar, ...] = ()
    heights: tuple[HeightSection, ...] = ()
    telescopes: dict[str, TelescopeSection] = Field(default_factory=dict)
    #: What is estimated, planned, computed and written.
    calibration: CalibrationSection | None = None
    plan: PlanSection | None = None
    gnss: GnssSection = GnssSection()
    adjustment: AdjustmentSection = AdjustmentSection()
    output: OutputSection = OutputSection()
    _folder: Path = PrivateAttr(default=Path())
    _file: Path | None = PrivateAttr(default=None)
    _text: str = PrivateAttr(default="")

    @model_validator(mode="after")
    def _one_epoch(self) -> Self:
        """Clouds hold for the epoch of the site: writing another would not move them."""
        clouds, site = self.cloud.epoch, self.site.epoch
        if clouds is not None and site is not None and clouds != site:
            raise ValueError(f"the epoch of clouds is {clouds}, that of the site {site}: leave one")
        return self

    def __repr__(self) -> str:
        parts = {"files of points": self.points, "scans": self.scans, "stations": self.stations}
        counts = [f"{len(part)} {name}" for name, part in parts.items() if part]
        files = sum(len(entry.names) for entry in self.observations)
        if files:
            counts.append(f"{files} files of observations")
        place = self._file if self._file is not None else self._folder
        return f"<Project {self.title!r}: {', '.join(counts) or 'nothing measured'}; {place}>"

    def __str__(self) -> str:
        return repr(self)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """Read a project file.

        Raises
        ------
        InputError
            Unreadable, not UTF-8, not TOML, a key that is unknown, missing or wrong;
            all with the line.
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
        return project.with_instrument_files()

    def with_instrument_files(self) -> Self:
        """Fill in the figures of instruments that stand in files of their own, once."""
        unread = {name: i for name, i in self.instruments.items() if not i.file_is_read}
        if not unread:
            return self
        filled = {}
        for name, instrument in unread.items():
            given, source = read_instrument_file(self._folder / str(instrument.file))
            try:
                filled[name] = instrument.with_file(given, source)
            except ValidationError as error:
                what = error.errors()[0]["msg"].removeprefix("Value error, ")
                raise self.error(
                    ("instruments", name, "file"),
                    f"with {instrument.file}: {what}",
                    "leave figures out here or there",
                ) from error
        return self.model_copy(update={"instruments": self.instruments | filled})

    def at(self, folder: str | Path) -> Self:
        """The same project with its files in a folder."""
        moved = self.model_copy()
        moved._folder = Path(folder)
        return moved

    @property
    def folder(self) -> Path:
        """Folder that the files are relative to."""
        return self._folder

    @property
    def results(self) -> Path:
        """Folder of the results, inside of the project's."""
        folder = self._folder / self.output.folder
        if not folder.resolve().is_relative_to(self._folder.resolve()):
            raise self.error(
                ("output", "folder"),
                f"output.folder {self.output.folder} lies outside of the project",
                "name a folder inside of it, or give another on the command line",
            )
        return folder

    def inputs(self) -> tuple[Path, ...]:
        """Every file that the project names, and its own: what a run may read.

        Any text of the project that is the name of a file counts, whatever key it stands at, so
        that no key can be forgotten.
        """
        own = () if self._file is None else (self._file,)
        return (*own, *sorted(set(self.named_files().values())))

    def named_files(self) -> dict[str, Path]:
        """The files that the project names, by the texts that name them."""
        named = {text: self._folder / text for text in _texts(self.model_dump())}
        return {text: path for text, path in named.items() if _is_file(path)}

    @property
    def logo(self) -> Path | None:
        """The picture that the facts name for the head of the report; None if they name none."""
        names = [name for key, name in self.facts.items() if key.strip().lower() == "logo"]
        return self._folder / names[0] if names and names[0] else None

    @property
    def file_name(self) -> str:
        """Name of the project file, "" for a project without one."""
        return "" if self._file is None else self._file.name

    @property
    def edits_file(self) -> Path:
        """Where decisions made by hand are kept, whether there are any or not."""
        return self._folder / self.edits

    def read_edits(self) -> Edits:
        """Read what was decided by hand."""
        path = self.edits_file
        if path.exists():
            return read_edits(path)
        if "edits" in self.model_fields_set:
            raise self.error(("edits",), f"there is no file {self.edits}", "check its name")
        return Edits()

    def line(self, keys: tuple[str | int, ...]) -> int | None:
        """1-based line of a key in the project file, None for a project made in Python."""
        return toml_file.line_of(self._text, keys) if self._text else None

    def error(self, keys: tuple[str | int, ...], what: str, cure: str | None = None) -> InputError:
        """An error about what a key of the project file says."""
        line = self.line(keys)
        record = ".".join(str(key) for key in keys) if self._file is None else None
        return InputError(what, file=self._file, line=line, record=record, cure=cure)


def _texts(value: object) -> Iterator[str]:
    """All texts among the values of nested tables."""
    if isinstance(value, str):
        if 0 < len(value) <= _LONGEST_NAME:
            yield value
    elif isinstance(value, Mapping):
        for item in value.values():
            yield from _texts(item)
    elif isinstance(value, list | tuple | set | frozenset):
        for item in value:
            yield from _texts(item)


def _is_file(path: Path) -> bool:
    """Is there a file of this name? A text that cannot be a name is none."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False
