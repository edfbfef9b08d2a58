"""What a self-calibration says: findings, tables, heat maps of correlations, residuals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from operator import itemgetter
from typing import Any, Literal

import numpy as np

from tribrach._types import Array
from tribrach.answers import Form
from tribrach.calibration.correlations import LIMITS
from tribrach.calibration.remedies import Remedy
from tribrach.calibration.self_calibration import SelfCalibration, remedy_sentences
from tribrach.calibration.significance import BlockTest, Omitted
from tribrach.errors import InputError
from tribrach.network.quality import global_test
from tribrach.report.answer import Answer
from tribrach.report.charts import SIGNED, Chart, beside, colour_bar, legend
from tribrach.report.columns import column
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding, words
from tribrach.report.numbers import counted
from tribrach.report.page import FrontPage
from tribrach.report.tables import ReportTable, build_table
from tribrach.sentences import Sentence, capital, joined, scaled, written

FORM = Form("calibrate", SelfCalibration, 1, title=str, sentences=list[str])
#: less is no size of a parameter, in its shown unit: a nanometre, a millionth of an arc second
_NOTHING = 1e-6
#: ratios of sigmas that are the same
_SAME = 5e-5
#: error probability of the test of residuals with and without the parameters
_LEVEL = 0.05
#: error probability of the test of stations against each other
_DIFFER = 1e-3
#: correlations from here on are written into their cells
_WRITTEN = 0.7
#: residuals drawn per panel; more are thinned out evenly
_MOST_DOTS = 20_000
_COMPONENTS = ("E", "N", "U", "tilt E", "tilt N", "heading")


def answer_of(title: str, calibration: SelfCalibration, further: Sequence[str] = ()) -> Answer:
    """The calibration as people read it; further sentences stand first on its page."""
    c, found = calibration, list(_findings(calibration))
    sigma0 = c.sigma0
    lines = [
        title,
        Sentence(
            "{c.counts.observed} observed values, {c.counts.unknowns} unknowns, redundancy "
            "{sigma0.dof}, sigma0 {sigma0.posterior:4}",
            c=c,
            sigma0=sigma0,
        ),
        Sentence("datum: {c.datum}; sigmas {c.sigma_origin}", c=c),
    ]
    width = max(map(len, c.names))
    lines += [
        f"  {p.name:<{width}} {_shown(p.value, p):>10} {_unit(p):<3} sigma {_shown(p.sigma, p):>8}"
        f"  t {p.t:8.2f}  {p.meaning}{'' if p.significant else ', not significant'}"
        for p in c.parameters
    ]
    lines += [*(one.line() for one in found), *(f"= {one}" for one in further)]
    nothing = InputError(
        "no redundancy: nothing is checked", cure="observe more before these figures are used"
    )
    return Answer(
        "Self-calibration",
        title,
        _front(c),
        c,
        FORM,
        {"title": title, "sentences": words(found)},
        [*map(Finding, further), *found],
        first=[_parameters(c)],
        pictures=_charts(c),
        tables=[_left(c), _omitted(c), _pairs(c), *_datums(c), _remedies(c)],
        footer=Sentence("Datum: {c.datum}. Sigmas {c.sigma_origin}.", c=c),
        terminal=[joined("\n", lines)],
        failure=None if sigma0.dof > 0 else nothing,
    )


def _unit(item: Any) -> str:
    """Unit that people read of an item's: mm, arc seconds, parts per million."""
    return {"m": "mm", "rad": "″"}.get(item.unit, "ppm")


def _spec(value: float, unit: str) -> str:
    """How a quantity is written in a unit that people read, with more digits if it is small."""
    return f"{unit}{'g4' if _NOTHING <= abs(scaled(value, unit)) < 0.01 else '3'}~"


def _size(value: float, unit: str) -> str:
    """A small quantity in a unit that people read, which is not written."""
    spec = _spec(value, unit)
    return written(value if abs(scaled(value, spec)) >= _NOTHING else 0.0, spec)


def _shown(value: float, item: Any) -> str:
    """A quantity of an item in the unit of that."""
    return _size(value, _unit(item))


