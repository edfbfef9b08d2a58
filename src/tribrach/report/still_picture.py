"""The clouds in space on the first page: a still picture of what the workbench shows.

A thin sample of the points is drawn from the south-west and from above, nearer points before those
behind them, in the colours of their 3D sigma, without a ground of its own; over it stations, points
of the network and their ellipsoids at the confidence, with the symbols of the plan, larger by a
factor that the caption names. Parallel projection, so that lengths along one axis are alike
everywhere.
"""

from __future__ import annotations

import base64
import io
import math
from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Array
from tribrach.report.charts import Drawing, DrawnMark, colour_bar, mark, shades, symbol
from tribrach.report.figures import Picture
from tribrach.report.labels import Item, place_labels
from tribrach.sentences import Sentence
from tribrach.statistics import chi2

if TYPE_CHECKING:
    from tribrach.job.steps import PlacedScans
    from tribrach.report.content import Report

#: pixels of the picture, of its margin, and of the square that a point covers
_WIDTH, _HEIGHT, _MARGIN = 960, 480, 34
_SPLAT = 4
#: the eye stands so far round from north and so high over the horizon [degrees]
_FROM, _ABOVE = 215.0, 28.0
#: points further out on either side than this share of them do not make the picture smaller
_OUTSIDE = 0.01
#: stations and points of the network make it no smaller than this; those farther out are left out
_SMALLER = 0.6
#: the median ellipsoid is drawn this large [pixels]
_SHOWN = 16.0
#: shares of the points that lie below the ends of the colours
_COLOURS = (0.05, 0.95)
_NONE = np.zeros((0, 3))


def still_picture(content: Report) -> Picture | None:
    """The picture; None where there are no clouds with sigmas."""
    placed = content.job.placed
    if placed is None:
        return None
    sample = np.concatenate([np.zeros((0, 4)), *(p.summary.sample for p in placed.products)])
    if len(sample) < 2 or not np.isfinite(sample).all():
        return None
    view = _View(sample[:, :3], _upright(placed), _places(content, placed))
    low, high = np.quantile(sample[:, 3], _COLOURS)
    image = _points(view, sample, low, high)
    marks, factor, outside = _over(content, placed, view)
    scale, high_bar = colour_bar(1e3 * low, 1e3 * high, "3D sigma [mm]", _WIDTH)
    below = mark("g", inner=[scale], transform=f"translate(0 {_HEIGHT + 8})")
    total = sum(product.summary.points for product in placed.products)
    caption = Sentence(
        "{sample:,} of {total:,} points from the south-west and above, coloured by "
        "their 3D sigma; stations and points as in the plan, with their "
        "{content.percent} ellipsoids, {factor:0,} times as large as they are{without}.",
        sample=len(sample),
        total=total,
        content=content,
        factor=factor,
        without=f", without {outside} farther out" if outside else "",
    )
    title = "The clouds in space"
    ground = mark("rect", width=_WIDTH, height=_HEIGHT, class_="ground")
    drawing = Drawing(
        _WIDTH, _HEIGHT + 8 + high_bar, (ground, image, *marks, below), title, "still"
    )
    return Picture("still", title, drawing, caption, wide=True)


def _upright(placed: PlacedScans) -> Array:
    """Axes of the clouds' coordinates to east, north, up."""
    frame = placed.frame
    if frame.kind != "ecef":
        return np.eye(3)
    middle = np.mean([p.pose.translation for p in placed.placements.values()], axis=0)
    axes: Array = frame.work.site.axes(middle[None])[0]
    turned: Array = axes @ frame.rotation(middle).T
    return turned


