"""One slip that explains a misfit, and the search for it within a budget."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tribrach.errors import TribrachError
from tribrach.network.adjustment import Adjustment, Options, adjust
from tribrach.network.blunders.clearing import fits
from tribrach.network.blunders.suspects import Key
from tribrach.network.network import Network
from tribrach.sentences import Sentence

#: networks that fit worse than this many times their sigmas are looked at
GROSS = 5.0
#: share of the variance factor that may be left
LEFT = 0.05
#: share of it that may be left where sigmas are too small for the global test
_FAR_LESS = 1e-3
#: share that explains a misfit where sigmas are too small by far, a thousandth of the residuals,
#: and the largest factor on sigmas that is taken for that
_BY_FAR, _TOO_SMALL = 1e-6, 30.0
#: adjustments after which the search may end, and iterations of each attempt
_RUNS, _ITERATIONS = 10, 30
#: iterations of a small network after which it may end (some five seconds), and observations of a
#: network of which an iteration takes twice as long
_WORK, _TWICE = 1000.0, 1000
#: iterations of a network that one slip is undone in: the right one needs few
FEW = 12


@dataclass(frozen=True)
class Slip:
    """One slip that explains a misfit."""

    words: str  #: what is wrong, as a clause
    undone: str  #: what is done to undo it, as a clause that continues "sigma0 falls ..."
    before: float  #: variance factor as it is, infinite if the network could not be adjusted
    after: float  #: variance factor with the slip undone
    cure: str  #: what to do
    kind: str = ""  #: what sort of slip it is
    #: the observations (table, item) that it is in; empty where it is in names or given values
    keys: frozenset[Key] = frozenset()
    names: tuple[str, ...] = ()  #: the points whose given coordinates it is in
    #: the network with the slip undone, where it is in given values
    corrected: Network | None = None

    def sentence(self) -> str:
        """The finding in one sentence."""
        if np.isfinite(self.before):
            fit = Sentence(
                "sigma0 falls from {before:1} to {after:2}",
                before=np.sqrt(self.before),
                after=np.sqrt(self.after),
            )
        else:
            fit = Sentence(
                "the network can be adjusted, with sigma0 {after:2}", after=np.sqrt(self.after)
            )
        return f"{self.words}: {self.undone} {fit}"


def explains(vtpv: float, dof: int, before: float) -> float | None:
    """Variance factor that remains if a slip explains the misfit; None if it does not."""
    if dof < 1:
        return None
    after = vtpv / dof
    if fits(vtpv, dof):
        return after if after < LEFT * before else None
    if after < min(GROSS**2, _FAR_LESS * before):
        return after
    by_far = min(_TOO_SMALL**2, _BY_FAR * before)
    return after if np.isfinite(before) and after < by_far else None


@dataclass
class SlipSearch:
    """Adjusts within a budget, which every part of a search has anew."""

    adjuster: Callable[[Network], Adjustment] | None = None  #: adjusts a network
    runs: int = 0  #: adjustments so far
    #: of how many pairs of names the search came to an end before it had tried all, 0 if not
    given_up: int = 0
    #: iterations of a small network in the present part of the search, and how many may be done
    spent: float = 0.0
    allowed: float = _WORK
    earlier: int = 0  #: adjustments when the present part of the search began

    @property
    def over(self) -> bool:
        """True if both the adjustments and their work are used up."""
        return self.tried >= _RUNS and self.spent >= self.allowed

    @property
    def tried(self) -> int:
        """Adjustments of the present part of the search."""
        return self.runs - self.earlier

    def go_on(self) -> None:
        """Begin another part of the search, with a budget of its own."""
        self.earlier, self.spent = self.runs, 0.0

    def run(self, network: Network, iterations: int = _ITERATIONS) -> Adjustment:
        """Adjust, giving up soon: with a slip undone few iterations are needed."""
        self.runs += 1
        done = iterations
        try:
            if self.adjuster is not None:
                trial = self.adjuster(network)
            else:
                trial = adjust(network, options=Options(max_iterations=iterations))
            done = trial.iterations
        finally:
            self.spent += done * (1 + (network.count() / _TWICE) ** 2)
        return trial

    def factor(self, network: Network) -> float | None:
        """Variance factor of a network that passes its global test, None of any other."""
        try:
            trial = self.run(network)
        except TribrachError:
            return None
        return trial.posterior_factor if fits(trial.vtpv, trial.dof) else None

    def explained(self, network: Network, before: float, loosened: int = 0) -> float | None:
        """Variance factor of a network that fits, or that fits far better than before.

        Sigmas are often too small: a slip that leaves a thousandth of the variance factor, and no
        misfit that would be looked at, explains what was wrong even where the global test still
        fails.

        ``before``: variance factor as it is, infinite if the network could not be adjusted;
        ``loosened``: values that pull at nothing and are no redundancy.
        """
        try:
            trial = self.run(network, FEW)
        except TribrachError:
            return None
        return explains(trial.vtpv, trial.dof - loosened, before)

    def sentences(self) -> list[str]:
        """That the search gave up, if it did."""
        if not self.given_up:
            return []
        return [
            f"the search for exchanged names gave up after {self.tried} adjustments, with "
            f"{self.given_up} pairs of names untried: what it tried does not explain the misfit"
        ]
