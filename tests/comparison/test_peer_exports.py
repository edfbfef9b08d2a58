import numpy as np
import pytest

from tests.comparison.two_stations import ORIGIN, pair, placement
from tribrach.cloud.placement import Placement
from tribrach.comparison.peer_exports import SIGMA_FIELDS, alignment
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp
from tribrach.instruments.scan_noise import ScanNoise

POINTS = ORIGIN + np.random.default_rng(1).uniform(-8, 8, (9, 3))


def propagated(found, points: np.ndarray) -> np.ndarray:
    """Covariances (n, 3, 3) of moved points from those of the twelve elements."""
    out = []
    for x in points - found.reference:
        by_elements = np.hstack([np.kron(np.eye(3), x), np.eye(3)])
        out.append(by_elements @ found.covariance @ by_elements.T)
    return np.array(out)


def test_twelve_elements_say_what_the_joint_covariance_says() -> None:
    found = alignment(pair(), ORIGIN)
    assert found.matrix == pytest.approx(np.eye(3, 4))
    assert np.linalg.matrix_rank(found.covariance, tol=1e-14) == 6
    expected = pair().registration(POINTS)
    assert propagated(found, POINTS) == pytest.approx(expected, rel=1e-9, abs=1e-15)


def test_with_a_motion_that_is_still_to_be_made() -> None:
    motion = Pose(exp(np.array([0.2, -0.5, 1.1])), np.array([5.0, 3.0, 1.0]))
    about = Pose(motion.rotation, motion.translation + ORIGIN - motion.rotation @ ORIGIN)
    found = alignment(pair(), ORIGIN, about)
    raw = (POINTS - about.translation) @ about.rotation
    moved = (raw - found.reference) @ found.matrix[:, :3].T + found.matrix[:, 3] + found.reference
    assert moved == pytest.approx(POINTS, abs=1e-9)
    expected = pair().registration(POINTS)
    assert propagated(found, raw) == pytest.approx(expected, rel=1e-7, abs=1e-14)


def scan_position(placement: Placement, length: float) -> dict:
    """One entry of py4dgeo's scan positions: origin [m], sigmas of range [m] and of angles [rad].

    length : the typical range [m]; range-dependent noise and the place within the beam's footprint
    are taken there, as the format has constants.

    Raises
    ------
    InputError : the scan's origin is not known, or the range is not positive.
    """
    noise = placement.noise
    if noise is None or not length > 0:
        raise InputError(f"scan {placement.station} has no known origin, or no positive range")
    at = np.array([length])
    beam = float(noise.beam_angle(at)[0])
    return {
        "origin": placement.pose.translation.tolist(),
        "sigma_range": float(noise.range_sigma(at)[0]),
        "sigma_scan": float(np.hypot(noise.vertical, beam)),
        "sigma_yaw": float(np.hypot(noise.horizontal, beam)),
    }


def test_py4dgeo_takes_it_and_says_the_same() -> None:
    m3c2ep = pytest.importorskip("py4dgeo.m3c2ep", reason="py4dgeo is not installed")
    found = alignment(pair(), ORIGIN)
    where = placement(1, np.zeros(6))
    position = scan_position(where, 15.0)
    algorithm = m3c2ep.M3C2EP(
        **found.arguments, corepoints=POINTS, cyl_radius=0.1, max_distance=0.1, normal_radii=[0.1]
    )
    sigmas = [position[name] for name in ("sigma_range", "sigma_range", "sigma_scan", "sigma_yaw")]
    _, covariance = m3c2ep.get_local_mean_and_Cxx_nocorr(
        algorithm.Cxx,
        algorithm.tfM,
        np.array([position["origin"]]),
        algorithm.refPointMov,
        np.array([sigmas]) * 1e-6,
        POINTS,
        np.ones(len(POINTS), dtype=int),
        epoch=1,
    )
    assert covariance == pytest.approx(pair().registration(POINTS).mean(axis=0), rel=1e-6)


def test_arguments_and_scan_positions() -> None:
    found = alignment(pair(), ORIGIN)
    data = found.arguments
    assert data["refPointMov"].tolist() == ORIGIN.tolist()
    assert np.array_equal(data["Cxx"], found.covariance)
    assert np.shape(data["tfM"]) == (3, 4)
    beams = ScanNoise(1e-3, 1e-5, 3e-5, 4e-5, 4e-3, 3e-4)
    where = placement(0, np.zeros(6))
    entry = scan_position(Placement("S1", where.pose, where.covariance, beams), 20.0)
    assert entry["sigma_range"] == pytest.approx(1.2e-3)
    quarter = np.hypot(4e-3, 6e-3) / 20 / 4
    assert entry["sigma_yaw"] == pytest.approx(np.hypot(3e-5, quarter))
    assert entry["sigma_scan"] == pytest.approx(np.hypot(4e-5, quarter))
    assert entry["origin"] == where.pose.translation.tolist()
    with pytest.raises(InputError, match="origin"):
        scan_position(Placement("S1", where.pose, where.covariance, None), 20.0)
    assert SIGMA_FIELDS == ("sigma_x", "sigma_y", "sigma_z")
