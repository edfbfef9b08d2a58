"""What text files of GNSS vectors have in common: numbers, covariances, recognition by content."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.units import too_large


def numbers(words: Sequence[str], what: str, path: Path, line: int) -> Array:
    """Finite numbers (n,) of words."""
    try:
        values = np.array([float(word) for word in words])
    except ValueError:
        values = np.array([np.nan])
    if not np.isfinite(values).all():
        raise InputError(
            f"{what} {'are' if len(words) > 1 else 'is'} {' '.join(words)!r}, no numbers",
            file=path,
            line=line,
        )
    if too_large(values):
        which = f"{what} {' '.join(words)!r}"
        raise InputError(f"{which} is beyond any measurement", file=path, line=line)
    return values


def covariance(upper: Array, path: Path, line: int) -> Array:
    """Covariance (3, 3) [m^2] from its upper half xx, xy, xz, yy, yz, zz (6,).

    ``upper`` (6,): the elements [m^2].
    """
    xx, xy, xz, yy, yz, zz = upper
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if not np.linalg.eigvalsh(matrix)[0] > 0:
        raise InputError(
            "the six numbers of a vector are no covariance matrix",
            file=path,
            line=line,
            cure="export the vectors again with their covariances",
        )
    return matrix
