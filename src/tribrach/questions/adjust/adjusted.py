"""A network, a survey, survey files, or a project without its scans, adjusted."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

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
from tribrach.network.survey import Survey, observed_part
from tribrach.project import Project, parse_datum
from tribrach.questions.epochs.from_files import against_earlier
from tribrach.report.content import Report
from tribrach.solution import AdjustmentSettings, SolvedNetwork, Solving, report, solve


def adjust(
    subject: Network | Survey | Job | Project | str | Path | Iterable[str | Path],
    *,
    options: Options | None = None,
    datum: Datum | str | None = None,
    snoop: bool | None = None,
    robust: Literal["none", "huber", "danish", "igg3"] | None = None,
    vce: bool | None = None,
    posterior: bool | None = None,
    confidence: float | None = None,
) -> Adjustment:
    """Adjust a network, a survey, survey files or a project without scans.

    What a project says is done; an option that is given takes its place.

    Parameters
    ----------
    subject : Network, Survey, Job, Project, path or iterable of paths
        What to adjust. Points of a survey or file that nothing observes are left out. Of a
        project everything that its section ``[adjustment]`` says is done.
    options : Options, optional
        When the iteration ends; for everything but projects, and without other options.
    datum : Datum or str, optional
        ``control``, ``free``, ``free:A,B,C`` (inner constraints) or ``fixed:A,B``.
    snoop : bool, optional
        Blunders are switched off, one by one.
    robust : {"none", "huber", "danish", "igg3"}, optional
        What departs is weighed down, which points at blunders.
    vce : bool, optional
        Groups are weighed anew by variance components.
    posterior : bool, optional
        Covariances are scaled by ``sigma0_posterior``.
    confidence : float, optional
        Probability of ellipses and tests, 0.95 if not given.

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
    given: dict[str, Any] = {"snoop": snoop, "robust": robust, "vce": vce}
    given |= {"posterior": posterior, "confidence": confidence}
    steps: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    other = parse_datum(datum) if isinstance(datum, str) else datum
    if isinstance(subject, str | Path) and Path(subject).suffix.lower() == ".toml":
        subject = Project.load(subject)
    if isinstance(subject, Job | Project):
        if options is not None:
            raise InputError("a project is adjusted as it says itself", cure="leave options out")
        refuse_scans(subject.project if isinstance(subject, Job) else subject)
        job = subject if isinstance(subject, Job) else open_job(subject)
        return _done(job.network(), replace(AdjustmentSettings.of(job.project), **steps), other)
    if isinstance(subject, Network):
        network = subject
    else:
        survey = subject if isinstance(subject, Survey) else read(subject)
        network = observed_part(survey).network()
    if not steps:
        network = network if other is None else network.with_datum(other)
        return adjust_alone(network, options=options)
    if options is not None:
        raise InputError(
            "options say when an iteration ends, and several are made",
            cure="leave options out, or the others",
        )
    return _done(network, AdjustmentSettings(**steps), other)


def _done(network: Network, settings: AdjustmentSettings, datum: Datum | None) -> Adjustment:
    """A network adjusted as settings say, in another datum if one is given."""
    network = network if datum is None else network.with_datum(datum)
    found = Solving(network, settings).adjustment
    return found.stated(posterior=settings.posterior, confidence=settings.confidence)


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
