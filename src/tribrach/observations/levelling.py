"""Height differences, and pairs of positions that share one distance or height difference."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach._types import Array, Index
from tribrach.geodesy.site import FlatSite, Site
from tribrach.instruments.precision import Precision
from tribrach.observations.base import Block, Observations, per_item, refers
from tribrach.observations.declaration import (
    Category,
    CsvColumns,
    End,
    KindFacts,
    ObservedAxes,
    Planned,
    Repetition,
    Role,
    SightLine,
    StartTie,
)
from tribrach.observations.sights import SlopeDistances
from tribrach.observations.ties import Rises, TieCollector
from tribrach.observations.unknowns import State

__all__ = ["EqualDistances", "EqualHeightDifferences", "HeightDifferences"]


@dataclass(kw_only=True)
class HeightDifferences(Observations):
    """Height differences ``H(X_b) - H(X_a)`` [m] of levelling.

    The height is that of the site (U on a flat site, ellipsoidal otherwise) minus a known geoid
    height of each end. Heights of rod or instrument over the marks are added (method section 2.4).

    Parameters
    ----------
    start, end : array of int (n,)
        Positions.
    height_start, height_end : array (n,), optional
        Heights over the marks of what was levelled [m].
    geoid_start, geoid_end : array (n,), optional
        Geoid heights [m].
    """

    start: Index = refers("position", end=End.FROM)
    end: Index = refers("position", end=End.TO)
    height_start: Array = per_item(0.0)
    height_end: Array = per_item(0.0)
    geoid_start: Array = per_item(0.0)
    geoid_end: Array = per_item(0.0)
    site: Site = field(default_factory=FlatSite)
    kind: ClassVar[str] = "height_difference"
    units: ClassVar[tuple[str, ...]] = ("m",)
    facts: ClassVar[KindFacts] = KindFacts(
        title="height difference",
        computed="`H_b - H_a`, with heights above the marks and geoid heights",
        role=Role.READING,
        category=Category.LINES,
        axes=ObservedAxes.HEIGHTS,
        repeats=Repetition.SETS,
        start=StartTie.RISE,
        csv=(
            CsvColumns(
                ("from", "to"),
                ("height_difference",),
                heights=("height_start", "height_end"),
                planned=Planned.BY_NAME,
            ),
        ),
    )

    def predict(self, state: State) -> Array:
        """Height differences (n, 1)."""
        x = state.positions
        upper = self.site.height(x[self.end]) - self.geoid_end + self.height_end
        lower = self.site.height(x[self.start]) - self.geoid_start + self.height_start
        return (upper - lower)[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """The vertical at either end: + at the end, - at the start."""
        x, columns = state.positions, state.layout.position_columns
        up_end = self.site.axes(x[self.end])[:, 2:]
        up_start = self.site.axes(x[self.start])[:, 2:]
        return [Block(columns(self.end), up_end), Block(columns(self.start), -up_start)]

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Rises from mark to mark."""
        over = (self.height_start - self.height_end + self.geoid_end - self.geoid_start)[rows]
        ties.add(Rises(self.start[rows], self.end[rows], self.values[rows, 0] + over))

    @classmethod
    def instrument_sigma(cls, precision: Precision, line: SightLine) -> Array | None:
        """By the length of the line."""
        return precision.of_lines(line.levelled)


@dataclass(kw_only=True)
class EqualDistances(SlopeDistances):
    """Slope distances less their common value [m]: ``|X_b - X_a| - q``, observed as zero.

    All pairs of a set share the value ``q``: rungs of a ladder, points of a sphere about a centre.
    The sigma says to what they are equal (equal lengths of method section 2.13, weighted).

    Parameters
    ----------
    common : array of int (n,)
        Scalars ``q`` [m].
    """

    common: Index = refers("scalar", means="common value", unit="m")
    kind: ClassVar[str] = "equal_distance"
    facts: ClassVar[KindFacts] = KindFacts(
        title="equal distance",
        computed="length between two positions less the unknown value that a set of pairs shares",
        role=Role.CONDITION,
        category=Category.OTHER,
        axes=ObservedAxes.SPACE,
        repeats=Repetition.NEVER,
        start=StartTie.NONE,
        csv=(),
        names_target=True,
    )

    def predict(self, state: State) -> Array:
        """``s - q``, (n, 1)."""
        return super().predict(state) - state.scalar(self.common)[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """As the distance, and -1 by the common value."""
        columns = state.layout.columns("scalar", self.common)
        return [*super().jacobian(state), Block(columns, np.full((len(self), 1, 1), -1.0))]

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """None: the common value is not known."""


@dataclass(kw_only=True)
class EqualHeightDifferences(HeightDifferences):
    """Height differences less their common value [m]: ``H(X_b) - H(X_a) - q``, observed as zero.

    Parameters
    ----------
    common : array of int (n,)
        Scalars ``q`` [m] (method section 2.13).
    """

    common: Index = refers("scalar", means="common value", unit="m")
    kind: ClassVar[str] = "equal_height_difference"
    facts: ClassVar[KindFacts] = KindFacts(
        title="equal height difference",
        computed="height difference less the unknown value that a set of pairs shares",
        role=Role.CONDITION,
        category=Category.OTHER,
        axes=ObservedAxes.HEIGHTS,
        repeats=Repetition.NEVER,
        start=StartTie.NONE,
        csv=(),
    )

    def predict(self, state: State) -> Array:
        """``dH - q``, (n, 1)."""
        return super().predict(state) - state.scalar(self.common)[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """As the height difference, and -1 by the common value."""
        columns = state.layout.columns("scalar", self.common)
        return [*super().jacobian(state), Block(columns, np.full((len(self), 1, 1), -1.0))]

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """None: the common value is not known."""
