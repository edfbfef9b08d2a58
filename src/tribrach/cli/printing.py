"""A table of a report as the terminal shows it."""

from __future__ import annotations

from rich.table import Table as Printed

from tribrach.report.tables import Table

__all__ = ["printed"]


def printed(table: Table) -> Printed:
    """Heads with their units, numbers to the right; what stands in brackets is no markup."""
    out = Printed(title=table.title, title_justify="left")
    for column in table.columns:
        head = f"{column.head}\n{column.unit}" if column.unit else column.head
        out.add_column(head, justify="right" if column.numeric else "left")
    for row in table.rows:
        out.add_row(*(cell.text.replace("[", r"\[") for cell in row.cells))
    return out
