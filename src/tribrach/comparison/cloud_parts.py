"""A cloud as parts that fit into memory, read as often as a method needs it.

Everything that M3C2 takes from a cloud (counts, sums, moments) adds up over parts, so that a cloud
of any size needs the memory of one part. Coordinates in metres, in the frame of the comparison.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.kernels import njit

#: points of one part
CHUNK = 4_000_000


@dataclass(frozen=True)
class CloudChunk:
    """Some points of a cloud."""

    xyz: Array  #: (n, 3), points [m]
    #: (n, 6), covariances [m^2] as xx, yy, zz, xy, xz, yz of what is new with every point (without
    #: the station's part), None where nobody asked for them
    random: Array | None = None


#: gives the parts of a cloud from its beginning, each time it is called
Source = Callable[[], Iterable[CloudChunk]]


def whole(xyz: Array, random: Array | None = None, most: int = CHUNK) -> Source:
    """A cloud that is in memory (n, 3), or mapped into it, with covariances (n, 6) or none."""

    def parts() -> Iterator[CloudChunk]:
        for begin in range(0, len(xyz), most):
            some = slice(begin, begin + most)
            covariance = None if random is None else np.asarray(random[some], dtype=float)
            yield CloudChunk(np.asarray(xyz[some], dtype=float), covariance)

    return parts


def plain(stream: Callable[[], Iterable[Array]]) -> Source:
    """A stream of arrays (n, 3), without covariances."""

    def chunks() -> Iterator[CloudChunk]:
        for xyz in stream():
            yield CloudChunk(np.asarray(xyz, dtype=float))

    return chunks


def centred(
    source: Source, origin: Array, low: Array, high: Array, most: int = CHUNK
) -> Iterator[CloudChunk]:
    """Read a cloud relative to an origin, without points outside a box.

    Coordinates of the size of UTM lose their large part here before anything is multiplied. Small
    chunks are joined up to ``most`` points, as every chunk is searched from all core points.
    """
    waiting: list[CloudChunk] = []
    for part in source():
        some = _cut(part, origin, low, high)
        if waiting and len(some.xyz) + sum(len(w.xyz) for w in waiting) > most:
            yield _joined(waiting)
            waiting = []
        if len(some.xyz):
            waiting.append(some)
    if waiting:
        yield _joined(waiting)


def _cut(part: CloudChunk, origin: Array, low: Array, high: Array) -> CloudChunk:
    """The points of a chunk within the box, relative to the origin."""
    kept, xyz = np.empty(len(part.xyz), dtype=np.int64), np.empty(part.xyz.shape)
    count = _inside(np.ascontiguousarray(part.xyz), origin, low, high, kept, xyz)
    if count < 0:
        raise InputError("a point has a coordinate that is not a number")
    random = None if part.random is None else part.random[kept[:count]]
    # a copy, so that a chunk that is nearly empty does not hold the memory of a full one
    return CloudChunk(xyz[:count] if 2 * count > len(xyz) else xyz[:count].copy(), random)


def _joined(chunks: list[CloudChunk]) -> CloudChunk:
    """All points of some chunks; covariances only where all have them."""
    if len(chunks) == 1:
        return chunks[0]
    random = [c.random for c in chunks if c.random is not None]
    whole = np.concatenate(random) if len(random) == len(chunks) else None
    return CloudChunk(np.concatenate([c.xyz for c in chunks]), whole)


@njit(cache=True, nogil=True)
def _inside(xyz, origin, low, high, kept, out):  # type: ignore[no-untyped-def]
    """Points within the box and their numbers, how many; -1 where one is not finite."""
    count = 0
    for k in range(len(xyz)):
        x, y, z = xyz[k, 0] - origin[0], xyz[k, 1] - origin[1], xyz[k, 2] - origin[2]
        if not np.isfinite(x + y + z):
            return -1
        if low[0] <= x <= high[0] and low[1] <= y <= high[1] and low[2] <= z <= high[2]:
            out[count, 0], out[count, 1], out[count, 2] = x, y, z
            kept[count] = k
            count += 1
    return count
