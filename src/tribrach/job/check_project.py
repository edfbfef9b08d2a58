"""A project before it is run: everything that is wrong or doubtful, in one go.

Reads the project file, all files of points and observations, and the headers of scans; a small
survey without scans is adjusted once, to see whether it can be. Nothing is written.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from tribrach.errors import (
    AdjustmentError,
    InputError,
    NoStartValues,
    RankDefect,
    RefusalCollector,
    Refusals,
    all_told,
    among,
)
from tribrach.job.opened import Job, open_job
from tribrach.job.plausibility import doubts, observed_points
from tribrach.job.scan_entries import scans_of_entry
from tribrach.job.survey_files import readable_survey
from tribrach.job.whose_instrument import Instruments
from tribrach.network.facts import AssumedSigmas, ListReading, facts_of
from tribrach.network.survey import Survey
from tribrach.project import Project
from tribrach.project.gnss import GnssSection
from tribrach.project.lenient import load_leniently, without
from tribrach.project.sections import ScanFile

Place = tuple[str | int, ...]
#: stations and scans that a sentence lists
_LISTED = 10
#: sentences on what is open, and observations up to which a survey is adjusted to see
_OPEN, _QUICK = 3, 2000


@dataclass(frozen=True)
class ProjectCheck:
    """Mistakes of a project, found before it is run."""

    path: Path  #: the project file
    mistakes: tuple[InputError, ...]  #: what would stop a run, each with file and line
    doubts: tuple[str, ...]  #: what looks wrong and would not stop it, without the stop
    #: what was taken for something that a file does not say, without the stop
    readings: tuple[str, ...]
    contents: str  #: what the project holds, in words

    @property
    def good(self) -> bool:
        """True if nothing would stop a run."""
        return not self.mistakes


def check_project(path: Path) -> ProjectCheck:
    """Look for everything that is wrong in a project and its files."""
    refused = RefusalCollector()
    with all_told():
        project = load_leniently(path, refused)
        if project is None:
            return ProjectCheck(path, _parts(refused), (), (), "")
        whole = project
        missing = list(_missing(project, refused))
        if missing:
            project = without(project, missing, refused) or project
        survey, stations = Survey(), list[str]()
        said: list[str] = []
        with refused.record():
            project = project.with_instrument_files()
        with refused.record():
            instruments = Instruments(project)
            survey = readable_survey(instruments, refused)
            _check_instruments(project, instruments, refused)
        if project.scans:
            stations = list(_check_scans(project, refused, said))
        elif not (whole.observations or whole.gnss.sessions or whole.plan or whole.scans):
            cure = "add [[observations]] or [[scans]]"
            refused.add(whole.error((), "nothing is measured", cure))
        lost = [part for k, part in enumerate(whole.scans) if ("scans", k) in missing]
        named = dict.fromkeys((*stations, *(name for entry in lost for name in _unread(entry))))
        _check_names(project, survey, list(named), refused)
        if not refused.count:
            with refused.record():
                # a session of receivers takes its time
                job = open_job(project.model_copy(update={"gnss": GnssSection()}))
                job.refuse_unstated()
                survey = job.surveyed()
                _check_frame(job, survey, refused)
        said += doubts(project, survey)
        lists = facts_of(survey.facts, ListReading)
        readings = [f"{one.file}: {text}" for one in lists for text in one.sentences]
        readings += [one.sentence for one in facts_of(survey.facts, AssumedSigmas)]
        return ProjectCheck(
            path, _parts(refused), tuple(said), tuple(readings), _contents(whole, survey, stations)
        )


def _parts(refused: RefusalCollector) -> tuple[InputError, ...]:
    """Everything that was noted."""
    if not refused.count:
        return ()
    error = refused.error()
    return tuple(error.errors) if isinstance(error, Refusals) else (error,)


def _named_files(project: Project) -> Iterator[tuple[Place, Place, str]]:
    """Files that a project names: where, what goes if there is none, and the name."""
    for k, part in enumerate(project.points):
        yield ("points", k, "file"), ("points", k), part.file
        if part.covariance is not None:
            yield ("points", k, "covariance"), ("points", k, "covariance"), part.covariance
    for k, reference in enumerate(project.reference):
        yield ("reference", k, "file"), ("reference", k), reference.file
    for k, entry in enumerate(project.observations):
        key = "file" if entry.file is not None else "files"
        for name in entry.names:
            yield ("observations", k, key), ("observations", k), name
    for k, scan in enumerate(project.scans):
        yield ("scans", k, "file"), ("scans", k), scan.file
    for name, instrument in project.instruments.items():
        for key in ("file", "calibration"):
            if (file := getattr(instrument, key)) is not None:
                yield ("instruments", name, key), ("instruments", name, key), file
    for name, arm in project.lever_arms.items():
        if arm.file is not None:
            yield ("lever_arms", name, "file"), ("lever_arms", name), arm.file
    for k, comparison in enumerate(project.comparison):
        if comparison.sites is not None:
            yield ("comparison", k, "sites"), ("comparison", k, "sites"), comparison.sites
    if project.site.geoid_grid is not None:
        yield ("site", "geoid_grid"), ("site", "geoid_grid"), project.site.geoid_grid
    if project.site.geoid_sigma_grid is not None:
        keys = ("site", "geoid_sigma_grid")
        yield keys, keys, project.site.geoid_sigma_grid
    if project.truth is not None:
        yield ("truth",), ("truth",), project.truth
    further: tuple[tuple[Place, tuple[str, ...]], ...] = (
        (("registration", "poses"), project.registration.poses),
        (("gnss", "navigation"), project.gnss.navigation),
        (("gnss", "antex"), (project.gnss.antex,) if project.gnss.antex else ()),
    )
    for place, names in further:
        for name in names:
            yield place, place, name
    for k, session in enumerate(project.gnss.sessions):
        for n, receiver in enumerate(session.receivers):
            yield ("gnss", "sessions", k, "receivers", n), ("gnss", "sessions", k), receiver.file
    if project.plan is not None:
        for key in ("stations", "target_places", "station_places"):
            if (file := getattr(project.plan, key)) is not None:
                yield ("plan", key), ("plan", key), file
        for name in project.plan.observations:
            yield ("plan", "observations"), ("plan", "observations"), name


def _missing(project: Project, refused: RefusalCollector) -> Iterator[Place]:
    """Places of the project that name files which are not there; they are noted."""
    for place, goes, name in _named_files(project):
        path = project.folder / name
        if path.is_file() or (path.is_dir() and place[0] == "registration"):
            continue
        what = f"there is no file {name}" if not path.is_dir() else f"{name} is a folder"
        refused.add(project.error(place, what, _nearest(project.folder, name)))
        yield goes


def _nearest(folder: Path, name: str) -> str:
    """The files whose names are most like one that is not there."""
    wanted = Path(name)
    there = folder / wanted.parent
    if not there.is_dir():
        return f"there is no folder {wanted.parent} beside the project"
    files = sorted(path.name for path in there.iterdir() if path.is_file())
    others = [
        path.relative_to(folder).as_posix()
        for path in sorted(folder.glob("*/*"))
        if path.name.casefold() == wanted.name.casefold() and path.is_file()
    ]
    if others:
        return f"did you mean {others[0]}"
    same = [file for file in files if Path(file).stem.casefold() == wanted.stem.casefold()]
    near = same or difflib.get_close_matches(wanted.name, files, 3, cutoff=0.6)
    if near:
        return f"did you mean {' or '.join((wanted.parent / n).as_posix() for n in near[:3])}"
    alike = [file for file in files if Path(file).suffix.lower() == wanted.suffix.lower()]
    listed = ", ".join((alike or files)[:_LISTED])
    return f"the folder holds {listed}" if listed else "the folder holds no files"


def _check_instruments(
    project: Project, instruments: Instruments, refused: RefusalCollector
) -> None:
    """Note entries whose instrument is not defined."""
    for k, entry in enumerate(project.observations):
        if entry.instrument is not None:
            with refused.record():
                instruments.of_file(k)
    for k, scan in enumerate(project.scans):
        if scan.instrument is not None:
            with refused.record():
                instruments.learn([], scan.instrument, ("scans", k, "instrument"))


def _check_scans(project: Project, refused: RefusalCollector, said: list[str]) -> Iterator[str]:
    """Stations and scans by name, from the headers of the files; what is wrong is noted."""
    for k, entry in enumerate(project.scans):
        before = refused.count
        with refused.record():
            scans = scans_of_entry(project, k, entry)
            for scan in scans:
                if scan.records == 0:
                    raise InputError(
                        f"the scan {scan.name} has no points",
                        file=scan.path,
                        cure="export it again, or leave its entry out",
                    )
                yield entry.station or scan.name
                if scan.name != entry.station:
                    yield f"{entry.station or scan.name} {scan.name}"
                unknown = scan.origin == "unknown" and entry.origin is None
                wanted = project.targets
                if unknown and (wanted.checkerboard_side_m or wanted.disc_radius_m):
                    said.append(
                        f"{entry.file}: checkerboards and discs will not be looked for, because "
                        'where the scanner stood is not known; say origin = "scanner" if at zero'
                    )
        if refused.count > before:
            yield from _unread(entry)


def _unread(entry: ScanFile) -> Iterator[str]:
    """Station and scan, as an entry names them, of files that tell nothing."""
    scan = entry.scan or Path(entry.file).stem
    yield entry.station or scan
    yield f"{entry.station or scan} {scan}"


def _check_names(
    project: Project, survey: Survey, stations: Sequence[str], refused: RefusalCollector
) -> None:
    """Note sections about stations and points that are nowhere else."""
    places = [*stations, *survey.stations]
    points = [*survey.points, *(name for table in survey.tables() for name in table.names("point"))]
    known = list(dict.fromkeys((*places, *points)))
    for name in project.stations:
        if name not in known and (project.scans or survey.stations):
            what = f"station {name} is scanned and observed by nothing"
            refused.add(project.error(("stations", name), what, among(name, places, "there are")))
    for k, request in enumerate(project.comparison):
        for key in ("a", "b"):
            name = getattr(request, key)
            if project.scans and name not in stations:
                what = f"comparison of {name}, which is no scan and no station"
                cure = among(name, list(stations), "there are")
                refused.add(project.error(("comparison", k, key), what, cure))
    if project.datum.kind != "control" and (survey.points or places):
        for name in project.datum.points:
            if name not in known:
                what = f"the datum names {name}, which is no point and no station"
                cure = among(name, known, "there are")
                refused.add(project.error(("datum", "points"), what, cure))


def _check_frame(job: Job, survey: Survey, refused: RefusalCollector) -> None:
    """Note that a survey leaves its frame or unknowns open, which a run would refuse."""
    project = job.project
    rows = sum(table.n for table in survey.tables())
    if project.scans or project.gnss.sessions or project.plan is not None or rows > _QUICK:
        return
    # loaded for small surveys without scans alone
    from tribrach.network.adjustment import adjust

    try:
        adjust(job.network_of(survey))
    except (RankDefect, NoStartValues) as error:
        said = [*error.sentences[:_OPEN]]
        more = len(error.sentences) - len(said)
        said += [f"and {more} more"] if more else []
        refused.add(project.error((), f"{error.headline}: {'; '.join(said)}"))
    except AdjustmentError:
        pass


def _contents(project: Project, survey: Survey, stations: Sequence[str]) -> str:
    """Contents of a project."""
    parts = []
    if project.scans:
        alone = {s for s in stations if " " not in s}
        parts.append(f"{len(project.scans)} entries of scans at {len(alone)} stations")
    given = [name for name, p in survey.points.items() if p.role in ("control", "fixed")]
    observed = observed_points(survey)
    idle = [name for name in given if name not in observed]
    if given:
        parts.append(f"{len(given)} control points")
    if idle and (len(idle) < len(given) or not project.scans):
        more = f" and {len(idle) - _LISTED} more" if len(idle) > _LISTED else ""
        # targets of scans are not known yet
        none = "by nothing but perhaps scans" if project.scans else "by nothing"
        parts[-1] = (
            f"{len(given) - len(idle)} of {len(given)} control points observed "
            f"({', '.join(idle[:_LISTED])}{more} {none})"
        )
    rows = sum(table.n for table in survey.tables())
    if rows:
        parts.append(f"{rows} observations")
    return ", ".join(parts)
