"""Figures of a report: a drawing with its heading and what it shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

from tribrach.report.charts import Drawing

#: least height of letters on paper [mm], 5 pt, and how much larger than drawn they may become
_LEAST, _MOST = 1.76, 1.5
#: what most letters of drawings are high [px]
_LETTERS = 11.0
#: wider drawings take the whole width of a page; higher ones than this share of it are tall
_BROAD, _TALL = 920.0, 0.45
#: width of half a page and of a whole one [mm], as the style sheet has them on paper
_HALF, _WHOLE = 131.0, 273.0


@dataclass(frozen=True)
class Picture:
    """A figure of a report."""

    #: anchor in the page, heading, and what the figure shows
    name: str
    title: str
    #: the drawing, or what makes it when the picture is first looked at
    image: Drawing | Callable[[], Drawing]
    caption: str
    wide: bool = False  #: true for what is to take the whole width of a page

    @cached_property
    def drawing(self) -> Drawing:
        """The drawing."""
        return self.image() if callable(self.image) else self.image

    @property
    def broad(self) -> bool:
        """Does it take the whole width of a printed page?"""
        return self.drawing.width > _BROAD and self.drawing.sort != "panorama"

    @property
    def tall(self) -> bool:
        """May it be higher on paper than others?"""
        return self.drawing.height > _TALL * self.drawing.width

    @property
    def letters(self) -> float:
        """How much larger its letters are on paper than drawn, so that they can be read."""
        one = self.drawing
        if one.sort in ("panorama", "still"):
            high = 34.0 if one.sort == "panorama" else 62.0
        elif self.broad:
            high = 98.0 if self.tall else 66.0
        elif self.wide:
            high = 66.0 if self.tall else 49.0
        else:
            high = 45.0
        scale = min((_WHOLE if self.broad else _HALF) / one.width, high / one.height)
        return min(max(_LEAST / (_LETTERS * scale), 1.0), _MOST)
