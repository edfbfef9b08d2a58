"""The chapter of the report on how stations hang together: pairs, their tests, the graph."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from tribrach.answers import Result
from tribrach.geometry.pose import Pose
from tribrach.network.adjustment import Adjustment
from tribrach.observations.registry import kind_named
from tribrach.registration.clouds.reference import (
    PlacedOn,
    ReferenceOffset,
    UsedReference,
    offset_sentence,
)
from tribrach.registration.edges import ALPHA, MOST, Edge, edges
from tribrach.registration.views import Agreement, seen
from tribrach.report.chapter import Chapter
from tribrach.report.charts import HALF, Chart, beside
from tribrach.report.columns import ColumnSet
from tribrach.report.content import Head
from tribrach.report.figures import Picture
from tribrach.report.numbers import Style, counted, percent_cell
from tribrach.report.references import reference_tables
from tribrach.report.subject import Subject
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    Spec,
    build_table,
    text_cell,
)
from tribrach.report.warnings import Severity, warned
from tribrach.sentences import Sentence, capital

if TYPE_CHECKING:
    from tribrach.job.results import JobResults
    from tribrach.job.tie import Registered

#: a pair with this share of one station's points in the open space of the other is spoken of
_CONFLICT = 0.12
#: largest ratio of test to limit in the colours of the graph
_WORST = 2.0


@dataclass(frozen=True)
class RegistrationPart(Result, maybe=("references", "offsets", "placed_on")):
    """Pairs of stations with observations in common."""

    edges: list[Edge]
    sentences: list[str]
    #: what scans were placed on, where it lies, and how much of each scan lies there; left out
    #: without any
    references: tuple[UsedReference, ...] = ()
    offsets: tuple[ReferenceOffset, ...] = ()
    placed_on: tuple[PlacedOn, ...] = ()


@dataclass(frozen=True)
class _Pair:
    """An edge with how the views of its stations overlap, None where there are none."""

    edge: Edge
    seen: Agreement | None

    @property
    def kind(self) -> str:
        """What ties them, in words."""
        return kind_named(self.edge.kind).facts.common_to_stations

    @property
    def stations(self) -> str:
        """Both stations."""
        return f"{self.edge.first} - {self.edge.second}"


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter, where scans were tied and pairs of stations have something in common."""
    if job.registered is None:
        return
    registered, adjustment = job.registered, head.adjustment
    pair_edges = edges(adjustment)
    if not pair_edges:
        return
    seen = _views(registered, adjustment)
    pairs = [_Pair(e, seen.get(frozenset((e.first, e.second)))) for e in pair_edges]
    on = registered.references
    offsets = tuple(ReferenceOffset.of(place, adjustment) for place in on.places)
    tested = [said for said in map(offset_sentence, offsets) if said is not None]
    unfit = [said for o in offsets if o.fits is False and (said := offset_sentence(o))]
    yield Chapter(
        "registration",
        "Registration",
        _sentences([*registered.sentences, *tested, *_verdict(pair_edges)]),
        (_graph(adjustment, pair_edges),),
        (_table(pairs, head.columns), *reference_tables(on.used, offsets, on.placed_on)),
        RegistrationPart(
            edges=[_record(pair) for pair in pairs],
            sentences=[*registered.sentences, *tested],
            references=on.used,
            offsets=offsets,
            placed_on=on.placed_on,
        ),
        warned(
            Severity.BLUNDER,
            [*unfit, *_outliers(pair_edges, head.columns.style), *_contradictions(seen)],
            "pairs",
        ),
    )


def _sentences(texts: Sequence[str]) -> tuple[str, ...]:
    """Texts with a capital and a full stop."""
    return tuple(capital(text) + "." for text in texts)


