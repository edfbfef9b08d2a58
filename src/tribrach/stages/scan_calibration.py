"""Calibrations of the scanners behind scans: known before the adjustment, adjusted after it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from tribrach.cloud.placement import CalibrationShare
from tribrach.instruments.calibration import CalibrationModel
from tribrach.instruments.correction import Correction, Faces
from tribrach.io.calibration_file import Calibration
from tribrach.network.observations.polar import ScannerPolar
from tribrach.scan.corrected import corrected_scan

if TYPE_CHECKING:
    from tribrach.network.adjustment import Adjustment
    from tribrach.stages.scans import StationScan

__all__ = ["as_adjusted", "calibration_sentences", "known_correction", "share_after"]

Array = NDArray[np.float64]


def known_correction(calibration: Calibration, faces: Faces) -> Correction:
    """The correction that a calibration file describes."""
    return Correction(calibration.columns(), calibration.values, faces)


def as_adjusted(scans: Sequence[StationScan], adjustment: Adjustment) -> list[StationScan]:
    """The scans, corrected with the parameters that the network gives their stations.

    A scan of a station without parameters in the network stays as it is.
    """
    out = []
    for scan in scans:
        found = _of_station(scan.station, adjustment)
        if found is None:
            out.append(scan)
            continue
        model, index = found
        correction = Correction(model, adjustment.state.scalars[index], scan.faces)
        out.append(replace(scan, scan=corrected_scan(scan.scan, correction)))
    return out


def share_after(
    scan: StationScan, adjustment: Adjustment, factor: float
) -> CalibrationShare | None:
    """Covariance of the parameters of a scan and with its station; None without a correction.

    factor : on a-priori covariances. Parameters that the network does not have keep the covariance
    of their file.
    """
    layout = adjustment.layout
    found = _of_station(scan.station, adjustment)
    if found is None:
        known = scan.known
        if known is None:
            return None
        correction = known_correction(known, scan.faces)
        return CalibrationShare(correction, known.covariance, np.zeros((6, len(known.values))))
    model, index = found
    columns = layout.columns("scalar", index)[:, 0]
    pose = layout.columns("pose", layout.index("pose", scan.station))
    return CalibrationShare(
        Correction(model, adjustment.state.scalars[index], scan.faces),
        factor * adjustment.covariance_columns(columns, columns),
        factor * adjustment.covariance_columns(pose, columns),
    )


def _of_station(
    station: str, adjustment: Adjustment
) -> tuple[CalibrationModel, NDArray[np.int64]] | None:
    """Model and scalars (k,) of a station's observations; None if they have none."""
    layout = adjustment.layout
    if not layout.has("pose", station):
        return None
    number = layout.index("pose", station)
    for o in adjustment.network.observations:
        if isinstance(o, ScannerPolar) and o.model is not None:
            mine = np.flatnonzero(o.station == number)
            if len(mine) and o.parameters.shape[1]:
                return o.model, o.parameters[mine[0]]
    return None


def calibration_sentences(scans: Sequence[StationScan], adjustment: Adjustment) -> list[str]:
    """Which scans were corrected, with parameters from where."""
    out = []
    for scan in scans:
        found = _of_station(scan.station, adjustment)
        if found is None and scan.known is None:
            continue
        names = found[0].parameters if found is not None else ()
        if found is None and scan.known is not None:
            names = scan.known.parameters
        origin = "adjusted with the network" if found is not None else "of the calibration file"
        out.append(f"Scan {scan.name} is corrected by {', '.join(names)}, {origin}.")
    return out
