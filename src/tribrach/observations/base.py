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
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from enum import IntEnum
from functools import cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.instruments.precision import Precision
from tribrach.observations.declaration import (
    End,
    Family,
    IndexField,
    KindFacts,
    ObservedAxes,
    SightLine,
    per_item,
    refers,
    shared,
)
from tribrach.observations.ties import TieCollector
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
    """Derivatives (n, rows, k) by full tangent ``columns`` (n, k), -1 where there is no unknown."""

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


@cache
def _references(kind: type[Observations]) -> tuple[IndexField, ...]:
    """Index fields of a kind with their names."""
    items = fields(kind)
    return tuple(
        replace(item.metadata["refers"], name=item.name)
        for item in items
        if "refers" in item.metadata
    )


@dataclass(kw_only=True)
class Observations(ABC):
    """All observations of one kind and one group.

    A kind is a subclass in a file of this package that sets ``kind``, ``units`` and ``facts`` and
    gives :meth:`predict` and :meth:`jacobian`. Fields made with
    :func:`~tribrach.observations.declaration.refers` name the unknowns.
    """

    values: Array  #: (n, rows): measured values in metres and radians
    #: (n, rows, rows): of the values, positive definite; metres and radians squared
    covariance: Array
    #: (n,): where each came from, such as ``net.gkf:17``
    source: NDArray[Any] = field(default_factory=lambda: np.array([], dtype=object))
    #: (n,): :class:`Use` of each; all active if not given
    use: NDArray[np.int8] = field(default_factory=lambda: np.array([], dtype=np.int8))
    #: (n,): why an observation is off
    reason: NDArray[Any] = field(default_factory=lambda: np.array([], dtype=object))
    group: str = ""  #: name of its variance component; the kind's name if not given

    kind: ClassVar[str]  #: name of the kind in files, JSON and reports
    units: ClassVar[tuple[str, ...]]  #: unit of each row: "m" or "rad" (or "1")
    angular: ClassVar[tuple[int, ...]] = ()  #: rows whose difference is wrapped to (-pi, pi]
    components: ClassVar[tuple[str, ...]] = ("",)  #: names of the rows, when there is more than one
    facts: ClassVar[KindFacts]  #: everything else that others ask of the kind

    def __init_subclass__(cls, **further: Any) -> None:
        super().__init_subclass__(**further)
        if "kind" in vars(cls) and "facts" not in vars(cls):
            raise TypeError(f"the kind {cls.kind} declares no facts")

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
        for reference in self.references():
            index = np.atleast_1d(np.asarray(getattr(self, reference.name), dtype=np.int64))
            if reference.optional and len(index) == 0:
                index = np.full(n, -1, dtype=np.int64)
            elif not reference.optional and (index < 0).any():
                first = int(np.argmax(index < 0))
                raise InputError(
                    f"a {self.facts.title} has no {reference.name}",
                    record=str(self.source[first]) or f"observation {first + 1}",
                    cure=f"give the {reference.family} it refers to",
                )
            setattr(self, reference.name, index)
        for item in fields(self):
            if "per_item" in item.metadata:
                value = np.asarray(getattr(self, item.name), dtype=float)
                value = np.asarray(item.metadata["per_item"]) if value.size == 0 else value
                setattr(self, item.name, np.broadcast_to(value, (n,)).copy())
            elif "shaped" in item.metadata:
                number, tail = item.metadata["shaped"]
                value = np.asarray(getattr(self, item.name), dtype=number)
                setattr(self, item.name, value.reshape(-1, *tail))

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

    @staticmethod
    def if_any(state: State, family: Family, index: Index, values: Array) -> list[Block]:
        """The derivatives by optional unknowns, where an observation has one of them."""
        return [Block(state.layout.columns(family, index), values)] if (index >= 0).any() else []

    @classmethod
    def references(cls) -> tuple[IndexField, ...]:
        """Fields of indices of unknowns, in the order of the class."""
        return _references(cls)

    @classmethod
    def end_field(cls, *ends: End) -> IndexField | None:
        """The first field that names one of these ends; None if there is none."""
        return next((r for r in cls.references() if r.end in ends), None)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """Names of what each observation goes from and to; "" where there is no such end."""
        start, end = self.end_names(layout)
        return list(zip(start.tolist(), end.tolist(), strict=True))

    def end_names(self, layout: Layout) -> tuple[NDArray[np.object_], NDArray[np.object_]]:
        """Names (n,) of what the observations go from, and to; "" where there is no such end."""
        return self._names(layout, End.FROM, End.AT), self._names(layout, End.TO)

    def _names(self, layout: Layout, *ends: End) -> NDArray[np.object_]:
        """Names (n,) of one of these ends, several joined by "to"."""
        out: list[NDArray[np.object_]] = []
        for reference in self.references():
            if reference.end in ends:
                index = getattr(self, reference.name)
                out.append(layout.name_array(reference.family)[index])
        if len(out) == 1:
            return out[0]
        joined = np.full(len(self), "", dtype=object)
        if out:
            joined[:] = [" to ".join(names) for names in zip(*out, strict=True)]
        return joined

    @classmethod
    def observed_axes(cls, columns: Mapping[str, Any]) -> ObservedAxes:
        """Axes that observations with these columns depend on, on a flat site."""
        return cls.facts.axes

    def coordinate_axes(self) -> Index | None:
        """Axes E, N, U (n, rows) of which the values are coordinates; None for other kinds."""
        return None

    def start_ties(self, rows: Index, ties: TieCollector) -> None:
        """Add what some of the observations (k,) say of where things are, as ``facts.start``."""
        return

    def from_places(self, rows: Index, state: State, given: State) -> State:
        """The state with what places tell some of the observations (k,) of their other unknowns.

        Asked when places are found, of kinds whose unknowns no tie gives: axes, telescopes. What
        ``given`` knows stays.
        """
        return state

    @classmethod
    def instrument_sigma(cls, precision: Precision, line: SightLine) -> Array | None:
        """Sigmas (n,) that an instrument gives along lines; None where it says nothing."""
        return None

    @classmethod
    def sigma_by_length(cls, precision: Precision) -> bool:
        """Does the instrument's sigma grow as the sight gets shorter, by errors of its ends?"""
        return False

    @classmethod
    def instrument_columns(cls, precision: Precision) -> dict[str, Any]:
        """Further columns of the kind that the instrument or the place give."""
        return {}
