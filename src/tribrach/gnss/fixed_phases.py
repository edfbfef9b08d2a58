"""Phases of a session without their clocks, and the coordinates that they give by least squares.

The engine's status file has double differences, reference satellite minus the others. Differences
between the receivers alone are as good and have no reference: those of one epoch, system and
frequency share an unknown clock, which is taken out with the weights of the phases. What is left is
divided by their standard deviation.

A phase has two kinds of noise. That of receivers and air grows towards the horizon as the engine
assumes. The last decimals of files, a thousandth of a cycle and a tenth of a millimetre, do not: in
data whose noise is smaller, as those of a simulator, a low satellite is as good as a high one.

With integer ambiguities these phases are linear in the coordinates of the rover, and their least
squares are the baseline. The last line of the engine's filter is not: it lets ambiguities wander,
so that it forgets the start of a session. Method section 7.2.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.geodesy.site import EllipsoidSite
from tribrach.io.gnss.solution_file import PhaseResiduals, Solution

#: the engine's standard deviation of a phase in zenith, and of what grows towards the horizon [m]
PHASE_SIGMA = 0.003
#: sine of the lowest elevation
LOWEST = 0.05
#: last decimal of phases in RINEX [cycles], and of residuals in the engine's status file [m]
CYCLES, LAST_DECIMAL = 1e-3, 1e-4
#: wavelengths of the engine's frequencies [m]; those of all systems are within 8 % of them
WAVELENGTHS = (0.1903, 0.2442, 0.2548)
#: fewer degrees of freedom than this do not tell noise from decimals
FEWEST = 10.0
#: smallest part of the largest eigenvalue of normal equations that determine three coordinates
DETERMINED = 1e-9


@dataclass(frozen=True, eq=False)
class ClockFreePhases:
    """n differences of phases between two receivers, without clocks, over their sigmas."""

    times: Array  #: (n,), seconds since 1980-01-06
    satellites: NDArray[np.int64]  #: (n,), numbers of the satellites
    values: Array  #: (n,), observed minus computed, over their standard deviation by ``weights``
    design: Array  #: (n, 3), derivatives by the coordinates of the rover [1/m]
    freedom: Array  #: (n,), share of each that its clock has left: (m - 1)/m with m satellites
    rounded: Array  #: (n,), what last decimals alone would give for the squares of ``values``
    relative: Array  #: (n,), variance by last decimals over the engine's
    residual: float  #: root mean square of the double differences [m]

    def coordinates(self) -> tuple[Array, Array] | None:
        """Shift of the rover (3,) [m] by least squares, and its formal covariance (3, 3) [m^2].

        The covariance is that of independent phases with the standard deviations of ``weights``.

        None where the phases do not determine it.
        """
        normal = self.design.T @ self.design
        size = np.linalg.eigvalsh(normal)
        if not size[0] > DETERMINED * size[-1]:
            return None
        cofactor = np.asarray(np.linalg.inv(normal), dtype=float)
        return cofactor @ (self.design.T @ self.values), cofactor

    def moved(self, shift: Array) -> ClockFreePhases:
        """The same, related to a place that is shifted (3,) [m]."""
        return replace(self, values=self.values - self.design @ shift)

    def over_frequencies(self) -> tuple[Array, Array, NDArray[np.int64], Array]:
        """One row for each epoch and satellite: what coordinates are made of.

        Frequencies share air and part of their multipath. Their sum over the root of their number
        has this in its variance, while each by itself would count as a witness of its own.

        Returns ``times`` (k,): ascending for each satellite [s]; ``table`` (k, 4): values, and the
        three columns of the design; ``satellites`` (k,): ascending; ``freedom`` (k,): as before.
        """
        order = np.lexsort((self.times, self.satellites))
        time, satellite = self.times[order], self.satellites[order]
        new = np.ones(len(order), dtype=bool)
        new[1:] = (np.abs(np.diff(time)) > 1e-3) | (np.diff(satellite) != 0)
        first = np.flatnonzero(new)
        count = np.diff(np.append(first, len(order)))
        table = np.column_stack([self.values, self.design])[order]
        summed = np.add.reduceat(table, first, axis=0) / np.sqrt(count)[:, None]
        freedom = np.add.reduceat(self.freedom[order], first) / count
        return time[first], summed, satellite[first], freedom


@dataclass(frozen=True)
class PhaseWeights:
    """Variance of phases: a part as the engine's, and one by the last decimals of the files."""

    engine: float = 1.0  #: factor on the engine's variance
    decimals: float = 0.0  #: factor on the variance that decimals leave

    def variance(self, elevation: Array, frequencies: NDArray[np.int64]) -> Array:
        """Variance (n,) [m^2] of the difference of a phase between two receivers."""
        return self.engine * phase_variance(elevation) + self.decimals * decimal_variance(
            frequencies
        )


