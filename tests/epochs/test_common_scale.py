"""One scale between two epochs is named before reference points are said to have moved."""

from dataclasses import replace

import numpy as np
import pytest

from tests.epochs.simulated import NAMES, PILLARS, XYZ, Network
from tribrach.epochs.comparison import Settings, compare, with_common_scale
from tribrach.epochs.differences import difference

NETWORK = Network.measured()
SETTINGS = Settings(references=PILLARS)


def compared(seed, scale=0.0, **moved):
    """Both comparisons, of epochs with a scale between them and displacements [m] to the east."""
    rng = np.random.default_rng(seed)
    shift = np.zeros((len(NAMES), 3))
    for name, east in moved.items():
        shift[NAMES.index(name), 0] = east
    first, second = NETWORK.epoch(rng), NETWORK.epoch(rng, shift + scale * XYZ)
    found = compare(difference(first, replace(second, label="later")), SETTINGS)
    return found, with_common_scale(found)


@pytest.mark.parametrize("seed", range(8))
def test_a_scale_is_no_movement(seed):
    found, scaled = compared(seed, 40e-6)
    assert not found.search.before.passed
    assert scaled is not None
    # one in twenty of what is left fails its test by chance
    assert len(scaled.search.moved) <= 1
    (scale,) = scaled.common
    assert abs(scale.value - 40e-6) < 4 * scale.sigma


def test_an_object_that_moved_beside_a_scale_is_found():
    _, scaled = compared(11, 40e-6, G=0.02)
    assert scaled is not None
    assert "G" in scaled.moved


@pytest.mark.parametrize("seed", range(8))
def test_a_point_that_moved_is_no_scale(seed):
    found, scaled = compared(seed, B=0.012)
    assert scaled is None
    assert "B" in found.moved


def test_nothing_is_taken_out_where_nothing_moved():
    """At most the 5 % whose global test fails, and of them those that look like a scale."""
    assert sum(compared(100 + k)[1] is not None for k in range(60)) <= 1
