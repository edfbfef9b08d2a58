"""Views of stations: what agrees, what is hidden, what stands in empty space."""

import numpy as np
import pytest

from tests.registration.plane_scenes import POSES, yard_station
from tribrach.geometry.pose import Pose
from tribrach.registration.station_view import StationView, agreement, merged_view


def between(a="S1", b="S2"):
    return yard_station(a), yard_station(b), POSES[a].inverse @ POSES[b]


def test_at_the_true_pose_nearly_all_agree():
    a, b, true = between()
    seen = agreement(b.view, a.view, true)
    assert seen.agree > 0.9 * len(b.view.points) - seen.hidden
    assert seen.conflict < 0.01
    assert seen.agree + seen.hidden + seen.through + seen.sky + seen.outside == len(b.view.points)


@pytest.mark.parametrize("shift", [[0, -1.5, 0], [1.5, 0, 0], [0, 0, 1.0]])
def test_shifted_walls_stand_where_the_other_looks_through(shift):
    a, b, true = between()
    moved = Pose(true.rotation, true.translation + np.array(shift))
    both = agreement(b.view, a.view, moved) + agreement(a.view, b.view, moved.inverse)
    assert both.conflict > 0.1


def test_what_nobody_looked_at_contradicts_nothing():
    a, b, true = between()
    blind = StationView.empty()
    seen = agreement(b.view, blind, true)
    assert seen.outside == len(b.view.points)
    assert seen.conflict == 0
    assert agreement(blind, a.view, true).overlap == 0


def test_views_of_one_station_merge():
    a = yard_station("S1").view
    both = merged_view([a, StationView.empty()])
    np.testing.assert_array_equal(both.near, a.near)
    assert both.reach == a.reach
    assert len(both.points) <= len(a.points)
