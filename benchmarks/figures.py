"""What a benchmark measured: costs of ours and of a peer in the same run, and how they grow."""

from __future__ import annotations

import dataclasses
import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

Result = TypeVar("Result")

ROOT = Path(__file__).parents[1]


@dataclass(frozen=True)
class Cost:
    """What a piece of work took: by the clock and of the processors [s], peak memory [MB]."""

    wall: float
    processor: float
    memory: float | None = None


@dataclass(frozen=True)
class Figure:
    """Ours against a peer, or against an operation that no method avoids."""

    what: str
    size: str
    ours: Cost
    peer: str
    #: None where the peer is not installed
    theirs: Cost | None
    #: how far the results of both agree, and what else there is to say
    agreement: str = ""

    def ratio(self, of: str = "wall") -> float | None:
        """Ours over theirs."""
        if self.theirs is None:
            return None
        return float(getattr(self.ours, of) / getattr(self.theirs, of))


@dataclass(frozen=True)
class Growth:
    """Cost against size."""

    what: str
    unit: str
    sizes: tuple[float, ...]
    seconds: tuple[float, ...]

    def exponent(self) -> float:
        """Power of the size that fits best."""
        return float(np.polyfit(np.log(self.sizes), np.log(self.seconds), 1)[0])


def cost_of(work: Callable[[], Result], repeats: int = 1) -> tuple[Result, Cost]:
    """What the work gives, and the least that it took in some repeats, in this process."""
    walls, processors = [], []
    for _ in range(repeats):
        start = time.perf_counter(), time.process_time()
        result = work()
        walls.append(time.perf_counter() - start[0])
        processors.append(time.process_time() - start[1])
    return result, Cost(min(walls), min(processors), peak())


def least(costs: Sequence[Cost]) -> Cost:
    """The least of each, over repeats."""
    memory = [cost.memory for cost in costs if cost.memory is not None]
    return Cost(
        min(cost.wall for cost in costs),
        min(cost.processor for cost in costs),
        min(memory) if memory else None,
    )


def peak() -> float:
    """Most memory that this process has held [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def alone(module: str, *words: object) -> dict[str, Any]:
    """What ``python -m benchmarks.MODULE WORDS`` prints as JSON, in a process of its own."""
    command = [sys.executable, "-m", f"benchmarks.{module}", *map(str, words)]
    out = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    return dict(json.loads(out.splitlines()[-1]))


def whole_process(command: Sequence[str], repeats: int = 1, **environment: str) -> Cost:
    """What a command takes from its start to its end, children included."""
    costs = []
    for _ in range(repeats):
        # a process in between waits for the command alone, so that its usage is not another's
        words = [sys.executable, "-c", _WATCH, *command]
        told = subprocess.run(
            words,
            cwd=ROOT,
            env={**os.environ, **environment},
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        costs.append(Cost(*json.loads(told.splitlines()[-1])))
    return least(costs)


_WATCH = """
import json, resource, subprocess, sys, time
start = time.perf_counter()
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL)
used = resource.getrusage(resource.RUSAGE_CHILDREN)
wall = time.perf_counter() - start
print(json.dumps([wall, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024]))
"""


def as_line(found: Figure | Growth) -> str:
    """One line of JSON that `from_line` reads."""
    return json.dumps({"kind": type(found).__name__, **dataclasses.asdict(found)})


def from_line(line: str) -> Figure | Growth:
    """What `as_line` wrote."""
    told = json.loads(line)
    if told.pop("kind") == "Growth":
        return Growth(told["what"], told["unit"], tuple(told["sizes"]), tuple(told["seconds"]))
    theirs = told.pop("theirs")
    ours = Cost(**told.pop("ours"))
    return Figure(ours=ours, theirs=None if theirs is None else Cost(**theirs), **told)


def in_words(found: Figure | Growth) -> str:
    """A line for the terminal."""
    if isinstance(found, Growth):
        least, most = found.sizes[0], found.sizes[-1]
        return (
            f"{found.what}: seconds grow with {found.unit}^{found.exponent():.2f} "
            f"({least:,.0f} to {most:,.0f})"
        )
    start = f"{found.what}, {found.size}: {found.ours.wall:.3g} s"
    if found.theirs is None:
        return f"{start}; {found.peer} is not installed"
    ending = f"; {found.agreement}" if found.agreement else ""
    return (
        f"{start}, {found.peer} {found.theirs.wall:.3g} s: ratio {found.ratio():.2f} "
        f"({found.ratio('processor'):.2f} of the processors){ending}"
    )


def run(
    measure: Callable[..., Iterator[Figure | Growth]],
    full: Sequence[float],
    small: Sequence[float],
) -> None:
    """The main part of a benchmark: print what is measured with the sizes asked for, as JSON."""
    words = sys.argv[1:]
    sizes = small if words == ["--small"] else [float(word) for word in words] or full
    for found in measure(*sizes):
        print(as_line(found), flush=True)
