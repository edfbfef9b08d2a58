"""Calibrates scanners from the observations of a network: what can be estimated, estimates, tests.

Estimability comes first: where unknowns are open nothing is inverted; the sentences say which,
which parameters can be estimated all the same, and what would separate the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tribrach._types import Array
from tribrach.answers import Matrix, Number, PoseEstimate, Result
from tribrach.calibration.correlations import (
    CorrelatedPair,
    Correlations,
    calibration_correlations,
)
from tribrach.calibration.datum_effects import DatumSigmas, datum_effects
from tribrach.calibration.estimability import (
    Estimability,
    EstimableSet,
    Left,
    estimability,
    parameter_columns_of,
    propose,
)
from tribrach.calibration.minimum_norm import adjust_minimum_norm
from tribrach.calibration.remedies import Remedy, remedies
from tribrach.calibration.significance import (
    BlockTest,
    Omitted,
    block_test,
    omitted_parameters,
    station_test,
)
from tribrach.errors import AdjustmentError, InputError, RankDefect
from tribrach.instruments.calibration import NIST, CalibrationModel, meaning_of, unit_of
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.blunders.snooping import SnoopingLog, snoop
from tribrach.network.linear import SingularMatrix
from tribrach.network.network import Network
from tribrach.network.start.start_values import find_start
from tribrach.observations.base import Use
from tribrach.observations.scanner import ScannerPolar
from tribrach.observations.unknowns import State
from tribrach.sentences import Sentence
from tribrach.statistics import f


@dataclass(frozen=True)
class CalibrationOptions:
    """Options of a calibration."""

    near: float = 0.95  #: correlation above which two parameters are hardly separated
    limit_t: float = 3.29  #: smallest t of a significant parameter
    posterior: bool = False  #: are sigmas scaled with the sigma0 that the residuals give?
    minimum_norm: bool = False  #: is what is open closed by the smallest solution?
    reduce: bool = False  #: are parameters left out that cannot be separated?
    back: bool = True  #: has the scanner a back face?
    snoop: bool = False  #: are blunders searched for?
    #: significance of the tests of parameters that are no unknowns, all together
    alpha: float = 0.05


@dataclass(frozen=True)
class Parameter(Result, also=("meaning", "t")):
    """An estimated calibration parameter: true = measured + correction."""

    name: str  #: such as ``x10(scanner)``: parameter, and instrument or station that it belongs to
    #: ``m``, ``rad`` or ``1``
    unit: str
    value: Number
    sigma: Number
    significant: bool  #: true if t is beyond its limit

    @property
    def plain(self) -> str:
        """The name that the model has for it."""
        return self.name.split("(")[0]

    @property
    def owner(self) -> str:
        """The instrument or station that it belongs to."""
        return self.name[len(self.plain) + 1 : -1]

    @property
    def meaning(self) -> str:
        """Its meaning, such as ``collimation axis error``."""
        return meaning_of(self.plain)

    @property
    def t(self) -> Number:
        """Value over sigma."""
        return self.value / self.sigma if self.sigma > 0 else float("nan")


@dataclass(frozen=True)
class PolarReadings:
    """Polar observations that took part."""

    polar: Array  #: measured r, H, V (n, 3) [m, rad], folded to the front
    #: residuals (n, 3) [m, rad], and of the same network without parameters, if it can be adjusted
    after: Array
    before: Array | None


@dataclass(frozen=True)
class Tests(Result):
    """Tests of the parameters and of the model."""

    together: BlockTest  #: all parameters against zero
    gain: BlockTest | None  #: how much the sum of squares falls with the parameters
    stations_differ: BlockTest | None  #: stations of one instrument against each other
    omitted: tuple[Omitted, ...]  #: parameters that are no unknowns

    #: a class of the program, not of its tests
    __test__ = False


@dataclass(frozen=True)
class Sigma0(Result):
    """Sigma of unit weight and redundancy."""

    prior: Number
    posterior: Number
    dof: int
    vtpv: Number


@dataclass(frozen=True)
class Counts(Result):
    """Sizes of the adjustment."""

    observed: int
    unknowns: int
    constraints: int
    defect: int


@dataclass(frozen=True)
class SelfCalibration(
    Result,
    without=(
        "adjustment", "estimability", "proposal", "rho", "readings", "factor", "dropped", "log",
        "limit_t",
    ),
    also=(
        "datum", "sigma0", "counts", "covariance", "stations", "open", "closed_by_datum",
        "left_out", "hardly_separated", "proposed", "correlations",
    ),
):  # fmt: skip
    """A finished calibration: estimates, their tests, and what the network could not separate."""

    adjustment: Adjustment  #: the network with parameters
    parameters: tuple[Parameter, ...]  #: estimates in the order of the network
    #: what was open to begin with, and parameters that the network can separate
    estimability: Estimability
    proposal: EstimableSet
    #: what further observations would give
    remedies: tuple[Remedy, ...]
    tests: Tests
    rho: Correlations  #: correlations of the parameters with each other, orientations and points
    datums: tuple[DatumSigmas, ...]  #: sigmas in several datums; empty for a minimum norm
    readings: PolarReadings  #: polar observations with residuals
    factor: float  #: variance that sigmas are scaled with
    sigma_origin: str  #: where the factor comes from, in words
    dropped: tuple[str, ...]  #: names of parameters that were left out
    log: SnoopingLog | None  #: blunders, None if none were searched for
    limit_t: float = 3.29  #: smallest t of a significant parameter

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(p.name for p in self.parameters)

    @property
    def datum(self) -> str:
        """The datum in words."""
        datum = self.adjustment.network.datum
        names = ", ".join(datum.names[:6]) + (" and more" if len(datum.names) > 6 else "")
        if self.adjustment.warnings and self.datums == ():
            return "minimum norm over metres and radians"
        if datum.kind == "free":
            return f"inner constraints over {names or 'all points'}"
        return f"{names} held" if datum.kind == "fixed" else "control as given"

    @property
    def sigma0(self) -> Sigma0:
        """Sigma of unit weight and redundancy."""
        a = self.adjustment
        return Sigma0(a.sigma0, a.sigma0_posterior, a.dof, a.vtpv)

    @property
    def counts(self) -> Counts:
        """Sizes of the adjustment."""
        a = self.adjustment
        return Counts(a.n_observations, a.n_unknowns, a.n_constraints, a.defect)

    @property
    def covariance(self) -> Matrix:
        """Covariance of the parameters, scaled like their sigmas."""
        columns = np.concatenate([self.adjustment.columns(name) for name in self.names])
        return self.factor * self.adjustment.covariance_columns(columns, columns)

    @property
    def stations(self) -> dict[str, PoseEstimate]:
        """Poses with their covariance."""
        a = self.adjustment
        frames = np.tile(np.eye(4), (a.layout.count("pose"), 1, 1))
        frames[:, :3, :3], frames[:, :3, 3] = a.state.pose_r, a.state.pose_t
        poses = map(PoseEstimate, frames, self.factor * a.family_covariances("pose"))
        return dict(zip(a.layout.names["pose"], poses, strict=True))

    @property
    def open(self) -> tuple[str, ...]:
        """Combinations that neither the observations nor the datum determine, in sentences."""
        return self.estimability.open

    @property
    def closed_by_datum(self) -> tuple[str, ...]:
        """Motions of the network as a whole that inner constraints close, in words."""
        return self.estimability.datum

    @property
    def left_out(self) -> tuple[Left, ...]:
        """Parameters that cannot be separated."""
        return self.proposal.left

    @property
    def hardly_separated(self) -> tuple[Left, ...]:
        """Parameters that can be separated, but only just."""
        return self.proposal.hardly

    @property
    def correlations(self) -> tuple[CorrelatedPair, ...]:
        """Strong ones of parameters with each other and with orientations, the strongest first."""
        return self.rho.pairs

    @property
    def proposed(self) -> tuple[str, ...]:
        """Parameters that are worth keeping, by elimination.

        What is hardly separated goes first, then the least significant one after the other, each
        time with the others as they are without it, until all are significant: of two that share
        an effect one stays. A minimum norm proposes nothing.
        """
        if not self.datums:
            return ()
        hardly = {item.name for item in self.proposal.hardly}
        values = np.array([p.value for p in self.parameters])
        return _eliminated(self.names, values, self.covariance, hardly, self.limit_t)


def calibration_names(network: Network) -> tuple[str, ...]:
    """Names of the free calibration unknowns of a network, in its order."""
    layout = network.start.layout
    used: set[int] = set()
    for o in network.observations:
        if isinstance(o, ScannerPolar):
            used |= set(np.unique(o.parameters).tolist())
    free = network.free[layout.columns("scalar", np.arange(layout.count("scalar")))[:, 0]]
    names = layout.names["scalar"]
    return tuple(names[i] for i in sorted(used) if i >= 0 and free[i])


def calibrate(
    network: Network,
    options: CalibrationOptions | None = None,
    models: Sequence[CalibrationModel] = (NIST,),
) -> SelfCalibration:
    """Calibrate the scanners of a network (method section 4.2)."""
    options = options or CalibrationOptions()
    names = calibration_names(network)
    if not names:
        raise InputError(
            "the network has no calibration parameters",
            cure="add a section [calibration], and observations of a scanner",
        )
    state = find_start(network)
    # with parameters at zero, where what acts alike does so exactly
    flat = _with_zero(state, names)
    open_unknowns = estimability(network, flat)
    try:
        proposal = propose(network, flat, names, options.near)
    except SingularMatrix:
        raise RankDefect(
            "stations or targets cannot be determined, whatever is calibrated", open_unknowns.open
        ) from None
    further: list[Remedy] = []
    if proposal.left or proposal.hardly:
        further = remedies(network, flat, names, options.near, back=options.back)
    left_out: tuple[str, ...] = ()
    if open_unknowns.open and not options.minimum_norm:
        if not (options.reduce and proposal.left):
            raise RankDefect(*_refusal(open_unknowns, proposal, further))
        left_out = tuple(item.name for item in proposal.left)
        network = without(network, left_out)
        names = proposal.names
    network = network.with_start(state)
    log: SnoopingLog | None = None
    if options.minimum_norm:
        adjustment = adjust_minimum_norm(network)
    elif options.snoop:
        adjustment, log = snoop(network)
    else:
        adjustment = adjust(network)
    return _analysed(
        adjustment=adjustment,
        names=names,
        options=options,
        models=models,
        open_unknowns=open_unknowns,
        proposal=proposal,
        further=tuple(further),
        left_out=left_out,
        log=log,
    )


def without(network: Network, names: Sequence[str]) -> Network:
    """Hold parameters of a network at their start, or at zero where they have none."""
    free = network.free.copy()
    free[parameter_columns_of(network, names)] = False
    return replace(network, free=free)


def _with_zero(state: State, names: Sequence[str]) -> State:
    """The state with parameters zero."""
    scalars = state.scalars.copy()
    scalars[[state.layout.index("scalar", name) for name in names]] = 0.0
    return replace(state, scalars=scalars)


def _analysed(
    adjustment: Adjustment,
    names: tuple[str, ...],
    options: CalibrationOptions,
    models: Sequence[CalibrationModel],
    open_unknowns: Estimability,
    proposal: EstimableSet,
    further: tuple[Remedy, ...],
    left_out: tuple[str, ...],
    log: SnoopingLog | None,
) -> SelfCalibration:
    """All figures of an adjusted calibration."""
    posterior = adjustment.scaled(posterior=options.posterior)
    factor = adjustment.variance_factor(posterior=posterior)
    before = _without_parameters(adjustment, names, options)
    own = {name.split("(")[0] for name in names}
    omitted = [
        item
        for model in models
        for item in omitted_parameters(
            adjustment,
            model.select([p for p in model.parameters if p not in own]),
            options.alpha,
            factor,
        )
    ]
    return SelfCalibration(
        adjustment=adjustment,
        parameters=_parameters(adjustment, names, factor, options.limit_t),
        estimability=open_unknowns,
        proposal=proposal,
        remedies=further,
        tests=Tests(
            _together(adjustment, names, options, posterior),
            None if before is None or options.minimum_norm else _gain(before, adjustment),
            _differ(adjustment, names, posterior),
            tuple(omitted),
        ),
        rho=calibration_correlations(adjustment, names),
        datums=() if options.minimum_norm else tuple(datum_effects(adjustment, names)),
        readings=_readings(adjustment, before),
        factor=factor,
        sigma_origin=_origin(adjustment, posterior),
        dropped=left_out,
        log=log,
        limit_t=options.limit_t,
    )


def _eliminated(
    names: Sequence[str], values: Array, covariance: Array, first: set[str], limit: float
) -> tuple[str, ...]:
    """Names that stay; values (k,) and covariance (k, k) follow as those of the others at zero."""
    alive, c, q = list(names), values, covariance
    while alive:
        t = np.abs(c) / np.sqrt(np.diag(q))
        marked = [k for k, name in enumerate(alive) if name in first]
        k = marked[0] if marked else int(np.argmin(t))
        if not marked and t[k] > limit:
            break
        rest = np.arange(len(alive)) != k
        c = (c - q[:, k] * (c[k] / q[k, k]))[rest]
        q = (q - np.outer(q[:, k], q[k]) / q[k, k])[np.ix_(rest, rest)]
        alive.pop(k)
    return tuple(alive)


def _refusal(
    open_unknowns: Estimability, proposal: EstimableSet, further: Sequence[Remedy]
) -> tuple[str, list[str]]:
    """Headline and sentences of a network with open unknowns."""
    count = len(open_unknowns.open)
    headline = (
        f"{count} combination{'s' if count > 1 else ''} of unknowns cannot be determined "
        f"(singular values {open_unknowns.gap[0]:.0e} against {open_unknowns.gap[1]:.0e})"
    )
    words = list(open_unknowns.open)
    words += [f"{item.name} is to be left out: {item.why}" for item in proposal.left]
    if proposal.names:
        words.append(f"these can be estimated together: {', '.join(proposal.names)}")
    words += remedy_sentences(proposal, further)
    return headline, words


def remedy_sentences(proposal: EstimableSet, further: Sequence[Remedy]) -> list[str]:
    """Say in words what every addition to the network would give."""
    out = []
    known = set(proposal.names)
    well = set(proposal.recommended)
    for remedy in further:
        more = [n for n in remedy.proposal.names if n not in known]
        better = [n for n in remedy.proposal.recommended if n not in well and n in known]
        if more:
            out.append(f"{remedy.what} would make estimable: {', '.join(more)}")
        if better:
            out.append(f"{remedy.what} would separate well: {', '.join(better)}")
    return out


def _parameters(
    adjustment: Adjustment, names: Sequence[str], factor: float, limit: float
) -> tuple[Parameter, ...]:
    """Estimates with their sigmas, scaled with a factor."""
    layout, out = adjustment.layout, []
    for name in names:
        value = float(adjustment.state.scalars[layout.index("scalar", name)])
        sigma = float(np.sqrt(factor * adjustment.covariance(name)[0, 0]))
        significant = sigma > 0 and abs(value) > limit * sigma
        out.append(Parameter(name, unit_of(name.split("(")[0]), value, sigma, significant))
    return tuple(out)


def _without_parameters(
    adjustment: Adjustment, names: Sequence[str], options: CalibrationOptions
) -> Adjustment | None:
    """The same network with all parameters zero; None if it cannot be adjusted."""
    plain = without(adjustment.network.with_start(_with_zero(adjustment.state, names)), names)
    try:
        return adjust_minimum_norm(plain) if options.minimum_norm else adjust(plain)
    except AdjustmentError:
        return None


def _together(
    adjustment: Adjustment, names: Sequence[str], options: CalibrationOptions, posterior: bool
) -> BlockTest:
    """All parameters against zero; a minimum norm has no such test."""
    if options.minimum_norm:
        return BlockTest(len(names), adjustment.dof, float("nan"), float("nan"), posterior)
    return block_test(adjustment, names, posterior=posterior)


def _gain(before: Adjustment, after: Adjustment) -> BlockTest | None:
    """F-test of how much the sum of squares falls with the parameters."""
    freedom = before.dof - after.dof
    if freedom <= 0 or after.dof <= 0 or after.vtpv <= 0:
        return None
    statistic = (before.vtpv - after.vtpv) / freedom / after.posterior_factor
    return BlockTest(
        freedom, after.dof, statistic, float(f.sf(statistic, freedom, after.dof)), True
    )


def _differ(adjustment: Adjustment, names: Sequence[str], posterior: bool) -> BlockTest | None:
    """Test of stations against each other, where stations share the parameters of an instrument."""
    owners = {name[name.index("(") :] for name in names}
    tables = [o for o in adjustment.network.observations if isinstance(o, ScannerPolar) and o.model]
    models = {o.model for o in tables if o.model}
    stations = np.unique(np.concatenate([o.station for o in tables])) if tables else ()
    if len(owners) >= len(stations) or len(models) != 1:
        return None
    own = list(dict.fromkeys(name.split("(")[0] for name in names))
    return station_test(adjustment, models.pop().select(own), posterior=posterior)


def _origin(adjustment: Adjustment, posterior: bool) -> str:
    if posterior:
        return Sentence(
            "a posteriori, sigma0 {adjustment.sigma0_posterior:4}, redundancy {adjustment.dof}",
            adjustment=adjustment,
        )
    return "a priori, from the sigmas of the observations"


def _readings(adjustment: Adjustment, before: Adjustment | None) -> PolarReadings:
    """Polar observations with their residuals."""
    polar, after, earlier = [], [], []
    for o in adjustment.network.observations:
        if not isinstance(o, ScannerPolar):
            continue
        items = np.flatnonzero(o.use == Use.ACTIVE)
        polar.append(o.folded()[items])
        after.append(-o.misclosure(adjustment.state)[items])
        if before is not None:
            earlier.append(-o.misclosure(before.state)[items])
    return PolarReadings(
        np.concatenate(polar),
        np.concatenate(after),
        np.concatenate(earlier) if before is not None else None,
    )
