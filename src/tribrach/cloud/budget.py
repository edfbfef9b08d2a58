"""Splits the uncertainty of a point into parts whose variances add up to its covariance.

``C_X = sum_g J_geo C_g J_geo^T + sum_k J_k s_k^2 J_k^T``: the groups g share the covariance of the
station (method section 5.1), the parts k are range, incidence, both angles and the beam's footprint
(method section 5.2), and what the angles have in common over a neighbourhood where an instrument
says so; a calibration of the scanner has a share of its own, which may be negative
where its parameters and the poses are correlated. Along the normal of the surface each gives ``n^T
C n``; what remains of its trace lies in the surface.

What the station leaves uncertain moves all points of its cloud together: the mean of ``J_geo C_geo
J_geo^T`` over them has a longest axis, the direction in which the place of the whole cloud is known
least.

Points and normals (n, 3) in the scanner frame [m], covariances (n, 3, 3) in the axes of the world
[m^2].
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.cloud.calibration_share import share_of
from tribrach.cloud.placement import Placement
from tribrach.geometry.rotation import skew
from tribrach.scan.normals import FLATTEST

#: angles that are wrong alike for neighbouring points; a part only where an instrument says so
SYSTEMATIC = "systematic angles"
#: what the scanner adds to every single point
POINT_PARTS = ("range", "incidence", "horizontal angle", "vertical angle", "beam width")


@dataclass(frozen=True)
class PointBudget:
    """Covariances of n points, part by part."""

    names: tuple[str, ...]  #: the m parts
    covariances: Array  #: (m, n, 3, 3): in the axes of the world [m^2]
    normals: Array  #: (n, 3): unit normals in the axes of the world, NaN where unknown

    @property
    def total(self) -> Array:
        """Covariances (n, 3, 3): the sum."""
        out: Array = self.covariances.sum(axis=0)
        return out

    @property
    def variances(self) -> Array:
        """Traces (m, n) [m^2]: squared three-dimensional sigmas."""
        out: Array = np.einsum("mnii->mn", self.covariances)
        return out

    @property
    def along_normal(self) -> Array:
        """Variances (m, n) [m^2] along the normal, NaN where it is unknown."""
        n = self.normals
        out: Array = np.einsum("ni,mnij,nj->mn", n, self.covariances, n)
        return out

    @property
    def tangential(self) -> Array:
        """Variances (m, n) [m^2] in the surface: both directions together."""
        return self.variances - self.along_normal


def point_budget(
    xyz: Array,
    placement: Placement,
    station: Mapping[str, Array] | None = None,
    normals: Array | None = None,
    intensity: Array | None = None,
) -> PointBudget:
    """Compute the budget of points of a scan.

    The station has shares (6, 6) of its covariance by name, one named ``station`` if None.
    Incidence adds nothing where normals are NaN; intensities are as in the file.
    """
    noise = placement.noise
    if noise is None:
        raise ValueError("points without a scanner origin have no covariance")
    shares = {"station": placement.covariance} if station is None else dict(station)
    _check_sum(shares, placement.covariance)
    normals = np.full_like(xyz, np.nan) if normals is None else normals
    frame = placement.pose.rotation
    arm = xyz @ frame.T
    geo = np.concatenate([np.broadcast_to(np.eye(3), (len(xyz), 3, 3)), -skew(arm)], axis=2)
    parts = [geo @ share @ geo.transpose(0, 2, 1) for share in shares.values()]
    names = tuple(shares)
    if placement.calibration is not None:
        parts.append(_symmetric(share_of(xyz, placement)))
        names = (*names, "calibration")
    length = np.linalg.norm(xyz, axis=1)
    beam, horizontal, vertical = (axis @ frame.T for axis in _axes(xyz, length))
    straight = noise.range_sigma(length, 1.0, intensity) ** 2
    slanted = noise.range_sigma(length, _cosine(xyz, length, normals), intensity) ** 2 - straight
    flat = np.hypot(xyz[:, 0], xyz[:, 1])
    spot = (noise.beam_diameter(length) / 4) ** 2
    across = np.einsum("ni,nj->nij", horizontal, horizontal)
    upright = np.einsum("ni,nj->nij", vertical, vertical)
    along = np.einsum("ni,nj->nij", beam, beam)
    parts += [
        straight[:, None, None] * along,
        slanted[:, None, None] * along,
        ((flat * noise.horizontal) ** 2)[:, None, None] * across,
        ((length * noise.vertical) ** 2)[:, None, None] * upright,
        spot[:, None, None] * (across + upright),
    ]
    names = (*names, *POINT_PARTS)
    if noise.systematic > 0:
        wide = (flat**2)[:, None, None] * across + (length**2)[:, None, None] * upright
        parts.append(noise.systematic**2 * wide)
        names = (*names, SYSTEMATIC)
    return PointBudget(names, np.array(parts), normals @ frame.T)


def _symmetric(elements: Array) -> Array:
    """Matrices (n, 3, 3) of their elements (n, 6) xx, yy, zz, xy, xz, yz."""
    return elements[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)


def _check_sum(shares: Mapping[str, Array], covariance: Array) -> None:
    """Refuse shares that do not add up: they would be a budget of something else."""
    rest = np.sum(list(shares.values()), axis=0) - covariance
    size = np.sqrt(np.maximum(np.diag(covariance), 1e-30))
    if np.abs(rest / size[:, None] / size).max() > 1e-4:
        raise ValueError("the shares of the station do not add up to its covariance")


def _axes(xyz: Array, length: Array) -> tuple[Array, Array, Array]:
    """Unit vectors (n, 3) along the beam, horizontally and vertically across it."""
    flat = np.hypot(xyz[:, 0], xyz[:, 1])
    upright = flat == 0
    safe = np.where(upright, 1.0, flat)
    ch, sh = np.where(upright, 1.0, xyz[:, 0] / safe), xyz[:, 1] / safe
    rho = np.where(length > 0, length, 1.0)
    cv, sv = np.where(length > 0, xyz[:, 2] / rho, 1.0), flat / rho
    zero = np.zeros(len(xyz))
    return (
        np.stack([sv * ch, sv * sh, cv], axis=1),
        np.stack([-sh, ch, zero], axis=1),
        np.stack([cv * ch, cv * sh, -sv], axis=1),
    )


def _cosine(xyz: Array, length: Array, normals: Array) -> Array:
    """Cosines (n,) of the incidence, at least 0.1; 1 where no normal is known."""
    raw = np.abs(np.einsum("ni,ni->n", xyz, normals)) / np.where(length > 0, length, 1.0)
    cosine: Array = np.where(np.isfinite(raw), np.clip(raw, FLATTEST, 1.0), 1.0)
    return cosine


@dataclass(frozen=True)
class Weakest:
    """The direction in which the place of a cloud is known least."""

    sigma: float  #: along that direction [m]
    #: of the direction in E, N, U [rad]
    azimuth: float
    elevation: float


def weakest_direction(points: Array, covariance: Array) -> Weakest:
    """Direction along E, N, U in which a cloud's place, relative to the station, is known least."""
    geo = np.concatenate([np.broadcast_to(np.eye(3), (len(points), 3, 3)), -skew(points)], axis=2)
    mean = (geo @ covariance @ geo.transpose(0, 2, 1)).mean(axis=0)
    values, vectors = np.linalg.eigh(mean)
    east, north, up = vectors[:, -1] if vectors[2, -1] >= 0 else -vectors[:, -1]
    azimuth = float(np.arctan2(east, north) % np.pi)
    elevation = float(np.arctan2(up, np.hypot(east, north)))
    return Weakest(float(np.sqrt(max(values[-1], 0.0))), azimuth, elevation)
