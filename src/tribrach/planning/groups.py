"""From networks to groups of observations that may come or go.

What may come is a network of its own: observations of candidates, with the points and stations
that they touch under the same names as in the plan. What may go are the rows of the plan that
touch a named target or station.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tribrach._types import Index
from tribrach.errors import InputError
from tribrach.network.adjustment import Adjustment
from tribrach.network.assembly import Assembly
from tribrach.network.network import Network
from tribrach.observations.unknowns import FAMILIES, WIDTH, Layout
from tribrach.planning.blocks import Blocks, group_rows
from tribrach.planning.prediction import Criterion, with_parameters
from tribrach.planning.prospect import Prospect, prospect


def same_columns(layout: Layout, base: Layout) -> Index:
    """Column (size,) of the base for each column of a layout, by names; -1 for what is new."""
    out = np.full(layout.size, -1, dtype=np.int64)
    for family in FAMILIES:
        names = layout.names[family]
        if not names:
            continue
        index = np.array(
            [base.index(family, n) if base.has(family, n) else -1 for n in names], dtype=np.int64
        )
        first = layout.offset[family]
        width = WIDTH[family]
        out[first : first + width * len(names)] = base.columns(family, index).ravel()
    return out


def prospect_for(
    adjustment: Adjustment,
    criterion: Criterion,
    further: Sequence[Network] = (),
    going_names: Sequence[str] = (),
) -> Prospect:
    """Compute a prospect that can judge what may come and what may go."""
    wanted = [np.zeros(0, dtype=np.int64)]
    for network in further:
        columns = same_columns(network.start.layout, adjustment.layout)
        wanted.append(columns[columns >= 0])
    for name in going_names:
        own, rows = _touching(adjustment, name)
        touched = np.unique(adjustment.design[rows].indices)
        wanted.append(adjustment.free_columns[np.setdiff1d(touched, own)])
    return prospect(adjustment, criterion, np.concatenate(wanted))


def coming(
    adjustment: Adjustment, now: Prospect, further: Network, groups: Mapping[str, int]
) -> list[Blocks]:
    """Form blocks of candidates that may come to a design."""
    further = with_parameters(further)
    assembly = Assembly(further)
    if len(now.share) and np.count_nonzero(assembly.whitener.data) > len(assembly.rows):
        raise InputError(
            "the values of a candidate are correlated, so that none is controlled by itself",
            cure="give candidates sigmas only, or judge by the sigma",
        )
    layout = further.start.layout
    base = same_columns(layout, adjustment.layout)
    kept = np.full(adjustment.layout.size + 1, -1, dtype=np.int64)
    kept[now.columns] = np.arange(len(now.columns))
    group = np.full(layout.size, -1, dtype=np.int64)
    for column in np.flatnonzero(base < 0):
        name = layout.describe(int(column))[1]
        if name not in groups:
            raise InputError(f"{name} is no part of the plan and of no candidate")
        group[column] = groups[name]
    free = assembly.free_columns
    return group_rows(assembly.design(further.start), group[free], kept[base][free])


def going(adjustment: Adjustment, now: Prospect, names: Sequence[str]) -> list[Blocks]:
    """Form blocks of targets and stations of the plan that may go, numbered as named."""
    kept = np.full(adjustment.layout.size + 1, -1, dtype=np.int64)
    kept[now.columns] = np.arange(len(now.columns))
    place = kept[adjustment.free_columns]
    parts: list[Blocks] = []
    for number, name in enumerate(names):
        own, rows = _touching(adjustment, name)
        group = np.full(adjustment.n_unknowns, -1, dtype=np.int64)
        group[own] = number
        for blocks in group_rows(adjustment.design[rows], group, place):
            line = np.where(blocks.line >= 0, rows[blocks.line], -1)
            parts.append(
                Blocks(
                    number=blocks.number,
                    rows=blocks.rows,
                    columns=blocks.columns,
                    leverage=blocks.leverage,
                    line=line,
                    determined=blocks.determined,
                )
            )
    return parts


def _touching(adjustment: Adjustment, name: str) -> tuple[Index, Index]:
    """Free columns of a target or station, and the rows of the design that touch them."""
    own = adjustment.reduced[adjustment.columns(name)]
    own = own[own >= 0]
    columns = adjustment.design[:, own]
    rows = np.unique(columns.tocoo().row).astype(np.int64)
    return own, rows
