"""Panoramas of scans as pictures, with the targets in their colours and numbered."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from tribrach.job.panorama import Panorama

__all__ = ["panorama_file"]

#: colours of targets, and of any other kind
_COLOURS = {"sphere": "#d62728", "checkerboard": "#1f77b4", "disc": "#2ca02c", "plane": "#9467bd"}
_OTHER = "#ff7f0e"
#: radius and width of the rings, size of the numbers and how far they are from the centre [pixels]
_RADIUS, _LINE, _SIZE, _AWAY = 7.0, 2, 12.0, 7.0
#: loss that nobody sees at this size, with numbers and rings as sharp as they were
_WEBP = {"quality": 80, "method": 4, "use_sharp_yuv": True}


def panorama_file(view: Panorama, kind: Literal["PNG", "WEBP"]) -> bytes:
    """Draw a panorama with its targets numbered.

    Parameters
    ----------
    view
        The panorama.
    kind
        ``PNG``, which keeps every pixel, or ``WEBP``, an eighth of its size, for pages.

    Returns
    -------
    bytes
        The file; the same panorama gives the same bytes.
    """
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


def _beside(at: tuple[float, float], length: float, width: int) -> tuple[float, float]:
    """Where a number begins: right above its ring, or left of it and lower at the margins."""
    x = at[0] + _AWAY if at[0] + _AWAY + length <= width else at[0] - _AWAY - length
    return x, at[1] - _AWAY if at[1] - _AWAY - _SIZE >= 0 else at[1] + _AWAY + _SIZE
