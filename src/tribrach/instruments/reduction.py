"""Readings in two faces and several sets, reduced to one direction, zenith angle and distance each.

Readings of both faces are paired for each target and set; the day's collimation and index error
come from all pairs of the file, the residuals of the sets from the rounds of each set-up. The
network gets means over faces and sets, with the number of readings in each.

**Sets.** Files tell the order of readings, seldom the sets. A set holds each target once in each
face; it ends where a target comes again in a face in which it was read before. Readings one after
the other of the same target in the same face are one pointing, and a half-set that ends on its
first target closes the horizon rather than beginning a new set.

**Rounds.** Directions of several sets are adjusted by least squares. Each set has an orientation of
its own; sets need not be complete. Values are face means in a table with a row for each set and a
column for each target, NaN where a target was not read. For complete sets the directions are the
plain means of the sets reduced to one of them (Ghilani, "Adjustment Computations"; ISO 17123-3).

**Into the network.** Sets that read the same targets equally often are such a complete round: their
means with one orientation hold all that they tell. Sets of other targets get an orientation of
their own, so that the network adjusts the same rounds, whether or not the tripod turned between
sets (method section 2.3). A set that shares no target with those before it continues the last one.

**Faces.** Half the difference of the faces of target i is ``(H_F - H_B -+ pi) / 2 = c / sin V +
t cot V`` for directions, with the collimation error c and the tilt t of the trunnion axis, and
``(V_F + V_B - 2 pi) / 2 = i`` for zenith angles, with the index error i (method section 4.4;
Deumlich & Staiger, "Instrumentenkunde der Vermessungstechnik"). The mean of the faces is free of
all three.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.statistics import robust_sigma
from tribrach.units import SEC

#: face differences are out of line beyond so many robust standard deviations, and beyond this [rad]
LIMIT, FLOOR = 5.0, 20 * SEC
#: zenith angles spread at least so much where the tilt of the trunnion axis can be told apart [rad]
SPREAD = np.radians(30)
#: most sets times targets of one set-up
MOST_CELLS = 10_000_000


@dataclass(frozen=True)
class ReadingSets:
    """Sets of n readings."""

    number: Index  #: (n,), set of each reading, from 0 on
    closing: NDArray[np.bool_]  #: (n,), true where the reading closes the horizon


def find_sets(target: Index, face: NDArray[np.int8], series: Index | None = None) -> ReadingSets:
    """Sets of n readings in the order they were taken.

    ``target`` (n,): index of the target; ``face`` (n,): 1 or 2; ``series`` (n,): numbers of sets
    that the file gives, 0 where it gives none; a change of it begins a set.
    """
    n = len(target)
    number, closing = np.zeros(n, dtype=np.int64), np.zeros(n, dtype=bool)
    given = np.zeros(n, dtype=np.int64) if series is None else series
    keys = list(zip(target.tolist(), face.tolist(), strict=True))
    seen: set[tuple[int, int]] = set()
    current, half, begin = 0, 0, 0
    for i, key in enumerate(keys):
        fresh = i > 0 and given[i] != given[i - 1]
        if i > 0 and keys[i - 1][1] != key[1]:
            half = i
        repeated = i > 0 and keys[i - 1] == key
        if fresh or (key in seen and not repeated):
            if not fresh and i > half + 1 and key == keys[half] and _ends(keys, i):
                closing[i] = True
            else:
                # a set may begin with targets that the one before it lacks
                first = i if fresh or not _was_whole(keys[begin:half]) else half
                current, begin, half = current + 1, first, first
                number[first:i] = current
                seen = set(keys[first:i])
        seen.add(key)
        number[i] = current
    return ReadingSets(number, closing)


def _was_whole(keys: list[tuple[int, int]]) -> bool:
    """True if readings are a half-set in each face, with two targets or more in both."""
    changes = sum(a[1] != b[1] for a, b in pairwise(keys))
    faces = [{target for target, face in keys if face == one} for one in (1, 2)]
    return changes == 1 and len(faces[0] & faces[1]) > 1


def _ends(keys: list[tuple[int, int]], i: int) -> bool:
    """True if the half-set ends here: the other face, the same target again, or nothing follows."""
    return i + 1 == len(keys) or keys[i + 1][1] != keys[i][1] or keys[i + 1] == keys[i]


@dataclass(frozen=True)
class Rounds:
    """Adjusted directions of t targets from s sets."""

    direction: Array  #: (t,), within [0, 2 pi), in the orientation of the first set [rad]
    orientation: Array  #: (s,), of the sets against the first [rad]
    residual: Array  #: (s, t), observed less adjusted [rad]
    sigma: float  #: of a direction in one set from the residuals [rad], NaN without redundancy
    sigma_mean: Array  #: (t,), of the adjusted directions [rad]
    dof: int  #: degrees of freedom


@dataclass(frozen=True)
class Repeats:
    """Means of values that need no orientation: t targets in s sets [rad or m]."""

    mean: Array  #: (t,), over the sets
    residual: Array  #: (s, t), observed less mean
    sigma: float  #: of a value in one set from the residuals, NaN without redundancy
    sigma_mean: Array  #: (t,), of the means
    dof: int  #: degrees of freedom


def wrapped(angle: Array) -> Array:
    """Angles within [-pi, pi)."""
    result: Array = (angle + np.pi) % (2 * np.pi) - np.pi
    return result


def adjust_rounds(directions: Array) -> Rounds:
    """Adjust directions (s, t) [rad] of sets to targets; sets without common ones stay apart."""
    known = np.isfinite(directions)
    orientation, direction = _approximate(directions, known)
    misclosure = np.where(
        known, wrapped(directions - direction[None, :] - orientation[:, None]), 0.0
    )
    # the longer side is eliminated, so that the equations stay as small as the shorter one
    if len(known) <= known.shape[1]:
        change, shift, rank = _solve(known, misclosure)
    else:
        shift, change, rank = _solve(known.T, misclosure.T)
    # the first set keeps its orientation
    base = change[0] if len(change) else 0.0
    direction, orientation = direction + shift + base, orientation + change - base
    residual = wrapped(directions - direction[None, :] - orientation[:, None])
    per_target = known.sum(axis=0)
    dof = int(known.sum()) - rank
    sigma = _sigma(residual, known, dof)
    weight = np.where(per_target > 0, 1 / np.maximum(per_target, 1), 0.0)
    direction = np.where(per_target > 0, direction % (2 * np.pi), np.nan)
    return Rounds(direction, orientation, residual, sigma, sigma * np.sqrt(weight), dof)


def _solve(known: NDArray[np.bool_], misclosure: Array) -> tuple[Array, Array, int]:
    """Unknowns of rows and of columns of ``l = row + column``, and the rank of the whole."""
    per_row, per_column = known.sum(axis=1), known.sum(axis=0)
    weight = np.where(per_column > 0, 1 / np.maximum(per_column, 1), 0.0)
    # columns eliminated: what is left are the rows
    normal = np.diag(per_row.astype(float)) - (known * weight) @ known.T
    right = misclosure.sum(axis=1) - (known * weight) @ misclosure.sum(axis=0)
    rows = np.linalg.pinv(normal, hermitian=True) @ right
    columns = weight * (misclosure - known * rows[:, None]).sum(axis=0)
    rank = int(np.linalg.matrix_rank(normal, hermitian=True)) + int((per_column > 0).sum())
    return rows, columns, rank


def adjust_repeats(values: Array) -> Repeats:
    """Means over sets of zenith angles or distances (s, t)."""
    known = np.isfinite(values)
    count = known.sum(axis=0)
    weight = np.where(count > 0, 1 / np.maximum(count, 1), 0.0)
    mean = np.where(count > 0, np.where(known, values, 0.0).sum(axis=0) * weight, np.nan)
    residual = values - mean[None, :]
    dof = int(known.sum()) - int((count > 0).sum())
    sigma = _sigma(residual, known, dof)
    return Repeats(mean, residual, sigma, sigma * np.sqrt(weight), dof)


def _sigma(residual: Array, known: NDArray[np.bool_], dof: int) -> float:
    """Standard deviation of one value from its residuals; NaN without redundancy."""
    return float(np.sqrt((residual[known] ** 2).sum() / dof)) if dof > 0 else float("nan")


def _approximate(directions: Array, known: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Orientations (s,) and directions (t,), from set to set through targets they share."""
    s, t = directions.shape
    orientation, direction = np.zeros(s), np.zeros(t)
    placed = np.zeros(t, dtype=bool)
    waiting = list(range(s))
    while waiting:
        # the first one that is left begins a part of its own
        linked = [waiting[0]]
        while linked:
            for k in linked:
                both = known[k] & placed
                if both.any():
                    turn = np.exp(1j * (directions[k, both] - direction[both]))
                    orientation[k] = np.angle(turn.mean())
                new = known[k] & ~placed
                direction[new] = directions[k, new] - orientation[k]
                placed |= known[k]
            done = set(linked)
            waiting = [k for k in waiting if k not in done]
            linked = [k for k in waiting if (known[k] & placed).any()]
    return orientation, direction


