"""Calibration models against a ray-traced mechanism, published data and each other."""

from pathlib import Path

import numpy as np
import pytest

from tests.geometry.test_euler import scanner_from_world_from_opk
from tests.instruments.ray_tracer import trace
from tribrach.errors import InputError
from tribrach.geometry.polar import polar_from_xyz
from tribrach.instruments.calibration import (
    NIST,
    PAPER_EIGHT,
    PAPER_EIGHT_ELEVATION,
    CalibrationModel,
    lichti,
)

MODELS = [NIST, PAPER_EIGHT, PAPER_EIGHT_ELEVATION, lichti(0.6, 9.6)]
#: front-face readings: near and far, flat and steep, all around
READINGS = np.array(
    [[3.0, 0.3, 1.5], [8.0, 2.0, 0.5], [20.0, -2.4, 2.2], [5.0, -1.1, 1.0], [12.0, 3.0, 2.6]]
)


def wrapped(angle: np.ndarray) -> np.ndarray:
    return np.remainder(angle + np.pi, 2 * np.pi) - np.pi


def traced_corrections(error: str, size: float, face: int) -> np.ndarray:
    """True minus measured (r, H, V) (n, 3) of the mechanism, folded to the front."""
    out = []
    for r, h, v in READINGS:
        raw = (r, h, v) if face > 0 else (r, h + np.pi, 2 * np.pi - v)
        true = polar_from_xyz(trace(error, size, *raw)[None])[0]
        out.append(true - [r, h, v])
    corrections = np.array(out)
    corrections[:, 1] = wrapped(corrections[:, 1])
    return corrections


def test_a_perfect_scanner_measures_the_truth():
    for face in (1, -1):
        assert np.abs(traced_corrections("none", 1e-6, face)).max() < 1e-12


@pytest.mark.parametrize("face", [1, -1])
@pytest.mark.parametrize("parameter", NIST.parameters)
def test_nist_column_is_what_the_mechanism_does(parameter, face):
    size = 1e-7
    traced = traced_corrections(parameter, size, face) / size
    k = np.full(len(READINGS), float(face))
    column = NIST.select([parameter]).columns(*READINGS.T, k)[:, :, 0]
    difference = traced - column
    if parameter == "x3":  # a shifted mirror also shortens all paths alike, as x10 does
        difference[:, 0] -= difference[:, 0].mean()
    assert np.abs(column).max() > 0.01
    assert np.abs(difference).max() < 1e-3 * np.abs(column).max()


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.name)
def test_derivative_is_that_of_delta(model):
    rng = np.random.default_rng(5)
    g = np.column_stack([rng.uniform(2, 30, 50), rng.uniform(-3, 3, 50), rng.uniform(0.3, 2.8, 50)])
    face = rng.choice([1.0, -1.0], 50)
    c = rng.normal(size=(50, len(model.parameters)))
    analytic = model.derivative(g, face, c)
    for axis in range(3):
        step = 1e-5 * np.eye(3)[axis]
        numeric = (model.delta(g + step, face, c) - model.delta(g - step, face, c)) / 2e-5
        np.testing.assert_allclose(analytic[:, :, axis], numeric, rtol=1e-6, atol=1e-5)


@pytest.mark.parametrize("model", MODELS, ids=lambda m: m.name)
def test_delta_is_linear_in_the_parameters(model):
    face = np.ones(len(READINGS))
    c = np.random.default_rng(2).normal(size=(len(READINGS), len(model.parameters)))
    b = model.columns(*READINGS.T, face)
    assert b.shape == (len(READINGS), 3, len(model.parameters))
    expected = [[sum(b[i, row] * c[i]) for row in range(3)] for i in range(len(READINGS))]
    np.testing.assert_allclose(model.delta(READINGS, face, c), expected, atol=1e-12)


def test_the_user_selects_parameters():
    chosen = NIST.select(["x10", "x2"])
    face = np.ones(len(READINGS))
    assert chosen.parameters == ("x10", "x2")
    whole = NIST.columns(*READINGS.T, face)
    index = [NIST.parameters.index(p) for p in chosen.parameters]
    np.testing.assert_array_equal(chosen.columns(*READINGS.T, face), whole[:, :, index])
    with pytest.raises(InputError, match="NIST has no parameter x99; choose from x1n, x1z"):
        NIST.select(["x99"])


