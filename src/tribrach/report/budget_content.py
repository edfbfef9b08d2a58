"""What the report says of the error budget: regions of each station, variances part by part.

Variances [m^2] are means over the sampled points of a region and add up to those of the points.
"""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["BudgetPart", "BudgetRow"]


@dataclass(frozen=True)
class BudgetPart:
    """A part of the budget: variance of all three directions, along the normal, in the surface.

    normal and tangential are None where no normals are known.
    """

    name: str
    variance: float
    normal: float | None
    tangential: float | None


@dataclass(frozen=True)
class BudgetRow:
    """A region of a station by range [m] and incidence [degrees]; share of the sampled points."""

    station: str
    region: str
    points: int
    share: float
    parts: tuple[BudgetPart, ...]

    @property
    def variance(self) -> float:
        """Sum over the parts [m^2]."""
        return sum(part.variance for part in self.parts)

    @property
    def normal(self) -> float | None:
        """Sum along the normal [m^2]."""
        return _sum([part.normal for part in self.parts])

    @property
    def tangential(self) -> float | None:
        """Sum in the surface [m^2]."""
        return _sum([part.tangential for part in self.parts])

    def part(self, *names: str) -> float | None:
        """Variance [m^2] of parts together; None if the budget has none of them."""
        found = [part.variance for part in self.parts if part.name in names]
        return sum(found) if found else None


def _sum(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) if len(known) == len(values) and known else None
