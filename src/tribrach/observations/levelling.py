"""Height differences, and pairs of positions that share one distance or height difference."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach._types import Array, Index
from tribrach.geodesy.plumb import PlumbLines
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
from tribrach.observations.sights import DEFLECTION_UNKNOWN, SlopeDistances
from tribrach.observations.ties import Rises, TieCollector
from tribrach.observations.unknowns import State


@dataclass(kw_only=True)
class HeightDifferences(Observations):
    """Height differences ``H(X_b) - H(X_a)`` [m] of levelling.

    The height is that of the site (U on a flat site, ellipsoidal otherwise) minus the geoid height
    of each end, as far as geoid or plumb lines are known. Heights of rod or instrument over the
    marks are added (method section 2.4).
    """

    #: (n,): positions
    start: Index = refers("position", end=End.FROM)
    end: Index = refers("position", end=End.TO)
    #: (n,): heights over the marks of what was levelled [m]
    height_start: Array = per_item(0.0)
    height_end: Array = per_item(0.0)
    #: (n,): geoid heights [m] of this line, instead of what ``plumb`` knows
    geoid_start: Array = per_item(np.nan)
    geoid_end: Array = per_item(np.nan)
    #: (n,): scalars to be added to the deflection between both ends [rad], -1 for none
    xi_error: Index = refers("scalar", optional=True, means=DEFLECTION_UNKNOWN, unit="rad")
    eta_error: Index = refers("scalar", optional=True, means=DEFLECTION_UNKNOWN, unit="rad")
    site: Site = field(default_factory=FlatSite)
    #: geoid heights of the positions, or the plumb lines from which their differences follow
    plumb: PlumbLines = field(default_factory=PlumbLines)
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

    @property
    def stated_rise(self) -> Array:
        """Rise of the geoid (n,) [m] that is stated with the lines themselves, else 0."""
        rise: Array = np.nan_to_num(self.geoid_end - self.geoid_start)
        return rise

    def _geoid(self, state: State) -> tuple[Array, Array]:
        """Known rise of the geoid (n,) [m], and the lean between the ends besides (n, 2) [rad]."""
        rise, lean = self.plumb.rise(self.site, self.start, self.end, state.positions)
        given = self.geoid_end - self.geoid_start
        known = ~np.isnan(given)
        rise[known], lean[known] = given[known], 0.0
        errors = np.stack([state.scalar(self.xi_error), state.scalar(self.eta_error)], axis=1)
        return rise, lean + errors

    def _run(self, state: State) -> tuple[Array, Array]:
        """Ways to the north and to the east (n, 2) [m], and these axes (n, 2, 3) in W."""
        start = state.positions[self.start]
        axes = self.site.axes(start)[:, [1, 0]]
        run: Array = np.einsum("nij,nj->ni", axes, state.positions[self.end] - start)
        return run, axes

    def predict(self, state: State) -> Array:
        """Height differences (n, 1)."""
        x = state.positions
        upper = self.site.height(x[self.end]) + self.height_end
        lower = self.site.height(x[self.start]) + self.height_start
        rise, lean = self._geoid(state)
        run, _ = self._run(state)
        values: Array = upper - lower - rise + (lean * run).sum(axis=1)
        return values[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """The vertical at either end: + at the end, - at the start; the way by the deflection."""
        x, columns = state.positions, state.layout.position_columns
        _, lean = self._geoid(state)
        run, axes = self._run(state)
        slope = np.einsum("ni,nij->nj", lean, axes)[:, None]
        up_end = self.site.axes(x[self.end])[:, 2:] + slope
        up_start = self.site.axes(x[self.start])[:, 2:] + slope
        blocks = [Block(columns(self.end), up_end), Block(columns(self.start), -up_start)]
        for axis, index in enumerate((self.xi_error, self.eta_error)):
            blocks += self.if_any(state, "scalar", index, run[:, axis, None, None])
        return blocks

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Rises from mark to mark."""
        over = (self.height_start - self.height_end)[rows]
        over = over + self.stated_rise[rows]
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
    """

    common: Index = refers("scalar", means="common value", unit="m")  #: (n,): scalars ``q`` [m]
    kind: ClassVar[str] = "equal_distance"
    facts: ClassVar[KindFacts] = KindFacts(
        title="equal distance",
        computed="length between two positions less the unknown value that a set of pairs shares",
        role=Role.CONDITION,
        category=Category.OTHER,
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
    """Height differences less their common value [m]: ``H(X_b) - H(X_a) - q``, observed as zero."""

    #: (n,): scalars ``q`` [m] (method section 2.13)
    common: Index = refers("scalar", means="common value", unit="m")
    kind: ClassVar[str] = "equal_height_difference"
    facts: ClassVar[KindFacts] = KindFacts(
        title="equal height difference",
        computed="height difference less the unknown value that a set of pairs shares",
        role=Role.CONDITION,
        category=Category.OTHER,
        axes=ObservedAxes.HEIGHTS,
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
