"""The field check of a scanner in words, as text, as a page with charts, and as data."""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np

from tribrach.calibration.distance_statistics import DistanceStatistics, DistanceUncertainty
from tribrach.calibration.field_check import FieldCheck
from tribrach.calibration.field_series import FTest, SeriesCheck
from tribrach.calibration.known_lengths import LengthCheck
from tribrach.calibration.misalignment_search import Cause, Explanation
from tribrach.calibration.target_distances import DistanceCheck
from tribrach.calibration.two_face import SIGNATURES, ComponentTest, TwoFaceTest
from tribrach.instruments.calibration import meaning_of
from tribrach.report.characters import anchor
from tribrach.report.charts import Chart, beside
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding, words
from tribrach.report.numbers import chance, counted, number
from tribrach.report.page import FrontPage, page
from tribrach.report.schema.base import heading
from tribrach.report.schema.check import SCHEMA, CheckDocument
from tribrach.report.tables import ColumnHead, ReportTable, build_table, number_cell, text_cell
from tribrach.report.text import table_text, wrapped
from tribrach.statistics import largest_first
from tribrach.units import SEC, percent

__all__ = ["check_document", "check_page", "check_sentences", "check_text"]

_METRES = ("x1n", "x1z", "x2", "x3", "x10")
#: shift of a test value that is found with 80 % at 0.1 %
_FOUND = 4.132
#: shift beyond its limit with which a test value is found with 80 %
_SHARE_FOUND = 0.842


def check_sentences(check: FieldCheck) -> list[str]:
    """The verdict first, then what each test says, with its limits."""
    begin = [f"{_verdict(check)}: {_because(check)}.", _error_probability(check)]
    return [*begin, *words(_tested(check))]


def _verdict(check: FieldCheck) -> str:
    return "The scanner does not pass" if check.failures else "The scanner passes"


def _because(check: FieldCheck) -> str:
    """Why, in words that go on after a colon."""
    return "; ".join(check.failures) or "every test is within its limit"


def _error_probability(check: FieldCheck) -> str:
    return (
        "A scanner that is as precise as stated and has no misalignments fails with at most "
        f"{percent(check.alpha)}; each test has {percent(check.alpha_each)}."
    )


def _tested(check: FieldCheck) -> list[Finding]:
    """What each test says, with its limits; what is beyond them warns."""
    out: list[Finding] = []
    if check.two_face is not None:
        out += _two_face_words(check.two_face)
    for one in check.distances:
        out += _distance_words(one)
    for k, of_standard in enumerate(check.statistics):
        out += _statistics_words(of_standard, again=k > 0)
    if check.lengths is not None:
        out += _length_words(check.lengths)
    if check.repeated is not None:
        out += _series_words(check.repeated)
    out += _changes(check)
    return [*out, *(Finding(f"{note[:1].upper()}{note[1:]}.") for note in check.notes)]


def _amount(name: str, value: float) -> str:
    """A parameter with its unit."""
    return f"{value * 1e3:.2f} mm" if name in _METRES else f"{value / SEC:.1f}″"


def _with_sigma(name: str, value: float, sigma: float) -> str:
    """A parameter and its standard deviation with their unit."""
    if name in _METRES:
        return f"{value * 1e3:.2f} ± {sigma * 1e3:.2f} mm"
    return f"{value / SEC:.1f} ± {sigma / SEC:.1f}″"


def _component_words(test: ComponentTest) -> str:
    size = f"{test.rms_metres * 1e3:.2f} mm"
    if test.name != "range":
        size = f"{test.rms / SEC:.1f}″ ({size})"
    verdict = "within" if test.passed else "beyond"
    return (
        f"Both faces, {test.name}: root mean square of the half differences {size}; their weighted "
        f"sum of squares, {test.statistic:.1f}, is {verdict} the limit {test.limit:.1f} "
        f"(chi-square, {test.dof} pairs), largest at {test.at}."
    )