@dataclass(frozen=True)
class AxisErrors:
    """Axis errors of an instrument from n pairs of faces [rad]."""

    #: the collimation error and its standard deviation
    collimation: float
    sigma_collimation: float
    #: tilt of the trunnion axis; NaN where sights are too level
    trunnion: float
    sigma_trunnion: float
    #: the index error of zenith angles
    index: float
    sigma_index: float
    #: of a reading in one face, from the scatter of the differences
    sigma_direction: float
    sigma_zenith: float
    #: (n,), half differences of the faces, NaN where only one was read
    half_direction: Array
    half_zenith: Array
    #: (n,), of half differences
    residual_direction: Array
    residual_zenith: Array
    #: (n,), true where a difference is out of line; it is then left out of everything else
    far_direction: NDArray[np.bool_]
    far_zenith: NDArray[np.bool_]
    pairs: int  #: how many were used


def fold(direction: Array, zenith: Array, face: NDArray[np.int8]) -> tuple[Array, Array]:
    """Readings (n,) [rad] as face 1 would give them: ``H - pi`` and ``2 pi - V`` from face 2."""
    second = face == 2
    folded = np.where(second, direction - np.pi, direction) % (2 * np.pi)
    return folded, np.where(second, 2 * np.pi - zenith, zenith)


