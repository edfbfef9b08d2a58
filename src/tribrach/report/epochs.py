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
from tribrach.epochs.systematics import Answer
from tribrach.job.epochs import ComparedEpochs
from tribrach.network.ellipsoids import confidence_factor, plan_ellipses
from tribrach.network.quality import GlobalTest
from tribrach.report.displacement_map import SAID, displacement_drawing
from tribrach.report.environment import render_page
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding, words
from tribrach.report.names import some_of
from tribrach.report.numbers import counted, fixed_cell, mm_cell, number
from tribrach.report.page import FrontPage, page
from tribrach.report.schema.epochs import EpochComparisonPart
from tribrach.report.tables import ColumnHead, ReportTable, build_table, text_cell
from tribrach.units import format_angle, percent

__all__ = [
    "direction_words",
    "epochs_findings",
    "epochs_page",
    "epochs_part",
    "epochs_pictures",
    "epochs_svg",
    "epochs_tables",
    "moved_sentence",
]

Angle = Literal["gon", "deg"]

#: points with a sentence of their own, of each verdict
_NAMED = 12
#: points that moved that a line of a front page names
_IN_LINE = 4
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
        size = f"{1e3 * abs(by[2]):.1f}"
        way = "in height" if float(size) == 0 else "down" if by[2] < 0 else "up"
        parts.append(f"{size} mm {way}")
    return ", ".join(parts)


def epochs_findings(compared: ComparedEpochs, angle: Angle = "gon") -> list[Finding]:
    """Whether the epochs hold, what moved, how sure that is, and what would have been seen."""
    c = compared.comparison
    out = [*_own(c), *_congruence(c), *_points(c, angle), *_common(c), *_remarks(c)]
    return [*out, *(Finding(f"{s[:1].upper()}{s[1:]}.") for s in compared.sentences)]


def _own(c: Comparison) -> list[Finding]:
    """The global test of each epoch: every later test rests on its sigmas."""
    out = []
    for label, test in zip(c.difference.labels, c.own, strict=True):
        if test.passed is None:
            out.append(Finding(f"{label}: its own global test is not known."))
            continue
        failed = not test.passed
        # in a run its own control is let go, so that this is not the test of its first page
        free = any(m.startswith(("shift", "rotation")) for m in c.difference.motions)
        alone = f"{label} by itself{', as a free network' if free else ''}"
        doubt = "; look at this epoch first, the tests below rest on its sigmas" if failed else ""
        out.append(Finding(f"{alone}: {test.sentence()}{doubt}.", failed))
    return out


def _test(test: CongruenceTest) -> str:
    return f"test {test.statistic:.2f} with {test.dof} degrees of freedom, limit {test.limit:.2f}"


def _listed(names: Sequence[str]) -> str:
    """A, B and C; of many the first."""
    if len(names) > 20:
        return f"{', '.join(names[:20])} and {len(names) - 20} more"
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _congruence(c: Comparison) -> list[Finding]:
    """The test of the reference points, and which of them moved."""
    one, two = c.difference.labels
    if c.search is None:
        how = "agree" if c.whole.passed else "differ"
        fixed = f" against {_listed(c.held)}, held in both" if c.held else ""
        out = [
            Finding(
                f"The points of {one} and {two} {how}{fixed}: {_test(c.whole)}.",
                not c.whole.passed,
            )
        ]
        if not c.held:
            out.append(
                Finding(
                    "The reference points only just carry the datum: none of them is tested.", True
                )
            )
        return out
    names = [d.name for d in c.displacements if d.reference]
    s = c.search
    if s.before.passed:
        return [Finding(f"The {len(names)} reference points are congruent: {_test(s.before)}.")]
    if not s.resolved:
        return [
            Finding(
                f"The {len(names)} reference points are not congruent ({_test(s.before)}), and no "
                "group of fewer than half of them explains it: what is stable cannot be told, of "
                "no point whether it moved, and the displacements hold in the datum of "
                f"{_listed(c.stable)} only.",
                True,
            )
        ]
    moved = _moved_references(c)
    found = (
        f"they are: {_test(s.after)}"
        if s.after.passed
        else f"what is left is still beyond its limit ({_test(s.after)}), and no further point "
        "explains it"
    )
    out = [
        Finding(
            f"The {len(names)} reference points are not congruent: {_test(s.before)}. Without "
            f"{_listed(moved)} {found}.",
            True,
        )
    ]
    out += [
        Finding(
            f"{_listed(group)} in place of {_listed(moved)} explains it nearly as well: which "
            "moved cannot be told.",
            True,
        )
        for group in c.partners[:_NAMED]
    ]
    if not s.exhaustive:
        out.append(
            Finding(
                "There are too many combinations to look at all: the best were sought stepwise."
            )
        )
    return out


