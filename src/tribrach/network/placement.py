"""What GNSS contributes: the placement of a network as a whole, beside its precision within.

A satellite position of some metres places a scan without making it worse: relative positions come
from the scanner. Both are said, so that nobody takes the one for the other (method section 2.6).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach.network.adjustment import Adjustment
from tribrach.observations.base import Observations, Use
from tribrach.observations.declaration import Category
from tribrach.sentences import Sentence

#: said once, with the first group
_WHAT_FOR = ": the first is for places in the world, the second for lengths on the site"


def is_gnss_position(observations: Observations) -> bool:
    """True for absolute positions from satellites, of marks or of antennas on scanners."""
    return observations.facts.absolute and observations.facts.category is Category.GNSS


def placement_sentences(adjustment: Adjustment) -> list[str]:
    """One sentence per group of GNSS positions: absolute and relative standard deviations."""
    out: list[str] = []
    for o in adjustment.network.observations:
        active = np.flatnonzero(o.use == Use.ACTIVE)
        if not is_gnss_position(o) or len(active) == 0:
            continue
        names = list(dict.fromkeys(o.ends(adjustment.layout)[i][0] for i in active))
        absolute = _sigma(_block(adjustment, names[0], names[0]))
        who = "GNSS" if o.group == o.kind else o.group
        words = Sentence(
            "{who} places {names[0]} with a standard deviation of {absolute:mm1} (3D)",
            who=who,
            names=names,
            absolute=absolute,
        )
        if len(names) > 1:
            length = _length_sigma(adjustment, names[0], names[1])
            words += Sentence(
                "; the distance from {names[0]} to {names[1]} is known to {length:mm2} from "
                "all observations together",
                names=names,
                length=length,
            )
            if not any(_WHAT_FOR in said for said in out):
                words += _WHAT_FOR
        out.append(words)
    return out


def _columns(adjustment: Adjustment, name: str) -> NDArray[np.int64]:
    layout = adjustment.layout
    return layout.position_columns(np.array(layout.position_index(name)))


def _block(adjustment: Adjustment, a: str, b: str) -> NDArray[np.float64]:
    return adjustment.covariance_columns(_columns(adjustment, a), _columns(adjustment, b))


def _sigma(covariance: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.trace(covariance)))


def _length_sigma(adjustment: Adjustment, a: str, b: str) -> float:
    """Standard deviation [m] of the distance between two positions."""
    layout, positions = adjustment.layout, adjustment.state.positions
    chord = positions[layout.position_index(b)] - positions[layout.position_index(a)]
    unit = chord / np.linalg.norm(chord)
    cross = _block(adjustment, a, b)
    spread = _block(adjustment, a, a) + _block(adjustment, b, b) - cross - cross.T
    return float(np.sqrt(unit @ spread @ unit))
