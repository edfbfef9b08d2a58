"""Every observed value with its residual and tests, and where it was written (chapter 7)."""

from __future__ import annotations

from typing import Literal

import numpy as np

from tribrach._types import Array
from tribrach.network.adjustment import Adjustment
from tribrach.network.quality import Quality, check_covariances
from tribrach.observations.base import Observations, Use
from tribrach.report.content import Observation
from tribrach.report.numbers import number

__all__ = ["observations", "sights"]

_STATES: dict[int, Literal["active", "check", "off"]] = {
    Use.ACTIVE: "active",
    Use.CHECK: "check",
    Use.OFF: "off",
}
_FIGURES = ("redundancy", "w", "tau", "mdb", "external")


def observations(adjustment: Adjustment, quality: Quality) -> tuple[Observation, ...]:
    """All values in the order of the network, whatever their state."""
    out: list[Observation] = []
    for table, o in enumerate(adjustment.network.observations):
        out += _table(adjustment, quality, table, o, len(out))
    return tuple(out)


def _table(
    adjustment: Adjustment, quality: Quality, table: int, o: Observations, first: int
) -> list[Observation]:
    """Rows of one kind and group."""
    if len(o) == 0:
        return []
    figures = _figures(adjustment, quality, table, o)
    block, limit = _blocks(quality, table, o)
    residual = -o.misclosure(adjustment.state)
    checks = np.flatnonzero(o.use == Use.CHECK)
    spread = np.sqrt(np.einsum("nii->ni", check_covariances(adjustment, o, checks)))
    figures["w"][checks] = residual[checks] / spread
    ends, sigma = o.ends(adjustment.layout), o.sigma
    position = adjustment.layout.position_name
    suspicious = np.abs(np.nan_to_num(figures["w"])) > quality.w_critical
    suspicious |= (np.nan_to_num(block) > limit)[:, None]
    return [
        Observation(
            number=first + i * o.rows + row + 1,
            kind=o.kind,
            component=o.components[row],
            start=ends[i][0],
            end=ends[i][1],
            unit=o.units[row],
            value=float(o.values[i, row]),
            sigma=float(sigma[i, row]),
            residual=number(residual[i, row]),
            state=_STATES[int(o.use[i])],
            reason=str(o.reason[i]),
            source=str(o.source[i]),
            group=o.group,
            **{name: number(figures[name][i, row]) for name in _FIGURES},
            external_at=position(int(where)) if (where := figures["where"][i, row]) >= 0 else "",
            block_test=number(block[i]),
            block_limit=number(limit[i]),
            suspicious=bool(suspicious[i, row]),
        )
        for i in range(len(o))
        for row in range(o.rows)
    ]


def _figures(
    adjustment: Adjustment, quality: Quality, table: int, o: Observations
) -> dict[str, Array]:
    """Quality figures (n, rows) of a table; NaN (and position -1) for values not taking part."""
    rows = adjustment.rows
    mine = np.flatnonzero(rows.table == table)
    place = rows.item[mine], rows.row[mine]
    out = {name: np.full(o.values.shape, np.nan) for name in _FIGURES}
    for name in _FIGURES:
        out[name][place] = getattr(quality, name)[mine]
    out["where"] = np.full(o.values.shape, -1.0)
    known = np.isfinite(quality.external[mine]) & (quality.external[mine] > 0)
    out["where"][place] = np.where(known, quality.external_position[mine], -1)
    return out


def _blocks(quality: Quality, table: int, o: Observations) -> tuple[Array, Array]:
    """Statistic and limit (n,) of whole observations; NaN and infinity where there is none."""
    statistic, limit = np.full(len(o), np.nan), np.full(len(o), np.inf)
    mine = quality.blocks.table == table
    item = quality.blocks.item[mine]
    statistic[item], limit[item] = quality.blocks.statistic[mine], quality.blocks.critical[mine]
    return statistic, limit


def sights(adjustment: Adjustment) -> tuple[tuple[str, str], ...]:
    """Pairs of positions joined by an observation, each pair once."""
    layout = adjustment.layout
    known = set(layout.names["point"]) | set(layout.names["pose"])
    pairs: dict[tuple[str, str], None] = {}
    for o in adjustment.network.observations:
        for (start, end), use in zip(o.ends(layout), o.use, strict=True):
            if use == Use.ACTIVE and start in known and end in known:
                pairs[(start, end) if start <= end else (end, start)] = None
    return tuple(pairs)
