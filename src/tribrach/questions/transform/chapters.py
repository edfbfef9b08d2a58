"""A fitted transformation as people read it: parameters, points, check points, models.

Differences are ``b - T(a)`` in the axes of B. The RMS of the fit is no accuracy: that is what the
check points say.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import numpy as np

from tribrach.geometry import euler
from tribrach.questions.transform.fit import FORM, FittedParameter, FittedTransformation
from tribrach.report.answer import Answer
from tribrach.report.columns import column, component
from tribrach.report.findings import Finding, words
from tribrach.report.numbers import Style
from tribrach.report.tables import ReportTable, build_table
from tribrach.sentences import Sentence, capital
from tribrach.statistics import chi2
from tribrach.transformation.outcome import ALPHA, CHECK

__all__ = ["FORM", "answer_of"]

#: points in the table, and names in a sentence
_SHOWN, _NAMED = 200, 8

#: differences below this are none that anybody measured [m]
_NOTHING = 1e-9


def answer_of(found: FittedTransformation, angle: Literal["gon", "deg"] = "gon") -> Answer:
    """The transformation as people read it."""
    style, findings = Style(angle), list(_findings(found))
    tables = [_parameters(found, style), _points(found, style), _models(found, style)]
    terminal: list[str | Finding | ReportTable] = []
    for table in tables:
        cut = [f"{table.left_out} more rows in the JSON file"] if table.left_out else []
        terminal += [table, *cut, Finding(table.note)]
    said = [one.words for one in (*findings, *_alone(found))]
    terminal += [Finding(capital(one), True) for one in said]
    return Answer(
        "Transformation",
        f"{found.from_} to {found.to}",
        None,
        found,
        FORM,
        {"warnings": words(findings)},
        findings,
        tables=tables,
        terminal=terminal,
    )


def _findings(found: FittedTransformation) -> Iterator[Finding]:
    """Everything to be known, in words."""
    outcome, fit, scale = found.outcome, found.outcome.fit, found.scale_test
    yield from (Finding(text, key="axes") for text in outcome.odd)
    yield _judgement(found)
    left = np.abs(fit.difference[np.isfinite(fit.difference)])
    if fit.dof > 0 and left.size and left.max() < _NOTHING:
        yield Finding(
            "nothing is left at any point: one list is a copy of the other, or was computed "
            "from it, and the sigmas tell no accuracy",
            True,
            key="copies",
        )
    yield from (Finding(text, key="snooped") for text in outcome.steps)
    used = [name for name, on in zip(fit.points.names, fit.points.used, strict=True) if on]
    wrong = [name for name, bad in zip(used, outcome.tests.suspicious, strict=True) if bad]
    if wrong:
        yield Finding.of(
            "does_not_fit",
            "does not fit: {names} (snooping takes the worst out first)",
            names=", ".join(wrong),
        )
    if scale is not None:
        rigid, scaled = (6, 7) if found.dimension == 3 else (3, 4)
        yield Finding.of(
            "scale",
            "scale - 1 = {s.excess:ppm+1} with sigma {s.sigma:ppm1} {origin}, t = {s.t:2} against "
            "{s.limit:2}: "
            + (
                "the scale is significant: {count} parameters are needed, or a length is wrong"
                if scale.needed
                else "{count} parameters are enough"
            ),
            s=scale,
            origin="a posteriori" if scale.posterior else "a priori",
            count=scaled if scale.needed else rigid,
        )
    if outcome.checks is not None:
        bad = outcome.checks.statistic > outcome.checks.limit(CHECK)
        each = " ".join(f"{{rmse[{k}]:mm2~}}" for k in range(found.dimension))
        yield Finding.of(
            "check_points",
            f"root mean square error of check points ({{n}}), x y z: {each} mm; beyond their 99 % "
            "limit: {beyond}",
            n=len(bad),
            rmse=outcome.checks.rmse,
            beyond=", ".join(fit.points.names[k] for k in outcome.checks.place[bad]) or "none",
        )
    elif fit.dof > 0:
        yield Finding.of(
            "no_check_points",
            "the root mean square of the differences at all {n} used points, {rms:mm2}, is that of "
            "a fit and no accuracy: hold points out as check points",
            n=len(used),
            rms=found.rms_of_fit,
        )


def _judgement(found: FittedTransformation) -> Finding:
    """The global test, or why there is none."""
    unit = found.sigma0
    if unit.dof <= 0:
        return Finding("no redundancy: nothing is checked", key="no_redundancy")
    if found.covariance_is == "posterior":
        return Finding.of(
            "no_sigmas",
            "no sigmas were given: one coordinate has sigma {unit.posterior:mm2} a posteriori with "
            "redundancy {unit.dof}; all sigmas rest on it",
            unit=unit,
        )
    low, high = (float(chi2.ppf(p, unit.dof)) for p in (ALPHA / 2, 1 - ALPHA / 2))
    limits = "({unit.vtpv:2} against {low:2} to {high:2}, redundancy {unit.dof})"
    template = f"the global test passes {limits}"
    if unit.vtpv > high:
        template = (
            f"the global test fails {limits}: wrong points, sigmas too small, or a model that is "
            "too stiff"
        )
    elif unit.vtpv < low:
        template += "; the sigmas look too large"
    return Finding.of("global_test", template, unit=unit, low=low, high=high)


def _alone(found: FittedTransformation) -> Iterator[Finding]:
    """Points that only one of the files has."""
    for name, points in zip((found.from_, found.to), found.alone, strict=True):
        more = f" and {len(points) - _NAMED} more" if len(points) > _NAMED else ""
        if points:
            yield Finding(f"only in {name}: {', '.join(points[:_NAMED])}{more}", key="only_in")


def _parameters(found: FittedTransformation, style: Style) -> ReportTable:
    """Centre, shifts, angles, scales."""

    def value(p: FittedParameter) -> str:
        if p.unit == "1":
            return f"{p.value:.9f}"
        return f"{style.value(p.value, p.unit)} {style.value_unit(p.unit)}"

    def sigma(p: FittedParameter) -> str:
        unit = style.small_unit(p.unit)
        return f"{style.small(p.sigma, p.unit)} {unit}" if np.isfinite(p.sigma) else ""

    origin = "a priori" if found.covariance_is == "prior" else "a posteriori"
    note = (
        "b = shift + M (a - centre). There are no sigmas: there is no redundancy."
        if found.covariance is None
        else "b = shift + M (a - centre) with the centre of the fitted points; the shift at the "
        "origin of A carries the errors of rotation and scale over the distance, and is strongly "
        f"correlated with them. Sigmas are {origin}."
    )
    columns = [
        column("Parameter", "name"),
        column("value", value),
        column("σ", sigma),
    ]
    title = capital(found.words)
    return build_table("parameters", title, note, list(_in_words(found)), columns)


def _in_words(found: FittedTransformation) -> Iterator[FittedParameter]:
    """The parameters as people know them: a free turn as omega, phi, kappa."""
    fit, t = found.outcome.fit, found.outcome.fit.transformation
    d, own = found.dimension, [p.sigma for p in found.parameters]
    origin = np.sqrt(np.diag(fit.origin_covariance))
    for what, values, sigmas in (
        ("centre {}", t.centre, [np.nan] * d),
        ("shift {} at the centre", t.shift, own[:d]),
        ("shift {} at the origin", t.at_origin, origin),
    ):
        for axis, v, s in zip("xyz"[:d], values, sigmas, strict=True):
            yield FittedParameter(what.format(axis), "m", float(v), float(s))
    free = t.model.turn == "free"
    yield from found.parameters[2 * d if free else d :]
    if free:
        by = euler.opk_by_increment(t.rotation)
        spread = np.sqrt(np.diag(by @ fit.covariance[d : d + 3, d : d + 3] @ by.T))
        turns = euler.opk_from_world_from_scanner(t.rotation)
        for name, v, s in zip(("omega", "phi", "kappa"), turns, spread, strict=True):
            yield FittedParameter(name, "rad", float(v), float(s))


def _points(found: FittedTransformation, style: Style) -> ReportTable:
    """Common points; of too many those that fit worst."""
    note = Sentence(
        "Differences b - T(a). The test of a point is against {alpha:%}, that of a check point "
        "against {check:%}; it cannot tell whether A or B is wrong.",
        alpha=0.001,
        check=1 - CHECK,
    )
    columns = [
        column("Point", "name"),
        column("use", "use"),
        *(
            column(
                f"Δ{axis}", component("difference", k), lambda v, _: style.small(v, "m"), unit="mm"
            )
            for k, axis in enumerate("xyz"[: found.dimension])
        ),
        column("redundancy", "redundancy", "2"),
        column("test", "test", "2"),
        column("limit", "limit", "2"),
        column("verdict", "verdict"),
        column("reason", "reason", wide=True),
    ]
    points = list(found.points)
    if len(points) > _SHOWN:
        points.sort(key=lambda p: -np.nan_to_num(p.test / p.limit))
    return build_table("points", "Common points", note, points, columns, most=_SHOWN)


def _models(found: FittedTransformation, style: Style) -> ReportTable:
    """What each model gains."""
    note = (
        "What each model gains over the one above it: a test beyond its limit at 95 % says that "
        "the further parameters are real. RMS is the root mean square of the lengths of the "
        f"differences at the {found.outcome.fit.points.used.sum()} used points; check points and "
        "points taken out take no part. It describes the fit and is not an accuracy."
    )
    columns = [
        column("parameters", "count", "0"),
        column("Model", "words"),
        column("RMS", "rms", lambda v, _: style.small(v, "m"), unit="mm"),
        column("redundancy", "dof", "0"),
        column("test", "statistic", "2"),
        column("limit", "limit", "2"),
        column("needed", "needed"),
    ]
    return build_table("models", "Which model is enough", note, found.models, columns)
