"""The uncertainty of a station, divided among the observations that it comes from.

``dx = Q A^T P w`` makes every adjusted unknown a linear function of the observations. Those of
one group alone give ``C_g = Q A_g^T P_g A_g Q``, and since ``Q N Q = Q`` the groups add up to the
covariance exactly: control, targets, levelling and traverse each with its own share. What is held
fixed adds nothing. Values that share a joint covariance stay together in one group, for they have
no shares of their own, unless it is known what part of it they have in common: that is a group of
its own, and the rest is that of each observation. Metres and radians of the work frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from tribrach._types import Array, Index
from tribrach.network.adjustment import Adjustment
from tribrach.network.network import JointCovariance, Network
from tribrach.network.reliability import solutions_affordable
from tribrach.observations.base import Observations
from tribrach.observations.declaration import Category, End

#: what surveyors call the groups, in the order of a budget; every kind says which is its own
CATEGORIES: tuple[str, ...] = tuple(Category)
#: share of the largest below which a principal part of a common error is rounding
_NOTHING = 1e-12


@dataclass(frozen=True)
class Contribution:
    """Share of one group in a covariance."""

    #: as in the network, names of several with a plus
    kind: str
    group: str
    own: bool  #: are the observations those of the station itself?
    category: Category  #: part of the budget that the share belongs to
    covariance: Array  #: (k, k), of the columns asked for


def contributions(adjustment: Adjustment, station: str) -> list[Contribution]:
    """Shares (6, 6) of every group in the a-priori covariance of a scanner station.

    Returns of translation E, N, U [m] and left rotation increments [rad], as in
    ``adjustment.covariance``, which is their sum.
    """
    influence = _influence(adjustment, adjustment.columns(station))
    out = _common(adjustment, influence)
    layout, network = adjustment.layout, adjustment.network
    owner = _owners(network)
    pose = layout.index("pose", station)
    own = _own(adjustment, pose, layout.count("point") + pose)
    own &= ~_merged(network)[adjustment.rows.table]
    labels: list[tuple[str, str]] = []
    for one in owner:
        members = [o for o, other in zip(network.observations, owner, strict=True) if other == one]
        kinds = " + ".join(dict.fromkeys(o.kind for o in members))
        labels.append((kinds, " + ".join(dict.fromkeys(o.group for o in members))))
    for label in dict.fromkeys(labels):
        tables = [t for t, other in enumerate(labels) if other == label]
        members = [network.observations[t] for t in tables]
        chosen = np.isin(adjustment.rows.table, tables)
        for rows, is_own in ((chosen & own, True), (chosen & ~own, False)):
            if rows.any():
                part = influence[rows]
                category = _category(members, is_own)
                out.append(Contribution(*label, is_own, category, part.T @ part))
    return out


def assumed_variances(adjustment: Adjustment) -> Array | None:
    """Part (P + S, 3) [m^2] of the variances of positions that stands on assumptions.

    Centring and refraction of a set-up, tilt, and common errors of observations. None where there
    are none, or too many to follow. Clouds keep their floors, and single sights their centring,
    which are not apart.
    """
    network, rows = adjustment.network, adjustment.rows
    assumed = [
        t
        for t, o in enumerate(network.observations)
        if o.facts.nuisance or Category.LEVELLING in (o.facts.category, o.facts.own_category)
    ]
    design = sp.csr_array(adjustment.design)
    rights = [design[np.isin(rows.table, assumed)]]
    for joint, place in zip(network.joint, adjustment.assembly.joint_places, strict=True):
        active = np.flatnonzero(place >= 0)
        if joint.common is None or not len(active):
            continue
        common = joint.part(active).common
        assert common is not None
        values, axes = np.linalg.eigh(common)
        kept = values > _NOTHING * values.max(initial=0.0)
        shift = np.zeros((adjustment.n_observations, int(kept.sum())))
        shift[place[active]] = axes[:, kept] * np.sqrt(values[kept])
        rights.append(sp.csr_array((design.T @ (adjustment.whitener @ shift)).T))
    right = sp.csr_array(sp.vstack(rights))
    if not 0 < right.shape[0] <= solutions_affordable(adjustment):
        return None
    count = len(adjustment.state.positions)
    place = adjustment.reduced[adjustment.layout.position_columns(np.arange(count))]
    out = np.zeros((count, 3))
    for part in np.array_split(np.arange(right.shape[0]), max(1, right.shape[0] // 500)):
        moved = adjustment.cofactor.solve(right[part].toarray().T)
        # a last row of zeros stands for the components that are fixed
        out += np.square(np.vstack([moved, np.zeros((1, len(part)))])[place]).sum(axis=2)
    return out


def _common(adjustment: Adjustment, influence: Array) -> list[Contribution]:
    """Shares of common errors; ``influence`` (n, k) keeps the rest.

    With ``C = L L^T`` an error ``dl`` of the values does ``g^T dl``, where ``g = L^-T`` times the
    influence of the whitened ones; its two parts have the shares ``g^T C g``. The Cholesky factor
    of what observations have by themselves has a block for each.
    """
    network = adjustment.network
    out = []
    for joint, place in zip(network.joint, adjustment.assembly.joint_places, strict=True):
        active = np.flatnonzero(place >= 0)
        if joint.common is None or joint.category is None or not len(active):
            continue
        left, rows = joint.part(active), place[active]
        assert left.common is not None
        lower = np.linalg.cholesky(left.covariance)
        direct = solve_triangular(lower, influence[rows], lower=True, trans="T")
        influence[rows] = np.linalg.cholesky(left.covariance - left.common).T @ direct
        share = direct.T @ left.common @ direct
        kinds = dict.fromkeys(network.observations[t].kind for t in left.table)
        label = " + ".join(kinds)
        out.append(Contribution(label, joint.category, False, joint.category, share))
    return out


def _category(members: list[Observations], own: bool) -> Category:
    """Category of tables that have one share: GNSS takes control along, others do not mix."""
    categories = {o.facts.budget(own) for o in members}
    if categories == {Category.GNSS, Category.CONTROL}:
        return Category.GNSS
    return categories.pop() if len(categories) == 1 else Category.OTHER


def by_category(parts: list[Contribution], factor: float = 1.0) -> dict[str, Array]:
    """Sums (k, k) by category, in its order, times a factor (a posteriori variance)."""
    return {
        name: factor * np.sum([p.covariance for p in parts if p.category == name], axis=0)
        for name in CATEGORIES
        if any(p.category == name for p in parts)
    }


def _influence(adjustment: Adjustment, columns: Index) -> Array:
    """``P^(1/2) A Q`` (n, k): what a whitened value does to columns of the tangent vector."""
    place = adjustment.reduced[columns]
    unit = np.zeros((adjustment.n_unknowns, len(columns)))
    free = place >= 0
    unit[place[free], np.flatnonzero(free)] = 1.0
    influence: Array = adjustment.design @ adjustment.cofactor.solve(unit)
    return influence


def _owners(network: Network) -> list[int]:
    """Number of each table; of tables that share a joint covariance, that of the first."""
    owner = list(range(len(network.observations)))
    for joint in _inseparable(network):
        tables = {owner[t] for t in np.unique(joint.table)}
        owner = [min(tables) if o in tables else o for o in owner]
    return owner


def _merged(network: Network) -> NDArray[np.bool_]:
    """True (tables,) for tables with a joint covariance: their values are not parted by station."""
    out = np.zeros(len(network.observations), dtype=bool)
    for joint in _inseparable(network):
        out[np.unique(joint.table)] = True
    return out


def _inseparable(network: Network) -> list[JointCovariance]:
    """Joint covariances of which no part is known to be common."""
    return [joint for joint in network.joint if joint.common is None]


def _own(adjustment: Adjustment, pose: int, position: int) -> NDArray[np.bool_]:
    """True (n,) for rows that were observed from a station, given as pose and as position."""
    parts = [np.zeros(0, dtype=bool)]
    for o, items in zip(adjustment.network.observations, adjustment.assembly.active, strict=True):
        place = o.end_field(End.FROM) or o.end_field(End.AT)
        at = np.zeros(len(o), dtype=bool)
        if place is not None and place.family == "pose":
            at = np.asarray(getattr(o, place.name)) == pose
        elif place is not None and place.family == "position" and place.end is End.FROM:
            at = np.asarray(getattr(o, place.name)) == position
        parts.append(np.repeat(at[items], o.rows))
    return np.concatenate(parts)
