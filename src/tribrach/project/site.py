"""The section ``[site]`` of a project: where the work frame is and how plumb lines lean in it."""

from __future__ import annotations

from typing import Any, Literal, Self

from pydantic import Field, NonNegativeFloat, PositiveFloat, model_validator

from tribrach.errors import InputError
from tribrach.geodesy.epochs import Realisation, crs_is_dynamic
from tribrach.project.sections import Section


def check_reference(crs: str | None, frame: str | None, epoch: float | None) -> None:
    """Refuse a dynamic reference system without an epoch, and unknown frames."""
    if epoch is None and crs is not None and crs_is_dynamic(crs):
        raise ValueError(
            f"coordinates in {crs} move with time: add the epoch as a decimal year, such as 2026.9"
        )
    if frame is not None:
        try:
            Realisation(frame, epoch)
        except InputError as error:
            raise ValueError(f"{error.what}; {error.cure}") from error


class Deflection(Section):
    """Deflection of the vertical at the site, for everything that is levelled."""

    #: Towards north and towards east.
    xi_arcsec: float | None = Field(default=None, ge=-120, le=120)
    eta_arcsec: float | None = Field(default=None, ge=-120, le=120)
    #: File of geoid heights whose slope is the deflection, instead of numbers.
    grid: str | None = None
    #: Standard deviation of either component, an error that all stations share.
    sigma_arcsec: NonNegativeFloat = 10.0

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        """Numbers or a grid."""
        if self.grid is not None and (self.xi_arcsec, self.eta_arcsec) != (None, None):
            raise ValueError("give xi_arcsec and eta_arcsec, or a grid, not both")
        return self


class SiteSection(Section):
    """Where the work frame is."""

    #: ``flat``: Cartesian E, N, U (crs only for a warning); ``geodetic``: E, N, U around an origin
    #: on GRS80; ``projected``: easting, northing, height of a crs, converted point by point in its
    #: datum.
    kind: Literal["flat", "geodetic", "projected"] = "flat"
    #: Radius of the Earth for zenith angles on a flat site.
    curvature_radius_m: PositiveFloat | None = None
    #: Origin of a geodetic site; one with a frame and no origin is centred on its geocentric
    #: points.
    latitude_deg: float | None = Field(default=None, ge=-90, le=90)
    longitude_deg: float | None = Field(default=None, ge=-360, le=360)
    height_m: float = 0.0
    crs: str | None = None  #: Coordinate reference system, such as ``EPSG:5897``.
    #: Make given heights ellipsoidal, by one number or point by point.
    geoid_height_m: float = 0.0
    geoid_grid: str | None = None
    #: What given heights are called: with a geoid orthometric or normal, without one ellipsoidal.
    heights: Literal["ellipsoidal", "orthometric", "normal"] | None = None
    #: Standard deviation of the geoid, a number or a grid; it joins the covariance of control
    #: heights.
    geoid_sigma_mm: NonNegativeFloat = 0.0
    geoid_sigma_grid: str | None = None
    #: Distance at which errors of the geoid share 1/e of their variance.
    geoid_correlation_km: PositiveFloat = 30.0
    #: How the plumb line leans against the normal of the ellipsoid, or the third axis.
    deflection: Deflection | None = None
    #: Reference frame of geocentric coordinates, transformed to the datum of a crs.
    frame: str | None = None
    #: Decimal year that coordinates in a dynamic frame hold for.
    epoch: float | None = Field(default=None, gt=1900, lt=2200)

    @model_validator(mode="before")
    @classmethod
    def _infer(cls, data: Any) -> Any:
        """The kind follows from the keys if it is not given."""
        if isinstance(data, dict) and "kind" not in data:
            if "latitude_deg" in data or "longitude_deg" in data:
                return data | {"kind": "geodetic"}
            if "crs" in data:
                return data | {"kind": "projected"}
            if "frame" in data:
                return data | {"kind": "geodetic"}
        return data

    @model_validator(mode="after")
    def _complete(self) -> Self:
        """Each kind has the keys it needs."""
        half = (self.latitude_deg is None) != (self.longitude_deg is None)
        nowhere = self.latitude_deg is None and self.frame is None
        if self.kind == "geodetic" and (half or nowhere):
            raise ValueError("a geodetic site needs latitude_deg and longitude_deg")
        if self.kind == "projected" and self.crs is None:
            raise ValueError("a projected site needs crs, such as EPSG:5897")
        if self.geoid_grid is not None and self.kind == "flat":
            raise ValueError("geoid_grid needs a place on the ellipsoid, and the site is flat")
        if self.geoid_grid is not None and self.geoid_height_m:
            raise ValueError("give either geoid_grid or geoid_height_m")
        if self.geoid_sigma_grid is not None and self.geoid_sigma_mm:
            raise ValueError("give either geoid_sigma_mm or geoid_sigma_grid")
        over = self.geoid_grid is not None or self.geoid_height_m
        if self.heights == "ellipsoidal" and (over or self.kind == "flat"):
            raise ValueError("ellipsoidal heights have no geoid, and a site on the ellipsoid")
        if self.heights in ("orthometric", "normal") and self.kind != "flat" and not over:
            raise ValueError(f"{self.heights} heights need geoid_grid or geoid_height_m")
        uncertain = self.geoid_sigma_grid is not None or self.geoid_sigma_mm > 0
        if uncertain and self.geoid_grid is None and not self.geoid_height_m:
            raise ValueError("a sigma of the geoid needs geoid_grid or geoid_height_m")
        check_reference(self.crs, self.frame, self.epoch)
        return self
