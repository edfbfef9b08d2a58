"""Grows a frame from what is known in it until no rule finds anything more.

Rules come in tiers: sound and cheap ones are repeated to their end before the next tier is
asked, so that chains run through well-determined places first.
"""

from __future__ import annotations

from collections.abc import Callable

from tribrach.network.approximate.frame import Frame
from tribrach.network.approximate.heights import rises, zeniths
from tribrach.network.approximate.loci import cross
from tribrach.network.approximate.plan import orient, set_ups, transfer, traverse
from tribrach.network.approximate.resection import (
    intersect,
    multilaterate,
    resect,
    trilaterate_space,
)
from tribrach.network.approximate.space import faces, fixes, headings, links, poses, shots, vectors

__all__ = ["grow"]

Rule = Callable[[Frame], None]

_SPACE: tuple[Rule, ...] = (fixes, vectors, links, poses, shots, faces)
_CHAINS: tuple[Rule, ...] = (transfer, orient, traverse, rises, zeniths, headings)
_STATIONS: tuple[Rule, ...] = (set_ups, headings)
_FIGURES: tuple[Rule, ...] = (intersect, multilaterate, resect, trilaterate_space)
_UPRIGHT = ((*_SPACE, *_CHAINS), _STATIONS, _FIGURES, (cross,))
_RIGID: tuple[tuple[Rule, ...], ...] = (_SPACE, (trilaterate_space,))

#: passes after which used-up ties are put aside
_PRUNE_EVERY = 4


def grow(f: Frame) -> None:
    """Place everything that hangs together with what the frame knows."""
    tiers = _RIGID if f.kind == "rigid" else _UPRIGHT
    passes, tier = 0, 0
    if f.kind != "rigid":
        # what is given orients best
        fixes(f)
        orient(f)
    while tier < len(tiers):
        before = f.count()
        for rule in tiers[tier]:
            rule(f)
        tier = 0 if f.count() > before else tier + 1
        passes += 1
        if passes % _PRUNE_EVERY == 0:
            f.prune()
