"""Proposes targets and stations to add or to move: greedy choices, then exchanges.

Each step takes the group that serves the criterion best; afterwards every choice is offered for
exchange against all others until none is better (Fedorov 1972). Greedy choices alone get stuck
where several points are equally bad; the exchange gets them out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array, Index
from tribrach.planning.blocks import Blocks, join
from tribrach.planning.prospect import Prospect, Scores

#: passes over all choices while exchanging
_PASSES = 5
#: relative improvement below which nothing counts as better
_BETTER = 1e-6


@dataclass(frozen=True)
class Pick:
    """A group that was chosen."""

    number: int  #: of the group
    #: the criterion without and with it
    before: float
    after: float


@dataclass(frozen=True)
class Search:
    """A proposal."""

    picks: tuple[Pick, ...]  #: in the order of choice, with the criterion after each
    start: float  #: the criterion without any
    single: Array  #: (c,), the criterion with each group alone, NaN where it is impossible
    number: Index  #: (c,), number of each group
    judged: int  #: number of designs that were looked at

    @property
    def value(self) -> float:
        """The criterion with all picks."""
        return self.picks[-1].after if self.picks else self.start


@dataclass(frozen=True)
class Move:
    """A group that goes and another that comes in its place."""

    #: their numbers
    gone: int
    come: int
    #: the criterion before and after the move
    before: float
    after: float


def _signed(start: Prospect, value: float) -> float:
    """The criterion with the sign that grows with disadvantage."""
    return -value if start.criterion.kind == "redundancy" else value


def propose(
    start: Prospect, parts: Sequence[Blocks], count: int, required: float | None = None
) -> Search:
    """Choose groups to add to a design."""
    before = start.value()
    if not parts or count <= 0:
        return Search((), before, np.zeros(0), np.zeros(0, dtype=np.int64), 0)
    blocks = join(parts)
    chosen: list[int] = []
    now, single, judged = start, np.zeros(0), 0
    value = before
    while len(chosen) < count and not _reached(start, value, required):
        scores = now.judge(blocks)
        judged += len(blocks)
        single = scores.value if not chosen else single
        best = _best(scores, chosen)
        if best is None or not _better(scores.worse[best], _signed(start, value)):
            break
        chosen.append(best)
        now, value = now.changed(blocks, best), float(scores.value[best])
    chosen, looked = _exchanged(start, blocks, chosen)
    return Search(_picks(start, blocks, chosen), before, single, blocks.number, judged + looked)


def _reached(start: Prospect, value: float, required: float | None) -> bool:
    """True if the criterion is as good as it is required to be."""
    return required is not None and _signed(start, value) <= _signed(start, required)


def _better(worse: float, than: float) -> bool:
    """True if a signed criterion is smaller by more than rounding."""
    return bool(worse < than - _BETTER * abs(than))


def _best(scores: Scores, taken: Sequence[int]) -> int | None:
    """The best group that is not taken."""
    return next((int(i) for i in scores.order() if i not in taken), None)


def _with(start: Prospect, blocks: Blocks, chosen: Sequence[int]) -> Prospect:
    """The design with the chosen groups."""
    for which in chosen:
        start = start.changed(blocks, which)
    return start


def _exchanged(start: Prospect, blocks: Blocks, chosen: list[int]) -> tuple[list[int], int]:
    """The choice after exchanges, and how many designs were judged."""
    judged = 0
    if len(chosen) < 2:
        return chosen, judged
    value = _signed(start, _with(start, blocks, chosen).value())
    for _ in range(_PASSES):
        improved = False
        for place in range(len(chosen)):
            others = [c for k, c in enumerate(chosen) if k != place]
            scores = _with(start, blocks, others).judge(blocks)
            judged += len(blocks)
            best = _best(scores, others)
            if best is not None and _better(float(scores.worse[best]), value):
                chosen = [*others[:place], best, *others[place:]]
                value, improved = float(scores.worse[best]), True
        if not improved:
            break
    return chosen, judged


def _picks(start: Prospect, blocks: Blocks, chosen: Sequence[int]) -> tuple[Pick, ...]:
    """The choice in the order in which it helps most."""
    now, left, picks = start, list(chosen), []
    value = start.value()
    while left:
        scores = now.judge(blocks.take(np.array(left, dtype=np.int64)))
        order = scores.order()
        best = left[int(order[0])]
        after = float(scores.value[order[0]])
        picks.append(Pick(int(blocks.number[best]), value, after))
        now, value = now.changed(blocks, best), after
        left.remove(best)
    return tuple(picks)


def best_moves(start: Prospect, present: Sequence[Blocks], parts: Sequence[Blocks]) -> list[Move]:
    """Find for each group that is there the best other place."""
    if not parts or not present:
        return []
    blocks, there = join(parts), join(present)
    before = start.value()
    spared = start.judge(there, -1)
    moves = []
    for which in np.flatnonzero(np.isfinite(spared.value)):
        without = start.changed(there, int(which), -1)
        scores = without.judge(blocks)
        best = scores.best()
        if best is not None and _better(float(scores.worse[best]), _signed(start, before)):
            moves.append(
                Move(
                    int(there.number[which]),
                    int(blocks.number[best]),
                    before,
                    float(scores.value[best]),
                )
            )
    return sorted(moves, key=lambda move: _signed(start, move.after))
