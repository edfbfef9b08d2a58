"""How far can the result be trusted? All figures of one adjustment together.

All are in the general form for correlated observations (method section 3.4): with ``P`` the
weights, ``P v`` the weighted residuals and ``S = P Q_vv P``,

* ``w = (P v)_i / sqrt(S_ii)``, standard normal without blunders (Baarda 1968);
* ``tau = w sigma0 / sigma0_posterior`` (Pope 1976);
* estimated gross error ``g = -(P v)_i / S_ii`` (for ``l = true + g``);
* minimal detectable bias ``delta0 / sqrt(S_ii)``;
* redundancy number ``r_i = (Q_vv P)_ii``; their sum is the redundancy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach.distributions import chi2
from tribrach.network.adjustment import Adjustment
from tribrach.network.blocks import BlockTests, block_tests, joint_tests
from tribrach.network.checks import check_tests
from tribrach.network.reliability import external_reliability, redundancy_numbers, weigh
from tribrach.network.significance import noncentrality, sidak, tau_critical, w_critical

__all__ = ["GlobalTest", "Quality", "assess", "global_test"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class GlobalTest:
    """Chi-square test of the a-priori sigma0.

    lower and upper are the two-sided limits of ``v^T P v``; only exceeding the upper one rejects,
    since a too small value means cautious sigmas and no blunder.
    """

    vtpv: float
    dof: int
    alpha: float
    lower: float
    upper: float

    @property
    def passed(self) -> bool | None:
        """None without redundancy."""
        return None if self.dof <= 0 else self.vtpv <= self.upper

    def sentence(self) -> str:
        """The verdict in words."""
        if self.dof <= 0:
            return "no redundancy: nothing is checked"
        limits = f"{self.vtpv:.2f} against {self.lower:.2f} to {self.upper:.2f}"
        level = f"at {100 * (1 - self.alpha):g} % with redundancy {self.dof}"
        if self.vtpv > self.upper:
            return f"the global test fails ({limits} {level}): blunders, or sigmas too small"
        if self.vtpv < self.lower:
            return f"the global test passes ({limits} {level}); the sigmas look too large"
        return f"the global test passes ({limits} {level})"


@dataclass(frozen=True)
class Quality:
    """Quality figures; arrays (n,) are in the order of ``adjustment.rows``.

    mdb and gross_error are in the unit of the value (metres or radians); external (n,) is the
    largest displacement [m] of any position that an undetected error of size MDB causes,
    external_position (n,) the position index where; ``external_exact`` (n,) is False where only
    the observation's own ends were looked at (large networks). With inner constraints the
    displacements belong to that datum; all other figures are the same in any datum.

    blocks, sessions, checks : tests of whole observations with several values, of the values that
    share a joint covariance, of observations held out.
    """

    global_test: GlobalTest
    redundancy: Array
    w: Array
    tau: Array
    gross_error: Array
    mdb: Array
    external: Array
    external_position: Index
    external_exact: NDArray[np.bool_]
    blocks: BlockTests
    sessions: BlockTests
    checks: BlockTests
    w_critical: float
    tau_critical: float
    alpha0: float
    power: float
    confidence: float

    @property
    def controlled(self) -> NDArray[np.bool_]:
        """Values (n,) that the others control at all."""
        return np.isfinite(self.w)

    @property
    def w_critical_of_all(self) -> float:
        """Limit of w so that all tests together have the significance of the global test."""
        return w_critical(sidak(self.global_test.alpha, int(self.controlled.sum())))


def assess(
    adjustment: Adjustment,
    *,
    alpha: float = 0.05,
    alpha0: float = 0.001,
    power: float = 0.8,
    confidence: float = 0.95,
) -> Quality:
    """Quality of an adjustment.

    alpha : significance of the global test; alpha0, power : of the single blunder test;
    confidence : of ellipses and intervals derived from it.
    """
    system = weigh(adjustment)
    factor = adjustment.posterior_factor
    mdb = system.detectable(noncentrality(alpha0, power))
    external = external_reliability(system, mdb)
    return Quality(
        global_test=global_test(adjustment, alpha),
        redundancy=redundancy_numbers(system),
        w=system.w,
        tau=system.w / np.sqrt(factor) if factor > 0 else np.full(len(system.w), np.nan),
        gross_error=system.gross_error,
        mdb=mdb,
        external=external.displacement,
        external_position=external.position,
        external_exact=external.exact,
        blocks=block_tests(system, alpha0, power),
        sessions=joint_tests(system, alpha0, power),
        checks=check_tests(adjustment, alpha0),
        w_critical=w_critical(alpha0),
        tau_critical=tau_critical(adjustment.dof, alpha0),
        alpha0=alpha0,
        power=power,
        confidence=confidence,
    )


def global_test(adjustment: Adjustment, alpha: float = 0.05) -> GlobalTest:
    """Test of ``v^T P v`` against its redundancy."""
    dof = adjustment.dof
    if dof <= 0:
        return GlobalTest(adjustment.vtpv, dof, alpha, 0.0, np.inf)
    lower, upper = (float(chi2.ppf(p, dof)) for p in (alpha / 2, 1 - alpha / 2))
    return GlobalTest(adjustment.vtpv, dof, alpha, lower, upper)
