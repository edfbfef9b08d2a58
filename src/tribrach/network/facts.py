"""What readers of files learn beside points and observations; the report asks for it by type."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Literal, TypeVar

import numpy as np

from tribrach._types import Array
from tribrach.answers import Result
from tribrach.geodesy.epochs import Passage
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.sentences import Sentence, capital, joined

#: mean radius of the Earth [m]
EARTH = 6371000.0


class Fact:
    """Base class of what a reader leaves for the report.

    Every reader derives a frozen dataclass of its own. A survey may hold several facts of one
    type, for example one for each raw file; none replaces another.
    """


KindOfFact = TypeVar("KindOfFact", bound=Fact)


def facts_of(facts: Iterable[Fact], kind: type[KindOfFact]) -> tuple[KindOfFact, ...]:
    """Choose the facts of one type, in the order in which they were left."""
    return tuple(fact for fact in facts if isinstance(fact, kind))


@dataclass(frozen=True)
class ListReading(Fact):
    """How a list was read that does not say everything itself."""

    file: str  #: name of the file
    sentences: tuple[str, ...]  #: what was taken for what, without the stop


@dataclass(frozen=True)
class PointCodes(Fact):
    """Codes and descriptions of points, as often as a file gives them."""

    given: tuple[tuple[str, str], ...]  #: name and code, in the order of the file


@dataclass(frozen=True)
class StartOnly(Fact):
    """Points of a list whose coordinates have no role and no sigma."""

    #: name of the file
    file: str
    names: tuple[str, ...]


@dataclass(frozen=True)
class OverGeoid(Fact):
    """Points whose heights were given over the geoid."""

    names: tuple[str, ...]


def codes_of(facts: Iterable[Fact]) -> Mapping[str, str]:
    """The code of each point that has one: the one given most often, the first of equals."""
    found: dict[str, Counter[str]] = {}
    for fact in facts_of(facts, PointCodes):
        for name, code in fact.given:
            if words := " ".join("".join(c if c.isprintable() else " " for c in code).split()):
                found.setdefault(name, Counter())[words] += 1
    return {name: counted.most_common(1)[0][0] for name, counted in found.items()}


def is_assumed(source: str) -> bool:
    """True if a source of figures says that nobody stated them."""
    return source.startswith("assumed")


@dataclass(frozen=True)
class AssumedSigmas(Fact):
    """Sigmas of coordinates that the project states, and not their file."""

    file: str  #: name of the file
    #: of easting and northing, and of the height [m]
    plan: float | None
    up: float | None
    points: tuple[str, ...] = ()  #: names of the points
    source: str = ""  #: where the project has them from, "" if it does not say

    @property
    def assumed(self) -> bool:
        """True if nobody stated them."""
        return is_assumed(self.source)

    @property
    def sentence(self) -> str:
        """Where the sigmas come from, without the stop."""
        parts = [("in plan", self.plan), ("in height", self.up)]
        told = [
            Sentence("{sigma:mmg} {words}", sigma=sigma, words=words)
            for words, sigma in parts
            if sigma is not None
        ]
        return Sentence(
            "{own.file} gives no sigmas: {told} are "
            + (self.source if self.assumed else "those of the project file"),
            own=self,
            told=joined(" and ", told),
        )


#: what heights can be counted from
HeightKind = Literal["ellipsoidal", "orthometric", "normal", "geoid"]
#: the same in words
HEIGHTS: dict[HeightKind, str] = {
    "ellipsoidal": "ellipsoidal height",
    "orthometric": "orthometric height",
    "normal": "normal height",
    "geoid": "height over the geoid",
}


@dataclass(frozen=True)
class Reference(Result, without=("grid",), maybe=("heights",)):
    """The reference system of the coordinates, as far as a file or project names it."""

    #: name or code of the coordinate reference system, such as ``EPSG:5897``
    crs: str | None = None
    frame: str | None = None  #: reference frame of geocentric coordinates, such as ``ITRF2014``
    epoch: float | None = None  #: decimal year that coordinates in a dynamic frame hold for
    #: what heights are: ``ellipsoidal``, ``orthometric``, ``normal``, or over the ``geoid`` of a
    #: file that does not say which
    heights: HeightKind | None = None
    #: converts work coordinates to easting, northing and height of a projected site
    grid: OutputFrame | None = None

    def completed(self, other: Reference) -> Reference:
        """Fill what is missing here from another reference."""
        own = self if self.frame is not None or self.epoch is not None else other
        return replace(
            self,
            crs=self.crs if self.crs is not None else other.crs,
            frame=own.frame,
            epoch=own.epoch,
            heights=self.heights or other.heights,
            grid=self.grid if self.grid is not None else other.grid,
        )


#: changes of a frame below this are not worth a sentence [m]
_NOTICEABLE = 5e-5
#: a transformation whose stated accuracy is worse is worth a warning [m]
_COARSE = 0.05


@dataclass(frozen=True)
class FrameChange(Fact):
    """Positions or vectors that came in another frame and were taken to that of the network."""

    file: str  #: where they came from
    vectors: bool  #: vectors, otherwise positions
    count: int  #: how many
    #: the frames with their epochs, in words
    source: str
    target: str
    largest: float  #: the largest change of one of them [m]
    accuracy: float  #: what is stated for the transformation [m], NaN if nothing is
    length: float = 0.0  #: of the longest vector [m], 0 for positions

    @classmethod
    def of_positions(
        cls, file: str, way: Passage, before: Array, after: Array, accuracy: float
    ) -> FrameChange:
        """What became of positions (n, 3) [m] on their way to the frame of the network."""
        largest = float(np.linalg.norm(after - before, axis=1).max(initial=0.0))
        ends = way.source.words, way.target.words
        return cls(file, False, len(before), *ends, largest, accuracy)

    @classmethod
    def of_vectors(
        cls, file: str, way: Passage, before: Array, after: Array, accuracy: float
    ) -> FrameChange:
        """What became of vectors (n, 3) [m] on their way to the frame of the network."""
        largest = float(np.linalg.norm(after - before, axis=1).max(initial=0.0))
        length = float(np.linalg.norm(before, axis=1).max(initial=0.0))
        ends = way.source.words, way.target.words
        return cls(file, True, len(before), *ends, largest, accuracy, length)

    @property
    def uncertain(self) -> float:
        """What the stated accuracy [m] means for the worst of them: all of it, or its turn."""
        return self.accuracy * (self.length / EARTH if self.vectors else 1.0)

    @property
    def sentence(self) -> str | None:
        """The transformation in a sentence; None if it changes nothing measurable."""
        if self.largest < _NOTICEABLE and not self.uncertain > _NOTICEABLE:
            return None
        what = "vector" if self.vectors else "position"
        things = f"{self.count} {what}{'s' * (self.count != 1)} of {self.file}"
        size = (
            Sentence("{own.largest:mm1}", own=self)
            if self.largest < 10
            else Sentence("{own.largest:0} m", own=self)
        )
        done = "turned" if self.vectors else "taken"
        known = "no accuracy is stated for the way"
        if self.uncertain >= 0:
            known = Sentence("EPSG's accuracy of the way makes {own.uncertain:mm1}", own=self)
        return Sentence(
            "{things} {are} {done} from {own.source} to {own.target}: by {size} at most, {known}",
            things=things,
            are="are" if self.count != 1 else "is",
            done=done,
            own=self,
            size=size,
            known=known,
        )

    @property
    def warning(self) -> str | None:
        """A sentence where positions come by a way that is coarser than surveys are."""
        if self.vectors or self.uncertain <= _COARSE or self.sentence is None:
            return None
        return Sentence(
            "{own.sentence}; control in {own.target} beside them shows what is left", own=self
        )


def frame_sentences(facts: Iterable[Fact], *, vectors: bool) -> list[str]:
    """What vectors, or positions, of other frames were taken to that of the network."""
    changes = [fact for fact in facts_of(facts, FrameChange) if fact.vectors == vectors]
    sentences = [change.sentence for change in changes]
    return [capital(text) + "." for text in sentences if text is not None]
