"""Elimination by fronts against dense matrices."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from tribrach.network.elimination import Elimination, eliminate


def multiplied(found: Elimination) -> np.ndarray:
    """``P^T L D L^T P``, dense."""
    n = len(found.d)
    triple = found.data, found.indices, found.indptr
    lower = sp.csc_array(triple, shape=(n, n)).toarray() + np.eye(n)
    assert (np.triu(lower, 1) == 0).all()
    return ((lower * found.d) @ lower.T)[np.ix_(found.place, found.place)]


def network(sizes: list[int], ties: list[tuple[int, int]], seed: int) -> sp.csc_array:
    """Positive definite matrix of points with so many unknowns each, some of them tied."""
    rng = np.random.default_rng(seed)
    begin = np.concatenate([[0], np.cumsum(sizes)])
    matrix = 0.1 * np.eye(begin[-1])
    for a, b in [*((k, k) for k in range(len(sizes))), *ties]:
        both = np.unique(np.r_[begin[a] : begin[a + 1], begin[b] : begin[b + 1]])
        row = np.zeros((len(both), begin[-1]))
        row[:, both] = rng.normal(size=(len(both), len(both)))
        matrix += row.T @ row
    return sp.csc_array(matrix)


@settings(deadline=None)  # compiled when it is first called
@given(data=st.data(), seed=st.integers(0, 99))
def test_the_factor_multiplies_to_the_matrix(data: st.DataObject, seed: int) -> None:
    """Points with one to four unknowns, tied at random, in one part or several."""
    sizes = data.draw(st.lists(st.integers(1, 4), min_size=1, max_size=25))
    end = st.integers(0, len(sizes) - 1)
    ties = data.draw(st.lists(st.tuples(end, end), max_size=60))
    matrix = network(sizes, ties, seed)
    found = eliminate(matrix)
    assert sorted(found.place) == list(range(matrix.shape[0]))
    assert (found.d > 0).all()
    dense = matrix.toarray()
    assert np.abs(multiplied(found) - dense).max() < 1e-12 * np.abs(dense).max()


def test_a_full_matrix_takes_several_panels() -> None:
    rng = np.random.default_rng(1)
    a = rng.normal(size=(150, 170))
    matrix = a @ a.T
    found = eliminate(sp.csc_array(matrix))
    assert np.abs(multiplied(found) - matrix).max() < 1e-11 * np.abs(matrix).max()


def test_rows_in_any_order_and_values_that_change() -> None:
    """A pattern that is known serves other values; another pattern of the same size does not."""
    first = network([3, 1, 3, 2], [(0, 1), (1, 2), (2, 3)], 1)
    second = network([3, 1, 3, 2], [(0, 1), (1, 2), (2, 3)], 2)
    other = network([3, 1, 3, 2], [(0, 3), (1, 3), (2, 3)], 3)
    for matrix in (first, second, other, first):
        turned = sp.csc_array(matrix[::-1][::-1])  # rows of a column are not in order
        assert np.allclose(multiplied(eliminate(turned)), matrix.toarray())


@pytest.mark.parametrize("side", [2, 9])
def test_a_matrix_that_is_not_positive_definite_shows_in_its_pivots(side: int) -> None:
    difference = sp.diags_array(
        [np.full(side - 1, -1.0), np.ones(side - 1)], offsets=[0, 1], shape=(side - 1, side)
    )
    for sign in (1.0, -1.0):
        matrix = sp.csc_array(sign * (difference.T @ difference))
        assert eliminate(matrix).d.min() < 1e-12
