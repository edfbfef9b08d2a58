"""The order of elimination, the pattern that fills in and the factor, against dense matrices."""

import numpy as np
import pytest
import scipy.sparse as sp

from tribrach.network.elimination_order import elimination_order, filled_pattern, panels
from tribrach.network.linear import SingularMatrix, SparseFactor
from tribrach.network.panel_factor import panel_factor, solve_factored


def grid(side: int) -> sp.csc_array:
    """Pattern of points on a grid, three columns each, tied to their neighbours."""
    index = np.arange(side * side).reshape(side, side)
    a = np.r_[index[:, :-1].ravel(), index[:-1].ravel()]
    b = np.r_[index[:, 1:].ravel(), index[1:].ravel()]
    one = sp.coo_array((np.full(len(a), -1.0), (a, b)), shape=(side**2, side**2))
    graph = one + one.T
    return sp.csc_array(sp.kron(graph + sp.diags_array(np.full(side**2, 4.5)), np.ones((3, 3))))


def drawn(n: int, seed: int, density: float = 0.02) -> sp.csc_array:
    """A positive definite matrix of random pattern."""
    rng = np.random.default_rng(seed)
    design = sp.random_array((n, n), density=density, rng=rng)
    return sp.csc_array(design.T @ design + 0.01 * sp.eye_array(n))


def filled(pattern: np.ndarray) -> np.ndarray:
    """Where elimination fills in, column by column as in the textbooks."""
    out = pattern.copy()
    for j in range(len(out)):
        below = np.flatnonzero(out[j + 1 :, j]) + j + 1
        out[np.ix_(below, below)] = True
    return np.tril(out, -1)


@pytest.mark.parametrize("matrix", [grid(6), drawn(90, 1), drawn(90, 2, 0.2)])
def test_pattern_is_that_of_elimination(matrix: sp.csc_array) -> None:
    order = elimination_order(matrix)
    assert sorted(order) == list(range(matrix.shape[0]))
    ordered = sp.csc_array(matrix[order][:, order])
    indptr, indices = filled_pattern(ordered)
    found = sp.csc_array((np.ones(len(indices)), indices, indptr), shape=matrix.shape).toarray()
    assert np.array_equal(found > 0, filled(ordered.toarray() != 0))


def test_order_keeps_the_fill_low() -> None:
    """Grids fill with n log n, and by far less than in the order they come in."""
    matrix = grid(40)
    order = elimination_order(matrix)
    _, indices = filled_pattern(sp.csc_array(matrix[order][:, order]))
    matrix.sort_indices()
    _, as_given = filled_pattern(matrix)
    assert len(indices) < 0.4 * len(as_given)
    # 31/4 n log2 n is the bound of nested dissection on a grid (George 1973), for single columns
    assert len(indices) < 9 * 31 / 4 * 1600 * np.log2(40)


def test_columns_of_a_point_stand_side_by_side() -> None:
    order = elimination_order(grid(8))
    assert np.array_equal(order[::3] // 3, order[2::3] // 3)


@pytest.mark.parametrize("widest", [1, 4, 64])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_factor_is_that_of_the_dense_matrix(seed: int, widest: int) -> None:
    matrix = drawn(120, seed, 0.03)
    order = elimination_order(matrix)
    ordered = sp.csc_array(matrix[order][:, order])
    lower, d = panel_factor(ordered, widest)
    assert np.diff(panels(lower.indptr, lower.indices, widest)).max() <= widest
    unit = lower.toarray() + np.eye(120)
    assert unit * d @ unit.T == pytest.approx(ordered.toarray(), abs=1e-13)
    b = np.arange(120.0)
    assert ordered @ solve_factored(lower, d, b) == pytest.approx(b, abs=1e-9)


def test_small_pivots_keep_their_digits() -> None:
    """Nearly dependent columns within a panel: what is left of them is that of their difference."""
    rng = np.random.default_rng(4)
    design = rng.normal(size=(60, 30))
    design[:, 7] = design[:, 6] + 1e-5 * rng.normal(size=60)
    matrix = design.T @ design
    scale = 1 / np.sqrt(np.diag(matrix))
    factor = SparseFactor(sp.csc_array(matrix), scale)
    inverse = np.linalg.inv(matrix * scale[:, None] * scale)
    # a pivot is one over the diagonal of the inverse for the column that comes last
    assert factor.smallest_pivot >= 1 / np.diag(inverse).max() * (1 - 1e-4)
    assert factor.smallest_pivot < 1e-9
    b = matrix @ np.ones(30)
    left = matrix @ factor.solve(b) - b
    assert np.abs(left).max() < 1e-12 * np.abs(b).max()


@pytest.mark.parametrize("value", [-0.5, 0.0, np.nan])
def test_pivots_that_are_not_positive_are_refused(value: float) -> None:
    lower, d = panel_factor(sp.csc_array(sp.diags_array([1.0, value, 2.0])))
    assert lower.nnz == 0
    assert d[0] == 1
    assert not d.min() > 0
    for diagonal in ([1.0, value, 2.0], [1.0, 2.0, value]):
        with pytest.raises(SingularMatrix, match="not positive"):
            SparseFactor(sp.csc_array(sp.diags_array(diagonal)), np.ones(3))