def _two_face_words(test: TwoFaceTest) -> list[Finding]:
    out = [Finding(_component_words(one), not one.passed) for one in test.components]
    return out + _explained(test.explanation, "the faces")


def _explained(explanation: Explanation, what: str) -> list[Finding]:
    if not explanation.causes:
        limit = f"|t| > {explanation.t_limit:.2f}"
        return [Finding(f"No single misalignment is significant in {what} ({limit}).")]
    out = [Finding(_cause_words(cause, what), True) for cause in explanation.causes]
    if not explanation.fits:
        text = (
            f"What these leave of {what} is still more than noise ({explanation.after:.1f} against "
            f"{explanation.limit:.1f}): another error, or a misread target."
        )
        out.append(Finding(text, True))
    return out


def _cause_words(cause: Cause, what: str) -> str:
    alike = (
        f"; {', '.join(cause.alternatives)} would explain it as well" if cause.alternatives else ""
    )
    return (
        f"{what[:1].upper()}{what[1:]} point to {cause.name}, {cause.words}: "
        f"{_with_sigma(cause.name, cause.value, cause.sigma)} "
        f"(t = {cause.t:.1f}){alike}."
    )


def _distance_words(test: DistanceCheck) -> list[Finding]:
    a, b = test.stations
    worst = int(np.argmax(np.abs(test.difference) / test.limit))
    verdict = "within" if test.passed else "beyond"
    compared = (
        f"Distances from {a} and {b}{_of_series(test.scans)}: the weighted sum of squares of the "
        f"{len(test.pairs)} differences, {test.statistic:.1f}, is {verdict} the limit "
        f"{test.critical:.1f} (chi-square, {test.dof} degrees of freedom); the largest beside its "
        f"limit is {test.pairs[worst][0]} to {test.pairs[worst][1]}, "
        f"{test.difference[worst] * 1e3:.2f} mm against ± {test.limit[worst] * 1e3:.2f} mm"
        f"{', beyond it: look at these targets' if _beyond(test, worst) else ''}."
    )
    least = _FOUND * test.sigma_zero
    zero = (
        f"Range zero from these distances: {test.zero * 1e3:.2f} ± {test.sigma_zero * 1e3:.2f} mm "
        f"(t = {test.zero / test.sigma_zero:.1f}, {_zero_words(test)}); "
        f"one of {least * 1e3:.1f} mm would be found with 80 %."
        if math.isfinite(least)
        else "These stations do not show a range zero: set up one between the targets and one "
        "outside on their line."
    )
    sure = math.isfinite(least) and _zero_found(test)
    beyond = _beyond(test, worst)
    out = [Finding(compared, not test.passed or beyond), Finding(zero, sure)]
    targets = len({name for pair in test.pairs for name in pair})
    if targets < test.in_common:
        chosen = f"{targets} of {test.in_common} common targets were compared, evenly chosen."
        out.append(Finding(chosen))
    if not test.passed:
        out += _explained(test.explanation, "the distances")
    return out


def _beyond(test: DistanceCheck | LengthCheck, k: int) -> bool:
    """Is a difference beyond the limit of all of them together?"""
    return bool(abs(test.difference[k]) > test.limit[k])


def _zero_found(test: DistanceCheck) -> bool:
    """Is a range zero more than noise? The verdict is that of all differences."""
    return bool(abs(test.zero) > (_FOUND - _SHARE_FOUND) * test.sigma_zero)


def _zero_words(test: DistanceCheck) -> str:
    return "significant at 0.1 %" if _zero_found(test) else "not significant at 0.1 %"


def _of_series(scans: tuple[int, int]) -> str:
    """What distances are means of, in words."""
    if scans == (1, 1):
        return ""
    count = f"{scans[0]}" if scans[0] == scans[1] else f"{scans[0]} and {scans[1]}"
    return f" (means of {count} series)"


