"""The plumb line of a project: deflection of the vertical from numbers or a geoid grid."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from tribrach.geodesy.plumb import PlumbField
from tribrach.geodesy.site import EllipsoidSite
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.io.geoid_files import read_geoid
from tribrach.network.survey import ObservationTable, Survey
from tribrach.observations.control import ScalarPriors
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.sights import Sights
from tribrach.project import Project
from tribrach.units import SEC

_NAMES = ("deflection xi, correction", "deflection eta, correction")


@dataclass(frozen=True)
class PlumbLine:
    """How the plumb line leans against the normal of the work frame."""

    #: deflections and geoid heights at any place of the site
    everywhere: PlumbField
    #: of either component, an error that all stations share [rad]; 0 for none
    sigma: float
    #: where the deflection comes from
    source: str


def plumb_line(project: Project, frame: WorkFrame) -> PlumbLine | None:
    """Find the deflection of the vertical and the geoid that a project names."""
    deflection = project.site.deflection
    levelled = frame if frame.geoid_grid is not None else None
    if deflection is None:
        if levelled is None:
            return None
        return PlumbLine(PlumbField(frame=levelled), 0.0, str(project.site.geoid_grid))
    sigma = deflection.sigma_arcsec * SEC
    if deflection.grid is not None:
        if not isinstance(frame.site, EllipsoidSite):
            raise project.error(
                ("site", "deflection"),
                "a geoid grid needs a place on the ellipsoid, and the site is flat",
                "give the site a latitude and longitude or a crs, or give xi_arcsec and eta_arcsec",
            )
        grid = read_geoid(project.folder / deflection.grid)
        # a grid that is not there or of another region is refused before anything is adjusted
        grid.deflection(frame.site.latitude, frame.site.longitude, frame.site.ellipsoidal_height)
        return PlumbLine(PlumbField(grid=grid, frame=frame), sigma, deflection.grid)
    xi = (deflection.xi_arcsec or 0.0) * SEC
    eta = (deflection.eta_arcsec or 0.0) * SEC
    source = "deflection of the project" if deflection.xi_arcsec is not None else "no deflection"
    return PlumbLine(PlumbField(xi, eta, frame=levelled), sigma, source)


def apply_plumb_line(survey: Survey, plumb: PlumbLine | None) -> None:
    """Tell a survey of the plumb line, and give its readings the error that they share.

    The error becomes two unknowns with priors (method section 7.5).
    """
    if plumb is None:
        return
    survey.plumb = plumb.everywhere
    leaning = [table for table in survey.tables() if _leans(table, plumb.everywhere)]
    if not (plumb.sigma > 0 and leaning):
        return
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
    for table in leaning:
        for column, name in zip(("xi_error", "eta_error"), _NAMES, strict=True):
            table.columns[column] = np.full(table.n, name, dtype=object)


def _leans(table: ObservationTable, known: PlumbField) -> bool:
    """Do the values of a table depend on the deflection?"""
    if issubclass(table.kind, HeightDifferences):
        # with a geoid the differences of its heights count, not the deflection
        return known.grid is None and known.frame is None
    if issubclass(table.kind, Sights) and not table.kind.along_plumb:
        return False
    return any(item.name == "xi_error" for item in fields(table.kind))
