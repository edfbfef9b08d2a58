"""The command register: whole clouds from nothing, with covariances, loops and poses."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Literal

import typer
from rich.console import Console

from tribrach.errors import InputError
from tribrach.io.outputs import write_texts
from tribrach.job.register import PlacedOutput, register_files, write_placed
from tribrach.project.instrument import noise_of
from tribrach.project.sections import CloudSection
from tribrach.registration.clouds.pair import APPROXIMATE, ApproximateSigma
from tribrach.registration.clouds.proposals import Choice
from tribrach.report.characters import visible
from tribrach.report.cloud_registration import (
    cloud_registration_page,
    cloud_registration_tables,
)
from tribrach.report.schema.base import document_text
from tribrach.report.schema.registration import registration_document
from tribrach.shell.flow import Overwrite, Quiet, claim, guarded, shown
from tribrach.shell.printing import printed
from tribrach.units import SEC

__all__ = ["register"]

#: terminals with as many columns show all columns of the tables
_WIDE = 118


def register(
    files: Annotated[list[Path], typer.Argument(help="Files of scans, in their scanners' frames.")],
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for poses and clouds, or E57 files with the new poses."),
    ] = None,
    clouds: Annotated[
        Literal["laz", "las", "copc", "ply", "e57"] | None,
        typer.Option(help="Write registered clouds in this format into the folder."),
    ] = None,
    merged: Annotated[bool, typer.Option("--merged", help="One cloud of all scans.")] = False,
    instrument: Annotated[
        str | None, typer.Option(help="Model of the scanner, for sigmas of points in clouds.")
    ] = None,
    approximate: Annotated[
        bool, typer.Option(help="Try poses beside the files or in them, among others.")
    ] = True,
    poses: Annotated[
        list[Path] | None,
        typer.Option(help="Approximate poses: KITTI, 4x4, .pose, .DAT, poses.json, a folder."),
    ] = None,
    pose_sigma_m: Annotated[
        float, typer.Option(min=1e-3, max=1e4, help="Sigma of the shift between two such poses.")
    ] = APPROXIMATE.shift,
    pose_sigma_deg: Annotated[
        float, typer.Option(min=1e-3, max=180, help="Sigma of the turn between two such poses.")
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
    html_file: Annotated[
        Path | None, typer.Option("--html", help="Write a page with plan, pairs and loops.")
    ] = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Register scans by their clouds; no targets, planes or approximate poses are needed."""
    lists = poses or []
    section = None if clouds is None else CloudSection(format=clouds, merged=merged)

    def work() -> None:
        if out is None and clouds is not None:
            raise InputError("clouds need a folder", cure="name it with --out")
        if clouds is None and (merged or instrument is not None):
            raise InputError(
                "--merged and --instrument are of clouds", cure="give their format with --clouds"
            )
        claim([*files, *lists], [json_file, html_file], out, overwrite=overwrite)
        output = None if out is None else PlacedOutput(out, section, noise_of(instrument))
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
                output=output,
                progress=progress,
            )
            written, said = ([], []) if output is None else write_placed(result, output, progress)
        texts = {}
        if json_file is not None:
            texts[json_file] = document_text(registration_document(result))
        if html_file is not None:
            texts[html_file] = cloud_registration_page(result)
        written += write_texts(texts)
        if quiet:
            return
        console = Console()
        for table in cloud_registration_tables(result.registration):
            fitting = table if console.width >= _WIDE else table.narrow()
            console.print(printed(fitting, console.width))
        for sentence in (*result.sentences, *said):
            console.print(visible(f"! {sentence}"), markup=False)
        for path in written:
            console.print(visible(str(path)), markup=False)

    guarded(work)
