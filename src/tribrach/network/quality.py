"""Says how far a result can be trusted: all tests and reliability figures of one adjustment.

All are in the general form for correlated observations (method section 3.4): with ``P`` the
weights, ``P v`` the weighted residuals and ``S = P Q_vv P``,

* ``w = (P v)_i / sqrt(S_ii)``, standard normal without blunders (Baarda 1968);
* ``tau = w sigma0 / sigma0_posterior`` (Pope 1976);
* estimated gross error ``g = -(P v)_i / S_ii`` (for ``l = true + g``);
* minimal detectable bias ``delta0 / sqrt(S_ii)``;
* redundancy number ``r_i = (Q_vv P)_ii``; their sum is the redundancy.

Observations with several values (vectors, targets, relative poses, a GNSS session) are tested as
blocks as well: ``T = y^T S^+ y`` with ``y = E^T P v`` and ``S = E^T P Q_vv P E`` is chi-square with
as many degrees of freedom as the block has directions that the other observations control. The
eigenvalues of S against ``E^T P E`` are those directions' redundancies; they say which are.

A value held out (or switched off) is compared with what the network predicts for it: ``d = h(x) -
l`` has the covariance ``C + A Q A^T``; a difference beyond it tells of an error in the value or in
the network.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.network.linear import group_products
from tribrach.network.reliability import (
    WeightedResiduals,
    external_reliability,
    redundancy_numbers,
    weigh,
)
from tribrach.network.significance import (
    block_noncentrality,
    block_tau_critical,
    block_tau_significance,
    noncentrality,
    sidak,
    tau_critical,
    w_critical,
)
from tribrach.network.solved import SolvedSystem
from tribrach.observations.base import Observations, Use
from tribrach.sentences import Sentence
from tribrach.statistics import chi2, f, t

#: redundancy of a direction that counts as controlled
CONTROLLED = 1e-7
#: a test that reaches its bound must not exceed it by rounding
ROUNDED = 1 + 1e-9
#: largest joint covariance that is tested as one block
LARGEST_JOINT = 300


@dataclass(frozen=True)
class GlobalTest:
    """Chi-square test of sigma0; only its upper limit rejects, a small one is cautious."""

    vtpv: float  #: ``v^T P v``
    dof: int  #: redundancy
    alpha: float  #: outside of both limits; right networks are rejected half as often
    #: two-sided limits of ``v^T P v``
    lower: float
    upper: float

    @classmethod
    def of(cls, vtpv: float, dof: int, alpha: float = 0.05) -> GlobalTest:
        """The test of a sum of squares; without redundancy one that nothing fails."""
        if dof <= 0:
            return cls(vtpv, dof, alpha, 0.0, np.inf)
        lower, upper = (float(chi2.ppf(p, dof)) for p in (alpha / 2, 1 - alpha / 2))
        return cls(vtpv, dof, alpha, lower, upper)

    @property
    def passed(self) -> bool | None:
        """True if the test passes, None without redundancy."""
        return None if self.dof <= 0 else self.vtpv <= self.upper

    @property
    def level(self) -> float:
        """Share of right networks that pass: only the upper limit rejects."""
        return 1 - self.alpha / 2

    def sentence(self) -> str:
        """The verdict in words."""
        if self.dof <= 0:
            return "no redundancy: nothing is checked"
        limits = Sentence("{own.vtpv:2} against {own.lower:2} to {own.upper:2}", own=self)
        level = Sentence("at {level:%g} with redundancy {own.dof}", level=self.level, own=self)
        if self.vtpv > self.upper:
            return Sentence(
                "the global test fails ({limits} {level}): blunders, or sigmas too small",
                limits=limits,
                level=level,
            )
        if self.vtpv < self.lower:
            return Sentence(
                "the global test passes ({own.vtpv:2}, at most {own.upper:2} {level}); below "
                "{own.lower:2} the sigmas look too large",
                own=self,
                level=level,
            )
        return Sentence("the global test passes ({limits} {level})", limits=limits, level=level)


@dataclass(frozen=True)
class BlockTests:
    """Chi-square tests of whole observations that have several values."""

    #: (b,), the observation of each block; for a joint covariance table -1 and its number
    table: Index
    item: Index
    freedom: Index  #: (b,), degrees of freedom
    redundancy: Array  #: (b,), trace of the block's part of R
    statistic: Array  #: (b,), naN where nothing controls the block
    critical: Array  #: (b,), limit of the statistic at alpha0
    gross_error: Array  #: (b,), length of the estimated error [m]
    #: (b,), length of the longest error that may stay undetected, in any direction [m]; as
    #: ``gross_error`` NaN unless all values are lengths and all are controlled
    mdb: Array

    @property
    def rejected(self) -> NDArray[np.bool_]:
        """Blocks (b,) beyond their limit."""
        return np.nan_to_num(self.statistic) > ROUNDED * self.critical

    def scaled(self, factor: float, critical: Array) -> BlockTests:
        """The same with statistics divided by a variance factor, against other limits (b,)."""
        return replace(self, statistic=self.statistic / factor, critical=critical)

    def chosen(self, which: Index) -> BlockTests:
        """Some of the blocks, in the order of their numbers (k,)."""
        return BlockTests(**{name: getattr(self, name)[which] for name in self.__annotations__})

    @classmethod
    def join(cls, parts: list[BlockTests]) -> BlockTests:
        """Join the blocks of several sets, in their order."""
        whole = ("table", "item", "freedom")
        empty = {name: np.empty(0, dtype=np.int64) for name in whole}
        return cls(
            **{
                name: np.concatenate(
                    [empty.get(name, np.empty(0)), *(getattr(part, name) for part in parts)]
                )
                for name in cls.__dataclass_fields__
            }
        )


@dataclass(frozen=True)
class Chance:
    """Tests beyond their limits, against what chance makes of a network without blunders."""

    #: how many tests of values and blocks are beyond their limits, of how many
    beyond: int
    tests: int
    expected: float  #: how many of them would be if nothing were wrong
    significance: float  #: smallest probability of any of them
    #: what the smallest probability stays above in clean networks (Šidák 1967), with the
    #: confidence of the global test
    limit: float

    @property
    def act(self) -> bool:
        """True if the worst test is more than the worst of so many is by chance."""
        return self.beyond > 0 and self.significance < self.limit


@dataclass(frozen=True)
class Quality:
    """Tests and reliability of an adjustment; arrays (n,) are in the order of ``adjustment.rows``.

    With inner constraints the displacements belong to that datum; all other figures are the same in
    any datum.
    """

    global_test: GlobalTest  #: test of the a-priori sigma0
    redundancy: Array  #: (n,), redundancy numbers
    #: (n,), baarda's and Pope's test values
    w: Array
    tau: Array
    #: (n,), estimated error and minimal detectable bias, in the unit of the value [m, rad]
    gross_error: Array
    mdb: Array
    #: (n,), largest displacement of any position that an undetected error of size MDB causes [m]
    external: Array
    external_position: Index  #: (n,), index of that position
    #: (n,), false where only the observation's own ends were looked at (large networks)
    external_exact: NDArray[np.bool_]
    #: (P + S,), the largest of them at each position [m]; infinite where a value that nothing
    #: controls moves it, NaN in networks too large to follow every error
    external_worst: Array
    blocks: BlockTests  #: tests of whole observations with several values
    sessions: BlockTests  #: tests of the values that share a joint covariance
    checks: BlockTests  #: tests of observations held out
    #: limits of single tests
    w_critical: float
    tau_critical: float
    #: significance and power of a single test
    alpha0: float
    power: float
    confidence: float  #: of the global test, ellipses and intervals
    #: what the tests of blocks, sessions and checks were divided by; 1 a priori
    variance_factor: float
    #: true if values are judged by tau and blocks by F, False if by w and chi-square. w itself,
    #: estimated errors, minimal detectable biases and effects are a priori either way.
    posterior: bool

    @property
    def test(self) -> Array:
        """Test statistic of single values (n,): tau a posteriori, w a priori."""
        return self.tau if self.posterior else self.w

    @property
    def critical(self) -> float:
        """Limit of :attr:`test`."""
        return self.tau_critical if self.posterior else self.w_critical

    @property
    def suspicious(self) -> NDArray[np.bool_]:
        """Values (n,) whose test is beyond its limit."""
        return np.nan_to_num(np.abs(self.test)) > ROUNDED * self.critical

    @cached_property
    def chance(self) -> Chance:
        """How many tests of values and blocks are beyond their limits, and whether by chance."""
        values, blocks = self.controlled, np.isfinite(self.blocks.statistic)
        statistic = np.concatenate([self.test[values] ** 2, self.blocks.statistic[blocks]])
        freedom = np.concatenate([np.ones(int(values.sum())), self.blocks.freedom[blocks]])
        if self.posterior:
            p = block_tau_significance(statistic, freedom, self.global_test.dof)
        else:
            p = np.asarray(chi2.sf(statistic, freedom), dtype=float)
        beyond = int(self.suspicious.sum() + self.blocks.rejected.sum())
        limit = sidak(self.global_test.alpha, len(p))
        return Chance(beyond, len(p), self.alpha0 * len(p), float(p.min(initial=1.0)), limit)

    @property
    def check_critical(self) -> float:
        """Limit of values held out: of Student's t a posteriori, of the normal a priori."""
        if not self.posterior:
            return self.w_critical
        return float(t.ppf(1 - self.alpha0 / 2, self.global_test.dof))

    @property
    def controlled(self) -> NDArray[np.bool_]:
        """Values (n,) that the others control at all."""
        return np.isfinite(self.w)


