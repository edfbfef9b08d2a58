"""The commands transform fit and transform apply: from one system to another by common points."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console

from tribrach.cli.help_words import SpokenCommand, SpokenGroup
from tribrach.errors import InputError
from tribrach.io.outputs import write_text, write_texts
from tribrach.io.scans.formats import read_scans
from tribrach.io.transformation_file import read_transformation, transformation_data
from tribrach.job.transform import fit_files, move_cloud, move_points
from tribrach.report.characters import visible
from tribrach.report.schema.base import document_text
from tribrach.report.schema.transformation import TransformationDocument
from tribrach.report.transformation import transformation_results, transformation_tables
from tribrach.shell.flow import Overwrite, Quiet, claim, guarded, say, shown
from tribrach.shell.printing import printed
from tribrach.transformation.carrying import Carrier

__all__ = ["apply", "fit", "transform"]

transform = typer.Typer(
    cls=SpokenGroup,
    add_completion=False,
    no_args_is_help=True,
    help="Fit a transformation to common points, and apply it.",
)


@transform.command(cls=SpokenCommand)
def fit(
    a: Annotated[Path, typer.Argument(metavar="A", help="Points as CSV: point,x_m,y_m,z_m.")],
    b: Annotated[Path, typer.Argument(metavar="B", help="The same points in the other system.")],
    model: Annotated[
        int | None,
        typer.Option(
            help="Number of parameters: 3, 4, 6, 7, 9, 12, without heights 3, 4, 6; 7 or 4 if not "
            "given."
        ),
    ] = None,
    check: Annotated[
        list[str] | None, typer.Option(help="A point held out as check point; repeat it.")
    ] = None,
    snoop: Annotated[bool, typer.Option(help="Switch off points that do not fit.")] = False,
    angle: Annotated[Literal["gon", "deg"], typer.Option(help="Unit of angles.")] = "gon",
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write it as JSON, for transform apply.")
    ] = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Fit the transformation from A to B with the weights of both, and test it."""

    def work() -> None:
        claim((a, b), [json_file], overwrite=overwrite)
        result = fit_files(a, b, model, check or [], snoop=snoop)
        outcome = result.outcome
        left = [
            f"only in {path.name}: {', '.join(names[:8])}"
            + (f" and {len(names) - 8} more" if len(names) > 8 else "")
            for path, names in zip((a, b), result.alone, strict=True)
            if names
        ]
        if json_file is not None:
            data = transformation_data(outcome.fit) | transformation_results(outcome)
            data |= {"from": a.name, "to": b.name}
            write_text(json_file, document_text(TransformationDocument.model_validate(data)))
        if quiet:
            return
        console = Console()
        for table in transformation_tables(outcome, angle):
            console.print(printed(table, console.width))
            if table.left_out:
                console.print(f"{table.left_out} more rows in the JSON file", style="dim")
            console.print(visible(table.note), markup=False, style="dim")
        for sentence in [*outcome.sentences(), *left]:
            console.print(visible(f"! {sentence[:1].upper()}{sentence[1:]}"), markup=False)

    guarded(work)


@transform.command(cls=SpokenCommand)
def apply(
    transformation: Annotated[Path, typer.Argument(help="The JSON file of transform fit.")],
    source: Annotated[Path, typer.Argument(help="Points as CSV, or a cloud.")],
    destination: Annotated[Path, typer.Argument(help="File to write: .csv, or that of a cloud.")],
    inverse: Annotated[bool, typer.Option(help="From B to A.")] = False,
    step_mm: Annotated[
        float, typer.Option(min=1e-3, max=10, help="Coordinate step of LAS and LAZ.")
    ] = 0.1,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Carry points or a cloud through a transformation, with their covariances."""

    def work() -> None:
        claim([transformation, source], [destination], overwrite=overwrite)
        stored = read_transformation(transformation)
        carrier = Carrier(stored.transformation, stored.covariance, inverse)
        if source.suffix.lower() == ".csv":
            if destination.suffix.lower() != ".csv":
                raise InputError(
                    "a table of points becomes a table", file=destination, cure="name it .csv"
                )
            text, sentences = move_points(source, carrier)
            write_texts({destination: text})
        else:
            with shown(quiet) as progress:
                moved = move_cloud(
                    read_scans(source), destination, carrier, step_mm / 1e3, progress
                )
            sentences = [f"{moved.points} points", *moved.sentences]
        if not quiet:
            say(f"{destination}: {'; '.join(sentences) or 'written'}")

    guarded(work)