def _findings(c: SelfCalibration) -> Iterator[Finding]:
    """Everything that is worth saying, what is most important first."""
    test = global_test(c.adjustment)
    yield Finding(capital(test.sentence()) + ".", test.passed is not True, "global_test")
    blunders = [] if c.log is None else c.log.sentences()
    for key, told in (("warning", c.adjustment.warnings), ("blunder", blunders)):
        yield from (Finding(capital(one) + ".", True, key) for one in told)
    yield from _estimability(c)
    yield from _significance(c)
    yield from _model(c)
    counts = joined(
        ", ",
        (
            Sentence("{n} above {limit:g}", n=c.rho.above(limit) or "none", limit=limit)
            for limit in LIMITS
        ),
    )
    said = "Correlations of parameters with each other and with orientations: {counts}."
    yield Finding.of("correlations", said, counts=counts)
    by_point = c.rho.strongest_by_point
    if by_point.size:
        said = "The strongest correlation of a parameter with a point is {strongest:2}."
        yield Finding.of("with_points", said, strongest=float(by_point.max()))
    if len(c.datums) > 1:
        yield _other_datums(c)


def _estimability(c: SelfCalibration) -> Iterator[Finding]:
    """Separable parameters, barely separable ones, and observations that would help."""
    if c.dropped:
        reasons = "; ".join(f"{i.name} ({i.why})" for i in c.left_out if i.name in c.dropped)
        said = "Left out because they cannot be separated: {reasons}."
        yield Finding.of("left_out", said, True, reasons=reasons)
    elif not c.open:
        yield Finding.of("separated", "All {n} parameters can be separated.", n=len(c.parameters))
    else:
        yield from (Finding(capital(said) + ".", True, "open") for said in c.open)
    for item in c.hardly_separated:
        yield Finding.of("hardly_separated", "{i.name}: {i.why}.", True, i=item)
    for said in remedy_sentences(c.proposal, c.remedies):
        yield Finding(capital(said) + ".", key="remedy")


def _significance(c: SelfCalibration) -> Iterator[Finding]:
    """Tests of the parameters, single and together, and the set that is worth keeping."""
    weak, count = [p.name for p in c.parameters if not p.significant], len(c.parameters)
    if c.datums:
        yield _different(weak, count)
        said = "Test of all parameters together against zero: {test}."
        yield Finding.of("together", said, test=_block(c.tests.together))
    if c.tests.gain is not None:
        better = c.tests.gain.p < _LEVEL
        yield Finding.of(
            "gain",
            "The observations {verb} with the parameters than without them: {test}.",
            not better,
            verb="fit better" if better else "fit not significantly better",
            test=_block(c.tests.gain),
        )
    proposed = c.proposed
    if proposed and len(proposed) < count:
        yield Finding.of("proposed", "Proposed set: {names}.", True, names=", ".join(proposed))


def _different(weak: Sequence[str], count: int) -> Finding:
    """Which parameters are different from zero, each by itself."""
    differ, rest = "significantly different from zero", count - len(weak)
    if not weak:
        said = ("The parameter is" if count == 1 else "All {count} parameters are") + f" {differ}."
    elif not rest:
        said = f"No parameter is {differ}."
    else:
        said = f"{{rest}} of {{count}} parameters {'is' if rest == 1 else 'are'} {differ}; "
        said += f"{{weak}} {'is' if len(weak) == 1 else 'are'} not."
    weak_names = ", ".join(weak)
    return Finding.of("significant", said, not rest, rest=rest, count=count, weak=weak_names)


def _block(test: BlockTest) -> Sentence:
    """A test of several parameters."""
    what = "F({t.freedom}, {t.redundancy})" if test.posterior else "chi²({t.freedom})"
    value = test.statistic * (1 if test.posterior else test.freedom)
    p = "p below {least:g}" if test.p < 1e-4 else "p = {t.p:g2}"
    digits = 0 if value >= 100 else 2
    return Sentence(f"{what} = {{value:{digits}}}, {p}", t=test, value=value, least=1e-4)


