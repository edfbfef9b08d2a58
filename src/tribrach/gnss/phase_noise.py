"""How noisy the phases of a session are, and for how long they stay alike: from their residuals.

The engine weights a phase by ``sigma^2 = a^2 + (a / sin e)^2`` with a = 3 mm and takes epochs for
independent. Its residuals say how it really is. Double differences v, related to the final
coordinates and divided by their standard deviation, have the mean square ``s^2`` (1 where the
engine is right) and the correlation ``r_k`` over k epochs, pooled over all pairs of satellites. The
variance of a mean of n epochs is that which the engine states times

    s^2 f^2,        f^2 = 1 + 2 sum_k (1 - k/n) r_k

The sum ends where pairs of correlations turn negative, and pairs never grow (initial monotone
sequence, Geyer 1992, Stat. Sci. 7:473): beyond that an estimated correlation is noise. Three
coordinates are taken out of the residuals, so ``s^2`` is divided by ``1 - 3/(m n/f^2)`` with m
double differences at an epoch and n/f^2 epochs that count. Correlation from residuals: El-Rabbany
and Kleusberg (2003), J. Surv. Eng. 129; Howind, Kutterer and Heck (1999), J. Geod. 73:246. Method
section 2.7.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from tribrach._types import Array
from tribrach.geodesy.site import EllipsoidSite
from tribrach.io.gnss.solution_file import PhaseResiduals, Solution

__all__ = [
    "FEWEST",
    "DoubleDifferences",
    "PhaseNoise",
    "double_differences",
    "phase_noise",
    "phase_variance",
    "sight_lines",
    "signal_groups",
]

#: the engine's standard deviation of a phase in zenith, and of what grows towards the horizon [m]
PHASE_SIGMA = 0.003
#: fewer independent double differences than this do not show their noise
FEWEST = 10.0
#: sine of the lowest elevation
LOWEST = 0.05


@dataclass(frozen=True, eq=False)
class DoubleDifferences:
    """n double differences of phases, reference satellite minus the other.

    Attributes
    ----------
    times : (n,)
        Seconds since 1980-01-06.
    pairs : (n,)
        Number of the pair of satellites, and frequency.
    residuals : (n,)
        Observed minus computed [m].
    sigma : (n,)
        Standard deviation that the engine gives them [m].
    """

    times: Array
    pairs: NDArray[np.int64]
    residuals: Array
    sigma: Array


@dataclass(frozen=True, eq=False)
class PhaseNoise:
    """Noise of the phases of a session.

    Attributes
    ----------
    scale
        Of the phases against what the engine assumes, s.
    correlation : (k,)
        Over 1 to k epochs.
    interval
        Time between epochs [s].
    epochs
        Of the session.
    independent
        How many independent double differences tell it.
    """

    scale: float
    correlation: Array
    interval: float
    epochs: int
    independent: float

    def inflation(self, epochs: int) -> float:
        """Factor f on the standard deviation of a mean of so many epochs."""
        lags = np.arange(1, min(len(self.correlation), max(epochs - 1, 0)) + 1)
        r = self.correlation[: len(lags)]
        return float(np.sqrt(1 + 2 * np.sum((1 - lags / max(epochs, 1)) * r)))

    def factor(self, epochs: int) -> float:
        """Factor s f on the formal standard deviation of a session of so many epochs."""
        return self.scale * self.inflation(epochs)

    @property
    def duration(self) -> float:
        """Time over which phases stay alike [s]: that between two independent epochs."""
        return self.interval * self.inflation(self.epochs) ** 2

    def sentence(self) -> str:
        """What was found."""
        return (
            f"phases scatter {self.scale:.2f} times as much as the engine assumes, and one epoch "
            f"in {self.duration:.0f} s is independent"
        )


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
    """Variance [m^2] that the engine gives the difference of a phase between two receivers.

    Parameters
    ----------
    elevation : (n,)
        Of the satellite [rad].
    """
    sine = np.maximum(np.sin(elevation), LOWEST)
    variance: Array = 2 * PHASE_SIGMA**2 * (1 + 1 / sine**2)
    return variance


def signal_groups(phases: PhaseResiduals) -> NDArray[np.int64]:
    """Numbers (n,) of the groups of phases that share a reference satellite.

    One for each epoch, satellite system and frequency.
    """
    keys = [
        np.unique(column, return_inverse=True)[1].ravel().astype(np.int64)
        for column in (phases.times, phases.satellites.astype("U1"), phases.frequencies)
    ]
    number = (keys[0] * (keys[1].max() + 1) + keys[1]) * (keys[2].max() + 1) + keys[2]
    return np.unique(number, return_inverse=True)[1].ravel().astype(np.int64)


def double_differences(
    phases: PhaseResiduals,
    solution: Solution,
    chosen: NDArray[np.int64],
    place: Array | None,
    delay: Array | None = None,
) -> DoubleDifferences:
    """Double differences of some epochs, related to one place of the rover.

    Parameters
    ----------
    phases
        Residuals as the engine wrote them, each against the place of its own epoch.
    solution
        All epochs, in ECEF.
    chosen : (k,)
        Epochs of the solution.
    place : (3,)
        ECEF coordinates of the rover [m] that the residuals are to belong to; None leaves each
        with its own epoch, as it must be where ambiguities move as well.
    delay : (n,)
        That the engine computed with each phase, rover minus base, and should not have [m].
    """
    times = solution.times[chosen]
    at = np.clip(np.searchsorted(times, phases.times - 1e-3), 0, len(times) - 1)
    own = np.abs(times[at] - phases.times) < 1e-3
    toward = sight_lines(phases, solution.values[chosen[-1]] if place is None else place)
    group = signal_groups(phases)
    # the reference is the highest one, and the only one that has no residual by definition
    rank = np.lexsort((phases.elevation, phases.residuals == 0, group))
    last = np.searchsorted(group[rank], np.arange(group.max() + 1), side="right") - 1
    reference = rank[last][group]
    use = own & (reference != np.arange(len(group)))
    numbers = np.unique(phases.satellites, return_inverse=True)[1].ravel()
    keys = np.stack([numbers[reference], numbers, phases.frequencies], axis=1)
    pairs = np.unique(keys, axis=0, return_inverse=True)[1].ravel()
    variance = phase_variance(phases.elevation)
    residuals = phases.residuals
    if place is not None:
        moved = place - solution.values[chosen][at]
        residuals = residuals - np.einsum("ni,ni->n", toward - toward[reference], moved)
    if delay is not None:
        residuals = residuals + delay[reference] - delay
    return DoubleDifferences(
        phases.times[use],
        pairs[use].astype(np.int64),
        residuals[use],
        np.sqrt(variance + variance[reference])[use],
    )


def phase_noise(differences: DoubleDifferences, interval: float) -> PhaseNoise | None:
    """Noise and correlation of double differences.

    Parameters
    ----------
    differences
        Of one session.
    interval
        Time between its epochs [s].

    Returns
    -------
    PhaseNoise or None
        None where too few of them are independent.
    """
    n = len(differences.residuals)
    if n < FEWEST or interval <= 0:
        return None
    u = differences.residuals / differences.sigma
    step = np.rint((differences.times - differences.times.min()) / interval).astype(np.int64)
    epochs = int(step.max()) + 1
    products, counts = np.zeros(epochs), np.zeros(epochs)
    order = np.argsort(differences.pairs, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(differences.pairs[order])) + 1):
        first = step[rows].min()
        length = int(step[rows].max() - first) + 1
        series, there = np.zeros(length), np.zeros(length)
        series[step[rows] - first], there[step[rows] - first] = u[rows], 1.0
        products[:length] += _lagged(series)
        counts[:length] += np.rint(_lagged(there))
    power = products[0] / counts[0]
    if not power > 0:
        return None
    with np.errstate(invalid="ignore", divide="ignore"):
        r = np.where(counts > 0, products / np.maximum(counts, 1) / power, 0.0)
    noise = PhaseNoise(1.0, _initial_monotone(r), interval, epochs, float(n))
    independent = n / noise.inflation(epochs) ** 2
    if independent < FEWEST:
        return None
    scale = float(np.sqrt(power / (1 - 3 / independent)))
    return PhaseNoise(scale, noise.correlation, interval, epochs, independent)


def _lagged(values: Array) -> Array:
    """Sums (n,) of the products of values (n,) with those 0, 1, ... places later."""
    size = fft.next_fast_len(2 * len(values) - 1, real=True)
    products: Array = fft.irfft(np.abs(fft.rfft(values, size)) ** 2, size)
    return products[: len(values)]


def _initial_monotone(r: Array) -> Array:
    """Correlations from lag 1 on (k,) up to where pairs, made to fall, turn negative (Geyer 1992).

    Parameters
    ----------
    r : (n,)
        Estimated correlations from lag 0 on.
    """
    pairs = r[: len(r) // 2 * 2].reshape(-1, 2).sum(axis=1)
    negative = np.flatnonzero(pairs <= 0)
    end = int(negative[0]) if len(negative) else len(pairs)
    if end == 0:
        return np.zeros(0)
    kept = pairs[:end]
    lower = np.minimum.accumulate(kept)
    shrunk: Array = (r[: 2 * end].reshape(-1, 2) * (lower / kept)[:, None]).ravel()
    return shrunk[1:]
