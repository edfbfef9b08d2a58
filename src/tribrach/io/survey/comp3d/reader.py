"""Comp3D networks (IGN): ``.comp`` projects, or an ``.obs`` and a ``.cor`` file.

Grid coordinates and ellipsoidal heights become a work frame that is East-North-Up at the
project's centre on the ellipsoid, so that the scale of heights, the convergence and the curvature
that Comp3D's spherical frame approximates are exact. Sigmas of coordinates are along the local
axes of each point. Subframes (codes 11 and 12) are stations with six unknowns, levelled ones with
both tilts held. Whatever is switched off in the files stays, switched off, with its reason.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tribrach.errors import InputError
from tribrach.geodesy.projection import ProjectedGrid, stereographic
from tribrach.io.survey.comp3d.assembly import assemble
from tribrach.io.survey.comp3d.covariances import read_covariances
from tribrach.io.survey.comp3d.observations import read_observations
from tribrach.io.survey.comp3d.points import Comp3dPoints, read_points
from tribrach.io.survey.comp3d.project import DEFAULT_LATITUDE, Comp3dProject, read_project
from tribrach.io.survey.comp3d.text import Problems
from tribrach.network.survey import Survey
from tribrach.sentences import Sentence
from tribrach.units import DEG


def read(paths: Path | Sequence[Path], *, tolerant: bool = False) -> Survey:
    """Survey of a project file, or of an observation and a coordinate file.

    ``paths``: one ``.comp`` file, or an ``.obs`` and a ``.cor`` file; ``tolerant``: leave lines out
    that cannot be used, with a warning for each, as Comp3D does.
    """
    given = [paths] if isinstance(paths, Path) else list(paths)
    problems = Problems(given[0].parent, tolerant)
    with problems.refused as refused:
        project = read_project(given)
        points = read_points(project.folder / project.points, project.points, problems)
        observed = read_observations(
            project.folder / project.observations,
            project.observations,
            points,
            project.unit,
            problems,
        )
        refused.settle()
        if not points.records:
            raise InputError("no point has usable coordinates", file=project.points)
        project = _located(project, points, problems)
        covariances = read_covariances(project, points, problems)
        survey = assemble(project, points, observed, problems, covariances)
    return survey


def _located(project: Comp3dProject, points: Comp3dPoints, problems: Problems) -> Comp3dProject:
    """The project with its grid, by default a local system around its points."""
    if project.grid is not None:
        return project
    centre = np.mean([record.enh for record in points.records.values()], axis=0).round(-1)
    easting, northing = float(centre[0]), float(centre[1])
    problems.warnings.append(
        Sentence(
            "No project file: a local stereographic grid around {easting:0} {northing:0} "
            "at latitude {latitude:degreesg} and refraction {project.refraction:g} are "
            "assumed.",
            easting=easting,
            northing=northing,
            latitude=DEFAULT_LATITUDE * DEG,
            project=project,
        )
    )
    crs = stereographic(DEFAULT_LATITUDE, easting, northing)
    return replace(project, grid=ProjectedGrid(crs, easting, northing))