def _stations_differ(c: SelfCalibration) -> bool:
    """True if a test says that the stations have not the same parameters."""
    return c.tests.stations_differ is not None and c.tests.stations_differ.p < _DIFFER


def _model(c: SelfCalibration) -> Iterator[Finding]:
    """Is the model complete, and one for all stations?"""
    omitted = c.tests.omitted
    missing = sorted((o for o in omitted if o.missing), key=lambda o: -abs(o.w))
    yield from map(_missing, missing[:6])
    if missing:
        yield Finding(
            "The model does not describe the residuals: its form, or the meaning of its angles, "
            "may be wrong.",
            True,
            "model_incomplete",
        )
    elif omitted:
        said = "No test calls for any of the {n} parameters that were not estimated: the model is "
        yield Finding.of("model_complete", f"{said}large enough.", n=len(omitted))
    if c.tests.stations_differ is not None:
        differ = _stations_differ(c)
        verdict = "differ" if differ else "do not differ significantly"
        said = f"The parameters {verdict} from station to station: {{test}}."
        yield Finding.of("stations_differ", said, differ, test=_block(c.tests.stations_differ))


def _missing(o: Omitted) -> Finding:
    value, sigma = (f"{{o.{k}:{_spec(getattr(o, k), _unit(o))}}}" for k in ("value", "sigma"))
    return Finding.of(
        "missing",
        f"The residuals call for {{o.name}} ({{o.meaning}}): {value} {_unit(o)} with sigma {sigma} "
        "(w = {o.w:1} against {o.limit:1}).",
        True,
        o=o,
    )


def _other_datums(c: SelfCalibration) -> Finding:
    """What stays the same in every datum."""
    own, others = c.datums[0], c.datums[1:]
    ratios = np.concatenate([_ratio(d.parameters, own.parameters) for d in others])
    lengths = np.concatenate([_ratio(d.distances, own.distances) for d in others])
    said = f"In {'another datum' if len(others) == 1 else 'other datums'} ({{names}}) "
    if np.abs(np.concatenate([ratios, lengths]) - 1).max(initial=0.0) < _SAME:
        said += "parameters and distances between points have the same sigmas; "
    else:
        said += "the sigmas of the parameters are {ratios} times as large, those of distances "
        said += "between points {lengths} times; "
    return Finding.of(
        "datums",
        said + "those of coordinates and orientations belong to the datum and change with it.",
        names=" and ".join(d.datum for d in others),
        ratios=_range(ratios),
        lengths=_range(lengths),
    )


def _ratio(a: Array, b: Array) -> Array:
    good = b > 0
    return np.asarray(a[good] / b[good])


def _range(values: Array) -> str:
    if len(values) == 0:
        return "1"
    low, high = float(values.min()), float(values.max())
    return Sentence("{low:4}" if high - low < _SAME else "{low:4} to {high:4}", low=low, high=high)


def _charts(calibration: SelfCalibration) -> list[Picture]:
    """All pictures."""
    c = calibration.rho
    axes = [f"{station} {name}" for station in c.stations for name in _COMPONENTS]
    held, largest = "Empty cells: held by the datum.", "Largest absolute value over the coordinates"
    maps = [
        ("within", "each other", c.within, c.names, ""),
        ("orientations", "orientations", c.orientation, axes, held),
        ("points", "points", c.strongest_by_point, c.point_names, f"{largest} of each point."),
    ]
    drawn = [
        _heat(name, f"Correlations of the parameters with {what}", rho, c.names, columns, caption)
        for name, what, rho, columns, caption in maps
        if rho.size
    ]
    return [*drawn, _residuals(calibration)]


def _heat(
    name: str, title: str, rho: Array, rows: Sequence[str], columns: Sequence[str], caption: str
) -> Picture:
    """A heat map."""
    size = (
        float(np.clip(130.0 + 34.0 * len(columns), 420.0, 1200.0)),
        float(np.clip(120.0 + 22.0 * len(rows), 170.0, 900.0)),
    )
    ends = (-0.5, len(columns) - 0.5), (-0.5, len(rows) - 0.5)
    chart = Chart(*ends, ("", ""), size, names=columns, rows=rows)
    chart.cells(rho, -1.0, 1.0, _WRITTEN)
    scale = colour_bar(-1.0, 1.0, "correlation", size[0], SIGNED)
    wide = size[0] > 700
    return Picture(name, title, beside([[chart]], title, scale), caption, wide=wide)


