"""The three factors against the dense inverse."""

import numpy as np
import pytest
import scipy.sparse as sp

from tribrach.network import linear
from tribrach.network.selected_inverse import look_up, selected_inverse


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


def factor_of(way: str, normal: sp.csc_array, point_of: np.ndarray) -> linear.Factor:
    scale = 1 / np.sqrt(normal.diagonal())
    return {
        "dense": lambda: linear.DenseFactor(normal.toarray(), scale),
        "schur": lambda: linear.SchurFactor(normal, scale, point_of >= 0, point_of),
        "sparse": lambda: linear.SparseFactor(normal, scale),
    }[way]()


@pytest.mark.parametrize("way", ["dense", "schur", "sparse"])
def test_solutions_and_entries_are_those_of_the_inverse(way: str) -> None:
    rng = np.random.default_rng(1)
    normal, point_of = scanner_like(30, 7, rng)
    # unknowns of very different size: a factor must not care
    units = 10.0 ** rng.uniform(-4, 4, normal.shape[0])
    normal = sp.csc_array(sp.diags_array(units) @ normal @ sp.diags_array(units))
    truth = np.linalg.inv(normal.toarray() / units[:, None] / units) / units[:, None] / units
    factor = factor_of(way, normal, point_of)
    i, j = pairs(len(truth))
    size = np.sqrt(np.diag(truth))
    error = (factor.entries(i, j) - truth[i, j]) / size[i] / size[j]
    assert np.abs(error).max() < 1e-9
    b = rng.normal(size=(len(truth), 3)) * units[:, None]
    assert np.abs((factor.solve(b) - truth @ b) / size[:, None]).max() < 1e-8
    assert np.allclose(factor.solve(b[:, 0]), factor.solve(b)[:, 0])


@pytest.mark.parametrize("way", ["dense", "schur", "sparse"])
@pytest.mark.parametrize("width", [1, 3, 12])
def test_forms_are_those_of_the_inverse(way: str, width: int) -> None:
    """Groups of sparse columns whose rows nothing observes together, and all columns as one."""
    rng = np.random.default_rng(4)
    normal, point_of = scanner_like(30, 7, rng)
    units = 10.0 ** rng.uniform(-4, 4, normal.shape[0])
    normal = sp.csc_array(sp.diags_array(units) @ normal @ sp.diags_array(units))
    truth = np.linalg.inv(normal.toarray() / units[:, None] / units) / units[:, None] / units
    factor = factor_of(way, normal, point_of)
    dense = np.where(rng.random((len(units), 12)) < 0.1, rng.normal(size=(len(units), 12)), 0.0)
    columns = dense * units[:, None]
    expected = [columns[:, k : k + width] for k in range(0, 12, width)]
    got = factor.forms(sp.csc_array(columns), width)
    assert got.shape == (12 // width, width, width)
    for form, b in zip(got, expected, strict=True):
        assert np.allclose(form, b.T @ truth @ b, rtol=1e-9, atol=1e-9)
    assert factor.forms(sp.csc_array((len(units), 0)), width).shape == (0, width, width)


@pytest.mark.parametrize("kept", [4, 4000])
def test_unknowns_without_any_connection_have_no_common_entry(kept: int, monkeypatch) -> None:
    """Two networks in one matrix; few and many half solutions are kept at a time."""
    monkeypatch.setattr(linear, "_SPARSE", kept)
    rng = np.random.default_rng(5)
    one, other = scanner_like(12, 4, rng)[0], scanner_like(9, 3, rng)[0]
    normal = sp.csc_array(sp.block_diag([one, other]))
    factor = linear.SparseFactor(normal, 1 / np.sqrt(normal.diagonal()))
    i, j = pairs(normal.shape[0])
    truth = np.linalg.inv(normal.toarray())
    assert np.abs(factor.entries(i, j) - truth[i, j]).max() < 1e-10
    apart = (i < one.shape[0]) != (j < one.shape[0])
    assert (factor.entries(i[apart], j[apart]) == 0).all()


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
    normal, point_of = scanner_like(680, 5, rng)
    assert isinstance(linear.factorise(normal, point_of), linear.SchurFactor)
    chain = sp.diags_array(
        [np.full(2999, -1.0), np.full(3000, 2.5), np.full(2999, -1.0)], offsets=[-1, 0, 1]
    )
    number = np.arange(3000) // 3
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


def factor_with_pattern(normal: np.ndarray) -> tuple[sp.csc_array, np.ndarray]:
    """L without its diagonal and D; every place that elimination may fill is stored."""
    pattern = normal != 0
    for j in range(len(normal)):
        below = np.flatnonzero(pattern[j + 1 :, j]) + j + 1
        pattern[np.ix_(below, below)] = True
    lower = np.linalg.cholesky(normal)
    row, column = np.nonzero(np.tril(pattern, -1))
    unit = lower / np.diag(lower)
    stored = sp.csc_array((unit[row, column], (row, column)), shape=normal.shape)
    stored.sort_indices()
    return stored, np.diag(lower) ** 2


@pytest.mark.parametrize("widest", [1, 3, 7, 256])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_selected_entries_are_those_of_the_inverse(seed: int, widest: int) -> None:
    """Panels and strips of several widths; the last unknowns are all coupled."""
    rng = np.random.default_rng(seed)
    n = 80
    design = np.where(rng.random((70, n)) < 0.03, rng.normal(size=(70, n)), 0.0)
    normal = design.T @ design + np.eye(n)
    normal[60:, 60:] += 0.1
    lower, d = factor_with_pattern(normal)
    truth = np.linalg.inv(normal)
    value, diagonal = selected_inverse(lower.indptr, lower.indices, lower.data, d, widest)
    column = np.repeat(np.arange(n), np.diff(lower.indptr))
    assert value == pytest.approx(truth[lower.indices, column], abs=1e-13)
    assert diagonal == pytest.approx(np.diag(truth), abs=1e-13)
    # and where they are not stored there is nothing to find
    i, j = (a.ravel() for a in np.tril_indices(n))
    found = look_up(lower.indptr, lower.indices, value, diagonal, i, j)
    stored = (i == j) | (lower.toarray()[i, j] != 0)
    assert np.isnan(found[~stored]).any()
    assert found[stored] == pytest.approx(truth[i, j][stored], abs=1e-13)


@pytest.mark.parametrize("way", ["dense", "schur", "sparse"])
def test_blocks_are_those_of_the_inverse(way: str) -> None:
    """Unknowns that are observed together and others, and places without an unknown."""
    rng = np.random.default_rng(6)
    normal, point_of = scanner_like(20, 5, rng)
    factor, truth = factor_of(way, normal, point_of), np.linalg.inv(normal.toarray())
    columns = rng.integers(-1, len(truth), (40, 5))
    expected = truth[columns[:, :, None], columns[:, None, :]]
    expected[(columns[:, :, None] < 0) | (columns[:, None, :] < 0)] = 0.0
    assert np.abs(factor.blocks(columns) - expected).max() < 1e-10
