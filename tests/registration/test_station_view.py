"""Views of stations: what agrees, what is hidden, what stands in empty space."""

import numpy as np
import pytest

from tests.registration.plane_scenes import POSES, yard_station
from tribrach.geometry.pose import Pose
from tribrach.registration.views import StationView, agreement, merged_view


def view(name):
    """What a station of the yard sees."""
    ((_, seen),) = yard_station(name).views
    return seen


def between(a="S1", b="S2"):
    return view(a), view(b), POSES[a].inverse @ POSES[b]


def test_at_the_true_pose_nearly_all_agree():
    a, b, true = between()
    seen = agreement(b, a, true)
    assert seen.agree > 0.9 * len(b.points) - seen.hidden
    assert seen.conflict < 0.01
    assert seen.agree + seen.hidden + seen.through + seen.sky + seen.outside == len(b.points)


@pytest.mark.parametrize("shift", [[0, -1.5, 0], [1.5, 0, 0], [0, 0, 1.0]])
def test_shifted_walls_stand_where_the_other_looks_through(shift):
    a, b, true = between()
    moved = Pose(true.rotation, true.translation + np.array(shift))
    both = agreement(b, a, moved) + agreement(a, b, moved.inverse)
    assert both.conflict > 0.1


def test_what_nobody_looked_at_contradicts_nothing():
    a, b, true = between()
    blind = StationView.empty()
    seen = agreement(b, blind, true)
    assert seen.outside == len(b.points)
    assert seen.conflict == 0
    assert agreement(blind, a, true).overlap == 0


def test_views_of_one_station_merge():
    a = view("S1")
    both = merged_view([a, StationView.empty()])
    np.testing.assert_array_equal(both.near, a.near)
    assert both.reach == a.reach
    assert len(both.points) <= len(a.points)
