"""Observations + unknowns + datum: the least-squares network before it is adjusted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tribrach.geodesy.site import FlatSite, Site
from tribrach.network.observations.base import Array, Observations
from tribrach.network.unknowns import State

__all__ = ["Constraint", "Datum", "JointCovariance", "Network"]


@dataclass(frozen=True)
class Datum:
    """What fixes the frame.

    kind : ``"control"``: the given control (fixed or weighted) and nothing else;
        ``"free"``: inner constraints, the corrections of the datum unknowns have minimum norm and
        coordinates given as observations are switched off.
    names : points and stations that carry the inner constraints; all of them if empty.
    components : optional mask (n_columns,) of the full tangent vector that carries the inner
        constraints, for networks whose points are datum points in some coordinates only.
    """

    kind: Literal["control", "free"] = "control"
    names: tuple[str, ...] = ()
    components: NDArray[np.bool_] | None = None


@dataclass(frozen=True)
class JointCovariance:
    """One covariance matrix over values of several observations, across kinds.

    table (k,) index into ``Network.observations``, item (k,), row (k,) of each value;
    covariance (k, k) in metres and radians, in that order. It replaces the values' own
    covariances. If any of the values is switched off, its rows and columns are left out.
    """

    table: NDArray[np.int64]
    item: NDArray[np.int64]
    row: NDArray[np.int64]
    covariance: Array


@dataclass(frozen=True)
class Constraint:
    """Observations that must hold exactly (method section 2.13): their covariance is not used."""

    observations: Observations
    label: str = ""


@dataclass(frozen=True)
class Network:
    """Everything the adjustment needs.

    start : values of all unknowns, NaN where they are to be found from the observations.
    free : mask (n_columns,) of the full tangent vector; False for fixed or unused components.
    observations : the kinds, each with all its observations.
    joint : covariances across observations.
    constraints : hard constraints.
    sigma0 : a-priori standard deviation of unit weight (covariances already include it).
    info : title, coordinate system and other facts for the report.
    """

    start: State
    free: NDArray[np.bool_]
    observations: tuple[Observations, ...]
    joint: tuple[JointCovariance, ...] = ()
    constraints: tuple[Constraint, ...] = ()
    datum: Datum = field(default_factory=Datum)
    site: Site = field(default_factory=FlatSite)
    sigma0: float = 1.0
    warnings: tuple[str, ...] = ()
    info: dict[str, Any] = field(default_factory=dict)

    def with_datum(self, datum: Datum) -> Network:
        """The same network in another datum."""
        return replace(self, datum=datum)

    def with_start(self, state: State) -> Network:
        """The same network with other start values."""
        return replace(self, start=state)

    def count(self) -> int:
        """Number of observed values, whatever their use."""
        return sum(o.values.size for o in self.observations)

    @staticmethod
    def describe(observations: Observations, item: int, state: State) -> str:
        """An observation in words: ``direction S1 -> T3 (net.gkf:17)``."""
        start, end = observations.ends(state.layout)[item]
        source = observations.source[item]
        arrow = f" {start} -> {end}" if end else f" {start}"
        return f"{observations.kind}{arrow}" + (f" ({source})" if source else "")


def positions_named(names: Sequence[str], state: State) -> NDArray[np.int64]:
    """Position indices of names."""
    return np.array([state.layout.position_index(name) for name in names], dtype=np.int64)
