"""Tables on terminals of any width: no number is cut, no line is longer than the terminal."""

import io

import pytest
from rich.console import Console

from tribrach.report.tables import ColumnHead, build_table, number_cell, text_cell
from tribrach.shell.printing import printed

ROWS = [(f"S{k}", 1234.5678 + k, 18.2 + k) for k in range(3)]


def shown(width: int, columns: int) -> str:
    """A table of so many columns of numbers beside one of words."""
    table = build_table(
        "t",
        "Title",
        "",
        ROWS,
        [
            (ColumnHead("Site", numeric=False), lambda r: text_cell(r[0])),
            *(
                (ColumnHead("incidence of B", "mm"), lambda r: number_cell(r[1], f"{r[1]:.4f}"))
                for _ in range(columns)
            ),
            (ColumnHead("Verdict", numeric=False), lambda r: text_cell("as predicted by [both]")),
        ],
    )
    out = io.StringIO()
    console = Console(file=out, width=width)
    console.print(printed(table, console.width))
    return out.getvalue()


@pytest.mark.parametrize(("width", "columns"), [(200, 5), (80, 5), (80, 4), (80, 2), (60, 3)])
def test_nothing_is_cut(width: int, columns: int) -> None:
    text = shown(width, columns)
    assert text.count("1235.5678") == columns
    assert "…" not in text
    assert max(map(len, text.splitlines())) <= width
    assert "both" in text


def test_wide_terminals_show_heads_in_one_line() -> None:
    assert "incidence of B" in shown(200, 3)
    assert "as predicted by [both]" in shown(80, 2)
