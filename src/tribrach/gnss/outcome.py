"""What one run of the engine has come to: a place, its formal covariance, the noise of its phases.

The same for a whole session and for each of its pieces. Without air the hydrostatic delay that the
engine computes with is taken out again (:mod:`~tribrach.gnss.dry_air`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tribrach._types import Array
from tribrach.gnss.dry_air import UNSURE, delay_differences, displacement
from tribrach.gnss.phase_noise import FEWEST, PhaseNoise, double_differences, phase_noise
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
#: the noise that the engine assumes counts as much as so many independent double differences
ASSUMED = 5.0
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
        Covariance that the engine states [m^2].
    final
        The state of the solution at its end.
    epochs
        With a solution of phases.
    start, end
        First and last of them [s].
    satellites
        Mean number over them.
    noise
        Of the phases, None where they do not tell.
    residual
        Root mean square of the phases' double differences [m], None if the engine gives none.
    unsure : (3, 3)
        Covariance of what was taken out for the air [m^2]; pieces of a session share it.
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
    noise: PhaseNoise | None
    residual: float | None
    unsure: Array
    satellites_used: tuple[str, ...] = ()

    def covariance(self, factor: float) -> Array:
        """Covariance (3, 3) [m^2] with a factor on formal sigmas, without what pieces share."""
        rounding = np.eye(3) * ROUNDING**2 / 12
        out: Array = self.formal * factor**2 + self.final.scatter + rounding
        return out


def outcome_of(
    solution: Solution, used: SatelliteUse | None, base: Array, interval: float, *, air: bool
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
    interval
        Time between epochs [s].
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
    place, unsure, noise = values[final.epoch], np.zeros((3, 3)), None
    phases = None if used is None else used.phases
    delay = None
    if phases is not None and final.fixed and not air:
        until = _until(phases, float(solution.times[phase[final.epoch]]))
        away = displacement(until, delay_differences(until, base, place), place)
        place, unsure = place + away, UNSURE**2 * np.outer(away, away)
        delay = delay_differences(phases, base, place)
    residual = None if used is None else used.residual
    if phases is not None:
        chosen = phase[fixed] if final.fixed else phase
        differences = double_differences(
            phases, solution, chosen, place if final.fixed else None, delay
        )
        noise = phase_noise(differences, interval)
        if delay is not None:
            residual = float(np.sqrt(np.square(differences.residuals).mean()))
    times = solution.times[phase]
    return RunOutcome(
        place,
        covariance[final.epoch],
        final,
        len(phase),
        float(times[0]),
        float(times[-1]),
        float(solution.satellites[phase].mean()),
        noise,
        residual,
        unsure,
        () if used is None else used.satellites,
    )


def _until(phases: PhaseResiduals, time: float) -> PhaseResiduals:
    """The phases up to a time [s]: what a filter has seen by then."""
    keep = phases.times <= time + 1e-3
    names = ("times", "satellites", "frequencies", "azimuth", "elevation", "residuals")
    return replace(phases, **{name: getattr(phases, name)[keep] for name in names})


def stated_factor(
    noise: PhaseNoise | None, interval: float, epochs: int, *, air: bool
) -> tuple[float, str]:
    """Factor on formal standard deviations, and where it comes from (method section 2.7).

    Parameters
    ----------
    noise
        Of the phases of the session, None where they do not tell.
    interval
        Time between epochs [s].
    epochs
        Of the session, or of a piece of it.
    air
        False if the data are free of it. With air phases are alike for as long as the exponential
        says at least, which leaves a short session fewer independent residuals than it seems to
        have; what the engine assumes has its weight beside them.
    """
    usual = sigma_factor(interval, epochs)
    if noise is None:
        return usual, SOURCE
    inflation = noise.inflation(epochs)
    if not air:
        return noise.scale * inflation, RESIDUALS
    of_session = noise.inflation(noise.epochs)
    alike = max(of_session, sigma_factor(interval, noise.epochs))
    count = noise.independent * (of_session / alike) ** 2
    if count < FEWEST:
        scale = max(noise.scale, 1.0)
    else:
        power = noise.scale**2 * (1 - 3 / noise.independent) / (1 - 3 / count)
        scale = float(np.sqrt((ASSUMED + count * power) / (ASSUMED + count)))
    return scale * max(inflation, usual), RESIDUALS
