import numpy as np
import pytest
from scipy.stats import chi2

from tests.targets.scenes import cylinder, directions, ellipsoid, room, scan
from tribrach.errors import InputError
from tribrach.scan.range_image import organise
from tribrach.targets.range_noise import estimate_range_noise
from tribrach.targets.spheres.grid_search import find_spheres

R = 0.0725
SIGMA, ANGLE = 1.5e-3, 2e-5
LOW, HIGH = np.array([-9.0, -7.0, -1.7]), np.array([9.0, 7.0, 1.5])
NIST = {
    "SPH101": ((-5.8958331, 3.6289394, -1.5612551), 0.15e-3),
    "SPH102": ((-4.5101085, -6.7583428, -1.5765064), 0.3e-3),
    "SPH103": ((-3.5087726, 5.8659247, -1.5709175), 0.15e-3),
    "SPH104": ((-2.3364711, 6.9683459, 0.0354132), 0.15e-3),
    "SPH105": ((-3.5022004, 5.8633289, 0.0282756), 0.15e-3),
    "SPH106": ((-4.6869884, 4.7536412, 0.0313286), 0.15e-3),
}
#: on poles, on the floor, against a wall, half hidden
SPHERES = np.array(
    [[4.0, 0.5, 0.2], [5.5, 1.9, -0.4], [5.0, -1.5, -1.7 + R], [6.0, 3.2, 0.5], [8.93, 0.0, 0.3]]
)


@pytest.fixture(scope="module")
def hall():
    """Five spheres and what could be taken for some; points, rows, columns."""
    d, row, column = directions((-0.75, 0.75), (1.25, 1.95), 1.2e-3)
    surfaces = [room(d, LOW, HIGH)]
    surfaces += [ellipsoid(d, c, R) for c in SPHERES]
    surfaces += [cylinder(d, [c[0], c[1], -1.7], 0.012, c[2] + 1.7) for c in SPHERES[:2]]
    surfaces += [cylinder(d, [5.6, 3.12, -1.7], 0.03, 3.2)]  # stands before the fourth
    surfaces += [cylinder(d, [4.5, -0.8, -0.4], R, 0.16)]  # a tin of the sphere's size
    surfaces += [cylinder(d, [7.0, 2.7, -1.7], R, 3.2)]  # a column
    surfaces += [ellipsoid(d, [4.5, -2.6, 0.3], 0.09)]  # a larger ball
    surfaces += [ellipsoid(d, [5.0, -3.6, 0.4], 0.055)]  # a smaller one
    surfaces += [ellipsoid(d, [5.0, 2.9, 0.2], [0.07, 0.07, 0.1])]  # an egg
    surfaces += [ellipsoid(d, [6.5, -2.0, 0.1], [0.095, 0.078, 0.115])]  # a head
    surfaces += [cylinder(d, [6.5, -2.0, -1.7], 0.055, 1.75)]  # its neck
    surfaces += [ellipsoid(d, [6.5, -2.0, -0.45], [0.15, 0.25, 0.45])]  # and body
    xyz = scan(d, surfaces, np.random.default_rng(11), SIGMA, ANGLE)
    return xyz, row, column


def assert_all_found(found, atol=1.5e-3):
    centers = np.array([d.center for d in found])
    assert len(found) == len(SPHERES), centers
    for c in SPHERES:
        assert np.linalg.norm(centers - c, axis=1).min() < atol


def test_spheres_are_found_and_nothing_else(hall):
    xyz, row, column = hall
    image = organise(xyz, row, column)
    assert image.gridded
    found, rejected = find_spheres(xyz, image, [R], sigma_range=SIGMA, sigma_angle=ANGLE, scan="S1")
    assert_all_found(found)
    for decoy in ([4.5, -0.8, -0.32], [4.5, -2.6, 0.3], [5.0, 2.9, 0.2], [6.5, -2.0, 0.1]):
        near = [r for r in rejected if np.linalg.norm(r.center - decoy) < 0.12]
        assert near, decoy
        assert all(r.reason for r in near)
    for d in found:
        assert d.scan == "S1"
        assert 0.4 < d.coverage <= 1
        assert d.rms == pytest.approx(SIGMA, rel=0.35)


