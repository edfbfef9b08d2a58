"""The map of displacements: where points went, with the ellipses in which that is uncertain.

East is right, north is up, in pixels of an SVG, as in the map of a network. Displacements and
ellipses share one stated exaggeration. Changes of heights are drawn upwards and downwards.
"""

from __future__ import annotations

import math

import numpy as np

from tribrach._types import Array
from tribrach.epochs.comparison import Comparison, Displacement
from tribrach.epochs.systematics import Answer
from tribrach.network.ellipsoids import plan_ellipses
from tribrach.report.charts import Drawing, DrawnMark, mark
from tribrach.report.labels import place_labels
from tribrach.report.map import MapFrame, length_words, round_down
from tribrach.sentences import Sentence

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
