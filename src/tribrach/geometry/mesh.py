"""A model made of triangles, each of a named element."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from tribrach._types import Array, Index, Mask

__all__ = ["Mesh"]

#: corners nearer than this share of the extent are one
_SAME = 1e-9


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with the elements that they are of."""

    #: (n, 3, 3), corners [m]
    triangles: Array
    #: (n,), number of the element of each
    element: Index
    #: names of the elements
    names: tuple[str, ...]
    #: reference system as WKT, None where nothing says so
    crs: str | None = None
    #: what was left out or assumed when it was read, without the final stop
    sentences: tuple[str, ...] = ()

    @classmethod
    def of(cls, parts: Sequence[tuple[str, Array]], **more: object) -> Self:
        """A mesh of named parts of triangles (k, 3, 3); parts of one name are one element."""
        names = tuple(dict.fromkeys(name for name, some in parts if len(some)))
        kept = [(name, some) for name, some in parts if len(some)]
        triangles = np.concatenate([np.empty((0, 3, 3)), *(some for _, some in kept)])
        numbers = [np.full(len(some), names.index(name)) for name, some in kept]
        element = np.concatenate([np.empty(0, dtype=np.int64), *numbers])
        return cls(triangles, element.astype(np.int64), names, **more)  # type: ignore[arg-type]

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
        """Make an element of every flat face: triangles of one element that share an edge.

        Parameters
        ----------
        angle
            Neighbours whose normals differ by less are of one face [rad].
        """
        low, high = self.corners
        step = max(float(np.abs(high - low).max()) * _SAME, 1e-12)
        keys = np.round((self.triangles - low).reshape(-1, 3) / step).astype(np.int64)
        corner = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1, 3)
        ends = np.sort(np.stack([corner, np.roll(corner, -1, axis=1)], axis=2).reshape(-1, 2))
        edge = np.unique(ends, axis=0, return_inverse=True)[1].ravel()
        order = np.argsort(edge, kind="stable")
        owner = order // 3
        one, two = owner[:-1], owner[1:]
        normals = self.normals
        flat = edge[order[:-1]] == edge[order[1:]]
        flat &= np.einsum("ni,ni->n", normals[one], normals[two]) > np.cos(angle)
        flat &= self.element[one] == self.element[two]
        graph = coo_array((flat[flat], (one[flat], two[flat])), shape=(len(self), len(self)))
        _, face = connected_components(graph, directed=False)
        # in the order of the file, by element
        _, first, number = np.unique(face, return_index=True, return_inverse=True)
        rank = np.argsort(np.argsort(first))
        names, counts = [""] * len(first), [0] * len(self.names)
        for at in np.sort(first):
            of = self.element[at]
            counts[of] += 1
            names[rank[number[at]]] = f"{self.names[of]}/{counts[of]}"
        return replace(self, element=rank[number], names=tuple(names))
