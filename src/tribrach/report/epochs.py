"""Compared epochs: the result as it is written, in findings, a table and a map.

Displacements are those of the second epoch against the first, in the datum of the stable points.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from tribrach._types import Array
from tribrach.answers import Result
from tribrach.epochs.comparison import CommonMotion, Comparison, Displacement
from tribrach.epochs.congruence import CongruenceTest
from tribrach.epochs.systematics import Answer
from tribrach.job.epochs import ComparedEpochs
from tribrach.network.ellipsoids import confidence_factor, plan_ellipses
from tribrach.report.charts import Drawing, DrawnMark, mark
from tribrach.report.columns import column, component
from tribrach.report.environment import render_page
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding, words
from tribrach.report.labels import place_labels
from tribrach.report.map import MapFrame, length_words, round_down
from tribrach.report.names import some_of
from tribrach.report.numbers import counted
from tribrach.report.tables import ColumnHead, ReportTable, build_table, text_cell
from tribrach.sentences import Sentence, capital, joined, written
from tribrach.units import format_angle, percent

# East is right, north is up, in pixels of an SVG, as in the map of a network. Displacements and
# ellipses share one stated exaggeration. Changes of heights are drawn upwards and downwards.


#: of the largest displacement or ellipse in pixels
_LONGEST = 90.0
#: what a test says of a point: that nothing moved is what no test can show
SAID: dict[Answer, str] = {
    "moved": "moved",
    "not moved": "no displacement shown",
    "cannot tell": "cannot be told",
}
_SORTS = {"moved": "moved", "not moved": "still", "cannot tell": "untold"}


def displacement_drawing(comparison: Comparison, factor: float) -> Drawing | None:
    """The map; None if fewer than two points have coordinates in plan."""
    shown = [d for d in comparison.displacements if np.isfinite(d.xyz[:2]).all()]
    if len(shown) < 2:
        return None
    xy = np.array([d.xyz[:2] for d in shown])
    if not np.ptp(xy, axis=0).any():
        return None
    frame = MapFrame(xy)
    pixel = frame.pixel(xy)
    plan = 0 in comparison.difference.axes
    vectors = np.array([_drawn(d, plan) for d in shown])
    axes = np.array([_ellipse(d, plan, factor) for d in shown])
    largest = max(float(np.linalg.norm(vectors, axis=1).max()), float(axes[:, 0].max()), 1e-9)
    exaggeration = round_down(_LONGEST / (largest * frame.scale))
    size = exaggeration * frame.scale
    marks = [
        mark("rect", x=0.5, y=0.5, width=frame.width - 1, height=frame.height - 1, class_="sheet")
    ]
    for d, (x, y), v, a in zip(shown, pixel.tolist(), vectors, axes, strict=True):
        marks.append(_point(d, x, y, v * size * [1, -1], a * [size, size, 1], plan))
    names = [
        (float(x), float(y), d.name, "control" if d.reference else "free", 6.0)
        for (x, y), d in zip(pixel, shown, strict=True)
    ]
    marks += [
        mark("text", text=label.text, x=label.x, y=label.y, class_=f"label {label.sort}")
        for label in place_labels(names, frame.width, frame.height)
    ]
    bar, small = round_down(0.22 * frame.width / frame.scale), round_down(60.0 / size)
    enlarged = (
        Sentence("enlarged {exaggeration:0,} ×", exaggeration=exaggeration)
        if exaggeration >= 1
        else "reduced"
    )
    words = Sentence(
        "{length} for displacements and ellipses ({enlarged})",
        length=length_words(small),
        enlarged=enlarged,
    )
    marks += [
        *_bar(16, frame.height + 22, bar * frame.scale, length_words(bar), "bar"),
        *_bar(frame.width / 2 - 80, frame.height + 22, small * size, words, "bar fine"),
        mark("path", d=f"M{frame.width - 26} 16l6 22l-6 -5l-6 5z", class_="north"),
        mark("text", text="N", x=frame.width - 26, y=52, class_="north"),
    ]
    return Drawing(
        frame.width, frame.height + 44, tuple(marks), "Plan of the displacements", "displacements"
    )


def _point(d: Displacement, x: float, y: float, step: Array, axes: Array, plan: bool) -> DrawnMark:
    """A point with its displacement and ellipse, all in pixels."""
    to = x + float(step[0]), y + float(step[1])
    spread = (
        mark(
            "ellipse",
            cx=to[0],
            cy=to[1],
            rx=float(axes[0]),
            ry=float(axes[1]),
            transform=f"rotate({math.degrees(axes[2]) - 90:.2f} {to[0]:.2f} {to[1]:.2f})",
            class_="spread",
        )
        if plan
        else mark(
            "path", d=f"M{to[0]:.2f} {to[1] - axes[0]:.2f}v{2 * axes[0]:.2f}", class_="spread"
        )
    )
    place = (
        mark("path", d=f"M{x} {y - 6}l5.4 10h-10.8z", class_="place")
        if d.reference
        else mark("circle", cx=x, cy=y, r=3.0, class_="place")
    )
    line = mark("line", x1=x, y1=y, x2=to[0], y2=to[1], class_="shift")
    title = Sentence("{d.name}: {d.length:mm2}, {d2}", d=d, d2=SAID[d.answer])
    return mark("g", title=title, inner=(spread, line, place), class_=_SORTS[d.answer])


def _bar(x: float, y: float, length: float, words: str, sort: str) -> list[DrawnMark]:
    """A scale bar with its words."""
    return [
        mark("path", d=f"M{x:.2f} {y - 5:.2f}v10m0 -5h{length:.2f}m0 -5v10", class_=sort),
        mark("text", text=words, x=x + length + 8, y=y + 4, class_="label"),
    ]


def _drawn(d: Displacement, plan: bool) -> Array:
    """What is drawn to the right and upwards [m]."""
    return d.vector[:2] if plan else np.array([0.0, d.vector[0]])


def _ellipse(d: Displacement, plan: bool, factor: float) -> tuple[float, float, float]:
    """Semi-axes [m] and azimuth; of heights a line upwards."""
    if not plan:
        return factor * math.sqrt(max(float(d.covariance[0, 0]), 0.0)), 0.0, 0.0
    whole = np.zeros((1, 3, 3))
    whole[0, :2, :2] = d.covariance[:2, :2]
    found = plan_ellipses(whole, factor)
    return float(found.major[0]), float(found.minor[0]), float(found.azimuth[0])


Angle = Literal["gon", "deg"]

#: points with a sentence of their own, of each verdict
_NAMED = 12
#: points that moved that a line of a front page names
IN_LINE = 4
#: names in a sentence
_LISTED = 20


@dataclass(frozen=True)
class ReferenceSearch(Result):
    """Which reference points moved."""

    before: CongruenceTest
    after: CongruenceTest
    moved: tuple[str, ...]
    #: groups that explain the differences nearly as well
    partners: tuple[tuple[str, ...], ...]
    resolved: bool
    combinations: int
    exhaustive: bool


@dataclass(frozen=True)
class OwnTest(Result):
    """The global test of one epoch."""

    vtpv: float
    dof: int
    lower: float
    upper: float
    passed: bool


@dataclass(frozen=True)
class EpochComparison(Result):
    """Comparison of two epochs, as it is written."""

    first: str
    second: str
    axes: tuple[Literal["E", "N", "U"], ...]
    confidence: float
    power: float
    covariances: Literal["prior", "posterior"]
    dof: int  #: of both epochs together; 0 where it is not known
    motions: tuple[str, ...]  #: what is taken out of the differences
    systematic: tuple[float, ...]  #: bounds of systematic parts in E, N, U [m]
    stable: tuple[str, ...]  #: points that carry the datum
    #: points that are held in both epochs
    held: tuple[str, ...]
    whole: CongruenceTest
    references: ReferenceSearch | None
    #: of the first and the second epoch; null where it is not known
    own: tuple[OwnTest | None, ...]
    precision: CongruenceTest | None  #: ratio of the variance factors of both epochs
    #: motions of the whole that were taken out by choice
    common: tuple[CommonMotion, ...]
    points: dict[str, Displacement]
    only_first: tuple[str, ...]
    only_second: tuple[str, ...]
    sentences: tuple[str, ...]

    @classmethod
    def of(cls, compared: ComparedEpochs, angle: Angle = "gon") -> EpochComparison:
        """A comparison with what is said of it."""
        c, d, s = compared.comparison, compared.comparison.difference, compared.comparison.search
        moved = tuple(_moved_references(c))
        return cls(
            *d.labels,
            tuple(_AXES[k] for k in d.axes),
            c.settings.confidence,
            c.settings.power,
            "posterior" if c.limits.dof else "prior",
            d.dof,
            tuple(d.motions),
            c.settings.systematic,
            c.stable,
            c.held,
            c.whole,
            None
            if s is None
            else ReferenceSearch(
                s.before, s.after, moved, c.partners, s.resolved, s.tried, s.exhaustive
            ),
            tuple(
                None if t.passed is None else OwnTest(t.vtpv, t.dof, t.lower, t.upper, t.passed)
                for t in c.own
            ),
            c.precision,
            c.common,
            {p.name: p for p in c.displacements},
            tuple(d.alone[0]),
            tuple(d.alone[1]),
            tuple(words(epochs_findings(compared, angle))),
        )


_AXES: tuple[Literal["E", "N", "U"], ...] = ("E", "N", "U")


def direction_words(vector: Sequence[float], axes: Sequence[int], angle: Angle = "gon") -> str:
    """A displacement [m] in words: 4.1 mm towards 212 gon, 2.0 mm down."""
    by = dict(zip(axes, np.asarray(vector, dtype=float).tolist(), strict=True))
    parts = []
    if 0 in by and 1 in by:
        azimuth = float(np.arctan2(by[0], by[1]) % (2 * np.pi))
        template = "{length:mm1} towards {azimuth:" + ("gon0}" if angle == "gon" else "°0}")
        parts.append(Sentence(template, length=float(np.hypot(by[0], by[1])), azimuth=azimuth))
    if 2 in by:
        way = "down" if by[2] < 0 else "up"
        if float(written(abs(by[2]), "mm1~")) == 0:
            way = "in height"
        parts.append(Sentence("{size:mm1} {way}", size=abs(by[2]), way=way))
    return joined(", ", parts)


def epochs_findings(compared: ComparedEpochs, angle: Angle = "gon") -> list[Finding]:
    """Whether the epochs hold, what moved, how sure that is, and what would have been seen."""
    c = compared.comparison
    out = [*_own(c), *_congruence(c), *_points(c, angle), *_common(c), *_remarks(c)]
    return [*out, *(Finding.of("remark", "{s}.", s=capital(s)) for s in compared.sentences)]


def _own(c: Comparison) -> Iterator[Finding]:
    """The global test of each epoch: every later test rests on its sigmas."""
    # in a run its own control is let go, so that this is not the test of its first page
    free = any(m.startswith(("shift", "rotation")) for m in c.difference.motions)
    alone = "{label} by itself" + (", as a free network" if free else "")
    doubt = "; look at this epoch first, the tests below rest on its sigmas"
    for label, test in zip(c.difference.labels, c.own, strict=True):
        if test.passed is None:
            template = "{label}: its own global test is not known."
            yield Finding.of("own_unknown", template, label=label)
            continue
        failed = not test.passed
        template = f"{alone}: {{said}}{doubt if failed else ''}."
        yield Finding.of("own", template, failed, label=label, said=test.sentence())


def _test(test: CongruenceTest) -> Sentence:
    return Sentence(
        "test {t.statistic:2} with {t.dof} degrees of freedom, limit {t.limit:2}", t=test
    )


def listed(names: Sequence[str]) -> str:
    """A, B and C; of many the first."""
    if len(names) > _LISTED:
        return f"{', '.join(names[:_LISTED])} and {len(names) - _LISTED} more"
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))


def _congruence(c: Comparison) -> Iterator[Finding]:
    """The test of the reference points, and which of them moved."""
    s = c.search
    if s is None:
        one, two = c.difference.labels
        yield Finding.of(
            "whole",
            "The points of {one} and {two} {how}"
            + " against {held}, held in both" * bool(c.held)
            + ": {test}.",
            not c.whole.passed,
            one=one,
            two=two,
            how="agree" if c.whole.passed else "differ",
            held=listed(c.held),
            test=_test(c.whole),
        )
        if not c.held:
            text = "The reference points only just carry the datum: none of them is tested."
            yield Finding(text, True, "untested")
        return
    said: dict[str, Any] = {
        "n": sum(d.reference for d in c.displacements),
        "before": _test(s.before),
        "after": _test(s.after),
        "stable": listed(c.stable),
        "moved": listed(_moved_references(c)),
    }
    if s.before.passed:
        yield Finding.of("congruent", "The {n} reference points are congruent: {before}.", **said)
        return
    if not s.resolved:
        yield Finding.of(
            "unresolved",
            "The {n} reference points are not congruent ({before}), and no group of fewer than "
            "half of them explains it: what is stable cannot be told, of no point whether it "
            "moved, and the displacements hold in the datum of {stable} only.",
            True,
            **said,
        )
        return
    found = "they are: {after}"
    if not s.after.passed:
        found = "what is left is still beyond its limit ({after}), and no further point explains it"
    template = (
        f"The {{n}} reference points are not congruent: {{before}}. Without {{moved}} {found}."
    )
    yield Finding.of("not_congruent", template, True, **said)
    for group in c.partners[:_NAMED]:
        yield Finding.of(
            "partners",
            "{group} in place of {moved} explains it nearly as well: which moved cannot be told.",
            True,
            group=listed(group),
            **said,
        )
    if not s.exhaustive:
        yield Finding(
            "There are too many combinations to look at all: the best were sought stepwise.",
            key="stepwise",
        )


def _moved_references(c: Comparison) -> list[str]:
    return [d.name for d in c.displacements if d.reference and d.name not in c.stable]


def _points(c: Comparison, angle: Angle) -> Iterator[Finding]:
    """One sentence for each point: it moved, it cannot be told, or what would have been seen."""
    moved = sorted((d for d in c.displacements if d.answer == "moved"), key=lambda d: -d.statistic)
    untold = [d for d in c.displacements if d.answer == "cannot tell" and np.isfinite(d.statistic)]
    references = _moved_references(c)
    open_ = c.search is not None and not c.search.resolved
    for d in [*moved[:_NAMED], *untold[:_NAMED]]:
        how = direction_words(d.vector.tolist(), c.difference.axes, angle)
        if d.answer == "moved":
            # the partners are named before
            doubtful = d.name in references and any(d.name not in group for group in c.partners)
            instead = ", if it is not a partner of it that moved" if doubtful else ""
            template = (
                f"{{d.name}} moved {{how}} (test {{d.statistic:1}}, limit {{d.limit:1}}){instead}."
            )
        else:
            reason = "test {d.statistic:1}, limit {d.limit:1}"
            if open_:
                reason = "no datum is known to be stable"
            elif d.least < d.limit < d.largest:
                reason = (
                    "what may be systematic leaves a test between {d.least:1} and {d.largest:1}, "
                    "limit {d.limit:1}"
                )
            template = f"{{d.name}}: whether it moved cannot be told ({{how}}; {reason})."
        yield Finding.of(d.answer.replace(" ", "_"), template, True, d=d, how=how)
        if len(moved) > _NAMED and d is moved[_NAMED - 1]:
            text = f"{len(moved) - _NAMED} more points moved: see the table."
            yield Finding(text, True, "more_moved")
    if len(untold) > _NAMED:
        text = f"{len(untold) - _NAMED} more points cannot be told: see the table."
        yield Finding(text, key="more_untold")
    yield from _still(c)
    alpha = 1 - c.settings.confidence
    single = [d for d in c.displacements if c.search is None or not d.reference]
    if not c.settings.together and len(single) > 1:
        yield Finding.of(
            "each",
            "Each {which} has its own test at {alpha}: of {n} that did not move, {expected:1} "
            "exceed the limit on average.",
            which="point" if len(single) == len(c.displacements) else "object point",
            alpha=percent(alpha),
            n=len(single),
            expected=alpha * len(single),
        )


def _still(c: Comparison) -> Iterator[Finding]:
    """Points whose test passed, and what it would have seen."""
    every = [d for d in c.displacements if d.answer == "not moved"]
    still = sorted(every, key=lambda d: not d.reference)
    if len(still) > _NAMED:
        sizes = np.array([d.detectable for d in still])
        yield Finding.of(
            "still",
            "{n} points show no displacement. Smallest detectable displacement (power "
            "{power:%g}): {low:mm1~} to {high:mm1}, depending on point and direction.",
            n=len(still),
            low=sizes.min(),
            high=sizes.max(),
            power=c.settings.power,
        )
        return
    others = _moved_references(c)
    left = f"the reference points without {listed(others)}" if others else "all reference points"
    for d in still:
        together = d.reference and c.search is not None
        test = f"in the test of {left}" if together else "(test {d.statistic:1}, limit {d.limit:1})"
        yield Finding.of(
            "not_moved",
            f"{{d.name}} shows no displacement {test}. {_detectable(d)}.",
            d=d,
            power=c.settings.power,
        )


def _detectable(d: Displacement) -> str:
    """The template of what would have been seen."""
    if not np.isfinite(d.detectable):
        return "In some direction this network detects none"
    least = "Smallest detectable displacement (power {power:%g}): "
    if written(d.easiest, "mm1") == written(d.detectable, "mm1"):
        return least + "{d.detectable:mm1}"
    return least + "{d.easiest:mm1~} to {d.detectable:mm1}, depending on direction"


def _common(c: Comparison) -> Iterator[Finding]:
    """Motions that were taken out by choice."""
    for m in c.common:
        unit = "mm2" if m.name.startswith("shift") else "ppm2" if m.name == "scale" else "mgon2"
        yield Finding.of(
            "common",
            f"Common {{m.name}} {{m.value:{unit}}}, sigma {{m.sigma:{unit}}} (test {{test:1}}, "
            "limit {m.limit:1}): {real}; it is taken out.",
            m=m,
            test=abs(m.statistic),
            real="significant" if abs(m.statistic) > m.limit else "not significant",
        )


def _remarks(c: Comparison) -> Iterator[Finding]:
    """Datum, scale of the sigmas, precision of both epochs, points without a partner."""
    d = c.difference
    taken = f" Common motions removed: {listed(d.motions)}." if d.motions else ""
    yield Finding(f"Datum: {listed(c.stable)}.{taken}", key="datum")
    scaled = "a priori"
    if c.limits.dof:
        scaled = "a posteriori, variance factor {l.factor:3} with {l.dof} degrees of freedom"
    yield Finding.of("scaled", f"Standard deviations and tests are {scaled}.", l=c.limits)
    if c.precision is not None and not c.precision.passed:
        yield Finding.of(
            "precision",
            "The epochs are not equally precise: ratio of the variance factors {t.statistic:2}, "
            "limit {t.limit:2}. Check the weights, or look for blunders in the worse one.",
            True,
            t=c.precision,
        )
    for label, names in zip(d.labels, d.alone, strict=True):
        if names:
            yield Finding(f"Only in {label}: {listed(names)}.", key="only_in")


def epochs_tables(compared: ComparedEpochs, angle: Angle = "gon") -> list[ReportTable]:
    """One row for each point."""
    c, factor = compared.comparison, _factor(compared.comparison)
    axes, level = c.difference.axes, written(c.settings.confidence, "%g")

    def azimuth(d: Displacement) -> str:
        return format_angle(float(np.arctan2(d.vector[0], d.vector[1]) % (2 * np.pi)), angle, 0)

    def sigma(k: int) -> Callable[[Displacement], float]:
        return lambda d: float(np.sqrt(max(d.covariance[k, k], 0.0)))

    columns = [
        column("Point", "name"),
        column("use", lambda d: "reference" if d.reference else "object"),
        *(column(f"Δ{_AXES[a]}", component("vector", k), "mm2") for k, a in enumerate(axes)),
        *(column(f"σ {_AXES[a]}", sigma(k), "mm2", wide=True) for k, a in enumerate(axes)),
    ]
    if 0 in axes and 1 in axes:
        columns += [
            (
                ColumnHead("azimuth", "gon" if angle == "gon" else "°"),
                lambda d: text_cell(azimuth(d)),
            ),
            column(f"a {level}", lambda d: _axes(d, factor)[0], "mm2", wide=True),
            column(f"b {level}", lambda d: _axes(d, factor)[1], "mm2", wide=True),
        ]
    bounded = ("least", "largest") if any(c.settings.systematic) else ()
    columns += [
        column("test", "statistic", "2"),
        *(column(name, name, "2") for name in bounded),
        column("limit", "limit", "2"),
        column("verdict", lambda d: SAID[d.answer], mark=lambda d: "bad" * (d.answer == "moved")),
        column("detectable", "detectable", "mm2"),
    ]
    one, two = c.difference.labels
    note = Sentence(
        "{two} minus {one}. Test: dᵀC⁻¹d in the datum of the stable points. Reference points are "
        "tested together, object points each. Detectable: the displacement that is found with "
        "{power:%g} in the direction in which that is hardest.",
        two=two,
        one=one,
        power=c.settings.power,
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
    return float(confidence_factor(2, c.settings.confidence, c.limits.dof or None))


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
    caption = Sentence(
        "Triangles are reference points. Red: moved; amber: cannot tell; grey: no displacement "
        "shown. Ellipses hold with {confidence:%g}.",
        confidence=c.settings.confidence,
    )
    return [Picture("displacement-map", "Map of the displacements", drawing, caption, wide=True)]


def epochs_svg(compared: ComparedEpochs) -> str | None:
    """The map as a file of its own; None without coordinates in plan."""
    drawing = displacement_drawing(compared.comparison, _factor(compared.comparison))
    if drawing is None:
        return None
    return render_page("displacements.svg.j2", drawing=drawing)


def moved_sentence(comparison: Comparison, *, but_those_that_moved: bool = False) -> str:
    """What the tests say of the points since an earlier epoch."""
    names: dict[Answer, list[str]] = {"moved": [], "not moved": [], "cannot tell": []}
    for one in comparison.displacements:
        names[one.answer].append(one.name)
    parts = []
    if names["moved"] and not but_those_that_moved:
        parts.append(f"{some_of(names['moved'], IN_LINE)} moved")
    if names["not moved"]:
        still = counted(len(names["not moved"]), "point")
        verb = "shows" if len(names["not moved"]) == 1 else "show"
        parts.append(f"{still} {verb} no displacement")
    if names["cannot tell"]:
        parts.append(f"of {counted(len(names['cannot tell']), 'point')} it cannot be told")
    said = ", ".join(parts) or "no other points are compared"
    return f"Since {comparison.difference.labels[0]}: {said}."
