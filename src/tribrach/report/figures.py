"""Charts are drawn with matplotlib; that takes half a second to load, and is for the first chart.

Most commands draw none unless a page is asked for.
"""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure

__all__ = ["Picture", "colour_scale", "colours", "new_figure", "picture", "png"]


@dataclass(frozen=True)
class Picture:
    """A figure of a report.

    Parameters
    ----------
    name, title, caption : str
        Anchor in the page, heading, and what the figure shows.
    png : str
        The PNG file in base64.
    """

    name: str
    title: str
    png: str
    caption: str


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


def png(figure: Figure) -> bytes:
    """The figure as a PNG file without date and version: the same chart gives the same bytes."""
    out = io.BytesIO()
    import_module("matplotlib.backends.backend_agg").FigureCanvasAgg(figure)
    figure.savefig(out, format="png", metadata={"Software": None})
    return out.getvalue()


def picture(name: str, title: str, figure: Figure, caption: str) -> Picture:
    """A figure as a picture of a report."""
    return Picture(name, title, base64.b64encode(png(figure)).decode("ascii"), caption)