def learned_weights(phases: ClockFreePhases) -> PhaseWeights:
    """How much of the variance of phases with integer ambiguities is that of their last decimals.

    What decimals leave is known, and what is beyond is the engine's variance times an unknown
    factor, from the sum of the squares. Both are divided so that their mean over the phases is what
    the engine assumes: the variance itself is learned with the correlation.
    """
    dof = float(phases.freedom.sum()) - 3
    if dof < FEWEST:
        return PhaseWeights()
    rest = float(phases.values @ phases.values - phases.rounded.sum())
    own = max(rest / dof, 0.0)
    total = own + float(phases.relative.mean())
    return PhaseWeights(own / total, 1 / total)


def sight_lines(phases: PhaseResiduals, place: Array) -> Array:
    """Unit vectors (n, 3) from a place (3,) [m] to the satellites, ECEF."""
    level = np.cos(phases.elevation)
    local = np.stack(
        [
            level * np.sin(phases.azimuth),
            level * np.cos(phases.azimuth),
            np.sin(phases.elevation),
        ],
        axis=-1,
    )
    ecef: Array = local @ EllipsoidSite.centred(place[None]).w_from_ecef
    return ecef


def phase_variance(elevation: Array) -> Array:
    """The engine's variance [m^2] of a phase between receivers at ``elevation`` (n,) [rad]."""
    sine = np.maximum(np.sin(elevation), LOWEST)
    variance: Array = 2 * PHASE_SIGMA**2 * (1 + 1 / sine**2)
    return variance


def decimal_variance(frequencies: NDArray[np.int64]) -> Array:
    """Variance [m^2] by last decimals of a phase between receivers; ``frequencies`` from 1 on."""
    wave = np.array(WAVELENGTHS)[np.clip(frequencies, 1, len(WAVELENGTHS)) - 1]
    variance: Array = (2 * (CYCLES * wave) ** 2 + LAST_DECIMAL**2) / 12
    return variance


def signal_groups(phases: PhaseResiduals) -> NDArray[np.int64]:
    """Groups (n,) of phases with one reference satellite: by epoch, system and frequency."""
    keys = [
        np.unique(column, return_inverse=True)[1].ravel().astype(np.int64)
        for column in (phases.times, phases.satellites.astype("U1"), phases.frequencies)
    ]
    number = (keys[0] * (keys[1].max() + 1) + keys[1]) * (keys[2].max() + 1) + keys[2]
    return np.unique(number, return_inverse=True)[1].ravel().astype(np.int64)


def clock_free(
    phases: PhaseResiduals,
    solution: Solution,
    chosen: NDArray[np.int64],
    place: Array | None,
    delay: Array | None = None,
    weights: PhaseWeights | None = None,
) -> ClockFreePhases | None:
    """Phases of some epochs without clocks, related to one place of the rover.

    ``phases``: residuals as the engine wrote them, each against the place of its own epoch;
    ``chosen`` (k,): epochs of the solution, ascending; ``place`` (3,): ECEF coordinates of the
    rover [m] that the residuals are to belong to; None leaves each with its own epoch, as it must
    be where ambiguities move as well; ``delay`` (n,): that the engine computed with each phase,
    rover minus base, and should not have [m]; ``weights``: of the phases, None for those of the
    engine.
    """
    times = solution.times[chosen]
    at = np.clip(np.searchsorted(times, phases.times - 1e-3), 0, len(times) - 1)
    own = np.abs(times[at] - phases.times) < 1e-3
    toward = sight_lines(phases, solution.values[chosen[-1]] if place is None else place)
    # reference minus this one is the file's sign, and the reference has 0: a clock apart
    single = -phases.residuals
    if place is not None:
        single = single + np.einsum("ni,ni->n", toward, place - solution.values[chosen][at])
    if delay is not None:
        single = single + delay
    group = signal_groups(phases)
    size = np.bincount(group, own)
    use = own & (size[group] > 1)
    if not use.any():
        return None
    group = np.unique(group[use], return_inverse=True)[1].ravel()
    count = np.bincount(group)
    elevation, frequencies = phases.elevation[use], phases.frequencies[use]
    variance = (weights or PhaseWeights()).variance(elevation, frequencies)
    decimals = decimal_variance(frequencies)
    root = 1 / np.sqrt(variance)
    table = np.column_stack([single[use], -toward[use]])
    total = np.bincount(group, root**2)
    mean = np.stack([np.bincount(group, root**2 * column) for column in table.T], axis=1)
    free = (table - (mean / total[:, None])[group]) * root[:, None]
    # the reference of double differences is the highest one of those without a residual
    rank = np.lexsort((phases.elevation[use], phases.residuals[use] == 0, group))
    reference = rank[np.cumsum(count) - 1][group]
    double = (single[use][reference] - single[use])[reference != np.arange(len(group))]
    return ClockFreePhases(
        phases.times[use],
        np.unique(phases.satellites[use], return_inverse=True)[1].ravel().astype(np.int64),
        free[:, 0],
        free[:, 1:],
        ((count - 1) / count)[group],
        # the sum over an epoch of the diagonal of M V M^T, with M that takes the clock out
        (1 - root**2 / total[group]) * decimals / variance,
        decimals / phase_variance(elevation),
        float(np.sqrt(np.square(double).mean())),
    )
