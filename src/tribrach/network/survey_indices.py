"""The names in the tables of a survey become indices of unknowns."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.geodesy.site import Site
from tribrach.network.observations.base import Observations
from tribrach.network.survey_table import Table, as_column
from tribrach.network.unknowns import FAMILIES, Layout

__all__ = ["concatenate", "layout_of"]


def layout_of(given: Mapping[str, Iterable[str]], tables: Sequence[Table]) -> Layout:
    """All names that are given, by family, or referred to by the tables.

    Raises
    ------
    InputError : a name is used both as a point and as a scanner station.
    """
    names: dict[str, dict[str, None]] = {family: {} for family in FAMILIES}
    for family, known in given.items():
        names[family] |= dict.fromkeys(known)
    for table in tables:
        for item in fields(table.kind):
            refers = item.metadata.get("refers")
            if refers is None or item.name not in table.columns:
                continue
            used = dict.fromkeys(n for n in table.columns[item.name].ravel() if n)
            if refers == "position":
                used = {n: None for n in used if n not in names["pose"]}
                refers = "point"
            names[refers] |= used
    clash = names["point"].keys() & names["pose"].keys()
    if clash:
        raise InputError(
            f"{sorted(clash)[0]} is used both as a point and as a scanner station",
            cure="give the station a name of its own",
        )
    return Layout(*(tuple(names[family]) for family in FAMILIES))


def concatenate(
    layout: Layout, tables: Sequence[Table], site: Site
) -> tuple[list[Observations], dict[int, tuple[int, int]]]:
    """One Observations per kind and group; where each table went (number, first item)."""
    grouped: dict[tuple[Any, ...], list[Table]] = {}
    for table in tables:
        shared = (f.name for f in fields(table.kind) if "shared" in f.metadata)
        # two instruments' calibration models do not mix, whatever their group
        key = (table.kind, table.group, *(table.columns.get(name) for name in shared))
        grouped.setdefault(key, []).append(table)
    out: list[Observations] = []
    place: dict[int, tuple[int, int]] = {}
    for (kind, group, *_), members in grouped.items():
        first = 0
        for table in members:
            place[id(table)] = (len(out), first)
            first += table.n
        out.append(_build(layout, kind, group, members, site))
    return out, place


def _build(
    layout: Layout, kind: type[Observations], group: str, members: list[Table], site: Site
) -> Observations:
    """The tables of one kind and group, one after the other."""
    columns: dict[str, Any] = {}
    for item in fields(kind):
        parts = [m.columns.get(item.name) for m in members]
        if item.name in ("group", "site") or all(part is None for part in parts):
            continue
        if "shared" in item.metadata:
            columns[item.name] = parts[0]
            continue
        default = 0 if item.name == "use" else item.metadata.get("per_item", "")
        filled = [
            np.full(m.n, default, dtype=object if default == "" else float)
            if part is None
            else as_column(part, m.n)
            for part, m in zip(parts, members, strict=True)
        ]
        column = np.concatenate(filled)
        family = item.metadata.get("refers")
        columns[item.name] = column if family is None else _indices(layout, family, column)
    if any(item.name == "site" for item in fields(kind)):
        columns["site"] = site
    return kind(group=group, **columns)


def _indices(layout: Layout, family: str, names: NDArray[Any]) -> NDArray[np.int64]:
    """Indices of names in a family; "" gives -1."""
    find = layout.position_index if family == "position" else lambda n: layout.index(family, n)
    index = [find(name) if name else -1 for name in names.ravel()]
    return np.array(index, dtype=np.int64).reshape(names.shape)
