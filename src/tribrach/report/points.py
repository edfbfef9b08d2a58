"""Adjusted points, their ellipses, and control against what was given (chapters 4 and 9)."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from tribrach._types import Array, Index
from tribrach.geodesy.site import EllipsoidSite
from tribrach.network.adjustment import Adjustment
from tribrach.network.ellipsoids import confidence_factor, plan_ellipses, principal_axes
from tribrach.observations.base import Observations, Use
from tribrach.observations.control import Coordinate, Coordinates, Heights
from tribrach.report.content import (
    CheckVerdict,
    Control,
    Ellipse,
    Ellipsoid,
    Point,
    ReportSettings,
    Role,
)
from tribrach.report.numbers import matrix, sigmas, triple
from tribrach.report.summary import (
    given_coordinates,
    held_names,
    used_axes,
    variance_factor,
)
from tribrach.statistics import chi2

__all__ = ["Uncertainty", "control", "points", "position_uncertainty"]

_USES: dict[Use, Literal["weighted", "check", "off"]] = {
    Use.ACTIVE: "weighted",
    Use.CHECK: "check",
    Use.OFF: "off",
}


class Uncertainty:
    """Ellipses, intervals and ellipsoids of positions at the chosen confidence.

    Parameters
    ----------
    covariances : (n, 3, 3) [m^2], scaled.
    """

    def __init__(
        self, covariances: Array, adjustment: Adjustment, settings: ReportSettings
    ) -> None:
        posterior = settings.posterior and adjustment.dof > 0
        self._factor = [
            confidence_factor(k, settings.confidence, adjustment.dof if posterior else None)
            for k in (1, 2, 3)
        ]
        self._free = np.einsum("nii->ni", covariances) > 0
        self._plan = plan_ellipses(covariances, self._factor[1])
        self._axes, self._directions = principal_axes(covariances, self._factor[2])
        self._sigma_u = np.sqrt(np.maximum(covariances[:, 2, 2], 0.0))

    def ellipse(self, i: int) -> Ellipse | None:
        """Ellipse in plan; None if E or N is held."""
        if not self._free[i, :2].all():
            return None
        plan = self._plan
        return Ellipse(float(plan.major[i]), float(plan.minor[i]), float(plan.azimuth[i]))

    def height(self, i: int) -> float | None:
        """Half width of the height interval [m]; None if U is held."""
        return float(self._factor[0] * self._sigma_u[i]) if self._free[i, 2] else None

    def ellipsoid(self, i: int) -> Ellipsoid | None:
        """Ellipsoid; None if a coordinate is held."""
        if not self._free[i].all():
            return None
        long, (e, n, u) = (
            self._axes[i],
            self._directions[i, 0] * np.sign(self._directions[i, 0, 2] or 1.0),
        )
        return Ellipsoid(
            (float(long[0]), float(long[1]), float(long[2])),
            float(np.arctan2(e, n) % (2 * np.pi)),
            float(np.arctan2(u, np.hypot(e, n))),
        )


def position_uncertainty(
    adjustment: Adjustment, settings: ReportSettings
) -> tuple[Array, Uncertainty]:
    """Scaled covariances (P + S, 3, 3) of all positions and their ellipses."""
    covariances = adjustment.position_covariances() * variance_factor(adjustment, settings)
    return covariances, Uncertainty(covariances, adjustment, settings)


def points(
    adjustment: Adjustment, settings: ReportSettings, covariances: Array, uncertainty: Uncertainty
) -> tuple[Point, ...]:
    """All points; coordinates that the network does not have are None."""
    names = adjustment.layout.names["point"]
    xyz = np.where(used_axes(adjustment), adjustment.state.points, np.nan)
    sigma = sigmas(covariances[: len(names)]) if names else np.zeros((0, 3))
    roles = _roles(adjustment)
    places = _places(adjustment, covariances)
    return tuple(
        Point(
            name=name,
            role=roles.get(name, "free"),
            xyz=triple(xyz[i]),
            sigma=triple(sigma[i]),
            covariance=matrix(covariances[i]),
            ellipse=uncertainty.ellipse(i),
            height_interval=uncertainty.height(i),
            ellipsoid=uncertainty.ellipsoid(i),
            **{key: found[i] for key, found in places.items()},
        )
        for i, name in enumerate(names)
    )


def _places(adjustment: Adjustment, covariances: Array) -> dict[str, list[Any]]:
    """Coordinates of all points in the other systems that the site knows, by field."""
    site, x = adjustment.network.site, adjustment.state.points
    if not isinstance(site, EllipsoidSite) or len(x) == 0:
        return {}
    turn = site.w_from_ecef
    turned = turn.T @ covariances[: len(x)] @ turn
    found: dict[str, list[Any]] = {
        "geodetic": [_three(row) for row in site.geodetic(x)],
        "ecef": [_three(row) for row in site.to_ecef(x)],
        "ecef_covariance": [matrix(block) for block in turned],
    }
    grid = adjustment.network.reference.grid
    if grid is not None:
        found["projected"] = [_three(row) for row in grid.from_work(x)]
    return found


def _three(row: Array) -> tuple[float, float, float]:
    a, b, c = row.tolist()
    return a, b, c


def _roles(adjustment: Adjustment) -> dict[str, Role]:
    """Points that are control or check; the others are free."""
    roles: dict[str, Role] = dict.fromkeys(held_names(adjustment), "control")
    for o in given_coordinates(adjustment):
        for (name, _), use in zip(o.ends(adjustment.layout), o.use, strict=True):
            if use == Use.ACTIVE:
                roles[name] = "control"
            elif use == Use.CHECK:
                roles.setdefault(name, "check")
    return roles


def control(adjustment: Adjustment, settings: ReportSettings) -> tuple[Control, ...]:
    """Held coordinates, then coordinates given with a covariance, weighted, check or off."""
    out = [_held(adjustment, name) for name in held_names(adjustment)]
    for o in given_coordinates(adjustment):
        out += _coordinates(adjustment, o, settings)
    return tuple(out)


def _held(adjustment: Adjustment, name: str) -> Control:
    """A point with coordinates that are not adjusted; those that are show no given value."""
    i = adjustment.layout.index("point", name)
    free = adjustment.network.free[3 * i : 3 * i + 3]
    unused = free | ~used_axes(adjustment)
    given = np.where(unused, np.nan, adjustment.state.points[i])
    nothing = (None, None, None)
    return Control(name, "held", triple(given), nothing, nothing, nothing, None)


def _axes_of(o: Observations) -> Index | None:
    """Axis (n, rows) of each value, 0 to 2; None for kinds that observe no coordinate."""
    if isinstance(o, Coordinates):
        return np.tile(np.arange(3), (len(o), 1))
    if isinstance(o, Coordinate):
        return np.asarray(o.axis, dtype=np.int64)[:, None]
    return np.full((len(o), 1), 2) if isinstance(o, Heights) else None


def _coordinates(
    adjustment: Adjustment, o: Observations, settings: ReportSettings
) -> list[Control]:
    """Given coordinates against the adjusted ones, with the sigma that difference should have.

    The covariance of adjusted - given is ``C - Q`` for coordinates that took part and ``C + Q``
    for those held out; those switched off by the datum are only listed.
    """
    axis = _axes_of(o)
    if axis is None or len(o) == 0:
        return []
    names = [name for name, _ in o.ends(adjustment.layout)]
    item = np.arange(len(o))[:, None]
    given, difference, sigma = (np.full((len(o), 3), np.nan) for _ in range(3))
    given[item, axis] = o.values
    sigma[item, axis] = o.sigma
    difference[item, axis] = -o.misclosure(adjustment.state)
    unused = ~used_axes(adjustment)
    given[:, unused] = sigma[:, unused] = difference[:, unused] = np.nan
    own = np.full((len(o), 3, 3), np.nan)
    own[item[:, :, None], axis[:, :, None], axis[:, None, :]] = o.covariance
    q = np.stack([_block(adjustment, name) for name in names])
    sign = np.where(o.use == Use.ACTIVE, -1.0, 1.0)[:, None, None]
    predicted = variance_factor(adjustment, settings) * (own + sign * q)
    out = []
    for i, name in enumerate(names):
        use = Use(int(o.use[i]))
        off = use == Use.OFF
        out.append(
            Control(
                name=name,
                use=_USES[use],
                given=triple(given[i]),
                sigma=triple(sigma[i]),
                difference=triple(difference[i]),
                difference_sigma=(None, None, None) if off else triple(sigmas(predicted[i])),
                verdict=None if off else _verdict(difference[i], predicted[i], settings),
                reason=str(o.reason[i]),
                source=str(o.source[i]),
            )
        )
    return out


def _block(adjustment: Adjustment, name: str) -> Array:
    """A-priori position covariance (3, 3) of a point or station."""
    columns = adjustment.columns(name)[:3]
    return adjustment.covariance_columns(columns, columns)


def _verdict(difference: Array, predicted: Array, settings: ReportSettings) -> CheckVerdict | None:
    """Chi-square test of a difference; None where nothing controls it."""
    used = np.isfinite(difference)
    variance = np.where(used, np.diag(predicted), np.nan)
    used &= np.nan_to_num(variance) > 1e-16
    if not used.any():
        return None
    block = predicted[np.ix_(used, used)]
    values, vectors = np.linalg.eigh(block)
    good = values > 1e-6 * values.max()
    along = vectors[:, good].T @ difference[used]
    statistic = float((along**2 / values[good]).sum())
    limit = float(chi2.ppf(1 - settings.alpha, int(good.sum())))
    return CheckVerdict(statistic, limit, statistic <= limit)
