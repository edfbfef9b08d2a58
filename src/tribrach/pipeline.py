"""From a project to signed figures: the page to read first.

Every verb is a module: open, find, name, adjust, clean, weigh, assess, georeference, compare,
report, write.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from tribrach._types import Progress
from tribrach.epochs_from_files import EPOCH, against_earlier, epoch_text
from tribrach.errors import InputError
from tribrach.io.keeping import keeping, refuse_loss
from tribrach.io.logo import read_logo
from tribrach.io.outputs import Content, write_texts
from tribrach.io.survey.formats import read
from tribrach.job.antenna_lever_arms import lever_arm_files
from tribrach.job.antennas import carried_antennas
from tribrach.job.opened import Job, open_job
from tribrach.job.plausibility import questioned, questions
from tribrach.job.results import JobResults
from tribrach.job.steps import Standing, compare, find, georeference, name_and_tie, refuse_lost
from tribrach.network.adjustment import Adjustment, Options
from tribrach.network.adjustment import adjust as adjust_alone
from tribrach.network.network import Datum, Network
from tribrach.network.observed_part import observed_part
from tribrach.network.survey import Survey
from tribrach.progress import watched
from tribrach.project import Project
from tribrach.questions.targets.left_findings import leaving, renew_findings
from tribrach.report import html, json_result, text
from tribrach.report.content import Report
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
    """Refuse a project that only :func:`run` does justice to."""
    if project.scans:
        raise project.error(
            ("scans",), "the project has scans, which adjust does not look at", "use tribrach run"
        )


def adjust_job(
    job: Job, settings: AdjustmentSettings | None = None, datum: Datum | None = None
) -> Report:
    """Adjust a job without its scans and say everything there is to say; nothing is written."""
    settings = settings or AdjustmentSettings.of(job.project)
    logo, survey = read_logo(job.project.logo), job.surveyed()
    solution = _solved(job, survey, settings, datum=datum)
    results = _results(job, survey, solution, settings, logo)
    return report(solution, settings, job.project.facts, results)


def run(
    project: Project | str | Path,
    folder: str | Path | None = None,
    progress: Progress | None = None,
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
    progress : callable, optional
        Told of every step that takes long: ``progress(what, done, total)`` with what is being done,
        how much of it is done, and how much there is, None where nobody knows. If not given, a
        notebook shows a line, and nobody is told elsewhere.
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
    how: Any = {"overwrite": overwrite, "command": "run"}
    with keeping(project.inputs(), folder, **how), watched(progress) as told:
        return _run(project, folder, told, engine)


def _run(project: Project, folder: Path, progress: Progress, engine: Engine) -> Report:
    """Run a project while what it reads is kept."""
    for name in _REPORTS:
        refuse_loss(folder / name)
    settings, logo = AdjustmentSettings.of(project), read_logo(project.logo)
    job = open_job(project, progress)
    found = find(job, folder, progress, engine) if project.scans else None
    with leaving(job, found, folder):
        ties = None if found is None else name_and_tie(job, found, progress)
        tied = None if ties is None else ties.registered.survey
        survey = job.surveyed(tied)
        solution = _solved(job, survey, settings, whole=tied is not None, final=True)
        if ties is not None:
            refuse_lost(job, ties, solution.adjustment)
    results = _results(job, survey, solution, settings, logo)
    origin = sigma_origin(solution.adjustment, settings.posterior, solution.components)
    if ties is not None:
        standing = Standing.of(job, ties, solution.adjustment)
        results = replace(
            results,
            registered=ties.registered,
            placed=georeference(job, standing, folder, origin, progress),
            comparisons=compare(standing, progress),
        )
    content = report(solution, settings, project.facts, results)
    beside: dict[Path, str | bytes] = {
        **lever_arm_files(results.lever_arms, folder, content.datum.sentence, origin),
        **workbench_texts(content, folder),
    }
    if project.output.epoch:
        beside[folder / EPOCH] = epoch_text(solution.adjustment, project.title)
    write(content, folder, beside)
    renew_findings(found, folder)
    return content


def _solved(job: Job, survey: Survey, settings: AdjustmentSettings, **how: Any) -> SolvedNetwork:
    """Adjust the network of a survey; if that fails, what looks wrong in it is said first."""
    with questioned(job.project, survey):
        solution = solve(job.network_of(survey, **how), settings)
    return solution.questioned(partial(questions, job.project, survey))


def _results(
    job: Job, survey: Survey, solution: SolvedNetwork, settings: AdjustmentSettings, logo: str
) -> JobResults:
    """What a job leaves without its scans."""
    adjustment = solution.adjustment
    factor = adjustment.variance_factor(posterior=settings.posterior)
    return JobResults(
        job.project,
        job.sessions,
        antennas=carried_antennas(survey, adjustment, factor),
        epochs=against_earlier(job.project, adjustment),
        logo=logo,
    )
