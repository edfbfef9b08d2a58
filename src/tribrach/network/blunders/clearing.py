"""Finds the observations without which a network fits, where gross errors spoil least squares.

Least squares smears gross errors over everything around them, or does not converge at all. Start
values are medians and stand where the bulk of the observations puts them: what is far from them is
loosened, the rest is adjusted, what then stands out is loosened as well and what fits is taken
back, until nothing changes any more (method section 3.4).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from tribrach._types import Array
from tribrach.errors import TribrachError
from tribrach.network.adjustment import Adjustment
from tribrach.network.blunders.robust import with_sigmas
from tribrach.network.blunders.suspects import Key
from tribrach.network.network import Network
from tribrach.network.quality import prediction_statistics
from tribrach.network.reliability import weigh
from tribrach.network.significance import w_critical
from tribrach.network.start.start_values import find_start
from tribrach.observations.base import Use
from tribrach.observations.declaration import End
from tribrach.observations.unknowns import State
from tribrach.statistics import chi2, robust_sigma

#: significance of the global test that an explanation must pass
ALPHA = 0.001
#: rounds of loosening and taking back
_ROUNDS = 6
#: misclosures at the start values that are loosened at once, in robust sigmas
_WILD = 10.0
#: tests that loosen an observation, and the share of the largest that they must have
_STANDS_OUT, _SHARE = 4.5, 0.5
#: factor on the misclosure in sigmas by which what is loosened gets weaker
_LOOSE = 10.0
#: share of the observed values that may be loosened
_MOST = 0.34


@dataclass(frozen=True)
class Cleared:
    """A network that fits once some observations are loosened."""

    #: with the sigmas of these observations so large that they pull at nothing
    adjustment: Adjustment
    wild: frozenset[Key]  #: the loosened observations (table, item)
    #: weighted sum of squares and redundancy of the rest
    vtpv: float
    dof: int

    @property
    def fits(self) -> bool:
        """True if the rest passes its global test."""
        return fits(self.vtpv, self.dof)


def fits(vtpv: float, dof: int) -> bool:
    """True if a weighted sum of squares passes the global test at 0.1 %, with redundancy."""
    return dof > 0 and vtpv <= float(chi2.ppf(1 - ALPHA, dof))


def loosened(network: Network, wild: frozenset[Key] | set[Key], size: list[Array]) -> Network:
    """Give observations, misclosures ``size`` (n,) [sigmas], sigmas that pull at nothing."""
    factors = [np.ones(o.values.shape) for o in network.observations]
    for table, item in wild:
        factors[table][item] = _LOOSE * max(float(size[table][item]), 10.0)
    return with_sigmas(network, factors)


def from_start(network: Network, run: Callable[[Network], Adjustment]) -> Cleared | None:
    """Loosen what does not fit, beginning where the start values put everything."""
    try:
        state = find_start(network)
    except TribrachError:
        return None
    size = _misclosures(network.with_start(state))
    every = np.concatenate([part[np.isfinite(part)] for part in size])
    limit = _WILD * max(1.0, robust_sigma(every, about=0.0)) if len(every) else np.inf
    return _cleared(network, state, _beyond(network, size, limit), run)


def from_adjusted(
    network: Network, adjustment: Adjustment, run: Callable[[Network], Adjustment]
) -> Cleared | None:
    """Loosen what does not fit, beginning with what the tests of an adjustment reject most."""
    return _cleared(network, adjustment.state, _standing_out(adjustment, frozenset()), run)


def _cleared(
    network: Network, state: State, wild: frozenset[Key], run: Callable[[Network], Adjustment]
) -> Cleared | None:
    """Loosen and take back until nothing changes any more."""
    found: Cleared | None = None
    seen: set[frozenset[Key]] = set()
    for _ in range(_ROUNDS):
        if not wild or wild in seen or not _affordable(network, wild):
            break
        seen.add(wild)
        size = _misclosures(network.with_start(state))
        loose, gone = _without_orphans(loosened(network, wild, size), wild)
        try:
            adjustment = run(loose.with_start(state))
        except TribrachError:
            break
        state = adjustment.state
        values = sum(network.observations[t].rows for t, _ in wild - gone)
        found = Cleared(adjustment, wild, adjustment.vtpv, adjustment.dof - values)
        back = _fitting(network, adjustment, wild - gone)
        wild = (wild - back) | _standing_out(adjustment, wild)
    return found


def _without_orphans(network: Network, wild: frozenset[Key]) -> tuple[Network, frozenset[Key]]:
    """Hold points that nothing but loosened observations sees, and switch those off."""
    layout = network.start.layout
    good = np.zeros(layout.count("point") + layout.count("pose"), dtype=bool)
    bad = good.copy()
    touched: dict[Key, list[int]] = {}
    for table, o in enumerate(network.observations):
        off = np.zeros(len(o), dtype=bool)
        off[[i for t, i in wild if t == table]] = True
        for end in (End.FROM, End.TO, End.AT):
            field = o.end_field(end)
            if field is None or field.family not in ("position", "pose"):
                continue
            at = np.asarray(getattr(o, field.name))
            at = at + (layout.count("point") if field.family == "pose" else 0)
            good[at[~off & (o.use == Use.ACTIVE)]] = True
            bad[at[off]] = True
            for item in np.flatnonzero(off):
                touched.setdefault((table, int(item)), []).append(int(at[item]))
    orphans = np.flatnonzero(bad & ~good)
    orphans = orphans[orphans < layout.count("point")]
    if not len(orphans):
        return network, frozenset()
    free = network.free.copy()
    free[layout.position_columns(orphans).ravel()] = False
    lost = set(orphans.tolist())
    gone = frozenset(key for key, ends in touched.items() if lost & set(ends))
    observations = list(network.observations)
    for table in {t for t, _ in gone}:
        use = observations[table].use.copy()
        use[[i for t, i in gone if t == table]] = Use.OFF
        observations[table] = replace(observations[table], use=use)
    return replace(network, free=free, observations=tuple(observations)), gone


def _affordable(network: Network, wild: frozenset[Key]) -> bool:
    """True if enough is left to say what is wrong."""
    active = sum(int((o.use == Use.ACTIVE).sum()) for o in network.observations)
    return len(wild) <= _MOST * active


def _misclosures(network: Network) -> list[Array]:
    """Largest misclosure (n,) of each observation in sigmas; of values not in use zero."""
    out = []
    for o in network.observations:
        with np.errstate(all="ignore"):
            size = np.abs(o.misclosure(network.start) / o.sigma).max(axis=1, initial=0.0)
        size = np.where(np.isfinite(size), size, 1e6)
        out.append(np.where(o.use == Use.ACTIVE, size, 0.0))
    return out


def _beyond(network: Network, size: list[Array], limit: float) -> frozenset[Key]:
    """Active observations whose misclosures are larger than a limit."""
    return frozenset(
        (table, int(item))
        for table, o in enumerate(network.observations)
        for item in np.flatnonzero((size[table] > limit) & (o.use == Use.ACTIVE))
    )


def _fitting(network: Network, adjustment: Adjustment, wild: frozenset[Key]) -> frozenset[Key]:
    """Loosened observations that the rest predicts after all."""
    out: set[Key] = set()
    for table in {t for t, _ in wild}:
        o = network.observations[table]
        items = np.array(sorted(i for t, i in wild if t == table))
        statistic = prediction_statistics(adjustment, o, items)
        good = statistic <= chi2.ppf(1 - ALPHA, o.rows)
        out |= {(table, int(i)) for i in items[good]}
    return frozenset(out)


def _standing_out(adjustment: Adjustment, wild: frozenset[Key]) -> frozenset[Key]:
    """Observations that the tests reject most clearly and that are not loosened yet."""
    rows = adjustment.rows
    w = np.nan_to_num(np.abs(weigh(adjustment).w))
    keys = list(zip(rows.table.tolist(), rows.item.tolist(), strict=True))
    w[[key in wild for key in keys]] = 0.0
    # errors that sights share are in every network; what is looked for is a reading
    shared = [o.facts.nuisance for o in adjustment.network.observations]
    w[np.array(shared, dtype=bool)[rows.table]] = 0.0
    limit = max(_STANDS_OUT, w_critical(), _SHARE * float(w.max(initial=0.0)))
    return frozenset(keys[k] for k in np.flatnonzero(w >= limit))
