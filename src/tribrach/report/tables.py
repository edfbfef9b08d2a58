"""The tables of the report, the same for every rendering: heads, cells, what they sort by."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress
from typing import Any, TypeVar

__all__ = [
    "Cell",
    "ColumnHead",
    "ReportTable",
    "Row",
    "Spec",
    "build_table",
    "number_cell",
    "text_cell",
]

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


#: a column: its head, and how it makes a cell of an item
Spec = tuple[ColumnHead, Callable[[Any], Cell]]


def _plain(item: Any) -> str:
    return ""


@dataclass(frozen=True)
class ReportTable:
    """A table with one row for each item; its cells are made when it is first looked at.

    Parameters
    ----------
    name, title, note : str
        Anchor in the page, heading, and what has to be known to read it.
    items : sequence
        What the rows are about.
    specs : tuple of Spec
        The columns.
    state : callable
        State of the row of an item, see :class:`Row`.
    left_out : int
        How many further items have no row.
    """

    name: str
    title: str
    note: str
    items: Sequence[Any]
    specs: tuple[Spec, ...]
    state: Callable[[Any], str] = _plain
    left_out: int = 0

    @cached_property
    def _made(self) -> tuple[tuple[ColumnHead, ...], tuple[Row, ...]]:
        """Heads and rows; columns that have no text in any row are left out."""
        heads = tuple(head for head, _ in self.specs)
        made = [tuple(make(item) for _, make in self.specs) for item in self.items]
        if made:
            used = [any(cells[k].text for cells in made) for k in range(len(heads))]
            heads = tuple(compress(heads, used))
            made = [tuple(compress(cells, used)) for cells in made]
        rows = tuple(
            Row(cells, self.state(item)) for cells, item in zip(made, self.items, strict=True)
        )
        return heads, rows

    @property
    def columns(self) -> tuple[ColumnHead, ...]:
        """Heads of the columns that have any text."""
        return self._made[0]

    @property
    def rows(self) -> tuple[Row, ...]:
        """One row for each item."""
        return self._made[1]

    def narrow(self) -> ReportTable:
        """Without the wide columns."""
        return replace(self, specs=tuple(spec for spec in self.specs if not spec[0].wide))

    def first(self, most: int | None) -> ReportTable:
        """The first ``most`` rows (all if None), the others counted as left out."""
        if most is None or len(self.items) <= most:
            return self
        left_out = self.left_out + len(self.items) - most
        return replace(self, items=self.items[:most], left_out=left_out)


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
    state: Callable[[Item], str] = _plain,
    most: int | None = None,
) -> ReportTable:
    """A table with one row for each of the first ``most`` items (all if None).

    Parameters
    ----------
    columns : sequence of (head, make)
        ``make`` says how a cell is made of an item; columns without any text are left out.
    state : callable
        State of the row of an item.
    """
    return ReportTable(name, title, note, items, tuple(columns), state).first(most)
