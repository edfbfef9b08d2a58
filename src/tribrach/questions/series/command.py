"""The command series: all cycles of a robotic total station in one call."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from tribrach._types import Progress
from tribrach.errors import InputError
from tribrach.io.point_list import read_point_list
from tribrach.io.readings_through_time import read_timed_readings
from tribrach.questions.series.alarms import alarm_lines
from tribrach.questions.series.chapters import answer_of
from tribrach.questions.series.cycles import SeriesSettings, monitor, read_series
from tribrach.report.answer import Answer
from tribrach.shell.command import WRITTEN, command
from tribrach.units import SEC


@command(json="Write it as JSON, for --resume too.", html="Write a page with charts.")
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
    centring_mm: Annotated[
        float, typer.Option(min=0, max=1000, help="Of instruments and prisms, anew in a cycle.")
    ] = 0.0,
    height_mm: Annotated[
        float, typer.Option(min=0, max=1000, help="Of their heights, anew in a cycle.")
    ] = 0.0,
    refraction: Annotated[
        float, typer.Option(min=-5, max=5, help="Coefficient of refraction.")
    ] = 0.13,
    sigma_refraction: Annotated[
        float, typer.Option(min=0, max=5, help="Of it in a cycle; 0 to hold it.")
    ] = 0.1,
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
    false_alarm_days: Annotated[
        float,
        typer.Option(min=0.01, max=1e6, help="One alarm by chance in so many days, of the site."),
    ] = 365.0,
    resume: Annotated[
        Path | None, typer.Option(help="JSON of an earlier call: only new cycles are solved.")
    ] = None,
    alarms: Annotated[
        Path | None,
        typer.Option("--alarms", help="Write alarms of new cycles as JSON lines."),
        WRITTEN,
    ] = None,
    *,
    progress: Progress,
) -> Answer:
    """Adjust all cycles of a monitored network: which points move, trends, jumps, alarms."""
    given = read_point_list(points)
    if given.dimension != 3:
        raise InputError("the points have no heights", file=points, cure="give e_m, n_m, u_m")
    places = dict(zip(given.names, given.xyz, strict=True))
    table = read_timed_readings(readings)
    chosen = tuple(reference or [n for n in given.names if n not in set(table.stations)])
    if not set(chosen) & set(table.targets):
        raise InputError(
            "none of the reference points is observed", file=readings, cure="check the names"
        )
    settings = SeriesSettings(
        references=chosen,
        sigma_direction=sigma_direction_arcsec * SEC,
        sigma_zenith=sigma_zenith_arcsec * SEC,
        sigma_distance=1e-3 * sigma_distance_mm,
        sigma_ppm=1e-6 * sigma_ppm,
        centring=1e-3 * centring_mm,
        height=1e-3 * height_mm,
        refraction=refraction,
        sigma_refraction=sigma_refraction,
        pause=60 * pause_min,
        baseline=baseline,
        confidence=confidence,
        as_stated=as_stated,
        scale=scale,
    )
    earlier = None if resume is None else read_series(resume, settings)
    found = monitor(table, places, settings, earlier=earlier, progress=progress)
    answer = answer_of(found, readings.name)
    if alarms is None:
        return answer
    old = set() if earlier is None else {cycle.key for cycle in earlier.cycles}
    new = {cycle.key for cycle in found.cycles} - old
    lines = alarm_lines(found, new, 1e-3 * threshold_mm, false_alarm_days)
    return replace(answer, files={alarms: lines})
