"""The tables of the report, the same for every rendering: heads, cells, what they sort by."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from typing import TypeVar

__all__ = ["Cell", "ColumnHead", "ReportTable", "Row", "build_table", "number_cell", "text_cell"]

Item = TypeVar("Item")


@dataclass(frozen=True)
class ColumnHead:
    """Head of a column with its unit; ``wide`` columns are left out of narrow prints."""

    head: str
    unit: str = ""
    numeric: bool = True
    wide: bool = False


@dataclass(frozen=True)
class Cell:
    """Text of a cell, what it sorts by, and a mark: ``bad``, ``good`` or nothing."""

    text: str
    key: float | str | None = None
    mark: str = ""


@dataclass(frozen=True)
class Row:
    """Cells of a row and its state: ``off``, ``check``, ``suspicious`` or nothing."""

    cells: tuple[Cell, ...]
    state: str = ""


@dataclass(frozen=True)
class ReportTable:
    """A table with its title, a note in words and how many rows were left out."""

    name: str
    title: str
    note: str
    columns: tuple[ColumnHead, ...]
    rows: tuple[Row, ...]
    left_out: int = 0

    def narrow(self) -> ReportTable:
        """Without the wide columns."""
        return self._keep([not column.wide for column in self.columns])

    def filled(self) -> ReportTable:
        """Without columns that have no text in any row."""
        used = [any(r.cells[k].text for r in self.rows) for k in range(len(self.columns))]
        return self._keep(used) if self.rows else self

    def first(self, most: int | None) -> ReportTable:
        """The first ``most`` rows (all if None), the others counted as left out."""
        if most is None or len(self.rows) <= most:
            return self
        left_out = self.left_out + len(self.rows) - most
        return replace(self, rows=self.rows[:most], left_out=left_out)

    def _keep(self, chosen: Sequence[bool]) -> ReportTable:
        rows = tuple(replace(r, cells=tuple(compress(r.cells, chosen))) for r in self.rows)
        return replace(self, columns=tuple(compress(self.columns, chosen)), rows=rows)


def text_cell(text: str, mark: str = "") -> Cell:
    """A cell of words."""
    return Cell(text, text, mark)


def number_cell(value: float | None, text: str, mark: str = "") -> Cell:
    """A cell of a number, sorted by its value; empty if there is none."""
    return Cell("" if value is None else text, value, mark)


def build_table(
    name: str,
    title: str,
    note: str,
    items: Sequence[Item],
    columns: Sequence[tuple[ColumnHead, Callable[[Item], Cell]]],
    state: Callable[[Item], str] = lambda item: "",
    most: int | None = None,
) -> ReportTable:
    """A table with one row for each of the first ``most`` items (all if None).

    columns : each says how it makes a cell of an item; those without any text are left out.
    """
    shown = items[:most]
    rows = tuple(Row(tuple(make(item) for _, make in columns), state(item)) for item in shown)
    heads = tuple(column for column, _ in columns)
    return ReportTable(name, title, note, heads, rows, len(items) - len(shown)).filled()
