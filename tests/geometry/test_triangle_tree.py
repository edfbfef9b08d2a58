"""Distances to models: those of trimesh, closed forms, whatever the order of triangles."""

import numpy as np
import pytest
import trimesh

from tribrach.geometry.mesh import Mesh
from tribrach.geometry.triangle_tree import TriangleTree


def soup(rng: np.random.Generator, count: int) -> np.ndarray:
    middle = rng.uniform(-20, 20, (count, 1, 3))
    return middle + rng.normal(0, 1, (count, 3, 3)) * rng.uniform(0.01, 3, (count, 1, 1))


@pytest.mark.parametrize("count", [1, 7, 9, 500])
def test_distances_are_those_of_trimesh(count: int) -> None:
    rng = np.random.default_rng(count)
    triangles = soup(rng, count)
    points = rng.uniform(-25, 25, (400, 3))
    # also on corners, edges and faces
    points[:50] = triangles[rng.integers(0, count, 50), rng.integers(0, 3, 50)]
    points[50:100] = triangles[rng.integers(0, count, 50)].mean(axis=1)
    far = np.full(len(points), np.inf)
    for triangle in triangles:
        again = np.broadcast_to(triangle, (len(points), 3, 3))
        place = trimesh.triangles.closest_point(again, points)
        far = np.minimum(far, np.linalg.norm(place - points, axis=1))
    shift = np.array([500_000.0, 5_000_000.0, 300.0])
    for origin, most in ((np.zeros(3), 1e-12), (shift, 1e-9)):
        found = TriangleTree(Mesh.of([("a", triangles + origin)])).nearest(points + origin)
        # coordinates of five millions are no sharper than a nanometre themselves
        assert np.abs(found.signed) == pytest.approx(far, abs=2 * most)
        there = np.linalg.norm(found.place - points - origin, axis=1)
        assert there == pytest.approx(far, abs=4 * most)


def test_signs_and_ties_at_the_edges_of_a_box() -> None:
    box = trimesh.creation.box((2, 4, 6))
    mesh = Mesh.of([("box", np.asarray(box.triangles))])
    tree = TriangleTree(mesh)
    rng = np.random.default_rng(1)
    inside = rng.uniform(-0.99, 0.99, (300, 3)) * [1, 2, 3]
    found = tree.nearest(inside)
    assert found.signed == pytest.approx(-(np.array([1, 2, 3]) - np.abs(inside)).min(axis=1))
    assert found.facing == pytest.approx(np.ones(300))
    outside = rng.uniform(-5, 5, (300, 3))
    gap = np.maximum(np.abs(outside) - [1, 2, 3], 0)
    outside, gap = outside[gap.max(axis=1) > 0], gap[gap.max(axis=1) > 0]
    found = tree.nearest(outside)
    assert found.signed == pytest.approx(np.linalg.norm(gap, axis=1))
    # beside an edge the face that looks more towards the point is taken
    near = tree.nearest(np.array([[1.1, 2.001, 0.0], [1.001, 2.1, 0.0]]))
    assert mesh.normals[near.triangle] == pytest.approx(np.array([[1, 0, 0], [0, 1, 0]]))


def test_nothing_beyond_the_limit() -> None:
    mesh = Mesh.of([("a", np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], float))])
    found = TriangleTree(mesh).nearest(np.array([[0.2, 0.2, 0.09], [0.2, 0.2, -0.11]]), 0.1)
    assert found.triangle.tolist() == [0, -1]
    assert found.signed[0] == pytest.approx(0.09)
    assert np.isnan(found.signed[1])
