"""What every observation kind is: measured values, their covariance, and a linearised model.

A kind holds *all* its observations as arrays and answers for all of them at once:

* ``predict(state)``  computed values ``h(x)``, shape (n, rows);
* ``jacobian(state)`` derivatives as blocks over columns of the full tangent vector;
* ``misclosure(state)`` ``w = l - h(x)``, angles wrapped to (-pi, pi].

Convention ``l + v = h(x)`` (method section 2): the residual ``v`` is what the observation must
be given to agree with the adjusted unknowns.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, fields
from enum import IntEnum
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tribrach._types import Array, Index
from tribrach.observations.unknowns import Layout, State

__all__ = [
    "Block",
    "Observations",
    "Use",
    "covariance_from_sigma",
    "norm",
    "per_item",
    "refers",
    "shared",
    "wrap",
]


class Use(IntEnum):
    """What an observation does in the adjustment."""

    ACTIVE = 0  #: takes part
    CHECK = 1  #: held out; its misclosure is reported against its predicted sigma
    OFF = 2  #: switched off, with a reason; stays in every report


@dataclass(frozen=True)
class Block:
    """Derivatives of all n observations by k columns each.

    columns (n, k) into the full tangent vector, -1 where an observation has no such unknown;
    values (n, rows, k).
    """

    columns: Index
    values: Array


def wrap(angle: Array) -> Array:
    """Angles [rad] brought to (-pi, pi]."""
    wrapped: Array = -np.remainder(np.pi - angle, 2 * np.pi) + np.pi
    return wrapped


def norm(vector: Array) -> Array:
    """Lengths (...,) of vectors (..., 3)."""
    length: Array = np.sqrt(np.einsum("...i,...i->...", vector, vector))
    return length


def covariance_from_sigma(sigma: ArrayLike) -> Array:
    """Diagonal covariances (n, rows, rows) of standard deviations (n, rows) or (n,)."""
    sigma = np.asarray(sigma, dtype=float)
    sigma = sigma[:, None] if sigma.ndim == 1 else sigma
    return sigma[:, :, None] ** 2 * np.eye(sigma.shape[1])


def refers(family: str, *, optional: bool = False) -> Any:
    """A dataclass field of indices (n,) into a family of unknowns (or "position").

    In a survey the same field holds names. An optional field may be left out, or hold -1 (no
    name) for observations that have no such unknown.
    """
    metadata = {"refers": family, "optional": optional}
    if optional:
        return field(default_factory=lambda: np.empty(0, dtype=np.int64), metadata=metadata)
    return field(metadata=metadata)


def per_item(default: float) -> Any:
    """A dataclass field of values (n,) with a default; a single number is broadcast."""
    return field(default_factory=lambda: np.empty(0), metadata={"per_item": default})


def shared() -> Any:
    """A hashable dataclass field that is one for all observations of a table; None if not given.

    In a survey, tables that differ in it are kept apart even within one group.
    """
    return field(default=None, metadata={"shared": True})


@dataclass(kw_only=True)
class Observations(ABC):
    """All observations of one kind and one group.

    Parameters
    ----------
    values : measured values (n, rows) in metres and radians.
    covariance : (n, rows, rows), metres and radians squared, positive definite.
    source : where each came from, such as ``net.gkf:17``; (n,) strings, optional.
    use : :class:`Use` of each, (n,); all active if not given.
    reason : why an observation is off, (n,) strings.
    group : name of its variance component; the kind's name if not given.
    """

    values: Array
    covariance: Array
    source: NDArray[Any] = field(default_factory=lambda: np.array([], dtype=object))
    use: NDArray[np.int8] = field(default_factory=lambda: np.array([], dtype=np.int8))
    reason: NDArray[Any] = field(default_factory=lambda: np.array([], dtype=object))
    group: str = ""

    #: name of the kind in files, JSON and reports
    kind: ClassVar[str]
    #: unit of each row: "m" or "rad" (or "1")
    units: ClassVar[tuple[str, ...]]
    #: rows whose difference is wrapped to (-pi, pi]
    angular: ClassVar[tuple[int, ...]] = ()
    #: names of the rows, when there is more than one
    components: ClassVar[tuple[str, ...]] = ("",)

    def __post_init__(self) -> None:
        rows = len(self.units)
        self.values = np.asarray(self.values, dtype=float).reshape(-1, rows)
        n = len(self.values)
        self.covariance = np.asarray(self.covariance, dtype=float).reshape(n, rows, rows)
        if len(self.source) != n:
            self.source = np.full(n, "", dtype=object)
        self.use = np.asarray(self.use if len(self.use) == n else np.zeros(n), dtype=np.int8)
        if len(self.reason) != n:
            self.reason = np.full(n, "", dtype=object)
        self.group = self.group or self.kind
        for item in fields(self):
            if "refers" in item.metadata:
                index = np.atleast_1d(np.asarray(getattr(self, item.name), dtype=np.int64))
                if item.metadata["optional"] and len(index) == 0:
                    index = np.full(n, -1, dtype=np.int64)
                setattr(self, item.name, index)
            elif "per_item" in item.metadata:
                value = np.asarray(getattr(self, item.name), dtype=float)
                value = np.asarray(item.metadata["per_item"]) if value.size == 0 else value
                setattr(self, item.name, np.broadcast_to(value, (n,)).copy())

    def __len__(self) -> int:
        return len(self.values)

    @property
    def rows(self) -> int:
        """Values per observation."""
        return len(self.units)

    @property
    def sigma(self) -> Array:
        """Standard deviations (n, rows) a priori."""
        sigma: Array = np.sqrt(np.einsum("nii->ni", self.covariance))
        return sigma

    @abstractmethod
    def predict(self, state: State) -> Array:
        """Computed values (n, rows) at the state."""

    @abstractmethod
    def jacobian(self, state: State) -> list[Block]:
        """Derivatives of :meth:`predict` by the manifold increments of the state."""

    def misclosure(self, state: State) -> Array:
        """``l - h(x)``, (n, rows), angular rows wrapped."""
        difference = self.values - self.predict(state)
        for row in self.angular:
            difference[:, row] = wrap(difference[:, row])
        return difference

    @abstractmethod
    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """Names of what each observation goes from and to; "" where there is no such end."""