def _views(registered: Registered, adjustment: Adjustment) -> dict[frozenset[str], Agreement]:
    """How the points of either station stand in the view of the other, by pairs."""
    layout, state = adjustment.layout, adjustment.state
    placed = [s for s in registered.stations if layout.has("pose", s.name)]
    at = {s.name: layout.index("pose", s.name) for s in placed}
    poses = {name: Pose(state.pose_r[k], state.pose_t[k]) for name, k in at.items()}
    out = {}
    for a, b in combinations(placed, 2):
        moved = poses[a.name].inverse @ poses[b.name]
        out[frozenset((a.name, b.name))] = seen(a, b, moved)[0]
    return out


def _verdict(pair_edges: Sequence[Edge]) -> list[str]:
    """How many pairs agree with the network."""
    tested = [e for e in pair_edges if e.statistic is not None]
    bad = [e for e in tested if e.outlying]
    verb = "has" if len(pair_edges) == 1 else "have"
    shared = f"{counted(len(pair_edges), 'pair')} of stations {verb} observations in common"
    if not tested:
        return [f"{shared}; none of them is controlled by other observations"]
    contradict = "contradicts" if len(bad) < 2 else "contradict"
    return [
        Sentence(
            "{shared}; others control {tested} of them, of which {bad} {contradict} the "
            "network (tests at {alpha:%g})",
            shared=shared,
            tested=len(tested),
            bad=len(bad) or "none",
            contradict=contradict,
            alpha=ALPHA,
        )
    ]


def _outliers(pair_edges: Sequence[Edge], style: Style) -> list[str]:
    """Pairs that the network contradicts, the worst first, and a station that all of them share."""
    bad = sorted((e for e in pair_edges if e.outlying), key=lambda e: -(e.ratio or 0.0))
    sentences: list[str] = [
        Sentence(
            "{e.first} and {e.second} by {kind_named}: their own relative pose differs "
            "from the network by {size}, expected {expected} (test {e.statistic:1} against "
            "{e.limit:1})",
            e=e,
            kind_named=kind_named(e.kind).facts.common_to_stations,
            size=_size(e.shift, e.turn, style),
            expected=_size(e.shift_sigma, e.turn_sigma, style),
        )
        for e in bad[:10]
    ]
    if len(bad) > 2:
        shared = set.intersection(*({e.first, e.second} for e in bad))
        sentences += [
            f"all of these pairs have station {name} in common" for name in sorted(shared)
        ]
    return sentences


def _size(shift: float, turn: float, style: Style) -> str:
    """A relative pose in words."""
    return Sentence("{shift:mm1} and {turn}", shift=shift, turn=style.said(turn, "rad", 1))


def _contradictions(seen: dict[frozenset[str], Agreement]) -> list[str]:
    """Pairs whose surfaces stand in each other's open space."""
    return [
        Sentence(
            "{s.conflict:%} of the surfaces that {pair} should both see stand where the "
            "other looks through: moving things, or a wrong pose",
            s=s,
            pair=" and ".join(sorted(pair)),
        )
        for pair, s in seen.items()
        if s.agree > 100 and s.conflict > _CONFLICT
    ]


def _table(pairs: Sequence[_Pair], columns: ColumnSet) -> ReportTable:
    """Every pair, kind by kind, the most improbable first."""
    specs: list[Spec] = [
        columns.word("Stations", "stations"),
        columns.word("tied by", "kind"),
        columns.plain("in common", "edge.count", 0),
        (ColumnHead("overlap", "%"), _share("overlap")),
        (ColumnHead("see through", "%", wide=True), _share("conflict")),
        columns.mm("residual RMS", lambda p: p.edge.rms, 3),
        columns.plain("held of 6", "edge.held", 0),
        columns.mm("observed shift", lambda p: p.edge.shift, 3),
        columns.mm("predicted shift", lambda p: p.edge.shift_sigma, 3),
        columns.small_angle("observed turn", lambda p: p.edge.turn),
        columns.small_angle("predicted turn", lambda p: p.edge.turn_sigma),
        columns.plain("test", "edge.statistic"),
        columns.plain("limit", "edge.limit"),
        (ColumnHead("verdict", numeric=False), _judged),
    ]
    note = Sentence(
        "Each pair by its own observations against the network: the differences of the "
        "relative pose (of the second station, along the directions that the pair "
        "holds) and what they should be from the covariances. The test is the squared "
        "difference in that metric against chi-square at {level:%g}. Overlap: share of "
        "the points of both scans on surfaces that both see. The residual RMS is that of all "
        "adjusted lengths of the pair, without any limit, and not an accuracy. Of each kind the "
        "table has at most {most} pairs, those "
        "with most in common.",
        level=1 - ALPHA,
        most=MOST,
    )
    rows = sorted(pairs, key=lambda p: -(p.edge.ratio or 0.0))
    return build_table("edges", "Pairs of stations", note, rows, specs, _state)


