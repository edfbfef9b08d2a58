"""Projected coordinates and heights, and the work frame they stand for.

Grid coordinates E, N with ellipsoidal heights h become positions in W by projection, ellipsoid and
ENU at the origin, so that scale, convergence and curvature are exact everywhere; and back again.
Everything stays in the datum of the grid and over its ellipsoid, so that no change of datum turns
or moves anything. The warnings state what a site neglects that is taken as flat. Method section
1.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pyproj import CRS, Proj, Transformer
from pyproj.exceptions import CRSError, ProjError

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geodesy.grid_datum import GridDatum
from tribrach.geodesy.proj_grids import offline
from tribrach.geodesy.site import GRS80, EllipsoidSite, ecef_from_geodetic
from tribrach.sentences import Sentence
from tribrach.units import SEC

#: mean radius of the Earth [m]
RADIUS = 6371000.0
#: effects below this [m] are not worth a sentence
NEGLIGIBLE = 1e-4


def gaussian_radius(latitude: float, ellipsoid: tuple[float, float] = GRS80) -> float:
    """Mean radius of curvature ``sqrt(M N)`` [m] at a latitude [rad]."""
    a, f = ellipsoid
    e2 = f * (2 - f)
    return float(a * np.sqrt(1 - e2) / (1 - e2 * np.sin(latitude) ** 2))


def stereographic(latitude: float, easting: float, northing: float) -> str:
    """PROJ's oblique stereographic grid that touches at a latitude [degrees], longitude zero."""
    return (
        f"+proj=sterea +lat_0={latitude!r} +lon_0=0 +k_0=1 +x_0={easting!r} +y_0={northing!r} "
        "+ellps=GRS80 +units=m +type=crs"
    )


@dataclass(frozen=True)
class ProjectedGrid:
    """A projected grid around an origin."""

    crs: str  #: anything PROJ understands, such as ``EPSG:2154`` or a ``+proj`` string
    #: coordinates of the origin [m]
    easting: float
    northing: float
    height: float = 0.0  #: ellipsoidal height of the origin [m]
    #: A geographic system that places are taken to in plan, their heights as they are, instead of
    #: staying in the datum of the grid: what some programs do, whose results are to be met
    geographic: str | None = None

    @cached_property
    def datum(self) -> GridDatum:
        """The datum of the grid, or the one that is taken instead."""
        try:
            return GridDatum.of(self.crs, self.geographic)
        except (CRSError, ProjError) as error:
            raise InputError(
                f"the grid {self.crs} is not known to PROJ", cure="give an EPSG code"
            ) from error

    @cached_property
    def _projection(self) -> Transformer:
        """From the grid to longitude and latitude, in units and from the meridian of its datum."""
        datum = self.datum
        offline()
        try:
            return Transformer.from_crs(datum.projected, datum.geographic, always_xy=True)
        except ProjError as error:
            raise InputError(
                f"the grid {self.crs} cannot be computed by PROJ", cure="give an EPSG code"
            ) from error

    def _geographic(self, easting: Array | float, northing: Array | float) -> tuple[Array, Array]:
        """Latitude and longitude from Greenwich [rad] in the datum of the grid."""
        longitude, latitude = self._projection.transform(easting, northing)
        unit, meridian = self.datum.unit, self.datum.meridian
        return unit * np.asarray(latitude), unit * np.asarray(longitude) + meridian

    @cached_property
    def place(self) -> tuple[float, float]:
        """Latitude and longitude [rad] of the origin, in the datum of the grid."""
        latitude, longitude = self._geographic(self.easting, self.northing)
        if not (np.isfinite(longitude) and np.isfinite(latitude)):
            raise InputError(
                f"the origin {self.easting:g} {self.northing:g} is outside the grid {self.crs}"
            )
        return float(latitude), float(longitude)

    @cached_property
    def site(self) -> EllipsoidSite:
        """The work frame: ENU at the origin on the ellipsoid of the grid."""
        phi, longitude = self.place
        body = self.datum.ellipsoid
        return EllipsoidSite(phi, longitude, self.height, body, gaussian_radius(phi, body))

    def plan(self, latitude: float, longitude: float) -> Array:
        """E, N (2,) [m] of a latitude and longitude [rad] in the datum of the grid."""
        place: Array = self._plan(np.array([longitude]), np.array([latitude]))[0]
        if not np.isfinite(place).all():
            raise InputError(
                f"latitude {np.degrees(latitude):.4f}, longitude {np.degrees(longitude):.4f} is "
                f"outside the grid {self.crs}",
                cure="give the crs of the place",
            )
        return place

    def to_work(self, enh: Array) -> Array:
        """W coordinates (n, 3) of E, N, h (n, 3)."""
        latitude, longitude = self._geographic(enh[:, 0], enh[:, 1])
        ecef = ecef_from_geodetic(latitude, longitude, enh[:, 2], self.datum.ellipsoid)
        return self.site.from_ecef(ecef)

    def from_work(self, x: Array) -> Array:
        """E, N, h (n, 3) of W coordinates (n, 3)."""
        geodetic = self.site.geodetic(x)
        plan = self._plan(geodetic[:, 1], geodetic[:, 0])
        if self.geographic is not None:
            # a change of datum in plan alone does not return exactly: 0.4 mm from NTF and back
            latitude, longitude = self._geographic(plan[:, 0], plan[:, 1])
            plan += plan - self._plan(longitude, latitude)
        return np.concatenate([plan, geodetic[:, 2:]], axis=1)

    def _plan(self, longitude: Array, latitude: Array) -> Array:
        """E, N (n, 2) of geographic positions [rad] from Greenwich in the datum of the grid."""
        unit, meridian = self.datum.unit, self.datum.meridian
        own = (longitude - meridian) / unit, latitude / unit
        return np.stack(self._projection.transform(*own, direction="INVERSE"), axis=1)


