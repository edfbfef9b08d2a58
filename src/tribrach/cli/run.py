"""The command run: a project from its files to its results."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tribrach import pipeline
from tribrach.cli.network import finish
from tribrach.cli.shell import Overwrite, Scheduler, Workers, guarded, shown, working
from tribrach.project import Project

__all__ = ["run"]


def run(
    project: Annotated[Path, typer.Argument(help="The project file (TOML).")],
    out: Annotated[Path | None, typer.Option(help="Folder of the results.")] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    overwrite: Overwrite = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing.")] = False,
) -> None:
    """Run a project: adjust, check, report."""

    def work() -> None:
        with shown(quiet) as progress, working(workers, scheduler) as engine:
            job = Project.load(project)
            folder = job.results if out is None else out
            content = pipeline.run(job, folder, progress, overwrite=overwrite, engine=engine)
        finish(content, quiet, folder)

    guarded(work)
