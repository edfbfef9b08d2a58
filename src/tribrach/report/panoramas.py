"""Panoramas of scans: as pictures with the targets numbered, and as drawings with their names and
the azimuths below.
"""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal

from tribrach.report.charts import Drawing, DrawnMark, mark

if TYPE_CHECKING:
    from tribrach.job.panorama import Panorama

#: colours of targets, and of any other kind
_COLOURS = {"sphere": "#d62728", "checkerboard": "#1f77b4", "disc": "#2ca02c", "plane": "#9467bd"}
_OTHER = "#ff7f0e"
#: radius and width of the rings, size of the numbers and how far they are from the centre [pixels]
_RADIUS, _LINE, _SIZE, _AWAY = 7.0, 2, 12.0, 7.0
#: loss that nobody sees at this size, with numbers and rings as sharp as they were
_WEBP = {"quality": 70, "method": 4, "use_sharp_yuv": True}


def panorama_file(view: Panorama, kind: Literal["PNG", "WEBP"]) -> bytes:
    """Draw a panorama with its targets numbered."""
    from PIL import Image, ImageDraw, ImageFont

    width, height = (max(round(x), 1) for x in view.shape)
    rows, columns = view.grey.shape
    image = Image.fromarray(view.grey).resize((width, height), Image.Resampling.NEAREST)
    image = image.convert("RGB")
    draw = ImageDraw.Draw(image)
    font = ImageFont.load_default(_SIZE)
    for number, ((x, y), target) in enumerate(zip(view.marks, view.kinds, strict=True), start=1):
        # centres of pixels stand at whole numbers
        at = ((x + 0.5) * width / columns, (y + 0.5) * height / rows)
        colour = _COLOURS.get(target, _OTHER)
        ring = (at[0] - _RADIUS, at[1] - _RADIUS, at[0] + _RADIUS, at[1] + _RADIUS)
        draw.ellipse(ring, outline=colour, width=_LINE)
        draw.text(_beside(at, font.getlength(str(number)), width), str(number), colour, font, "ls")
    out = io.BytesIO()
    image.save(out, kind, **(_WEBP if kind == "WEBP" else {}))
    return out.getvalue()


#: size of a letter in the drawing, and the height of its axis
_LETTER, _AXIS = 8.0, 34.0


def panorama_drawing(
    view: Panorama,
    names: Sequence[str],
    heading: float | None,
    angle: Literal["gon", "deg"] = "gon",
) -> Drawing:
    """A panorama with the names of its targets and an axis of directions.

    Targets that take no part have the name "", and their number is shown. Without a heading [rad]
    the axis has horizontal angles of the scanner, else azimuths.
    """
    from PIL import Image

    width, height = (max(round(x), 1) for x in view.shape)
    rows, columns = view.grey.shape
    out = io.BytesIO()
    Image.fromarray(view.grey).save(out, "WEBP", **_WEBP)
    data = base64.b64encode(out.getvalue()).decode("ascii")
    source = f"data:image/webp;base64,{data}"
    parts = [mark("image", width=width, height=height, preserveAspectRatio="none", href=source)]
    taken: list[tuple[float, float, float]] = []
    for number, ((x, y), kind) in enumerate(zip(view.marks, view.kinds, strict=True), start=1):
        at = (x + 0.5) * width / columns, (y + 0.5) * height / rows
        name = names[number - 1] or f"no. {number}"
        words = f"{name}: {kind}, number {number}"
        sort = f"ring {_class(kind)}"
        parts.append(mark("circle", title=words, cx=at[0], cy=at[1], r=_RADIUS, class_=sort))
        place = _free(at, len(name) * _LETTER, (width, height), taken)
        parts.append(mark("text", name, x=place[0], y=place[1], class_="seen"))
    parts += _azimuths(view.window, width, height, heading, angle)
    what = "azimuth" if heading is not None else "horizontal angle of the scanner"
    unit = "gon" if angle == "gon" else "°"
    title = f"{what} [{unit}]"
    parts.append(mark("text", title, x=width / 2, y=height + _AXIS - 3, class_="tick"))
    words = f"Panorama with {len(names)} targets"
    return Drawing(width, height + _AXIS, tuple(parts), words, "panorama")


def _class(kind: str) -> str:
    """Class of the colour of a kind of target."""
    return f"target-{kind}" if kind in _COLOURS else "target-other"


def _free(
    at: tuple[float, float],
    length: float,
    size: tuple[float, float],
    taken: list[tuple[float, float, float]],
) -> tuple[float, float]:
    """Where a name stands: beside its ring, and not upon another name."""
    away = _RADIUS + 3
    places = [
        (at[0] + side, at[1] + rise)
        for rise in (-5.0, 12.0, -18.0, 25.0, -31.0)
        for side in (away, -away - length)
    ]
    inside = [
        p for p in places
        if p[0] >= 0 and p[0] + length <= size[0] and 11 <= p[1] <= size[1] - 2
    ] or places  # fmt: skip
    for place in inside:
        hit = any(
            place[0] < right and left < place[0] + length and abs(place[1] - y) < 12.0
            for left, right, y in taken
        )
        if not hit:
            break
    else:
        place = inside[0]
    taken.append((place[0], place[0] + length, place[1]))
    return place


def _azimuths(
    window: tuple[float, float],
    width: float,
    height: float,
    heading: float | None,
    angle: Literal["gon", "deg"],
) -> list[DrawnMark]:
    """Ticks of the axis below a panorama."""
    circle = 400.0 if angle == "gon" else 360.0
    unit = circle / (2 * math.pi)
    left, right = window[0] * unit, window[1] * unit
    sign, offset = (1.0, 0.0) if heading is None else (-1.0, heading * unit)
    ends = sorted((sign * left + offset, sign * right + offset))
    span = ends[1] - ends[0]
    if not span > 0:
        return []
    steps = (1, 2, 5, 10, 20, 50, 100) if angle == "gon" else (1, 2, 5, 10, 15, 30, 45, 90)
    step = next((s for s in steps if span / s <= 16), steps[-1])
    out: list[DrawnMark] = []
    value = math.ceil(ends[0] / step) * step
    while value <= ends[1]:
        share = (sign * (value - offset) - left) / (right - left)
        x = share * width
        text = f"{value % circle:.0f}"
        half = 3.4 * len(text)
        out.append(mark("path", d=f"M{x:.1f} {height}v5", class_="axis"))
        # a number that would be cut at the end is left out, its tick is not
        if half <= x <= width - half:
            out.append(mark("text", text, x=x, y=height + 17, class_="tick"))
        value += step
    return out


def _beside(at: tuple[float, float], length: float, width: int) -> tuple[float, float]:
    """Where a number begins: right above its ring, or left of it and lower at the margins."""
    x = at[0] + _AWAY if at[0] + _AWAY + length <= width else at[0] - _AWAY - length
    return x, at[1] - _AWAY if at[1] - _AWAY - _SIZE >= 0 else at[1] + _AWAY + _SIZE