def assess(
    adjustment: SolvedSystem,
    *,
    posterior: bool = False,
    alpha0: float = 0.001,
    power: float = 0.8,
    confidence: float = 0.95,
) -> Quality:
    """Compute the quality of an adjustment (method section 3.4).

    Parameters
    ----------
    adjustment
        The adjusted network.
    posterior
        Judge observations with the a-posteriori sigma0, where there is one.
    alpha0, power
        Significance and power of a single blunder test.
    confidence
        Of the global test, and of ellipses and intervals derived from it.

    Returns
    -------
    Quality
        All tests and reliability figures.
    """
    system = weigh(adjustment)
    factor, dof = adjustment.posterior_factor, adjustment.dof
    posterior = adjustment.scaled(posterior=posterior)
    blocks, sessions = block_tests(system, alpha0, power), joint_tests(system, alpha0, power)
    checks = check_tests(adjustment, alpha0)
    if posterior:
        blocks, sessions = (
            part.scaled(factor, block_tau_critical(np.maximum(part.freedom, 1), dof, alpha0))
            for part in (blocks, sessions)
        )
        quantile = f.ppf(1 - alpha0, checks.freedom, dof)
        checks = checks.scaled(factor, np.asarray(checks.freedom * quantile, dtype=float))
    mdb = system.detectable(noncentrality(alpha0, power))
    external = external_reliability(system, mdb)
    return Quality(
        global_test=global_test(adjustment, 1 - confidence),
        redundancy=redundancy_numbers(system),
        w=system.w,
        tau=system.w / np.sqrt(factor) if factor > 0 else np.full(len(system.w), np.nan),
        gross_error=system.gross_error,
        mdb=mdb,
        external=external.displacement,
        external_position=external.position,
        external_exact=external.exact,
        external_worst=external.worst,
        blocks=blocks,
        sessions=sessions,
        checks=checks,
        w_critical=w_critical(alpha0),
        tau_critical=tau_critical(adjustment.dof, alpha0),
        alpha0=alpha0,
        power=power,
        confidence=confidence,
        variance_factor=factor if posterior else 1.0,
        posterior=posterior,
    )


