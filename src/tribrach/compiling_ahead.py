"""Kernels are compiled by a second process while a command that will need them is under way.

After an installation nothing is compiled. A command that needs tens of kernels would compile one
after the other, each when it comes to it, while all processors but one wait. So it starts a
process that compiles the kernels of ``kernel_list.tsv`` in the order in which the command needs
them, and stores them where the command finds them; a kernel that one of both is compiling the
other waits for (:mod:`tribrach.kernels`). Once all kernels of a command are stored a stamp says
so, and no process is started until the source, numba or the machine is another one.

The second process ends with the command, however that ends: it holds the other end of a pipe. It
is not started where it could only be in the way, which is with one processor, and nowhere with
``TRIBRACH_COMPILE_AHEAD=0``.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from tribrach.kernel_cache import cache_folder

#: environment variable that is 0 where no second process is wanted
SWITCH = "TRIBRACH_COMPILE_AHEAD"
_PACKAGE = Path(__file__).resolve().parent
#: names of commands, module of this package, kernel, types of its arguments as numba writes them;
#: written by ``docs/make_kernel_list.py``
_LIST = _PACKAGE / "kernel_list.tsv"
#: politeness of the second process; not more, as the command may come to wait for it
_NICE = 5
#: so long the command waits for its end [s]
_ENDING = 1.0
#: the first bytes of what Linux says of its processors: the model of one, and what it can do
_CPU, _CPU_SIZE = Path("/proc/cpuinfo"), 4096
#: what the second process runs, with the modules of the first and nothing from where it is started
_CODE = """
import json, sys
sys.path[:] = json.loads(sys.argv[2])
from tribrach.compiling_ahead import compile_all, end_with_command
end_with_command()
compile_all(sys.argv[1])
"""


@contextmanager
def compiling_ahead(words: Sequence[str]) -> Iterator[Any]:
    """A block with a second process that compiles, where that helps; it ends with the block."""
    process = _started(words)
    try:
        yield process
    finally:
        if process is not None:
            # it hears that, and ends unless it is just storing what it has compiled
            process.stdin.close()
            with suppress(import_module("subprocess").TimeoutExpired):
                process.wait(_ENDING)


def _started(words: Sequence[str]) -> Any:
    """The second process; None where there is none."""
    command = next((word for word in words if not word.startswith("-")), "")
    if "--help" in words or not kernels_of(command) or not _helps():
        return None
    if _read(_stamp(command)) == state(command):
        return None
    # loaded here, as most commands start none
    subprocess = import_module("subprocess")
    path = import_module("json").dumps([os.path.abspath(place) for place in sys.path])
    # on Windows, where a terminal ends what belongs to it; elsewhere it is a session of its own
    flags = sum(
        getattr(subprocess, name, 0) for name in ("BELOW_NORMAL_PRIORITY_CLASS", "CREATE_NO_WINDOW")
    )
    with suppress(OSError):
        return subprocess.Popen(
            [sys.executable, "-P", "-c", _CODE, command, path],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
            creationflags=flags,
        )
    return None


def _helps() -> bool:
    """Is there a processor for it, and does anybody want it?"""
    if os.environ.get(SWITCH) == "0" or os.environ.get("NUMBA_DISABLE_JIT", "0") != "0":
        return False
    # a program that brings its own Python starts itself again under that name
    if not sys.executable or getattr(sys, "frozen", False):
        return False
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0)) > 1
    return (os.cpu_count() or 1) > 1


def kernels_of(command: str) -> list[tuple[str, str, str]]:
    """List modules of this package, kernels and types that a command needs, in its order."""
    rows = (line.split("\t") for line in (_read(_LIST) or "").splitlines())
    return [(row[1], row[2], row[3]) for row in rows if command in row[0].split()]


def _stamp(command: str) -> Path:
    """The file that says that all kernels of a command are stored."""
    return cache_folder() / f"tribrach-{command}.compiled"


def _read(file: Path) -> str | None:
    """What a file says; None if there is none that can be read."""
    with suppress(OSError, UnicodeDecodeError):
        return file.read_text(encoding="utf-8")
    return None


def state(command: str) -> str:
    """What stored kernels depend on, in some hundredths of a millisecond for each module."""
    kernels = kernels_of(command)
    numba = find_spec("numba")
    origin = numba.origin if numba is not None else None
    lines = [str(sys.implementation.cache_tag), f"numba {_age(Path(origin)) if origin else ''}"]
    for module in dict.fromkeys(module for module, *_ in kernels):
        lines.append(f"{module} {_age(_PACKAGE.joinpath(*module.split('.')).with_suffix('.py'))}")
    lines += [" ".join(kernel) for kernel in kernels]
    with suppress(OSError), _CPU.open("rb") as file:
        wanted = (b"model name", b"flags", b"CPU part", b"Features")
        told = [line for line in file.read(_CPU_SIZE).split(b"\n") if line.startswith(wanted)]
        lines += sorted({line.decode("ascii", "replace") for line in told})
    return "\n".join(lines) + "\n"


def _age(file: Path) -> str:
    """When a file was written, and its size."""
    with suppress(OSError):
        status = file.stat()
        return f"{status.st_mtime_ns} {status.st_size}"
    return "absent"


def end_with_command() -> None:
    """End this process when the one that started it does, but not while it stores a kernel."""
    threading = import_module("threading")
    storing = import_module("tribrach.kernels").STORING

    def wait() -> None:
        with suppress(OSError):
            os.read(0, 1)
        with storing:
            os._exit(0)

    threading.Thread(target=wait, daemon=True).start()


def compile_all(command: str) -> None:
    """Compile and store the kernels that a command needs: what the second process does."""
    filelock = import_module("filelock")
    if hasattr(os, "nice"):
        os.nice(_NICE)
    now, stamp = state(command), _stamp(command)
    stamp.parent.mkdir(parents=True, exist_ok=True)
    # given back by the system where this process is ended
    turn = filelock.FileLock(stamp.with_suffix(".lock"))
    # another command of the same name may have its own at work
    with suppress(filelock.Timeout), turn.acquire(blocking=False):
        # where this cannot be written no kernel can, and all the work would be for nothing
        stamp.write_text("begun\n", encoding="utf-8")
        later = [kernel for kernel in kernels_of(command) if not _compiled(*kernel, wait=False)]
        for kernel in later:
            _compiled(*kernel, wait=True)
        stamp.write_text(now, encoding="utf-8")


def _compiled(module: str, name: str, types: str, *, wait: bool) -> bool:
    """Compile and store a kernel; False if another process is about it and is not waited for."""
    kernels = import_module("tribrach.kernels")
    # a kernel that is gone or takes something else is compiled by whoever calls it
    with suppress(Exception):
        kernel = getattr(import_module(f"tribrach.{module}"), name)
        dispatcher = kernel.declared() if isinstance(kernel, kernels.Kernel) else kernel
        if not wait and kernels.is_being_compiled(dispatcher):
            return False
        dispatcher.compile(types_of(types))
    return True


def types_of(text: str) -> tuple[Any, ...]:
    """Types of arguments, as numba writes them where a kernel is declared with them."""
    sigutils = import_module("numba.core.sigutils")
    types: tuple[Any, ...] = sigutils.normalize_signature(f"({text},)")[0]
    return types
