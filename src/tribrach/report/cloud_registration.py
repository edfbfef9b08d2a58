"""The registration of clouds as tables and as a page with plans: pairs, loops, stations."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal

import numpy as np

from tribrach._types import Array
from tribrach.report.charts import TESTED, Chart, beside, colour_bar, shade
from tribrach.report.figures import Picture
from tribrach.report.names import some_of
from tribrach.report.numbers import arcsec_cell, count_cell, counted, mm_cell
from tribrach.report.page import FrontPage, page
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    build_table,
    number_cell,
    text_cell,
)

if TYPE_CHECKING:
    from tribrach.job.register import RegisteredFiles
    from tribrach.registration.clouds.graph import StationLoop
    from tribrach.registration.clouds.pair import CloudPair, PairFit
    from tribrach.registration.clouds.together import CloudGroup, CloudRegistration
    from tribrach.registration.edges import Edge

#: largest ratio of test to limit in the colours of the plan
_WORST = 2.0
#: colour of standing surfaces
_WALLS = 168.0
#: margin of a plan around stations and walls [share], and share of the walls beyond it on a side
_MARGIN, _OUTER = 0.05, 0.05
#: directions of a pose, and stations that the verdict names
_ALL, _IN_VERDICT = 6, 4

__all__ = ["cloud_registration_page", "cloud_registration_tables"]


def cloud_registration_tables(registration: CloudRegistration) -> list[ReportTable]:
    """Pairs that were registered, loops, and the stations of each group."""
    out = [_pairs(registration)]
    if registration.consistency.loops:
        out.append(_loops(registration))
    joined = [group for group in registration.groups if group.adjustment is not None]
    return out + [_stations(group, number) for number, group in enumerate(joined)]


def cloud_registration_page(files: RegisteredFiles) -> str:
    """The whole registration as one HTML file: plans, poses, pairs with verdicts, loops."""
    registration = files.registration
    joined = [group for group in registration.groups if group.adjustment is not None]
    pictures = [_plan(group, registration, files.walls, k) for k, group in enumerate(joined)]
    pairs, *rest = cloud_registration_tables(registration)
    sentences = [_sentence(text) for text in files.sentences]
    return page(
        "Registration of clouds",
        f"{len(files.scans)} scans registered by their clouds",
        _front(registration),
        sentences,
        pictures,
        [*rest, _verdicts(registration), pairs, _refused(registration), _files(files)],
        "Covariances are a priori. The residuals of a fit are no accuracy: a pair is as good as "
        "its sigmas, which hold the floor, and as the loops that it is in.",
    )


def _head(registration: CloudRegistration) -> str:
    """How many pairs there are, and which station is known least."""
    done, tried = sum(p.fit is not None for p in registration.pairs), len(registration.pairs)
    scans = sum(len(group.stations) for group in registration.groups)
    possible = scans * (scans - 1) // 2
    words = f"{done} of {counted(tried, 'pair')} that {'was' if tried == 1 else 'were'} tried "
    words += f"{'was' if done == 1 else 'were'} registered"
    if possible != tried:
        words += f", of {possible} that are possible"
    sigmas = _place_sigmas(registration.groups[0])
    if not sigmas:
        return f"{words}."
    worst = max(sigmas, key=lambda name: sigmas[name])
    size = sigmas[worst]
    told = f"{1e3 * size:.1f} mm" if size < 1 else f"{size:.1f} m"
    return f"{words}. The place of {worst} is known least, σ {told}."


def _place_sigmas(group: CloudGroup) -> dict[str, float]:
    """Sigma of the place of every station but the first [m], three-dimensional."""
    out = {}
    for name in group.stations[1:]:
        variance = np.diag(group.covariances[name])[:3]
        out[name] = float(np.sqrt(np.maximum(variance, 0.0).sum()))
    return out


def _loosely_held(registration: CloudRegistration, group: CloudGroup) -> list[str]:
    """Stations of a group whose pairs all leave a direction open."""
    held: dict[str, int] = {}
    for pair in registration.pairs:
        if pair.fit is not None:
            for name in (pair.a, pair.b):
                held[name] = max(held.get(name, 0), pair.fit.precision.rank)
    return [name for name in group.stations if held.get(name, _ALL) < _ALL]


def _front(registration: CloudRegistration) -> FrontPage:
    """Whether all scans hang together and the loops close."""
    first, *_ = registration.groups[0].stations
    largest = len(registration.groups[0].stations)
    scans = sum(len(group.stations) for group in registration.groups)
    loops = registration.consistency.loops
    closed = sum(loop.closes for loop in loops)
    outlying = sum(edge.outlying for group in registration.groups for edge in group.edges)
    every = "Both scans" if scans == 2 else f"All {scans} scans"
    words = [f"{every if largest == scans else f'{largest} of {scans} scans'} hang together"]
    if loops:
        verb = "closes" if closed == 1 else "close"
        words.append(f"{closed} of {counted(len(loops), 'loop')} {verb}")
    elif largest > 1:
        words.append("there is no loop to control them")
    if outlying:
        verb = "contradicts" if outlying == 1 else "contradict"
        words.append(f"{counted(outlying, 'pair')} {verb} the network")
    loose = _loosely_held(registration, registration.groups[0])
    if loose:
        words.append(f"no pair holds {some_of(loose, _IN_VERDICT)} in all directions")
    whole = largest == scans and loops and closed == len(loops) and not outlying and not loose
    sort: Literal["good", "bad", "none"] = "good" if whole else "none" if largest > 1 else "bad"
    signed = f"Poses of {largest} scans with their covariances, in the frame of {first}."
    return FrontPage(
        sort,
        "; ".join(words),
        _head(registration),
        signed=signed if largest > 1 else "",
    )


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}."


def _verdicts(registration: CloudRegistration) -> ReportTable:
    """What loops and the network say of each registered pair."""
    consistency = registration.consistency
    good = Counter(e.ends for loop in consistency.loops if loop.closes for e in loop.edges)
    bad = Counter(e.ends for loop in consistency.loops if not loop.closes for e in loop.edges)
    dropped = {e.ends for e in consistency.dropped}
    tests = _tests(registration)

    def ends(p: CloudPair) -> frozenset[str]:
        return frozenset((p.a, p.b))

    def tested(p: CloudPair, name: str) -> float | None:
        edge = tests.get(ends(p))
        return None if edge is None else getattr(edge, name)

    def plain(value: float | None) -> Cell:
        return number_cell(value, "" if value is None else f"{value:.1f}")

    def shift(p: CloudPair, name: str) -> Cell:
        value = tested(p, name)
        return text_cell("") if value is None else _mm(value)

    def verdict(p: CloudPair) -> Cell:
        edge = tests.get(ends(p))
        if ends(p) in dropped:
            return text_cell("left out: its loops do not close", "bad")
        if edge is not None and edge.outlying:
            return text_cell("contradicts the network", "bad")
        if edge is None or edge.statistic is None:
            return text_cell("not controlled")
        return text_cell("agrees", "good")

    columns = [
        (ColumnHead("Pair", numeric=False), lambda p: text_cell(f"{p.a} - {p.b}")),
        (ColumnHead("Loops that close"), lambda p: count_cell(good[ends(p)])),
        (ColumnHead("Loops that do not"), lambda p: count_cell(bad[ends(p)])),
        (ColumnHead("Shift to the network", "mm"), lambda p: shift(p, "shift")),
        (ColumnHead("Predicted", "mm"), lambda p: shift(p, "shift_sigma")),
        (ColumnHead("Test"), lambda p: plain(tested(p, "statistic"))),
        (ColumnHead("Limit"), lambda p: plain(tested(p, "limit"))),
        (ColumnHead("Verdict", numeric=False), verdict),
    ]
    note = (
        "Each pair by itself against the adjusted poses; the test is that of the report of a "
        "project. A pair that is in no loop is controlled by nothing."
    )
    pairs = [p for p in registration.pairs if p.fit is not None]
    return build_table("cloud_verdicts", "Verdicts on the pairs", note, pairs, columns)


def _tests(registration: CloudRegistration) -> dict[frozenset[str], Edge]:
    """Tests of pairs against the network."""
    return {frozenset((e.first, e.second)): e for group in registration.groups for e in group.edges}


def _refused(registration: CloudRegistration) -> ReportTable:
    """Pairs that were tried and have no pose."""
    columns = [
        (ColumnHead("Pair", numeric=False), lambda p: text_cell(f"{p.a} - {p.b}")),
        (ColumnHead("Why", numeric=False), lambda p: text_cell("; ".join(p.sentences))),
    ]
    pairs = [p for p in registration.pairs if p.fit is None]
    return build_table("cloud_refused", "Pairs that were not registered", "", pairs, columns)


def _files(files: RegisteredFiles) -> ReportTable:
    """The scans, and what of them took part."""
    beams = {n: s.no_return.points if s.no_return else 0 for n, s in files.scans.items()}
    columns = [
        (ColumnHead("Scan", numeric=False), text_cell),
        (ColumnHead("File", numeric=False), lambda n: text_cell(files.scans[n].path.name)),
        (ColumnHead("Points"), lambda n: count_cell(files.points[n])),
        (ColumnHead("Beams without return"), lambda n: count_cell(beams[n])),
    ]
    return build_table("cloud_scans", "Scans", "", list(files.scans), columns)


def _plan(
    group: CloudGroup, registration: CloudRegistration, walls: Mapping[str, Array], number: int
) -> Picture:
    """Stations of a group in plan, with walls and the pairs between them."""
    placed = [
        (group.poses[name] @ walls.get(name, np.empty((0, 3))))[:, :2] for name in group.stations
    ]
    seen = np.concatenate(placed)
    at = {name: group.poses[name].translation[:2] for name in group.stations}
    xy = np.array(list(at.values()))
    # a few walls far away would make the stations small
    low, high = np.quantile(np.concatenate([seen, xy]), [_OUTER, 1 - _OUTER], axis=0)
    low, high = np.minimum(low, xy.min(axis=0)), np.maximum(high, xy.max(axis=0))
    margin = _MARGIN * float((high - low).max()) + 1.0
    chart = Chart(
        (low[0] - margin, high[0] + margin), (low[1] - margin, high[1] + margin),
        ("x [m]", "y [m]"), (900.0, 640.0), equal=True,
    )  # fmt: skip
    chart.spots(seen[:, 0], seen[:, 1], np.full((len(seen), 3), _WALLS))
    tests = _tests(registration)
    for edge in registration.consistency.used:
        if edge.ends <= set(at):
            test = tests.get(edge.ends)
            ratio = None if test is None else test.ratio
            words = f"{edge.first} and {edge.second}: "
            if ratio is None:
                colour, words = "faint", words + "nothing controls it"
            else:
                colour = shade(min(ratio / _WORST, 1.0), TESTED)
                words += f"test {ratio:.2f} times its limit"
            _line(chart, at[edge.first], at[edge.second], colour, words)
    for edge in registration.consistency.dropped:
        if edge.ends <= set(at):
            words = f"{edge.first} and {edge.second}: taken away, a loop does not close"
            _line(chart, at[edge.first], at[edge.second], "bad", words, dashed=True)
    loose = [name for name in _loosely_held(registration, group) if name != group.stations[0]]
    for name, place in at.items():
        sort: Literal["station", "loose"] = "loose" if name in loose else "station"
        chart.place(float(place[0]), float(place[1]), name, sort)
    caption = (
        f"Stations in the frame of {group.stations[0]} and some of the standing surfaces that they "
        "saw. Lines are pairs, coloured by their test against the network (above 1: it "
        "contradicts), grey where nothing controls them, dashed where a loop that does not close "
        "took them away; a line that is pointed at says its test."
    )
    if loose:
        them = "it" if len(loose) == 1 else "them"
        caption += (
            f" Hollow: {some_of(loose, _IN_VERDICT)}, whose place is not known, since no pair "
            f"holds {them} in all directions."
        )
    scale = colour_bar(0.0, _WORST, "test of the pair over its limit", 900.0, TESTED)
    title = "Stations in plan"
    drawing = beside([[chart]], title, scale)
    return Picture(f"plan-{number + 1}", title, drawing, caption, wide=True)


def _line(
    chart: Chart, one: Array, two: Array, colour: str, words: str, *, dashed: bool = False
) -> None:
    """A pair of stations."""
    chart.line((one[0], two[0]), (one[1], two[1]), colour, dashed=dashed, words=words)


def _pairs(registration: CloudRegistration) -> ReportTable:
    """One row for each registered pair."""
    pairs = [p for p in registration.pairs if p.fit is not None]
    placed = {
        frozenset(k): d for group in registration.groups for k, d in group.differences.items()
    }

    def fit(p: CloudPair) -> PairFit:
        assert p.fit is not None
        return p.fit

    def sigma(p: CloudPair, first: int) -> float:
        part = np.diag(fit(p).precision.local)[first : first + 3]
        return float(np.sqrt(part.sum()))

    def difference(p: CloudPair, which: str) -> Cell:
        one = placed.get(frozenset((p.a, p.b)))
        return text_cell("") if one is None else _mm(getattr(one, which))

    columns = [
        (ColumnHead("Pair", numeric=False), lambda p: text_cell(f"{p.a} - {p.b}")),
        (
            ColumnHead("Overlap", "%"),
            lambda p: number_cell(
                max(fit(p).verdict.overlap), f"{100 * max(fit(p).verdict.overlap):.0f}"
            ),
        ),
        (ColumnHead("RMS", "mm"), lambda p: _mm(fit(p).alignment.rms)),
        (ColumnHead("within", "mm"), lambda p: _mm(fit(p).alignment.gate)),
        (
            ColumnHead("Matches", wide=True),
            lambda p: number_cell(
                len(fit(p).alignment.matches), str(len(fit(p).alignment.matches))
            ),
        ),
        (
            ColumnHead("Effective", wide=True),
            lambda p: number_cell(fit(p).precision.effective, f"{fit(p).precision.effective:.0f}"),
        ),
        (ColumnHead("Sigma shift", "mm"), lambda p: _mm(sigma(p, 0))),
        (ColumnHead("Sigma turn", '"'), lambda p: _arcsec(sigma(p, 3))),
        (ColumnHead("Held", "of 6"), lambda p: _held(fit(p).precision.rank)),
        (ColumnHead("Observed", "mm", wide=True), lambda p: difference(p, "observed")),
        (ColumnHead("Predicted", "mm", wide=True), lambda p: difference(p, "predicted")),
    ]
    tried = len(registration.pairs)
    title = f"Registered pairs ({len(pairs)} of {tried} tried)"
    note = (
        "Sigmas a priori, of the middle of the overlap, with the floor. RMS is the root mean "
        "square of the residuals of the matches within the limit beside it; larger ones are not "
        "in it."
    )
    return build_table("cloud_pairs", title, note, pairs, columns)


def _loops(registration: CloudRegistration) -> ReportTable:
    """One row for each loop."""
    columns = [
        (
            ColumnHead("Loop", numeric=False),
            lambda x: text_cell(" - ".join((*x.stations, x.stations[0]))),
        ),
        (ColumnHead("Shift", "mm"), lambda x: _mm(x.shift)),
        (ColumnHead("Predicted", "mm"), lambda x: _mm(x.shift_sigma)),
        (ColumnHead("Turn", '"'), lambda x: _arcsec(x.turn)),
        (ColumnHead("Predicted", '"'), lambda x: _arcsec(x.turn_sigma)),
        (ColumnHead("Test"), lambda x: number_cell(x.statistic, f"{x.statistic:.1f}")),
        (ColumnHead("Limit", wide=True), lambda x: number_cell(x.limit, f"{x.limit:.1f}")),
        (ColumnHead("Closes", numeric=False), _closes),
    ]
    return build_table("cloud_loops", "Loops", "", list(registration.consistency.loops), columns)


def _stations(group: CloudGroup, number: int) -> ReportTable:
    """One row for each station."""
    first = group.stations[0]

    def sigma(name: str, begin: int) -> float:
        part = np.diag(group.covariances[name])[begin : begin + 3]
        return float(np.sqrt(np.maximum(part, 0.0).sum()))

    def coordinate(axis: int) -> tuple[ColumnHead, object]:
        def cell(name: str) -> Cell:
            value = float(group.poses[name].translation[axis])
            return number_cell(value, f"{value:.4f}")

        return ColumnHead("xyz"[axis], "m"), cell

    def heading(name: str) -> Cell:
        r = group.poses[name].rotation
        value = float(np.degrees(np.arctan2(r[1, 0], r[0, 0])))
        return number_cell(value, f"{value:.4f}")

    columns = [
        (ColumnHead("Station", numeric=False), text_cell),
        *(coordinate(axis) for axis in range(3)),
        (ColumnHead("Turn about z", "°"), heading),
        (ColumnHead("Sigma place", "mm"), lambda name: _mm(sigma(name, 0))),
        (ColumnHead("Sigma turn", '"'), lambda name: _arcsec(sigma(name, 3))),
    ]
    title = f"Stations in the frame of {first}, which is held"
    anchor = "cloud_stations" if number == 0 else f"cloud_stations_{number + 1}"
    return build_table(anchor, title, "", list(group.stations), columns)  # type: ignore[arg-type]


def _mm(value: float) -> Cell:
    """Millimetres, without decimals where they would be more than a metre."""
    return mm_cell(value, 2 if value < 1 else 0)


def _arcsec(value: float) -> Cell:
    """Arc seconds, without decimals where the angle is large."""
    return arcsec_cell(value, 1 if value < 0.1 else 0)


def _held(rank: int) -> Cell:
    return count_cell(rank, "" if rank == 6 else "bad")


def _closes(loop: StationLoop) -> Cell:
    return text_cell("yes" if loop.closes else "no", "" if loop.closes else "bad")
