"""What one run of the engine has come to: a place, its formal covariance, the noise of its phases.

The same for a whole session and for each of its pieces. Without air the hydrostatic delay that the
engine computes with is taken out again (:mod:`~tribrach.gnss.dry_air`).

Residuals belong to the engine's place of their epoch, which is written with four decimals. Where
these are a noticeable part of the sigma, a second run of the engine gives the residuals against one
place that is given and stands (:func:`outcome_standing`). Method section 7.2.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.gnss.dry_air import UNSURE, delay_differences, displacement
from tribrach.gnss.fixed_phases import (
    ClockFreePhases,
    PhaseWeights,
    clock_free,
    learned_weights,
)
from tribrach.gnss.phase_noise import ASSUMED, PhaseNoise, phase_noise, usual_noise
from tribrach.instruments.final_solution import FinalSolution, final_solution
from tribrach.instruments.gnss_solutions import SOURCE, sigma_factor
from tribrach.io.gnss.solution_file import (
    FIXED,
    FLOAT,
    PhaseResiduals,
    SatelliteUse,
    Solution,
)

#: coordinates of the engine end with this decimal [m]
ROUNDING = 1e-4
#: share of a variance from which on the last decimal is noticed
NOTICED = 0.01
#: decimals of a place that is given to the engine
GIVEN = 6
#: what reports cite for the factor where phases tell it
RESIDUALS = "residuals of the phases and how long they stay alike"


@dataclass(frozen=True, eq=False)
class RunOutcome:
    """Result of one run of the engine."""

    place: Array  #: (3,), ECEF coordinates of the rover [m]
    #: (3, 3), covariance with independent epochs and the weights of the phases [m^2], which in the
    #: mean are those of the engine
    formal: Array
    final: FinalSolution  #: the state of the solution at its end
    epochs: int  #: with a solution of phases
    #: first and last of them [s]
    start: float
    end: float
    satellites: float  #: mean number over them
    phases: ClockFreePhases | None  #: from which their noise is learned; None where there are none
    #: root mean square of the phases' double differences [m], None if the engine gives none
    residual: float | None
    #: (3, 3), covariance [m^2] of what was taken out for the air, which pieces of a session share
    air: Array
    #: (3,), variance [m^2] by the last decimal of the engine's places, an upper bound; zero where
    #: they stand
    rounding: Array
    weights: PhaseWeights  #: of the phases
    satellites_used: tuple[str, ...] = ()  #: names of the satellites

    def covariance(self, factor: float) -> Array:
        """Covariance (3, 3) [m^2] by a factor on formal sigmas, and of the last decimal."""
        out: Array = self.formal * factor**2 + self.final.scatter + np.diag(self.rounding)
        return out

    def noticed(self, factor: float) -> bool:
        """True if the last decimal of the engine's places is a noticeable part of the variance."""
        if not self.final.fixed or self.phases is None:
            return False
        return bool((self.rounding > NOTICED * factor**2 * np.diag(self.formal)).any())

    def noise(self, interval: float, *, air: bool) -> PhaseNoise | None:
        """Noise of the phases, or None; without ``air`` the engine's assumption says nothing."""
        if self.phases is None:
            return None
        if not self.final.fixed:
            return usual_noise(self.phases, interval, self.epochs)
        assumed = ASSUMED if air else 0.0
        return phase_noise(self.phases, interval, self.epochs, assumed=assumed)


def outcome_of(
    solution: Solution,
    used: SatelliteUse | None,
    base: Array,
    *,
    air: bool,
    weights: PhaseWeights | None = None,
) -> RunOutcome | None:
    """The outcome of a run; None where no epoch has a solution of phases.

    ``base`` (3,) is ECEF [m]; ``weights`` of phases with integers are learned if None.
    """
    phase = np.flatnonzero(solution.quality <= FLOAT)
    if not len(phase):
        return None
    values, covariance = solution.values[phase], solution.covariance[phase]
    fixed = solution.quality[phase] == FIXED
    length = float(np.linalg.norm(values[-1] - base))
    final = final_solution(values, covariance, fixed, solution.ratio[phase], length)
    place, formal = values[final.epoch], covariance[final.epoch]
    phases = None if used is None else used.phases
    residual = None if used is None else used.residual
    free, rounding, unsure = None, _rounding(place[None]), np.zeros((3, 3))
    own = PhaseWeights() if weights is None else weights
    if phases is not None and not final.fixed:
        free = clock_free(phases, solution, phase, None)
    elif phases is not None:
        # epochs of other integers are not of this place
        chosen = phase[fixed & (np.linalg.norm(values - place, axis=1) <= final.limit)]
        found = _adjusted(phases, solution, chosen, place, base, final.limit, air, weights)
        if found is not None:
            free, own, shift, cofactor, away = found
            if cofactor is not None:
                place, formal = place + shift, cofactor
                rounding = _rounding(solution.values[chosen])
            elif away is not None:
                place = place + away
            if away is not None:
                unsure = UNSURE**2 * np.outer(away, away)
                residual = free.residual
    times = solution.times[phase]
    return RunOutcome(
        place,
        formal,
        final,
        len(phase),
        float(times[0]),
        float(times[-1]),
        float(solution.satellites[phase].mean()),
        free,
        residual,
        unsure,
        rounding,
        own,
        () if used is None else used.satellites,
    )