def _statistics_words(test: DistanceStatistics, *, again: bool) -> list[Finding]:
    a, b = test.stations
    formulas = "Distance statistics with the formulas of ISO 17123-9"
    name = (
        f"{formulas}, {test.procedure} procedure"
        if test.procedure
        else f"{formulas}, not its procedure ({'; '.join(test.departures)})"
    )
    largest = int(np.argmax(np.abs(test.difference)))
    if again:
        # what the numbers mean and how they depart from the standard is said with the first pair
        text = (
            f"The same from {a} and {b}, {test.targets} targets: {test.beyond} of "
            f"{len(test.difference)} differences beyond ± {test.difference_limit * 1e3:.2f} mm "
            f"(u_T = {test.u_stated * 1e3:.2f} mm), of a scanner as precise as stated "
            f"{_as_many(test)}; the largest is "
            f"{test.pairs[largest][0]} to {test.pairs[largest][1]}, "
            f"{test.difference[largest] * 1e3:.2f} mm."
        )
        out = [Finding(text)]
        return out if test.repeated is None else out + _uncertainty_words(test.repeated, test)
    text = (
        f"{name}: {test.beyond} of {len(test.difference)} differences Δ of {a} less {b} are beyond "
        f"± {test.difference_limit * 1e3:.2f} mm, the limit of "
        f"{percent(1 - test.alpha_standard)} for each by itself with u_T = "
        f"{test.u_stated * 1e3:.2f} mm (root mean square of the stated "
        f"precision); of a scanner as precise as stated {_as_many(test)}. The standard has a limit "
        "for each difference and none for their number, so that the number is not tested: "
        "differences share targets and vary together, and the verdict is that of their weighted "
        "sum of squares above. The largest is "
        f"{test.pairs[largest][0]} to {test.pairs[largest][1]}, "
        f"{test.difference[largest] * 1e3:.2f} mm."
    )
    out = [Finding(text)]
    if test.repeated is not None:
        out += _uncertainty_words(test.repeated, test)
    return out


def _as_many(test: DistanceStatistics) -> str:
    """How many differences beyond the limit a scanner in order has, and how often so many."""
    average = f"{test.expected_beyond:.3g} would be on average"
    if not test.beyond:
        return average
    rate = test.beyond_rate
    often = "less than 1 %" if rate < 0.01 else f"{100 * rate:.0f} %"
    return f"{average}, {test.beyond} or more with {'more than 99 %' if rate > 0.99 else often}"


def _uncertainty_words(shown: DistanceUncertainty, test: DistanceStatistics) -> list[Finding]:
    a, b = test.stations
    verdict = "within" if shown.passed else "beyond"
    agree = "agree" if shown.ratio.passed else "do not agree"
    scans = sum(test.scans)
    repeated = (
        f"u_ISO-TLS = {shown.u * 1e3:.2f} mm: root mean square of the residuals of "
        f"{scans * len(test.difference)} distances of {scans} scans against their means, over √2 "
        f"(ν = {shown.dof}); stated are {test.u_stated * 1e3:.2f} mm. It is {verdict} the limit "
        f"{shown.limit * 1e3:.2f} mm of correlated distances. The limit of the standard, which "
        f"takes distances for independent, is {shown.standard_limit * 1e3:.2f} mm (chi-square): "
        f"{'kept' if shown.u <= shown.standard_limit else 'not kept'}; a scanner as precise as "
        f"stated exceeds it with {percent(shown.standard_rate)}."
    )
    within = (
        f"Root mean square within the series of {a} {shown.within[0] * 1e3:.2f} mm, of {b} "
        f"{shown.within[1] * 1e3:.2f} mm; beside what is stated for each they {agree} (F "
        f"{shown.ratio.ratio:.2f}, limits {shown.ratio.lower:.2f} to {shown.ratio.upper:.2f} with "
        f"{percent(1 - test.alpha_standard)})."
    )
    return [Finding(repeated, not shown.passed), Finding(within, not shown.ratio.passed)]


