"""Names the targets of all scans, without names and approximate poses.

Each scan is matched by the distances between its targets to the points that are known; a placed
scan adds its other targets to the known points, so that scans which see no control at all follow
(method section 8.4). A scan that fits in more than one way is not guessed: it waits until more
points are known, and if it stays ambiguous it is refused. Targets that two scans see and nobody
named become tie points. Stations whose relative poses are known already, from planes or clouds, are
matched as one. Where targets are too few, an antenna on the scanner whose place and lever arm are
known counts as one more. Metres; poses are world from scanner.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.registration.matching import Matching, match
from tribrach.registration.rigid_units import Mounted, RigidUnit, Sighting, rigid_units
from tribrach.sentences import Sentence

__all__ = [
    "Identification",
    "IdentifyGates",
    "Mounted",
    "Obstacle",
    "Sighting",
    "Unplaced",
    "identify",
    "is_tie_point",
]


@dataclass(frozen=True)
class IdentifyGates:
    """When scans are placed by their targets, and when two targets are one.

    Chosen by hand with test_identify.
    """

    #: a target and a point are the same within this many sigmas of their distance ...
    same_sigmas: float = 6.0
    pose_error_m: float = 0.02  #: ... plus what an approximate pose may be wrong by [m] ...
    drift_sigmas: float = 4.0  #: ... and this many sigmas of its drift
    #: a floor for the sigma of targets and points in matching, so that small systematic errors of
    #: a scanner do not part what belongs together [m]
    matching_floor_m: float = 0.003
    #: matchings of this many targets place a scan even where a smaller second solution exists;
    #: three distances agree by chance where there are many points, six do not
    sure_targets: int = 6
    #: as many targets place a scan on what one station saw (one less if it is levelled)
    one_station_targets: int = 4
    #: so many targets that fit points with East and North swapped are no accident
    mirrored_targets: int = 4


GATES = IdentifyGates()

#: how the names of tie points begin, targets that two stations see and nobody named
_TIE = "tie "


def is_tie_point(name: str) -> bool:
    """True if a name was given here to a target that two stations see and nobody else names."""
    return name.startswith(_TIE)


class Obstacle(Enum):
    """Why a station is not placed by its targets."""

    NO_FIT = "its targets fit no points"
    AMBIGUOUS = "its targets fit in several ways"


@dataclass(frozen=True)
class Unplaced:
    """A station, or several joined ones, that targets do not place."""

    obstacle: Obstacle  #: what keeps it from being placed
    words: str  #: the reason in words


@dataclass(frozen=True, eq=False)
class _Placed:
    """A matching that places a unit, with the number of antennas that took part."""

    matching: Matching
    antennas: int = 0

    @property
    def size(self) -> int:
        """Number of targets and antennas that fit."""
        return len(self.matching.pairs) + self.antennas


@dataclass(frozen=True)
class Identification:
    """Names of targets, poses of stations, and how they came about."""

    #: names by station (n,), in the order of its detections; empty for a target that nothing else
    #: saw
    names: Mapping[str, tuple[str, ...]]
    poses: Mapping[str, Pose]  #: poses of the placed stations, world from scanner
    sentences: tuple[str, ...]  #: how each station was placed
    #: why the other stations were not placed
    unplaced: Mapping[str, Unplaced] = field(default_factory=dict)
    #: true if the poses are in the frame of a station, because no scan sees given points
    adrift: bool = False


def identify(
    sightings: Sequence[Sighting],
    points: Mapping[str, tuple[Array, float]],
    *,
    free: bool = False,
    groups: Sequence[Mapping[str, Pose]] = (),
    partial: bool = False,
) -> Identification:
    """Name the targets of all scans.

    ``points`` are known without the scans, with one sigma each [m]. ``free``: something else places
    the stations; if none sees three of the points, the unit with most targets becomes the frame, as
    it does without points. ``groups``: stations whose relative poses are known, each group in its
    own frame. ``partial``: leave out what cannot be placed, with the reason, instead of refusing
    it.
    """
    search = _Search(Pool(points))
    waiting = rigid_units(sightings, groups)
    while waiting:
        placed = search.place_some(waiting)
        if not placed and not search.poses and (free or not points):
            search.take_as_frame(waiting[0])
            placed = [waiting[0]]
        if not placed:
            joined = next((u for u in waiting if len(u.own) > 1), None)
            if joined is None:
                break
            reason = search.unplaced[joined.name].words
            search.say(
                Sentence(
                    "{joined.name}: {reason}; matched one by one instead",
                    joined=joined,
                    reason=reason,
                )
            )
            waiting = [u for u in waiting if u is not joined] + joined.apart()
            continue
        waiting = [u for u in waiting if u not in placed]
    if waiting and not partial:
        raise _refusal([u.sighting for u in waiting], search.unplaced, Pool(points))
    seen = [s for s in sightings if s.station in search.poses]
    order = dict.fromkeys([*(s.station for s in seen), *search.poses])
    names = _final_names(seen, search, Pool(points))
    return Identification(
        names=names,
        poses={name: search.poses[name] for name in order},
        sentences=(*search.sentences, *_alone_sentences(names)),
        unplaced={name: search.unplaced[u.name] for u in waiting for name in u.members},
        adrift=search.adrift,
    )


class _Search:
    """Units placed one after the other, by the points known so far.

    ``pool`` holds these points, ``poses`` the placed stations, ``drift`` how uncertain a pose makes
    the targets of its station (n,) [m]. ``adrift`` is true if the poses are in the frame of a
    station, not in that of the points. ``unplaced`` says by the name of a unit why it was not
    placed when last tried, ``sentences`` how units were placed.
    """

    def __init__(self, pool: Pool) -> None:
        self.pool = pool
        self.poses: dict[str, Pose] = {}
        self.drift: dict[str, Array] = {}
        self.adrift = False
        self.unplaced: dict[str, Unplaced] = {}
        self.sentences: list[str] = []
        #: of each unit, and for how many stations of the pool it was found
        self._outcomes: dict[str, tuple[int, _Placed | Unplaced]] = {}
        #: matchings of a unit with what one station saw; neither changes
        self._alone: dict[tuple[str, str], Matching | None] = {}

    def say(self, sentence: str) -> None:
        """Add a sentence."""
        self.sentences.append(sentence)

    def take_as_frame(self, unit: RigidUnit) -> None:
        """Let a unit hold the frame, since no scan sees given points."""
        self._settle(unit, Pose.identity(), None)
        self.say(f"{unit.name} is the frame of the matching: no scan sees given points")
        self.adrift = True

    def place_some(self, waiting: Sequence[RigidUnit]) -> list[RigidUnit]:
        """Units that are placed now: by many targets before any is placed by few."""
        for least in range(GATES.sure_targets, 1, -1):
            placed = [unit for unit in waiting if self._place(unit, least)]
            if placed:
                return placed
        return []

    def _place(self, unit: RigidUnit, least: int) -> bool:
        """Place a unit by a least number of targets and antennas, or note why it is not."""
        placed = len(self.pool.stations)
        known, outcome = self._outcomes.get(unit.name, (-1, None))
        if outcome is None or known != placed:
            outcome = self._outcome(unit)
            self._outcomes[unit.name] = placed, outcome
        if isinstance(outcome, Unplaced):
            self.unplaced[unit.name] = outcome
            return False
        if outcome.size < least:
            return False
        matching = outcome.matching
        self._settle(unit, Pose(matching.rotation, matching.translation), matching)
        rms = np.sqrt(matching.chi_square / max(1, 3 * outcome.size))
        verb, whose = ("are", "their") if len(unit.members) > 1 else ("is", "its")
        helped = f" and {_antennas(outcome.antennas)}" if outcome.antennas else ""
        self.say(
            Sentence(
                "{unit.name} {verb} placed by {matching} of {whose} {unit2} targets{helped}, "
                "off by {rms:1} times what the search for names expects (root mean square, "
                "before the adjustment)",
                unit=unit,
                verb=verb,
                matching=len(matching.pairs),
                whose=whose,
                unit2=len(unit.sighting.centers),
                helped=helped,
                rms=rms,
            )
        )
        return True

    def _outcome(self, unit: RigidUnit) -> _Placed | Unplaced:
        """The matching with all points, those of one station, or with antennas; or why none."""
        sighting = unit.sighting
        try:
            matching = _match(sighting, self.pool)
        except InputError as error:
            unplaced = Unplaced(Obstacle.NO_FIT, error.what)
        else:
            if not matching.ambiguous or _decided(matching):
                return _Placed(matching)
            ways = len(matching.others) + 1
            words = f"{len(matching.pairs)} targets fit in {ways} ways"
            unplaced = Unplaced(Obstacle.AMBIGUOUS, words)
        alone = self._by_one_station(unit.name, sighting)
        if alone is not None:
            return _Placed(alone)
        if sighting.mounted and not self.adrift:
            return _by_antennas(sighting, self.pool) or unplaced
        return unplaced

    def _by_one_station(self, name: str, sighting: Sighting) -> Matching | None:
        """The best matching with what one placed station saw; None if none is free of doubt.

        Points from both ends of a chain of stations lie beside each other by its drift: all
        together they fit nothing, those of a single station fit. What a station saw stays as it is,
        so each unit is matched with it once.
        """
        best: Matching | None = None
        for station in self.pool.stations:
            key = name, station
            if key not in self._alone:
                self._alone[key] = _with_station(sighting, self.pool, station)
            matching = self._alone[key]
            if matching is not None and (best is None or len(matching.pairs) > len(best.pairs)):
                best = matching
        return best

    def _settle(self, unit: RigidUnit, pose: Pose, matching: Matching | None) -> None:
        """Note the poses of a unit's stations and what they see."""
        for station, in_unit in unit.members.items():
            self.poses[station] = pose @ in_unit
        for s in unit.own:
            drift = np.zeros(len(s.centers))
            if matching is not None:
                start = self.pool.drift_of(matching.pairs[:, 1])
                drift = np.hypot(start, matching.placed_sigma(unit.members[s.station] @ s.centers))
            self.drift[s.station] = drift
            self.pool.add(s, self.poses[s.station] @ s.centers, drift)