def half_difference(first: Array, second: Array) -> Array:
    """Half of face 1 less face 2 of folded readings (n,), within a quarter of a circle."""
    half: Array = ((first - second + np.pi) % (2 * np.pi) - np.pi) / 2
    return half


def axis_errors(half_direction: Array, half_zenith: Array, zenith: Array) -> AxisErrors:
    """Axis errors by least squares from half differences.

    What is out of line is found from medians beforehand.

    ``half_direction``, ``half_zenith`` (n,): half differences of the faces [rad]; NaN takes no
    part; ``zenith`` (n,): zenith angles [rad].
    """
    # a sight along the vertical axis tells nothing of it
    zenith = np.where(np.sin(zenith) == 0, np.nan, zenith)
    slope = 1 / np.sin(zenith)
    known = np.isfinite(half_direction) & np.isfinite(slope)
    far_direction = _far(half_direction / slope, known)
    use = known & ~far_direction
    design = slope[:, None]
    if use.sum() > 3 and np.ptp(zenith[use]) > SPREAD:
        design = np.stack([slope, 1 / np.tan(zenith)], axis=1)
    estimate, sigma, residual_direction, s_direction = _fit(design, half_direction, use)
    level = np.isfinite(half_zenith)
    far_zenith = _far(half_zenith, level)
    mean, sigma_mean, residual_zenith, s_zenith = _fit(
        np.ones((len(half_zenith), 1)), half_zenith, level & ~far_zenith
    )
    tilted = design.shape[1] == 2
    return AxisErrors(
        collimation=float(estimate[0]),
        sigma_collimation=float(sigma[0]),
        trunnion=float(estimate[1]) if tilted else float("nan"),
        sigma_trunnion=float(sigma[1]) if tilted else float("nan"),
        index=float(mean[0]),
        sigma_index=float(sigma_mean[0]),
        # a half difference has half the variance of a reading
        sigma_direction=float(np.sqrt(2) * s_direction),
        sigma_zenith=float(np.sqrt(2) * s_zenith),
        half_direction=half_direction,
        half_zenith=half_zenith,
        residual_direction=residual_direction,
        residual_zenith=residual_zenith,
        far_direction=far_direction,
        far_zenith=far_zenith,
        pairs=int(use.sum()),
    )


