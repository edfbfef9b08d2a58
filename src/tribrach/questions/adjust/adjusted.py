"""A network, a survey, survey files, or a project without its scans, adjusted."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from pathlib import Path

from tribrach.errors import InputError
from tribrach.io.logo import read_logo
from tribrach.io.survey.formats import read
from tribrach.job.antennas import carried_antennas
from tribrach.job.opened import Job, open_job
from tribrach.job.plausibility import questioned, questions
from tribrach.job.results import JobResults
from tribrach.job.steps import ScanWork, refuse_lost
from tribrach.network.adjustment import Adjustment, Options
from tribrach.network.adjustment import adjust as adjust_alone
from tribrach.network.network import Datum, Network
from tribrach.network.observed_part import observed_part
from tribrach.network.survey import Survey
from tribrach.project import Project
from tribrach.questions.epochs.from_files import against_earlier
from tribrach.report.content import Report
from tribrach.solution import AdjustmentSettings, SolvedNetwork, report, solve

__all__ = ["adjust", "adjust_job", "left_by", "refuse_scans", "solved"]


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
    logo = read_logo(job.project.logo)
    survey, solution = solved(job, settings, datum=datum)
    results = left_by(job, survey, solution, settings, logo)
    return report(solution, settings, job.project.facts, results)


def solved(
    job: Job,
    settings: AdjustmentSettings,
    work: ScanWork | None = None,
    *,
    datum: Datum | None = None,
) -> tuple[Survey, SolvedNetwork]:
    """Adjust a job with what ties its scans; if that fails, what looks wrong is said first."""
    ties = None if work is None else work.registered.survey
    survey, whole = job.surveyed(ties), ties is not None
    with questioned(job.project, survey):
        network = job.network_of(survey, whole=whole, datum=datum, final=work is not None)
        solution = solve(network, settings)
    solution = solution.questioned(partial(questions, job.project, survey))
    if work is not None:
        refuse_lost(job, work, solution.adjustment)
    return survey, solution


def left_by(
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
