"""Tells weak places from wrong ones: along which direction, how weak, and what would hold them.

A place is weak where its standard deviation along some direction is many times what its own
observations would give if everything else were known (method section 3.2). That is geometry and no
blunder, whatever the size of the misfits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from tribrach._types import Array, Index
from tribrach.network.solved import SolvedSystem
from tribrach.observations.unknowns import Layout
from tribrach.sentences import Sentence, joined
from tribrach.statistics import largest_first
from tribrach.units import GON

#: standard deviations that are so many times those with all else known are weak
WEAK = 300.0
#: directions within this of the vertical are heights (cosine)
_UPRIGHT = 0.9
#: names that a sentence lists
_NAMED = 4


@dataclass(frozen=True)
class Weakness:
    """A place that its network holds badly along one direction."""

    name: str  #: of the point or station
    sigma: float  #: standard deviation along the direction [m]
    direction: Array  #: (3,), unit vector E, N, U of the work frame
    ratio: float  #: the standard deviation over that with everything else known

    def along(self) -> str:
        """The direction in words."""
        if abs(self.direction[2]) > _UPRIGHT:
            return "in height"
        azimuth = round(float(np.arctan2(self.direction[0], self.direction[1]) / GON)) % 200
        slope = " and in height" if abs(self.direction[2]) > 0.3 else ""
        return f"along the azimuth {azimuth} gon{slope}"

    def cure(self) -> str:
        """What would hold it."""
        if abs(self.direction[2]) > _UPRIGHT:
            return "a height with its sigma, or levelling to a point of known height, would hold it"
        return (
            "a distance along that direction, a sight at right angles to it to a point with "
            "coordinates, or a coordinate with its sigma would hold it"
        )


def weak_places(adjustment: SolvedSystem) -> list[Weakness]:
    """Find the places that are weak, the weakest first."""
    layout, state = adjustment.layout, adjustment.state
    count = len(state.positions)
    if not count:
        return []
    covariance = adjustment.position_covariances()
    values, vectors = np.linalg.eigh(covariance)
    sigma, direction = np.sqrt(np.maximum(values[:, 2], 0.0)), vectors[:, :, 2]
    columns = adjustment.reduced[layout.position_columns(np.arange(count))]
    alone = _alone(adjustment.design, columns, direction)
    ratio = np.where(alone > 0, sigma / np.where(alone > 0, alone, 1.0), 0.0)
    chosen = np.flatnonzero(ratio > WEAK)
    return [
        Weakness(layout.position_name(int(k)), float(sigma[k]), direction[k], float(ratio[k]))
        for k in chosen[largest_first(sigma[chosen])]
    ]


def _alone(design: sp.csr_array, columns: Index, direction: Array) -> Array:
    """Standard deviations (n,) along directions if nothing else were unknown; 0 unobserved."""
    n, u = len(columns), design.shape[1]
    row, axis = np.nonzero(columns >= 0)
    spread = sp.csc_array((direction[row, axis], (columns[row, axis], row)), shape=(u, n))
    effect = sp.csc_array(design @ spread)
    weight = np.asarray(effect.multiply(effect).sum(axis=0)).ravel()
    return np.where(weight > 0, 1 / np.sqrt(np.where(weight > 0, weight, 1.0)), 0.0)


def weak_place_of(layout: Layout, columns: Index, vector: Array, size: float) -> Weakness | None:
    """The place that a weak combination of unknowns moves most.

    ``columns`` (u,): free columns of the full tangent vector; ``vector`` (u,): right singular
    vector of the whitened design in natural units, of any length; ``size``: whitened residuals that
    the vector changes, as a length.
    """
    full = np.zeros(layout.size)
    full[columns] = vector / max(size, np.finfo(float).tiny)
    count = layout.count("point") + layout.count("pose")
    moved = full[layout.position_columns(np.arange(count))]
    length = np.linalg.norm(moved, axis=1)
    if not count or not length.max() > 0:
        return None
    k = int(np.argmax(length))
    name = layout.position_name(k)
    return Weakness(name, float(length[k]), moved[k] / length[k], float("inf"))


def weakness_sentences(adjustment: SolvedSystem) -> list[str]:
    """One sentence on the weak places of a network, none if there are none."""
    weak = weak_places(adjustment)
    if not weak:
        return []
    worst = weak[0]
    free = adjustment.reduced[
        adjustment.layout.position_columns(np.arange(len(adjustment.state.positions)))
    ]
    if len(weak) > 1 and len(weak) == int((free >= 0).any(axis=1).sum()):
        return [
            Sentence(
                "the network as a whole is weak, which is geometry and no blunder: the sigma "
                "of {worst.name} {worst2} is {metres}, {worst.ratio:g2} times what its own "
                "observations would give if all else were known; control with smaller sigmas "
                "would hold it, or inner constraints (datum free) where only its shape is "
                "wanted",
                worst=worst,
                worst2=worst.along(),
                metres=_metres(worst.sigma),
            )
        ]
    also = [
        Sentence("{w.name} ({metres})", w=w, metres=_metres(w.sigma)) for w in weak[1 : 1 + _NAMED]
    ]
    more = f" and {len(weak) - 1 - _NAMED} more" if len(weak) > 1 + _NAMED else ""
    others = (
        Sentence("; weak with it: {also}{more}", also=joined(", ", also), more=more) if also else ""
    )
    return [
        Sentence(
            "{worst.name} is weak {worst2}, which is geometry and no blunder: sigma "
            "{metres}, {worst.ratio:g3} times what its own observations would give if all "
            "else were known; {worst3}{others}",
            worst=worst,
            worst2=worst.along(),
            metres=_metres(worst.sigma),
            worst3=worst.cure(),
            others=others,
        )
    ]


def _metres(sigma: float) -> str:
    """A standard deviation in the unit that suits it."""
    return (
        Sentence("{sigma:g3} m", sigma=sigma)
        if sigma >= 1
        else Sentence("{sigma:mmg3}", sigma=sigma)
    )
