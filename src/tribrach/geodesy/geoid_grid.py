"""Geoid heights from a grid that the user brings: a table of its nodes, or a file that PROJ reads.

Nothing is ever downloaded. The deflection of the vertical follows from the slope of the geoid
(method section 7.5): ``xi = -(1/M) dN/dphi``, ``eta = -(1/(nu cos phi)) dN/dlambda``, with the
curvature of the normal plumb line, ``0.1713 arcsec per km of height times sin 2 phi``, added to xi.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyproj
from pyproj.exceptions import ProjError

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geodesy.height_table import HeightTable
from tribrach.geodesy.proj_grids import offline
from tribrach.geodesy.site import GRS80
from tribrach.units import SEC

#: half of the distance [rad] over which the slope is taken: two to three cells of a 2.5' grid
_STEP = np.radians(3 / 60)
#: curvature of the normal plumb line of GRS80 at 45 degrees [rad/m]: level surfaces sink towards
#: the pole with height, so that the zenith leans north
_CURVATURE = 0.1713e-3 * SEC


@dataclass(frozen=True)
class GeoidGrid:
    """A grid of geoid heights on disk; PROJ opens and reads it if it is not read here."""

    path: Path  #: of the file
    table: HeightTable | None = None  #: its nodes, where they were read

    @cached_property
    def _transformer(self) -> Any:
        """PROJ's reader of the grid."""
        if not self.path.is_file():
            raise InputError(
                "the geoid grid is not there",
                file=self.path,
                cure="put the grid of your region there; nothing is downloaded",
            )
        offline()
        try:
            # PROJ looks for relative names in its own folders, not in that of the project
            return pyproj.Transformer.from_pipeline(
                f'+proj=vgridshift +grids="{self.path.resolve()}" +multiplier=1'
            )
        except ProjError as error:
            raise InputError(
                "PROJ does not read this grid",
                file=self.path,
                cure="give a grid of geoid heights in GTX or GeoTIFF",
            ) from error

    def undulation(self, latitude: Array, longitude: Array) -> Array:
        """Geoid heights (n,) [m] over the ellipsoid at latitudes and longitudes (n,) [rad]."""
        if self.table is not None:
            height = self.table.at(latitude, longitude).reshape(np.shape(latitude))
        else:
            zero = np.zeros(np.shape(latitude))
            up = self._transformer.transform(longitude, latitude, zero, radians=True)[2]
            height = np.asarray(up, dtype=float)
        outside = np.flatnonzero(~np.isfinite(np.atleast_1d(height)))
        if len(outside):
            k = outside[0]
            where = np.degrees([np.atleast_1d(latitude)[k], np.atleast_1d(longitude)[k]])
            raise InputError(
                f"the geoid grid does not reach to latitude {where[0]:.4f}, "
                f"longitude {where[1]:.4f}",
                file=self.path,
                cure="give the grid of this region",
            )
        return height

    def deflection(self, latitude: float, longitude: float, height: float) -> tuple[float, float]:
        """Deflection xi, eta [rad] at a geodetic position [rad] and height [m]."""
        place = np.array([latitude]), np.array([longitude]), np.array([height])
        xi, eta = slope(self.undulation, *place)[0]
        return float(xi), float(eta)


def slope(
    undulation: Callable[[Array, Array], Array],
    latitude: Array,
    longitude: Array,
    height: Array,
    ellipsoid: tuple[float, float] = GRS80,
) -> Array:
    """Deflections xi, eta (n, 2) [rad] from slopes of ``undulation`` (n,) [m] at positions.

    Osada et al. 2017, Sensors 17:1489; method section 7.5. ``ellipsoid``: a [m] and flattening.
    """
    step = np.repeat([_STEP, -_STEP, 0.0, 0.0], len(latitude))
    lat = np.tile(latitude, 4) + step
    lon = np.tile(longitude, 4) + np.roll(step, 2 * len(latitude))
    n = undulation(lat, lon).reshape(4, -1)
    a, f = ellipsoid
    e2 = f * (2 - f)
    w2 = 1 - e2 * np.sin(latitude) ** 2
    nu, m = a / np.sqrt(w2), a * (1 - e2) / w2**1.5
    xi = -(n[0] - n[1]) / (2 * _STEP * m) + _CURVATURE * height * np.sin(2 * latitude)
    eta = -(n[2] - n[3]) / (2 * _STEP * nu * np.cos(latitude))
    return np.stack([xi, eta], axis=1)
