"""A covariance matrix of coordinates from a CSV file: square, its rows and columns named alike.

The first cell is ``covariance_m2`` or ``covariance_mm2``; columns and rows are named after points
with the axis behind them, ``A_e, A_n, A_u, B_e, ...`` (also ``_x, _y, _z``). The matrix that
Comp3D exports has the same shape, another first cell, and further unknowns besides coordinates.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.csv_rows import read_rows
from tribrach.io.decimals import plain
from tribrach.network.survey import SMALLEST_SIGMA
from tribrach.units import too_large

#: factor to square metres by the first cell, and axis by the end of a name
_UNITS = {"covariance_m2": 1.0, "covariance_mm2": 1e-6}
_AXES = {"e": 0, "n": 1, "u": 2, "x": 0, "y": 1, "z": 2}


@dataclass(frozen=True)
class CoordinateCovariance:
    """Covariances between coordinates of points."""

    path: Path  #: the file
    line: int  #: of its header
    #: point and axis (0 east, 1 north, 2 up) of each row and column
    keys: tuple[tuple[str, int], ...]
    matrix: Array  #: (k, k), in square metres

    def sigmas(self) -> dict[tuple[str, int], float]:
        """Standard deviations [m] by point and axis."""
        return dict(zip(self.keys, np.sqrt(np.diag(self.matrix)).tolist(), strict=True))


def read_matrix(
    path: Path, wanted: Collection[tuple[str, int]] | None = None
) -> CoordinateCovariance:
    """Read a covariance matrix of coordinates.

    ``wanted`` (str, int): points and axes to take from a matrix in square metres whose first cell
    says nothing, and whose other rows may be of anything. All rows of the file's own format if not
    given.
    """
    table = read_rows(path)
    rows, lines = table.cells, table.lines
    head = [cell.strip() for cell in rows[0]]
    factor = 1.0 if wanted is not None else _UNITS.get(head[0].lower())
    if factor is None:
        raise InputError(
            f"the first cell is {head[0]!r}",
            file=path,
            line=lines[0],
            cure="write covariance_m2 or covariance_mm2",
        )
    if not any(row[-1].strip() for row in rows):
        # a separator at the end of each line
        head, rows = head[:-1], [row[:-1] for row in rows]
    names = head[1:]
    if len(rows) != len(head):
        raise InputError(
            f"{len(rows) - 1} rows stand under {len(names)} columns",
            file=path,
            line=lines[0],
            cure="give the whole square matrix",
        )
    _check_rows(path, names, rows[1:], lines[1:])
    chosen, keys = _chosen(path, lines[0], names, wanted)
    matrix = np.zeros((len(keys), len(keys)))
    decimal, _ = table.decimal([column + 1 for column in chosen])
    for k, row in enumerate(chosen):
        try:
            matrix[k] = [float(plain(rows[row + 1][column + 1], decimal)) for column in chosen]
        except ValueError:
            raise InputError("a cell is not a number", file=path, line=lines[row + 1]) from None
    scale = np.sqrt(np.abs(np.diag(matrix)))
    good = np.isfinite(matrix).all() and (scale > SMALLEST_SIGMA).all() and not too_large(matrix)
    unit = matrix / np.outer(scale, scale) if good else matrix
    good = good and (np.diag(matrix) > 0).all()
    if not good or np.abs(unit - unit.T).max() > 1e-6 or np.linalg.eigvalsh(unit)[0] <= 1e-14:
        raise InputError(
            "the matrix is not symmetric and positive definite",
            file=path,
            line=lines[0],
            cure="check the order and the signs of its elements",
        )
    return CoordinateCovariance(path, lines[0], tuple(keys), factor * (matrix + matrix.T) / 2)


def _check_rows(path: Path, names: list[str], rows: list[list[str]], lines: list[int]) -> None:
    """Refuse rows that are not in the order of the columns."""
    for name, row, line in zip(names, rows, lines, strict=True):
        if row[0].strip() != name:
            raise InputError(
                f"the row of {row[0].strip()!r} stands where that of {name} should",
                file=path,
                line=line,
                cure="keep rows and columns in one order",
            )


def _chosen(
    path: Path, line: int, names: list[str], wanted: Collection[tuple[str, int]] | None
) -> tuple[list[int], list[tuple[str, int]]]:
    """Numbers of the rows that are taken, and their points and axes."""
    if wanted is None:
        every = {k: _key(path, line, name) for k, name in enumerate(names)}
    else:
        split = ((k, *name.rpartition("_")[::2]) for k, name in enumerate(names))
        every = {k: (point, _AXES.get(axis.lower(), -1)) for k, point, axis in split}
        every = {k: key for k, key in every.items() if key in wanted}
        if not every:
            raise InputError(
                "it has covariances of no coordinate that carries a weight",
                file=path,
                line=line,
                cure="give rows and columns such as A_x, A_y, A_z of constrained points",
            )
    if len(set(every.values())) < len(every):
        raise InputError("a coordinate is named twice", file=path, line=line)
    return list(every), list(every.values())


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
