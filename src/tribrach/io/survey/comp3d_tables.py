"""Observations gathered one by one, handed to a survey as one table per kind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.network.network import Network
from tribrach.network.observations.base import Observations, Use
from tribrach.network.survey import Survey

__all__ = ["Tables"]

Array = NDArray[np.float64]


@dataclass
class _Rows:
    values: list[Any] = field(default_factory=list)
    covariance: list[Any] = field(default_factory=list)
    source: list[str] = field(default_factory=list)
    reason: list[str] = field(default_factory=list)
    columns: dict[str, list[Any]] = field(default_factory=dict)


@dataclass
class Tables:
    """Rows by kind and group, in the order they came."""

    rows: dict[tuple[type[Observations], str, bool], _Rows] = field(default_factory=dict)

    def put(
        self,
        kind: type[Observations],
        value: float | tuple[float, ...] | Array,
        sigma: float | tuple[float, ...] | Array,
        source: str,
        columns: Mapping[str, object],
        *,
        off: str = "",
        group: str = "",
        hard: bool = False,
    ) -> None:
        """Add one observation: sigma or covariance matrix, the kind's fields, why it is off."""
        rows = self.rows.setdefault((kind, group, hard), _Rows())
        size = len(kind.units)
        spread = np.asarray(sigma, dtype=float)
        if spread.ndim < 2:
            spread = np.diag(np.broadcast_to(spread, size) ** 2)
        rows.values.append(np.broadcast_to(np.asarray(value, dtype=float), size))
        rows.covariance.append(spread)
        rows.source.append(source)
        rows.reason.append(off)
        for name, entry in columns.items():
            rows.columns.setdefault(name, []).append(entry)

    def computed(self, network: Network) -> dict[tuple[str, str], Array]:
        """Values (n, rows) of each kind and group as the network's start values give them."""
        return {(o.kind, o.group): o.predict(network.start) for o in network.observations}

    def add_to(self, survey: Survey, computed: dict[tuple[str, str], Array] | None = None) -> None:
        """Hand all rows over, with the computed values instead of the measured ones if given."""
        for (kind, group, hard), rows in self.rows.items():
            values = np.array(rows.values)
            if computed is not None and not hard:
                values = computed[kind.kind, group or kind.kind]
            survey.add(
                kind,
                values=values,
                covariance=None if hard else np.array(rows.covariance),
                source=rows.source,
                group=group,
                hard=hard,
                use=[Use.OFF if reason else Use.ACTIVE for reason in rows.reason],
                reason=rows.reason,
                **{name: np.array(entries) for name, entries in rows.columns.items()},
            )
