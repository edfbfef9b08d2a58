"""Medians and sums by group, for values and for angles."""

from __future__ import annotations

import numpy as np

from tribrach._types import Array, Index


def wrap(angle: Array) -> Array:
    """Angles [rad] brought to (-pi, pi]."""
    out: Array = -np.remainder(np.pi - angle, 2 * np.pi) + np.pi
    return out


def azimuth(d: Array) -> Array:
    """Azimuths [rad] clockwise from north of plan vectors (n, 2)."""
    out: Array = np.arctan2(d[:, 0], d[:, 1])
    return out


def pair_key(a: Index, b: Index, n: int) -> Index:
    """One number for each unordered pair of numbers below n."""
    out: Index = np.minimum(a, b) * n + np.maximum(a, b)
    return out


def grouped_sum(group: Index, size: int, values: Array) -> Array:
    """Sums (size, ...) of values (n, ...) by group number (n,)."""
    flat = values.reshape(len(values), int(np.prod(values.shape[1:], dtype=int)))
    out = np.stack([np.bincount(group, c, minlength=size) for c in flat.T], axis=1)
    sums: Array = out.reshape(size, *values.shape[1:]).astype(float)
    return sums


def grouped_median(group: Index, values: Array) -> tuple[Index, Array, Index]:
    """Medians of columns, by group.

    ``group`` (n,): group of each row; ``values`` (n, k): rows. Returns ``keys`` (g,): groups that
    occur; ``medians`` (g, k): their medians by column; ``count`` (g,): their members.
    """
    keys, first, count = np.unique(np.sort(group), return_index=True, return_counts=True)
    medians = np.empty((len(keys), values.shape[1]))
    for k, column in enumerate(values.T):
        ordered = column[np.lexsort((column, group))]
        medians[:, k] = (ordered[first + (count - 1) // 2] + ordered[first + count // 2]) / 2
    return keys, medians, count


def grouped_angle(group: Index, angle: Array) -> tuple[Index, Array, Index]:
    """Medians of angles on the circle, by group.

    The circle is cut open opposite to each group's mean direction.

    ``group`` (n,): group of each angle; ``angle`` (n,): angles [rad]. Returns ``keys`` (g,): groups
    that occur; ``medians`` (g,): their medians [rad]; ``count`` (g,): their members.
    """
    keys, inverse = np.unique(group, return_inverse=True)
    sums = grouped_sum(inverse, len(keys), np.stack([np.sin(angle), np.cos(angle)], axis=1))
    reference = np.arctan2(sums[:, 0], sums[:, 1])
    _, medians, count = grouped_median(inverse, wrap(angle - reference[inverse])[:, None])
    return keys, reference + medians[:, 0], count
