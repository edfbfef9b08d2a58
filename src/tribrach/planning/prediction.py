"""Predicts covariance and reliability of a network before it is measured.

Neither depends on measured values, only on where points and stations are and on the stochastic
model. :func:`predict` therefore gives the adjustment that a network will have, and :func:`figures`
the four criteria by which designs are compared (method section 3.7; Grafarend & Sansò 1985 on the
orders of design): the largest standard deviation at named positions, the smallest redundancy, the
largest effect of an undetected error, the largest correlation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import scipy.sparse as sp

from tribrach._types import Array, Index
from tribrach.answers import Number, Result
from tribrach.errors import InputError
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.network import Datum, Network
from tribrach.network.reliability import WeightedResiduals, weigh
from tribrach.network.significance import noncentrality
from tribrach.observations.unknowns import Layout

#: by which figure designs are compared, see CRITERIA
CriterionKind = Literal["sigma", "redundancy", "undetected", "correlation"]

#: displacement by an error of one sigma below which a position counts as untouched [m]
REACHED = 1e-9
#: criteria in words
CRITERIA: dict[CriterionKind, str] = {
    "sigma": "largest standard deviation at the named points",
    "redundancy": "smallest redundancy",
    "undetected": "largest effect of an undetected error on the named points",
    "correlation": "largest correlation of the parameters",
}


@dataclass(frozen=True)
class Criterion:
    """What a design is judged by."""

    kind: CriterionKind = "sigma"  #: see :data:`CRITERIA`
    names: tuple[str, ...] = ()  #: points, stations or lever arms that count, all points if empty
    #: scalars whose correlations with each other and with the stations count, all scalars if empty
    parameters: tuple[str, ...] = ()
    #: stations whose correlations count, all if empty (a candidate's own pose counts once it is
    #: part of the plan)
    stations: tuple[str, ...] = ()
    #: of the test that an undetected error slips through
    alpha0: float = 0.001
    power: float = 0.8

    @property
    def delta0(self) -> float:
        """Non-centrality of an error that is found with the power."""
        return noncentrality(self.alpha0, self.power)


@dataclass(frozen=True)
class Extreme(Result):
    """The worst figure of a kind, and where."""

    value: Number
    at: str  #: in words


@dataclass(frozen=True)
class Figures(Result):
    """What a design is predicted to give, a priori [m, 1]."""

    #: largest in any direction of each position that counts [m], in the network's datum
    sigma: dict[str, Number]
    redundancy: Extreme  #: the smallest of the observed values
    #: largest displacement of a position that counts by an error that stays undetected [m]; null
    #: where an uncontrolled value moves one
    undetected: Extreme
    correlation: Extreme  #: the largest of the parameters, null without any

    @property
    def worst(self) -> Extreme:
        """The largest sigma."""
        at = max(self.sigma, key=self.sigma.__getitem__, default="")
        return Extreme(self.sigma.get(at, 0.0), at)

    def of(self, kind: CriterionKind) -> Extreme:
        """The criterion itself, and where."""
        found: Extreme = self.worst if kind == "sigma" else getattr(self, kind)
        return found

    def value(self, kind: CriterionKind) -> float:
        """The criterion itself."""
        return self.of(kind).value


def with_predicted_values(network: Network) -> Network:
    """Give every observation the value that follows from the start values."""
    state = network.start
    observations = tuple(replace(o, values=o.predict(state)) for o in network.observations)
    constraints = tuple(
        replace(c, observations=replace(c.observations, values=c.observations.predict(state)))
        for c in network.constraints
    )
    return replace(network, observations=observations, constraints=constraints)


def with_parameters(network: Network) -> Network:
    """Take every scalar without a start value as zero, which is near enough for a prediction."""
    scalars = np.nan_to_num(network.start.scalars, nan=0.0)
    return network.with_start(replace(network.start, scalars=scalars))


def predict(network: Network) -> Adjustment:
    """Compute the adjustment that a network will have, at its start values and without residuals.

    Scalars without a start value are taken as zero. With inner constraints over all points, the
    datum is that of the points it has now.
    """
    network = with_parameters(network)
    missing = network.start.missing()
    if missing:
        family, name = missing[0]
        noun = {"pose": "station"}.get(family, family)
        raise InputError(
            f"{noun} {name} has no approximate place",
            cure="a plan needs approximate coordinates of everything in it",
        )
    return adjust(with_predicted_values(network))


def position_columns(layout: Layout, names: Sequence[str]) -> tuple[tuple[str, ...], Index]:
    """Find the columns of positions in the full tangent vector."""
    chosen = tuple(names) or layout.names["point"]
    arms = np.zeros(len(chosen), dtype=bool)
    for k, name in enumerate(chosen):
        if not layout.has("point", name) and not layout.has("pose", name):
            arms[k] = layout.has("vector", name)
            if not arms[k]:
                raise InputError(
                    f"{name} is no point or station of the network",
                    cure="name points that are observed or planned",
                )
    columns = np.empty((len(chosen), 3), dtype=np.int64)
    places = [layout.position_index(n) for n, arm in zip(chosen, arms, strict=True) if not arm]
    vectors = [layout.index("vector", n) for n, arm in zip(chosen, arms, strict=True) if arm]
    columns[~arms] = layout.position_columns(np.array(places, dtype=np.int64))
    columns[arms] = layout.columns("vector", np.array(vectors, dtype=np.int64))
    return chosen, columns


def parameter_columns(layout: Layout, criterion: Criterion) -> tuple[Index, Index]:
    """Find the columns of the scalars and stations whose correlations count."""
    chosen = criterion.parameters or layout.names["scalar"]
    for name in chosen:
        if not layout.has("scalar", name):
            raise InputError(
                f"{name} is no parameter of the network",
                cure=f"its parameters are {', '.join(layout.names['scalar']) or 'none'}",
            )
    index = np.array([layout.index("scalar", name) for name in chosen], dtype=np.int64)
    names = [n for n in criterion.stations if layout.has("pose", n)] or layout.names["pose"]
    places = np.array([layout.index("pose", name) for name in names], dtype=np.int64)
    poses = layout.columns("pose", places).ravel()
    return layout.columns("scalar", index).ravel(), poses


def largest_sigma(covariances: Array) -> Array:
    """Largest sigma in any direction, by the closed form for 3x3 matrices (Smith 1961)."""
    c = covariances
    mean = (c[..., 0, 0] + c[..., 1, 1] + c[..., 2, 2]) / 3
    off = c[..., 0, 1] ** 2 + c[..., 0, 2] ** 2 + c[..., 1, 2] ** 2
    a, b, d = c[..., 0, 0] - mean, c[..., 1, 1] - mean, c[..., 2, 2] - mean
    p = np.sqrt((a**2 + b**2 + d**2 + 2 * off) / 6)
    determinant = (
        a * (b * d - c[..., 1, 2] ** 2)
        - c[..., 0, 1] * (c[..., 0, 1] * d - c[..., 1, 2] * c[..., 0, 2])
        + c[..., 0, 2] * (c[..., 0, 1] * c[..., 1, 2] - b * c[..., 0, 2])
    )
    cubed = np.where(p > 0, p, 1.0) ** 3
    angle = np.arccos(np.clip(np.where(p > 0, determinant / 2 / cubed, 1.0), -1, 1)) / 3
    return np.asarray(np.sqrt(np.maximum(mean + 2 * p * np.cos(angle), 0.0)))


def figures(adjustment: Adjustment, criterion: Criterion) -> Figures:
    """Compute all criteria of a predicted network, exactly."""
    names, columns = position_columns(adjustment.layout, criterion.names)
    covariances = adjustment.cofactor.blocks(adjustment.reduced[columns])
    system = weigh(adjustment)
    _, share = redundancy_rows(system)
    weakest = int(np.argmin(share)) if len(share) else -1
    undetected, row, where = _undetected(adjustment, columns, criterion.delta0)
    least = float(share[weakest]) if weakest >= 0 else float("nan")
    reached = f"{_row_words(adjustment, row)} at {names[where]}" if row >= 0 else ""
    return Figures(
        sigma=dict(zip(names, largest_sigma(covariances).tolist(), strict=True)),
        redundancy=Extreme(least, _row_words(adjustment, weakest)),
        undetected=Extreme(undetected, reached),
        correlation=Extreme(*_correlation(adjustment, criterion)),
    )


def criterion_value(adjustment: Adjustment, criterion: Criterion) -> float:
    """Compute the criterion alone, as :func:`figures` gives it."""
    _, columns = position_columns(adjustment.layout, criterion.names)
    if criterion.kind == "sigma":
        covariances = adjustment.cofactor.blocks(adjustment.reduced[columns])
        return float(largest_sigma(covariances).max(initial=0.0))
    if criterion.kind == "redundancy":
        return float(redundancy_rows(weigh(adjustment))[1].min(initial=np.inf))
    if criterion.kind == "undetected":
        return _undetected(adjustment, columns, criterion.delta0)[0]
    return _correlation(adjustment, criterion)[0]


def redundancy_rows(system: WeightedResiduals) -> tuple[sp.csr_array, Array]:
    """Compute what is left of each value when the unknowns have taken their part.

    What is left is the redundancy number of an uncorrelated value. Values of one observation that
    are correlated have none each; theirs are those of the whitened values, whose sum is the
    redundancy of the observation.

    The rows' form with Q is what the unknowns take of each value; the second answer is what is left
    of one.
    """
    adjustment = system.adjustment
    correlated = np.zeros(len(system.s), dtype=bool)
    rows = adjustment.rows
    for number, o in enumerate(adjustment.network.observations):
        if o.rows > 1:
            away = np.abs(o.covariance * (1 - np.eye(o.rows))).max(axis=(1, 2), initial=0.0)
            inside = rows.table == number
            correlated[inside] = away[rows.item[inside]] > 0
    for joint in adjustment.network.joint:
        for table in np.unique(joint.table):
            correlated |= (rows.table == table) & np.isin(rows.item, joint.item)
    scale = sp.diags_array(np.where(correlated, 0.0, 1 / np.sqrt(system.weight)))
    whitened = sp.diags_array(correlated.astype(float)) @ adjustment.design
    out = sp.csr_array(scale @ system.rows + whitened)
    return out, 1 - adjustment.cofactor.row_forms(out)


def _undetected(adjustment: Adjustment, columns: Index, delta0: float) -> tuple[float, int, int]:
    """Largest displacement [m] of named positions by an undetected error, its row, its position."""
    system = weigh(adjustment)
    controlled = system.controlled[:, None]
    root = delta0 / np.sqrt(np.where(system.controlled, system.s, np.nan))
    place = adjustment.reduced[columns]
    best, row, where = 0.0, -1, 0
    for part in np.array_split(np.arange(len(place)), max(1, len(place) // 100)):
        index = place[part].ravel()
        unit = np.zeros((adjustment.n_unknowns, len(index)))
        free = np.flatnonzero(index >= 0)
        unit[index[free], free] = 1.0
        effect = system.rows @ adjustment.cofactor.solve(unit)
        length = np.sqrt((effect.reshape(len(effect), -1, 3) ** 2).sum(axis=2))
        # an error of one sigma that moves a position by less than a nanometre does not reach it
        reached = length > REACHED * np.sqrt(system.weight)[:, None]
        unlimited = np.where(reached, np.inf, 0.0)
        shift = np.where(controlled, length * np.nan_to_num(root)[:, None], unlimited)
        if shift.size and shift.max() > best:
            row, near = (int(i) for i in np.unravel_index(np.argmax(shift), shift.shape))
            best, where = float(shift[row, near]), int(part[near])
    return best, row, where


def _correlation(adjustment: Adjustment, criterion: Criterion) -> tuple[float, str]:
    """Largest correlation of the parameters with each other and with stations, and which pair."""
    own, poses = parameter_columns(adjustment.layout, criterion)
    place = adjustment.reduced
    own, poses = own[place[own] >= 0], poses[place[poses] >= 0]
    if len(own) == 0 or len(own) + len(poses) < 2:
        return float("nan"), ""
    columns = np.concatenate([own, poses])
    covariance = adjustment.covariance_columns(own, columns)
    sigma = np.sqrt(np.concatenate([np.diag(covariance), _variances(adjustment, poses)]))
    rho = np.abs(covariance / sigma[: len(own), None] / sigma)
    rho[np.arange(len(own)), np.arange(len(own))] = 0.0
    i, j = (int(k) for k in np.unravel_index(np.argmax(rho), rho.shape))
    layout = adjustment.layout
    words = f"{layout.label(int(columns[i]))} and {layout.label(int(columns[j]))}"
    return float(rho[i, j]), words


def _variances(adjustment: Adjustment, columns: Index) -> Array:
    """Variances (k,) of columns of the full tangent vector."""
    index = adjustment.reduced[columns]
    return adjustment.cofactor.entries(index, index)


def _row_words(adjustment: Adjustment, row: int) -> str:
    """An observed value in words: kind, component, from and to."""
    if row < 0:
        return ""
    rows = adjustment.rows
    o = adjustment.network.observations[rows.table[row]]
    start, end = o.ends(adjustment.layout)[int(rows.item[row])]
    component = o.components[int(rows.row[row])]
    kind = f"{component} of {o.facts.title}" if component else o.facts.title
    return f"{kind} {start} -> {end}" if end else f"{kind} {start}"


def fixed_datum(network: Network, without: Sequence[str] = ()) -> Network:
    """Put inner constraints over named points, so that designs stay comparable.

    Inner constraints over all points mean others as soon as a point comes or goes; here they keep
    to the points of the network. Fewer than three points left: the stations carry the datum. Other
    datums stay as they are.
    """
    datum = network.datum
    if datum.kind != "free" or (datum.components is not None and not without):
        return network
    names = datum.names or network.start.layout.names["point"]
    kept = tuple(name for name in names if name not in without)
    if len(kept) < 3:
        kept = network.start.layout.names["pose"]
    return replace(network, datum=Datum("free", kept))
