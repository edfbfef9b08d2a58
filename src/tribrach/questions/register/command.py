"""The command register: whole clouds from nothing, with covariances, loops and poses."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import typer

from tribrach._types import Progress
from tribrach.errors import InputError
from tribrach.io.models.formats import model_unit
from tribrach.job.references import ReferenceFile
from tribrach.project.instrument import noise_of
from tribrach.project.sections import CloudSection
from tribrach.questions.register.chapters import answer_of
from tribrach.questions.register.registration import PlacedOutput, register_files, write_placed
from tribrach.registration.clouds.pair import APPROXIMATE, ApproximateSigma
from tribrach.registration.clouds.proposals import Choice
from tribrach.report.answer import Answer
from tribrach.report.findings import Finding
from tribrach.shell.command import FOLDER, command
from tribrach.units import MM, SEC


@command(html="Write a page with plan, pairs and loops.", scans=True)
def register(
    files: Annotated[list[Path], typer.Argument(help="Files of scans, in their scanners' frames.")],
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for poses and clouds, or E57 files with the new poses."),
        FOLDER,
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
    origin: Annotated[
        tuple[float, float, float] | None,
        typer.Option(help="Where the scanner stood in the coordinates of the files in metres."),
    ] = None,
    pairs: Annotated[
        Choice, typer.Option(help="Register the pairs that are needed, or all of them.")
    ] = "proposed",
    reference: Annotated[
        list[Path] | None,
        typer.Option(help="A cloud, model or terrain that the scans are placed on."),
    ] = None,
    reference_sigma_mm: Annotated[
        float, typer.Option(min=0, help="What each piece of 10 m of it is wrong by.")
    ] = 0.0,
    reference_shared_mm: Annotated[
        float, typer.Option(min=0, help="What all of it is wrong by, along each axis.")
    ] = 0.0,
    reference_unit: Annotated[
        str | None, typer.Option(help="What coordinates of models are counted in: m, mm, ft ...")
    ] = None,
    floor_mm: Annotated[
        float, typer.Option(min=0, max=1000, help="Sigma of shifts that residuals do not show.")
    ] = 1.0,
    floor_arcsec: Annotated[
        float, typer.Option(min=0, max=36000, help="Sigma of turns that residuals do not show.")
    ] = 10.0,
    *,
    progress: Progress,
) -> Answer:
    """Register scans by their clouds; no targets, planes or approximate poses are needed."""
    if out is None and clouds is not None:
        raise InputError("clouds need a folder", cure="name it with --out")
    if clouds is None and (merged or instrument is not None):
        raise InputError(
            "--merged and --instrument are of clouds", cure="give their format with --clouds"
        )
    section = None if clouds is None else CloudSection(format=clouds, merged=merged)
    output = None if out is None else PlacedOutput(out, section, noise_of(instrument))
    result = register_files(
        files,
        approximate=approximate,
        poses=poses or [],
        sigma=ApproximateSigma(pose_sigma_m, math.radians(pose_sigma_deg)),
        no_return=no_return,
        choice=pairs,
        floor=(floor_mm / 1e3, floor_arcsec * SEC),
        origin=origin,
        references=[
            ReferenceFile(
                path, reference_sigma_mm * MM, reference_shared_mm * MM, model_unit(reference_unit)
            )
            for path in reference or []
        ],
        output=output,
        progress=progress,
    )
    written, said = ([], []) if output is None else write_placed(result, output, progress)
    answer = answer_of(result)
    terminal = [*answer.terminal, *(Finding(text, True, "written") for text in said)]
    return replace(answer, terminal=terminal, written=written)
