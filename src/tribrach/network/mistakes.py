"""Blunders that sit in several observations at once, named before anything is switched off."""

from __future__ import annotations

from tribrach.errors import InputError, NotConverged
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.common_causes import common_causes
from tribrach.network.network import Network
from tribrach.network.swapped_names import swapped_names

__all__ = ["first_adjustment", "mistakes"]

_CURE = "correct the names in the file"


def first_adjustment(network: Network) -> Adjustment:
    """The network adjusted as it is.

    Raises
    ------
    InputError : it does not converge because two names are exchanged.
    AdjustmentError : it cannot be adjusted for another reason.
    """
    try:
        return adjust(network)
    except NotConverged as error:
        found = swapped_names(network)
        if found is None:
            raise
        raise InputError(found.sentence(), cure=_CURE) from error


def mistakes(adjustment: Adjustment) -> list[str]:
    """Mistakes that explain several bad observations each, in sentences."""
    swapped = swapped_names(adjustment.network, adjustment)
    if swapped is not None:
        return [swapped.sentence()]
    return [cause.sentence() for cause in common_causes(adjustment)]