class _View:
    """From coordinates of the clouds to the picture, in parallel.

    points : (n, 3) that should be in it; upright : (3, 3) their axes to east, north, up; others :
    (m, 3) that should be in it where that makes it little smaller.
    """

    def __init__(self, points: Array, upright: Array, others: Array = _NONE) -> None:
        azimuth, above = np.radians(_FROM), np.radians(_ABOVE)
        # east, north, up: towards the eye, to the right, upwards in the picture
        eye = np.array(
            [np.sin(azimuth) * np.cos(above), np.cos(azimuth) * np.cos(above), np.sin(above)]
        )
        right = np.array([-np.cos(azimuth), np.sin(azimuth), 0.0])
        self.origin = points.mean(axis=0)
        self.axes = np.stack([right, np.cross(eye, right), eye]) @ upright
        seen = (points - self.origin) @ self.axes[:2].T
        low, high = np.quantile(seen, [_OUTSIDE, 1 - _OUTSIDE], axis=0)
        room = np.array([_WIDTH, _HEIGHT]) - 2 * _MARGIN
        self.scale = float((room / np.maximum(high - low, 1e-3)).min())
        beside = np.concatenate([(others - self.origin) @ self.axes[:2].T, [low, high]])
        least, most = beside.min(axis=0), beside.max(axis=0)
        whole = float((room / np.maximum(most - least, 1e-3)).min())
        if whole >= _SMALLER * self.scale:
            low, high, self.scale = least, most, whole
        self.middle = (low + high) / 2

    def __call__(self, points: Array) -> Array:
        """Column, row and nearness (n, 3) of points (n, 3)."""
        seen = (points - self.origin) @ self.axes.T
        out: Array = np.empty_like(seen)
        out[:, 0] = _WIDTH / 2 + (seen[:, 0] - self.middle[0]) * self.scale
        out[:, 1] = _HEIGHT / 2 - (seen[:, 1] - self.middle[1]) * self.scale
        out[:, 2] = seen[:, 2]
        return out

    def outline(self, covariance: Array) -> Array:
        """Half axes (2, 2) [pixels] of the outline of an ellipsoid, by its covariance [m^2]."""
        flat = self.axes[:2] @ covariance @ self.axes[:2].T
        values, vectors = np.linalg.eigh(flat)
        half: Array = (vectors * np.sqrt(np.maximum(values, 0.0))).T * self.scale
        half[:, 1] *= -1
        return half


def _points(view: _View, sample: Array, low: float, high: float) -> DrawnMark:
    """Points, edges of what is nearer darkened; between them nothing."""
    places = view(sample[:, :3])
    colours = shades(np.clip((sample[:, 3] - low) / max(high - low, 1e-12), 0, 1))
    corner = np.floor(places[:, :2] - _SPLAT / 2).astype(np.int64)
    order = np.argsort(places[:, 2], kind="stable")
    pixels = np.zeros((_HEIGHT, _WIDTH, 3))
    depth = np.full((_HEIGHT, _WIDTH), -np.inf)
    for dx in range(_SPLAT):
        for dy in range(_SPLAT):
            x, y = (corner[order] + [dx, dy]).T
            inside = (x >= 0) & (x < _WIDTH) & (y >= 0) & (y < _HEIGHT)
            x, y, which = x[inside], y[inside], order[inside]
            # of several in one pixel the last, the nearest, stays
            flat = np.full(_HEIGHT * _WIDTH, -1)
            flat[y * _WIDTH + x] = which
            hit = np.flatnonzero(flat >= 0)
            nearer = places[flat[hit], 2] > depth.ravel()[hit]
            hit = hit[nearer]
            depth.ravel()[hit] = places[flat[hit], 2]
            pixels.reshape(-1, 3)[hit] = colours[flat[hit]]
    from PIL import Image

    shade = _edges(depth, float(np.ptp(places[:, 2])))
    colour = np.clip(pixels * shade[:, :, None], 0, 255)
    drawn = np.where(np.isfinite(depth), 255.0, 0.0)[:, :, None]
    picture = np.concatenate([colour, drawn], axis=2).astype(np.uint8)
    out = io.BytesIO()
    Image.fromarray(picture, "RGBA").save(out, "WEBP", quality=60, method=4)
    data = base64.b64encode(out.getvalue()).decode("ascii")
    return mark(
        "image", width=_WIDTH, height=_HEIGHT, preserveAspectRatio="none",
        href=f"data:image/webp;base64,{data}",
    )  # fmt: skip


