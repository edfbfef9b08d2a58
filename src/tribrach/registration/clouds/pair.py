"""Registers two scans without approximate values, or says why no pose can be taken.

Proposals (plans, features, a given approximate pose) are moved to where they fit and judged by what
agrees and what is seen through; the best are fitted with all surfels. A pose is taken only if the
scans overlap enough, little is seen through, and no other place fits as well; otherwise a sentence
says what is wrong and no pose is given.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from weakref import WeakKeyDictionary

import numpy as np
from scipy.ndimage import maximum_filter1d

from tribrach._types import Array, Mask
from tribrach.answers import Matrix, Number, Result, part
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import log
from tribrach.registration.alternatives import (
    APPROXIMATE,
    ApproximateSigma,
    OpenPair,
    symmetric_places,
)
from tribrach.registration.clouds.fine import FINE, FineAlignment, Indexed, align
from tribrach.registration.clouds.open_directions import fit_held, slid_to
from tribrach.registration.clouds.prepared import PreparedScan
from tribrach.registration.clouds.relative_covariance import GATES as COVARIANCE
from tribrach.registration.clouds.relative_covariance import (
    RelativeCovariance,
    relative_covariance,
)
from tribrach.registration.clouds.shared_errors import with_shared_errors
from tribrach.registration.clouds.starts import (
    kiss_poses,
    levelled_pose,
    own_poses,
    plan_poses,
    slope_poses,
)
from tribrach.registration.clouds.surfels import Surfels
from tribrach.registration.clouds.verdict import Verdict, judge
from tribrach.sentences import Sentence
from tribrach.units import percent

__all__ = [
    "APPROXIMATE",
    "ApproximateSigma",
    "CloudPair",
    "Origin",
    "PairFit",
    "register_pair",
]


@dataclass(frozen=True)
class CloudPairGates:
    """Which poses of two scans are looked at, and when one of them is taken.

    Chosen by hand with test_pair, test_real_scans. A size is that of the coarse surfels.
    """

    #: gates of the first and of the second look [sizes], and steps at each
    first_gates_sizes: tuple[float, ...] = (4.0, 2.0, 1.0)
    first_steps: int = 3
    second_gates_sizes: tuple[float, ...] = (1.0, 0.5)
    second_steps: int = 8
    first_surfels: int = 2500  #: surfels that the first look takes
    #: poses nearer than this are one: shift [sizes], turn [rad]
    same_sizes: float = 1.5
    same_turn_rad: float = float(np.radians(3.0))
    same_again: float = 0.3  #: ... after the second look, as a share of that shift
    #: candidates that are looked at a second time, and the share of the best score that they need
    second_looks: int = 6
    best_share: float = 0.4
    #: places to either side that are tried along an open direction, one size apart
    slide_places: int = 60
    #: how many of them are kept, and how many sizes these are apart
    slid_kept: int = 3
    slid_apart: int = 3
    slide_share: float = 0.9  #: what is open is a shift if it has this share of shift or more
    fewest_matches: int = 50  #: fewer matches tell of no open direction and hold no pose
    agrees_sizes: float = 0.4  #: agreement along normals in the search [sizes]

    #: a pair overlaps if either scan is seen by the other with this share and this area [m^2]
    least_overlap: float = 0.12
    least_area_m2: float = 4.0
    least_consistency: float = 0.25  #: of what is judged at least so much agrees
    #: shares of the agreeing area, and of that of it which is no floor, that may be seen through:
    #: things that were moved between the scans
    moved_share: float = 0.01
    moved_standing_share: float = 0.02
    #: bays are sought where the upright surfaces hold a direction by less than this share, within
    #: this reach and by steps that the windows of a facade do not miss
    bay_upright: float = 0.5
    bay_share: float = 0.2
    bay_reach_m: float = 9.0
    bay_step_m: float = 0.1
    bay_apart_m: float = 0.8
    #: so many places at most, by so many surfels
    bays: int = 6
    bay_surfels: int = 3000
    #: rivals agree in this share of the area of the best, or in the lesser one if they are clearly
    #: less seen through than it
    rival_share: float = 0.7
    clean_rival_share: float = 0.4
    #: edge of patches that are independent evidence [m], and sigmas by which rivals are excluded
    patch_m: float = 0.5
    excluded_sigmas: float = 3.0
    #: agreement along normals in the fit [sigmas of the residuals], at least [m]
    agrees_sigmas: float = 3.0
    agrees_m: float = 0.004
    #: poses that differ by less than this are the same: shift at the overlap [m]
    same_m: float = 0.3
    #: along an open direction a fit is nowhere near an approximate pose from so many of its sigmas
    slid_sigmas: float = 4.0
    #: a pose is that of one place if it moves b by less: shift [radii of the scans], turn [rad]
    still_radii: float = 0.02
    still_rad: float = float(np.radians(3.0))
    #: ... and rests on equal ranges if surfaces across the line of sight [cosine] at one range
    #: (share of it) make this share of the area that matches
    across_cosine: float = 0.97
    one_range: float = 0.01
    equal_share: float = 0.2
    #: turns and shifts that lay a scan on itself, at most, and how many of their products are tried
    own_most: int = 4
    own_products: int = 12
    #: a place that holds fewer directions than the best is none if more of what would exclude it
    #: is looked through
    hardly_through: float = 0.3
    #: proposals that are fitted, and those of them that differ only where nothing holds
    fitted: int = 5
    fitted_alike: int = 2


GATES = CloudPairGates()


class Origin(Enum):
    """What proposed a pose; the value is used in reports."""

    GIVEN = "approximate pose"
    PLAN = "plan"
    SLOPES = "slopes"
    FRAME = "one frame"
    KISS = "kiss-matcher"
    SYMMETRY = "what a scan has twice"


@dataclass(frozen=True, eq=False)
class Candidate:
    """A pose of scan b in scan a with its verdict."""

    pose: Pose  #: pose of b in a
    verdict: Verdict  #: what agrees and what contradicts it
    origin: Origin  #: what proposed it


def judged(
    a: PreparedScan, b: PreparedScan, proposed: Iterable[tuple[Pose, Origin]]
) -> list[Candidate]:
    """Make candidates of proposed poses, and of other places along directions left open."""
    size = _size(a, b)
    few = Indexed.of(_some(a.coarse)), Indexed.of(_some(b.coarse))
    looked: list[Candidate] = []
    for pose, origin in proposed:
        if any(_same(c.pose, pose, size) for c in looked):
            continue
        moved = align(
            few[0],
            few[1],
            pose,
            [k * size for k in GATES.first_gates_sizes],
            steps=GATES.first_steps,
        ).pose
        if any(_same(c.pose, moved, size) for c in looked):
            continue
        looked.append(_candidate(a, b, moved, origin, size))
    looked.sort(key=lambda c: -c.verdict.score)
    best = looked[0].verdict.score if looked else 0.0
    # where more is looked through than agrees, the best is looked at all the same
    least = min(best, GATES.best_share * best)
    good = [c for c in looked[: GATES.second_looks] if c.verdict.score >= least]
    # what the user gave is looked at in any case, and so is one frame
    certain = (Origin.GIVEN, Origin.FRAME)
    good += [c for c in looked if c.origin in certain and not any(c is other for other in good)]
    candidates = refined(a, b, good)
    slid = [place for c in candidates for place in _slid(a, b, few, c)]
    return refined(a, b, [*candidates, *slid]) if slid else candidates


def _slid(
    a: PreparedScan, b: PreparedScan, few: tuple[Indexed, Indexed], c: Candidate
) -> list[Candidate]:
    """Other places along a direction that surfaces leave open, where a candidate fits best.

    Along a wall, plans correlate as well in one place as in the next; only what stands before the
    wall, and who looked through it, tells which place is right.
    """
    size = _size(a, b)
    alignment = align(few[0], few[1], c.pose, [GATES.second_gates_sizes[-1] * size], steps=1)
    if len(alignment.matches) < GATES.fewest_matches:
        return []
    unheld = relative_covariance(few[0], few[1], alignment, sweep=False).unheld
    if unheld.shape[1] != 1 or np.linalg.norm(unheld[:3, 0]) < GATES.slide_share:
        return []
    along = unheld[:3, 0] / np.linalg.norm(unheld[:3, 0])
    steps = size * np.arange(-GATES.slide_places, GATES.slide_places + 1)
    places = [Pose(c.pose.rotation, c.pose.translation + s * along) for s in steps]
    seen = (a.view, b.view)
    scores = np.array([judge(*few, seen, p, GATES.agrees_sizes * size).score for p in places])
    out = []
    for _ in range(GATES.slid_kept):
        best = int(np.argmax(scores))
        if scores[best] < GATES.best_share * c.verdict.score:
            break
        out.append(_candidate(a, b, places[best], c.origin, size))
        scores[max(best - GATES.slid_apart, 0) : best + GATES.slid_apart + 1] = -np.inf
    return out


def _bays(a: PreparedScan, b: PreparedScan, best: PairFit) -> list[Candidate]:
    """Other places along the walls that nearly all of a pair's common surface stands along.

    A facade has the same window every few metres. What differs at its ends tells the bays of one
    scan apart, and need not be in what two scans have in common.
    """
    normal = best.alignment.matches.normal
    level = normal[np.abs(normal[:, 2]) < GATES.bay_upright, :2]
    if len(level) < GATES.fewest_matches:
        return []
    share, ways = np.linalg.eigh(level.T @ level)
    if share[0] > GATES.bay_share * share.sum():
        return []
    along, seen = np.append(ways[:, 0], 0.0), (a.view, b.view)
    few = [Indexed.of(one.some.surfels.thinned(GATES.bay_surfels)) for one in (a, b)]
    tolerance = max(GATES.agrees_m, GATES.agrees_sigmas * best.alignment.rms)
    count = round(GATES.bay_reach_m / GATES.bay_step_m)
    steps = GATES.bay_step_m * np.arange(-count, count + 1)
    pose = best.pose
    places = [Pose(pose.rotation, pose.translation + s * along) for s in steps]
    verdicts = [judge(few[0], few[1], seen, place, tolerance) for place in places]
    scores = np.array([v.score for v in verdicts])
    around = maximum_filter1d(scores, 2 * round(GATES.bay_apart_m / GATES.bay_step_m) + 1)
    top = np.flatnonzero((scores == around) & (np.abs(steps) >= GATES.bay_apart_m))
    top = top[scores[top] > GATES.clean_rival_share * scores[count]]
    out = [
        Candidate(places[k], verdicts[k], Origin.SYMMETRY)
        for k in top[np.argsort(-scores[top])][: GATES.bays]
    ]
    return out


def refined(a: PreparedScan, b: PreparedScan, some: Sequence[Candidate]) -> list[Candidate]:
    """Fit candidates with all coarse surfels."""
    size = _size(a, b)
    out: list[Candidate] = []
    for c in some:
        pose = align(
            a.coarse,
            b.coarse,
            c.pose,
            [k * size for k in GATES.second_gates_sizes],
            steps=GATES.second_steps,
        ).pose
        near = [k for k, o in enumerate(out) if _same(o.pose, pose, GATES.same_again * size)]
        if not near:
            out.append(_candidate(a, b, pose, c.origin, size))
        elif c.origin is Origin.GIVEN:
            # what the user gave stays known as such, whoever proposed it as well
            out[near[0]] = replace(out[near[0]], origin=c.origin)
    return sorted(out, key=lambda c: -c.verdict.score)


def apart(one: Pose, two: Pose) -> tuple[float, float]:
    """Shift [m] and turn [rad] between two poses of scan b in scan a, at the scanner of b."""
    shift = float(np.linalg.norm(one.translation - two.translation))
    return shift, float(np.linalg.norm(log(one.rotation @ two.rotation.T)))


def _size(a: PreparedScan, b: PreparedScan) -> float:
    """Typical size of the coarse surfels [m]."""
    return float(max(np.median(x.coarse.surfels.size) for x in (a, b)))


def _some(indexed: Indexed) -> Surfels:
    """Some surfels, evenly; each stands for several."""
    return indexed.surfels.thinned(GATES.first_surfels)


#: symmetries of scans that are at hand
_SYMMETRIES: WeakKeyDictionary[PreparedScan, tuple[Pose, ...]] = WeakKeyDictionary()


def symmetries(scan: PreparedScan) -> tuple[Pose, ...]:
    """Turns and shifts that lay a scan on itself, looked for once."""
    if scan not in _SYMMETRIES:
        _SYMMETRIES[scan] = _symmetries(scan)
    return _SYMMETRIES[scan]


def _symmetries(scan: PreparedScan) -> tuple[Pose, ...]:
    """Turns and shifts that lay a scan on itself without contradiction, the identity left out.

    Half and quarter turns of a room, the next storey of a stairwell, the next bay of a hall: what a
    scan has twice, the other scan may show at either place.
    """
    size, few = _size(scan, scan), Indexed.of(_some(scan.coarse))
    still, seen = Pose.identity(), (scan.view, scan.view)
    tolerance = GATES.agrees_sizes * size
    looked: list[Candidate] = []
    for pose in own_poses(scan.coarse.surfels):
        known = [still, *(c.pose for c in looked)]
        if any(_same(other, pose, size) for other in known):
            continue
        gates = [k * size for k in GATES.first_gates_sizes]
        moved = align(few, few, pose, gates, steps=GATES.first_steps).pose
        if any(_same(other, moved, size) for other in known):
            continue
        verdict = judge(few, few, seen, moved, tolerance)
        looked.append(Candidate(moved, verdict, Origin.SYMMETRY))
    looked.sort(key=lambda c: -c.verdict.score)
    good = refined(scan, scan, looked[: 2 * GATES.own_most])
    found = [c for c in good if _possible(c.verdict) and _consistent(c.verdict)]
    return tuple(c.pose for c in found if not _same(still, c.pose, size))[: GATES.own_most]


def _repeated(
    a: PreparedScan, b: PreparedScan, best: PairFit, floor: tuple[float, float]
) -> list[PairFit]:
    """Fits at the places where the scans may lie as well because one of them repeats itself.

    Such a place may have less overlap than the best and be right all the same: what the scanners
    saw is the same thing twice. Only what is looked through speaks against it, and residuals that
    are none of the best fit: a rough face lies on itself anywhere to some decimetres.
    """
    out: list[PairFit] = []
    tolerance = max(GATES.agrees_m, GATES.agrees_sigmas * best.alignment.rms)
    for c in _elsewhere(a, b, best.pose):
        fit = _fitted(a, b, c, floor)
        if fit is None or fit.verdict.agree < GATES.least_area_m2:
            continue
        closely = judge(a.some, b.some, (a.view, b.view), fit.pose, tolerance)
        if closely.consistency < GATES.least_consistency:
            continue
        if _open(best, fit) and not any(_alike(f, fit.pose) for f in (best, *out)):
            out.append(fit)
    return out


def _open(best: PairFit, fit: PairFit) -> bool:
    """True if nothing that is looked through speaks for the best place against another."""
    if not _clean(fit.verdict):
        return False
    if best.precision.rank < 6 <= fit.precision.rank + 1:
        # somewhere along an open direction it may agree better than where it was put
        return True
    through = _excess(fit.verdict.through, best.verdict.through)
    return through <= (1.0 if fit.precision.rank >= best.precision.rank else GATES.hardly_through)


def _elsewhere(a: PreparedScan, b: PreparedScan, pose: Pose) -> list[Candidate]:
    """Places of b in a that the symmetries of both scans make of one, and others along them."""
    size, places = _size(a, b), [pose]
    for place in symmetric_places(pose, symmetries(a), symmetries(b)):
        if not any(_same(known, place, size) for known in places):
            places.append(place)
    some = places[1 : 1 + GATES.own_products]
    found = refined(a, b, [_candidate(a, b, p, Origin.SYMMETRY, size) for p in some])
    few = Indexed.of(_some(a.coarse)), Indexed.of(_some(b.coarse))
    slid = [place for c in found[: GATES.own_most] for place in _slid(a, b, few, c)]
    return [*found, *refined(a, b, slid)]


def _same(one: Pose, two: Pose, size: float) -> bool:
    shift, turn = apart(one, two)
    return shift < GATES.same_sizes * size and turn < GATES.same_turn_rad


def _candidate(
    a: PreparedScan, b: PreparedScan, pose: Pose, origin: Origin, size: float
) -> Candidate:
    """A judged pose."""
    verdict = judge(a.coarse, b.coarse, (a.view, b.view), pose, GATES.agrees_sizes * size)
    return Candidate(pose, verdict, origin)


@dataclass(frozen=True, eq=False)
class PairFit:
    """A candidate fitted with all surfels."""

    alignment: FineAlignment  #: the alignment
    precision: RelativeCovariance  #: its covariance
    verdict: Verdict  #: what agrees and what contradicts it
    origin: Origin  #: what proposed it

    @property
    def pose(self) -> Pose:
        """Pose of b in a."""
        return self.alignment.pose


#: what is written of a pair that was registered
_FITTED = (
    "first_from_second",
    "relative_covariance",
    "overlap",
    "rms",
    "matches",
    "effective_matches",
    "correlation_length",
    "held_directions",
    "found_by",
)


@dataclass(frozen=True, eq=False)
class CloudPair(
    Result,
    without=("a", "b", "fit", "rivals"),
    also=("first", "second", "registered", *_FITTED),
    maybe=_FITTED,
):
    """One cloud placed in another with covariance, or the reason why not."""

    #: names of the scans
    a: str
    b: str
    fit: PairFit | None  #: the pose with its covariance, None if none may be taken
    rivals: tuple[PairFit, ...]  #: other places that fit as well
    sentences: tuple[str, ...]  #: what is weak, or why there is no pose

    first = part("a", str, "One scan.")
    second = part("b", str, "The other.")
    first_from_second = part("fit.pose.matrix", Matrix, "4 x 4.")
    relative_covariance = part(
        "fit.precision.covariance",
        Matrix,
        "6 x 6 of the translation in the first [m] and a rotation vector in the second.",
    )
    overlap = part("fit.verdict.overlap", tuple[Number, ...], "Share of each that the other sees.")
    rms = part("fit.alignment.rms", Number, "Of the residuals of the matches [m].")
    matches = part("fit.precision.observations", int, "Number of matches.")
    effective_matches = part("fit.precision.effective", Number, "As many independent ones.")
    correlation_length = part("fit.precision.correlation_length", Number, "Of residuals [m].")
    held_directions = part("fit.precision.rank", int, "Of six.")
    found_by = part("fit.origin.value", str, "What proposed the pose.")

    @property
    def registered(self) -> bool:
        """True if it has a pose."""
        return self.fit is not None

    @property
    def open(self) -> OpenPair | None:
        """The places between which nothing decides, None if it has a pose or no place."""
        if self.fit is not None or not self.rivals:
            return None
        return OpenPair(self.a, self.b, tuple(f.pose for f in self.rivals))


def register_pair(
    a: PreparedScan,
    b: PreparedScan,
    prior: Pose | None = None,
    *,
    sigma: ApproximateSigma = APPROXIMATE,
    floor: tuple[float, float] = COVARIANCE.floor,
    speaks: str = "the approximate pose",
) -> CloudPair:
    """Find the pose of scan b in scan a without approximate values.

    The prior is one proposal among others and decides between places that fit alike; if it is
    wrong, a sentence says so, with what it ``speaks`` from. ``floor``: [m], [rad].
    """
    proposed = [] if prior is None else [(prior, Origin.GIVEN)]
    proposed += [(p, Origin.PLAN) for p in plan_poses(a.coarse.surfels, b.coarse.surfels)]
    level = levelled_pose(a.coarse.surfels, b.coarse.surfels)
    frames = [Pose.identity()] if level is None else [Pose.identity(), level]
    proposed += [(pose, Origin.FRAME) for pose in frames]
    fits, most = _fits(a, b, proposed, floor)
    tried = [Origin.GIVEN] * (prior is not None) + [Origin.PLAN, Origin.FRAME]
    for further, origin in ((slope_poses, Origin.SLOPES), (kiss_poses, Origin.KISS)):
        if fits and _consistent(fits[0].verdict):
            break
        places = further(a.coarse.surfels, b.coarse.surfels)
        if places:
            tried.append(origin)
            more, share = _fits(a, b, [(pose, origin) for pose in places], floor)
            fits, most = sorted([*fits, *more], key=lambda f: -f.verdict.score), max(most, share)
    carried = [f for f in fits if _carried_along(a, b, f)]
    fits = [f for f in fits if not any(f is c for c in carried)]
    if carried and not (fits and _consistent(fits[0].verdict)):
        return CloudPair(a.name, b.name, None, (), (_suspect(a.name, b.name, carried[0]),))
    if not fits:
        return CloudPair(a.name, b.name, None, (), (_not_found(a.name, b.name, most, tried),))
    best = fits[0] if prior is None else _nearest(fits, prior)
    if not _consistent(best.verdict):
        return CloudPair(a.name, b.name, None, (), (_contradicted(a.name, b.name, best),))
    for c in _bays(a, b, best):
        fit = _fitted(a, b, c, floor)
        # the right bay is held as well as the wrong one
        held = fit is not None and fit.precision.rank >= best.precision.rank
        if fit is not None and held and not any(_alike(f, fit.pose) for f in fits):
            fits.append(fit)
    rivals = _rivals(best, [f for f in fits if f is not best])
    rivals += [
        f
        for f in _repeated(a, b, best, floor)
        if not any(_alike(rival, f.pose) for rival in rivals)
    ]
    at = None if prior is None else _at_prior(a, b, prior, sigma, floor)
    if at is not None and not any(_alike(f, at.pose) for f in (best, *rivals)):
        rivals.append(at)
    near = None if prior is None else _decided((best, *rivals), prior, sigma)
    far = GATES.slid_sigmas * sigma.shift
    if rivals and prior is not None and near is not None:
        placed = _with_all(a, b, near, floor, prior, far) if _possible(near.verdict) else None
        if placed is None or apart(placed.pose, prior)[0] > far:
            sentence = (
                _too_little(a.name, b.name, prior, best)
                if placed is None
                else _far_off(a.name, b.name, prior, placed)
            )
            return CloudPair(a.name, b.name, None, (best, *rivals), (sentence,))
        sentence = (
            f"{a.name} and {b.name} may lie in {len(rivals) + 1} places that look alike; "
            f"the one that {speaks} speaks for is taken"
        )
        sentences = [sentence, *placed.precision.sentences(a.name, b.name)]
        return CloudPair(a.name, b.name, placed, (), tuple(sentences))
    if rivals:
        sentence = _ambiguous(a.name, b.name, best, rivals)
        return CloudPair(a.name, b.name, None, (best, *rivals), (sentence,))
    told = None if prior is None or _wrong(best, prior, sigma) else prior
    placed = _with_all(a, b, best, floor, told, far)
    if placed is None:
        assert prior is not None
        sentence = _too_little(a.name, b.name, prior, best)
        return CloudPair(a.name, b.name, None, (), (sentence,))
    sentences = placed.precision.sentences(a.name, b.name)
    if prior is not None:
        sentences += _prior_sentences(a.name, b.name, placed, prior, sigma)
    return CloudPair(a.name, b.name, placed, (), tuple(sentences))


def _fits(
    a: PreparedScan,
    b: PreparedScan,
    proposed: Sequence[tuple[Pose, Origin]],
    floor: tuple[float, float],
) -> tuple[list[PairFit], float]:
    """Proposals with all surfels, those with enough overlap, the best first; the most overlap."""
    fits: list[PairFit] = []
    candidates = judged(a, b, proposed)
    most = max((max(c.verdict.overlap) for c in candidates), default=0.0)
    for c in candidates:
        alike = sum(_alike(f, c.pose) for f in fits)
        room = len(fits) < GATES.fitted and alike < GATES.fitted_alike
        if _possible(c.verdict) and (room or c.origin is Origin.GIVEN):
            fit = _fitted(a, b, c, floor)
            fits += [] if fit is None else [fit]
    fits = sorted((f for f in fits if _possible(f.verdict)), key=lambda f: -f.verdict.score)
    return fits, most


def _fitted(
    a: PreparedScan, b: PreparedScan, c: Candidate, floor: tuple[float, float]
) -> PairFit | None:
    """A candidate with some of the fine surfels; None if hardly any match."""
    alignment = align(a.some, b.some, c.pose)
    if len(alignment.matches) < GATES.fewest_matches:
        return None
    precision = relative_covariance(a.some, b.some, alignment, floor, sweep=False)
    tolerance = max(GATES.agrees_m, GATES.agrees_sigmas * alignment.rms)
    verdict = judge(a.some, b.some, (a.view, b.view), alignment.pose, tolerance)
    return PairFit(alignment, precision, verdict, c.origin)


def _at_prior(
    a: PreparedScan,
    b: PreparedScan,
    prior: Pose,
    sigma: ApproximateSigma,
    floor: tuple[float, float],
) -> PairFit | None:
    """The fit at an approximate pose; None if nothing agrees or something speaks against it."""
    start = _candidate(a, b, prior, Origin.GIVEN, _size(a, b))
    fit = _fitted(a, b, refined(a, b, [start])[0], floor)
    if fit is None or fit.verdict.agree < GATES.least_area_m2 or _wrong(fit, prior, sigma):
        return None
    return fit if _clean(fit.verdict) else None


def _with_all(
    a: PreparedScan,
    b: PreparedScan,
    fit: PairFit,
    floor: tuple[float, float],
    prior: Pose | None = None,
    far: float = np.inf,
) -> PairFit | None:
    """The chosen one with all surfels, and the test whether the scanners stood still.

    Along what is open it is where an approximate pose has it, if nothing contradicts that; None if
    too little overlaps there and that place is ``far`` away [m].
    """
    alignment, scans = fit.alignment, (a.some, b.some)
    if a.some is not a.fine or b.some is not b.fine:
        alignment, scans = align(a.fine, b.fine, fit.pose, FINE.gates_m[1:]), (a.fine, b.fine)
    if len(alignment.matches) < len(fit.alignment.matches):
        alignment, scans = fit.alignment, (a.some, b.some)
    precision = relative_covariance(*scans, alignment, floor)
    if precision.unheld.shape[1]:
        held = fit_held(scans, (a.some, b.some), alignment, precision, floor)
        if prior is not None:
            pose = slid_to(alignment.pose, prior, precision)
            slid = fit_held(
                scans, (a.some, b.some), replace(alignment, pose=pose), precision, floor
            )
            there = _candidate(a, b, slid[0].pose, Origin.GIVEN, _size(a, b)).verdict
            if slid[1] is not precision and _possible(there) and _consistent(there):
                held = slid
            elif not _possible(there) and apart(pose, alignment.pose)[0] > far:
                return None
        alignment, precision = held
    alignment, precision = with_shared_errors(scans, alignment, precision, floor)
    return replace(fit, alignment=alignment, precision=precision)


def _possible(v: Verdict) -> bool:
    """True if enough of the scans overlaps."""
    return max(v.overlap) >= GATES.least_overlap and v.agree >= GATES.least_area_m2


def _consistent(v: Verdict) -> bool:
    """True if what overlaps agrees."""
    return v.consistency >= GATES.least_consistency and _clean(v)


def _clean(v: Verdict) -> bool:
    """True if no more is looked through than what moves between two scans."""
    allowed = GATES.moved_share * v.agree + GATES.moved_standing_share * v.standing
    return v.surely_through <= allowed


def _carried_along(a: PreparedScan, b: PreparedScan, fit: PairFit) -> bool:
    """True if a pose near identity rests on points that go with the scanners, at one range.

    Beams without return that are written at one range are a shell about either scanner; the shells
    agree where the scanners lie on each other, wherever they stood. The pose is judged again
    without what faces the scanner at that range.
    """
    shift, turn = apart(fit.pose, Pose.identity())
    if shift > GATES.still_radii * min(a.radius, b.radius) or turn > GATES.still_rad:
        return False
    s, m = a.some.surfels, fit.alignment.matches
    across, ranges = _across(s)
    area = s.area[m.first]
    facing = across[m.first]
    if not facing.any():
        return False
    far = float(np.median(ranges[m.first][facing]))
    alike = facing & (np.abs(ranges[m.first] / far - 1) < GATES.one_range)
    if area[alike].sum() < GATES.equal_share * area.sum():
        return False
    rest = []
    for scan in (a, b):
        across, ranges = _across(scan.some.surfels)
        shell = across & (np.abs(ranges / far - 1) < GATES.one_range)
        if (~shell).sum() < GATES.fewest_matches:
            return True
        rest.append(Indexed.of(scan.some.surfels.subset(~shell)))
    tolerance = max(GATES.agrees_m, GATES.agrees_sigmas * fit.alignment.rms)
    verdict = judge(rest[0], rest[1], (a.view, b.view), fit.pose, tolerance)
    return not (_possible(verdict) and _consistent(verdict))


def _across(s: Surfels) -> tuple[Mask, Array]:
    """Which surfels (n,) lie across the line of sight, and their ranges (n,) [m]."""
    ranges = np.linalg.norm(s.center, axis=1)
    return np.abs(np.einsum("ni,ni->n", s.normal, s.center)) > GATES.across_cosine * ranges, ranges


def _rivals(best: PairFit, others: Sequence[PairFit]) -> list[PairFit]:
    """Fits at other places that the evidence does not exclude."""
    return [f for f in others if not _alike(best, f.pose) and not _excluded(best, f)]


def _excluded(best: PairFit, other: PairFit) -> bool:
    """True if clearly less agrees, or clearly more is seen through, or both nearly so."""
    through = _excess(other.verdict.through, best.verdict.through)
    clean = _excess(best.verdict.through, other.verdict.through) > 1
    share = GATES.clean_rival_share if clean else GATES.rival_share
    less = (1 - other.verdict.agree / best.verdict.agree) / (1 - share)
    return bool(np.hypot(max(less, 0.0), max(through, 0.0)) > 1)


def _excess(one: float, two: float) -> float:
    """By how much an area is larger than another, one where it is clearly more than chance.

    Areas in m^2; chance is that of independent patches.
    """
    more, less = one / GATES.patch_m**2, two / GATES.patch_m**2
    return float((more - less) / (GATES.excluded_sigmas * np.sqrt(more + less + 1.0)))


def _nearest(fits: Sequence[PairFit], prior: Pose) -> PairFit:
    """Of the best fit and those that differ from it only where nothing holds, the nearest."""
    alike = [f for f in fits if f is fits[0] or _alike(fits[0], f.pose)]
    return min(alike, key=lambda f: apart(f.pose, prior)[0])


def _alike(one: PairFit, pose: Pose) -> bool:
    """True if a pose differs from a fit only along directions that nothing holds."""
    middle, lever = one.precision.middle, one.precision.lever
    moved = pose @ (one.pose.inverse @ middle) - middle
    turn = apart(one.pose, pose)[1]
    direction = np.concatenate([moved, np.zeros(3)])
    unheld = one.precision.unheld
    rest = direction - unheld @ (unheld.T @ direction)
    return bool(np.linalg.norm(rest) < GATES.same_m and turn * lever < GATES.same_m)


def _decided(fits: Sequence[PairFit], prior: Pose, sigma: ApproximateSigma) -> PairFit | None:
    """Of fits at several places the one that an approximate pose speaks for, None without."""
    found = sigma.likely([_off(fit, prior) for fit in fits])
    if found is None:
        return None
    best = fits[found[0]]
    if not all(_alike(best, fits[k].pose) for k in found[1]):
        return None
    same = [f for f in fits if f is best or _alike(best, f.pose)]
    return min(same, key=lambda f: apart(f.pose, prior)[0])


def _wrong(fit: PairFit, prior: Pose, sigma: ApproximateSigma) -> bool:
    """True if an approximate pose is nowhere near."""
    return sigma.wrong(*_off(fit, prior))


def _off(fit: PairFit, prior: Pose) -> tuple[float, float]:
    """Shift [m] and turn [rad] of an approximate pose, but for shifts that the fit leaves open."""
    off = prior.translation - fit.pose.translation
    slides = fit.precision.unheld[
        :3, np.linalg.norm(fit.precision.unheld[:3], axis=0) > GATES.slide_share
    ]
    basis = np.linalg.qr(slides)[0]
    return float(np.linalg.norm(off - basis @ (basis.T @ off))), apart(fit.pose, prior)[1]


def _not_found(a: str, b: str, most: float, tried: Sequence[Origin]) -> str:
    return Sentence(
        "no place was found for {b} in {a}: of the places tried ({tried}) the "
        "best lets {most} of one scan agree with the other, less than {least} or too "
        "small an area; give an approximate pose, or targets",
        a=a,
        b=b,
        tried=", ".join(origin.value for origin in tried),
        most=percent(most),
        least=percent(GATES.least_overlap),
    )


def _suspect(a: str, b: str, fit: PairFit) -> str:
    shift, turn = apart(fit.pose, Pose.identity())
    return Sentence(
        "no pose between {a} and {b} is taken: where they fit best they lie on each "
        "other ({shift:mm0} and {turn:degrees1} apart), and what agrees there are "
        "points at equal ranges from either scanner, as beams without return make "
        "them; without these the scans do not agree",
        a=a,
        b=b,
        shift=shift,
        turn=turn,
    )


def _too_little(a: str, b: str, prior: Pose, best: PairFit) -> str:
    shift, turn = apart(best.pose, prior)
    return Sentence(
        "no pose between {a} and {b} is taken: nothing contradicts the approximate pose, but too "
        "little of the scans overlaps there to register them; they look alike {shift:2} m and "
        "{turn:degrees0} from it as well, with an overlap of {overlap}",
        a=a,
        b=b,
        shift=shift,
        turn=turn,
        overlap=percent(max(best.verdict.overlap)),
    )


def _far_off(a: str, b: str, prior: Pose, placed: PairFit) -> str:
    return Sentence(
        "no pose between {a} and {b} is taken: several places look alike, and where the scans fit "
        "nearest to the approximate pose they lie {shift:2} m from it; give a better one, or "
        "targets",
        a=a,
        b=b,
        shift=apart(placed.pose, prior)[0],
    )


def _contradicted(a: str, b: str, best: PairFit) -> str:
    v = best.verdict
    share = v.through / max(v.agree, 1e-9)
    return Sentence(
        "no pose between {a} and {b} is taken: where they fit best {percent} of the "
        "overlap agrees, and for every 100 m2 that agree the other scanner looked "
        "through {share:1} m2",
        a=a,
        b=b,
        percent=percent(v.consistency),
        share=100 * share,
    )


def _ambiguous(a: str, b: str, best: PairFit, rivals: Sequence[PairFit]) -> str:
    shift, turn = apart(best.pose, rivals[0].pose)
    count = len(rivals) + 1
    return Sentence(
        "{a} and {b} may lie in {count} places that look alike, {shift:2} m and "
        "{turn:degrees0} apart (something repeats itself, or is symmetric): no pose is taken from "
        "them",
        a=a,
        b=b,
        count=count,
        shift=shift,
        turn=turn,
    )


def _prior_sentences(
    a: str, b: str, fit: PairFit, prior: Pose, sigma: ApproximateSigma
) -> list[str]:
    if not _wrong(fit, prior, sigma):
        return []
    shift, turn = _off(fit, prior)
    return [
        Sentence(
            "the approximate pose of {b} in {a} is wrong by {shift:1} m and "
            "{turn:degrees0}; the clouds say otherwise",
            b=b,
            a=a,
            shift=shift,
            turn=turn,
        )
    ]
