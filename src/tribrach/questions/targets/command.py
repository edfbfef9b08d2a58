"""The command targets: finds targets in scans, as a run would find them."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import Annotated

import typer
from tribrach.report.found_targets import targets_document

from tribrach.errors import InputError
from tribrach.io.outputs import write_texts
from tribrach.io.scans.formats import read_scans
from tribrach.job.find_targets import Findings, blind, found_alone
from tribrach.job.nothing_found import density_sentences, unit_sentences
from tribrach.job.scans import StationScan
from tribrach.project.sections import TargetSection
from tribrach.report.panoramas import panorama_file
from tribrach.scan.prepared import seen_from
from tribrach.shell.flow import (
    Overwrite,
    Quiet,
    Scheduler,
    Workers,
    claim,
    guarded,
    say,
    shown,
    working,
)
from tribrach.tasks.engine import Call

__all__ = ["targets"]


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
    json_file: Annotated[Path | None, typer.Option("--json", help="Write it as JSON.")] = None,
    png_file: Annotated[
        Path | None, typer.Option("--png", help="Write the panorama with the targets marked.")
    ] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Find spheres, checkerboards and discs in whole scans; centres in their coordinates."""

    def work() -> None:
        claim([scan], (json_file, png_file), overwrite=overwrite)
        wanted = TargetSection(
            sphere_radius_m=tuple(sphere or ()),
            checkerboard_side_m=tuple(checkerboard or ()),
            disc_radius_m=tuple(disc or ()),
        )
        if not wanted.wanted:
            raise typer.BadParameter(
                "give --sphere, --checkerboard or --disc with a size in metres"
            )
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
        calls = [
            Call(f"targets of {s.name}", (s, wanted), scan, s.scan.records or 0) for s in stations
        ]
        with shown(quiet) as progress, working(workers, scheduler) as engine:
            found = dict(engine.completed(found_alone, calls, progress))
        findings: list[Findings] = []
        empty: list[StationScan] = []
        said: list[str] = []
        beams: list[str] = []
        for number in range(len(calls)):
            at_station, finding = found[number]
            if at_station.scan.no_return is not None:
                beams.append(f"{at_station.name}: {at_station.scan.no_return.sentence}")
            if not finding.detections:
                empty.append(at_station)
                said += density_sentences(finding, wanted)
            findings.append(finding.moved(at_station.scan.scanner))
        _write(findings, json_file, png_file)
        if not quiet:
            for sentence in beams:
                say(f"! {sentence}")
            _print(findings)
            if len(empty) == len(findings):
                said += unit_sentences(empty, wanted)
            for sentence in said:
                say(f"? {sentence}")

    guarded(work)


def _write(findings: list[Findings], json_file: Path | None, png_file: Path | None) -> None:
    """JSON of all scans; one picture for each, numbered where there are several."""
    files: dict[Path, str | bytes] = {}
    if json_file is not None:
        files[json_file] = targets_document(findings)
    if png_file is not None:
        for number, finding in enumerate(findings, start=1):
            one = len(findings) == 1
            path = png_file if one else png_file.with_stem(f"{png_file.stem}-{number}")
            assert finding.panorama is not None
            files[path] = panorama_file(finding.panorama, "PNG")
    write_texts(files)


def _print(findings: list[Findings]) -> None:
    """One line per target and per rejected candidate."""
    for finding in findings:
        say(
            f"{finding.scan}: {finding.points} points, {len(finding.detections)} targets, "
            f"{len(finding.rejected)} candidates rejected"
        )
        for sentence in finding.sentences:
            say(f"  ! {sentence}")
        for number, d in enumerate(finding.detections, start=1):
            x, y, z = d.center
            sigma = ", ".join(f"{1e3 * s:.2f}" for s in d.sigmas)
            far = f"  range {d.range:.2f} m" if isfinite(d.range) else ""
            say(
                f"  {number}  {d.kind}  {x:.5f} {y:.5f} {z:.5f} m  sigma {sigma} mm  "
                f"rms {1e3 * d.rms:.2f} mm within the limit of its fit  {d.points} points{far}"
            )
        for r in finding.rejected:
            x, y, z = r.center
            say(f"  x  {r.kind} at {x:.3f} {y:.3f} {z:.3f}: {r.reason}")
