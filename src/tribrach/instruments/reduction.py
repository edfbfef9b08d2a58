"""From readings in two faces and several sets to one direction, zenith angle and distance each.

Readings of both faces are paired for each target and set; the day's collimation and index error
come from all pairs of the file, the residuals of the sets from the rounds of each set-up. What the
network gets are means over faces and sets, with the number of readings in each.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.instruments.faces import AxisErrors, axis_errors, fold, half_difference
from tribrach.instruments.rounds import Repeats, Rounds, adjust_repeats, adjust_rounds, wrapped
from tribrach.instruments.sets import find_sets

__all__ = ["Cells", "Closures", "Means", "Readings", "Reduction", "SetupReduction", "reduce"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: sets whose common targets differ by less were read with the circle unmoved [rad]
UNMOVED = 1e-3
#: sets times targets of one set-up
MOST_CELLS = 10_000_000


@dataclass(frozen=True)
class Readings:
    """n readings in the order they were taken.

    setup, target (n,) indices; face (n,) 1 or 2; direction, zenith (n,) as read [rad]; distance
    (n,) corrected [m]; NaN where not read; series (n,) number of the set if it is known, else 0.
    """

    setup: Index
    target: Index
    face: NDArray[np.int8]
    direction: Array
    zenith: Array
    distance: Array
    series: Index


@dataclass(frozen=True)
class Cells:
    """n means of a target in a set of a set-up.

    setup, set, target (n,); direction, zenith (n,) means of faces, or what one face says;
    distance (n,); half_direction, half_zenith (n,) half differences of the faces, NaN where only
    one was read; directions, zeniths, distances (n,) how many readings; first (n,) index of the
    first reading; far_direction, far_zenith (n,) faces too far apart.
    """

    setup: Index
    set: Index
    target: Index
    direction: Array
    zenith: Array
    distance: Array
    half_direction: Array
    half_zenith: Array
    directions: Index
    zeniths: Index
    distances: Index
    first: Index
    far_direction: NDArray[np.bool_]
    far_zenith: NDArray[np.bool_]


@dataclass(frozen=True)
class Closures:
    """n closed horizons: set-up, set, target, face (n,) and last less first reading (n,) [rad]."""

    setup: Index
    set: Index
    target: Index
    face: NDArray[np.int8]
    difference: Array


@dataclass(frozen=True)
class SetupReduction:
    """The rounds of a set-up: targets (t,) and sets (s,) of its tables, adjusted."""

    setup: int
    targets: Index
    sets: Index
    rounds: Rounds
    zeniths: Repeats
    distances: Repeats


@dataclass(frozen=True)
class Means:
    """n values for the network.

    setup, target (n,); circle (n,) counts positions of the circle in a set-up, from 0; value (n,);
    readings (n,) that it is the mean of; first (n,) index of the first; far (n,) True if the faces
    of all its readings were too far apart.
    """

    setup: Index
    target: Index
    circle: Index
    value: Array
    readings: Index
    first: Index
    far: NDArray[np.bool_]


@dataclass(frozen=True)
class Reduction:
    """All that the readings of a file give."""

    cells: Cells
    axes: AxisErrors
    closures: Closures
    setups: tuple[SetupReduction, ...]
    directions: Means
    zeniths: Means
    distances: Means


def reduce(readings: Readings) -> Reduction:
    """Pair faces, adjust rounds, average.

    Raises
    ------
    InputError : a set-up with more sets and targets than a table holds.
    """
    number = np.zeros(len(readings.setup), dtype=np.int64)
    closing = np.zeros(len(readings.setup), dtype=bool)
    for setup in np.unique(readings.setup):
        rows = np.flatnonzero(readings.setup == setup)
        found = find_sets(readings.target[rows], readings.face[rows], readings.series[rows])
        number[rows], closing[rows] = found.number, found.closing
    folded, zenith = fold(readings.direction, readings.zenith, readings.face)
    cells, axes = _cells(readings, number, folded, zenith)
    setups, circles = [], np.zeros(len(cells.setup), dtype=np.int64)
    for setup in np.unique(cells.setup):
        rows = np.flatnonzero(cells.setup == setup)
        reduced, table = _rounds(cells, rows)
        setups.append(reduced)
        moved = _circles(table)
        circles[rows] = moved[np.searchsorted(reduced.sets, cells.set[rows])]
    return Reduction(
        cells,
        axes,
        _closures(readings, number, closing, folded),
        tuple(setups),
        _means(cells, circles, cells.direction, cells.directions, cells.far_direction, turn=True),
        _means(cells, circles * 0, cells.zenith, cells.zeniths, cells.far_zenith),
        _means(
            cells, circles * 0, cells.distance, cells.distances, np.zeros_like(cells.far_zenith)
        ),
    )


def _mean(values: Array, group: Index, size: int, *, turn: bool = False) -> tuple[Array, Index]:
    """Means (size,) and counts of values by group; turn : angles around the circle."""
    known = np.isfinite(values)
    count = np.bincount(group[known], minlength=size)
    base = np.full(size, np.nan)
    rows = np.flatnonzero(known)[::-1]
    base[group[rows]] = values[rows]
    offset = values - base[group]
    offset = wrapped(offset) if turn else offset
    total = np.bincount(group[known], weights=offset[known], minlength=size)
    return base + total / np.maximum(count, 1), count


def _cells(
    readings: Readings, number: Index, folded: Array, zenith: Array
) -> tuple[Cells, AxisErrors]:
    """Means of faces for each set-up, set and target."""
    keys = np.stack([readings.setup, number, readings.target], axis=1)
    unique, first, cell = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    cell = cell.ravel()
    size = len(unique)
    second = (readings.face == 2).astype(np.int64)
    both, n_direction = _mean(folded, 2 * cell + second, 2 * size, turn=True)
    up, n_zenith = _mean(zenith, 2 * cell + second, 2 * size)
    distance, n_distance = _mean(readings.distance, cell, size)
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
    return Cells(
        unique[:, 0],
        unique[:, 1],
        unique[:, 2],
        direction,
        level,
        distance,
        half_direction,
        half_zenith,
        n_direction[0::2] + n_direction[1::2],
        n_zenith[0::2] + n_zenith[1::2],
        n_distance,
        first,
        axes.far_direction,
        axes.far_zenith,
    ), axes


def _rounds(cells: Cells, rows: Index) -> tuple[SetupReduction, Array]:
    """Rounds of one set-up, and its table of directions (s, t)."""
    targets, column = np.unique(cells.target[rows], return_inverse=True)
    sets, row = np.unique(cells.set[rows], return_inverse=True)
    if len(sets) * len(targets) > MOST_CELLS:
        raise InputError(
            f"a set-up has {len(sets)} sets of {len(targets)} targets, too many for one table",
            cure="split the file at the time of the set-up, or name the sets",
        )
    tables = []
    for values, far in (
        (cells.direction, cells.far_direction),
        (cells.zenith, cells.far_zenith),
        (cells.distance, np.zeros_like(cells.far_zenith)),
    ):
        table = np.full((len(sets), len(targets)), np.nan)
        table[row, column] = np.where(far[rows], np.nan, values[rows])
        tables.append(table)
    reduced = SetupReduction(
        int(cells.setup[rows[0]]),
        targets,
        sets,
        adjust_rounds(tables[0]),
        adjust_repeats(tables[1]),
        adjust_repeats(tables[2]),
    )
    return reduced, tables[0]


def _circles(table: Array) -> Index:
    """Position of the circle of each set (s,): a new one where common targets show that it moved.

    A set is compared with the first one of the current position, and of those before it.
    """
    s, t = table.shape
    circle = np.zeros(s, dtype=np.int64)
    reference: list[Array] = [np.full(t, np.nan)]
    for k in range(s):
        for c in (len(reference) - 1, *range(len(reference) - 1)):
            difference = wrapped(table[k] - reference[c])
            common = np.isfinite(difference)
            if not common.any() or abs(np.median(difference[common])) < UNMOVED:
                break
        else:
            c = len(reference)
            reference.append(np.full(t, np.nan))
        circle[k] = c
        reference[c] = np.where(np.isnan(reference[c]), table[k], reference[c])
    return circle


def _means(
    cells: Cells,
    circle: Index,
    values: Array,
    counts: Index,
    far: NDArray[np.bool_],
    *,
    turn: bool = False,
) -> Means:
    """Means over sets; faces too far apart take part only where there is nothing else."""
    known = np.flatnonzero(np.isfinite(values))
    keys = np.stack([cells.setup[known], circle[known], cells.target[known]], axis=1)
    unique, group = np.unique(keys, axis=0, return_inverse=True)
    group = group.ravel()
    size = len(unique)
    good = np.bincount(group[~far[known]], minlength=size) > 0
    use = known[~far[known] | ~good[group]]
    group = group[~far[known] | ~good[group]]
    mean, _ = _mean(values[use], group, size, turn=turn)
    readings = np.bincount(group, weights=counts[use], minlength=size).astype(np.int64)
    first = np.full(size, np.iinfo(np.int64).max)
    np.minimum.at(first, group, cells.first[use])
    mean = mean % (2 * np.pi) if turn else mean
    return Means(unique[:, 0], unique[:, 2], unique[:, 1], mean, readings, first, ~good)


def _closures(
    readings: Readings, number: Index, closing: NDArray[np.bool_], folded: Array
) -> Closures:
    """Closing readings against the first ones of the same target, set and face."""
    last = np.flatnonzero(closing & np.isfinite(folded))
    keys = np.stack([readings.setup, number, readings.target, readings.face], axis=1)
    first = np.array([np.flatnonzero((keys == keys[i]).all(axis=1))[0] for i in last], dtype=int)
    difference = wrapped(folded[last] - folded[first]) if len(last) else np.empty(0)
    return Closures(
        readings.setup[last], number[last], readings.target[last], readings.face[last], difference
    )
