"""The chapter of the report on GNSS: sessions, baselines, loops, a map."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from tribrach._types import Array
from tribrach.answers import Result
from tribrach.gnss.attempts import Attempt
from tribrach.gnss.baseline import Baseline
from tribrach.gnss.loops import BaselineLoop
from tribrach.gnss.orbits import calendar
from tribrach.gnss.pieces import UNSEEN
from tribrach.gnss.sessions import SessionResult
from tribrach.job.gnss_loops import (
    BaselineSet,
    baselines_of,
    epoch_sentences,
    loops_of,
)
from tribrach.job.mounted_antennas import raised_antennas
from tribrach.network.adjustment import Adjustment
from tribrach.network.facts import Reference, frame_sentences
from tribrach.report.chapter import Chapter
from tribrach.report.charts import PALETTE, Chart, Drawing, beside, legend
from tribrach.report.content import Head
from tribrach.report.figures import Picture
from tribrach.report.numbers import counted, fixed_cell, mm_cell
from tribrach.report.subject import Subject
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    build_table,
    text_cell,
)
from tribrach.report.warnings import Severity, warned
from tribrach.sentences import Sentence, capital

if TYPE_CHECKING:
    from tribrach.job.results import JobResults

#: sessions in the legend of the map
MOST_SESSIONS = 8
_TITLE = "GNSS baselines"


@dataclass(frozen=True)
class NamedLoop(BaselineLoop, keys={"names": "points"}):
    """A loop of baselines and its closure along E, N, U [m]."""

    names: tuple[str, ...] = ()  #: in the order in which they are walked


@dataclass(frozen=True)
class SessionBaseline(Baseline, also=("from_", "to")):
    """A baseline of a session."""

    session: str = ""

    @property
    def from_(self) -> str:
        """The base."""
        return self.names[0]

    @property
    def to(self) -> str:
        """The rover."""
        return self.names[1]


@dataclass(frozen=True)
class GnssPart(Result):
    """Baselines that were computed, and all loops."""

    frame: str | None
    epoch: float | None
    baselines: tuple[SessionBaseline, ...]
    loops: tuple[NamedLoop, ...]


@dataclass(frozen=True)
class MapLine:
    """A baseline on the map: numbers of its points, its session, what is special about it."""

    start: int
    end: int
    session: str
    floating: bool = False
    suspicious: bool = False


def baseline_map(plan: Array, names: Sequence[str], lines: Sequence[MapLine]) -> Picture:
    """Baselines between points with plan coordinates (n, 2) [m], E and N."""
    caption = (
        "Baselines in the plan of the work frame. Dashed: float ambiguities. Red: in a loop that "
        "fails its test."
    )
    return Picture("gnss-map", _TITLE, partial(_drawn, plan, names, lines), caption, wide=True)


def _drawn(plan: Array, names: Sequence[str], lines: Sequence[MapLine]) -> Drawing:
    """The drawing of :func:`baseline_map`."""
    used = np.unique([k for line in lines for k in (line.start, line.end)])
    low, high = plan[used].min(axis=0), plan[used].max(axis=0)
    margin = 0.1 * max(float((high - low).max()), 1.0)
    chart = Chart(
        (low[0] - margin, high[0] + margin), (low[1] - margin, high[1] + margin),
        ("E [m]", "N [m]"), (900.0, 560.0), equal=True,
    )  # fmt: skip
    sessions = list(dict.fromkeys(line.session for line in lines))
    for line in lines:
        colour = f"s{sessions.index(line.session) % PALETTE}"
        ends = plan[[line.start, line.end]]
        words = f"{names[line.start]} to {names[line.end]}"
        words += f", session {line.session}" if line.session else ""
        words += ", float ambiguities" if line.floating else ""
        words += ", in a loop that fails its test" if line.suspicious else ""
        chart.line(
            ends[:, 0], ends[:, 1], "bad" if line.suspicious else colour,
            dashed=line.floating, words=words,
        )  # fmt: skip
    for k in used.tolist():
        chart.place(float(plan[k, 0]), float(plan[k, 1]), names[k], "free")
    entries = [(f"s{k % PALETTE}", f"session {name}") for k, name in enumerate(sessions) if name]
    return beside([[chart]], _TITLE, legend(entries[:MOST_SESSIONS], 900.0))


#: failing loops that are named one by one
MOST_NAMED = 5


def gnss_chapter(adjustment: Adjustment, sessions: Sequence[SessionResult] = ()) -> Chapter | None:
    """The chapter; None where no baseline takes part."""
    baselines = baselines_of(adjustment)
    if baselines is None:
        return None
    loops = loops_of(baselines)
    reference = adjustment.network.reference
    warnings = (
        *warned(Severity.BLUNDER, _loop_warnings(baselines, loops), "loops"),
        *warned(Severity.INPUT, raised_antennas(adjustment, sessions), "antenna_height"),
    )
    sentences = [
        *_session_sentences(sessions),
        *_loop_sentences(baselines, loops),
        *epoch_sentences(reference, sessions),
        *frame_sentences(adjustment.network.facts, vectors=True),
    ]
    tables = [
        _session_table(sessions),
        _baseline_table(sessions),
        _attempt_table(sessions),
        _loop_table(baselines, loops),
    ]
    return Chapter(
        "gnss",
        "GNSS baselines and loops",
        tuple(sentences),
        (_map(adjustment, baselines, loops, sessions),),
        tuple(table for table in tables if table.rows),
        _data(baselines, loops, sessions, reference),
        warnings,
    )


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter, where baselines take part."""
    chapter = gnss_chapter(head.adjustment, job.sessions)
    return () if chapter is None else (chapter,)