def test_shuffled_cloud_without_grid_gives_the_same(hall):
    xyz = hall[0][np.random.default_rng(1).permutation(len(hall[0]))]
    image = organise(xyz)
    found, _ = find_spheres(xyz, image, [R], sigma_range=SIGMA, sigma_angle=ANGLE)
    assert_all_found(found)


def test_several_radii_at_once_take_each_ball_for_what_it_is(hall):
    xyz, row, column = hall
    image = organise(xyz, row, column)
    found, _ = find_spheres(xyz, image, [0.055, R, 0.09], sigma_range=SIGMA, sigma_angle=ANGLE)
    radii = sorted(round(d.radius, 4) for d in found)
    assert radii == [0.055, *[R] * len(SPHERES), 0.09]


def test_noise_is_estimated_from_the_scan(hall):
    xyz, row, column = hall
    image = organise(xyz, row, column)
    assert estimate_range_noise(image) == pytest.approx(SIGMA, rel=0.15)
    found, _ = find_spheres(xyz, image, [R])
    assert_all_found(found)


def test_centers_agree_with_their_covariance():
    """Chi-square of 40 simulated scans of four exact spheres."""
    d, row, column = directions((-0.1, 0.1), (1.47, 1.67), 1.2e-3)
    centers = np.array([[5.0, 0.2, 0.1], [5.0, -0.2, 0.1], [6.0, 0.2, -0.2], [7.0, -0.2, -0.3]])
    surfaces = [room(d, LOW, HIGH), *[ellipsoid(d, c, R) for c in centers]]
    rng, total, count = np.random.default_rng(3), 0.0, 0
    for _ in range(40):
        xyz = scan(d, surfaces, rng, SIGMA, ANGLE)
        found, _ = find_spheres(
            xyz,
            organise(xyz, row, column),
            [R],
            sigma_range=SIGMA,
            sigma_angle=ANGLE,
            tolerance=0.0,
            floor=0.0,
        )
        assert len(found) == 4
        for t in found:
            e = t.center - centers[np.linalg.norm(centers - t.center, axis=1).argmin()]
            total += e @ np.linalg.solve(t.covariance, e)
            count += 3
    low, high = chi2.ppf([0.005, 0.995], count)
    assert low < total < high


@pytest.mark.parametrize("gridded", [True, False])
def test_spheres_across_the_seam_of_the_circle(gridded):
    d, row, column = directions((0.0, 2 * np.pi - 1e-6), (1.4, 1.75), 2e-3)
    centers = np.array([[3.0, 0.004, 0.1], [-3.0, 0.002, 0.0], [2.0, -2.0, -0.1]])
    surfaces = [room(d, LOW, HIGH), *[ellipsoid(d, c, R) for c in centers]]
    xyz = scan(d, surfaces, np.random.default_rng(9), SIGMA, ANGLE)
    image = organise(xyz, row, column) if gridded else organise(xyz)
    assert image.wraps
    found, _ = find_spheres(xyz, image, [R], sigma_range=SIGMA, sigma_angle=ANGLE)
    assert len(found) == 3
    for t in found:
        assert np.linalg.norm(centers - t.center, axis=1).min() < 1e-3
        assert t.coverage > 0.85


@pytest.mark.data
@pytest.mark.parametrize("name", sorted(NIST))
def test_nist_spheres_in_their_raw_files(shared_data, name):
    xyz = np.loadtxt(shared_data / "targets" / "nist_spheres" / f"{name}.xyz")
    found, _ = find_spheres(xyz, organise(xyz), [0.05], scan=name)
    center, tolerance = NIST[name]
    assert len(found) == 1
    assert np.linalg.norm(found[0].center - center) < tolerance


def test_radius_must_be_positive(hall):
    xyz, row, column = hall
    with pytest.raises(InputError, match="positive"):
        find_spheres(xyz, organise(xyz, row, column), [0.0])
