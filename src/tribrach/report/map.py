"""The map of the network: what stands where, how exactly, and what it is tied to.

East is right, north is up, in pixels of an SVG. Ellipses and difference arrows share one stated
exaggeration. A network without plan coordinates has no map.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from tribrach._types import Array
from tribrach.report.content import Ellipse, Head
from tribrach.report.labels import Label, place_labels
from tribrach.sentences import Sentence

WIDTH, MARGIN = 960.0, 56.0
LOWEST, HIGHEST = 320.0, 860.0
#: sight lines beyond this number are thinned out
MOST_SIGHTS = 6000


@dataclass(frozen=True)
class Symbol:
    """A point or station: pixels, what it is, its name."""

    x: float
    y: float
    sort: Literal["control", "check", "free", "station"]
    name: str


@dataclass(frozen=True)
class Drawn:
    """An enlarged ellipse: centre and semi-axes in pixels, SVG rotation [deg], sizes in words."""

    x: float
    y: float
    rx: float
    ry: float
    turn: float
    words: str


@dataclass(frozen=True)
class Arrow:
    """An enlarged difference at control, from the given to the adjusted place, in pixels."""

    x: float
    y: float
    dx: float
    dy: float
    words: str


@dataclass(frozen=True)
class DrawnSuspect:
    """A sight with a suspicious observation: both ends in pixels, their names, what it is."""

    x1: float
    y1: float
    x2: float
    y2: float
    ends: tuple[str, str]
    words: str


@dataclass(frozen=True)
class MapDrawing:
    """Everything to draw: sizes in pixels, one path of sight lines, scale bars in metres and mm."""

    width: float
    height: float
    sights: str
    sight_opacity: float
    suspects: tuple[DrawnSuspect, ...]
    symbols: tuple[Symbol, ...]
    ellipses: tuple[Drawn, ...]
    arrows: tuple[Arrow, ...]
    labels: tuple[Label, ...]
    unlabelled: int
    bar: float
    bar_metres: float
    exaggeration: float
    ellipse_bar: float
    ellipse_bar_metres: float

    @property
    def bar_words(self) -> str:
        """Length of the scale bar."""
        return length_words(self.bar_metres)

    @property
    def ellipse_words(self) -> str:
        """Length of the scale bar of ellipses and arrows, and how they are enlarged."""
        what = "ellipses and arrows" if self.arrows else "ellipses"
        factor = self.exaggeration
        enlarged = (
            Sentence("enlarged {factor:0,} ×", factor=factor)
            if factor >= 1
            else Sentence("reduced to 1 : {factor:0,}", factor=1 / factor)
        )
        return Sentence(
            "{length} for {what} ({enlarged})",
            length=length_words(self.ellipse_bar_metres),
            what=what,
            enlarged=enlarged,
        )


def round_down(value: float) -> float:
    """The largest of 1, 2, 5 times a power of ten that is not above a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    return max(k * power for k in (1.0, 2.0, 5.0) if k * power <= value * (1 + 1e-12))


def length_words(metres: float) -> str:
    """A length in the unit that suits its size."""
    for factor, unit in ((1000.0, "km"), (1.0, "m"), (0.001, "mm")):
        if metres >= factor * 0.999:
            return Sentence(f"{{metres:{unit}g}}", metres=metres)
    return Sentence("{size:g} µm", size=metres * 1e6)


def network_map(content: Head) -> MapDrawing | None:
    """The map; None if fewer than two positions have plan coordinates."""
    symbols, ellipses = _positions(content)
    if len(symbols) < 2:
        return None
    frame = MapFrame(np.array([[s.x, s.y] for s in symbols]))
    pixel = frame.pixel(np.array([[s.x, s.y] for s in symbols]))
    placed = [
        Symbol(x, y, s.sort, s.name) for s, (x, y) in zip(symbols, pixel.tolist(), strict=True)
    ]
    where = {s.name: (s.x, s.y) for s in placed}
    exaggeration = _exaggeration([e for e in ellipses if e], pixel, frame.scale)
    size = frame.scale * exaggeration
    radius = [e.major * size if e else 0.0 for e in ellipses]
    items = [(s.x, s.y, s.name, s.sort, r) for s, r in zip(placed, radius, strict=True)]
    labels = place_labels(items, frame.width, frame.height)
    bar = round_down(0.22 * frame.width / frame.scale)
    small = round_down(60.0 / size) if exaggeration else 0.0
    return MapDrawing(
        width=frame.width,
        height=frame.height,
        sights=_sights(content, where),
        sight_opacity=round(min(0.6, 10.0 / math.sqrt(len(content.sights) + 1)), 2),
        suspects=_suspects(content, where),
        symbols=tuple(sorted(placed, key=lambda s: s.sort != "free")),
        ellipses=_drawn(placed, ellipses, size) if exaggeration else (),
        arrows=_arrows(content, where, size) if exaggeration else (),
        labels=labels,
        unlabelled=len(placed) - len(labels),
        bar=bar * frame.scale,
        bar_metres=bar,
        exaggeration=exaggeration,
        ellipse_bar=small * size,
        ellipse_bar_metres=small,
    )


