"""Matching without names: found where the figure is unique, flagged where it is not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tribrach.errors import InputError
from tribrach.geometry import rotation
from tribrach.registration.matching import GATES, _allowed, _associations, match

SQUARE = np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]])


def test_a_square_is_ambiguous() -> None:
    turned = SQUARE @ rotation.exp(np.array([0.3, 0.1, 0.7])).T + 5.0
    found = match(turned, SQUARE)
    assert len(found.pairs) == 4
    assert found.ambiguous
    # in space a square can be turned over as well: eight ways in all
    assert len(found.others) == 7
    assert "name one target" in str(found)


def test_a_levelled_square_has_four_ways() -> None:
    turned = SQUARE @ rotation.exp(np.array([0.0, 0.0, 0.7])).T + 5.0
    found = match(turned, SQUARE, levelled=True)
    assert len(found.pairs) == 4
    assert len(found.others) == 3


def test_one_higher_corner_decides() -> None:
    figure = SQUARE + np.array([0.0, 0, 0])
    figure[2] += [0.5, 1.0, 1.5]
    turn = rotation.exp(np.array([0.3, -1.0, 2.0]))
    found = match(figure @ turn.T + 5.0, figure[[2, 0, 3, 1]])
    assert not found.ambiguous
    assert found.pairs.tolist() == [[0, 1], [1, 3], [2, 0], [3, 2]]
    assert np.allclose(found.rotation, turn.T, atol=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_false_targets_stay_out(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 60, (14, 3)) * [1, 1, 0.2]
    turn, shift = rotation.exp(rng.uniform(-2, 2, 3)), rng.uniform(-9, 9, 3)
    true = rng.choice(14, 6, replace=False)
    seen = (points[true] - shift) @ turn + rng.normal(0, 0.002, (6, 3))
    found = match(np.concatenate([seen, rng.uniform(-30, 30, (3, 3))]), points)
    assert found.pairs.tolist() == [[i, int(j)] for i, j in enumerate(true)]
    assert not found.ambiguous
    assert np.allclose(found.rotation, turn, atol=1e-3)


def test_a_mirrored_list_does_not_match() -> None:
    points = np.array([[0.0, 0, 0], [11, 0, 1], [3, 17, 2], [5, 6, 9], [-4, 2, 7]])
    with pytest.raises(InputError):
        match(points[:4] * [1, 1, -1], points[:4] + 1.0)


def test_too_many_are_refused() -> None:
    with pytest.raises(InputError, match="too many"):
        match(np.zeros((100, 3)), np.zeros((100, 3)))


@settings(max_examples=40, deadline=None)
@given(
    n=st.integers(1, 6),
    m=st.integers(0, 9),
    levelled=st.booleans(),
    lattice=st.booleans(),
    seed=st.integers(0, 10**6),
)
def test_associations_are_those_of_every_pair_with_every_other(
    n: int, m: int, levelled: bool, lattice: bool, seed: int
) -> None:
    """Few of all pairs are looked at; on a lattice many distances are equal."""
    rng = np.random.default_rng(seed)
    targets, points = rng.uniform(0, 4, (n, 3)), rng.uniform(0, 4, (m, 3))
    if lattice:
        targets, points = np.round(targets), np.round(points)
    s2 = rng.uniform(0.0, 0.3, (n, m)) ** 2
    nodes = _allowed(n, m, {0: 0} if m and seed % 2 else {})
    found = _associations(targets, points, s2, levelled, nodes)
    assert len(found) == len(nodes)
    for k, mask in enumerate(found):
        for other, node in enumerate(nodes):
            (a, c), (b, d) = divmod(int(nodes[k]), m), divmod(int(node), m)
            gate = GATES.distance_sigmas * np.sqrt(s2[a, c] + s2[b, d])
            apart = np.linalg.norm(targets[a] - targets[b]) - np.linalg.norm(points[c] - points[d])
            joined = a != b and c != d and abs(apart) < gate
            rise = (targets[a] - targets[b] - points[c] + points[d])[2]
            joined &= not levelled or abs(rise) < gate
            assert (mask >> other) & 1 == joined


@pytest.mark.parametrize("levelled", [True, False])
def test_targets_at_the_same_places_of_each_storey(levelled):
    """The station sees two storeys, and so did the one before, one storey below or the same."""
    rng = np.random.default_rng(5)
    one = np.column_stack([rng.uniform(-4, 4, (4, 2)), rng.uniform(0, 2, 4)])
    storeys = [one + np.array([0, 0, 3.0 * k]) for k in range(3)]
    points, targets = np.vstack(storeys[:2]), np.vstack(storeys[1:])
    moved = targets - [1.0, 2.0, 4.5]
    found = match(moved, points, levelled=levelled)
    assert len(found.pairs) == 8
    assert found.ambiguous
    assert any({(k, k + 4) for k in range(4)} == set(map(tuple, o.tolist())) for o in found.others)
    # one name decides
    named = match(moved, points, levelled=levelled, known={0: 4})
    assert not named.ambiguous
    assert {(k, k + 4) for k in range(4)} == set(map(tuple, named.pairs.tolist()))
