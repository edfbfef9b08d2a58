"""How densely a scan looks at what is around it, and how densely targets have to be seen.

A target of the size s [m] at the range r [m], seen with the angular steps dh and dv [rad], has
``s / (r max(dh, dv))`` points across and ``a s^2 / (r^2 dh dv)`` points on it, where a is the share
of the square around it that it covers. The searches have a least number of both
(:data:`LEAST`); what is below is not looked at or not fitted. It is a bound from the steps alone:
an oblique or half hidden target takes more.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np

from tribrach.scan.range_image import RangeImage
from tribrach.sentences import Sentence
from tribrach.targets.checkerboards.pattern import GATES as PATTERN
from tribrach.targets.checkerboards.search import GATES as BOARD
from tribrach.targets.detection import Kind
from tribrach.targets.discs.fit import GATES as DISC_FIT
from tribrach.targets.discs.search import GATES as DISC
from tribrach.targets.spheres.fit import GATES as SPHERE_FIT
from tribrach.targets.spheres.grid_search import GATES as SPHERE


@dataclass(frozen=True)
class LeastPoints:
    """What the search for a kind of target takes at least."""

    across: float  #: points across the size, along the coarser direction
    on: int  #: points on the target
    share: float  #: share of the square around the target that it covers

    @property
    def even(self) -> float:
        """Points across where both steps are the same."""
        return float(max(self.across, np.sqrt(self.on / self.share)))


#: by kind; the size of a board is its side, that of spheres and discs the diameter
LEAST: Mapping[Kind, LeastPoints] = {
    "sphere": LeastPoints(SPHERE.fewest_in_run, SPHERE_FIT.fewest_points, np.pi / 4),
    "checkerboard": LeastPoints(
        BOARD.least_circle_px / min(BOARD.circle_sides), PATTERN.fewest_points, 1.0
    ),
    "disc": LeastPoints(2 * DISC.least_radius_px, DISC_FIT.fewest_on_disc, np.pi / 4),
}


@dataclass(frozen=True)
class Sampling:
    """Angular steps of a scan and the ranges in it."""

    #: steps of H and V [rad]
    step_h: float
    step_v: float
    median: float  #: half of the directions with a point end nearer [m]

    @classmethod
    def of(cls, image: RangeImage) -> Self:
        """Steps and ranges of a range image that has at least one point."""
        ranges = image.range[np.isfinite(image.range)]
        return cls(float(image.step_h), float(image.step_v), float(np.median(ranges)))

    def reach(self, kind: Kind, size: float) -> float:
        """Range [m] up to which a target of this size has enough points, seen squarely."""
        least = LEAST[kind]
        coarse = least.across * max(self.step_h, self.step_v)
        area = least.on / least.share * self.step_h * self.step_v
        return float(size / max(coarse, np.sqrt(area)))

    def sentence(self, kind: Kind, size: float, away: float) -> str:
        """Compare the density that a target takes at a range with the density that is there."""
        degree = np.degrees(size / away)
        across, down = (1 / np.degrees(step) for step in (self.step_h, self.step_v))
        reach = self.reach(kind, size)
        points = LEAST[kind].share * (size / away) ** 2 / (self.step_h * self.step_v)
        needs = Sentence(
            "{even:1} points per degree ({on} on it)",
            even=LEAST[kind].even / degree,
            on=LEAST[kind].on,
        )
        there = Sentence(
            "{across:1} across and {down:1} down ({points:0} on it)",
            across=across,
            down=down,
            points=points,
        )
        enough = "reach" if reach >= away else "are too few: they reach"
        takes = Sentence("{away:m1}, one takes {needs} at least", away=away, needs=needs)
        return Sentence(
            "{takes}; {there} are there and {enough} {reach:m1}",
            takes=takes,
            there=there,
            enough=enough,
            reach=reach,
        )
