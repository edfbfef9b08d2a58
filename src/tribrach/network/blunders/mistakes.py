"""Names the mistakes of a network, before anything is switched off.

A bias that several observations share (:mod:`common_causes`) and a slip of reading, writing or
naming (:mod:`gross`) are looked for in a network that does not fit. Each is said only after a test
that could have said otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass

from tribrach.errors import InputError, NotConverged
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.blunders.clearing import fits
from tribrach.network.blunders.common_causes import common_causes
from tribrach.network.blunders.gross import explain
from tribrach.network.blunders.slip_search import SlipSearch
from tribrach.network.network import Network
from tribrach.network.significance import log_significance


def first_adjustment(network: Network) -> Adjustment:
    """Adjust a network as it is."""
    try:
        return adjust(network)
    except NotConverged as error:
        search = SlipSearch()
        found = explain(network, search=search)
        if found is None:
            raise NotConverged(error.headline, [*error.sentences, *search.sentences()]) from error
        raise InputError(found.sentence(), cure=found.cure) from error


@dataclass(frozen=True)
class Mistakes:
    """Sentences on mistakes."""

    #: mistakes that explain several bad observations each; that the search gave up, if it did
    sentences: tuple[str, ...]
    #: what many set-ups or targets have a little of, which is no mistake of one
    notes: tuple[str, ...]
    #: True if the network fits without them: what else looks wrong is their doing
    explained: bool = False


def mistakes(
    adjustment: Adjustment, released: Adjustment | None = None, score: float = 0.0
) -> Mistakes:
    """Find mistakes that explain several bad observations each.

    ``released``: the same without what may be wrong in given coordinates, ``score`` the logarithm
    of its significance: causes that explain less are looked for without it.
    """
    found, dof = common_causes(adjustment), adjustment.dof
    if released is not None and all(
        log_significance(cause.statistic, len(cause.size)) > score for cause in found.named
    ):
        found, dof = common_causes(released), released.dof
    notes = () if found.pattern is None else (found.pattern.sentence(),)
    said = tuple(cause.sentence() for cause in found.named)
    if found.named:
        freedom = sum(len(cause.size) for cause in found.named)
        if fits(found.named[-1].rest, dof - freedom):
            return Mistakes(said, notes, True)
    search = SlipSearch()
    slip = explain(adjustment.network, adjustment, search)
    if slip is not None:
        return Mistakes((slip.sentence(),), notes, True)
    return Mistakes((*said, *search.sentences()), notes)
