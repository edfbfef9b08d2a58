"""Registers all scans by their clouds: pairs, loops, one adjustment, differences as placed.

Overlaps need not be given: the pairs that promise most are tried until all scans hang together and
loops control them, or no pair is left that could. Pairs become observations of a network (one for
each group of stations that they connect), the first station of each held.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Progress
from tribrach.comparison.station_pair import StationPair, along_normals
from tribrach.errors import NotConverged
from tribrach.geometry.pose import Pose
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.survey import Survey
from tribrach.registration.clouds.fine import matched
from tribrach.registration.clouds.graph import (
    CloudEdge,
    Consistency,
    consistent,
    decided_by_loops,
    groups,
    network_of,
)
from tribrach.registration.clouds.likeness import Walls, likeness
from tribrach.registration.clouds.pair import (
    APPROXIMATE,
    ApproximateSigma,
    CloudPair,
    register_pair,
)
from tribrach.registration.clouds.prepared import PreparedScan
from tribrach.registration.clouds.proposals import (
    Choice,
    all_pairs,
    promise_of,
    try_all,
    try_proposed,
)
from tribrach.registration.clouds.reference import (
    PlacedOn,
    ReferenceOffset,
    ScanReference,
    offset_sentence,
    on_references,
)
from tribrach.registration.clouds.relative_covariance import GATES as COVARIANCE
from tribrach.registration.clouds.surfels import Surfels
from tribrach.registration.edges import Edge, edges
from tribrach.registration.pose_graph import Joint, join
from tribrach.sentences import Sentence
from tribrach.statistics import robust_sigma


@dataclass(frozen=True)
class DifferenceGates:
    """Which places of two placed clouds are compared (method section 9.5).

    Chosen by hand with test_covariance.
    """

    gate_m: float = 0.1  #: differences beyond this are other surfaces [m]
    #: surfels with so many points, no rougher than this many times the median, are flat places
    flat_points: int = 12
    flat_roughness: float = 2.5
    edge_sigmas: float = 6.0  #: differences beyond this many robust sigmas are edges
    fewest_places: int = 30  #: fewer places tell nothing
    most_refusals: int = 10  #: pairs that were not registered and are said to be, at most


GATES = DifferenceGates()
#: a turn with a larger sigma is held by nothing: a covariance is that of small angles [rad]
HELD_TURN = 0.05


@dataclass(frozen=True)
class Differences:
    """Differences of two placed clouds on flat places of their overlap, as root mean squares."""

    places: int  #: number of places
    observed: float  #: observed differences [m]
    noise: float  #: predicted part from noise [m]
    registration: float  #: predicted part from the uncertainty of the relative pose [m]

    @property
    def predicted(self) -> float:
        """Both predicted parts together [m]."""
        return float(np.hypot(self.noise, self.registration))

    @property
    def ratio(self) -> float:
        """Observed over predicted differences."""
        return self.observed / self.predicted


def differences(
    a: PreparedScan, b: PreparedScan, pose: Pose, covariance: Array, gate: float = GATES.gate_m
) -> Differences | None:
    """Compare the differences of two placed clouds with their uncertainty.

    ``covariance`` has left increments in a, of the translation [m] and of the turn about the
    scanner of b [rad]. Differences beyond ``gate`` [m] belong to other surfaces.

    On flat places that both stations see, the means of the clouds differ along the mean of their
    normals by noise and by the uncertainty of the relative pose:
    ``s^2 = s_1^2/n_1 + s_2^2/n_2 + s_normal^2 + a C a^T`` with ``a = [n ; (X - X_0) x n]`` (method
    section 9.5). Its RMS over the overlap is predicted and observed.
    """
    matches = matched(a.fine, b.fine, pose, gate)
    s, t = a.fine.surfels, b.fine.surfels
    flat = _flat(s)[matches.first] & _flat(t)[matches.second]
    flat &= s.size[matches.first] == t.size[matches.second]
    matches = matches.subset(flat & matches.forward)
    # the few that are beyond all noise are edges
    limit = GATES.edge_sigmas * robust_sigma(matches.residual, about=0.0) if len(matches) else 0.0
    matches = matches.subset(np.abs(matches.residual) <= limit)
    if len(matches) < GATES.fewest_places:
        return None
    i, j = matches.first, matches.second
    q = matches.point - s.center[i]
    along = np.maximum((q**2).sum(axis=1) - matches.residual**2, 0.0)
    noise = sum(
        one.sigma_offset[k] ** 2 * (1 + 0.125 * along * (1 / one.width[k] ** 2).sum(axis=1))
        for one, k in ((s, i), (t, j))
    )
    rows = along_normals(matches.point, matches.normal, pose.translation)
    registered = np.einsum("ni,ij,nj->n", rows, covariance, rows)
    return Differences(
        len(matches),
        float(np.sqrt((matches.residual**2).mean())),
        float(np.sqrt(noise.mean())),
        float(np.sqrt(max(registered.mean(), 0.0))),
    )


def _flat(s: Surfels) -> NDArray[np.bool_]:
    """Which surfels (n,) are flat places with enough points."""
    enough = s.count >= GATES.flat_points
    usual = float(np.median(s.thickness[enough])) if enough.any() else 0.0
    return np.asarray(enough & (s.thickness <= GATES.flat_roughness * usual))


@dataclass(frozen=True, eq=False)
class CloudGroup:
    """Stations that pairs of clouds connect, in the frame of the first one or of a reference."""

    poses: Mapping[str, Pose]  #: poses by name of station
    #: covariances (6, 6) by name: translation [m] and left rotation increments [rad], zero for the
    #: first
    covariances: Mapping[str, Array]
    adjustment: Adjustment | None  #: the adjusted network, None for a single station
    edges: Sequence[Edge]  #: each pair compared with the network
    #: differences of the placed clouds, by pairs of names
    differences: Mapping[tuple[str, str], Differences]

    @property
    def stations(self) -> tuple[str, ...]:
        """Names of the stations, the one that holds the frame first."""
        return tuple(self.poses)


@dataclass(frozen=True, eq=False)
class CloudRegistration:
    """Clouds registered together, with their loops."""

    pairs: Sequence[CloudPair]  #: the pairs that were tried
    consistency: Consistency  #: test of the loops
    #: connected stations, those on a reference first, else the largest group
    groups: Sequence[CloudGroup]
    sentences: tuple[str, ...]  #: what was left out or is weak
    references: tuple[str, ...] = ()  #: names of references, which stand among the stations
    offsets: tuple[ReferenceOffset, ...] = ()  #: what the network says of their places
    placed_on: tuple[PlacedOn, ...] = ()  #: scans on references


def register_clouds(
    scans: Sequence[PreparedScan],
    priors: Mapping[str, Pose] | None = None,
    *,
    references: Sequence[ScanReference] = (),
    sigma: ApproximateSigma = APPROXIMATE,
    choice: Choice = "proposed",
    floor: tuple[float, float] = COVARIANCE.floor,
    progress: Progress = lambda what, done, total: None,
) -> CloudRegistration:
    """Register scans by their clouds; references, if there are any, give the frame."""
    pairs = pairwise(scans, priors, sigma=sigma, choice=choice, floor=floor, progress=progress)
    if references:
        joints = [
            Joint(edge.first, edge.second, edge.pose, 1.0)
            for edge in consistent([e for e in map(edge_of, pairs) if e is not None]).used
        ]
        progress("places on references", 0, len(references))
        groups = join([scan.name for scan in scans], joints).groups
        together = max(groups, key=len, default={})
        pairs += on_references(scans, references, priors or {}, together, sigma, floor)
    return settled(scans, pairs, progress, references)


def pairwise(
    scans: Sequence[PreparedScan],
    priors: Mapping[str, Pose] | None = None,
    *,
    sigma: ApproximateSigma = APPROXIMATE,
    choice: Choice = "proposed",
    floor: tuple[float, float] = COVARIANCE.floor,
    progress: Progress = lambda what, done, total: None,
) -> list[CloudPair]:
    """Register the pairs that approximate poses promise most of, or every pair."""
    priors = priors or {}
    by_name = {scan.name: scan for scan in scans}
    names = list(by_name)
    out: dict[tuple[int, int], CloudPair] = {}

    def attempt(a: str, b: str) -> tuple[CloudEdge | None, int]:
        prior = None
        if a in priors and b in priors:
            prior = priors[a].inverse @ priors[b]
        pair = register_pair(by_name[a], by_name[b], prior, sigma=sigma, floor=floor)
        out[names.index(a), names.index(b)] = pair
        return edge_of(pair), 0 if pair.fit is None else pair.fit.precision.rank

    if all_pairs(len(names), choice):
        try_all(names, attempt, progress)
    else:
        radii = {scan.name: scan.radius for scan in scans}
        alike = likeness([Walls.of(scan) for scan in scans], progress)
        promise = promise_of(names, alike, radii, priors, sigma.shift)
        try_proposed(names, promise, radii, attempt, progress)
    asked: set[frozenset[str]] = set()
    while True:
        whole = [p for p in out.values() if p.fit is not None and p.fit.precision.rank == 6]
        used = consistent([edge for edge in map(edge_of, whole) if edge is not None]).used
        open_ = [p.open for p in out.values() if p.open is not None]
        loops = decided_by_loops(names, used, [o for o in open_ if o.ends not in asked])
        if not loops:
            return [out[key] for key in sorted(out)]
        for o, pose in loops:
            asked.add(o.ends)
            key = names.index(o.first), names.index(o.second)
            a, b = by_name[o.first], by_name[o.second]
            out[key] = register_pair(a, b, pose, floor=floor, speaks="their loop")


def edge_of(pair: CloudPair) -> CloudEdge | None:
    """The relative pose of a pair, None if none was taken."""
    if pair.fit is None:
        return None
    return CloudEdge(pair.a, pair.b, pair.fit.pose, pair.fit.precision.covariance)


def settled(
    scans: Sequence[PreparedScan],
    pairs: Sequence[CloudPair],
    progress: Progress = lambda what, done, total: None,
    references: Sequence[ScanReference] = (),
) -> CloudRegistration:
    """Test the loops of pairs and adjust each group of stations."""
    joints = [edge for edge in map(edge_of, pairs) if edge is not None]
    consistency = consistent(joints)
    by_name = {one.name: one for one in (*(r.scan for r in references), *scans)}
    frames = {reference.name: reference.place.observe for reference in references}
    tried = [(p.a, p.b) for p in pairs]
    used, loose = consistency.used, tuple[CloudEdge, ...]()

    def placed() -> list[CloudGroup]:
        return [
            _group(by_name, group, used, tried, progress, frames)
            for group in groups(list(by_name), used)
        ]

    try:
        hung = placed()
    except NotConverged:
        # a turn that is open by more than a small angle has no linear equation
        loose = tuple(e for e in used if e.turn_sigma > HELD_TURN)
        if not loose:
            raise
        used = tuple(e for e in used if e.turn_sigma <= HELD_TURN)
        hung = placed()
    # scans in the frame of a reference go first
    hung.sort(key=lambda group: not (frames.keys() & group.poses.keys() and group.adjustment))
    offsets = [
        ReferenceOffset.of(reference.place, group.adjustment)
        for reference in references
        for group in hung
        if group.adjustment is not None and reference.name in group.poses
    ]
    on = {reference.name: reference for reference in references}
    placed_on = [
        PlacedOn.of(on[p.a], by_name[p.b], p.fit) for p in pairs if p.fit is not None and p.a in on
    ]
    sentences = [s for p in pairs if p.fit for s in p.sentences]
    sentences += _refusals(pairs, hung, frames)
    sentences += consistency.sentences
    sentences += [
        f"{e.first} and {e.second} are not joined: what they have in common does not hold how they "
        "are turned"
        for e in loose
    ]
    for group in hung:
        sentences += [
            Sentence(
                "the pair {e.first} - {e.second} contradicts the network (test "
                "{e.statistic:1}, limit {e.limit:1})",
                e=e,
            )
            for e in group.edges
            if e.outlying and e.statistic is not None and e.limit is not None
        ]
    if len(hung) > 1:
        sentences.append(_apart(pairs, hung))
    sentences += [said for said in map(offset_sentence, offsets) if said is not None]
    return CloudRegistration(
        pairs,
        consistency,
        hung,
        tuple(sentences),
        tuple(frames),
        tuple(offsets),
        tuple(placed_on),
    )


def _refusals(
    pairs: Sequence[CloudPair], hung: Sequence[CloudGroup], references: Collection[str]
) -> list[str]:
    """Why pairs that nothing else joins, and scans on references, were not registered; ten."""
    number = {name: k for k, group in enumerate(hung) for name in group.stations}
    told = [p for p in pairs if not p.fit and number[p.a] != number[p.b]]
    told += [p for p in pairs if not p.fit and p.a in references and number[p.a] == number[p.b]]
    sentences = [s for p in told for s in p.sentences]
    left = len(sentences) - GATES.most_refusals
    return sentences[: GATES.most_refusals] + (
        [f"{left} more pairs were not registered"] if left > 0 else []
    )


def _group(
    scans: Mapping[str, PreparedScan],
    names: tuple[str, ...],
    used: Sequence[CloudEdge],
    tried: Sequence[tuple[str, str]],
    progress: Progress,
    frames: Mapping[str, Callable[[Survey], None]],
) -> CloudGroup:
    """One group, adjusted; the pairs of it that were tried are compared as they are placed."""
    if len(names) == 1:
        none = {names[0]: np.zeros((6, 6))}
        return CloudGroup({names[0]: Pose.identity()}, none, None, (), {})
    adjustment = adjust(network_of(names, used, frames))
    state, layout = adjustment.state, adjustment.layout
    at = {name: layout.index("pose", name) for name in names}
    poses = {name: Pose(state.pose_r[k], state.pose_t[k]) for name, k in at.items()}
    covariances = {name: adjustment.covariance(name) for name in names}
    placed = {}
    inner = [(a, b) for a, b in tried if a in at and b in at]
    for number, (a, b) in enumerate(inner):
        progress("differences of clouds", number, len(inner))
        pose = poses[a].inverse @ poses[b]
        covariance = _between(adjustment, a, b, poses)
        one = differences(scans[a], scans[b], pose, covariance)
        if one is not None:
            placed[a, b] = one
    progress("differences of clouds", len(inner), len(inner))
    return CloudGroup(poses, covariances, adjustment, edges(adjustment), placed)


def _between(adjustment: Adjustment, a: str, b: str, poses: Mapping[str, Pose]) -> Array:
    """Covariance (6, 6) of b in the frame of a, left increments there."""
    pair = StationPair.from_adjustment(adjustment, a, b)
    back = np.kron(np.eye(2), poses[a].rotation.T)
    covariance: Array = back @ pair.relative(poses[b].translation) @ back.T
    return covariance


def _apart(pairs: Sequence[CloudPair], hung: Sequence[CloudGroup]) -> str:
    """Which stations nothing joins to the first group."""
    lost = [name for group in hung[1:] for name in group.stations]
    doubtful = {n for p in pairs if not p.fit and p.rivals for n in (p.a, p.b)} & set(lost)
    words = f"{', '.join(lost)} {'is' if len(lost) == 1 else 'are'} not joined to "
    words += f"{', '.join(hung[0].stations)} by clouds"
    if doubtful:
        words += f" ({', '.join(sorted(doubtful))}: several places fit alike)"
    return words + "; add targets, planes, or a station between them"
