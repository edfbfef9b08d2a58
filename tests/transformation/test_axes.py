"""Exchanged and reversed columns are named; good and flat points are left alone."""

import numpy as np
import pytest

from tribrach.geometry import rotation
from tribrach.transformation.fit import CommonPoints
from tribrach.transformation.models import find_model
from tribrach.transformation.outcome import axis_sentences, examine, unit_sentences
from tribrach.transformation.weights import Spread

TITLES = ("e", "n", "u")


def pair(tilt: float = 0.01) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    a = rng.uniform(-50, 50, (8, 3)) * [1, 1, 0.2] + [4e5, 5e6, 100]
    turn = rotation.exp(np.array([tilt, -tilt, 0.7]))
    return a, (a - a.mean(axis=0)) @ turn.T + rng.normal(0, 0.003, a.shape)


@pytest.mark.parametrize("count", [4, 6, 7, 9])
@pytest.mark.parametrize(("i", "j"), [(0, 1), (1, 2), (0, 2)])
def test_two_exchanged_columns_are_named(count: int, i: int, j: int) -> None:
    a, b = pair(0.0 if count == 4 else 0.01)
    order = [0, 1, 2]
    order[i], order[j] = j, i
    (sentence,) = axis_sentences(a[:, order], b, find_model(count, 3), TITLES)
    assert f"the columns {TITLES[i]} and {TITLES[j]} look exchanged" in sentence
    assert "mirror image" in sentence


def test_a_reversed_height_is_named() -> None:
    a, b = pair()
    (sentence,) = axis_sentences(a * [1, 1, -1], b, find_model(7, 3), TITLES)
    assert "u looks reversed" in sentence


def test_an_affine_transformation_hides_no_mirror() -> None:
    a, b = pair()
    (sentence,) = axis_sentences(a[:, [1, 0, 2]], b, find_model(12, 3), TITLES)
    assert "mirrors" in sentence


def test_exchanged_columns_in_the_plane() -> None:
    a, b = pair()
    for count in (3, 4):
        (sentence,) = axis_sentences(a[:, [1, 0]], b[:, :2], find_model(count, 2), ("e", "n"))
        assert "the columns e and n look exchanged" in sentence


def test_a_triangle_that_fits_upside_down() -> None:
    """Three points fit their mirror image as well: only the standing axis tells."""
    a = np.array([[0.0, 0, 0], [10, 0, 0], [0, 5, 1]])
    (sentence,) = axis_sentences(a[:, [1, 0, 2]], a, find_model(6, 3), TITLES)
    assert "upside down" in sentence


@pytest.mark.parametrize("count", [4, 6, 7, 9, 12])
def test_good_columns_are_left_alone(count: int) -> None:
    a, b = pair(0.0 if count == 4 else 0.01)
    assert axis_sentences(a, b, find_model(count, 3), TITLES) == []


def test_flat_noisy_points_are_left_alone() -> None:
    rng = np.random.default_rng(2)
    for _ in range(30):
        a = rng.uniform(-20, 20, (6, 3)) * [1, 1, 0]
        b = a + rng.normal(0, 0.01, a.shape)
        assert axis_sentences(a, b, find_model(7, 3), TITLES) == []


def test_what_fits_in_no_way_is_not_upside_down() -> None:
    """Two names exchanged turn the best fit over, and leave as much as one that stands upright."""
    a = np.random.default_rng(4).uniform(-100, 100, (8, 3)) * [1, 1, 0.1]
    for i, j in ((2, 5), (0, 1), (3, 7), (1, 6)):
        b = a.copy()
        b[[i, j]] = b[[j, i]]
        assert axis_sentences(a, b, find_model(6, 3), TITLES) == []


def test_one_large_blunder_is_no_exchange() -> None:
    a, b = pair()
    b[2] += [30.0, -20.0, 5.0]
    assert axis_sentences(a, b, find_model(7, 3), TITLES) == []


@pytest.mark.parametrize(
    ("factor", "words"),
    [(1e3, "B were in millimetres"), (1 / 0.3048, "B were in feet"), (0.3048, "A were in feet")],
)
def test_another_unit_is_named_and_no_point(factor: float, words: str) -> None:
    a, b = pair()
    (sentence,) = unit_sentences(a, factor * b)
    assert words in sentence
    for count in (4, 6, 7):
        used = np.ones(len(a), dtype=bool)
        names, none = tuple(f"P{k}" for k in range(len(a))), Spread(None)
        points = CommonPoints(names, a, factor * b, none, none, used, ~used, ("",) * len(a))
        outcome = examine(points, find_model(count, 3), TITLES, snoop=True)
        assert outcome.odd == (sentence,)
        assert not outcome.removed


def test_a_scale_of_a_projection_is_no_unit() -> None:
    a, b = pair()
    assert unit_sentences(a, 0.9996 * b) == []