def _all(sessions: Sequence[SessionResult]) -> list[tuple[SessionResult, Baseline]]:
    return [(session, baseline) for session in sessions for baseline in session.baselines]


def _session_sentences(sessions: Sequence[SessionResult]) -> list[str]:
    rows = [baseline for _, baseline in _all(sessions)]
    if not rows:
        return []
    epochs = sum(b.epochs for b in rows)
    fixed = sum(b.fixed_share * b.epochs for b in rows)
    solved = sum(b.ambiguities == "fixed" for b in rows)
    factors = sorted({round(b.factor, 2) for b in rows})
    spread = (
        Sentence("{factors[0]:2}", factors=factors)
        if len(factors) == 1
        else Sentence("{factors[0]:2} to {factors2:2}", factors=factors, factors2=factors[-1])
    )
    origin = " and ".join(dict.fromkeys(b.factor_source for b in rows))
    out: list[str] = [
        Sentence(
            "{sessions} gave {rows}, computed by RTKLIB ({dict}); ambiguities of {solved} "
            "are fixed, in {fixed:%} of {epochs} epochs.",
            sessions=counted(len(sessions), "session"),
            rows=counted(len(rows), "independent baseline"),
            dict=", ".join(dict.fromkeys(b.engine for b in rows)),
            solved=solved,
            fixed=fixed / epochs,
            epochs=epochs,
        ),
        Sentence(
            "Formal standard deviations of the engine are multiplied by {spread} ({origin}).",
            spread=spread,
            origin=origin,
        ),
    ]
    parts = [b.session_part for b in rows if b.session_part is not None]
    if parts:
        out.append(
            Sentence(
                "What stays alike within a session is in them: {plan:mm1} in plan and {up:mm1} "
                "in height at most ({part.source}).",
                plan=max(part.plan for part in parts),
                up=max(part.up for part in parts),
                part=parts[0],
            )
        )
    out += [
        Sentence(
            "Not fixed in session {s.name} is {b.headline}; it takes part with that covariance.",
            s=s,
            b=b,
        )
        for s, b in _all(sessions)
        if b.ambiguities != "fixed"
    ]
    out += [
        f"{b.names[0]} to {b.names[1]} of session {s.name} was doubtful and computed in other ways "
        f"too: {b.choice}."
        for s, b in _all(sessions)
        if b.choice
    ]
    idle = dict.fromkeys((s.name, text) for s, b in _all(sessions) for text in b.idle)
    if idle:
        named = "; ".join(f"{text} in session {name}" for name, text in idle)
        out.append(f"Satellite systems in the files that took no part: {named}.")
    checked = [b.pieces for b in rows if b.pieces is not None]
    if checked:
        ratios = [p.ratio for p in checked]
        wide = sum(not p.agree for p in checked)
        out.append(
            Sentence(
                "Sigmas of {checked} were checked by computing pieces of their sessions, which "
                "scatter {ratios:2} to {ratios2:2} times as much as they state; those of "
                "{wide} were widened because of it. {unseen}.",
                checked=len(checked),
                ratios=min(ratios),
                ratios2=max(ratios),
                wide=wide or "none",
                unseen=capital(UNSEEN),
            )
        )
    files = dict.fromkeys(name for b in rows for name in b.orbits)
    if files:
        precise = sum(bool(b.orbits) for b in rows)
        rest = "" if precise == len(rows) else f", those of {len(rows) - precise} broadcast ones"
        out.append(f"Orbits of {precise} are precise ones ({', '.join(files)}){rest}.")
    if any(len(session.baselines) > 1 for session in sessions):
        out.append(
            "Baselines of one session share receivers and are adjusted with their correlation, "
            "one half where they share one."
        )
    return out


