"""Do scans reach beyond the targets of their station, and what does that cost there?"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tribrach.cloud.placement import Placement
from tribrach.geometry.rotation import skew
from tribrach.network.adjustment import Adjustment
from tribrach.registration.geometry_warnings import (
    TargetsAround,
    extrapolation_factor,
    targets_around,
)
from tribrach.stages.budget import sample_of
from tribrach.stages.scans import StationScan
from tribrach.stages.state import State

__all__ = ["reach_sentences"]

Array = NDArray[np.float64]

#: hulls that must grow by more are worth a sentence, if errors grow by more as well
_FAR, _WORSE = 1.5, 1.3


def reach_sentences(
    scans: Sequence[StationScan],
    placements: Mapping[str, Placement],
    adjustment: Adjustment,
    state: State,
) -> list[str]:
    """One sentence for each station whose scans are extrapolated; placements by scan name."""
    said = []
    for around in targets_around(adjustment):
        mine = [s for s in scans if s.station == around.station and s.origin_known]
        if not mine or len(around.targets) < 2:
            continue
        where = placements[mine[0].name]
        points = np.concatenate([where.pose @ sample_of(scan, state).xyz for scan in mine])
        if len(points):
            said += _sentence(around, where, points)
    return said


def _sentence(around: TargetsAround, where: Placement, points: Array) -> list[str]:
    """What the reach of points (n, 3) [m] means for a station."""
    factor = extrapolation_factor(around.targets, around.place, points)
    among = float(np.sqrt(np.mean(_station_sigmas(around.targets, where) ** 2)))
    out = float(np.quantile(_station_sigmas(points, where), 0.95))
    if factor < _FAR or out < _WORSE * among:
        return []
    return [
        f"the scans of station {around.station} reach {factor:.1f} times as far as its targets "
        f"surround: what the station leaves uncertain is {1e3 * among:.1f} mm at the targets and "
        f"{1e3 * out:.1f} mm out there (3D, 95 % of the points below); targets around the object "
        "would hold it"
    ]


def _station_sigmas(world: Array, where: Placement) -> Array:
    """Three-dimensional sigmas (n,) [m] that points get from their station alone."""
    arm = world - where.pose.translation
    geo = np.concatenate([np.broadcast_to(np.eye(3), (len(arm), 3, 3)), -skew(arm)], axis=2)
    variance = np.einsum("nij,jk,nik->n", geo, where.covariance, geo)
    sigma: Array = np.sqrt(np.maximum(variance, 0.0))
    return sigma
