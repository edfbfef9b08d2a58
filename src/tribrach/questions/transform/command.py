"""The commands transform fit and transform apply: from one system to another by common points."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from tribrach._types import Progress
from tribrach.errors import InputError
from tribrach.io.scans.formats import read_scans
from tribrach.io.transformation_file import read_transformation
from tribrach.questions.transform.carried import move_cloud, move_points
from tribrach.questions.transform.chapters import answer_of
from tribrach.questions.transform.fit import fit_files
from tribrach.report.answer import Answer
from tribrach.shell.command import WRITTEN, command
from tribrach.shell.help_words import SpokenCommand, SpokenGroup
from tribrach.transformation.carrying import Carrier

transform = typer.Typer(
    cls=SpokenGroup,
    add_completion=False,
    no_args_is_help=True,
    help="Fit a transformation to common points, and apply it.",
)


@transform.command(cls=SpokenCommand)
@command(json="Write it as JSON, for transform apply.", html=None)
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
) -> Answer:
    """Fit the transformation from A to B with the weights of both, and test it."""
    return answer_of(fit_files(a, b, model, check or [], snoop=snoop), angle)


@transform.command(cls=SpokenCommand)
@command(json=None, html=None, scans=True)
def apply(
    transformation: Annotated[Path, typer.Argument(help="The JSON file of transform fit.")],
    source: Annotated[Path, typer.Argument(help="Points as CSV, or a cloud.")],
    destination: Annotated[
        Path, typer.Argument(help="File to write: .csv, or that of a cloud."), WRITTEN
    ],
    inverse: Annotated[bool, typer.Option(help="From B to A.")] = False,
    step_mm: Annotated[
        float, typer.Option(min=1e-3, max=10, help="Coordinate step of LAS and LAZ.")
    ] = 0.1,
    *,
    progress: Progress,
) -> Answer:
    """Carry points or a cloud through a transformation, with their covariances."""
    stored = read_transformation(transformation)
    carrier = Carrier(stored.transformation, stored.covariance, inverse, stored.freedom)
    files = {}
    if source.suffix.lower() == ".csv":
        if destination.suffix.lower() != ".csv":
            raise InputError(
                "a table of points becomes a table", file=destination, cure="name it .csv"
            )
        files[destination], said = move_points(source, carrier)
    else:
        said = move_cloud(read_scans(source), destination, carrier, step_mm / 1e3, progress)
    words = f"{destination}: {'; '.join(said) or 'written'}"
    return Answer("Transformation", source.name, None, None, terminal=[words], files=files)
