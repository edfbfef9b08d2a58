"""The command targets: finds targets in scans, as a run would find them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from tribrach._types import Progress
from tribrach.errors import InputError
from tribrach.io.scans.formats import read_scans
from tribrach.job.find_targets import Findings, blind, found_alone
from tribrach.job.nothing_found import density_sentences, unit_sentences
from tribrach.job.scans import StationScan
from tribrach.project.sections import TargetSection
from tribrach.questions.targets.chapters import answer_of
from tribrach.report.answer import Answer
from tribrach.report.panoramas import panorama_file
from tribrach.scan.prepared import seen_from
from tribrach.shell.command import WRITTEN, command
from tribrach.tasks.engine import Call, Engine


@command(html=None, scans=True)
def targets(
    scan: Annotated[Path, typer.Argument(help="A file of scans.")],
    sphere: Annotated[
        list[float] | None,
        typer.Option(min=1e-3, max=10, help="Radius of spheres in metres; may be repeated."),
    ] = None,
    checkerboard: Annotated[
        list[float] | None,
        typer.Option(min=1e-3, max=10, help="Side of checkerboards in metres; may be repeated."),
    ] = None,
    disc: Annotated[
        list[float] | None,
        typer.Option(min=1e-3, max=10, help="Radius of white discs in metres; may be repeated."),
    ] = None,
    origin: Annotated[
        tuple[float, float, float] | None,
        typer.Option(help="Where the scanner stood in the coordinates of the file in metres."),
    ] = None,
    png_file: Annotated[
        Path | None,
        typer.Option("--png", help="Write the panorama with the targets marked."),
        WRITTEN,
    ] = None,
    *,
    progress: Progress,
    engine: Engine,
) -> Answer:
    """Find spheres, checkerboards and discs in whole scans; centres in their coordinates."""
    wanted = TargetSection(
        sphere_radius_m=tuple(sphere or ()),
        checkerboard_side_m=tuple(checkerboard or ()),
        disc_radius_m=tuple(disc or ()),
    )
    if not wanted.wanted:
        raise typer.BadParameter("give --sphere, --checkerboard or --disc with a size in metres")
    stations = []
    for one in read_scans(scan):
        seen = one if origin is None else seen_from(one, origin)
        at_station = StationScan(one.name, one.name, seen, None, False, {})
        if not wanted.sphere_radius_m and blind(at_station, wanted):
            raise InputError(
                "where the scanner stood among the points is not known, and checkerboards and "
                "discs are measured along its lines of sight",
                file=scan,
                record=one.name,
                cure="give its coordinates with --origin x y z, or --origin 0 0 0 if those of "
                "the file are the scanner's own",
            )
        stations.append(at_station)
    calls = [Call(f"targets of {s.name}", (s, wanted), scan, s.scan.records or 0) for s in stations]
    done = dict(engine.completed(found_alone, calls, progress))
    found = [done[number] for number in range(len(calls))]
    findings = [finding.moved(at.scan.scanner) for at, finding in found]
    beams = [f"! {at.name}: {b.sentence}" for at, _ in found if (b := at.scan.no_return)]
    empty = [at for at, finding in found if not finding.detections]
    said = [s for _, one in found if not one.detections for s in density_sentences(one, wanted)]
    if len(empty) == len(findings):
        said += unit_sentences(empty, wanted)
    answer = answer_of(findings)
    return replace(
        answer,
        terminal=[*beams, *answer.terminal, *(f"? {sentence}" for sentence in said)],
        files={} if png_file is None else _pictures(findings, png_file),
    )


def _pictures(findings: list[Findings], path: Path) -> dict[Path, bytes]:
    """One picture for each scan, numbered where there are several."""
    files = {}
    for number, finding in enumerate(findings, start=1):
        assert finding.panorama is not None
        own = path if len(findings) == 1 else path.with_stem(f"{path.stem}-{number}")
        files[own] = panorama_file(finding.panorama, "PNG")
    return files
