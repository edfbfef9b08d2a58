"""A whole scan in memory, for work that needs every neighbour at once (targets, planes)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.scan.scan import Chunk, Scan

__all__ = ["LIMIT", "Loaded", "load"]

#: scans with more points than this are refused; 2.4 GB of coordinates
LIMIT = 100_000_000


@dataclass(frozen=True, eq=False)
class Loaded:
    """A whole scan in memory.

    Attributes
    ----------
    xyz : array (n, 3)
        Points of the scanner frame, float64 [m].
    intensity : array (n,)
        float32 in the file's unit; None if the scan has none.
    row, column : array (n,)
        int32, of the scanner's grid; None if the scan has none.
    """

    xyz: Array
    intensity: NDArray[np.float32] | None = None
    row: NDArray[np.int32] | None = None
    column: NDArray[np.int32] | None = None


def load(scan: Scan, limit: int = LIMIT) -> Loaded:
    """Read all valid points of a scan.

    Parameters
    ----------
    scan
        The scan.
    limit
        Points at most.

    Returns
    -------
    Loaded
        Points, and what the search for targets needs besides.

    Raises
    ------
    InputError
        More than ``limit`` points, none at all, or a damaged file.
    """
    chunks: list[Chunk] = []
    total = 0
    for chunk in scan.chunks():
        total += len(chunk)
        if total > limit:
            what = f"the scan has more than {limit} points, too many to search at once"
            raise InputError(what, file=scan.path, record=scan.name, cure="thin or split it")
        kept = {k: v for k, v in chunk.values.items() if k in ("intensity", "row", "column")}
        chunks.append(Chunk(chunk.xyz, kept))
    if total == 0:
        raise InputError("the scan has no valid points", file=scan.path, record=scan.name)
    xyz = np.concatenate([chunk.xyz for chunk in chunks])
    return Loaded(
        xyz,
        _joined(chunks, "intensity", np.float32),
        _joined(chunks, "row", np.int32),
        _joined(chunks, "column", np.int32),
    )


def _joined(chunks: list[Chunk], name: str, dtype: type[np.generic]) -> NDArray[Any] | None:
    """One field (n,) of all chunks, None unless all of them have it."""
    if not all(name in chunk.values for chunk in chunks):
        return None
    return np.concatenate([np.asarray(chunk.values[name], dtype=dtype) for chunk in chunks])
