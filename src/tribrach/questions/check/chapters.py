"""What a field check says: verdict, findings with their limits, tables, the chart of the faces."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Literal

import numpy as np

from tribrach.answers import Form
from tribrach.calibration.distance_statistics import DistanceStatistics, DistanceUncertainty
from tribrach.calibration.field_check import FOUND, FieldCheck
from tribrach.calibration.field_series import FTest, SeriesCheck
from tribrach.calibration.known_lengths import LengthCheck
from tribrach.calibration.misalignment_search import Cause, Explanation
from tribrach.calibration.target_distances import DistanceCheck
from tribrach.calibration.two_face import ComponentTest, TwoFaceTest
from tribrach.instruments.calibration import meaning_of
from tribrach.report.answer import Answer
from tribrach.report.characters import anchor
from tribrach.report.charts import Chart, beside, ends_of
from tribrach.report.columns import column, passed
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding, words
from tribrach.report.numbers import chance, counted
from tribrach.report.page import FrontPage
from tribrach.report.tables import ReportTable, Spec, build_table
from tribrach.report.text import table_text, wrapped
from tribrach.sentences import Sentence, capital, scaled, written
from tribrach.statistics import largest_first
from tribrach.units import percent

FORM = Form("check", FieldCheck, 2, findings=list[str], sources=str)
#: parameters in metres; the others are angles
_METRES = ("x1n", "x1z", "x2", "x3", "x10")
#: what is said of a scanner that passed, did not, or of which that cannot be told
_VERDICTS = {
    True: "The scanner passes",
    False: "The scanner does not pass",
    None: "Whether the scanner passes cannot be told",
}
_SORTS: dict[bool | None, Literal["good", "bad", "look"]] = {
    True: "good",
    False: "bad",
    None: "look",
}
#: shift beyond its limit with which a test value is found with 80 %
_SHARE_FOUND = 0.842
#: distances in a table
_SHOWN = 40
#: what was implemented, and from where
SOURCES = (
    "Two-face test: half differences of front and back against the signatures of the panoramic "
    "model (Muralikrishnan et al. 2015). Distances from two stations: after what is published "
    "about DVW-Merkblatt 7. Distance statistics: formulas of ISO 17123-9:2018 as a published "
    "program for it has them; means of both faces where both were measured. The texts of both were "
    "not at hand, nor what the standard demands of the places of targets and stations; no "
    "conformity with them is claimed."
)


def answer_of(check: FieldCheck) -> Answer:
    """The check as people read it."""
    verdict = _VERDICTS[check.passed]
    because = "; ".join(check.failures or check.unseen) or "every test is within its limit"
    if check.passed is None:
        because = f"every test is within its limit, but they do not show {because}"
    chance_of = Sentence(
        "A scanner that is as precise as stated and has no misalignments fails with at most "
        "{whole}; each test has {each}.",
        whole=percent(check.alpha),
        each=percent(check.alpha_each),
    )
    tested = list(_tested(check))
    said = [f"{verdict}: {because}.", chance_of, *words(tested)]
    if check.failures:
        because = f"beyond {'its limit' if len(check.failures) == 1 else 'their limits'}: {because}"
    stations, targets = (
        counted(len(check.stations), "station"),
        counted(len(check.targets), "target"),
    )
    measured = f"{check.readings} readings of {targets} from {stations} in "
    front = FrontPage(
        _SORTS[check.passed],
        verdict,
        capital(because) + ".",
        (
            ("Measured", f"{measured}{counted(len(check.series_names), 'series', 'series')}."),
            ("Error probability", chance_of),
        ),
        "The outcome of these tests, with the precision and the limits stated here.",
    )
    faces = [] if check.two_face is None else [_components(check.two_face)]
    tables = [] if check.two_face is None else [_detectable(check.two_face)]
    tables += [_distances(*both) for both in zip(check.distances, check.statistics, strict=True)]
    tables += [] if check.lengths is None else [_lengths(check.lengths)]
    shown = [table_text(table) for table in (*faces, *tables) if table.rows]
    lines = "\n".join(wrapped("- " + sentence) for sentence in said)
    return Answer(
        "Field check of a scanner",
        check.title,
        front,
        check,
        FORM,
        {"findings": said, "sources": SOURCES},
        tested,
        first=faces,
        pictures=[] if check.two_face is None else [_picture(check.two_face)],
        tables=tables,
        footer=SOURCES,
        terminal=["\n\n".join([check.title, lines, *shown, wrapped(SOURCES)])],
    )


def _tested(check: FieldCheck) -> Iterator[Finding]:
    """What each test says, with its limits; what is beyond them warns."""
    if check.two_face is not None:
        yield from map(_component, check.two_face.components)
        yield from _explained(check.two_face.explanation, "the faces")
        yield from _within(check)
    for one in check.distances:
        yield from _compared(one)
    for k, of_standard in enumerate(check.statistics):
        yield _standard(of_standard, again=k > 0)
        if of_standard.repeated is not None:
            yield from _uncertainty(of_standard.repeated, of_standard)
    if check.lengths is not None:
        yield from _known(check.lengths)
    if check.series is not None:
        yield from _series(check.series)
    yield from _changes(check)
    yield from (Finding(capital(note) + ".", key="note") for note in check.notes)


def _unit(name: str) -> str:
    """How a parameter is written."""
    return "mm2" if name in _METRES else "″1"


def _side(within: bool) -> str:
    return "within" if within else "beyond"


def _component(test: ComponentTest) -> Finding:
    rms = "{test.rms_metres:mm2}"
    rms = rms if test.reading == "range" else f"{{test.rms:″1}} ({rms})"
    return Finding.of(
        "two_face",
        f"Both faces, {{test.reading}}: root mean square of the half differences {rms}; their "
        "weighted sum of squares, {test.statistic:1}, is {side} the limit {test.limit:1} "
        "(chi-square, {test.dof} pairs), largest at {test.at}.",
        not test.passed,
        test=test,
        side=_side(test.passed),
    )


def _explained(explanation: Explanation, what: str) -> Iterator[Finding]:
    """The misalignments that the faces or the distances point to."""
    if not explanation.causes:
        yield Finding.of(
            "no_misalignment",
            "No single misalignment is significant in {what} (|t| > {all.t_limit:2}).",
            what=what,
            all=explanation,
        )
        return
    yield from (_cause(cause, what) for cause in explanation.causes)
    if not explanation.fits:
        yield Finding.of(
            "misalignment_rest",
            "What these leave of {what} is still more than noise ({all.after:1} against "
            "{all.limit:1}): another error, or a misread target.",
            True,
            what=what,
            all=explanation,
        )


def _cause(cause: Cause, what: str) -> Finding:
    unit, others = _unit(cause.parameter), ", ".join(cause.alternatives)
    return Finding.of(
        "misalignment",
        "{what} point to {cause.parameter}, {cause.words}: "
        f"{{cause.value:{unit}~}} ± {{cause.sigma:{unit}}} (t = {{cause.t:1}}){{alike}}.",
        True,
        what=capital(what),
        cause=cause,
        alike=f"; {others} would explain it as well" if others else "",
    )


def _within(check: FieldCheck) -> Iterator[Finding]:
    """Misalignments beyond the noise that the stated precision of the scanner contains."""
    stated, noise = check.two_face, check.two_face_noise
    if stated is None or noise is None or not stated.passed:
        return
    for cause in noise.explanation.causes:
        unit, others = _unit(cause.parameter), ", ".join(cause.alternatives)
        yield Finding.of(
            "misalignment_within",
            "Against the noise alone both faces point to {cause.parameter}, {cause.words}: "
            f"{{cause.value:{unit}~}} ± {{cause.sigma:{unit}}} (t = {{cause.t:1}}){{alike}}. The "
            "scanner is stated to be that far off and passes; calibrate, or measure in both faces.",
            True,
            cause=cause,
            alike=f"; {others} would explain it as well" if others else "",
        )


def _worst(table: Any) -> Any:
    """The row whose difference is largest beside its limit."""
    (row,) = table.each([int(np.argmax(np.abs(table.difference) / table.limit))])
    return row


def _beyond(row: Any) -> bool:
    return bool(abs(row.difference) > row.limit)


def _compared(test: DistanceCheck) -> Iterator[Finding]:
    """Distances from two stations against each other, and the range zero that they show."""
    worst = _worst(test.pairs)
    yield Finding.of(
        "distances",
        "Distances from {test.stations[0]} and {test.stations[1]}{series}: the weighted sum of "
        "squares of the {n} differences, {test.statistic:1}, is {side} the limit {test.limit:1} "
        "(chi-square, {test.dof} degrees of freedom); the largest beside its limit is "
        "{worst.from_} to {worst.to}, {worst.difference:mm2} against ± {worst.limit:mm2}{look}.",
        not test.passed or _beyond(worst),
        test=test,
        worst=worst,
        series=_of_series(test.scans),
        n=len(test.pairs),
        side=_side(test.passed),
        look=", beyond it: look at these targets" if _beyond(worst) else "",
    )
    zero = test.range_zero
    if math.isfinite(zero.sigma):
        found = bool(abs(zero.value) > (FOUND - _SHARE_FOUND) * zero.sigma)
        yield Finding.of(
            "range_zero",
            "Range zero from these distances: {zero.value:mm2~} ± {zero.sigma:mm2} (t = "
            "{zero.t:1}, {found} at 0.1 %); one of {least:mm1} would be found with 80 %.",
            found,
            zero=zero,
            found="significant" if found else "not significant",
            least=FOUND * zero.sigma,
        )
    else:
        yield Finding(
            "These stations do not show a range zero: set up one between the targets and one "
            "outside on their line.",
            key="range_zero_open",
        )
    targets = len({*test.pairs.from_, *test.pairs.to})
    if targets < test.in_common:
        yield Finding.of(
            "targets_chosen",
            "{targets} of {common} common targets were compared, evenly chosen.",
            targets=targets,
            common=test.in_common,
        )
    if not test.passed:
        yield from _explained(test.explanation, "the distances")


def _of_series(scans: tuple[int, int]) -> str:
    """What distances are means of, in words."""
    if scans == (1, 1):
        return ""
    count = f"{scans[0]}" if scans[0] == scans[1] else f"{scans[0]} and {scans[1]}"
    return f" (means of {count} series)"


def _standard(test: DistanceStatistics, *, again: bool) -> Finding:
    """The distance statistics; what they mean is said with the first pair of stations."""
    table, procedure = test.differences, f"{test.procedure} procedure"
    (largest,) = table.each([int(np.argmax(np.abs(table.difference)))])
    if test.departures:
        procedure = f"not its procedure ({'; '.join(test.departures)})"
    often = "less than 1 %" if test.beyond_rate < 0.01 else "{test.beyond_rate:%0}"
    often = "more than 99 %" if test.beyond_rate > 0.99 else often
    as_many = "{test.expected_beyond:g3} would be on average"
    as_many += f", {{test.beyond}} or more with {often}" if test.beyond else ""
    worst = "{largest.from_} to {largest.to}, {largest.difference:mm2}."
    if again:
        template = (
            "The same from {test.stations[0]} and {test.stations[1]}, {test.targets} targets: "
            "{test.beyond} of {n} differences beyond ± {test.difference_limit:mm2} (u_T = "
            "{test.u_stated:mm2}), of a scanner as precise as stated "
            f"{as_many}; the largest is {worst}"
        )
    else:
        template = (
            "Distance statistics with the formulas of ISO 17123-9, {procedure}: {test.beyond} of "
            "{n} differences Δ of {test.stations[0]} less {test.stations[1]} are beyond ± "
            "{test.difference_limit:mm2}, the limit of {share} for each by itself with u_T = "
            "{test.u_stated:mm2} (root mean square of the stated precision); of a scanner as "
            f"precise as stated {as_many}. The standard limits each difference, not their "
            "number: differences share targets and vary together. The verdict is that of their "
            "weighted sum of squares above. The "
            f"largest is {worst}"
        )
    return Finding.of(
        "distance_statistics",
        template,
        test=test,
        largest=largest,
        n=len(table),
        procedure=procedure,
        share=percent(1 - test.alpha_standard),
    )


def _uncertainty(shown: DistanceUncertainty, test: DistanceStatistics) -> Iterator[Finding]:
    """The uncertainty of a target that repeated distances show."""
    scans = sum(test.scans)
    yield Finding.of(
        "u_iso_tls",
        "u_ISO-TLS = {shown.u:mm2}: root mean square of the residuals of {n} distances of {scans} "
        "scans against their means, over √2 (ν = {shown.dof}); stated are {stated:mm2}. It is "
        "{side} the limit {shown.limit:mm2} of correlated distances. The limit of the standard, "
        "which takes distances for independent, is {shown.standard_limit:mm2} (chi-square): "
        "{kept}; a scanner as precise as stated exceeds it with {rate}.",
        not shown.passed,
        shown=shown,
        n=scans * len(test.differences),
        scans=scans,
        stated=test.u_stated,
        side=_side(shown.passed),
        kept="kept" if shown.u <= shown.standard_limit else "not kept",
        rate=percent(shown.standard_rate),
    )
    yield Finding.of(
        "u_of_stations",
        "Root mean square within the series of {names[0]} {shown.within[0]:mm2}, of {names[1]} "
        "{shown.within[1]:mm2}; beside what is stated for each they {agree} (F {f.ratio:2}, limits "
        "{f.lower:2} to {f.upper:2} with {share}).",
        not shown.stations.passed,
        names=test.stations,
        shown=shown,
        f=shown.stations,
        agree="agree" if shown.stations.passed else "do not agree",
        share=percent(1 - test.alpha_standard),
    )


def _known(test: LengthCheck) -> Iterator[Finding]:
    """Known lengths: whether they fit, the scale, the range zero beside it."""
    worst, beside = _worst(test.rows), " beside a range zero" if test.beside_zero else ""
    yield Finding.of(
        "known_lengths",
        "Known lengths: the weighted sum of squares of {n} measured less known distances, "
        "{test.statistic:1}, is {side} the limit {test.limit:1} (chi-square, {test.dof} degrees of "
        "freedom); the largest beside its limit is {worst.from_} to {worst.to} from "
        "{worst.station}, {worst.difference:mm2} against ± {worst.limit:mm2}{look}.",
        not test.fits or _beyond(worst),
        n=len(test.rows),
        test=test,
        worst=worst,
        side=_side(test.fits),
        look=", beyond it: look at this length" if _beyond(worst) else "",
    )
    yield Finding.of(
        "range_scale",
        "Scale of the range{beside}: {test.scale:ppm1~} ± {test.sigma_scale:ppm1} {found} "
        "significant (limit of |t| {test.t_limit:2}); one of {least:ppm0} would be found with 80 "
        "%.",
        not test.scale_passed,
        beside=beside,
        test=test,
        found="is not" if test.scale_passed else "is",
        least=(test.t_limit + _SHARE_FOUND) * test.sigma_scale,
    )
    if test.beside_zero:
        found = abs(test.zero.t) > test.t_limit
        yield Finding.of(
            "range_zero",
            "Range zero beside this scale: {zero.value:mm2~} ± {zero.sigma:mm2} (t = {zero.t:1}) "
            "{found} significant.",
            found,
            zero=test.zero,
            found="is" if found else "is not",
        )
    if not test.fits:
        explain = test.after <= test.after_limit
        yield Finding.of(
            "lengths_rest",
            "{both} leave {test.after:1} of the sum of squares, {side} {test.after_limit:1}: {so}.",
            both="Scale and range zero" if test.beside_zero else "A scale",
            test=test,
            side=_side(explain),
            so="they explain it"
            if explain
            else "another error, of the scanner or of the known lengths",
        )


def _series(test: SeriesCheck) -> Iterator[Finding]:
    """Repeated series against what is stated, and the stations against each other."""
    yield Finding.of(
        "series",
        "Series: experimental standard deviation of a coordinate {test.s:mm2}, root of the sum of "
        "squares of all residuals over their redundancy {test.dof}, from {test.scans} scans of "
        "{test.targets} targets; stated are {test.stated:mm2} (root mean square). With the stated "
        "precision the weighted sum of squares, {test.statistic:1}, is {side} the limit "
        "{test.limit:1} (chi-square).",
        not test.passed,
        side=_side(test.passed),
        test=test,
    )
    if test.stations is not None:
        f = test.stations
        yield Finding.of(
            "series_of_stations",
            "The stations differ {f.ratio:2} times as much as their own series do (ratio of the "
            "variances), {side} the limit {f.upper:2} (F, {f.dof[0]:0} and {f.dof[1]:0}){so}.",
            not f.passed,
            f=f,
            side=_side(f.passed),
            so="" if f.passed else ": errors that depend on where the scanner stands",
        )
    if test.series < 3 or test.targets < 4:
        yield Finding(
            "A full check takes three series of four targets from two stations.", key="not_full"
        )


def _changes(check: FieldCheck) -> Iterator[Finding]:
    """What differs from an earlier check, of coordinates and of distances."""
    before, shown = check.earlier, check.statistics[0].repeated if check.statistics else None
    if before is None:
        return
    if check.change is not None and check.series is not None:
        what = "standard deviation of a coordinate"
        yield _change(what, check.change, check.series.s, before.s, before.title)
    if check.change_of_distances is not None and shown is not None and before.u is not None:
        yield _change("u_ISO-TLS", check.change_of_distances, shown.u, before.u, before.title)


def _change(what: str, test: FTest, now: float, before: float, title: str) -> Finding:
    return Finding.of(
        "change",
        "Against {title}, {what}: {now:mm2} after {before:mm2} is {verdict} (F {f.ratio:2}, limits "
        "{f.lower:2} to {f.upper:2} of {f.dof[0]:1} and {f.dof[1]:1} degrees of freedom).",
        not test.passed,
        title=title,
        what=what,
        now=now,
        before=before,
        verdict="no significant change" if test.passed else "a significant change",
        f=test,
    )


def _components(test: TwoFaceTest) -> ReportTable:
    columns = [
        column("Reading", "reading"),
        column("rms", "rms_metres", "mm2"),
        column("rms", lambda c: None if c.reading == "range" else c.rms, "″1"),
        column("test value", "statistic", "1"),
        column("limit", "limit", "1"),
        column("p", "p", lambda p, _: chance(p)),
        passed(lambda c: c.passed),
    ]
    note = "Half differences of front and back; the limit is that of a chi-square."
    return build_table("faces", "Both faces", note, test.components, columns)


def _detectable(test: TwoFaceTest) -> ReportTable:
    """The smallest misalignment of each kind that these readings show."""
    columns = [
        column("Parameter", lambda r: r[0]),
        column("What it is", lambda r: meaning_of(r[0])),
        column(
            "is found from",
            lambda r: r[1],
            lambda value, r: written(value, _unit(r[0])) if math.isfinite(value) else "never",
        ),
    ]
    note = Sentence(
        "Each parameter by itself: from this size on it is found with 80 %, at an error "
        "probability of {alpha:%g}.",
        alpha=0.001,
    )
    rows = list(test.detectable.items())
    return build_table("signatures", "What these faces show", note, rows, columns)


def _difference_columns() -> list[Spec]:
    """Difference, sigma, limit, and whether it is beyond."""
    return [
        column("σ", "sigma", "mm2"),
        column("limit", "limit", "mm2"),
        column(
            "",
            lambda r: "beyond" if _beyond(r) else "",
            mark=lambda r: "bad" if _beyond(r) else "",
        ),
    ]


def _distances(test: DistanceCheck, of_standard: DistanceStatistics) -> ReportTable:
    (a, b), limit = test.stations, of_standard.difference_limit
    columns = [
        column("From", "from_"),
        column("to", "to"),
        column(f"from {a}", lambda r: r.lengths[0], "m4"),
        column(f"from {b}", lambda r: r.lengths[1], "m4"),
        column("difference Δ", "difference", "mm2"),
        *_difference_columns(),
        column(
            Sentence("limit of the standard, ± {limit:mm2}", limit=limit),
            lambda r: "beyond" if abs(r.difference) > limit else "kept",
        ),
    ]
    note = Sentence(
        "{a} less {b}, the largest beside its limit first. The limits hold together "
        "with {test:%} or more (Šidák); the verdict is that of the chi-square over "
        "all. The limit of the standard is for each difference alone, with "
        "{of_standard:%}.",
        a=a,
        b=b,
        test=1 - test.alpha,
        of_standard=1 - of_standard.alpha_standard,
    )
    title = f"Distances from {a} and {b}{_of_series(test.scans)}"
    rows = _ordered(test.pairs)
    return build_table(anchor(f"distances-{a}-{b}"), title, note, rows, columns, most=_SHOWN)


def _ordered(table: Any) -> list[Any]:
    """The rows, the largest beside its limit first."""
    rows: list[Any] = table.each(largest_first(np.abs(table.difference) / table.limit))
    return rows


def _lengths(test: LengthCheck) -> ReportTable:
    columns = [
        column("Station", "station"),
        column("From", "from_"),
        column("to", "to"),
        column("measured", "measured", "m4"),
        column("known", "known", "m4"),
        column("difference", "difference", "mm2"),
        *_difference_columns(),
    ]
    note = Sentence(
        "Mean over the series of a station less the known length, the largest beside "
        "its limit first. The limits hold together with {test:%} or more (Šidák); the "
        "verdict is that of the chi-square over all, and of the scale.",
        test=1 - test.alpha,
    )
    return build_table("lengths", "Known lengths", note, _ordered(test.rows), columns, most=_SHOWN)


def _picture(test: TwoFaceTest) -> Picture:
    """Half differences of range and angles by zenith angle and by range."""
    pairs, sigma = test.pairs, np.sqrt(np.einsum("nii->ni", test.pairs.covariance))
    rows = []
    for label, x in (
        ("zenith angle [°]", np.degrees(pairs.polar[:, 2])),
        ("range [m]", pairs.polar[:, 0]),
    ):
        ends = ends_of(x, 0.04)
        panels = []
        for k, (name, spec) in enumerate(
            (("range", "mm2"), ("horizontal", "″2"), ("zenith", "″2"))
        ):
            half, reach = (scaled(v, spec) for v in (pairs.half[:, k], 2 * sigma[:, k]))
            most, unit = 1.05 * float((np.abs(half) + reach).max()), spec[:-1]
            panel = Chart(ends, (-most, most), (label, f"{name} [{unit}]"), (410.0, 260.0))
            panel.line(ends, (0.0, 0.0), "s0")
            for at, value, by in zip(x, half, reach, strict=True):
                panel.line((at, at), (value - by, value + by), "faint")
            said = [
                Sentence("{v:2} ± {by:2} {unit} (2 σ)", v=v, by=by, unit=unit)
                for v, by in zip(half, reach, strict=True)
            ]
            panel.points(x, half, said)
            panels.append(panel)
        rows.append(panels)
    caption = (
        "Half of front less back, with twice its standard deviation to both sides. An instrument "
        "without errors of its faces has them scattered about zero."
    )
    title = "Half differences of the faces"
    return Picture("faces-chart", title, beside(rows, title), caption, wide=True)
