"""Simulated field checks: readings of targets with noise and misalignments."""

import numpy as np

from tribrach.calibration.scanner_readings import ScannerReadings
from tribrach.geometry.polar import polar_from_xyz
from tribrach.geometry.rotation import exp
from tribrach.instruments.calibration import NIST

SIGMA = np.array([1.2e-3, 4e-5, 4e-5])
#: four targets around, at several heights
TARGETS = np.array([[20.0, 1.0, 2.0], [-18.0, 2.0, -1.0], [3.0, 15.0, 5.0], [1.0, -12.0, 0.5]])
#: a station between the targets, and one outside behind the first
STATIONS = {"inside": np.array([0.0, 0.0, 0.0]), "outside": np.array([32.0, 1.5, 0.3])}


def readings(
    rng,
    parameters=None,
    *,
    targets=TARGETS,
    stations=STATIONS,
    faces=(1.0, -1.0),
    series=("",),
    sigma=SIGMA,
    noise=1.0,
    scale=0.0,
    swept=False,
):
    """What a scanner reads; every scan of a series is set up anew.

    scale : of the range; swept : as one half turn of the instrument sees the targets, those on its
    other side in the back face.
    """
    parameters = parameters or {}
    model = NIST.select(list(parameters)) if parameters else None
    parts = []
    for name, place in stations.items():
        for one in series:
            turn = exp(np.array([0.01, -0.02, rng.uniform(-3, 3)]))
            true = polar_from_xyz((targets - place) @ turn)
            for face in faces:
                side = np.where(true[:, 1] < 0, -face, face) if swept else np.full(len(true), face)
                measured = true.copy()
                if model is not None:
                    c = np.tile(list(parameters.values()), (len(true), 1))
                    for _ in range(4):
                        measured = true - model.delta(measured, side, c)
                measured[:, 0] *= 1 + scale
                measured = measured + noise * sigma * rng.normal(size=measured.shape)
                parts.append((name, one, side, measured))
    n = len(targets)
    count = len(parts)
    return ScannerReadings(
        np.repeat(np.array([p[0] for p in parts], dtype=object), n),
        np.repeat(np.array([p[1] for p in parts], dtype=object), n),
        np.tile(np.array([f"T{k}" for k in range(n)], dtype=object), count),
        np.concatenate([p[2] for p in parts]),
        np.concatenate([p[3] for p in parts]),
        np.tile(np.diag(sigma**2), (n * count, 1, 1)),
        np.array([f"line {k}" for k in range(n * count)], dtype=object),
    )
