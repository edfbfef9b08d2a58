"""The command plan: precision and reliability of a network before it is measured."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tribrach._types import Progress
from tribrach.job.opened import open_job
from tribrach.job.steps import find_and_name
from tribrach.project import Project
from tribrach.questions.plan.chapters import answer_of
from tribrach.questions.plan.design import plan_project
from tribrach.questions.plan.survey import plan_of
from tribrach.report.answer import Answer
from tribrach.shell.command import RESULTS, command


@command(html="Write a page with a map for the crew.", text="Write it as text.")
def plan(
    project: Annotated[
        Path, typer.Argument(help="The project file (TOML) with a section plan."), RESULTS
    ],
    *,
    progress: Progress,
) -> Answer:
    """Predict precision and reliability, and propose targets, stations and sets."""
    given = Project.load(project)
    plan_of(given)
    job = open_job(given, progress)
    work = find_and_name(job, given.results, progress) if given.scans else None
    further = None if work is None or work.named is None else work.named.survey
    return answer_of(plan_project(job, further, progress), given)
