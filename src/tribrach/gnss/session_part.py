"""What stays alike within a session, which its pieces do not show: its sigma.

Residual troposphere, multipath of slow satellites and antennas move all pieces of a session alike,
and another session otherwise. The variance of a baseline is

    C + s^2 (I - u u^T) + t^2 u u^T

with the covariance C of its phases, the plumb line u and sigmas s of each axis in plan and t in
height. Where no baseline repeats they are those that a manufacturer states for long static
sessions, where noise is little. Baselines of several sessions tell factors f^2 on both variances:
their restricted likelihood, with ``log f`` normal around 0 with ``ln 2`` before. Method section
7.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tribrach._types import Array
from tribrach.answers import Result

#: constant [m] and share of the length, in plan (both axes together) and in height
PLAN, UP = (0.003, 0.1e-6), (0.0035, 0.4e-6)
SOURCE = "data sheet for long static sessions, Leica Viva GS25 User Manual 2.0, 6.1.2"
#: logarithms of the factors on the sigmas that are tried
_FACTORS = np.log(2.0) * np.linspace(-5, 5, 41)


@dataclass(frozen=True)
class SessionPart(Result):
    """Sigmas [m] of what stays alike within a session, of a baseline."""

    plan: float  #: of each axis in plan
    up: float  #: of the height
    source: str  #: where they come from

    @classmethod
    def usual(cls, length: float) -> SessionPart:
        """Those of a data sheet for a baseline of ``length`` [m]."""
        plan, up = (constant + share * length for constant, share in (PLAN, UP))
        return cls(float(plan / np.sqrt(2)), up, SOURCE)

    def covariance(self, place: Array) -> Array:
        """The same (3, 3) [m^2] at a place (3,) ECEF."""
        u = place / np.linalg.norm(place)
        out: Array = self.plan**2 * np.eye(3) + (self.up**2 - self.plan**2) * np.outer(u, u)
        return out


@dataclass(frozen=True)
class RepeatedBaseline:
    """One baseline of k sessions."""

    vectors: Array  #: (k, 3) [m]
    covariance: Array  #: (k, 3, 3), without what stays alike within a session [m^2]
    place: Array  #: (3,), of one end, ECEF [m]
    part: SessionPart  #: that which is taken without repetitions


def repeated(repeats: Sequence[RepeatedBaseline]) -> tuple[float, float]:
    """Factors on the sigmas in plan and in height that repeated baselines show."""
    squares = np.exp(2 * _FACTORS)
    chance = -0.5 * np.square(_FACTORS / np.log(2.0))
    score = chance[:, None] + chance[None, :]
    for one in repeats:
        plan = replace(one.part, up=0.0).covariance(one.place)
        up = replace(one.part, plan=0.0).covariance(one.place)
        added = squares[:, None, None, None] * plan + squares[None, :, None, None] * up
        each = one.covariance[:, None, None] + added
        weight = np.linalg.inv(each)
        total = weight.sum(axis=0)
        around = one.vectors - one.vectors.mean(axis=0)
        right = np.einsum("nabij,nj->abi", weight, around)
        fit = np.linalg.solve(total, right[..., None])[..., 0]
        rest = np.einsum("ni,nabij,nj->ab", around, weight, around) - (right * fit).sum(axis=-1)
        score -= 0.5 * (np.linalg.slogdet(each)[1].sum(axis=0) + np.linalg.slogdet(total)[1] + rest)
    chance = np.exp(score - score.max())
    chance /= chance.sum()
    plan_square, up_square = chance.sum(axis=1) @ squares, chance.sum(axis=0) @ squares
    return float(np.sqrt(plan_square)), float(np.sqrt(up_square))
