"""The command series: all cycles of a robotic total station in one call."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from tribrach.errors import InputError
from tribrach.io.outputs import write_texts
from tribrach.io.point_list import read_point_list
from tribrach.io.readings_through_time import read_timed_readings
from tribrach.job.series import SeriesSettings, monitor, read_series, series_of
from tribrach.report.characters import visible
from tribrach.report.schema.base import document_text
from tribrach.report.series import (
    alarm_lines,
    series_document,
    series_findings,
    series_page,
    series_tables,
)
from tribrach.shell.flow import Overwrite, Quiet, claim, guarded, shown
from tribrach.shell.printing import printed
from tribrach.units import SEC

__all__ = ["series"]


def series(
    readings: Annotated[
        Path, typer.Argument(help="Readings as CSV: time,station,target,direction_gon,...")
    ],
    points: Annotated[
        Path, typer.Option(help="Coordinates of the reference points, and of others, as CSV.")
    ],
    reference: Annotated[
        list[str] | None,
        typer.Option(help="A point taken as stable until tested; repeat it. Else all of the file."),
    ] = None,
    baseline: Annotated[
        int, typer.Option(min=1, max=1000, help="Cycles that the others are compared with.")
    ] = 6,
    pause_min: Annotated[
        float, typer.Option(min=0.1, max=1e5, help="Pause in minutes that ends a cycle.")
    ] = 30.0,
    sigma_direction_arcsec: Annotated[
        float, typer.Option(min=0.01, max=1000, help="Of one sight.")
    ] = 1.0,
    sigma_zenith_arcsec: Annotated[
        float, typer.Option(min=0.01, max=1000, help="Of one sight.")
    ] = 1.0,
    sigma_distance_mm: Annotated[
        float, typer.Option(min=0.001, max=1000, help="Of one distance.")
    ] = 1.0,
    sigma_ppm: Annotated[
        float, typer.Option(min=0, max=1000, help="Part of it that grows with the distance.")
    ] = 1.0,
    scale: Annotated[
        bool, typer.Option("--scale", help="Take out a scale common to a cycle.")
    ] = False,
    as_stated: Annotated[
        bool, typer.Option("--as-stated", help="Do not widen sigmas by what references scatter.")
    ] = False,
    confidence: Annotated[
        float, typer.Option(min=0.5, max=0.99999, help="Of the tests of every cycle.")
    ] = 0.99,
    threshold_mm: Annotated[
        float, typer.Option(min=0, max=1e6, help="Alarms are for displacements beyond this.")
    ] = 5.0,
    resume: Annotated[
        Path | None, typer.Option(help="JSON of an earlier call: only new cycles are solved.")
    ] = None,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="Write it as JSON, for --resume too.")
    ] = None,
    alarm_file: Annotated[
        Path | None, typer.Option("--alarms", help="Write alarms of new cycles as JSON lines.")
    ] = None,
    html_file: Annotated[
        Path | None, typer.Option("--html", help="Write a page with charts.")
    ] = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Adjust all cycles of a monitored network: which points move, trends, jumps, alarms."""

    def work() -> None:
        inputs = [path for path in (readings, points, resume) if path is not None]
        claim(inputs, (json_file, alarm_file, html_file), overwrite=overwrite)
        given = read_point_list(points)
        if given.dimension != 3:
            raise InputError("the points have no heights", file=points, cure="give e_m, n_m, u_m")
        places = dict(zip(given.names, given.xyz, strict=True))
        table = read_timed_readings(readings)
        stations = set(table.stations)
        chosen = tuple(reference or [n for n in given.names if n not in stations])
        strange = [name for name in chosen if name not in set(table.targets)]
        if len(strange) == len(chosen):
            raise InputError(
                "none of the reference points is observed", file=readings, cure="check the names"
            )
        settings = SeriesSettings(
            references=chosen,
            sigma_direction=sigma_direction_arcsec * SEC,
            sigma_zenith=sigma_zenith_arcsec * SEC,
            sigma_distance=1e-3 * sigma_distance_mm,
            sigma_ppm=1e-6 * sigma_ppm,
            pause=60 * pause_min,
            baseline=baseline,
            confidence=confidence,
            as_stated=as_stated,
            scale=scale,
        )
        earlier = None if resume is None else read_series(resume, settings)
        with shown(quiet) as progress:
            found = monitor(table, places, settings, earlier=earlier, progress=progress)
        through_time = series_of(found)
        old = set() if earlier is None else {cycle.key for cycle in earlier.cycles}
        new = [cycle for cycle in found.cycles if cycle.key not in old]
        texts = {}
        if json_file is not None:
            texts[json_file] = document_text(series_document(found, through_time))
        if alarm_file is not None:
            texts[alarm_file] = alarm_lines(new, chosen, 1e-3 * threshold_mm)
        if html_file is not None:
            texts[html_file] = series_page(found, through_time, readings.name)
        write_texts(texts)
        if quiet:
            return
        console = Console()
        table_of_points = series_tables(found, through_time)[0]
        console.print(printed(table_of_points.first(40).narrow(), console.width))
        for finding in series_findings(found, through_time):
            console.print(visible(finding.line()), markup=False)

    guarded(work)
