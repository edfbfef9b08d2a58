"""Runs a project with a fault at a chosen write: ``python -m tests.job.faults PROJECT WHAT N``.

``count`` says how many names are given and how many writes are made; ``before`` and ``after`` kill
the process at the N-th name, ``searched`` when the targets of N scans are noted, ``full`` lets the
disk be full from the N-th write on. Everything that
is written in Python passes the hooks; what the library of E57 files writes itself does not.
"""

import builtins
import errno
import io
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from typer.testing import CliRunner


class Faults:
    """Counts names and writes, and strikes at one of them."""

    def __init__(self, what: str, number: int) -> None:
        self.what, self.number = what, number
        self.names = self.writes = 0

    def name(self, replace: Callable[..., None]) -> Callable[..., None]:
        """``os.replace`` that may not come back."""

        def named(*arguments: Any, **options: Any) -> None:
            self.names += 1
            if (self.what, self.number) == ("before", self.names):
                os.kill(os.getpid(), signal.SIGKILL)
            replace(*arguments, **options)
            if (self.what, self.number) == ("after", self.names):
                os.kill(os.getpid(), signal.SIGKILL)
            if self.what == "searched" and self._searched(arguments[1]) == self.number:
                os.kill(os.getpid(), signal.SIGKILL)

        return named

    @staticmethod
    def _searched(given: Any) -> int:
        """Scans whose targets are noted beside the file that was just named."""
        return len(list(Path(given).parent.glob("targets-*.json")))

    def open(self, opened: Callable[..., Any]) -> Callable[..., Any]:
        """``open`` and ``os.fdopen`` whose files may be on a full disk."""

        def opening(file: Any, mode: str = "r", *arguments: Any, **options: Any) -> Any:
            stream = opened(file, mode, *arguments, **options)
            return Full(stream, self) if set(mode) & set("wax+") else stream

        return opening

    def write(self) -> None:
        """Count a write; from the chosen one on there is no space."""
        self.writes += 1
        if self.what == "full" and self.writes >= self.number:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


class Full:
    """A file whose writes are counted."""

    def __init__(self, stream: Any, faults: Faults) -> None:
        self._stream, self._faults = stream, faults

    def write(self, data: Any) -> Any:
        self._faults.write()
        return self._stream.write(data)

    def __enter__(self) -> "Full":
        return self

    def __exit__(self, *error: object) -> None:
        self._stream.close()

    def __iter__(self) -> Any:
        return iter(self._stream)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def main(project: str, what: str, number: str) -> int:
    """Run the project; the exit status of the command."""
    from tribrach.cli import app

    faults = Faults(what, int(number))
    os.replace = faults.name(os.replace)
    os.fdopen = faults.open(os.fdopen)
    # pathlib takes io.open
    io.open = builtins.open = faults.open(io.open)
    result = CliRunner().invoke(app, ["run", project, "--quiet"])
    faults.what = "over"
    print(faults.names, faults.writes)
    print(result.stderr, file=sys.stderr)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        print(f"Traceback: {result.exception!r}", file=sys.stderr)
    return result.exit_code


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
