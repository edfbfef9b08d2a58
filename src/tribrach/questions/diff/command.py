"""The command diff: two results of one job."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from tribrach.io.result_file import read_result_file, result_path
from tribrach.questions.diff.chapters import answer_of
from tribrach.questions.diff.difference import difference
from tribrach.report.answer import Answer
from tribrach.shell.command import command


@command(html=None)
def diff(
    first: Annotated[
        Path, typer.Argument(help="A result.json, or the folder that has it."), result_path
    ],
    second: Annotated[Path, typer.Argument(help="The other one, of a later run."), result_path],
    confidence: Annotated[
        float, typer.Option(min=0.5, max=0.9999, help="Of all tests together.")
    ] = 0.95,
    angle: Annotated[Literal["gon", "deg"], typer.Option(help="Unit of angles.")] = "gon",
) -> Answer:
    """Say what differs between two results: what moved, sigmas, states of observations, edits."""
    one, two = read_result_file(first), read_result_file(second)
    found = difference(one, two, (str(first), str(second)), confidence=confidence)
    return answer_of(found, angle)