def _length_words(test: LengthCheck) -> list[Finding]:
    worst = int(np.argmax(np.abs(test.difference) / test.limit))
    verdict = "within" if test.statistic <= test.critical else "beyond"
    beside = " beside a range zero" if test.with_zero else ""
    found = "is not significant" if test.scale_passed else "is significant"
    a, b = test.pairs[worst]
    least = (test.t_limit + _SHARE_FOUND) * test.sigma_scale
    compared = (
        f"Known lengths: the weighted sum of squares of {len(test.difference)} measured less known "
        f"distances, {test.statistic:.1f}, is {verdict} the limit {test.critical:.1f} (chi-square, "
        f"{test.dof} degrees of freedom); the largest beside its limit is {a} to {b} from "
        f"{test.stations[worst]}, {test.difference[worst] * 1e3:.2f} mm against ± "
        f"{test.limit[worst] * 1e3:.2f} mm"
        f"{', beyond it: look at this length' if _beyond(test, worst) else ''}."
    )
    scale = (
        f"Scale of the range{beside}: {test.scale * 1e6:.1f} ± {test.sigma_scale * 1e6:.1f} ppm "
        f"{found} (limit of |t| {test.t_limit:.2f}); one of {least * 1e6:.0f} "
        "ppm would be found with 80 %."
    )
    out = [
        Finding(compared, test.statistic > test.critical or _beyond(test, worst)),
        Finding(scale, not test.scale_passed),
    ]
    if test.with_zero:
        t = test.zero / test.sigma_zero
        text = (
            f"Range zero beside this scale: {test.zero * 1e3:.2f} ± {test.sigma_zero * 1e3:.2f} mm "
            f"(t = {t:.1f}) {'is' if abs(t) > test.t_limit else 'is not'} significant."
        )
        out.append(Finding(text, abs(t) > test.t_limit))
    if test.statistic > test.critical:
        both = "Scale and range zero" if test.with_zero else "A scale"
        text = f"{both} leave {test.after:.1f} of the sum of squares, " + (
            f"within {test.after_limit:.1f}: they explain it."
            if test.after <= test.after_limit
            else f"beyond {test.after_limit:.1f}: another error, of the scanner or of the "
            "known lengths."
        )
        out.append(Finding(text))
    return out


def _series_words(test: SeriesCheck) -> list[Finding]:
    verdict = "within" if test.passed else "beyond"
    text = (
        f"Series: experimental standard deviation of a coordinate {test.s * 1e3:.2f} mm, root of "
        f"the sum of squares of all residuals over their redundancy {test.dof}, from {test.scans} "
        f"scans of {test.targets} targets; stated are {test.sigma * 1e3:.2f} mm (root mean "
        f"square). With the stated precision the weighted sum of squares, {test.statistic:.1f}, is "
        f"{verdict} the limit {test.critical:.1f} (chi-square)."
    )
    out = [Finding(text, not test.passed)]
    if test.stations is not None:
        f = test.stations
        text = (
            f"The stations differ {f.ratio:.2f} times as much as their own series do (ratio of the "
            "variances), "
            + ("within" if f.passed else "beyond")
            + f" the limit {f.upper:.2f} (F, {f.dof[0]:.0f} and {f.dof[1]:.0f})"
            + ("." if f.passed else ": errors that depend on where the scanner stands.")
        )
        out.append(Finding(text, not f.passed))
    if test.series < 3 or test.targets < 4:
        full = "A full check takes three series of four targets from two stations."
        out.append(Finding(full))
    return out


def _changes(check: FieldCheck) -> list[Finding]:
    """What differs from an earlier check, of coordinates and of distances."""
    before = check.earlier
    if before is None:
        return []
    out: list[Finding] = []
    if check.change is not None and check.repeated is not None:
        out.append(
            _change_words(
                "standard deviation of a coordinate",
                check.change,
                check.repeated.s,
                before.s,
                before.title,
            )
        )
    shown = check.statistics[0].repeated if check.statistics else None
    if check.change_of_distances is not None and shown is not None and before.u is not None:
        out.append(
            _change_words("u_ISO-TLS", check.change_of_distances, shown.u, before.u, before.title)
        )
    return out


