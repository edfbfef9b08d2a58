"""What the report says of scans: targets found, clouds written, their uncertainty.

Metres and radians; pictures are PNG files in base64.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tribrach.report.budget_content import BudgetRow

__all__ = ["FoundTarget", "Picture", "Rejection", "ScanChapter", "Side", "TruthRow", "WrittenCloud"]

Triple = tuple[float, float, float]
Side = Literal["within", "above", "below", "wrong"]


@dataclass(frozen=True)
class FoundTarget:
    """A target found in a scan: its number in the picture, the name it got, its numbers.

    center and sigma along x, y, z of the scanner frame; name "" if nothing else saw it; range and
    incidence None where the place of the scanner is not known.
    """

    scan: str
    number: int
    kind: str
    name: str
    center: Triple
    sigma: Triple
    range: float | None
    incidence: float | None
    points: int
    rms: float
    coverage: float
    remark: str = ""


@dataclass(frozen=True)
class Rejection:
    """What looked like a target and was none, with the reason."""

    scan: str
    kind: str
    center: Triple
    reason: str


@dataclass(frozen=True)
class Picture:
    """A figure: PNG in base64, what it shows."""

    name: str
    title: str
    png: str
    caption: str


@dataclass(frozen=True)
class WrittenCloud:
    """A cloud that was written.

    sigma : root mean square along the axes of its frame; median, p95, largest : of the
    three-dimensional sigma; weakest : sigma, azimuth and elevation of the direction in which the
    cloud as a whole is known least, None for merged clouds; step : of stored coordinates, None for
    copies of a source; without sigmas all of these but the step are None.
    """

    name: str
    file: str
    points: int
    sigma: Triple | None
    median: float | None
    p95: float | None
    largest: float | None
    weakest: Triple | None
    step: float | None
    shares: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class TruthRow:
    """A comparison of a simulated project with its truth: error, test, limits, verdict.

    statistic against least (None where only large ones are wrong) and limit; dof : of chi-square, 0
    where it is none; side : of the limits that the statistic is on, "wrong" of what is counted.
    """

    what: str
    name: str
    words: str
    statistic: float | None = None
    least: float | None = None
    limit: float | None = None
    dof: int = 0
    side: Side = "within"

    @property
    def agrees(self) -> bool:
        """True if the errors are as large as stated, and the counts right."""
        return self.side == "within"

    @property
    def verdict(self) -> str:
        """The same in words."""
        return {
            "within": "as stated",
            "above": "not so: larger than stated",
            "below": "not so: smaller than stated",
            "wrong": "not so",
        }[self.side]


@dataclass(frozen=True)
class ScanChapter:
    """All of it.

    placement, budget : sentences on how stations were placed and on the precision budget;
    warnings : what clouds do not carry and why, for the head of the report.
    """

    targets: tuple[FoundTarget, ...]
    rejections: tuple[Rejection, ...]
    pictures: tuple[Picture, ...]
    clouds: tuple[WrittenCloud, ...]
    placement: tuple[str, ...]
    budget: tuple[str, ...]
    truth: tuple[TruthRow, ...] = ()
    error_budget: tuple[BudgetRow, ...] = ()
    warnings: tuple[str, ...] = ()
