"""Places an array of points through an adjusted station, each with its covariance."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tribrach._types import Array
from tribrach.cloud.covariance import covariances
from tribrach.cloud.placement import Placement
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.network.results import StationResult

#: where the elements xx, yy, zz, xy, xz, yz stand in a matrix (3, 3)
_ELEMENTS = np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2]])
#: what unit vectors in single precision exceed one by
_ROUNDING = 1e-6
_NO_NOISE = ScanNoise(0.0, 0.0, 0.0, 0.0)


def place(
    points: ArrayLike,
    station: StationResult,
    noise: ScanNoise | None = None,
    cosine: ArrayLike | None = None,
    intensity: ArrayLike | None = None,
) -> tuple[Array, Array]:
    """Place points of a scan in the world, with the covariance of each.

    Parameters
    ----------
    points : array_like (n, 3)
        Coordinates in the frame of the scanner, whose origin is at zero [m].
    station : StationResult
        Where it stood, ``adjustment.stations["S3"]``.
    noise : ScanNoise, optional
        Of single points. Without it covariances are those of the station alone.
    cosine : array_like (n,), optional
        Of the incidence angle of each point on its surface; ranges are then known less well.
    intensity : array_like (n,), optional
        Of each point as in its file, NaN where unknown, for a noise with a law of the intensity.

    Returns
    -------
    xyz : array (n, 3)
        E, N, U in the work frame [m].
    covariance : array (n, 3, 3)
        Along the same axes [m^2], a priori or a posteriori as ``station.scale`` says.

    Raises
    ------
    InputError
        Points that are not (n, 3), cosines that are not (n,) or outside (0, 1], intensities that
        are not (n,).

    Notes
    -----
    ``C_X = J_geo C_geo J_geo^T + J_rho C_int J_rho^T`` with ``J_geo = [I | -[R x]x]``, method
    section 5.1.

    Examples
    --------
    >>> quarter_turn = np.array([[0, -1, 0, 10], [1, 0, 0, 20], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    >>> station = StationResult("S1", quarter_turn, np.diag([4e-6] * 3 + [0.0] * 3), "a priori")
    >>> xyz, covariance = place([[5.0, 0.0, 1.0]], station)
    >>> xyz.tolist()
    [[10.0, 25.0, 1.0]]
    >>> np.sqrt(np.diagonal(covariance[0])).tolist()
    [0.002, 0.002, 0.002]
    """
    local = np.ascontiguousarray(points, dtype=float)
    if local.ndim != 2 or local.shape[1] != 3:
        raise InputError(f"points have the shape {local.shape}", cure="give an array (n, 3)")
    angles = None if cosine is None else _cosines(cosine, len(local))
    pose = Pose(station.rotation, station.xyz)
    placement = Placement(station.name, pose, station.covariance, noise or _NO_NOISE)
    light = None if intensity is None else _intensities(intensity, len(local))
    elements = covariances(local, placement, angles, light)
    return local @ pose.rotation.T + pose.translation, elements[:, _ELEMENTS]


def _cosines(given: ArrayLike, count: int) -> Array:
    """Cosines (n,) of incidence angles, one for each point."""
    cosines = np.ascontiguousarray(given, dtype=float)
    if cosines.shape != (count,):
        raise InputError(
            f"{count} points have cosines of the shape {cosines.shape}",
            cure="give one cosine for each point",
        )
    wrong = cosines[~((cosines > 0) & (cosines <= 1 + _ROUNDING))]
    if len(wrong):
        raise InputError(
            f"{len(wrong)} of {count} cosines are not in (0, 1], the first is {wrong[0]:g}",
            cure="give the cosine of the angle between beam and surface normal, without its sign",
        )
    return cosines


def _intensities(given: ArrayLike, count: int) -> Array:
    """Intensities (n,), one for each point."""
    light = np.ascontiguousarray(given, dtype=float)
    if light.shape != (count,):
        raise InputError(
            f"{count} points have intensities of the shape {light.shape}",
            cure="give one intensity for each point, NaN where it is unknown",
        )
    return light
