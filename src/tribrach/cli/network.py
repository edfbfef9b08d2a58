"""The command adjust: files of networks, or a project without scans.

What only projects, pages and JSON need is loaded for them, since loading all of it takes several
times as long as adjusting a network of some points.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tribrach.io.outputs import Content, write_texts
from tribrach.io.survey.formats import read_files
from tribrach.network.observed_part import observed_part
from tribrach.report import text
from tribrach.report.content import Report
from tribrach.shell.flow import Overwrite, Quiet, claim, fail, guarded, say, shown
from tribrach.shell.settings import (
    Angle,
    Confidence,
    DatumWords,
    Posterior,
    Robust,
    Snoop,
    Vce,
    given,
)
from tribrach.solution import AdjustmentSettings, adjust_network

if TYPE_CHECKING:
    from tribrach.network.network import Datum
    from tribrach.project import Project

__all__ = ["adjust", "finish", "project_of"]


def adjust(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="Raw files of total stations, tables, vectors, networks of GNU Gama, STAR*NET, "
            "DynAdjust, Comp3D or RiSCAN PRO; or a project."
        ),
    ],
    datum: DatumWords = None,
    snoop: Snoop = None,
    robust: Robust = None,
    vce: Vce = None,
    confidence: Confidence = None,
    posterior: Posterior = None,
    angle: Angle = None,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write the result as JSON.")
    ] = None,
    html_file: Annotated[Path | None, typer.Option("--html", help="Write the HTML report.")] = None,
    text_file: Annotated[Path | None, typer.Option("--text", help="Write the text report.")] = None,
    epoch_file: Annotated[
        Path | None,
        typer.Option("--epoch", help="Write an epoch: coordinates, joint covariance."),
    ] = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Adjust a network from files of any known format, or a project without scans.

    What a project says is done; an option that is given takes its place.
    """
    options = given(
        snoop=snoop,
        robust=robust,
        vce=vce,
        posterior=posterior,
        confidence=confidence,
        angle=angle,
    )

    def work() -> None:
        claim(
            files,
            {"--json": json_file, "--html": html_file, "--text": text_file, "--epoch": epoch_file},
            overwrite=overwrite,
        )
        other = None if datum is None else _datum(datum)
        project = project_of(files)
        if project is not None:
            content = _of_project(project, options, other, quiet)
        else:
            network = observed_part(read_files(files)).network()
            network = network if other is None else network.with_datum(other)
            content = adjust_network(network, AdjustmentSettings(**options))
        outputs: list[tuple[Path | None, Callable[[Report], Content]]] = [
            (json_file, _json),
            (html_file, _html),
            (text_file, text.render),
            (epoch_file, partial(_epoch, label=files[0].stem)),
        ]
        write_texts({path: render(content) for path, render in outputs if path is not None})
        finish(content, quiet)

    guarded(work)


def _datum(words: str) -> Datum:
    """The datum that an option names."""
    from tribrach.project import parse_datum

    return parse_datum(words)


def _of_project(
    project: Project, options: dict[str, Any], datum: Datum | None, quiet: bool
) -> Report:
    """The report of a project without scans."""
    from tribrach.job.opened import open_job
    from tribrach.pipeline import adjust_job

    with shown(quiet) as progress:
        job = open_job(project, progress)
    return adjust_job(job, replace(AdjustmentSettings.of(project), **options), datum)


def _json(content: Report) -> Content:
    """The result for other programs; its models are built for it alone."""
    from tribrach.report.json_result import pieces

    return pieces(content)


def _epoch(content: Report, label: str) -> Content:
    """The epoch file, for later epochs."""
    from tribrach.epochs_from_files import epoch_text

    return epoch_text(content.adjustment, label)


def _html(content: Report) -> Content:
    """The page, whose templates are loaded for it alone."""
    from tribrach.report.html import render

    return render(content)


def project_of(files: list[Path]) -> Project | None:
    """The project if its file is given and nothing else."""
    if len(files) != 1 or files[0].suffix.lower() != ".toml":
        return None
    from tribrach.pipeline import refuse_scans
    from tribrach.project import Project

    project = Project.load(files[0])
    refuse_scans(project)
    return project


def finish(content: Report, quiet: bool, folder: Path | None = None) -> None:
    """Print the summary; without redundancy say so and end with 2."""
    if not quiet:
        say(text.brief(content))
        if folder is not None:
            say(f"report: {folder / 'report.html'}")
            if any(table.name == "clouds" for table in content.tables(1)):
                say(f"clouds: {folder / 'clouds'}")
    if content.summary.dof <= 0:
        fail("no redundancy: nothing is checked; observe more before these figures are used")
