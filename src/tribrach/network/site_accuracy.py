"""Separates how well a site is known as a whole from how well its points are known to each other.

The joint covariance C of the positions is split by the six motions of a rigid body, ``q = B^+ x``:
three shifts of the centroid and three turns about E, N and U. What they carry is absolute and
common to everything on the site; what is left, ``(I - B B^+) C (I - B B^+)^T``, is its inner
accuracy. Metres and radians, a priori unless a factor says otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.answers import Result, Vector
from tribrach.geometry.rotation import skew
from tribrach.network.adjustment import Adjustment
from tribrach.observations.base import Use
from tribrach.observations.control import Offsets, VectorPriors
from tribrach.observations.gnss import GnssPositions

#: positions looked at; more are thinned evenly
_MOST = 60


@dataclass(frozen=True, eq=False)
class SiteAccuracy:
    """Standard deviations of a site as a whole and within itself, along E, N, U."""

    names: tuple[str, ...]  #: the k positions that were looked at
    radius: float  #: largest distance in plan from their centroid [m]
    point: Array  #: (3,), root mean square of the positions [m]
    shift: Array  #: (3,), shift of the site as a whole [m]
    turn: Array  #: (3,), turn of the site as a whole about E, N and U [rad]
    inner: Array  #: (3,), root mean square of the positions without shift and turn [m]
    pair: Array  #: (3,), median of the differences between two positions [m]
    worst: Array  #: (3,), the largest difference [m]
    worst_names: tuple[str, str]  #: the two positions of the largest difference


@dataclass(frozen=True, eq=False)
class CommonShift(Result, without=("name",), keys={"count": "positions"}):
    """A shift that several GNSS positions have in common."""

    name: str  #: of the session
    sigma: Vector  #: (3,), its standard deviation a priori [m]
    count: int  #: number of positions


def site_accuracy(adjustment: Adjustment, factor: float = 1.0) -> SiteAccuracy | None:
    """Split the accuracy of a site's points and stations; marks under targets do not count."""
    names, xyz, columns = _positions(adjustment)
    k = len(names)
    if k < 3:
        return None
    flat = columns.ravel()
    c = factor * adjustment.covariance_columns(flat, flat)
    local = xyz - xyz.mean(axis=0)
    motions = np.zeros((3 * k, 6))
    motions[:, :3] = np.tile(np.eye(3), (k, 1))
    motions[:, 3:] = -skew(local).reshape(3 * k, 3)
    inverse = np.linalg.pinv(motions, rcond=1e-6)
    rigid = inverse @ c @ inverse.T
    rest = np.eye(3 * k) - motions @ inverse
    inner = np.einsum("ij,jk,ik->i", rest, c, rest, optimize=True)
    i, j = np.triu_indices(k, 1)
    variance = np.diag(c).reshape(k, 3)
    cross = np.einsum("iaja->ija", c.reshape(k, 3, k, 3))[i, j]
    pairs = np.maximum(variance[i] + variance[j] - 2 * cross, 0.0)
    worst = int(np.argmax(pairs.sum(axis=1)))
    return SiteAccuracy(
        names=tuple(names),
        radius=float(np.hypot(local[:, 0], local[:, 1]).max()),
        point=np.sqrt(np.maximum(variance.mean(axis=0), 0.0)),
        shift=np.sqrt(np.maximum(np.diag(rigid)[:3], 0.0)),
        turn=np.sqrt(np.maximum(np.diag(rigid)[3:], 0.0)),
        inner=np.sqrt(np.maximum(inner.reshape(k, 3).mean(axis=0), 0.0)),
        pair=np.sqrt(np.median(pairs, axis=0)),
        worst=np.sqrt(pairs[worst]),
        worst_names=(names[int(i[worst])], names[int(j[worst])]),
    )


def _positions(adjustment: Adjustment) -> tuple[list[str], Array, NDArray[np.int64]]:
    """Names, places (k, 3) and columns (k, 3) of free positions other than marks."""
    layout, state = adjustment.layout, adjustment.state
    marks: set[int] = set()
    for o in adjustment.network.observations:
        if isinstance(o, Offsets):
            marks |= set(o.start.tolist()) - set(o.end.tolist())
    every = np.arange(layout.count("point") + layout.count("pose"))
    columns = layout.position_columns(every)
    free = (adjustment.reduced[columns] >= 0).all(axis=1)
    good = free & np.isfinite(state.positions).all(axis=1) & ~np.isin(every, list(marks))
    chosen = np.flatnonzero(good)
    if len(chosen) > _MOST:
        chosen = chosen[np.linspace(0, len(chosen) - 1, _MOST).astype(int)]
    names = [layout.position_name(int(n)) for n in chosen]
    return names, state.positions[chosen], columns[chosen]


def sessions(adjustment: Adjustment) -> list[CommonShift]:
    """Common shifts of GNSS positions that take part."""
    layout = adjustment.layout
    count: dict[int, int] = {}
    sigma: dict[int, Array] = {}
    for o in adjustment.network.observations:
        active = o.use == Use.ACTIVE
        if isinstance(o, GnssPositions):
            for k in np.flatnonzero(active & (o.common >= 0)):
                count[int(o.common[k])] = count.get(int(o.common[k]), 0) + 1
        elif isinstance(o, VectorPriors):
            for k in np.flatnonzero(active):
                sigma[int(o.vector[k])] = np.sqrt(np.diag(o.covariance[k]))
    return [
        CommonShift(layout.names["vector"][v], sigma[v], n) for v, n in count.items() if v in sigma
    ]