def _loop_sentences(baselines: BaselineSet, loops: Sequence[BaselineLoop]) -> list[str]:
    if not loops:
        return ["The baselines close no loop: nothing checks them."]
    basis = [loop for loop in loops if loop.independent]
    largest = max(loops, key=lambda loop: loop.size)
    steepest = max(loops, key=lambda loop: loop.ppm)
    failing = sum(not loop.passes for loop in loops)
    further = len(loops) - len(basis)
    more = f" and {counted(further, 'further triangle')}" if further else ""
    words = Sentence(
        "{counted}{more}: the largest closure is {largest.size:mm1} ({largest.ppm:2} "
        "ppm of {largest.length:0} m) in {path}",
        counted=counted(len(basis), "minimal loop"),
        more=more,
        largest=largest,
        path=_path(baselines, largest),
    )
    if steepest is not largest:
        words += Sentence(
            ", the largest in proportion {steepest.ppm:2} ppm ({steepest.size:mm1}) in {path}",
            steepest=steepest,
            path=_path(baselines, steepest),
        )
    verb = "fails" if failing in (0, 1) else "fail"
    out: list[str] = [
        Sentence(
            "{words}; {failing} of {loops} {verb} the test at 5 %.",
            words=words,
            failing=failing or "none",
            loops=len(loops),
            verb=verb,
        )
    ]
    dof = sum(loop.dof for loop in basis)
    if dof >= 3:
        factor = float(np.sqrt(sum(loop.statistic for loop in basis) / dof))
        out.append(
            Sentence(
                "Closures are {factor:2} times what the covariances let expect, in the mean; "
                "vce = true under [adjustment] estimates such a factor with all observations.",
                factor=factor,
            )
        )
    return out


def _loop_warnings(baselines: BaselineSet, loops: Sequence[BaselineLoop]) -> list[str]:
    bad = sorted((loop for loop in loops if not loop.passes), key=lambda loop: -loop.statistic)
    # a share of the tests fails by chance: only closures far beyond are worth a warning
    far = [loop for loop in bad if loop.statistic > 2 * loop.limit]
    words: list[str] = [
        Sentence(
            "GNSS loop {path} does not close by {loop.size:mm1} ({loop.ppm:1} ppm): its "
            "test is {loop.statistic:1}, the limit {loop.limit:1}.",
            path=_path(baselines, loop),
            loop=loop,
        )
        for loop in far[:MOST_NAMED]
    ]
    if len(far) > MOST_NAMED:
        words.append(f"{len(far) - MOST_NAMED} further GNSS loops do not close either.")
    return words


def _path(baselines: BaselineSet, loop: BaselineLoop) -> str:
    return "-".join(baselines.names[k] for k in (*loop.points, loop.points[0]))


def _session_table(sessions: Sequence[SessionResult]) -> ReportTable:
    columns: list[tuple[ColumnHead, Callable[[SessionResult], Cell]]] = [
        (ColumnHead("Session", numeric=False), lambda s: text_cell(s.name)),
        (ColumnHead("Points", numeric=False), lambda s: text_cell(", ".join(_points(s)))),
        (ColumnHead("start", numeric=False), lambda s: text_cell(calendar(_span(s)[0]))),
        (ColumnHead("end", numeric=False), lambda s: text_cell(calendar(_span(s)[1]))),
        (ColumnHead("interval", "s"), lambda s: fixed_cell(s.baselines[0].interval, 0)),
        (ColumnHead("baselines"), lambda s: fixed_cell(len(s.baselines), 0)),
        (ColumnHead("systems", numeric=False), lambda s: text_cell(s.baselines[0].systems)),
    ]
    note = "Times are those of the files, GPS time unless they say otherwise."
    return build_table("gnss-sessions", "GNSS sessions", note, sessions, columns)


