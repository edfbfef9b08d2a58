"""Iterative data snooping: one suspect at a time, nothing deleted silently.

The observation with the largest test statistic is switched off with its reason, the network is
adjusted again, and so on; at the end every switched-off observation is tried again and comes
back if it fits after all (method section 3.4).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from tribrach.errors import AdjustmentError
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.network import Network
from tribrach.network.observations.base import Use
from tribrach.network.quality import Quality, assess

__all__ = ["SnoopingLog", "SnoopingStep", "snoop", "switch"]

#: groups whose observations are given coordinates and not measurements
CONTROL_GROUPS = ("control",)


@dataclass(frozen=True)
class SnoopingStep:
    """One decision: the observation, its statistic against its limit, and what was done."""

    observation: str
    statistic: float
    critical: float
    gross_error: float
    unit: str
    action: str

    def sentence(self) -> str:
        """The step in words."""
        scale, name = (1e3, "mm") if self.unit == "m" else (206264.806, "arcsec")
        size = f", error about {self.gross_error * scale:.2f} {name}" if self.gross_error else ""
        return (
            f"{self.observation}: {self.action} (test {self.statistic:.2f} against "
            f"{self.critical:.2f}{size})"
        )


@dataclass(frozen=True)
class SnoopingLog:
    """All steps in order; ``removed`` are (table, item) of what stayed off."""

    steps: tuple[SnoopingStep, ...]
    removed: tuple[tuple[int, int], ...]


def switch(network: Network, table: int, item: int, use: Use, reason: str = "") -> Network:
    """The network with one observation in another use."""
    observations = list(network.observations)
    o = observations[table]
    uses, reasons = o.use.copy(), o.reason.copy()
    uses[item], reasons[item] = use, reason
    observations[table] = replace(o, use=uses, reason=reasons)
    return replace(network, observations=tuple(observations))


def snoop(
    network: Network,
    *,
    alpha0: float = 0.001,
    include_control: bool = False,
    max_removed: int | None = None,
    run: Callable[[Network], Adjustment] = adjust,
) -> tuple[Adjustment, SnoopingLog]:
    """Adjust, test, switch the worst suspect off, repeat.

    include_control : may given coordinates be switched off? Otherwise they are named as
        suspicious and kept. max_removed : at most this many; a third of the observations if None.

    The redundancy never falls below one.
    """
    adjustment = run(network)
    steps: list[SnoopingStep] = []
    removed: list[tuple[int, int]] = []
    kept: set[tuple[int, int]] = set()
    limit = max(1, network.count() // 3) if max_removed is None else max_removed
    while True:
        suspect = _worst(adjustment, assess(adjustment, alpha0=alpha0), kept)
        if suspect is None or len(removed) >= limit:
            break
        table, item, step = suspect
        o = adjustment.network.observations[table]
        if o.group in CONTROL_GROUPS and not include_control:
            kept.add((table, item))
            steps.append(replace(step, action="suspicious control, kept"))
            continue
        if adjustment.dof - o.rows < 1:
            kept.add((table, item))
            steps.append(replace(step, action="kept, without it nothing would be checked"))
            continue
        reason = f"snooping: test {step.statistic:.2f} against {step.critical:.2f}"
        changed = switch(adjustment.network, table, item, Use.OFF, reason)
        try:
            adjustment = run(changed.with_start(adjustment.state))
        except AdjustmentError:
            kept.add((table, item))
            steps.append(replace(step, action="kept, the network needs it"))
            continue
        removed.append((table, item))
        steps.append(step)
    adjustment = _reinstate(adjustment, removed, steps, alpha0, run)
    return adjustment, SnoopingLog(tuple(steps), tuple(removed))


def _worst(
    adjustment: Adjustment, quality: Quality, kept: set[tuple[int, int]]
) -> tuple[int, int, SnoopingStep] | None:
    """The observation furthest beyond its limit: vectors as blocks, single values by w."""
    rows = adjustment.rows
    observations = adjustment.network.observations
    best: tuple[float, int, int, SnoopingStep] | None = None
    single = np.array([o.rows == 1 for o in observations])[rows.table]
    ratio = np.where(single, np.nan_to_num(np.abs(quality.w)) / quality.w_critical, 0.0)
    for row in np.argsort(-ratio)[: len(kept) + 1]:
        key = int(rows.table[row]), int(rows.item[row])
        if ratio[row] > 1 and key not in kept:
            words = Network.describe(observations[key[0]], key[1], adjustment.state)
            unit = observations[key[0]].units[0]
            step = SnoopingStep(
                words,
                abs(float(quality.w[row])),
                quality.w_critical,
                float(quality.gross_error[row]),
                unit,
                "switched off",
            )
            best = (float(ratio[row]), *key, step)
            break
    blocks = quality.blocks
    ratio = np.sqrt(np.nan_to_num(blocks.statistic) / np.maximum(blocks.critical, 1e-9))
    for b in np.argsort(-ratio)[: len(kept) + 1]:
        key = int(blocks.table[b]), int(blocks.item[b])
        if ratio[b] > max(1.0, best[0] if best else 1.0) and key not in kept:
            words = Network.describe(observations[key[0]], key[1], adjustment.state)
            step = SnoopingStep(
                words,
                float(blocks.statistic[b]),
                float(blocks.critical[b]),
                0.0,
                "m",
                "switched off",
            )
            best = (float(ratio[b]), *key, step)
            break
    return None if best is None else best[1:]


def _reinstate(
    adjustment: Adjustment,
    removed: list[tuple[int, int]],
    steps: list[SnoopingStep],
    alpha0: float,
    run: Callable[[Network], Adjustment],
) -> Adjustment:
    """Try each switched-off observation again, the last one first."""
    for table, item in list(reversed(removed)):
        trial = run(switch(adjustment.network, table, item, Use.ACTIVE))
        quality = assess(trial, alpha0=alpha0)
        rows = trial.rows
        mine = (rows.table == table) & (rows.item == item)
        worst = float(np.nanmax(np.abs(quality.w[mine]), initial=0.0))
        if worst < norm.ppf(1 - alpha0 / 2):
            o = trial.network.observations[table]
            words = Network.describe(o, item, trial.state)
            steps.append(
                SnoopingStep(words, worst, quality.w_critical, 0.0, o.units[0], "taken back")
            )
            removed.remove((table, item))
            adjustment = trial
    return adjustment
