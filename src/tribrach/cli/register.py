"""The command register: whole clouds from nothing, with covariances, loops and poses."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from tribrach.cli.printing import printed
from tribrach.cli.shell import Overwrite, claim, guarded, shown
from tribrach.io.outputs import write_texts
from tribrach.job.register import register_files, write_placed
from tribrach.registration.clouds.pair import APPROXIMATE, ApproximateSigma
from tribrach.registration.clouds.proposals import Choice
from tribrach.report.cloud_registration import cloud_registration_tables
from tribrach.report.schema.base import document_text
from tribrach.report.schema.registration import registration_document
from tribrach.units import SEC

__all__ = ["register"]

#: terminals with as many columns show all columns of the tables
_WIDE = 118


def register(
    files: Annotated[list[Path], typer.Argument(help="Files of scans, in their scanners' frames.")],
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for poses.csv, poses.json and E57 files with the new poses."),
    ] = None,
    approximate: Annotated[
        bool, typer.Option(help="Try poses beside the files or in them, among others.")
    ] = True,
    poses: Annotated[
        list[Path] | None,
        typer.Option(help="Approximate poses: KITTI, 4x4, .pose, .DAT, poses.json, a folder."),
    ] = None,
    pose_sigma_m: Annotated[
        float, typer.Option(min=1e-3, max=1e4, help="What these may be wrong by: shift.")
    ] = APPROXIMATE.shift,
    pose_sigma_deg: Annotated[
        float, typer.Option(min=1e-3, max=180, help="What these may be wrong by: turn.")
    ] = 1.25,
    no_return: Annotated[
        bool, typer.Option("--keep-no-return", help="Keep points of beams without return.")
    ] = False,
    pairs: Annotated[
        Choice, typer.Option(help="Register the pairs that are needed, or all of them.")
    ] = "proposed",
    floor_mm: Annotated[
        float, typer.Option(min=0, max=1000, help="Sigma of shifts that residuals do not show.")
    ] = 1.0,
    floor_arcsec: Annotated[
        float, typer.Option(min=0, max=36000, help="Sigma of turns that residuals do not show.")
    ] = 10.0,
    json_file: Annotated[Path | None, typer.Option("--json", help="Write it as JSON.")] = None,
    overwrite: Overwrite = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing.")] = False,
) -> None:
    """Register scans by their clouds; no targets, planes or approximate poses are needed."""
    lists = poses or []

    def work() -> None:
        claim([*files, *lists], [json_file], out, overwrite=overwrite)
        floor = (floor_mm / 1e3, floor_arcsec * SEC)
        sigma = ApproximateSigma(pose_sigma_m, math.radians(pose_sigma_deg))
        with shown(quiet) as progress:
            result = register_files(
                files,
                approximate=approximate,
                poses=lists,
                sigma=sigma,
                no_return=no_return,
                choice=pairs,
                floor=floor,
                progress=progress,
            )
            written = [] if out is None else write_placed(result, out, progress)
        if json_file is not None:
            text = document_text(registration_document(result))
            written += write_texts({json_file: text})
        if quiet:
            return
        console = Console()
        for table in cloud_registration_tables(result.registration):
            fitting = table if console.width >= _WIDE else table.narrow()
            console.print(printed(fitting, console.width))
        for sentence in result.sentences:
            console.print(f"! {sentence}", markup=False)
        for path in written:
            console.print(str(path), markup=False)

    guarded(work)