def _change_words(what: str, test: FTest, now: float, before: float, title: str) -> Finding:
    verdict = "no significant change" if test.passed else "a significant change"
    text = (
        f"Against {title}, {what}: {now * 1e3:.2f} mm after {before * 1e3:.2f} mm is {verdict} (F "
        f"{test.ratio:.2f}, limits {test.lower:.2f} to {test.upper:.2f} of {test.dof[0]:.1f} and "
        f"{test.dof[1]:.1f} degrees of freedom)."
    )
    return Finding(text, not test.passed)


#: what was implemented, and from where
SOURCES = (
    "Two-face test: half differences of front and back against the signatures of the panoramic "
    "model (Muralikrishnan et al. 2015). Distances from two stations: after what is published "
    "about DVW-Merkblatt 7. Distance statistics: formulas of ISO 17123-9:2018 as a published "
    "program for it has them; means of both faces where both were measured. The texts of both were "
    "not at hand, nor what the standard demands of the places of targets and stations; no "
    "conformity with them is claimed."
)
#: distances in a table
_SHOWN = 40


def check_text(check: FieldCheck) -> str:
    """What a terminal shows."""
    lines = [wrapped(f"- {sentence}") for sentence in check_sentences(check)]
    tables = [table_text(table) for table in _tables(check) if table.rows]
    return "\n\n".join([check.title, "\n".join(lines), *tables, wrapped(SOURCES)])


def check_page(check: FieldCheck) -> str:
    """The whole check as one HTML file."""
    tables = _tables(check)
    # what the faces were tested by stands before their chart
    first = [] if check.two_face is None else [tables.pop(0)]
    return page(
        "Field check of a scanner",
        check.title,
        _front(check),
        _tested(check),
        _pictures(check),
        tables,
        SOURCES,
        first=first,
    )


def _front(check: FieldCheck) -> FrontPage:
    """The verdict, what it rests on, and what one signs."""
    because = _because(check)
    if check.failures:
        because = f"beyond {'its limit' if len(check.failures) == 1 else 'their limits'}: {because}"
    targets = counted(len(check.targets), "target")
    stations = counted(len(check.stations), "station")
    series = counted(len(check.series), "series", "series")
    lines = (
        ("Measured", f"{check.readings} readings of {targets} from {stations} in {series}."),
        ("Error probability", _error_probability(check)),
    )
    signed = "The outcome of these tests, with the precision and the limits stated here."
    sort: Literal["good", "bad"] = "bad" if check.failures else "good"
    return FrontPage(sort, _verdict(check), f"{because[:1].upper()}{because[1:]}.", lines, signed)


def _tables(check: FieldCheck) -> list[ReportTable]:
    out = [] if check.two_face is None else [_components(check.two_face), _found(check.two_face)]
    out += [_distances(*both) for both in zip(check.distances, check.statistics, strict=True)]
    return [*out, _lengths(check.lengths)] if check.lengths is not None else out


def _components(test: TwoFaceTest) -> ReportTable:
    columns = [
        (ColumnHead("Reading", numeric=False), lambda c: text_cell(c.name)),
        (ColumnHead("rms", "mm"), lambda c: number_cell(c.rms_metres, f"{c.rms_metres * 1e3:.2f}")),
        (
            ColumnHead("rms", "″"),
            lambda c: number_cell(c.rms, "" if c.name == "range" else f"{c.rms / SEC:.1f}"),
        ),
        (ColumnHead("test value"), lambda c: number_cell(c.statistic, f"{c.statistic:.1f}")),
        (ColumnHead("limit"), lambda c: number_cell(c.limit, f"{c.limit:.1f}")),
        (ColumnHead("p"), lambda c: number_cell(c.p, chance(c.p))),
        (
            ColumnHead("", numeric=False),
            lambda c: text_cell("passed" if c.passed else "failed", "good" if c.passed else "bad"),
        ),
    ]
    note = "Half differences of front and back; the limit is that of a chi-square."
    return build_table("faces", "Both faces", note, test.components, columns)


