"""A comparison of two clouds as people read it; what a run shows of one too is the report's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from tribrach._types import Array
from tribrach.answers import Form
from tribrach.comparison.compared import CloudComparison
from tribrach.io.outputs import Content
from tribrach.questions.compare.motions import CloudMotions, ComparedPlaces, MovedPart
from tribrach.questions.compare.moved import (
    ToldMotions,
    motions_findings,
    motions_front,
    motions_tables,
)
from tribrach.report.answer import Answer
from tribrach.report.charts import Chart, beside, colour_bar, legend, shades
from tribrach.report.comparison import (
    PREDICTED,
    comparison_findings,
    comparison_pictures,
    comparison_tables,
    offsets_finding,
)
from tribrach.report.figures import Picture
from tribrach.report.findings import Finding
from tribrach.report.page import FrontPage
from tribrach.report.views import SIZE, View, views_in_words, views_of
from tribrach.sentences import Sentence

#: places that are drawn; more hide each other
_DRAWN = 40_000
#: from -1 by way of 0 to 1: blue, grey that is seen on white and on black, red
_SIGNED = np.array(
    [[33, 102, 172], [103, 169, 207], [176, 192, 203], [190, 190, 190], [219, 184, 167],
     [239, 138, 98], [178, 24, 43]],
    dtype=float,
)  # fmt: skip
#: colours of the stable area, of what is in nothing, and of parts one after the other
_STABLE, _NOTHING = "#7fbf9a", "#c9c9c9"
_PARTS = ("#d1495b", "#3d6fb4", "#e0a030", "#7b4fa3", "#1f9e9e", "#8c6b4f")
#: parts with a name and a colour of their own in the legend
_NAMED = 12
#: length of the longest arrow over the width of the picture
_LONGEST = 0.12
#: two-sided 95 % of the normal distribution
_NORMAL_95 = 1.96


def motions_pictures(motions: CloudMotions) -> list[Picture]:
    """Distances along normals, and what they are part of; none where nothing was compared."""
    places = motions.places
    if len(places.distance) < 2:
        return []
    return [_distances(places), _membership(motions)]


def _distances(places: ComparedPlaces) -> Picture:
    """Signed distances in plan and elevation, the largest on top."""
    rows = _some(len(places.distance))
    xyz, values = places.xyz[rows], 1e3 * places.distance[rows]
    top = max(float(np.quantile(np.abs(values), 0.98)), 1e-3)
    order = np.argsort(np.abs(values), kind="stable")
    colours = shades(np.clip(0.5 + values[order] / (2 * top), 0, 1), _SIGNED)
    views = views_of(xyz)
    panels = []
    for view in views:
        panel = view.panel()
        panel.spots(*view.of(xyz[order]), colours)
        panels.append([panel])
    scale = colour_bar(-top, top, "A minus B along the normal [mm]", SIZE[0], _SIGNED)
    title = "Distances along normals"
    caption = Sentence(
        "{views_in_words}; {values:,} core points that were compared, colours to the "
        "98 % quantile of their sizes. Red lies further out, towards the scanner of B, "
        "in the later cloud A.",
        views_in_words=views_in_words(views),
        values=len(values),
    )
    drawing = beside(panels, title, scale)
    return Picture("motions-distances", title, drawing, caption, wide=True)


def _membership(motions: CloudMotions) -> Picture:
    """Stable area and parts by colours, with the shifts of those that moved as arrows."""
    places = motions.places
    rows = _some(len(places.distance))
    xyz, part, stable = places.xyz[rows], places.part[rows], places.stable[rows]
    colours = np.tile(_rgb(_NOTHING), (len(xyz), 1))
    colours[stable] = _rgb(_STABLE)
    for number in np.unique(part[part > 0]).tolist():
        own = part == number
        if motions.sites:
            # a site of the stable area keeps its colour
            own &= ~stable
        colours[own] = _rgb(_colour(number))
    order = np.argsort((part > 0).astype(int) * 2 + stable, kind="stable")
    views = views_of(xyz)
    moved = [
        (k, p) for k, p in enumerate(motions.parts, start=1) if p.motion is not None and p.differs
    ]
    shifts = [shift for _, p in moved if (shift := _shift(p)) is not None]
    longest = max((float(np.linalg.norm(shift)) for shift in shifts), default=0.0)
    scale = _LONGEST * float(np.ptp(xyz, axis=0).max()) / longest if longest > 0 else 0.0
    panels = []
    for view in views:
        panel = view.panel()
        panel.spots(*view.of(xyz[order]), colours[order])
        for _, one in moved[:_NAMED]:
            _draw(panel, view, one, scale)
        panels.append([panel])
    what = "site" if motions.sites else "part"
    entries = [(_STABLE, "stable area")] if stable.any() else []
    entries += [(_colour(k), f"{what} {p.name}: {p.verdict}") for k, p in moved[:_NAMED]]
    entries.append((_NOTHING, "neither"))
    title = "What moved"
    caption = f"{views_in_words(views)}; core points that were compared."
    if scale > 0:
        caption += Sentence(
            " Arrows: shift along the mean normal of what moved, where its sign is sure "
            "with 95 %, drawn {scale:0,} times as long as it is (1 mm is {by:mg2}).",
            scale=scale,
            by=0.001 * scale,
        )
    drawing = beside(panels, title, legend(entries, SIZE[0]))
    return Picture("motions-parts", title, drawing, caption, wide=True)


def _draw(panel: Chart, view: View, part: MovedPart, scale: float) -> None:
    """Name of a part at its middle, and its shift as an arrow."""
    assert part.motion is not None
    middle = part.motion.middle
    shift = _shift(part)
    (x,), (y,) = view.of(middle[None])
    if shift is not None and scale > 0:
        (a,), (b,) = view.of((middle + scale * shift)[None])
        along = np.array([a - x, b - y])
        # seen from ahead an arrow is a point
        if np.linalg.norm(along) > 0.2 * scale * float(np.linalg.norm(shift)):
            side = 0.18 * np.array([-along[1], along[0]])
            head = np.array([a, b]) - 0.35 * along
            one, two = head + side, head - side
            panel.line([x, a], [y, b], "ink", words=part.name)
            panel.line([one[0], a, two[0]], [one[1], b, two[1]], "ink")
    panel.place(float(x), float(y), part.name, "free")


def _shift(part: MovedPart) -> Array | None:
    """Shift (3,) [m] along the mean normal, where it is seen and its sign is sure."""
    motion = part.motion
    if motion is None or not motion.seen[0]:
        return None
    half = _NORMAL_95 * float(np.sqrt(max(motion.covariance[0, 0], 0.0)))
    return motion.values[0] * motion.normal if abs(float(motion.values[0])) > half else None


def _some(count: int) -> slice:
    """Every so many, that no more are drawn than show."""
    return slice(None, None, max(1, -(-count // _DRAWN)))


def _colour(number: int) -> str:
    """Of a part by its number from 1."""
    return _PARTS[(number - 1) % len(_PARTS)]


def _rgb(colour: str) -> Array:
    """Colour (3,) from 0 to 255."""
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)], dtype=float)


@dataclass(frozen=True)
class ComparedClouds(CloudComparison):
    """A comparison of two clouds, a against the reference b."""

    motions: ToldMotions | None = None  #: what moved, where it was asked for


FORM = Form("compare", ComparedClouds, 1)


def answer_of(
    names: tuple[str, str],
    found: ComparedClouds,
    beams: Sequence[str] = (),
    files: Mapping[Path, Content] | None = None,
) -> Answer:
    """The comparison as people read it."""
    a, b = names
    motions, moved = found.motions, found.motions is not None
    notes = comparison_findings(found, moved=moved)
    tables, pictures = comparison_tables(found, moved=moved), comparison_pictures(found)
    front = _front(found) if motions is None else motions_front(motions)
    said = [] if motions is None else motions_findings(motions)
    first = [] if motions is None else motions_tables(motions)
    if motions is not None:
        pictures = [one for one in pictures if one.name != PREDICTED]
        pictures = [*motions_pictures(motions), *pictures]
    quiet = Finding("Every site has enough points, and its figures are above sampling.", key="all")
    warned = [Finding(text, True, "beam") for text in beams]
    return Answer(
        "Comparison of clouds",
        f"{a} against {b}",
        front,
        found,
        FORM,
        findings=[*said, *notes] or [quiet],
        first=first,
        pictures=pictures,
        tables=tables,
        footer=Sentence(
            "A: {a}; B, the reference: {b}; limit {found.limit:mmg}. Nearest-neighbour "
            "distances are no accuracy: read them beside their floor.",
            a=a,
            b=b,
            found=found,
        ),
        # the question that was asked comes first
        terminal=[*said, *first, *tables, *warned, *(replace(one, warns=True) for one in notes)],
        files=files or {},
    )


def _front(found: CloudComparison) -> FrontPage:
    """Whether the clouds differ by what was predicted."""
    known = [s.prediction for s in found.sites if s.prediction is not None]
    enough, offsets = [p for p in known if p.enough], found.offsets
    signed = "The distances between these two clouds, with the sigmas stated here."
    if not known:
        sentence = "The stations are not known with their covariance: nothing was predicted."
        return FrontPage("none", "Measured, not judged", sentence, signed=signed)
    sort: Literal["good", "bad", "none"]
    if offsets is not None and offsets.statistic > offsets.limit:
        sort, verdict = "bad", "Farther apart than predicted"
    elif not all(p.noise_agrees for p in enough):
        sort, verdict = "bad", "Scatter not as predicted"
    elif offsets is not None and not offsets.agrees:
        sort, verdict = "none", "Nearer than predicted"
    elif enough:
        sort, verdict = "good", "As predicted"
    else:
        sort, verdict = "none", "Too few points to judge the scatter"
    sentence = "" if offsets is None else offsets_finding(offsets).words
    return FrontPage(sort, verdict, sentence, signed=signed)
