"""Verticals and heights at points of the work frame.

The work frame W is right-handed and Cartesian. Two kinds of site answer the same questions:

* :class:`FlatSite`: W is taken as (E, N, U) with parallel plumb lines; Earth curvature enters
  only as the classical correction of trigonometric heights, if a radius is given.
* :class:`EllipsoidSite`: W is East-North-Up at an origin on the GRS80 ellipsoid; verticals are
  ellipsoid normals and heights are ellipsoidal.

Everything is array-shaped, metres and radians. Method section 1.1.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np

from tribrach._types import Array

#: semi-major axis [m] and flattening of GRS80
GRS80 = (6378137.0, 1 / 298.257222101)


class Site(Protocol):
    """What the observation kinds ask about the place they are measured at."""

    @property
    def curvature_radius(self) -> float | None:
        """Radius [m] for the correction of zenith angles, None where verticals carry it."""
        ...

    def axes(self, x: Array) -> Array:
        """Rows east, north, up at points ``x`` (n, 3) in W; (n, 3, 3)."""
        ...

    def turn(self, x: Array) -> Array:
        """Matrix ``K`` (n, 3, 3): moving by ``dx`` turns the axes by ``w = K @ dx`` (vector in W).

        ``axes(x + dx) = axes(x) @ exp(w)^T`` to first order.
        """
        ...

    def leaning(self, x: Array, lean: Array) -> Array:
        """Astronomic east, north, up as rows in W (n, 3, 3), by deflections (n, 2) [rad]."""
        ...

    def latitude_at(self, x: Array) -> Array:
        """Geodetic latitudes (n,) [rad], 0 on a flat site, where no lean turns the north."""
        ...

    def height(self, x: Array) -> Array:
        """Heights (n,) in metres of points (n, 3); their gradient is the up axis."""
        ...


@dataclass(frozen=True)
class FlatSite:
    """A site where W is (E, N, U) with parallel verticals."""

    #: earth radius [m] used to reduce zenith angles, or None for a purely Cartesian site
    #: (industrial, or a textbook network)
    curvature_radius: float | None = None

    def axes(self, x: Array) -> Array:
        """Identity axes at every point."""
        return np.broadcast_to(np.eye(3), (len(x), 3, 3))

    def turn(self, x: Array) -> Array:
        """Zeros: parallel verticals do not turn."""
        return np.zeros((len(x), 3, 3))

    def leaning(self, x: Array, lean: Array) -> Array:
        """Axes (n, 3, 3) whose third leans by xi, eta (n, 2) [rad] to north and east."""
        level: Array = enu_rotation(np.zeros(1), np.zeros(1))[0]
        return enu_rotation(lean[:, 0], lean[:, 1]) @ level.T

    def latitude_at(self, x: Array) -> Array:
        """Zeros: a flat site has no latitude."""
        return np.zeros(len(x))

    def height(self, x: Array) -> Array:
        """The U coordinate."""
        return x[:, 2]


def enu_rotation(latitude: Array, longitude: Array) -> Array:
    """Rotations (..., 3, 3) from ECEF differences to east, north, up at positions (...,) [rad]."""
    sp, cp = np.sin(latitude), np.cos(latitude)
    sl, cl = np.sin(longitude), np.cos(longitude)
    zero = np.zeros_like(sp)
    rows = [[-sl, cl, zero], [-sp * cl, -sp * sl, cp], [cp * cl, cp * sl, sp]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def ecef_from_geodetic(
    latitude: Array, longitude: Array, height: Array, ellipsoid: tuple[float, float] = GRS80
) -> Array:
    """ECEF (..., 3) [m] of positions (...,) [rad] and heights [m] on a [m] and flattening."""
    a, f = ellipsoid
    e2 = f * (2 - f)
    nu = a / np.sqrt(1 - e2 * np.sin(latitude) ** 2)
    return np.stack(
        [
            (nu + height) * np.cos(latitude) * np.cos(longitude),
            (nu + height) * np.cos(latitude) * np.sin(longitude),
            (nu * (1 - e2) + height) * np.sin(latitude),
        ],
        axis=-1,
    )


def curvature_radii(latitude: Array, ellipsoid: tuple[float, float] = GRS80) -> tuple[Array, Array]:
    """Radii nu, m (...,) [m] in the prime vertical and meridian at latitudes (...,) [rad]."""
    a, f = ellipsoid
    e2 = f * (2 - f)
    w2 = 1 - e2 * np.sin(latitude) ** 2
    return a / np.sqrt(w2), a * (1 - e2) / w2**1.5


@dataclass(frozen=True)
class EllipsoidSite:
    """A site where W is ENU at an origin on an ellipsoid."""

    #: of the origin [rad]
    latitude: float
    longitude: float
    ellipsoidal_height: float  #: of the origin [m]
    ellipsoid: tuple[float, float] = field(default=GRS80)  #: semi-major axis [m] and flattening
    #: earth radius [m] for the correction of zenith angles where it is asked for; the verticals of
    #: this site carry the curvature already
    curvature_radius: float | None = None

    @classmethod
    def centred(cls, xyz: Array, ellipsoid: tuple[float, float] = GRS80) -> EllipsoidSite:
        """The site at the centroid of ECEF positions (n, 3) [m]."""
        anywhere = cls(0.0, 0.0, 0.0, ellipsoid)
        origin = anywhere.geodetic(anywhere.from_ecef(xyz.mean(axis=0)[None]))[0]
        return cls(float(origin[0]), float(origin[1]), float(origin[2]), ellipsoid)

    @cached_property
    def w_from_ecef(self) -> Array:
        """Rotation (3, 3) from ECEF differences to W."""
        return enu_rotation(np.float64(self.latitude), np.float64(self.longitude))  # type: ignore[arg-type]

    @cached_property
    def origin(self) -> Array:
        """ECEF (3,) [m] of the origin of W."""
        return ecef_from_geodetic(
            np.float64(self.latitude),  # type: ignore[arg-type]
            np.float64(self.longitude),  # type: ignore[arg-type]
            np.float64(self.ellipsoidal_height),  # type: ignore[arg-type]
            self.ellipsoid,
        )

    def to_ecef(self, x: Array) -> Array:
        """ECEF (n, 3) [m] of points (n, 3) in W."""
        return self.origin + x @ self.w_from_ecef

    def from_ecef(self, xyz: Array) -> Array:
        """W coordinates (n, 3) of ECEF points (n, 3)."""
        return (xyz - self.origin) @ self.w_from_ecef.T

    def geodetic(self, x: Array) -> Array:
        """Latitude, longitude [rad] and ellipsoidal height [m] (n, 3) of points (n, 3) in W.

        Bowring's start and three fixed-point steps: below 1e-9 m within 10 km of the ellipsoid.
        What is left is rounding of coordinates of 6000 km. Two steps of Newton's method in the
        differences from the origin take it away near it: heights within 10 km of the origin differ
        from each other by what they should to 1e-11 m, where levelling is of half a millimetre.
        """
        x = np.asarray(x, dtype=float)
        a, f = self.ellipsoid
        e2 = f * (2 - f)
        ecef = self.to_ecef(x)
        p = np.hypot(ecef[:, 0], ecef[:, 1])
        beta = np.arctan2(ecef[:, 2], (1 - f) * p)
        for _ in range(4):
            latitude = np.arctan2(
                ecef[:, 2] + e2 / (1 - e2) * a * (1 - f) * np.sin(beta) ** 3,
                p - e2 * a * np.cos(beta) ** 3,
            )
            beta = np.arctan2((1 - f) * np.sin(latitude), np.cos(latitude))
        nu = a / np.sqrt(1 - e2 * np.sin(latitude) ** 2)
        height = p * np.cos(latitude) + ecef[:, 2] * np.sin(latitude) - a**2 / nu
        turned = self._from_origin(x, latitude - self.latitude, height - self.ellipsoidal_height)
        longitude = np.arctan2(ecef[:, 1], ecef[:, 0])
        return np.stack(
            [self.latitude + turned[0], longitude, self.ellipsoidal_height + turned[1]], axis=1
        )

    def _from_origin(self, x: Array, turn: Array, rise: Array) -> tuple[Array, Array]:
        """Latitudes [rad] and heights [m] (n,) less the origin's, by products to keep digits."""
        a, f = self.ellipsoid
        e2 = f * (2 - f)
        sin0, cos0 = np.sin(self.latitude), np.cos(self.latitude)
        root0 = np.sqrt(1 - e2 * sin0**2)
        nu0, h0 = a / root0, self.ellipsoidal_height
        p0 = (nu0 + h0) * cos0
        # distance from the axis and along it, less those of the origin
        out = cos0 * x[:, 2] - sin0 * x[:, 1]
        p = np.hypot(p0 + out, x[:, 0])
        dp = (2 * p0 * out + out**2 + x[:, 0] ** 2) / (p + p0)
        dz = sin0 * x[:, 2] + cos0 * x[:, 1]
        for _ in range(2):
            latitude, half = self.latitude + turn, turn / 2
            sin, cos = np.sin(latitude), np.cos(latitude)
            dsin = 2 * np.cos(self.latitude + half) * np.sin(half)
            dcos = -2 * np.sin(self.latitude + half) * np.sin(half)
            root = np.sqrt(1 - e2 * sin**2)
            dnu = a * e2 * dsin * (sin + sin0) / (root * root0 * (root + root0))
            missing_p = dp - ((dnu + rise) * cos + (nu0 + h0) * dcos)
            missing_z = dz - (((1 - e2) * dnu + rise) * sin + ((1 - e2) * nu0 + h0) * dsin)
            m = a * (1 - e2) / root**3
            turn = turn + (cos * missing_z - sin * missing_p) / (m + h0 + rise)
            rise = rise + cos * missing_p + sin * missing_z
        return turn, rise

    def axes(self, x: Array) -> Array:
        """East, north and up (of the ellipsoid normal) at each point, as rows in W; (n, 3, 3)."""
        geodetic = self.geodetic(x)
        return enu_rotation(geodetic[:, 0], geodetic[:, 1]) @ self.w_from_ecef.T

    def leaning(self, x: Array, lean: Array) -> Array:
        """Astronomic east, north, up (n, 3, 3) in W, by xi, eta (n, 2) (method section 7.5)."""
        geodetic = self.geodetic(x)
        longitude = geodetic[:, 1] + lean[:, 1] / np.cos(geodetic[:, 0])
        return enu_rotation(geodetic[:, 0] + lean[:, 0], longitude) @ self.w_from_ecef.T

    def latitude_at(self, x: Array) -> Array:
        """Geodetic latitudes (n,) [rad]."""
        return self.geodetic(x)[:, 0]

    def turn(self, x: Array) -> Array:
        """Turn of the axes per metre (n, 3, 3): 1/(nu+h), 1/(M+h) and tan(lat)/(nu+h)."""
        geodetic = self.geodetic(x)
        nu, m = curvature_radii(geodetic[:, 0], self.ellipsoid)
        axes = self.axes(x)
        local = np.zeros((len(x), 3, 3))
        local[:, 0, 1] = -1 / (m + geodetic[:, 2])
        local[:, 1, 0] = 1 / (nu + geodetic[:, 2])
        local[:, 2, 0] = np.tan(geodetic[:, 0]) / (nu + geodetic[:, 2])
        return axes.transpose(0, 2, 1) @ local @ axes

    def height(self, x: Array) -> Array:
        """Ellipsoidal heights (n,) [m]."""
        return self.geodetic(x)[:, 2]