def _far(values: Array, known: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """True where values (n,) lie off the median by more than chance or any instrument explains."""
    far = np.zeros(len(values), dtype=bool)
    if known.sum() < 3:
        # with one or two pairs nothing says which is wrong, unless no instrument is so bad
        far[known] = np.abs(values[known]) > np.radians(0.5)
        return far
    off = np.abs(values - np.median(values[known]))
    spread = robust_sigma(off[known], about=0.0)
    far[known] = off[known] > max(LIMIT * spread, FLOOR)
    return far


def _fit(design: Array, values: Array, use: NDArray[np.bool_]) -> tuple[Array, Array, Array, float]:
    """Estimates (u,), their sigmas, residuals (n,) against the fit, sigma of a value."""
    u = design.shape[1]
    nothing = np.full(len(values), np.nan)
    if use.sum() < u:
        return np.full(u, np.nan), np.full(u, np.nan), nothing, float("nan")
    a, y = design[use], values[use]
    estimate = np.linalg.lstsq(a, y, rcond=None)[0]
    residual: Array = values - design @ estimate
    dof = len(y) - u
    s = float(np.sqrt(residual[use] @ residual[use] / dof)) if dof else float("nan")
    sigma = s * np.sqrt(np.diag(np.linalg.inv(a.T @ a)))
    return np.asarray(estimate, dtype=float), sigma, residual, s


@dataclass(frozen=True)
class Closures:
    """n closed horizons."""

    #: (n,), of the closing reading
    setup: Index
    set: Index
    target: Index
    face: NDArray[np.int8]
    difference: Array  #: (n,), last less first reading [rad]


@dataclass(frozen=True)
class SetupReduction:
    """The adjusted rounds of one set-up."""

    setup: int  #: index of the set-up
    targets: Index  #: (t,), targets of its tables
    sets: Index  #: (s,), sets of its tables
    #: the adjusted values
    rounds: Rounds
    zeniths: Repeats
    distances: Repeats


@dataclass(frozen=True)
class Means:
    """n means of the readings of a target."""

    #: (n,), indices
    setup: Index
    target: Index
    #: (n,), set, or round within the set-up: directions of one round share an orientation
    circle: Index
    value: Array  #: (n,), [rad or m], NaN where it was not read
    readings: Index  #: (n,), how many readings it is the mean of
    first: Index  #: (n,), index of the first of them
    far: NDArray[np.bool_]  #: (n,), true if the faces of all its readings were too far apart


#: directions, zenith angles and distances of the same n targets in the same sets; means of the
#: faces, or the value of the one face that was read
Cells = tuple[Means, Means, Means]


@dataclass(frozen=True)
class Reduction:
    """Faces, rounds and sets reduced to means with their precision."""

    cells: Cells  #: for each target of each set
    axes: AxisErrors  #: axis errors of the instrument
    closures: Closures  #: closed horizons
    setups: tuple[SetupReduction, ...]  #: adjusted rounds, one for each set-up
    #: values for the network
    directions: Means
    zeniths: Means
    distances: Means


def reduce(
    setup: Index,
    target: Index,
    face: NDArray[np.int8],
    direction: Array,
    zenith: Array,
    distance: Array,
    series: Index,
) -> Reduction:
    """Pair faces, adjust rounds and average.

    ``setup``, ``target`` (n,): indices, of readings in the order they were taken; ``face`` (n,): 1
    or 2; ``direction``, ``zenith`` (n,): as read [rad], NaN where not read; ``distance`` (n,):
    corrected [m], NaN where not read; ``series`` (n,): number of the set if it is known, else 0.
    """
    number = np.zeros(len(setup), dtype=np.int64)
    closing = np.zeros(len(setup), dtype=bool)
    for rows in _by_setup(setup):
        sets = find_sets(target[rows], face[rows], series[rows])
        number[rows], closing[rows] = sets.number, sets.closing
    folded, zenith = fold(direction, zenith, face)
    keys = np.stack([setup, number, target], axis=1)
    cells, axes = _cells(keys, face, folded, zenith, distance)
    circle, level, length = cells
    setups, circles = [], np.zeros_like(circle.setup)
    turned = circle.value.copy()
    for rows in _by_setup(circle.setup):
        setups.append(_rounds(cells, rows))
        circles[rows] = _circles(circle, rows)
        for same in _by_setup(circles[rows]):
            _turn_to_first(turned, circle, rows[same])
    whole = circles * 0
    return Reduction(
        cells,
        axes,
        _closures(keys, face, closing, folded),
        tuple(setups),
        _means(replace(circle, circle=circles, value=turned), turn=True),
        _means(replace(level, circle=whole)),
        _means(replace(length, circle=whole)),
    )


def _by_setup(setup: Index) -> list[Index]:
    """Rows of each set-up, in their order."""
    order = np.argsort(setup, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(setup[order])) + 1) if len(order) else []


