"""One call of observations as a survey keeps it: columns by name, names not yet indices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.network.observations.base import Array, Observations, Use

__all__ = [
    "Table",
    "as_column",
    "check_covariance",
    "check_heights",
    "check_sigmas",
    "check_values",
]

#: coordinates and measurements from here on are none [m]; nor are sigmas below
LARGEST, SMALLEST_SIGMA = 1e12, 1e-15
#: nor are heights over a mark [m]
HIGHEST = 1e4


@dataclass
class Table:
    """n observations of a kind; columns (n, ...) by field, with names where they refer.

    hard : the values hold exactly, as constraints.
    """

    kind: type[Observations]
    group: str
    columns: dict[str, Any]
    n: int
    hard: bool = False

    def names(self, family: str) -> set[str]:
        """Names of unknowns that the table refers to as this family."""
        out: set[str] = set()
        for item in fields(self.kind):
            if item.metadata.get("refers") == family and item.name in self.columns:
                out |= {str(name) for name in np.ravel(self.columns[item.name]) if name}
        return out

    def active(self) -> Table:
        """Without check values and what is switched off."""
        use = self.columns.get("use")
        if use is None:
            return self
        return self.part(as_column(use, self.n).astype(int) == Use.ACTIVE)

    def part(self, keep: NDArray[np.bool_]) -> Table:
        """Some of the observations, by a mask (n,)."""
        shared = {f.name for f in fields(self.kind) if "shared" in f.metadata}
        columns = {
            name: column if name in shared else _chosen(column, keep)
            for name, column in self.columns.items()
        }
        return Table(self.kind, self.group, columns, int(keep.sum()), self.hard)


def _chosen(column: Any, keep: NDArray[np.bool_]) -> Any:
    """The kept items of a column; what has one value for all stays."""
    if isinstance(column, list):
        return [item for item, kept in zip(column, keep, strict=True) if kept]
    return column[keep] if isinstance(column, np.ndarray) and column.ndim else column


def check_covariance(matrices: Array, source: Sequence[str], what: str) -> None:
    """Refuse covariances (n, k, k) that are not finite, symmetric and positive definite.

    Raises
    ------
    InputError : names the source of the first bad matrix.
    """
    scale = np.sqrt(np.abs(np.einsum("nii->ni", matrices)))
    check_sigmas(np.where(scale > 0, scale, 1.0), source, what)
    scale[scale == 0] = 1.0
    unit = matrices / scale[:, :, None] / scale[:, None, :]
    for i, matrix in enumerate(unit):
        good = np.isfinite(matrix).all() and np.allclose(matrix, matrix.T, atol=1e-9)
        if not good or np.linalg.eigvalsh(matrix)[0] <= 1e-14:
            raise InputError(
                f"covariance of {what} is not symmetric and positive definite",
                record=source[i] or None,
                cure="check the order and the signs of its elements",
            )


def check_values(values: Array, source: Sequence[str], kind: str) -> None:
    """Refuse measured values (n, rows) that are no numbers, or beyond any measurement.

    Raises
    ------
    InputError : names the source of the first of them.
    """
    good = (np.abs(values) < LARGEST).all(axis=1)
    if good.all():
        return
    k = int(np.argmin(good))
    what = values[k][~(np.abs(values[k]) < LARGEST)][0]
    raise InputError(
        f"{kind} is {what:.3g}, beyond any measurement"
        if np.isfinite(what)
        else f"{kind} is not a number",
        record=source[k] or f"observation {k + 1}",
    )


def check_sigmas(sigmas: Array, source: Sequence[str], kind: str) -> None:
    """Refuse standard deviations (n, rows) that are not above zero, or beyond any weight.

    Raises
    ------
    InputError : names the source of the first of them.
    """
    fair = (sigmas > SMALLEST_SIGMA) & (sigmas < LARGEST)
    if fair.all():
        return
    k = int(np.argmin(fair.all(axis=1)))
    what = sigmas[k][~fair[k]][0]
    raise InputError(
        f"sigma of {kind} is {what:g}",
        record=source[k] or f"observation {k + 1}",
        cure="leave the observation out"
        if what >= LARGEST
        else f"give a standard deviation above {SMALLEST_SIGMA if what > 0 else 0:g}",
    )


def check_heights(columns: Mapping[str, Any], source: Sequence[str], kind: str) -> None:
    """Refuse heights of instruments, targets and antennas (n,) that nothing stands on.

    Raises
    ------
    InputError : names the source of the first of them.
    """
    for name, column in columns.items():
        if "height" not in name:
            continue
        heights = np.asarray(column, dtype=float)
        good = np.abs(heights) < HIGHEST
        if not good.all():
            k = int(np.argmin(good))
            raise InputError(
                f"{name.replace('_', ' ')} of {kind} is {heights[k]:.6g} m",
                record=source[k] or f"observation {k + 1}",
                cure="give the height over the mark in metres",
            )


def as_column(part: Any, n: int) -> NDArray[Any]:
    """A column (n, ...) of a table; a single value is repeated."""
    if isinstance(part, str) or np.ndim(part) == 0:
        return np.full(n, part, dtype=object if isinstance(part, str) else float)
    array = np.asarray(part)
    return array.astype(object) if array.dtype.kind in "US" else array
