"""Points that cover triangles: no gap wider than the spacing, all on the triangle."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tribrach.geometry import triangles as module
from tribrach.geometry.triangles import covering_points

TRIANGLE = np.array([[[0, 0, 0], [3, 0, 0], [0, 4, 1]]], dtype=float)


def inside(count: int) -> np.ndarray:
    u, v = np.random.default_rng(1).uniform(size=(2, count))
    over = u + v > 1
    u, v = np.where(over, 1 - u, u), np.where(over, 1 - v, v)
    a, b, c = TRIANGLE[0]
    return np.outer(1 - u - v, a) + np.outer(u, b) + np.outer(v, c)


@pytest.mark.parametrize("parts", [4, 128])
def test_covered(parts: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_PARTS", parts)
    points = np.concatenate(list(covering_points(TRIANGLE, 0.1)))
    distance, _ = cKDTree(points).query(inside(5000))
    assert distance.max() < 0.1
    a, b, c = TRIANGLE[0]
    normal = np.cross(b - a, c - a)
    assert points @ normal == pytest.approx(0, abs=1e-9)
    for corner in (a, b, c):
        assert np.linalg.norm(points - corner, axis=1).min() < 1e-12


def test_degenerate_triangles_are_points_and_lines() -> None:
    flat = np.array([[[1, 1, 1]] * 3, [[0, 0, 0], [1, 0, 0], [2, 0, 0]]], dtype=float)
    points = np.concatenate(list(covering_points(flat, 0.5)))
    assert np.isfinite(points).all()
    assert points[:, 0].max() == 2


def test_chunks_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_CHUNK", 1000)
    many = np.repeat(TRIANGLE, 50, axis=0)
    sizes = [len(chunk) for chunk in covering_points(many, 0.3)]
    assert max(sizes) <= 1000
    assert len(sizes) > 1