def _mean(
    values: Array, group: Index, size: int, *, turn: bool = False, weight: Index | None = None
) -> tuple[Array, Index]:
    """Means (size,) and counts of values by group; ``turn`` for angles around the circle.

    With ``weight``, the readings that each value is the mean of, the counts are those of readings.
    """
    known = np.isfinite(values)
    weight = np.ones(len(values), dtype=np.int64) if weight is None else weight
    count = np.bincount(group[known], weights=weight[known], minlength=size).astype(np.int64)
    base = np.full(size, np.nan)
    rows = np.flatnonzero(known)[::-1]
    base[group[rows]] = values[rows]
    offset = values - base[group]
    offset = wrapped(offset) if turn else offset
    total = np.bincount(group[known], weights=(weight * offset)[known], minlength=size)
    return base + total / np.maximum(count, 1), count


def _cells(
    keys: Index, face: NDArray[np.int8], folded: Array, zenith: Array, distance: Array
) -> tuple[Cells, AxisErrors]:
    """Means of faces for each set-up, set and target, which ``keys`` (n, 3) has."""
    unique, first, cell = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    cell = cell.ravel()
    size = len(unique)
    second = (face == 2).astype(np.int64)
    both, n_direction = _mean(folded, 2 * cell + second, 2 * size, turn=True)
    up, n_zenith = _mean(zenith, 2 * cell + second, 2 * size)
    distance, n_distance = _mean(distance, cell, size)
    half_direction = half_difference(both[0::2], both[1::2])
    half_zenith = (up[0::2] - up[1::2]) / 2
    direction = np.where(
        np.isfinite(half_direction), both[0::2] - half_direction,
        np.where(np.isfinite(both[0::2]), both[0::2], both[1::2]),
    ) % (2 * np.pi)  # fmt: skip
    level = np.where(
        np.isfinite(half_zenith), up[0::2] - half_zenith,
        np.where(np.isfinite(up[0::2]), up[0::2], up[1::2]),
    )  # fmt: skip
    axes = axis_errors(half_direction, half_zenith, np.where(np.isnan(level), np.pi / 2, level))

    def means(value: Array, readings: Index, far: NDArray[np.bool_]) -> Means:
        return Means(unique[:, 0], unique[:, 2], unique[:, 1], value, readings, first, far)

    return (
        means(direction, n_direction[0::2] + n_direction[1::2], axes.far_direction),
        means(level, n_zenith[0::2] + n_zenith[1::2], axes.far_zenith),
        means(distance, n_distance, np.zeros(size, dtype=bool)),
    ), axes


def _rounds(cells: Cells, rows: Index) -> SetupReduction:
    """Rounds of one set-up."""
    targets, column = np.unique(cells[0].target[rows], return_inverse=True)
    sets, row = np.unique(cells[0].circle[rows], return_inverse=True)
    if len(sets) * len(targets) > MOST_CELLS:
        raise InputError(
            f"a set-up has {len(sets)} sets of {len(targets)} targets, too many for one table",
            cure="split the file at the time of the set-up, or name the sets",
        )
    tables = []
    for means in cells:
        table = np.full((len(sets), len(targets)), np.nan)
        table[row, column] = np.where(means.far[rows], np.nan, means.value[rows])
        tables.append(table)
    return SetupReduction(
        int(cells[0].setup[rows[0]]),
        targets,
        sets,
        adjust_rounds(tables[0]),
        adjust_repeats(tables[1]),
        adjust_repeats(tables[2]),
    )


