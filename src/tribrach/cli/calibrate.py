"""The command calibrate: self-calibration of scanners."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from tribrach.calibration.run_comparison import compare_runs
from tribrach.io.calibration_file import calibration_text
from tribrach.io.outputs import write_texts
from tribrach.job.calibrate import calibrate_project, calibration_of, calibrations_of
from tribrach.job.opened import open_job
from tribrach.project import Project
from tribrach.report.calibration import calibration_document, calibration_page
from tribrach.report.calibration import calibration_text as summary
from tribrach.report.schema.base import document_text
from tribrach.shell.flow import Overwrite, Quiet, claim, fail, guarded, say, shown

__all__ = ["calibrate"]


def calibrate(
    project: Annotated[Path, typer.Argument(help="The project file, with a section calibration.")],
    json_file: Annotated[Path | None, typer.Option("--json", help="Write it as JSON.")] = None,
    html_file: Annotated[
        Path | None, typer.Option("--html", help="Write a page with charts.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Write a calibration file that projects can name; of several scanners one each, "
            "with their names before the suffix."
        ),
    ] = None,
    against: Annotated[
        Path | None, typer.Option(help="Another project file, to compare this run with.")
    ] = None,
    estimable: Annotated[
        bool, typer.Option("--estimable", help="Leave out what cannot be separated.")
    ] = False,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Calibrate scanners from targets that they saw from several stations."""

    def work() -> None:
        inputs = [path for path in (project, against) if path is not None]
        claim(inputs, (json_file, html_file, out), overwrite=overwrite)
        given = Project.load(project)
        calibration_of(given)
        with shown(quiet) as progress:
            job = open_job(given, progress)
            result = calibrate_project(job, progress, reduce=estimable)
            words: list[str] = []
            if against is not None:
                other = Project.load(against)
                first = calibrate_project(open_job(other, progress), progress, reduce=estimable)
                words = [
                    f"against {other.title}: {sentence}"
                    for sentence in compare_runs(first, result).sentences()
                ]
        texts: dict[Path, str | bytes] = {}
        if json_file is not None:
            texts[json_file] = document_text(calibration_document(given.title, result))
        if html_file is not None:
            texts[html_file] = calibration_page(given.title, result, words)
        if out is not None:
            several = calibrations_of(job, result)
            files = {name: _file_of(out, name, len(several)) for name in several}
            claim(inputs, (json_file, html_file, *files.values()), overwrite=overwrite)
            texts |= {files[name]: calibration_text(one) for name, one in several.items()}
        write_texts(texts)
        if not quiet:
            say("\n".join([given.title, summary(result), *(f"= {w}" for w in words)]))
        if result.adjustment.dof <= 0:
            fail("no redundancy: nothing is checked; observe more before these figures are used")

    guarded(work)


def _file_of(save: Path, instrument: str, count: int) -> Path:
    """The file of one of so many instruments."""
    if count == 1:
        return save
    plain = re.sub(r"[^\w.-]", "_", instrument).strip(".")
    return save.with_name(f"{save.stem}-{plain}{save.suffix}")
