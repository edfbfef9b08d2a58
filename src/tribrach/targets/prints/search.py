"""The search for flat printed targets: candidates of each size are fitted, the best fit stays.

Discs and checkerboards differ in what a candidate is and how it is fitted; the loop is the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.scan.range_image import RangeImage
from tribrach.targets.detection import Kind, Rejected
from tribrach.targets.prints.windows import points_around

__all__ = ["BestFits", "PrintCandidate", "PrintFit", "PrintSearch", "Refused", "footprint_at"]


class PrintFit(Protocol):
    """What the search asks of a fit: centre (3,) [m], share of the variance of light explained."""

    @property
    def center(self) -> Array:
        """Scanner frame [m]."""

    @property
    def explained(self) -> float:
        """0 to 1."""


@dataclass(frozen=True)
class Refused:
    """Why points are no target, in one sentence without the stop.

    texture : nothing like a target is there, which is not worth a line in the report.
    """

    reason: str
    texture: bool = False


@dataclass(frozen=True)
class PrintCandidate:
    """A pixel of the range image that may look at the centre of a target.

    notable : its refusal is worth a line even if it looks like texture.
    """

    row: int
    column: int
    notable: bool = False


Fit = TypeVar("Fit", bound=PrintFit)


class BestFits(Generic[Fit]):
    """Fits with the sizes [m] that they were made for, one at each place.

    apart : fits nearer than this many of the larger of their sizes are at one place.
    """

    def __init__(self, apart: float) -> None:
        self.apart = apart
        self.fits: list[tuple[Fit, float]] = []

    def near(self, place: Array, sizes: float, of_size: float | None = None) -> bool:
        """Is there a fit within so many of its sizes of a place (3,)? of_size : of this size."""
        return any(
            np.linalg.norm(fit.center - place) < sizes * size
            for fit, size in self.fits
            if of_size is None or size == of_size
        )

    def keep(self, fit: Fit, size: float) -> None:
        """Add a fit unless a better one is at the same place; then it replaces a worse one."""
        for k, (other, other_size) in enumerate(self.fits):
            if np.linalg.norm(other.center - fit.center) < self.apart * max(other_size, size):
                if fit.explained > other.explained:
                    self.fits[k] = (fit, size)
                return
        self.fits.append((fit, size))


@dataclass(frozen=True)
class PrintSearch(Generic[Fit]):
    """What a kind of printed target brings to the search.

    Attributes
    ----------
    kind
        Of the detections.
    candidates
        Candidates for a size [m], the strongest first.
    fit
        Fits the points with numbers (k,) around a place (3,) [m] to a target of a size [m].
    reach_sizes
        Half the window of points around a candidate, over the size.
    same_start_sizes
        A candidate nearer than this many of its sizes to a fit is that target ...
    same_size_only
        ... if the fit is of the size that is sought.
    same_target_sizes
        Fits nearer than this many of the larger of their sizes are one target.
    """

    kind: Kind
    candidates: Callable[[float], Iterable[PrintCandidate]]
    fit: Callable[[NDArray[np.int32], Array, float], Fit | Refused]
    reach_sizes: float
    same_start_sizes: float
    same_size_only: bool
    same_target_sizes: float

    def run(
        self, image: RangeImage, sizes: Sequence[float]
    ) -> tuple[list[tuple[Fit, float]], list[Rejected]]:
        """Fits with their sizes, one at each place, and the refusals that are worth a line."""
        best: BestFits[Fit] = BestFits(self.same_target_sizes)
        rejected: list[Rejected] = []
        for size in sizes:
            of_size = size if self.same_size_only else None
            for candidate in self.candidates(size):
                window, start = points_around(
                    image, candidate.row, candidate.column, self.reach_sizes * size
                )
                if start is None or best.near(start, self.same_start_sizes, of_size):
                    continue
                outcome = self.fit(window, start, size)
                if not isinstance(outcome, Refused):
                    best.keep(outcome, size)
                elif candidate.notable or not outcome.texture:
                    rejected.append(Rejected(self.kind, np.asarray(start), outcome.reason))
        return best.fits, rejected


def footprint_at(footprint: tuple[float, float], place: Array) -> float:
    """Diameter [m] of a beam at a place (3,); footprint : exit diameter [m], divergence [rad]."""
    return float(np.hypot(footprint[0], footprint[1] * np.linalg.norm(place)))