def _adjusted(
    phases: PhaseResiduals,
    solution: Solution,
    chosen: NDArray[np.int64],
    place: Array,
    base: Array,
    limit: float,
    air: bool,
    weights: PhaseWeights | None,
) -> tuple[ClockFreePhases, PhaseWeights, Array, Array | None, Array | None] | None:
    """Least squares of the phases of fixed epochs, with the weights that they have or show.

    ``chosen`` (k,): epochs of one set of integers; ``place`` (3,): to which phases are related [m];
    ``limit``: a shift beyond this is refused [m]. Returns the phases, related to the place that
    they give, else to the one given, with their weights; ``shift`` (3,): of the place [m];
    ``cofactor`` (3, 3): its formal covariance [m^2], None where the phases do not determine a place
    near by; ``away`` (3,): what the delays of the air did to it [m], None with air.
    """
    delay = None if air else delay_differences(phases, base, place)
    own = PhaseWeights() if weights is None else weights
    free = clock_free(phases, solution, chosen, place, delay, own)
    if free is None:
        return None
    found = free.coordinates()
    if found is not None and weights is None:
        own = learned_weights(free.moved(found[0]))
        again = clock_free(phases, solution, chosen, place, delay, own)
        free = free if again is None else again
        found = free.coordinates()
    shift, cofactor = np.zeros(3), None
    if found is not None and np.linalg.norm(found[0]) <= limit:
        shift, cofactor = found
        free = free.moved(shift)
    away = None
    if delay is not None:
        used = np.isin(phases.times, free.times)
        away = displacement(_chosen(phases, used), delay[used], place + shift)
    return free, own, shift, cofactor, away


def standing_place(outcome: RunOutcome) -> Array:
    """The place (3,) [m] that the engine is given to stand at, as it reads it."""
    return np.round(outcome.place, GIVEN)


def outcome_standing(
    first: RunOutcome,
    solution: Solution,
    used: SatelliteUse | None,
    base: Array,
    *,
    air: bool,
    weights: PhaseWeights | None = None,
) -> RunOutcome:
    """An outcome with the residuals of a run whose rover stood at ``standing_place``."""
    if used is None or used.phases is None or first.phases is None:
        return first
    before = np.unique(first.phases.times)
    at = np.clip(np.searchsorted(before, solution.times - 1e-3), 0, len(before) - 1)
    known = np.abs(before[at] - solution.times) < 1e-3
    chosen = np.flatnonzero((solution.quality == FIXED) & known)
    if 2 * len(chosen) < len(before):
        return first
    stand = standing_place(first)
    # the file has four decimals of what was given with six
    given = replace(solution, values=np.tile(stand, (len(solution), 1)))
    found = _adjusted(used.phases, given, chosen, stand, base, first.final.limit, air, weights)
    if found is None:
        return first
    free, own, shift, cofactor, away = found
    if cofactor is None:
        return first
    return replace(
        first,
        place=stand + shift,
        formal=cofactor,
        phases=free,
        residual=free.residual if away is not None else used.residual,
        air=first.air if away is None else UNSURE**2 * np.outer(away, away),
        rounding=np.zeros(3),
        weights=own,
    )


def _rounding(values: Array) -> Array:
    """Variance (3,) [m^2] by the last decimal of a mean of coordinates (n, 3).

    Those of a filter that stands are rounded alike until they change; one that moves on has less.
    """
    out = np.zeros(3)
    for k, column in enumerate(values.T):
        edges = np.flatnonzero(np.diff(column)) + 1
        runs = np.diff(np.concatenate([[0], edges, [len(column)]]))
        out[k] = ROUNDING**2 / 12 * float(np.square(runs / len(column)).sum())
    return out


def _chosen(phases: PhaseResiduals, keep: NDArray[np.bool_]) -> PhaseResiduals:
    """Some of the phases."""
    names = ("times", "satellites", "frequencies", "azimuth", "elevation", "residuals")
    return replace(phases, **{name: getattr(phases, name)[keep] for name in names})


def stated_factor(noise: PhaseNoise | None, interval: float, epochs: int) -> tuple[float, str]:
    """Factor on formal sigmas by noise, each ``interval`` [s], and its origin (section 7.2)."""
    if noise is None:
        return sigma_factor(interval, epochs), SOURCE
    return noise.factor(epochs), RESIDUALS
