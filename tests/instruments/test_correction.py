"""Corrections of points: against the model, their inverse, their derivatives."""

import numpy as np
import pytest

from tribrach.geometry.polar import polar_from_xyz
from tribrach.instruments.calibration import NIST
from tribrach.instruments.correction import Correction
from tribrach.simulate.scanner import Scanner
from tribrach.simulate.twins.newcastle_lab import MISALIGNMENTS, NOISE

VALUES = np.array(list(MISALIGNMENTS.values()))
MODEL = NIST.select(list(MISALIGNMENTS))


def points(n: int = 500) -> np.ndarray:
    return np.random.default_rng(2).uniform([-8, -8, -3], [8, 8, 6], (n, 3))


@pytest.mark.parametrize("faces", ["front", "back", "dome"])
def test_true_is_measured_plus_delta(faces: str) -> None:
    xyz = points()
    correction = Correction(MODEL, VALUES, faces)
    measured = polar_from_xyz(xyz)
    h = measured[:, 1] % (2 * np.pi)
    face = {"front": 1.0, "back": -1.0, "dome": np.where(h >= np.pi, -1.0, 1.0)}[faces]
    face = np.broadcast_to(face, len(xyz)).astype(float)
    expected = measured + MODEL.delta(measured, face, np.tile(VALUES, (len(xyz), 1)))
    found = polar_from_xyz(correction.corrected(xyz))
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_simulated_scanner_has_the_same_sign() -> None:
    """The twin's scanner and the correction use one convention."""
    measured = polar_from_xyz(points())
    scanner = Scanner(NOISE, parameters=dict(MISALIGNMENTS))
    delta = scanner.delta(measured)
    moved = polar_from_xyz(Correction(MODEL, VALUES).corrected(points()))
    np.testing.assert_allclose(moved - measured, delta, atol=1e-12)


def test_raw_takes_the_correction_back() -> None:
    correction = Correction(MODEL, VALUES)
    xyz = points()
    np.testing.assert_allclose(correction.raw(correction.corrected(xyz)), xyz, atol=1e-12)


def test_jacobian_is_the_derivative() -> None:
    xyz = points(50)
    base = Correction(MODEL, np.zeros(len(VALUES)))
    analytic = base.jacobian(xyz)
    for k, step in enumerate(np.eye(len(VALUES)) * 1e-6):
        numeric = (Correction(MODEL, step).corrected(xyz) - xyz) / 1e-6
        np.testing.assert_allclose(analytic[:, :, k], numeric, rtol=1e-4, atol=1e-4)


def test_points_on_the_axis_and_at_zero_stay_finite() -> None:
    xyz = np.array([[0, 0, 3.0], [1e-9, 0, -2.0], [0, 0, 0], [0.01, 0.01, 0.0]])
    moved = Correction(MODEL, VALUES).corrected(xyz)
    assert np.isfinite(moved).all()
    assert np.abs(moved - xyz).max() < 0.01


def test_nothing_is_done_without_parameters() -> None:
    xyz = points()
    assert Correction(MODEL, np.zeros(len(VALUES))).corrected(xyz) is xyz
