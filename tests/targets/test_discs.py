"""Flat circular targets: found in scans, with the covariance of their errors, and none invented."""

import re

import numpy as np
import pytest
from scipy.stats import chi2

from tests.targets.prints import TOLD_DISCS, alone, gap, scanned, squares
from tribrach.errors import InputError
from tribrach.simulate import scene as sc
from tribrach.targets.discs.search import find_discs

R = 0.1
CASES = [
    (away, np.radians(incidence), pitch)
    for away in (8, 15, 25, 35)
    for incidence in (0, 30, 55)
    for pitch in (4e-3, 8e-3, 16e-3)
]
BACK = sc.rectangle((10.0, 0.0, 0.0), (-1, 0, 0), 12, 5, 0.5)
WINDOW = ((-0.3, 0.3), (1.4, 1.75), 7e-4)


def on_wall(y, z):
    """A place a little before the wall."""
    return np.array([9.99, y, z])


@pytest.fixture(scope="module")
def wall():
    """Three discs on a wall and what could be taken for some: points, light, image, truth."""
    true = [on_wall(-2.0, 0.8), on_wall(0.3, 0.9), on_wall(2.3, -0.9)]
    flat = (-1, 0, 0)
    things = [sc.disc(c, flat, R, 0.5) for c in true]
    things += [sc.disc(on_wall(-1.0, 0.8), flat, 0.07, 0.4)]  # too small
    things += [sc.disc(on_wall(1.3, 0.9), flat, 0.14, 0.6)]  # too large
    things += [sc.checkerboard(on_wall(2.2, 0.8), flat, 0.3, margin=0.05)]
    for y, z, width, height in [
        (-2.0, -0.4, 0.177, 0.177),  # a square of the same area
        (-1.3, -0.4, 0.26, 0.13),  # a plate
        (-0.5, -0.4, 0.05, 0.8),  # a strip
        (2.3, 0.0, 0.9, 0.45),  # a window
    ]:
        things += [sc.rectangle(on_wall(y, z), flat, width, height, 0.08)]
    for k in range(6):
        things += [sc.rectangle(on_wall(0.3 + 0.2 * k, -0.7), flat, 0.1, 0.7, 0.1)]
    things += [sc.sphere((9.6, -0.9, -1.2), R)]
    return *scanned([BACK, *things], *WINDOW, 4), np.array(true)


@pytest.fixture(scope="module")
def searched(wall):
    """What is found on that wall and what is rejected."""
    xyz, light, image, _ = wall
    return find_discs(xyz, light, image, [R], scan="S1", **TOLD_DISCS)


def test_discs_are_found_and_nothing_else(wall, searched):
    true, (found, rejected) = wall[3], searched
    assert len(found) == len(true)
    for center in true:
        d = min(found, key=lambda d: gap(d.center, center))
        assert gap(d.center, center) < 4e-4
        assert (d.kind, d.scan, d.radius) == ("disc", "S1", R)
        assert d.facts["seen_radius_m"] == pytest.approx(R, abs=1e-3)
        assert d.facts["disc_minus_ground_m"] == pytest.approx(0, abs=1e-3)
        assert d.coverage > 0.95
        assert d.range == pytest.approx(np.linalg.norm(center), abs=1e-3)
        cosine = center[0] / np.linalg.norm(center)
        assert d.incidence == pytest.approx(np.arccos(cosine), abs=0.02)
        assert np.linalg.eigvalsh(d.covariance).min() > 0
    assert rejected
    assert all(r.reason for r in rejected)


def test_a_wrong_radius_and_a_square_are_refused_for_that_reason(searched):
    _, rejected = searched
    for center, reason in [
        (on_wall(-1.0, 0.8), "wrong radius: 70"),
        (on_wall(-2.0, -0.4), "of its light|is no circle|points on it"),
    ]:
        reasons = [r.reason for r in rejected if gap(r.center, center) < 0.15]
        assert any(re.search(reason, r) for r in reasons), reasons


def test_each_disc_is_taken_for_the_radius_that_it_has(wall):
    xyz, light, image, _ = wall
    found, _ = find_discs(xyz, light, image, [0.07, R, 0.14], **TOLD_DISCS)
    assert sorted(d.radius for d in found) == [0.07, R, R, R, 0.14]


def test_without_an_instrument_the_points_tell(wall):
    xyz, light, image, true = wall
    found, _ = find_discs(xyz, light, image, [R])
    assert len(found) == len(true)
    for center in true:
        assert min(gap(d.center, center) for d in found) < 5e-4


def test_black_discs_and_a_half_hidden_one():
    true = [on_wall(-1.0, 0.3), on_wall(0.5, 0.3)]
    board = {"center": true[0], "normal": (-1, 0, 0), "radius": R, "side": 0.5}
    white = sc.disc(**board, bright=0.1)
    light = sc.Primitive(
        white.kind, white.center, white.axes, white.half, 0.8, white.pattern, white.second
    )
    hidden = sc.disc(true[1], (-1, 0, 0), R, 0.5)
    screen = sc.box((9.5, 0.4, 0.0), (0.02, 0.12, 3.0), 0.4)
    xyz, intensity, image = scanned([BACK, light, hidden, screen], *WINDOW, 5)
    found, rejected = find_discs(xyz, intensity, image, [R], **TOLD_DISCS)
    assert len(found) == 1
    assert gap(found[0].center, true[0]) < 4e-4
    assert found[0].facts["gain"] < 0
    assert all(r.reason for r in rejected)


def test_bad_light_and_bad_radii():
    center, xyz, light, image = alone("disc", 10.0, 0.2, R, 8e-3, 1)
    with pytest.raises(InputError, match="positive"):
        find_discs(xyz, light, image, [0.0])
    assert find_discs(xyz, np.full_like(light, np.nan), image, [R])[0] == []
    assert find_discs(xyz, np.ones_like(light), image, [R]) == ([], [])
    holes = np.where(np.random.default_rng(1).random(len(light)) < 0.03, np.nan, light)
    found, _ = find_discs(xyz, holes.astype(np.float32), image, [R], **TOLD_DISCS)
    assert gap(found[0].center, center) < 1e-3


def test_stated_covariance_is_that_of_the_errors():
    cases = [(8, 0.0, 16e-3), (15, 0.5, 16e-3), (35, 0.9, 16e-3), (15, 0.0, 8e-3)]
    z = squares(find_discs, "disc", R, cases, 6)
    assert not np.isnan(z).any()
    low, high = chi2.ppf([1e-4, 0.9999], 3 * z.size)
    assert low < z.sum() < high


@pytest.mark.slow
def test_stated_covariance_is_that_of_the_errors_everywhere():
    z = squares(find_discs, "disc", R, CASES, 30)
    assert np.isnan(z).mean() < 0.01
    ratio = np.nanmean(z, axis=1) / 3
    assert (ratio > 0.4).all(), ratio
    assert (ratio < 1.5).all(), ratio
    assert 0.8 < np.nanmean(z) / 3 < 1.15
