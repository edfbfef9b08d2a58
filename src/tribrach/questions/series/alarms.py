"""Alarms of a series: which new cycles ask somebody to go there, and how seldom by chance."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.answers import stamp
from tribrach.epochs.series import DAY
from tribrach.io.json_text import json_text
from tribrach.questions.series.cycles import AXES, Cycle, PointSeries, Series
from tribrach.statistics import chi2, norm

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
    """Key of each cycle and the test of the mean of the last cycles, longer ones last.

    Cycles of the baseline share its errors and take no part.
    """
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
