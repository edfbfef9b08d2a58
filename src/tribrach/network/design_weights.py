"""How often must be measured, and how precisely? Weights of a design (second order).

A set more is one more repetition of everything that a station observes, so n sets divide the
covariances of its observations by n; what does not come from the readings (control, scale bars)
stays. Sets are added one by one where they serve most (method section 3.7).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tribrach.network.adjustment import Adjustment
from tribrach.network.network import Network
from tribrach.network.observations.base import Observations, Use
from tribrach.network.planning import Criterion, figures, predict

__all__ = ["Precision", "Sets", "needed_precision", "needed_sets", "reading_groups", "scaled"]

Array = NDArray[np.float64]

#: kinds that are not read from an instrument that could read again
_GIVEN = ("coordinates", "coordinate", "height", "vector_prior", "parameter", "relative_pose")
#: sets of one station at most
MOST = 32
#: factors of sigmas that are looked at: a thousandth is as good as perfect
_FINEST, _COARSEST = 1e-3, 1e3


@dataclass(frozen=True)
class Sets:
    """Sets by station.

    sets : how many, in the order of the stations; start and value : the criterion with one set
    each and with these; reached : is it what is required? steps : station and criterion of every
    set that was added.
    """

    sets: Mapping[str, int]
    start: float
    value: float
    reached: bool
    steps: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Precision:
    """What one group of readings must be to reach a requirement, the others as they are.

    group : kind and component; sigma : of the first reading now [m, rad]; factor : what all its
    sigmas may be multiplied with, NaN where no precision of this group reaches the requirement;
    limit : the criterion with a perfect group.
    """

    group: str
    unit: str
    sigma: float
    factor: float
    limit: float


def scaled(network: Network, factor: Callable[[Observations], Array]) -> Network:
    """The network with sigmas of all values multiplied by factors (n, rows) of each kind.

    Joint covariances are scaled with their values.
    """
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


def _readers(network: Network) -> dict[str, list[tuple[int, NDArray[np.bool_]]]]:
    """By station or instrument point: tables and masks of what is read there."""
    layout = network.start.layout
    out: dict[str, list[tuple[int, NDArray[np.bool_]]]] = {}
    for number, o in enumerate(network.observations):
        if o.kind in _GIVEN or o.kind.startswith("gnss"):
            continue
        starts = np.array([start for start, _ in o.ends(layout)], dtype=object)
        for name in dict.fromkeys(starts):
            out.setdefault(str(name), []).append((number, starts == name))
    return out


def needed_sets(network: Network, criterion: Criterion, required: float, most: int = MOST) -> Sets:
    """Sets of every station, added one by one until the criterion is what is required.

    network : with the sigmas of one set. Raises what
    :func:`~tribrach.network.planning.predict` raises.
    """
    readers = _readers(network)
    sets = dict.fromkeys(readers, 1)
    start = figures(predict(network), criterion).value(criterion.kind)
    value, steps = start, []
    sign = -1.0 if criterion.kind == "redundancy" else 1.0
    while sign * value > sign * required:
        best: tuple[float, str] | None = None
        for name, count in sets.items():
            if count >= most:
                continue
            trial = _with_sets(network, readers, sets | {name: count + 1})
            after = figures(predict(trial), criterion).value(criterion.kind)
            if best is None or sign * after < sign * best[0]:
                best = (after, name)
        if best is None or sign * best[0] >= sign * value - 1e-9 * abs(value):
            break
        value, name = best
        sets[name] += 1
        steps.append((name, value))
    return Sets(sets, start, value, sign * value <= sign * required, tuple(steps))


def _with_sets(
    network: Network,
    readers: Mapping[str, list[tuple[int, NDArray[np.bool_]]]],
    sets: Mapping[str, int],
) -> Network:
    factors = [np.ones(o.values.shape) for o in network.observations]
    for name, count in sets.items():
        for number, mine in readers[name]:
            factors[number][mine] /= np.sqrt(count)
    given = {id(o): f for o, f in zip(network.observations, factors, strict=True)}
    return scaled(network, lambda o: given[id(o)])


def reading_groups(network: Network) -> list[tuple[str, str, list[int], str]]:
    """Groups of readings: words, unit, rows of the kind, kind; ranges and angles apart."""
    out: list[tuple[str, str, list[int], str]] = []
    for o in network.observations:
        if o.kind in _GIVEN or not (o.use == Use.ACTIVE).any():
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
) -> list[Precision]:
    """For every group of readings the sigma that reaches a requirement, the others as they are.

    By bisection of the factor's logarithm to the relative tolerance; every step is a prediction of
    its own.
    """
    sign = -1.0 if criterion.kind == "redundancy" else 1.0
    out = []
    for words, unit, rows, kind in reading_groups(network):

        def reached(log: float, rows: list[int] = rows, kind: str = kind) -> tuple[bool, float]:
            value = _with_factor(network, criterion, kind, rows, float(np.exp(log)))
            return sign * value <= sign * required, value

        sigma = next(o.sigma[0, rows[0]] for o in network.observations if o.kind == kind)
        low, high = np.log(_FINEST), np.log(_COARSEST)
        perfect, limit = reached(low)
        if not perfect:
            out.append(Precision(words, unit, float(sigma), float("nan"), limit))
            continue
        while high - low > tolerance:
            middle = (low + high) / 2
            low, high = (middle, high) if reached(middle)[0] else (low, middle)
        out.append(Precision(words, unit, float(sigma), float(np.exp(low)), limit))
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

    adjustment: Adjustment = predict(scaled(network, factors))
    return figures(adjustment, criterion).value(criterion.kind)
