"""The datum of a projected grid: its ellipsoid, its name, and how it lies to WGS 84.

A grid belongs to a datum, and everything on a projected site stays in it. Only two things need to
know how this datum lies to others: geoid models, which give heights over a geocentric ellipsoid,
and satellite positions of another frame (:mod:`tribrach.geodesy.frames`). Method section 1.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from pyproj import CRS
from pyproj.exceptions import ProjError

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geodesy import frames
from tribrach.geodesy.proj_grids import offline
from tribrach.geodesy.site import EllipsoidSite, ecef_from_geodetic

#: datums this close [m] to WGS 84 have its centre: geoid models of a country are in its own
_GEOCENTRIC = 5.0
_WGS84 = "WGS 84"


@dataclass(frozen=True, eq=False)
class GridDatum:
    """The datum of a projected coordinate reference system."""

    projected: CRS  #: the projected system without heights and without a bound transformation
    #: latitude and longitude in this datum, in its own units and from its own meridian
    geographic: CRS

    @classmethod
    def of(cls, crs: str, instead: str | None = None) -> GridDatum:
        """The datum of a reference system."""
        return _datum_of(crs, instead)

    @cached_property
    def unit(self) -> float:
        """Radians in the unit of the datum's latitudes and longitudes (degrees, grads)."""
        return float(self.geographic.axis_info[0].unit_conversion_factor)

    @cached_property
    def meridian(self) -> float:
        """Longitude from Greenwich of the datum's prime meridian [rad]."""
        zero = self.geographic.prime_meridian
        return 0.0 if zero is None else zero.longitude * float(zero.unit_conversion_factor)

    @cached_property
    def ellipsoid(self) -> tuple[float, float]:
        """Semi-major axis [m] and flattening."""
        body = self.geographic.ellipsoid
        assert body is not None
        return (
            body.semi_major_metre,
            1 / body.inverse_flattening if body.inverse_flattening else 0.0,
        )

    @cached_property
    def frame(self) -> str | None:
        """Datum as a geocentric frame with Greenwich as meridian; None if PROJ has none."""
        name = self.geographic.name
        if self.meridian:
            # EPSG names them after the datum and the meridian: NTF (Paris)
            name = name.rpartition(" (")[0]
        try:
            frames.frame(name)
        except InputError:
            return None
        return name

    def over_wgs84(self, latitude: Array, longitude: Array) -> tuple[Array, Array, Array]:
        """The surface of this datum's ellipsoid as it lies to the one that geoid models refer to.

        Geoid models of a country are given in its own geocentric datum (ETRS89, NAD83, GDA2020),
        and there is nothing between. The ellipsoids of older datums lie up to some hundred metres
        off; EPSG's parameters through PROJ say how.

        ``latitude``, ``longitude`` (n,): geodetic position [rad] in this datum. Returns
        ``latitude``, ``longitude`` (n,): the same places for the geoid model [rad]; ``height``
        (n,): heights of this datum's ellipsoid over that of the geoid model [m].
        """
        none = np.zeros(np.shape(latitude))
        if self.frame is None:
            return latitude, longitude, none
        here = ecef_from_geodetic(latitude, longitude, none, self.ellipsoid)
        try:
            there, _ = frames.transform(here, self.frame, _WGS84, 2000.0)
        except (InputError, ProjError):
            return latitude, longitude, none
        if np.abs(there - here).max(initial=0.0) < _GEOCENTRIC:
            return latitude, longitude, none
        anywhere = EllipsoidSite(0.0, 0.0, 0.0, frames.ellipsoid(_WGS84))
        moved = anywhere.geodetic(anywhere.from_ecef(there))
        return moved[:, 0], moved[:, 1], moved[:, 2]


@cache
def _datum_of(crs: str, instead: str | None) -> GridDatum:
    """The datum of a reference system, or the one that is taken instead."""
    offline()
    whole = system = CRS.from_user_input(crs)
    while system.is_bound or system.is_compound:
        inner = system.source_crs if system.is_bound else system.sub_crs_list[0]
        assert inner is not None
        system = inner
    if not system.is_projected:
        raise InputError(f"{crs} is not a projected grid")
    if instead is not None:
        return GridDatum(whole, CRS.from_user_input(instead))
    own = system.geodetic_crs
    assert own is not None
    return GridDatum(system, own)
