"""Compared epochs in words, tables, a map and as JSON.

Displacements are those of the second epoch against the first, in the datum of the stable points.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from tribrach.epochs.comparison import Comparison, Displacement
from tribrach.epochs.congruence import CongruenceTest
from tribrach.job.epochs import ComparedEpochs
from tribrach.network.ellipsoids import confidence_factor, plan_ellipses
from tribrach.report.displacement_map import displacement_drawing
from tribrach.report.environment import render_page
from tribrach.report.figures import Picture
from tribrach.report.numbers import fixed_cell, mm_cell, number
from tribrach.report.page import page
from tribrach.report.schema.epochs import EpochComparisonPart
from tribrach.report.tables import ColumnHead, ReportTable, build_table, text_cell
from tribrach.units import format_angle

__all__ = [
    "direction_words",
    "epochs_page",
    "epochs_part",
    "epochs_pictures",
    "epochs_sentences",
    "epochs_svg",
    "epochs_tables",
]

Angle = Literal["gon", "deg"]

#: points with a sentence of their own, of each verdict
_NAMED = 12
_MARKS = {"moved": "bad", "not moved": "", "cannot tell": ""}


def direction_words(vector: Sequence[float], axes: Sequence[int], angle: Angle = "gon") -> str:
    """A displacement [m] in words: 4.1 mm towards 212 gon, 2.0 mm down."""
    by = dict(zip(axes, np.asarray(vector, dtype=float).tolist(), strict=True))
    parts = []
    if 0 in by and 1 in by:
        azimuth = float(np.arctan2(by[0], by[1]) % (2 * np.pi))
        unit = "gon" if angle == "gon" else "°"
        text = format_angle(azimuth, angle, 0)
        length = 1e3 * float(np.hypot(by[0], by[1]))
        parts.append(f"{length:.1f} mm towards {text}{' ' if angle == 'gon' else ''}{unit}")
    if 2 in by:
        parts.append(f"{1e3 * abs(by[2]):.1f} mm {'down' if by[2] < 0 else 'up'}")
    return ", ".join(parts)


def epochs_sentences(compared: ComparedEpochs, angle: Angle = "gon") -> list[str]:
    """What moved, how sure that is, and what would not have been seen."""
    c = compared.comparison
    out = [*_congruence(c), *_points(c, angle), *_common(c), *_remarks(c)]
    return [*out, *(f"{s[:1].upper()}{s[1:]}." for s in compared.sentences)]


def _test(test: CongruenceTest) -> str:
    return f"test {test.statistic:.2f} with {test.dof} degrees of freedom, limit {test.limit:.2f}"


def _listed(names: Sequence[str]) -> str:
    """A, B and C; of many the first."""
    if len(names) > 20:
        return f"{', '.join(names[:20])} and {len(names) - 20} more"
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _congruence(c: Comparison) -> list[str]:
    """The test of the reference points, and which of them moved."""
    one, two = c.difference.labels
    out = []
    if c.search is None:
        how = "differ" if not c.whole.passed else "agree"
        fixed = f" against {_listed(c.held)}, held in both" if c.held else ""
        out.append(f"The points of {one} and {two} {how}{fixed}: {_test(c.whole)}.")
        if not c.held:
            out.append("The reference points only just carry the datum: none of them is tested.")
        return out
    names = [d.name for d in c.displacements if d.reference]
    s = c.search
    if s.before.passed:
        out.append(f"The {len(names)} reference points are congruent: {_test(s.before)}.")
        return out
    if not s.resolved:
        out.append(
            f"The {len(names)} reference points are not congruent ({_test(s.before)}), and no "
            f"group of fewer than half of them explains it: what is stable cannot be told, and the "
            f"displacements hold in the datum of {_listed(c.stable)} only."
        )
        return out
    moved = [d.name for d in c.displacements if d.reference and d.name not in c.stable]
    found = (
        f"they are: {_test(s.after)}"
        if s.after.passed
        else f"what is left is still beyond its limit ({_test(s.after)}), and no further point "
        "explains it"
    )
    out.append(
        f"The {len(names)} reference points are not congruent: {_test(s.before)}. Without "
        f"{_listed(moved)} {found}."
    )
    out += [
        f"{_listed(group)} in place of {_listed(moved)} explains it nearly as well: which moved "
        "cannot be told."
        for group in c.partners[:_NAMED]
    ]
    if not s.exhaustive:
        out.append("There are too many combinations to look at all: the best were sought stepwise.")
    return out


def _points(c: Comparison, angle: Angle) -> list[str]:
    """One sentence for each point that moved or may have moved."""
    axes = c.difference.axes
    out = []
    moved = [d for d in c.displacements if d.answer == "moved"]
    for d in sorted(moved, key=lambda d: -d.statistic)[:_NAMED]:
        out.append(
            f"{d.name} moved {direction_words(d.vector.tolist(), axes, angle)} "
            f"(test {d.statistic:.1f}, limit {d.limit:.1f})."
        )
    if len(moved) > _NAMED:
        out.append(f"{len(moved) - _NAMED} more points moved: see the table.")
    untold = [d for d in c.displacements if d.answer == "cannot tell" and np.isfinite(d.statistic)]
    for d in untold[:_NAMED]:
        reason = (
            f"what may be systematic leaves a test between {d.least:.1f} and {d.largest:.1f}, "
            f"limit {d.limit:.1f}"
            if d.least < d.limit < d.largest
            else f"test {d.statistic:.1f}, limit {d.limit:.1f}"
        )
        words = direction_words(d.vector.tolist(), axes, angle)
        out.append(f"{d.name}: whether it moved cannot be told ({words}; {reason}).")
    still = [d for d in c.displacements if d.answer == "not moved"]
    percent = f"{100 * c.settings.power:g} %"
    if len(still) <= _NAMED:
        out += [
            f"{d.name} may have moved: {_needed(d)} would have been needed to see it with "
            f"{percent}."
            for d in still
        ]
    else:
        sizes = np.array([d.detectable for d in still])
        out.append(
            f"{len(still)} points show no displacement: {1e3 * sizes.min():.1f} to "
            f"{1e3 * sizes.max():.1f} mm would have been needed to see one with {percent}."
        )
    alpha = 1 - c.settings.confidence
    if not c.settings.together and len(c.displacements) > 1:
        out.append(
            f"Each point has its own test at {100 * alpha:.2g} %: of {len(c.displacements)} that "
            f"did not move {alpha * len(c.displacements):.1f} exceed the limit on average."
        )
    return out


def _needed(d: Displacement) -> str:
    if not np.isfinite(d.detectable):
        return "more than this network can tell"
    low, high = f"{1e3 * d.easiest:.1f}", f"{1e3 * d.detectable:.1f}"
    return f"{high} mm" if low == high else f"{low} to {high} mm, as it went,"


def _common(c: Comparison) -> list[str]:
    out = []
    for m in c.common:
        unit, factor = {"scale": ("ppm", 1e6)}.get(
            m.name, ("mm", 1e3) if m.name.startswith("shift") else ("mgon", 2e5 / np.pi)
        )
        real = "real" if abs(m.statistic) > m.limit else "not significant"
        out.append(
            f"Common {m.name} {factor * m.value:.2f} {unit}, sigma {factor * m.sigma:.2f} {unit} "
            f"(test {abs(m.statistic):.1f}, limit {m.limit:.1f}): {real}; it is taken out."
        )
    return out


def _remarks(c: Comparison) -> list[str]:
    """Datum, scale of the sigmas, precision of both epochs, points without a partner."""
    d = c.difference
    taken = f" {_listed(d.motions)} of the whole are taken out." if d.motions else ""
    out = [f"Datum: {_listed(c.stable)}.{taken}"]
    scaled = (
        f"a posteriori, variance factor {c.limits.factor:.3f} with {c.limits.dof} degrees of "
        "freedom"
        if c.limits.dof
        else "a priori"
    )
    out.append(f"Standard deviations and tests are {scaled}.")
    if c.precision is not None and not c.precision.passed:
        out.append(
            f"The epochs are not equally precise: ratio of the variance factors "
            f"{c.precision.statistic:.2f}, limit {c.precision.limit:.2f}. Check the weights, or "
            "look for blunders in the worse one."
        )
    for label, names in zip(d.labels, d.alone, strict=True):
        if names:
            out.append(f"Only in {label}: {_listed(names)}.")
    return out


def epochs_tables(compared: ComparedEpochs, angle: Angle = "gon") -> list[ReportTable]:
    """One row for each point."""
    c = compared.comparison
    axes = c.difference.axes
    factor = _factor(c)

    def component(axis: int) -> Any:
        place = axes.index(axis)
        head = ColumnHead(f"Δ{'ENU'[axis]}", "mm")
        return head, lambda d: mm_cell(number(d.vector[place]))

    def sigma(axis: int) -> Any:
        place = axes.index(axis)
        head = ColumnHead(f"σ{'ENU'[axis]}", "mm", wide=True)
        return head, lambda d: mm_cell(number(np.sqrt(max(d.covariance[place, place], 0.0))))

    columns: list[Any] = [
        (ColumnHead("Point", numeric=False), lambda d: text_cell(d.name)),
        (
            ColumnHead("use", numeric=False),
            lambda d: text_cell("reference" if d.reference else "object"),
        ),
        *(component(a) for a in axes),
        *(sigma(a) for a in axes),
    ]
    if 0 in axes and 1 in axes:
        percent = f"{100 * c.settings.confidence:g} %"
        columns += [
            (
                ColumnHead("azimuth", "gon" if angle == "gon" else "°"),
                lambda d: text_cell(
                    format_angle(
                        float(np.arctan2(d.vector[0], d.vector[1]) % (2 * np.pi)), angle, 0
                    )
                ),
            ),
            (ColumnHead(f"a {percent}", "mm", wide=True), lambda d: mm_cell(_axes(d, factor)[0])),
            (ColumnHead(f"b {percent}", "mm", wide=True), lambda d: mm_cell(_axes(d, factor)[1])),
        ]
    bounded = any(c.settings.systematic)
    columns += [
        (ColumnHead("test"), lambda d: fixed_cell(number(d.statistic), 2)),
        *(
            [
                (ColumnHead("least"), lambda d: fixed_cell(number(d.least), 2)),
                (ColumnHead("largest"), lambda d: fixed_cell(number(d.largest), 2)),
            ]
            if bounded
            else []
        ),
        (ColumnHead("limit"), lambda d: fixed_cell(d.limit, 2)),
        (ColumnHead("verdict", numeric=False), lambda d: text_cell(d.answer, _MARKS[d.answer])),
        (ColumnHead("detectable", "mm"), lambda d: mm_cell(number(d.detectable))),
    ]
    one, two = c.difference.labels
    note = (
        f"{two} minus {one}. Test: d^T C^-1 d in the datum of the stable points. Reference points "
        "are tested together, object points each. Detectable: the displacement that is found with "
        f"{100 * c.settings.power:g} % in the direction in which that is hardest."
    )
    return [
        build_table(
            "displacements",
            f"Displacements, {one} to {two}",
            note,
            c.displacements,
            columns,
            state=lambda d: "suspicious" if d.answer == "moved" else "",
        )
    ]


def _factor(c: Comparison) -> float:
    """From standard to confidence ellipses; the covariances are scaled already."""
    return confidence_factor(2, c.settings.confidence, c.limits.dof or None)


def _axes(d: Displacement, factor: float) -> tuple[float, float]:
    whole = np.zeros((1, 3, 3))
    whole[0, :2, :2] = d.covariance[:2, :2]
    found = plan_ellipses(whole, factor)
    return float(found.major[0]), float(found.minor[0])


def epochs_pictures(compared: ComparedEpochs) -> list[Picture]:
    """The map of the displacements; none without coordinates in plan."""
    c = compared.comparison
    drawing = displacement_drawing(c, _factor(c))
    if drawing is None:
        return []
    caption = (
        f"Triangles are reference points. Red moved, amber cannot be told, grey shows no "
        f"displacement. Ellipses hold with {100 * c.settings.confidence:g} %."
    )
    return [Picture("displacement-map", "Displacements", drawing, caption, wide=True)]


def epochs_svg(compared: ComparedEpochs) -> str | None:
    """The map as a file of its own; None without coordinates in plan."""
    drawing = displacement_drawing(compared.comparison, _factor(compared.comparison))
    if drawing is None:
        return None
    return render_page("displacements.svg.j2", drawing=drawing)


def epochs_page(compared: Sequence[ComparedEpochs], angle: Angle = "gon") -> str:
    """All comparisons on one page."""
    sentences, pictures, tables = [], [], []
    for k, one in enumerate(compared):
        labels = one.comparison.difference.labels
        head = f"{labels[0]} to {labels[1]}: " if len(compared) > 1 else ""
        sentences += [f"{head}{s}" for s in epochs_sentences(one, angle)]
        pictures += [
            replace(p, name=f"{p.name}-{k}", title=f"{head}{p.title}") for p in epochs_pictures(one)
        ]
        tables += [replace(t, name=f"{t.name}-{k}") for t in epochs_tables(one, angle)]
    every = [one.comparison.difference.labels for one in compared]
    title = f"{every[0][0]} to {_listed([two for _, two in every])}"
    return page("Comparison of epochs", title, sentences, pictures, tables)


def epochs_part(compared: ComparedEpochs, angle: Angle = "gon") -> EpochComparisonPart:
    """A comparison as JSON: metres, square metres, radians."""
    c, d = compared.comparison, compared.comparison.difference
    search = None
    if c.search is not None:
        s = c.search
        search = {
            "before": _test_part(s.before),
            "after": _test_part(s.after),
            "moved": [p.name for p in c.displacements if p.reference and p.name not in c.stable],
            "partners": [list(group) for group in c.partners],
            "resolved": s.resolved,
            "combinations": s.tried,
            "exhaustive": s.exhaustive,
        }
    return EpochComparisonPart.model_validate(
        {
            "first": d.labels[0],
            "second": d.labels[1],
            "axes": ["ENU"[k] for k in d.axes],
            "confidence": c.settings.confidence,
            "power": c.settings.power,
            "covariances": "posterior" if c.limits.dof else "prior",
            "dof": d.dof,
            "motions": list(d.motions),
            "systematic": list(c.settings.systematic),
            "stable": list(c.stable),
            "held": list(c.held),
            "whole": _test_part(c.whole),
            "references": search,
            "precision": None if c.precision is None else _test_part(c.precision),
            "common": [
                {
                    "name": m.name,
                    "value": m.value,
                    "sigma": m.sigma,
                    "test": m.statistic,
                    "limit": m.limit,
                }
                for m in c.common
            ],
            "points": {p.name: _point_part(p) for p in c.displacements},
            "only_first": list(d.alone[0]),
            "only_second": list(d.alone[1]),
            "sentences": epochs_sentences(compared, angle),
        }
    )


def _test_part(test: CongruenceTest) -> dict[str, Any]:
    return {
        "statistic": test.statistic,
        "dof": test.dof,
        "limit": test.limit,
        "significance": test.significance,
        "passed": test.passed,
    }


def _point_part(p: Displacement) -> dict[str, Any]:
    return {
        "reference": p.reference,
        "xyz": p.xyz.tolist(),
        "displacement": p.vector.tolist(),
        "covariance": p.covariance.tolist(),
        "test": p.statistic,
        "limit": p.limit,
        "significance": p.significance,
        "test_least": p.least,
        "test_largest": p.largest,
        "verdict": p.answer,
        "detectable": p.detectable,
        "detectable_easiest": p.easiest,
    }
