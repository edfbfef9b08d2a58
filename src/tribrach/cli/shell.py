"""What all commands share: the application, errors as sentences, progress.

Whatever is wrong with the input ends in a sentence on standard error and exit status 2.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Annotated, Any, NoReturn

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
from typer.core import TyperGroup

import tribrach
from tribrach.errors import TribrachError

__all__ = ["app", "fail", "guarded", "shown"]

#: commands in the order of a job; others follow
_ORDER = (
    *("run", "demo", "adjust", "plan", "baseline", "targets", "register", "transform"),
    *("calibrate", "check", "compare", "regress", "complete", "info", "convert", "simulate"),
)


class _Ordered(TyperGroup):
    """Lists commands as a job needs them, not as they were imported."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Names of the commands."""
        known = super().list_commands(ctx)
        first = [name for name in _ORDER if name in known]
        return first + [name for name in known if name not in first]


app = typer.Typer(
    cls=_Ordered,
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Turns laser scans and survey observations into georeferenced clouds that state their "
    "uncertainty.",
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"tribrach {tribrach.__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Turns laser scans and survey observations into clouds that state their uncertainty."""


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
