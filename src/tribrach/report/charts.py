"""Charts of few marks as drawings that a page holds as they are: sharp, dark where the page is
dark, and every mark says its numbers when it is pointed at. Clouds of very many points are drawn
as pictures without a background inside of them.
"""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.report.labels import Item, place_labels
from tribrach.sentences import Sentence

#: classes of colours in the style sheet: ``s0`` to ``s11``
PALETTE = 12
_LEFT, _RIGHT, _TOP, _BOTTOM = 62.0, 14.0, 26.0, 44.0
#: size of a chart that takes half the width of a page: with one size for all, letters of charts
#: that stand beside each other are alike
HALF = (560.0, 390.0)
#: size of a letter in pixels
_LETTER = 6.2
#: stops of colours, evenly spaced from low to high: dark blue to yellow
LEVELS = np.array(
    [
        [68, 1, 84], [72, 40, 120], [62, 73, 137], [49, 104, 142], [38, 130, 142],
        [31, 158, 137], [53, 183, 121], [110, 206, 88], [181, 222, 43], [253, 231, 37],
    ],
    dtype=float,
)  # fmt: skip
#: from -1 by way of 0 to 1: blue, nearly white, red
SIGNED = np.array(
    [[33, 102, 172], [103, 169, 207], [209, 229, 240], [247, 247, 247], [253, 219, 199],
     [239, 138, 98], [178, 24, 43]],
    dtype=float,
)  # fmt: skip
#: well within its limit to well beyond: green, yellow in the middle, red
TESTED = np.array(
    [[26, 122, 72], [102, 189, 99], [190, 215, 110], [245, 222, 110], [250, 174, 97],
     [226, 92, 61], [165, 20, 38]],
    dtype=float,
)  # fmt: skip
#: cells of a table of numbers that are drawn one by one, each with what it says
_MOST_CELLS = 1500
#: words of a legend may become that much larger on paper, as the style sheet has it
_LARGER = 1.25
#: more points than these are drawn small
_MANY_SPOTS = 2000
#: cells nearer than this share to an end of the colours have white numbers
_STRONG = 0.12


@dataclass(frozen=True)
class DrawnMark:
    """An element of a drawing."""

    tag: str  #: of the element, in SVG
    attributes: tuple[tuple[str, str], ...]  #: names of attributes with their values
    text: str = ""  #: its words
    title: str = ""  #: what it says when it is pointed at
    inner: tuple[DrawnMark, ...] = ()  #: what it holds


@dataclass(frozen=True)
class Drawing:
    """What a page draws by itself: its size in pixels, its marks, and in words what it is."""

    width: float
    height: float
    marks: tuple[DrawnMark, ...]
    words: str
    sort: str = "chart"


def mark(
    tag: str,
    text: str = "",
    title: str = "",
    inner: Sequence[DrawnMark] = (),
    **attributes: float | str,
) -> DrawnMark:
    """An element by its attributes; ``class_`` stands for class, numbers have two digits."""
    given = tuple(
        (
            key.rstrip("_").replace("_", "-"),
            value if isinstance(value, str) else f"{value:.2f}".rstrip("0").rstrip("."),
        )
        for key, value in attributes.items()
    )
    return DrawnMark(tag, given, text, title, tuple(inner))


def symbol(x: float, y: float, name: str, sort: str) -> DrawnMark:
    """Symbol of a control, check or free point, a station (hollow if loose) or a ring."""
    shape = {
        "station": mark("path", d="M0 -5.5L5.5 0L0 5.5L-5.5 0z"),
        "loose": mark("path", d="M0 -5.5L5.5 0L0 5.5L-5.5 0z"),
        "free": mark("circle", r=2.8),
        "ring": mark("circle", r=8),
    }.get(sort, mark("path", d="M0 -6.5L5.8 4.2L-5.8 4.2z"))
    place = f"translate({x:.2f} {y:.2f})"
    return mark("g", title=name, inner=[shape], transform=place, class_=sort)


