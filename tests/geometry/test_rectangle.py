"""Rectangles in planes: known ones are found again, upright on walls and smallest on floors."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tribrach.geometry.rectangle import held_rectangle


def places(centre, axes, half, seed: int) -> np.ndarray:
    """Corners of a rectangle and places in it."""
    at = np.random.default_rng(seed).uniform(-1, 1, (40, 2)) * half
    corners = np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]]) * half
    return np.array(centre) + np.concatenate([corners, at]) @ np.array(axes)


@given(st.floats(0, 2 * np.pi), st.floats(-0.6, 0.6), st.integers(0, 1000))
def test_a_wall_has_an_upright_rectangle(azimuth: float, lean: float, seed: int) -> None:
    normal = np.array(
        [np.cos(azimuth) * np.cos(lean), np.sin(azimuth) * np.cos(lean), np.sin(lean)]
    )
    across = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    up = np.cross(normal, across)
    middle = np.array([105.0, -20.0, 4.0])
    centre, axes, half = held_rectangle(normal, places(middle, [across, up], (6.0, 2.5), seed))
    assert centre == pytest.approx(middle, abs=1e-9)
    assert half == pytest.approx([6.0, 2.5], abs=1e-9)
    assert axes[0][2] == pytest.approx(0, abs=1e-12)
    assert axes[1][2] > 0.8
    assert axes @ normal == pytest.approx([0, 0], abs=1e-12)
    assert axes @ axes.T == pytest.approx(np.eye(2), abs=1e-12)


@given(st.floats(0, np.pi), st.integers(0, 1000), st.sampled_from([1.0, -1.0]))
def test_a_floor_has_the_smallest_rectangle(azimuth: float, seed: int, side: float) -> None:
    c, s = np.cos(azimuth), np.sin(azimuth)
    long, short = np.array([c, s, 0.0]), np.array([-s, c, 0.0])
    middle = np.array([-8.0, 3.0, 1.5])
    normal = np.array([0.0, 0.0, side])
    centre, axes, half = held_rectangle(normal, places(middle, [long, short], (9.0, 2.0), seed))
    assert centre == pytest.approx(middle, abs=1e-6)
    assert half == pytest.approx([9.0, 2.0], abs=1e-6)
    assert abs(axes[0] @ long) == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_places_on_a_line_have_a_length_and_no_width(count: int) -> None:
    along = np.array([0.6, 0.8, 0.0])
    on = np.linspace(-3, 3, count)[:, None] * along if count > 1 else np.zeros((1, 3))
    centre, axes, half = held_rectangle(np.array([0.0, 0.0, 1.0]), on)
    assert centre == pytest.approx([0, 0, 0], abs=1e-12)
    assert half == pytest.approx([3.0 if count > 1 else 0.0, 0.0], abs=1e-9)
    if count > 1:
        assert abs(axes[0] @ along) == pytest.approx(1)