def _antennas(count: int) -> str:
    return "the antenna" if count == 1 else f"{count} antennas"


def _by_antennas(sighting: Sighting, pool: Pool) -> _Placed | Unplaced | None:
    """Match targets that are too few by themselves, together with the antennas on the scanners.

    The pairs of the matching are those of the targets. None where the antennas do not fit; unplaced
    where they leave several ways.
    """
    try:
        matching = _match(sighting, pool, mounted=sighting.mounted)
    except InputError:
        return None
    antennas = len(sighting.mounted)
    targets = matching.pairs[matching.pairs[:, 0] < len(sighting.centers)]
    if len(matching.pairs) - len(targets) < antennas:
        return None
    if matching.ambiguous:
        ways = len(matching.others) + 1
        words = f"{len(targets)} targets and {_antennas(antennas)} fit in {ways} ways"
        return Unplaced(Obstacle.AMBIGUOUS, words)
    return _Placed(replace(matching, pairs=targets), antennas)


def _with_station(sighting: Sighting, pool: Pool, station: str) -> Matching | None:
    """The matching with what one placed station saw, None if there is none or it is in doubt."""
    chosen = pool.seen_by(station)
    try:
        matching = _match(sighting, pool, chosen=chosen)
    except InputError:
        return None
    least = GATES.one_station_targets - (1 if sighting.levelled else 0)
    if matching.ambiguous or len(matching.pairs) < least:
        return None
    pairs = np.stack([matching.pairs[:, 0], chosen[matching.pairs[:, 1]]], axis=1)
    return replace(matching, pairs=pairs)


