"""Temporary folders that do not outlive the program, not even when it is killed.

A folder is locked as long as the process that made it lives; the system gives the lock back when
the process ends, however it ends. Whoever makes the next folder removes those that nobody holds.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from filelock import FileLock, Timeout

_PREFIX, _LOCK, _CONTENT = "tribrach-scratch-", "lock", "content"
#: folders that are made until one of them can be locked
_TRIES = 20


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """Make a temporary folder, and remove it with all that is in it when the block ends."""
    _remove_abandoned(Path(tempfile.gettempdir()))
    outer, lock = _locked()
    try:
        yield outer / _CONTENT
    finally:
        # Windows does not remove a file that is open
        lock.release()
        shutil.rmtree(outer, ignore_errors=True)


def _locked() -> tuple[Path, FileLock]:
    """A new folder with its lock, which is beside the content: that is for whoever works in it."""
    for _ in range(_TRIES):
        outer = Path(tempfile.mkdtemp(prefix=_PREFIX))
        lock = FileLock(outer / _LOCK)
        # another process may find the folder before it is locked, and take it for abandoned
        with suppress(FileNotFoundError, Timeout):
            lock.acquire(blocking=False)
            (outer / _CONTENT).mkdir()
            return outer, lock
        lock.release()
        shutil.rmtree(outer, ignore_errors=True)
    raise OSError(f"no folder in {tempfile.gettempdir()} could be locked {_TRIES} times")


def is_scratch(path: Path) -> bool:
    """Does a file lie in a temporary folder of this program, so that it is nobody's input?"""
    temporary = Path(tempfile.gettempdir()).resolve()
    return path.is_relative_to(temporary) and any(
        part.startswith(_PREFIX) for part in path.relative_to(temporary).parts[:1]
    )


def _remove_abandoned(folder: Path) -> None:
    """Remove the folders of processes that were killed; those of others and of users stay."""
    for outer in folder.glob(f"{_PREFIX}*"):
        # a folder without a lock is being made at this moment, or was left in that moment: empty
        if not (outer / _LOCK).is_file():
            continue
        lock = FileLock(outer / _LOCK)
        with suppress(OSError, Timeout):
            lock.acquire(blocking=False)
            # held meanwhile, so that whoever is just making the folder sees that it is gone
            shutil.rmtree(outer, ignore_errors=True)
            lock.release()
            # Windows does not remove a file that is open
            shutil.rmtree(outer, ignore_errors=True)
