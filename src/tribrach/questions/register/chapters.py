"""What a registration of clouds says: verdict, plans, pairs, loops, stations."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np

from tribrach._types import Array
from tribrach.answers import Form
from tribrach.questions.register.registration import RegisteredFiles
from tribrach.registration.clouds.pair import CloudPair
from tribrach.registration.clouds.together import CloudGroup, CloudRegistration
from tribrach.registration.edges import Edge
from tribrach.report.answer import Answer
from tribrach.report.charts import TESTED, Chart, beside, colour_bar, shade
from tribrach.report.columns import column, millimetres
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding
from tribrach.report.names import some_of
from tribrach.report.numbers import counted
from tribrach.report.page import FrontPage
from tribrach.report.references import reference_tables
from tribrach.report.tables import ReportTable, Spec, build_table
from tribrach.sentences import Sentence, capital, joined, stopped, written

FORM = Form("register", RegisteredFiles, 1)
#: largest ratio of test to limit in the colours of the plan
_WORST = 2.0
#: colour of standing surfaces
_WALLS = 168.0
#: margin of a plan around stations and walls [share], and share of the walls beyond it on a side
_MARGIN, _OUTER = 0.05, 0.05
#: directions of a pose, and stations that the verdict names
_ALL, _IN_VERDICT = 6, 4


def answer_of(files: RegisteredFiles) -> Answer:
    """The registration as people read it: plans, poses, pairs with verdicts, loops."""
    registration = files.registration
    joined = [group for group in registration.groups if group.adjustment is not None]
    bases = registration.references
    on_them = reference_tables(files.references, files.offsets, files.placed_on)
    stations = [_stations(group, k, bases) for k, group in enumerate(joined)]
    pairs, loops = _pairs(registration), _loops(registration)
    return Answer(
        "Registration of clouds",
        counted(len(files.files), "scan") + " registered by their clouds",
        _front(registration),
        files,
        FORM,
        findings=[Finding(stopped(capital(text)), key="file") for text in files.sentences],
        pictures=[_plan(group, registration, files.walls, k) for k, group in enumerate(joined)],
        tables=[
            loops, *on_them, *stations, _verdicts(registration), pairs,
            _refused(registration), _files(files),
        ],
        footer="Covariances are a priori. The residuals of a fit are no accuracy: a pair is as "
        "good as its sigmas, which hold the floor, and as the loops that it is in.",
        terminal=[
            pairs, *([loops] if loops.rows else []), *on_them, *stations,
            *(Finding(text, True, "file") for text in files.sentences),
        ],
    )  # fmt: skip


def _head(registration: CloudRegistration) -> str:
    """How many pairs there are, and which station is known least."""
    done, tried = sum(p.fit is not None for p in registration.pairs), len(registration.pairs)
    bases = len(registration.references)
    scans = sum(len(group.stations) for group in registration.groups) - bases
    possible = scans * (scans - 1) // 2 + scans * bases
    words = f"{done} of {counted(tried, 'pair')} that {'was' if tried == 1 else 'were'} tried "
    words += f"{'was' if done == 1 else 'were'} registered"
    if possible != tried:
        words += f", of {possible} that are possible"
    sigmas = _place_sigmas(registration.groups[0])
    if not sigmas:
        return f"{words}."
    worst = max(sigmas, key=lambda name: sigmas[name])
    size = sigmas[worst]
    told = Sentence("{size:mm1}", size=size) if size < 1 else Sentence("{size:m1}", size=size)
    return Sentence(
        "{words}. The place of {worst} is known least, σ {told}.",
        words=words,
        worst=worst,
        told=told,
    )


def _place_sigmas(group: CloudGroup) -> dict[str, float]:
    """Sigma of the place of every station but the first [m], three-dimensional."""
    return {name: _size(group.covariances[name], 0) for name in group.stations[1:]}


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
    bases = set(registration.references)
    largest = len(set(registration.groups[0].stations) - bases)
    scans = sum(len(group.stations) for group in registration.groups) - len(bases)
    placed = not bases or bool(bases & set(registration.groups[0].stations) and largest)
    loops = registration.consistency.loops
    closed = sum(loop.closes for loop in loops)
    outlying = sum(edge.outlying for group in registration.groups for edge in group.edges)
    every = {1: "The scan", 2: "Both scans"}.get(scans, f"All {scans} scans")
    all_of_them = every if largest == scans else f"{largest} of {scans} scans"
    if bases and placed:
        verb = "lies" if largest == 1 else "lie"
        words = [f"{all_of_them} {verb} on {first}"]
    elif bases:
        words = ["no scan was placed on a reference"]
    else:
        words = [f"{all_of_them} {'is' if largest == 1 else 'are'} connected"]
    unfit = [offset.name for offset in registration.offsets if offset.fits is False]
    if unfit:
        words.append(f"{some_of(unfit, _IN_VERDICT)} does not fit the rest")
    if loops:
        verb = "closes" if closed == 1 else "close"
        words.append(f"{closed} of {counted(len(loops), 'loop')} {verb}")
    elif largest > 1 or (bases and placed):
        words.append("there is no loop to control them")
    if outlying:
        verb = "contradicts" if outlying == 1 else "contradict"
        words.append(f"{counted(outlying, 'pair')} {verb} the network")
    loose = _loosely_held(registration, registration.groups[0])
    if loose:
        words.append(f"no pair holds {some_of(loose, _IN_VERDICT)} in all directions")
    whole = largest == scans and loops and closed == len(loops) and not outlying and not loose
    whole = whole and placed and not unfit
    together = placed and (largest > 1 or bool(bases))
    sort: Literal["good", "bad", "none"] = "good" if whole else "none" if together else "bad"
    signed = f"Poses of {largest} scans with their covariances, in the frame of {first}."
    return FrontPage(
        sort,
        "; ".join(words),
        _head(registration),
        signed=signed if together else "",
    )


def _arcsec(head: str, get: Any) -> Spec:
    """Arc seconds, without decimals where the angle is large."""
    spec = ("arcsec0~", "arcsec1~")
    return column(head, get, lambda v, _: written(v, spec[v < 0.1]), unit='"')


def _size(covariance: Array, first: int) -> float:
    """Sigma of three components together."""
    part = np.diag(covariance)[first : first + 3]
    return float(np.sqrt(np.maximum(part, 0.0).sum()))


_PAIR = column("Pair", lambda p: f"{p.a} - {p.b}")


def _verdicts(registration: CloudRegistration) -> ReportTable:
    """What loops and the network say of each registered pair."""
    consistency = registration.consistency
    good = Counter(e.ends for loop in consistency.loops if loop.closes for e in loop.edges)
    bad = Counter(e.ends for loop in consistency.loops if not loop.closes for e in loop.edges)
    dropped = {e.ends for e in consistency.dropped}
    tests = _tests(registration)

    def verdict(p: CloudPair) -> tuple[str, str]:
        edge = tests.get(_ends(p))
        if _ends(p) in dropped:
            return "left out: its loops do not close", "bad"
        if edge is not None and edge.outlying:
            return "contradicts the network", "bad"
        if edge is None or edge.statistic is None:
            return "not controlled", ""
        return "agrees", "good"

    def of_test(name: str) -> Any:
        return lambda p: getattr(tests.get(_ends(p)), name, None)

    columns = [
        _PAIR,
        column("Loops that close", lambda p: good[_ends(p)], "0"),
        column("Loops that do not", lambda p: bad[_ends(p)], "0"),
        millimetres("Shift to the network", of_test("shift")),
        millimetres("Predicted", of_test("shift_sigma")),
        column("Test", of_test("statistic"), "1"),
        column("Limit", of_test("limit"), "1"),
        column("Verdict", lambda p: verdict(p)[0], mark=lambda p: verdict(p)[1]),
    ]
    note = (
        "Each pair by itself against the adjusted poses; the test is that of the report of a "
        "project. A pair that is in no loop is controlled by nothing."
    )
    pairs = [p for p in registration.pairs if p.registered]
    return build_table("cloud_verdicts", "Verdicts on the pairs", note, pairs, columns)


def _ends(p: CloudPair) -> frozenset[str]:
    return frozenset((p.a, p.b))


def _tests(registration: CloudRegistration) -> dict[frozenset[str], Edge]:
    """Tests of pairs against the network."""
    return {frozenset((e.first, e.second)): e for group in registration.groups for e in group.edges}


def _refused(registration: CloudRegistration) -> ReportTable:
    """Pairs that were tried and have no pose."""
    columns = [_PAIR, column("Why", lambda p: joined("; ", p.sentences))]
    pairs = [p for p in registration.pairs if not p.registered]
    return build_table("cloud_refused", "Pairs that were not registered", "", pairs, columns)


def _files(files: RegisteredFiles) -> ReportTable:
    """The scans, and what of them took part."""
    columns = [
        column("Scan", "scan"),
        column("File", "file"),
        column("Points", "points", "0"),
        column("Beams without return", "no_return", "0"),
    ]
    return build_table("cloud_scans", "Scans", "", files.scans, columns)


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
                words += Sentence("test {ratio:2} times its limit", ratio=ratio)
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
    pairs = [p for p in registration.pairs if p.registered]
    placed = {
        frozenset(k): d for group in registration.groups for k, d in group.differences.items()
    }

    def difference(which: str) -> Any:
        return lambda p: getattr(placed.get(_ends(p)), which, None)

    columns = [
        _PAIR,
        column("Overlap", lambda p: max(p.overlap), "%0"),
        millimetres("RMS", "rms"),
        millimetres("within", "fit.alignment.gate"),
        column("Matches", lambda p: len(p.fit.alignment.matches), "0", wide=True),
        column("Effective", "effective_matches", "0", wide=True),
        millimetres("Sigma shift", lambda p: _size(p.fit.precision.local, 0)),
        _arcsec("Sigma turn", lambda p: _size(p.fit.precision.local, 3)),
        column(
            "Held",
            "held_directions",
            "0",
            unit="of 6",
            mark=lambda p: "" if p.held_directions == _ALL else "bad",
        ),
        millimetres("Observed", difference("observed"), wide=True),
        millimetres("Predicted", difference("predicted"), wide=True),
    ]
    title = f"Registered pairs ({len(pairs)} of {len(registration.pairs)} tried)"
    note = (
        "Sigmas a priori, of the middle of the overlap, with the floor. RMS is the root mean "
        "square of the residuals of the matches within the limit beside it; larger ones are not "
        "in it."
    )
    return build_table("cloud_pairs", title, note, pairs, columns)


def _loops(registration: CloudRegistration) -> ReportTable:
    """One row for each loop."""
    columns = [
        column("Loop", lambda x: " - ".join((*x.stations, x.stations[0]))),
        millimetres("Shift", "shift"),
        millimetres("Predicted", "shift_sigma"),
        _arcsec("Turn", "turn"),
        _arcsec("Predicted", "turn_sigma"),
        column("Test", "statistic", "1"),
        column("Limit", "limit", "1", wide=True),
        column(
            "Closes",
            lambda x: "yes" if x.closes else "no",
            mark=lambda x: "" if x.closes else "bad",
        ),
    ]
    return build_table("cloud_loops", "Loops", "", registration.consistency.loops, columns)


def _stations(group: CloudGroup, number: int, references: Sequence[str]) -> ReportTable:
    """One row for each station."""

    def heading(name: str) -> float:
        r = group.poses[name].rotation
        return float(np.arctan2(r[1, 0], r[0, 0]))

    def coordinate(k: int) -> Any:
        return lambda name: group.poses[name].translation[k]

    columns = [
        column("Station", str),
        *(column("xyz"[k], coordinate(k), "m4") for k in range(3)),
        column("Turn about z", heading, "°4"),
        millimetres("Sigma place", lambda name: _size(group.covariances[name], 0)),
        _arcsec("Sigma turn", lambda name: _size(group.covariances[name], 3)),
    ]
    title = f"Stations in the frame of {group.stations[0]}"
    if group.stations[0] not in references:
        title += ", which is held"
    anchor = "cloud_stations" if number == 0 else f"cloud_stations_{number + 1}"
    return build_table(anchor, title, "", list(group.stations), columns)
