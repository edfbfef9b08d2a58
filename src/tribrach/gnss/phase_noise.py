"""How noisy the phases of a session are, and for how long they stay alike: from their residuals.

The engine weights a phase by ``sigma^2 = a^2 + (a / sin e)^2`` with a = 3 mm and takes epochs for
independent. Phases are made of three parts instead: noise of the receiver, new at every epoch;
multipath and turbulence, alike for a time T of seconds to minutes; and what stays for some twenty
minutes. Over a time t the correlation of a phase is

    r(t) = a [t = 0] + b exp(-t/T) + c exp(-t/1200 s),        a + b + c = 1

The restricted likelihood of a session's phases, from which clocks and three coordinates are taken
out, weights all laws (a, b, c, T) of a grid, each with its best variance; what is stated is the
mean over the laws. A long session tells its law, a short one leaves many possible, and they count
with what they would do to its coordinates. Sources: Patterson and Thompson (1971), Biometrika 58;
El-Rabbany and Kleusberg (2003), J. Surv. Eng. 129; Howind, Kutterer and Heck (1999), J. Geod.
73:246. Method section 7.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from tribrach._types import Array
from tribrach.answers import Result
from tribrach.gnss.fixed_phases import ClockFreePhases
from tribrach.instruments.gnss_solutions import CORRELATION_TIME
from tribrach.sentences import Sentence

#: fewer degrees of freedom than this do not show their noise
FEWEST = 10.0
#: the noise that the engine assumes counts as much as so many independent phases
ASSUMED = 5.0
#: shortest and longest time over which multipath and turbulence stay alike, and steps between [s]
SHORTEST, LONGEST, STEPS = 15.0, 600.0, 7
#: the slow part stays alike so long [s]
SLOW = 1200.0
#: shares are the Chebyshev nodes of so many, which are dense where one part is all or nothing
SHARES = 10
#: more rows than this are thinned by leaving out epochs
ROWS = 5000
#: a law that is less likely than this against the best takes no part
UNLIKELY = 1e-6


@dataclass(frozen=True, eq=False)
class PhaseNoise(
    Result,
    also=("scale", "duration"),
    without=("weights", "variance", "shares", "times", "interval", "epochs", "learned"),
    keys={"duration": "independent_after_s"},
):
    """Noise of the phases of a session, as g laws with their weights."""

    weights: Array  #: (g,) of the laws, sum 1
    variance: Array  #: (g,) of one phase against what the engine assumes
    #: (g, 3) of it: new at every epoch, alike over the first time, alike over the second
    shares: Array
    times: Array  #: (g, 2) over which the second and third part stay alike [s]
    interval: float  #: time between epochs [s]
    epochs: int  #: of the session
    #: false where the law is the usual one, and only its variance is the session's
    learned: bool = True

    def means(self, starts: Sequence[int], counts: Sequence[int]) -> Array:
        """Covariance (k, k) of means over spans of epochs, in the engine's variances."""
        q = np.exp(-self.interval / self.times)
        part = self.shares[:, 1:]
        weight = self.weights * self.variance
        out = np.zeros((len(starts), len(starts)))
        for i, (start, n) in enumerate(zip(starts, counts, strict=True)):
            own = (1 + q) / (1 - q) - 2 * q * (1 - q**n) / (n * (1 - q) ** 2)
            out[i, i] = weight @ (self.shares[:, 0] + (part * own).sum(axis=1)) / n
            for j in range(i + 1, len(starts)):
                m = counts[j]
                apart = max(starts[j] - start - n, 0) + 1
                shared = q**apart * (1 - q**n) * (1 - q**m) / (1 - q) ** 2 / (n * m)
                out[i, j] = out[j, i] = weight @ (part * shared).sum(axis=1)
        return out

    def alike(self, starts: Sequence[int], counts: Sequence[int]) -> Array:
        """Correlation (k, k) of means over spans of epochs; parameters as those of ``means``."""
        covariance = self.means(starts, counts)
        root = np.sqrt(np.diag(covariance))
        out: Array = covariance / np.outer(root, root)
        return out

    def factor(self, epochs: int) -> float:
        """Factor on the formal standard deviation of a session of so many epochs."""
        return float(np.sqrt(max(epochs, 1) * self.means([0], [max(epochs, 1)])[0, 0]))

    @property
    def scale(self) -> float:
        """Standard deviation of the phases against what the engine assumes."""
        return float(np.sqrt(self.weights @ self.variance))

    @property
    def duration(self) -> float:
        """Time over which phases stay alike [s]: that between two independent epochs."""
        return self.interval * (self.factor(self.epochs) / self.scale) ** 2

    def sentence(self) -> str:
        """The estimated noise in a sentence."""
        words = Sentence(
            "phases scatter {own.scale:2} times as much as the engine assumes, and one "
            "epoch in {own.duration:0} s is independent",
            own=self,
        )
        if not self.learned:
            return Sentence(
                "{words} (float ambiguities take up what stays alike, so that the usual "
                "{CORRELATION_TIME:0} s are taken)",
                words=words,
                CORRELATION_TIME=CORRELATION_TIME,
            )
        weight = self.weights * self.variance
        white, fast, slow = 100 * (weight @ self.shares) / weight.sum()
        part = weight * self.shares[:, 1]
        time = np.exp(part @ np.log(self.times[:, 0]) / part.sum())
        return Sentence(
            "{words} ({white:0} % of the variance are new at every epoch, {fast:0} % stay "
            "alike over {time:0} s, {slow:0} % over {SLOW:0} s)",
            words=words,
            white=white,
            fast=fast,
            time=time,
            slow=slow,
            SLOW=SLOW,
        )


