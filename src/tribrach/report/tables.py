"""The tables of the report, the same for every rendering: heads, cells, what they sort by."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress
from typing import Any, TypeVar

import numpy as np

__all__ = [
    "ROW_LIMIT",
    "Cell",
    "ColumnHead",
    "ReportTable",
    "Row",
    "Spec",
    "Worst",
    "build_table",
    "number_cell",
    "text_cell",
]

Item = TypeVar("Item")

#: rows of a table in text and HTML; nobody reads more, and the JSON result has all
ROW_LIMIT = 1000


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
class Worst:
    """Which rows of a long table are shown.

    Parameters
    ----------
    words : str
        In a sentence: "those with the largest w".
    size : callable, optional
        Of an item: those with the largest are shown; if not given, the items stand in that order.
    """

    words: str
    size: Callable[[Any], float] | None = None


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
    worst : Worst, optional
        Which items keep their rows where not all can have one; the first if not given.
    """

    name: str
    title: str
    note: str
    items: Sequence[Any]
    specs: tuple[Spec, ...]
    state: Callable[[Any], str] = _plain
    left_out: int = 0
    worst: Worst | None = None

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
        """The ``most`` worst rows in their order (all if None), the others counted as left out."""
        if most is None or len(self.items) <= most:
            return self
        left_out = self.left_out + len(self.items) - most
        items = self.items[:most]
        if self.worst is not None and self.worst.size is not None:
            size = np.array([self.worst.size(item) for item in self.items], dtype=float)
            chosen = np.sort(np.argsort(-np.nan_to_num(size), kind="stable")[:most])
            items = [self.items[k] for k in chosen.tolist()]
        return replace(self, items=items, left_out=left_out)

    @property
    def cut(self) -> str:
        """How many rows are left out, and which are shown; "" where all are."""
        if not self.left_out:
            return ""
        which = self.worst.words if self.worst else "the first"
        shown = len(self.items)
        return (
            f"{shown} of {shown + self.left_out} rows are shown, {which}; {self.left_out} are left "
            "out: the JSON result has all of them."
        )


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
    worst: Worst | None = None,
) -> ReportTable:
    """A table with one row for each of ``most`` items (all if None).

    Parameters
    ----------
    columns : sequence of (head, make)
        ``make`` says how a cell is made of an item; columns without any text are left out.
    state : callable
        State of the row of an item.
    worst : Worst, optional
        Which rows are shown where there are too many; the first if not given.
    """
    table = ReportTable(name, title, note, items, tuple(columns), state, worst=worst)
    return table.first(most)