def _match(
    sighting: Sighting,
    pool: Pool,
    axes: tuple[int, int, int] = (0, 1, 2),
    chosen: Index | None = None,
    mounted: Sequence[Mounted] = (),
) -> Matching:
    """Match the targets of a scan to the pool.

    ``axes`` is the order in which coordinates of the pool are taken, ``chosen`` the points that
    count. Antennas count as targets, and as points behind the others.
    """
    needed = 2 if sighting.levelled else 3
    n = len(sighting.centers)
    if n + len(mounted) < needed:
        raise InputError(f"{n} targets found and {needed} needed")
    numbers = np.arange(len(pool.names)) if chosen is None else chosen
    position = {int(number): k for k, number in enumerate(numbers)}
    known = {
        i: position[pool.called[name]]
        for i, name in sighting.known.items()
        if pool.called.get(name) in position
    }
    known |= {n + k: len(numbers) + k for k in range(len(mounted))}
    arms = np.array([m.arm for m in mounted]).reshape(-1, 3)
    places = np.array([m.xyz for m in mounted]).reshape(-1, 3)
    sigmas = np.append(sighting.sigmas, [m.sigma_arm for m in mounted])
    return match(
        np.concatenate([sighting.centers, arms]),
        np.concatenate([pool.xyz[numbers], places])[:, axes],
        sigma_targets=np.hypot(sigmas, GATES.matching_floor_m),
        sigma_points=np.append(pool.sigmas[numbers], [m.sigma for m in mounted]),
        levelled=sighting.levelled,
        known=known,
    )