def _points(session: SessionResult) -> list[str]:
    return list(dict.fromkeys(name for b in session.baselines for name in b.names))


def _span(session: SessionResult) -> tuple[float, float]:
    return min(b.start for b in session.baselines), max(b.end for b in session.baselines)


def _baseline_table(sessions: Sequence[SessionResult]) -> ReportTable:
    Row = tuple[SessionResult, Baseline]  # noqa: N806  a local name of a type
    columns: list[tuple[ColumnHead, Callable[[Row], Cell]]] = [
        (ColumnHead("From", numeric=False), lambda r: text_cell(r[1].names[0])),
        (ColumnHead("To", numeric=False), lambda r: text_cell(r[1].names[1])),
        (ColumnHead("Session", numeric=False), lambda r: text_cell(r[0].name)),
        (ColumnHead("antenna from", "m"), lambda r: fixed_cell(r[1].heights[0], 4)),
        (ColumnHead("antenna to", "m"), lambda r: fixed_cell(r[1].heights[1], 4)),
        (ColumnHead("length", "m"), lambda r: fixed_cell(r[1].length, 4)),
        *(
            (
                ColumnHead(f"σ {axis}", "mm"),
                lambda r, k=k: mm_cell(float(np.sqrt(r[1].covariance[k, k])), 1),
            )
            for k, axis in enumerate("XYZ")
        ),
        (ColumnHead("ambiguities", numeric=False), lambda r: _ambiguities(r[1])),
        (ColumnHead("fixed", "%"), lambda r: fixed_cell(100 * r[1].fixed_share, 1)),
        (ColumnHead("epochs"), lambda r: fixed_cell(r[1].epochs, 0)),
        (ColumnHead("of"), lambda r: fixed_cell(r[1].epochs_common, 0)),
        (ColumnHead("ratio"), lambda r: fixed_cell(r[1].ratio, 1)),
        (ColumnHead("satellites"), lambda r: fixed_cell(r[1].satellites, 1)),
        (ColumnHead("phases", "mm"), lambda r: _residual(r[1])),
        (ColumnHead("σ factor"), lambda r: fixed_cell(r[1].factor, 2)),
        (ColumnHead("pieces"), lambda r: _pieces(r[1])),
    ]
    note = (
        "Antennas: heights of their reference points over the marks, between which baselines are. "
        "Standard deviations are the formal ones of the engine times the factor, and for float "
        "baselines the scatter of the epochs at the end of the session. Ambiguities: those at the "
        "end; fixed: share of the solved epochs; ratio: of the ambiguity test, median over the "
        "end; phases: root mean square of the residuals of their double differences; pieces: "
        "scatter of the pieces of the session over what they state, before sigmas were widened."
    )
    return build_table("gnss-baselines", "GNSS baselines", note, _all(sessions), columns)


def _attempt_table(sessions: Sequence[SessionResult]) -> ReportTable:
    Row = tuple[Baseline, Attempt]  # noqa: N806  a local name of a type
    columns: list[tuple[ColumnHead, Callable[[Row], Cell]]] = [
        (ColumnHead("From", numeric=False), lambda r: text_cell(r[0].names[0])),
        (ColumnHead("To", numeric=False), lambda r: text_cell(r[0].names[1])),
        (ColumnHead("way", numeric=False), lambda r: text_cell(r[1].what)),
        (ColumnHead("ambiguities", numeric=False), lambda r: _ambiguities(r[1])),
        (ColumnHead("fixed", "%"), lambda r: fixed_cell(100 * r[1].fixed_share, 1)),
        (ColumnHead("ratio"), lambda r: fixed_cell(r[1].ratio, 1)),
        (ColumnHead("σ", "mm"), lambda r: mm_cell(r[1].sigma, 1)),
        (ColumnHead("pieces"), lambda r: fixed_cell(r[1].pieces, 0)),
        (ColumnHead("scatter", "mm"), lambda r: _scatter(r[1])),
        (ColumnHead("from the first", "mm"), lambda r: mm_cell(r[1].away, 1)),
        (ColumnHead("taken", numeric=False), lambda r: text_cell(_yes(r[1].taken))),
    ]
    note = (
        "Ways of computing baselines that were doubtful as they were asked for. Scatter: of the "
        "pieces of the session, each computed by itself, in space."
    )
    rows = [(b, a) for _, b in _all(sessions) for a in b.attempts]
    return build_table("gnss-attempts", "Doubtful baselines", note, rows, columns)


