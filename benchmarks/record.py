"""What was measured, kept from one command to the next.

A full run takes an hour; one that ends early, or a benchmark that is run again, costs no other.
Only what one machine measured with the same libraries stands side by side: the rest is dropped.
"""

from __future__ import annotations

import dataclasses
import datetime
import json
import os
import platform
import resource
import subprocess
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from benchmarks.figures import ROOT, Figure, Growth, as_line, from_line

#: what the figures depend on
PACKAGES = (
    "tribrach", "numpy", "scipy", "numba", "qdldl", "pykdtree", "laspy", "lazrs", "pye57",
    "py4dgeo", "small_gicp", "gtsam", "dask",
)  # fmt: skip


@dataclass(frozen=True)
class Machine:
    """Where something was measured.

    Attributes
    ----------
    machine, system : str
        Processor, cores and memory; operating system and Python.
    packages : str
        Versions of the libraries.
    """

    machine: str
    system: str
    packages: str

    @classmethod
    def here(cls) -> Machine:
        """The machine that runs it."""
        size = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
        return cls(
            f"{_processor()}, {os.cpu_count()} cores, {size / 2**30:.0f} GiB of memory",
            f"{platform.system()}, Python {platform.python_version()}",
            ", ".join(f"{name} {told}" for name in PACKAGES if (told := _version(name))),
        )


@dataclass(frozen=True)
class Measured:
    """One benchmark.

    Attributes
    ----------
    name : str
        Its module.
    sizes : str
        "full", "small" or the sizes of the command line.
    where : Machine
        Machine and versions.
    tree : str
        Commit of the tree that was measured; a "+" where files had changed since.
    date : str
        When it ended, UTC.
    seconds : float
        How long it took by the clock.
    load : float
        Load average when it began [processes].
    others : float or None
        Processors that other programs kept busy meanwhile, on average; None where it is not known.
    found : list
        Its figures.
    """

    name: str
    sizes: str
    where: Machine
    tree: str
    date: str
    seconds: float
    load: float
    others: float | None
    found: list[Figure | Growth] = field(default_factory=list)


class Watch:
    """The clock of a benchmark, and what else the machine did while it ran."""

    def __init__(self) -> None:
        self._load = os.getloadavg()[0]
        self._start = time.perf_counter(), _busy(), _own()

    def measured(self, name: str, sizes: str, found: Iterable[Figure | Growth]) -> Measured:
        """The record, once the benchmark has ended."""
        start, busy, own = self._start
        seconds = time.perf_counter() - start
        now = _busy()
        others = None
        if busy is not None and now is not None:
            others = max(0.0, (now - busy - (_own() - own)) / seconds)
        date = f"{datetime.datetime.now(datetime.UTC):%Y-%m-%d %H:%M}"
        where, tree = Machine.here(), _tree()
        return Measured(name, sizes, where, tree, date, seconds, self._load, others, list(found))


def kept(file: Path, where: Machine) -> dict[str, Measured]:
    """What a file holds of this machine with these libraries, by the name of the benchmark."""
    if not file.exists():
        return {}
    every = [_from_text(line) for line in file.read_text(encoding="utf-8").splitlines()]
    return {one.name: one for one in every if one.where == where}


def keep(file: Path, every: Iterable[Measured]) -> None:
    """Write the file anew, a line for each benchmark."""
    file.parent.mkdir(parents=True, exist_ok=True)
    text = "".join(_text(one) + "\n" for one in every)
    part = file.with_name(f".{file.name}.part")
    part.write_text(text, encoding="utf-8", newline="\n")
    part.replace(file)


def _text(one: Measured) -> str:
    told = dataclasses.asdict(one) | {"found": [as_line(figure) for figure in one.found]}
    return json.dumps(told)


def _from_text(line: str) -> Measured:
    told = json.loads(line)
    found = [from_line(figure) for figure in told.pop("found")]
    return Measured(where=Machine(**told.pop("where")), found=found, **told)


def _tree() -> str:
    """The commit that is checked out; empty where that is not known."""

    def git(*words: str) -> str:
        done = subprocess.run(
            ["git", *words], cwd=ROOT, capture_output=True, text=True, check=False
        )
        return done.stdout.strip() if done.returncode == 0 else ""

    changed = git("status", "--porcelain", "--untracked-files=no", "--", "src", "benchmarks")
    return git("rev-parse", "--short=10", "HEAD") + ("+" if changed else "")


def _busy() -> float | None:
    """Seconds that all processors together have worked since the machine started."""
    told = Path("/proc/stat")
    if not told.exists():
        return None
    ticks: Sequence[int] = [int(word) for word in told.read_text().split("\n", 1)[0].split()[1:9]]
    user, nice, system, _, _, irq, softirq, _ = ticks
    return (user + nice + system + irq + softirq) / os.sysconf("SC_CLK_TCK")


def _own() -> float:
    """Seconds of the processors that this program and what it has run took."""
    both = (resource.getrusage(of) for of in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(used.ru_utime + used.ru_stime for used in both)


def _processor() -> str:
    told = Path("/proc/cpuinfo")
    if told.exists():
        for line in told.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""
