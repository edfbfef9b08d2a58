"""Series of cycles in words, tables, charts, as JSON and as alarms."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from scipy.special import bdtrc

from tribrach._types import Array
from tribrach.epochs.series import SeriesFit
from tribrach.geodesy.site import FlatSite
from tribrach.io.epoch_files import epoch_data
from tribrach.io.json_text import json_text
from tribrach.job.series import DAY, SCHEMA, Cycle, PointSeries, Series
from tribrach.report.charts import Chart, beside
from tribrach.report.epochs import direction_words
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding, words
from tribrach.report.names import some_of
from tribrach.report.numbers import counted, fixed_cell, mm_cell, number
from tribrach.report.page import FrontPage, page
from tribrach.report.schema.base import heading
from tribrach.report.schema.epochs import SeriesDocument
from tribrach.report.tables import Cell, ColumnHead, ReportTable, build_table, text_cell
from tribrach.report.times import clock, clocks, stamp, time_label, time_ticks
from tribrach.units import percent

__all__ = ["alarm_lines", "series_document", "series_findings", "series_page", "series_tables"]

#: points with charts and sentences
_DRAWN, _NAMED = 12, 12
#: references that the verdict names
_IN_VERDICT = 4
#: alarms are more than chance if chance has as many this seldom
_OFTEN = 0.01
#: a wander that is not worth a word [m]
_SMALL = 1e-4
_AXES = ("E", "N", "U")
#: steps along the time axis of a panel
_TICKS = 6


def series_findings(found: Series, points: Sequence[PointSeries]) -> list[Finding]:
    """How many cycles were solved, which references moved, what the points do."""
    solved = [c for c in found.cycles if not c.reason]
    out = [
        Finding(
            f"{len(solved)} of {counted(len(found.cycles), 'cycle')} are solved"
            + (f", {found.reused} of them by an earlier call." if found.reused else "."),
            len(solved) < len(found.cycles),
        ),
        *_references(found, solved),
    ]
    open_ = [c for c in solved if not c.resolved]
    if open_:
        out.append(
            Finding(
                f"In {counted(len(open_), 'cycle')} the reference points do not agree and no group "
                f"of them explains it, the first at {clock(open_[0].start)} UTC.",
                True,
            )
        )
    out += [Finding(text, True) for text in _moved_sentences(solved, points)]
    out += [
        Finding(f"Cycle of {clock(cycle.start)} UTC: {cycle.reason}.", True)
        for cycle in [c for c in found.cycles if c.reason][:_NAMED]
    ]
    return out + [Finding(text) for text in _point_sentences(points)][: 3 * _NAMED]


def _alarms(found: Series, solved: Sequence[Cycle]) -> tuple[list[Cycle], int, bool]:
    """Cycles whose references fail their test, of how many, and if that is more than chance."""
    tested = [c for c in solved if c.dof]
    alarms = [c for c in tested if c.test > c.limit]
    chance = bdtrc(len(alarms) - 1, len(tested), 1 - found.settings.confidence) if alarms else 1.0
    return alarms, len(tested), bool(chance < _OFTEN)


def _references(found: Series, solved: Sequence[Cycle]) -> Iterator[Finding]:
    """How often the references fail, beside chance, and what they were seen to do."""
    alarms, tested, often = _alarms(found, solved)
    alpha = 1 - found.settings.confidence
    if tested:
        named = sum(bool(c.moved) for c in alarms)
        text = (
            f"The reference points fail their test in {len(alarms)} of "
            f"{counted(tested, 'cycle')} ({percent(len(alarms) / tested)}, by chance "
            f"{percent(alpha)})"
        )
        if alarms:
            text += f"; in {named} of these a point is beyond its own limit and is named"
        yield Finding(f"{text}.", often)
    if found.factor > 1.0:
        yield Finding(
            f"From cycle to cycle most reference points scatter {np.sqrt(found.factor):.2f} times "
            "as much as the stated sigmas let them: all sigmas are multiplied by that."
        )
    swing = {name: np.linalg.eigh(matrix) for name, matrix in found.wander.items()}
    largest = sorted(swing, key=lambda name: -float(swing[name][0][-1]))
    listed = [
        f"{name} {1e3 * np.sqrt(value[-1]):.1f} mm {_along(vector[:, -1])}"
        for name in largest[:_NAMED]
        for value, vector in [swing[name]]
        if value[-1] > _SMALL**2
    ]
    if listed:
        yield Finding(
            "Reference points come and go within a day, and only what is beyond that counts as "
            f"movement (standard deviation in the direction of most): {', '.join(listed)}."
        )


def _along(direction: Array) -> str:
    """A direction without a sense: up and down, or towards an azimuth and back."""
    if abs(direction[2]) > np.hypot(direction[0], direction[1]):
        return "in height"
    azimuth = np.arctan2(direction[0], direction[1]) / np.pi * 200 % 200
    return f"along {azimuth:.0f} gon"


def _moved_sentences(solved: Sequence[Cycle], points: Sequence[PointSeries]) -> Iterator[str]:
    """Each reference that moved: in which cycles, how far at most, and whether it drifts."""
    series = {p.name: p for p in points}
    count = Counter(name for c in solved for name in c.moved)
    for name, times in count.most_common(_NAMED):
        cycles = [c for c in solved if name in c.moved]
        most = max(cycles, key=lambda c: c.points[name].test)
        at = most.points[name]
        axes = range(len(at.vector)) if len(at.vector) == 3 else (0, 1)
        when = (
            f"at {clock(most.start)} UTC"
            if times == 1
            else f"in {times} cycles between {clocks(cycles[0].start, cycles[-1].start)}, most at "
            f"{clock(most.start)}"
        )
        text = (
            f"Reference point {name} moved {when}: {direction_words(at.vector, axes)} "
            f"(test {at.test:.1f}, limit {at.limit:.1f})"
        )
        fits = series[name].fits if name in series else ()
        drifts = [
            f"{30e3 * fit.rate:+.1f} mm along {axis}"
            for axis, fit in zip(_AXES, fits, strict=False)
            if fit is not None and fit.trend
        ]
        drift = "it has no significant trend"
        if drifts:
            drift = f"it drifts by {', '.join(drifts)} in 30 days"
        yield f"{text}; {drift}."


def _point_sentences(points: Sequence[PointSeries]) -> Iterator[str]:
    """Trends and jumps that are significant, the largest first."""
    trends = [
        (abs(fit.rate) * 30, p.name, axis, fit)
        for p in points
        for axis, fit in zip(_AXES, p.fits, strict=True)
        if fit is not None and fit.trend
    ]
    for _, name, axis, fit in sorted(trends, key=lambda item: -item[0])[:_NAMED]:
        yield (
            f"{name} moves by {30e3 * fit.rate:+.2f} mm in 30 days along {axis} "
            f"(sigma {30e3 * fit.rate_sigma:.2f} mm)."
        )
    jumps = [
        (abs(jump.size), p, axis, jump)
        for p in points
        for axis, fit in zip(_AXES, p.fits, strict=True)
        if fit is not None
        for jump in fit.jumps
    ]
    for _, p, axis, jump in sorted(jumps, key=lambda item: -item[0])[:_NAMED]:
        yield (
            f"{p.name} jumps by {1e3 * jump.size:+.1f} mm along {axis} between "
            f"{clocks(*(p.days[jump.at - 1 : jump.at + 1] * DAY))} (test "
            f"{abs(jump.statistic):.1f}, limit {jump.limit:.1f})."
        )


def series_tables(found: Series, points: Sequence[PointSeries]) -> list[ReportTable]:
    """Points with their trends, and cycles with their tests."""
    rows = [(p, axis, fit) for p in points for axis, fit in zip(_AXES, p.fits, strict=True) if fit]
    point_columns: list[Any] = [
        (ColumnHead("Point", numeric=False), lambda r: text_cell(r[0].name)),
        (ColumnHead("axis", numeric=False), lambda r: text_cell(r[1])),
        (ColumnHead("values"), lambda r: fixed_cell(float(len(r[0].days)), 0)),
        (ColumnHead("last", "mm"), lambda r: mm_cell(float(r[0].values[-1, _AXES.index(r[1])]))),
        (ColumnHead("30 days", "mm"), lambda r: mm_cell(30 * r[2].rate)),
        (ColumnHead("σ", "mm"), lambda r: mm_cell(30 * r[2].rate_sigma)),
        (
            ColumnHead("trend", numeric=False),
            lambda r: _significant(found=r[2].trend),
        ),
        (ColumnHead("daily", "mm"), lambda r: mm_cell(r[2].amplitude)),
        (
            ColumnHead("period", numeric=False),
            lambda r: _significant(found=r[2].period),
        ),
        (ColumnHead("jumps"), lambda r: fixed_cell(float(len(r[2].jumps)), 0)),
        (ColumnHead("outliers"), lambda r: fixed_cell(float(len(r[2].outliers)), 0)),
        (ColumnHead("scatter", wide=True), lambda r: fixed_cell(r[2].scatter, 2)),
    ]
    cycle_columns: list[Any] = [
        (ColumnHead("Cycle", "UTC", numeric=False), lambda c: text_cell(clock(c.start))),
        (ColumnHead("sights"), lambda c: fixed_cell(float(c.sights), 0)),
        (ColumnHead("test"), lambda c: fixed_cell(number(c.test), 1)),
        (ColumnHead("limit"), lambda c: fixed_cell(number(c.limit), 1)),
        (ColumnHead("references that moved", numeric=False), lambda c: text_cell(_moved(c))),
        (ColumnHead("not solved", numeric=False, wide=True), lambda c: text_cell(c.reason)),
    ]
    return [
        build_table(
            "series",
            "Points through time",
            "Displacements since the baseline in the datum of the references that stayed. 30 days: "
            "trend. Daily: half the range of the daily period. Scatter: residuals over the sigmas. "
            "Sigmas of trends rest on the residuals and on how neighbours hang together.",
            rows,
            point_columns,
        ),
        build_table(
            "cycles",
            "Cycles",
            "Test of the reference points against the baseline.",
            found.cycles,
            cycle_columns,
            state=lambda c: "off" if c.reason else "suspicious" if c.moved else "",
        ),
    ]


def _significant(*, found: bool) -> Cell:
    return text_cell("significant" if found else "")


def _moved(cycle: Cycle) -> str:
    return ", ".join(cycle.moved) if cycle.resolved else "cannot be told"


def series_page(found: Series, points: Sequence[PointSeries], title: str) -> str:
    """The whole series as one HTML file, with charts of the points that did most."""
    ordered = sorted(points, key=lambda p: -_size(p))[:_DRAWN]
    pictures = [_chart(p, found, k) for k, p in enumerate(ordered)]
    findings = series_findings(found, points)
    tables = series_tables(found, points)
    scaled = f", times {np.sqrt(found.factor):.2f}" if found.factor > 1.0 else ""
    footer = f"Sigmas of displacements are a priori, from those of the readings{scaled}."
    return page("Series", title, _front(found, points), findings, pictures, tables, footer)


def _front(found: Series, points: Sequence[PointSeries]) -> FrontPage:
    """Which references moved, which points drift or jump.

    References are named only where they fail their test more often than chance lets them.
    """
    solved = [c for c in found.cycles if not c.reason]
    alarms, _, often = _alarms(found, solved)
    named = [name for name, _ in Counter(n for c in solved for n in c.moved).most_common()]
    drifting = [p.name for p in points if any(fit and (fit.trend or fit.jumps) for fit in p.fits)]
    parts = []
    if often and named:
        noun = "Reference point" if len(named) == 1 else "Reference points"
        parts.append(f"{noun} {some_of(named, _IN_VERDICT)} moved")
    elif often:
        parts.append("The reference points fail their test, and none can be named")
    if drifting:
        parts.append(f"{counted(len(drifting), 'point')} with a significant trend or jump")
    verdict = "; ".join(parts) or "No movement found"
    first, last = found.cycles[0].start, found.cycles[-1].start
    sentence = f"Cycles from {clock(first)} to {clock(last)} UTC."
    if alarms and not often:
        sentence += (
            f" The reference points fail their test in {counted(len(alarms), 'cycle')}, which "
            "is no more than chance makes in so many."
        )
    good = not parts and len(solved) == len(found.cycles) and solved
    signed = (
        "The motions stated here, with their tests, of the cycles that were solved, in the datum "
        "of the reference points that stayed."
    )
    return FrontPage("good" if good else "none", verdict, sentence, signed=signed)


def _size(p: PointSeries) -> float:
    """The largest median displacement of the last tenth over its sigma."""
    last = max(len(p.days) // 10, 1)
    ratio = np.abs(np.median(p.values[-last:], axis=0)) / np.maximum(
        np.median(p.sigma[-last:], axis=0), 1e-9
    )
    return float(ratio.max())


def _chart(p: PointSeries, found: Series, k: int) -> Picture:
    """One point: three panels with values, fit and jumps."""
    # the panels of all points have one axis
    first, last = found.cycles[0].start, found.cycles[-1].start
    ends = first, max(last, first + 0.1 * DAY)
    panels = []
    x = p.days * DAY
    for axis, name in enumerate(_AXES):
        y = 1e3 * p.values[:, axis]
        fit: SeriesFit | None = p.fits[axis]
        low, high = float(y.min()), float(y.max())
        room = 0.08 * max(high - low, 0.5)
        panel = Chart(
            ends,
            (low - room, high + room),
            (time_label(*ends), "mm"),
            (460.0, 260.0),
            f"{p.name}, {name}",
            ticks=time_ticks(*ends, _TICKS),
        )
        words = [
            f"{clock(at)}: {v:.2f} mm, sigma {1e3 * s:.2f} mm"
            for at, v, s in zip(x, y, p.sigma[:, axis], strict=True)
        ]
        panel.points(x, y, words)
        if fit is not None:
            panel.line(x, 1e3 * fit.fitted, "s1")
        panels.append(panel)
    caption = f"Displacements of {p.name} since the baseline."
    if k == 0:
        # it is alike for all of them
        caption += (
            " The lines, here and below, are trend, daily period and jumps as they are fitted; the "
            "table says which of them are significant."
        )
    return Picture(
        f"series-{k}", p.name, beside([panels], f"Series of {p.name}"), caption, wide=True
    )


def series_document(found: Series, points: Sequence[PointSeries]) -> SeriesDocument:
    """A series as JSON: metres, radians, seconds."""
    settings = asdict(found.settings) | {"references": list(found.settings.references)}
    return SeriesDocument.model_validate(
        heading(SCHEMA)
        | {
            "kind": "series",
            "settings": settings,
            "baseline": epoch_data(found.zero, FlatSite(), "baseline of a series"),
            "factor": found.factor,
            "wander": {name: matrix.tolist() for name, matrix in found.wander.items()},
            "cycles": [_cycle(c) for c in found.cycles],
            "series": {
                p.name: [
                    _fit(fit, axis, p)
                    for axis, fit in zip(_AXES, p.fits, strict=True)
                    if fit is not None
                ]
                for p in points
            },
            "sentences": words(series_findings(found, points)),
        }
    )


def _cycle(c: Cycle) -> dict[str, Any]:
    return {
        "key": c.key,
        "time": stamp(c.start),
        "start": c.start,
        "sights": c.sights,
        "reason": c.reason,
        "test": c.test,
        "dof": c.dof,
        "limit": c.limit,
        "moved": list(c.moved),
        "resolved": c.resolved,
        "points": {
            name: {
                "displacement": list(p.vector),
                "sigma": list(p.sigma),
                "test": p.test,
                "limit": p.limit,
                "verdict": p.answer,
            }
            for name, p in c.points.items()
        },
    }


def _fit(fit: SeriesFit, axis: str, p: PointSeries) -> dict[str, Any]:
    return {
        "axis": axis,
        "rate": fit.rate,
        "rate_sigma": fit.rate_sigma,
        "trend": fit.trend,
        "amplitude": fit.amplitude,
        "amplitude_sigma": fit.amplitude_sigma,
        "phase": fit.phase,
        "period": fit.period,
        "jumps": [
            {
                "time": stamp(float(p.days[j.at]) * DAY),
                "size": j.size,
                "sigma": j.sigma,
                "test": j.statistic,
                "limit": j.limit,
            }
            for j in fit.jumps
        ],
        "outliers": [stamp(float(p.days[k]) * DAY) for k in fit.outliers.tolist()],
        "scatter": fit.scatter,
        "correlation": fit.correlation,
    }


def alarm_lines(cycles: Sequence[Cycle], references: Sequence[str], threshold: float) -> str:
    """JSON lines: points beyond the threshold *and* the limit, references that moved, failures.

    Parameters
    ----------
    cycles
        Those that are new.
    references
        Reference points, whose movement is an alarm of any size.
    threshold
        Of the length of a displacement [m].
    """
    lines: list[dict[str, Any]] = []
    for c in cycles:
        head: dict[str, Any] = {"time": stamp(c.start)}
        if c.reason:
            lines.append(head | {"alarm": "cycle not solved", "reason": c.reason})
            continue
        if not c.resolved:
            lines.append(head | {"alarm": "references disagree", "test": c.test, "limit": c.limit})
            continue
        for name, p in c.points.items():
            length = float(np.linalg.norm(p.vector))
            reference = name in references
            if p.answer != "moved" or (not reference and length <= threshold):
                continue
            lines.append(
                head
                | {
                    "alarm": "reference moved" if reference else "point moved",
                    "point": name,
                    "displacement": list(p.vector),
                    "length": length,
                    "threshold": 0.0 if reference else threshold,
                    "test": p.test,
                    "limit": p.limit,
                }
            )
    return "".join(json_text(line) + "\n" for line in lines)
