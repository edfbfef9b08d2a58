"""The three factors against the dense inverse."""

import numpy as np
import pytest
import scipy.sparse as sp

from tribrach.network import linear


def scanner_like(
    points: int, stations: int, rng: np.random.Generator
) -> tuple[sp.csc_array, np.ndarray]:
    """Normal matrix of points seen from stations, every station column with some prior."""
    size = 3 * points + 6 * stations
    rows = []
    for p in range(points):
        for s in rng.choice(stations, min(4, stations), replace=False):
            block = np.zeros((3, size))
            block[:, 3 * p : 3 * p + 3] = rng.normal(size=(3, 3))
            block[:, 3 * points + 6 * s : 3 * points + 6 * s + 6] = rng.normal(size=(3, 6))
            rows.append(block)
    design = sp.csr_array(np.vstack([*rows, np.eye(size)[3 * points :]]))
    point_of = np.concatenate([np.repeat(np.arange(points), 3), np.full(6 * stations, -1)])
    return sp.csc_array(design.T @ design), point_of


def pairs(size: int) -> tuple[np.ndarray, np.ndarray]:
    i, j = np.meshgrid(np.arange(size), np.arange(size))
    return i.ravel(), j.ravel()


@pytest.mark.parametrize("way", ["dense", "schur", "sparse"])
def test_solutions_and_entries_are_those_of_the_inverse(way: str) -> None:
    rng = np.random.default_rng(1)
    normal, point_of = scanner_like(30, 7, rng)
    # unknowns of very different size: a factor must not care
    units = 10.0 ** rng.uniform(-4, 4, normal.shape[0])
    normal = sp.csc_array(sp.diags_array(units) @ normal @ sp.diags_array(units))
    truth = np.linalg.inv(normal.toarray() / units[:, None] / units) / units[:, None] / units
    scale = 1 / np.sqrt(normal.diagonal())
    factor = {
        "dense": lambda: linear.DenseFactor(normal.toarray(), scale),
        "schur": lambda: linear.SchurFactor(normal, scale, point_of >= 0, point_of),
        "sparse": lambda: linear.SparseFactor(normal, scale),
    }[way]()
    i, j = pairs(len(truth))
    size = np.sqrt(np.diag(truth))
    error = (factor.entries(i, j) - truth[i, j]) / size[i] / size[j]
    assert np.abs(error).max() < 1e-9
    b = rng.normal(size=(len(truth), 3)) * units[:, None]
    assert np.abs((factor.solve(b) - truth @ b) / size[:, None]).max() < 1e-8
    assert np.allclose(factor.solve(b[:, 0]), factor.solve(b)[:, 0])


def test_points_with_fixed_coordinates_are_eliminated_as_smaller_blocks() -> None:
    rng = np.random.default_rng(2)
    normal, point_of = scanner_like(12, 4, rng)
    keep = np.ones(len(point_of), dtype=bool)
    keep[[1, 6, 7, 20]] = False
    normal, point_of = sp.csc_array(normal[keep][:, keep]), point_of[keep]
    truth = np.linalg.inv(normal.toarray())
    factor = linear.SchurFactor(normal, 1 / np.sqrt(normal.diagonal()), point_of >= 0, point_of)
    i, j = pairs(len(truth))
    assert np.abs(factor.entries(i, j) - truth[i, j]).max() < 1e-10


def test_structure_chooses_the_factor() -> None:
    rng = np.random.default_rng(3)
    normal, point_of = scanner_like(400, 5, rng)
    assert isinstance(linear.factorise(normal, point_of), linear.SchurFactor)
    chain = sp.diags_array(
        [np.full(1499, -1.0), np.full(1500, 2.5), np.full(1499, -1.0)], offsets=[-1, 0, 1]
    )
    number = np.arange(1500) // 3
    assert isinstance(linear.factorise(sp.csc_array(chain), number), linear.SparseFactor)
    small, number = scanner_like(5, 2, rng)
    assert isinstance(linear.factorise(small, number), linear.DenseFactor)


@pytest.mark.parametrize("size", [6, 1200])
def test_a_singular_matrix_is_refused(size: int) -> None:
    # a chain of differences without a datum
    difference = sp.diags_array(
        [np.full(size - 1, -1.0), np.ones(size - 1)], offsets=[0, 1], shape=(size - 1, size)
    )
    normal = sp.csc_array(difference.T @ difference)
    try:
        factor = linear.factorise(normal, np.full(size, -1))
    except linear.SingularMatrix:
        return
    assert factor.smallest_pivot < linear.PIVOT_LIMIT


def test_an_unknown_without_observation_is_refused() -> None:
    with pytest.raises(linear.SingularMatrix, match="observed by nothing"):
        linear.factorise(sp.csc_array(np.diag([1.0, 0.0, 2.0])), np.full(3, -1))