def _share(name: str) -> Any:
    """A share of points in per cent."""

    def cell(pair: _Pair) -> Cell:
        return percent_cell(None if pair.seen is None else float(getattr(pair.seen, name)))

    return cell


def _judged(pair: _Pair) -> Cell:
    if pair.edge.statistic is None:
        return text_cell("not controlled")
    return text_cell("contradicts", "bad") if pair.edge.outlying else text_cell("agrees", "good")


def _state(pair: _Pair) -> str:
    return "suspicious" if pair.edge.outlying else ""


def _record(pair: _Pair) -> Edge:
    """An edge with how its views overlap."""
    if pair.seen is None:
        return pair.edge
    return replace(pair.edge, overlap=pair.seen.overlap, conflict=pair.seen.conflict)


def _graph(adjustment: Adjustment, pair_edges: Sequence[Edge]) -> Picture:
    """Stations in plan, pairs coloured by the worst of their tests."""
    layout, state = adjustment.layout, adjustment.state
    names = sorted({name for e in pair_edges for name in (e.first, e.second)})
    plan = {name: state.pose_t[layout.index("pose", name), :2] for name in names}
    xy = np.array([plan[name] for name in names])
    low, high = xy.min(axis=0), xy.max(axis=0)
    margin = 0.12 * max(float((high - low).max()), 1.0)
    chart = Chart(
        (low[0] - margin, high[0] + margin), (low[1] - margin, high[1] + margin),
        ("E [m]", "N [m]"), HALF, equal=True,
    )  # fmt: skip
    for first, second in sorted({(e.first, e.second) for e in pair_edges}):
        group = [e for e in pair_edges if (e.first, e.second) == (first, second)]
        _line(chart, group, np.array([plan[first], plan[second]]))
    chart.points(xy[:, 0], xy[:, 1], names)
    for name in names:
        chart.name(float(plan[name][0]), float(plan[name][1]), name)
    caption = (
        "Stations in plan. Lines join stations with observations in common, green where the worst "
        "test of the pair is within its limit, red where it is above, which contradicts the "
        "network, and grey where nothing controls it; a line that is pointed at says the ratio. "
        "Dashed where the pair by itself leaves a direction open."
    )
    drawing = beside([[chart]], "Graph of the registration")
    return Picture("registration-graph", "Graph of the registration", drawing, caption)


def _line(chart: Chart, group: Sequence[Edge], ends: np.ndarray[Any, Any]) -> None:
    """One pair of stations."""
    worst = max((e.ratio for e in group if e.ratio is not None), default=None)
    colour = "faint" if worst is None else "good" if worst <= 1 else "bad"
    words = f"{group[0].first} and {group[0].second}: "
    words += (
        "not controlled"
        if worst is None
        else Sentence("worst test {worst:2} times its limit", worst=worst)
    )
    dashed = max(e.held for e in group) != 6
    chart.line(ends[:, 0], ends[:, 1], colour, dashed=dashed, words=words)


SUBJECT = Subject("registration", _chapters, RegistrationPart)
