"""What one run of the engine has come to: a place, its formal covariance, the noise of its phases.

The same for a whole session and for each of its pieces. Without air the hydrostatic delay that the
engine computes with is taken out again (:mod:`~tribrach.gnss.dry_air`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.gnss.dry_air import UNSURE, delay_differences, displacement
from tribrach.gnss.fixed_phases import ClockFreePhases, clock_free
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

__all__ = ["RESIDUALS", "ROUNDING", "RunOutcome", "outcome_of", "stated_factor"]

#: coordinates of the engine end with this decimal [m]
ROUNDING = 1e-4
#: what reports cite for the factor where phases tell it
RESIDUALS = "residuals of the phases and how long they stay alike"


@dataclass(frozen=True, eq=False)
class RunOutcome:
    """What one run has come to.

    Attributes
    ----------
    place : (3,)
        ECEF coordinates of the rover [m].
    formal : (3, 3)
        Covariance with the engine's weights and independent epochs [m^2].
    final
        The state of the solution at its end.
    epochs
        With a solution of phases.
    start, end
        First and last of them [s].
    satellites
        Mean number over them.
    phases
        From which their noise is learned; None where there are none.
    residual
        Root mean square of the phases' double differences [m], None if the engine gives none.
    unsure : (3, 3)
        Covariance [m^2] of what was taken out for the air, which pieces of a session share, and of
        the engine's last decimal, an upper bound that says nothing of their scatter.
    satellites_used
        Names of the satellites.
    """

    place: Array
    formal: Array
    final: FinalSolution
    epochs: int
    start: float
    end: float
    satellites: float
    phases: ClockFreePhases | None
    residual: float | None
    unsure: Array
    satellites_used: tuple[str, ...] = ()

    def covariance(self, factor: float) -> Array:
        """Covariance (3, 3) [m^2] with a factor on formal sigmas, without ``unsure``."""
        out: Array = self.formal * factor**2 + self.final.scatter
        return out

    def noise(self, interval: float, *, air: bool) -> PhaseNoise | None:
        """Noise of the phases, None where they do not tell.

        Parameters
        ----------
        interval
            Time between epochs [s].
        air
            False if the data are free of it: the engine's assumption says nothing of them then.
        """
        if self.phases is None:
            return None
        if not self.final.fixed:
            return usual_noise(self.phases, interval, self.epochs)
        assumed = ASSUMED if air else 0.0
        return phase_noise(self.phases, interval, self.epochs, assumed=assumed)


def outcome_of(
    solution: Solution, used: SatelliteUse | None, base: Array, *, air: bool
) -> RunOutcome | None:
    """The outcome of a run; None where no epoch has a solution of phases.

    Parameters
    ----------
    solution
        All epochs, ECEF.
    used
        What the status file says, None if there is none.
    base : (3,)
        ECEF coordinates of the base [m].
    air
        False if the data are free of it.
    """
    phase = np.flatnonzero(solution.quality <= FLOAT)
    if not len(phase):
        return None
    values, covariance = solution.values[phase], solution.covariance[phase]
    fixed = solution.quality[phase] == FIXED
    length = float(np.linalg.norm(values[-1] - base))
    final = final_solution(values, covariance, fixed, solution.ratio[phase], length)
    place, formal, unsure = values[final.epoch], covariance[final.epoch], np.zeros((3, 3))
    phases = None if used is None else used.phases
    residual = None if used is None else used.residual
    free, adjusted, rounding = None, False, _rounding(place[None])
    if phases is not None and not final.fixed:
        free = clock_free(phases, solution, phase, None)
    elif phases is not None:
        # epochs of other integers are not of this place
        chosen = phase[fixed & (np.linalg.norm(values - place, axis=1) <= final.limit)]
        delay = None if air else delay_differences(phases, base, place)
        free = clock_free(phases, solution, chosen, place, delay)
        found = None if free is None else free.coordinates()
        if free is not None and found is not None and np.linalg.norm(found[0]) <= final.limit:
            place, formal, adjusted = place + found[0], found[1], True
            free = free.moved(found[0])
            rounding = _rounding(solution.values[chosen])
        if delay is not None and free is not None:
            own = np.isin(phases.times, free.times)
            away = displacement(_chosen(phases, own), delay[own], place)
            place = place if adjusted else place + away
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
        unsure + np.diag(rounding),
        () if used is None else used.satellites,
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
    """Factor on formal standard deviations, and where it comes from (method section 7.2).

    Parameters
    ----------
    noise
        Of the phases of the session, None where they do not tell.
    interval
        Time between epochs [s].
    epochs
        Of the session, or of a piece of it.
    """
    if noise is None:
        return sigma_factor(interval, epochs), SOURCE
    return noise.factor(epochs), RESIDUALS
