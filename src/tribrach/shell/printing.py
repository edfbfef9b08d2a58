"""Prints the tables of a report in a terminal."""

from __future__ import annotations

from rich.console import JustifyMethod
from rich.markup import escape
from rich.table import Table as Printed

from tribrach.report.characters import visible
from tribrach.report.tables import ReportTable

#: characters up to which words of heads, and cells of words, are kept in one piece
_WORD, _CELL = 10, 14


def printed(table: ReportTable, width: int) -> Printed:
    """A table as the terminal shows it.

    Heads carry their units, numbers stand to the right, brackets are kept as text. Where a table
    needs more characters than a line has, heads are folded and then blanks left out; numbers are
    never cut, since a cut number is another number. Of a table without heads words are folded.
    """
    heads = any(column.head or column.unit for column in table.columns)
    widths = [_natural(table, k) for k in range(len(table.columns))]
    if heads and _total(widths, 1) > width:
        widths = [_least(table, k) for k in range(len(table.columns))]
        # what is left goes to the words that need it most
        missing = [_natural(table, k) - least for k, least in enumerate(widths)]
        words = [0 if c.numeric else m for c, m in zip(table.columns, missing, strict=True)]
        if any(words):
            k = words.index(max(words))
            widths[k] += max(0, min(words[k], width - _total(widths, 1)))
    padding = 0 if heads and _total(widths, 1) > width else 1
    out = Printed(
        title=escape(visible(table.title)),
        title_justify="left",
        padding=(0, padding),
        show_header=heads,
    )
    for column, characters in zip(table.columns, widths, strict=True):
        head = f"{column.head}\n{column.unit}" if column.unit else column.head
        justify: JustifyMethod = "right" if column.numeric else "left"
        own = characters if heads else None
        out.add_column(head, justify=justify, width=own, overflow="fold")
    for row in table.rows:
        out.add_row(*(escape(visible(cell.words)) for cell in row.cells))
    return out


def _total(widths: list[int], padding: int) -> int:
    """Characters of a line with its borders."""
    return sum(widths) + (2 * padding + 1) * len(widths) + 1


def _natural(table: ReportTable, k: int) -> int:
    """Characters of a column that is not folded."""
    column = table.columns[k]
    return max(len(column.head), len(column.unit), _longest(table, k))


def _least(table: ReportTable, k: int) -> int:
    """Characters of a column with its head, or its cells of many words, folded."""
    column = table.columns[k]
    words = max(map(len, (*column.head.split(), column.unit)), default=0)
    longest = _longest(table, k)
    return max(min(words, _WORD), longest if column.numeric else min(longest, _CELL))


def _longest(table: ReportTable, k: int) -> int:
    return max((len(row.cells[k].words) for row in table.rows), default=0)
