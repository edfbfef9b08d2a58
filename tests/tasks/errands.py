"""Tasks for tests: functions of a module, so that workers find them."""

import os
import signal
import time
from pathlib import Path
from typing import Any

from tribrach._types import Progress
from tribrach.errors import InputError


def squared(number: float, *, progress: Progress) -> float:
    progress(f"square of {number}", 1, 1)
    return number**2


def slept(seconds: float, *, progress: Progress) -> float:
    time.sleep(seconds)
    return seconds


def positive(number: float, *, progress: Progress) -> float:
    """The lesser of two wrong numbers takes longer to be found."""
    if number < 0:
        time.sleep(0.3 if number == -1 else 0)
        raise InputError(f"{number} is negative", file="numbers.csv", line=3, cure="drop the sign")
    return number


def killed_once(number: float, flag: Path | None, *, progress: Progress) -> float:
    """Die at the first call with a flag, which is a file that the first call makes."""
    if flag is not None and not flag.exists():
        flag.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number**2


def killing(number: float, *, progress: Progress) -> float:
    if number == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    time.sleep(0.1)
    return number


def threads(_: int, *, progress: Progress) -> dict[str, Any]:
    import numba

    return {"compiled": numba.config.NUMBA_NUM_THREADS, "sums": os.environ["OPENBLAS_NUM_THREADS"]}


def deaf(_: int, *, progress: Progress) -> bool:
    """True if Ctrl-C does not reach this process."""
    return signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, [])
