"""A fitted transformation in tables and as JSON: parameters, points, check points, models.

Differences are ``b - T(a)`` in the axes of B. The RMS of the fit is no accuracy: that is what the
check points say.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from tribrach.geometry import euler
from tribrach.report.numbers import Style, fixed_cell
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    build_table,
    number_cell,
    text_cell,
)
from tribrach.transformation.model_choice import Rung
from tribrach.transformation.outcome import CHECK, Outcome

__all__ = ["transformation_results", "transformation_tables"]


@dataclass(frozen=True)
class _Parameter:
    name: str
    value: float
    sigma: float | None
    unit: str


@dataclass(frozen=True)
class _Point:
    name: str
    state: str
    difference: tuple[float, ...]
    redundancy: float | None
    statistic: float | None
    limit: float | None
    verdict: str
    reason: str


def transformation_tables(
    outcome: Outcome, angle: Literal["gon", "deg"] = "gon", most: int = 200
) -> list[ReportTable]:
    """Parameters, points, models; of more points than ``most`` those that fit worst."""
    style = Style(angle)
    return [
        _parameter_table(outcome, style),
        _point_table(outcome, style, most),
        _model_table(outcome, style),
    ]


def _parameter_table(outcome: Outcome, style: Style) -> ReportTable:
    fit = outcome.fit
    known = bool(np.isfinite(fit.covariance).all())
    origin = "a priori" if fit.points.weighted else "a posteriori"
    note = (
        "b = shift + M (a - centre) with the centre of the fitted points; the shift at the origin "
        "of A carries the errors of rotation and scale over the distance, and is strongly "
        f"correlated with them. Sigmas are {origin}."
        if known
        else "b = shift + M (a - centre). There are no sigmas: there is no redundancy."
    )
    columns = [
        (ColumnHead("Parameter", numeric=False), lambda p: text_cell(p.name)),
        (ColumnHead("value", numeric=False), lambda p: _written(style, p)),
        (ColumnHead("σ", numeric=False), lambda p: _small(style, p)),
    ]
    title = fit.model.words.capitalize()
    return build_table("parameters", title, note, _parameters(outcome), columns)


def _parameters(outcome: Outcome) -> list[_Parameter]:
    """Centre, shifts, angles, scales; in words."""
    fit, t = outcome.fit, outcome.fit.transformation
    d = t.model.dimension
    axes = "xyz"[:d]
    sigma = np.sqrt(np.diag(fit.covariance))
    origin = np.sqrt(np.diag(fit.origin_covariance))
    out = [_Parameter(f"centre {a}", float(t.centre[k]), 0.0, "m") for k, a in enumerate(axes)]
    out += [
        _Parameter(f"shift {a} at the centre", float(t.shift[k]), float(sigma[k]), "m")
        for k, a in enumerate(axes)
    ]
    out += [
        _Parameter(f"shift {a} at the origin", float(t.at_origin[k]), float(origin[k]), "m")
        for k, a in enumerate(axes)
    ]
    values = t.values
    # a free turn is written as omega, phi, kappa below
    turns = range(d, d + 3) if t.model.turn == "free" else range(0)
    for k, (name, unit) in enumerate(t.model.parameters):
        if k >= d and k not in turns:
            out.append(_Parameter(name, float(values[k]), float(sigma[k]), unit))
    if t.model.turn == "free":
        opk = euler.opk_from_world_from_scanner(t.rotation)
        by = euler.opk_by_increment(t.rotation)
        turn = fit.covariance[d : d + 3, d : d + 3]
        spread = np.sqrt(np.diag(by @ turn @ by.T))
        out += [
            _Parameter(name, float(v), float(s), "rad")
            for name, v, s in zip(("omega", "phi", "kappa"), opk, spread, strict=True)
        ]
    return out


def _written(style: Style, p: _Parameter) -> Cell:
    if p.name.startswith(("scale", "element")):
        return Cell(f"{p.value:.9f}", p.value)
    return Cell(f"{style.value(p.value, p.unit)} {style.value_unit(p.unit)}".strip(), p.value)


def _small(style: Style, p: _Parameter) -> Cell:
    if p.name.startswith("centre") or p.sigma is None or not np.isfinite(p.sigma):
        return Cell("")
    unit = style.small_unit(p.unit) or "ppm"
    return Cell(f"{style.small(p.sigma, p.unit)} {unit}", p.sigma)


def _points(outcome: Outcome) -> list[_Point]:
    fit, tests, checks = outcome.fit, outcome.tests, outcome.checks
    used = {int(k): row for row, k in enumerate(np.flatnonzero(fit.points.used))}
    held = {} if checks is None else {int(k): row for row, k in enumerate(checks.place)}
    out = []
    for k, name in enumerate(fit.points.names):
        state, statistic, limit, r = "off", None, None, None
        if k in used:
            state, row = "used", used[k]
            statistic, limit = float(tests.statistic[row]), float(tests.limit[row])
            r = float(tests.redundancy[row])
        elif checks is not None and k in held:
            state, row = "check", held[k]
            statistic, limit = float(checks.statistic[row]), float(checks.limit(CHECK)[row])
        good = None
        if statistic is not None and limit is not None and np.isfinite(statistic):
            good = statistic <= limit
        else:
            statistic = limit = None
        words = {None: "not controlled", True: "agrees", False: "does not fit"}[good]
        out.append(
            _Point(
                name,
                state,
                tuple(float(v) for v in fit.difference[k]),
                r,
                statistic,
                limit,
                "" if state == "off" else words,
                fit.points.reasons[k],
            )
        )
    return out


def _point_table(outcome: Outcome, style: Style, most: int) -> ReportTable:
    note = (
        "Differences b - T(a). The test of a point is against 0.1 %, that of a check point "
        "against 1 %; it cannot tell whether A or B is wrong."
    )

    def axis(k: int) -> tuple[ColumnHead, Any]:
        return ColumnHead(f"Δ{'xyz'[k]}", "mm"), lambda p: number_cell(
            p.difference[k], style.small(p.difference[k], "m")
        )

    columns = [
        (ColumnHead("Point", numeric=False), lambda p: text_cell(p.name)),
        (ColumnHead("use", numeric=False), lambda p: text_cell(p.state)),
        *(axis(k) for k in range(outcome.fit.points.dimension)),
        (ColumnHead("redundancy"), lambda p: fixed_cell(p.redundancy, 2)),
        (ColumnHead("test"), lambda p: fixed_cell(p.statistic, 2)),
        (ColumnHead("limit"), lambda p: fixed_cell(p.limit, 2)),
        (ColumnHead("verdict", numeric=False), lambda p: text_cell(p.verdict)),
        (ColumnHead("reason", numeric=False, wide=True), lambda p: text_cell(p.reason)),
    ]
    points = _points(outcome)
    if len(points) > most:
        points.sort(key=lambda p: -(p.statistic or 0.0) / (p.limit or 1.0))
    return build_table("points", "Common points", note, points, columns, most=most)


def _model_table(outcome: Outcome, style: Style) -> ReportTable:
    used = int(outcome.fit.points.used.sum())
    note = (
        "What each model gains over the one above it: a test beyond its limit at 95 % says that "
        "the further parameters are real. RMS is the root mean square of the lengths of the "
        f"differences at the {used} used points, none of them left out by a limit; check points "
        "and points taken out take no part. It is that of a fit, no accuracy."
    )
    columns: list[tuple[ColumnHead, Any]] = [
        (ColumnHead("parameters"), lambda r: number_cell(r.count, str(r.count))),
        (ColumnHead("Model", numeric=False), lambda r: text_cell(r.words)),
        (ColumnHead("RMS", "mm"), lambda r: number_cell(r.rms, style.small(r.rms, "m"))),
        (ColumnHead("redundancy"), lambda r: number_cell(r.dof, str(r.dof))),
        (ColumnHead("test"), lambda r: fixed_cell(r.statistic, 2)),
        (ColumnHead("limit"), lambda r: fixed_cell(r.limit, 2)),
        (ColumnHead("needed", numeric=False), lambda r: text_cell(_needed(r))),
    ]
    return build_table("models", "Which model is enough", note, outcome.rungs, columns)


def _needed(rung: Rung) -> str:
    if rung.statistic is None or rung.limit is None:
        return ""
    return "yes" if rung.statistic > rung.limit else "no"


def transformation_results(outcome: Outcome) -> dict[str, Any]:
    """Tests, points and models as JSON: metres, radians, square metres."""
    fit, checks = outcome.fit, outcome.checks
    scale = outcome.scale
    points = []
    for k, p in enumerate(_points(outcome)):
        points.append(
            {
                "name": p.name,
                "use": p.state,
                "difference": list(p.difference),
                "residual_a": fit.residual_a[k].tolist(),
                "residual_b": fit.residual_b[k].tolist(),
                "redundancy": p.redundancy,
                "test": p.statistic,
                "limit": p.limit,
                "reason": p.reason,
            }
        )
    return {
        "sigma0": {"posterior": fit.sigma0, "dof": fit.dof, "vtpv": fit.vtpv},
        "rms_of_fit": fit.rms,
        "check_rmse": None if checks is None else checks.rmse.tolist(),
        "scale_test": None
        if scale is None
        else {
            "excess": scale.excess,
            "sigma": scale.sigma,
            "t": scale.t if np.isfinite(scale.t) else None,
            "limit": scale.limit,
            "needed": scale.needed,
            "sigma_is": "posterior" if scale.posterior else "prior",
        },
        "models": list(outcome.rungs),
        "points": points,
        "removed": list(outcome.removed),
        "warnings": outcome.sentences(),
    }