def _moved_references(c: Comparison) -> list[str]:
    return [d.name for d in c.displacements if d.reference and d.name not in c.stable]


def _points(c: Comparison, angle: Angle) -> list[Finding]:
    """One sentence for each point: it moved, it cannot be told, or what would have been seen."""
    axes = c.difference.axes
    out = []
    moved = [d for d in c.displacements if d.answer == "moved"]
    doubtful = {
        name for name in _moved_references(c) if any(name not in group for group in c.partners)
    }
    for d in sorted(moved, key=lambda d: -d.statistic)[:_NAMED]:
        # the partners are named before
        instead = ", if it is not a partner of it that moved" if d.name in doubtful else ""
        out.append(
            Finding(
                f"{d.name} moved {direction_words(d.vector.tolist(), axes, angle)} "
                f"(test {d.statistic:.1f}, limit {d.limit:.1f}){instead}.",
                True,
            )
        )
    if len(moved) > _NAMED:
        out.append(Finding(f"{len(moved) - _NAMED} more points moved: see the table.", True))
    untold = [d for d in c.displacements if d.answer == "cannot tell" and np.isfinite(d.statistic)]
    for d in untold[:_NAMED]:
        out.append(Finding(_untold(c, d, angle), True))
    if len(untold) > _NAMED:
        out.append(Finding(f"{len(untold) - _NAMED} more points cannot be told: see the table."))
    return [*out, *_still(c), *_each(c)]


def _untold(c: Comparison, d: Displacement, angle: Angle) -> str:
    """Why it cannot be told whether a point moved."""
    words = direction_words(d.vector.tolist(), c.difference.axes, angle)
    if c.search is not None and not c.search.resolved:
        reason = "no datum is known to be stable"
    elif d.least < d.limit < d.largest:
        reason = (
            f"what may be systematic leaves a test between {d.least:.1f} and {d.largest:.1f}, "
            f"limit {d.limit:.1f}"
        )
    else:
        reason = f"test {d.statistic:.1f}, limit {d.limit:.1f}"
    return f"{d.name}: whether it moved cannot be told ({words}; {reason})."


def _still(c: Comparison) -> list[Finding]:
    """Points whose test passed, and what it would have seen."""
    every = [d for d in c.displacements if d.answer == "not moved"]
    still = sorted(every, key=lambda d: not d.reference)
    others = _moved_references(c)
    left = f"the reference points without {_listed(others)}" if others else "all reference points"
    together = f"the test of {left}"
    power = f"{100 * c.settings.power:g} %"
    if len(still) > _NAMED:
        sizes = np.array([d.detectable for d in still])
        return [
            Finding(
                f"{len(still)} points show no displacement: {1e3 * sizes.min():.1f} to "
                f"{1e3 * sizes.max():.1f} mm would have been needed to see one with {power}."
            )
        ]
    return [
        Finding(
            f"{d.name} shows no displacement"
            + (
                f" in {together}"
                if d.reference and c.search is not None
                else f" (test {d.statistic:.1f}, limit {d.limit:.1f})"
            )
            + f": {_needed(d)} would have been needed to see one with {power}."
        )
        for d in still
    ]