def _scatter(attempt: Attempt) -> Cell:
    return text_cell("") if attempt.scatter is None else mm_cell(attempt.scatter, 1)


def _residual(baseline: Baseline) -> Cell:
    value = baseline.residual
    return text_cell("") if value is None else mm_cell(value, 1)


def _ambiguities(of: Baseline | Attempt) -> Cell:
    return text_cell(of.ambiguities, "" if of.ambiguities == "fixed" else "bad")


def _pieces(baseline: Baseline) -> Cell:
    found = baseline.pieces
    if found is None:
        return text_cell("")
    return fixed_cell(found.ratio, 2, "" if found.agree else "bad")


def _loop_table(baselines: BaselineSet, loops: Sequence[BaselineLoop]) -> ReportTable:
    columns: list[tuple[ColumnHead, Callable[[BaselineLoop], Cell]]] = [
        (ColumnHead("Loop", numeric=False), lambda loop: text_cell(_path(baselines, loop))),
        (ColumnHead("minimal", numeric=False), lambda loop: text_cell(_yes(loop.independent))),
        (ColumnHead("length", "m"), lambda loop: fixed_cell(loop.length, 1)),
        *(
            (ColumnHead(axis, "mm"), lambda loop, k=k: mm_cell(float(loop.closure[k]), 1))
            for k, axis in enumerate("ENU")
        ),
        (ColumnHead("closure", "mm"), lambda loop: mm_cell(loop.size, 1)),
        (ColumnHead("closure", "ppm"), lambda loop: fixed_cell(loop.ppm, 2)),
        (ColumnHead("test"), lambda loop: fixed_cell(loop.statistic, 2)),
        (ColumnHead("limit"), lambda loop: fixed_cell(loop.limit, 2)),
        (ColumnHead("verdict", numeric=False), _verdict),
    ]
    note = (
        "Closure: sum of the baselines around the loop, along E, N, U; test: its square in the "
        "metric of its covariance against chi-square at 5 %."
    )
    rows = sorted(loops, key=lambda loop: -loop.size)
    return build_table("gnss-loops", "GNSS loops", note, rows, columns)


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def _verdict(loop: BaselineLoop) -> Cell:
    if loop.dof == 0:
        return text_cell("tells nothing")
    return text_cell("closes", "good") if loop.passes else text_cell("fails", "bad")


def _map(
    adjustment: Adjustment,
    baselines: BaselineSet,
    loops: Sequence[BaselineLoop],
    sessions: Sequence[SessionResult],
) -> Any:
    # by their files as well: a baseline that was measured twice has two lines
    of_ends = {
        (*sorted(b.names), f"{b.files[0]}, {b.files[1]}"): (s.name, b.ambiguities)
        for s, b in _all(sessions)
    }
    bad = {k for loop in loops if not loop.passes for k, _ in loop.walk}
    lines = []
    for k, (a, b) in enumerate(zip(baselines.start.tolist(), baselines.end.tolist(), strict=True)):
        ends = sorted((baselines.names[a], baselines.names[b]))
        session, state = of_ends.get((*ends, str(baselines.source[k])), ("", "fixed"))
        lines.append(MapLine(a, b, session, state == "float", k in bad))
    return baseline_map(adjustment.state.positions[:, :2], baselines.names, lines)


def _data(
    baselines: BaselineSet,
    loops: Sequence[BaselineLoop],
    sessions: Sequence[SessionResult],
    reference: Reference,
) -> GnssPart:
    of_sessions = tuple(SessionBaseline(**vars(b), session=s.name) for s, b in _all(sessions))
    names = [tuple(baselines.names[k] for k in loop.points) for loop in loops]
    named = [NamedLoop(**vars(loop), names=n) for loop, n in zip(loops, names, strict=True)]
    return GnssPart(reference.frame, reference.epoch, of_sessions, tuple(named))


SUBJECT = Subject("gnss", _chapters, GnssPart)
