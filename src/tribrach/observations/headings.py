"""Headings of scanners: the azimuth of an axis of the instrument, as a compass shows it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach._types import Array, Index
from tribrach.geodesy.site import FlatSite, Site
from tribrach.geometry.rotation import skew
from tribrach.observations.base import Block, Observations, per_item, refers, wrap
from tribrach.observations.declaration import (
    Category,
    CsvColumns,
    End,
    KindFacts,
    ObservedAxes,
    Repetition,
    Role,
    StartTie,
)
from tribrach.observations.sights import azimuth_by_sight
from tribrach.observations.ties import TieCollector
from tribrach.observations.unknowns import State


@dataclass(kw_only=True)
class Headings(Observations):
    """Azimuths [rad] of an axis of the scanner, clockwise from north: ``atan2(E', N') - o``.

    ``u = L(t) R a = (E', N', U')`` is the axis ``a = (cos d, sin d, 0)`` of the scanner frame in
    the local axes of the station; ``o`` is an optional unknown that the headings of one compass
    share: declination and mounting (method section 2.9).
    """

    station: Index = refers("pose", end=End.AT)  #: (n,): poses
    direction: Array = per_item(0.0)  #: (n,): ``d`` from the x axis towards y [rad]
    #: (n,): scalars ``o``, -1 for none
    offset: Index = refers("scalar", optional=True, means="heading offset", unit="rad")
    site: Site = field(default_factory=FlatSite)
    kind: ClassVar[str] = "heading"
    units: ClassVar[tuple[str, ...]] = ("rad",)
    angular: ClassVar[tuple[int, ...]] = (0,)
    facts: ClassVar[KindFacts] = KindFacts(
        title="heading",
        computed="azimuth of an axis of the scanner, less an offset that one compass has",
        role=Role.READING,
        category=Category.OTHER,
        own_category=Category.BACKSIGHT,
        axes=ObservedAxes.PLAN,
        repeats=Repetition.SETS,
        start=StartTie.HEADING,
        csv=(CsvColumns(("station",), ("heading",)),),
        full_circle=True,
    )

    def _axis(self, state: State) -> tuple[Array, Array, Array]:
        """The axis in W (n, 3), local axes (n, 3, 3), the axis in them (n, 3)."""
        d = self.direction
        own = np.stack([np.cos(d), np.sin(d), np.zeros(len(self))], axis=1)
        a = np.einsum("nij,nj->ni", state.pose_r[self.station], own)
        local = self.site.axes(state.pose_t[self.station])
        return a, local, np.einsum("nij,nj->ni", local, a)

    def predict(self, state: State) -> Array:
        """Headings (n, 1) in (-pi, pi]."""
        _, _, u = self._axis(state)
        return wrap(np.arctan2(u[:, 0], u[:, 1]) - state.scalar(self.offset))[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """``-[N', -E', 0]/h'^2 L [a]x`` by the rotation, its opposite through the vertical's turn.

        -1 by the offset.
        """
        a, local, u = self._axis(state)
        by_turn = -azimuth_by_sight(u) @ local @ skew(a)
        by_t = -by_turn @ self.site.turn(state.pose_t[self.station])
        by_pose = np.concatenate([by_t, by_turn], axis=2)
        by_offset = np.full((len(self), 1, 1), -1.0)
        return [
            Block(state.layout.columns("pose", self.station), by_pose),
            *self.if_any(state, "scalar", self.offset, by_offset),
        ]

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Orientations of levelled scanners."""
        offset = np.zeros(len(rows))
        has = self.offset[rows] >= 0
        offset[has] = np.nan_to_num(ties.start.scalars[self.offset[rows][has]])
        # the azimuth of the x axis is a quarter turn beyond that of the y axis
        north = self.values[rows, 0] + offset + self.direction[rows] - np.pi / 2
        ties.heading[self.station[rows]] = wrap(north)