class MapFrame:
    """Metres to pixels: one scale, the network centred, the height as the network needs."""

    def __init__(self, xy: Array) -> None:
        low, high = xy.min(axis=0), xy.max(axis=0)
        extent = np.maximum(high - low, 1e-9 + 1e-3 * (high - low).max())
        room = np.array([WIDTH, HIGHEST]) - 2 * MARGIN
        self.scale = float((room / extent).min())
        self.width = WIDTH
        self.height = float(np.clip(extent[1] * self.scale + 2 * MARGIN, LOWEST, HIGHEST))
        self._centre = (low + high) / 2

    def pixel(self, xy: Array) -> Array:
        """Pixels (n, 2), y downwards, of E, N (n, 2)."""
        half = np.array([self.width, self.height]) / 2
        out: Array = half + (xy - self._centre) * self.scale * np.array([1.0, -1.0])
        return np.round(out, 2)


def _positions(content: Head) -> tuple[list[Symbol], list[Ellipse | None]]:
    """Points and stations with plan coordinates, x and y still E and N in metres."""
    symbols, ellipses = [], []
    for point in content.points:
        east, north, _ = point.xyz
        if east is not None and north is not None:
            symbols.append(Symbol(east, north, point.role, point.name))
            ellipses.append(point.ellipse)
    for station in content.stations:
        east, north, _ = station.xyz
        if east is not None and north is not None:
            symbols.append(Symbol(east, north, "station", station.name))
            ellipses.append(station.ellipse)
    return symbols, ellipses


def _exaggeration(ellipses: list[Ellipse], pixel: Array, scale: float) -> float:
    """Enlargement (1, 2, 5 times a power of ten) that lets ellipses show but hardly overlap."""
    major = np.array([e.major for e in ellipses if e.major > 0])
    if len(major) == 0:
        return 0.0
    nearest = np.asarray(cKDTree(pixel).query(pixel, k=2)[0])[:, 1]
    least = 10.0 if len(pixel) < 200 else 4.0
    room = float(np.clip(0.45 * np.median(nearest), least, 46.0))
    return round_down(room / (float(np.quantile(major, 0.8)) * scale))


def _drawn(symbols: list[Symbol], ellipses: list[Ellipse | None], size: float) -> tuple[Drawn, ...]:
    """Enlarged ellipses; an azimuth from north is a turn from the right by 90 deg less."""
    return tuple(
        Drawn(
            s.x,
            s.y,
            round(e.major * size, 2),
            round(e.minor * size, 2),
            round(math.degrees(e.azimuth) - 90, 2),
            Sentence("{s.name}: {e.major:mm2~} x {e.minor:mm2}", s=s, e=e),
        )
        for s, e in zip(symbols, ellipses, strict=True)
        if e is not None
    )


def _arrows(content: Head, where: dict[str, tuple[float, float]], size: float) -> tuple[Arrow, ...]:
    """Differences of control and check points, enlarged like the ellipses."""
    out = []
    for c in content.control:
        east, north, _ = c.difference
        if (
            c.name in where
            and c.use in ("weighted", "check")
            and east is not None
            and north is not None
        ):
            words = Sentence(
                "{c.name}: adjusted - given E {east:mm1}, N {north:mm1}",
                c=c,
                east=east,
                north=north,
            )
            out.append(Arrow(*where[c.name], round(east * size, 2), round(-north * size, 2), words))
    return tuple(out)


def _sights(content: Head, where: dict[str, tuple[float, float]]) -> str:
    """One SVG path with all lines, evenly thinned out where there are too many."""
    pairs = [(where[a], where[b]) for a, b in content.sights if a in where and b in where]
    step = math.ceil(len(pairs) / MOST_SIGHTS) or 1
    return "".join(f"M{a[0]:.1f} {a[1]:.1f}L{b[0]:.1f} {b[1]:.1f}" for a, b in pairs[::step])


#: suspicious sights that a plan shows
_MOST_SUSPECTS = 200


def _suspects(content: Head, where: dict[str, tuple[float, float]]) -> tuple[DrawnSuspect, ...]:
    """Sights with a suspicious observation, each once with its largest test value."""
    observations = content.observations
    chosen = observations.chosen(observations.column("suspicious").astype(bool))
    order = np.argsort(-np.abs(np.nan_to_num(chosen.column("w"))), kind="stable")
    out: dict[tuple[str, str], DrawnSuspect] = {}
    for o in chosen.chosen(order):
        ends = o.start, o.end
        if ends in out or o.start not in where or o.end not in where:
            continue
        size = "" if math.isnan(o.w) else Sentence(", w {o.w:1}", o=o)
        words = Sentence(
            "{kind} {o.start} to {o.end}{size}", kind=o.kind.replace("_", " "), o=o, size=size
        )
        out[ends] = DrawnSuspect(*where[o.start], *where[o.end], ends, words)
        if len(out) == _MOST_SUSPECTS:
            break
    return tuple(out.values())
