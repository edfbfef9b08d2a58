"""Small triangles that others are cut into: no gap wider than they are, and their areas."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tribrach.geometry import triangles as module
from tribrach.geometry.triangles import covering_pieces

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
    points, areas = map(np.concatenate, zip(*covering_pieces(TRIANGLE, 0.1), strict=True))
    distance, _ = cKDTree(points).query(inside(5000))
    assert distance.max() < 0.1
    a, b, c = TRIANGLE[0]
    normal = np.cross(b - a, c - a)
    assert points @ normal == pytest.approx(0, abs=1e-9)
    assert areas.sum() == pytest.approx(np.linalg.norm(normal) / 2, rel=1e-12)
    assert areas @ points / areas.sum() == pytest.approx((a + b + c) / 3, rel=1e-12)


def test_degenerate_triangles_are_points_and_lines() -> None:
    flat = np.array([[[1, 1, 1]] * 3, [[0, 0, 0], [1, 0, 0], [2, 0, 0]]], dtype=float)
    points, areas = map(np.concatenate, zip(*covering_pieces(flat, 0.5), strict=True))
    assert np.isfinite(points).all()
    assert points[:, 0].max() == pytest.approx(1.75)
    assert not areas.any()


def test_chunks_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_CHUNK", 1000)
    many = np.repeat(TRIANGLE, 50, axis=0)
    sizes = [len(chunk) for chunk, _ in covering_pieces(many, 0.3)]
    assert max(sizes) <= 1000
    assert len(sizes) > 1
