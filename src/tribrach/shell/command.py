"""A command of a question: its inputs are claimed, its answer is made, written and shown."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, get_type_hints

import typer
from rich.console import Console
from typer.models import ArgumentInfo, ParameterInfo

from tribrach.io.outputs import Content, write_texts
from tribrach.io.scans.reading import as_told
from tribrach.report.answer import Answer
from tribrach.report.characters import visible
from tribrach.report.findings import Finding
from tribrach.report.tables import ReportTable
from tribrach.shell.flow import (
    Overwrite,
    Quiet,
    Scheduler,
    Workers,
    claim,
    guarded,
    say,
    shown,
    working,
)
from tribrach.shell.printing import printed
from tribrach.shell.reading import READING

__all__ = ["FOLDER", "WRITTEN", "command", "deliver"]

#: marks the parameter of a command that names a file which the command writes
WRITTEN = "written"
#: marks the one that names the folder of results
FOLDER = "folder"
#: terminals with as many columns show all columns of the tables
_WIDE = 118


def command(
    *,
    json: str | None = "Write it as JSON.",
    html: str | None = "Write a page.",
    scans: bool = False,
) -> Callable[[Callable[..., Answer]], Callable[..., None]]:
    """Make a command of the function that answers a question.

    Its paths are claimed as inputs but for those marked with :data:`WRITTEN`, whose contents the
    answer brings in ``files``. Of a parameter with a function among its marks the function says
    which files are meant. A parameter ``progress`` is told what is being done; ``engine`` is
    who does it, which brings the options ``--workers`` and ``--scheduler``. A command that reads
    ``scans`` has the options that say how they are read.
    """

    def decorated(work: Callable[..., Answer]) -> Callable[..., None]:
        own = dict(inspect.signature(work).parameters)
        hints = get_type_hints(work, include_extras=True)
        by_itself = {
            n for n in _GIVEN if n in own and own[n].kind is inspect.Parameter.KEYWORD_ONLY
        }
        progress, engine = "progress" in by_itself, "engine" in by_itself
        options = {n: (hints[n], p.default) for n, p in own.items() if n not in by_itself}
        marks = {n: _marked(hint) for n, (hint, _) in options.items() if _path(hint)}
        read, written, folder = ([n for n in marks if marks[n] == m] for m in ("", WRITTEN, FOLDER))
        meant = {
            name: mark
            for name, (hint, _) in options.items()
            for mark in getattr(hint, "__metadata__", ())
            if inspect.isfunction(mark)
        }
        if json is not None:
            options["json_file"] = (_file("--json", json), None)
        if html is not None:
            options["html_file"] = (_file("--html", html), None)
        if engine:
            options |= {"workers": (Workers, None), "scheduler": (Scheduler, None)}
        if scans:
            options |= {name: (hint, None) for name, hint in READING.items()}
        options |= {"overwrite": (Overwrite, False), "quiet": (Quiet, False)}

        @wraps(work)
        def run(**given: Any) -> None:
            guarded(lambda: _answer(given))

        def _answer(given: dict[str, Any]) -> None:
            quiet, overwrite = given.pop("quiet"), given.pop("overwrite")
            outputs = {render: given.pop(name, None) for name, render in _RENDERED.items()}
            told = {name: given.pop(name) for name in READING} if scans else {}
            crew = (given.pop("workers"), given.pop("scheduler")) if engine else None
            given |= {name: meaning(given[name]) for name, meaning in meant.items()}
            inputs = _paths(given[name] for name in dict.fromkeys((*read, *meant)))
            files = {_option(name, options[name][0]): _paths([given[name]]) for name in written}
            files |= {_OPTIONS[render]: _paths([path]) for render, path in outputs.items()}
            place = given[folder[0]] if folder else None
            claim(inputs, files, place, overwrite=overwrite)
            with ExitStack() as stack:
                stack.enter_context(as_told(**told))
                if progress:
                    given["progress"] = stack.enter_context(shown(quiet))
                if crew is not None:
                    given["engine"] = stack.enter_context(working(*crew))
                answer = work(**given)
            claimed = {path for several in files.values() for path in several}
            if further := [path for path in answer.files if path not in claimed]:
                claim(inputs, files | {"(beside a result)": further}, overwrite=overwrite)
            deliver(answer, outputs, quiet=quiet)

        kind = inspect.Parameter.KEYWORD_ONLY
        run.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
            [
                inspect.Parameter(name, kind, annotation=hint, default=default)
                for name, (hint, default) in options.items()
            ]
        )
        run.__annotations__ = {name: hint for name, (hint, _) in options.items()}
        return run

    return decorated


#: parameters, behind a star, that a command gives itself
_GIVEN = ("progress", "engine")
#: options that render the answer
_RENDERED: dict[str, Callable[[Answer], Content]] = {
    "json_file": Answer.json,
    "html_file": Answer.page,
}
_OPTIONS: dict[Callable[[Answer], Content], str] = {Answer.json: "--json", Answer.page: "--html"}


def deliver(
    answer: Answer,
    outputs: Mapping[Callable[[Answer], Content], Path | None],
    *,
    quiet: bool = False,
) -> None:
    """Write an answer in the forms that were asked for, all together, and show it."""
    if not answer.refuses:
        texts = {path: render(answer) for render, path in outputs.items() if path is not None}
        written = write_texts(texts | dict(answer.files))
        if answer.written is not None:
            paths = [Finding(str(path)) for path in (*answer.written, *written)]
            answer = replace(answer, terminal=[*answer.terminal, *paths])
    if not quiet:
        _show(answer)
    if answer.failure is not None:
        raise answer.failure


def _show(answer: Answer) -> None:
    """Print what a terminal shows."""
    console = Console()
    for part in answer.terminal:
        if isinstance(part, ReportTable):
            fitting = part if console.width >= _WIDE else part.narrow()
            console.print(printed(fitting, console.width))
        elif isinstance(part, Finding):
            console.print(visible(part.line()), markup=False)
        else:
            say(part)


def _option(name: str, hint: Any) -> str:
    """The option of a parameter, "" of an argument."""
    about = [mark for mark in hint.__metadata__ if isinstance(mark, ParameterInfo)]
    if any(isinstance(mark, ArgumentInfo) for mark in about):
        return ""
    names = [name for mark in about for name in mark.param_decls or ()]
    return next(iter(names), "--" + name.replace("_", "-"))


def _file(name: str, help: str) -> Any:
    return Annotated[Path | None, typer.Option(name, help=help)]


def _path(hint: Any) -> bool:
    """Does a parameter take files?"""
    return "pathlib.Path" in str(getattr(hint, "__origin__", hint))


def _marked(hint: Any) -> str:
    """How the parameter is marked, "" if it names what is read."""
    found = getattr(hint, "__metadata__", ())
    return next((mark for mark in (WRITTEN, FOLDER) if mark in found), "")


def _paths(values: Any) -> list[Path]:
    """All paths among the values of parameters."""
    out: list[Path] = []
    for value in values:
        if isinstance(value, Path):
            out.append(value)
        elif value is not None:
            out += _paths(value)
    return out