def _found(test: TwoFaceTest) -> ReportTable:
    """The smallest misalignment of each kind that these readings show."""
    rows = list(zip(SIGNATURES, test.detectable, strict=True))
    columns = [
        (ColumnHead("Parameter", numeric=False), lambda r: text_cell(r[0])),
        (ColumnHead("What it is", numeric=False), lambda r: text_cell(meaning_of(r[0]))),
        (
            ColumnHead("is found from"),
            lambda r: number_cell(
                number(r[1]), _amount(r[0], r[1]) if math.isfinite(r[1]) else "never"
            ),
        ),
    ]
    note = (
        "Each parameter by itself: from this size on it is found with 80 %, at an error "
        "probability of 0.1 %."
    )
    return build_table("signatures", "What these faces show", note, rows, columns)


def _millimetres(values: Any) -> Any:
    """Cells of metres as millimetres."""
    return lambda k: number_cell(float(values[k]), f"{values[k] * 1e3:.2f}")


def _distances(test: DistanceCheck, of_standard: DistanceStatistics) -> ReportTable:
    rows = [int(k) for k in largest_first(np.abs(test.difference) / test.limit)]
    mm, (a, b) = _millimetres, test.stations
    alone = np.abs(of_standard.difference) > of_standard.difference_limit
    beyond = np.abs(test.difference) > test.limit
    columns = [
        (ColumnHead("From", numeric=False), lambda k: text_cell(test.pairs[k][0])),
        (ColumnHead("to", numeric=False), lambda k: text_cell(test.pairs[k][1])),
        *(
            (
                ColumnHead(f"from {name}", "m"),
                lambda k, side=side: number_cell(
                    float(test.lengths[k, side]), f"{test.lengths[k, side]:.4f}"
                ),
            )
            for side, name in enumerate((a, b))
        ),
        (ColumnHead("difference Δ", "mm"), mm(test.difference)),
        (ColumnHead("σ", "mm"), mm(test.sigma)),
        (ColumnHead("limit", "mm"), mm(test.limit)),
        (
            ColumnHead("", numeric=False),
            lambda k: text_cell("beyond" if beyond[k] else "", "bad" if beyond[k] else ""),
        ),
        (
            ColumnHead(
                f"limit of the standard, ± {of_standard.difference_limit * 1e3:.2f} mm",
                numeric=False,
            ),
            lambda k: text_cell("beyond" if alone[k] else "kept"),
        ),
    ]
    note = (
        f"{a} less {b}, the largest beside its limit first. The limits hold together with "
        f"{percent(1 - test.alpha)} or more (Šidák); the verdict is that of the chi-square over "
        f"all. The limit of the standard is for each difference alone, with "
        f"{percent(1 - of_standard.alpha_standard)}."
    )
    name = anchor(f"distances-{a}-{b}")
    title = f"Distances from {a} and {b}{_of_series(test.scans)}"
    return build_table(name, title, note, rows, columns, most=_SHOWN)


