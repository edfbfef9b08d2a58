"""Fits a transformation to common points, with the weights of both systems.

Conditions ``b + v_b = T(a + v_a)`` with ``v_a^T C_a^-1 v_a + v_b^T C_b^-1 v_b`` smallest
(Gauss-Helmert model; Ghilani, Adjustment Computations, ch. 18). T is affine in the points, so with
``w = b - T(a)`` and ``C = C_b + M C_a M^T`` the residuals are ``v_b = -C_b C^-1 w`` and ``v_a = C_a
M^T C^-1 w``; derivatives at ``a + v_a`` make the iteration end at the exact minimum. A system
without covariances is free of errors; if both are, all differences have one unknown sigma. Metres
and radians; (n, d) points with d = 3 or 2.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tribrach._types import Array, Mask
from tribrach.errors import InputError, NotConverged, RankDefect
from tribrach.transformation.models import Model, Transformation, find_model, start
from tribrach.transformation.weights import Metric, Spread, given_spread

#: iterations before giving up
_STEPS = 100
#: ratio of singular values of the scaled design below which a parameter is open
_RANK = 1e-8


@dataclass(frozen=True, eq=False)
class CommonPoints:
    """Points by name in both systems."""

    names: tuple[str, ...]  #: of the n points
    #: (n, d), coordinates in system A and system B [m]
    a: Array
    b: Array
    #: their covariances
    spread_a: Spread
    spread_b: Spread
    used: Mask  #: (n,), false for check points and for points that are switched off
    check: Mask  #: (n,), true for points held out to be compared
    reasons: tuple[str, ...] = field(default=())  #: why a point is switched off, empty if it is not

    @property
    def weighted(self) -> bool:
        """True if a covariance is given in any system."""
        spreads = (self.spread_a, self.spread_b)
        return any(s.blocks is not None or s.joint is not None for s in spreads)

    @property
    def dimension(self) -> int:
        """Number of coordinates of a point, 2 or 3."""
        return int(self.a.shape[1])


@dataclass(frozen=True, eq=False)
class TransformationFit:
    """A fitted transformation of n points, of which m were used."""

    points: CommonPoints  #: the common points
    transformation: Transformation  #: the fitted transformation
    #: (k, k), of the parameters in the order of ``transformation.model.parameters``, from the
    #: given covariances (from unit weights if none are given)
    cofactor: Array
    difference: Array  #: (n, d), b - T(a) of all points, also of those held out [m]
    #: (n, d), residuals in both systems [m], zero where a point is not used
    residual_a: Array
    residual_b: Array
    vtpv: float  #: weighted sum of squares
    dof: int  #: redundancy
    iterations: int  #: steps that were needed
    force: Array  #: (m, d), ``C^-1 w``
    weight: Array  #: (m, d, d), diagonal blocks of C^-1
    solved: Array  #: (m, d, k), blocks of C^-1 A

    @property
    def model(self) -> Model:
        """The model."""
        return self.transformation.model

    @property
    def sigma0(self) -> float | None:
        """A-posteriori sigma0, None without redundancy; in metres if no covariance was given."""
        return float(np.sqrt(self.vtpv / self.dof)) if self.dof > 0 else None

    @property
    def factor(self) -> float:
        """Factor on the cofactor: 1 with given covariances, else squared sigma0 (NaN if none)."""
        if self.points.weighted:
            return 1.0
        return float("nan") if self.sigma0 is None else self.sigma0**2

    @property
    def covariance(self) -> Array:
        """Covariance (k, k) of the parameters: a priori with given covariances, else posterior."""
        return self.factor * self.cofactor

    @property
    def origin_covariance(self) -> Array:
        """Covariance (d, d) of the image of the origin of A, with all that turns and scales."""
        at = self.transformation.jacobian(np.zeros((1, self.points.dimension)))[0]
        out: Array = at @ self.covariance @ at.T
        return out

    def predicted(self, a: Array, spread: Array | None = None) -> Array:
        """Covariances of points of A carried over.

        ``a`` (n, d): points of A [m]; ``spread`` (n, d, d): their own covariances [m^2], none if
        None. Returns (n, d, d): in the axes of B [m^2].
        """
        lever = self.transformation.jacobian(a)
        out: Array = lever @ self.covariance @ lever.transpose(0, 2, 1)
        m = self.transformation.matrix
        return out if spread is None else out + m @ spread @ m.T

    @property
    def rms(self) -> float:
        """Root mean square [m] of the lengths of the used differences; no accuracy."""
        used = self.difference[self.points.used]
        return float(np.sqrt((used**2).sum(axis=1).mean()))


def fit_transformation(
    a: Array,
    b: Array,
    model: int | Model,
    *,
    names: list[str] | tuple[str, ...] | None = None,
    covariance_a: Array | None = None,
    covariance_b: Array | None = None,
    check: Mask | None = None,
) -> TransformationFit:
    """Fit a transformation to points given as arrays.

    Parameters
    ----------
    a, b : array (n, d)
        Points in both systems [m].
    model
        A model, or its number of parameters.
    names
        Of the points; numbers if None.
    covariance_a, covariance_b
        (n, d, d), or (n d, n d) over all points [m^2]; None if a system is free of errors.
    check : array (n,)
        True for points held out.

    Returns
    -------
    TransformationFit
        Parameters, residuals and covariance.

    Raises
    ------
    InputError
        Other shapes, numbers that are not finite, too few points.
    RankDefect
        The points leave parameters open.
    NotConverged
        The iteration did not reach a minimum.
    """
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    if a.shape != b.shape or a.ndim != 2 or a.shape[1] not in (2, 3):
        raise InputError(
            f"the points have shapes {a.shape} and {b.shape}", cure="give both as (n, 3) or (n, 2)"
        )
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise InputError("a coordinate is not a number", cure="leave such points out")
    n, d = a.shape
    held = np.zeros(n, dtype=bool) if check is None else np.asarray(check, dtype=bool)
    points = CommonPoints(
        names=tuple(names) if names is not None else tuple(str(i + 1) for i in range(n)),
        a=a,
        b=b,
        spread_a=given_spread(covariance_a, n, d, "A"),
        spread_b=given_spread(covariance_b, n, d, "B"),
        used=~held,
        check=held,
        reasons=("",) * n,
    )
    return fit_points(points, model if isinstance(model, Model) else find_model(model, d))


def fit_points(points: CommonPoints, model: Model) -> TransformationFit:
    """Fit a transformation to the used common points."""
    used, d = points.used, points.dimension
    a, b = points.a[used], points.b[used]
    spread_a, spread_b = points.spread_a.part(used, d), points.spread_b.part(used, d)
    transformation = start(model, a, b)
    # steps below this no longer matter: rounding of the coordinates
    limit = 1e-12 + 16 * np.finfo(float).eps * max(np.abs(a).max(), np.abs(b).max())
    for step_number in range(1, _STEPS + 1):
        metric = Metric(spread_a, spread_b, transformation.matrix, len(a))
        w = b - transformation(a)
        force = metric.solve(w)
        cost = float((w * force).sum())
        adjusted = a + spread_a.times(force @ transformation.matrix)
        design = transformation.jacobian(adjusted)
        solved = metric.solve(design)
        cofactor = _inverse(model, design, solved)
        step = cofactor @ np.einsum("nik,ni->k", design, force)
        transformation, moved = _descend(transformation, step, cost, a, b, spread_a, spread_b)
        if np.abs(np.einsum("nik,k->ni", design, step)).max() * moved < limit:
            return _finished(points, transformation, (spread_a, spread_b), step_number)
    raise NotConverged(
        f"the transformation did not converge in {_STEPS} steps",
        ["look at the points with the largest differences, or take fewer parameters"],
    )


def _descend(
    transformation: Transformation,
    step: Array,
    cost: float,
    a: Array,
    b: Array,
    sa: Spread,
    sb: Spread,
) -> tuple[Transformation, float]:
    """The transformation moved by as much of a step as does not raise the cost; how much."""
    share = 1.0
    while share > 1e-6:
        trial = transformation.moved(share * step)
        w = b - trial(a)
        now = float((w * Metric(sa, sb, trial.matrix, len(a)).solve(w)).sum())
        if now <= cost * (1 + 1e-9) + 1e-18:
            return trial, share
        share /= 2
    # rounding: the cost cannot fall any more
    return transformation, 0.0


def _inverse(model: Model, design: Array, solved: Array) -> Array:
    """Inverse normal matrix (k, k), columns scaled; parameters that are left open are named."""
    normal = np.einsum("nik,nil->kl", design, solved)
    scale = np.sqrt(np.diag(normal))
    scale = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh(normal / scale[:, None] / scale)
    if values[0] <= _RANK**2 * 1e4 * values[-1]:
        weak = np.abs(vectors[:, 0] / scale)
        weak /= weak.max()
        names = [n for (n, _), size in zip(model.parameters, weak, strict=True) if size > 0.05]
        raise RankDefect(
            f"the common points leave the transformation with {model.count} parameters open",
            [f"they do not determine {', '.join(names)}", f"it needs {model.least}"],
        )
    inverse: Array = (vectors / values) @ vectors.T / scale[:, None] / scale
    symmetric: Array = (inverse + inverse.T) / 2
    return symmetric


def _finished(
    points: CommonPoints, solution: Transformation, spreads: tuple[Spread, Spread], iterations: int
) -> TransformationFit:
    """Residuals and cofactors at the solution."""
    used, a, b = points.used, points.a[points.used], points.b[points.used]
    metric = Metric(*spreads, solution.matrix, len(a))
    w = b - solution(a)
    force = metric.solve(w)
    va, vb = np.zeros_like(points.a), np.zeros_like(points.b)
    va[used] = spreads[0].times(force @ solution.matrix)
    vb[used] = -spreads[1].times(force) if points.weighted else -w
    design = solution.jacobian(points.a[used] + va[used])
    solved = metric.solve(design)
    return TransformationFit(
        points=points,
        transformation=solution,
        cofactor=_inverse(solution.model, design, solved),
        difference=points.b - solution(points.a),
        residual_a=va,
        residual_b=vb,
        vtpv=float((w * force).sum()),
        dof=w.size - solution.model.count,
        iterations=iterations,
        force=force,
        weight=metric.inverse_blocks(),
        solved=solved,
    )
