"""Who is told of work that takes long: a terminal, a log, a notebook, or a function of yours.

Everything that takes long calls one function, ``progress(what, done, total)``: what is being done,
how much of it is done, and how much there is, None where nobody knows. What is done with that is
decided here alone.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TextIO

from tribrach._types import Progress

#: a stage that took less [s] is not worth a line in a log
_WORTH = 1.0
#: a notebook is drawn anew this often at most [s]
_OFTEN = 0.25


def silent(what: str, done: int, total: int | None) -> None:
    """Tell nobody."""


@contextmanager
def in_terminal() -> Iterator[Progress]:
    """Show stage, what is done, how far it is and how long it will take still."""
    # a display is loaded for somebody who looks at it
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import (
        BarColumn,
        Progress,
        SpinnerColumn,
        TaskID,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns = (
        SpinnerColumn(),
        TextColumn("{task.fields[stage]}", style="dim"),
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TextColumn("still", style="dim"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as display:
        tasks: dict[str, TaskID] = {}

        def report(what: str, done: int, total: int | None) -> None:
            if what not in tasks:
                for known in tasks.values():
                    display.update(known, visible=False)
                stage = f"stage {len(tasks) + 1}"
                tasks[what] = display.add_task(escape(what), total=total, stage=stage)
            display.update(tasks[what], completed=done, total=total, visible=True)

        yield report


@contextmanager
def in_lines(
    stream: TextIO | None = None, clock: Callable[[], float] = time.monotonic
) -> Iterator[Progress]:
    """Write one line for every stage with its time, once it is over; short ones say nothing."""
    stages = _Stages(clock)

    def say(line: str) -> None:
        print(line, file=sys.stderr if stream is None else stream, flush=True)

    def report(what: str, done: int, total: int | None) -> None:
        line = stages.ended(what, done)
        if line:
            say(line)

    try:
        yield report
    finally:
        line = stages.ended(None, 0)
        if line:
            say(line)


class _Stages:
    """One stage after the other with its time."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._what: str | None = None
        self._begun = self._first = clock()
        self._done = 0

    def ended(self, what: str | None, done: int) -> str:
        """Message for a stage that ended because another began; "" while it goes on."""
        if what == self._what and what is not None:
            self._done = max(self._done, done)
            return ""
        now = self._clock()
        took, line = now - self._begun, ""
        if self._what is not None and took >= _WORTH:
            many = f", {self._done:,}" if self._done > 1 else ""
            since = _time(now - self._first)
            line = f"  {_seen(self._what)}{many}: {took:.1f} s (after {since})"
        self._what, self._begun, self._done = what, now, done
        return line


def _seen(text: str) -> str:
    """A name without characters that steer a terminal."""
    return "".join(c if c.isprintable() else "\ufffd" for c in text)


def _time(seconds: float) -> str:
    """Minutes and seconds."""
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"


@contextmanager
def in_notebook(
    show: Callable[[str], Callable[[str], Any]] | None = None,
    clock: Callable[[], float] = time.monotonic,
) -> Iterator[Progress]:
    """Show one line in a cell that is written over as the work goes on."""
    write: Callable[[str], Any] | None = None
    begun = drawn = clock()
    stage, stage_begun, stages = "", begun, 0

    def report(what: str, done: int, total: int | None) -> None:
        nonlocal write, drawn, stage, stage_begun, stages
        now = clock()
        if what != stage:
            stage, stage_begun, stages = what, now, stages + 1
        elif now - drawn < _OFTEN:
            return
        drawn = now
        line = f"{_time(now - begun)}  stage {stages}: {_seen(what)}{_far(done, total)}"
        if total and 0 < done < total and now > stage_begun:
            line += f", still {_time((now - stage_begun) * (total - done) / done)}"
        if write is None:
            write = (show or _display)(line)
        else:
            write(line)

    yield report
    if write is not None:
        write(f"{_time(clock() - begun)}  {stages} stages, done")


def _far(done: int, total: int | None) -> str:
    """How far it is in words."""
    if total:
        return f", {min(done / total, 1.0):.0%}"
    return f", {done:,}" if done else ""


def _display(line: str) -> Callable[[str], Any]:
    """Show a line in the cell that runs; what is given writes over it."""
    shows = sys.modules["IPython.display"]  # there in every notebook, and nowhere needed
    handle = shows.display(shows.Pretty(line), display_id=True)
    return lambda text: handle.update(shows.Pretty(text))


def _of_notebook() -> bool:
    """True if this process works for a notebook."""
    module = sys.modules.get("IPython")
    shell = None if module is None or "IPython.display" not in sys.modules else module.get_ipython()
    return type(shell).__name__ == "ZMQInteractiveShell"


@contextmanager
def watched(progress: Progress | None) -> Iterator[Progress]:
    """A function that is told: the caller's, or one that shows a line where a notebook runs."""
    if progress is not None:
        yield progress
    elif _of_notebook():
        with in_notebook() as shown:
            yield shown
    else:
        yield silent
