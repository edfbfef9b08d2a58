"""Adjusts a network: linearise, whiten, solve, update, until nothing moves any more.

Gauss-Newton on the manifold with Levenberg-Marquardt damping only where a full step would not
descend; the covariance is always that of the undamped system at the solution (method section 3.1).
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.answers import Estimate
from tribrach.errors import AdjustmentError, NoStartValues, NotConverged
from tribrach.geometry import rotation
from tribrach.network import defects
from tribrach.network.alike_names import hints_among
from tribrach.network.assembly import Assembly
from tribrach.network.datum import Cofactor, OpenMotions, open_motions, point_numbers
from tribrach.network.linear import PIVOT_LIMIT, SingularMatrix
from tribrach.network.network import Network
from tribrach.network.observation_rows import ObservationRows
from tribrach.network.quality import Quality
from tribrach.network.results import (
    FrameLibrary,
    Names,
    PlaceDifference,
    PlotName,
    PointResult,
    Results,
    ScalarResult,
    StationResult,
    TableName,
)
from tribrach.network.solved import SolvedSystem
from tribrach.network.start.missing import left_out
from tribrach.network.start.placeholders import misplaced, without_dummies, without_placeholders
from tribrach.network.start.start_values import find_start
from tribrach.network.start.trials import tried_starts
from tribrach.observations.unknowns import State

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: what ``dir`` of an adjustment shows
_SURVEYORS = (
    "points",
    "stations",
    "scalars",
    "observations",
    "network",
    "residuals",
    "covariance",
    "results",
    "quality",
    "difference",
    "direction",
    "distance",
    "sigma0_prior",
    "sigma0_posterior",
    "dof",
    "warnings",
    "summary",
    "to_frame",
    "plot",
)


#: the first damping, and what multiplies it when a step still does not descend: 10, 100, 10,000
_DAMPING, _GROWTH = 1e-7, 10.0
#: share of a step at which the curvature along it is looked at
_PROBE = 0.1
#: steps that do not shrink any more are rounding where they stay below this share of sigma
_ROUNDING = 1e-4


@dataclass(frozen=True)
class Options:
    """When the iteration ends."""

    max_iterations: int = 60  #: linearisations before giving up
    step_sigma: float = 0.01  #: largest last step in units of its own sigma
    #: largest last step of lengths [m] and of angles [rad]
    step_metres: float = 1e-7
    step_radians: float = 1e-10
    vtpv_change: float = 1e-10  #: largest last relative change of the weighted sum of squares
    #: called with (iteration, sum of squares) after each step
    progress: Callable[[int, float], None] | None = None


@dataclass(frozen=True, repr=False)
class Adjustment(SolvedSystem):
    """An adjusted network: coordinates, stations and observations by name.

    Attributes
    ----------
    points, stations, scalars
        Adjusted unknowns by name, each with its covariance; see
        :class:`~tribrach.network.results.PointResult`.
    observations
        Every observed value with its residual and tests, by number and by id.
    network
        What was adjusted; ``adjust(adjustment.network.without(id, reason=...))`` does it again.
    residuals
        Array (n,) [m, rad] of the active values, in the order of ``rows``.

    Notes
    -----
    Standard deviations and covariances are a priori: they follow from those given with the
    observations. ``results(posterior=True)`` gives the same scaled by ``v^T P v / r``.

    Examples
    --------
    >>> from tribrach.network.survey import Survey
    >>> from tribrach.observations.sights import Distances
    >>> survey = Survey()
    >>> survey.point("A", (0.0, 0.0, 0.0), free=(False, False, False), role="control")
    >>> survey.point("B", (100.0, 0.0, 0.0), free=(True, False, False))
    >>> _ = survey.add(
    ...     Distances, values=[100.003, 100.005], sigma=0.002, start=["A", "A"], end=["B", "B"]
    ... )
    >>> adjustment = adjust(survey.network())
    >>> adjustment
    <Adjustment: 2 points, 2 observed values, redundancy 1, global test passed>
    >>> adjustment.points["B"]
    <point B, free: 100.0040 - - m, sigma 1.41 - - mm a priori>
    >>> adjustment.observations["distance:A:B::2"]
    <distance:A:B::2: 100.0050 m, residual -1.00 mm, w -0.71, active>
    """

    #: start values as they were given, before those that were missing were found
    given: State | None = field(default=None, repr=False)

    def results(self, *, posterior: bool = False, confidence: float = 0.95) -> Results:
        """Results by name, scaled and at a confidence of your choice.

        Parameters
        ----------
        posterior : bool
            Scale covariances by ``v^T P v / r``; without redundancy, or with residuals that
            are all zero, they stay a priori.
        confidence : float
            Probability that ellipses and ellipsoids hold.

        Raises
        ------
        InputError
            The confidence is not between 0 and 1.
        """
        return Results(self, posterior=posterior, confidence=confidence)

    @cached_property
    def _results(self) -> Results:
        return self.results()

    @property
    def points(self) -> Names[PointResult]:
        """Points by name, sigmas a priori unless :meth:`stated` made them others."""
        return self._results.points

    @property
    def stations(self) -> Names[StationResult]:
        """Scanner stations by name, sigmas as those of points."""
        return self._results.stations

    @property
    def scalars(self) -> Names[ScalarResult]:
        """Single unknowns by name (orientations, calibration parameters), sigmas as of points."""
        return self._results.scalars

    @property
    def observations(self) -> ObservationRows:
        """Every observed value with residual and tests; computed when first asked for."""
        return self._results.observations

    @property
    def quality(self) -> Quality:
        """Quality figures; computed when first asked for."""
        return self._results.quality

    def stated(self, *, posterior: bool = False, confidence: float = 0.95) -> Adjustment:
        """The same, its points, tests and tables scaled and at a confidence of your choice."""
        other = copy(self)
        other.__dict__["_results"] = other.results(posterior=posterior, confidence=confidence)
        return other

    def difference(self, a: str, b: str) -> PlaceDifference:
        """Place of one point or station less that of another, with its covariance."""
        return self._results.difference(a, b)

    def distance(self, a: str, b: str, *, horizontal: bool = False) -> Estimate:
        """Distance of two points or stations [m], in plan if wanted, with its sigma."""
        return self._results.distance(a, b, horizontal=horizontal)

    def direction(self, a: str, b: str) -> Estimate:
        """Azimuth from one point or station to another [rad], from N clockwise, with its sigma."""
        return self._results.direction(a, b)

    def to_frame(
        self, table: TableName = "observations", library: FrameLibrary | None = None
    ) -> Any:
        """A table of results; see :meth:`tribrach.network.results.Results.to_frame`."""
        return self._results.to_frame(table, library)

    def plot(self, what: PlotName = "plan", axes: Axes | None = None) -> Axes:
        """Draw the network; see :meth:`tribrach.network.results.Results.plot`."""
        return self._results.plot(what, axes)

    def summary(self) -> str:
        """The adjustment in a page: datum, sigma0, tests, worst observations, points."""
        return self._results.summary()

    def __str__(self) -> str:
        return self.summary()

    def __repr__(self) -> str:
        return repr(self._results)

    def _repr_html_(self) -> str:
        return self._results._repr_html_()

    def __dir__(self) -> list[str]:
        """What a surveyor asks for; what the solver keeps is documented at SolvedSystem."""
        return sorted(_SURVEYORS)


def adjust(network: Network, *, options: Options | None = None) -> Adjustment:
    """Adjust a network by least squares (method section 3.1).

    ``network``: observations, unknowns and datum; missing start values are found; ``options``: when
    the iteration ends; the defaults of :class:`Options` if None.
    """
    options = options or Options()
    solve = partial(_adjusted, options=options)
    network = without_dummies(network)
    try:
        try:
            found = solve(network)
        except NoStartValues as error:
            thrown = tried_starts(network, error.unplaced, solve)
            if thrown is None:
                raise
            found = solve(thrown)
        except NotConverged:
            better = without_placeholders(network, solve)
            if better is None:
                raise
            return solve(better)
        if misplaced(network, found) and (better := without_placeholders(network, solve)):
            return solve(better)
        return found
    except AdjustmentError as error:
        names = network.start.layout.names
        if not isinstance(error, NoStartValues):
            error.also(left_out(network))
        error.also(hints_among([*names["point"], *names["pose"]], network.warnings))
        raise


def _adjusted(network: Network, options: Options) -> Adjustment:
    """The solution; what it raises names no alike names yet."""
    given = network.start
    network = network.with_start(find_start(network))
    assembly = Assembly(network)
    datum = defects.datum_mask(network, assembly.free_columns)
    state = network.start
    damping, growth, vtpv, motions = 0.0, _GROWTH, np.inf, None
    before = np.inf
    for iteration in range(1, options.max_iterations + 1):
        system = _System(assembly, state, datum, motions, damping)
        motions = system.motions
        step = system.step(_moved(network.start, state, assembly.free_columns))
        found = _descent(assembly, system, state, step)
        if found is None:
            damping, growth = max(growth * damping, _DAMPING), growth**2
            if damping > 1e8:
                break
            continue
        state, cost, step = found
        if options.progress:
            options.progress(iteration, cost)
        change = abs(vtpv - cost)
        steady = change <= options.vtpv_change * cost + 1e-9
        vtpv, damped = cost, damping
        damping, growth = (damping / 100 if damping > _DAMPING else 0.0), _GROWTH
        size = _size(step, assembly, options)
        # rounding alone moves what is weak by more than the limits, and never less
        rounding = size > 0.5 * before
        before = size
        if not damped and steady and (size < 1 or rounding):
            # a step below the limits changes no derivative: the system that gave it is the last
            last = system if size < 1 else _System(assembly, state, datum, motions, 0.0)
            final = _finish(assembly, state, last, iteration, given)
            if _within_sigma(step, final, options.step_sigma if size < 1 else _ROUNDING):
                return final
    raise NotConverged(
        f"the adjustment did not converge in {options.max_iterations} iterations",
        defects.not_converged(assembly, state, motions.basis if motions else np.zeros((0, 0))),
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
            centred = assembly.centred(state)
            design = self.design if centred is state else assembly.design(centred)
            self.motions = open_motions(design, state, assembly.free_columns, self.constraints)
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
                assembly, self.design, self.constraints, self.motions.basis, state
            )
        if cofactor is None:
            raise NotConverged("the normal matrix cannot be factored where the iteration went")
        self.cofactor: Cofactor = cofactor

    def step(self, moved: Array) -> Array:
        """Increment (u,) of the free columns."""
        return self.cofactor.step(self.gradient, self.right, moved)

    def bend(self, gradient: Array) -> Array:
        """Increment (u,) by a gradient alone, which changes neither constraints nor datum."""
        zero = np.zeros(len(gradient))
        return self.cofactor.step(gradient, np.zeros_like(self.right), zero)


def _descent(
    assembly: Assembly, system: _System, state: State, step: Array
) -> tuple[State, float, Array] | None:
    """State, sum of squares and step (u,) that descends: the step, or the step bent.

    Pulling a constraint in may cost some fit: either is progress. The bent step follows the
    curvature of the observations along it (method section 3.1).
    """

    def progress(trial: State) -> float | None:
        cost, violation = _merit(assembly, trial)
        lower = cost <= system.cost * (1 + 1e-8) + 1e-9
        return cost if lower or violation < 0.5 * system.violation else None

    trial = state.retract(_full(step, assembly))
    if (cost := progress(trial)) is not None:
        return trial, cost, step
    probe = state.retract(_full(_PROBE * step, assembly))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        moved = assembly.whiten(assembly.misclosure(probe))
        second = ((moved - system.white) / _PROBE + system.design @ step) / _PROBE
    if not np.isfinite(second).all():
        return None
    bent = step + system.bend(system.design.T @ second)
    trial = state.retract(_full(bent, assembly))
    return None if (cost := progress(trial)) is None else (trial, cost, bent)


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


def _size(step: Array, assembly: Assembly, options: Options) -> float:
    """Largest change of a length or an angle over the limit for it; below 1 nothing moved."""
    layout = assembly.layout
    radians = np.zeros(layout.size, dtype=bool)
    poses = layout.columns("pose", np.arange(layout.count("pose")))
    planes = layout.columns("plane", np.arange(layout.count("plane")))
    radians[poses[:, 3:].ravel()] = True
    radians[planes[:, :2].ravel()] = True
    radians[layout.offset["scalar"] :] = True
    limit = np.where(radians[assembly.free_columns], options.step_radians, options.step_metres)
    return float((np.abs(step) / limit).max(initial=0.0))


def _within_sigma(step: Array, final: Adjustment, share: float) -> bool:
    """True if the last step is small against the sigma of each unknown."""
    index = np.arange(len(step))
    sigma = np.sqrt(np.maximum(final.cofactor.entries(index, index), 0.0))
    return bool((np.abs(step) <= share * sigma + 1e-9).all())


def _finish(
    assembly: Assembly, state: State, system: _System, iterations: int, given: State
) -> Adjustment:
    """The adjustment at the solution, with the undamped cofactor matrix of a system there."""
    network = assembly.network
    misclosure = assembly.misclosure(state)
    return Adjustment(
        network=network,
        state=state,
        rows=assembly.rows,
        residuals=-misclosure,
        whitened_residuals=-assembly.whiten(misclosure),
        design=system.design,
        free_columns=assembly.free_columns,
        cofactor=system.cofactor,
        motions=system.motions,
        iterations=iterations,
        warnings=network.warnings + system.warnings,
        assembly=assembly,
        given=given,
    )
