"""The tables of a scene for other programs: rows as JSON, or CSV with one header line."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from typing import Any

from tribrach.answers import items_of
from tribrach.io.csv_rows import name_cell
from tribrach.io.json_text import json_text
from tribrach.workbench.schema import SceneDocument

#: tables by name: the part of the scene, and its columns that are no rows of plain cells
TABLES: dict[str, tuple[str, ...]] = {
    "points": ("frames",),
    "stations": ("clouds",),
    "observations": ("words",),
    "targets": ("words", "picture"),
    "rejected": ("picture",),
    "planes": (),
}
#: columns of observations in the order in which scripts read them
_ORDER = (
    "id", "kind", "title", "component", "from", "to", "unit", "value", "sigma", "residual",
    "redundancy", "w", "tau", "mdb", "external", "external_at", "suspicious", "group", "state",
    "source", "reason",
)  # fmt: skip
_AXES = ("x", "y", "z")
#: names of the numbers of columns that have several in a row
_PARTS = {3: _AXES, 6: ("tx", "ty", "tz", "rx", "ry", "rz"), 4: ("0", "1", "2", "3")}


def table_of(scene: SceneDocument, name: str) -> dict[str, list[Any]]:
    """A table of a scene in columns."""
    left_out = TABLES[name]
    columns: dict[str, list[Any]] = items_of(getattr(scene, name))
    if name == "observations":
        columns = {key: columns[key] for key in (*_ORDER, *columns)}
    return {key: values for key, values in columns.items() if key not in left_out}


def table_json(columns: Mapping[str, list[Any]]) -> str:
    """Rows of a table as a list of objects."""
    rows = zip(*columns.values(), strict=True)
    return json_text([dict(zip(columns, row, strict=True)) for row in rows], indent=1) + "\n"


def table_csv(columns: Mapping[str, list[Any]]) -> str:
    """Rows of a table as CSV; coordinates have a column each, matrices their lower triangle."""
    flat: dict[str, list[str]] = {}
    for key, values in columns.items():
        shape = next((_shape(v) for v in values if v is not None), ())
        for name, pick in _cells(key, shape):
            flat[name] = ["" if v is None else _cell(_at(v, pick)) for v in values]
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(flat)
    writer.writerows(zip(*flat.values(), strict=True))
    return out.getvalue()


def _shape(value: Any) -> tuple[int, ...]:
    """Of nested lists of numbers."""
    shape = []
    while isinstance(value, list | tuple):
        shape.append(len(value))
        value = value[0] if len(value) else None
    return tuple(shape)


def _cells(key: str, shape: tuple[int, ...]) -> list[tuple[str, tuple[int, ...]]]:
    """Columns of a value with the place of each in it."""
    if not shape:
        return [(key, ())]
    parts = _PARTS.get(shape[0], tuple(str(k) for k in range(shape[0])))
    if len(shape) == 1:
        base = "" if key == "xyz" else f"{key}_"
        return [(f"{base}{parts[k]}", (k,)) for k in range(shape[0])]
    places = [(i, j) for i in range(shape[0]) for j in range(shape[1])]
    if key == "covariance":
        places = [(i, j) for i, j in places if j <= i]
    return [(f"{key}_{parts[i]}_{parts[j]}", (i, j)) for i, j in places]


def _at(value: Any, place: tuple[int, ...]) -> Any:
    for k in place:
        value = value[k]
    return value


def _cell(value: Any) -> str:
    """A number as short as it can be read back, a text that no spreadsheet takes for a formula."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    return name_cell(value) if isinstance(value, str) else repr(value)