def global_test(adjustment: SolvedSystem, alpha: float = 0.05) -> GlobalTest:
    """Test of ``v^T P v`` against its redundancy."""
    return GlobalTest.of(adjustment.vtpv, adjustment.dof, alpha)


def block_tests(system: WeightedResiduals, alpha0: float = 0.001, power: float = 0.8) -> BlockTests:
    """Test every active observation that has several values as a whole."""
    rows = system.adjustment.rows
    parts = []
    for number, o in enumerate(system.adjustment.network.observations):
        members = np.flatnonzero(rows.table == number)
        if o.rows == 1 or len(members) == 0:
            continue
        block = members.reshape(-1, o.rows)
        table, item = np.full(len(block), number), rows.item[block[:, 0]]
        metric = set(o.units) == {"m"}
        parts.append(_tests(system, block, table, item, metric, alpha0, power))
    return BlockTests.join(parts)


def joint_tests(system: WeightedResiduals, alpha0: float = 0.001, power: float = 0.8) -> BlockTests:
    """Test the active values of each joint covariance (a GNSS session, say) as a whole."""
    adjustment = system.adjustment
    tables, joint = adjustment.network.observations, adjustment.network.joint
    active = [place[place >= 0] for place in adjustment.assembly.joint_places]
    size = np.array([len(members) for members in active], dtype=np.int64)
    metric = [
        {tables[t].units[r] for t, r in zip(one.table, one.row, strict=True)} == {"m"}
        for one in joint
    ]
    parts = []
    for m in np.unique(size[(size > 0) & (size <= LARGEST_JOINT)]):
        item = np.flatnonzero(size == m)
        block, whole = np.stack([active[k] for k in item]), np.array([metric[k] for k in item])
        parts.append(_tests(system, block, np.full(len(item), -1), item, whole, alpha0, power))
    tests = BlockTests.join(parts)
    return tests.chosen(np.argsort(tests.item, kind="stable"))


