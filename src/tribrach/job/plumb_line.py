"""The plumb line of levelled scanners: deflection of the vertical from numbers or a geoid grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tribrach.geodesy.geoid_grid import GeoidGrid
from tribrach.geodesy.site import EllipsoidSite, Site
from tribrach.network.survey import Survey
from tribrach.observations.control import ScalarPriors
from tribrach.project import Project
from tribrach.units import SEC

__all__ = ["PlumbLine", "plumb_columns", "plumb_line"]

_NAMES = ("deflection xi, correction", "deflection eta, correction")


@dataclass(frozen=True)
class PlumbLine:
    """How the plumb line leans against the third axis of the work frame.

    Parameters
    ----------
    xi, eta : float
        Deflection of the vertical towards north and east [rad].
    sigma : float
        Of either component, an error that all stations share [rad]; 0 for none.
    source : str
        Where the deflection comes from.
    """

    xi: float
    eta: float
    sigma: float
    source: str


def plumb_line(project: Project, site: Site) -> PlumbLine | None:
    """Find the deflection of the vertical that a project names.

    Parameters
    ----------
    project : Project
        Gives the deflection as numbers or as a geoid grid.
    site : Site
        The work frame, a place on the ellipsoid where a grid is given.

    Returns
    -------
    PlumbLine or None
        None if the project names none.

    Raises
    ------
    InputError
        A grid without a place on the ellipsoid, or one that cannot be read.
    """
    deflection = project.site.deflection
    if deflection is None:
        return None
    xi = (deflection.xi_arcsec or 0.0) * SEC
    eta = (deflection.eta_arcsec or 0.0) * SEC
    source = "deflection of the project" if deflection.xi_arcsec is not None else "no deflection"
    if deflection.grid is not None:
        if not isinstance(site, EllipsoidSite):
            raise project.error(
                ("site", "deflection"),
                "a geoid grid needs a place on the ellipsoid, and the site is flat",
                "give the site a latitude and longitude or a crs, or give xi_arcsec and eta_arcsec",
            )
        grid = GeoidGrid(project.folder / deflection.grid)
        xi, eta = grid.deflection(site.latitude, site.longitude, site.ellipsoidal_height)
        source = deflection.grid
    return PlumbLine(xi, eta, deflection.sigma_arcsec * SEC, source)


def plumb_columns(survey: Survey, plumb: PlumbLine | None) -> dict[str, Any]:
    """Give what inclinations of a survey are told of the plumb line.

    Its error, common to all stations, becomes two unknowns with priors (method section 7.5).

    Parameters
    ----------
    survey : Survey
        Gets the unknowns and their priors.
    plumb : PlumbLine or None
        The deflection, None if there is none.

    Returns
    -------
    dict
        Columns of :class:`~tribrach.observations.scanner.Inclinations`.
    """
    if plumb is None:
        return {}
    columns: dict[str, Any] = {"xi": plumb.xi, "eta": plumb.eta}
    if plumb.sigma > 0:
        for name in _NAMES:
            survey.scalars[name] = (0.0, True)
        survey.add(
            ScalarPriors,
            values=[0.0, 0.0],
            sigma=plumb.sigma,
            scalar=list(_NAMES),
            source=[plumb.source, plumb.source],
            group="deflection of the vertical",
        )
        columns |= {"xi_error": [_NAMES[0]], "eta_error": [_NAMES[1]]}
    return columns
