"""From a project to signed figures: the page to read first.

Every verb is a module: open, find, name, adjust, clean, weigh, assess, georeference, compare,
report, write.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from tribrach._types import Progress
from tribrach.errors import InputError, NothingFound, TribrachError
from tribrach.io.keeping import keeping, refuse_loss
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
from tribrach.network.blunders.control_mistakes import wrong_coordinate
from tribrach.network.blunders.mistakes import first_adjustment, mistakes
from tribrach.network.blunders.robust import adjust_robust
from tribrach.network.blunders.snooping import SnoopingLog, snoop
from tribrach.network.blunders.suspects import Key
from tribrach.network.datum_control import unchecked_control
from tribrach.network.misread_checks import misread_checks
from tribrach.network.network import Datum, Network
from tribrach.network.observed_part import observed_part
from tribrach.network.placement import placement_sentences
from tribrach.network.plausible_sigmas import held_azimuths, implausible_sigmas
from tribrach.network.quality import Quality, assess
from tribrach.network.separability import confusable
from tribrach.network.survey import Survey
from tribrach.network.variance_components import VarianceComponents, estimate_components
from tribrach.network.weakness import weakness_sentences
from tribrach.project import Project
from tribrach.registration.geometry_warnings import geometry_sentences
from tribrach.report import html, json_result, text
from tribrach.report.build import build
from tribrach.report.content import Report
from tribrach.report.found_targets import FOLDER, LIST, write_found
from tribrach.report.summary import sigma_origin
from tribrach.report.warnings import ReportWarning, Severity, warned
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


@dataclass(frozen=True)
class AdjustmentSettings:
    """What is done with a network besides adjusting it, and how its figures are stated.

    Parameters
    ----------
    snoop : bool
        Blunders are switched off, one by one.
    robust : str
        Reweighting that points at blunders, ``none`` for none; with ``snoop`` what it points at
        is switched off first, and tried again at the end.
    vce : bool
        Variance components are estimated.
    posterior : bool
        Covariances are scaled by the a-posteriori variance factor.
    confidence : float
        Probability of ellipses, intervals and ellipsoids, of the global test and of the verdicts
        on control and check points.
    angle : str
        Unit of angles in reports, ``gon`` or ``deg``.
    """

    snoop: bool = False
    robust: Literal["none", "huber", "danish", "igg3"] = "none"
    vce: bool = False
    posterior: bool = False
    confidence: float = 0.95
    angle: Literal["gon", "deg"] = "gon"

    @classmethod
    def of(cls, project: Project) -> AdjustmentSettings:
        """Take the settings that a project file states.

        Parameters
        ----------
        project : Project
            Its sections ``[adjustment]`` and ``[output]`` and its confidence.

        Returns
        -------
        AdjustmentSettings
        """
        section = project.adjustment
        return cls(
            snoop=section.snoop,
            robust=section.robust,
            vce=section.vce,
            posterior=section.posterior,
            confidence=project.confidence,
            angle=project.output.angle,
        )


@dataclass(frozen=True)
class SolvedNetwork:
    """An adjusted network, its quality, what was done to it, and what looks wrong.

    ``apart`` is the same without a given coordinate that was found to be wrong: what looks wrong
    in it as well has another reason.
    """

    adjustment: Adjustment
    quality: Quality
    snooping: SnoopingLog | None
    components: VarianceComponents | None
    warnings: tuple[ReportWarning, ...]
    apart: Adjustment


def solve(network: Network, settings: AdjustmentSettings) -> SolvedNetwork:
    """Adjust a network as the settings say, clean it, weigh it, assess it."""
    log: SnoopingLog | None = None
    components: VarianceComponents | None = None
    adjustment = first_adjustment(network)
    wrong = wrong_coordinate(adjustment)
    warnings = [*warned(Severity.INPUT, implausible_sigmas(network))]
    warnings += [*warned(Severity.INPUT, [] if wrong is None else [wrong.sentence()])]
    # what else is wrong is looked for without a coordinate that is wrong for certain
    wrong = wrong if wrong is not None and wrong.certain else None
    apart = adjustment if wrong is None else wrong.after
    found = mistakes(apart)
    warnings += warned(Severity.INPUT, found.sentences)
    warnings += warned(Severity.NOTE, (*found.notes, *held_azimuths(network)))
    suspects: Mapping[Key, float] = {}
    if settings.robust != "none":
        robust = adjust_robust(apart.network, settings.robust)
        warnings += warned(Severity.BLUNDER, robust.sentences())
        suspects = robust.suspects
    if settings.snoop:
        if wrong is None:
            adjustment, log = snoop(network, suspects=suspects)
        else:
            adjustment, log = wrong.snooped(suspects)
    if settings.vce:
        components = estimate_components(adjustment.network)
        adjustment = components.adjustment
    quality = assess(adjustment, posterior=settings.posterior, confidence=settings.confidence)
    apart = adjustment if wrong is None else wrong.without(adjustment)
    alone = quality if wrong is None else assess(apart, confidence=settings.confidence)
    warnings += warned(Severity.WEAK, confusable(apart, alone)[:10])
    warnings += warned(Severity.NOTE, placement_sentences(adjustment))
    warnings += warned(Severity.INPUT, misread_checks(apart))
    warnings += warned(Severity.WEAK, unchecked_control(adjustment))
    warnings += warned(Severity.WEAK, weakness_sentences(adjustment))
    warnings += warned(Severity.WEAK, geometry_sentences(adjustment)[:20])
    return SolvedNetwork(adjustment, quality, log, components, tuple(warnings), apart)


def report(
    solution: SolvedNetwork,
    settings: AdjustmentSettings,
    facts: Mapping[str, str] | None = None,
    job: JobResults | None = None,
) -> Report:
    """Everything there is to say of a solution, and of what a job left besides."""
    return build(
        solution.adjustment,
        solution.quality,
        confidence=settings.confidence,
        posterior=settings.posterior,
        angle=settings.angle,
        facts=facts,
        snooping=solution.snooping,
        components=solution.components,
        warnings=solution.warnings,
        apart=solution.apart,
        job=job or JobResults(),
    )


def adjust_network(
    network: Network, settings: AdjustmentSettings, facts: Mapping[str, str] | None = None
) -> Report:
    """Adjust a network as the settings say; the content of its report."""
    return report(solve(network, settings), settings, facts)


def write(content: Report, folder: Path, further: Mapping[Path, str] | None = None) -> list[Path]:
    """Write report.html, report.txt and result.json into a folder, and further files by path."""
    texts = {folder / name: render(content) for name, render in _REPORTS.items()}
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
    network = job.network_of(survey)
    solution = solve(network if datum is None else network.with_datum(datum), settings)
    antennas = _antennas(survey, solution.adjustment, settings)
    results = JobResults(job.project, job.sessions, antennas=antennas)
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
    settings = AdjustmentSettings.of(project)
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
        job.project, job.sessions, antennas=_antennas(survey, adjustment, settings)
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
    write(content, folder, lever_arm_files(arms, folder, content.datum.sentence, origin))
    if found is not None and (folder / FOLDER / LIST).exists():
        # an earlier run stopped: what it left is brought up to date; files of others stay
        with suppress(InputError):
            write_found(found.findings, folder)
    return content


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
