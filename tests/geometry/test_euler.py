"""Omega, phi, kappa: direction, equation, inverse and derivative."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tribrach._types import Array
from tribrach.geometry import euler, rotation


def scanner_from_world_from_opk(opk: Array) -> Array:
    """``M`` (..., 3, 3), world to scanner, of omega, phi, kappa (..., 3)."""
    sw, sp, sk = np.moveaxis(np.sin(opk), -1, 0)
    cw, cp, ck = np.moveaxis(np.cos(opk), -1, 0)
    rows = [
        [cp * ck, cw * sk + sw * sp * ck, sw * sk - cw * sp * ck],
        [-cp * sk, cw * ck - sw * sp * sk, sw * ck + cw * sp * sk],
        [sp, -sw * cp, cw * cp],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def world_from_scanner_from_opk(opk: Array) -> Array:
    """``M^T`` (..., 3, 3), scanner to world, of omega, phi, kappa (..., 3)."""
    return np.swapaxes(scanner_from_world_from_opk(opk), -1, -2)


angle = st.floats(-3.1, 3.1)
tilt = st.floats(-1.5, 1.5)


def passive(axis: int, a: float) -> np.ndarray:
    """R1, R2, R3 of the textbooks: the axes turn, the point stays."""
    j, k = (axis + 1) % 3, (axis + 2) % 3
    out = np.eye(3)
    out[j, j] = out[k, k] = np.cos(a)
    out[j, k], out[k, j] = np.sin(a), -np.sin(a)
    return out


@given(angle, tilt, angle)
def test_equation_is_three_passive_rotations(w, p, k):
    """AC-13: equation 5 of S1 is R3(kappa) R2(phi) R1(omega), object to sensor, and proper."""
    m = scanner_from_world_from_opk(np.array([w, p, k]))
    np.testing.assert_allclose(m, passive(2, k) @ passive(1, p) @ passive(0, w), atol=1e-15)
    assert np.linalg.det(m) == pytest.approx(1.0, abs=1e-14)


@given(angle, tilt, angle)
def test_angles_come_back(w, p, k):
    opk = np.array([w, p, k])
    back = euler.opk_from_world_from_scanner(world_from_scanner_from_opk(opk))
    np.testing.assert_allclose(back, opk, atol=1e-12)


@pytest.mark.parametrize("sign", [1, -1])
def test_gimbal_lock_gives_the_same_rotation(sign):
    r = world_from_scanner_from_opk(np.array([0.4, sign * np.pi / 2, 0.9]))
    opk = euler.opk_from_world_from_scanner(r)
    assert opk[0] == 0
    np.testing.assert_allclose(world_from_scanner_from_opk(opk), r, atol=1e-12)


def test_arrays_of_any_shape():
    opk = np.random.default_rng(1).uniform(-1, 1, (2, 5, 3))
    r = world_from_scanner_from_opk(opk)
    assert r.shape == (2, 5, 3, 3)
    np.testing.assert_allclose(euler.opk_from_world_from_scanner(r), opk, atol=1e-13)


@given(angle, tilt, angle)
def test_derivative_by_left_increments(w, p, k):
    r = world_from_scanner_from_opk(np.array([w, p, k]))
    step = 1e-4 * np.eye(3) * np.cos(p)
    ends = [euler.opk_from_world_from_scanner(rotation.exp(s * step) @ r) for s in (1, -1)]
    change = np.remainder(ends[0] - ends[1] + np.pi, 2 * np.pi) - np.pi
    numeric = change.T / (2e-4 * np.cos(p))
    np.testing.assert_allclose(
        euler.opk_by_increment(r) * np.cos(p), numeric * np.cos(p), atol=1e-6
    )
