"""Given coordinates, vectors and covariances, converted into the work frame.

Coordinates come in the site's own system (E, N, U on a flat site or around a geodetic origin;
easting, northing and height in a projection), as latitude, longitude and height, or geocentric.
Covariances come in the axes that belong to them and are propagated (method section 1.1). Metres and
radians.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geodesy.geoid_grid import GeoidGrid
from tribrach.geodesy.projection import ProjectedGrid
from tribrach.geodesy.site import EllipsoidSite, FlatSite, Site, ecef_from_geodetic


@dataclass(frozen=True)
class WorkFrame:
    """The work frame and the system in which the site's own coordinates are given."""

    site: Site = field(default_factory=FlatSite)  #: the work frame itself
    grid: ProjectedGrid | None = None  #: the projection of E, N, if they are projected
    #: geoid height [m] of the place, added to given heights to make them ellipsoidal
    geoid: float = 0.0
    geoid_grid: GeoidGrid | None = None  #: geoid heights point by point, added as well

    @property
    def leaves_datum(self) -> bool:
        """True if geoid heights refer to another datum than that of the site's grid."""
        if self.grid is None or (self.geoid_grid is None and not self.geoid):
            return False
        latitude, longitude = np.array(self.grid.place)[:, None]
        return bool(self.grid.datum.over_wgs84(latitude, longitude)[2].any())

    def undulation(self, latitude: Array, longitude: Array) -> Array:
        """Geoid heights (n,) [m] over the site's ellipsoid at positions (n,) [rad] in its datum."""
        if self.geoid_grid is None and not self.geoid:
            return np.zeros(np.shape(latitude))
        own = np.zeros(np.shape(latitude))
        if self.grid is not None:
            latitude, longitude, own = self.grid.datum.over_wgs84(latitude, longitude)
        undulation = self.geoid - own
        if self.geoid_grid is None:
            return undulation
        return undulation + self.geoid_grid.undulation(latitude, longitude)

    def from_own(self, enu: Array, covariance: Array | None = None) -> tuple[Array, Array | None]:
        """Own coordinates (n, 3) [m] and covariance (n, 3, 3) [m^2] in W."""
        if self.grid is None:
            return enu, covariance
        up = np.zeros_like(enu)
        # the geoid changes by micrometres over the error of the plan place at another height
        there = self.grid.site.geodetic(self.grid.to_work(enu))
        up[:, 2] = self.undulation(there[:, 0], there[:, 1])
        positions = self.grid.to_work(enu + up)
        if covariance is None:
            return positions, None
        jacobian = np.stack(
            [
                (self.grid.to_work(enu + up + step) - self.grid.to_work(enu + up - step)) / 2
                for step in np.eye(3)
            ],
            axis=2,
        )
        return positions, jacobian @ covariance @ jacobian.transpose(0, 2, 1)

    def from_geodetic(
        self, geodetic: Array, covariance: Array | None = None
    ) -> tuple[Array, Array | None]:
        """Geodetic positions (n, 3) and their ENU covariances (n, 3, 3) [m^2] in W."""
        site = self._ellipsoid("latitude and longitude")
        height = geodetic[:, 2] + self.undulation(geodetic[:, 0], geodetic[:, 1])
        ecef = ecef_from_geodetic(geodetic[:, 0], geodetic[:, 1], height, site.ellipsoid)
        positions = site.from_ecef(ecef)
        if covariance is None:
            return positions, None
        axes = site.axes(positions)
        return positions, axes.transpose(0, 2, 1) @ covariance @ axes

    def from_ecef(self, xyz: Array, covariance: Array | None = None) -> tuple[Array, Array | None]:
        """Geocentric coordinates (n, 3) [m] and their covariances (n, 3, 3) [m^2] in W."""
        site = self._ellipsoid("geocentric coordinates")
        turned = None if covariance is None else self.turned(covariance)
        return site.from_ecef(xyz), turned

    def vectors(self, difference: Array) -> Array:
        """Geocentric vectors (n, 3) [m] along the axes of W."""
        return difference @ self._ellipsoid("geocentric vectors").w_from_ecef.T

    def turned(self, covariance: Array) -> Array:
        """Geocentric covariances (n, 3, 3) [m^2] along the axes of W."""
        rotation = self._ellipsoid("geocentric covariances").w_from_ecef
        return rotation @ covariance @ rotation.T

    def _ellipsoid(self, what: str) -> EllipsoidSite:
        """The site as an ellipsoidal one; an error that names ``what`` needs it otherwise."""
        if not isinstance(self.site, EllipsoidSite):
            raise InputError(
                f"{what} need a place on the ellipsoid, and the site is flat",
                cure="give the project a site with latitude_deg and longitude_deg, or a crs",
            )
        return self.site
