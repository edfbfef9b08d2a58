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
from tribrach.instruments.beam import Beam
from tribrach.scan.range_image import RangeImage
from tribrach.targets.detection import Kind, Rejected
from tribrach.targets.prints.windows import points_around


class PrintFit(Protocol):
    """What the search for printed targets needs of a fit."""

    @property
    def center(self) -> Array:
        """Centre (3,) in the scanner frame [m]."""

    @property
    def explained(self) -> float:
        """Share of the variance of intensity that the fit explains, 0 to 1."""


@dataclass(frozen=True)
class Refused:
    """Reason why points are not a target."""

    reason: str  #: one sentence without the full stop
    #: true if nothing like a target is there, which is not worth a line in the report
    texture: bool = False


@dataclass(frozen=True)
class PrintCandidate:
    """A pixel of the range image that may look at the centre of a target."""

    #: indices of the pixel
    row: int
    column: int
    notable: bool = False  #: true if its refusal is worth a line even if it looks like texture


Fit = TypeVar("Fit", bound=PrintFit)


class BestFits(Generic[Fit]):
    """Fits with the sizes [m] that they were made for, one at each place.

    Fits nearer than ``apart`` times the larger of their sizes are at one place.
    """

    def __init__(self, apart: float) -> None:
        self.apart = apart
        self.fits: list[tuple[Fit, float]] = []

    def near(self, place: Array, sizes: float, of_size: float | None = None) -> bool:
        """True if a fit, or one of a given size, is within so many of its sizes of a place."""
        return any(
            np.linalg.norm(fit.center - place) < sizes * size
            for fit, size in self.fits
            if of_size is None or size == of_size
        )

    def keep(self, fit: Fit, size: float) -> None:
        """Add a fit unless a better one is at the same place; it replaces a worse one there."""
        for k, (other, other_size) in enumerate(self.fits):
            if np.linalg.norm(other.center - fit.center) < self.apart * max(other_size, size):
                if fit.explained > other.explained:
                    self.fits[k] = (fit, size)
                return
        self.fits.append((fit, size))


@dataclass(frozen=True)
class PrintSearch(Generic[Fit]):
    """What a kind of printed target brings to the search."""

    kind: Kind  #: kind of the detections
    #: returns the candidates for a size [m], the strongest first
    candidates: Callable[[float], Iterable[PrintCandidate]]
    #: fits the points with numbers (k,) around a place (3,) [m] to a target of a size [m]
    fit: Callable[[NDArray[np.int32], Array, float], Fit | Refused]
    reach_sizes: float  #: half the window of points around a candidate, over the size
    #: A candidate nearer to a fit than this many of its sizes is the same target
    same_start_sizes: float
    #: true if ``same_start_sizes`` only counts for fits of the size that is searched
    same_size_only: bool
    #: fits nearer than this many of the larger of their sizes are one target
    same_target_sizes: float

    def run(
        self, image: RangeImage, sizes: Sequence[float]
    ) -> tuple[list[tuple[Fit, float]], list[Rejected]]:
        """Fit candidates of all sizes: the best fit at each place, and refusals worth a line."""
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


def footprint_at(footprint: Beam, place: Array) -> float:
    """Diameter of a beam at a place."""
    return float(footprint.diameter(np.asarray(np.linalg.norm(place))))
