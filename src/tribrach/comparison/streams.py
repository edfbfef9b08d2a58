"""Clouds too large for memory: chunks, parts of space, points waiting on disk for their turn.

A stream is a function that begins anew each time it is called and gives chunks (n, 3) [m]; one
with light gives the intensity of each point in a fourth column, NaN where it is unknown. Two
streams are cut into parts: boxes that share space among them. Every query lies in one of them;
every point of the reference in all that it is within the limit of, so that no part needs another.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.scratch import scratch_folder

__all__ = ["SIZE", "Part", "Spool", "Stream", "in_memory", "parts", "without_light"]

Stream = Callable[[], Iterator[Array]]

#: points of a reference that are in memory at a time: 24 bytes each, and as much for their tree
SIZE = 8_000_000
#: points at a time from disk
_CHUNK = 1_000_000
#: points that say where boxes are cut
_SAMPLE = 200_000


@dataclass(frozen=True)
class Part:
    """A part of space with the points that matter to it.

    Attributes
    ----------
    reference : array (m, 3)
        Points of the reference in and around a box [m].
    queries
        All queries within the box, as a stream.
    """

    reference: Array
    queries: Stream


class Spool:
    """Points in files of a temporary folder by number, in the order in which they came.

    columns : of each chunk, three or with light four.
    """

    def __init__(self, folder: Path, count: int, columns: int = 3) -> None:
        self._paths = [folder / f"{number}.points" for number in range(count)]
        self.counts = [0] * count
        self.columns = columns

    def add(self, number: int, points: Array) -> None:
        """Append points (n, columns)."""
        if len(points):
            with self._paths[number].open("ab") as file:
                file.write(np.ascontiguousarray(points, dtype=np.float64).tobytes())
            self.counts[number] += len(points)

    def stream(self, number: int) -> Stream:
        """The points of a number, in chunks."""

        def chunks() -> Iterator[Array]:
            left = self.counts[number]
            if left == 0:
                return
            with self._paths[number].open("rb") as file:
                while left:
                    some = min(left, _CHUNK)
                    flat = np.fromfile(file, np.float64, self.columns * some)
                    yield flat.reshape(some, self.columns)
                    left -= some

        return chunks

    def points(self, number: int) -> Array:
        """The points (n, 3) of a number, all at once."""
        return joined(self.stream(number)())

    def drop(self, number: int) -> None:
        """Forget the points of a number."""
        self._paths[number].unlink(missing_ok=True)
        self.counts[number] = 0


def in_memory(points: Array) -> Stream:
    """Points (n, 3) as a stream."""
    return lambda: iter([points[k : k + _CHUNK] for k in range(0, len(points), _CHUNK)])


def without_light(stream: Stream) -> Stream:
    """The coordinates alone of a stream, whether it has light or not."""
    return lambda: (np.ascontiguousarray(chunk[:, :3]) for chunk in stream())


def joined(chunks: Iterator[Array]) -> Array:
    """All chunks as one array (n, 3)."""
    return np.concatenate([np.empty((0, 3)), *chunks])


def parts(queries: Stream, reference: Stream, limit: float, size: int = SIZE) -> Iterator[Part]:
    """Cut two clouds so that about ``size`` points of the reference are in memory at a time.

    Boxes are not cut narrower than eight limits, whatever lies in them. References up to the size
    are not cut and leave the disk alone; else both clouds pass through a temporary folder.

    Parameters
    ----------
    queries, reference
        The clouds.
    limit
        How far from its query a point of the reference can matter [m].
    size
        Points of the reference in memory.

    Yields
    ------
    Part
        A box with its queries.

    Raises
    ------
    ValueError
        The limit is not a length.
    """
    if not (np.isfinite(limit) and limit > 0):
        raise ValueError("the limit must be above zero and finite")
    sample, total, whole = _first_pass(reference, size)
    if whole is not None:
        yield Part(whole, queries)
        return
    boxes = _boxes(sample, limit, size * len(sample) / total)
    with scratch_folder() as folder:
        (folder / "q").mkdir()
        (folder / "r").mkdir()
        asked = Spool(folder / "q", len(boxes))
        answers = Spool(folder / "r", len(boxes))
        _share(queries, boxes, asked, 0.0)
        _share(reference, boxes, answers, limit)
        for number in range(len(boxes)):
            if asked.counts[number]:
                yield Part(answers.points(number), asked.stream(number))
            asked.drop(number)
            answers.drop(number)


def _first_pass(reference: Stream, size: int) -> tuple[Array, int, Array | None]:
    """A sample of the points, their number, and all of them if they are not too many."""
    held: list[Array] | None = []
    sample, total, step = np.empty((0, 3)), 0, 1
    for chunk in reference():
        sample = np.concatenate([sample, chunk[-total % step :: step]])
        while len(sample) > _SAMPLE:
            sample, step = sample[::2], 2 * step
        total += len(chunk)
        if total > size:
            held = None
        elif held is not None:
            held.append(chunk)
    return sample, total, None if held is None else joined(iter(held))


def _boxes(sample: Array, limit: float, most: float) -> list[Array]:
    """Boxes (2, 3) that fill space, with at most so many points of the sample in and around each.

    Cut at the median of the points along the longest side, again and again.
    """
    everything = np.array([[-np.inf] * 3, [np.inf] * 3])
    todo, done = [(everything, sample)], []
    while todo:
        box, near = todo.pop()
        inside = near[((near >= box[0]) & (near < box[1])).all(axis=1)]
        extent = np.ptp(inside, axis=0) if len(inside) else np.zeros(3)
        axis = int(np.argmax(extent))
        if len(near) <= most or extent[axis] < 8 * limit:
            done.append(box)
            continue
        first, cut = inside[:, axis].min(), float(np.median(inside[:, axis]))
        if cut <= first:  # most of them lie on one plane
            cut = float(first + extent[axis] / 2)
        for side in (0, 1):
            half = box.copy()
            half[1 - side, axis] = cut
            around = ((near >= half[0] - limit) & (near <= half[1] + limit)).all(axis=1)
            todo.append((half, near[around]))
    return done


def _share(points: Stream, boxes: Sequence[Array], spool: Spool, margin: float) -> None:
    """Give every point to its box, or to all boxes that it is within the margin of."""
    for chunk in points():
        low, high = chunk.min(axis=0, initial=np.inf), chunk.max(axis=0, initial=-np.inf)
        for number, (start, end) in enumerate(boxes):
            if (low > end + margin).any() or (high < start - margin).any():
                continue
            if margin:
                inside = ((chunk >= start - margin) & (chunk <= end + margin)).all(axis=1)
            else:
                inside = ((chunk >= start) & (chunk < end)).all(axis=1)
            spool.add(number, chunk[inside])
