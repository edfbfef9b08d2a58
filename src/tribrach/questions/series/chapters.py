"""What a series of cycles says: verdict, findings, tables, charts, alarms."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import bdtrc

from tribrach._types import Array
from tribrach.epochs.coloured_noise import NOISES
from tribrach.epochs.series import DAY, SeriesFit
from tribrach.questions.series.cycles import AXES, FORM, Cycle, PointSeries, Series
from tribrach.report.answer import Answer
from tribrach.report.charts import Chart, beside
from tribrach.report.columns import column
from tribrach.report.epochs import direction_words
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding, words
from tribrach.report.names import some_of
from tribrach.report.numbers import counted
from tribrach.report.page import FrontPage
from tribrach.report.tables import ReportTable, build_table
from tribrach.report.times import clock, clocks, time_label, time_ticks
from tribrach.sentences import Sentence
from tribrach.units import GON, MM, percent

__all__ = ["FORM", "answer_of"]

#: points with charts, points with sentences, references that the verdict names
_DRAWN, _NAMED, _IN_VERDICT = 12, 12, 4
#: rows that a terminal shows
_SHOWN = 40
#: alarms are more than chance if chance has as many this seldom
_OFTEN = 0.01
#: sigmas of a trend by two kinds of noise that differ more than this are told
_UNDECIDED = 1.5
#: a wander that is not worth a word [m]
_SMALL = 1e-4
#: steps along the time axis of a panel
_TICKS = 6


class _Along(NamedTuple):
    """A point through time along one axis."""

    point: PointSeries
    fit: SeriesFit

    @property
    def last(self) -> float:
        return float(self.point.values[-1, AXES.index(self.fit.axis)])


def answer_of(found: Series, title: str) -> Answer:
    """The series as an answer, with charts of the points with the largest displacements."""
    findings = list(_findings(found))
    every = [_Along(p, fit) for p in found.points for fit in p.fits]
    points, cycles = _points(every), _cycles(found)
    drawn = sorted(found.points, key=lambda p: -_size(p))[:_DRAWN]
    scaled = (
        Sentence(", times {found:2}", found=np.sqrt(found.factor)) if found.factor > 1.0 else ""
    )
    return Answer(
        "Series",
        title,
        _front(found),
        found,
        FORM,
        {"sentences": words(findings)},
        findings,
        pictures=[_chart(p, found, k) for k, p in enumerate(drawn)],
        tables=[points, cycles],
        footer=Sentence(
            "Sigmas of displacements are a priori, from those of the readings{scaled}.",
            scaled=scaled,
        ),
        terminal=[points.first(_SHOWN).narrow(), *findings],
    )


def _findings(found: Series) -> Iterator[Finding]:
    """How many cycles were solved, which references moved, what the points do."""
    unresolved = [c for c in found.solved if not c.resolved]
    failed = [c for c in found.cycles if c.reason]
    yield Finding.of(
        "solved",
        "{solved} of {cycles} are solved{reused}.",
        bool(failed),
        solved=len(found.solved),
        cycles=counted(len(found.cycles), "cycle"),
        reused=f", {found.reused} of them by an earlier call" if found.reused else "",
    )
    yield from _references(found)
    if unresolved:
        yield Finding.of(
            "unresolved",
            "In {cycles} the reference points do not agree and no group of them explains it, the "
            "first at {first.when} UTC.",
            True,
            cycles=counted(len(unresolved), "cycle"),
            first=unresolved[0],
        )
    yield from _moved(found)
    for cycle in failed[:_NAMED]:
        yield Finding.of("failed", "Cycle of {c.when} UTC: {c.reason}.", True, c=cycle)
    yield from _significant(found)


def _alarms(found: Series) -> tuple[list[Cycle], int, bool]:
    """Cycles whose references fail their test, of how many, and if that is more than chance."""
    tested = [c for c in found.solved if c.dof]
    alarms = [c for c in tested if c.test > c.limit]
    chance = bdtrc(len(alarms) - 1, len(tested), 1 - found.settings.confidence) if alarms else 1.0
    return alarms, len(tested), bool(chance < _OFTEN)


def _references(found: Series) -> Iterator[Finding]:
    """How often the references fail, beside chance, and what they were seen to do."""
    alarms, tested, often = _alarms(found)
    if tested:
        yield Finding.of(
            "alarms",
            "The reference points fail their test in {alarms} of {tested} ({share}, by chance "
            "{alpha})"
            + ("; in {named} of these a point is beyond its own limit and is named" * bool(alarms))
            + ".",
            often,
            alarms=len(alarms),
            tested=counted(tested, "cycle"),
            share=percent(len(alarms) / tested),
            alpha=percent(1 - found.settings.confidence),
            named=sum(bool(c.moved) for c in alarms),
        )
    if found.factor > 1.0:
        yield Finding.of(
            "factor",
            "From cycle to cycle most reference points scatter {factor:2} times as much as the "
            "stated sigmas let them: all sigmas are multiplied by that.",
            factor=np.sqrt(found.factor),
        )
    swing = [(name, *np.linalg.eigh(matrix)) for name, matrix in found.wander.items()]
    swing = sorted(swing, key=lambda item: -float(item[1][-1]))[:_NAMED]
    listed = [
        (name, np.sqrt(value[-1]), _along(vector[:, -1]))
        for name, value, vector in swing
        if value[-1] > _SMALL**2
    ]
    if listed:
        each = (f"{{w[{k}][0]}} {{w[{k}][1]:mm1}} {{w[{k}][2]}}" for k in range(len(listed)))
        yield Finding.of(
            "wander",
            "Reference points come and go within a day, and only what is beyond that counts as "
            f"movement (standard deviation in the direction of most): {', '.join(each)}.",
            w=listed,
        )


def _along(direction: Array) -> str:
    """A direction without a sense: up and down, or towards an azimuth and back."""
    if abs(direction[2]) > np.hypot(direction[0], direction[1]):
        return "in height"
    azimuth = np.arctan2(direction[0], direction[1]) / np.pi * 200 % 200
    return Sentence("along {azimuth:gon0}", azimuth=azimuth * GON)


def _moved(found: Series) -> Iterator[Finding]:
    """Each reference that moved: in which cycles, how far at most, and whether it drifts."""
    series = found.series
    count = Counter(name for c in found.solved for name in c.moved)
    for name, times in count.most_common(_NAMED):
        cycles = [c for c in found.solved if name in c.moved]
        most = max(cycles, key=lambda c: c.points[name].test)
        at = most.points[name]
        when = "at {most.when} UTC"
        if times > 1:
            when = "in {times} cycles between {between}, most at {most.when}"
        drifts = [fit for fit in series.get(name, ()) if fit.trend]
        drift = "it has no significant trend"
        if drifts:
            each = (f"{{f[{k}].month:mm+1}} along {{f[{k}].axis}}" for k in range(len(drifts)))
            drift = f"it drifts by {', '.join(each)} in 30 days"
        yield Finding.of(
            "moved",
            f"Reference point {{name}} moved {when}: {{how}} (test {{at.test:1}}, limit "
            f"{{at.limit:1}}); {drift}.",
            True,
            name=name,
            most=most,
            times=times,
            between=clocks(cycles[0].start, cycles[-1].start),
            how=direction_words(
                at.displacement, range(3) if len(at.displacement) == 3 else range(2)
            ),
            at=at,
            f=drifts,
        )


def _significant(found: Series) -> Iterator[Finding]:
    """What noise the series have, and trends and jumps that are significant, the largest first."""
    every = [(p, fit) for p in found.points for fit in p.fits]
    if every:
        yield from _noise([fit for _, fit in every])
    trends = [(p, fit) for p, fit in every if fit.trend]
    for p, fit in sorted(trends, key=lambda item: -abs(item[1].rate))[:_NAMED]:
        yield Finding.of(
            "trend",
            "{p.name} moves by {fit.month:mm+2} in 30 days along {fit.axis} (sigma "
            "{fit.month_sigma:mm2}).",
            p=p,
            fit=fit,
        )
    jumps = [(p, fit, jump) for p, fit in every for jump in fit.jumps]
    for p, fit, jump in sorted(jumps, key=lambda item: -abs(item[2].size))[:_NAMED]:
        yield Finding.of(
            "jump",
            "{p.name} jumps by {jump.size:mm+1} along {fit.axis} between {between} (test {test:1}, "
            "limit {jump.limit:1}).",
            p=p,
            fit=fit,
            jump=jump,
            between=clocks(*(p.days[jump.at - 1 : jump.at + 1] * DAY)),
            test=abs(jump.test),
        )


def _noise(fits: Sequence[SeriesFit]) -> Iterator[Finding]:
    """Kinds of noise that all series say together, and whether single ones can tell."""
    shares = {kind: float(np.mean([fit.noise[kind] for fit in fits])) for kind in NOISES}
    yield Finding.of(
        "noise",
        "Noise of {series}, which say together what it is like: {each}.",
        series=counted(len(fits), "series", "series"),
        each=", ".join(f"{kind} {percent(share)}" for kind, share in shares.items()),
        shares=shares,
    )
    open_ = [fit for fit in fits if fit.rate_sigma_range[1] > _UNDECIDED * fit.rate_sigma_range[0]]
    if open_:
        most = max(open_, key=lambda fit: fit.rate_sigma_range[1] / fit.rate_sigma_range[0])
        yield Finding.of(
            "noise_undecided",
            "{n} of {series} are too short to decide their noise: sigmas of their trends are "
            "averages over what it may be (at most between {low:mm2} and {high:mm2} in 30 days).",
            n=len(open_),
            series=counted(len(fits), "series", "series"),
            low=30 * most.rate_sigma_range[0],
            high=30 * most.rate_sigma_range[1],
        )


def _points(rows: Sequence[_Along]) -> ReportTable:
    """Points with their trends, jumps and periods."""

    def real(found: bool) -> str:
        return "significant" if found else ""

    columns = [
        column("Point", "point.name"),
        column("axis", "fit.axis"),
        column("values", lambda r: len(r.point.days), "0"),
        column("last", "last", "mm2"),
        column("30 days", "fit.month", "mm2"),
        column("σ", "fit.month_sigma", "mm2"),
        column("found from", "fit.month_detectable", "mm1"),
        column("trend", lambda r: real(r.fit.trend)),
        column("daily", "fit.amplitude", "mm2"),
        column("period", lambda r: real(r.fit.period)),
        column("jumps", lambda r: len(r.fit.jumps), "0"),
        column("outliers", lambda r: len(r.fit.outliers), "0"),
        column("scatter", "fit.scatter", "2", wide=True),
    ]
    note = (
        "Displacements since the baseline in the datum of the references that stayed. 30 days: "
        "trend. Found from: trend that its test finds with 80 %. Daily: half the range of the "
        "daily period. Scatter: residuals over the sigmas. Sigmas of trends rest on the residuals "
        "and on what noise the series of all points have."
    )
    return build_table("series", "Points through time", note, rows, columns)


def _cycles(found: Series) -> ReportTable:
    """Cycles with their tests."""
    columns = [
        column("Cycle", "when", unit="UTC"),
        column("sights", "sights", "0"),
        column("test", "test", "1"),
        column("limit", "limit", "1"),
        column(
            "references that moved",
            lambda c: ", ".join(c.moved) if c.resolved else "cannot be told",
        ),
        column("not solved", "reason", wide=True),
    ]
    note = "Test of the reference points against the baseline."
    return build_table(
        "cycles",
        "Cycles",
        note,
        found.cycles,
        columns,
        state=lambda c: "off" if c.reason else "suspicious" if c.moved else "",
    )


def _front(found: Series) -> FrontPage:
    """Which references moved more often than by chance, and which points drift or jump."""
    alarms, _, often = _alarms(found)
    named = [name for name, _ in Counter(n for c in found.solved for n in c.moved).most_common()]
    drifting = [p.name for p in found.points if any(fit.trend or fit.jumps for fit in p.fits)]
    parts = []
    if often and named:
        noun = "Reference point" if len(named) == 1 else "Reference points"
        parts.append(f"{noun} {some_of(named, _IN_VERDICT)} moved")
    elif often:
        parts.append("The reference points fail their test, and none can be named")
    if drifting:
        parts.append(f"{counted(len(drifting), 'point')} with a significant trend or jump")
    sentence = f"Cycles from {found.cycles[0].when} to {found.cycles[-1].when} UTC."
    if alarms and not often:
        sentence += (
            f" The reference points fail their test in {counted(len(alarms), 'cycle')}, no "
            "more often than expected by chance."
        )
    good = not parts and found.solved and len(found.solved) == len(found.cycles)
    return FrontPage(
        "good" if good else "none",
        "; ".join(parts) or "No movement found",
        sentence,
        signed="The motions stated here, with their tests, of the cycles that were solved, in the "
        "datum of the reference points that stayed.",
    )


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
    x, fits = p.days * DAY, {fit.axis: fit for fit in p.fits}
    for axis, name in enumerate(AXES):
        y = 1e3 * p.values[:, axis]
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
        said = [
            Sentence("{clock}: {v:mm2}, sigma {s:mm2}", clock=clock(at), v=v * MM, s=s)
            for at, v, s in zip(x, y, p.sigma[:, axis], strict=True)
        ]
        panel.points(x, y, said)
        if name in fits:
            panel.line(x, 1e3 * fits[name].fitted, "s1")
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