def _decided(matching: Matching) -> bool:
    """True if all rivals of a large matching share all but one of its pairs."""
    if len(matching.pairs) < GATES.sure_targets:
        return False
    pairs = {(int(i), int(j)) for i, j in matching.pairs}
    return all(len(pairs - {(int(i), int(j)) for i, j in o}) <= 1 for o in matching.others)


def _refusal(
    waiting: Sequence[Sighting], unplaced: Mapping[str, Unplaced], given: Pool
) -> InputError:
    """Why the rest could not be placed."""
    ambiguous = {name for name, u in unplaced.items() if u.obstacle is Obstacle.AMBIGUOUS}
    for sighting in waiting:
        if sighting.station not in ambiguous and _mirrored(sighting, given):
            return InputError(
                f"the targets of station {sighting.station} fit the list of points only with its "
                "first two columns swapped (the determinant is -1)",
                cure="check which column is East and which is North",
            )
    first = waiting[0].station
    more = len(waiting) - 1
    others = f" (nor can {more} other station{'s' * (more > 1)})" if more else ""
    reason = unplaced[first].words if first in unplaced else ""
    cure = "see the detections of the station, or name three of its targets"
    if first in ambiguous:
        cure = "name one of its targets in the project file, or add a target without symmetry"
    return InputError(
        f"station {first} cannot be matched to the points and the other stations: {reason}{others}",
        cure=cure,
    )


def _mirrored(sighting: Sighting, given: Pool) -> bool:
    """True if a scan fits the given points with East and North swapped."""
    try:
        swapped = _match(sighting, given, (1, 0, 2))
    except InputError:
        return False
    return len(swapped.pairs) >= GATES.mirrored_targets


def _final_names(
    sightings: Sequence[Sighting], search: _Search, pool: Pool
) -> dict[str, tuple[str, ...]]:
    """Name detections by the nearest given point within its gate, leftovers as tie points."""
    for s in sightings:
        world = search.poses[s.station] @ s.centers
        pool.add(s, world, search.drift[s.station])
    return {s.station: tuple(pool.names_of(s.station)) for s in sightings}


def _alone_sentences(names: Mapping[str, tuple[str, ...]]) -> list[str]:
    """Which stations see targets that nothing else saw."""
    alone = {station: own.count("") for station, own in names.items()}
    return [
        f"{station}: {count} of {len(names[station])} targets "
        f"{'is' if count == 1 else 'are'} seen by no other station and "
        f"{'is no known point' if count == 1 else 'are no known points'}"
        for station, count in alone.items()
        if count
    ]


