"""What does it cost to take a site as flat? Numbers for the warning (method section 1.1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pyproj import CRS, Proj, Transformer
from pyproj.exceptions import CRSError, ProjError

from tribrach.errors import InputError
from tribrach.geodesy.grid import gaussian_radius

__all__ = ["flat_warnings", "grid_scale"]

Array = NDArray[np.float64]
RADIUS = 6371000.0
#: effects below this [m] are not worth a sentence
NEGLIGIBLE = 1e-4


def grid_scale(crs: str, xyz: Array) -> float:
    """Length in the grid over length on the ground, minus one, at E, N, height (3,) [m].

    Raises
    ------
    InputError : PROJ does not know the grid, or the place is outside of it.
    """
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


def flat_warnings(xyz: Array, crs: str | None, *, curved: bool) -> list[str]:
    """Sentences on what a flat site neglects over the extent of points (n, 3), E, N, U [m].

    crs : the projection of the coordinates, if they are projected; curved : zenith angles are
    corrected for the curvature of the Earth.
    """
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
            out.append(
                f"the coordinates of {crs} are taken as Cartesian: their scale differs from the "
                f"ground by {1e6 * scale:.1f} ppm, {1e3 * abs(scale) * extent:.1f} mm over the "
                f"{extent:.0f} m of the site; a site of kind projected takes it into account"
            )
    bend = extent**2 / (2 * RADIUS)
    if bend > NEGLIGIBLE and not curved:
        out.append(
            f"the site is taken as flat: over its {extent:.0f} m the Earth curves by "
            f"{1e3 * bend:.1f} mm and plumb lines turn by {extent / 30.9:.1f} arcsec; "
            "curvature_radius_m or a site on the ellipsoid takes it into account"
        )
    return out
