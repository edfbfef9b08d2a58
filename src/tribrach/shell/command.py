"""A command of a question: its inputs are claimed, its answer is made, written and shown."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import fields, is_dataclass, replace
from functools import wraps
from operator import methodcaller
from pathlib import Path
from typing import Annotated, Any, Literal, get_type_hints

import typer
from typer.models import ArgumentInfo, ParameterInfo

from tribrach.errors import untold_doubts
from tribrach.io.opened_files import opened_once
from tribrach.io.outputs import Content, write_texts
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

Unit = Annotated[
    str | None, typer.Option(help="What coordinates are counted in: m, mm, cm, ft, usft ...")
]
Columns = Annotated[
    str | None,
    typer.Option(help='Columns of scans in text: "number y x z - code", - for one to leave out.'),
]
DecimalMark = Annotated[
    Literal["point", "comma"] | None, typer.Option(help="What stands before decimals in text.")
]
#: by the names of :func:`tribrach.io.scans.reading.as_told`
READING: dict[str, Any] = {"unit": Unit, "columns": Columns, "decimal": DecimalMark}


#: marks the parameter of a command that names a file which the command writes
WRITTEN = "written"
#: marks the one that names the folder of results
FOLDER = "folder"
#: marks the one that names a project in whose folder of results something is kept
RESULTS = "results"
#: what is larger is no project file [bytes]
_PROJECT = 1_000_000
#: terminals with as many columns show all columns of the tables
_WIDE = 118


def command(
    *,
    json: str | None = "Write it as JSON.",
    html: str | None = "Write a page.",
    scans: bool = False,
    text: str | None = None,
    quiet: bool = True,
) -> Callable[[Callable[..., Answer]], Callable[..., None]]:
    """Make a command of the function that answers a question.

    Its paths are claimed as inputs but for those marked with :data:`WRITTEN`, whose contents the
    answer brings in ``files``. Of a parameter with a function among its marks the function says
    which files are meant. The fields of a parameter that is a dataclass are options. A parameter
    ``progress`` is told what is being done; ``engine`` is who does it, which brings the options
    ``--workers`` and ``--scheduler``; ``overwrite`` is for work that writes files itself. A command
    that reads ``scans`` has the options that say how they are read.
    """

    def decorated(work: Callable[..., Answer]) -> Callable[..., None]:
        own = dict(inspect.signature(work).parameters)
        hints = get_type_hints(work, include_extras=True)
        by_itself = {
            n for n in _GIVEN if n in own and own[n].kind is inspect.Parameter.KEYWORD_ONLY
        }
        progress, engine = "progress" in by_itself, "engine" in by_itself
        bundles = {n: hints[n] for n in own if is_dataclass(hints[n]) and n not in by_itself}
        options: dict[str, Any] = {}
        for n, p in own.items():
            if n not in by_itself:
                options |= _options_of(hints[n]) if n in bundles else {n: (hints[n], p.default)}
        marks = {n: _marked(hint) for n, (hint, _) in options.items() if _path(hint)}
        read, written, folder, project = (
            [name for name in marks if marks[name] == mark]
            for mark in ("", WRITTEN, FOLDER, RESULTS)
        )
        meant = {
            name: mark
            for name, (hint, _) in options.items()
            for mark in getattr(hint, "__metadata__", ())
            if inspect.isfunction(mark)
        }
        for form, help in (("json", json), ("html", html), ("text", text)):
            if help is not None:
                options[f"{form}_file"] = (_file(f"--{form}", help), None)
        if engine:
            options |= {"workers": (Workers, None), "scheduler": (Scheduler, None)}
        if scans:
            options |= {name: (hint, None) for name, hint in READING.items()}
        options |= {"overwrite": (Overwrite, False)}
        if quiet:
            options |= {"quiet": (Quiet, False)}

        @wraps(work)
        def run(**given: Any) -> None:
            guarded(lambda: _answer(given))

        def _answer(given: dict[str, Any]) -> None:
            silent, overwrite = given.pop("quiet", False), given.pop("overwrite")
            outputs = {form: given.pop(f"{form}_file", None) for form in _FORMS}
            told = {name: given.pop(name) for name in READING} if scans else {}
            crew = (given.pop("workers"), given.pop("scheduler")) if engine else None
            given |= {name: meaning(given[name]) for name, meaning in meant.items()}
            inputs = _paths(given[name] for name in dict.fromkeys((*read, *project, *meant)))
            files = {_option(name, options[name][0]): _paths([given[name]]) for name in written}
            files |= {f"--{form}": _paths([path]) for form, path in outputs.items()}
            place = given[folder[0]] if folder else _results(*(given[name] for name in project))
            for name, bundle in bundles.items():
                given[name] = bundle(**{f.name: given.pop(f.name) for f in fields(bundle)})
            given |= {"overwrite": overwrite} if "overwrite" in by_itself else {}
            with ExitStack() as stack:
                # who claims the files of a project reads it, as the work does
                stack.enter_context(opened_once({}, _PROJECT))
                claim(inputs, files, place, overwrite=overwrite)
                if told:
                    # the readers of scans take their time, which other commands should not spend
                    from tribrach.io.scans.reading import as_told

                    stack.enter_context(as_told(**told))
                if progress:
                    given["progress"] = stack.enter_context(shown(silent))
                if crew is not None:
                    given["engine"] = stack.enter_context(working(*crew))
                answer = work(**given)
            lines = [part for part in answer.terminal if not isinstance(part, ReportTable)]
            texts = [part if isinstance(part, str) else part.line() for part in lines]
            doubts = [f"! {text}" for text in untold_doubts("\n".join(texts))]
            answer = replace(answer, terminal=[*doubts, *answer.terminal])
            claimed = {path for several in files.values() for path in several}
            if further := [path for path in answer.files if path not in claimed]:
                claim(inputs, files | {"(beside a result)": further}, overwrite=overwrite)
            deliver(answer, outputs, quiet=silent)

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
_GIVEN = ("progress", "engine", "overwrite")
#: options that render the answer
_FORMS: dict[str, Callable[[Answer], Content]] = {
    "json": methodcaller("json"),
    "html": methodcaller("page"),
    "text": methodcaller("text"),
}


def deliver(
    answer: Answer,
    outputs: Mapping[str, Path | None],
    *,
    quiet: bool = False,
) -> None:
    """Write an answer in the forms that were asked for, all together, and show it."""
    if not answer.refuses:
        texts = {path: _FORMS[form](answer) for form, path in outputs.items() if path is not None}
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
    for part in answer.terminal:
        if isinstance(part, str):
            say(part)
            continue
        # loaded for tables and findings alone
        from rich.console import Console

        from tribrach.shell.printing import printed

        console = Console()
        if isinstance(part, ReportTable):
            fitting = part if console.width >= _WIDE else part.narrow()
            console.print(printed(fitting, console.width))
        else:
            console.print(visible(part.line()), markup=False)


def _option(name: str, hint: Any) -> str:
    """The option of a parameter, "" of an argument."""
    about = [mark for mark in hint.__metadata__ if isinstance(mark, ParameterInfo)]
    if any(isinstance(mark, ArgumentInfo) for mark in about):
        return ""
    names = [name for mark in about for name in mark.param_decls or ()]
    return next(iter(names), "--" + name.replace("_", "-"))


def _options_of(bundle: Any) -> dict[str, Any]:
    """Options that are the fields of a dataclass, with their defaults."""
    hints = get_type_hints(bundle, include_extras=True)
    return {f.name: (hints[f.name], f.default) for f in fields(bundle)}


def _file(name: str, help: str) -> Any:
    return Annotated[Path | None, typer.Option(name, help=help)]


def _results(project: Path | None = None) -> Path | None:
    """The folder of results of a project."""
    if project is None:
        return None
    # the model of project files takes its time, which other commands should not spend
    from tribrach.project import Project

    return Project.load(project).results


def _path(hint: Any) -> bool:
    """Does a parameter take files?"""
    return "pathlib.Path" in str(getattr(hint, "__origin__", hint))


def _marked(hint: Any) -> str:
    """How the parameter is marked, "" if it names what is read."""
    found = getattr(hint, "__metadata__", ())
    return next((mark for mark in (WRITTEN, FOLDER, RESULTS) if mark in found), "")


def _paths(values: Any) -> list[Path]:
    """All paths among the values of parameters."""
    out: list[Path] = []
    for value in values:
        if isinstance(value, Path):
            out.append(value)
        elif value is not None:
            out += _paths(value)
    return out
