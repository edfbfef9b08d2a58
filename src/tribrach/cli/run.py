"""The command run: a project from its files to its results."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tribrach import pipeline
from tribrach._types import Progress
from tribrach.errors import InputError
from tribrach.project import Project
from tribrach.report.answer import Answer
from tribrach.report.network_answer import NetworkAnswer
from tribrach.shell.command import FOLDER, command
from tribrach.shell.settings import Adjusting
from tribrach.tasks.engine import Engine


def _project_file(path: Path) -> Path:
    """Point to ``init`` where a folder, a scan or a list is given instead of a project."""
    if path.is_dir():
        projects = sorted(one.name for one in path.glob("*.toml"))
        cure = f"tribrach init {path} writes a project file for what lies there"
        if projects:
            cure = f"name its project file, such as {path / projects[0]}"
        raise InputError("this is a folder, and run takes a project file", file=path, cure=cure)
    if path.is_file() and path.suffix.lower() != ".toml":
        folder = path.parent
        raise InputError(
            "this is no project file (TOML)",
            file=path,
            cure=f"tribrach init {folder} writes one for the folder of this file",
        )
    return path


@command(json=None, html=None)
def run(
    project: Annotated[Path, typer.Argument(help="The project file (TOML)."), _project_file],
    *,
    out: Annotated[Path | None, typer.Option(help="Folder of the results."), FOLDER] = None,
    adjusting: Adjusting,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Check the project as check-project does.")
    ] = False,
    engine: Engine,
    progress: Progress,
    overwrite: bool,
) -> Answer:
    """Run a project: adjust, check, report.

    What the project says is done; an option that is given takes its place.
    """
    if dry_run:
        from tribrach.cli.check_project import answer_of
        from tribrach.job.check_project import check_project

        return answer_of(check_project(project))
    job = adjusting.of_project(Project.load(project))
    folder = job.results if out is None else out
    content = pipeline.run(job, folder, progress, overwrite=overwrite, engine=engine)
    return NetworkAnswer.of(content, folder=folder)
