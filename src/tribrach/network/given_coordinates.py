"""Tests every given coordinate by itself: those with a sigma and those held without error alike.

A coordinate that is held is no observation and has no residual. What would its error do? With the
derivatives ``J_c`` by the coordinate, an error g in it moves all predictions by ``J_c g``, which is
a bias ``-J_c g`` of the observations: one more parameter, tested like any other bias. A weighted
coordinate is an observation, and its bias is that of its own row (method section 3.4). Both stand
here as whitened columns ``Z``, with ``S = Z^T Q Z`` over the residuals and ``y = Z^T v``:

    g = -y / S_ii,      w = y / sqrt(S_ii)

The rank of S is what the observations know of the given coordinates: where it is zero nothing
checks them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from tribrach._types import Array, Index, Mask
from tribrach.network.adjustment import Adjustment
from tribrach.network.assembly import Assembly
from tribrach.network.network import JointCovariance, Network, is_given
from tribrach.network.roles import used_axes
from tribrach.observations.base import Observations, Use
from tribrach.observations.control import Coordinate, Coordinates
from tribrach.observations.declaration import End

#: names of the axes of the work frame
AXES = "ENU"
#: most given coordinates that are tested, those first that residuals pull at most
_MOST = 1500
#: share of a bias that must be left in the residuals to be tested at all
UNCONTROLLED = 1e-7


@dataclass(frozen=True)
class GivenCoordinate:
    """One given coordinate of a point."""

    point: str  #: name of the point
    axis: int  #: 0, 1, 2 for E, N, U of the work frame
    column: int  #: column of the full tangent vector
    #: the observed value that gives it a weight; -1 where it is held without error
    table: int = -1
    item: int = -1
    row: int = -1
    source: str = ""  #: ``file:line``, "" where it is not known

    @property
    def held(self) -> bool:
        """True if it is held without error."""
        return self.table < 0


def coordinate_words(coordinates: Sequence[GivenCoordinate]) -> str:
    """Coordinates of one point in words: ``the given E and N of P4 (control.csv:5)``."""
    first = coordinates[0]
    axes = [AXES[g.axis] for g in coordinates]
    listed = " and ".join(filter(None, [", ".join(axes[:-1]), axes[-1]]))
    state = "held" if first.held else "given"
    return f"the {state} {listed} of {first.point}" + f" ({first.source})" * bool(first.source)


@dataclass(frozen=True)
class GivenCoordinates:
    """Given coordinates of an adjusted network as biases of its observations."""

    adjustment: Adjustment  #: the network
    items: tuple[GivenCoordinate, ...]  #: the coordinates (k,)
    columns: sp.csc_array  #: (n, k), whitened columns ``Z``
    left: Array  #: (k, k), ``S``: what of them the residuals show
    pull: Array  #: (k,), ``y = Z^T v``
    weight: Array  #: (k,), diagonal of ``Z^T Z``

    @cached_property
    def controlled(self) -> Mask:
        """Coordinates (k,) whose error other values would show."""
        return np.diag(self.left) > UNCONTROLLED * self.weight

    def words(self, members: Index) -> str:
        """Coordinates (m,) of one point in words: ``the given E and N of P4 (control.csv:5)``."""
        return coordinate_words([self.items[k] for k in members])

    def same_point(self, one: Index, other: Index) -> bool:
        """True if coordinates of two sets belong to one point."""
        return bool(self.items[one[0]].point == self.items[other[0]].point)

    def rank(self, chosen: Mask) -> int:
        """Directions in the space of some coordinates (k,) whose errors other values would show."""
        if not chosen.any():
            return 0
        size = np.sqrt(np.where(self.weight > 0, self.weight, 1.0))[chosen]
        unit = self.left[np.ix_(chosen, chosen)] / np.outer(size, size)
        return int((np.linalg.eigvalsh((unit + unit.T) / 2) > UNCONTROLLED).sum())

    def test(self, members: Index) -> tuple[float, int, Array, Array]:
        """Test of some coordinates as a whole.

        ``members`` (m,): which of ``items``. Returns chi-square if nothing is wrong with them, and
        its degrees of freedom; ``error``, ``sigma`` (m,): what is wrong with them, given less true
        [m], and its standard deviation.
        """
        size = np.sqrt(np.where(self.weight[members] > 0, self.weight[members], 1.0))
        unit = self.left[np.ix_(members, members)] / np.outer(size, size)
        values, vectors = np.linalg.eigh((unit + unit.T) / 2)
        seen = values > UNCONTROLLED
        if not seen.any():
            return 0.0, 0, np.zeros(len(members)), np.full(len(members), np.inf)
        inverse = (vectors[:, seen] / values[seen]) @ vectors[:, seen].T
        pull = self.pull[members] / size
        error: Array = -(inverse @ pull) / size
        sigma = np.sqrt(np.diag(inverse)) / size
        return float(pull @ inverse @ pull), int(seen.sum()), error, sigma


def given_coordinates(adjustment: Adjustment) -> GivenCoordinates:
    """Look at all given coordinates that take part in an adjustment."""
    # asked for wrong ones and for what is checked by nothing
    return GivenCoordinates(
        adjustment, *adjustment.once(given_coordinates, lambda: _looked_at(adjustment))
    )


def _looked_at(
    adjustment: Adjustment,
) -> tuple[tuple[GivenCoordinate, ...], sp.csc_array, Array, Array, Array]:
    """Items, whitened columns, ``left``, pull and weight of those that are looked at."""
    items = [*_held(adjustment), *_weighted(adjustment)]
    columns = _columns(adjustment, items)
    weight = np.asarray(columns.multiply(columns).sum(axis=0)).ravel()
    pull = columns.T @ adjustment.whitened_residuals
    touched = np.flatnonzero(weight > 0)
    strength = np.abs(pull[touched]) / np.sqrt(weight[touched])
    chosen = np.sort(touched[np.argsort(-strength, kind="stable")[:_MOST]])
    columns, weight, pull = columns[:, chosen], weight[chosen], pull[chosen]
    left = _left(adjustment, columns)
    return tuple(items[k] for k in chosen), columns, left, pull, weight


def _held(adjustment: Adjustment) -> list[GivenCoordinate]:
    """Coordinates of points that are held without error."""
    layout, network = adjustment.layout, adjustment.network
    names = layout.names["point"]
    free = network.free[: 3 * len(names)].reshape(-1, 3)
    held = ~free & used_axes(adjustment) & np.isfinite(network.start.points)
    return [
        GivenCoordinate(
            names[p],
            int(axis),
            3 * int(p) + int(axis),
            source=network.point_sources.get(names[p], ""),
        )
        for p, axis in np.argwhere(held)
    ]


def _weighted(adjustment: Adjustment) -> list[GivenCoordinate]:
    """Coordinates that are observed with a sigma and take part."""
    layout, used = adjustment.layout, used_axes(adjustment)
    out = []
    for table, o in enumerate(adjustment.network.observations):
        axes, at = o.coordinate_axes(), o.end_field(End.AT)
        if not is_given(type(o), o.group) or axes is None or at is None:
            continue
        position = np.asarray(getattr(o, at.name))
        columns = layout.position_columns(position)
        for item in np.flatnonzero(o.use == Use.ACTIVE):
            name = layout.position_name(int(position[item]))
            for row, axis in enumerate(axes[item]):
                if used[axis]:
                    column, source = int(columns[item, axis]), str(o.source[item])
                    out.append(
                        GivenCoordinate(name, int(axis), column, table, int(item), row, source)
                    )
    return out


def _columns(adjustment: Adjustment, items: list[GivenCoordinate]) -> sp.csc_array:
    """Whitened columns (n, k) of biases of given coordinates."""
    held = np.array([g.column for g in items if g.held], dtype=np.int64)
    free = adjustment.network.free.copy()
    free[held] = True
    wide = Assembly(replace(adjustment.network, free=free))
    parts = [-sp.csc_array(wide.design(adjustment.state))[:, wide.reduced[held]]]
    at = np.array([(g.table, g.item, g.row) for g in items if not g.held], dtype=np.int64)
    own = adjustment.assembly.row_numbers(*at.reshape(-1, 3).T)
    parts.append(sp.csc_array(adjustment.whitener)[:, own])
    return sp.csc_array(sp.hstack(parts))


def _left(adjustment: Adjustment, columns: sp.csc_array) -> Array:
    """``Z^T Z - Z^T A Q A^T Z`` (k, k)."""
    out: Array = (columns.T @ columns).toarray()
    seen = sp.csc_array(adjustment.design.T @ columns)
    if columns.shape[1]:
        out -= adjustment.cofactor.forms(seen, columns.shape[1])[0]
    return out


def released(network: Network, coordinates: tuple[GivenCoordinate, ...]) -> Network:
    """The same network without some given coordinates of one point: they become free."""
    free = network.free.copy()
    free[[g.column for g in coordinates if g.held]] = True
    network = replace(network, free=free)
    weighted = [g for g in coordinates if not g.held]
    for table, item in dict.fromkeys((g.table, g.item) for g in weighted):
        gone = [g.row for g in weighted if (g.table, g.item) == (table, item)]
        network = _split(network, table, item, gone)
    return network


def _split(network: Network, table: int, item: int, gone: list[int]) -> Network:
    """Switch an observation of coordinates off and keep those of its values that are not gone."""
    o = network.observations[table]
    rest = [row for row in range(o.rows) if row not in gone]
    off = network.switched([(table, item)], Use.OFF, "tried without it")
    if not rest:
        return off
    assert isinstance(o, Coordinates)
    number, covariance = len(network.observations), o.covariance[item][np.ix_(rest, rest)]
    single = Coordinate(
        values=o.values[item][rest][:, None],
        covariance=np.diag(covariance)[:, None, None],
        position=np.full(len(rest), o.position[item]),
        axis=np.array(rest),
        source=np.full(len(rest), o.source[item], dtype=object),
        group=o.group,
    )
    joint = tuple(_moved(j, table, item, rest, number) for j in network.joint)
    if not any(a is not b for a, b in zip(joint, network.joint, strict=True)):
        own = JointCovariance(
            np.full(len(rest), number), np.arange(len(rest)), np.zeros(len(rest), int), covariance
        )
        joint = (*joint, own)
    tables: tuple[Observations, ...] = (*off.observations, single)
    return replace(off, observations=tables, joint=joint)


def _moved(
    joint: JointCovariance, table: int, item: int, rest: list[int], to: int
) -> JointCovariance:
    """A joint covariance whose values of a split observation stand in another table now."""
    mine = (joint.table == table) & (joint.item == item)
    if not mine.any():
        return joint
    keep = ~mine | np.isin(joint.row, rest)
    moved = mine[keep]
    number = np.array(
        [rest.index(r) if m else 0 for r, m in zip(joint.row[keep], moved, strict=True)]
    )
    left = joint.part(np.flatnonzero(keep))
    return replace(
        left,
        table=np.where(moved, to, left.table),
        item=np.where(moved, number, left.item),
        row=np.where(moved, 0, left.row),
    )
