"""The chapter on points: coordinates, covariances, ellipses, and places in known systems."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from tribrach._types import Array
from tribrach.geodesy.site import EllipsoidSite
from tribrach.network.adjustment import Adjustment
from tribrach.network.contributions import assumed_variances
from tribrach.network.ellipsoids import confidence_factor, plan_ellipses, principal_axes
from tribrach.network.facts import HEIGHTS, codes_of
from tribrach.network.quality import Quality
from tribrach.network.roles import point_roles, used_axes
from tribrach.report.chapter import Chapter
from tribrach.report.columns import AXES, ColumnSet, component
from tribrach.report.content import (
    Ellipse,
    Ellipsoid,
    Head,
    Point,
    ReportSettings,
    Triple,
)
from tribrach.report.numbers import matrices, sigmas, triple, triples
from tribrach.report.subject import Subject
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    Spec,
    Worst,
    build_table,
    number_cell,
)
from tribrach.units import GON, format_angle

if TYPE_CHECKING:
    from tribrach.job.results import JobResults

#: elevation [rad] from which on an axis counts as upright
_UPRIGHT = np.radians(90) - 0.5 * GON
#: elevation [rad] up to which an axis counts as level
_LEVEL = 0.05 * GON
#: rows of a network of very many points
_WORST = Worst(
    "those of the points with the largest sigma", lambda p: sum((s or 0.0) ** 2 for s in p.sigma)
)


class Uncertainty:
    """Ellipses, intervals and ellipsoids of positions at the chosen confidence.

    ``covariances`` are scaled; ``freedom`` (n, 3) is that of the variances along E, N and U.
    """

    def __init__(self, covariances: Array, freedom: Array, settings: ReportSettings) -> None:
        self.freedom = freedom
        used = (freedom[:, 2], freedom[:, 0], freedom.min(axis=1))
        self._factor = [
            confidence_factor(k, settings.confidence, dof) for k, dof in enumerate(used, start=1)
        ]
        self._free = np.einsum("nii->ni", covariances) > 0
        self._plan = plan_ellipses(covariances, self._factor[1])
        self._longest = principal_axes(covariances)[0][:, 0]
        self._axes, self._directions = principal_axes(covariances, self._factor[2])
        self._sigma_u = np.sqrt(np.maximum(covariances[:, 2, 2], 0.0))
        upward = self._directions[:, 0] * np.where(self._directions[:, 0, 2:] < 0, -1.0, 1.0)
        e, n, u = upward.T
        self._elevation = np.arctan2(u, np.hypot(e, n))
        # a level axis has two ends alike and the azimuth of the ellipse in plan
        turn = np.where(self._elevation < _LEVEL, np.pi, 2 * np.pi)
        self._azimuth = np.arctan2(e, n) % turn

    def ellipse(self, i: int) -> Ellipse | None:
        """Ellipse in plan; None if E or N is held."""
        if not self._free[i, :2].all():
            return None
        plan = self._plan
        return Ellipse(float(plan.major[i]), float(plan.minor[i]), float(plan.azimuth[i]))

    def height(self, i: int) -> float | None:
        """Half width of the height interval [m]; None if U is held."""
        return float(self._factor[0][i] * self._sigma_u[i]) if self._free[i, 2] else None

    def dof(self, i: int) -> Triple | None:
        """Degrees of freedom of the variances along E, N, U; None where sigmas are given."""
        found = self.freedom[i]
        return None if np.isinf(found).all() else triple(np.where(np.isinf(found), np.nan, found))

    def protection(self, quality: Quality) -> list[float | None]:
        """Longest semi-axis at the significance of single tests, and worst undetected effect."""
        dimension, lowest = self._free.sum(axis=1), self.freedom.min(axis=1)
        size = np.full(len(dimension), np.nan)
        for k in (1, 2, 3):
            of = dimension == k
            size[of] = confidence_factor(k, 1 - quality.alpha0, lowest[of])
        size = size * self._longest + quality.external_worst
        return [float(x) if np.isfinite(x) else None for x in size]

    def ellipsoid(self, i: int) -> Ellipsoid | None:
        """Ellipsoid; None if a coordinate is held."""
        if not self._free[i].all():
            return None
        long = self._axes[i]
        return Ellipsoid(
            (float(long[0]), float(long[1]), float(long[2])),
            float(self._azimuth[i]),
            float(self._elevation[i]),
        )


def position_uncertainty(
    adjustment: Adjustment, settings: ReportSettings
) -> tuple[Array, Uncertainty]:
    """Scaled covariances (P + S, 3, 3) of all positions and their ellipses."""
    covariances = adjustment.position_covariances() * adjustment.variance_factor(
        posterior=settings.posterior
    )
    freedom = adjustment.freedom(posterior=settings.posterior)
    return covariances, Uncertainty(covariances, freedom, settings)


def points(
    adjustment: Adjustment,
    quality: Quality,
    settings: ReportSettings,
    covariances: Array,
    uncertainty: Uncertainty,
) -> tuple[Point, ...]:
    """All points; coordinates that the network does not have are None."""
    names = adjustment.layout.names["point"]
    xyz = triples(np.where(used_axes(adjustment), adjustment.state.points, np.nan))
    sigma = triples(sigmas(covariances[: len(names)]) if names else np.zeros((0, 3)))
    covariance = matrices(covariances[: len(names)])
    roles = point_roles(adjustment)
    places = places_of(adjustment, adjustment.state.points, covariances)
    codes = codes_of(adjustment.network.facts)
    doubled, protection = (
        _doubled(adjustment, settings, covariances),
        uncertainty.protection(quality),
    )
    return tuple(
        Point(
            name=name,
            role=roles.get(name, "free"),
            xyz=xyz[i],
            sigma=sigma[i],
            covariance=covariance[i],
            ellipse=uncertainty.ellipse(i),
            height_interval=uncertainty.height(i),
            ellipsoid=uncertainty.ellipsoid(i),
            code=codes.get(name, ""),
            dof=uncertainty.dof(i),
            doubled=None if doubled is None else doubled[i],
            protection=protection[i],
            **{key: coordinates[i] for key, coordinates in places.items()},
        )
        for i, name in enumerate(names)
    )


def _doubled(
    adjustment: Adjustment, settings: ReportSettings, covariances: Array
) -> list[Triple] | None:
    """Sigmas of positions if what is assumed were twice as large; weights stay as they are."""
    assumed = assumed_variances(adjustment)
    if assumed is None:
        return None
    factor = adjustment.variance_factor(posterior=settings.posterior)
    variance = np.einsum("nii->ni", covariances) + 3 * factor * assumed
    return triples(np.sqrt(np.where(variance > 0, variance, np.nan)))


def places_of(adjustment: Adjustment, x: Array, covariances: Array) -> dict[str, list[Any]]:
    """Coordinates of positions (n, 3) in the other systems that the site knows, by field."""
    site = adjustment.network.site
    if not isinstance(site, EllipsoidSite) or len(x) == 0:
        return {}
    turn = site.w_from_ecef
    turned = turn.T @ covariances[: len(x)] @ turn
    places: dict[str, list[Any]] = {
        "geodetic": [_three(row) for row in site.geodetic(x)],
        "ecef": [_three(row) for row in site.to_ecef(x)],
        "ecef_covariance": matrices(turned),
    }
    grid = adjustment.network.reference.grid
    if grid is not None:
        places["projected"] = [_three(row) for row in grid.from_work(x)]
    return places


def _three(row: Array) -> tuple[float, float, float]:
    a, b, c = row.tolist()
    return a, b, c


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter; every report has it."""
    tables = (_point_table(head), _geodetic_table(head))
    yield Chapter("points", "Points", tables=tables, signed=True)
    covariances = _ellipsoid_table(head)
    if covariances.items:  # rows are made when a page shows them
        yield Chapter("covariances", "Covariances of points", tables=(covariances,))


