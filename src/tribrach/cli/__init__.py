"""The command line, with one file for each group of commands."""

from __future__ import annotations

import gc
import os
import sys
import warnings
from importlib import import_module
from typing import TYPE_CHECKING, Any

from tribrach.cli.interruption import Interruption

if TYPE_CHECKING:
    from tribrach.cli.commands import app

__all__ = ["app", "main"]


def main() -> None:
    """Entry point of the command ``tribrach``."""
    interruption = Interruption()
    interruption.listen()
    # the last digits of a sum depend on how many threads share it; one job gives the same bytes
    # whatever the number of processors, unless somebody asks for more threads
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    # threads that search neighbours sleep while they wait: on a busy machine they would spin
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
    # what loading makes stays for good: the command looks for garbage once its modules are there
    gc.disable()
    if not sys.warnoptions:
        # a terminal is for sentences; the tests make errors of these warnings
        warnings.simplefilter("ignore", RuntimeWarning)
    try:
        # loaded here, so that Ctrl-C ends the command in order from its first moment
        ahead = import_module("tribrach.compiling_ahead")
        with ahead.compiling_ahead(sys.argv[1:]):
            import_module("tribrach.cli.commands").app()
    except BrokenPipeError:
        # piping into head or a closed pager is no error worth a traceback
        sys.exit(141)
    except KeyboardInterrupt:
        _end(interruption)
    except SystemExit:
        if interruption.number is not None:
            _end(interruption)
        raise


def _end(interruption: Interruption) -> None:
    """Say that the command was interrupted, with the exit status of the signal."""
    print("tribrach: interrupted; nothing was half-written", file=sys.stderr)
    sys.exit(interruption.status)


def __getattr__(name: str) -> Any:
    """Load the commands when first asked for."""
    if name != "app":
        raise AttributeError(f"module tribrach.cli has no attribute {name}")
    return import_module("tribrach.cli.commands").app
