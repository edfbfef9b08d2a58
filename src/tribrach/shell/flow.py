"""What all commands share: errors as sentences, refused outputs, progress.

An error of the input ends in a sentence on standard error and exit status 2; a fault of the program
in one that names a file to send, and exit status 3.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from tribrach._types import Progress
from tribrach.errors import InputError, TribrachError, doubting, untold_doubts
from tribrach.io.fault_file import write_fault
from tribrach.io.keeping import keep, keeping, refuse_loss
from tribrach.io.outputs import special
from tribrach.progress import in_lines, in_terminal, silent
from tribrach.report.characters import visible
from tribrach.tasks.engine import HERE, Engine

#: the option of every command that writes files
Overwrite = Annotated[
    bool,
    typer.Option("--overwrite", help="Replace files that this program did not write."),
]

#: the options of every command that opens the page of a project or of results
ShownClouds = Annotated[
    list[Path] | None,
    typer.Option(
        "--cloud",
        help="Show this cloud too, in the frame of the others: distances of tribrach compare.",
    ),
]
ShownEpochs = Annotated[
    Path | None,
    typer.Option(help="Draw the displacements that tribrach epochs wrote with --json."),
]
PagePort = Annotated[
    int, typer.Option(min=0, max=65535, help="Port of this machine; a free one if 0.")
]
NoBrowser = Annotated[
    bool, typer.Option("--no-browser", help="Print the address and open no browser.")
]

#: the option of every command that says something
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing.")]

#: the options of every command whose work is done in tasks
Workers = Annotated[
    int | None,
    typer.Option(min=1, max=1024, help="Work in so many processes at once (docs: On a cluster)."),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS", help="Work on several machines: where the scheduler of Dask listens."
    ),
]


def guarded(work: Callable[[], Any]) -> None:
    """Run a command; errors of the input become one sentence and exit status 2, others 3."""
    try:
        with keeping(), doubting():
            try:
                work()
            except TribrachError as error:
                for note in untold_doubts():
                    error.add_note(note)
                raise
    except TribrachError as error:
        notes = getattr(error, "__notes__", ())
        between = " " if len(notes) == 1 and "\n" not in str(error) else "\n"
        fail(between.join([str(error), *notes]))
    except BrokenPipeError:
        raise
    except OSError as error:
        fail(
            f"{error.filename or 'a file'}: {error.strerror or error}; check the file and its disk."
        )
    except MemoryError:
        fail("the memory is not enough for this; give smaller files or close other programs.")
    except KeyboardInterrupt:
        # what is said then, and the exit status, depend on the signal: see cli.main
        raise typer.Exit(130) from None
    except (typer.Exit, typer.Abort, typer.BadParameter):
        raise
    except Exception as error:
        place = write_fault(error)
        send = "please send what was read" if place is None else f"please send {place}"
        what = f"this is a fault of the program ({type(error).__name__})"
        typer.echo(f"tribrach: {what}; {send} to those who maintain it.", err=True)
        raise typer.Exit(3) from error


def claim(
    inputs: Iterable[Path],
    outputs: Mapping[str, Path | Iterable[Path] | None],
    folder: Path | None = None,
    *,
    overwrite: bool,
) -> None:
    """Say what a command reads and writes, by option; refuse first what would be lost."""
    results = [
        (path, kind)
        for kind, several in outputs.items()
        for path in ([several] if isinstance(several, Path) else several or ())
    ]
    keep([], folder, overwrite=overwrite, kinds=dict(results))
    for path in inputs:
        keep([path])
        if path.suffix.lower() == ".toml":
            # the model of project files takes its time, which files of networks should not spend
            from tribrach.project import Project

            with suppress(InputError):  # what is wrong with it is said by who reads it
                keep(Project.load(path).inputs())
    taken = set[Path]()
    for result, _ in results:
        if result.is_dir():
            raise InputError("this is a folder, no file", file=result, cure="name a file in it")
        if result.resolve() in taken:
            raise InputError(
                "two results would have this name", file=result, cure="name another file"
            )
        taken.add(result.resolve())
        if not special(result):
            refuse_loss(result)


@contextmanager
def working(workers: int | None, scheduler: str | None) -> Iterator[Engine]:
    """Who does the tasks of a command: this process, others of this machine, or a cluster."""
    if workers is None and scheduler is None:
        yield HERE
        return
    if workers is not None and scheduler is not None:
        raise InputError(
            "workers of this machine and those of a scheduler are not taken together",
            cure="give --workers or --scheduler",
        )
    # Dask takes its time, which only who asks for it should spend
    from tribrach.tasks.cluster import local_workers, remote_workers

    with (
        local_workers(workers) if workers is not None else remote_workers(scheduler or "") as engine
    ):
        yield engine


def fail(sentence: str) -> NoReturn:
    """End with a sentence on standard error and exit status 2."""
    typer.echo(f"tribrach: {sentence}", err=True)
    raise typer.Exit(2)


def say(text: str) -> None:
    """Print on standard output; what names bring along steers no terminal."""
    typer.echo(visible(text))


@contextmanager
def shown(quiet: bool) -> Iterator[Progress]:
    """Progress on standard error: a display in a terminal, elsewhere a line for each stage."""
    if quiet:
        yield silent
        return
    if not sys.stderr.isatty():
        with in_lines() as progress:
            yield progress
        return
    with ExitStack() as stack:
        display: list[Progress] = []

        def told(what: str, done: int, total: int | None) -> None:
            """Open the display, which takes a while to load, when there is something to tell."""
            display[:] = display or [stack.enter_context(in_terminal())]
            display[0](what, done, total)

        yield told
