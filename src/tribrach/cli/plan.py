"""The command plan: precision and reliability of a network before it is measured."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tribrach.io.outputs import write_texts
from tribrach.job.opened import open_job
from tribrach.job.plan.steps import plan_project
from tribrach.job.plan.survey import plan_of
from tribrach.job.steps import find_and_name
from tribrach.project import Project
from tribrach.report.planning.page import plan_page, plan_text
from tribrach.report.planning.report import plan_document, plan_report
from tribrach.report.schema.base import document_text
from tribrach.shell.flow import Overwrite, Quiet, claim, guarded, say, shown

__all__ = ["plan"]


def plan(
    project: Annotated[Path, typer.Argument(help="The project file (TOML) with a section plan.")],
    json_file: Annotated[Path | None, typer.Option("--json", help="Write it as JSON.")] = None,
    html_file: Annotated[
        Path | None, typer.Option("--html", help="Write a page with a map for the crew.")
    ] = None,
    text_file: Annotated[Path | None, typer.Option("--text", help="Write it as text.")] = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Predict precision and reliability, and propose targets, stations and sets."""

    def work() -> None:
        given = Project.load(project)
        outputs = {"--json": json_file, "--html": html_file, "--text": text_file}
        claim([project], outputs, given.results, overwrite=overwrite)
        plan_of(given)
        with shown(quiet) as progress:
            job = open_job(given, progress)
            findings = find_and_name(job, given.results, progress) if given.scans else None
            named = None if findings is None else findings.named
            result = plan_project(job, None if named is None else named.survey, progress)
            page = plan_report(result)
        texts = {}
        if json_file is not None:
            texts[json_file] = document_text(plan_document(result, page))
        if html_file is not None:
            texts[html_file] = plan_page(page)
        if text_file is not None:
            texts[text_file] = plan_text(page)
        write_texts(texts)
        if not quiet:
            say(plan_text(page, brief=True))

    guarded(work)
