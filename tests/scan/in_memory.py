"""Scans whose points are in memory, and shells of beams without return."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from tribrach.scan.scan import Chunk, Field, Origin, Scan


@dataclass(frozen=True)
class InMemory(Scan):
    """A scan of an array (n, 3), with the number of each point as a field, and others."""

    points: np.ndarray | None = None
    others: Mapping[str, np.ndarray] = field(default_factory=dict)

    def stored(self, size: int = 70_000, start: int = 0) -> Iterator[Chunk]:
        assert self.points is not None
        for k in range(start, len(self.points), size):
            xyz = self.points[k : k + size]
            others = {name: values[k : k + size] for name, values in self.others.items()}
            yield Chunk(xyz, {"number": np.arange(k, k + len(xyz))} | others)


def in_memory(
    points: np.ndarray, name: str = "S", origin: Origin = "stated", **others: np.ndarray
) -> InMemory:
    """A scan of points (n, 3) with further fields (n,)."""
    fields = (Field("number", "int64"), *(Field(k, v.dtype.name) for k, v in others.items()))
    path = Path(f"{name}.mem")
    return InMemory(
        name, path, fields=fields, origin=origin, points=points, others=others, records=len(points)
    )


def shell(
    points: int, far: float, seed: int = 0, noise: float = 0.0, lowest: float = -0.2
) -> np.ndarray:
    """Points (n, 3) in directions all over the sky above a sine of the height [m]."""
    rng = np.random.default_rng(seed)
    up, turn = rng.uniform(lowest, 1, points), rng.uniform(0, 2 * np.pi, points)
    flat = np.sqrt(1 - up**2)
    out = np.stack([flat * np.cos(turn), flat * np.sin(turn), up], axis=1)
    return np.asarray(out * (far + noise * rng.normal(size=points))[:, None])


def mixed(points: np.ndarray, others: np.ndarray, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Both in one array, mixed up, and which of them are the others."""
    order = np.random.default_rng(seed).permutation(len(points) + len(others))
    both = np.concatenate([points, others])
    return both[order], order >= len(points)
