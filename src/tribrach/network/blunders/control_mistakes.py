"""Names given coordinates that contradict everything else, whether they have a sigma or are held.

A list that is written otherwise as a whole is asked first (:mod:`given_lists`), and whether all of
its distances are longer or shorter than the measured ones: a scale m of the given coordinates in
plan is a bias ``x - x0`` of theirs. What all points share accuses none of them.

One mistyped coordinate spoils all observations around it, and each of them looks wrong. Every given
coordinate is therefore tested as a bias of its own (method section 3.4), single and with the others
of its point. It is accused only if

* its test fails at 0.1 % for all such tests together, also against the variance factor that is left
  without it, so that sigmas that are too small everywhere accuse nobody;
* nothing else explains as much: no observation, no mistake common to several, no other coordinate.
  What comes close is named as the alternative, and then nothing is called wrong.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from tribrach._types import Array, Index
from tribrach.errors import TribrachError
from tribrach.geodesy.site import FlatSite
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.blunders.clearing import fits
from tribrach.network.blunders.common_causes import common_causes
from tribrach.network.blunders.given_lists import GIVEN_LIST
from tribrach.network.blunders.gross import explain
from tribrach.network.blunders.rivals import ALIKE
from tribrach.network.blunders.snooping import (
    SUSPICIOUS,
    SnoopingLog,
    SnoopingStep,
    restart,
    snoop,
)
from tribrach.network.blunders.suspects import Key, Suspect, find_suspects
from tribrach.network.given_coordinates import (
    AXES,
    UNCONTROLLED,
    GivenCoordinate,
    GivenCoordinates,
    coordinate_words,
    given_coordinates,
    released,
)
from tribrach.network.network import Network, is_given
from tribrach.network.quality import global_test
from tribrach.network.reliability import weigh
from tribrach.network.significance import log_significance
from tribrach.observations.base import Observations, Use
from tribrach.sentences import Sentence, joined
from tribrach.statistics import chi2, f

#: significance of all tests of given coordinates together
_ALPHA = 0.001
#: redundancy from which sigma0 without the coordinate is an estimate to test against
_MANY = 15
#: factor by which stated sigmas may be too small: beyond it sigma0 is no estimate of them
_OPTIMISTIC = 5.0
#: the most promising coordinates that are released in turn
_TRIED = 3
#: given points in plan from which on a scale of all of them is told from an error of one
_SCALED = 3
#: times that it is looked again without the worst reading; once in networks with more unknowns
_ROUNDS, _LARGE = 4, 5000
#: share of sigma0 that a coordinate found beside wrong readings may leave
_HELPS = 0.9


@dataclass(frozen=True)
class WrongCoordinate:
    """Given coordinates of one point that contradict everything else."""

    coordinates: tuple[GivenCoordinate, ...]  #: one, or several of one point
    error: Array  #: (m,), given less adjusted without them [m]
    sigma: Array  #: (m,), standard deviation of the error, a priori [m]
    #: test against zero and its limit: the size of w for one, chi-square for several
    statistic: float
    limit: float
    #: the adjustment with the coordinates, and without them; readings that are wrong as well take
    #: part in both
    before: Adjustment
    after: Adjustment
    #: what explains as much, in words; nothing is wrong for certain then
    alternatives: tuple[str, ...] = ()

    @property
    def certain(self) -> bool:
        """True if nothing else explains as much."""
        return not self.alternatives

    @property
    def score(self) -> float:
        """Logarithm of its significance."""
        count = len(self.coordinates)
        return float(log_significance(self.statistic ** (2 if count == 1 else 1), count))

    def sentence(self) -> str:
        """All of it in one sentence."""
        many = len(self.coordinates) > 1
        words = coordinate_words(self.coordinates)
        sizes = joined(
            ", ",
            (
                (f"{AXES[g.axis]} " if many else "") + _sized(x, s)
                for g, x, s in zip(self.coordinates, self.error, self.sigma, strict=True)
            ),
        )
        it, be = ("them", "are") if many else ("it", "is")
        figures = Sentence(
            "{sizes} off what everything else says ({chi} {own.statistic:1} against "
            "{own.limit:1}); sigma0 is {own.before.sigma0_posterior:2} with {it} and "
            "{own.after.sigma0_posterior:2} without {it}",
            sizes=sizes,
            chi="chi-square" if many else "test",
            own=self,
            it=it,
        )
        if self.certain:
            cure = f"compare {it} with where the coordinates come from"
            return Sentence(
                "{words} {be} wrong: {figures}; {cure}",
                words=words,
                be=be,
                figures=figures,
                cure=cure,
            )
        rivals = " or ".join(self.alternatives)
        return Sentence(
            "{words} may be wrong: {figures}; an error in {rivals} would do as well, look at both",
            words=words,
            figures=figures,
            rivals=rivals,
        )

    def without(self, adjustment: Adjustment) -> Adjustment:
        """An adjustment of the same network without these coordinates."""
        network = adjustment.network
        if network is self.before.network:
            return self.after
        return adjust(restart(released(network, self.coordinates), adjustment))

    def snooped(self, suspects: Mapping[Key, float]) -> tuple[Adjustment, SnoopingLog]:
        """Snoop while these coordinates stand aside; they come back, and are named in the log."""
        one = len(self.coordinates) == 1
        error = float(self.error[0]) if one else 0.0
        kept = [(g.table, g.item) for g in self.coordinates if not g.held]
        step = SnoopingStep(
            coordinate_words(self.coordinates), self.statistic, self.limit, error, "m", SUSPICIOUS
        )
        return _snooped(self.before, self.after, suspects, kept, step)


@dataclass(frozen=True)
class WrongList:
    """Given coordinates that all are wrong in one way: no single one of them is accused."""

    #: what is wrong, in one sentence, and in a few words
    words: str
    short: str
    #: the adjustment with the list as it stands, and with the list put right
    before: Adjustment
    after: Adjustment
    #: scale of the list less one, and its sigma; NaN where it is in another unit or has other axes
    scale: float = np.nan
    sigma: float = np.nan
    #: chi-square of its test with so many degrees of freedom, and its limit
    statistic: float = np.nan
    limit: float = np.nan
    freedom: int = 1
    alternatives: tuple[str, ...] = ()  #: what explains as much, in words

    @property
    def score(self) -> float:
        """Logarithm of its significance."""
        return float(log_significance(self.statistic, self.freedom))

    @property
    def certain(self) -> bool:
        """True if nothing else explains as much."""
        return not self.alternatives

    def sentence(self) -> str:
        """All of it in one sentence."""
        rivals = " or ".join(self.alternatives)
        return self.words + f"; an error in {rivals} would do as well, look at both" * bool(rivals)

    def without(self, adjustment: Adjustment) -> Adjustment:
        """An adjustment of the same network with what is wrong put right."""
        if adjustment.network is self.before.network:
            return self.after
        right, network = self.after.network, adjustment.network
        tables = list(network.observations)
        for k, (o, other) in enumerate(zip(tables, right.observations, strict=False)):
            tables[k] = replace(o, values=other.values)
        return adjust(replace(network, observations=tuple(tables), start=self.after.state))

    def snooped(self, suspects: Mapping[Key, float]) -> tuple[Adjustment, SnoopingLog]:
        """Snoop with what is wrong put right, so that symptoms stay; the log names it."""
        size = 0.0 if np.isnan(self.scale) else self.scale
        step = SnoopingStep(self.short, self.statistic, self.limit, size, "1", SUSPICIOUS)
        return _snooped(self.before, self.after, suspects, (), step)


def _snooped(
    before: Adjustment,
    after: Adjustment,
    suspects: Mapping[Key, float],
    kept: Sequence[Key],
    step: SnoopingStep,
) -> tuple[Adjustment, SnoopingLog]:
    """Snoop in one network and take what it says over into another, but for what is kept there."""
    cleaned, log = snoop(after.network, suspects=suspects)
    given, tables = before.network, list[Observations]()
    for o, other in zip(given.observations, cleaned.network.observations, strict=False):
        tables.append(replace(o, use=other.use.copy(), reason=other.reason.copy()))
    for table, item in kept:
        o = given.observations[table]
        tables[table].use[item] = o.use[item]
        tables[table].reason[item] = o.reason[item]
    adjustment = adjust(replace(given, observations=tuple(tables)))
    return adjustment, SnoopingLog((step, *log.steps), log.removed)


def wrong_list(adjustment: Adjustment) -> WrongList | None:
    """Find what is wrong in all given coordinates alike: unit, axes, or scale."""
    slip = explain(adjustment.network, adjustment)
    if slip is not None:
        if slip.kind != GIVEN_LIST or slip.corrected is None:
            return None
        after = adjust(slip.corrected)
        words = f"{slip.sentence()}; {slip.cure}"
        return WrongList(words, "the list of given coordinates", adjustment, after)
    return _scaled_list(adjustment)


def _scaled_list(adjustment: Adjustment) -> WrongList | None:
    """The scale of all given coordinates in plan, where it explains more than anything else."""
    given = given_coordinates(adjustment)
    plan = np.array([k for k, g in enumerate(given.items) if g.axis < 2], dtype=np.int64)
    points = list(dict.fromkeys(given.items[k].point for k in plan))
    if adjustment.dof < 2 or len(points) < _SCALED:
        return None
    axis = np.array([given.items[k].axis for k in plan])
    value = np.array([_value(adjustment, given.items[k]) for k in plan])
    centre = np.array([value[axis == a].mean() if (axis == a).any() else 0.0 for a in (0, 1)])
    arm = value - centre[axis]
    left = float(arm @ given.left[np.ix_(plan, plan)] @ arm)
    if not left > UNCONTROLLED * float(np.square(arm) @ given.weight[plan]):
        return None
    pull = float(arm @ given.pull[plan])
    # the scale as a cause beside single coordinates
    cause = _Cause(plan, pull**2 / left, 1, np.array([left**-0.5]))
    if not _significance(adjustment, cause) < _ALPHA:
        return None
    scale, unit = -pull / left, _unit(adjustment, cause)
    rivals = _rivals(given, list(_causes(given)), None, find_suspects(weigh(adjustment)), unit)
    score = cause.score(unit)
    if any(rival < score - ALIKE for rival in rivals.values()):
        return None
    try:
        begun = restart(adjustment.network, adjustment)
        after = adjust(_rescaled(begun, given, plan, centre, scale))
    except TribrachError:
        return None
    if not _explains(after):
        return None
    close = sorted((rival, words) for words, rival in rivals.items() if rival < score + ALIKE)
    flat = isinstance(adjustment.network.site, FlatSite)
    sentence = Sentence(
        "the {count} given points lie {size:ppm1~} ± {sigma:ppm1} {apart} than what was measured "
        "between them (test {test:1} against {limit:1}; sigma0 is {with_:2} with it and "
        "{without:2} without it); all of them share it, so that no single point is wrong, and "
        "{reason} look so, or ranges that have a scale: {cure}, or calibrate the ranges",
        count=len(points),
        size=abs(scale),
        sigma=cause.sigma[0],
        apart="further apart" if scale > 0 else "closer together",
        test=float(np.sqrt(cause.statistic)),
        limit=float(np.sqrt(chi2.ppf(1 - _ALPHA, 1))),
        with_=adjustment.sigma0_posterior,
        without=after.sigma0_posterior,
        reason="grid coordinates that are taken for lengths on the ground"
        if flat
        else "coordinates of another projection or realisation of the frame",
        cure="name the reference system of the list (crs)"
        if flat
        else "look where the list comes from",
    )
    return WrongList(
        sentence,
        "the scale of the given coordinates",
        adjustment,
        after,
        scale,
        float(cause.sigma[0]),
        cause.statistic,
        float(chi2.ppf(1 - _ALPHA, 1)),
        alternatives=tuple(words for _, words in close[:3]),
    )


def _value(adjustment: Adjustment, g: GivenCoordinate) -> float:
    """A given coordinate [m]."""
    if not g.held:
        return float(adjustment.network.observations[g.table].values[g.item, g.row])
    return float(adjustment.state.points[adjustment.layout.position_index(g.point), g.axis])


def _rescaled(
    network: Network, given: GivenCoordinates, plan: Index, centre: Array, scale: float
) -> Network:
    """The network with the given coordinates in plan without a scale about a centre."""
    values = [o.values.copy() for o in network.observations]
    points, layout = network.start.points.copy(), network.start.layout
    for g in (given.items[k] for k in plan):
        x0 = centre[g.axis]
        if g.held:
            at = layout.position_index(g.point), g.axis
            points[at] = x0 + (points[at] - x0) / (1 + scale)
        else:
            old = values[g.table][g.item, g.row]
            values[g.table][g.item, g.row] = x0 + (old - x0) / (1 + scale)
    tables = (replace(o, values=v) for o, v in zip(network.observations, values, strict=True))
    start = replace(network.start, points=points)
    return replace(network, observations=tuple(tables), start=start)


def wrong_coordinate(adjustment: Adjustment) -> WrongCoordinate | None:
    """Find the given coordinate, or those of one point, that contradict everything else."""
    trial, rounds = adjustment, _ROUNDS if adjustment.n_unknowns <= _LARGE else 1
    for turn in range(rounds):
        suspects = find_suspects(weigh(trial))
        if trial.dof < 2 or (global_test(trial).passed and not suspects):
            return None
        found = _explanation(trial, suspects)
        if found is not None and _explains(found.after):
            break
        measured = [s for s in suspects if not _is_given(trial, s)]
        if not measured or turn + 1 == rounds:
            return None
        # a reading that is wrong as well must not hide the coordinate
        less = trial.network.switched([measured[0].key], Use.OFF, "tried without it")
        try:
            trial = adjust(restart(less, trial))
        except TribrachError:
            return None
    else:
        return None
    if trial is not adjustment and _one_reading(adjustment):
        return None
    # exchanged names put two targets off that each alone could be a coordinate's error
    if explain(adjustment.network, adjustment) is not None:
        return None
    if found is None or trial is adjustment:
        return found
    try:
        after = adjust(restart(released(adjustment.network, found.coordinates), adjustment))
    except TribrachError:
        return None
    # what leaves the misfit of the whole network as it is has not shown to be wrong
    if not after.sigma0_posterior < _HELPS * adjustment.sigma0_posterior:
        return None
    return replace(found, before=adjustment, after=after)


def _one_reading(adjustment: Adjustment) -> bool:
    """True if a network fits without one of its readings: then no coordinate is needed."""
    return any(
        fits(adjustment.vtpv - s.chi_square, adjustment.dof - s.freedom)
        for s in find_suspects(weigh(adjustment))
        if not _is_given(adjustment, s)
    )


def _explains(after: Adjustment) -> bool:
    """True if a network fits without a coordinate, or as well as sigmas that are too small let it.

    Where much is left, all of it is wrong, and nobody is to be accused.
    """
    if fits(after.vtpv, after.dof):
        return True
    return after.dof >= _MANY and after.vtpv <= _OPTIMISTIC**2 * after.dof


def _is_given(adjustment: Adjustment, suspect: Suspect) -> bool:
    """True for given coordinates, which are looked at by themselves."""
    o = adjustment.network.observations[suspect.key[0]]
    return is_given(type(o), o.group)


def _explanation(adjustment: Adjustment, suspects: list[Suspect]) -> WrongCoordinate | None:
    """The coordinates that explain most, unless anything else explains more."""
    given = given_coordinates(adjustment)
    causes = list(_causes(given))
    level = _ALPHA / max(len(causes), 1)
    failing = [cause for cause in causes if _significance(adjustment, cause) < level]
    if not failing:
        return None
    unit = _unit(adjustment, max(failing, key=lambda cause: cause.statistic))
    cause, after = _best(given, _simplest(failing, unit), unit)
    if cause is None or after is None:
        return None
    score = cause.score(unit)
    rivals = _rivals(given, failing, cause, suspects, unit)
    if any(rival < score - ALIKE for rival in rivals.values()):
        return None
    close = sorted((rival, words) for words, rival in rivals.items() if rival < score + ALIKE)
    limit = float(chi2.ppf(1 - level, cause.freedom))
    members = tuple(given.items[k] for k in cause.members)
    one = len(members) == 1
    return WrongCoordinate(
        members,
        _error(adjustment, after, members),
        cause.sigma,
        float(np.sqrt(cause.statistic)) if one else cause.statistic,
        float(np.sqrt(limit)) if one else limit,
        adjustment,
        after,
        tuple(words for _, words in close[:3]),
    )


def _rivals(
    given: GivenCoordinates,
    failing: Sequence[_Cause],
    cause: _Cause | None,
    suspects: Sequence[Suspect],
    unit: float,
) -> dict[str, float]:
    """Scores of rival explanations of the misfit; without a cause, of all failing ones."""
    adjustment = given.adjustment
    out = {
        given.words(other.members): other.score(unit)
        for other in failing
        if cause is None or not given.same_point(other.members, cause.members)
    }
    for suspect in suspects:
        if not _is_given(adjustment, suspect):
            o = adjustment.network.observations[suspect.key[0]]
            words = Network.describe(o, suspect.key[1], adjustment.state)
            # a vector may be wrong in one of its values alone
            out[words] = float(log_significance(suspect.chi_square / unit, 1))
    for common in common_causes(adjustment).named:
        score = log_significance(common.statistic / unit, len(common.size))
        out[common.words] = float(score)
    return out


def _sized(error: float, sigma: float) -> str:
    """An error with its sigma, in metres from one on."""
    size = (
        Sentence("{error:+3} m", error=error)
        if abs(error) >= 1
        else Sentence("{error:mm+1}", error=error)
    )
    return Sentence("{size} ± {sigma:mm1}", size=size, sigma=sigma)


@dataclass(frozen=True)
class _Cause:
    """Coordinates (m,) of one point as an explanation, with their test."""

    members: Index
    statistic: float
    freedom: int
    sigma: Array

    def score(self, unit: float) -> float:
        """Logarithm of the significance with so much variance of unit weight."""
        return float(log_significance(self.statistic / unit, self.freedom))


def _causes(given: GivenCoordinates) -> Iterator[_Cause]:
    """Every controlled coordinate, and those of one point in plan and together."""
    order = sorted(np.flatnonzero(given.controlled), key=lambda k: given.items[k].point)
    for _, group in groupby(order, key=lambda k: given.items[k].point):
        members = sorted(group, key=lambda k: given.items[k].axis)
        plan = tuple(k for k in members if given.items[k].axis < 2)
        for one in sorted({*((k,) for k in members), plan, tuple(members)} - {()}):
            statistic, freedom, _, sigma = given.test(np.array(one))
            # several whose errors are not all to be seen are no explanation of their own
            if freedom == len(one):
                yield _Cause(np.array(one), statistic, freedom, sigma)


def _unit(adjustment: Adjustment, cause: _Cause) -> float:
    """Variance of unit weight that a cause leaves, at least one."""
    rest = adjustment.dof - cause.freedom
    return max(1.0, (adjustment.vtpv - cause.statistic) / rest) if rest > 0 else 1.0


def _significance(adjustment: Adjustment, cause: _Cause) -> float:
    """Probability of as much by chance: with sigma0 a priori, or with what is left if larger."""
    prior = float(chi2.sf(cause.statistic, cause.freedom))
    unit, rest = _unit(adjustment, cause), adjustment.dof - cause.freedom
    if unit == 1.0:
        return prior
    return max(prior, float(f.sf(cause.statistic / cause.freedom / unit, cause.freedom, rest)))


def _simplest(causes: list[_Cause], unit: float) -> list[_Cause]:
    """The best first; of those that hold one coordinate of each other the one with the fewest."""
    ranked = sorted(causes, key=lambda cause: cause.score(unit))
    out: list[_Cause] = []
    for cause in ranked:
        within = [
            other
            for other in ranked
            if set(other.members) < set(cause.members)
            and other.score(unit) < cause.score(unit) + ALIKE
        ]
        if not within:
            out.append(cause)
    return out


def _best(
    given: GivenCoordinates, causes: list[_Cause], unit: float
) -> tuple[_Cause | None, Adjustment | None]:
    """Release the most promising in turn: the one without which the network fits best."""
    best: tuple[_Cause | None, Adjustment | None] = None, None
    least = np.inf
    before = given.adjustment
    for cause in causes[:_TRIED]:
        members = tuple(given.items[k] for k in cause.members)
        try:
            after = adjust(restart(released(before.network, members), before))
        except TribrachError:
            continue
        drop = (before.vtpv - after.vtpv) / unit
        score = float(log_significance(drop, cause.freedom))
        if score < least:
            best, least = (cause, after), score
    return best


def _error(before: Adjustment, after: Adjustment, members: Sequence[GivenCoordinate]) -> Array:
    """Given less adjusted without them (m,) [m]."""
    out = []
    for g in members:
        place = before.layout.position_index(g.point)
        if g.held:
            value = before.state.points[place, g.axis]
        else:
            value = before.network.observations[g.table].values[g.item, g.row]
        out.append(value - after.state.positions[place, g.axis])
    return np.array(out)
