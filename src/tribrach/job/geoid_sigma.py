"""The sigma of the geoid in the covariances of heights that count from it (method section 7.5).

A geoid is smooth, and so is its error: heights of neighbouring points share it. Two points that are
d apart share ``sigma_i sigma_j exp(-d / D)``, along the verticals of both.
"""

from __future__ import annotations

import numpy as np

from tribrach.errors import InputError
from tribrach.geodesy.site import EllipsoidSite
from tribrach.io.geoid_files import read_geoid
from tribrach.network.facts import OverGeoid, facts_of
from tribrach.network.survey import Survey
from tribrach.observations.control import Coordinates
from tribrach.observations.declaration import Category
from tribrach.project import Project


def apply_geoid_sigma(project: Project, survey: Survey) -> None:
    """Give control heights over the geoid the error that its grid brings."""
    site, own = survey.site, project.site
    if not isinstance(site, EllipsoidSite):
        return
    if own.geoid_sigma_grid is None and not own.geoid_sigma_mm:
        return
    over = {name for fact in facts_of(survey.facts, OverGeoid) for name in fact.names}
    tied = survey.correlated_tables()
    where: list[tuple[int, int]] = []
    for number, table in enumerate(survey.tables()):
        if table.kind is Coordinates:
            items = [k for k, name in enumerate(table.columns["position"]) if str(name) in over]
            if items and number in tied:
                raise project.error(
                    ("site",),
                    "a sigma of the geoid and a file of covariances speak of the same heights",
                    "put the geoid's part into the file of covariances, and leave its sigma out",
                )
            where += [(number, item) for item in items]
    if not where:
        return
    tables = survey.tables()
    x = np.array([tables[n].columns["values"][item] for n, item in where])
    latitude, longitude, _ = site.geodetic(x).T
    if own.geoid_sigma_grid is not None:
        path = project.folder / own.geoid_sigma_grid
        sigma = read_geoid(path).undulation(latitude, longitude)
        if not (sigma >= 0).all():
            raise InputError(
                f"the grid of sigmas holds {sigma.min():g} m",
                file=path,
                cure="give the grid of sigmas of the geoid in geoid_sigma_grid",
            )
    else:
        sigma = np.full(len(x), own.geoid_sigma_mm / 1e3)
    apart = np.linalg.norm(x[:, None] - x, axis=2)
    share = np.outer(sigma, sigma) * np.exp(-apart / (1e3 * own.geoid_correlation_km))
    up = site.axes(x)[:, 2]
    size = 3 * len(x)
    common = np.einsum("ij,ia,jb->iajb", share, up, up).reshape(size, size)
    alone = np.zeros((size, size))
    for k, (number, item) in enumerate(where):
        block = slice(3 * k, 3 * k + 3)
        alone[block, block] = tables[number].columns["covariance"][item]
    place = np.repeat(np.array(where, dtype=np.int64), 3, axis=0)
    row = np.tile(np.arange(3), len(x))
    survey.correlate(
        place[:, 0], place[:, 1], row, alone + common, "geoid", (common, Category.CONTROL)
    )
