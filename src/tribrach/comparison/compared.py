"""Two clouds or stations against each other: all their sites, and what these say together."""

from __future__ import annotations

from dataclasses import dataclass

from tribrach.answers import Result
from tribrach.comparison.predicted import OffsetTest
from tribrach.comparison.predicted_classes import PredictedClass, predicted_classes
from tribrach.comparison.results import SiteResult


@dataclass(frozen=True)
class Units(Result):
    """Units of all numbers."""

    length: str = "m"
    angle: str = "rad"


@dataclass(frozen=True)
class CloudComparison(Result, also=("units", "classes")):
    """A comparison of two clouds or stations, a against the reference b."""

    a: str
    b: str
    #: longest distance that was compared [m]
    limit: float
    sites: tuple[SiteResult, ...]
    offsets: OffsetTest | None = None  #: all sites against the joint covariance of the stations

    @property
    def units(self) -> Units:
        """Units of all numbers."""
        return Units()

    @property
    def classes(self) -> list[PredictedClass]:
        """All sites together, by intensity, range and incidence."""
        return predicted_classes(self.sites)
