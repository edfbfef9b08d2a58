"""What a run leaves in its folder: the report in three forms and what its job brings besides, or
targets, candidates and panoramas where it stops.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tribrach.errors import InputError, NothingFound, TribrachError
from tribrach.io.delivery.names import DeliveryOptions, refuse_missing, suffix_of
from tribrach.io.keeping import refuse_loss
from tribrach.io.outputs import Content, write_texts
from tribrach.job.antenna_lever_arms import lever_arm_files
from tribrach.job.nothing_found import search_sentences
from tribrach.job.opened import Job
from tribrach.job.steps import FoundInScans, scans_to_tell_of
from tribrach.project import OutputSection
from tribrach.questions.epochs.from_files import EPOCH, epoch_text
from tribrach.questions.targets.chapters import FOLDER, LIST, write_found
from tribrach.report import html, json_result, text
from tribrach.report.content import Report
from tribrach.report.workbench_parts import workbench_texts

#: scans without targets whose searches are told where a run stops
_BARE = 6
#: what every run leaves, by name
_REPORTS: dict[str, Callable[[Report], Content]] = {
    "report.html": html.render,
    "report.txt": text.render,
    "result.json": json_result.pieces,
}


def refuse_reports(folder: Path, output: OutputSection) -> None:
    """Refuse what could not be written or would take the place of another file, before any work."""
    for format in output.deliver:
        refuse_missing(format)
    for name in (*_REPORTS, *map(_delivered_name, output.deliver)):
        refuse_loss(folder / name)


def _delivered_name(format: str) -> str:
    """The name of a result in a format of offices."""
    return f"result{suffix_of(format)}"


def write(content: Report, folder: Path) -> list[Path]:
    """Write all reports, lever arms, the epoch that is wanted, and what the workbench shows."""
    job = content.job
    files: dict[Path, Content] = {
        **lever_arm_files(job.lever_arms, folder, content.datum.sentence, content.sigma_origin),
        **workbench_texts(content, folder),
    }
    if job.project is not None and job.project.output.epoch:
        files[folder / EPOCH] = epoch_text(content.adjustment, job.project.title)
    written = write_texts(files | {folder / name: make(content) for name, make in _REPORTS.items()})
    return written + _deliver(content, folder)


def _deliver(content: Report, folder: Path) -> list[Path]:
    """Write the result in the formats of offices that the project wants."""
    output = OutputSection() if content.job.project is None else content.job.project.output
    if not output.deliver:
        return []
    from tribrach.io.delivery.content import delivered_network
    from tribrach.io.delivery.formats import delivered

    result = delivered_network(json_result.network(content))
    options = DeliveryOptions(output.drawing_scale, output.list_template)
    return write_texts(
        {folder / _delivered_name(f): delivered(result, f, options) for f in output.deliver}
    )


@contextmanager
def leaving(job: Job, found: FoundInScans | None, folder: Path) -> Iterator[None]:
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


def renew_findings(found: FoundInScans | None, folder: Path) -> None:
    """Bring up to date what an earlier run left that stopped; files of others stay."""
    if found is not None and (folder / FOLDER / LIST).exists():
        with suppress(InputError):
            write_found(found.findings, folder)
