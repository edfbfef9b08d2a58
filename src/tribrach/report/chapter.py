"""A chapter of the report that only some jobs have: words, pictures, tables, data.

Everything that is not the adjustment itself comes as chapters: comparisons between stations,
registration, GNSS, lever arms, calibration. A stage makes one, the report prints it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from tribrach.report.scan_content import Picture
from tribrach.report.tables import ReportTable

__all__ = ["Chapter"]


@dataclass(frozen=True)
class Chapter:
    """One chapter, after the scans and before the tables of the adjustment.

    name : anchor in the page and key in the JSON result; sentences : findings, each a sentence;
    data : what the JSON result holds under ``name``: numbers in metres and radians, text, lists and
    dictionaries with names as keys, None where there is no number.
    """

    name: str
    title: str
    sentences: tuple[str, ...] = ()
    pictures: tuple[Picture, ...] = ()
    tables: tuple[ReportTable, ...] = ()
    data: Mapping[str, Any] = field(default_factory=dict)
