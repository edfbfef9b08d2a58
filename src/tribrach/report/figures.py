"""Figures of a report: a drawing with its heading and what it shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from tribrach.report.charts import Drawing

__all__ = ["Picture"]


@dataclass(frozen=True)
class Picture:
    """A figure of a report.

    Parameters
    ----------
    name, title, caption : str
        Anchor in the page, heading, and what the figure shows.
    image : Drawing or callable
        The drawing, or what makes it when the picture is first looked at.
    wide : bool
        True for what is to take the whole width of a page.
    """

    name: str
    title: str
    image: Drawing | Callable[[], Drawing]
    caption: str
    wide: bool = False

    @cached_property
    def drawing(self) -> Drawing:
        """What is drawn."""
        return self.image() if callable(self.image) else self.image
