"""Switches blunders off by iterative data snooping and records why.

The observation with the most improbable test value is switched off with its reason, the network is
adjusted again, and so on; at the end every switched-off observation is tried again and comes back
if it fits after all (method section 3.4). Nothing is switched off while something else would
explain as much: the observation stands aside while the search goes on, comes back at its end, and
is named with its rivals and with what must not be used.

Given coordinates that look wrong are named. Unless they may be switched off they stand aside while
the search goes on, since otherwise the good observations around them would be taken for wrong, and
come back at its end.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.errors import AdjustmentError
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.blunders.rivals import Rivals, rivals_of
from tribrach.network.blunders.suspects import Key, Suspect, find_suspects
from tribrach.network.network import Network
from tribrach.network.quality import prediction_statistics
from tribrach.network.reliability import WeightedResiduals, correlations_of_tests, weigh
from tribrach.network.separability import partners
from tribrach.network.significance import log_significance, w_critical
from tribrach.observations.base import Use
from tribrach.sentences import Sentence
from tribrach.statistics import chi2

#: what is done with given coordinates that look wrong
SUSPICIOUS = "suspicious control, kept"
#: what is done with an observation that cannot be told from others
UNDECIDED = "kept, others would explain as much"
#: groups whose observations are given coordinates and not measurements
CONTROL_GROUPS = ("control",)
#: coverage in percent of 95 % regions of the point that a removal moves most (method section 3.4)
COVERED = 87, 90
#: networks with more values than this lose up to BATCH suspects a round, if far enough apart
LARGE = 5000
#: suspects that a large network may lose in one round
BATCH = 20
#: tests less correlated than this do not influence each other
APART = 0.1


@dataclass(frozen=True)
class SnoopingStep:
    """One decision about one observation."""

    observation: str  #: in words
    #: its test value and the limit
    statistic: float
    critical: float
    gross_error: float  #: estimated error in ``unit``, 0 if it has no single size
    unit: str  #: ``m`` or ``rad``
    action: str  #: what was done, in words
    alternatives: tuple[str, ...] = ()  #: observations in words that could as well be the wrong one
    #: points and stations that an error in one of all these moves by more than their sigma
    touched: tuple[str, ...] = ()
    undecided: bool = False  #: it takes part, since others explain as much

    def sentence(self) -> str:
        """The step in words."""
        scale, name = (1e3, "mm") if self.unit == "m" else (206264.806, "arcsec")
        size = (
            Sentence(
                ", error about {gross_error:2} {name}",
                gross_error=self.gross_error * scale,
                name=name,
            )
            if self.gross_error
            else ""
        )
        doubt = f"; it could as well be {self._others()}" if self.alternatives else ""
        return Sentence(
            "{own.observation}: {own.action} (test {own.statistic:2} against "
            "{own.critical:2}{size}){doubt}",
            own=self,
            size=size,
            doubt=doubt,
        )

    def _others(self) -> str:
        more = len(self.alternatives) - 3
        return " or ".join(self.alternatives[:3]) + (f" or {more} others" if more > 0 else "")


@dataclass(frozen=True)
class SnoopingLog:
    """What snooping switched off, and why."""

    steps: tuple[SnoopingStep, ...]  #: in the order in which they were taken
    removed: tuple[Key, ...]  #: (table, item) of the observations that stayed off

    def sentences(self) -> list[str]:
        """The steps in words."""
        return [step.sentence() for step in self.steps]

    def undecided(self) -> list[str]:
        """Observations that cannot be told apart, and points not to be used."""
        told: list[set[str]] = []
        out: list[str] = []
        for step in self.steps:
            group = {step.observation, *step.alternatives}
            # a part of a group that was said already is the same doubt
            if step.undecided and not any(group <= larger for larger in told):
                told.append(group)
                out.append(_undecided(step))
        return out


#: observations and points that a sentence names
_NAMED = 4


def _undecided(step: SnoopingStep) -> str:
    """A group of which one is wrong, in a sentence."""
    group = (step.observation, *step.alternatives)
    touched = _listed(step.touched, ", ")
    return Sentence(
        "one of {count} looks wrong (test {step.statistic:1} against {step.critical:1}) and "
        "nothing tells which: {names}; none is switched off: look into the field notes, or "
        "observe more{before}{touched}",
        count=len(group),
        step=step,
        names=_listed(group, "; "),
        before=", before you use " if touched else "",
        touched=touched,
    )


def _listed(names: tuple[str, ...], between: str) -> str:
    """The first names, and how many more there are."""
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return between.join(names[:_NAMED]) + more


def restart(network: Network, adjustment: Adjustment) -> Network:
    """Start a network from an adjusted state, unless inner constraints refer to the start."""
    return network if adjustment.defect else network.with_start(adjustment.state)


def snoop(
    network: Network,
    *,
    alpha0: float = 0.001,
    include_control: bool = False,
    max_removed: int | None = None,
    suspects: Mapping[Key, float] | None = None,
    run: Callable[[Network], Adjustment] = adjust,
) -> tuple[Adjustment, SnoopingLog]:
    """Adjust, test, switch the worst suspect off, repeat; the redundancy stays one at least."""
    limit = max(1, network.count() // 3) if max_removed is None else max_removed
    search = _Search(run(network), alpha0, include_control, limit, run)
    search.begin(suspects or {})
    while search.round():
        pass
    search.recall()
    search.reinstate()
    return search.adjustment, SnoopingLog(tuple(search.steps), tuple(search.removed))


def coverage_after(first: Adjustment, cleaned: Adjustment, log: SnoopingLog | None) -> list[str]:
    """Where sigmas are too small since the same observations chose what was switched off."""
    if log is None or not log.removed:
        return []
    moved = np.linalg.norm(cleaned.state.positions - first.state.positions, axis=1)
    spread = np.sqrt(np.maximum(np.trace(cleaned.position_covariances(), axis1=1, axis2=2), 0.0))
    ratio = np.where(spread > 0, moved / np.where(spread > 0, spread, 1.0), 0.0)
    if not len(ratio) or not ratio.max() > 0:
        return []
    return [
        Sentence(
            "what snooping switched off moved {name} most; its sigmas do not know that the same "
            "observations made the choice: in trials 95 % regions of such points held the truth "
            "in {low} to {high} %",
            name=cleaned.layout.position_name(int(np.argmax(ratio))),
            low=COVERED[0],
            high=COVERED[1],
        )
    ]


class _Search:
    """The state of the search: what is off, what is kept, and why."""

    def __init__(
        self,
        adjustment: Adjustment,
        alpha0: float,
        include_control: bool,
        limit: int,
        run: Callable[[Network], Adjustment],
    ) -> None:
        self.adjustment, self.alpha0, self.limit, self.run = adjustment, alpha0, limit, run
        self.include_control = include_control
        self.steps: list[SnoopingStep] = []
        self.removed: list[Key] = []
        self.aside: list[Key] = []
        self.open: list[Key] = []
        self.kept: set[Key] = set()

    def begin(self, suspects: Mapping[Key, float]) -> None:
        """Switch off what a robust estimate suspects, as far as the network can do without it."""
        tables = self.adjustment.network.observations
        for key, size in sorted(suspects.items(), key=lambda item: -item[1]):
            if tables[key[0]].group in CONTROL_GROUPS and not self.include_control:
                continue
            words = self._words(key)
            if self._undecided(self._robust_suspect(key, size)):
                continue
            reason = Sentence(
                "robust estimate: largest standardised residual {size:2}, limit {w_critical:2}",
                size=size,
                w_critical=w_critical(),
            )
            if self._without([key], [reason]):
                limit = w_critical(self.alpha0)
                self.removed.append(key)
                self.steps.append(SnoopingStep(words, size, limit, 0.0, "m", "switched off"))

    def round(self) -> bool:
        """Look once at all tests; True if anything was done."""
        system = weigh(self.adjustment)
        suspects = [s for s in find_suspects(system, self.alpha0) if s.key not in self.kept]
        if not suspects:
            return False
        if len(self.removed) + len(self.open) >= self.limit:
            action = f"kept, {len(self.removed)} observations are off already: look at the data"
            self.steps.append(self._step(system, suspects[0], action))
            return False
        if self._undecided(suspects[0]):
            return True
        chosen = self._independent(system, suspects)
        if len(chosen) > 1 and self._switched(system, chosen):
            return True
        if not self._switched(system, chosen[:1]):
            self._keep(system, chosen[0])
        return True

    def _independent(self, system: WeightedResiduals, suspects: list[Suspect]) -> list[Suspect]:
        """The worst suspect, and in large networks others that it does not influence."""
        if len(self.adjustment.rows) <= LARGE:
            return suspects[:1]
        suspects = suspects[: min(2 * BATCH, self.limit - len(self.removed))]
        rows = np.array([suspect.row for suspect in suspects])
        rho = np.abs(np.nan_to_num(correlations_of_tests(system, rows)[rows]))
        chosen: list[int] = []
        for k in range(len(suspects)):
            if len(chosen) < BATCH and (rho[k, chosen] < APART).all():
                chosen.append(k)
        alone = [k for k in chosen[1:] if not self._rivals(suspects[k])]
        return [suspects[k] for k in (chosen[0], *alone)]

    def _rivals(self, suspect: Suspect) -> Rivals | None:
        """What explains as much as a suspect; None for control, which is kept in any case."""
        return None if self._protected(suspect.key) else rivals_of(self.adjustment, suspect)

    def _undecided(self, suspect: Suspect) -> bool:
        """Put a suspect aside for the time of the search if others explain as much."""
        rivals = self._rivals(suspect)
        if not rivals:
            return False
        step = self._undecided_step(suspect, rivals, UNDECIDED)
        # one that stands aside is enough to see what else is wrong
        aside = next(
            (k for k in (suspect.key, *rivals.keys) if self._without([k], [UNDECIDED])), None
        )
        if aside is None:
            return False
        self.steps.append(step)
        self.open.append(aside)
        return True

    def _undecided_step(self, suspect: Suspect, rivals: Rivals, action: str) -> SnoopingStep:
        """The decision that nothing decides."""
        return SnoopingStep(
            self._words(suspect.key),
            suspect.statistic,
            suspect.critical,
            suspect.gross_error,
            suspect.unit,
            action,
            rivals.words,
            rivals.touched,
            undecided=True,
        )

    def _robust_suspect(self, key: Key, size: float) -> Suspect:
        """An observation that a robust estimate suspects, as a suspect with its own row."""
        system = weigh(self.adjustment)
        rows = system.adjustment.rows
        own = np.flatnonzero((rows.table == key[0]) & (rows.item == key[1]))
        row = int(own[np.argmax(np.abs(np.nan_to_num(system.w[own])))])
        unit = self.adjustment.network.observations[key[0]].units[0]
        log_p = float(log_significance(size**2, 1))
        return Suspect(key, row, size, w_critical(self.alpha0), log_p, 0.0, unit)

    def _switched(self, system: WeightedResiduals, chosen: list[Suspect]) -> bool:
        """Switch suspects off together; False if the network cannot do without them."""
        reasons: list[str] = [
            Sentence("snooping: test {s.statistic:2} against {s.critical:2}", s=s) for s in chosen
        ]
        if not self._without([s.key for s in chosen], reasons):
            return False
        for suspect in chosen:
            control = self._protected(suspect.key)
            (self.aside if control else self.removed).append(suspect.key)
            action = SUSPICIOUS if control else "switched off"
            self.steps.append(self._step(system, suspect, action))
        return True

    def _keep(self, system: WeightedResiduals, suspect: Suspect) -> None:
        """Say why a suspect stays."""
        self.kept.add(suspect.key)
        if self._protected(suspect.key):
            action = SUSPICIOUS
        elif self.adjustment.dof - self._rows(suspect.key) < 1:
            action = "kept, without it nothing would be checked"
        else:
            action = "kept, the network needs it"
        rivals = self._rivals(suspect)
        if rivals:
            self.steps.append(self._undecided_step(suspect, rivals, action))
        else:
            self.steps.append(self._step(system, suspect, action))

    def _protected(self, key: Key) -> bool:
        """True for given coordinates that may not be switched off."""
        group = self.adjustment.network.observations[key[0]].group
        return group in CONTROL_GROUPS and not self.include_control

    def _rows(self, key: Key) -> int:
        return self.adjustment.network.observations[key[0]].rows

    def _without(self, keys: list[Key], reasons: list[str]) -> bool:
        """Adjust without some observations; False if that cannot be done."""
        if self.adjustment.dof - sum(map(self._rows, keys)) < 1:
            return False
        changed = self.adjustment.network
        for key, reason in zip(keys, reasons, strict=True):
            changed = changed.switched([key], Use.OFF, reason)
        try:
            self.adjustment = self.run(restart(changed, self.adjustment))
        except AdjustmentError:
            return False
        return True

    def recall(self) -> None:
        """Bring back the control and the undecided observations that stood aside."""
        aside = [*self.aside, *self.open]
        if aside:
            network = self.adjustment.network.switched(aside, Use.ACTIVE)
            self.adjustment = self.run(restart(network, self.adjustment))
            self.kept |= set(aside)

    def reinstate(self) -> None:
        """Take back, one at a time, what fits and makes nothing else fail; the best first."""
        waiting = list(self.removed)
        while waiting:
            statistic, freedom = self._predicted(waiting)
            log_p = log_significance(statistic, freedom)
            best = int(np.argmax(log_p))
            if log_p[best] <= np.log(self.alpha0):
                return
            key = waiting.pop(best)
            before = self._rejected()
            changed = self.adjustment.network.switched([key], Use.ACTIVE)
            try:
                trial = self.run(restart(changed, self.adjustment))
            except AdjustmentError:
                continue
            after = {s.key for s in find_suspects(weigh(trial), self.alpha0)}
            if key in after or not after <= before:
                continue
            self.adjustment = trial
            self.removed.remove(key)
            self._note_return(key, float(statistic[best]), int(freedom[best]))

    def _rejected(self) -> set[Key]:
        """Observations (table, item) that the tests reject now."""
        return {s.key for s in find_suspects(weigh(self.adjustment), self.alpha0)}

    def _predicted(self, keys: list[Key]) -> tuple[Array, Array]:
        """Statistics and degrees of freedom of observations that are off, by prediction."""
        tables = self.adjustment.network.observations
        table, item = np.array(keys).T
        statistic = np.zeros(len(keys))
        for number in np.unique(table):
            inside = table == number
            statistic[inside] = prediction_statistics(self.adjustment, tables[number], item[inside])
        return statistic, np.array([float(self._rows(key)) for key in keys])

    def _note_return(self, key: Key, statistic: float, freedom: int) -> None:
        """Write down that an observation was taken back."""
        limit = float(chi2.ppf(1 - self.alpha0, freedom))
        if freedom == 1:
            statistic, limit = float(np.sqrt(statistic)), float(np.sqrt(limit))
        step = SnoopingStep(self._words(key), statistic, limit, 0.0, "m", "taken back")
        self.steps.append(step)

    def _words(self, key: Key) -> str:
        o = self.adjustment.network.observations[key[0]]
        return Network.describe(o, key[1], self.adjustment.state)

    def _step(self, system: WeightedResiduals, suspect: Suspect, action: str) -> SnoopingStep:
        return SnoopingStep(
            self._words(suspect.key),
            suspect.statistic,
            suspect.critical,
            suspect.gross_error,
            suspect.unit,
            action,
            partners(system, suspect.row),
        )
