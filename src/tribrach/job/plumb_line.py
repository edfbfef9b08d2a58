"""The plumb line of levelled scanners: deflection of the vertical from numbers or a geoid grid."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from tribrach.errors import InputError
from tribrach.geodesy.geoid_grid import GeoidGrid
from tribrach.geodesy.site import EllipsoidSite
from tribrach.network.survey import Survey
from tribrach.observations.control import ScalarPriors
from tribrach.project.site import Deflection
from tribrach.units import SEC

__all__ = ["plumb_columns"]

_NAMES = ("deflection xi, correction", "deflection eta, correction")


def plumb_columns(
    survey: Survey,
    deflection: Deflection | None,
    folder: Path,
    error: Callable[..., InputError],
) -> dict[str, Any]:
    """What inclinations of the survey are told of the plumb line; nothing without a deflection.

    Its error, common to all stations, becomes two unknowns with priors (method section 7.5).

    Raises
    ------
    InputError : a grid without a place on the ellipsoid, or that cannot be read.
    """
    if deflection is None:
        return {}
    xi = (deflection.xi_arcsec or 0.0) * SEC
    eta = (deflection.eta_arcsec or 0.0) * SEC
    source = "deflection of the project" if deflection.xi_arcsec is not None else "no deflection"
    if deflection.grid is not None:
        site = survey.site
        if not isinstance(site, EllipsoidSite):
            raise error(
                ("site", "deflection"),
                "a geoid grid needs a place on the ellipsoid, and the site is flat",
                "give the site a latitude and longitude or a crs, or give xi_arcsec and eta_arcsec",
            )
        grid = GeoidGrid(folder / deflection.grid)
        xi, eta = grid.deflection(site.latitude, site.longitude, site.ellipsoidal_height)
        source = deflection.grid
    columns: dict[str, Any] = {"xi": xi, "eta": eta}
    if deflection.sigma_arcsec > 0:
        for name in _NAMES:
            survey.scalars[name] = (0.0, True)
        survey.add(
            ScalarPriors,
            values=[0.0, 0.0],
            sigma=deflection.sigma_arcsec * SEC,
            scalar=list(_NAMES),
            source=[source, source],
            group="deflection of the vertical",
        )
        columns |= {"xi_error": [_NAMES[0]], "eta_error": [_NAMES[1]]}
    return columns
