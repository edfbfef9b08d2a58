"""The clouds in space on the first page: a still picture of what the workbench shows.

A thin sample of the points is drawn from the south-west and from above, nearer points before those
behind them, in the colours of their 3D sigma; over it stations, points of the network and their
ellipsoids at the confidence, larger by a factor that the caption names. Parallel projection, so
that lengths along one axis are alike everywhere.
"""

from __future__ import annotations

import base64
import io
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from tribrach._types import Array
from tribrach.report.characters import visible
from tribrach.report.figures import Picture
from tribrach.statistics import chi2

if TYPE_CHECKING:
    from tribrach.job.steps import PlacedScans
    from tribrach.report.content import Report

__all__ = ["still_picture"]

#: pixels of the picture, of its margin, and of the square that a point covers
_WIDTH, _HEIGHT, _MARGIN = 960, 480, 34
_SPLAT = 4
#: the eye stands so far round from north and so high over the horizon [degrees]
_FROM, _ABOVE = 215.0, 28.0
#: points further out on either side than this share of them do not make the picture smaller
_OUTSIDE = 0.01
#: the median ellipsoid is drawn this large [pixels]
_SHOWN = 16.0
#: names that are written at most
_NAMES = 60
#: shares of the points that lie below the ends of the colours
_COLOURS = (0.05, 0.95)
_BACK, _INK, _STATION = (255, 255, 255), (30, 34, 40), (20, 20, 24)
_ROLES = {"control": (200, 40, 40), "check": (30, 120, 60), "free": (40, 70, 170)}
#: viridis at its tenths
_SCALE = np.array(
    [
        [68, 1, 84], [72, 36, 117], [65, 68, 135], [53, 95, 141], [42, 120, 142], [33, 145, 140],
        [34, 168, 132], [68, 191, 112], [122, 209, 81], [189, 223, 38], [253, 231, 37],
    ],
    dtype=float,
)  # fmt: skip


def still_picture(content: Report) -> Picture | None:
    """The picture; None where there are no clouds with sigmas.

    Parameters
    ----------
    content
        The report.
    """
    placed = content.job.placed
    if placed is None:
        return None
    sample = np.concatenate([np.zeros((0, 4)), *(p.summary.sample for p in placed.products)])
    if len(sample) < 2 or not np.isfinite(sample).all():
        return None
    view = _View(sample[:, :3], _upright(placed))
    low, high = np.quantile(sample[:, 3], _COLOURS)
    image = _points(view, sample, low, high)
    factor = _over(content, placed, view, image)
    _legend(image, low, high)
    out = io.BytesIO()
    image.save(out, "WEBP", quality=60, method=4)
    total = sum(product.summary.points for product in placed.products)
    caption = (
        f"{len(sample):,} of {total:,} points from the south-west and above, coloured by their 3D "
        f"sigma; stations (triangles), points (control red, check green, others blue) with their "
        f"{content.percent} ellipsoids, {factor:,.0f} times as large as they are."
    )
    return Picture(
        "still", "The clouds in space", base64.b64encode(out.getvalue()).decode("ascii"), caption
    )


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

    points : (n, 3) that should be in it; upright : (3, 3) their axes to east, north, up.
    """

    def __init__(self, points: Array, upright: Array) -> None:
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


def _colour(values: Array, low: float, high: float) -> Array:
    """Colours (n, 3) of values (n,)."""
    at = np.clip((values - low) / max(high - low, 1e-12), 0, 1) * (len(_SCALE) - 1)
    steps = np.arange(len(_SCALE))
    return np.stack([np.interp(at, steps, _SCALE[:, k]) for k in range(3)], axis=1)


def _points(view: _View, sample: Array, low: float, high: float) -> Any:
    """Points before a white ground, edges of what is nearer darkened."""
    places, colours = view(sample[:, :3]), _colour(sample[:, 3], low, high)
    corner = np.floor(places[:, :2] - _SPLAT / 2).astype(np.int64)
    order = np.argsort(places[:, 2], kind="stable")
    pixels = np.full((_HEIGHT, _WIDTH, 3), _BACK, dtype=float)
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
    images = import_module("PIL.Image")
    shade = _edges(depth, float(np.ptp(places[:, 2])))
    return images.fromarray(np.clip(pixels * shade[:, :, None], 0, 255).astype(np.uint8))


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


def _over(content: Report, placed: PlacedScans, view: _View, image: Any) -> float:
    """Draw stations, points and ellipsoids; by what ellipsoids are larger than they are."""
    draw = import_module("PIL.ImageDraw").Draw(image)
    font = import_module("PIL.ImageFont").load_default(13)
    frame, names = placed.frame, []
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
    circle = np.linspace(0, 2 * np.pi, 49)
    round_about = np.stack([np.cos(circle), np.sin(circle)], axis=1)
    places = view(frame.from_work(xyz)) if len(xyz) else np.zeros((0, 3))
    for point, place, half in zip(known, places, halves, strict=True):
        colour = _ROLES[point.role]
        line = place[:2] + factor * round_about @ half
        draw.line([tuple(p) for p in line.tolist()], fill=colour, width=2)
        x, y = place[:2].tolist()
        draw.ellipse((x - 2, y - 2, x + 2, y + 2), fill=colour)
        names.append((x, y, point.name, colour))
    for where in {p.station: p for p in placed.placements.values()}.values():
        at = where.delivered(frame).pose.translation
        x, y = view(at[None])[0, :2].tolist()
        draw.polygon([(x, y - 7), (x - 6, y + 5), (x + 6, y + 5)], fill=_STATION, outline=_BACK)
        names.insert(0, (x, y, where.station, _STATION))
    for x, y, name, colour in names[:_NAMES]:
        text = visible(name)[:24]
        draw.text((x + 8, y - 14), text, colour, font, stroke_width=2, stroke_fill=_BACK)
    return factor


def _round(value: float) -> float:
    """1, 2 or 5 times a power of ten, at least 1."""
    power = 10.0 ** np.floor(np.log10(max(value, 1.0)))
    return float(max(step * power for step in (1, 2, 5) if step * power <= max(value, 1.0)))


def _legend(image: Any, low: float, high: float) -> None:
    """The colours with their ends in millimetres, in the lower left corner."""
    draw = import_module("PIL.ImageDraw").Draw(image)
    font = import_module("PIL.ImageFont").load_default(13)
    left, top, width = 14, _HEIGHT - 24, 180
    for k, colour in enumerate(_colour(np.linspace(0, 1, width), 0.0, 1.0)):
        draw.line((left + k, top, left + k, top + 10), fill=tuple(int(c) for c in colour))
    words = {"lb": f"{1e3 * low:.1f}", "rb": f"{1e3 * high:.1f} mm"}
    for anchor, text in words.items():
        x = left if anchor[0] == "l" else left + width
        draw.text((x, top - 3), text, _INK, font, anchor, stroke_width=2, stroke_fill=_BACK)
    draw.text((left + width + 12, top + 10), "3D sigma", _INK, font, "lb",
              stroke_width=2, stroke_fill=_BACK)  # fmt: skip
