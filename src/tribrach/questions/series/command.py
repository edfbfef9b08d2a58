"""The command series: all cycles of a robotic total station in one call."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from tribrach._types import Array, Progress
from tribrach.answers import stamp
from tribrach.epochs.series import DAY
from tribrach.errors import InputError
from tribrach.io.json_text import json_text
from tribrach.io.point_list import read_point_list
from tribrach.io.readings_through_time import read_timed_readings
from tribrach.questions.series.chapters import answer_of
from tribrach.questions.series.cycles import (
    AXES,
    Cycle,
    PointSeries,
    Series,
    SeriesSettings,
    monitor,
    read_series,
)
from tribrach.report.answer import Answer
from tribrach.shell.command import WRITTEN, command
from tribrach.statistics import chi2, norm
from tribrach.units import SEC

#: cycles whose mean is tested beside each cycle by itself
_WINDOWS = (4, 16)


def alarm_lines(
    found: Series, new: Collection[str], threshold: float, run_length: float = 365.0
) -> str:
    """JSON lines: points that moved, references that moved or disagree, failures.

    A point is tested in each cycle and in the mean of its last cycles, so that a small movement
    that stays is found as well.

    Displacements of points below ``threshold`` are no alarm [m]; those of references are of any
    size. Where nothing moves, one alarm of the site comes in ``run_length`` days on average.

    Method section 12.6.
    """
    level = _level(found, run_length)
    windows: dict[str, list[dict[str, Any]]] = {}
    for point in found.points:
        for key, window in _means(found, point, level):
            windows.setdefault(key, []).append(window)
    lines = [
        {"time": stamp(c.start)} | line
        for c in found.cycles
        if c.key in new
        for line in _of_cycle(c, found.settings.references, threshold, level, windows)
    ]
    return "".join(json_text(line) + "\n" for line in lines)


def _level(found: Series, run_length: float) -> float:
    """Level of each test: expected alarms of a cycle are its time over the run length."""
    starts = np.array([c.start for c in found.cycles])
    between = float(np.median(np.diff(starts))) if len(starts) > 1 else DAY
    names = {name for c in found.cycles for name in c.points}
    tests = 1 + len(names) * (1 + len(_WINDOWS) * len(AXES))
    return min(between / DAY / run_length, 1.0) / tests


def _of_cycle(
    cycle: Cycle,
    references: Collection[str],
    threshold: float,
    level: float,
    windows: dict[str, list[dict[str, Any]]],
) -> Iterator[dict[str, Any]]:
    """Alarms of one cycle."""
    if cycle.reason:
        yield {"alarm": "cycle not solved", "reason": cycle.reason}
        return
    if not cycle.resolved:
        limit = float(chi2.ppf(1 - level, cycle.dof)) if cycle.dof else cycle.limit
        if not cycle.test <= limit:
            yield {"alarm": "references disagree", "test": cycle.test, "limit": limit}
        return
    tests = [
        {
            "point": name,
            "cycles": 1,
            "displacement": p.displacement,
            "test": p.test,
            "limit": float(chi2.ppf(1 - level, len(p.displacement))),
        }
        for name, p in cycle.points.items()
        if p.verdict == "moved"
    ]
    done = set()
    for one in [*tests, *windows.get(cycle.key, ())]:
        name = one["point"]
        length = float(np.linalg.norm(one["displacement"]))
        least = 0.0 if name in references else threshold
        if name in done or not one["test"] > one["limit"] or length <= least:
            continue
        done.add(name)
        what = "reference moved" if name in references else "point moved"
        yield {"alarm": what, **one, "length": length, "threshold": least}


def _means(found: Series, point: PointSeries, level: float) -> Iterator[tuple[str, dict[str, Any]]]:
    """Each cycle and the test of the mean of the last ones, longest last, without the baseline."""
    b = max(found.seen.get(point.name, 0), 1)
    limit = float(norm.isf(level / 2)) ** 2
    alike = _alike(found, point)
    for m in _WINDOWS:
        for last in range(found.settings.baseline + m, len(point.days) + 1):
            part = slice(last - m, last)
            mean = point.values[part].mean(axis=0)
            own = (point.sigma[part] ** 2).mean(axis=0) / (1 + 1 / b)
            test = mean**2 / (own * (np.minimum(alike, m) / m + 1 / b))
            if test.max() > limit:
                yield (
                    point.keys[last - 1],
                    {
                        "point": point.name,
                        "cycles": m,
                        "displacement": tuple(mean.tolist()),
                        "test": float(test.max()),
                        "limit": limit,
                    },
                )


def _alike(found: Series, point: PointSeries) -> Array:
    """How many cycles say as much as an independent one, along each axis (3,)."""
    out = np.ones(len(AXES))
    for fit in point.fits:
        out[AXES.index(fit.axis)] = (1 + fit.correlation) / (1 - fit.correlation)
    # what comes and goes within a day is alike in neighbouring cycles
    return np.full(len(AXES), np.inf) if point.name in found.wander else out


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
