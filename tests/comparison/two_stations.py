"""Two scanners before a wall, with a joint covariance: scans and clouds as a survey makes them."""

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from tests.comparison.planes import frame
from tribrach.cloud.covariance import covariances
from tribrach.cloud.placement import Placement
from tribrach.comparison.cloud_parts import CloudChunk, Source
from tribrach.comparison.station_pair import StationPair
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp
from tribrach.instruments.scan_noise import ScanNoise

Array = np.ndarray

ORIGIN = np.array([584_100.0, 2_326_000.0, 10.0])
PLACES = ORIGIN + np.array([[-6.0, -12.0, 1.5], [7.0, -9.0, 1.6]])
NOISE = ScanNoise(1.5e-3, 1e-5, 3e-5, 4e-5)


def joint_covariance(seed=1, common=2e-3) -> Array:
    """(12, 12): 1 mm and 10" of each station alone, and a shift of the control common to both."""
    rng = np.random.default_rng(seed)
    scale = np.tile([1e-3] * 3 + [5e-5] * 3, 2)
    root = scale[:, None] * rng.normal(size=(12, 12)) / np.sqrt(12)
    shift = np.tile(np.vstack([np.eye(3), np.zeros((3, 3))]), (2, 1))
    return root @ root.T + common**2 * shift @ shift.T


def pair(**more) -> StationPair:
    return StationPair(*PLACES, joint_covariance(**more))


def placement(k: int, error: Array) -> Placement:
    """Station k as adjusted, away from the truth by an increment (6,) of its pose."""
    rotation = exp(np.array([0.0, 0.0, 0.4 + k]))
    where = Pose(exp(error[3:]) @ rotation, PLACES[k] + error[:3])
    return Placement(
        f"S{k + 1}", where, joint_covariance()[6 * k : 6 * k + 6, 6 * k : 6 * k + 6], NOISE
    )


def observed(rng, k: int, surface: Array) -> Array:
    """What station k measures (n, 3) of true points, in its frame: noise of range and angles."""
    truth = placement(k, np.zeros(6)).pose.inverse @ surface
    length = np.linalg.norm(truth, axis=1)
    azimuth, zenith = np.arctan2(truth[:, 1], truth[:, 0]), np.arccos(truth[:, 2] / length)
    length = length + NOISE.range_sigma(length) * rng.normal(size=len(length))
    azimuth = azimuth + NOISE.horizontal * rng.normal(size=len(length))
    zenith = zenith + NOISE.vertical * rng.normal(size=len(length))
    direction = [np.sin(zenith) * np.cos(azimuth), np.sin(zenith) * np.sin(azimuth), np.cos(zenith)]
    return length[:, None] * np.stack(direction, axis=1)


def patch(rng, middle, normal, n, size=0.5) -> Array:
    """Points (n, 3) of a flat square about a place relative to the origin."""
    uv = rng.uniform(-size / 2, size / 2, (n, 2))
    return ORIGIN + np.asarray(middle, float) + uv @ frame(normal)[:, :2].T


def from_station(
    parts: Callable[[], Iterable[tuple[Array, Array | None]]], placement: Placement
) -> Source:
    """A scan (method section 5.1): points carried into the world, with their random part ``C_int``.

    parts : gives points (n, 3) in the scanner frame and the cosines (n,) of their incidence angles
    or None. The covariance of the pose is left out here: it is common to all points of the scan.
    """
    alone = Placement(placement.station, placement.pose, np.zeros((6, 6)), placement.noise)

    def carried() -> Iterator[CloudChunk]:
        for xyz, cosine in parts():
            yield CloudChunk(placement.pose @ xyz, covariances(xyz, alone, cosine))

    return carried
