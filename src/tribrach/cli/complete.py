"""The command complete: surfaces that no station saw, or only one, or none well enough."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tribrach.io.outputs import write_texts
from tribrach.job.complete import complete_clouds
from tribrach.report.completeness import completeness_page, completeness_text
from tribrach.report.schema.base import document_text, heading
from tribrach.report.schema.completeness import SCHEMA, CompletenessDocument
from tribrach.shell.flow import Overwrite, Quiet, claim, guarded, say, shown

__all__ = ["complete"]


def complete(
    clouds: Annotated[list[Path], typer.Argument(help="Clouds in one frame, one per station.")],
    model: Annotated[
        Path | None, typer.Option(help="What should be there: a cloud, or a mesh (.stl, .obj).")
    ] = None,
    cell_m: Annotated[float, typer.Option(min=1e-3, max=100, help="Size of cells.")] = 0.1,
    sigma_mm: Annotated[
        float | None, typer.Option(min=1e-3, max=1e5, help="Required sigma of points (3D).")
    ] = None,
    json_file: Annotated[Path | None, typer.Option("--json", help="Write it as JSON.")] = None,
    html_file: Annotated[
        Path | None, typer.Option("--html", help="Write a page with maps.")
    ] = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Say which surfaces no station, one or several saw, and where the sigma is not reached."""

    def work() -> None:
        claim(clouds, (json_file, html_file), overwrite=overwrite)
        required = None if sigma_mm is None else sigma_mm / 1e3
        with shown(quiet) as progress:
            result = complete_clouds(clouds, model, cell_m, required, progress)
        texts = {}
        if json_file is not None:
            data = heading(SCHEMA) | result.to_json()
            texts[json_file] = document_text(CompletenessDocument.model_validate(data))
        if html_file is not None:
            title = ", ".join(path.name for path in clouds[:4])
            texts[html_file] = completeness_page(title, result)
        write_texts(texts)
        if not quiet:
            say(completeness_text(result))

    guarded(work)