def test_nist_twins_are_separated_by_the_horizontal_angle_only():
    """x5n and x9n act alike on V, x5z, x7 and x9z span two functions (method section 4.1)."""
    rng = np.random.default_rng(3)
    g = np.column_stack(
        [rng.uniform(2, 30, 200), rng.uniform(-3, 3, 200), rng.uniform(0.3, 2.8, 200)]
    )
    face = np.repeat([1.0, -1.0], 100)
    triple = NIST.select(["x5z", "x7", "x9z"]).columns(*g.T, face).reshape(-1, 3)
    assert np.linalg.matrix_rank(triple) == 2
    constant = np.zeros((200, 3, 1))
    constant[:, 1] = 1.0  # the orientation of the station
    pair = NIST.select(["x5n", "x9n"]).columns(*g.T, face)
    assert np.linalg.matrix_rank(np.concatenate([pair, constant], axis=2).reshape(-1, 3)) == 2


def test_papers_constants_are_their_twins():
    """E_R = a1 in both meanings of the angle, E_V = a3 for one face (AC-15)."""
    for model in (PAPER_EIGHT, PAPER_EIGHT_ELEVATION):
        b = model.columns(*READINGS.T, np.ones(len(READINGS)))
        columns = dict(zip(model.parameters, np.moveaxis(b, 2, 0), strict=True))
        np.testing.assert_array_equal(columns["E_R"], columns["a1"])
        np.testing.assert_array_equal(columns["E_V"], columns["a3"])


def test_paper_with_zenith_angles_is_the_physical_part_of_nist():
    pairs = {"a1": "x10", "a2": "x2", "a3": "x4", "a4": "x3", "a5": "x6"}
    for face in (1.0, -1.0):
        k = np.full(len(READINGS), face)
        paper = PAPER_EIGHT.select(list(pairs)).columns(*READINGS.T, k)
        nist = NIST.select(list(pairs.values())).columns(*READINGS.T, k)
        np.testing.assert_allclose(paper, nist, atol=1e-15)


def test_lichti_constants_against_nist():
    """Collimation is the mirror's tilt, trunnion tilt and index agree up to sign, on both faces."""
    pairs = [("A0", "x10", -1), ("B6", "x6", -0.5), ("B7", "x7", 1), ("C0", "x4", 1)]
    for face in (1.0, -1.0):
        k = np.full(len(READINGS), face)
        for mine, theirs, factor in pairs:
            a = lichti(0.6, 9.6).select([mine]).columns(*READINGS.T, k)
            b = NIST.select([theirs]).columns(*READINGS.T, k)
            np.testing.assert_allclose(a, factor * b, atol=1e-12)


def object_points(path: Path) -> np.ndarray:
    """Coordinates (n, 3) between the keywords OPSTRT and OP_END."""
    text = path.read_text(encoding="latin-1").split("\nOPSTRT")[1].split("\nOP_END")[0]
    rows = [line.split("%")[0].split() for line in text.splitlines()]
    return np.array([[float(a) for a in row[1:4]] for row in rows if row])


@pytest.mark.data
@pytest.mark.parametrize(
    ("scan", "position", "opk"),
    [(1, (0, 0, 0), (0.02, -0.01, 5.0)), (2, (-1, 0, 0.1), (0.0, 0.0, -2.0))],
)
def test_simulated_scans_of_another_program(shared_data, scan, position, opk):
    """Four parameters of Lichti 2007 (-4 mm, 1, -1, -2 mrad) and angles of known direction.

    The program turns in the order R1 R2 R3, which the rounding of the coordinates tells apart from
    R3 R2 R1 by 0.17 mm.
    """
    folder = shared_data / "selfcal" / "Testdata_1"
    points = object_points(folder / "GroundTruth" / "PPE_TLS_T1_OP_test_true.txt")
    scanned = np.loadtxt(folder / "Scans" / f"PPE_TLS_T1_Scan{scan}.dat")[:, 1:4]
    r1, r2, r3 = scanner_from_world_from_opk(np.diag(np.radians(opk)))
    m = r1 @ r2 @ r3
    true, measured = polar_from_xyz((points - position) @ m.T), polar_from_xyz(scanned)
    model: CalibrationModel = lichti(1.0, 1.0).select(["A0", "B6", "B7", "C0"])
    c = np.tile([-4e-3, 1e-3, -1e-3, -2e-3], (len(points), 1))
    # as the observation equation has it: h = g - Delta(g), at the computed readings
    difference = true - model.delta(true, np.ones(len(points)), c) - measured
    difference[:, 1] = wrapped(difference[:, 1]) * np.sin(true[:, 2])
    difference[:, 1:] *= true[:, :1]
    # coordinates are rounded to 0.1 mm; the corrections are up to 9 mm
    assert np.linalg.norm(difference, axis=1).max() < 0.05e-3 * np.sqrt(3)
