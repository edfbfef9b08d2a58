"""What the report says of the comparison of two stations: sites, predictions, regression."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from tribrach._types import Array
from tribrach.comparison.predicted import OffsetTest
from tribrach.comparison.regression import Regression, regress
from tribrach.comparison.results import SiteResult, comparison_json
from tribrach.errors import InputError
from tribrach.report.comparison_page import (
    comparison_pictures,
    comparison_sentences,
    comparison_tables,
)
from tribrach.report.regression_page import regression_pictures, regression_tables
from tribrach.report.scan_content import Picture
from tribrach.report.tables import ReportTable

__all__ = ["ComparisonChapter", "comparison_chapter"]


#: columns of the regression with their units
_UNITS = {"range": "m", "incidence": "deg", "mean": "mm", "std": "mm"}


@dataclass(frozen=True)
class ComparisonChapter:
    """Two stations or scans, a against the reference b.

    values : columns of the regression of nearest-neighbour distances on range and incidence;
    remarks : why there is none, and how sites were chosen.
    """

    a: str
    b: str
    limit: float
    sites: tuple[SiteResult, ...]
    offsets: OffsetTest | None = None
    regression: Regression | None = None
    values: Mapping[str, Array] = field(default_factory=dict, repr=False)
    remarks: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """Which is compared with which."""
        return f"{self.a} against {self.b}"

    @property
    def _slug(self) -> str:
        """Both names as part of an anchor."""
        return re.sub(r"\W+", "-", f"{self.a}-{self.b}")

    def sentences(self) -> list[str]:
        """What it came to."""
        said = [*comparison_sentences(self.sites, self.offsets), *self.remarks]
        return said if self.regression is None else [*said, *self.regression.sentences()]

    def tables(self, angle: Literal["gon", "deg"] = "deg") -> list[ReportTable]:
        """All tables that have rows, named after both stations."""
        tables = comparison_tables(self.sites, angle)
        if self.regression is not None:
            tables += regression_tables(self.regression, _UNITS)
        return [
            replace(t, name=f"{t.name}-{self._slug}", title=f"{self.title}: {t.title}")
            for t in tables
            if t.rows
        ]

    def pictures(self) -> list[Picture]:
        """Map, histogram, predicted against observed, curves of the regression."""
        shown = comparison_pictures(self.sites, self.limit)
        if self.regression is not None:
            shown += regression_pictures(self.values, _UNITS, self.regression)
        return [
            replace(p, name=f"{p.name}-{self._slug}", title=f"{self.title}: {p.title}")
            for p in shown
        ]

    def to_json(self) -> dict[str, Any]:
        """Plain numbers; the regression null where there is none."""
        data = comparison_json(self.a, self.b, self.limit, self.sites, self.offsets)
        found = self.regression
        return data | {
            "regression": None if found is None else found.to_json(),
            "sentences": self.sentences(),
        }


def comparison_chapter(
    a: str,
    b: str,
    limit: float,
    sites: Sequence[SiteResult],
    offsets: OffsetTest | None = None,
    remarks: Sequence[str] = (),
) -> ComparisonChapter:
    """The chapter of a comparison, with the regression where the sites carry one."""
    values = _values(sites)
    regression, said = None, list(remarks)
    if len(values["range"]) > 1:
        try:
            regression = regress(values, ["range", "incidence"], ["mean", "std"], _UNITS)
        except InputError as error:
            said.append(f"No regression on range and incidence: {error.what}.")
    return ComparisonChapter(a, b, limit, tuple(sites), offsets, regression, values, tuple(said))


def _values(sites: Sequence[SiteResult]) -> dict[str, Array]:
    """Columns over the sites that have all of them."""
    rows = [
        (s.range, np.degrees(s.incidence), 1e3 * s.c2c.mean, 1e3 * s.c2c.std)
        for s in sites
        if s.range is not None
        and s.incidence is not None
        and s.c2c is not None
        and s.c2c.mean is not None
        and s.c2c.std is not None
    ]
    return dict(zip(_UNITS, np.array(rows, dtype=float).reshape(-1, 4).T, strict=True))
