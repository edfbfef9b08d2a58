"""What is known beforehand: coordinates, offsets between marks, values of other unknowns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.geodesy.site import FlatSite, Site
from tribrach.observations.base import Block, Observations, per_item, refers
from tribrach.observations.declaration import (
    Category,
    CsvColumns,
    End,
    KindFacts,
    ObservedAxes,
    Repetition,
    Role,
    StartTie,
    shaped,
)
from tribrach.observations.sights import Sights
from tribrach.observations.ties import Fixes, TieCollector, Vectors
from tribrach.observations.unknowns import Layout, State

#: sigma of given coordinates that came without one and are only compared with [m]; chosen by hand
CHECK_SIGMA = 1e-4


@dataclass(kw_only=True)
class Coordinates(Observations):
    """Coordinates E, N, U [m] with their covariance: weighted control (method section 2.13)."""

    position: Index = refers("position", end=End.AT)  #: (n,): positions
    kind: ClassVar[str] = "coordinates"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("E", "N", "U")
    facts: ClassVar[KindFacts] = KindFacts(
        title="coordinates",
        computed="given coordinates E, N, U",
        role=Role.GIVEN,
        category=Category.CONTROL,
        start=StartTie.FIX,
        csv=(CsvColumns(("point",), ("e", "n", "u")),),
        absolute=True,
        listed_as_control=True,
    )

    def predict(self, state: State) -> Array:
        """Coordinates (n, 3)."""
        return state.positions[self.position]

    def jacobian(self, state: State) -> list[Block]:
        """Identity."""
        columns = state.layout.position_columns(self.position)
        return [Block(columns, np.broadcast_to(np.eye(3), (len(self), 3, 3)))]

    def coordinate_axes(self) -> Index | None:
        """All three."""
        return np.tile(np.arange(3), (len(self), 1))

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Coordinates."""
        ties.add(Fixes(self.position[rows], self.values[rows]))


@dataclass(kw_only=True)
class Coordinate(Observations):
    """Single coordinates [m]: control known in plan or in height alone (method section 2.13)."""

    position: Index = refers("position", end=End.AT)  #: (n,): positions
    axis: Index = shaped(whole=True)  #: (n,): 0 for E, 1 for N, 2 for U
    kind: ClassVar[str] = "coordinate"
    units: ClassVar[tuple[str, ...]] = ("m",)
    facts: ClassVar[KindFacts] = KindFacts(
        title="coordinate",
        computed="one given coordinate",
        role=Role.GIVEN,
        category=Category.CONTROL,
        start=StartTie.FIX,
        csv=(CsvColumns(("point",), ("e", "n", "u")),),
        absolute=True,
        listed_as_control=True,
    )

    def end_names(self, layout: Layout) -> tuple[NDArray[np.object_], NDArray[np.object_]]:
        """The position and the axis."""
        axes = np.array(("E", "N", "U"), dtype=object)
        return layout.name_array("position")[self.position], axes[self.axis]

    def predict(self, state: State) -> Array:
        """Coordinates (n, 1)."""
        return state.positions[self.position, self.axis][:, None]

    def jacobian(self, state: State) -> list[Block]:
        """1 by the observed coordinate."""
        columns = state.layout.position_columns(self.position)[np.arange(len(self)), self.axis]
        return [Block(columns[:, None], np.ones((len(self), 1, 1)))]

    @classmethod
    def observed_axes(cls, columns: Mapping[str, Any]) -> ObservedAxes:
        """Those of the coordinates."""
        up = np.asarray(columns["axis"]).astype(int) == 2
        return (
            ObservedAxes.HEIGHTS
            if up.all()
            else ObservedAxes.SPACE
            if up.any()
            else ObservedAxes.PLAN
        )

    def coordinate_axes(self) -> Index | None:
        """The one of each."""
        return self.axis[:, None]

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Coordinates along one axis."""
        xyz = np.full((len(rows), 3), np.nan)
        xyz[np.arange(len(rows)), self.axis[rows]] = self.values[rows, 0]
        ties.add(Fixes(self.position[rows], xyz))


@dataclass(kw_only=True)
class DirectedComponents(Observations):
    """Components ``a . X`` [m] of positions along given directions ``a`` of the work frame.

    For control that is known in one direction only which is not an axis of W: the ellipsoidal
    height or the latitude of a station away from the origin (method section 2.13).
    """

    position: Index = refers("position", end=End.AT)  #: (n,): positions
    direction: Array = shaped(3)  #: (n, 3): unit vectors ``a`` in W
    kind: ClassVar[str] = "component"
    units: ClassVar[tuple[str, ...]] = ("m",)
    facts: ClassVar[KindFacts] = KindFacts(
        title="component",
        computed="coordinate along a given direction, `a . X`",
        role=Role.GIVEN,
        category=Category.CONTROL,
        absolute=True,
    )

    def predict(self, state: State) -> Array:
        """Components (n, 1)."""
        x = state.positions[self.position]
        out: Array = np.einsum("ni,ni->n", self.direction, x)
        return out[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """The direction."""
        columns = state.layout.position_columns(self.position)
        return [Block(columns, self.direction[:, None, :])]


@dataclass(kw_only=True)
class Heights(Observations):
    """Heights ``H(X)`` [m]: control in height alone (method section 2.13).

    The height is that of the site: U on a flat site, the height over the ellipsoid or sphere
    otherwise, so that a benchmark far from the origin of W keeps its height while its plan position
    is still unknown.
    """

    position: Index = refers("position", end=End.AT)  #: (n,): positions
    site: Site = field(default_factory=FlatSite)
    kind: ClassVar[str] = "height"
    units: ClassVar[tuple[str, ...]] = ("m",)
    facts: ClassVar[KindFacts] = KindFacts(
        title="height",
        computed="given height",
        role=Role.GIVEN,
        category=Category.CONTROL,
        axes=ObservedAxes.HEIGHTS,
        start=StartTie.FIX,
        absolute=True,
        listed_as_control=True,
    )

    def predict(self, state: State) -> Array:
        """Heights (n, 1)."""
        return self.site.height(state.positions[self.position])[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """The up axis."""
        x = state.positions[self.position]
        columns = state.layout.position_columns(self.position)
        return [Block(columns, self.site.axes(x)[:, 2:])]

    def coordinate_axes(self) -> Index | None:
        """The height."""
        return np.full((len(self), 1), 2)

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Coordinates in height."""
        xyz = np.full((len(rows), 3), np.nan)
        xyz[:, 2] = self.values[rows, 0]
        ties.add(Fixes(self.position[rows], xyz))


