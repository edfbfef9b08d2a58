"""Scanner polar observations with calibration unknowns, from names to an adjusted network."""

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.geometry.polar import polar_from_xyz
from tribrach.geometry.rotation import exp
from tribrach.instruments.calibration import NIST, CalibrationModel, lichti
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.network import Datum
from tribrach.network.survey import Survey
from tribrach.observations.scanner import ScannerPolar

#: parameters that two stations with two faces determine (method section 4.2), in m and rad
TRUTH = {"x10": 1.2e-3, "x2": -0.4e-3, "x4": 8e-5, "x3": 0.3e-3, "x6": -5e-5}
STATIONS = {"S1": ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]), "S2": ([3.0, 1.5, 0.2], [0.0, 0.01, 2.0])}


def room(seed: int = 1) -> np.ndarray:
    """Forty targets on the walls, floor and ceiling of a room."""
    x = np.random.default_rng(seed).uniform([-4, -4, -1.5], [6, 5, 3], (40, 3))
    wall = np.arange(40) % 3
    low, high = np.array([-4, -4, -1.5]), np.array([6, 5, 3.0])
    x[np.arange(40), wall] = np.where(np.arange(40) % 2, low[wall], high[wall])
    return x


def two_faces(model: CalibrationModel, c: np.ndarray, noise: float) -> Survey:
    """Both stations see all targets on the front face, and raw on the back face."""
    rng = np.random.default_rng(7)
    survey = Survey()
    for name, (t, w) in STATIONS.items():
        survey.station(name)
        g = polar_from_xyz((room() - t) @ exp(np.array(w)))
        for face in (1.0, -1.0):
            measured = g - model.delta(g, np.full(len(g), face), np.tile(c, (len(g), 1)))
            if face < 0:
                measured = measured * [1, 1, -1] + [0, np.pi, 2 * np.pi]
            sigma = np.array([0.4e-3, 15e-6, 15e-6])
            survey.add(
                ScannerPolar,
                values=measured + noise * sigma * rng.normal(size=measured.shape),
                sigma=np.tile(sigma, (len(g), 1)),
                station=name,
                target=[f"T{i}" for i in range(len(g))],
                model=model,
                parameters=np.tile(np.array(model.parameters, dtype=object), (len(g), 1)),
            )
    survey.datum = Datum("free")
    return survey


def estimates(adjustment: Adjustment, names: tuple[str, ...]) -> np.ndarray:
    state = adjustment.state
    return np.array([state.scalars[state.layout.index("scalar", n)] for n in names])


def test_a_free_network_recovers_the_parameters():
    model = NIST.select(list(TRUTH))
    c = np.array(list(TRUTH.values()))
    adjustment = adjust(two_faces(model, c, noise=0.0).network())
    np.testing.assert_allclose(estimates(adjustment, model.parameters), c, atol=1e-9)
    assert adjustment.vtpv < 1e-6


def test_estimates_agree_with_their_covariance():
    model = NIST.select(list(TRUTH))
    c = np.array(list(TRUTH.values()))
    adjustment = adjust(two_faces(model, c, noise=1.0).network())
    sigma = np.sqrt([adjustment.covariance(n)[0, 0] for n in model.parameters])
    assert (np.abs(estimates(adjustment, model.parameters) - c) < 4 * sigma).all()
    assert (sigma < [2e-4, 5e-5, 5e-6, 5e-5, 5e-6]).all()
    assert adjustment.vtpv / adjustment.dof == pytest.approx(
        1.0, abs=4 * np.sqrt(2 / adjustment.dof)
    )


def test_models_of_one_group_stay_apart():
    survey = Survey()
    models = (NIST.select(["x10"]), lichti(0.6, 9.6).select(["C0", "A0"]), None)
    for i, model in enumerate(models):
        names = np.array(model.parameters if model else (), dtype=object)
        columns = {"parameters": names[None, :]} if model else {}
        survey.station(f"S{i}")
        survey.add(ScannerPolar, values=[[5, 0, 1]], sigma=[[1e-3, 1e-5, 1e-5]], station=[f"S{i}"],
                   target=["T"], model=model, group="scans", **columns)  # fmt: skip
    tables = survey.network().observations
    assert [t.model for t in tables] == list(models)
    assert {t.group for t in tables} == {"scans"}
    assert [t.parameters.shape for t in tables] == [(1, 1), (1, 2), (1, 0)]


def test_parameters_must_be_those_of_the_model():
    columns = {
        "values": [[5.0, 0, 1]],
        "covariance": np.eye(3)[None],
        "station": [0],
        "target": [0],
        "source": np.array(["scan.csv:2"], dtype=object),
    }
    with pytest.raises(InputError, match=r"scan.csv:2: 1 calibration parameters .* the 2 of"):
        ScannerPolar(**columns, model=NIST.select(["x10", "x2"]), parameters=[[0]])
    with pytest.raises(InputError, match=r"1 calibration parameters .* the 0 of"):
        ScannerPolar(**columns, parameters=[[0]])
    with pytest.raises(InputError, match=r"scan.csv:2: a range of 0.1 m"):
        ScannerPolar(**(columns | {"values": [[0.1, 0, 1]]}))