def grid_scale(crs: str, xyz: Array) -> float:
    """Grid length over length on the ground, less one, at e, N, height (3,) [m] or NaN."""
    try:
        definition = CRS.from_user_input(crs)
        to_geographic = Transformer.from_crs(definition, definition.geodetic_crs, always_xy=True)
        longitude, latitude = to_geographic.transform(xyz[0], xyz[1], errcheck=True)
        factor = float(Proj(definition).get_factors(longitude, latitude).meridional_scale)
    except (CRSError, ProjError) as error:
        raise InputError(
            f"the site is not within the grid {crs}", cure="check crs and coordinates"
        ) from error
    height = 0.0 if np.isnan(xyz[2]) else float(xyz[2])
    radius = gaussian_radius(np.radians(latitude))
    return factor / (1 + height / radius) - 1


@dataclass(frozen=True)
class FlatEffect:
    """Effects that a flat site neglects."""

    sentence: str  #: in words, with what takes it into account
    size: float  #: over the extent of the site [m]
    axes: tuple[int, ...]  #: coordinates that it acts on, of 0, 1, 2 for E, N, U


def flat_effects(xyz: Array, crs: str | None, *, curved: bool) -> list[FlatEffect]:
    """What a flat site neglects over its points (n, 3) [m]; ``curved`` zeniths are corrected."""
    known = xyz[~np.isnan(xyz[:, :2]).any(axis=1)]
    if len(known) < 2:
        return []
    extent = float(np.hypot(*np.ptp(known[:, :2], axis=0)))
    out = []
    if crs is not None:
        height = known[:, 2][~np.isnan(known[:, 2])]
        centre = np.array([*known[:, :2].mean(axis=0), height.mean() if len(height) else np.nan])
        scale = grid_scale(crs, centre)
        if abs(scale) * extent > NEGLIGIBLE:
            words = Sentence(
                "the coordinates of {crs} are taken as Cartesian: their scale differs from the "
                "ground by {scale:ppm1}, {scale2:1} mm over the {extent:0} m of the site; a "
                "site of kind projected takes it into account",
                crs=crs,
                scale=scale,
                scale2=1000.0 * abs(scale) * extent,
                extent=extent,
            )
            out.append(FlatEffect(words, abs(scale) * extent, (0, 1)))
    bend = extent**2 / (2 * RADIUS)
    if bend > NEGLIGIBLE and not curved:
        words = Sentence(
            "the site is taken as flat: over its {extent:0} m the Earth curves by "
            "{bend:mm1} and plumb lines turn by {extent2:arcsec1}; a radius of curvature "
            "for the site, or a site on the ellipsoid, takes it into account",
            extent=extent,
            bend=bend,
            extent2=extent / 30.9 * SEC,
        )
        out.append(FlatEffect(words, bend, (2,)))
    return out
