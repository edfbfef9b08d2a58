"""Targets of a calibrated scanner as readings: range, angles and face, as they were measured.

Where a station has scans of both faces, a target gives one observation for each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from tribrach._types import Array
from tribrach.calibration.calibrated import polar_of_centres
from tribrach.job.find_targets import Findings
from tribrach.job.scans import StationScan
from tribrach.network.survey import Survey
from tribrach.observations.scanner import ScannerPolar
from tribrach.targets.detection import Detection

#: detections with the names of their targets, in the order of the observations
Sighted = Sequence[tuple[str, Detection]]
#: detections of one target in several scans lie nearer than this [m]
_SAME = 0.02


def observe_readings(
    survey: Survey,
    station: str,
    named: Mapping[str, Detection],
    scans: Sequence[StationScan],
    findings: Sequence[Findings],
) -> Sighted:
    """Add the readings of one station; named : its targets by name.

    Returns the targets of the readings, in their order, with their names.

    What the scans were corrected by is taken out again, so that the readings are those of the
    scanner.
    """
    if not named:
        return ()
    by_name = {scan.name: scan for scan in scans}
    names = list(named)
    places = np.array([named[name].center for name in names])
    best: dict[tuple[str, float], Detection] = {}
    for finding in findings:
        if finding.station != station:
            continue
        for d in finding.detections:
            away = np.linalg.norm(places - d.center, axis=1)
            k = int(np.argmin(away))
            if away[k] > _SAME:
                continue
            key = names[k], _face(by_name[d.scan], d)
            if key not in best or np.trace(d.covariance) < np.trace(best[key].covariance):
                best[key] = d
    raw = np.array([_reading(by_name[d.scan], d) for d in best.values()])
    sources = [f"{d.scan}: {d.kind}" for d in best.values()]
    polar, covariance = polar_of_centres(
        raw, np.array([d.covariance for d in best.values()]), sources
    )
    survey.add(
        ScannerPolar,
        values=polar,
        covariance=covariance,
        station=[station] * len(best),
        target=[name for name, _ in best],
        face=np.array([face for _, face in best]),
        source=sources,
    )
    return [(name, d) for (name, _), d in best.items()]


def _face(scan: StationScan, d: Detection) -> float:
    """The face that a target was measured on."""
    h = np.arctan2(d.center[1], d.center[0])
    if scan.faces == "dome":
        return -1.0 if h % (2 * np.pi) >= np.pi else 1.0
    return 1.0 if scan.faces == "front" else -1.0


def _reading(scan: StationScan, d: Detection) -> Array:
    """The centre (3,) as the scanner measured it, in the air that its ranges are meant for."""
    correction = scan.scan.correction
    if correction is None:
        return np.asarray(d.center)
    centre: Array = replace(correction, scale=0.0).raw(np.asarray(d.center)[None])[0]
    return centre
