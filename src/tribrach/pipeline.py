"""From a project to signed figures: the page to read first.

Every verb is a module: open, find, name, adjust, clean, weigh, assess, georeference, compare,
report, write.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Literal

from tribrach._types import Progress
from tribrach.errors import AdjustmentError, InputError, NothingFound, TribrachError
from tribrach.io.epoch_files import SCHEMA as EPOCH_SCHEMA
from tribrach.io.epoch_files import epoch_data, read_epoch
from tribrach.io.keeping import keeping, refuse_loss
from tribrach.io.logo import read_logo
from tribrach.io.outputs import Content, write_texts
from tribrach.io.survey.formats import read
from tribrach.job.antenna_lever_arms import lever_arm_files
from tribrach.job.antennas import CarriedAntennas, carried_antennas
from tribrach.job.epochs import (
    ComparedEpochs,
    EpochInput,
    EpochSettings,
    compare_epochs,
    control_names,
    epoch_of,
)
from tribrach.job.nothing_found import search_sentences
from tribrach.job.opened import Job, open_job
from tribrach.job.plausibility import after_doubts, questions
from tribrach.job.results import JobResults
from tribrach.job.steps import (
    FoundInScans,
    compare,
    find,
    georeference,
    name_and_tie,
    refuse_lost,
    scans_to_tell_of,
)
from tribrach.network.adjustment import Adjustment, Options
from tribrach.network.adjustment import adjust as adjust_alone
from tribrach.network.network import Datum, Network
from tribrach.network.observed_part import observed_part
from tribrach.network.roles import datum_sentence
from tribrach.network.survey import Survey
from tribrach.progress import watched
from tribrach.project import Project
from tribrach.project.sections import OutputSection
from tribrach.questions.targets.chapters import FOLDER, LIST, write_found
from tribrach.report import html, json_result, text
from tribrach.report.content import Report
from tribrach.report.schema.base import document_text, heading
from tribrach.report.schema.epochs import EpochDocument
from tribrach.report.summary import sigma_origin
from tribrach.report.warnings import Severity, warned
from tribrach.report.workbench_parts import workbench_texts
from tribrach.solution import AdjustmentSettings, SolvedNetwork, adjust_network, report, solve
from tribrach.tasks.engine import HERE, Engine

__all__ = [
    "AdjustmentSettings",
    "SolvedNetwork",
    "adjust",
    "adjust_job",
    "adjust_network",
    "compare_epoch_files",
    "epoch_from_files",
    "epoch_text",
    "refuse_scans",
    "report",
    "run",
    "solve",
    "write",
]


#: coordinates of a run with their joint covariance, where they are wanted
_EPOCH = "epoch.json"
#: folder of results where the project names none
_RESULTS = OutputSection().folder

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


def epoch_from_files(
    files: Sequence[Path], *, datum: Literal["free", "control"] = "free", label: str = ""
) -> EpochInput:
    """An epoch from its files: a project, survey files, or coordinates with their covariance.

    Parameters
    ----------
    files
        They belong to one epoch.
    datum
        Of networks: ``free``, so that control can be tested, or ``control`` as given.
    label
        What the epoch is called; the name of its first file if not given, or of the folder where
        a run has left it.

    Raises
    ------
    InputError
        What a file says wrong; a project with scans, a result without joint covariance.
    AdjustmentError
        The network cannot be adjusted.
    """
    paths = [Path(file) for file in files]
    label = label or _label(paths[0])
    stored = read_epoch(paths)
    if stored is not None:
        return EpochInput(
            replace(stored.epoch, label=label), stored.site, sentences=stored.sentences
        )
    settings = AdjustmentSettings()
    if len(paths) == 1 and paths[0].suffix.lower() == ".toml":
        project = Project.load(paths[0])
        if project.scans:
            raise project.error(
                ("scans",),
                "the project has scans",
                f"run it with epoch = true in [output], and give the {_EPOCH} that it writes",
            )
        settings = AdjustmentSettings.of(project)
        network = open_job(project).network()
    else:
        network = observed_part(read(paths)).network()
    return _epoch(network, settings, datum, label)


def _epoch(
    network: Network, settings: AdjustmentSettings, datum: Literal["free", "control"], label: str
) -> EpochInput:
    """The epoch of a network in a datum; blunders are switched off where that is asked for."""
    # roles of control are those before the datum lets it go
    control = control_names(network)
    if datum == "free":
        network = network.with_datum(Datum("free"))
    if settings.snoop or settings.robust != "none" or settings.vce:
        adjustment = solve(network, settings).adjustment
    else:
        adjustment = adjust_alone(network)
    return replace(epoch_of(adjustment, label), control=control)


def compare_epoch_files(
    epochs: Sequence[Sequence[Path]],
    settings: EpochSettings,
    *,
    datum: Literal["free", "control"] = "free",
    previous: bool = False,
) -> list[ComparedEpochs]:
    """Compare epochs with the first of them, or each with the one before it.

    Parameters
    ----------
    epochs
        Files of each, the earliest first; at least two.
    settings
        What is compared, and how.
    datum
        Of networks.
    previous
        Each is compared with the one before it.

    Raises
    ------
    InputError, AdjustmentError
        As for :func:`epoch_from_files`, and where two epochs cannot be compared.
    """
    if len(epochs) < 2:
        raise InputError("one epoch alone says nothing", cure="give at least two")
    labels = _labels([files[0] for files in epochs])
    inputs = [
        epoch_from_files(files, datum=datum, label=label)
        for files, label in zip(epochs, labels, strict=True)
    ]
    firsts = inputs[:-1] if previous else [inputs[0]] * (len(inputs) - 1)
    return [compare_epochs(one, two, settings) for one, two in zip(firsts, inputs[1:], strict=True)]


def _labels(files: Sequence[Path]) -> list[str]:
    """Names of epochs by their files; with more of the path where that is not enough."""
    for name in (
        [_label(f) for f in files],
        [f.name for f in files],
        [f"{f.resolve().parent.name}/{f.name}" for f in files],
    ):
        if len(set(name)) == len(name):
            return name
    return [f"{k + 1}: {f.name}" for k, f in enumerate(files)]


def _label(file: Path) -> str:
    """The name of a file without its suffix; of what a run has left, that of the folder."""
    if file.name != _EPOCH:
        return file.stem
    folder = file.resolve().parent
    return (folder.parent if folder.name == _RESULTS else folder).name or file.stem


def epoch_text(adjustment: Adjustment, label: str) -> str:
    """The epoch file of an adjusted network, for later comparisons.

    Raises
    ------
    InputError
        The network has too many points for a joint covariance.
    """
    found = epoch_of(adjustment, label)
    data = heading(EPOCH_SCHEMA) | epoch_data(found.epoch, found.site, datum_sentence(adjustment))
    return document_text(EpochDocument.model_validate(data))


def _earlier(project: Project, adjustment: Adjustment) -> tuple[ComparedEpochs, ...]:
    """The project against the earlier epochs that it names."""
    out = []
    for k, section in enumerate(project.epochs):
        files = [project.folder / name for name in section.against]
        missing = [path for path in files if not path.is_file()]
        if missing:
            raise project.error(
                ("epochs", k, "against"), f"there is no file {missing[0].name}", "check the path"
            )
        first = epoch_from_files(files, datum=section.datum)
        # named as the earlier one is: after its folder, or by its title
        own = project.folder / project.output.folder / _EPOCH
        label = _label(own) if files[0].name == _EPOCH else project.title
        label = label if label != first.epoch.label else f"{label} (now)"
        second = _epoch(adjustment.network, AdjustmentSettings(), section.datum, label)
        control = control_names(adjustment.network)
        settings = EpochSettings(
            section.settings(project.confidence), section.coordinates, section.free
        )
        out.append(compare_epochs(first, replace(second, control=control), settings))
    return tuple(out)


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
    with _questioned(job, survey):
        solution = solve(job.network_of(survey, datum=datum), settings)
    solution = _doubted(solution, job, survey)
    antennas = _antennas(survey, solution.adjustment, settings)
    results = JobResults(
        job.project,
        job.sessions,
        antennas=antennas,
        epochs=_earlier(job.project, solution.adjustment),
        logo=_logo(job.project),
    )
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
    with keeping(project.inputs(), folder, overwrite=overwrite), watched(progress) as told:
        return _run(project, folder, told, engine)


@contextmanager
def _questioned(job: Job, survey: Survey) -> Iterator[None]:
    """Whatever cannot be adjusted says first what looks wrong in what the project gives."""
    try:
        yield
    except AdjustmentError as error:
        error.because(questions(job.project, survey))
        raise
    except InputError as error:
        raise after_doubts(error, job.project, survey) from error


def _doubted(solution: SolvedNetwork, job: Job, survey: Survey) -> SolvedNetwork:
    """A solution whose warnings begin with what looks wrong, if it fails its global test."""
    if solution.quality.global_test.passed is not False:
        return solution
    said = warned(Severity.INPUT, questions(job.project, survey))
    return replace(solution, warnings=(*said, *solution.warnings))


def _run(project: Project, folder: Path, progress: Progress, engine: Engine) -> Report:
    """Run a project while what it reads is kept."""
    for name in _REPORTS:
        refuse_loss(folder / name)
    settings, logo = AdjustmentSettings.of(project), _logo(project)
    job = open_job(project, progress)
    found = find(job, folder, progress, engine) if project.scans else None
    with _leaving(job, found, folder):
        ties = None if found is None else name_and_tie(job, found, progress)
        tied = None if ties is None else ties.registered.survey
        survey = job.surveyed(tied)
        with _questioned(job, survey):
            solution = solve(job.network_of(survey, whole=tied is not None, final=True), settings)
        solution = _doubted(solution, job, survey)
        if ties is not None:
            refuse_lost(job, ties, solution.adjustment)
    adjustment = solution.adjustment
    origin = sigma_origin(adjustment, settings.posterior, solution.components)
    results = JobResults(
        job.project,
        job.sessions,
        antennas=_antennas(survey, adjustment, settings),
        epochs=_earlier(project, adjustment),
        logo=logo,
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
    beside: dict[Path, str | bytes] = {
        **lever_arm_files(arms, folder, content.datum.sentence, origin),
        **workbench_texts(content, folder),
    }
    if project.output.epoch:
        beside[folder / _EPOCH] = epoch_text(adjustment, project.title)
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
def _leaving(job: Job, found: FoundInScans | None, folder: Path) -> Iterator[None]:
    """A block in which stations are tied and adjusted; if it fails, what was found is written."""
    try:
        yield
    except TribrachError as error:
        if found is not None and found.findings:
            _leave_found(error, job, found, folder)
        raise


def _leave_found(error: TribrachError, job: Job, found: FoundInScans, folder: Path) -> None:
    """Write what was found in scans before a run stopped; the error says where it is."""
    if not isinstance(error, NothingFound):
        for finding in scans_to_tell_of(error, job, found)[:_BARE]:
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
