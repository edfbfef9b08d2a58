"""Covariances between weighted coordinates of a Comp3D project, from its ``coord_cov_file``.

The file is the matrix that Comp3D exports of an adjustment: square, rows and columns named after
unknowns (``A_x``, ``A_y``, ``A_z`` of point A), in square metres along east and north of the grid
and up at each point. What it says of coordinates that carry a sigma replaces that sigma; the rest,
of free or held points and of other unknowns, is not used.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from tribrach._types import Array
from tribrach.io.survey.comp3d.points import Comp3dPoint, Comp3dPoints
from tribrach.io.survey.comp3d.project import Comp3dProject
from tribrach.io.survey.comp3d.text import Problems
from tribrach.io.survey.csv.matrix import CoordinateCovariance, read_matrix
from tribrach.network.survey import Survey
from tribrach.observations.base import Observations

#: kind, group and hardness of the observations of one table
TableKey = tuple[type[Observations], str, bool]
#: coordinates that a sentence names
_NAMED = 5


@dataclass(frozen=True)
class Weight:
    """The weighted coordinates of a point, as observations of a survey."""

    #: table, observation and row of each axis (0 E, 1 N, 2 h)
    places: Mapping[int, tuple[TableKey, int, int]]
    sigmas: tuple[float, float, float]  #: standard deviations of the coordinate file by axis [m]
    #: (3, 3), east, north, up in W as rows where all three are one observation in the axes of W
    axes: Array | None


def _weighted(record: Comp3dPoint) -> list[int]:
    """Axes of a point that carry a sigma."""
    return [axis for axis in range(3) if record.constrained[axis] and record.sigmas[axis] > 0]


def read_covariances(
    project: Comp3dProject, points: Comp3dPoints, problems: Problems
) -> CoordinateCovariance | None:
    """The covariances that a project names, of the coordinates that carry a sigma."""
    if not project.covariance:
        return None
    if project.inner_constraints:
        problems.warnings.append(
            f"The covariances of {project.covariance} are not used: with inner constraints no "
            "coordinate carries a weight."
        )
        return None
    wanted = {(name, a): None for name, r in points.records.items() for a in _weighted(r)}
    matrix = read_matrix(project.folder / project.covariance, wanted)
    missing = [f"{name}_{'xyz'[axis]}" for name, axis in wanted if (name, axis) not in matrix.keys]
    if missing:
        more = ", ..." if len(missing) > _NAMED else ""
        problems.warnings.append(
            f"{project.covariance} has no covariances of {len(missing)} weighted coordinates "
            f"({', '.join(missing[:_NAMED])}{more}): they keep the sigmas of the coordinate file, "
            "uncorrelated. Add them if they come from the same adjustment."
        )
    return matrix


def correlate(
    survey: Survey,
    matrix: CoordinateCovariance,
    weights: Mapping[str, Weight],
    numbers: Mapping[TableKey, int],
) -> None:
    """Give weighted coordinates their covariances.

    Points that the survey does not weigh, since nothing observes them, are left out.
    """
    names = [name for name in dict.fromkeys(name for name, _ in matrix.keys) if name in weights]
    keys = [(name, axis) for name in names for axis in sorted(weights[name].places)]
    if not keys:
        return
    rows = {key: k for k, key in enumerate(matrix.keys)}
    known = np.array([rows.get(key, -1) for key in keys])
    block = np.diag([weights[name].sigmas[axis] ** 2 for name, axis in keys])
    both = np.ix_(known >= 0, known >= 0)
    block[both] = matrix.matrix[np.ix_(known[known >= 0], known[known >= 0])]
    parts = [weights[name] for name in names]
    turn = block_diag(*(np.eye(len(p.places)) if p.axes is None else p.axes.T for p in parts))
    places = [weights[name].places[axis] for name, axis in keys]
    tables, items, axes = zip(*((numbers[key], i, r) for key, i, r in places), strict=True)
    source = f"{matrix.path.name}:{matrix.line}"
    survey.correlate(tables, items, axes, turn @ block @ turn.T, source)