def _residuals(calibration: SelfCalibration) -> Picture:
    """Residuals of range, H and V against range, H and V; without and with parameters."""
    r = calibration.readings
    step = max(1, len(r.polar) // _MOST_DOTS)
    across = [
        ("range [m]", r.polar[::step, 0]),
        ("horizontal angle [°]", np.degrees(r.polar[::step, 1]) % 360),
        ("zenith angle [°]", np.degrees(r.polar[::step, 2])),
    ]
    rows = []
    for row, (what, unit) in enumerate((("range", "mm"), ("horizontal", "″"), ("zenith", "″"))):
        after = scaled(r.after[::step, row], unit)
        before = after[:0] if r.before is None else scaled(r.before[::step, row], unit)
        most = 1.05 * float(np.abs(np.concatenate([before, after])).max(initial=1e-9))
        panels = []
        for against, x in across:
            ends = float(x.min()), float(x.max())
            label = f"residual of {what} [{unit}]"
            panel = Chart(ends, (-most, most), (against, label), (410.0, 250.0))
            if len(before):
                panel.dots(x, before, "s1")
            panel.dots(x, after, "s0")
            panel.line(ends, (0.0, 0.0), "faint")
            panels.append(panel)
        rows.append(panels)
    entries = [("s0", "with the parameters")]
    if r.before is not None:
        entries.insert(0, ("s1", "without"))
    title = "Residuals against range and angles"
    drawing = beside(rows, title, legend(entries, 1230.0))
    caption = (
        "Residuals of the network without and with the parameters: what still bends or steps with "
        "them is an error that the model does not have."
    )
    return Picture("residuals", title, drawing, caption, wide=True)


def _front(c: SelfCalibration) -> FrontPage:
    """Whether the parameters can be used, and what one signs."""
    test, count = global_test(c.adjustment), counted(len(c.parameters), "parameter")
    missing = sum(o.missing for o in c.tests.omitted)
    asked = ""
    if missing:
        was, is_ = ("was", "is") if missing == 1 else ("were", "are")
        asked = f"; {counted(missing, 'parameter')} that {was} not estimated {is_} called for"
    if _stations_differ(c):
        asked += "; the parameters differ from station to station"
    sort: Literal["good", "look", "bad", "none"] = "none" if asked else "good"
    begin = f"{count} determined, global test passed"
    if test.passed is None:
        sort, begin = "none", f"{count} determined, not checked"
    elif not test.passed:
        sort, begin = "bad", "Global test failed"
    signed = Sentence(
        "{count} with {its} sigmas {c.sigma_origin}. Datum: {c.datum}.",
        count=counted(len(c.parameters), "calibration parameter"),
        its="its" if len(c.parameters) == 1 else "their",
        c=c,
    )
    return FrontPage(sort, begin + asked, capital(test.sentence()) + ".", signed=signed)


def _parameters(c: SelfCalibration) -> ReportTable:
    columns = [
        column("Parameter", "name"),
        column("What it is", "meaning"),
        column("Value", "value", _shown),
        column("σ", "sigma", _shown),
        column("Unit", _unit),
        column("t", "t", "2", mark=lambda p: "good" if p.significant else ""),
    ]
    note = Sentence(
        "True = measured + correction. Sigmas {c.sigma_origin}. Significant t are green.", c=c
    )
    return build_table("parameters", "Parameters", note, c.parameters, columns)


def _left(c: SelfCalibration) -> ReportTable:
    note = "Proposed to be left out: what cannot be separated, then what hardly can."
    columns = [column("Parameter", "name"), column("Why", "why")]
    items = [*c.left_out, *c.hardly_separated]
    return build_table("left", "Not or hardly separated", note, items, columns)


def _omitted(c: SelfCalibration) -> ReportTable:
    columns = [
        column("Parameter", "name"),
        column("What it is", "meaning"),
        column("Would be", "value", _shown),
        column("σ", "sigma", _shown),
        column("Unit", _unit),
        column("w", "w", "2", mark=lambda o: "bad" if o.missing else ""),
        column("limit", "limit", "2"),
    ]
    note = (
        "What the residuals say of each, as if it were the only one added. Red: they call for it."
    )
    title = "Parameters that were not estimated"
    return build_table("omitted", title, note, c.tests.omitted, columns)


def _pairs(c: SelfCalibration) -> ReportTable:
    columns = [
        column("Parameter", "a"),
        column("and", "b"),
        column("Correlation", "value", "3", mark=lambda p: "bad" if abs(p.value) > 0.9 else ""),
    ]
    note = Sentence(
        "Above {limit:g}, strongest first; those with orientations belong to the datum.",
        limit=LIMITS[0],
    )
    return build_table("correlations", "Correlations", note, c.correlations, columns, most=500)


def _datums(c: SelfCalibration) -> Iterator[ReportTable]:
    """Sigmas of parameters, of stations and of points in every datum."""
    several = len(c.datums) > 1
    columns = [column("Parameter", lambda r: r[0].name), column("Unit", lambda r: _unit(r[0]))]
    for k, d in enumerate(c.datums, 1):
        columns.append(column(f"σ, {d.datum}", itemgetter(k), lambda v, r: _shown(v, r[0])))
    rows: list[Any] = list(zip(c.parameters, *(d.parameters for d in c.datums), strict=True))
    note = "A priori. Estimable parameters have the same sigma in every datum."
    title = "Parameters in other datums"
    yield build_table("datum-parameters", title, note, rows if several else [], columns)

    layout = c.adjustment.layout
    rows = [
        (d.datum, name, *values)
        for d in c.datums
        for name, values in zip(layout.names["pose"], d.stations, strict=True)
    ]
    if several:
        means = [np.sqrt((d.of_points**2).mean(axis=0)) for d in c.datums]
        for d, mean in zip(c.datums, means, strict=True):
            rows.append((d.datum, "mean of points", *mean, *3 * [np.nan]))
    columns = [column("Datum", itemgetter(0)), column("Station", itemgetter(1))]
    for k, head in enumerate(_COMPONENTS):
        columns.append(column(f"σ {head}", itemgetter(k + 2), "mm3" if k < 3 else "″3"))
    note = "A priori. The same observations; only what is held differs."
    yield build_table("datum-stations", "Stations and points by datum", note, rows, columns)

    columns = [column("Point", itemgetter(0))]
    for k, d in enumerate(c.datums, 1):
        columns.append(
            column(f"σ 3D, {d.datum}", itemgetter(k), lambda v, _: _size(v, "mm"), unit="mm")
        )
    sizes = [np.sqrt((d.of_points**2).sum(axis=1)) for d in c.datums]
    rows = list(zip(layout.names["point"], *sizes, strict=True)) if several else []
    note = "A priori. What a point is known by depends on what it is referred to."
    yield build_table("datum-points", "Points by datum", note, rows, columns, most=2000)


def _remedies(c: SelfCalibration) -> ReportTable:
    own = dict(zip(c.proposal.names, c.proposal.sigma, strict=True))

    def largest(remedy: Remedy) -> float:
        """Largest fall of a sigma."""
        pairs = zip(remedy.estimable, remedy.sigma, strict=True)
        return float(max((own[n] / s for n, s in pairs if n in own and s > 0), default=1.0))

    columns = [
        column("Addition", "what"),
        column("Estimable", lambda r: len(r.estimable), "0"),
        column("Well separated", lambda r: len(r.well_separated), "0"),
        column(
            "Best gain", largest, lambda gain, _: Sentence("sigma divided by {gain:1}", gain=gain)
        ),
    ]
    note = (
        f"Now {len(c.proposal.names)} are estimable and {len(c.proposal.recommended)} of them well "
        "separated. Tried out on the design, without observations."
    )
    return build_table("remedies", "What would help", note, c.remedies, columns)