def _lengths(test: LengthCheck) -> ReportTable:
    rows = [int(k) for k in largest_first(np.abs(test.difference) / test.limit)]
    mm, beyond = _millimetres, np.abs(test.difference) > test.limit
    columns = [
        (ColumnHead("Station", numeric=False), lambda k: text_cell(test.stations[k])),
        (ColumnHead("From", numeric=False), lambda k: text_cell(test.pairs[k][0])),
        (ColumnHead("to", numeric=False), lambda k: text_cell(test.pairs[k][1])),
        *(
            (
                ColumnHead(head, "m"),
                lambda k, side=side: number_cell(
                    float(test.lengths[k, side]), f"{test.lengths[k, side]:.4f}"
                ),
            )
            for side, head in enumerate(("measured", "known"))
        ),
        (ColumnHead("difference", "mm"), mm(test.difference)),
        (ColumnHead("σ", "mm"), mm(test.sigma)),
        (ColumnHead("limit", "mm"), mm(test.limit)),
        (
            ColumnHead("", numeric=False),
            lambda k: text_cell("beyond" if beyond[k] else "", "bad" if beyond[k] else ""),
        ),
    ]
    note = (
        "Mean over the series of a station less the known length, the largest beside its limit "
        f"first. The limits hold together with {percent(1 - test.alpha)} or more (Šidák); "
        f"the verdict is that of the chi-square over all, and of the scale."
    )
    return build_table("lengths", "Known lengths", note, rows, columns, most=_SHOWN)


def _pictures(check: FieldCheck) -> list[Picture]:
    if check.two_face is None:
        return []
    pairs = check.two_face.pairs
    across = [
        ("zenith angle [°]", np.degrees(pairs.polar[:, 2])),
        ("range [m]", pairs.polar[:, 0]),
    ]
    sigma = np.sqrt(np.einsum("nii->ni", pairs.covariance))
    rows = []
    for label, x in across:
        panels = []
        for k, (name, factor, unit) in enumerate(
            (("range", 1e3, "mm"), ("horizontal", 1 / SEC, "″"), ("zenith", 1 / SEC, "″"))
        ):
            half, reach = pairs.half[:, k] * factor, 2 * sigma[:, k] * factor
            most = 1.05 * float((np.abs(half) + reach).max())
            margin = 0.04 * float(np.ptp(x)) + 1e-6
            ends = float(x.min()) - margin, float(x.max()) + margin
            panel = Chart(ends, (-most, most), (label, f"{name} [{unit}]"), (410.0, 260.0))
            panel.line(ends, (0.0, 0.0), "s0")
            for at, value, by in zip(x, half, reach, strict=True):
                panel.line((at, at), (value - by, value + by), "faint")
            words = [
                f"{value:.2f} ± {by:.2f} {unit} (2 σ)"
                for value, by in zip(half, reach, strict=True)
            ]
            panel.points(x, half, words)
            panels.append(panel)
        rows.append(panels)
    title = "Half differences of the faces"
    caption = (
        "Half of front less back, with twice its standard deviation to both sides. An instrument "
        "without errors of its faces has them scattered about zero."
    )
    return [Picture("faces-chart", title, beside(rows, title), caption, wide=True)]


def check_document(check: FieldCheck) -> CheckDocument:
    """The check as data: metres and radians, None where there is no number."""
    two, series = check.two_face, check.repeated
    data = heading(SCHEMA) | {
        "title": check.title,
        "passed": check.passed,
        "failures": check.failures,
        "alpha": check.alpha,
        "alpha_each": check.alpha_each,
        "readings": check.readings,
        "stations": list(check.stations),
        "targets": list(check.targets),
        "two_face": None
        if two is None
        else {
            "passed": two.passed,
            "components": [
                {
                    "reading": c.name,
                    "rms": number(c.rms),
                    "rms_metres": number(c.rms_metres),
                    "statistic": number(c.statistic),
                    "dof": c.dof,
                    "limit": number(c.limit),
                    "p": number(c.p),
                    "passed": c.passed,
                }
                for c in two.components
            ],
            "explanation": _explanation_json(two.explanation),
            "detectable": dict(zip(SIGNATURES, (number(x) for x in two.detectable), strict=True)),
        },
        "distances": [_distance_json(one) for one in check.distances],
        "statistics": [_statistics_json(one) for one in check.statistics],
        "lengths": _lengths_json(check.lengths),
        "series": None
        if series is None
        else {
            "scans": series.scans,
            "targets": series.targets,
            "s": series.s,
            "dof": series.dof,
            "dof_equivalent": series.dof_equivalent,
            "s_station": series.s_station,
            "stated": series.sigma,
            "statistic": number(series.statistic),
            "limit": number(series.critical),
            "p": number(series.p),
            "passed": series.passed,
            "stations": _f_json(series.stations),
        },
        "change": _f_json(check.change),
        "change_of_distances": _f_json(check.change_of_distances),
        "findings": check_sentences(check),
        "sources": SOURCES,
    }
    return CheckDocument.model_validate(data)


