"""RTKLIB behind one interface: the program ``rnx2rtkp`` or the wheel ``pyrtklib``.

Both get the same file of options and leave the same kind of solution file, so that one can check
the other. Each run is a process of its own with a time limit. RTKLIB takes everything from files,
so this module writes what a run needs into a temporary folder: nobody else reads those files.

T. Takasu, RTKLIB 2.4.3 manual, appendix B (options) and E.4 to E.7 (static baselines, LAMBDA
ambiguities).
"""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from pathlib import Path
from typing import Literal

from tribrach.errors import InputError

EngineName = Literal["auto", "pyrtklib", "rnx2rtkp"]
PROGRAM = "rnx2rtkp"
#: exit status of each engine where there was nothing to compute
_NOTHING = {"rnx2rtkp": 1, "pyrtklib": 4}
#: runs the wheel in a process of its own
WORKER = Path(__file__).with_name("engine_worker.py")


def engines() -> tuple[EngineName, ...]:
    """Names of the engines that are installed, the preferred one first."""
    installed: list[EngineName] = []
    if importlib.util.find_spec("pyrtklib") is not None:
        installed.append("pyrtklib")
    if shutil.which(PROGRAM) is not None:
        installed.append("rnx2rtkp")
    return tuple(installed)


def run_engine(
    options: Mapping[str, object],
    files: Sequence[Path],
    folder: Path,
    *,
    engine: EngineName = "auto",
    seconds: float = 600.0,
    span: tuple[float, float] | None = None,
) -> tuple[Path, EngineName]:
    """Run RTKLIB on files: rover's, base's, orbits; ``span`` is first and last GPS time [s]."""
    installed = engines()
    if engine == "auto" and not installed:
        raise InputError(
            "baselines need RTKLIB, and neither pyrtklib nor rnx2rtkp is installed",
            cure="install pyrtklib, or the package rtklib of the system",
        )
    if engine != "auto" and engine not in installed:
        raise InputError(
            f"the engine {engine} is not installed",
            cure=f"use {installed[0]}" if installed else "install pyrtklib",
        )
    chosen = installed[0] if engine == "auto" else engine
    settings, out = folder / "rtklib.conf", folder / "rtklib.pos"
    settings.write_text("".join(f"{key} ={value}\n" for key, value in options.items()))
    out.unlink(missing_ok=True)
    names = [str(path) for path in files]
    if chosen == "rnx2rtkp":
        command = [PROGRAM, "-k", str(settings), "-o", str(out), *_span_options(span), *names]
    else:
        times = [f"{at:.6f}" for at in span or (0.0, 0.0)]
        command = [sys.executable, "-P", str(WORKER), str(settings), str(out), *times, *names]
    _run(command, folder, chosen, seconds)
    if not out.is_file():
        out.write_text("")
    return out, chosen


def _span_options(span: tuple[float, float] | None) -> list[str]:
    """Options of the program for the first and the last epoch, as date and time."""
    out: list[str] = []
    for name, at in zip(("-ts", "-te"), span or (), strict=False):
        moment = datetime(1980, 1, 6) + timedelta(seconds=at)
        out += [name, f"{moment:%Y/%m/%d}", f"{moment:%H:%M:%S.%f}"]
    return out


def staged(folder: Path, contents: Mapping[str, bytes]) -> list[Path]:
    """Write files of the given names and contents into the work folder, in this order."""
    paths = []
    for name, content in contents.items():
        paths.append(folder / name)
        paths[-1].write_bytes(content)
    return paths


def _run(command: list[str], folder: Path, engine: EngineName, seconds: float) -> None:
    """Run the command and wait for it."""
    try:
        done = subprocess.run(
            command,
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=seconds,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise InputError(
            f"{engine} was not ready after {seconds:.0f} s and was stopped",
            cure="thin the observations out or allow more time",
        ) from error
    except OSError as error:
        raise InputError(f"{engine} could not be started ({error.strerror})") from error
    if done.returncode < 0:
        raise InputError(
            f"{engine} crashed on these files (signal {-done.returncode})",
            cure="check that the files are whole, or use the other engine",
        )
    # both say by a status that there was nothing to compute; the empty solution says the rest
    if done.returncode not in (0, _NOTHING[engine]):
        raise InputError(f"{engine} ended with status {done.returncode}")
