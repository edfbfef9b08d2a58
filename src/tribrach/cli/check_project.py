"""The command check-project: everything that is wrong or doubtful in a project, before it runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tribrach.job.check_project import ProjectCheck
from tribrach.job.check_project import check_project as look_at
from tribrach.shell.flow import fail, guarded, say

__all__ = ["check_project", "tell"]


def check_project(
    project: Annotated[Path, typer.Argument(help="The project file (TOML).")],
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print mistakes alone.")] = False,
) -> None:
    """Read a project and all its files, and list every mistake at once; nothing is run."""

    def work() -> None:
        tell(look_at(project), quiet)

    guarded(work)


def tell(check: ProjectCheck, quiet: bool) -> None:
    """Print what was found; mistakes end the command with 2."""
    if not quiet:
        _list("Read as follows:", check.readings)
        _list("Doubtful:", [f"{sentence}?" for sentence in check.doubts])
        if check.good:
            end = "; look at what is doubtful" if check.doubts else ""
            say(f"{check.path}: {check.contents}; nothing would stop a run{end}.")
    if not check.good:
        count = f"{len(check.mistakes)} mistake{'s' * (len(check.mistakes) > 1)}"
        fail("\n".join([f"{check.path}: {count}:", *(f"  - {error}" for error in check.mistakes)]))


def _list(title: str, sentences: tuple[str, ...] | list[str]) -> None:
    if sentences:
        say("\n".join([title, *(f"  - {text}" for text in sentences)]))
