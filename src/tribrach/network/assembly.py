"""Makes one whitened sparse system ``A dx = w`` of the observations of a network.

Rows are the active observed values in the order of ``Network.observations``; columns are the free
components of the tangent vector. Whitening (``W C W^T = I``) is applied block by block, so that no
kind knows about weights; joint covariances across observations are one sparse factor.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from tribrach._types import Array, Index
from tribrach.network.network import JointCovariance, Network
from tribrach.observations.base import Block, Observations, Use
from tribrach.observations.sights import ECCENTRICITY_UNKNOWN
from tribrach.observations.unknowns import State


@dataclass(frozen=True)
class Rows:
    """The observed value that belongs to each row of the system."""

    table: Index  #: (n,), index into ``Network.observations``
    item: Index  #: (n,), observation within the table
    row: Index  #: (n,), value within the observation

    def __len__(self) -> int:
        return len(self.table)

    @classmethod
    def of(cls, observations: tuple[Observations, ...]) -> Rows:
        """Rows of all active values."""
        parts = [(np.flatnonzero(o.use == Use.ACTIVE), o.rows) for o in observations]
        table = [np.full(len(items) * m, t) for t, (items, m) in enumerate(parts)]
        item = [np.repeat(items, m) for items, m in parts]
        row = [np.tile(np.arange(m), len(items)) for items, m in parts]
        empty = [np.empty(0, dtype=np.int64)]
        return cls(*(np.concatenate(empty + part).astype(np.int64) for part in (table, item, row)))


def inverse_cholesky(covariance: Array) -> Array:
    """``L^-1`` (n, m, m) with ``covariance = L L^T``."""
    if covariance.shape[1] == 1:
        return 1 / np.sqrt(covariance)
    lower = np.linalg.cholesky(covariance)
    if len(lower) == 1:
        unit = np.eye(lower.shape[1])
        return scipy.linalg.solve_triangular(lower[0], unit, lower=True)[None]
    inverse: Array = np.linalg.inv(lower)
    return np.tril(inverse)


class Assembly:
    """Evaluates a network at any state as whitened residuals and sparse Jacobians."""

    def __init__(self, network: Network) -> None:
        self.network = network
        self.layout = network.start.layout
        self.free_columns: Index = np.flatnonzero(network.free)
        self.reduced: Index = np.full(self.layout.size + 1, -1, dtype=np.int64)
        self.reduced[self.free_columns] = np.arange(len(self.free_columns))
        self.rows = Rows.of(network.observations)
        self.active = [np.flatnonzero(o.use == Use.ACTIVE) for o in network.observations]
        self._joint = self._joint_rows(network.joint)
        self._white = self._whiteners()

    @cached_property
    def _row_numbers(self) -> tuple[Index, Index, Index]:
        """First value of each table, values of an observation of each, row number of each value."""
        first = np.cumsum([0] + [o.values.size for o in self.network.observations])
        width = np.array([o.rows for o in self.network.observations], dtype=np.int64)
        number = np.full(first[-1], -1, dtype=np.int64)
        rows = self.rows
        number[first[rows.table] + rows.item * width[rows.table] + rows.row] = np.arange(len(rows))
        return first, width, number

    def row_numbers(self, table: Index | int, item: Index, row: Index | int) -> Index:
        """Row numbers (k,) of values by table, item and row; -1 for values that take no part."""
        first, width, number = self._row_numbers
        found: Index = number[first[table] + item * width[table] + row]
        return found

    @cached_property
    def joint_places(self) -> list[Index]:
        """Row number of each value of the joint covariances, -1 for values that take no part."""
        return [
            self.row_numbers(joint.table, joint.item, joint.row) for joint in self.network.joint
        ]

    def _joint_rows(self, joint: tuple[JointCovariance, ...]) -> list[tuple[Index, Array]]:
        """Row numbers and inverse Cholesky factor of each joint covariance, active rows only."""
        by_size: dict[int, list[tuple[Index, Array]]] = {}
        for group, place in zip(joint, self.joint_places if joint else (), strict=True):
            active = place >= 0
            if active.any():
                block = group.covariance[np.ix_(active, active)]
                by_size.setdefault(len(block), []).append((place[active], block))
        out = []
        for same in by_size.values():
            inverses = inverse_cholesky(np.stack([block for _, block in same]))
            out += [(place, one) for (place, _), one in zip(same, inverses, strict=True)]
        return out

    def _whiteners(self) -> list[Array]:
        """Per table ``L^-1`` (n, m, m) of the active observations; identity for joint rows."""
        joined = np.zeros(len(self.rows), dtype=bool)
        for place, _ in self._joint:
            joined[place] = True
        out, first = [], 0
        for observations, items in zip(self.network.observations, self.active, strict=True):
            m = observations.rows
            covariance = observations.covariance[items].copy()
            part = joined[first : first + len(items) * m].reshape(-1, m)
            covariance[part[:, :, None] | part[:, None, :]] = 0.0
            covariance[:, np.arange(m), np.arange(m)] += part
            out.append(inverse_cholesky(covariance))
            first += len(items) * m
        return out

    @cached_property
    def joint_whitener(self) -> sp.csr_array | None:
        """Sparse factor (n, n) of the joint covariances, identity elsewhere; None if none."""
        if not self._joint:
            return None
        n = len(self.rows)
        plain = np.ones(n, dtype=bool)
        rows, columns, values = [], [], []
        for place, inverse in self._joint:
            lower = np.tril_indices(len(place))
            rows.append(place[lower[0]])
            columns.append(place[lower[1]])
            values.append(inverse[lower])
            plain[place] = False
        rest = np.flatnonzero(plain)
        triple = (
            np.concatenate([*values, np.ones(len(rest))]),
            (np.concatenate([*rows, rest]), np.concatenate([*columns, rest])),
        )
        return sp.csr_array(triple, shape=(n, n))

    @cached_property
    def whitener(self) -> sp.csr_array:
        """The whole whitener ``W`` (n, n)."""
        data, rows, columns, first = [], [], [], 0
        for white in self._white:
            n, m = white.shape[:2]
            base = first + m * np.arange(n)[:, None, None]
            i, j = np.broadcast_arrays(
                base + np.arange(m)[None, :, None], base + np.arange(m)[None, None, :]
            )
            keep = np.broadcast_to(np.tri(m, dtype=bool), white.shape)
            data.append(white[keep])
            rows.append(i[keep])
            columns.append(j[keep])
            first += n * m
        triple = (np.concatenate(data), (np.concatenate(rows), np.concatenate(columns)))
        plain = sp.csr_array(triple, shape=(first, first))
        return plain if self.joint_whitener is None else (self.joint_whitener @ plain).tocsr()

    @cached_property
    def observed(self) -> Array:
        """The active values ``l`` (n,), metres and radians."""
        tables = zip(self.network.observations, self.active, strict=True)
        return np.concatenate([np.empty(0), *(o.values[items].ravel() for o, items in tables)])

    def misclosure(self, state: State) -> Array:
        """``l - h(x)`` (n,) of the active values, metres and radians."""
        parts = [
            o.misclosure(state)[items].ravel()
            for o, items in zip(self.network.observations, self.active, strict=True)
        ]
        return np.concatenate([np.empty(0), *parts])

    def whiten(self, misclosure: Array) -> Array:
        """``W w`` of values (n,) in the order of the rows."""
        parts, first = [], 0
        for white in self._white:
            n, m = white.shape[:2]
            block = misclosure[first : first + n * m].reshape(n, m)
            parts.append(np.einsum("nij,nj->ni", white, block).ravel())
            first += n * m
        out = np.concatenate([np.empty(0), *parts])
        return out if self.joint_whitener is None else self.joint_whitener @ out

    def design(self, state: State, *, whitened: bool = True) -> sp.csr_array:
        """Jacobian (n, u) over the free columns, whitened or in metres and radians."""
        data, rows, columns, first = [], [], [], 0
        for o, items, weight in zip(
            self.network.observations, self.active, self._white, strict=True
        ):
            n, m = weight.shape[:2]
            white = weight if whitened else np.broadcast_to(np.eye(m), weight.shape)
            for block in o.jacobian(state) if n else ():
                d, i, j = self._triples(block, items, white, first)
                data.append(d)
                rows.append(i)
                columns.append(j)
            first += n * m
        matrix = _sparse(data, rows, columns, (len(self.rows), len(self.free_columns)))
        if self.joint_whitener is None or not whitened:
            return matrix
        return sp.csr_array(self.joint_whitener @ matrix)

    def centred(self, state: State) -> State:
        """The state without eccentricities, at which motions are open that no sight sees.

        Eccentricities are not turned with the network, so that a turn seems to be seen a little.
        """
        if not len(self._eccentric):
            return state
        vectors = state.vectors.copy()
        vectors[self._eccentric] = 0.0
        return replace(state, vectors=vectors)

    @cached_property
    def _eccentric(self) -> Index:
        """Numbers (k,) of the vectors that are eccentricities."""
        used = [
            getattr(o, reference.name)
            for o in self.network.observations
            for reference in o.references()
            if reference.means == ECCENTRICITY_UNKNOWN
        ]
        index = np.unique(np.concatenate([np.empty(0, dtype=np.int64), *used]))
        return index[index >= 0]

    def _triples(
        self, block: Block, items: Index, white: Array, first: int
    ) -> tuple[Array, Index, Index]:
        """Whitened values, rows and reduced columns of one Jacobian block."""
        m = white.shape[1]
        values = white @ block.values[items]
        row = first + m * np.arange(len(items))[:, None, None] + np.arange(m)[None, :, None]
        column = self.reduced[block.columns[items]][:, None, :]
        row, column = (np.broadcast_to(a, values.shape) for a in (row, column))
        keep = column >= 0
        return values[keep], row[keep], column[keep]

    def constraints(self, state: State) -> tuple[sp.csr_array, Array]:
        """Hard constraints ``C dx = c``: C (q, u) over the free columns, c (q,)."""
        data, rows, columns, right, first = [], [], [], [], 0
        for constraint in self.network.constraints:
            o = constraint.observations
            items = np.flatnonzero(o.use == Use.ACTIVE)
            unit = np.broadcast_to(np.eye(o.rows), (len(items), o.rows, o.rows))
            for block in o.jacobian(state) if len(items) else ():
                d, i, j = self._triples(block, items, unit, first)
                data.append(d)
                rows.append(i)
                columns.append(j)
            right.append(o.misclosure(state)[items].ravel())
            first += len(items) * o.rows
        shape = (first, len(self.free_columns))
        return _sparse(data, rows, columns, shape), np.concatenate([np.empty(0), *right])


def _sparse(
    data: list[Array], rows: list[Index], columns: list[Index], shape: tuple[int, int]
) -> sp.csr_array:
    if not data:
        return sp.csr_array(shape)
    triple = (np.concatenate(data), (np.concatenate(rows), np.concatenate(columns)))
    return sp.csr_array(sp.coo_array(triple, shape=shape))
