"""The table of the figures of all instruments with their sources."""

from __future__ import annotations

from collections.abc import Sequence

from tribrach.report.content import InstrumentFigure
from tribrach.report.tables import ColumnHead, ReportTable, build_table, number_cell, text_cell

__all__ = ["instrument_table"]

_NOTE = (
    "What the a-priori sigmas and the footprint of the beam were taken from. Makers' figures are "
    "of single points under good conditions and mean one sigma or a limit, as each maker likes: "
    "compare them with the sheet of the instrument at hand, and with a field check. Defaults stand "
    "where the maker publishes nothing."
)


def instrument_table(figures: Sequence[InstrumentFigure]) -> ReportTable:
    """One row per figure; without rows if no instrument is given."""
    columns = [
        (ColumnHead("Instrument", numeric=False), lambda f: text_cell(f.instrument)),
        (ColumnHead("Sheet", numeric=False), lambda f: text_cell(f.sheet)),
        (ColumnHead("Figure", numeric=False), lambda f: text_cell(f.key)),
        (ColumnHead("value"), lambda f: number_cell(f.value, f"{f.value:g}")),
        (ColumnHead("Source", numeric=False), lambda f: text_cell(f.source)),
    ]
    return build_table("instruments", "Instruments", _NOTE, figures, columns)
