import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tribrach.comparison.point_cells import PointCells, ball_ranges, cylinder_ranges


def members(ranges: np.ndarray) -> np.ndarray:
    return np.concatenate([np.arange(a, b) for a, b in ranges]) if len(ranges) else np.zeros(0, int)


@settings(deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.floats(0.02, 3.0),
    st.floats(0.02, 1.0),
    st.floats(0.02, 2.0),
)
def test_every_point_of_the_body_is_in_one_range(seed, size, radius, depth) -> None:
    rng = np.random.default_rng(seed)
    # coordinates on a coarse lattice lie on the edges of cells
    xyz = np.round(rng.uniform(-2, 2, (300, 3)), rng.integers(0, 4))
    cells = PointCells.of(xyz, size)
    assert np.array_equal(cells.xyz, xyz[cells.order])
    assert np.array_equal(np.sort(cells.order), np.arange(300))
    centre, normal = rng.uniform(-2.5, 2.5, 3), rng.normal(size=3)
    if rng.uniform() < 0.3:
        normal = np.eye(3)[rng.integers(3)]
    normal /= np.linalg.norm(normal)
    offset = cells.xyz - centre
    along = offset @ normal
    across = np.linalg.norm(offset - along[:, None] * normal, axis=1)
    inside = np.flatnonzero((np.abs(along) <= depth) & (across <= radius))
    found = members(cylinder_ranges(centre, normal, radius, depth, cells.arrays))
    assert len(np.unique(found)) == len(found)
    assert np.isin(inside, found).all()
    near = np.flatnonzero(np.linalg.norm(offset, axis=1) <= radius)
    found = members(ball_ranges(centre, radius, cells.arrays))
    assert len(np.unique(found)) == len(found)
    assert np.isin(near, found).all()


def test_ranges_are_tight() -> None:
    rng = np.random.default_rng(1)
    xyz = rng.uniform(0, 10, (200_000, 3)) * [1, 1, 0]
    cells = PointCells.of(xyz, 0.5)
    found = members(cylinder_ranges(np.full(3, 5.0), np.eye(3)[2], 0.5, 1.0, cells.arrays))
    # a disc of diameter 1 touches at most nine cells of 0.25 square metres
    assert len(found) < 1.05 * 9 * 0.25 * 2000


def test_far_points_make_the_cells_larger_and_not_the_tables() -> None:
    xyz = np.array([[0, 0, 0], [1e6, 2e6, 3e5], [0.01, 0, 0]], float)
    cells = PointCells.of(xyz, 0.01)
    assert len(cells.base) <= (1 << 24) + 1
    assert len(cells.start) <= (1 << 21)
    found = members(ball_ranges(np.zeros(3), 0.02, cells.arrays))
    assert np.isin([0, 2], cells.order[found]).all()


def test_no_points() -> None:
    cells = PointCells.of(np.empty((0, 3)), 0.1)
    assert len(ball_ranges(np.zeros(3), 1.0, cells.arrays)) == 0
    assert len(cylinder_ranges(np.zeros(3), np.eye(3)[0], 1.0, 1.0, cells.arrays)) == 0


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_every_cell_holds_its_points(axis) -> None:
    xyz = np.roll(np.random.default_rng(2).uniform(0, 3, (5000, 3)) * [1, 1, 0.01], axis, axis=1)
    cells = PointCells.of(xyz, 0.2)
    place = np.floor((cells.xyz - cells.corner) / cells.size).astype(int)
    column = place[:, 0] * cells.shape[1] + place[:, 1]
    cell = cells.base[column] + place[:, 2] - cells.lowest[column]
    assert (np.diff(cell) >= 0).all()
    assert np.array_equal(np.searchsorted(cell, np.arange(len(cells.start))), cells.start)
