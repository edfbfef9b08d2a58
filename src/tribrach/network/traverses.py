"""Traverses in a network, and how they close: angles, plan, length, and where one angle fits.

A traverse is a chain of set-ups that see each other, whose inner ones have no other neighbours:
between two control points, or a ring. It is computed through with its observed angles and
distances, as on a form: misclosure of the angles where both ends are oriented, then that of the
coordinates with the angles put right by equal shares. Method section 3.8.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from tribrach._types import Array, Mask
from tribrach.answers import Number, Result
from tribrach.network.adjustment import Adjustment
from tribrach.observations.base import Use
from tribrach.observations.control import Centrings, Coordinate, Coordinates
from tribrach.observations.sights import (
    Angles,
    Directions,
    HorizontalDistances,
    SlopeDistances,
    ZenithAngles,
)

#: sigmas beyond which a misclosure asks for a single angle, and within which one explains it
_LARGE, _EXPLAINED = 4.0, 3.0


@dataclass(frozen=True)
class Traverse(Result, also=("plan", "ratio")):
    """A chain of set-ups, computed through."""

    points: tuple[str, ...]  #: in their order; a ring ends where it begins
    length: float  #: of the legs [m]
    #: observed less what they should be, summed over the angles [rad], and the sigma of that sum
    #: from readings and centring; null where one end is not oriented
    angle: Number
    sigma_angle: Number
    #: computed less given coordinates of the end [m], the angles put right by equal shares
    east: float
    north: float
    #: along and across the way from the first point to the last, null for a ring [m]
    along: Number
    across: Number
    #: the point whose angle alone explains both misclosures, "" if none does or several do
    angle_at: str = ""

    @property
    def plan(self) -> float:
        """Length of the misclosure in plan [m]."""
        return float(np.hypot(self.east, self.north))

    @property
    def ratio(self) -> Number:
        """The n of 1:n, length over misclosure; null if it closes exactly."""
        return self.length / self.plan if self.plan > 0 else np.nan


@dataclass(frozen=True)
class _Readings:
    """Observations in plan, by names."""

    #: angles between two sights of a set-up [rad] with their variances
    sights: dict[str, list[dict[str, tuple[float, float]]]]
    angles: dict[tuple[str, str, str], list[tuple[float, float]]]
    #: horizontal lengths [m] with their variances, either way
    lengths: dict[frozenset[str], list[tuple[float, float]]]
    #: places in plan (2,), as given where they are control
    places: dict[str, Array]
    control: set[str]

    def angle(self, at: str, back: str, ahead: str) -> tuple[float, float] | None:
        """Mean clockwise angle [rad] from one sight to another and its variance; None without."""
        found = [
            (one[ahead][0] - one[back][0], one[ahead][1] + one[back][1])
            for one in self.sights.get(at, ())
            if ahead in one and back in one
        ]
        found += self.angles.get((at, back, ahead), [])
        found += [(-value, square) for value, square in self.angles.get((at, ahead, back), ())]
        if not found:
            return None
        first = found[0][0]
        off = [(value - first + np.pi) % (2 * np.pi) - np.pi for value, _ in found]
        return first + float(np.mean(off)), float(sum(v for _, v in found)) / len(found) ** 2

    def seen_from(self, at: str) -> set[str]:
        """What a set-up sights."""
        return {name for one in self.sights.get(at, ()) for name in one} | {
            name for key in self.angles if key[0] == at for name in key[1:]
        }


def traverses(adjustment: Adjustment) -> list[Traverse]:
    """The traverses of an adjusted network, the longest first."""
    readings = _readings(adjustment)
    stations = set(readings.sights) | {key[0] for key in readings.angles}
    seen = {name: readings.seen_from(name) for name in stations}
    near = {
        name: {
            other
            for other in seen[name] & stations
            if name in seen[other] and frozenset((name, other)) in readings.lengths
        }
        for name in stations
    }
    found = [_closed(readings, chain) for chain in _chains(near, readings.control)]
    return sorted((one for one in found if one), key=lambda one: (-one.length, one.points))


def _readings(adjustment: Adjustment) -> _Readings:
    """Observations in plan, reduced to plane geometry."""
    layout, state = adjustment.layout, adjustment.state
    name = layout.name_array("position").tolist()
    xyz = state.positions
    places = {str(n): xyz[k, :2].copy() for k, n in enumerate(name)}
    columns = layout.position_columns(np.arange(len(name)))
    held: Mask = np.all(adjustment.reduced[columns][:, :2] < 0, axis=1)
    given: dict[str, set[int]] = {
        str(n): {0, 1} for n, fixed in zip(name, held, strict=True) if fixed
    }
    sights: dict[str, dict[int, dict[str, tuple[float, float]]]] = defaultdict(dict)
    angles: dict[tuple[str, str, str], list[tuple[float, float]]] = defaultdict(list)
    lengths: dict[frozenset[str], list[tuple[float, float]]] = defaultdict(list)
    zeniths, centring = _zeniths(adjustment), _centring(adjustment)
    marks = replace(state, vectors=np.zeros_like(state.vectors))
    for table in adjustment.network.observations:
        active = np.flatnonzero(table.use == Use.ACTIVE).tolist()
        if isinstance(table, Coordinate | Coordinates):
            axes = table.axis if isinstance(table, Coordinate) else None
            for i in active:
                at = str(name[table.position[i]])
                for k, axis in enumerate((0, 1) if axes is None else (int(axes[i]),)):
                    if axis < 2:
                        places[at][axis] = table.values[i, 0 if axes is not None else k]
                        given.setdefault(at, set()).add(axis)
            continue
        if not isinstance(table, Directions | Angles | SlopeDistances | HorizontalDistances):
            continue
        model, sigma = table.predict(marks)[:, 0], table.sigma[:, 0]
        off = table.values[:, 0] - model
        for i in active:
            one, other = table.start[i], table.end[i]
            ends = str(name[one]), str(name[other])
            line = xyz[other] - xyz[one]
            flat, square = float(np.hypot(*line[:2])), float(sigma[i]) ** 2
            off_mark = centring[table.eccentricity_instrument[i]]
            off_mark += centring[table.eccentricity_target[i]]
            if isinstance(table, Directions):
                reading = _azimuth(line) + off[i]
                sight = sights[ends[0]].setdefault(int(table.orientation[i]), {})
                sight.setdefault(ends[1], (reading, square + off_mark / max(flat, 1e-3) ** 2))
            elif isinstance(table, Angles):
                ahead = table.foresight[i]
                turn = _azimuth(xyz[ahead] - xyz[one]) - _azimuth(line)
                nearer = min(flat, float(np.hypot(*(xyz[ahead] - xyz[one])[:2])))
                key = (*ends, str(name[ahead]))
                angles[key].append((turn + off[i], square + 2 * off_mark / max(nearer, 1e-3) ** 2))
            else:
                slope = float(np.linalg.norm(line))
                sine = flat / slope if isinstance(table, SlopeDistances) else 1.0
                bent = line[2] * zeniths.get(ends, 0.0) if isinstance(table, SlopeDistances) else 0
                length = flat + sine * off[i] + bent
                lengths[frozenset(ends)].append((length, square + off_mark))
    control = {at for at, axes in given.items() if axes == {0, 1}}
    sets = {at: list(one.values()) for at, one in sights.items()}
    return _Readings(sets, angles, lengths, places, control)


def _zeniths(adjustment: Adjustment) -> dict[tuple[str, str], float]:
    """Mean error of zenith angles, by the ends of the sight [rad]."""
    name = adjustment.layout.name_array("position")
    found: dict[tuple[str, str], list[float]] = defaultdict(list)
    for table in adjustment.network.observations:
        if isinstance(table, ZenithAngles):
            off = table.values[:, 0] - table.predict(adjustment.state)[:, 0]
            for i in np.flatnonzero(table.use == Use.ACTIVE).tolist():
                found[str(name[table.start[i]]), str(name[table.end[i]])].append(float(off[i]))
    return {ends: float(np.mean(values)) for ends, values in found.items()}


def _centring(adjustment: Adjustment) -> Array:
    """Variances in plan (v + 1,) of what stands beside its mark [m^2]; the last is that of none."""
    out = np.zeros(len(adjustment.state.vectors) + 1)
    for table in adjustment.network.observations:
        if isinstance(table, Centrings):
            plan = table.axis < 2
            np.maximum.at(out, table.vector[plan], table.sigma[plan, 0] ** 2)
    return out


def _azimuth(line: Array) -> float:
    """From north, clockwise."""
    return float(np.arctan2(line[0], line[1]))


def _chains(near: dict[str, set[str]], control: set[str]) -> Iterator[tuple[str, ...]]:
    """Chains between control points, and rings; set-ups at the end of nothing are left out."""
    near = {name: set(others) for name, others in near.items()}
    ends = [name for name, others in near.items() if len(others) < 2 and name not in control]
    while ends:
        name = ends.pop()
        for other in near.pop(name, ()):
            near[other].discard(name)
            if len(near[other]) < 2 and other not in control and other in near:
                ends.append(other)
    done: set[str] = set()
    for first in sorted(control & near.keys()):
        for second in sorted(near[first]):
            chain = [first, second]
            while chain[-1] not in control and len(near[chain[-1]]) == 2:
                (ahead,) = near[chain[-1]] - {chain[-2]}
                chain.append(ahead)
            inner = chain[1:-1]
            if chain[-1] in control and inner and not done & set(inner):
                done |= set(inner)
                yield tuple(chain)
    for first in sorted(near.keys() - control - done):
        if first in done:
            continue
        chain = [first]
        ahead = min(near[first], default="")
        while ahead and ahead != first and ahead not in control and len(near[ahead]) == 2:
            chain.append(ahead)
            (ahead,) = near[ahead] - {chain[-2]}
        done |= set(chain)
        if ahead == first and len(near[first]) == 2 and len(chain) > 2:
            yield (*chain, first)


def _closed(readings: _Readings, chain: tuple[str, ...]) -> Traverse | None:
    """Compute a chain through; None if no end of it is oriented or a reading is missing."""
    ring = chain[0] == chain[-1]
    before = {chain[-2]} if ring else _oriented(readings, chain[0], chain[1])
    after = {chain[1]} if ring else _oriented(readings, chain[-1], chain[-2])
    if not before and after:
        chain, before, after = chain[::-1], after, before
    if not before:
        return None
    turns = [_mean_azimuth(readings, chain[0], before, chain[1], ring)]
    turns += [readings.angle(at, back, ahead) for back, at, ahead in _threes(chain)]
    if any(one is None for one in turns):
        return None
    own = [one for one in turns if one is not None]
    measured = [readings.lengths[frozenset(pair)] for pair in pairwise(chain)]
    legs = [float(np.mean([length for length, _ in some])) for some in measured]
    along_legs = sum(sum(v for _, v in some) / len(some) ** 2 for some in measured)
    misclosure, square = np.nan, np.nan
    if ring:
        last = readings.angle(chain[0], chain[-2], chain[1])
        if last is not None:
            misclosure = _small(sum(value + np.pi for value, _ in own[1:]) + last[0] + np.pi)
            square = sum(v for _, v in own[1:]) + last[1]
    elif after:
        end = _mean_azimuth(readings, chain[-1], after, chain[-2], False)
        if end is not None:
            reached = own[0][0] + sum(value + np.pi for value, _ in own[1:])
            misclosure = _small(reached + np.pi - end[0])
            square = end[1] + sum(v for _, v in own)
    start, end_place = readings.places[chain[0]], readings.places[chain[-1]]
    as_read = _through(start, own, legs, 0.0)
    # the first of a ring is no angle: what closes it takes its place
    many = len(own) if ring else len(own) + 1
    share = misclosure / many if np.isfinite(misclosure) else 0.0
    if ring:
        own[0] = (own[0][0] + share, 0.0)
    stations = _through(start, own, legs, share)
    east, north = (stations[-1] - end_place).tolist()
    way = end_place - start
    span = float(np.linalg.norm(way))
    along = across = np.nan
    if not ring and span > 0:
        along = float((way @ [east, north]) / span)
        across = float((way[1] * east - way[0] * north) / span)
    found = ""
    sigma = float(np.sqrt(square))
    if abs(misclosure) > _LARGE * sigma:
        found = _single(chain, as_read, end_place, misclosure, square / many, along_legs)
    return Traverse(chain, sum(legs), misclosure, sigma, east, north, along, across, found)


def _threes(chain: tuple[str, ...]) -> Iterable[tuple[str, str, str]]:
    """Each inner set-up between its neighbours."""
    return zip(chain[:-2], chain[1:-1], chain[2:], strict=True)


def _small(angle: float) -> float:
    """An angle between -pi and pi."""
    return float((angle + np.pi) % (2 * np.pi) - np.pi)


def _oriented(readings: _Readings, at: str, ahead: str) -> set[str]:
    """Control points that an end sights, which orient it."""
    return (readings.seen_from(at) & readings.control) - {at, ahead}


def _mean_azimuth(
    readings: _Readings, at: str, backs: set[str], ahead: str, ring: bool
) -> tuple[float, float] | None:
    """Azimuth of a leg by what orients the end, and its variance."""
    if ring:
        return _azimuth(readings.places[ahead] - readings.places[at]), 0.0
    found = []
    for back in sorted(backs):
        turn = readings.angle(at, back, ahead)
        if turn is not None:
            line = readings.places[back] - readings.places[at]
            found.append((_azimuth(line) + turn[0], turn[1]))
    if not found:
        return None
    first = found[0][0]
    mean = first + float(np.mean([_small(value - first) for value, _ in found]))
    return mean, sum(v for _, v in found) / len(found) ** 2


def _through(
    start: Array, turns: list[tuple[float, float]], legs: list[float], share: float
) -> Array:
    """Places (n, 2) of a chain computed with its observed angles, less a share at each."""
    azimuth, out = 0.0, [start]
    for k, ((turn, _), leg) in enumerate(zip(turns, legs, strict=True)):
        azimuth = turn - share if k == 0 else azimuth + np.pi + turn - share
        out.append(out[-1] + leg * np.array([np.sin(azimuth), np.cos(azimuth)]))
    return np.array(out)


def _single(
    chain: tuple[str, ...],
    stations: Array,
    end: Array,
    misclosure: float,
    of_angle: float,
    of_legs: float,
) -> str:
    """The one point whose angle explains what the coordinates are off, "" if that is undecided.

    of_angle, of_legs : variance of an angle [rad^2], and of all legs together [m^2].
    """
    off = stations[-1] - end
    # an angle that is too large turns all behind it clockwise about its point, at the end nothing
    arms = stations[-1] - stations
    left = np.linalg.norm(off - misclosure * arms[:, ::-1] * [1.0, -1.0], axis=1)
    if chain[0] == chain[-1]:
        left = left[:-1]
    noise = np.sqrt(of_angle * (arms**2).sum() + of_legs)
    order = np.argsort(left)
    if left[order[0]] > _EXPLAINED * noise or left[order[1]] < 2 * _EXPLAINED * noise:
        return ""
    return chain[int(order[0])]