def _point_table(head: Head) -> ReportTable:
    """Adjusted points with sigmas and ellipses."""
    note = (
        f"Sigmas are {head.origin}. Ellipse in plan and height interval hold with "
        f"{head.percent} each; the azimuth is that of the major axis."
    )
    columns: list[Spec] = [
        head.columns.word("Point", "name"),
        head.columns.word("Role", "role"),
        *head.columns.axes("", "xyz", head.columns.metres),
        *head.columns.axes("σ ", "sigma", head.columns.mm),
        *head.columns.ellipse(),
    ]
    return build_table(
        "points", "Adjusted points", note, head.points, columns, worst=_WORST, ends=_ends
    )


def _ends(point: Point) -> tuple[str, ...]:
    """The point itself."""
    return (point.name,)


def _azimuth(point: Point) -> float | None:
    """Azimuth of the longest axis of an ellipsoid; an axis that stands upright has none."""
    found = point.ellipsoid
    return None if found is None or found.elevation > _UPRIGHT else found.azimuth


def _ellipsoid_table(head: Head) -> ReportTable:
    """Covariance matrices of the points and their ellipsoids."""
    note = (
        f"Covariances are {head.origin}. The ellipsoid holds with {head.percent}; azimuth "
        "and elevation are those of its longest axis. Shared doubled is the 3D σ if what "
        "observations share (centring and refraction of a set-up, tilt, common errors of "
        "targets) were twice as large as assumed; clouds keep their floors. Protected is what an "
        "error stays below: the longest semi-axis at the significance of blunder tests, and the "
        "worst effect of an error that they just find; empty where an error of a value that "
        "nothing controls moves the point."
    )
    pairs = [(i, j) for i in range(3) for j in range(i, 3)]
    columns: list[Spec] = [
        head.columns.word("Point", "name"),
        *(_square(head.columns, i, j) for i, j in pairs),
        *(head.columns.mm(f"axis {k + 1}", _semi_axis(k)) for k in range(3)),
        head.columns.bearing("azimuth", _azimuth),
        head.columns.bearing("elevation", lambda p: p.ellipsoid and p.ellipsoid.elevation),
        head.columns.mm("shared doubled", _doubled_space),
        head.columns.mm("protected", lambda p: p.protection),
    ]
    rows = [p for p in head.points if any(p.sigma)]
    return build_table(
        "ellipsoids", "Covariances and ellipsoids", note, rows, columns, worst=_WORST
    )


