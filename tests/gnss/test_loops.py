"""Loops of baselines: how many, how short, how they close; independent baselines of sessions.

Truth: Euler's count of independent loops, enumeration of all loops of small networks, baselines
made from coordinates, Monte Carlo of the closures.
"""

import itertools

import numpy as np
import pytest
from scipy.stats import chi2

from tribrach._types import Array
from tribrach.gnss.loops import close_loops, minimal_loops, triangles
from tribrach.gnss.sessions import independent_baselines, session_covariance


def network(sides: list[tuple[int, int]], seed: int = 1) -> tuple[Array, ...]:
    """Start, end and vectors of sides between random points."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 1000, (1 + max(map(max, sides)), 3))
    start, end = np.array(sides).T
    return start, end, points[end] - points[start]


def closed(walks: list[tuple[tuple[int, int], ...]], start: Array, end: Array) -> bool:
    """Each walk comes back to where it started, over sides that follow each other."""
    for walk in walks:
        ends = [(start[k], end[k]) if sign > 0 else (end[k], start[k]) for k, sign in walk]
        if any(ends[i][1] != ends[(i + 1) % len(ends)][0] for i in range(len(ends))):
            return False
    return True


def shortest_basis(start: Array, end: Array, length: Array) -> float:
    """Total length of the shortest basis, from all loops of the network."""
    loops = []
    n = len(start)
    for size in range(2, n + 1):
        for chosen in itertools.combinations(range(n), size):
            ends = [int(p) for k in chosen for p in (start[k], end[k])]
            degree = np.unique(ends, return_counts=True)[1]
            if (degree == 2).all() and _connected(chosen, start, end):
                loops.append((sum(length[k] for k in chosen), sum(1 << k for k in chosen)))
    total, pivots = 0.0, {}
    for size_m, mask in sorted(loops):
        rest = mask
        while rest and rest.bit_length() in pivots:
            rest ^= pivots[rest.bit_length()]
        if rest:
            pivots[rest.bit_length()] = rest
            total += size_m
    return total


def _connected(chosen: tuple[int, ...], start: Array, end: Array) -> bool:
    reached, left = {int(start[chosen[0]])}, set(chosen)
    while True:
        found = {k for k in left if int(start[k]) in reached or int(end[k]) in reached}
        if not found:
            return not left
        reached |= {int(p) for k in found for p in (start[k], end[k])}
        left -= found


NETWORKS = {
    "square with a diagonal": [(0, 1), (1, 2), (3, 2), (3, 0), (0, 2)],
    "two parts": [(0, 1), (1, 2), (2, 0), (4, 5), (6, 5), (6, 4)],
    "all of five": list(itertools.combinations(range(5), 2)),
    "repeated": [(0, 1), (1, 0), (1, 2), (2, 0), (0, 1)],
    "a chain": [(0, 1), (1, 2), (2, 3)],
    "a ladder": [(0, 1), (1, 2), (3, 4), (4, 5), (0, 3), (1, 4), (2, 5)],
}


@pytest.mark.parametrize("case", NETWORKS)
def test_loops_are_a_shortest_basis(case: str) -> None:
    start, end, vectors = network(NETWORKS[case])
    length = np.linalg.norm(vectors, axis=1)
    walks = minimal_loops(start, end, length)
    points = len(np.unique(np.concatenate([start, end])))
    parts = 2 if case == "two parts" else 1
    assert len(walks) == len(start) - points + parts
    assert closed(walks, start, end)
    total = sum(length[k] for walk in walks for k, _ in walk)
    assert total == pytest.approx(shortest_basis(start, end, length))
    loops = close_loops(walks, start, end, vectors, np.tile(1e-6 * np.eye(3), (len(start), 1, 1)))
    assert max((loop.size for loop in loops), default=0) < 1e-9


def test_large_networks_get_as_many_loops() -> None:
    rng = np.random.default_rng(5)
    sides = [(k, k + 1) for k in range(599)] + [
        tuple(sorted(rng.choice(600, 2, replace=False))) for _ in range(900)
    ]
    start, end, vectors = network(list(dict.fromkeys(sides)))
    walks = minimal_loops(start, end, np.linalg.norm(vectors, axis=1))
    assert len(walks) == len(start) - 600 + 1
    assert closed(walks, start, end)


def test_triangles() -> None:
    start, end, _ = network(NETWORKS["all of five"])
    found = triangles(start, end)
    assert len(found) == 10
    assert closed(found, start, end)
    assert not triangles(*network(NETWORKS["a ladder"])[:2])


def test_closure_of_a_triangle_by_hand() -> None:
    start, end = np.array([0, 1, 0]), np.array([1, 2, 2])
    vectors = np.array([[100.0, 0, 0], [0, 100, 0], [100.0, 100, 0.003]])
    covariance = np.tile(np.diag([1e-6, 1e-6, 4e-6]), (3, 1, 1))
    (loop,) = close_loops(minimal_loops(start, end, np.ones(3)), start, end, vectors, covariance)
    assert loop.size == pytest.approx(0.003)
    assert loop.ppm == pytest.approx(1e6 * 0.003 / (200 + np.sqrt(20000 + 9e-6)))
    assert loop.statistic == pytest.approx(9e-6 / 12e-6)
    assert (loop.dof, loop.passes) == (3, True)
    assert loop.limit == pytest.approx(7.8147, abs=1e-4)


def test_closures_of_correlated_baselines_are_as_stated() -> None:
    """Monte Carlo: the tests of loops over two sessions follow chi-square with three."""
    rng = np.random.default_rng(7)
    positions = rng.uniform(0, 1000, (4, 3))
    trees = [[(0, 1), (0, 2), (2, 3)], [(1, 3), (3, 0), (0, 2)]]
    start, end = np.array(trees[0] + trees[1]).T
    roots = rng.normal(size=(6, 3, 3)) * 1e-3
    single = roots @ roots.transpose(0, 2, 1) + 1e-7 * np.eye(3)
    joint = np.zeros((18, 18))
    joint[:9, :9] = session_covariance(trees[0], single[:3])
    joint[9:, 9:] = session_covariance(trees[1], single[3:])
    truth = positions[end] - positions[start]
    walks = minimal_loops(start, end, np.linalg.norm(truth, axis=1))
    assert len(walks) == 3
    statistics = []
    for noise in rng.multivariate_normal(np.zeros(18), joint, 2000):
        loops = close_loops(walks, start, end, truth + noise.reshape(6, 3), joint)
        statistics.append([loop.statistic for loop in loops])
        assert all(loop.dof == 3 for loop in loops)
    # the mean of 2000 chi-squares of three has a sigma of sqrt(6 / 2000)
    np.testing.assert_allclose(np.mean(statistics, axis=0), 3, atol=3.3 * np.sqrt(6 / 2000))
    share = np.mean(np.array(statistics) > chi2.ppf(0.95, 3), axis=0)
    np.testing.assert_allclose(share, 0.05, atol=3.3 * np.sqrt(0.05 * 0.95 / 2000))


@pytest.mark.parametrize(
    ("tree", "receivers", "walk", "side"),
    [
        ([(0, 1), (1, 2)], [1, 1, 24], [1, 1], 25),
        ([(0, 1), (1, 2)], [3, 3, 3], [1, 1], 6),
        ([(0, 1), (0, 2), (0, 3)], [2, 2, 2, 2], [-1, 0, 1], 4),
        ([(0, 1), (0, 2), (0, 3)], [1, 1, 1, 24], [-1, 0, 1], 25),
        ([(0, 1), (1, 2), (2, 3)], [24, 1, 1, 1], [1, 1, 1], 25),
    ],
)
def test_sides_of_a_session_with_one_bad_receiver(tree, receivers, walk, side) -> None:
    """What was not computed follows from the joint covariance: the sum of both receivers."""
    one = np.diag([1.0, 1.0, 2.0])
    single = np.array([(receivers[a] + receivers[b]) * one for a, b in tree])
    joint = session_covariance(tree, single).reshape(len(tree), 3, len(tree), 3)
    for k in range(len(tree)):
        np.testing.assert_allclose(joint[k, :, k], single[k], atol=1e-9)
    found = np.einsum("a,aibj,b->ij", walk, joint, walk)
    np.testing.assert_allclose(found, side * one, rtol=0.05)


def test_variances_that_no_receivers_have_are_taken() -> None:
    """A good side, a bad one and a good one: no receiver is bad at one end alone."""
    single = np.array([v * np.eye(3) for v in (2.0, 25.0, 2.0)])
    joint = session_covariance([(0, 1), (1, 2), (2, 3)], single)
    assert np.linalg.eigvalsh(joint)[0] > 0
    np.testing.assert_allclose(np.diag(joint), np.repeat([2.0, 25.0, 2.0], 3))


def test_a_loop_of_dependent_baselines_tells_nothing() -> None:
    """All three baselines of one session: the third is the sum of the others."""
    start, end = np.array([0, 1, 0]), np.array([1, 2, 2])
    combine = np.kron([[1, 0], [0, 1], [1, 1]], np.eye(3))
    covariance = combine @ combine.T * 1e-6
    vectors = np.array([[10.0, 0, 0], [0, 10, 0], [10, 10, 0]])
    (loop,) = close_loops(minimal_loops(start, end, np.ones(3)), start, end, vectors, covariance)
    assert (loop.dof, loop.passes) == (0, True)


def test_independent_baselines_are_the_shortest_tree() -> None:
    positions = np.array([[0.0, 0, 0], [1000, 0, 0], [1000, 500, 0], [0, 400, 0]])
    found = independent_baselines(positions, [2])
    assert {frozenset(pair) for pair in found} == {
        frozenset(pair) for pair in ((0, 3), (0, 1), (1, 2))
    }
    # each starts where coordinates are known already
    reached = {2}
    for a, b in found:
        assert a in reached
        reached.add(b)
    assert independent_baselines(positions, [0], star=1) == [(1, 0), (1, 2), (1, 3)]
    assert independent_baselines(np.zeros((2, 3)), []) == [(0, 1)]
    assert independent_baselines(np.zeros((1, 3)), [0]) == []


def test_correlation_of_a_session_is_that_of_receivers() -> None:
    """Equal receiver errors: baselines 0-1 and 0-2 are correlated 1/2, 0-1 and 1-2 by -1/2."""
    receiver = 2e-6 * np.eye(3)
    for tree in ([(0, 1), (0, 2), (2, 3)], [(0, 1), (1, 2), (3, 2)]):
        incidence = np.zeros((3, 4))
        for k, (a, b) in enumerate(tree):
            incidence[k, a], incidence[k, b] = -1, 1
        truth = np.kron(incidence, np.eye(3)) @ np.kron(np.eye(4), receiver)
        truth = truth @ np.kron(incidence, np.eye(3)).T
        single = np.tile(2 * receiver, (3, 1, 1))
        np.testing.assert_allclose(session_covariance(tree, single), truth, atol=1e-18)
