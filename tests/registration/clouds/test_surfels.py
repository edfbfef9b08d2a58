"""Cubes, surfels and views: sums against numpy, planes against their definition."""

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp
from tribrach.registration.clouds.prepared import BEHIND, SEEN_THROUGH, UNSEEN, RangeView, prepare
from tribrach.registration.clouds.surfels import CellSum, CubeSums, coarser, surfels_of


def summed(xyz: np.ndarray, size: float, chunk: int = 700) -> CubeSums:
    cubes = CellSum(size)
    for first in range(0, len(xyz), chunk):
        cubes.add(xyz[first : first + chunk])
    return cubes.cells


def sorted_moments(cells: CubeSums) -> np.ndarray:
    return cells.moments[np.argsort(cells.keys)]


@pytest.fixture(scope="module")
def points() -> np.ndarray:
    return np.random.default_rng(1).normal((100, -50, 7), 3, (50_000, 3))


def test_moments_are_those_of_the_points_in_each_cube(points: np.ndarray) -> None:
    cells = summed(points, 1.0)
    number = np.floor(points).astype(int)
    _, group = np.unique(number, axis=0, return_inverse=True)
    count = np.bincount(group.ravel())
    assert len(cells) == len(count)
    assert cells.moments[:, 0].sum() == len(points)
    middle = cells.middles
    k = int(np.argmax(cells.moments[:, 0]))
    inside = points[(np.abs(points - middle[k]) <= 0.5).all(axis=1)] - middle[k]
    assert cells.moments[k, 0] == len(inside)
    assert np.allclose(cells.moments[k, 1:4], inside.sum(axis=0))
    products = inside.T @ inside
    assert np.allclose(cells.moments[k, 4:], products[np.triu_indices(3)])


def test_merged_cubes_are_the_cubes_of_twice_the_size(points: np.ndarray) -> None:
    merged, direct = coarser(summed(points, 0.5)), summed(points, 1.0)
    assert merged.size == 1.0
    assert np.array_equal(np.sort(merged.keys), np.sort(direct.keys))
    assert np.allclose(sorted_moments(merged), sorted_moments(direct), atol=1e-9)


def test_no_more_cubes_than_there_is_room_for(points: np.ndarray) -> None:
    cubes = CellSum(0.1, most=2000)
    cubes.add(points)
    assert len(cubes.cells) <= 2000
    assert cubes.size > 0.1
    assert cubes.cells.moments[:, 0].sum() == len(points)


def test_what_is_no_point_is_left_out(points: np.ndarray) -> None:
    bad = points.copy()
    bad[::10, 1] = np.nan
    bad[5, 0] = np.inf
    bad[7] = 1e12
    assert summed(bad, 1.0).moments[:, 0].sum() == 45_000 - 2


def test_a_surfel_is_the_plane_of_its_points() -> None:
    rng = np.random.default_rng(2)
    flat = np.column_stack([rng.uniform(-2, 2, (200_000, 2)), rng.normal(0, 0.002, 200_000)])
    pose = Pose(exp(np.array([0.3, -0.2, 0.5])), np.array([1.0, 8.0, -3.0]))
    s = surfels_of(summed(pose @ flat, 0.2))
    normal = pose.rotation[:, 2] * -np.sign(pose.rotation[:, 2] @ pose.translation)
    good = (s.count > 200) & (s.size < 0.3)
    assert good.sum() > 200
    assert (s.normal[good] @ normal > np.cos(0.02)).all()
    offset = (s.center[good] - pose.translation) @ normal
    assert np.abs(offset / s.sigma_offset[good]).max() < 5
    assert (offset / s.sigma_offset[good]).std() == pytest.approx(1.0, abs=0.15)
    assert np.median(s.thickness[good]) == pytest.approx(0.002, rel=0.03)


def test_edges_and_leaves_are_no_surfels() -> None:
    rng = np.random.default_rng(3)
    leaves = rng.uniform(-1, 1, (20_000, 3))
    assert len(surfels_of(summed(leaves, 0.4), merges=0)) < 10


def test_a_view_knows_what_it_looked_through() -> None:
    rng = np.random.default_rng(4)
    direction = rng.normal(0, 1, (400_000, 3))
    direction = direction[direction[:, 0] > 0.3 * np.linalg.norm(direction, axis=1)]
    view = RangeView()
    view.add(10 * direction / np.linalg.norm(direction, axis=1, keepdims=True))
    view.settle()
    places = np.array([[6.0, 1, 0], [14.0, 0, 1], [-5.0, 0, 0], [10.0, 0, 0]])
    said = view.judge(places, np.full(4, 0.3))
    assert said[:3].tolist() == [SEEN_THROUGH, BEHIND, UNSEEN]
    assert said[3] not in (SEEN_THROUGH, BEHIND, UNSEEN)


def test_a_scan_without_surfaces_is_refused() -> None:
    with pytest.raises(InputError, match="scan T has 30 points"):
        prepare("T", [np.random.default_rng(5).normal(0, 5, (30, 3))])
