"""The tables of a plan: where to set up, where targets are, what is proposed, what it takes."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from tribrach._types import Array
from tribrach.planning.prediction import CRITERIA, CriterionKind, Figures, largest_sigma
from tribrach.questions.plan.design import DesignResult, PlannedPlace
from tribrach.questions.plan.lever_arm import LeverArmForecast
from tribrach.questions.plan.sights import PlannedSight
from tribrach.report.columns import AXES, along, column, component
from tribrach.report.numbers import Style, three_digits
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    Spec,
    build_table,
    number_cell,
    text_cell,
)
from tribrach.sentences import Sentence, written
from tribrach.units import format_angle

#: criteria that are lengths
METRIC = ("sigma", "undetected")


def plan_tables(plan: DesignResult, style: Style) -> tuple[ReportTable, ...]:
    """All tables, what the crew needs first, with angles in one unit."""
    return (
        _stations(plan),
        _targets(plan),
        _lever_arm(plan.lever_arm),
        _proposals(plan),
        _criteria(plan),
        _relocations(plan),
        _spares(plan),
        _sets(plan),
        _precisions(plan, style),
        _datums(plan),
        _sights(plan, style),
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
    return Sentence("{value:mmg3}" if kind in METRIC else "{value:3}", value=value)


def _criterion(
    head: str,
    get: str | Callable[[Any], float],
    kind: CriterionKind | Callable[[Any], CriterionKind],
    missing: str | None = None,
    zeros: bool = True,
) -> Spec:
    """A column of a criterion, in words where not determined; ``zeros`` keeps three digits."""
    take = along(get) if isinstance(get, str) else get

    def cell(item: Any) -> Cell:
        value = take(item)
        if value is None:
            return text_cell("")
        own = kind(item) if callable(kind) else kind
        if not math.isfinite(value):
            return text_cell(shown(own, value) if missing is None else missing)
        if zeros and own in METRIC:
            return number_cell(value, f"{three_digits(1e3 * value, zeros=True)} mm")
        return number_cell(value, shown(own, value))

    return ColumnHead(head), cell


def _places(path: str) -> list[Spec]:
    """Columns E, N, U of a place (3,)."""
    return [column(name, component(path, k), "m3") for k, name in enumerate(AXES)]


def _few(names: tuple[str, ...]) -> str:
    """Some names in words."""
    return ", ".join(names[:8]) + (f" and {len(names) - 8} others" if len(names) > 8 else "")


def solutions(forecast: LeverArmForecast) -> list[tuple[str, Array]]:
    """The solutions of a lever arm in words, with their covariances."""
    rows = [("as it is known", forecast.prior)]
    if forecast.before is not None:
        rows.append(("with the targets of the plan", forecast.before))
    if forecast.before is None or not np.array_equal(forecast.before, forecast.after):
        rows.append(("with what is proposed", forecast.after))
    return rows


def _lever_arm(forecast: LeverArmForecast | None) -> ReportTable:
    """Sigmas and correlations of each solution; no rows without a lever arm."""

    def sigma(k: int) -> Callable[[Any], float]:
        """Takes that along an axis."""
        return lambda row: float(np.sqrt(row[1][k, k]))

    def correlation(a: int, b: int) -> Callable[[Any], float]:
        """Takes that of two axes; zero where one is held."""
        both = sigma(a), sigma(b)
        return lambda row: float(row[1][a, b]) / (both[0](row) * both[1](row) or np.inf)

    columns = [
        column("Lever arm", lambda row: row[0]),
        *(column(f"σ {'xyz'[k]}", sigma(k), "mm2") for k in range(3)),
        column("worst σ", lambda row: largest_sigma(row[1]), "mm2"),
        column("ρ xy", correlation(0, 1), "2"),
        column("ρ xz", correlation(0, 2), "2"),
        column("ρ yz", correlation(1, 2), "2"),
    ]
    note = (
        "In the scanner frame, a priori; planned scanners have x to the east and y to the north. "
        "ρ are correlations."
    )
    rows = [] if forecast is None else solutions(forecast)
    return build_table("lever-arm", "The lever arm", note, rows, columns)


class _Standing(NamedTuple):
    """A place of the plan, and what is seen from it or who sees it."""

    name: str
    place: PlannedPlace
    sights: Sequence[PlannedSight]


def _stations(plan: DesignResult) -> ReportTable:
    seen: dict[str, list[PlannedSight]] = {}
    for sight in plan.sights:
        seen.setdefault(sight.start, []).append(sight)
    standing = plan.points | plan.stations
    rows = [_Standing(name, standing[name], sights) for name, sights in seen.items()]
    columns = [
        column("Station", "name"),
        column("", lambda row: "new" * row.place.new),
        *_places("place.xyz"),
        column("sights", lambda row: len(row.sights), "0"),
        column("longest", lambda row: max(s.length for s in row.sights), "m1"),
        column("sees", lambda row: ", ".join(s.end for s in row.sights), wide=True),
    ]
    return build_table("stations", "Where to set up", "", rows, columns)


def _targets(plan: DesignResult) -> ReportTable:
    seen: dict[str, list[PlannedSight]] = {}
    for sight in plan.sights:
        seen.setdefault(sight.end, []).append(sight)
    rows = [_Standing(name, place, seen.get(name, ())) for name, place in plan.points.items()]
    columns = [
        column("Target or point", "name"),
        column("", lambda row: "new" * row.place.new),
        *_places("place.xyz"),
        column("worst σ", lambda row: largest_sigma(row.place.covariance), "mm2"),
        column("seen from", lambda row: ", ".join(s.start for s in row.sights)),
    ]
    note = "Sigmas in the worst direction, in the datum of the plan, a priori."
    return build_table("targets", "Where targets and points are", note, rows, columns)


def _proposals(plan: DesignResult) -> ReportTable:
    kind = plan.criterion.kind
    columns = [
        column("Add", "sort"),
        column("at", "name"),
        *_places("place"),
        _criterion("before", "before", kind),
        _criterion("after", "after", kind),
    ]
    note = f"In the order of their gain; judged by the {criterion_words(plan, kind)}."
    return build_table("proposals", "Proposals", note, plan.proposals, columns)


def _criteria(plan: DesignResult) -> ReportTable:
    def of(figures: Figures | None) -> Callable[[CriterionKind], Any]:
        """Takes a criterion of the figures."""
        return lambda kind: None if figures is None else figures.value(kind)

    columns = [
        column("Criterion", lambda kind: criterion_words(plan, kind)),
        _criterion("before", of(plan.before), lambda kind: kind),
        _criterion("plan", of(plan.after), lambda kind: kind),
        column("where", lambda kind: plan.after.of(kind).at, wide=True),
    ]
    return build_table("criteria", "Criteria", "", list(CRITERIA), columns)


def _relocations(plan: DesignResult) -> ReportTable:
    kind = plan.criterion.kind
    columns = [
        column("Move", "name"),
        column("to", "to"),
        *_places("place"),
        _criterion("before", "before", kind, zeros=False),
        _criterion("after", "after", kind, zeros=False),
    ]
    at = f"; judged at {_few(plan.judged_at)}, which do not move" * (plan.lever_arm is None)
    return build_table("moves", "Moves", f"Each move by itself{at}.", plan.relocations, columns)


def _spares(plan: DesignResult) -> ReportTable:
    kind = plan.criterion.kind
    rows = sorted(plan.spares, key=lambda s: (math.isnan(s.after), s.after))
    columns = [
        column("Without", lambda s: f"{s.sort} {s.name}"),
        _criterion("before", "before", kind, zeros=False),
        _criterion("after", "after", kind, "needed"),
    ]
    note = (
        f"Each is left out alone; judged at {_few(plan.judged_at)}, which stay. Before: the whole "
        "plan, in a datum that rests on none of them."
    )
    if plan.lever_arm is not None:
        note = "Each is left out alone."
    return build_table("spares", "What could be left out", note, rows, columns)


def _sets(plan: DesignResult) -> ReportTable:
    rows = [] if plan.sets is None or not plan.sets.steps else list(plan.sets.sets.items())
    columns = [column("Station", lambda row: row[0]), column("sets", lambda row: row[1], "0")]
    note = "Repetitions of all observations of a station that the requirement needs."
    return build_table("sets", "Sets", note, rows, columns)


def _precisions(plan: DesignResult, style: Style) -> ReportTable:
    def sigma(p: Any, factor: float) -> Cell:
        """A sigma of readings times a factor, in a unit of the style."""
        if math.isnan(factor):
            return text_cell("never enough alone")
        unit = style.small_unit(p.unit) if p.unit in ("m", "rad") else ""
        return text_cell(f"{written(p.sigma * factor, f'{unit}g3~')} {unit}".rstrip())

    columns = [
        column("Readings", lambda p: p.group.replace("_", " ")),
        (ColumnHead("σ now"), lambda p: sigma(p, 1.0)),
        (ColumnHead("σ that is enough"), lambda p: sigma(p, p.factor)),
    ]
    note = "For the first reading of each kind; all others keep their sigmas."
    return build_table("precision", "How precise", note, plan.precisions, columns)


def _datums(plan: DesignResult) -> ReportTable:
    columns = [
        column("Datum", "datum"),
        column("largest σ of a point", "sigma", "mm3"),
        column("mean σ", "mean", "mm3"),
        column("largest σ of a distance", "distance", "mm3"),
        column("smallest redundancy", "redundancy", "3"),
        column("why none", "refused"),
    ]
    note = "Sigmas of points belong to their datum; distances and redundancies can be compared."
    return build_table("datums", "Datums", note, plan.datums, columns)


def _sights(plan: DesignResult, style: Style) -> ReportTable:
    sign = "gon" if style.angle == "gon" else "°"

    def angle(head: str, path: str) -> Spec:
        """A column of angles to a tenth."""
        return column(head, path, lambda v, _: format_angle(v, style.angle, 1), unit=sign)

    columns = [
        column("From", "start"),
        column("to", "end"),
        column("observations", "kinds"),
        column("length", "length", "m2"),
        angle("azimuth", "azimuth"),
        angle("zenith", "zenith"),
        column("values", "values", "0"),
        column("least redundancy", "redundancy", "2"),
        column("undetected", "undetected", "mm2"),
    ]
    note = "Undetected: largest displacement of any position by an error that stays undetected."
    return build_table("sights", "Sights", note, plan.sights, columns, most=2000)
