import numpy as np
import pytest
from scipy.stats import chi2

from tests.targets.scenes import FAR, cylinder, directions, room, scan
from tribrach.scan.range_image import organise
from tribrach.targets.planes import find_planes

SIGMA, ANGLE = 1.5e-3, 2e-5
LOW, HIGH = np.array([-6.0, -5.0, -1.7]), np.array([7.0, 4.0, 1.9])


def board(d, low, high):
    """Ranges to a board x = low[0] between low and high in y and z."""
    r = np.where(d[:, 0] > 0, low[0] / np.maximum(d[:, 0], 1e-12), FAR)
    y, z = r * d[:, 1], r * d[:, 2]
    return np.where((y > low[1]) & (y < high[1]) & (z > low[2]) & (z < high[2]), r, FAR)


def box(step=6e-3):
    """Directions of a full-circle scan of the room, rows, columns, exact ranges."""
    d, row, column = directions((-np.pi, np.pi), (0.4, 2.5), step)
    return d, row, column, room(d, LOW, HIGH)


def difference(plane):
    """Tilts and offset (3,) of a found plane against the wall of the room that it is."""
    axis = int(np.abs(plane.normal).argmax())
    normal = np.zeros(3)
    normal[axis] = np.sign(plane.normal[axis])
    wall = (LOW if normal[axis] > 0 else HIGH)[axis]
    tilt = plane.tangents @ (plane.normal - normal)
    return np.array([*tilt, normal[axis] * (plane.center[axis] - wall)])


@pytest.mark.parametrize("gridded", [True, False])
def test_six_walls_of_a_room(gridded):
    d, row, column, r = box()
    xyz = scan(d, [r], np.random.default_rng(1), SIGMA, ANGLE)
    image = organise(xyz, row, column) if gridded else organise(xyz)
    planes, _ = find_planes(xyz, image, sigma_range=SIGMA, sigma_angle=ANGLE, scan="S1")
    assert len(planes) == 6
    for p in planes:
        assert np.abs(difference(p)).max() < 4e-4
        assert p.normal @ p.center < 0
        assert p.detection.scan == "S1"
        assert p.detection.rms == pytest.approx(SIGMA, rel=0.05)
        assert p.detection.coverage > 0.9
        assert np.abs((p.outline - p.center) @ p.normal).max() < 1e-9
        assert p.detection.kind == "plane"
    wall = next(p for p in planes if p.normal[0] > 0.99)
    assert wall.area == pytest.approx(9 * 3.6, rel=0.05)


def test_covariance_of_tilt_and_offset_is_that_of_the_errors():
    """Chi-square over simulated rooms; points further apart than 5 cm count as independent."""
    d, row, column, r = box(0.02)
    rng, total, count = np.random.default_rng(2), 0.0, 0
    for _ in range(40):
        xyz = scan(d, [r], rng, SIGMA, ANGLE)
        planes, _ = find_planes(
            xyz, organise(xyz, row, column), sigma_range=SIGMA, sigma_angle=ANGLE, floor=0.0
        )
        for p in planes:
            if p.detection.inliers > p.area / 0.05**2:
                continue
            e = difference(p)
            total += e @ np.linalg.solve(p.covariance, e)
            count += 3
    assert count >= 3 * 40 * 3
    assert 0.8 * count < total < chi2.ppf(0.995, count)


def test_parts_of_one_wall_are_joined_and_a_step_is_not():
    d, row, column = directions((-0.75, 0.75), (1.3, 1.8), 2e-3)
    high = np.array([8.0, 30.0, 30.0])
    back = room(d, -high, high)
    pillar = board(d, [7.0, -0.4, -3], [7.0, 0.4, 3])
    stepped = board(d, [7.985, 2.0, -9], [7.985, 9.0, 9])
    xyz = scan(d, [back, pillar, stepped], np.random.default_rng(3), SIGMA, ANGLE)
    planes, _ = find_planes(xyz, organise(xyz, row, column), sigma_range=SIGMA, sigma_angle=ANGLE)
    offsets = sorted(-p.normal @ p.center for p in planes)
    np.testing.assert_allclose(offsets, [7.0, 7.985, 8.0], atol=5e-4)


def test_small_and_curved_surfaces_are_not_taken():
    d, row, column = directions((-0.6, 0.6), (1.2, 1.9), 2e-3)
    small = board(d, [5.0, -2.0, -0.3], [5.0, -1.5, 0.3])
    column_of = cylinder(d, [6.0, 1.5, -5.0], 0.5, 10.0)
    far = np.full(len(d), 12.0)  # a sphere around the scanner
    xyz = scan(d, [small, column_of, far], np.random.default_rng(4), SIGMA, ANGLE)
    planes, rejected = find_planes(
        xyz, organise(xyz, row, column), sigma_range=SIGMA, sigma_angle=ANGLE
    )
    assert planes == []
    assert any("curved with a radius of 0." in r.reason for r in rejected)
    near = [r for r in rejected if np.linalg.norm(r.center - [5, -1.75, 0]) < 0.05]
    assert len(near) == 1
    assert "below 0.5 m2" in near[0].reason


def test_empty_result_on_clutter():
    xyz = np.random.default_rng(5).normal(size=(5000, 3)) * 3 + [0, 0, 0.1]
    planes, _ = find_planes(xyz, organise(xyz), sigma_range=SIGMA, sigma_angle=ANGLE)
    assert planes == []


def test_waves_of_a_surface_count_as_few_points():
    """Waves of 1 mm and 1.5 m length: the stated covariance holds, that of white noise does not."""
    d, row, column = directions((-0.5, 0.5), (1.25, 1.9), 8e-3)
    rng, total, count, white = np.random.default_rng(6), 0.0, 0, 0.0
    wall = np.array([8.0, 30.0, 30.0])
    for _ in range(30):
        r = room(d, -wall, wall)
        xyz = d * r[:, None]
        phase = rng.uniform(0, 2 * np.pi, 12)
        turn = rng.uniform(0, 2 * np.pi, 12)
        wave = np.cos(
            2 * np.pi / 1.5 * (xyz[:, 1:2] * np.cos(turn) + xyz[:, 2:] * np.sin(turn)) + phase
        )
        r = r + 1e-3 / np.sqrt(6) * wave.sum(axis=1)
        xyz = scan(d, [r], rng, 5e-4, 1e-6)
        planes, _ = find_planes(
            xyz, organise(xyz, row, column), sigma_range=5e-4, sigma_angle=1e-6, floor=0.0
        )
        plane = planes[0]
        e = np.array(
            [*(plane.tangents @ (plane.normal + np.array([1.0, 0, 0]))), 8.0 - plane.center[0]]
        )
        square = e @ np.linalg.solve(plane.covariance, e)
        total, count = total + square, count + 3
        share = plane.detection.facts["effective_points"] / plane.detection.inliers
        white += square / share
    assert total < chi2.ppf(0.9999, count)
    assert white > 3 * chi2.ppf(0.9999, count)
