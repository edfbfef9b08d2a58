"""What centring adds to a variance, against marks that are moved by chance."""

import numpy as np
import pytest

from tribrach.instruments import centring

N = 40000
#: 3 standard deviations of a variance of so many samples
NEAR = 3 * (2 / N) ** 0.5


@pytest.fixture(scope="module")
def moved():
    """Instrument and target of a steep sight, each moved in plan and height."""
    generator = np.random.default_rng(12)
    spread = np.array([[3e-3, 3e-3, 2e-3], [5e-3, 5e-3, 2e-3]])
    marks = np.array([[0, 0, 0], [30.0, 40.0, 25.0]])
    return marks + spread * generator.normal(size=(N, 2, 3))


def test_directions_distances_and_zenith_angles(moved):
    u = moved[:, 1] - moved[:, 0]
    plan = np.hypot(u[:, 0], u[:, 1])
    length, rise = np.array([50.0]), np.array([25.0])
    direction = centring.of_directions(length, 3e-3, 5e-3)[0]
    assert np.var(np.arctan2(u[:, 0], u[:, 1])) == pytest.approx(direction, rel=NEAR)
    slope = centring.of_slope_distances(length, rise, 3e-3, 5e-3, 2e-3)[0]
    assert np.var(np.linalg.norm(u, axis=1)) == pytest.approx(slope, rel=NEAR)
    zenith = centring.of_zeniths(length, rise, 3e-3, 5e-3, 2e-3)[0]
    assert np.var(np.arctan2(plan, u[:, 2])) == pytest.approx(zenith, rel=NEAR)


def test_angles(moved):
    generator = np.random.default_rng(13)
    back = np.array([-60.0, 10.0, 0]) + 5e-3 * generator.normal(size=(N, 3)) - moved[:, 0]
    fore = moved[:, 1] - moved[:, 0]
    angle = np.arctan2(fore[:, 0], fore[:, 1]) - np.arctan2(back[:, 0], back[:, 1])
    lengths = [np.array([x]) for x in (50.0, np.hypot(60, 10), np.hypot(90, 30))]
    expected = centring.of_angles(*lengths, 3e-3, 5e-3)[0]
    assert np.var(angle) == pytest.approx(expected, rel=NEAR)


def test_a_sight_of_no_length_tells_no_variance():
    assert not np.isfinite(centring.of_directions(np.zeros(1), 1e-3, 1e-3)).any()
