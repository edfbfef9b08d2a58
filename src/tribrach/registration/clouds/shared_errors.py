"""Errors that all matches of two scans share, fitted together with their pose.

Two of them look like a pose that is a little wrong and no residual tells of them afterwards
(method section 2.11).

*Depth.* Ranges are too long alike: by a zero error of the scanner, or since its beams enter grass
and gravel. A floor becomes a dish about either scanner, and two dishes differ by a tilt.

*Bend.* The mean of a piece of a trunk lies behind the bark, the deeper the wider around the trunk
the piece is. The scanner that is farther away has wider pieces, so that trunks all around ask for a
shift. A piece is not wider than a trunk: what is, has other things in it.

Both are unknowns with a prior of zero: what the matches say of them is taken, and what they leave
open is in the covariance of the pose.

Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tribrach._types import Array, Index
from tribrach.registration.clouds.fine import FINE, FineAlignment, Indexed, Matches, displaced
from tribrach.registration.clouds.relative_covariance import (
    RelativeCovariance,
    across,
    at_origin,
    relative_covariance,
)
from tribrach.registration.clouds.surfels import UNKNOWN, Surfels
from tribrach.statistics import robust_sigma


@dataclass(frozen=True)
class SharedErrorGates:
    """Prior knowledge of shared errors."""

    #: sigma of the curvature of trunks and poles [1/m]: radii of 0.1 m and more
    bend_per_m: float = 10.0
    #: the upright pieces of unknown form that are taken for pieces of such bodies
    upright: float = 0.5
    #: widest pieces of them, as standard deviations around the body [m]
    widest_m: float = 0.15
    #: steps of the fit
    steps: int = 5


GATES = SharedErrorGates()


@dataclass(frozen=True, eq=False)
class SharedErrors:
    """What shared errors do to the residuals of matches."""

    #: (n, k), for one sigma of their priors [m]
    columns: Array
    #: (k,), sigmas of the priors: of the depth [m], then of the bend [1/m] if pieces tell of it
    sigmas: Array

    @classmethod
    def of(cls, a: Indexed, b: Indexed, alignment: FineAlignment, zero: float) -> SharedErrors:
        """The errors that matches may share; ``zero`` is the sigma of the zero error [m]."""
        m, pose = alignment.matches, alignment.pose
        # beams enter a surface about as deep as it is rough
        depth = float(np.hypot(zero, robust_sigma(m.residual, about=0.0)))
        away = m.point - pose.translation
        columns = [_along(m, away)]
        if not a.surfels.two_sided:
            columns = [columns[0] - _along(m, m.point)]
        sigmas = [depth]
        forms = a.surfels.form[m.first], b.surfels.form[m.second]
        unknown = (forms[0] == UNKNOWN) | (forms[1] == UNKNOWN)
        unknown &= np.abs(m.normal[:, 2]) < GATES.upright
        if unknown.any():
            wide = _around(a.surfels, m.first) - _around(b.surfels, m.second)
            columns.append(np.where(unknown, 0.5 * wide, 0.0))
            sigmas.append(GATES.bend_per_m)
        return cls(np.stack(columns, axis=1) * sigmas, np.array(sigmas))

    def fitted(
        self, alignment: FineAlignment, held: Array, factor: float
    ) -> tuple[FineAlignment, Array]:
        """The alignment with what the matches share, and corrections of that in sigmas (k,).

        ``held`` (6, h) are the directions that are fitted, turns times the lever of the matches;
        so many matches count as one: ``factor``.
        """
        m, gate = alignment.matches, alignment.gate
        about = m.about
        design = np.concatenate([m.design(about) @ held, self.columns], axis=1)
        h, n = held.shape[1], design.shape[1]
        prior = np.diag(np.repeat([0.0, factor], [h, n - h]))
        alone = 1 / (m.sigma**2 + (gate / FINE.gate_sigmas) ** 2)
        x = np.zeros(n)
        for _ in range(GATES.steps):
            residual = m.residual + design @ x
            weight = (1 - np.minimum(np.abs(residual) / gate, 1) ** 2) ** 2 * alone
            normal = (design * weight[:, None]).T @ design + prior
            x -= np.linalg.lstsq(normal, design.T @ (weight * residual) + prior @ x, rcond=None)[0]
        residual = m.residual + design @ x
        inside = np.abs(residual) < gate
        if not np.isfinite(x).all() or inside.sum() < FINE.fewest_matches:
            return alignment, np.zeros(n - h)
        pose = displaced(alignment.pose, held @ x[:h], about)
        matches = replace(m, residual=np.clip(residual, -gate, gate))
        return replace(alignment, pose=pose, matches=matches), x[h:]


def _around(s: Surfels, chosen: Index) -> Array:
    """Variances (n,) of the points of upright pieces along the level [m^2]."""
    normal = s.normal[chosen]
    level = np.stack([-normal[:, 1], normal[:, 0], np.zeros(len(chosen))], axis=1)
    level /= np.maximum(np.linalg.norm(level, axis=1, keepdims=True), 1e-9)
    variance = np.einsum("ni,nij,nj->n", level, s.spread[chosen], level)
    return np.asarray(np.minimum(variance, GATES.widest_m**2))


def _along(m: Matches, way: Array) -> Array:
    """Cosines (n,) between the normals of matches and ways (n, 3) from a scanner."""
    far = np.maximum(np.linalg.norm(way, axis=1), 1e-9)
    return np.asarray(np.einsum("ni,ni->n", m.normal, way) / far)


def with_shared_errors(
    scans: tuple[Indexed, Indexed],
    alignment: FineAlignment,
    precision: RelativeCovariance,
    floor: tuple[float, float],
) -> tuple[FineAlignment, RelativeCovariance]:
    """Fit what the matches of a fitted pair share together with what its surfaces hold."""
    u = precision.unheld
    if precision.rank == 0 or len(alignment.matches) < FINE.fewest_matches:
        return alignment, precision
    errors = SharedErrors.of(*scans, alignment, floor[0])
    before = precision.factor
    # what they are without any prior, then as well as neighbours agree without them
    fit, found = errors.fitted(alignment, across(u), 1.0)
    if not found.any():
        return alignment, precision
    after = relative_covariance(*scans, fit, floor, unheld=u, shared=errors.columns).factor
    fit, found = errors.fitted(alignment, across(u), min(after, before))
    # a scanner that moved looks the same: half of what the errors explain is believed
    least = float(np.sqrt(before * min(after, before)))
    out = relative_covariance(*scans, fit, floor, unheld=u, shared=errors.columns, least=least)
    # what the directions that are open add to those that are held
    bare = relative_covariance(*scans, alignment, floor, unheld=u) if u.shape[1] else precision
    local = out.local + precision.local - bare.local
    depth = -float(found[0] * errors.sigmas[0]), float(out.shared[0] * errors.sigmas[0])
    covariance = at_origin(local, fit.pose, out.middle)
    return fit, replace(out, local=local, covariance=covariance, depth=depth)