@cache
def _laws() -> tuple[Array, Array]:
    """Shares (g, 3) and times (g, 2) [s] of all laws; each is as probable as any other before."""
    nodes = np.sin(np.pi * (np.arange(SHARES) + 0.5) / (2 * SHARES)) ** 2
    times = np.geomspace(SHORTEST, LONGEST, STEPS)
    slow, new, fast = (a.ravel() for a in np.meshgrid(nodes, nodes, times, indexing="ij"))
    shares = np.stack([new * (1 - slow), (1 - new) * (1 - slow), slow], axis=1)
    return shares, np.stack([fast, np.full(len(fast), SLOW)], axis=1)


def phase_noise(
    phases: ClockFreePhases, interval: float, epochs: int, *, assumed: float = ASSUMED
) -> PhaseNoise | None:
    """Noise of phases with integer ambiguities, epochs each ``interval`` [s]; None if too few."""
    time, table, satellite, freedom = phases.over_frequencies()
    if interval <= 0:
        return None
    step = np.rint((time - time.min()) / interval).astype(np.int64)
    thin = step % -(-len(step) // ROWS) == 0
    step, table, satellite, freedom = step[thin], table[thin], satellite[thin], freedom[thin]
    dof = float(freedom.sum()) - 3
    if dof < FEWEST:
        return None
    shares, times = _laws()
    squares, determinant = _filtered(table, satellite, step, freedom, shares, times, interval)
    design = squares[:, 1:, 1:]
    cross = squares[:, 1:, 0]
    fit = np.einsum("gi,gi->g", cross, np.linalg.solve(design, cross[..., None])[..., 0])
    rest = assumed + np.maximum(squares[:, 0, 0] - fit, 0.0)
    if not rest.min() > 0:
        return None
    likelihood = -0.5 * (
        determinant + np.linalg.slogdet(design)[1] + (assumed + dof) * np.log(rest)
    )
    weight = np.exp(likelihood - likelihood.max())
    keep = weight > UNLIKELY
    return PhaseNoise(
        weight[keep] / weight[keep].sum(),
        # mean of the inverse gamma distribution: what few phases tell is uncertain upwards
        rest[keep] / (assumed + dof - 2),
        shares[keep],
        times[keep],
        interval,
        epochs,
    )


def _filtered(
    table: Array,
    satellite: Array,
    step: Array,
    freedom: Array,
    shares: Array,
    times: Array,
    interval: float,
) -> tuple[Array, Array]:
    """``Y^T R^-1 Y`` (g, c, c) and ``log |R|`` (g,) for g laws, by a Kalman filter of two states.

    ``table`` (n, c): y, ascending in time for each satellite; satellites are independent;
    ``satellite``, ``step``, ``freedom`` (n,): satellite, number of the epoch, weight in the
    determinant; ``shares``, ``times`` (g, 3): the laws; ``interval``: of the epochs [s].
    """
    white, first, second = shares.T
    columns = table.shape[1]
    upper = np.triu_indices(columns)
    total = np.zeros((len(shares), len(upper[0])))
    determinant = np.zeros(len(shares))
    rate = np.exp(-interval / times)
    decays: dict[int, tuple[Array, Array]] = {}
    state = np.zeros((2, len(shares), columns))
    a, b, c = first, second, np.zeros(len(shares))
    for row in range(len(table)):
        if row == 0 or satellite[row] != satellite[row - 1]:
            state[:] = 0
            a, b, c = first, second, np.zeros(len(shares))
        else:
            gap = int(step[row] - step[row - 1])
            if gap not in decays:
                u, v = (rate**gap).T
                decays[gap] = (u, v)
            u, v = decays[gap]
            state[0] *= u[:, None]
            state[1] *= v[:, None]
            a, b, c = first + u * u * (a - first), second + v * v * (b - second), u * v * c
        one, two = a + c, b + c
        variance = one + two + white
        news = table[row] - state[0] - state[1]
        state[0] += (one / variance)[:, None] * news
        state[1] += (two / variance)[:, None] * news
        a, b, c = a - one * one / variance, b - two * two / variance, c - one * two / variance
        determinant += freedom[row] * np.log(variance)
        total += news[:, upper[0]] * news[:, upper[1]] / variance[:, None]
    squares = np.zeros((len(shares), columns, columns))
    squares[:, upper[0], upper[1]] = total
    squares[:, upper[1], upper[0]] = total
    return squares, determinant


def usual_noise(phases: ClockFreePhases, interval: float, epochs: int) -> PhaseNoise | None:
    """Noise of phases whose ambiguities are float: their variance with the usual correlation.

    Float ambiguities take up whatever stays alike, and residuals do not show it. With few
    independent ones the variance is at least what the engine assumes.

    ``interval``: time between its epochs [s].
    """
    _, table, _, freedom = phases.over_frequencies()
    total = float(freedom.sum())
    if total < FEWEST or interval <= 0:
        return None
    power = float(np.square(table[:, 0]).sum()) / total
    usual = PhaseNoise(
        np.ones(1),
        np.ones(1),
        np.array([[0.0, 0.0, 1.0]]),
        np.array([[CORRELATION_TIME, CORRELATION_TIME]]),
        interval,
        epochs,
        learned=False,
    )
    count = total / usual.factor(epochs) ** 2
    enough = count >= FEWEST
    variance = (ASSUMED + count * power) / (ASSUMED + count) if enough else max(power, 1.0)
    return PhaseNoise(
        usual.weights, np.array([variance]), usual.shares, usual.times, interval, epochs, False
    )