def _known(**attributes: str) -> dict[str, Any]:
    """Attributes that have a value."""
    return {key: value for key, value in attributes.items() if value}


def nice_ticks(low: float, high: float, most: int = 6) -> list[float]:
    """Round numbers from low to high: steps of 1, 2 or 5 times a power of ten, at most ``most``."""
    span = high - low
    if not span > 0 or not math.isfinite(span):
        return [low]
    power = 10.0 ** math.floor(math.log10(span / most))
    step = next(k * power for k in (1, 2, 5, 10, 20) if span / (k * power) <= most)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [k * step + 0.0 for k in range(first, last + 1)]


def _tick(value: float) -> str:
    """The number at a tick."""
    return Sentence("{value:g10}", value=value)


def _log_ticks(low: float, high: float) -> list[float]:
    """Ticks of a logarithmic axis: 1, 2 and 5 times powers of ten, fewer over many powers."""
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    steps = (1, 2, 5) if len(powers) <= 4 else (1,)
    ticks = [k * 10.0**p for p in powers for k in steps]
    return [tick for tick in ticks if low <= tick * (1 + 1e-9) and tick <= high * (1 + 1e-9)]


def shade(share: float, scale: Array = LEVELS) -> str:
    """The colour of a share from 0 to 1 between low and high, as a page writes it."""
    r, g, b = np.round(shades(np.array([share]), scale)[0]).astype(int).tolist()
    return f"#{r:02x}{g:02x}{b:02x}"


def shades(shares: Array, scale: Array = LEVELS) -> Array:
    """Colours (..., 3) from 0 to 255 of shares (...); beyond the ends those of the ends."""
    at = np.linspace(0, 1, len(scale))
    return np.stack([np.interp(shares, at, scale[:, k]) for k in range(3)], axis=-1)


