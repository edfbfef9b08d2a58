"""Whether a static GNSS solution is fixed at its end, and which of its epochs stands for it.

A static filter has seen all epochs up to each line, and the engine searches integers anew in every
epoch. What counts is therefore the end of the session and not whether any epoch was ever fixed: a
search that finds integers in 4 % of the epochs and loses them again has found the wrong ones.
Method section 2.7.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.sentences import Sentence

#: the end of a session is this part of its epochs
END = 1 / 3
#: share of the epochs at the end that must be fixed
SHARE = 0.8
#: fewer fixed epochs of the whole session than this share are worth a sentence
RARELY = 0.5
#: fixed epochs at the end lie within this of the one that is taken: [m] and per metre of length
AGREEMENT = (0.02, 1e-6)
#: fewer epochs at the end than this cannot contradict each other
FEWEST_CHECKED = 3


@dataclass(frozen=True)
class FinalSolution:
    """End of a static solution."""

    fixed: bool  #: ambiguities are integers at the end, and stay the same ones
    epoch: int  #: number of the epoch that is taken
    share: float  #: of all solved epochs that are fixed
    share_end: float  #: of those at the end
    ratio: float  #: of the ambiguity test, median over the end
    epochs_end: int  #: epochs that count as the end
    #: largest distance [m] of a fixed epoch at the end from ``epoch``, or from the best fixed one
    #: where the solution is float; 0 where none is fixed
    apart: float
    limit: float  #: for ``apart`` [m]
    #: (3, 3), of a float solution [m^2]: mean square of what all epochs at the end differ from the
    #: one that is taken; zero where the solution is fixed
    scatter: Array

    @property
    def reason(self) -> str:
        """Why the solution is float, with figures and thresholds; "" where it is fixed."""
        if self.fixed:
            return ""
        if self.share == 0:
            return "no epoch is fixed"
        if self.share_end < SHARE:
            return Sentence(
                "{own.share_end:%} of the last {own.epochs_end} epochs are fixed, and "
                "{share:%} are needed",
                own=self,
                share=SHARE,
            )
        return Sentence(
            "fixed epochs at the end differ by {own.apart:mm0}, and {own.limit:mm0} are "
            "the limit: some are fixed to wrong integers",
            own=self,
        )


def final_solution(
    values: Array,
    covariance: Array,
    fixed: NDArray[np.bool_],
    ratio: Array,
    length: float = 0.0,
) -> FinalSolution:
    """The state of a static solution at its end (method section 2.7).

    ``values`` (n, 3): solved epochs in the order of time, at least one [m], in any Cartesian frame;
    ``covariance`` (n, 3, 3): that the engine states [m^2]; ``fixed`` (n,): epochs whose ambiguities
    are integers; ``ratio`` (n,): of the ambiguity test; ``length``: of the baseline [m].
    """
    n = len(values)
    end = np.arange(n - max(int(np.ceil(END * n)), 1), n)
    of_end = fixed[end]
    trace = np.einsum("nii->n", covariance)
    apart, limit = 0.0, AGREEMENT[0] + AGREEMENT[1] * length
    share_end = float(of_end.mean())
    if of_end.any():
        known = end[of_end]
        best = known[np.argmin(trace[known])]
        apart = float(np.linalg.norm(values[known] - values[best], axis=1).max())
    good = share_end >= SHARE and apart <= limit
    # epochs fixed to wrong integers are no float solution; where all are fixed there is no other
    chosen = end[of_end] if of_end.all() else end[~of_end]
    if good:
        # satellites that set take the fixed ambiguities with them: an earlier epoch of the same
        # integers may be the better determined one
        near = np.linalg.norm(values - values[best], axis=1) <= limit
        chosen = np.flatnonzero(fixed & near)
    # of equal ones the last, which has seen most
    epoch = int(chosen[len(chosen) - 1 - np.argmin(trace[chosen][::-1])])
    away = values[end] - values[epoch]
    return FinalSolution(
        fixed=good,
        epoch=epoch,
        share=float(fixed.mean()),
        share_end=share_end,
        ratio=float(np.median(ratio[end])),
        epochs_end=len(end),
        apart=apart,
        limit=limit,
        scatter=np.zeros((3, 3)) if good else away.T @ away / len(end),
    )