def _doubled_space(point: Point) -> float | None:
    """Sigma in space with doubled assumptions."""
    found = point.doubled
    return None if found is None else float(np.sqrt(sum((s or 0.0) ** 2 for s in found)))


def _square(columns: ColumnSet, i: int, j: int) -> Spec:
    """An element of a covariance in square millimetres; empty where a value is held."""

    def cell(point: Point) -> Cell:
        value = point.covariance[i][j]
        held = point.sigma[i] is None or point.sigma[j] is None
        shown = None if value is None or held else value * 1e6
        return number_cell(shown, columns.style.plain(shown, 3))

    return ColumnHead(f"{AXES[i]}{AXES[j]}", "mm²"), cell


def _semi_axis(k: int) -> Callable[[Point], float | None]:
    """Takes one semi-axis of the ellipsoid of a point."""
    return lambda point: point.ellipsoid.axes[k] if point.ellipsoid else None


def _geodetic_table(head: Head) -> ReportTable:
    """Latitude, longitude and height, geocentric and projected coordinates of known sites."""
    kind = head.adjustment.network.reference.heights
    height = "height" if kind is None else HEIGHTS[kind]
    columns: list[Spec] = [
        head.columns.word("Point", "name"),
        (ColumnHead("latitude", "° ′ ″"), lambda p: _dms(p.geodetic[0])),
        (ColumnHead("longitude", "° ′ ″"), lambda p: _dms(p.geodetic[1])),
        head.columns.metres("ellipsoidal height", lambda p: p.geodetic[2]),
        *(head.columns.metres(name, component("ecef", k)) for k, name in enumerate("XYZ")),
        *(
            head.columns.metres(name, component("projected", k))
            for k, name in enumerate(("easting", "northing", height))
        ),
    ]
    note = (
        "X, Y, Z are geocentric; easting, northing and height are those of the site's grid. "
        "All are at the epoch of the reference system, where it has one."
    )
    rows = [p for p in head.points if p.geodetic]
    return build_table("geodetic", "Geodetic coordinates", note, rows, columns, worst=_WORST)


def _dms(value: float) -> Cell:
    """Degrees, minutes and seconds to 1e-5 arc seconds, a third of a millimetre."""
    return Cell(format_angle(value, "dms", 5), value)


SUBJECT = Subject("points", _chapters)
