"""What an observation kind says about itself: the words in which every kind answers.

A kind is a class of :class:`~tribrach.observations.base.Observations`. Its index fields are
declared with :func:`refers`, everything else in one :class:`KindFacts`. Whoever needs to know
(survey, start values, error budget, planning, readers, report) asks the kind and keeps no list of
names. :mod:`tribrach.observations.registry` finds all kinds.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum, StrEnum
from typing import Any, Literal

import numpy as np

from tribrach._types import Array

#: families of unknowns; a position is a point or the place of a pose
Family = Literal["point", "pose", "plane", "vector", "scalar", "position"]


class End(Enum):
    """Which end of an observation an index field names."""

    FROM = "from"  #: where the instrument stands, or the first of two
    TO = "to"  #: what is seen from there, or the second of two
    AT = "at"  #: the one thing that is observed


class Role(Enum):
    """Where the values of a kind come from."""

    READING = "reading"  #: an instrument was read
    GIVEN = "given"  #: known beforehand of a point or a station: control
    PRIOR = "prior"  #: known beforehand of another unknown
    CONDITION = "condition"  #: what must be true of several unknowns


class Category(StrEnum):
    """What surveyors call the parts of an error budget, in its order."""

    CONTROL = "control"
    GNSS = "GNSS"
    LINES = "levelling lines"
    TOTAL_STATION = "total station"
    CENTRING = "centring"
    BACKSIGHT = "backsight"  #: every sight from the scanner itself
    OWN_TARGETS = "own targets"  #: in scans of the station
    OTHER_TARGETS = "targets of others"
    ORIENTATION = "board orientation"  #: centres of boards, by the angle of sight
    LEVELLING = "levelling"  #: of the scanner
    OTHER = "other"


class ObservedAxes(Enum):
    """Which axes of a flat site a kind depends on."""

    PLAN = "plan"
    HEIGHTS = "heights"
    SPACE = "plan and heights"
    NONE = "none"  #: no coordinates at all


class Repetition(Enum):
    """What a design may ask for more of."""

    NEVER = "never"  #: nothing is read, or nothing would be better the second time
    FINER = "finer"  #: no sets, but a better or longer measurement
    SETS = "sets"  #: an instrument at the first end that can read again


class StartTie(Enum):
    """As what a kind helps to find start values (see :mod:`tribrach.observations.ties`)."""

    RAY = "ray"
    LENGTH = "length"
    RISE = "rise"
    ZENITH = "zenith"
    VECTOR = "vector"
    SHOT = "shot"
    LINK = "link"
    FACE = "face"
    FIX = "fix"
    LEVELLING = "levelling"
    HEADING = "heading"
    VALUE = "value"  #: the start value of an unknown itself
    NONE = "none"


class SightLength(Enum):
    """Is a value the length of its sight?"""

    NO = "no"
    SLOPE = "slope"
    LEVEL = "level"


class Planned(Enum):
    """How a table of planned observations names a kind."""

    NO = "no"
    BY_NAME = "by name"
    TOTAL_STATION = "by name and as total_station"


@dataclass(frozen=True)
class IndexField:
    """An index field of a kind."""

    name: str
    family: Family  #: of the unknowns that it holds indices of
    optional: bool  #: may it hold -1 (in a survey: no name)?
    end: End | None = None  #: which end it names, None for other unknowns
    means: str = ""  #: what such an unknown is, for the report
    unit: str = ""  #: of such a scalar: "m", "rad" or "1"; "" if it depends on the scalar
    #: has every set of readings an unknown of its own, whose start value the ties give?
    by_set: bool = False


@dataclass(frozen=True)
class CsvColumns:
    """How a kind stands in our own CSV tables.

    Columns of values are in the units of the kind's rows: lengths, angles or ratios. A kind with
    the keys ``from, to`` and one value is a column of the table of sights; nothing else has to know
    of it.
    """

    keys: tuple[str, ...]  #: columns of names, in the order of the ends
    values: tuple[str, ...]  #: columns of values, without unit
    length: SightLength = SightLength.NO  #: is the value the length of the sight?
    sigmas: tuple[str, ...] = ()  #: columns that hold its sigma where its own does not
    #: fields that take the columns ``height_instrument`` and ``height_target``
    heights: tuple[str, ...] = ()
    planned: Planned = Planned.NO  #: how a planned one is named

    @property
    def is_sight(self) -> bool:
        """Is it one value of a line in the table of sights?"""
        return self.keys == ("from", "to") and len(self.values) == 1


@dataclass(frozen=True, kw_only=True)
class KindFacts:
    """All that a kind of observation answers about itself."""

    title: str  #: one observation in words, for reports
    computed: str  #: what is computed, in Markdown, for the documentation
    role: Role  #: where its values come from
    #: its part of a station's error budget, and that of what was observed from the station itself
    #: (the same if not given)
    category: Category
    own_category: Category | None = None
    axes: ObservedAxes = ObservedAxes.SPACE  #: what it depends on, on a flat site
    repeats: Repetition = Repetition.NEVER  #: what a design may ask for more of
    start: StartTie = StartTie.NONE  #: how it helps to find start values
    csv: tuple[CsvColumns, ...] = ()  #: how it stands in CSV tables; empty if in none
    #: are its values coordinates in the work frame, which place what they refer to?
    absolute: bool = False
    #: is it judged in the table of control and check points, not as an observation?
    listed_as_control: bool = False
    places_station: bool = False  #: does it place a scanner by something that is mounted on it?
    levels_station: bool = False  #: does it hold a scanner's axis to the plumb line?
    names_target: bool = False  #: is its second end a target that somebody named at the first one?
    #: what two scanners have in common by it, in the plural; "" if it ties none
    common_to_stations: str = ""
    full_circle: bool = False  #: are its values read on a full circle?
    of_unknown: bool = False  #: have its values the unit of the unknown they refer to?
    #: is it what is known beforehand of an error that sights share, and no reading of anybody?
    nuisance: bool = False

    def budget(self, own: bool) -> Category:
        """Category in the budget of a station; own: observed from the station itself."""
        return self.own_category if own and self.own_category is not None else self.category


#: what readings of a total station have in common
SIGHT = KindFacts(
    title="",
    computed="",
    role=Role.READING,
    category=Category.TOTAL_STATION,
    own_category=Category.BACKSIGHT,
    repeats=Repetition.SETS,
)

#: what is found in scans
SCANNED = KindFacts(
    title="",
    computed="",
    role=Role.READING,
    category=Category.OTHER_TARGETS,
    own_category=Category.OWN_TARGETS,
)


@dataclass(frozen=True)
class SightLine:
    """What is known of n lines of sight when their sigmas are taken from an instrument."""

    value: Array  #: (n,): measured or planned values of the kind itself [m, rad, 1]
    sight: Array  #: (n,): lengths of the sights [m], NaN where unknown
    levelled: Array  #: (n,): lengths of levelling lines [m], NaN where unknown
    repetitions: Array  #: (n,): how often each value was measured
    planned: bool = False  #: is it a plan, and nothing measured yet?
    #: (n,): how many of the two ends have an error of centring that is the sight's own
    ends: Array | float = 2.0


def refers(
    family: Family,
    *,
    optional: bool = False,
    end: End | None = None,
    means: str = "",
    unit: str = "",
    by_set: bool = False,
) -> Any:
    """A dataclass field of indices (n,) of unknowns, described as in :class:`IndexField`.

    In a survey the same field holds names. An optional field may be left out, or hold -1 (no
    name) for observations that have no such unknown.
    """
    # the name of the field is not known here: Observations.references fills it in
    metadata = {"refers": IndexField("", family, optional, end, means, unit, by_set)}
    if optional:
        return field(default_factory=lambda: np.empty(0, dtype=np.int64), metadata=metadata)
    return field(metadata=metadata)


def per_item(default: float) -> Any:
    """A dataclass field of values (n,) with a default; a single number is broadcast."""
    return field(default_factory=lambda: np.empty(0), metadata={"per_item": default})


def shaped(*tail: int, whole: bool = False) -> Any:
    """A dataclass field of numbers (n, *tail) without a default, ``whole`` ones if need be."""
    return field(metadata={"shaped": (np.int64 if whole else np.float64, tail)})


def shared() -> Any:
    """A hashable dataclass field that is one for all observations of a table; None if not given.

    In a survey, tables that differ in it are kept apart even within one group.
    """
    return field(default=None, metadata={"shared": True})
