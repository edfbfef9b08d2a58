"""The report as plain text to print, and the few lines a terminal shows."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from tribrach.report.chapter import Chapter
from tribrach.report.characters import visible
from tribrach.report.content import Report
from tribrach.report.notation import notation_of
from tribrach.report.tables import ROW_LIMIT, Cell, ColumnHead, ReportTable, Row
from tribrach.sentences import PLAIN, Notation, Sentence, joined

if TYPE_CHECKING:
    from tribrach.epochs.comparison import Comparison

#: characters per line of running text; tables may be a little wider
WIDTH = 100
_LEGEND = {"suspicious": "! suspicious", "check": "c held out as a check", "off": "x switched off"}


def render(content: Report, *, row_limit: int = ROW_LIMIT) -> str:
    """The whole report; tables have their worst ``row_limit`` rows, x is off, c a check."""
    notation = notation_of(content)
    say = notation.words
    warnings = [say("! " + text) for text in content.warnings]
    origin = [content.datum.sentence, content.sigma_origin]
    parts = [
        _head(content),
        _section("Warnings", warnings or ["none"]),
        _section("Datum and standard deviations", [say(text) for text in origin]),
        _section("Adjustment", [say(text) for text in _facts(content)]),
        *(part for chapter in content.chapters for part in _chapter(chapter, row_limit, notation)),
    ]
    return visible("\n\n".join(parts) + "\n")


def brief(content: Report) -> str:
    """What a terminal shows after an adjustment: warnings, fit, datum, worst observations."""
    summary = content.summary
    worst = next(table for table in content.tables(5) if table.name == "observations")
    say = notation_of(content).words
    lines = [
        content.title,
        *("! " + text for text in content.warnings),
        f"{summary.n_observations} observed values, {summary.n_unknowns} unknowns, "
        f"{summary.n_constraints} constraints, datum defect {summary.defect}, redundancy "
        f"{summary.dof}, {summary.iterations} iterations",
        _sigma0(content),
        summary.test.sentence,
        *(chapter.sentences if (chapter := content.chapter("adjustment")) else ()),
        content.datum.sentence,
        content.sigma_origin,
        *content.readings,
        *(_moved(one.comparison) for one in content.job.epochs),
    ]
    grid = ["", _grid(worst)] if worst.rows else []
    return visible("\n".join([wrapped(say(line)) for line in lines] + grid))


def _moved(comparison: Comparison) -> str:
    """What moved since an earlier epoch, with "!" where something did or cannot be told."""
    # loaded here, as few networks have earlier epochs
    from tribrach.report.epochs import moved_sentence

    sure = all(one.answer == "not moved" for one in comparison.displacements)
    return moved_sentence(comparison) if sure else "! " + moved_sentence(comparison)


def _sigma0(content: Report) -> str:
    summary = content.summary
    after = summary.sigma0_posterior
    words = "not estimated (no redundancy)" if after is None else Sentence("{after:4}", after=after)
    return Sentence(
        "sigma0 a priori {summary.sigma0:g}, a posteriori {words}", summary=summary, words=words
    )


def _head(content: Report) -> str:
    rule = "=" * WIDTH
    facts = [wrapped(f"{name}: {value}") for name, value in content.facts]
    made = f"Tribrach {content.version}, {content.date}"
    return "\n".join([rule, textwrap.fill(content.title, WIDTH), made, rule, *facts])


def _facts(content: Report) -> list[str]:
    """The adjustment in lines."""
    summary = content.summary
    return [
        f"observed values {summary.n_observations}, check values {summary.n_check}, switched off "
        f"{summary.n_off}",
        f"unknowns {summary.n_unknowns}, constraints {summary.n_constraints}, datum defect "
        f"{summary.defect}, redundancy {summary.dof}, iterations {summary.iterations}",
        Sentence(
            "weighted sum of squares {summary.vtpv:g6}; {sigma0}",
            summary=summary,
            sigma0=_sigma0(content),
        ),
        summary.test.sentence,
    ]


def _section(title: str, lines: list[str]) -> str:
    return "\n".join([title, "-" * len(title), *(wrapped(line) for line in lines)])


def wrapped(line: str) -> str:
    """A line broken to the width of running text."""
    return textwrap.fill(line, WIDTH, subsequent_indent="  ", break_on_hyphens=False)


def _chapter(chapter: Chapter, row_limit: int, notation: Notation) -> list[str]:
    """The findings of a chapter and its tables."""
    tables = [table.first(row_limit) for table in chapter.tables]
    said = [notation.words(text) for text in chapter.sentences]
    return [
        *([_section(chapter.title, said)] if said else []),
        *(
            table_text(table, notation, titled=not said or table.title != chapter.title)
            for table in tables
            if table.rows
        ),
    ]


def table_text(table: ReportTable, notation: Notation = PLAIN, *, titled: bool = True) -> str:
    """Title, note and grid of a table."""
    title = [table.title, "-" * len(table.title)] if titled else []
    legend = [_LEGEND[state] for state in _LEGEND if any(r.state == state for r in table.rows)]
    marks = f"Marks: {', '.join(legend)}." if legend else ""
    note = notation.words(joined(" ", filter(None, [table.note, marks, table.cut])))
    return "\n".join([*title, *([wrapped(note)] if note else []), _grid(table, notation)])


def _grid(table: ReportTable, notation: Notation = PLAIN) -> str:
    """Aligned columns: numbers to the right, words to the left; units under the heads."""
    table = table.narrow()
    grid = [
        [column.head for column in table.columns],
        [column.unit for column in table.columns],
        *(
            [_words(*item, notation) for item in zip(row.cells, table.columns, strict=True)]
            for row in table.rows
        ),
    ]
    if not any(grid[1]):
        del grid[1]
    width = [max(len(line[k]) for line in grid) for k in range(len(table.columns))]
    marks = ["  "] * (len(grid) - len(table.rows)) + [_mark(row) for row in table.rows]
    lines = [
        mark + "  ".join(_aligned(*item) for item in zip(line, table.columns, width, strict=True))
        for mark, line in zip(marks, grid, strict=True)
    ]
    return "\n".join(line.rstrip() for line in lines)


def _words(cell: Cell, column: ColumnHead, notation: Notation) -> str:
    """A cell with the blanks that put decimal points one below the other, and its unit."""
    unit = f" {cell.unit:4s}" if cell.unit else ""
    text = notation.cell(cell.text) if column.numeric else notation.words(cell.text)
    return text + " " * cell.blanks + unit


def _aligned(text: str, column: ColumnHead, width: int) -> str:
    return text.rjust(width) if column.numeric else text.ljust(width)


def _mark(row: Row) -> str:
    return f"{_LEGEND.get(row.state, ' ')[0]} "