@dataclass(kw_only=True)
class Offsets(Sights):
    """Vectors [m] east, north, up from one position to another in the local axes of the first.

    ``u = L(X_a) (X_b + h_b g_b - X_a) - h_a e_3``: a sphere's centre over its mark, a prism or
    antenna beside it, a scanner's centre over the occupied mark. With the value zero and held
    exactly it makes two positions coincide. An offset tilted by the bubble of its pole has the
    covariance ``(h sigma_bubble)^2`` in plan (method sections 2.6 and 2.13).
    """

    kind: ClassVar[str] = "offset"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("E", "N", "U")
    facts: ClassVar[KindFacts] = KindFacts(
        title="offset",
        computed="vector from one position to another in the local axes of the first",
        role=Role.READING,
        category=Category.CENTRING,
        repeats=Repetition.SETS,
        start=StartTie.VECTOR,
        csv=(CsvColumns(("mark", "target"), ("rod",)),),
        names_target=True,
    )

    def predict(self, state: State) -> Array:
        """Vectors (n, 3)."""
        return self.sight(state)

    def jacobian(self, state: State) -> list[Block]:
        """Identity by the sight."""
        return self.sight_blocks(state, np.broadcast_to(np.eye(3), (len(self), 3, 3)))

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Vectors from mark to mark."""
        value = self.values[rows].copy()
        value[:, 2] -= self.lift(rows, ties.start)
        ties.add(Vectors(self.start[rows], self.end[rows], value))


@dataclass(kw_only=True)
class ScalarPriors(Observations):
    """Known values of scalars, each in its scalar's own unit: weighted parameters.

    An EDM zero, a refraction coefficient, a calibration parameter, a height of instrument (method
    section 2.13).
    """

    scalar: Index = refers("scalar", end=End.AT)  #: (n,): scalars
    kind: ClassVar[str] = "scalar_prior"
    units: ClassVar[tuple[str, ...]] = ("1",)
    facts: ClassVar[KindFacts] = KindFacts(
        title="scalar prior",
        computed="known value of a scalar: zero constant, refraction, calibration parameter",
        role=Role.PRIOR,
        category=Category.OTHER,
        axes=ObservedAxes.NONE,
        start=StartTie.VALUE,
        of_unknown=True,
    )

    def predict(self, state: State) -> Array:
        """Values (n, 1)."""
        return state.scalars[self.scalar][:, None]

    def jacobian(self, state: State) -> list[Block]:
        """1 by the scalar."""
        columns = state.layout.columns("scalar", self.scalar)
        return [Block(columns, np.ones((len(self), 1, 1)))]


@dataclass(kw_only=True)
class VectorPriors(Observations):
    """Known values [m] of vectors in their own frames: lever arms, common shift of a session."""

    vector: Index = refers("vector", end=End.AT)  #: (n,): vectors (method section 2.13)
    kind: ClassVar[str] = "vector_prior"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    facts: ClassVar[KindFacts] = KindFacts(
        title="stated value",
        computed="known value of a vector: lever arm, common shift of a session",
        role=Role.PRIOR,
        category=Category.GNSS,
        axes=ObservedAxes.NONE,
        start=StartTie.VALUE,
    )

    def predict(self, state: State) -> Array:
        """Values (n, 3)."""
        return state.vectors[self.vector]

    def jacobian(self, state: State) -> list[Block]:
        """Identity by the vector."""
        columns = state.layout.columns("vector", self.vector)
        return [Block(columns, np.broadcast_to(np.eye(3), (len(self), 3, 3)))]


@dataclass(kw_only=True)
class VectorComponentPriors(Observations):
    """Known components [m] of vectors, where others are held or unknown."""

    vector: Index = refers("vector", end=End.AT)  #: (n,): vectors (method section 2.13)
    axis: Array = per_item(0.0)  #: (n,): 0, 1, 2 for x, y, z
    kind: ClassVar[str] = "vector_component_prior"
    units: ClassVar[tuple[str, ...]] = ("m",)
    facts: ClassVar[KindFacts] = KindFacts(
        title="vector component prior",
        computed="known component of a vector",
        role=Role.PRIOR,
        category=Category.GNSS,
        axes=ObservedAxes.NONE,
    )

    def end_names(self, layout: Layout) -> tuple[NDArray[np.object_], NDArray[np.object_]]:
        """The vector and its component."""
        axes = np.array(("x", "y", "z"), dtype=object)
        return layout.name_array("vector")[self.vector], axes[self._axis]

    @property
    def _axis(self) -> Index:
        return self.axis.astype(np.int64)

    def predict(self, state: State) -> Array:
        """Values (n, 1)."""
        return state.vectors[self.vector, self._axis][:, None]

    def jacobian(self, state: State) -> list[Block]:
        """1 by the component."""
        columns = state.layout.columns("vector", self.vector)
        values = np.zeros((len(self), 1, 3))
        values[np.arange(len(self)), 0, self._axis] = 1.0
        return [Block(columns, values)]


@dataclass(kw_only=True)
class Centrings(VectorComponentPriors):
    """Components [m] of the eccentricity of what stands over a mark, zero as far as is known.

    Whoever centres an instrument or a target means the vector to be zero; all sights of one
    occupation have the same (method section 2.3).
    """

    kind: ClassVar[str] = "centring"
    facts: ClassVar[KindFacts] = KindFacts(
        title="centring",
        computed="zero eccentricity of an occupation, which its sights have in common",
        role=Role.READING,
        category=Category.CENTRING,
        axes=ObservedAxes.NONE,
        nuisance=True,
    )

    def end_names(self, layout: Layout) -> tuple[NDArray[np.object_], NDArray[np.object_]]:
        """The occupation with the component; no other end."""
        vectors = layout.name_array("vector")[self.vector]
        names = np.empty(len(self), dtype=object)
        names[:] = [
            f"{vector.removeprefix(self.kind + ' ')}, {'ENU'[axis]}"
            for vector, axis in zip(vectors, self._axis, strict=True)
        ]
        return names, np.full(len(self), "", dtype=object)


@dataclass(kw_only=True)
class RefractionChanges(ScalarPriors):
    """Changes, zero as far as known, of refraction that a set-up's sights share (section 2.3)."""

    kind: ClassVar[str] = "refraction_change"
    facts: ClassVar[KindFacts] = KindFacts(
        title="change of refraction",
        computed="zero change of the coefficient of refraction, which sights of a set-up share",
        role=Role.READING,
        category=Category.TOTAL_STATION,
        axes=ObservedAxes.NONE,
        start=StartTie.VALUE,
        of_unknown=True,
        nuisance=True,
    )