def _circles(cells: Means, rows: Index) -> Index:
    """Round (k,) of the cells of one set-up: sets of the same targets, equally often read."""
    members: dict[int, list[tuple[int, int]]] = {}
    for i in rows[np.isfinite(cells.value[rows]) & ~cells.far[rows]]:
        read_cell = (int(cells.target[i]), int(cells.readings[i]))
        members.setdefault(int(cells.circle[i]), []).append(read_cell)
    # a set without a target of those before it goes on with the orientation of the last one
    joined, place, seen = [], dict[int, int](), set[int]()
    for number, read in sorted(members.items()):
        targets = {target for target, _ in read}
        if not seen or targets & seen:
            joined.append(list[tuple[int, int]]())
        joined[-1] += read
        place[number] = len(joined) - 1
        seen |= targets
    rounds: dict[tuple[tuple[int, int], ...], int] = {}
    circle = [rounds.setdefault(tuple(sorted(read)), len(rounds)) for read in joined]
    # cells that are far off stand aside where another set has their target
    out = np.array([circle[place[n]] if (n := int(k)) in place else 0 for k in cells.circle[rows]],
                   dtype=np.int64)  # fmt: skip
    far = cells.far[rows]
    elsewhere = dict(zip(cells.target[rows][~far].tolist(), out[~far].tolist(), strict=True))
    for i in np.flatnonzero(far):
        out[i] = elsewhere.get(int(cells.target[rows[i]]), int(out[i]))
    return out


def _turn_to_first(direction: Array, cells: Means, rows: Index) -> None:
    """Turn the sets of one round, in place, into the orientation of its first set."""
    use = rows[np.isfinite(direction[rows]) & ~cells.far[rows]]
    if not len(use):
        return
    targets, column = np.unique(cells.target[use], return_inverse=True)
    reading = np.zeros(len(use), dtype=np.int64)
    order = np.lexsort((cells.circle[use], column))
    starts = np.flatnonzero(np.r_[True, np.diff(column[order]) > 0])
    reading[order] = np.arange(len(use)) - np.repeat(starts, np.diff(np.r_[starts, len(use)]))
    # each target was read equally often: the k-th readings belong to one set
    table = np.full((reading.max() + 1, len(targets)), np.nan)
    table[reading, column] = direction[use]
    first = table[:, :1] - table[:1, :1]
    turn = first[:, 0] + wrapped(table - table[:1] - first).mean(axis=1)
    direction[use] = (direction[use] - turn[reading]) % (2 * np.pi)


def _means(of: Means, *, turn: bool = False) -> Means:
    """Means over sets; faces too far apart take part only where there is nothing else."""
    known = np.flatnonzero(np.isfinite(of.value))
    keys = np.stack([of.setup[known], of.circle[known], of.target[known]], axis=1)
    unique, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.ravel()
    size = len(unique)
    far = of.far[known]
    good = np.bincount(group[~far], minlength=size) > 0
    use, group = known[~far | ~good[group]], group[~far | ~good[group]]
    mean, readings = _mean(of.value[use], group, size, turn=turn, weight=of.readings[use])
    first = np.full(size, np.iinfo(np.int64).max)
    np.minimum.at(first, group, of.first[use])
    mean = mean % (2 * np.pi) if turn else mean
    return Means(unique[:, 0], unique[:, 2], unique[:, 1], mean, readings, first, ~good)


def _closures(
    keys: Index, face: NDArray[np.int8], closing: NDArray[np.bool_], folded: Array
) -> Closures:
    """Closing readings against the first ones of the same target, set and face."""
    last = np.flatnonzero(closing & np.isfinite(folded))
    _, begin, group = np.unique(
        np.column_stack([keys, face]), axis=0, return_index=True, return_inverse=True
    )
    first = begin[group.ravel()[last]]
    difference = wrapped(folded[last] - folded[first]) if len(last) else np.empty(0)
    setup, number, target = keys[last].T
    return Closures(setup, number, target, face[last], difference)