class Chart:
    """A panel with two axes; marks are added one after the other.

    ``log`` names the logarithmic axes ("", "x", "y", "xy"). With ``equal`` both axes have one
    scale, and the panel gets as high as that needs, up to ``size``. ``names`` and ``rows`` stand at
    0, 1, 2 of the axes instead of numbers, the first row on top; ``ticks`` are values and words of
    the lower axis.
    """

    def __init__(
        self,
        x: tuple[float, float],
        y: tuple[float, float],
        labels: tuple[str, str],
        size: tuple[float, float] = (460.0, 300.0),
        title: str = "",
        *,
        log: Literal["", "x", "y", "xy"] = "",
        equal: bool = False,
        names: Sequence[str] | None = None,
        rows: Sequence[str] | None = None,
        ticks: Sequence[tuple[float, str]] | None = None,
    ) -> None:
        self._log, self._given = log, ticks
        self.x, self.y = _ends(x, log="x" in log), _ends(y, log="y" in log)
        self._labels, self._title, self._names = labels, title, names
        self.width, self.height = size
        self._rows = rows
        self._left = max([_LEFT, *(len(row) * _LETTER + 30.0 for row in rows or ())])
        longest = max((len(name) for name in names or ()), default=0)
        self._slanted = names is not None and longest * _LETTER > (
            (self.width - self._left - _RIGHT) / max(len(names), 1) - 4
        )
        if names and self._slanted:
            # the first name begins left of the panel
            slot = (self.width - self._left - _RIGHT) / len(names)
            self._left = max(self._left, 0.77 * _LETTER * len(names[0]) - slot / 2 + 12.0)
        slant = longest * _LETTER * 0.64 - 8 if self._slanted else 0.0
        self._bottom = _BOTTOM + max(slant, 0.0) - (14.0 if not labels[0] else 0.0)
        self._top = _TOP if title else 10.0
        room = self.width - self._left - _RIGHT, self.height - self._top - self._bottom
        if equal:
            spans = self.x[1] - self.x[0], self.y[1] - self.y[0]
            scale = min(room[0] / spans[0], room[1] / spans[1])
            least = 60.0
            high = max(scale * spans[1], least)
            self.height = high + self._top + self._bottom
            # the axes reach as far as the panel does
            self.x, self.y = _about(self.x, room[0] / scale), _about(self.y, high / scale)
        self._marks: list[DrawnMark] = []
        self._ground = False
        self._names_beside: list[Item] = []

    def across(self, value: float) -> float:
        """Pixels from the left."""
        low, high = self.x
        if "x" in self._log:
            low, high, value = (math.log10(v) for v in (low, high, max(value, 1e-300)))
        room = self.width - self._left - _RIGHT
        return round(self._left + (value - low) / (high - low) * room, 2)

    def up(self, value: float) -> float:
        """Pixels from the top."""
        low, high = self.y
        if "y" in self._log:
            low, high, value = (math.log10(v) for v in (low, high, max(value, 1e-300)))
        room = self.height - self._top - self._bottom
        return round(self.height - self._bottom - (value - low) / (high - low) * room, 2)

    def points(
        self, x: Sequence[float] | Array, y: Sequence[float] | Array, words: Sequence[str],
        colour: str = "mark",
    ) -> None:  # fmt: skip
        """Discs, each with what it says."""
        for a, b, text in zip(x, y, words, strict=True):
            at = self.across(a), self.up(b)
            self._marks.append(mark("circle", title=text, cx=at[0], cy=at[1], r=3, class_=colour))

    def dots(self, x: Sequence[float] | Array, y: Sequence[float] | Array, colour: str) -> None:
        """Many small discs of one colour; those beyond the ends of the axes are left out."""
        inside = [
            (self.across(a), self.up(b))
            for a, b in zip(x, y, strict=True)
            if self.x[0] <= a <= self.x[1] and self.y[0] <= b <= self.y[1]
        ]
        d = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in inside)
        if d:
            self._marks.append(mark("path", d=d, class_=f"dots {colour}"))

    def place(
        self, x: float, y: float, name: str, sort: Literal["station", "loose", "free", "ring"]
    ) -> None:
        """A station (loose: hollow), a point or a ring about a place, its name beside it."""
        at = self.across(x), self.up(y)
        self._marks.append(symbol(*at, name, sort))
        if name:
            self._names_beside.append((*at, name, sort, 8.0 if sort == "ring" else 0.0))

    def line(
        self, x: Sequence[float] | Array, y: Sequence[float] | Array, colour: str = "s0",
        *, dashed: bool = False, words: str = "",
    ) -> None:  # fmt: skip
        """A line through points; ``colour`` is a class of the style sheet or one like #1a7a48."""
        own = colour.startswith("#")
        sort = " ".join(["line"] + [colour] * (not own) + ["dashed"] * dashed)
        style = f"stroke: {colour}" if own else ""
        self._marks.append(
            mark("path", title=words, d=self._path(x, y), class_=sort, **_known(style=style))
        )

    def area(self, x: Sequence[float] | Array, y: Sequence[float] | Array, colour: str) -> None:
        """A filled polygon, faint."""
        self._marks.append(mark("path", d=f"{self._path(x, y)}Z", class_=f"area {colour}"))

    def _path(self, x: Sequence[float] | Array, y: Sequence[float] | Array) -> str:
        """A path through points."""
        places = (f"{self.across(a)} {self.up(b)}" for a, b in zip(x, y, strict=True))
        return "M" + "L".join(places)

    def bar(
        self, left: float, right: float, low: float, high: float, colour: str, words: str
    ) -> None:
        """A block from left to right and from low to high."""
        a, b = self.across(left), self.across(right)
        top, base = self.up(high), self.up(low)
        if base - top < 0.02:
            return
        self._marks.append(
            mark(
                "rect", title=words, x=a, y=top, width=b - a, height=base - top,
                class_=f"bar-{colour}",
            )
        )  # fmt: skip

    def name(self, x: float, y: float, text: str) -> None:
        """A name right above a place."""
        at = self.across(x) + 7, self.up(y) - 6
        self._marks.append(mark("text", text, x=at[0], y=at[1], class_="label"))

    def note(self, x: float, y: float, text: str) -> None:
        """Words about a place."""
        self._marks.append(mark("text", text, x=self.across(x), y=self.up(y), class_="note-end"))

    def cloud(self, x: Array, y: Array, shares: Array, scale: Array = LEVELS) -> None:
        """Very many points, coloured by shares from 0 to 1; the largest lies on top."""
        order = np.argsort(shares, kind="stable")
        # the darkest of these colours would hardly be seen on a dark page
        self._ground = scale is LEVELS
        self.spots(x[order], y[order], shades(np.clip(shares[order], 0, 1), scale))

    def spots(self, x: Array, y: Array, colours: Array) -> None:
        """Very many points (n,) with colours (n, 3) from 0 to 255; the last lies on top."""
        zoom = 2
        left, right = self.across(self.x[0]), self.across(self.x[1])
        top, base = self.up(self.y[1]), self.up(self.y[0])
        columns, rows = int((right - left) * zoom), int((base - top) * zoom)
        picture = np.zeros((rows, columns, 4), dtype=np.uint8)
        column = (x - self.x[0]) / (self.x[1] - self.x[0]) * (columns - 1)
        row = (self.y[1] - y) / (self.y[1] - self.y[0]) * (rows - 1)
        # few points would hardly be seen as small as many have to be
        side = 3 if len(x) > _MANY_SPOTS else 9
        inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        # what lies on the edge of the panel is drawn as far within as it is wide
        column = np.clip(column[inside] - side // 2, 0, columns - side).astype(int)
        row = np.clip(row[inside] - side // 2, 0, rows - side).astype(int)
        colour = np.round(colours[inside]).astype(np.uint8)
        for right_by in range(side):
            for down_by in range(side):
                picture[row + down_by, column + right_by, :3] = colour
                picture[row + down_by, column + right_by, 3] = 255
        self._image(picture, "")

    def cells(self, values: Array, low: float, high: float, digits: float = math.inf) -> None:
        """Numbers (rows, columns) in colours, NaN empty; those from ``digits`` on are written."""
        rows, columns = values.shape
        share = (values - low) / (high - low)
        known = np.isfinite(values)
        if values.size > _MOST_CELLS:
            picture = np.zeros((rows, columns, 4), dtype=np.uint8)
            picture[known, :3] = np.round(shades(share[known], SIGNED))
            picture[known, 3] = 255
            self._image(picture, "cells signed")
            return
        drawn = []
        wide = self.across(1) - self.across(0) if columns > 1 else math.inf
        for i, j in np.argwhere(known).tolist():
            value, at = float(values[i, j]), (j - 0.5, rows - 1.5 - i)
            names = [n[k] for n, k in ((self._rows, i), (self._names, j)) if n is not None]
            x, y = self.across(at[0]), self.up(at[1] + 1)
            across, down = self.across(at[0] + 1) - x, self.up(at[1]) - y
            fill = shade(float(share[i, j]), SIGNED)
            words = Sentence("{names}: {value:2}", names=", ".join(names), value=value)
            drawn.append(mark("rect", title=words, x=x, y=y, width=across, height=down, fill=fill))
            if abs(value) >= digits and wide >= 26:
                right, base = x + across / 2, y + down / 2 + 4
                strong = min(float(share[i, j]), 1 - float(share[i, j])) < _STRONG
                sort = "on-cell strong" if strong else "on-cell"
                drawn.append(
                    mark("text", Sentence("{value:2}", value=value), x=right, y=base, class_=sort)
                )
        self._marks.append(mark("g", inner=drawn, class_="signed"))

    def _image(self, picture: NDArray[np.uint8], sort: str) -> None:
        """Pixels (rows, columns, 4) over the whole panel, below all other marks."""
        from PIL import Image

        out = io.BytesIO()
        Image.fromarray(picture, "RGBA").save(out, "WEBP", lossless=True, quality=50, method=2)
        data = base64.b64encode(out.getvalue()).decode("ascii")
        left, right = self.across(self.x[0]), self.across(self.x[1])
        top, base = self.up(self.y[1]), self.up(self.y[0])
        self._marks.insert(
            0,
            mark(
                "image", x=left, y=top, width=right - left, height=base - top,
                preserveAspectRatio="none", class_=sort or "spots",
                href=f"data:image/webp;base64,{data}",
            ),
        )  # fmt: skip

    def group(self, x: float, y: float) -> DrawnMark:
        """The panel as a part of a drawing, shifted."""
        left, right = self.across(self.x[0]), self.across(self.x[1])
        top, base = self.up(self.y[1]), self.up(self.y[0])
        parts = []
        if self._ground:
            wide, high = right - left, base - top
            parts.append(mark("rect", x=left, y=top, width=wide, height=high, class_="ground"))
        for value, text in self._heights(base - top):
            at = self.up(value)
            if self._rows is None:
                parts.append(mark("path", d=f"M{left} {at}H{right}", class_="grid"))
            parts.append(mark("text", text, x=left - 6, y=at + 4, class_="count"))
        parts += self._ticks(left, right, base)
        parts += self._marks
        parts += [
            mark("text", label.text, x=label.x, y=label.y, class_=f"label {label.sort}")
            for label in place_labels(self._names_beside, right, base)
        ]
        parts.append(mark("path", d=f"M{left} {top}V{base}H{right}", class_="axis"))
        middle = (left + right) / 2
        if self._labels[0]:
            parts.append(mark("text", self._labels[0], x=middle, y=self.height - 6, class_="tick"))
        if self._labels[1]:
            turn = f"translate(13 {(top + base) / 2:.1f}) rotate(-90)"
            parts.append(mark("text", self._labels[1], transform=turn, class_="tick"))
        if self._title:
            parts.append(mark("text", self._title, x=middle, y=15, class_="head"))
        return mark("g", inner=parts, transform=f"translate({x} {y})")

    def _heights(self, room: float) -> list[tuple[float, str]]:
        """Values and words of the axis upwards, for so many pixels."""
        if self._rows is not None:
            last = len(self._rows) - 1
            step = max(1, math.ceil(11.0 * len(self._rows) / room))
            return [(float(last - k), self._rows[k]) for k in range(0, last + 1, step)]
        ticks = _log_ticks(*self.y) if "y" in self._log else []
        if len(ticks) < 2:
            ticks = nice_ticks(*self.y, most=max(2, int(room / 34)))
        return [(value, _tick(value)) for value in ticks]

    def _ticks(self, left: float, right: float, base: float) -> list[DrawnMark]:
        """Marks and words below the axis to the right."""
        if self._names is not None:
            # slanted names stand farther from each other than they are high
            apart = 17.0 if self._slanted else 11.0
            step = max(1, math.ceil(apart * len(self._names) / (right - left)))
            places = [(float(k), self._names[k]) for k in range(0, len(self._names), step)]
        elif self._given is not None:
            places = list(self._given)
        elif "x" in self._log:
            places = [(value, _tick(value)) for value in _log_ticks(*self.x)]
        else:
            most = max(2, int((right - left) / 70))
            places = [(value, _tick(value)) for value in nice_ticks(*self.x, most=most)]
        parts, free = [], -math.inf
        for value, text in places:
            at = self.across(value)
            parts.append(mark("path", d=f"M{at} {base}v4", class_="axis"))
            half = len(text) * _LETTER / 2
            if self._slanted:
                turn = f"translate({at + 4} {base + 14}) rotate(-40)"
                parts.append(mark("text", text, transform=turn, class_="count"))
            elif at - half > free:
                parts.append(mark("text", text, x=at, y=base + 17, class_="tick"))
                free = at + half + 4
        return parts


def _ends(ends: tuple[float, float], *, log: bool = False) -> tuple[float, float]:
    """Ends of an axis that has a length."""
    low, high = float(ends[0]), float(ends[1])
    if not (math.isfinite(low) and math.isfinite(high)):
        return (1.0, 10.0) if log else (0.0, 1.0)
    if log:
        low = max(low, 1e-12)
        return (low, high) if high > low * 1.0001 else (low / 2, low * 2)
    return (low, high) if high > low else (low - 0.5, low + 0.5)


def _about(ends: tuple[float, float], span: float) -> tuple[float, float]:
    """An interval of a length about the middle of another."""
    middle = (ends[0] + ends[1]) / 2
    return middle - span / 2, middle + span / 2


def ends_of(values: Array, margin: float = 0.03, least: float = 1e-6) -> tuple[float, float]:
    """Ends of an axis, with a share of the extent of the values beside them; ``least`` is added."""
    low, high = float(values.min()), float(values.max())
    more = margin * (high - low) + least
    return low - more, high + more


def legend(entries: Sequence[tuple[str, str]], width: float) -> tuple[DrawnMark, float]:
    """Colours, classes or such as #1a7a48, with their words, and how high their rows are."""
    parts, x, y = [], _LEFT, 12.0
    for colour, text in entries:
        need = 30 + _LARGER * _wide(text)
        if x > _LEFT and x + need > width:
            x, y = _LEFT, y + 18.0
        plain = colour.startswith("#")
        own = _known(fill=colour if plain else "", class_="" if plain else f"bar-{colour}")
        parts.append(mark("rect", x=x, y=y - 9, width=11, height=11, **own))
        parts.append(mark("text", text, x=x + 16, y=y, class_="entry"))
        x += need
    return mark("g", inner=parts), y + 8.0


def _wide(text: str) -> float:
    """Pixels that the words of a legend take."""
    return sum(
        3.6 if c in " .,:;'ijl|" else 9.6 if c in "mwMW@%" else 8.4 if c.isupper() else 6.6
        for c in text
    )


def colour_bar(
    low: float, high: float, label: str, width: float, scale: Array = LEVELS
) -> tuple[DrawnMark, float]:
    """The colours from low to high with their numbers, and how high that is in pixels."""
    left, long = _LEFT, min(260.0, width - 2 * _LEFT)
    steps = 40
    step = long / steps
    parts = [
        mark("rect", x=left + k * step, y=4, width=step + 0.4, height=10,
             fill=shade((k + 0.5) / steps, scale))
        for k in range(steps)
    ]  # fmt: skip
    parts = [mark("g", inner=parts, class_="signed" if scale is SIGNED else "bar-of-colours")]
    for value in nice_ticks(low, high, 5) if high > low else ():
        at = left + (value - low) / (high - low) * long
        parts.append(mark("text", _tick(value), x=at, y=29, class_="tick"))
    parts.append(mark("text", label, x=left + long + 14, y=13, class_="entry"))
    return mark("g", inner=parts), 36.0


def beside(
    rows: Sequence[Sequence[Chart]], words: str, below: tuple[DrawnMark, float] | None = None
) -> Drawing:
    """Panels in rows as one drawing; ``below`` is a legend or scale of colours with its height."""
    width = max(sum(chart.width for chart in row) for row in rows)
    parts, y = [], 0.0
    for row in rows:
        x = 0.0
        for chart in row:
            parts.append(chart.group(x, y))
            x += chart.width
        y += max(chart.height for chart in row) + 6
    if below is not None:
        parts.append(mark("g", inner=[below[0]], transform=f"translate(0 {y:.1f})"))
        y += below[1]
    return Drawing(width, y, tuple(parts), words)
