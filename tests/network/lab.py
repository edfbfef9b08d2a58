"""The laboratory of two stations with readings made directly, without errors or with noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from tribrach.calibration.calibrated import StationModel, calibrate_survey, unknown_name
from tribrach.geometry.polar import polar_from_xyz
from tribrach.geometry.rotation import exp
from tribrach.instruments.calibration import NIST, CalibrationModel
from tribrach.network.network import Datum, Network
from tribrach.network.survey import Survey
from tribrach.observations.scanner import ScannerPolar
from tribrach.observations.unknowns import State
from tribrach.simulate.surveying import observe
from tribrach.simulate.twins.newcastle_lab import BASE, MISALIGNMENTS, places
from tribrach.units import SEC

#: of all estimable parameters of the NIST model: the injected ones, and others of usual size
TRUTH = {
    "x1n": 0.00015, "x1z": -0.0001, "x7": -5 * SEC, "x8x": 3 * SEC, "x8y": -2 * SEC,
    "x9n": 4 * SEC, "x9z": -6 * SEC, "x11a": 2 * SEC, "x11b": -3 * SEC, "x12a": 2.5 * SEC,
    "x12b": -4 * SEC, **MISALIGNMENTS,
}  # fmt: skip
STATIONS = {
    "S1": (np.zeros(3), np.array([0.012, -0.008, 0.2])),
    "S2": (np.array([1.2, np.sqrt(BASE**2 - 1.2**2), 0.05]), np.array([-0.01, 0.014, -1.1])),
}


def lab(
    parameters: Sequence[str],
    *,
    ceiling: bool = True,
    faces: Sequence[float] = (1.0, -1.0),
    model: CalibrationModel = NIST,
    sigma: tuple[float, float] = (0.0012, 8 * SEC),
    stations: Mapping[str, tuple[np.ndarray, np.ndarray]] = STATIONS,
    targets: np.ndarray | None = None,
) -> Network:
    """Two stations that see all targets, one set of parameters, inner constraints."""
    x = places(ceiling)[0] if targets is None else targets
    survey = Survey()
    for i, place in enumerate(x):
        survey.point(f"T{i}", place)
    for name, (t, w) in stations.items():
        survey.station(name, translation=t, rotation=exp(w))
        g = polar_from_xyz((x - t) @ exp(w))
        s = np.column_stack([sigma[0] + 1e-5 * g[:, 0], np.full((len(g), 2), sigma[1])])
        for face in faces:
            survey.add(
                ScannerPolar,
                values=g,
                sigma=s,
                station=name,
                target=[f"T{i}" for i in range(len(x))],
                face=face,
            )
    given = StationModel(model.select(list(parameters)), "scanner")
    calibrate_survey(survey, dict.fromkeys(stations, given))
    survey.datum = Datum("free")
    return survey.network()


def with_truth(network: Network, truth: Mapping[str, float]) -> State:
    """The start of the network with true parameters."""
    state = network.start
    scalars = state.scalars.copy()
    for name, value in truth.items():
        full = unknown_name(name, "scanner")
        if state.layout.has("scalar", full):
            scalars[state.layout.index("scalar", full)] = value
    return replace(state, scalars=scalars)


def measured(network: Network, truth: Mapping[str, float], seed: int) -> Network:
    """The network with readings of the true state and their noise."""
    return observe(network, with_truth(network, truth), np.random.default_rng(seed))


def misaligned(network: Network, truth: Mapping[str, float], seed: int) -> Network:
    """Readings of a scanner with NIST misalignments in a network of any model, or none."""
    full = lab_like(network, tuple(truth))
    drawn = measured(full, truth, seed)
    tables = [
        replace(mine, values=theirs.values)
        for mine, theirs in zip(network.observations, drawn.observations, strict=True)
    ]
    return replace(network, observations=tuple(tables))


def lab_like(network: Network, parameters: tuple[str, ...]) -> Network:
    """The same observations with these NIST parameters as scalars of their own layout."""
    survey = Survey()
    state = network.start
    for name, x in zip(state.layout.names["point"], state.points, strict=True):
        survey.point(name, x)
    poses = state.layout.names["pose"]
    for name, t, r in zip(poses, state.pose_t, state.pose_r, strict=True):
        survey.station(name, translation=t, rotation=r)
    for o in network.observations:
        survey.add(
            ScannerPolar,
            values=o.values,
            sigma=o.sigma,
            station=[poses[k] for k in o.station],
            target=[state.layout.position_name(int(k)) for k in o.target],
            face=o.face,
        )
    given = StationModel(NIST.select(list(parameters)), "scanner")
    calibrate_survey(survey, dict.fromkeys(poses, given))
    return survey.network()
