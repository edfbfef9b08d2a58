"""Finds the nearest triangles of a model to points.

Triangles stand in the order of a space-filling curve (Morton 1966), eight to a leaf of a complete
binary tree of boxes; what is farther than the best so far is passed over. The nearest place of a
triangle is that of Ericson (2005, section 5.1.5). Metres; places are about the middle of the model,
so that nothing is lost far from zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array, Index
from tribrach.geometry.mesh import Mesh
from tribrach.kernels import in_threads, njit

#: triangles in a leaf, and bits of the curve along an axis
_LEAF, _BITS = 8, 20
#: levels of a tree, at most
_DEPTH = 40
#: distances that differ by less than this share are one: the face that a point faces goes first
_TIE = 1e-9


@dataclass(frozen=True, eq=False)
class Nearest:
    """The nearest places of a model to n points."""

    triangle: Index  #: (n,), numbers of the triangles, -1 where none is within the limit
    place: Array  #: (n, 3), the places [m]
    signed: Array  #: (n,), distances, positive on the side of the normal [m]
    #: (n,), cosine between the way to the point and the normal, without sign: 1 above a face
    facing: Array


class TriangleTree:
    """A model that is asked for its nearest triangles; none is without area."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        low, high = mesh.corners
        self._middle = (low + high) / 2
        triangles = mesh.triangles - self._middle
        self._order = np.argsort(_curve(triangles.mean(axis=1)), kind="stable")
        self._corners = np.ascontiguousarray(triangles[self._order])
        self._normals = np.ascontiguousarray(mesh.normals[self._order])
        self._boxes = _boxes(self._corners)

    def nearest(self, xyz: Array, limit: float = np.inf) -> Nearest:
        """The nearest places."""
        if not len(xyz):
            empty = np.empty(0)
            return Nearest(np.empty(0, dtype=np.int64), np.empty((0, 3)), empty, empty)
        # neighbours after each other ask for the same triangles: a third of the time
        order = np.argsort(_curve(xyz), kind="stable")
        points = np.ascontiguousarray(xyz[order] - self._middle)
        found = np.empty(len(points), dtype=np.int64)
        table = np.empty((len(points), 5))
        in_threads(
            _searched, len(points), points, self._corners, self._normals, self._boxes,
            float(limit), found, table,
        )  # fmt: skip
        at = np.empty_like(found)
        at[order] = np.where(found >= 0, self._order[found], -1)
        rows = np.empty_like(table)
        rows[order] = table
        return Nearest(at, rows[:, :3] + self._middle, rows[:, 3], rows[:, 4])


def _curve(places: Array) -> Index:
    """Numbers (n,) of places (n, 3) along a curve that keeps neighbours together."""
    low = places.min(axis=0)
    size = max(float((places.max(axis=0) - low).max()), 1e-300)
    cell = np.minimum((places - low) / size * (1 << _BITS), (1 << _BITS) - 1).astype(np.int64)
    out = np.zeros(len(places), dtype=np.int64)
    for bit in range(_BITS):
        for axis in range(3):
            out |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return out


def _boxes(corners: Array) -> Array:
    """Boxes (m, 6) of a complete tree, the root at 1, leaves last; empty ones are inside out."""
    leaves = 1
    while leaves * _LEAF < len(corners):
        leaves *= 2
    low = np.full((leaves * _LEAF, 3), np.inf)
    high = np.full((leaves * _LEAF, 3), -np.inf)
    low[: len(corners)], high[: len(corners)] = corners.min(axis=1), corners.max(axis=1)
    boxes = np.empty((2 * leaves, 6))
    boxes[leaves:, :3] = low.reshape(leaves, _LEAF, 3).min(axis=1)
    boxes[leaves:, 3:] = high.reshape(leaves, _LEAF, 3).max(axis=1)
    while leaves > 1:
        below = boxes[leaves : 2 * leaves].reshape(-1, 2, 6)
        leaves //= 2
        boxes[leaves : 2 * leaves, :3] = below[:, :, :3].min(axis=1)
        boxes[leaves : 2 * leaves, 3:] = below[:, :, 3:].max(axis=1)
    return boxes


@njit(cache=True, nogil=True)
def _to_box(p: Array, box: Array) -> float:
    """Squared distance of a point from a box."""
    out = 0.0
    for k in range(3):
        off = max(box[k] - p[k], p[k] - box[3 + k], 0.0)
        out += off * off
    return out


@njit(cache=True, nogil=True)
def _to_triangle(p: Array, t: Array, place: Array) -> float:
    """Squared distance of a point from a triangle, and the nearest place of it."""
    d1, d2, d3, d4, d5, d6 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        ab, ac = t[1, k] - t[0, k], t[2, k] - t[0, k]
        d1 += ab * (p[k] - t[0, k])
        d2 += ac * (p[k] - t[0, k])
        d3 += ab * (p[k] - t[1, k])
        d4 += ac * (p[k] - t[1, k])
        d5 += ab * (p[k] - t[2, k])
        d6 += ac * (p[k] - t[2, k])
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    u, v, w = 1.0, 0.0, 0.0
    if d1 <= 0.0 and d2 <= 0.0:
        pass
    elif d3 >= 0.0 and d4 <= d3:
        u, v = 0.0, 1.0
    elif d6 >= 0.0 and d5 <= d6:
        u, w = 0.0, 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
        u = 1.0 - v
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w = d2 / (d2 - d6)
        u = 1.0 - w
    elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        u, v = 0.0, 1.0 - w
    else:
        whole = va + vb + vc
        v, w = vb / whole, vc / whole
        u = 1.0 - v - w
    square = 0.0
    for k in range(3):
        place[k] = u * t[0, k] + v * t[1, k] + w * t[2, k]
        square += (p[k] - place[k]) ** 2
    return square


@njit(cache=True, nogil=True)
def _searched(
    first: int,
    last: int,
    points: Array,
    corners: Array,
    normals: Array,
    boxes: Array,
    limit: float,
    found: Index,
    table: Array,
) -> None:
    """Number, place, signed distance and cosine of the nearest triangle of each point."""
    leaves = len(boxes) // 2
    stack = np.empty(2 * _DEPTH, dtype=np.int64)
    place = np.empty(3)
    for n in range(first, last):
        p = points[n]
        best, facing, number = limit * limit, -1.0, -1
        stack[0], depth = 1, 1
        while depth > 0:
            depth -= 1
            node = stack[depth]
            if _to_box(p, boxes[node]) > best * (1.0 + _TIE):
                continue
            if node < leaves:
                one, two = 2 * node, 2 * node + 1
                if _to_box(p, boxes[one]) < _to_box(p, boxes[two]):
                    one, two = two, one
                stack[depth], stack[depth + 1] = one, two
                depth += 2
                continue
            begin = (node - leaves) * _LEAF
            for m in range(begin, min(begin + _LEAF, len(corners))):
                square = _to_triangle(p, corners[m], place)
                if square > best * (1.0 + _TIE):
                    continue
                along = 0.0
                for k in range(3):
                    along += normals[m, k] * (p[k] - place[k])
                root = np.sqrt(square)
                cosine = abs(along) / root if root > 0.0 else 1.0
                if square < best * (1.0 - _TIE) or cosine > facing:
                    best, facing, number = min(square, best), cosine, m
                    table[n, 3] = root if along >= 0.0 else -root
                    for k in range(3):
                        table[n, k] = place[k]
        found[n] = number
        table[n, 4] = facing
        if number < 0:
            for k in range(5):
                table[n, k] = np.nan
