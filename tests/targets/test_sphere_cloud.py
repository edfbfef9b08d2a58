import numpy as np
import pytest

from tests.targets.scenes import cylinder, directions, ellipsoid, room, scan
from tribrach.errors import InputError
from tribrach.targets.spheres.cloud_search import find_spheres_in_cloud

R, SIGMA = 0.0725, 1e-3
SPHERES = np.array([[4.0, 0.5, 0.2], [3.5, -0.5, -1.0], [4.5, 1.2, 0.5]])
SHIFT = np.array([100.0, 200.0, 30.0])


@pytest.fixture(scope="module")
def cloud():
    """Two scans of a room from different places, merged, in a frame of their own."""
    parts = []
    for k, origin in enumerate([np.zeros(3), np.array([0.5, 1.5, 0.0])]):
        d, _, _ = directions((-0.7, 0.7), (1.2, 2.0), 2e-3)
        low, high = np.array([-6.0, -5.0, -1.7]), np.array([6.0, 4.0, 1.9])
        surfaces = [room(d, low - origin, high - origin)]
        surfaces += [ellipsoid(d, c - origin, R) for c in SPHERES]
        surfaces += [cylinder(d, np.array([5.0, 0.2, -1.7]) - origin, R, 3.0)]
        surfaces += [ellipsoid(d, np.array([4.2, -0.2, 0.6]) - origin, 0.11)]
        xyz = scan(d, surfaces, np.random.default_rng(k), SIGMA, 2e-5)
        parts.append(xyz + origin + SHIFT)
    return np.concatenate(parts)


def test_spheres_without_a_scanner(cloud):
    found, rejected = find_spheres_in_cloud(cloud, [R], scan="merged")
    assert len(found) == len(SPHERES)
    for d in found:
        assert np.linalg.norm(SPHERES + SHIFT - d.center, axis=1).min() < 1e-3
        assert any("origin of the scanner is unknown" in s for s in d.sentences)
        assert d.coverage > 0.2
    assert all(r.reason for r in rejected)


def test_bad_input_is_refused(cloud):
    with pytest.raises(InputError, match="positive"):
        find_spheres_in_cloud(cloud, [-1.0])
    with pytest.raises(InputError, match="30 are needed"):
        find_spheres_in_cloud(np.full((50, 3), np.nan), [R])
