"""The commands info and convert on scans."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from tribrach.errors import TribrachError
from tribrach.io.outputs import write_text
from tribrach.io.scans.formats import read_scans
from tribrach.io.scans.info import Description, describe
from tribrach.io.scans.reading import as_told
from tribrach.io.survey.riscan.info import ProjectDescription, describe_project
from tribrach.job.convert import convert_scans
from tribrach.report.characters import visible
from tribrach.report.schema.base import document_text, heading
from tribrach.report.schema.scans import SCHEMA, ScansDocument
from tribrach.shell.flow import Overwrite, Quiet, claim, guarded, say, shown
from tribrach.shell.reading import Columns, DecimalMark, Unit

__all__ = ["convert", "info"]


def info(
    files: Annotated[list[Path], typer.Argument(help="Scans, or projects of RiSCAN PRO (.rsp).")],
    json_file: Annotated[Path | None, typer.Option("--json", help="Write it as JSON.")] = None,
    unit: Unit = None,
    columns: Columns = None,
    decimal: DecimalMark = None,
    overwrite: Overwrite = False,
) -> None:
    """Say what is in files of scans: points, extents, fields, grid, poses, what looks wrong.

    A file that cannot be read is named at the end, after what the others hold.
    """

    def work() -> None:
        claim(files, {"--json": json_file}, overwrite=overwrite)
        described: list[Description] = []
        projects: list[ProjectDescription] = []
        refused: list[TribrachError] = []
        for path in files:
            try:
                if path.suffix.lower() == ".rsp":
                    projects.append(describe_project(path))
                    continue
                with as_told(unit, columns, decimal):
                    scans = read_scans(path)
                described += [describe(scan, among=len(scans)) for scan in scans]
            except TribrachError as error:
                refused.append(error)
        if json_file is not None:
            data = heading(SCHEMA) | {
                "scans": [d.to_json() for d in described],
                "projects": [p.to_json() for p in projects],
            }
            write_text(json_file, document_text(ScansDocument.model_validate(data)))
        console = Console()
        everything: list[Description | ProjectDescription] = [*projects, *described]
        for description in everything:
            table = Table(
                title=escape(visible(description.title)), title_justify="left", show_header=False
            )
            for name, value in description.rows():
                table.add_row(escape(name), escape(visible(value)))
            console.print(table)
            for sentence in description.sentences():
                console.print(visible(f"! {sentence}"), markup=False)
        if refused:
            # the others were told of; the first error ends the command, and says the further ones
            first, *further = refused
            for other in further:
                first.add_note(str(other))
            raise first

    guarded(work)


def convert(
    source: Annotated[Path, typer.Argument(help="A file of scans.")],
    destination: Annotated[
        Path, typer.Argument(help="File to write: .las, .laz, .copc.laz, .ply or .e57.")
    ],
    placed: Annotated[bool, typer.Option(help="Apply the poses that the source has.")] = False,
    step_mm: Annotated[
        float | None,
        typer.Option(
            min=1e-3, max=10, help="Coordinate step of LAS, LAZ and E57; that of the source."
        ),
    ] = None,
    unit: Unit = None,
    columns: Columns = None,
    decimal: DecimalMark = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Write scans in another format, every field kept."""

    def work() -> None:
        claim([source], {"": destination}, overwrite=overwrite)
        with shown(quiet) as progress, as_told(unit, columns, decimal):
            written = convert_scans(
                read_scans(source),
                destination,
                placed=placed,
                step=None if step_mm is None else step_mm / 1e3,
                progress=progress,
            )
        if not quiet:
            for path, points, cost in written:
                say(f"{path}: {points} points" + (f"; {cost}" if cost else ""))

    guarded(work)