class Pool:
    """Points known so far, given or seen: ``xyz`` (m, 3) and ``sigmas`` (m,) [m]."""

    def __init__(self, points: Mapping[str, tuple[Array, float]]) -> None:
        self.names: list[str] = list(points)
        self.xyz: Array = np.array([xyz for xyz, _ in points.values()]).reshape(-1, 3)
        self.sigmas: Array = np.array([sigma for _, sigma in points.values()], dtype=np.float64)
        self._drift: Array = np.zeros(len(points))
        self._kinds: list[str] = [""] * len(points)
        self._given = len(points)
        self._seen: dict[str, Index] = {}
        #: numbers of points by the names that they were given, here or by the user in a scan
        self.called: dict[str, int] = {name: k for k, name in enumerate(points)}

    def add(self, sighting: Sighting, xyz: Array, drift: Array) -> None:
        """Assign targets of a placed station one to one; those left over become new points.

        ``drift`` is what the station's pose adds to their uncertainty [m].

        The drift is common to what one station saw, so it counts when a chain of stations meets its
        beginning, and not in the distances between points of one station.
        """
        sigmas, kinds = sighting.sigmas, sighting.kinds
        named = {i: self.called[n] for i, n in sighting.known.items() if n in self.called}
        place = self._assign(xyz, sigmas, kinds, drift, named)
        for i in np.flatnonzero(place < 0).tolist():
            place[i] = len(self.names)
            self.names.append(f"{_TIE}{len(self.names) - self._given + 1}")
            self.xyz = np.vstack([self.xyz, xyz[i]])
            self.sigmas = np.append(self.sigmas, sigmas[i])
            self._drift = np.append(self._drift, drift[i])
            self._kinds.append(kinds[i])
        for i, j in enumerate(place.tolist()):
            self._kinds[j] = kinds[i]
        self._seen[sighting.station] = place
        self.called = {n: int(place[i]) for i, n in sighting.known.items()} | self.called

    def drift_of(self, numbers: Index) -> float:
        """Root mean square of the drifts of some points [m]."""
        return float(np.sqrt((self._drift[numbers] ** 2).mean())) if len(numbers) else 0.0

    def seen_by(self, station: str) -> Index:
        """Points that a station saw."""
        return self._seen[station]

    @property
    def stations(self) -> list[str]:
        """Names of the stations that were added."""
        return list(self._seen)

    def names_of(self, station: str) -> list[str]:
        """Names of the targets of a station."""
        used = np.bincount(np.concatenate(list(self._seen.values())), minlength=len(self.names))
        alone = (used < 2) & (np.arange(len(self.names)) >= self._given)
        return ["" if alone[j] else self._final(int(j), alone) for j in self._seen[station]]

    def _final(self, j: int, alone: NDArray[np.bool_]) -> str:
        """The name of a point; tie points are numbered without those seen only once."""
        if j < self._given:
            return self.names[j]
        return f"{_TIE}{int((~alone[self._given : j]).sum()) + 1}"

    def _assign(
        self,
        xyz: Array,
        sigmas: Array,
        kinds: Sequence[str],
        drift: Array,
        named: Mapping[int, int],
    ) -> Index:
        """Number of the point of each target, -1 for none; those of named targets are given."""
        place = np.full(len(xyz), -1, dtype=np.int64)
        if len(self.names) == 0 or len(xyz) == 0:
            return place
        distance = np.linalg.norm(xyz[:, None] - self.xyz[None], axis=2)
        gate = GATES.same_sigmas * np.hypot(sigmas[:, None], self.sigmas[None])
        gate += GATES.pose_error_m
        gate += GATES.drift_sigmas * np.hypot(drift[:, None], self._drift[None])
        own, known = np.array(kinds, dtype=object), np.array(self._kinds, dtype=object)
        alike = (known == "") | (own[:, None] == known)
        cost = np.where(alike & (distance < gate), distance / gate, 1e3)
        for i, j in named.items():
            # a given point that lies elsewhere is for others to find out
            if j >= self._given:
                cost[i], cost[:, j] = 1e3, 1e3
                cost[i, j] = 0.0
        rows, columns = linear_sum_assignment(cost)
        fits = cost[rows, columns] < 1e3
        place[rows[fits]] = columns[fits]
        return place
