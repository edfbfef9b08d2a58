"""A chapter of a report: findings in words, pictures, tables, and data for the JSON result.

Everything that a report says after its head comes as chapters. Each is made by one file in
:mod:`tribrach.report.chapters`; renderings print them one after the other and know none by name.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tribrach.report.figures import Picture
from tribrach.report.tables import ReportTable
from tribrach.report.warnings import ReportWarning


@dataclass(frozen=True)
class Chapter:
    """One chapter of the report of a network."""

    name: str  #: anchor in the page, unique in a report
    title: str  #: its heading
    sentences: tuple[str, ...] = ()  #: findings, each a sentence
    pictures: tuple[Picture, ...] = ()  #: in the page only
    tables: tuple[ReportTable, ...] = ()  #: those without rows are left out
    data: Any = None  #: what the JSON result holds; None if it holds nothing
    warnings: tuple[ReportWarning, ...] = ()  #: what belongs on top of the report
    key: str = ""  #: key of the data in the JSON result; the name if it is empty
    #: true for the figures that one signs: they come first. The others stand behind them, and a
    #: page shows them when they are asked for.
    signed: bool = False
