"""Comp3D's points in a survey: which unknowns they have, and their control.

A fully weighted point is control with a covariance; a partly weighted one is observed axis by
axis: east and north of the grid, height over the ellipsoid. Points with a height only
keep their plan position and the other way round. Coordinates that are held drop out if the whole
point is held and are hard constraints otherwise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach.geodesy.site import EllipsoidSite
from tribrach.io.survey.comp3d_points import PointRecord
from tribrach.io.survey.comp3d_tables import Tables
from tribrach.network.observations.base import Observations
from tribrach.network.observations.component import Components
from tribrach.network.observations.coordinates import Coordinates
from tribrach.network.observations.height import Heights

__all__ = ["INNER", "add_control", "free_axes", "grid_axes"]

Array = NDArray[np.float64]
INNER = "the project uses inner constraints"


def grid_axes(x: Array, site: EllipsoidSite) -> Array:
    """Axes (3, 3) at ``x`` (3,): the grid's east and north in the local horizon, and up.

    The grid of the computation has the north of the project's centre everywhere.
    """
    up = site.axes(x[None])[0, 2]
    east = np.array([1.0, 0.0, 0.0]) - up[0] * up
    east /= np.linalg.norm(east)
    return np.stack([east, np.cross(up, east), up])


def free_axes(record: PointRecord) -> tuple[bool, ...]:
    """Which of E, N, U of W are unknown."""
    if all(record.used) and not all(record.held):
        return True, True, True
    return tuple(u and not h for u, h in zip(record.used, record.held, strict=True))


def add_control(
    tables: Tables, record: PointRecord, x: Array, site: EllipsoidSite, *, inner: bool
) -> None:
    """Add the constraints of a point at ``x`` (3,) in W; inner constraints switch them off."""
    axes = grid_axes(x, site)
    off = INNER if inner and not record.far else ""
    weighted = [c and not h for c, h in zip(record.constrained, record.held, strict=True)]
    if all(weighted) and min(record.sigmas) > 0:
        covariance = axes.T @ np.diag(np.square(record.sigmas)) @ axes
        where = {"position": record.name}
        tables.put(Coordinates, x, covariance, record.line.source, where, off=off, group="control")
        return
    free = free_axes(record)
    for axis in range(3):
        sigma = record.sigmas[axis]
        if weighted[axis]:
            reason = off or ("" if sigma > 0 else "its sigma is negative in the file")
            _put(tables, record, axis, x, axes, site, abs(sigma), off=reason, group="control")
        elif record.held[axis] and free[axis]:
            _put(tables, record, axis, x, axes, site, 1.0, hard=True)


def _put(
    tables: Tables,
    record: PointRecord,
    axis: int,
    x: Array,
    axes: Array,
    site: EllipsoidSite,
    sigma: float,
    *,
    off: str = "",
    group: str = "",
    hard: bool = False,
) -> None:
    """Observe one coordinate of a point."""
    kind: type[Observations] = Heights
    value = float(site.height(x[None])[0])
    columns: dict[str, object] = {"position": record.name}
    if axis < 2:
        kind, value = Components, float(axes[axis] @ x)
        columns["direction"] = axes[axis]
    source = record.line.source
    tables.put(kind, value, sigma, source, columns, off=off, group=group, hard=hard)
