"""The loops that the GNSS baselines of a network close, with the covariances it gives them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_diag, csr_matrix

from tribrach._types import Array, Index
from tribrach.geodesy import frames
from tribrach.gnss.loops import BaselineLoop, close_loops, minimal_loops, triangles
from tribrach.gnss.sessions import SessionResult
from tribrach.network.adjustment import Adjustment
from tribrach.network.facts import Reference
from tribrach.network.network import Network
from tribrach.observations.base import Use
from tribrach.observations.gnss import GnssBaselines
from tribrach.sentences import Sentence

# What the report says of frame and epoch of a GNSS network.


#: no plate turns faster [rad/year]: 2.4 milliarcseconds, the Pacific (Altamimi et al. 2017)
FASTEST_TURN = 1.2e-8
#: turns of baselines below this are not worth a word [m]
NOTICEABLE = 1e-4
_YEAR = 365.25 * 86400


def epoch_sentences(reference: Reference, sessions: Sequence[SessionResult]) -> list[str]:
    """Frame and epoch of the coordinates, and what the age of the baselines costs."""
    frame, epoch = reference.frame, reference.epoch
    if frame is None:
        return []
    if epoch is None or not frames.is_dynamic(frame):
        return [f"Coordinates are in {frame}."]
    out: list[str] = [
        Sentence("Coordinates are in {frame} at epoch {epoch:2}.", frame=frame, epoch=epoch)
    ]
    ages = [
        (abs(1980.014 + b.start / _YEAR - epoch) * FASTEST_TURN * b.length, b)
        for session in sessions
        for b in session.baselines
    ]
    if ages and (worst := max(ages, key=lambda pair: pair[0]))[0] > NOTICEABLE:
        year = 1980.014 + worst[1].start / _YEAR
        out.append(
            Sentence(
                "Baselines measured in {year:1} are used at {epoch:2}: the turn of the plate "
                "in between is neglected, at most {worst[0]:mm1} in the longest.",
                year=year,
                epoch=epoch,
                worst=worst,
            )
        )
    return out


@dataclass(frozen=True)
class BaselineSet:
    """Active baselines of a network from mark to mark, in its work frame.

    names : of all positions; start, end (n,) numbers of positions; vectors (n, 3) [m]; covariance
    (3n, 3n) [m^2] of all; source (n,).
    """

    names: tuple[str, ...]
    start: Index
    end: Index
    vectors: Array
    covariance: csr_matrix
    source: NDArray[np.str_]

    def __len__(self) -> int:
        return len(self.start)


def baselines_of(adjustment: Adjustment) -> BaselineSet | None:
    """The baselines that take part, None if there are none."""
    network, state = adjustment.network, adjustment.state
    kinds = [(t, o) for t, o in enumerate(network.observations) if isinstance(o, GnssBaselines)]
    active = [(t, o, np.flatnonzero(o.use == Use.ACTIVE)) for t, o in kinds]
    active = [(t, o, rows) for t, o, rows in active if len(rows)]
    if not active:
        return None
    layout = state.layout
    vectors: list[Array] = []
    place: dict[tuple[int, int], int] = {}
    for t, o, rows in active:
        for k, row in enumerate(rows.tolist(), start=len(place)):
            place[t, row] = k
        marks = o.values[rows].copy()
        for sign, index, height in ((-1, o.end, o.height_end), (1, o.start, o.height_start)):
            up = o.site.axes(state.positions[index[rows]])[:, 2]
            marks += sign * height[rows, None] * up
        vectors.append(marks)
    count = layout.count("point") + layout.count("pose")
    return BaselineSet(
        tuple(layout.position_name(k) for k in range(count)),
        np.concatenate([o.start[rows] for _, o, rows in active]),
        np.concatenate([o.end[rows] for _, o, rows in active]),
        np.concatenate(vectors),
        _covariance(network, place, [o.covariance[rows] for _, o, rows in active]),
        np.concatenate([o.source[rows].astype(str) for _, o, rows in active]),
    )


def loops_of(baselines: BaselineSet) -> list[BaselineLoop]:
    """Minimal loops and further triangles, with their closures."""
    length = np.linalg.norm(baselines.vectors, axis=1)
    basis = minimal_loops(baselines.start, baselines.end, length)
    there = {frozenset(k for k, _ in walk) for walk in basis}
    more = [
        walk
        for walk in triangles(baselines.start, baselines.end)
        if frozenset(k for k, _ in walk) not in there
    ]
    return close_loops(
        [*basis, *more],
        baselines.start,
        baselines.end,
        baselines.vectors,
        baselines.covariance,
        independent=len(basis),
    )


def _covariance(
    network: Network, place: dict[tuple[int, int], int], blocks: list[Array]
) -> csr_matrix:
    """Own covariances of the baselines, replaced by joint ones where they have some."""
    own = block_diag(list(np.concatenate(blocks)), format="coo")
    rows, columns, values = [own.row], [own.col], [own.data]
    covered = np.zeros(own.shape[0], dtype=bool)
    for joint in network.joint:
        ours = [
            k
            for k, key in enumerate(zip(joint.table.tolist(), joint.item.tolist(), strict=True))
            if key in place
        ]
        if not ours:
            continue
        where = np.array(
            [3 * place[int(joint.table[k]), int(joint.item[k])] + joint.row[k] for k in ours]
        )
        covered[where] = True
        rows.append(np.repeat(where, len(where)))
        columns.append(np.tile(where, len(where)))
        values.append(joint.covariance[np.ix_(ours, ours)].ravel())
    keep = ~(covered[own.row] & covered[own.col])
    rows[0], columns[0], values[0] = own.row[keep], own.col[keep], own.data[keep]
    entries = (np.concatenate(rows), np.concatenate(columns))
    return csr_matrix((np.concatenate(values), entries), shape=own.shape)