def _tests(
    system: WeightedResiduals,
    block: Index,
    table: Index,
    item: Index,
    metric: bool | NDArray[np.bool_],
    alpha0: float,
    power: float,
) -> BlockTests:
    """Tests of blocks of rows (b, m)."""
    m = block.shape[1]
    p, s = _gram(system, block)
    # S in the metric of P: eigenvalues are redundancies between 0 and 1
    inverse = np.linalg.inv(np.linalg.cholesky(p))
    unit = inverse @ s @ inverse.transpose(0, 2, 1)
    value, vector = np.linalg.eigh((unit + unit.transpose(0, 2, 1)) / 2)
    good = value > CONTROLLED
    safe = np.where(good, value, 1.0)
    along = np.einsum("bij,bi->bj", vector, np.einsum("bij,bj->bi", inverse, system.pull[block]))
    along = np.where(good, along, 0.0)
    freedom = good.sum(axis=1)
    statistic = np.where(freedom > 0, (along**2 / safe).sum(axis=1), np.nan)
    error = np.einsum("bji,bj->bi", inverse, np.einsum("bij,bj->bi", vector, along / safe))
    whole = metric & (freedom == m)
    return BlockTests(
        table=table,
        item=item,
        freedom=freedom,
        redundancy=value.sum(axis=1),
        statistic=statistic,
        critical=np.where(freedom > 0, chi2.ppf(1 - alpha0, np.maximum(freedom, 1)), np.inf),
        gross_error=np.where(whole, np.sqrt((error**2).sum(axis=1)), np.nan),
        mdb=_longest(s, whole, block_noncentrality(m, alpha0, power)),
    )


def _longest(s: Array, whole: NDArray[np.bool_], delta0: float) -> Array:
    """Longest error with ``g^T S g = delta0^2`` (b,) where the block is wholly controlled."""
    out = np.full(len(s), np.nan)
    if whole.any():
        out[whole] = delta0 / np.sqrt(np.linalg.eigvalsh(s[whole])[:, 0])
    return out


def _gram(system: WeightedResiduals, block: Index) -> tuple[Array, Array]:
    """``E^T P E`` and ``E^T P Q_vv P E`` (b, m, m) of blocks of rows (b, m)."""
    columns = sp.csc_array(system.adjustment.whitener)[:, block.ravel()]
    p = group_products(columns, columns, block.shape[1])
    return p, p - system.adjustment.cofactor.row_blocks(system.rows, block)


def check_tests(adjustment: SolvedSystem, alpha0: float = 0.001) -> BlockTests:
    """Test every observation held out as a check against what the network predicts for it."""
    parts = []
    for table, o in enumerate(adjustment.network.observations):
        items = np.flatnonzero(o.use == Use.CHECK)
        if len(items) == 0:
            continue
        unknown = np.full(len(items), np.nan)
        freedom = np.full(len(items), o.rows)
        parts.append(
            BlockTests(
                table=np.full(len(items), table),
                item=items,
                freedom=freedom,
                redundancy=unknown,
                statistic=prediction_statistics(adjustment, o, items),
                critical=np.asarray(chi2.ppf(1 - alpha0, freedom), dtype=float),
                gross_error=unknown,
                mdb=unknown,
            )
        )
    return BlockTests.join(parts)


def prediction_statistics(adjustment: SolvedSystem, o: Observations, items: Index) -> Array:
    """Test statistics ``d^T (C + A Q A^T)^-1 d`` of values held out.

    Correlations with values that took part (joint covariances) are not used.

    ``items`` (k,): those to be tested. Returns (k,): chi-square with as many degrees of freedom as
    the observation has values.
    """
    difference = o.misclosure(adjustment.state)[items]
    covariance = check_covariances(adjustment, o, items)
    # lengths and angles together: to unit diagonal first
    size = np.sqrt(np.einsum("kii->ki", covariance))
    unit = covariance / size[:, :, None] / size[:, None, :]
    d = difference / size
    statistic: Array = np.einsum("ki,ki->k", d, np.linalg.solve(unit, d[:, :, None])[:, :, 0])
    return statistic


def check_covariances(adjustment: SolvedSystem, o: Observations, items: Index) -> Array:
    """Covariances of ``h(x) - l`` for values held out: ``C + A Q A^T``.

    ``items`` (k,): those that are held out. Returns (k, rows, rows): in squares of the units of the
    values.
    """
    own = o.covariance[items]
    if len(items) == 0:
        return own
    design = sp.csc_array(design_of(adjustment, o, items).T)
    out: Array = own + adjustment.cofactor.forms(design, o.rows)
    return out


def design_of(adjustment: SolvedSystem, o: Observations, items: Index) -> sp.csr_array:
    """Derivatives (k * rows, u) of chosen observations by the free columns."""
    n, rows = len(items), o.rows
    data, line, columns = [], [], []
    for block in o.jacobian(adjustment.state):
        place = np.where(block.columns < 0, -1, adjustment.reduced[block.columns])[items]
        values = block.values[items]
        row = np.arange(n * rows).reshape(n, rows, 1)
        row, place = (np.broadcast_to(a, values.shape) for a in (row, place[:, None, :]))
        keep = place >= 0
        data.append(values[keep])
        line.append(row[keep])
        columns.append(place[keep])
    triple = (np.concatenate(data), (np.concatenate(line), np.concatenate(columns)))
    return sp.csr_array(sp.coo_array(triple, shape=(n * rows, adjustment.n_unknowns)))
