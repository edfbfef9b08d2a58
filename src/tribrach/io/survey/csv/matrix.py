"""A covariance matrix of coordinates from a CSV file: square, its rows and columns named alike.

The first cell is ``covariance_m2`` or ``covariance_mm2``; columns and rows are named after points
with the axis behind them, ``A_e, A_n, A_u, B_e, ...`` (also ``_x, _y, _z``).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.csv_rows import read_rows

__all__ = ["CoordinateCovariance", "read_matrix"]

#: factor to square metres by the first cell, and axis by the end of a name
_UNITS = {"covariance_m2": 1.0, "covariance_mm2": 1e-6}
_AXES = {"e": 0, "n": 1, "u": 2, "x": 0, "y": 1, "z": 2}


@dataclass(frozen=True)
class CoordinateCovariance:
    """Covariances between coordinates of points.

    Parameters
    ----------
    path : Path
        The file.
    line : int
        Of its header.
    keys : tuple of (str, int)
        Point and axis (0 east, 1 north, 2 up) of each row and column.
    matrix : array (k, k)
        In square metres.
    """

    path: Path
    line: int
    keys: tuple[tuple[str, int], ...]
    matrix: Array

    def sigmas(self) -> dict[tuple[str, int], float]:
        """Standard deviations [m] by point and axis."""
        return dict(zip(self.keys, np.sqrt(np.diag(self.matrix)).tolist(), strict=True))


def read_matrix(path: Path) -> CoordinateCovariance:
    """Read a covariance matrix of coordinates.

    Raises
    ------
    InputError
        Unreadable, not square, names that are no coordinates or differ between rows and columns, a
        cell that is no number, or a matrix that is not symmetric and positive definite.
    """
    rows, lines = read_rows(path)
    head = [cell.strip() for cell in rows[0]]
    factor = _UNITS.get(head[0].lower())
    if factor is None:
        raise InputError(
            f"the first cell is {head[0]!r}",
            file=path,
            line=lines[0],
            cure="write covariance_m2 or covariance_mm2",
        )
    names = head[1:]
    if len(rows) != len(head):
        raise InputError(
            f"{len(rows) - 1} rows stand under {len(names)} columns",
            file=path,
            line=lines[0],
            cure="give the whole square matrix",
        )
    keys = [_key(path, lines[0], name) for name in names]
    if len(set(keys)) < len(keys):
        raise InputError("a coordinate is named twice", file=path, line=lines[0])
    matrix = np.zeros((len(names), len(names)))
    for k, (row, line) in enumerate(zip(rows[1:], lines[1:], strict=True)):
        if row[0].strip() != names[k]:
            raise InputError(
                f"the row of {row[0].strip()!r} stands where that of {names[k]} should",
                file=path,
                line=line,
                cure="keep rows and columns in one order",
            )
        try:
            matrix[k] = [float(cell) for cell in row[1:]]
        except ValueError:
            raise InputError("a cell is not a number", file=path, line=line) from None
    scale = np.sqrt(np.abs(np.diag(matrix)))
    good = np.isfinite(matrix).all() and (np.diag(matrix) > 0).all()
    unit = matrix / np.outer(scale, scale) if good else matrix
    if not good or np.abs(unit - unit.T).max() > 1e-6 or np.linalg.eigvalsh(unit)[0] <= 1e-14:
        raise InputError(
            "the matrix is not symmetric and positive definite",
            file=path,
            line=lines[0],
            cure="check the order and the signs of its elements",
        )
    return CoordinateCovariance(path, lines[0], tuple(keys), factor * (matrix + matrix.T) / 2)


def _key(path: Path, line: int, name: str) -> tuple[str, int]:
    """Point and axis of a name."""
    point, _, axis = name.rpartition("_")
    if not point or axis.lower() not in _AXES:
        raise InputError(
            f"{name!r} names no coordinate",
            file=path,
            line=line,
            cure="write the point and its axis, such as A_e, A_n, A_u",
        )
    return point, _AXES[axis.lower()]
