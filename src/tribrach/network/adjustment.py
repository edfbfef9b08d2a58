"""Adjusts a network: linearise, whiten, solve, update, until nothing moves any more.

Gauss-Newton on the manifold with Levenberg-Marquardt damping only where a full step would not
descend; the covariance is always that of the undamped system at the solution (method section 3.1).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.errors import AdjustmentError, NotConverged
from tribrach.geometry import rotation
from tribrach.network import defects
from tribrach.network.assembly import Assembly, Rows
from tribrach.network.datum import Cofactor, OpenMotions, open_motions, point_numbers
from tribrach.network.linear import PIVOT_LIMIT, SingularMatrix
from tribrach.network.network import Network
from tribrach.network.start.start_values import find_start
from tribrach.observations.unknowns import WIDTH, Layout, State

__all__ = ["Adjustment", "Options", "adjust"]


@dataclass(frozen=True)
class Options:
    """When the iteration ends.

    Attributes
    ----------
    max_iterations
        Linearisations before giving up.
    step_sigma
        Largest last step in units of its own sigma.
    step_metres, step_radians
        Largest last step of lengths [m] and of angles [rad].
    vtpv_change
        Largest last relative change of the weighted sum of squares.
    progress
        Called with (iteration, sum of squares) after each step.
    """

    max_iterations: int = 60
    step_sigma: float = 0.01
    step_metres: float = 1e-7
    step_radians: float = 1e-10
    vtpv_change: float = 1e-10
    progress: Callable[[int, float], None] | None = None


@dataclass(frozen=True)
class Adjustment:
    """An adjusted network: estimates, residuals, and covariances on request.

    Covariances are a priori: those given with the observations taken as they are.
    ``variance_factor`` says what scales them.

    Attributes
    ----------
    network
        The network as it was adjusted, with the start values that were found.
    state
        Adjusted unknowns in the work frame [m, rad].
    rows
        The active observed values, in the order of the residuals.
    residuals : array (n,)
        ``v = h(x) - l`` of the active values [m, rad].
    whitened_residuals : array (n,)
        ``W v``; their sum of squares is ``vtpv``.
    design : sparse array (n, u)
        Whitened Jacobian over the free columns, at the solution.
    free_columns : array (u,)
        Columns of the full tangent vector that are unknowns.
    cofactor
        Cofactor matrix of the unknowns in the datum of the network.
    motions
        Open motions that inner constraints closed.
    iterations
        Linearisations that were needed.
    warnings
        Sentences of the network and of its solution.
    assembly
        Evaluates the network at any state.
    """

    network: Network
    state: State
    rows: Rows
    residuals: Array
    whitened_residuals: Array
    design: sp.csr_array
    free_columns: Index
    cofactor: Cofactor
    motions: OpenMotions
    iterations: int
    warnings: tuple[str, ...]
    assembly: Assembly = field(repr=False)

    @property
    def layout(self) -> Layout:
        """Names and columns of the unknowns."""
        return self.state.layout

    @property
    def n_observations(self) -> int:
        """Number of active observed values."""
        return len(self.rows)

    @property
    def n_unknowns(self) -> int:
        """Number of free unknowns."""
        return len(self.free_columns)

    @property
    def n_constraints(self) -> int:
        """Number of independent hard constraints."""
        return self.cofactor.n_constraints

    @property
    def defect(self) -> int:
        """Number of open motions closed by inner constraints."""
        return int(self.motions.basis.shape[1])

    @property
    def dof(self) -> int:
        """Redundancy ``r = n - u + q + d``."""
        return self.n_observations - self.n_unknowns + self.n_constraints + self.defect

    @property
    def vtpv(self) -> float:
        """Weighted sum of squared residuals."""
        return float(self.whitened_residuals @ self.whitened_residuals)

    @property
    def sigma0(self) -> float:
        """A-priori standard deviation of unit weight."""
        return self.network.sigma0

    @property
    def sigma0_posterior(self) -> float:
        """A-posteriori standard deviation of unit weight; NaN without redundancy."""
        return self.sigma0 * float(np.sqrt(self.posterior_factor))

    @property
    def posterior_factor(self) -> float:
        """``v^T P v / r``, which scales covariances from a priori to a posteriori; NaN if r = 0."""
        return self.vtpv / self.dof if self.dof > 0 else float("nan")

    def variance_factor(self, *, posterior: bool) -> float:
        """Return what multiplies a-priori covariances of unknowns.

        Parameters
        ----------
        posterior
            Are covariances wanted a posteriori?

        Returns
        -------
        float
            ``v^T P v / r`` if that is wanted and the residuals tell it; 1 if it is not wanted,
            without redundancy, or with residuals that are all zero.
        """
        factor = self.posterior_factor
        return factor if posterior and factor > 0 else 1.0

    @cached_property
    def whitener(self) -> sp.csr_array:
        """``W`` (n, n) with ``W C W^T = I``."""
        return self.assembly.whitener

    @cached_property
    def reduced(self) -> Index:
        """Free column number (size,) of each column of the full tangent vector, -1 if fixed."""
        return self.assembly.reduced[:-1]

    def columns(self, name: str) -> Index:
        """Columns of the full tangent vector of a named unknown; KeyError if there is none."""
        family, index = self.layout.find(name)
        return self.layout.columns(family, index)

    def covariance(self, a: str, b: str | None = None) -> Array:
        """A-priori covariance block of named unknowns: points 3, stations 6, scalars 1 wide."""
        return self.covariance_columns(self.columns(a), self.columns(a if b is None else b))

    def covariance_columns(self, a: Index, b: Index) -> Array:
        """A-priori covariance (k, l) between columns of the full tangent vector; fixed: zero."""
        i, j = self.reduced[np.asarray(a)], self.reduced[np.asarray(b)]
        out = np.zeros((len(i), len(j)))
        good = np.ix_(np.flatnonzero(i >= 0), np.flatnonzero(j >= 0))
        grid_i, grid_j = np.meshgrid(i[i >= 0], j[j >= 0], indexing="ij")
        values = self.cofactor.entries(grid_i.ravel(), grid_j.ravel())
        out[good] = values.reshape(grid_i.shape)
        return out

    def family_covariances(self, family: str) -> Array:
        """A-priori blocks (n, w, w) of all unknowns of a family; fixed components are zero."""
        columns = self.layout.columns(family, np.arange(self.layout.count(family)))
        return (
            self.cofactor.blocks(self.reduced[columns])
            if len(columns)
            else np.zeros((0, WIDTH[family], WIDTH[family]))
        )

    def position_covariances(self) -> Array:
        """A-priori 3x3 blocks (P + S, 3, 3) of all points, then of all station positions."""
        return np.concatenate(
            [self.family_covariances("point"), self.family_covariances("pose")[:, :3, :3]]
        )

    def summary(self) -> str:
        """The adjustment in a few lines."""
        datum = self.network.datum
        frame = "control" if datum.kind == "control" else "inner constraints"
        lines = [
            f"{self.n_observations} observed values, {self.n_unknowns} unknowns, "
            f"{self.n_constraints} constraints, datum defect {self.defect}, "
            f"redundancy {self.dof}",
            f"datum: {frame}; {self.iterations} iterations",
            f"sigma0 a priori {self.sigma0:g}, a posteriori {self.sigma0_posterior:.4f}"
            if self.dof > 0
            else "no redundancy: nothing is checked",
        ]
        return "\n".join([*lines, *self.warnings])

    def __str__(self) -> str:
        return self.summary()


def adjust(network: Network, *, options: Options | None = None) -> Adjustment:
    """Adjust a network by least squares (method section 3.1).

    Parameters
    ----------
    network
        Observations, unknowns and datum; missing start values are found.
    options
        When the iteration ends; the defaults of :class:`Options` if None.

    Returns
    -------
    Adjustment
        Estimates, residuals and covariances at the solution.

    Raises
    ------
    NoStartValues
        No chain of observations reaches some unknowns.
    RankDefect
        The observations leave combinations of unknowns open, named in sentences.
    NotConverged
        The iteration did not reach a minimum.
    """
    options = options or Options()
    network = network.with_start(find_start(network))
    assembly = Assembly(network)
    datum = defects.datum_mask(network, assembly.free_columns)
    state = network.start
    damping, vtpv, motions = 0.0, np.inf, None
    for iteration in range(1, options.max_iterations + 1):
        system = _System(assembly, state, datum, motions, damping)
        motions = system.motions
        step = system.step(_moved(network.start, state, assembly.free_columns))
        trial = state.retract(_full(step, assembly))
        cost, violation = _merit(assembly, trial)
        descends = cost <= system.cost * (1 + 1e-8) + 1e-9
        # pulling a constraint in may cost some fit: either is progress
        if not descends and not violation < 0.5 * system.violation:
            damping = max(10 * damping, 1e-4)
            if damping > 1e8:
                break
            continue
        state = trial
        if options.progress:
            options.progress(iteration, cost)
        change = abs(vtpv - cost)
        steady = change <= options.vtpv_change * cost + 1e-9
        vtpv, damped = cost, damping
        damping = 0.0 if damping < 1e-3 else damping / 10
        if not damped and steady and _small(step, assembly, options):
            final = _finish(assembly, state, datum, motions, iteration)
            if _within_sigma(step, final, options):
                return final
    raise NotConverged(
        f"the adjustment did not converge in {options.max_iterations} iterations",
        [defects.worst_misclosure(assembly, state)],
    )


class _System:
    """The linearised network at one state."""

    def __init__(
        self,
        assembly: Assembly,
        state: State,
        datum: NDArray[np.bool_],
        motions: OpenMotions | None,
        damping: float,
    ) -> None:
        # observations between points at one place have no derivatives: refused below in words
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            self.design = assembly.design(state)
            self.white = assembly.whiten(assembly.misclosure(state))
            self.constraints, self.right = assembly.constraints(state)
            self.cost = float(self.white @ self.white)
        if not np.isfinite(self.design.data).all() or not np.isfinite(self.cost):
            raise NotConverged(
                "observations cannot be computed at the approximate coordinates",
                [defects.not_computed(assembly, self.design, self.white)],
            )
        self.violation = float(np.abs(self.right).max(initial=0.0))
        if motions is not None and motions.basis.shape[1] == 0:
            self.motions = motions
        else:
            self.motions = open_motions(self.design, state, assembly.free_columns, self.constraints)
        if motions is None:
            defects.check_datum(assembly, self.design, self.constraints, self.motions, datum)
        transposed = sp.csr_array(self.design.T)
        normal = sp.csc_array(transposed @ self.design)
        self.gradient = transposed @ self.white
        if damping:
            normal = sp.csc_array(normal + damping * sp.diags_array(normal.diagonal()))
        point_of = point_numbers(state.layout, assembly.free_columns)
        cofactor: Cofactor | None
        try:
            cofactor = Cofactor(normal, point_of, self.constraints, self.motions.basis, datum)
            weak = cofactor.factor.smallest_pivot < PIVOT_LIMIT
        except SingularMatrix:
            cofactor, weak = None, True
        self.warnings: tuple[str, ...] = ()
        if weak:
            self.warnings = defects.check_rank(
                assembly, self.design, self.constraints, self.motions.basis
            )
        if cofactor is None:
            raise AdjustmentError("the normal matrix cannot be factored")
        self.cofactor: Cofactor = cofactor

    def step(self, moved: Array) -> Array:
        """Increment (u,) of the free columns."""
        return self.cofactor.step(self.gradient, self.right, moved)


def _merit(assembly: Assembly, state: State) -> tuple[float, float]:
    """Weighted sum of squares and largest violated constraint; infinite where undefined."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        white = assembly.whiten(assembly.misclosure(state))
        cost = float(white @ white)
    right = [c.observations.misclosure(state).ravel() for c in assembly.network.constraints]
    violation = float(np.abs(np.concatenate([np.zeros(1), *right])).max())
    return (cost if np.isfinite(cost) else np.inf), violation


