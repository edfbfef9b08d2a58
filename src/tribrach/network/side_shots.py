"""Side shots: points computed from an adjusted network that they take no part in.

A side shot is measured once and checked by nothing. Its observations are kept out of the network
and solved behind it, each with the covariance of the marks that it stands on, so that coordinates
and sigmas are those that the point would have in the network, while nothing else changes (method
section 3.4).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from tribrach._types import Array
from tribrach.errors import AdjustmentError
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.facts import Fact
from tribrach.network.survey import Survey, observed_part
from tribrach.observations.control import Coordinate

#: added to variances of marks, whose covariance is singular where parts of them are held [m^2]
_HELD = 1e-16


@dataclass(frozen=True)
class SideShots(Fact):
    """Side shots of a survey."""

    survey: Survey  #: their observations. Each shot is a point of its own, whatever its name.
    #: name of the point of each shot, by the key that it has in ``survey``
    names: Mapping[str, str]
    sources: Mapping[str, str]  #: ``file:line`` of each shot, by key
    #: why a shot cannot be computed, by ``file:line``
    left_out: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class ComputedShot:
    """A point that a side shot gives."""

    name: str  #: of the point; several shots may be to one
    source: str  #: ``file:line``
    xyz: Array  #: (3,), in the work frame [m]
    covariance: Array  #: (3, 3), A priori [m^2], with that of the marks


def compute(adjustment: Adjustment, shots: SideShots) -> tuple[list[ComputedShot], dict[str, str]]:
    """Solve side shots behind an adjusted network."""
    left_out = dict(shots.left_out)
    known = set(adjustment.layout.names["point"])
    small = shots.survey.copy()
    marks: dict[str, None] = {}
    parts = []
    lost: set[str] = set()
    for table in small.tables():
        ends = {name: table.columns.get(name) for name in ("start", "end", "foresight")}
        keep = np.ones(table.n, dtype=bool)
        for column in ends.values():
            for i, name in enumerate(() if column is None else column):
                if name not in known and name not in shots.names:
                    keep[i] = False
                    lost |= {str(c[i]) for c in ends.values() if c is not None} & set(shots.names)
        parts.append((table, ends, keep))
    kept = []
    for table, ends, keep in parts:
        for i in range(table.n):
            keep[i] &= not any(c is not None and c[i] in lost for c in ends.values())
        kept.append([table.part(keep)] if keep.any() else [])
    small.replace_tables(kept)
    for key in lost:
        left_out[shots.sources[key]] = "a mark that it needs is not in the network"
    for table in small.tables():
        marks |= dict.fromkeys(n for n in table.names("position") if n not in shots.names)
    if not small.tables():
        return [], left_out
    _stand(small, adjustment, list(marks))
    try:
        solved = adjust(observed_part(small).network())
    except AdjustmentError as error:
        return [], left_out | dict.fromkeys(shots.sources.values(), error.headline)
    out = []
    for key, name in shots.names.items():
        if key in lost:
            continue
        index = solved.layout.index("point", key)
        columns = solved.columns(key)
        covariance = solved.covariance_columns(columns, columns)
        out.append(ComputedShot(name, shots.sources[key], solved.state.points[index], covariance))
    return out, left_out


def _stand(small: Survey, adjustment: Adjustment, marks: list[str]) -> None:
    """Give the marks their adjusted places and their joint covariance."""
    columns = {name: adjustment.columns(name) for name in marks}
    free = {name: adjustment.reduced[columns[name]] >= 0 for name in marks}
    layout = adjustment.layout
    for name in marks:
        xyz = adjustment.state.points[layout.index("point", name)]
        small.point(name, xyz, free=free[name], role="control")
    loose = [(name, axis) for name in marks for axis in np.flatnonzero(free[name])]
    if not loose:
        return
    chosen = np.array([columns[name][axis] for name, axis in loose])
    joint = adjustment.covariance_columns(chosen, chosen)
    joint = (joint + joint.T) / 2 + _HELD * np.eye(len(chosen))
    table = small.add(
        Coordinate,
        values=[small.points[name].xyz[axis] for name, axis in loose],
        sigma=np.sqrt(np.diag(joint)),
        position=[name for name, _ in loose],
        axis=np.array([axis for _, axis in loose]),
        group="control",
    )
    small.correlate(np.full(len(loose), table), np.arange(len(loose)), np.zeros(len(loose)), joint)
