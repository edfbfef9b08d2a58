"""Which detected target of which scan is which point, without names and approximate poses?

Each scan is matched by the distances between its targets to the points that are known; a placed
scan adds its other targets to the known points, so that scans which see no control at all follow
(method section 8.4). What fits in more than one way is not guessed: it waits until more points
are known, and if it stays ambiguous it is refused. Targets that two scans see and nobody named
become tie points. Stations whose relative poses are known already, from planes or clouds, are
matched as one. Where targets are too few, an antenna on the scanner whose place and lever arm are
known counts as one more. Metres; poses are world from scanner.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.registration.matching import Matching, match
from tribrach.registration.units import Mounted, Sighting, Unit, units_of

__all__ = ["Identification", "Mounted", "Sighting", "identify"]

# The points known so far while stations are being matched: given ones and seen ones.


#: a target and a point are the same within this many sigmas of their distance ...
_GATE = 6.0


#: ... plus what an approximate pose may be wrong by [m], and this many sigmas of its drift
_POSE_ERROR = 0.02


_DRIFT = 4.0


class Pool:
    """Points with coordinates (m, 3) and sigmas (m,) [m]; what stations saw is added to them.

    points : name to coordinates and sigma of those that are given.
    """

    def __init__(self, points: Mapping[str, tuple[Array, float]]) -> None:
        self.names: list[str] = list(points)
        self.xyz: Array = np.array([xyz for xyz, _ in points.values()]).reshape(-1, 3)
        self.sigmas: Array = np.array([sigma for _, sigma in points.values()], dtype=np.float64)
        self._drift: Array = np.zeros(len(points))
        self._kinds: list[str] = [""] * len(points)
        self._given = len(points)
        self._seen: dict[str, NDArray[np.int64]] = {}

    def add(
        self, station: str, xyz: Array, sigmas: Array, kinds: Sequence[str], drift: Array
    ) -> None:
        """Assign targets (n, 3) of a placed station, one to one; the rest become new points.

        drift (n,) : how uncertain the station's place makes them [m]. It is common to what one
        station saw, so it counts when a chain of stations meets its beginning, and not in the
        distances between points of one station.
        """
        place = self._assign(xyz, sigmas, kinds, drift)
        for i in np.flatnonzero(place < 0).tolist():
            place[i] = len(self.names)
            self.names.append(f"tie {len(self.names) - self._given + 1}")
            self.xyz = np.vstack([self.xyz, xyz[i]])
            self.sigmas = np.append(self.sigmas, sigmas[i])
            self._drift = np.append(self._drift, drift[i])
            self._kinds.append(kinds[i])
        for i, j in enumerate(place.tolist()):
            self._kinds[j] = kinds[i]
        self._seen[station] = place

    def drift_of(self, places: NDArray[np.int64]) -> float:
        """Drift that points (k,) have on the average [m]."""
        return float(np.sqrt((self._drift[places] ** 2).mean())) if len(places) else 0.0

    def seen_by(self, station: str) -> NDArray[np.int64]:
        """Numbers of the points that a station saw."""
        return self._seen[station]

    @property
    def stations(self) -> list[str]:
        """Stations that were added."""
        return list(self._seen)

    def names_of(self, station: str) -> list[str]:
        """Name of each target of a station; "" for those that nothing else saw."""
        used = np.bincount(np.concatenate(list(self._seen.values())), minlength=len(self.names))
        alone = (used < 2) & (np.arange(len(self.names)) >= self._given)
        return ["" if alone[j] else self._final(int(j), alone) for j in self._seen[station]]

    def _final(self, j: int, alone: NDArray[np.bool_]) -> str:
        """The name of a point; tie points are numbered without those seen only once."""
        if j < self._given:
            return self.names[j]
        return f"tie {int((~alone[self._given : j]).sum()) + 1}"

    def _assign(
        self, xyz: Array, sigmas: Array, kinds: Sequence[str], drift: Array
    ) -> NDArray[np.int64]:
        """Number of the point of each target, -1 for none."""
        place = np.full(len(xyz), -1, dtype=np.int64)
        if len(self.names) == 0 or len(xyz) == 0:
            return place
        distance = np.linalg.norm(xyz[:, None] - self.xyz[None], axis=2)
        gate = _GATE * np.hypot(sigmas[:, None], self.sigmas[None]) + _POSE_ERROR
        gate += _DRIFT * np.hypot(drift[:, None], self._drift[None])
        alike = np.array([[k in ("", kind) for k in self._kinds] for kind in kinds])
        cost = np.where(alike & (distance < gate), distance / gate, 1e3)
        rows, columns = linear_sum_assignment(cost)
        fits = cost[rows, columns] < 1e3
        place[rows[fits]] = columns[fits]
        return place


#: a floor for the sigma of targets and points in matching, so that small systematic errors of a
#: scanner do not part what belongs together [m]
MATCHING_FLOOR = 0.003


#: matchings of this many targets place a scan even where a smaller second solution exists
_SURE = 6


#: as many targets place a scan on what one station saw (one less if it is levelled)
_ALONE = 4


@dataclass
class Drifts:
    """Poses of the placed stations, and how uncertain they make the targets of each (n,) [m].

    adrift : they are in the frame of a station, not in that of the points.
    """

    poses: dict[str, Pose] = field(default_factory=dict)
    of: dict[str, Array] = field(default_factory=dict)
    adrift: bool = False


@dataclass(frozen=True)
class Identification:
    """Names by station and detection number, approximate poses, and what is to be said.

    names : station to (n,) names, "" for a target that nothing else saw; poses : placed stations;
    sentences : how each station was placed; unplaced : why the others were not; adrift : the poses
    are in the frame of a station, because no scan sees given points.
    """

    names: Mapping[str, tuple[str, ...]]
    poses: Mapping[str, Pose]
    sentences: tuple[str, ...]
    unplaced: Mapping[str, str] = field(default_factory=dict)
    adrift: bool = False


def identify(
    sightings: Sequence[Sighting],
    points: Mapping[str, tuple[Array, float]],
    *,
    free: bool = False,
    groups: Sequence[Mapping[str, Pose]] = (),
    partial: bool = False,
) -> Identification:
    """Name the targets of all scans; points : name to coordinates (3,) and one sigma [m].

    Without points the unit with most targets becomes the frame; likewise with ``free`` if none
    sees three of the points, because something else places the stations. groups : stations whose
    poses relative to each other are known, each in a frame of its own; partial : what cannot be
    placed is left to others, with the reason, instead of refused.

    Raises
    ------
    InputError : a scan fits nowhere or in more than one way, with what would decide it.
    """
    pool = Pool(points)
    waiting = units_of(sightings, groups)
    drifts = Drifts()
    poses = drifts.poses
    said: list[str] = []
    obstacles: dict[str, str] = {}
    while waiting:
        placed = _placed(waiting, pool, drifts, said, obstacles)
        if not placed and not poses and (free or not points):
            first = waiting[0]
            _settle(first, Pose.identity(), pool, drifts, None)
            said.append(f"{first.name} is the frame of the matching: no scan sees given points")
            placed, drifts.adrift = [first], True
        if not placed:
            joined = next((u for u in waiting if len(u.own) > 1), None)
            if joined is None:
                break
            said.append(f"{joined.name}: {obstacles[joined.name]}; matched one by one instead")
            waiting = [u for u in waiting if u is not joined] + joined.apart()
            continue
        waiting = [u for u in waiting if u not in placed]
    if waiting and not partial:
        raise _refusal([u.sighting for u in waiting], obstacles, Pool(points))
    seen = [s for s in sightings if s.station in poses]
    order = dict.fromkeys([*(s.station for s in seen), *poses])
    drifts.poses = {name: poses[name] for name in order}
    found = _names(seen, drifts, Pool(points), said)
    unplaced = {name: obstacles[u.name] for u in waiting for name in u.members}
    return replace(found, unplaced=unplaced, adrift=drifts.adrift)


def _settle(unit: Unit, pose: Pose, pool: Pool, drifts: Drifts, found: Matching | None) -> None:
    """Note the poses of a unit's stations and what they see.

    found : the matching that the pose is of, None for the frame.
    """
    for station, own in unit.members.items():
        drifts.poses[station] = pose @ own
    for s in unit.own:
        drift = np.zeros(len(s.centers))
        if found is not None:
            start = pool.drift_of(found.pairs[:, 1])
            drift = np.hypot(start, found.placed_sigma(unit.members[s.station] @ s.centers))
        drifts.of[s.station] = drift
        pool.add(s.station, drifts.poses[s.station] @ s.centers, s.sigmas, s.kinds, drift)


def _placed(
    waiting: Sequence[Unit], pool: Pool, drifts: Drifts, said: list[str], obstacles: dict[str, str]
) -> list[Unit]:
    """Units that are placed now: by many targets before any is placed by few.

    Three distances agree by chance where there are many points; six do not.
    """
    for least in range(_SURE, 1, -1):
        placed = [u for u in waiting if _try(u, pool, drifts, said, obstacles, least)]
        if placed:
            return placed
    return []


def _try(
    unit: Unit,
    pool: Pool,
    placed: Drifts,
    said: list[str],
    obstacles: dict[str, str],
    least: int,
) -> bool:
    """Place a unit by at least so many of the points known so far.

    The reason why not goes to the obstacles.
    """
    sighting = unit.sighting
    try:
        found = _match(sighting, pool)
    except InputError as error:
        obstacles[unit.name] = error.what
        found = None
    if found is not None and found.ambiguous and not _decided(found):
        obstacles[unit.name] = f"{len(found.pairs)} targets fit in {len(found.others) + 1} ways"
        found = None
    if found is None:
        found = _by_one_station(sighting, pool)
    antennas = 0
    if found is None and sighting.mounted and not placed.adrift:
        found, reason = _by_antennas(sighting, pool)
        if reason:
            obstacles[unit.name] = reason
        antennas = len(sighting.mounted)
    if found is None or len(found.pairs) + antennas < least:
        return False
    _settle(unit, Pose(found.rotation, found.translation), pool, placed, found)
    rms = np.sqrt(found.chi_square / max(1, 3 * (len(found.pairs) + antennas)))
    several = ("are", "their") if len(unit.members) > 1 else ("is", "its")
    helped = f" and {_antennas(antennas)}" if antennas else ""
    said.append(
        f"{unit.name} {several[0]} placed by {len(found.pairs)} of {several[1]} "
        f"{len(sighting.centers)} targets{helped} (residuals {rms:.1f} times the sigmas "
        "that the search allows for)"
    )
    return True


def _antennas(count: int) -> str:
    return "the antenna" if count == 1 else f"{count} antennas"


def _by_antennas(sighting: Sighting, pool: Pool) -> tuple[Matching | None, str]:
    """The matching of targets that are too few by themselves, with the antennas on the scanners.

    Its pairs are those of the targets. The reason is said where the antennas leave several ways.
    """
    try:
        found = _match(sighting, pool, mounted=sighting.mounted)
    except InputError:
        return None, ""
    targets = found.pairs[found.pairs[:, 0] < len(sighting.centers)]
    if len(found.pairs) - len(targets) < len(sighting.mounted):
        return None, ""
    if found.ambiguous:
        ways = len(found.others) + 1
        words = f"{len(targets)} targets and {_antennas(len(sighting.mounted))} fit in {ways} ways"
        return None, words
    return replace(found, pairs=targets), ""


def _by_one_station(sighting: Sighting, pool: Pool) -> Matching | None:
    """The best matching with what one placed station saw; None if there is none without doubt.

    Points from both ends of a chain of stations lie beside each other by its drift: all together
    they fit nothing, those of a single station fit.
    """
    least = _ALONE - 1 if sighting.levelled else _ALONE
    best: Matching | None = None
    for station in pool.stations:
        chosen = pool.seen_by(station)
        try:
            found = _match(sighting, pool, chosen=chosen)
        except InputError:
            continue
        if found.ambiguous or len(found.pairs) < least:
            continue
        if best is None or len(found.pairs) > len(best.pairs):
            pairs = np.stack([found.pairs[:, 0], chosen[found.pairs[:, 1]]], axis=1)
            best = replace(found, pairs=pairs)
    return best


def _match(
    sighting: Sighting,
    pool: Pool,
    axes: tuple[int, int, int] = (0, 1, 2),
    chosen: Index | None = None,
    mounted: Sequence[Mounted] = (),
) -> Matching:
    """The targets of a scan against the pool, its coordinates in the order of the axes.

    chosen : numbers of the points that count, all if not given; mounted : antennas that count as
    targets and points behind the others.
    """
    needed = 2 if sighting.levelled else 3
    n = len(sighting.centers)
    if n + len(mounted) < needed:
        raise InputError(f"{n} targets found and {needed} needed")
    numbers = np.arange(len(pool.names)) if chosen is None else chosen
    names = [pool.names[k] for k in numbers]
    known = {i: names.index(name) for i, name in sighting.known.items() if name in names}
    known |= {n + k: len(names) + k for k in range(len(mounted))}
    arms = np.array([m.arm for m in mounted]).reshape(-1, 3)
    places = np.array([m.xyz for m in mounted]).reshape(-1, 3)
    sigmas = np.append(sighting.sigmas, [m.sigma_arm for m in mounted])
    return match(
        np.concatenate([sighting.centers, arms]),
        np.concatenate([pool.xyz[numbers], places])[:, axes],
        sigma_targets=np.hypot(sigmas, MATCHING_FLOOR),
        sigma_points=np.append(pool.sigmas[numbers], [m.sigma for m in mounted]),
        levelled=sighting.levelled,
        known=known,
    )


def _decided(found: Matching) -> bool:
    """True if a large matching has only rivals that share all but one of its pairs."""
    if len(found.pairs) < _SURE:
        return False
    mine = {(int(i), int(j)) for i, j in found.pairs}
    return all(len(mine - {(int(i), int(j)) for i, j in o}) <= 1 for o in found.others)


def _refusal(waiting: Sequence[Sighting], obstacles: Mapping[str, str], given: Pool) -> InputError:
    """Why the rest could not be placed."""
    for sighting in waiting:
        if "ways" not in obstacles.get(sighting.station, "") and _mirrored(sighting, given):
            return InputError(
                f"the targets of station {sighting.station} fit the list of points only with its "
                "first two columns swapped (the determinant is -1)",
                cure="check which column is East and which is North",
            )
    first = waiting[0].station
    others = "" if len(waiting) == 1 else f" (and so for {len(waiting) - 1} more stations)"
    reason = obstacles.get(first, "")
    cure = "see the detections of the station, or name three of its targets"
    if "ways" in reason:
        cure = "name one of its targets in the project file, or add a target without symmetry"
    return InputError(
        f"station {first} cannot be matched to the points and the other stations: {reason}{others}",
        cure=cure,
    )


def _mirrored(sighting: Sighting, given: Pool) -> bool:
    """True if a scan fits the given points with East and North swapped, and not as they are."""
    try:
        swapped = _match(sighting, given, (1, 0, 2))
    except InputError:
        return False
    return len(swapped.pairs) >= 4


def _names(
    sightings: Sequence[Sighting], drifts: Drifts, pool: Pool, said: list[str]
) -> Identification:
    """Final names: every detection to the nearest point within its gate, leftovers as ties."""
    poses = drifts.poses
    for s in sightings:
        world = poses[s.station] @ s.centers
        pool.add(s.station, world, s.sigmas, s.kinds, drifts.of[s.station])
    names = {}
    for s in sightings:
        found = pool.names_of(s.station)
        names[s.station] = tuple(found[i] for i in range(len(s.centers)))
        alone = [i for i, name in enumerate(found) if name == ""]
        if alone:
            said.append(
                f"{s.station}: {len(alone)} of {len(found)} targets are seen by no other station "
                "and are no known points"
            )
    return Identification(names, dict(poses), tuple(said))
