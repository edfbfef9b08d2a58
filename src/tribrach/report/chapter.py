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

__all__ = ["Chapter"]


@dataclass(frozen=True)
class Chapter:
    """One chapter.

    Parameters
    ----------
    name : str
        Anchor in the page, unique in a report.
    title : str
        Its heading.
    sentences : tuple of str
        Findings, each a sentence.
    pictures : tuple of Picture
        In the page only.
    tables : tuple of ReportTable
        Those without rows are left out.
    data : Result, sequence or mapping of results, or None
        What the JSON result holds; None if it holds nothing.
    warnings : tuple of ReportWarning
        What belongs on top of the report.
    key : str
        Key of the data in the JSON result; the name if it is empty.
    signed : bool
        True for the figures that one signs: they come first. The others stand behind them, and a
        page shows them when they are asked for.
    """

    name: str
    title: str
    sentences: tuple[str, ...] = ()
    pictures: tuple[Picture, ...] = ()
    tables: tuple[ReportTable, ...] = ()
    data: Any = None
    warnings: tuple[ReportWarning, ...] = ()
    key: str = ""
    signed: bool = False