def _each(c: Comparison) -> list[Finding]:
    """How many of the single tests fail by chance."""
    alpha = 1 - c.settings.confidence
    single = [d for d in c.displacements if c.search is None or not d.reference]
    if c.settings.together or len(single) < 2:
        return []
    which = "point" if len(single) == len(c.displacements) else "object point"
    return [
        Finding(
            f"Each {which} has its own test at {percent(alpha)}: of {len(single)} that "
            f"did not move, {alpha * len(single):.1f} exceed the limit on average."
        )
    ]


def _needed(d: Displacement) -> str:
    if not np.isfinite(d.detectable):
        return "more than this network can tell"
    low, high = f"{1e3 * d.easiest:.1f}", f"{1e3 * d.detectable:.1f}"
    return f"{high} mm" if low == high else f"{low} to {high} mm, by its direction,"


def _common(c: Comparison) -> list[Finding]:
    out = []
    for m in c.common:
        unit, factor = {"scale": ("ppm", 1e6)}.get(
            m.name, ("mm", 1e3) if m.name.startswith("shift") else ("mgon", 2e5 / np.pi)
        )
        real = "significant" if abs(m.statistic) > m.limit else "not significant"
        out.append(
            Finding(
                f"Common {m.name} {factor * m.value:.2f} {unit}, sigma {factor * m.sigma:.2f} "
                f"{unit} (test {abs(m.statistic):.1f}, limit {m.limit:.1f}): {real}; it is taken "
                "out."
            )
        )
    return out


