"""A model made of triangles, each of a named element."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tribrach._types import Array, Index, Mask

#: corners nearer than this share of the extent are one
_SAME = 1e-9


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with the elements that they are of."""

    triangles: Array  #: (n, 3, 3), corners [m]
    element: Index  #: (n,), number of the element of each
    names: tuple[str, ...]  #: names of the elements
    crs: str | None = None  #: reference system as WKT, None where nothing says so
    #: what was left out or assumed when it was read, without the final stop
    sentences: tuple[str, ...] = ()

    @classmethod
    def of(cls, parts: Sequence[tuple[str, Array]], **more: Any) -> Self:
        """A mesh of named parts of triangles (k, 3, 3); parts of one name are one element."""
        names = tuple(dict.fromkeys(name for name, some in parts if len(some)))
        kept = [(name, some) for name, some in parts if len(some)]
        triangles = np.concatenate([np.empty((0, 3, 3)), *(some for _, some in kept)])
        numbers = [np.full(len(some), names.index(name)) for name, some in kept]
        element = np.concatenate([np.empty(0, dtype=np.int64), *numbers])
        return cls(triangles, element.astype(np.int64), names, **more)

    def __len__(self) -> int:
        return len(self.triangles)

    @property
    def across(self) -> Array:
        """Products (n, 3) of two sides: along the normals, twice the areas long [m^2]."""
        a, b, c = self.triangles.transpose(1, 0, 2)
        return np.asarray(np.cross(b - a, c - a))

    @property
    def areas(self) -> Array:
        """Areas (n,) [m^2]."""
        return np.asarray(np.linalg.norm(self.across, axis=1) / 2)

    @property
    def normals(self) -> Array:
        """Unit normals (n, 3), to the side from which corners run anticlockwise."""
        across = self.across
        return np.asarray(across / np.linalg.norm(across, axis=1, keepdims=True))

    @property
    def corners(self) -> tuple[Array, Array]:
        """Lowest and highest coordinates (3,) [m]."""
        return self.triangles.min(axis=(0, 1)), self.triangles.max(axis=(0, 1))

    def subset(self, chosen: Mask) -> Mesh:
        """Some of the triangles (n,)."""
        return replace(self, triangles=self.triangles[chosen], element=self.element[chosen])

    def by_faces(self, angle: float = np.radians(1.0)) -> Mesh:
        """Make an element of every flat face, of neighbours in one element within ``angle``."""
        one, two = self._neighbours(self._edges()[0])
        normals = self.normals
        flat = np.einsum("ni,ni->n", normals[one], normals[two]) > np.cos(angle)
        flat &= self.element[one] == self.element[two]
        face = _joined(one[flat], two[flat], len(self))
        # in the order of the file, by element
        _, first, number = np.unique(face, return_index=True, return_inverse=True)
        rank = np.argsort(np.argsort(first))
        names, counts = [""] * len(first), [0] * len(self.names)
        for at in np.sort(first):
            of = self.element[at]
            counts[of] += 1
            names[rank[number[at]]] = f"{self.names[of]}/{counts[of]}"
        return replace(self, element=rank[number], names=tuple(names))

    def outwards(self) -> tuple[Mesh, bool]:
        """Turn triangles to the side from which they are seen, where the model tells it.

        Closed bodies get their normals outwards, open sheets of terrain theirs up; True if all of
        it is one of these.
        """
        edge, sense = self._edges()
        body = _joined(*self._neighbours(edge), len(self))
        count, balance = np.bincount(edge), np.bincount(edge, sense)
        of_edge = np.repeat(body, 3)
        bodies = int(body.max()) + 1
        wound = np.bincount(of_edge[(count[edge] > 2) | (abs(balance[edge]) > 1)], minlength=bodies)
        wound += np.bincount(of_edge[(count[edge] == 2) & (balance[edge] != 0)], minlength=bodies)
        borders = np.bincount(of_edge[count[edge] == 1], minlength=bodies)
        first = self.triangles[np.unique(body, return_index=True)[1], 0]
        corners = self.triangles - first[body][:, None]
        volume = np.bincount(body, np.linalg.det(corners)) / 6
        up = self.across[:, 2]
        rises, falls = np.bincount(body, up > 0), np.bincount(body, up < 0)
        size = np.bincount(body)
        closed = (wound == 0) & (borders == 0) & (volume != 0)
        sheet = (wound == 0) & (borders > 0) & ((rises == size) | (falls == size))
        back = np.where(closed, volume < 0, sheet & (falls == size))[body]
        turned = np.where(back[:, None, None], self.triangles[:, ::-1], self.triangles)
        return replace(self, triangles=turned), bool((closed | sheet).all())

    def _edges(self) -> tuple[Index, Array]:
        """Numbers (3 n,) of the sides of all triangles, shared ones alike, and their senses."""
        low, high = self.corners
        step = max(float(np.abs(high - low).max()) * _SAME, 1e-12)
        keys = np.round((self.triangles - low).reshape(-1, 3) / step).astype(np.int64)
        order = np.lexsort(keys.T)
        new = np.ones(len(keys), dtype=bool)
        new[1:] = (keys[order[1:]] != keys[order[:-1]]).any(axis=1)
        corner = np.empty(len(keys), dtype=np.int64)
        corner[order] = np.cumsum(new) - 1
        one = corner.reshape(-1, 3)
        two = np.roll(one, -1, axis=1)
        both = (np.minimum(one, two) * len(keys) + np.maximum(one, two)).ravel()
        number = np.unique(both, return_inverse=True)[1].ravel()
        return number.astype(np.int64), np.where(one < two, 1.0, -1.0).ravel()

    @staticmethod
    def _neighbours(edge: Index) -> tuple[Index, Index]:
        """Pairs of triangles that share a side."""
        order = np.argsort(edge, kind="stable")
        same = edge[order[:-1]] == edge[order[1:]]
        return order[:-1][same] // 3, order[1:][same] // 3


def _joined(one: Index, two: Index, count: int) -> Index:
    """Component numbers (count,) of items that are connected by pairs."""
    graph = coo_array((np.ones(len(one), dtype=bool), (one, two)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)
