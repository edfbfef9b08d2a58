"""The chapters on comparisons between stations: sites, predictions, regression."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, NamedTuple

from tribrach._types import Array
from tribrach.comparison.regression import Regression, regress
from tribrach.job.station_comparison import REGRESSION_UNITS, StationComparison
from tribrach.report.chapter import Chapter
from tribrach.report.characters import anchor
from tribrach.report.comparison import (
    comparison_findings,
    comparison_pictures,
    comparison_tables,
)
from tribrach.report.content import Head
from tribrach.report.figures import Picture
from tribrach.report.findings import words
from tribrach.report.names import spoken
from tribrach.report.regression import RegressionFigures, regression_pictures, regression_tables
from tribrach.report.subject import Subject
from tribrach.report.tables import ReportTable

if TYPE_CHECKING:
    from tribrach.job.results import JobResults

_KEY = "comparisons"


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """One chapter for each comparison."""
    return [comparison_chapter(one, head.settings.angle) for one in job.comparisons]


def comparison_chapter(one: StationComparison, angle: Literal["gon", "deg"] = "deg") -> Chapter:
    """What a comparison came to; names of its tables and pictures end with those of both."""
    told = _told(one)
    shown = _shown(one, angle)
    slug, title = anchor(f"{one.a}-{one.b}"), f"{spoken(one.a)} against {spoken(one.b)}"
    return Chapter(
        f"comparison-{slug}",
        f"Comparison between stations: {title}",
        tuple(told.sentences) or ("nothing",),
        tuple(replace(p, name=f"{p.name}-{slug}", title=p.title) for p in _pictures(one, shown)),
        tuple(
            replace(t, name=f"{t.name}-{slug}", title=t.title) for t in _tables(one, shown, angle)
        ),
        told,
        key=_KEY,
    )


@dataclass(frozen=True)
class ToldComparison(StationComparison, also=("sentences",)):
    """A comparison between stations of a job."""

    #: of nearest-neighbour distances on range and incidence
    regression: RegressionFigures | None = None

    @property
    def sentences(self) -> list[str]:
        """Result of the comparison in words."""
        fits = [] if self.regression is None else self.regression.sentences
        return [*words(comparison_findings(self)), *self.remarks, *fits]


def _told(one: StationComparison) -> ToldComparison:
    """A comparison with its sentences."""
    figures = None if one.regression is None else RegressionFigures(**vars(one.regression))
    return ToldComparison(**vars(one) | {"regression": figures})


class _Shown(NamedTuple):
    """The regression with incidence in the unit of the report, its columns and their units."""

    values: Mapping[str, Array]
    regression: Regression
    units: Mapping[str, str]


def _shown(one: StationComparison, angle: Literal["gon", "deg"]) -> _Shown | None:
    """The regression as the report shows it: coefficients have the unit of its angles."""
    if one.regression is None:
        return None
    if angle == "deg":
        return _Shown(one.values, one.regression, REGRESSION_UNITS)
    values = {**one.values, "incidence": one.values["incidence"] / 0.9}
    units = {**REGRESSION_UNITS, "incidence": "gon"}
    causes = list(dict.fromkeys(r.x for r in one.regression.relations))
    quantities = list(dict.fromkeys(r.y for r in one.regression.relations))
    return _Shown(values, regress(values, causes, quantities, units), units)


def _tables(
    one: StationComparison, shown: _Shown | None, angle: Literal["gon", "deg"]
) -> list[ReportTable]:
    tables = comparison_tables(one, angle)
    if shown is not None:
        tables += regression_tables(shown.regression, shown.units)
    return tables


def _pictures(one: StationComparison, shown: _Shown | None) -> list[Picture]:
    """Map, histogram, predicted against observed, curves of the regression."""
    pictures = comparison_pictures(one)
    if shown is not None:
        pictures += regression_pictures(shown.values, shown.units, shown.regression)
    return pictures


SUBJECT = Subject(_KEY, _chapters, list[ToldComparison], several=True)