def _edges(depth: Array, extent: float) -> Array:
    """Factors (rows, columns) that darken what has something nearer beside it."""
    unit = max(extent, 1e-3) / 40
    behind = np.zeros_like(depth)
    filled = np.where(np.isfinite(depth), depth, -1e9)
    for shift in ((0, _SPLAT), (0, -_SPLAT), (_SPLAT, 0), (-_SPLAT, 0)):
        other = np.roll(filled, shift, axis=(0, 1))
        behind += np.clip((other - filled) / unit, 0, 1)
    dark: Array = np.where(np.isfinite(depth), 1.0 - 0.11 * behind, 1.0)
    return dark


def _places(content: Report, placed: PlacedScans) -> Array:
    """Stations and known points of the network (m, 3) in the frame of the clouds."""
    frame = placed.frame
    known = [p.xyz for p in content.points if None not in p.xyz]
    xyz = np.array(known, dtype=float).reshape(-1, 3)
    stations = [p.delivered(frame).pose.translation for p in placed.placements.values()]
    placed_at = np.array(stations, dtype=float).reshape(-1, 3)
    return np.concatenate([frame.from_work(xyz) if len(xyz) else _NONE, placed_at])


def _inside(x: float, y: float) -> bool:
    """Is there room for a symbol?"""
    return 8 <= x <= _WIDTH - 8 and 8 <= y <= _HEIGHT - 8


def _over(content: Report, placed: PlacedScans, view: _View) -> tuple[list[DrawnMark], float, int]:
    """Stations, points and ellipsoids; by what ellipsoids are larger; how many lie outside."""
    frame, outside = placed.frame, 0
    known = [p for p in content.points if None not in p.xyz]
    xyz = np.array([p.xyz for p in known], dtype=float).reshape(-1, 3)
    blocks = [np.array(p.covariance, dtype=float) for p in known]
    turns = [frame.rotation(x) for x in xyz]
    quantile = float(np.sqrt(chi2.ppf(content.settings.confidence, 3)))
    halves = [
        quantile * view.outline(turn @ block @ turn.T)
        for turn, block in zip(turns, blocks, strict=True)
    ]
    sizes = [float(np.linalg.norm(half, axis=1).max()) for half in halves]
    factor = _round(_SHOWN / max(float(np.median(sizes)), 1e-9)) if sizes else 1.0
    places = view(frame.from_work(xyz)) if len(xyz) else np.zeros((0, 3))
    marks, names = [], list[Item]()
    for point, place, half in zip(known, places, halves, strict=True):
        x, y = place[:2].tolist()
        if not _inside(x, y):
            outside += 1
            continue
        long, short = factor * np.linalg.norm(half, axis=1)
        turn = math.degrees(math.atan2(half[0, 1], half[0, 0]))
        marks.append(
            mark("ellipse", rx=float(long), ry=float(short), class_="ellipse",
                 transform=f"translate({x:.1f} {y:.1f}) rotate({turn:.1f})")
        )  # fmt: skip
        marks.append(symbol(x, y, point.name, point.role))
        names.append((x, y, point.name, point.role, 0.5 * float(short)))
    for where in {p.station: p for p in placed.placements.values()}.values():
        at = where.delivered(frame).pose.translation
        x, y = view(at[None])[0, :2].tolist()
        if not _inside(x, y):
            outside += 1
            continue
        marks.append(symbol(x, y, where.station, "station"))
        names.append((x, y, where.station, "station", 0.0))
    marks += [
        mark("text", label.text, x=label.x, y=label.y, class_=f"label {label.sort}")
        for label in place_labels(names, _WIDTH, _HEIGHT)
    ]
    return marks, factor, outside


def _round(value: float) -> float:
    """1, 2 or 5 times a power of ten, at least 1."""
    power = 10.0 ** np.floor(np.log10(max(value, 1.0)))
    return float(max(step * power for step in (1, 2, 5) if step * power <= max(value, 1.0)))
