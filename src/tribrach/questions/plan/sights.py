"""The sights of a plan, one for each pair of places, with what they control."""

from __future__ import annotations

from dataclasses import dataclass
from math import isnan

import numpy as np

from tribrach.answers import Result
from tribrach.network.adjustment import Adjustment
from tribrach.network.observation_rows import ObservationRow, observation_rows
from tribrach.network.quality import assess
from tribrach.observations.registry import kind_named


@dataclass(frozen=True)
class PlannedSight(Result, keys={"start": "from", "end": "to"}):
    """Everything observed from one place to another."""

    start: str
    end: str
    kinds: str  #: what is observed, in words
    #: between the positions [m, rad]
    length: float
    azimuth: float
    zenith: float
    values: int  #: how many are observed
    redundancy: float | None  #: the smallest of them, null where nothing controls one
    undetected: float | None  #: the largest displacement [m] by an undetected error in one of them


def sights_of(adjustment: Adjustment) -> tuple[PlannedSight, ...]:
    """Sights between positions of a predicted network, in the order of its observations."""
    layout, positions = adjustment.layout, adjustment.state.positions
    known = set(layout.names["point"]) | set(layout.names["pose"])
    groups: dict[tuple[str, str], list[ObservationRow]] = {}
    for row in observation_rows(adjustment, assess(adjustment)):
        if row.state == "active" and row.start in known and row.end in known:
            groups.setdefault((row.start, row.end), []).append(row)
    out = []
    for (start, end), rows in groups.items():
        e, n, u = positions[layout.position_index(end)] - positions[layout.position_index(start)]
        level = float(np.hypot(e, n))
        redundancies = [row.redundancy for row in rows if not isnan(row.redundancy)]
        effects = [row.external for row in rows if not isnan(row.external)]
        out.append(
            PlannedSight(
                start,
                end,
                ", ".join(dict.fromkeys(kind_named(row.kind).facts.title for row in rows)),
                float(np.hypot(level, u)),
                float(np.arctan2(e, n) % (2 * np.pi)),
                float(np.arctan2(level, u)),
                len(rows),
                min(redundancies) if len(redundancies) == len(rows) else None,
                max(effects) if len(effects) == len(rows) else None,
            )
        )
    return tuple(out)
