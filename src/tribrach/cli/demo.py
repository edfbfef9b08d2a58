"""The command demo: a survey to start from, simulated and run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tribrach import demo as demonstration
from tribrach import pipeline
from tribrach.project import Project
from tribrach.report.network_answer import NetworkAnswer
from tribrach.shell.command import deliver
from tribrach.shell.flow import Overwrite, Quiet, guarded, say, shown


def demo(
    out: Annotated[Path, typer.Option(help="Folder to write the project into.")] = Path("demo"),
    points: Annotated[
        int, typer.Option(min=10_000, max=200_000_000, help="Points per station, about.")
    ] = demonstration.POINTS,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Simulate a survey of two facades, run it, and compare everything with the truth."""

    def work() -> None:
        if not quiet:
            say(f"simulating scans of two facades in {out}, then running the project")
        with shown(quiet) as progress:
            job = Project.load(
                demonstration.write_project(out, points, progress, overwrite=overwrite)
            )
            content = pipeline.run(job, progress=progress, overwrite=overwrite)
        deliver(NetworkAnswer.of(content, folder=job.results), {}, quiet=quiet)

    guarded(work)
