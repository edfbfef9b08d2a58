"""Parts of the ties while the observations of a network are read one kind after another."""

from __future__ import annotations

from typing import Any

import numpy as np

from tribrach.network.approximate.ties import (
    Array,
    Faces,
    Fixes,
    Index,
    Lengths,
    Links,
    Rays,
    Rises,
    Shots,
    Table,
    Vectors,
    Zeniths,
)
from tribrach.network.network import Network

__all__ = ["Collector"]


class Collector:
    """Tables in parts, and the numbers of nodes and sets so far.

    ``vectors`` (V, 3) lever arms; ``levelling`` (S, 3, 3) as in the ties; ``north`` rays of
    azimuths, which become the last set.
    """

    def __init__(self, network: Network, vectors: Array) -> None:
        layout = network.start.layout
        self.network = network
        self.vectors = vectors
        self.n_points = layout.count("point")
        self.n_poses = layout.count("pose")
        self.n_nodes = self.n_points + self.n_poses
        self.n_scalars = layout.count("scalar")
        self.n_sets = self.n_scalars + self.n_poses
        self.levelling = np.full((self.n_poses, 3, 3), np.nan)
        self.north: list[tuple[Index, Index, Array]] = []
        index, number, triple = np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros((0, 3))
        self.parts: dict[type[Table], list[Any]] = {
            Rays: [Rays(index, index, index, number)],
            Lengths: [Lengths(index, index, number, number, number)],
            Rises: [Rises(index, index, number)],
            Zeniths: [Zeniths(index, index, number, number)],
            Vectors: [Vectors(index, index, triple)],
            Shots: [Shots(index, index, triple)],
            Links: [Links(index, index, triple, np.zeros((0, 3, 3)))],
            Faces: [Faces(index, index, triple, number)],
            Fixes: [Fixes(index, triple)],
        }

    def add(self, part: Table) -> None:
        """One more part of a table."""
        self.parts[type(part)].append(part)

    def table(self, kind: type[Any]) -> Any:
        """All parts of a table."""
        return kind.joined(self.parts[kind])
