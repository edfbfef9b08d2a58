"""Systematic errors of scanners, tested in every network as alternatives.

A zero and a scale of the ranges, the index of the vertical circle, the collimation and a
coefficient of refraction are biases that all readings share. None is an unknown of an ordinary run;
each is tested by what it would explain of the residuals (method section 4.2), against what single
observations explain. What is significant is named with its size, and snooping looks at the network
without it, so that it takes no symptom for a blunder. Metres, radians.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tribrach._types import Array
from tribrach.calibration.extra_columns import unexplained
from tribrach.errors import TribrachError
from tribrach.geometry.polar import polar_from_xyz, xyz_by_polar
from tribrach.instruments.calibration import NIST, meaning_of
from tribrach.instruments.common_errors import COMMON, RANGE_SCALE, REFRACTION
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.blunders.control_mistakes import WrongList
from tribrach.network.blunders.rivals import ALIKE
from tribrach.network.blunders.snooping import restart
from tribrach.network.blunders.suspects import find_suspects
from tribrach.network.network import Network
from tribrach.network.reliability import weigh
from tribrach.network.significance import log_significance, sidak
from tribrach.observations.base import Observations
from tribrach.observations.scanner import ScannerPolar, TargetCentres
from tribrach.observations.unknowns import State
from tribrach.sentences import Sentence, joined
from tribrach.statistics import chi2, f

#: significance of all tests of a network together
_ALPHA = 0.005
#: share of a column that must be left beside the unknowns
_SEEN = 1e-4
#: beyond these no instrument is wrong and no air bends: zero [m], scale, angles [rad], coefficient
_MOST = {"x10": 0.1, RANGE_SCALE: 0.01, "x4": 0.003, "x6": 0.003, REFRACTION: 10.0}
_MODEL = NIST.select(["x10", "x4", "x6"]).joined(COMMON.select([RANGE_SCALE, REFRACTION]))
#: how each is said
_SAID = {
    "x10": "ranges are {size:mm2~} ± {sigma:mm2} too {side}",
    RANGE_SCALE: "ranges are {size:ppm1~} ± {sigma:ppm1} too {side}",
    "x4": "the index of the vertical circle is {size:arcsec1~} ± {sigma:arcsec1} off",
    "x6": "the collimation is {size:arcsec1~} ± {sigma:arcsec1} off",
    REFRACTION: "the coefficient of refraction is {size:2~} ± {sigma:2} beside the one in use",
}


@dataclass(frozen=True)
class SystematicError:
    """One error that all readings of the scanners share."""

    name: str  #: parameter of a calibration, or the name of a common error
    #: true less measured: what has to be added [m, rad or 1], and its sigma
    value: float
    sigma: float

    @property
    def meaning(self) -> str:
        """Its meaning in words."""
        return self.name if self.name in COMMON.parameters else meaning_of(self.name)

    def sentence(self) -> str:
        """It with its size."""
        side = "short" if self.value > 0 else "long"
        return Sentence(_SAID[self.name], size=abs(self.value), sigma=self.sigma, side=side)


@dataclass(frozen=True)
class SystematicErrors(WrongList):
    """Errors that all readings of the scanners of a network share."""

    errors: tuple[SystematicError, ...] = ()


def systematic_errors(adjustment: Adjustment) -> SystematicErrors | None:
    """Find systematic errors of the scanners that explain more than any single observation."""
    tables = adjustment.network.observations
    if adjustment.dof < 2 or not any(_readings(o) for o in tables):
        return None
    raw = _columns(adjustment.network, adjustment.state, adjustment)
    white = np.asarray(adjustment.whitener @ raw)
    rest = unexplained(adjustment.design, adjustment.cofactor, white)
    length = np.linalg.norm(white, axis=0)
    able = [
        k
        for k in range(len(_MODEL.parameters))
        if np.linalg.norm(rest[:, k]) > _SEEN * max(float(length[k]), 1e-300)
    ]
    residual = -adjustment.whitened_residuals
    suspects = [s.log_p for s in find_suspects(weigh(adjustment))]
    level = sidak(_ALPHA, max(len(able), 1))
    chosen = list[int]()
    while len(chosen) < len(able):
        basis = _basis(rest[:, chosen])
        left = residual - basis @ (basis.T @ residual)
        gains = {}
        for k in set(able) - set(chosen):
            own = rest[:, k] - basis @ (basis.T @ rest[:, k])
            size = float(own @ own)
            if size > _SEEN**2 * float(length[k]) ** 2:
                gains[k] = float(own @ left) ** 2 / size, float(own @ left) / size
        within = {k: g for k, (g, v) in gains.items() if abs(v) < _MOST[_MODEL.parameters[k]]}
        if not within:
            break
        best = max(within, key=lambda k: within[k])
        if not _significant(adjustment, float(left @ left), within[best], len(chosen), level):
            break
        if (
            not chosen
            and suspects
            and _score(left, adjustment, within[best]) > min(suspects) + ALIKE
        ):
            return None
        chosen.append(best)
    return _named(adjustment, chosen, raw, rest, residual) if chosen else None


def _significant(
    adjustment: Adjustment, square: float, gain: float, more: int, level: float
) -> bool:
    """True if a gain is significant, a priori and against the remaining residuals."""
    if not float(chi2.sf(gain, 1)) < level:
        return False
    dof = adjustment.dof - more - 1
    if dof < 1:
        return False
    unit = (square - gain) / dof
    return unit <= 1 or float(f.sf(gain / unit, 1, dof)) < level


def _score(left: Array, adjustment: Adjustment, gain: float) -> float:
    """Logarithm of the significance of a gain."""
    unit = max(1.0, (float(left @ left) - gain) / max(adjustment.dof - 1, 1))
    return float(log_significance(gain / unit, 1))


def _named(
    adjustment: Adjustment, chosen: list[int], raw: Array, rest: Array, residual: Array
) -> SystematicErrors | None:
    """The chosen errors, estimated together, and the network without them."""
    part = rest[:, chosen]
    inverse = np.linalg.inv(part.T @ part)
    values = inverse @ (part.T @ residual)
    sigmas = np.sqrt(np.diag(inverse))
    errors = tuple(
        SystematicError(_MODEL.parameters[k], float(v), float(s))
        for k, v, s in zip(chosen, values, sigmas, strict=True)
    )
    shift = np.zeros(len(_MODEL.parameters))
    shift[chosen] = values
    try:
        begun = restart(adjustment.network, adjustment)
        after = adjust(_corrected(begun, adjustment.state, shift))
    except TribrachError:
        return None
    gain = float(values @ (part.T @ residual))
    words = Sentence(
        "all scanner readings share a systematic error: {errors} (test {gain:1}, chi-square of "
        "{count}; sigma0 is {with_:2} with it and {without:2} without it); points and clouds have "
        "it too, and their sigmas do not: calibrate the scanner (tribrach calibrate), or give the "
        "correction with the instrument",
        errors=joined(" and ", [e.sentence() for e in errors]),
        gain=gain,
        count=len(errors),
        with_=adjustment.sigma0_posterior,
        without=after.sigma0_posterior,
    )
    short = " and ".join(e.meaning for e in errors) + " of the scanners"
    limit = float(chi2.ppf(1 - _ALPHA, len(errors)))
    return SystematicErrors(
        words,
        short,
        adjustment,
        after,
        statistic=gain,
        limit=limit,
        freedom=len(errors),
        errors=errors,
    )


def _readings(o: Observations) -> bool:
    """True for readings of scanners without a calibration of their own."""
    return isinstance(o, TargetCentres) or (isinstance(o, ScannerPolar) and o.model is None)


def _of_table(o: Observations, state: State) -> Array:
    """Derivatives (n, rows, k) of the readings of a table by the errors."""
    if isinstance(o, ScannerPolar):
        return o.parameter_columns(state, _MODEL)
    polar = polar_from_xyz(o.predict(state))
    r, h, v = polar.T
    out: Array = -xyz_by_polar(polar) @ _MODEL.columns(r, h, v, np.ones(len(o)))
    return out


def _columns(network: Network, state: State, adjustment: Adjustment) -> Array:
    """Derivatives (n, k) of all active observations by the errors."""
    out = np.zeros((adjustment.n_observations, len(_MODEL.parameters)))
    first = 0
    for o, items in zip(network.observations, adjustment.assembly.active, strict=True):
        rows = len(items) * o.rows
        if rows and _readings(o):
            out[first : first + rows] = _of_table(o, state)[items].reshape(rows, -1)
        first += rows
    return out


def _corrected(network: Network, state: State, values: Array) -> Network:
    """The network with its scanner readings corrected."""
    tables = tuple(
        replace(o, values=o.values - _of_table(o, state) @ values) if _readings(o) else o
        for o in network.observations
    )
    return replace(network, observations=tables)


def _basis(columns: Array) -> Array:
    """An orthonormal basis (n, k) of columns."""
    if not columns.shape[1]:
        return columns
    scale = np.linalg.norm(columns, axis=0)
    out: Array = np.linalg.qr(columns / np.where(scale > 0, scale, 1.0))[0]
    return out
