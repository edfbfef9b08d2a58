"""Where are the clouds compared? One point per cell of a grid: the one nearest to its middle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach.comparison.cloud_parts import Source
from tribrach.errors import InputError

__all__ = ["core_points"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: most core points that are kept
MOST = 5_000_000
#: cells along an axis stay whole numbers in 21 bits
_CELLS = 1 << 21


def core_points(cloud: Source, spacing: float, most: int = MOST) -> Array:
    """Core points (m, 3) [m]: of each cubic cell of a grid the point nearest to its middle.

    The grid hangs at the first point, so that large coordinates cost no digits; the order of the
    parts does not matter but for ties.

    Raises
    ------
    InputError : the spacing is not positive, the cloud is empty or needs more than ``most`` points,
    or it is wider than two million cells.
    """
    if not spacing > 0:
        raise InputError("the spacing of core points is not positive", record=f"{spacing:g} m")
    origin: Array | None = None
    key, miss, kept = np.empty(0, np.int64), np.empty(0), np.empty((0, 3))
    for part in cloud():
        if len(part.xyz) == 0:
            continue
        if origin is None:
            origin = part.xyz[0].copy()
        new = _keys((part.xyz - origin) / spacing, spacing)
        key, miss, kept = _merged((key, miss, kept), (*new, part.xyz))
        if len(key) > most:
            raise InputError(
                f"a spacing of {spacing:g} m makes more than {most} core points",
                cure="take a wider spacing",
            )
    if origin is None:
        raise InputError("the cloud has no points to compare at")
    return kept


def _keys(cells: Array, spacing: float) -> tuple[Index, Array]:
    """Number (n,) of the cell of each point and its squared miss (n,) of the middle, in cells."""
    whole = np.floor(cells)
    if not (np.abs(whole) < _CELLS // 2).all():
        raise InputError(
            f"the cloud is wider than {_CELLS // 2} cells of {spacing:g} m, or not a number",
            cure="take a wider spacing, or drop points far away",
        )
    i, j, k = (whole.T + _CELLS // 2).astype(np.int64)
    miss: Array = ((cells - whole - 0.5) ** 2).sum(axis=1)
    return (i * _CELLS + j) * _CELLS + k, miss


def _merged(
    old: tuple[Index, Array, Array], new: tuple[Index, Array, Array]
) -> tuple[Index, Array, Array]:
    """The nearest point of each cell of both."""
    key, miss = np.concatenate([old[0], new[0]]), np.concatenate([old[1], new[1]])
    order = np.lexsort((miss, key))
    first = np.ones(len(order), dtype=bool)
    first[1:] = key[order[1:]] != key[order[:-1]]
    chosen = order[first]
    split = len(old[0])
    xyz = np.empty((len(chosen), 3))
    fresh = chosen >= split
    xyz[~fresh], xyz[fresh] = old[2][chosen[~fresh]], new[2][chosen[fresh] - split]
    return key[chosen], miss[chosen], xyz
