"""Poses: composition, inverse, matrices that are no motions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tribrach.errors import InputError
from tribrach.geometry import rotation
from tribrach.geometry.pose import Pose

vectors = st.lists(st.floats(-3, 3), min_size=3, max_size=3).map(np.array)


@given(vectors, vectors, vectors, vectors, vectors)
def test_compositions_read_as_algebra(a, b, c, d, x) -> None:  # type: ignore[no-untyped-def]
    first, second = Pose(rotation.exp(a), b), Pose(rotation.exp(c), d)
    assert (first @ second) @ x == pytest.approx(first @ (second @ x), abs=1e-12)
    assert first.inverse @ (first @ x) == pytest.approx(x, abs=1e-12)
    assert (first.matrix @ np.append(x, 1))[:3] == pytest.approx(first @ x, abs=1e-12)
    assert Pose.from_matrix(first.matrix).matrix == pytest.approx(first.matrix, abs=1e-12)


def test_points_keep_their_shape() -> None:
    pose = Pose(np.eye(3), np.array([1.0, 2.0, 3.0]))
    assert (pose @ np.zeros((4, 3))).shape == (4, 3)


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        (np.diag([1.0, 1.0, -1.0, 1.0]), "mirrors"),
        (np.diag([2.0, 2.0, 2.0, 1.0]), "scales"),
        (np.zeros((4, 4)), "last row"),
        (np.full((4, 4), np.nan), "last row"),
    ],
)
def test_no_motions(matrix: np.ndarray, words: str) -> None:
    with pytest.raises(InputError, match=words):
        Pose.from_matrix(matrix)
