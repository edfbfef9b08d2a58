"""Points of one coordinate system from a CSV file: ``point,e_m,n_m,u_m`` and their precision.

The table of coordinates that projects have, with ``x, y, z``, ``easting, northing, height`` or
``ecef_x, ecef_y, ecef_z`` as other names; without heights the points lie in a plane. Sigmas in
``sigma_`` columns or covariances in ``cxx_mm2`` and so on; ``use`` (on, check, off), ``reason`` and
``role`` (of which only ``check`` has a meaning here). Metres, axes in the order x, y, z.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.csv_rows import name_cell
from tribrach.io.survey.csv.columns import COORDINATES
from tribrach.io.survey.csv.file import CsvTable, read_table

_PAIRS = ("ee", "en", "nn", "eu", "nu", "uu")
_USES = ("", "on", "check", "off")


@dataclass(frozen=True, eq=False)
class PointList:
    """Points of one file."""

    path: Path  #: of the file
    names: tuple[str, ...]  #: of the n points
    xyz: Array  #: (n, d), coordinates [m], d is 3 or 2, or 1 for heights alone
    covariance: Array | None  #: (n, d, d), of the coordinates [m^2]
    use: tuple[str, ...]  #: ``on``, ``check`` or ``off`` for each
    reasons: tuple[str, ...]  #: why points are off, "" for the others
    titles: tuple[str, ...]  #: of the coordinates

    @property
    def dimension(self) -> int:
        """3 with heights, 2 without, 1 for heights alone."""
        return int(self.xyz.shape[1])

    @property
    def axes(self) -> tuple[int, ...]:
        """Axes of the coordinates: E, N and U are 0, 1 and 2."""
        return (2,) if self.dimension == 1 else tuple(range(self.dimension))


def read_point_list(path: Path, *, heights: bool = False) -> PointList:
    """Read the points of a CSV file; with ``heights`` the file may have nothing else."""
    table = read_table(path)
    if table.layout is not COORDINATES:
        raise table.error(None, f"this is a table of {table.layout.name}", "give point,x_m,y_m,z_m")
    if table.has("latitude") or table.has("longitude"):
        raise table.error(
            None, "latitude and longitude are no metres", "give ecef_x_m, ecef_y_m, ecef_z_m"
        )
    whole = tuple(f"ecef_{a}" for a in "xyz") if table.has("ecef_x") else ("e", "n", "u")
    columns = whole if table.has(whole[2]) else whole[:2]
    if heights and table.has("u") and not table.has("e") and not table.has("n"):
        columns = ("u",)
    names = table.names("point", range(len(table)))
    seen: dict[str, int] = {}
    for row, name in enumerate(names):
        if name in seen:
            raise table.error(
                row,
                f"point {name} is there twice",
                f"keep one (see line {table.lines[seen[name]]})",
            )
        seen[name] = row
    use, reasons = _uses(table)
    xyz = table.columns(*columns)
    return PointList(
        path,
        tuple(names),
        xyz,
        _covariance(table, "enu" if len(columns) == 3 else "en" if len(columns) == 2 else "u"),
        use,
        reasons,
        tuple(table.titles[c].rpartition("_")[0] for c in columns),
    )


def _uses(table: CsvTable) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Use of each point, and the reason of those that are off."""
    n = len(table)
    words = [word.lower() for word in table.words.get("use", [""] * n)]
    roles = [word.lower() for word in table.words.get("role", [""] * n)]
    for row, word in enumerate(words):
        if word not in _USES:
            raise table.error(row, f"use is {word!r}", "write on, check or off")
    use = tuple(
        word if word in ("check", "off") else "check" if role == "check" else "on"
        for word, role in zip(words, roles, strict=True)
    )
    given = table.words.get("reason", [""] * n)
    reasons = tuple(
        (reason or f"off in {table.path.name}") if word == "off" else ""
        for word, reason in zip(use, given, strict=True)
    )
    return use, reasons


def _covariance(table: CsvTable, axes: str) -> Array | None:
    """Covariances (n, d, d) [m^2] from columns of covariances or of sigmas; None without."""
    d = len(axes)
    pairs = [f"c{pair}" for pair in _PAIRS if set(pair) <= set(axes)]
    if any(table.has(pair) for pair in pairs):
        flat = table.columns(*pairs)
        out = np.zeros((len(table), d, d))
        for k, pair in enumerate(pairs):
            i, j = (axes.index(letter) for letter in pair[1:])
            out[:, i, j] = out[:, j, i] = flat[:, k]
        smallest = np.linalg.eigvalsh(out)[:, 0]
        bad = np.flatnonzero(smallest < -1e-9 * np.abs(out).max(axis=(1, 2)))
        if len(bad):
            raise table.error(
                int(bad[0]), "the covariance has a negative variance", "check order and signs"
            )
        return out
    if not any(table.has(f"sigma_{axis}") for axis in axes):
        return None
    sigma = table.columns(*(f"sigma_{axis}" for axis in axes))
    filled: Array = sigma[:, :, None] ** 2 * np.eye(d)
    return filled


def point_list_text(names: Sequence[str], xyz: Array, covariance: Array | None) -> str:
    """A CSV table of points with their covariances that :func:`read_point_list` reads.

    ``xyz`` (n, 3): coordinates [m]; ``covariance`` (n, d, d): of the coordinates [m^2].
    """
    d = xyz.shape[1]
    axes = "xyz"[:d]
    pairs = [(i, j) for i in range(d) for j in range(i, d)]
    head = ["point", *(f"{a}_m" for a in axes)]
    if covariance is not None:
        head += [f"c{axes[i]}{axes[j]}_mm2" for i, j in pairs]
    rows = [",".join(head)]
    for k, name in enumerate(names):
        cells = [_cell(name_cell(name)), *(f"{v:.5f}" for v in xyz[k])]
        if covariance is not None:
            cells += [f"{1e6 * covariance[k, i, j]:.8g}" for i, j in pairs]
        rows.append(",".join(cells))
    return "\n".join([*rows, ""])


def _cell(name: str) -> str:
    """A name, quoted if there is a separator in it."""
    if any(c in name for c in ',;"\t\n'):
        return '"' + name.replace('"', '""') + '"'
    return name


def refuse_dimensions(a: PointList, b: PointList) -> None:
    """Refuse points in space together with points in a plane."""
    if a.dimension != b.dimension:
        flat = a if a.dimension == 2 else b
        raise InputError(
            "the points have no heights, those of the other file have",
            file=flat.path,
            cure="give heights in both files, or leave them out of both",
        )
