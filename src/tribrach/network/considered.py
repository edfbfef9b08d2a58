"""Errors that a network does not solve for, and what they have done to its unknowns.

An effect c with a standard deviation, such as a scale of the ranges of a scanner, that no unknown
stands for moves every reading by ``B c``, and the adjusted unknowns by ``G c`` with

    G = Q A^T P B

so that the unknowns have the covariance ``C + G S_c G^T`` and with the effects ``G S_c`` (method
section 5.10; considered parameters, Tapley, Schutz and Born 2004). Targets near which everything is
measured take most of such an error in; what lies beyond them sees it doubled.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array, Index
from tribrach.geometry.polar import polar_from_xyz, xyz_by_polar
from tribrach.instruments.calibration import CalibrationModel
from tribrach.instruments.common_errors import RANGE_SCALE
from tribrach.network.adjustment import Adjustment
from tribrach.observations.base import Observations
from tribrach.observations.planes import FittedPlanes, moved_planes
from tribrach.observations.poses import RelativePoses
from tribrach.observations.scanner import ScannerPolar, TargetCentres

#: kinds whose readings have what a scanner does alike at all points
_CARRYING = (ScannerPolar, TargetCentres, FittedPlanes, RelativePoses)


@dataclass(frozen=True, eq=False)
class Considered:
    """An effect on the readings of some stations."""

    model: CalibrationModel  #: with one parameter, the effect
    stations: Collection[str]  #: names of the scanner stations whose readings it is in


def influence_of(adjustment: Adjustment, effects: Sequence[Considered], columns: Index) -> Array:
    """Effect of considered errors on the unknowns of a network.

    Method section 5.10.

    ``adjustment``: the network, solved without them. Readings of targets and fitted planes carry
    them, and relative poses of clouds a scale that both stations have; else clouds are taken as
    free; ``columns`` (k,): columns of the full tangent vector. Returns (k, m): derivatives of the
    unknowns; zero where they are fixed.
    """
    shift = np.zeros((adjustment.n_observations, len(effects)))
    start = 0
    for o, items in zip(adjustment.network.observations, adjustment.assembly.active, strict=True):
        stop = start + len(items) * o.rows
        if isinstance(o, _CARRYING) and len(items):
            for k, effect in enumerate(effects):
                moved = _moved(o, adjustment, effect)[items]
                shift[start:stop, k] = moved.reshape(-1)
        start = stop
    if not shift.any():
        return np.zeros((len(columns), len(effects)))
    right = adjustment.design.T @ (adjustment.whitener @ shift)
    solved = adjustment.cofactor.solve(right)
    place = adjustment.reduced[columns]
    out: Array = np.where((place >= 0)[:, None], solved[place], 0.0)
    return out


def _moved(o: Observations, adjustment: Adjustment, effect: Considered) -> Array:
    """What an effect corrects the readings (n, m) of a table by, zero from other stations."""
    assert isinstance(o, _CARRYING)
    names = adjustment.layout.names["pose"]
    owned = np.array([name in effect.stations for name in names], dtype=bool)
    if isinstance(o, RelativePoses):
        # what is m times larger everywhere is m times farther apart, and not turned
        scale = RANGE_SCALE in effect.model.parameters
        wanted = owned[o.start] & owned[o.end] & scale
        corrections = o.predict(adjustment.state) * [1, 1, 1, 0, 0, 0]
        return np.asarray(np.where(wanted[:, None], corrections, 0.0))
    wanted = owned[o.station]
    if isinstance(o, FittedPlanes):
        corrections = moved_planes(
            o.normal, o.centroid, lambda places: _of_places(places, effect.model)
        )
    elif isinstance(o, ScannerPolar):
        # what is true is measured + Delta, what is predicted is true - Delta
        corrections = -o.parameter_columns(adjustment.state, effect.model)[:, :, 0]
    else:
        corrections = _of_places(o.predict(adjustment.state), effect.model)
    out: Array = np.where(wanted[:, None], corrections, 0.0)
    return out


def _of_places(places: Array, model: CalibrationModel) -> Array:
    """What an effect corrects places (n, 3) in the frame of the scanner by."""
    polar = polar_from_xyz(places)
    r, h, v = polar.T
    by_effect = model.columns(r, h, v, np.ones(len(places)))
    out: Array = (xyz_by_polar(polar) @ by_effect)[:, :, 0]
    return out
