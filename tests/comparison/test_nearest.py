"""Nearest neighbours against scipy, in any order and far from the origin."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tribrach.comparison.nearest import Neighbours, nearest
from tribrach.comparison.streams import Spool

UTM = np.array([505_123.4, 2_331_456.7, 20.0])


def scan(points: int, place: np.ndarray, seed: int) -> np.ndarray:
    """A room in columns, with noise."""
    rng = np.random.default_rng(seed)
    rows = int(np.sqrt(points / 2))
    i = np.arange(rows * (points // rows))
    h = (i // rows + 0.5) * 2 * np.pi / (points // rows)
    v = np.radians(30 + 100 * (i % rows + 0.4) / rows)
    d = np.stack([np.sin(v) * np.cos(h), np.sin(v) * np.sin(h), np.cos(v)], axis=1)
    wall = np.where(d >= 0, np.array([9, 7, 3.0]) - place, np.array([-9, -7, -2.0]) - place) / d
    return d * (wall.min(axis=1) + rng.normal(0, 2e-3, len(i)))[:, None] + place


A = scan(24_000, np.array([2.0, 1.0, 0.0]), 0)
B = scan(30_000, np.array([-3.0, -2.0, 0.2]), 1)


@pytest.mark.parametrize("shuffled", [False, True])
@pytest.mark.parametrize("shift", [np.zeros(3), UTM])
def test_distances_are_those_of_scipy(shuffled: bool, shift: np.ndarray) -> None:
    expected, where = cKDTree(B).query(A)
    rng = np.random.default_rng(2)
    p = rng.permutation(len(A)) if shuffled else np.arange(len(A))
    q = rng.permutation(len(B)) if shuffled else np.arange(len(B))
    distances, found = nearest(A[p] + shift, B[q] + shift)
    # a coordinate of two million metres has steps of half a nanometre
    assert distances == pytest.approx(expected[p], abs=1e-12 if not shift.any() else 2e-9)
    assert (q[found] == where[p]).mean() > (0.9999 if shift.any() else 0.999999)


def test_limit() -> None:
    expected = cKDTree(B).query(A)[0]
    distances, found = nearest(A, B, 0.05)
    near = expected < 0.05
    assert 0.1 < near.mean() < 0.95
    assert (np.isfinite(distances) == near).all()
    assert distances[near] == pytest.approx(expected[near], abs=1e-12)
    assert (found[~near] == len(B)).all()
    assert (found[near] < len(B)).all()


@pytest.mark.parametrize("shuffled", [False, True])
def test_several_neighbours(shuffled: bool) -> None:
    q = np.random.default_rng(3).permutation(len(B)) if shuffled else np.arange(len(B))
    expected = cKDTree(B).query(A[::50], k=7)[0]
    distances, found = Neighbours(B[q]).query(A[::50], k=7)
    assert distances == pytest.approx(expected, abs=1e-12)
    assert np.linalg.norm(B[q][found] - A[::50, None], axis=2) == pytest.approx(expected)


def test_fewer_points_than_neighbours() -> None:
    distances, found = Neighbours(B[:3]).query(A[:2], k=5)
    assert np.isfinite(distances[:, :3]).all()
    assert np.isinf(distances[:, 3:]).all()
    assert (found[:, 3:] == 3).all()


def test_nothing_to_find_and_nothing_to_ask() -> None:
    distances, found = nearest(A[:5], np.empty((0, 3)))
    assert np.isinf(distances).all()
    assert (found == 0).all()
    assert len(nearest(np.empty((0, 3)), B)[0]) == 0


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("rows", [5, 250_000])
def test_numbers_that_are_none_are_refused(bad: float, rows: int) -> None:
    """A search at NaN would never end."""
    spoiled = np.zeros((rows, 3))
    spoiled[-2, 1] = bad
    with pytest.raises(ValueError, match="finite"):
        nearest(spoiled, B)
    with pytest.raises(ValueError, match="finite"):
        nearest(A, spoiled)


def test_spool(tmp_path: Path) -> None:
    spool = Spool(tmp_path, 2)
    spool.add(1, A[:10])
    spool.add(1, A[10:13])
    assert (spool.points(1) == A[:13]).all()
    assert spool.counts == [0, 13]
    assert len(spool.points(0)) == 0
    spool.drop(1)
    assert list(tmp_path.iterdir()) == []