def _explanation_json(explanation: Explanation) -> dict[str, Any]:
    return {
        "causes": [
            {
                "parameter": c.name,
                "value": number(c.value),
                "sigma": number(c.sigma),
                "t": number(c.t),
                "alternatives": list(c.alternatives),
            }
            for c in explanation.causes
        ],
        "before": number(explanation.before),
        "after": number(explanation.after),
        "limit": number(explanation.limit),
    }


def _distance_json(test: DistanceCheck) -> dict[str, Any]:
    return {
        "stations": list(test.stations),
        "scans": list(test.scans),
        "passed": test.passed,
        "statistic": number(test.statistic),
        "dof": test.dof,
        "limit": number(test.critical),
        "p": number(test.p),
        "range_zero": {"value": number(test.zero), "sigma": number(test.sigma_zero)},
        "pairs": [
            {
                "from": a,
                "to": b,
                "lengths": [number(x) for x in test.lengths[k]],
                "difference": number(test.difference[k]),
                "sigma": number(test.sigma[k]),
                "limit": number(test.limit[k]),
            }
            for k, (a, b) in enumerate(test.pairs)
        ],
        "explanation": _explanation_json(test.explanation),
    }


def _statistics_json(test: DistanceStatistics) -> dict[str, Any]:
    shown = test.repeated
    return {
        "stations": list(test.stations),
        "scans": list(test.scans),
        "targets": test.targets,
        "procedure": test.procedure,
        "departures": list(test.departures),
        "differences": [
            {"from": a, "to": b, "difference": number(test.difference[k])}
            for k, (a, b) in enumerate(test.pairs)
        ],
        "u_stated": test.u_stated,
        "difference_limit": test.difference_limit,
        "beyond": test.beyond,
        "expected_beyond": test.expected_beyond,
        "beyond_rate": test.beyond_rate,
        "repeated": None
        if shown is None
        else {
            "u": shown.u,
            "dof": shown.dof,
            "dof_equivalent": shown.dof_equivalent,
            "within": [number(x) for x in shown.within],
            "limit": number(shown.limit),
            "p": number(shown.p),
            "passed": shown.passed,
            "standard_limit": number(shown.standard_limit),
            "standard_rate": number(shown.standard_rate),
            "stations": _f_json(shown.ratio),
        },
    }


def _lengths_json(test: LengthCheck | None) -> dict[str, Any] | None:
    if test is None:
        return None
    return {
        "passed": test.passed,
        "statistic": number(test.statistic),
        "dof": test.dof,
        "limit": number(test.critical),
        "p": number(test.p),
        "scale": number(test.scale),
        "sigma_scale": number(test.sigma_scale),
        "beside_zero": test.with_zero,
        "t_limit": number(test.t_limit),
        "rows": [
            {
                "station": test.stations[k],
                "from": a,
                "to": b,
                "measured": number(test.lengths[k, 0]),
                "known": number(test.lengths[k, 1]),
                "difference": number(test.difference[k]),
                "sigma": number(test.sigma[k]),
                "limit": number(test.limit[k]),
            }
            for k, (a, b) in enumerate(test.pairs)
        ],
    }


def _f_json(test: FTest | None) -> dict[str, Any] | None:
    if test is None:
        return None
    return {
        "ratio": number(test.ratio),
        "dof": list(test.dof),
        "lower": number(test.lower),
        "upper": number(test.upper),
        "passed": test.passed,
    }
