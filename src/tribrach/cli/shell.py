"""What all commands share: errors as sentences, refused outputs, progress.

An error of the input ends in a sentence on standard error and exit status 2.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
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

from tribrach.errors import InputError, TribrachError

__all__ = ["fail", "guarded", "refuse_outputs", "shown"]


def guarded(work: Callable[[], Any]) -> None:
    """Run a command; errors of the input become one sentence and exit status 2."""
    try:
        work()
    except TribrachError as error:
        fail(str(error))
    except BrokenPipeError:
        raise
    except OSError as error:
        fail(
            f"{error.filename or 'a file'}: {error.strerror or error}; check the file and its disk."
        )
    except MemoryError:
        fail("the memory is not enough for this; give smaller files or close other programs.")
    except KeyboardInterrupt:
        typer.echo("interrupted; nothing was half-written", err=True)
        raise typer.Exit(130) from None


def refuse_outputs(inputs: Iterable[Path], outputs: Iterable[Path | None]) -> None:
    """Refuse, before any work is done, results that would overwrite something else.

    Parameters
    ----------
    inputs
        Files that the command reads.
    outputs
        Files that it writes; None takes no part.

    Raises
    ------
    InputError
        A result has the name of an input, of another result or of a folder.
    """
    taken = {path.resolve(): "it is read by the same command" for path in inputs}
    for path in outputs:
        if path is None:
            continue
        place = path.resolve()
        if place in taken or place.is_dir():
            raise InputError(
                f"this result would take the place of a file: {taken[place]}"
                if place in taken
                else "this is a folder, no file",
                file=path,
                cure="name another file",
            )
        taken[place] = "another result has this name"


def fail(sentence: str) -> NoReturn:
    """End with a sentence on standard error and exit status 2."""
    typer.echo(f"tribrach: {sentence}", err=True)
    raise typer.Exit(2)


@contextmanager
def shown(quiet: bool) -> Iterator[Callable[[str, int, int | None], None]]:
    """A progress display on standard error; nothing is shown where that is no terminal."""
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
