"""One run at a time in a folder of results.

Two runs in one folder would take each other's half-written files for leftovers and mix their
results. The lock is one of the system, which gives it back when the process ends, however it ends:
there are no stale locks. The file of the lock names who holds it.
"""

from __future__ import annotations

import json
import os
import platform
import threading
from contextlib import suppress
from datetime import datetime
from pathlib import Path

from filelock import FileLock, Timeout

from tribrach.errors import InputError
from tribrach.io.json_text import json_text

#: file of the lock in the folder of what the program keeps for itself
LOCK_FILE = "lock"
#: notes of who holds a lock are no longer than this [bytes]
_LARGEST = 1000


class FolderLock:
    """The lock of a folder of results, taken when first something is written there.

    ``state``: the folder of what the program keeps for itself in the folder of results.
    """

    #: folders that this process holds, with the thread that took them
    _held: dict[Path, int] = {}  # noqa: RUF012
    _guard = threading.Lock()

    def __init__(self, state: Path) -> None:
        self._state = state
        self._lock: FileLock | None = None

    def take(self) -> None:
        """Take the lock; blocks within one that has it already have it too."""
        place = self._state.resolve()
        with self._guard:
            holder = self._held.get(place)
            if holder == threading.get_ident():
                return
            if holder is not None:
                raise self._refused("another run of this process")
            self._state.mkdir(parents=True, exist_ok=True)
            lock = FileLock(self._state / LOCK_FILE)
            try:
                lock.acquire(blocking=False)
            except Timeout:
                raise self._refused(_holder(self._state / LOCK_FILE)) from None
            except OSError:
                # a disk that knows no locks: runs there are as safe as they were without
                return
            self._lock = lock
            self._held[place] = threading.get_ident()
        note = {
            "process": os.getpid(),
            "machine": platform.node(),
            "since": datetime.now().astimezone().isoformat(timespec="seconds"),
        }
        # only the sentence to another run is poorer without the note
        with suppress(OSError):
            (self._state / LOCK_FILE).write_text(json_text(note), encoding="utf-8")

    def give_back(self) -> None:
        """Give the lock back, if this object took it."""
        lock, self._lock = self._lock, None
        if lock is None:
            return
        with suppress(OSError):
            (self._state / LOCK_FILE).write_bytes(b"")
        with self._guard:
            self._held.pop(self._state.resolve(), None)
            lock.release()

    def _refused(self, who: str) -> InputError:
        return InputError(
            f"{who} is writing into this folder",
            file=self._state.parent,
            cure="wait until it has ended, or name another folder for results",
        )


def _holder(file: Path) -> str:
    """Holder of a lock, as its file names it."""
    try:
        with file.open("rb") as opened:
            note = json.loads(opened.read(_LARGEST))
        process, machine = int(note["process"]), str(note["machine"])
        since = datetime.fromisoformat(str(note["since"]))
    except (OSError, ValueError, KeyError, TypeError, OverflowError, RecursionError):
        return "another run"
    return f"another run (process {process} on {machine!r}, since {since:%Y-%m-%d %H:%M:%S})"
