"""What all commands share: errors as sentences, progress.

Whatever is wrong with the input ends in a sentence on standard error and exit status 2.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    SpinnerColumn,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
)

from tribrach.errors import TribrachError

__all__ = ["fail", "guarded", "shown"]


def guarded(work: Callable[[], Any]) -> None:
    """Run a command; errors of the input become one sentence and exit status 2."""
    try:
        work()
    except TribrachError as error:
        fail(str(error))
    except KeyboardInterrupt:
        typer.echo("interrupted; nothing was half-written", err=True)
        raise typer.Exit(130) from None


def fail(sentence: str) -> NoReturn:
    """End with a sentence on standard error and exit status 2."""
    typer.echo(f"tribrach: {sentence}", err=True)
    raise typer.Exit(2)


@contextmanager
def shown(quiet: bool) -> Iterator[Callable[[str, int, int | None], None]]:
    """A progress display on standard error; nothing where that is no terminal."""
    if quiet or not sys.stderr.isatty():
        yield lambda what, done, total: None
        return
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as display:
        tasks: dict[str, TaskID] = {}

        def report(what: str, done: int, total: int | None) -> None:
            if what not in tasks:
                tasks[what] = display.add_task(what, total=total)
            display.update(tasks[what], completed=done, total=total)

        yield report
