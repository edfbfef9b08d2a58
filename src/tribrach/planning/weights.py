"""Weights of a design (second order): numbers of sets, and the precision that is needed.

A set more is one more repetition of everything that a station observes, so n sets divide the
covariances of its observations by n; what does not come from the readings (control, scale bars)
stays. Sets are added one by one where they serve most (method section 3.7).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.answers import Number, Result
from tribrach.network.adjustment import Adjustment
from tribrach.network.network import Network
from tribrach.observations.base import Observations, Use
from tribrach.observations.declaration import Repetition
from tribrach.planning.blocks import Blocks
from tribrach.planning.prediction import Criterion, criterion_value, predict
from tribrach.planning.prospect import prospect

#: by station: tables and masks of what is read there
_Readers = dict[str, list[tuple[int, NDArray[np.bool_]]]]


#: sets of one station at most
MOST = 32


#: factors of sigmas that are looked at: a thousandth is as good as perfect
_FINEST, _COARSEST = 1e-3, 1e3


@dataclass(frozen=True)
class SetsByStation(Result, without=("start", "steps")):
    """Repetitions by station that the requirement takes."""

    sets: dict[str, int]  #: how many, in the order of the stations
    start: float  #: the criterion with one set each
    value: Number  #: the criterion with these sets
    reached: bool  #: is it what is required?
    steps: tuple[tuple[str, float], ...]  #: station and criterion of every set that was added


@dataclass(frozen=True)
class RequiredPrecision(Result, without=("unit",), keys={"limit": "perfect"}):
    """How precise one group of readings must be to reach a requirement, the others as they are."""

    group: str  #: kind and component
    unit: str  #: of the readings
    sigma: float  #: of the first reading now [m, rad]
    #: what all its sigmas may be multiplied with, null where no precision of this group reaches the
    #: requirement
    factor: Number
    limit: Number  #: the criterion with a perfect group


def scaled(network: Network, factor: Callable[[Observations], Array]) -> Network:
    """The network with sigmas times factors (n, rows) of each kind, joint covariances as well."""
    factors = [factor(o) for o in network.observations]
    observations = tuple(
        replace(o, covariance=o.covariance * f[:, :, None] * f[:, None, :])
        for o, f in zip(network.observations, factors, strict=True)
    )
    joint = []
    for group in network.joint:
        f = np.array(
            [factors[t][i, r] for t, i, r in zip(group.table, group.item, group.row, strict=True)]
        )
        joint.append(replace(group, covariance=group.covariance * f[:, None] * f))
    return replace(network, observations=observations, joint=tuple(joint))


def _readers(network: Network) -> _Readers:
    """Tables and masks (n,) of what can be read again, by station or instrument point."""
    layout = network.start.layout
    out: _Readers = {}
    for number, o in enumerate(network.observations):
        if o.facts.repeats is not Repetition.SETS:
            continue
        starts = np.array([start for start, _ in o.ends(layout)], dtype=object)
        for name in dict.fromkeys(starts):
            out.setdefault(str(name), []).append((number, starts == name))
    return out


def needed_sets(
    network: Network, criterion: Criterion, required: float, most: int = MOST
) -> SetsByStation:
    """Sets of every station, added one by one until the criterion is what is required.

    network : with the sigmas of one set. The last figure is that of a prediction with all sets.
    Raises what :func:`~tribrach.planning.prediction.predict` raises.
    """
    readers = _readers(network)
    sets, sign = dict.fromkeys(readers, 1), _sign(criterion)
    adjustment = predict(network)
    start = value = criterion_value(adjustment, criterion)
    steps: list[tuple[str, float]] = []
    trial = _ByUpdate if criterion.kind in ("sigma", "correlation") else _ByPrediction
    design = trial(adjustment, criterion, readers)
    # a gain hardly ever grows with further sets: an old gain is an upper bound of the new one
    gains = dict.fromkeys(sets, np.inf)
    while sign * value > sign * required:
        best = _best_station(design, sets, gains, sign * value, sign, most)
        if best is None or gains[best] <= 1e-9 * abs(value):
            break
        value -= sign * gains[best]
        sets[best] += 1
        design.take(best)
        steps.append((best, value))
    value = criterion_value(predict(_with_sets(network, readers, sets)), criterion)
    reached = sign * value <= sign * required + 1e-6 * abs(required)
    return SetsByStation(sets, start, value, reached, tuple(steps))


def _best_station(
    design: _ByPrediction | _ByUpdate,
    sets: dict[str, int],
    gains: dict[str, float],
    value: float,
    sign: float,
    most: int,
) -> str | None:
    """The station where one more set serves most; gains are brought up to date as far as needed."""
    fresh: set[str] = set()
    while True:
        open_ = [name for name, count in sets.items() if count < most]
        if not open_:
            return None
        best = max(open_, key=lambda name: gains[name])
        if best in fresh:
            return best
        gains[best] = value - sign * design.value_with(best, sets)
        fresh.add(best)


def _sign(criterion: Criterion) -> float:
    """-1 for a criterion that should be large."""
    return -1.0 if criterion.kind == "redundancy" else 1.0


class _ByPrediction:
    """Effect of one more set on the reliability, by a prediction for each."""

    def __init__(self, adjustment: Adjustment, criterion: Criterion, readers: _Readers) -> None:
        self.network, self.criterion, self.readers = adjustment.network, criterion, readers

    def value_with(self, name: str, sets: Mapping[str, int]) -> float:
        """The criterion with one more set at a station."""
        trial = _with_sets(self.network, self.readers, {**sets, name: sets[name] + 1})
        return criterion_value(predict(trial), self.criterion)

    def take(self, name: str) -> None:
        """Nothing is kept from one prediction to the next."""


class _ByUpdate:
    """Effect of one more set on the covariance, by an update with the rows of the station."""

    def __init__(self, adjustment: Adjustment, criterion: Criterion, readers: _Readers) -> None:
        rows = {name: _rows_of(adjustment, parts) for name, parts in readers.items()}
        parts = [adjustment.design[r].indices for r in rows.values()]
        touched = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *parts]))
        self.now = prospect(adjustment, criterion, adjustment.free_columns[touched])
        place = np.full(adjustment.layout.size, -1, dtype=np.int64)
        place[self.now.columns] = np.arange(len(self.now.columns))
        place = place[adjustment.free_columns]
        self.blocks = {name: _block(adjustment.design[r], place) for name, r in rows.items()}

    def value_with(self, name: str, sets: Mapping[str, int]) -> float:
        """The criterion with one more set at a station."""
        return float(self.now.judge(self.blocks[name]).value[0])

    def take(self, name: str) -> None:
        """Keep the set."""
        self.now = self.now.changed(self.blocks[name], 0)


def _rows_of(adjustment: Adjustment, parts: list[tuple[int, NDArray[np.bool_]]]) -> Index:
    """Rows of the design that are read at a station."""
    rows = adjustment.rows
    chosen = [
        np.flatnonzero((rows.table == number) & mask[np.minimum(rows.item, len(mask) - 1)])
        for number, mask in parts
    ]
    return np.concatenate([np.zeros(0, dtype=np.int64), *chosen])


def _block(design: sp.csr_array, place: Index) -> Blocks:
    """Rows without own unknowns as one group, no more of them than columns they touch."""
    columns = np.unique(design.indices)
    dense = design[:, columns].toarray()
    if len(dense) > len(columns):
        dense = np.asarray(np.linalg.qr(dense, mode="r"))
    k = len(dense)
    return Blocks(
        np.zeros(1, dtype=np.int64),
        dense[None],
        place[columns][None],
        np.zeros((1, k)),
        np.full((1, k), -1, dtype=np.int64),
        np.ones(1, dtype=bool),
    )


def _with_sets(
    network: Network,
    readers: _Readers,
    sets: Mapping[str, int],
) -> Network:
    factors = [np.ones(o.values.shape) for o in network.observations]
    for name, count in sets.items():
        for number, mask in readers[name]:
            factors[number][mask] /= np.sqrt(count)
    given = {id(o): f for o, f in zip(network.observations, factors, strict=True)}
    return scaled(network, lambda o: given[id(o)])


def reading_groups(network: Network) -> list[tuple[str, str, list[int], str]]:
    """Groups of readings: words, unit, rows of the kind, kind; ranges and angles apart."""
    out: list[tuple[str, str, list[int], str]] = []
    for o in network.observations:
        if o.facts.repeats is Repetition.NEVER or not (o.use == Use.ACTIVE).any():
            continue
        for unit in dict.fromkeys(o.units):
            rows = [k for k, u in enumerate(o.units) if u == unit]
            part = "/".join(o.components[k] for k in rows if o.components[k])
            entry = (f"{o.kind} {part}".strip(), unit, rows, o.kind)
            if entry not in out:
                out.append(entry)
    return out


def needed_precision(
    network: Network, criterion: Criterion, required: float, tolerance: float = 0.01
) -> list[RequiredPrecision]:
    """For every group of readings the sigma that reaches a requirement, the others as they are.

    By bisection of the factor's logarithm to the relative tolerance; every step is a prediction of
    its own.
    """
    sign = _sign(criterion)
    out = []
    for words, unit, rows, kind in reading_groups(network):

        def reached(log: float, rows: list[int] = rows, kind: str = kind) -> tuple[bool, float]:
            value = _with_factor(network, criterion, kind, rows, float(np.exp(log)))
            return sign * value <= sign * required, value

        sigma = next(o.sigma[0, rows[0]] for o in network.observations if o.kind == kind)
        low, high = np.log(_FINEST), np.log(_COARSEST)
        perfect, limit = reached(low)
        if not perfect:
            out.append(RequiredPrecision(words, unit, float(sigma), float("nan"), limit))
            continue
        while high - low > tolerance:
            middle = (low + high) / 2
            low, high = (middle, high) if reached(middle)[0] else (low, middle)
        out.append(RequiredPrecision(words, unit, float(sigma), float(np.exp(low)), limit))
    return out


def _with_factor(
    network: Network, criterion: Criterion, kind: str, rows: list[int], factor: float
) -> float:
    """The criterion with the sigmas of some rows of a kind multiplied."""

    def factors(o: Observations) -> Array:
        out = np.ones(o.values.shape)
        if o.kind == kind:
            out[:, rows] = factor
        return out

    return criterion_value(predict(scaled(network, factors)), criterion)
