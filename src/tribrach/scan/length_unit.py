"""What the coordinates of a file are counted in, and how many metres that is along each axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tribrach.answers import Result
from tribrach.sentences import Sentence

#: questions by what asks them
_DOUBTS = {
    "wide": "the points spread over {value:kmg4}: are the coordinates metres?",
    "high": "the points rise over {value:kmg4}: are the coordinates metres?",
    "narrow": "all points lie within {value:mmg2}: are the coordinates metres, and not degrees?",
    "slender": "seen from above all points lie within {value:mmg2}, and they are much higher than "
    "wide: are the coordinates metres, and not degrees?",
    "steep": "half of the steep rays are longer than {value:mg4}, and no floor or ceiling is so "
    "far away: are the coordinates metres?",
    "tower": "half of the rays that look down steeply are longer than {value:mg4}, as from a "
    "tower: are the coordinates metres?",
    "feet": "the floor of a room lies {value:mg3} below the scanner, and tripods are a third as "
    "high: are the coordinates metres, and not feet?",
    "far": "nothing around the scanner is nearer than {value:mg3}: are the coordinates metres?",
    "coarse": "all coordinates are whole multiples of {value:mg4}, which no scanner is so coarse "
    "to give: are they metres?",
}


@dataclass(frozen=True)
class LengthUnit:
    """The unit of the coordinates of a file."""

    names: tuple[str, str, str] = ("metre", "metre", "metre")  #: of x, y and z, in words
    #: metres in one unit of x, y and z; None if x and y are angles
    factors: tuple[float, float, float] | None = (1.0, 1.0, 1.0)
    source: str = "assumed"  #: who says so
    crs: str | None = None  #: WKT of the file, whose axes have these units; None if it has none
    #: true if it follows from the axes of the reference system, which any program can read
    by_crs: bool = False

    @property
    def metric(self) -> bool:
        """True if the coordinates are metres."""
        return self.factors == (1.0, 1.0, 1.0)

    @property
    def words(self) -> str:
        """The unit, and that of heights where it is another."""
        x, _, z = self.names
        if x == z:
            return x
        return f"{x}, heights {z}"


METRES = LengthUnit()


@dataclass(frozen=True)
class UnitDoubt(Result):
    """What no scan in metres shows."""

    #: kind of doubt
    key: Literal["wide", "high", "narrow", "slender", "steep", "tower", "feet", "far", "coarse"]
    value: float  #: the length that asks [m]

    @property
    def sentence(self) -> Sentence:
        """The question, without capital."""
        return Sentence(_DOUBTS[self.key], value=self.value)
