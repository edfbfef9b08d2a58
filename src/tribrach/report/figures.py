"""Charts are drawn with matplotlib; that takes half a second to load, and is for the first chart.

Most commands draw none unless a page is asked for. Pages hold pictures as WebP, charts without any
loss: a third of what they take as PNG.
"""

from __future__ import annotations

import base64
import io
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any

from tribrach._types import Array
from tribrach.report.characters import visible
from tribrach.report.charts import Drawing

if TYPE_CHECKING:
    from matplotlib.cm import ScalarMappable
    from matplotlib.collections import Collection
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

__all__ = [
    "Picture",
    "colour_scale",
    "colours",
    "legend_patches",
    "new_figure",
    "picture",
    "poly_collection",
]


#: no pixel differs from what was drawn; more effort takes twice the time for a tenth of the size
_EXACT = {"lossless": True, "quality": 50, "method": 2}


@dataclass(frozen=True)
class Picture:
    """A figure of a report.

    Parameters
    ----------
    name, title, caption : str
        Anchor in the page, heading, and what the figure shows.
    image : str, Drawing or callable
        The WebP file in base64 or a drawing, or what makes either when the picture is first
        looked at.
    wide : bool
        True for what is to take the whole width of a page.
    """

    name: str
    title: str
    image: str | Drawing | Callable[[], str | Drawing]
    caption: str
    wide: bool = False

    @cached_property
    def content(self) -> str | Drawing:
        """The WebP file in base64, or the drawing."""
        return self.image() if callable(self.image) else self.image

    @property
    def webp(self) -> str:
        """The WebP file in base64, "" for a drawing."""
        return self.content if isinstance(self.content, str) else ""

    @property
    def drawing(self) -> Drawing | None:
        """The drawing, None for a picture."""
        return None if isinstance(self.content, str) else self.content


def new_figure(**options: Any) -> Figure:
    """An empty figure: ``figsize`` in inches, ``dpi``, ``layout``."""
    figure: Figure = import_module("matplotlib.figure").Figure(**options)
    return figure


def colours(name: str) -> Colormap:
    """The colours of this name for numbers from 0 to 1."""
    known: Colormap = import_module("matplotlib").colormaps[name]
    return known


def colour_scale(low: float, high: float, name: str) -> ScalarMappable:
    """The scale of the colours of this name for numbers from low to high."""
    range_ = import_module("matplotlib.colors").Normalize(low, high)
    scale: ScalarMappable = import_module("matplotlib.cm").ScalarMappable(range_, name)
    return scale


def poly_collection(corners: Array, facecolors: Array) -> Collection:
    """Filled polygons (n, corners, 2) with their colours (n, 4) as one thing to draw."""
    kind = import_module("matplotlib.collections").PolyCollection
    made: Collection = kind(corners, facecolors=facecolors, linewidths=0)
    return made


def legend_patches(labels: Sequence[str], shades: Array) -> list[Patch]:
    """Entries of a legend: words with their colours (n, 4)."""
    kind = import_module("matplotlib.patches").Patch
    return [kind(color=shade, label=label) for label, shade in zip(labels, shades, strict=True)]


def _webp(figure: Figure) -> bytes:
    """The figure as a WebP file, its pixels as they are: the same chart gives the same bytes."""
    out = io.BytesIO()
    import_module("matplotlib.backends.backend_agg").FigureCanvasAgg(figure)
    _as_it_stands(figure)
    with warnings.catch_warnings():
        # names in writings that the font lacks are boxes; the tables have them
        warnings.filterwarnings("ignore", "Glyph .* missing from", UserWarning)
        figure.savefig(out, format="webp", pil_kwargs=_EXACT)
    return out.getvalue()


def _as_it_stands(figure: Figure) -> None:
    """Take no name for a formula: with two dollars in it, it would be set as one, or refused."""
    powers = set[int]()
    for axis in (axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)):
        if axis.get_scale() == "log":
            # powers of ten are formulas of matplotlib's own
            ticks = (*axis.get_major_ticks(), *axis.get_minor_ticks())
            powers |= {id(label) for tick in ticks for label in (tick.label1, tick.label2)}
    for text in figure.findobj(import_module("matplotlib.text").Text):
        if id(text) not in powers:
            text.set_parse_math(False)
            text.set_text(visible(text.get_text()))


def picture(name: str, title: str, figure: Figure | Callable[[], Figure], caption: str) -> Picture:
    """A figure as a picture of a report; a function draws it when a page first shows it."""
    if callable(figure):
        return Picture(name, title, lambda: _text(figure()), caption)
    return Picture(name, title, _text(figure), caption)


def _text(figure: Figure) -> str:
    """The WebP file of a figure in base64."""
    return base64.b64encode(_webp(figure)).decode("ascii")
