"""The tables of the report, the same for every rendering: heads, cells, what they sort by."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress
from typing import Any, TypeVar

import numpy as np

from tribrach.sentences import Sentence

Item = TypeVar("Item")

#: rows of a table in text and HTML; nobody reads more, and the JSON result has all
ROW_LIMIT = 1000
#: a zero with a sign, alone or before a unit
_ZERO = re.compile(r"^-(0(?:\.0*)?)(?![\d.])")


@dataclass(frozen=True)
class ColumnHead:
    """Head of a column with its unit; ``wide`` columns are left out of narrow prints."""

    head: str
    unit: str = ""
    numeric: bool = True
    wide: bool = False


@dataclass(frozen=True)
class Cell:
    """What stands in a cell."""

    text: str  #: its words or its number
    key: float | str | None = None  #: what it sorts by
    mark: str = ""  #: how it stands out
    unit: str = ""  #: of a number whose column has several
    #: as many digits the longest fraction of the column has more: blanks of that width put the
    #: decimal points of a column one below the other
    blanks: int = 0

    @property
    def padding(self) -> str:
        """Blanks as wide as the digits that are missing, and as the point where it is."""
        if not self.blanks:
            return ""
        point = "\u2008" * ("." not in self.text)
        return point + "\u2007" * (self.blanks - len(point))

    @property
    def words(self) -> str:
        """The text with its unit."""
        return f"{self.text} {self.unit}" if self.unit else self.text


@dataclass(frozen=True)
class Row:
    """A row of a table."""

    cells: tuple[Cell, ...]  #: from the left
    state: str = ""  #: of what the row is about
    #: names of the points that it is about, one or two, to be shown in the plan
    ends: tuple[str, ...] = ()


#: a column: its head, and how it makes a cell of an item
Spec = tuple[ColumnHead, Callable[[Any], Cell]]
#: a number as cells have it: sign, digits with what groups them, fraction, percent
_NUMBER = re.compile(r"(?:< )?[-+]?\d[\d,]*(?:\.(\d+))?(?: %)?")


def _plain(item: Any) -> str:
    return ""


def _nowhere(item: Any) -> tuple[str, ...]:
    return ()


@dataclass(frozen=True)
class Worst:
    """Which rows of a long table are shown."""

    words: str  #: in a sentence: "those with the largest w"
    #: of an item: those with the largest are shown; if not given, the items stand in that order
    size: Callable[[Any], float] | None = None


@dataclass(frozen=True)
class ReportTable:
    """A table with one row for each item; its cells are made when it is first looked at."""

    #: anchor in the page, heading, and what has to be known to read it
    name: str
    title: str
    note: str
    items: Sequence[Any]  #: what the rows are about
    specs: tuple[Spec, ...]  #: the columns
    state: Callable[[Any], str] = _plain  #: state of the row of an item, see :class:`Row`
    left_out: int = 0  #: how many further items have no row
    #: which items keep their rows where not all can have one; the first if not given
    worst: Worst | None = None
    #: names of the points that an item is about, see :class:`Row`
    ends: Callable[[Any], tuple[str, ...]] = _nowhere

    @cached_property
    def _made(self) -> tuple[tuple[ColumnHead, ...], tuple[Row, ...]]:
        """Heads and rows; columns that have no text in any row are left out."""
        heads = tuple(head for head, _ in self.specs)
        made = [tuple(make(item) for _, make in self.specs) for item in self.items]
        if made:
            used = [any(cells[k].text for cells in made) for k in range(len(heads))]
            heads = tuple(compress(heads, used))
            made = [tuple(compress(cells, used)) for cells in made]
        made = _by_the_point(made, [head.numeric for head in heads])
        rows = tuple(
            Row(cells, self.state(item), self.ends(item))
            for cells, item in zip(made, self.items, strict=True)
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


def _by_the_point(
    rows: Sequence[tuple[Cell, ...]], numeric: Sequence[bool]
) -> list[tuple[Cell, ...]]:
    """The cells with blanks that put decimal points one below the other."""
    columns = [list(column) for column in zip(*rows, strict=True)]
    for column in compress(columns, numeric):
        found = [_NUMBER.fullmatch(cell.text) for cell in column]
        numbers = [isinstance(cell.key, int | float) for cell in column]
        if any(match is None for match in compress(found, numbers)):
            continue
        fractions = [0 if m is None or m[1] is None else 1 + len(m[1]) for m in found]
        longest = max(fractions, default=0)
        for k, (cell, own) in enumerate(zip(column, fractions, strict=True)):
            if isinstance(cell.key, int | float) and own < longest:
                column[k] = replace(cell, blanks=longest - own)
    return list(zip(*columns, strict=True))


def text_cell(text: str, mark: str = "") -> Cell:
    """A cell of words."""
    return Cell(text, text, mark)


def number_cell(value: float | None, text: str, mark: str = "", unit: str = "") -> Cell:
    """A cell of a number, sorted by its value; empty if there is none, and zero without a sign."""
    if value is None or math.isnan(value):
        return Cell("", None, mark)
    return Cell(text if isinstance(text, Sentence) else _ZERO.sub(r"\1", text), value, mark, unit)


def build_table(
    name: str,
    title: str,
    note: str,
    items: Sequence[Item],
    columns: Sequence[tuple[ColumnHead, Callable[[Item], Cell]]],
    state: Callable[[Item], str] = _plain,
    most: int | None = None,
    worst: Worst | None = None,
    ends: Callable[[Item], tuple[str, ...]] = _nowhere,
) -> ReportTable:
    """A table with one row for each of ``most`` items (all if None).

    ``worst`` says which rows are shown where there are too many, ``state`` how a row is marked,
    ``ends`` which points an item is about. Columns without any text are left out.
    """
    table = ReportTable(name, title, note, items, tuple(columns), state, worst=worst, ends=ends)
    return table.first(most)
