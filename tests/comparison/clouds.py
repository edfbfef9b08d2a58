"""Clouds in memory, compared as a whole, and the floors of ideal patterns."""

import numpy as np

from tribrach._types import Array
from tribrach.comparison.c2c import C2C, tile_distances
from tribrach.comparison.sampling_floor import Floor, lattice_mean, lattice_square
from tribrach.comparison.streams import Stream
from tribrach.comparison.tiles import tiles

_CHUNK = 1_000_000


def in_memory(points: Array) -> Stream:
    """Points (n, 3) as a stream."""
    return lambda: iter([points[k : k + _CHUNK] for k in range(0, len(points), _CHUNK)])


def cloud_to_cloud(
    compared: Stream,
    reference: Stream,
    limit: float,
    *,
    viewpoint: Array | None = None,
    size: int | None = None,
) -> C2C:
    """Compare every point of a cloud with the nearest of a reference within a limit.

    Distances from local planes are positive towards the viewpoint; ``size`` points of either cloud
    are in memory at a time.
    """
    with tiles(compared, reference, limit, size=size) as cut:
        return tile_distances(cut, limit, viewpoint=viewpoint)


def lattice_floor(pitch_x: float, pitch_y: float, incidence: float = 0.0) -> Floor:
    """Floor of one lattice; the first pitch is stretched by an incidence angle [rad] across it."""
    x, y = np.array([pitch_x / np.cos(incidence)]), np.array([pitch_y])
    return Floor.from_moments(float(lattice_mean(x, y)[0]), float(lattice_square(x, y)[0]))


def random_floor(spacing: float) -> Floor:
    """Floor of points at random, one on ``spacing^2``: mean ``s / 2``, RMS ``s / sqrt(pi)``."""
    return Floor.from_moments(spacing / 2, spacing**2 / np.pi)
