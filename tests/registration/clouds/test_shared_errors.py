"""Errors that all matches share: a zero error of the scanner, the depth of trunks."""

import numpy as np
import pytest
from scipy.stats import chi2

from tests.registration.clouds.scenes import scanned
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import log
from tribrach.registration.clouds.pair import CloudPair, register_pair
from tribrach.simulate.scene import Scene, box, rectangle


def hall() -> Scene:
    """One room with things in it: floor and ceiling hold its tilt."""
    walls = [
        rectangle((0, 0, 0), (0, 0, 1), 14, 9, 0.5),
        rectangle((0, 0, 3.2), (0, 0, -1), 14, 9, 0.5),
        rectangle((-7, 0, 1.6), (1, 0, 0), 9, 3.2, 0.5),
        rectangle((7, 0, 1.6), (-1, 0, 0), 9, 3.2, 0.5),
        rectangle((0, 4.5, 1.6), (0, -1, 0), 14, 3.2, 0.5),
        rectangle((0, -4.5, 1.6), (0, 1, 0), 14, 3.2, 0.5),
    ]
    things = [box((2, 3, 0.5), (1, 0.6, 1), 0.4, 0.3), box((-4, -2, 0.8), (0.6, 1.4, 1.6), 0.4)]
    return Scene.of([*walls, *things])


def squared(pair: CloudPair, true: Pose) -> float:
    """Squared error over its covariance; six on the average."""
    assert pair.fit is not None
    found, p = pair.fit.pose, pair.fit.precision
    shift = found @ (true.inverse @ p.middle) - p.middle
    error = np.concatenate([shift, log(found.rotation @ true.rotation.T)])
    return float(error @ np.linalg.solve(p.local, error))


@pytest.mark.parametrize("zero", [0.0, 0.003, -0.003])
def test_a_zero_error_does_not_tilt_a_room_unseen(zero: float) -> None:
    places = ((-4.0, 1.5, 0.2), (3.5, -1.0, 1.9))
    scans, poses = scanned(hall(), places, points=100_000, seed=5, zero=zero)
    true = poses[0].inverse @ poses[1]
    pair = register_pair(*scans, true)
    assert pair.fit is not None
    depth, sigma = pair.fit.precision.depth
    assert squared(pair, true) < chi2.ppf(0.99, 6)
    assert abs(depth - zero) < 3 * sigma < 0.002
    told = [s for s in pair.sentences if "zero error" in s]
    assert bool(told) == (zero != 0)