def _remarks(c: Comparison) -> list[Finding]:
    """Datum, scale of the sigmas, precision of both epochs, points without a partner."""
    d = c.difference
    taken = f" Taken out of the whole: {_listed(d.motions)}." if d.motions else ""
    out = [Finding(f"Datum: {_listed(c.stable)}.{taken}")]
    scaled = (
        f"a posteriori, variance factor {c.limits.factor:.3f} with {c.limits.dof} degrees of "
        "freedom"
        if c.limits.dof
        else "a priori"
    )
    out.append(Finding(f"Standard deviations and tests are {scaled}."))
    if c.precision is not None and not c.precision.passed:
        out.append(
            Finding(
                f"The epochs are not equally precise: ratio of the variance factors "
                f"{c.precision.statistic:.2f}, limit {c.precision.limit:.2f}. Check the weights, "
                "or look for blunders in the worse one.",
                True,
            )
        )
    for label, names in zip(d.labels, d.alone, strict=True):
        if names:
            out.append(Finding(f"Only in {label}: {_listed(names)}."))
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
        head = ColumnHead(f"σ {'ENU'[axis]}", "mm", wide=True)
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
        level = f"{100 * c.settings.confidence:g} %"
        columns += [
            (
                ColumnHead("azimuth", "gon" if angle == "gon" else "°"),
                lambda d: text_cell(
                    format_angle(
                        float(np.arctan2(d.vector[0], d.vector[1]) % (2 * np.pi)), angle, 0
                    )
                ),
            ),
            (ColumnHead(f"a {level}", "mm", wide=True), lambda d: mm_cell(_axes(d, factor)[0])),
            (ColumnHead(f"b {level}", "mm", wide=True), lambda d: mm_cell(_axes(d, factor)[1])),
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
        (
            ColumnHead("verdict", numeric=False),
            lambda d: text_cell(SAID[d.answer], _MARKS[d.answer]),
        ),
        (ColumnHead("detectable", "mm"), lambda d: mm_cell(number(d.detectable))),
    ]
    one, two = c.difference.labels
    note = (
        f"{two} minus {one}. Test: dᵀC⁻¹d in the datum of the stable points. Reference points "
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
    return [Picture("displacement-map", "Map of the displacements", drawing, caption, wide=True)]


def epochs_svg(compared: ComparedEpochs) -> str | None:
    """The map as a file of its own; None without coordinates in plan."""
    drawing = displacement_drawing(compared.comparison, _factor(compared.comparison))
    if drawing is None:
        return None
    return render_page("displacements.svg.j2", drawing=drawing)


def epochs_page(compared: Sequence[ComparedEpochs], angle: Angle = "gon") -> str:
    """All comparisons on one page."""
    findings, pictures, tables = [], [], []
    for k, one in enumerate(compared):
        labels = one.comparison.difference.labels
        head = f"{labels[0]} to {labels[1]}: " if len(compared) > 1 else ""
        findings += [
            replace(f, words=f"{head}{f.words}") if head else f for f in epochs_findings(one, angle)
        ]
        pictures += [
            replace(p, name=f"{p.name}-{k}", title=f"{head}{p.title}") for p in epochs_pictures(one)
        ]
        tables += [replace(t, name=f"{t.name}-{k}") for t in epochs_tables(one, angle)]
    every = [one.comparison.difference.labels for one in compared]
    title = f"{every[0][0]} to {_listed([two for _, two in every])}"
    front = _front([one.comparison for one in compared])
    return page("Comparison of epochs", title, front, findings, pictures, tables)


def _front(comparisons: Sequence[Comparison]) -> FrontPage:
    """What moved in any of the comparisons, and what one signs."""
    moved = list(dict.fromkeys(name for c in comparisons for name in c.moved))
    open_ = [c for c in comparisons if c.search is not None and not c.search.resolved]
    failed = [
        label
        for c in comparisons
        for label, test in zip(c.difference.labels, c.own, strict=True)
        if test.passed is False
    ]
    sort: Literal["good", "look", "bad", "none"] = "none"
    untold = any(d.answer == "cannot tell" for c in comparisons for d in c.displacements)
    if len(open_) == len(comparisons):
        sort, verdict = "bad", "What moved cannot be told"
    elif moved:
        verdict = f"{some_of(moved, _IN_LINE)} moved"
    elif untold:
        verdict = "No displacement is sure"
    else:
        sort, verdict = "good", "No displacement found"
    if failed:
        sort = "bad"
        verdict += f"; {_listed(list(dict.fromkeys(failed)))} by itself fails its global test"
    stable = comparisons[0].stable
    signed = (
        f"Displacements with their tests and with what would have been seen, in the datum of "
        f"{_listed(stable)}."
        if len(comparisons) == 1
        else "Displacements with their tests and with what would have been seen, each in its datum."
    )
    if len(comparisons) == 1:
        # those that moved are in the verdict
        sentence = moved_sentence(comparisons[0], but_those_that_moved=bool(moved))
    else:
        sentence = " ".join(map(moved_sentence, comparisons))
    return FrontPage(sort, verdict, sentence, signed=signed)


def moved_sentence(comparison: Comparison, *, but_those_that_moved: bool = False) -> str:
    """What the tests say of the points since an earlier epoch."""
    names: dict[Answer, list[str]] = {"moved": [], "not moved": [], "cannot tell": []}
    for one in comparison.displacements:
        names[one.answer].append(one.name)
    parts = []
    if names["moved"] and not but_those_that_moved:
        parts.append(f"{some_of(names['moved'], _IN_LINE)} moved")
    if names["not moved"]:
        still = counted(len(names["not moved"]), "point")
        verb = "shows" if len(names["not moved"]) == 1 else "show"
        parts.append(f"{still} {verb} no displacement")
    if names["cannot tell"]:
        parts.append(f"of {counted(len(names['cannot tell']), 'point')} it cannot be told")
    said = ", ".join(parts) or "no other points are compared"
    return f"Since {comparison.difference.labels[0]}: {said}."


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
            "own": [_own_part(test) for test in c.own],
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
            "sentences": words(epochs_findings(compared, angle)),
        }
    )


def _own_part(test: GlobalTest) -> dict[str, Any] | None:
    if test.passed is None:
        return None
    return {
        "vtpv": test.vtpv,
        "dof": test.dof,
        "lower": test.lower,
        "upper": test.upper,
        "passed": test.passed,
    }


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
