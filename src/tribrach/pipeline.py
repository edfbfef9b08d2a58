"""From a project to signed figures: the page to read first.

Every verb is a module: open, find, name, adjust, clean, weigh, assess, georeference, compare,
report, write.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

from tribrach._types import Progress
from tribrach.errors import InputError, NothingFound, TribrachError
from tribrach.io.keeping import keeping, refuse_loss
from tribrach.io.logo import read_logo
from tribrach.io.outputs import Content, write_texts
from tribrach.io.survey.formats import read
from tribrach.job.antenna_lever_arms import lever_arm_files
from tribrach.job.antennas import CarriedAntennas, carried_antennas
from tribrach.job.nothing_found import search_sentences
from tribrach.job.opened import Job, open_job
from tribrach.job.results import JobResults
from tribrach.job.steps import FoundInScans, compare, find, georeference, name_and_tie, refuse_lost
from tribrach.network.adjustment import Adjustment, Options
from tribrach.network.adjustment import adjust as adjust_alone
from tribrach.network.network import Datum, Network
from tribrach.network.observed_part import observed_part
from tribrach.network.survey import Survey
from tribrach.project import Project
from tribrach.report import html, json_result, text
from tribrach.report.content import Report
from tribrach.report.found_targets import FOLDER, LIST, write_found
from tribrach.report.summary import sigma_origin
from tribrach.report.workbench_parts import workbench_texts
from tribrach.solution import AdjustmentSettings, SolvedNetwork, adjust_network, report, solve
from tribrach.tasks.engine import HERE, Engine

__all__ = [
    "AdjustmentSettings",
    "SolvedNetwork",
    "adjust",
    "adjust_job",
    "adjust_network",
    "refuse_scans",
    "report",
    "run",
    "solve",
    "write",
]


#: what every run leaves, by name
_REPORTS: dict[str, Callable[[Report], Content]] = {
    "report.html": html.render,
    "report.txt": text.render,
    "result.json": json_result.pieces,
}


#: scans without targets whose searches are told where a run stops
_BARE = 6


def write(
    content: Report, folder: Path, further: Mapping[Path, str | bytes] | None = None
) -> list[Path]:
    """Write report.html, report.txt and result.json into a folder, and further files by path."""
    texts: dict[Path, Content] = {
        folder / name: render(content) for name, render in _REPORTS.items()
    }
    return write_texts({**(further or {}), **texts})


def adjust(
    subject: Network | Survey | Job | Project | str | Path | Iterable[str | Path],
    *,
    options: Options | None = None,
) -> Adjustment:
    """Adjust a network, a survey, survey files or a project without scans.

    Parameters
    ----------
    subject : Network, Survey, Job, Project, path or iterable of paths
        What to adjust. Points of a survey or file that nothing observes are left out. Of a
        project everything that its section ``[adjustment]`` says is done.
    options : Options, optional
        When the iteration ends; for everything but projects.

    Returns
    -------
    Adjustment
        Points, stations and observations by name.

    Raises
    ------
    InputError
        What a file says wrong; a project with scans, which :func:`run` looks at.
    AdjustmentError
        The network cannot be adjusted.

    Examples
    --------
    >>> adjustment = adjust("network.gkf")  # doctest: +SKIP
    >>> adjustment.points["B"].xyz  # doctest: +SKIP
    """
    if isinstance(subject, Network):
        return adjust_alone(subject, options=options)
    if isinstance(subject, Survey):
        return adjust_alone(observed_part(subject).network(), options=options)
    if isinstance(subject, str | Path) and Path(subject).suffix.lower() == ".toml":
        subject = Project.load(subject)
    if isinstance(subject, Job | Project):
        if options is not None:
            raise InputError("a project is adjusted as it says itself", cure="leave options out")
        refuse_scans(subject.project if isinstance(subject, Job) else subject)
        job = subject if isinstance(subject, Job) else open_job(subject)
        return solve(job.network(), AdjustmentSettings.of(job.project)).adjustment
    return adjust_alone(observed_part(read(subject)).network(), options=options)


def refuse_scans(project: Project) -> None:
    """Refuse a project that only :func:`run` does justice to.

    Raises
    ------
    InputError
        It has scans.
    """
    if project.scans:
        raise project.error(
            ("scans",), "the project has scans, which adjust does not look at", "use tribrach run"
        )


def adjust_job(
    job: Job, settings: AdjustmentSettings | None = None, datum: Datum | None = None
) -> Report:
    """Adjust a job without its scans and say everything there is to say; nothing is written.

    Parameters
    ----------
    job : Job
        The opened project.
    settings : AdjustmentSettings, optional
        Those of the project if not given.
    datum : Datum, optional
        Takes the place of that of the project.

    Returns
    -------
    Report

    Raises
    ------
    InputError
        What the project or a file says wrong.
    AdjustmentError
        The network cannot be adjusted.
    """
    settings = settings or AdjustmentSettings.of(job.project)
    survey = job.surveyed()
    solution = solve(job.network_of(survey, datum=datum), settings)
    antennas = _antennas(survey, solution.adjustment, settings)
    results = JobResults(job.project, job.sessions, antennas=antennas, logo=_logo(job.project))
    return report(solution, settings, job.project.facts, results)


def run(
    project: Project | str | Path,
    folder: str | Path | None = None,
    progress: Progress = lambda what, done, total: None,
    *,
    overwrite: bool = False,
    engine: Engine = HERE,
) -> Report:
    """Run a project and leave its results in a folder.

    No file that the project reads is ever replaced, and of the others only those that an earlier
    run wrote (see :mod:`tribrach.io.keeping`).

    Parameters
    ----------
    project : Project or path
        What is measured and what is wanted of it.
    folder : path, optional
        Folder of the results, the project's own if not given.
    progress : Progress
        Told of every step that takes long.
    overwrite : bool
        Files of other programs that have the name of a result are replaced.
    engine : Engine
        Who works on the scans, this process if not given; see :mod:`tribrach.tasks.cluster`.

    Returns
    -------
    Report
        The report; ``report.adjustment`` is what was adjusted.

    Raises
    ------
    InputError
        What the project or a file says wrong; a result that would take the place of a file that
        is read or that this program did not write.
    AdjustmentError
        The network cannot be adjusted.
    """
    project = project if isinstance(project, Project) else Project.load(project)
    folder = project.results if folder is None else Path(folder)
    with keeping(project.inputs(), folder, overwrite=overwrite):
        return _run(project, folder, progress, engine)


def _run(project: Project, folder: Path, progress: Progress, engine: Engine) -> Report:
    """Run a project while what it reads is kept."""
    for name in _REPORTS:
        refuse_loss(folder / name)
    settings, logo = AdjustmentSettings.of(project), _logo(project)
    job = open_job(project, progress)
    found = find(job, folder, progress, engine) if project.scans else None
    with _leaving(found, folder):
        ties = None if found is None else name_and_tie(job, found, progress)
        further = None if ties is None else ties.registered.survey
        survey = job.surveyed(further)
        solution = solve(job.network_of(survey, whole=further is not None), settings)
        if ties is not None:
            refuse_lost(job, ties, solution.adjustment)
    adjustment = solution.adjustment
    origin = sigma_origin(adjustment, settings.posterior, solution.components)
    results = JobResults(
        job.project, job.sessions, antennas=_antennas(survey, adjustment, settings), logo=logo
    )
    if ties is not None:
        results = replace(
            results,
            registered=ties.registered,
            placed=georeference(job, ties, adjustment, folder, origin, progress),
            comparisons=compare(job, ties, adjustment, progress),
        )
    content = report(solution, settings, project.facts, results)
    arms = () if results.antennas is None else results.antennas.lever_arms
    beside = {
        **lever_arm_files(arms, folder, content.datum.sentence, origin),
        **workbench_texts(content, folder),
    }
    write(content, folder, beside)
    if found is not None and (folder / FOLDER / LIST).exists():
        # an earlier run stopped: what it left is brought up to date; files of others stay
        with suppress(InputError):
            write_found(found.findings, folder)
    return content


def _logo(project: Project) -> str:
    """The picture that the facts of a project name for the head of the report."""
    names = [name for key, name in project.facts.items() if key.strip().lower() == "logo"]
    return read_logo(project.folder / names[0]) if names and names[0] else ""


@contextmanager
def _leaving(found: FoundInScans | None, folder: Path) -> Iterator[None]:
    """A block in which stations are tied and adjusted; if it fails, what was found is written."""
    try:
        yield
    except TribrachError as error:
        if found is not None and found.findings:
            _leave_found(error, found, folder)
        raise


def _leave_found(error: TribrachError, found: FoundInScans, folder: Path) -> None:
    """Write what was found in scans before a run stopped; the error says where it is."""
    if not isinstance(error, NothingFound):
        bare = [finding for finding in found.findings if not finding.detections]
        for finding in bare[:_BARE]:
            for sentence in search_sentences(finding, found.wanted):
                error.add_note(f"  - {sentence}")
    try:
        write_found(found.findings, folder)
    except InputError as refused:
        error.add_note(f"Targets and candidates could not be written: {refused}")
        return
    error.add_note(f"Targets, candidates and panoramas of the scans are in {folder / FOLDER}.")


def _antennas(
    survey: Survey, adjustment: Adjustment, settings: AdjustmentSettings
) -> CarriedAntennas | None:
    """Lever arms of the stations that carry antennas, scaled as the settings say."""
    return carried_antennas(
        survey, adjustment, adjustment.variance_factor(posterior=settings.posterior)
    )
