"""The command check-project: everything that is wrong or doubtful in a project, before it runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

import typer

from tribrach.errors import TribrachError
from tribrach.job.check_project import ProjectCheck
from tribrach.job.check_project import check_project as look_at
from tribrach.report.answer import Answer
from tribrach.shell.command import deliver
from tribrach.shell.flow import guarded


def check_project(
    project: Annotated[Path, typer.Argument(help="The project file (TOML).")],
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print mistakes alone.")] = False,
) -> None:
    """Read a project and all its files, and list every mistake at once; nothing is run."""
    guarded(lambda: deliver(answer_of(look_at(project)), {}, quiet=quiet))


def answer_of(check: ProjectCheck) -> Answer:
    """The mistakes in words; with mistakes the command ends with status 2."""
    terminal = [
        *_listed("Read as follows:", check.readings),
        *_listed("Doubtful:", [f"{sentence}?" for sentence in check.doubts]),
    ]
    failure = None
    if check.good:
        end = "; look at what is doubtful" if check.doubts else ""
        terminal.append(f"{check.path}: {check.contents}; nothing would stop a run{end}.")
    else:
        count = f"{len(check.mistakes)} mistake{'s' * (len(check.mistakes) > 1)}"
        lines = [f"{check.path}: {count}:", *(f"  - {error}" for error in check.mistakes)]
        failure = TribrachError("\n".join(lines))
    title = check.path.name
    return Answer("Check of a project", title, None, check, terminal=terminal, failure=failure)


def _listed(title: str, sentences: Sequence[str]) -> Iterator[str]:
    """One text with a line for each sentence, if there are any."""
    if sentences:
        yield "\n".join([title, *(f"  - {text}" for text in sentences)])
