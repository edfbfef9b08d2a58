"""The tables of a plan: where to set up, where targets are, what is proposed, what it takes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from tribrach._types import Array
from tribrach.planning.prediction import CRITERIA, CriterionKind, Figures, largest_sigma
from tribrach.report.numbers import Style, mm_cell, number, numbers, three_digits
from tribrach.report.planning.sights import PlannedSight
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    build_table,
    number_cell,
    text_cell,
)
from tribrach.sentences import Sentence, joined
from tribrach.units import format_angle

if TYPE_CHECKING:
    from tribrach.job.plan.lever_arm import LeverArmForecast
    from tribrach.job.plan.steps import DesignResult

__all__ = ["criterion_words", "lever_arm_json", "lever_arm_sentences", "plan_tables", "shown"]

# What a plan says about a lever arm: a table, sentences, data.


_Row = tuple[str, Array]


#: targets that leave a wider part of the horizon free than this are not all around [rad]
_GAP = np.radians(180.0)


def _rows(forecast: LeverArmForecast) -> list[_Row]:
    """The solutions in words, with their covariances."""
    rows = [("as it is known", forecast.prior)]
    if forecast.before is not None:
        rows.append(("with the targets of the plan", forecast.before))
    if forecast.before is None or not np.array_equal(forecast.before, forecast.after):
        rows.append(("with what is proposed", forecast.after))
    return rows


def lever_arm_table(forecast: LeverArmForecast | None) -> ReportTable:
    """Sigmas and correlations of each solution; no rows without a lever arm."""
    rows = [] if forecast is None else _rows(forecast)

    def mm(row: _Row, axis: int) -> float:
        return float(np.sqrt(row[1][axis, axis]))

    def correlation(row: _Row, a: int, b: int) -> float:
        both = mm(row, a) * mm(row, b)
        return float(row[1][a, b]) / both if both > 0 else 0.0

    columns = [
        (ColumnHead("Lever arm", numeric=False), lambda row: text_cell(row[0])),
        *(
            (ColumnHead(f"σ {name}", "mm"), lambda row, k=k: mm_cell(mm(row, k)))
            for k, name in enumerate("xyz")
        ),
        (ColumnHead("worst σ", "mm"), lambda row: mm_cell(float(largest_sigma(row[1])))),
        *(
            (
                ColumnHead(f"ρ {'xyz'[a]}{'xyz'[b]}"),
                lambda row, a=a, b=b: number_cell(
                    correlation(row, a, b), f"{correlation(row, a, b):.2f}"
                ),
            )
            for a, b in ((0, 1), (0, 2), (1, 2))
        ),
    ]
    note = (
        "In the scanner frame, a priori; planned scanners have x to the east and y to the north. "
        "ρ are correlations."
    )
    return build_table("lever-arm", "The lever arm", note, rows, columns)


def lever_arm_sentences(forecast: LeverArmForecast | None) -> list[str]:
    """What the plan makes of the lever arm, and whether its targets stand all around."""
    if forecast is None:
        return []
    out = []
    for words, covariance in _rows(forecast)[1:]:
        size = joined(
            ", ",
            (
                Sentence("{axis} {s:mmg2}", axis=axis, s=s)
                for axis, s in zip("xyz", np.sqrt(np.diag(covariance)), strict=True)
            ),
        )
        out.append(
            Sentence(
                "Lever arm {forecast.name} {words}: sigma {size}.",
                forecast=forecast,
                words=words,
                size=size,
            )
        )
    if forecast.gaps[1] > _GAP:
        out.append(
            Sentence(
                "The targets leave {forecast.gaps[1]:degrees0} of the horizon free: the "
                "scanner's place is extrapolated from them. Targets on the other side serve "
                "most.",
                forecast=forecast,
            )
        )
    return out


def lever_arm_json(forecast: LeverArmForecast | None) -> Any:
    """Covariances [m^2] of a lever arm, free parts of the horizon [rad]; None without one."""
    if forecast is None:
        return None

    def matrix(covariance: Array | None) -> Any:
        return None if covariance is None else [numbers(row) for row in covariance]

    return {
        "name": forecast.name,
        "prior": matrix(forecast.prior),
        "before": matrix(forecast.before),
        "plan": matrix(forecast.after),
        "horizon_without_targets": {"before": forecast.gaps[0], "plan": forecast.gaps[1]},
    }


def plan_tables(
    plan: DesignResult, sights: tuple[PlannedSight, ...], style: Style
) -> tuple[ReportTable, ...]:
    """All tables, what the crew needs first, with angles in one unit."""
    return (
        _stations(plan, sights),
        _targets(plan, sights),
        lever_arm_table(plan.lever_arm),
        _proposals(plan),
        _criteria(plan),
        _relocations(plan),
        _spares(plan),
        _sets(plan),
        _precisions(plan, style),
        _datums(plan),
        _sights(sights, style),
    )


def criterion_words(plan: DesignResult, kind: CriterionKind) -> str:
    """A criterion, and what it is about."""
    words = CRITERIA[kind]
    if plan.lever_arm is not None:
        words = words.replace("at the named points", "of the lever arm in any direction")
        words = words.replace("the named points", "the lever arm")
    return words


def shown(kind: CriterionKind, value: float) -> str:
    """A criterion in words: millimetres, or a plain number."""
    if math.isnan(value):
        return "not determined"
    if math.isinf(value):
        return "unlimited"
    spec = "mmg3" if kind in ("sigma", "undetected") else "3"
    return Sentence(f"{{value:{spec}}}", value=value)


def _shown_cell(kind: CriterionKind, value: float) -> Cell:
    """A criterion as a cell; what is not determined says so."""
    if not math.isfinite(value):
        return text_cell(shown(kind, value))
    if kind in ("sigma", "undetected"):
        # one below the other, as many digits in each
        return number_cell(value, three_digits(1e3 * value, zeros=True) + " mm")
    return number_cell(value, shown(kind, value))


def _places(get: Callable[[Any], Array]) -> list[tuple[ColumnHead, Callable[[Any], Cell]]]:
    """Columns E, N, U of a place (3,)."""

    def column(axis: int) -> Callable[[Any], Cell]:
        return lambda item: number_cell(
            float(get(item)[axis]), f"{round(float(get(item)[axis]), 3) + 0.0:.3f}"
        )

    return [(ColumnHead(name, "m"), column(axis)) for axis, name in enumerate("ENU")]


def _few(names: tuple[str, ...]) -> str:
    """Some names in words."""
    return ", ".join(names[:8]) + (f" and {len(names) - 8} others" if len(names) > 8 else "")


def _stations(plan: DesignResult, sights: tuple[PlannedSight, ...]) -> ReportTable:
    layout, state = plan.adjustment.layout, plan.adjustment.state
    new = {p.name for p in plan.proposals}
    scan: dict[str, list[PlannedSight]] = {}
    for sight in sights:
        scan.setdefault(sight.start, []).append(sight)
    rows = list(scan)
    xyz = {n: state.positions[layout.position_index(n)] for n in rows}
    columns = [
        (ColumnHead("Station", numeric=False), lambda n: text_cell(n)),
        (ColumnHead("", numeric=False), lambda n: text_cell("new" if n in new else "")),
        *_places(lambda n: xyz[n]),
        (ColumnHead("sights"), lambda n: number_cell(len(scan[n]), str(len(scan[n])))),
        (
            ColumnHead("longest", "m"),
            lambda n: number_cell(
                max(o.length for o in scan[n]), f"{max(o.length for o in scan[n]):.1f}"
            ),
        ),
        (
            ColumnHead("sees", numeric=False, wide=True),
            lambda n: text_cell(", ".join(o.end for o in scan[n])),
        ),
    ]
    return build_table("stations", "Where to set up", "", rows, columns)


def _targets(plan: DesignResult, sights: tuple[PlannedSight, ...]) -> ReportTable:
    adjustment = plan.adjustment
    layout = adjustment.layout
    names = layout.names["point"]
    sigma = largest_sigma(adjustment.family_covariances("point")) if names else np.zeros(0)
    new = {p.name for p in plan.proposals}
    seen: dict[str, list[str]] = {n: [] for n in names}
    for s in sights:
        if s.end in seen:
            seen[s.end].append(s.start)
    rows = list(range(len(names)))
    xyz = adjustment.state.points
    columns = [
        (ColumnHead("Target or point", numeric=False), lambda i: text_cell(names[i])),
        (ColumnHead("", numeric=False), lambda i: text_cell("new" if names[i] in new else "")),
        *_places(lambda i: xyz[i]),
        (
            ColumnHead("worst σ", "mm"),
            lambda i: number_cell(float(sigma[i]), f"{sigma[i] * 1e3:.2f}"),
        ),
        (
            ColumnHead("seen from", numeric=False),
            lambda i: text_cell(", ".join(dict.fromkeys(seen[names[i]]))),
        ),
    ]
    note = "Sigmas in the worst direction, in the datum of the plan, a priori."
    return build_table("targets", "Where targets and points are", note, rows, columns)


def _proposals(plan: DesignResult) -> ReportTable:
    kind = plan.criterion.kind
    columns = [
        (ColumnHead("Add", numeric=False), lambda p: text_cell(p.sort)),
        (ColumnHead("at", numeric=False), lambda p: text_cell(p.name)),
        *_places(lambda p: p.place),
        (ColumnHead("before"), lambda p: _shown_cell(kind, p.before)),
        (ColumnHead("after"), lambda p: _shown_cell(kind, p.after)),
    ]
    note = f"In the order of their gain; judged by the {criterion_words(plan, kind)}."
    return build_table("proposals", "Proposals", note, plan.proposals, columns)


def _criteria(plan: DesignResult) -> ReportTable:
    kinds = list(CRITERIA)

    def cell(figures: Figures | None, kind: CriterionKind) -> Cell:
        if figures is None:
            return text_cell("")
        return _shown_cell(kind, figures.value(kind))

    at = {
        "sigma": plan.after.names[int(np.argmax(plan.after.sigma))] if plan.after.names else "",
        "redundancy": plan.after.redundancy_at,
        "undetected": plan.after.undetected_at,
        "correlation": plan.after.correlation_at,
    }
    columns = [
        (ColumnHead("Criterion", numeric=False), lambda k: text_cell(criterion_words(plan, k))),
        (ColumnHead("before"), lambda k: cell(plan.before, k)),
        (ColumnHead("plan"), lambda k: cell(plan.after, k)),
        (ColumnHead("where", numeric=False, wide=True), lambda k: text_cell(at[k])),
    ]
    return build_table("criteria", "Criteria", "", kinds, columns)


def _relocations(plan: DesignResult) -> ReportTable:
    kind = plan.criterion.kind
    columns = [
        (ColumnHead("Move", numeric=False), lambda r: text_cell(r.name)),
        (ColumnHead("to", numeric=False), lambda r: text_cell(r.to)),
        *_places(lambda r: r.place),
        (ColumnHead("before"), lambda r: number_cell(r.before, shown(kind, r.before))),
        (ColumnHead("after"), lambda r: number_cell(r.after, shown(kind, r.after))),
    ]
    note = f"Each move by itself; judged at {_few(plan.judged_at)}, which do not move."
    if plan.lever_arm is not None:
        note = "Each move by itself."
    return build_table("moves", "Moves", note, plan.relocations, columns)


def _spares(plan: DesignResult) -> ReportTable:
    kind = plan.criterion.kind
    rows = sorted(plan.spares, key=lambda s: (math.isnan(s.after), s.after))
    columns = [
        (ColumnHead("Without", numeric=False), lambda s: text_cell(f"{s.sort} {s.name}")),
        (ColumnHead("before"), lambda s: number_cell(s.before, shown(kind, s.before))),
        (
            ColumnHead("after"),
            lambda s: text_cell("needed") if math.isnan(s.after) else _shown_cell(kind, s.after),
        ),
    ]
    note = (
        f"Each left out alone; judged at {_few(plan.judged_at)}, which stay. Before is the whole "
        "plan, in a datum that does not rest on what may be left out."
    )
    if plan.lever_arm is not None:
        note = "Each left out alone."
    return build_table("spares", "What could be left out", note, rows, columns)


def _sets(plan: DesignResult) -> ReportTable:
    rows = [] if plan.sets is None or not plan.sets.steps else list(plan.sets.sets.items())
    columns = [
        (ColumnHead("Station", numeric=False), lambda r: text_cell(r[0])),
        (ColumnHead("sets"), lambda r: number_cell(r[1], str(r[1]))),
    ]
    note = "Repetitions of everything observed at a station that the requirement takes."
    return build_table("sets", "Sets", note, rows, columns)


def _precisions(plan: DesignResult, style: Style) -> ReportTable:
    def shown_as(p: Any, value: float) -> str:
        if p.unit not in ("m", "rad"):
            return three_digits(value)
        return Sentence(f"{{value:{style.small_unit(p.unit)}g3}}", value=value)

    def sigma(p: Any) -> str:
        return shown_as(p, p.sigma)

    def needed(p: Any) -> str:
        return "never enough alone" if math.isnan(p.factor) else shown_as(p, p.sigma * p.factor)

    columns = [
        (ColumnHead("Readings", numeric=False), lambda p: text_cell(p.group.replace("_", " "))),
        (ColumnHead("σ now"), lambda p: text_cell(sigma(p))),
        (ColumnHead("σ that is enough"), lambda p: text_cell(needed(p))),
    ]
    note = "Of the first reading of each kind, the others as they are."
    return build_table("precision", "How precise", note, plan.precisions, columns)


def _datums(plan: DesignResult) -> ReportTable:
    def mm(value: float) -> Cell:
        return number_cell(number(value), "" if math.isnan(value) else f"{value * 1e3:.3f}")

    columns = [
        (ColumnHead("Datum", numeric=False), lambda d: text_cell(d.words)),
        (ColumnHead("largest σ of a point", "mm"), lambda d: mm(d.sigma)),
        (ColumnHead("mean σ", "mm"), lambda d: mm(d.mean)),
        (ColumnHead("largest σ of a distance", "mm"), lambda d: mm(d.distance)),
        (
            ColumnHead("smallest redundancy"),
            lambda d: number_cell(
                number(d.redundancy), "" if math.isnan(d.redundancy) else f"{d.redundancy:.3f}"
            ),
        ),
        (ColumnHead("why none", numeric=False), lambda d: text_cell(d.refused)),
    ]
    note = "Sigmas of points belong to their datum; distances and redundancies can be compared."
    return build_table("datums", "Datums", note, plan.datums, columns)


def _sights(sights: tuple[PlannedSight, ...], style: Style) -> ReportTable:
    unit: Literal["gon", "deg"] = style.angle
    sign = "gon" if unit == "gon" else "°"
    columns = [
        (ColumnHead("From", numeric=False), lambda s: text_cell(s.start)),
        (ColumnHead("to", numeric=False), lambda s: text_cell(s.end)),
        (ColumnHead("observations", numeric=False), lambda s: text_cell(s.kinds)),
        (ColumnHead("length", "m"), lambda s: number_cell(s.length, f"{s.length:.2f}")),
        (
            ColumnHead("azimuth", sign),
            lambda s: number_cell(s.azimuth, format_angle(s.azimuth, unit, 1)),
        ),
        (
            ColumnHead("zenith", sign),
            lambda s: number_cell(s.zenith, format_angle(s.zenith, unit, 1)),
        ),
        (ColumnHead("values"), lambda s: number_cell(s.values, str(s.values))),
        (
            ColumnHead("least redundancy"),
            lambda s: number_cell(
                s.redundancy, "" if s.redundancy is None else f"{s.redundancy:.2f}"
            ),
        ),
        (
            ColumnHead("undetected", "mm"),
            lambda s: number_cell(
                s.undetected, "" if s.undetected is None else f"{s.undetected * 1e3:.2f}"
            ),
        ),
    ]
    note = "Undetected: largest displacement of any position by an error that stays undetected."
    return build_table("sights", "Sights", note, sights, columns, most=2000)
