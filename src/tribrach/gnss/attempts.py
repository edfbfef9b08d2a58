"""Other ways of computing a doubtful baseline, and which of them is taken.

A baseline that is doubtful as it was asked for is computed in other ways as well: with phases of
L2C moved to those of P(Y) where a file mixes them (:mod:`tribrach.io.gnss.l2_phases`), and with L1
alone. What is taken is decided by what the attempts themselves show: whether they end fixed, in
how many epochs, and how far the pieces of the session scatter. Method section 2.7.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from tribrach.answers import Number, Result
from tribrach.sentences import Sentence, joined
from tribrach.units import percent

#: words for the numbers of frequencies
FREQUENCIES = {1: "L1 alone", 2: "L1 and L2", 3: "three frequencies"}
#: share of epochs that an attempt needs to be taken
SHARE = 0.6
#: an attempt takes the place of a fixed baseline only where its pieces scatter so much less, or
#: where its ratio is so much larger and it cures the files
BETTER = 2.0
#: an attempt further from the float solution than so many sigmas has wrong integers
CONTRADICTION = 4.0


@dataclass(frozen=True)
class Attempt(
    Result,
    without=("cures",),
    keys={"ratio": "ratio_median", "away": "from_first", "scatter": "pieces_scatter"},
):
    """One way of computing a doubtful baseline, lengths in metres."""

    what: str  #: in words
    frequencies: int  #: how many are used
    ambiguities: Literal["fixed", "float"]  #: at the end of the session
    fixed_share: float  #: of the solved epochs
    ratio: Number  #: of the ambiguity test
    sigma: float  #: of the vector in space
    away: float = 0.0  #: distance from the first attempt
    scatter: float | None = None  #: of a piece of the session in space; null where it was not cut
    pieces: int = 0  #: how many pieces gave that
    taken: bool = False  #: is this the baseline?
    cures: str = ""  #: what would be wrong with the files if this attempt is right; "" for nothing

    @property
    def words(self) -> str:
        """Its figures."""
        words = Sentence(
            "{own.ambiguities}, {percent} of the epochs fixed, ratio {own.ratio:1}",
            own=self,
            percent=percent(self.fixed_share),
        )
        if self.scatter is None:
            return words
        return Sentence(
            "{words}, {own.pieces} pieces scatter by {own.scatter:mm1} (standard "
            "deviation, none left out)",
            words=words,
            own=self,
        )


def choose(attempts: Sequence[Attempt]) -> int:
    """The number of the attempt that is taken (method section 2.7); the first was asked for."""
    first = attempts[0]
    able = [
        k
        for k, a in enumerate(attempts)
        if k
        and a.ambiguities == "fixed"
        and a.fixed_share >= SHARE
        and a.away <= CONTRADICTION * (first.sigma**2 + a.sigma**2) ** 0.5
    ]
    if not able:
        return 0
    if any(attempts[k].scatter is None for k in able):
        best = max(able, key=lambda k: attempts[k].fixed_share)
    else:
        best = min(able, key=lambda k: attempts[k].scatter or 0.0)
    mine, its = attempts[best].scatter, first.scatter
    if first.ambiguities == "fixed":
        steadier = mine is not None and its is not None and BETTER * mine < its
        return best if steadier or _cured(first, attempts[best]) else 0
    return best if mine is None or its is None or mine < its else 0


def _cured(first: Attempt, other: Attempt) -> bool:
    """True if a defect of the files is gone: as many epochs are fixed, by far more clearly."""
    return (
        bool(other.cures)
        and other.fixed_share >= first.fixed_share
        and other.ratio > BETTER * first.ratio
    )


def reason(attempts: Sequence[Attempt], taken: int) -> str:
    """Why an attempt is taken, or why the first, the baseline as it was asked for, stays."""
    first, best = attempts[0], attempts[taken]
    if taken:
        words = Sentence(
            "{best.what} is taken ({best.words}) instead of {first.what} ({first.words})",
            best=best,
            first=first,
        )
        cured = [a for a in attempts[1:] if a.cures and a.ambiguities == "fixed"]
        if not cured or not (first.ambiguities == "float" or _cured(first, cured[0])):
            return words
        return Sentence(
            "{words}; {cured[0].cures}, and with those moved by a quarter of a cycle "
            "{first.what} are fixed in {cured[0].fixed_share:%} of the epochs",
            words=words,
            cured=cured,
            first=first,
        )
    others = joined("; ", (Sentence("{a.what}: {a.words}", a=a) for a in attempts[1:]))
    return Sentence(
        "{first.what} is kept ({first.words}), no other way is better ({others})",
        first=first,
        others=others,
    )


def comparison(attempts: Sequence[Attempt]) -> list[str]:
    """A line for each attempt, the taken one marked; the first is the baseline as asked for."""
    return [
        Sentence("{a.what}: {a.words}, sigma {a.sigma:mm1}", a=a)
        + (Sentence(", {a.away:mm1} from the first", a=a) if k else "")
        + (" (taken)" if a.taken else "")
        for k, a in enumerate(attempts)
    ]
