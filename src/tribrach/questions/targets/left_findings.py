"""What a run leaves of its scans when it stops: targets, candidates and panoramas."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from tribrach.errors import InputError, NothingFound, TribrachError
from tribrach.job.nothing_found import search_sentences
from tribrach.job.opened import Job
from tribrach.job.steps import FoundInScans, scans_to_tell_of
from tribrach.questions.targets.chapters import FOLDER, LIST, write_found

__all__ = ["leaving", "renew_findings"]

#: scans without targets whose searches are told where a run stops
_BARE = 6


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
