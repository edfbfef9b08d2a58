"""What makes a baseline doubtful, in sentences: its base, its files, its ambiguities."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach.gnss.observation_file import ObservationFile
from tribrach.gnss.solution_file import Solution

__all__ = ["doubts_of_files", "doubts_of_fixes", "doubts_of_length", "doubts_of_place"]

Array = NDArray[np.float64]

#: fixed epochs of the second half of a session agree better than this [m]
DISAGREEING = 0.05
#: receivers know their place better than this [m]
ASTRAY = 100.0
#: beyond this length the covariance is too small [m]
LONG = 20_000.0


def doubts_of_place(base: ObservationFile, reference: Array) -> list[str]:
    """Coordinates of the base that are not where its receiver believed to be."""
    away = float(np.linalg.norm(reference - base.approximate))
    # no position in the header is not a number, and never too far
    if not away > ASTRAY:
        return []
    return [
        f"the coordinates of the base are {away:.0f} m from the position in the header of "
        f"{base.path.name}: are they right, or are base and rover exchanged? The baseline would be "
        f"off by some {1e6 * away / 6.4e6:.0f} ppm"
    ]


def doubts_of_files(*files: ObservationFile) -> list[str]:
    """Epochs that were counted anew."""
    return [
        f"{file.path.name}: {file.recounted} of {len(file.times)} epochs promise more satellites "
        "than they list; they were counted anew"
        for file in files
        if file.recounted
    ]


def doubts_of_fixes(
    name: str, solution: Solution, fixed: NDArray[np.int64], share: float, best: int
) -> list[str]:
    """Sentences on ambiguities that are float, rarely fixed, or fixed in different ways."""
    if not len(fixed):
        return [f"{name}: the ambiguities could not be fixed, the baseline is a float solution"]
    out = []
    if share < 0.5:
        out.append(f"{name}: only {100 * share:.0f} % of the epochs are fixed")
    late = fixed[len(fixed) // 2 :]
    apart = np.linalg.norm(solution.values[late] - solution.values[best], axis=1).max()
    if apart > DISAGREEING:
        out.append(
            f"{name}: fixed epochs differ by {apart:.3f} m, some of them are fixed to wrong "
            "integers: measure longer, or raise the threshold of the ratio"
        )
    return out


def doubts_of_length(name: str, length: float, *, precise: bool, satellites: bool) -> list[str]:
    """What a long baseline [m] suffers from and the covariance leaves out.

    precise : orbits are precise ones; satellites : with their phase centres.
    """
    if length <= LONG:
        return []
    causes = ["ionosphere", "troposphere"]
    if not precise:
        causes.insert(0, "broadcast orbits")
    elif not satellites:
        causes.insert(0, "phase centres of satellites, which an ANTEX file would give")
    return [
        f"{name}: over {length / 1000:.0f} km errors of {', '.join(causes[:-1])} and {causes[-1]} "
        "add up, which the covariance leaves out"
    ]
