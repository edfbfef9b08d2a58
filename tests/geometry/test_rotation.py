"""Rotation vectors, matrices and quaternions against scipy, at all angles."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tribrach.geometry.rotation import exp, from_quaternion, log, to_quaternion

RNG = np.random.default_rng(3)
AXES = RNG.normal(size=(40, 3))
AXES = np.concatenate([AXES / np.linalg.norm(AXES, axis=1)[:, None], np.eye(3), -np.eye(3)])
ANGLES = [0.0, 1e-300, 1e-12, 1e-7, 1e-3, 0.4, np.pi / 2, 3.0, np.pi - 1e-7]


@pytest.mark.parametrize("angle", [*ANGLES, np.pi, 4.0, 40.0])
def test_exp(angle: float) -> None:
    ours = exp(AXES * angle)
    assert np.abs(ours - Rotation.from_rotvec(AXES * angle).as_matrix()).max() < 1e-15 * (
        10 + angle
    )
    assert np.abs(ours @ np.swapaxes(ours, 1, 2) - np.eye(3)).max() < 3e-15


@pytest.mark.parametrize("angle", ANGLES)
def test_log_undoes_exp(angle: float) -> None:
    """To the last digits, half a turn and none at all included."""
    assert np.abs(log(exp(AXES * angle)) - AXES * angle).max() <= 2e-15


def test_half_a_turn() -> None:
    """Either sign of the axis is right."""
    back = log(exp(AXES * np.pi))
    assert np.abs(np.linalg.norm(back, axis=1) - np.pi).max() < 1e-14
    assert np.abs(np.abs(np.einsum("ni,ni->n", back, AXES)) - np.pi).max() < 1e-14


def test_quaternions() -> None:
    q = RNG.normal(size=(5, 40, 4))
    matrix = from_quaternion(q)
    there = Rotation.from_quat(q.reshape(-1, 4))
    assert np.abs(matrix.reshape(-1, 3, 3) - there.as_matrix()).max() < 2e-15
    back = to_quaternion(matrix)
    assert back.shape == q.shape
    assert np.abs(back.reshape(-1, 4) - there.as_quat(canonical=True)).max() < 2e-15
    assert (back[..., 3] >= 0).all()


@pytest.mark.parametrize("q", [np.zeros(4), np.array([0, 0, np.nan, 1]), np.full(4, np.inf)])
def test_no_rotation(q: np.ndarray) -> None:
    with pytest.raises(ValueError, match="no rotation"):
        from_quaternion(q)


def test_shapes() -> None:
    assert exp(np.zeros(3)).shape == (3, 3)
    assert log(np.eye(3)).shape == (3,)
    assert exp(np.zeros((0, 3))).shape == (0, 3, 3)
    assert log(np.zeros((0, 3, 3))).shape == (0, 3)
    assert exp(np.zeros((2, 5, 3))).shape == (2, 5, 3, 3)
