"""The command simulate: a whole survey job with its truth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tribrach.io.twins import write_twin
from tribrach.shell.flow import Overwrite, Quiet, guarded, say, shown
from tribrach.simulate.twins import TWINS, build


def simulate(
    twin: Annotated[str, typer.Argument(help=f"One of {', '.join(TWINS)}.")],
    out: Annotated[Path, typer.Option(help="Folder to write the project into.")],
    points: Annotated[
        int, typer.Option(min=10_000, max=200_000_000, help="Points per station, about.")
    ] = 1_000_000,
    seed: Annotated[int, typer.Option(min=0, help="Another seed draws other errors.")] = 1,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Simulate a whole survey job: scans, observations, project file and its truth."""

    def work() -> None:
        with shown(quiet) as progress:
            made = build(twin, points, seed)
            write_twin(made, out, progress, overwrite=overwrite)
        if not quiet:
            paths = [out / one.project_file for one in (made, *made.later)]
            then = [f"then: tribrach run {path}" for path in paths[1:]]
            say("\n".join([*map(str, paths), f"now: tribrach run {paths[0]}", *then]))

    guarded(work)
