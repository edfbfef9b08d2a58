"""A self-calibration in words, as text, as a page with charts, and as data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from tribrach._types import Array
from tribrach.calibration.correlations import LIMITS, CorrelatedPair
from tribrach.calibration.estimability import Left
from tribrach.calibration.remedies import Remedy
from tribrach.calibration.self_calibration import Parameter, SelfCalibration, remedy_sentences
from tribrach.calibration.significance import BlockTest, Omitted
from tribrach.instruments.calibration import meaning_of, unit_of
from tribrach.network.quality import global_test
from tribrach.report.charts import SIGNED, Chart, beside, colour_bar, legend
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding, words
from tribrach.report.numbers import count_cell, counted, matrix, number, numbers
from tribrach.report.page import FrontPage, page
from tribrach.report.schema.base import heading
from tribrach.report.schema.calibration import SCHEMA, CalibrationDocument
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    build_table,
    number_cell,
    text_cell,
)
from tribrach.units import SEC

__all__ = ["calibration_document", "calibration_page", "calibration_sentences", "calibration_text"]


#: less is no size of a parameter, in its shown unit: a nanometre, a millionth of an arc second
_NOTHING = 1e-6


def _shown_unit(unit: str) -> str:
    """Unit that people read: mm, arc seconds, parts per million."""
    return {"m": "mm", "rad": "″"}.get(unit, "ppm")


def _shown(value: float, unit: str) -> str:
    """A small quantity in its shown unit."""
    scaled = value * {"m": 1e3, "rad": 1 / SEC}.get(unit, 1e6)
    if abs(scaled) < _NOTHING:
        return "0.000"
    return f"{scaled:.4g}" if abs(scaled) < 0.01 else f"{scaled:.3f}"


def calibration_text(calibration: SelfCalibration) -> str:
    """Lines for a terminal: counts, parameters, findings."""
    adjustment = calibration.adjustment
    lines = [
        f"{adjustment.n_observations} observed values, {adjustment.n_unknowns} unknowns, "
        f"redundancy {adjustment.dof}, sigma0 {adjustment.sigma0_posterior:.4f}",
        f"datum: {calibration.datum_words}; sigmas {calibration.sigma_origin}",
    ]
    width = max(len(p.name) for p in calibration.parameters)
    for p in calibration.parameters:
        unit = _shown_unit(p.unit)
        mark = "" if p.significant else ", not significant"
        lines.append(
            f"  {p.name:<{width}} {_shown(p.value, p.unit):>10} {unit:<3} "
            f"sigma {_shown(p.sigma, p.unit):>8}  t {p.t:8.2f}  {p.meaning}{mark}"
        )
    return "\n".join([*lines, *(found.line() for found in calibration_findings(calibration))])


def calibration_sentences(calibration: SelfCalibration) -> list[str]:
    """Everything that is worth saying, what is most important first."""
    return words(calibration_findings(calibration))


def calibration_findings(calibration: SelfCalibration) -> list[Finding]:
    """The same sentences, and which of them ask for something."""
    a = calibration.adjustment
    test = global_test(a)
    out = [Finding(f"{_upper(test.sentence())}.", test.passed is not True)]
    out += [Finding(f"{_upper(said)}.", True) for said in a.warnings]
    if calibration.log is not None:
        out += [Finding(f"{_upper(said)}.", True) for said in calibration.log.sentences()]
    out += _estimability(calibration)
    out += _significance(calibration)
    out += _model(calibration)
    out += map(Finding, _correlated(calibration))
    out += map(Finding, _datum(calibration))
    return out


def _upper(words: str) -> str:
    return words[:1].upper() + words[1:]


def _estimability(calibration: SelfCalibration) -> list[Finding]:
    """What can be separated, what only just, and what would help."""
    proposal, out = calibration.proposal, list[Finding]()
    if calibration.left_out:
        reasons = [f"{i.name} ({i.why})" for i in proposal.left if i.name in calibration.left_out]
        said = f"Left out because they cannot be separated: {'; '.join(reasons)}."
        out.append(Finding(said, True))
    elif not calibration.estimability.open:
        out.append(Finding(f"All {len(calibration.parameters)} parameters can be separated."))
    else:
        out += [Finding(f"{_upper(said)}.", True) for said in calibration.estimability.open]
    out += [Finding(f"{item.name}: {item.why}.", True) for item in proposal.hardly]
    remedies = remedy_sentences(proposal, calibration.remedies)
    return [*out, *(Finding(f"{_upper(said)}.") for said in remedies)]


def _p(p: float) -> str:
    return "p below 0.0001" if p < 1e-4 else f"p = {p:.2g}"


def _significance(calibration: SelfCalibration) -> list[Finding]:
    """Tests of the parameters, single and together, and the set that is worth keeping."""
    out = list[Finding]()
    weak = [p.name for p in calibration.parameters if not p.significant]
    count = len(calibration.parameters)
    if calibration.datums:
        out.append(Finding(_different(weak, count), len(weak) == count))
        together = _block(calibration.together)
        out.append(Finding(f"Test of all parameters together against zero: {together}."))
    if calibration.gain is not None:
        better = calibration.gain.p < _LEVEL
        verb = "fit better" if better else "fit not significantly better"
        said = (
            f"The observations {verb} with the parameters than without them: "
            f"{_block(calibration.gain)}."
        )
        out.append(Finding(said, not better))
    if calibration.datums and calibration.suggested and len(calibration.suggested) < count:
        out.append(Finding(f"Proposed set: {', '.join(calibration.suggested)}.", True))
    return out


def _different(weak: Sequence[str], count: int) -> str:
    """Which parameters are different from zero, each by itself."""
    differ = "significantly different from zero"
    if not weak:
        every = "The parameter is" if count == 1 else f"All {count} parameters are"
        return f"{every} {differ}."
    if len(weak) == count:
        return f"No parameter is {differ}."
    verb = "is" if count - len(weak) == 1 else "are"
    return (
        f"{count - len(weak)} of {count} parameters {verb} {differ}; {', '.join(weak)} "
        f"{'is' if len(weak) == 1 else 'are'} not."
    )


def _block(test: BlockTest) -> str:
    """A test of several parameters."""
    if test.posterior:
        what, statistic = f"F({test.freedom}, {test.redundancy})", test.statistic
    else:
        what, statistic = f"chi²({test.freedom})", test.freedom * test.statistic
    digits = 0 if statistic >= 100 else 2
    return f"{what} = {statistic:.{digits}f}, {_p(test.p)}"


def _model(calibration: SelfCalibration) -> list[Finding]:
    """Is the model complete, and one for all stations?"""
    missing = sorted((o for o in calibration.omitted if o.missing), key=lambda o: -abs(o.w))
    out = [Finding(_missing(o), True) for o in missing[:6]]
    if calibration.omitted and not missing:
        said = (
            f"No test calls for any of the {len(calibration.omitted)} parameters that were "
            "not estimated: the model is large enough."
        )
        out.append(Finding(said))
    if missing:
        said = (
            "The model does not describe the residuals: its form, or the meaning of its angles, "
            "may be wrong."
        )
        out.append(Finding(said, True))
    if calibration.differ is not None:
        differ = _stations_differ(calibration)
        verdict = "differ" if differ else "do not differ significantly"
        said = f"The parameters {verdict} from station to station: {_block(calibration.differ)}."
        out.append(Finding(said, differ))
    return out


def _missing(o: Omitted) -> str:
    unit = unit_of(o.name)
    return (
        f"The residuals call for {o.name} ({meaning_of(o.name)}): {_shown(o.value, unit)} "
        f"{_shown_unit(unit)} with sigma {_shown(o.sigma, unit)} "
        f"(w = {o.w:.1f} against {o.limit:.1f})."
    )


def _correlated(calibration: SelfCalibration) -> list[str]:
    c = calibration.correlations
    counts = ", ".join(f"{c.above(limit) or 'none'} above {limit:g}" for limit in LIMITS)
    out = [f"Correlations of parameters with each other and with orientations: {counts}."]
    if c.strongest_by_point.size:
        strongest = float(c.strongest_by_point.max())
        out.append(f"The strongest correlation of a parameter with a point is {strongest:.2f}.")
    return out


def _datum(calibration: SelfCalibration) -> list[str]:
    """What stays the same in every datum."""
    if len(calibration.datums) < 2:
        return []
    own, others = calibration.datums[0], calibration.datums[1:]
    ratios = np.concatenate([_ratio(d.parameters, own.parameters) for d in others])
    lengths = np.concatenate([_ratio(d.distances, own.distances) for d in others])
    names = " and ".join(d.datum for d in others)
    begin = f"In {'another datum' if len(others) == 1 else 'other datums'} ({names})"
    end = "those of coordinates and orientations belong to the datum and change with it."
    if max(np.abs(np.concatenate([ratios, lengths]) - 1).max(initial=0.0), 0.0) < _SAME:
        return [f"{begin} parameters and distances between points have the same sigmas; {end}"]
    return [
        f"{begin} the sigmas of the parameters are {_range(ratios)} times as large, those of "
        f"distances between points {_range(lengths)} times; {end}"
    ]


def _ratio(a: Array, b: Array) -> Array:
    good = b > 0
    return np.asarray(a[good] / b[good])


def _range(values: Array) -> str:
    if len(values) == 0:
        return "1"
    low, high = float(values.min()), float(values.max())
    return f"{low:.4f}" if high - low < _SAME else f"{low:.4f} to {high:.4f}"


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


def calibration_charts(calibration: SelfCalibration) -> list[Picture]:
    """All pictures."""
    c = calibration.correlations
    axes = [f"{station} {name}" for station in c.stations for name in _COMPONENTS]
    pictures = [
        _heat(
            "within",
            "Correlations of the parameters with each other",
            c.within,
            c.names,
            c.names,
            "",
        ),
        _heat(
            "orientations",
            "Correlations of the parameters with orientations",
            c.orientation,
            c.names,
            axes,
        ),
        _heat(
            "points",
            "Correlations of the parameters with points",
            c.strongest_by_point,
            c.names,
            c.point_names,
            "Largest absolute value over the coordinates of each point.",
        ),
    ]
    return [p for p in pictures if p is not None] + [_residuals(calibration)]


def _heat(
    name: str,
    title: str,
    rho: Array,
    rows: tuple[str, ...],
    columns: tuple[str, ...] | list[str],
    caption: str = "Empty cells: held by the datum.",
) -> Picture | None:
    """A heat map; None if there is nothing in it."""
    if rho.size == 0:
        return None
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
    up = [("range [mm]", 0, 1e3), ("horizontal [″]", 1, 1 / SEC), ("zenith [″]", 2, 1 / SEC)]
    rows = []
    for what, row, scale in up:
        after = r.after[::step, row] * scale
        before = after[:0] if r.before is None else r.before[::step, row] * scale
        most = 1.05 * float(np.abs(np.concatenate([before, after])).max(initial=1e-9))
        panels = []
        for against, x in across:
            ends = float(x.min()), float(x.max())
            label = f"residual of {what}"
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


def calibration_page(title: str, calibration: SelfCalibration, further: Sequence[str] = ()) -> str:
    """A calibration as one HTML file.

    Parameters
    ----------
    title
        Of the page.
    found
        The calibration.
    further
        Sentences to begin with.
    """
    footer = f"Datum: {calibration.datum_words}. Sigmas {calibration.sigma_origin}."
    return page(
        "Self-calibration",
        title,
        _front(calibration),
        [*further, *calibration_sentences(calibration)],
        calibration_charts(calibration),
        [
            _left(calibration),
            _omitted(calibration),
            _pairs(calibration),
            _datum_parameters(calibration),
            _datum_stations(calibration),
            _datum_points(calibration),
            _remedies(calibration),
        ],
        footer,
        first=[_parameters(calibration)],
    )


def _front(calibration: SelfCalibration) -> FrontPage:
    """Whether the parameters can be used, and what one signs."""
    test = global_test(calibration.adjustment)
    count = len(calibration.parameters)
    missing = sum(o.missing for o in calibration.omitted)
    todo = [
        f"{counted(missing, 'parameter')} that {'was' if missing == 1 else 'were'} not estimated "
        f"{'is' if missing == 1 else 'are'} called for"
        if missing
        else "",
        "the parameters differ from station to station" if _stations_differ(calibration) else "",
    ]
    asked = "".join(f"; {words}" for words in todo if words)
    sort: Literal["good", "look", "bad", "none"] = "none" if asked else "good"
    begin = f"{counted(count, 'parameter')} determined, global test passed"
    if test.passed is None:
        sort, begin = "none", f"{counted(count, 'parameter')} determined, not checked"
    elif not test.passed:
        sort, begin = "bad", "Global test failed"
    signed = (
        f"{counted(count, 'calibration parameter')} with {'its' if count == 1 else 'their'} "
        f"sigmas {calibration.sigma_origin}. Datum: {calibration.datum_words}."
    )
    return FrontPage(sort, begin + asked, f"{_upper(test.sentence())}.", signed=signed)


def _stations_differ(calibration: SelfCalibration) -> bool:
    """True if a test says that the stations have not the same parameters."""
    return calibration.differ is not None and calibration.differ.p < _DIFFER


def _small(value: float, unit: str, mark: str = "") -> Cell:
    return number_cell(value, _shown(value, unit), mark)


def _parameters(calibration: SelfCalibration) -> ReportTable:
    def t_cell(p: Parameter) -> Cell:
        return number_cell(p.t, f"{p.t:.2f}", "good" if p.significant else "")

    columns = [
        (ColumnHead("Parameter", numeric=False), lambda p: text_cell(p.name)),
        (ColumnHead("What it is", numeric=False), lambda p: text_cell(p.meaning)),
        (ColumnHead("Value"), lambda p: _small(p.value, p.unit)),
        (ColumnHead("σ"), lambda p: _small(p.sigma, p.unit)),
        (ColumnHead("Unit", numeric=False), lambda p: text_cell(_shown_unit(p.unit))),
        (ColumnHead("t"), t_cell),
    ]
    note = (
        f"True = measured + correction. Sigmas {calibration.sigma_origin}. Significant t are green."
    )
    return build_table("parameters", "Parameters", note, calibration.parameters, columns)


def _left(calibration: SelfCalibration) -> ReportTable:
    items = [*calibration.proposal.left, *calibration.proposal.hardly]
    columns = [
        (ColumnHead("Parameter", numeric=False), lambda i: text_cell(i.name)),
        (ColumnHead("Why", numeric=False), lambda i: text_cell(i.why)),
    ]
    note = "Proposed to be left out: what cannot be separated, then what hardly can."
    return build_table("left", "Not or hardly separated", note, items, columns)


def _omitted(calibration: SelfCalibration) -> ReportTable:
    def w_cell(o: Omitted) -> Cell:
        return number_cell(o.w, f"{o.w:.2f}", "bad" if o.missing else "")

    columns = [
        (ColumnHead("Parameter", numeric=False), lambda o: text_cell(o.name)),
        (ColumnHead("What it is", numeric=False), lambda o: text_cell(meaning_of(o.name))),
        (ColumnHead("Would be"), lambda o: _small(o.value, unit_of(o.name))),
        (ColumnHead("σ"), lambda o: _small(o.sigma, unit_of(o.name))),
        (ColumnHead("Unit", numeric=False), lambda o: text_cell(_shown_unit(unit_of(o.name)))),
        (ColumnHead("w"), w_cell),
        (ColumnHead("limit"), lambda o: number_cell(o.limit, f"{o.limit:.2f}")),
    ]
    note = (
        "What the residuals say of each, as if it were the only one added. Red: they call for it."
    )
    return build_table(
        "omitted", "Parameters that were not estimated", note, calibration.omitted, columns
    )


def _pairs(calibration: SelfCalibration) -> ReportTable:
    columns = [
        (ColumnHead("Parameter", numeric=False), lambda p: text_cell(p.a)),
        (ColumnHead("and", numeric=False), lambda p: text_cell(p.b)),
        (
            ColumnHead("Correlation"),
            lambda p: number_cell(p.value, f"{p.value:.3f}", "bad" if abs(p.value) > 0.9 else ""),
        ),
    ]
    note = "Above 0.7, strongest first; those with orientations belong to the datum."
    return build_table(
        "correlations", "Correlations", note, calibration.correlations.pairs, columns, most=500
    )


def _datum_parameters(calibration: SelfCalibration) -> ReportTable:
    rows = list(range(len(calibration.parameters))) if len(calibration.datums) > 1 else []
    columns = [
        (ColumnHead("Parameter", numeric=False), lambda k: text_cell(calibration.names[k])),
        (
            ColumnHead("Unit", numeric=False),
            lambda k: text_cell(_shown_unit(calibration.parameters[k].unit)),
        ),
        *[
            (
                ColumnHead(f"σ, {d.datum}"),
                lambda k, d=d: _small(float(d.parameters[k]), calibration.parameters[k].unit),
            )
            for d in calibration.datums
        ],
    ]
    note = "A priori. Estimable parameters have the same sigma in every datum."
    return build_table("datum-parameters", "Parameters in other datums", note, rows, columns)


def _datum_stations(calibration: SelfCalibration) -> ReportTable:
    layout = calibration.adjustment.layout
    names = layout.names["pose"]
    rows = (
        [(d, s) for d in calibration.datums for s in range(len(names))]
        if calibration.datums
        else []
    )
    if len(calibration.datums) > 1:
        rows += [(d, -1) for d in calibration.datums]

    def value(row: tuple[Any, int], k: int) -> Cell:
        d, s = row
        if s < 0:
            mean = float(np.sqrt((d.points[:, k] ** 2).mean())) if k < 3 else float("nan")
            return number_cell(mean if k < 3 else None, f"{1e3 * mean:.3f}")
        scale = 1e3 if k < 3 else 1 / SEC
        return number_cell(float(d.stations[s, k]), f"{scale * d.stations[s, k]:.3f}")

    heads = (
        ("E", "mm"), ("N", "mm"), ("U", "mm"), ("tilt E", "″"), ("tilt N", "″"), ("heading", "″"),
    )  # fmt: skip
    columns = [
        (ColumnHead("Datum", numeric=False), lambda row: text_cell(row[0].datum)),
        (
            ColumnHead("Station", numeric=False),
            lambda row: text_cell(names[row[1]] if row[1] >= 0 else "mean of points"),
        ),
        *[
            (ColumnHead(f"σ {head}", unit), lambda row, k=k: value(row, k))
            for k, (head, unit) in enumerate(heads)
        ],
    ]
    note = "A priori. The same observations; only what is held differs."
    return build_table("datum-stations", "Stations and points by datum", note, rows, columns)


def _datum_points(calibration: SelfCalibration) -> ReportTable:
    """Three-dimensional sigma of every point in every datum."""
    names = calibration.adjustment.layout.names["point"]
    sigmas = [np.sqrt((d.points**2).sum(axis=1)) for d in calibration.datums]
    columns = [
        (ColumnHead("Point", numeric=False), lambda k: text_cell(names[k])),
        *[
            (ColumnHead(f"σ 3D, {d.datum}", "mm"), lambda k, s=s: _small(float(s[k]), "m"))
            for d, s in zip(calibration.datums, sigmas, strict=True)
        ],
    ]
    note = "A priori. What a point is known by depends on what it is referred to."
    rows = list(range(len(names))) if len(calibration.datums) > 1 else []
    return build_table("datum-points", "Points by datum", note, rows, columns, most=2000)


def _remedies(calibration: SelfCalibration) -> ReportTable:
    own = dict(zip(calibration.proposal.names, calibration.proposal.sigma, strict=True))

    def largest(remedy: Remedy) -> float:
        """Largest fall of a sigma."""
        p = remedy.proposal
        ratios = [own[n] / s for n, s in zip(p.names, p.sigma, strict=True) if n in own and s > 0]
        return float(max(ratios, default=1.0))

    columns = [
        (ColumnHead("Addition", numeric=False), lambda r: text_cell(r.what)),
        (ColumnHead("Estimable"), lambda r: count_cell(len(r.proposal.names))),
        (ColumnHead("Well separated"), lambda r: count_cell(len(r.proposal.recommended))),
        (
            ColumnHead("Best gain"),
            lambda r: number_cell(largest(r), f"sigma divided by {largest(r):.1f}"),
        ),
    ]
    note = (
        f"Now {len(calibration.proposal.names)} are estimable and "
        f"{len(calibration.proposal.recommended)} of them well separated. "
        "Tried out on the design, without observations."
    )
    return build_table("remedies", "What would help", note, calibration.remedies, columns)


def calibration_document(title: str, calibration: SelfCalibration) -> CalibrationDocument:
    """The calibration as data; metres, radians and their squares."""
    a = calibration.adjustment
    data = heading(SCHEMA) | {
        "title": title,
        "datum": calibration.datum_words,
        "sigma_origin": calibration.sigma_origin,
        "sigma0": {
            "prior": a.sigma0,
            "posterior": number(a.sigma0_posterior),
            "dof": a.dof,
            "vtpv": a.vtpv,
        },
        "counts": {
            "observed": a.n_observations,
            "unknowns": a.n_unknowns,
            "constraints": a.n_constraints,
            "defect": a.defect,
        },
        "parameters": [
            {
                "name": p.name,
                "meaning": p.meaning,
                "unit": p.unit,
                "value": p.value,
                "sigma": p.sigma,
                "t": number(p.t),
                "significant": p.significant,
            }
            for p in calibration.parameters
        ],
        "covariance": matrix(calibration.covariance),
        "stations": _stations_json(calibration),
        "open": list(calibration.estimability.open),
        "closed_by_datum": list(calibration.estimability.datum),
        "left_out": [_left_json(i) for i in calibration.proposal.left],
        "hardly_separated": [_left_json(i) for i in calibration.proposal.hardly],
        "proposed": list(calibration.suggested),
        "remedies": [_remedy_json(r) for r in calibration.remedies],
        "tests": {
            "together": _test_json(calibration.together),
            "gain": _test_json(calibration.gain),
            "stations_differ": _test_json(calibration.differ),
            "omitted": [_omitted_json(o) for o in calibration.omitted],
        },
        "correlations": [_pair_json(p) for p in calibration.correlations.pairs],
        "datums": [
            {
                "datum": d.datum,
                "parameters": numbers(d.parameters),
                "stations": matrix(d.stations),
                "points": dict(zip(a.layout.names["point"], matrix(d.points), strict=True)),
                "distances": numbers(d.distances),
            }
            for d in calibration.datums
        ],
        "sentences": calibration_sentences(calibration),
    }
    return CalibrationDocument.model_validate(data)


def _stations_json(calibration: SelfCalibration) -> dict[str, Any]:
    """Poses with their covariance, left increments."""
    a = calibration.adjustment
    blocks = calibration.factor * a.family_covariances("pose")
    out = {}
    for k, name in enumerate(a.layout.names["pose"]):
        frame = np.eye(4)
        frame[:3, :3], frame[:3, 3] = a.state.pose_r[k], a.state.pose_t[k]
        out[name] = {"world_from_scanner": frame.tolist(), "covariance": matrix(blocks[k])}
    return out


def _left_json(item: Left) -> dict[str, str]:
    return {"name": item.name, "why": item.why}


def _remedy_json(remedy: Remedy) -> dict[str, Any]:
    return {
        "what": remedy.what,
        "estimable": list(remedy.proposal.names),
        "well_separated": list(remedy.proposal.recommended),
        "sigma": numbers(remedy.proposal.sigma),
    }


def _test_json(test: BlockTest | None) -> dict[str, Any] | None:
    if test is None:
        return None
    return {
        "freedom": test.freedom,
        "redundancy": test.redundancy,
        "statistic": number(test.statistic),
        "p": number(test.p),
        "kind": "F" if test.posterior else "chi-square over freedom",
    }


def _omitted_json(o: Omitted) -> dict[str, Any]:
    return {"name": o.name, "value": o.value, "sigma": o.sigma, "w": o.w, "limit": o.limit}


def _pair_json(pair: CorrelatedPair) -> dict[str, Any]:
    return {"a": pair.a, "b": pair.b, "value": pair.value}
