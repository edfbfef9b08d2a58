"""The command complete: surfaces that no station saw, or only one, or none well enough."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tribrach._types import Progress
from tribrach.questions.complete.chapters import answer_of
from tribrach.questions.complete.clouds import complete_clouds
from tribrach.report.answer import Answer
from tribrach.shell.command import command


@command(html="Write a page with maps.", scans=True)
def complete(
    clouds: Annotated[list[Path], typer.Argument(help="Clouds in one frame, one per station.")],
    model: Annotated[
        Path | None, typer.Option(help="What should be there: a cloud, or a mesh (.stl, .obj).")
    ] = None,
    cell_m: Annotated[float, typer.Option(min=1e-3, max=100, help="Size of cells.")] = 0.1,
    sigma_mm: Annotated[
        float | None, typer.Option(min=1e-3, max=1e5, help="Required sigma of points (3D).")
    ] = None,
    *,
    progress: Progress,
) -> Answer:
    """Say which surfaces no station, one or several saw, and where the sigma is not reached."""
    required = None if sigma_mm is None else sigma_mm / 1e3
    found = complete_clouds(clouds, model, cell_m, required, progress)
    return answer_of(", ".join(path.name for path in clouds[:4]), found)
