"""The command calibrate: self-calibration of scanners."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from tribrach._types import Progress
from tribrach.calibration.run_comparison import compare_runs
from tribrach.io.calibration_file import calibration_text
from tribrach.job.opened import open_job
from tribrach.project import Project
from tribrach.questions.calibrate.chapters import answer_of
from tribrach.questions.calibrate.project import calibrate_project, calibration_of, calibrations_of
from tribrach.report.answer import Answer
from tribrach.shell.command import WRITTEN, command


@command(html="Write a page with charts.")
def calibrate(
    project: Annotated[Path, typer.Argument(help="The project file, with a section calibration.")],
    out: Annotated[
        Path | None,
        typer.Option(
            help="Write a calibration file that projects can name; of several scanners one each, "
            "with their names before the suffix."
        ),
        WRITTEN,
    ] = None,
    against: Annotated[
        Path | None, typer.Option(help="Another project file, to compare this run with.")
    ] = None,
    estimable: Annotated[
        bool, typer.Option("--estimable", help="Leave out what cannot be separated.")
    ] = False,
    *,
    progress: Progress,
) -> Answer:
    """Calibrate scanners from targets that they saw from several stations."""
    given = Project.load(project)
    calibration_of(given)
    job = open_job(given, progress)
    result = calibrate_project(job, progress, reduce=estimable)
    words: list[str] = []
    if against is not None:
        other = Project.load(against)
        first = calibrate_project(open_job(other, progress), progress, reduce=estimable)
        said = compare_runs(first, result).sentences()
        words = [f"against {other.title}: {sentence}" for sentence in said]
    answer = answer_of(given.title, result, words)
    if out is None:
        return answer
    several = calibrations_of(job, result)
    files = {_file_of(out, n, len(several)): calibration_text(one) for n, one in several.items()}
    return replace(answer, files=files)


def _file_of(save: Path, instrument: str, count: int) -> Path:
    """The file of one of so many instruments."""
    if count == 1:
        return save
    plain = re.sub(r"[^\w.-]", "_", instrument).strip(".")
    return save.with_name(f"{save.stem}-{plain}{save.suffix}")
