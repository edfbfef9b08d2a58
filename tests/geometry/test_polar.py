"""Polar coordinates of the scanner frame and their derivatives."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tribrach.errors import InputError
from tribrach.geometry import polar


def vectors(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(20, 3)) * 30


def test_known_directions():
    u = np.array([[2.0, 0, 0], [0, 2, 0], [0, -1, 1], [-1, 0, -1]])
    right, root = np.pi / 2, np.sqrt(2)
    expected = [[2, 0, right], [2, right, right], [root, -right, right / 2]]
    expected.append([root, np.pi, 1.5 * right])
    np.testing.assert_allclose(polar.polar_from_xyz(u), expected, atol=1e-15)


@given(st.integers(0, 10**6))
def test_there_and_back(seed):
    u = vectors(seed)
    np.testing.assert_allclose(polar.xyz_from_polar(polar.polar_from_xyz(u)), u, atol=1e-12)


@given(st.integers(0, 10**6))
def test_derivatives(seed):
    u = vectors(seed)
    g = polar.polar_from_xyz(u)
    # hypot has no complex step: differences of the way back, whose inverse is the way there
    back = np.empty((len(u), 3, 3))
    for k in range(3):
        step = 1e-4 * np.eye(3)[k]
        back[:, :, k] = (polar.xyz_from_polar(g + step) - polar.xyz_from_polar(g - step)) / 2e-4
    np.testing.assert_allclose(polar.xyz_by_polar(g), back, atol=1e-6)
    product = polar.polar_by_xyz(u) @ polar.xyz_by_polar(g)
    np.testing.assert_allclose(product, np.broadcast_to(np.eye(3), product.shape), atol=1e-10)


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        ([0.29, 0, 1], r"scan.csv:3: a range of 0.29 m is below 0.3 m"),
        ([5, 0, np.radians(0.49)], "zenith angle of 0.4900 deg"),
        ([5, 0, np.radians(179.6)], "zenith angle of 179.6000 deg"),
        ([5, 0, np.radians(180.4)], "zenith angle of 180.4000 deg"),
        ([5, 0, np.radians(-30)], "zenith angle of -30.0000 deg"),
        ([5, 0, np.radians(390)], "outside the circle"),
    ],
)
def test_undefined_readings_are_refused(bad, words):
    readings = np.array([[0.31, 0, 1], bad])
    with pytest.raises(InputError, match=words):
        polar.require_defined(readings, ["scan.csv:2", "scan.csv:3"])
    polar.require_defined(readings[:1])


def test_raw_back_face_readings_pass():
    polar.require_defined(np.array([[5.0, 0.0, np.radians(271)]]))
