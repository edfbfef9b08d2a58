"""The command diff: two results of one job."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console

from tribrach.io.outputs import write_text
from tribrach.io.result_file import read_result_file, result_path
from tribrach.report.characters import visible
from tribrach.report.diff import difference, difference_tables
from tribrach.report.schema.base import document_text
from tribrach.shell.flow import Overwrite, Quiet, claim, guarded
from tribrach.shell.printing import printed

__all__ = ["diff"]


def diff(
    first: Annotated[Path, typer.Argument(help="A result.json, or the folder that has it.")],
    second: Annotated[Path, typer.Argument(help="The other one, of a later run.")],
    confidence: Annotated[
        float, typer.Option(min=0.5, max=0.9999, help="Of all tests together.")
    ] = 0.95,
    angle: Annotated[Literal["gon", "deg"], typer.Option(help="Unit of angles.")] = "gon",
    json_file: Annotated[Path | None, typer.Option("--json", help="Write it as JSON.")] = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Say what differs between two results: what moved, sigmas, states of observations, edits."""

    def work() -> None:
        paths = result_path(first), result_path(second)
        claim(paths, [json_file], overwrite=overwrite)
        results = [read_result_file(path) for path in paths]
        names = str(paths[0]), str(paths[1])
        document = difference(results[0], results[1], names, confidence=confidence)
        if json_file is not None:
            write_text(json_file, document_text(document))
        if quiet:
            return
        console = Console()
        for table in difference_tables(document, angle):
            console.print(printed(table, console.width))
            if table.left_out:
                console.print(f"{table.left_out} more rows in the JSON file", style="dim")
        for sentence in document.sentences:
            console.print(visible(sentence), markup=False)

    guarded(work)