def _full(step: Array, assembly: Assembly) -> Array:
    """The step over all columns (size,) of the tangent vector, zero where they are fixed."""
    full = np.zeros(assembly.layout.size)
    full[assembly.free_columns] = step
    return full


def _moved(start: State, state: State, free_columns: Index) -> Array:
    """Tangent (u,) from the start to a state, for the families that can carry a datum."""
    layout = state.layout
    out = np.zeros(layout.size)
    out[: 3 * layout.count("point")] = (state.points - start.points).ravel()
    turn = rotation.log(state.pose_r @ start.pose_r.transpose(0, 2, 1))
    pose = np.concatenate([state.pose_t - start.pose_t, turn], axis=1)
    first = layout.offset["pose"]
    out[first : first + pose.size] = pose.ravel()
    return out[free_columns]


def _small(step: Array, assembly: Assembly, options: Options) -> bool:
    """True if no length and no angle moved noticeably."""
    layout = assembly.layout
    radians = np.zeros(layout.size, dtype=bool)
    poses = layout.columns("pose", np.arange(layout.count("pose")))
    planes = layout.columns("plane", np.arange(layout.count("plane")))
    radians[poses[:, 3:].ravel()] = True
    radians[planes[:, :2].ravel()] = True
    radians[layout.offset["scalar"] :] = True
    limit = np.where(radians[assembly.free_columns], options.step_radians, options.step_metres)
    return bool((np.abs(step) < limit).all())


def _within_sigma(step: Array, final: Adjustment, options: Options) -> bool:
    """True if the last step is small against the sigma of each unknown."""
    index = np.arange(len(step))
    sigma = np.sqrt(np.maximum(final.cofactor.entries(index, index), 0.0))
    return bool((np.abs(step) <= options.step_sigma * sigma + 1e-9).all())


def _finish(
    assembly: Assembly,
    state: State,
    datum: NDArray[np.bool_],
    motions: OpenMotions,
    iterations: int,
) -> Adjustment:
    """The adjustment at the solution, with the undamped cofactor matrix."""
    system = _System(assembly, state, datum, motions, 0.0)
    network = assembly.network
    return Adjustment(
        network=network,
        state=state,
        rows=assembly.rows,
        residuals=-assembly.misclosure(state),
        whitened_residuals=-system.white,
        design=system.design,
        free_columns=assembly.free_columns,
        cofactor=system.cofactor,
        motions=system.motions,
        iterations=iterations,
        warnings=network.warnings + system.warnings,
        assembly=assembly,
    )
