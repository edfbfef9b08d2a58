"""Finds where surfels are pieces of round bodies, and how these bend, from neighbouring surfels.

The mean of points on a trunk lies inside it, the plane of its cube leans as the scanner saw more of
one side, and beyond the cube the trunk falls away from the plane: two stations that each see their
own side of it would be pushed apart. A surface ``f(x) = 0`` of second order has ``mean f = 0`` over
any points on it, and the mean over a cube is known from its mean and spread, whatever part of the
cube was seen and how densely. Surfels about each one give its gradient and second derivatives; they
are taken where they explain these significantly better than a plane does (method section 2.11).
Metres.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from pykdtree.kdtree import KDTree

from tribrach.kernels import in_threads, njit
from tribrach.registration.clouds.surfels import ROUND, UNKNOWN, Surfels
from tribrach.statistics import f as fisher


@dataclass(frozen=True)
class CurvatureGates:
    """Which neighbours tell how a surface bends, and when it is called round.

    Chosen by hand with test_round.
    """

    #: surfels that are looked at about each one, and how far away they may be [sizes]
    neighbours: int = 24
    reach_sizes: float = 2.5
    like_sizes: float = 2.5  #: their sizes differ by no more than this factor
    #: normals of one surface turn by less than this over the reach [cosine] ...
    alike_cosine: float = 0.3
    #: ... and the chord to a neighbour is square to the mean of both normals, to this [sizes]
    chord_sizes: float = 0.25
    fewest: int = 8  #: fewer surfels do not tell six parameters
    level: float = 1e-4  #: chance that a plane is called round (F-test)
    surface_m: float = 3e-4  #: error of single surfels that no scatter tells [m]
    passes: int = 3  #: passes with the strongest curvature along the first axis
    #: the surface explains its neighbours up to this many times their variance
    most_variance: float = 25.0
    flat_sigmas: float = 3.0  #: half of the neighbours of a plane lie in it, up to this many sigmas
    #: they tell that it is flat if they lie to both sides of any line, on the average so far
    #: [sizes]
    across_sizes: float = 0.3


GATES = CurvatureGates()


def formed(surfels: Surfels, most: int) -> Surfels:
    """Thin surfels, and say which of those that remain are pieces of round bodies."""
    kept = surfels.thinned(most)
    if len(surfels) < GATES.fewest:
        return kept
    count = min(GATES.neighbours, len(surfels))
    tree = KDTree(np.ascontiguousarray(surfels.center), leafsize=16)
    far, near = tree.query(np.ascontiguousarray(kept.center), k=count, sqr_dists=False)
    usual = float(np.median(surfels.thickness))
    variance = usual**2 / surfels.count + GATES.surface_m**2
    freedom = np.arange(GATES.fewest - 6, count - 5)
    limits = np.concatenate(
        [np.full(GATES.fewest - 6, np.inf), fisher.ppf(1 - GATES.level, 3, freedom)]
    )
    mine = usual**2 / kept.count + GATES.surface_m**2
    table = np.zeros((len(near), 13))
    in_threads(
        _fitted,
        len(near),
        near.astype(np.int64),
        far,
        (kept.center, kept.normal, kept.size, mine, np.sqrt(mine) / kept.width[:, 0]),
        (surfels.center, surfels.normal, surfels.size, surfels.spread, variance),
        (GATES.reach_sizes, GATES.like_sizes, GATES.alike_cosine, GATES.chord_sizes),
        (GATES.fewest, GATES.passes, GATES.most_variance, GATES.flat_sigmas, GATES.across_sizes),
        limits,
        table,
        least=256,
    )
    form = table[:, 0].astype(np.int8)
    bends = form == ROUND
    gradient, bend = kept.normal.copy(), np.zeros((len(kept), 3, 3))
    gradient[bends] = table[bends, 1:4]
    bend[bends] = table[bends, 4:].reshape(-1, 3, 3)
    return replace(kept, form=form, gradient=gradient, bend=bend)


@njit(cache=True, nogil=True)
def _fitted(first, last, near, far, here, there, same, gates, limits, out):  # type: ignore[no-untyped-def]
    """Form, gradient and second derivatives (n, 13) of each surfel."""
    for i in range(first, last):
        number = np.empty(near.shape[1], dtype=np.int64)
        place = here[0][i], here[1][i], here[2][i]
        k = _neighbours(near[i], far[i], place, there, same, number)
        if k >= gates[0]:
            _fit(place, there, number[:k], gates, limits, out[i])
        if out[i, 0] == ROUND:
            continue
        if not _flat(place, here[3][i], here[4][i], there, number[:k], gates):
            out[i, 0] = UNKNOWN


@njit(cache=True, nogil=True)
def _flat(place, variance, tilt, there, number, gates):  # type: ignore[no-untyped-def]
    """True if half of the neighbours or more lie in the plane of a surfel, and all about it."""
    center, normal, size = place
    off = np.empty(len(number))
    scatter = np.zeros((3, 3))
    d = np.empty(3)
    count = 0
    for j in number:
        height, square = 0.0, 0.0
        for a in range(3):
            d[a] = there[0][j, a] - center[a]
            height += normal[a] * d[a]
            square += d[a] * d[a]
        # its own mean is among the neighbours
        if square > 0.0:
            off[count] = abs(height) / np.sqrt(variance + there[4][j] + square * tilt**2)
            count += 1
            for a in range(3):
                for b in range(3):
                    scatter[a, b] += (d[a] - height * normal[a]) * (d[b] - height * normal[b])
    if count == 0 or np.median(off[:count]) > gates[3]:
        return False
    # the lesser of two eigenvalues, the third being zero
    trace, product = 0.0, 0.0
    for a in range(3):
        trace += scatter[a, a]
        b = (a + 1) % 3
        product += scatter[a, a] * scatter[b, b] - scatter[a, b] ** 2
    least = 0.5 * trace - np.sqrt(max(0.25 * trace**2 - product, 0.0))
    return least > count * (gates[4] * size) ** 2


@njit(cache=True, nogil=True)
def _neighbours(near, far, place, there, same, number):  # type: ignore[no-untyped-def]
    """How many neighbours belong to the same surface; their numbers are entered."""
    center, normal, size = place
    reach, like, alike, askew = same
    k = 0
    for q in range(len(near)):
        j = near[q]
        if j >= len(there[0]) or far[q] > reach * size:
            continue
        ratio = there[2][j] / size
        if ratio > like or ratio * like < 1.0:
            continue
        cosine, chord = 0.0, 0.0
        for a in range(3):
            cosine += there[1][j, a] * normal[a]
            chord += (there[1][j, a] + normal[a]) * (there[0][j, a] - center[a])
        if cosine < alike:
            continue
        if abs(chord) > askew * size * np.sqrt(2.0 + 2.0 * cosine):
            continue
        number[k] = j
        k += 1
    return k


@njit(cache=True, nogil=True)
def _fit(place, there, number, gates, limits, out):  # type: ignore[no-untyped-def]
    """Fit a surface of second order to the means and spreads of surfels, if a plane does not do.

    In axes u, v, n at the mean: n = e + s u + t v - k (u^2 + n^2) / 2 - l u v - m v^2 / 2, with the
    strongest curvature along u, so that cylinders and spheres are exact. Lengths in sizes.
    """
    center, normal, size = place
    passes, most = gates[1], gates[2]
    variance = there[4]
    k = len(number)
    axes = np.zeros((3, 3))
    least = 0
    for a in range(3):
        axes[2, a] = normal[a]
        if abs(normal[a]) < abs(normal[least]):
            least = a
    axes[0, least] = 1.0
    design, right = np.empty((k, 6)), np.empty(k)
    matrix, lower = np.empty((6, 6)), np.empty((6, 6))
    x, plane = np.empty(6), np.empty(6)
    squares = 0.0
    for turn in range(passes):
        _complete(axes)
        _equations(center, size, axes, there, number, turn > 0, design, right)
        _normal_equations(design, right, variance, number, size, matrix, x)
        if turn == 0:
            for a in range(6):
                plane[a] = x[a]
                for b in range(6):
                    lower[a, b] = matrix[a, b]
            if not _solved(lower, plane, 3):
                return
            flat = _squares(design, right, variance, number, size, plane, 3)
        if not _solved(matrix, x, 6):
            return
        squares = _squares(design, right, variance, number, size, x, 6)
        if turn == 0 and flat - squares < 3.0 * limits[k - 6] * squares / (k - 6):
            return
        if turn < passes - 1:
            # the strongest curvature along the first axis
            angle = 0.5 * np.arctan2(2.0 * x[4], x[3] - x[5])
            if x[3] + x[5] < 0.0:
                angle += 0.5 * np.pi
            c, s = np.cos(angle), np.sin(angle)
            for a in range(3):
                u, v = axes[0, a], axes[1, a]
                axes[2, a] -= x[1] * u + x[2] * v
                axes[0, a] = c * u + s * v
    if squares > most * (k - 6):
        return
    out[0] = ROUND
    # the gradient of f at the mean of the surfel, to length one, and the second derivatives
    length = np.sqrt(1.0 + x[1] ** 2 + x[2] ** 2)
    for a in range(3):
        out[1 + a] = (axes[2, a] - x[1] * axes[0, a] - x[2] * axes[1, a]) / length
        for b in range(3):
            uu = axes[0, a] * axes[0, b] + axes[2, a] * axes[2, b]
            uv = axes[0, a] * axes[1, b] + axes[1, a] * axes[0, b]
            vv = axes[1, a] * axes[1, b]
            out[4 + 3 * a + b] = (x[3] * uu + x[4] * uv + x[5] * vv) / (size * length)


@njit(cache=True, nogil=True)
def _complete(axes):  # type: ignore[no-untyped-def]
    """Make axes (3, 3) orthonormal, the third first."""
    square, along = 0.0, 0.0
    for a in range(3):
        square += axes[2, a] ** 2
        along += axes[0, a] * axes[2, a]
    for a in range(3):
        axes[0, a] -= along / square * axes[2, a]
        axes[2, a] /= np.sqrt(square)
    square = 0.0
    for a in range(3):
        square += axes[0, a] ** 2
    for a in range(3):
        axes[0, a] /= np.sqrt(square)
    axes[1, 0] = axes[2, 1] * axes[0, 2] - axes[2, 2] * axes[0, 1]
    axes[1, 1] = axes[2, 2] * axes[0, 0] - axes[2, 0] * axes[0, 2]
    axes[1, 2] = axes[2, 0] * axes[0, 1] - axes[2, 1] * axes[0, 0]


@njit(cache=True, nogil=True)
def _equations(center, size, axes, there, number, full, design, right):  # type: ignore[no-untyped-def]
    """Design and right side: the mean of the surface over the points of each neighbour is zero."""
    d, second = np.empty(3), np.empty(4)
    for q in range(len(number)):
        j = number[q]
        spread = there[3][j]
        for a in range(3):
            d[a] = 0.0
            for b in range(3):
                d[a] += axes[a, b] * (there[0][j, b] - center[b]) / size
        for a in range(4):
            second[a] = 0.0
        for b in range(3):
            for c in range(3):
                w = spread[b, c] / size**2
                second[0] += axes[0, b] * w * axes[0, c]
                second[1] += axes[0, b] * w * axes[1, c]
                second[2] += axes[1, b] * w * axes[1, c]
                second[3] += axes[2, b] * w * axes[2, c]
        across = d[2] ** 2 + second[3] if full else 0.0
        design[q, 0] = 1.0
        design[q, 1] = d[0]
        design[q, 2] = d[1]
        design[q, 3] = -0.5 * (d[0] ** 2 + second[0] + across)
        design[q, 4] = -(d[0] * d[1] + second[1])
        design[q, 5] = -0.5 * (d[1] ** 2 + second[2])
        right[q] = d[2]


@njit(cache=True, nogil=True)
def _normal_equations(design, right, variance, number, size, matrix, x):  # type: ignore[no-untyped-def]
    for a in range(6):
        x[a] = 0.0
        for b in range(6):
            matrix[a, b] = 0.0
    for q in range(len(right)):
        weight = size**2 / variance[number[q]]
        for a in range(6):
            w = weight * design[q, a]
            x[a] += w * right[q]
            for b in range(a + 1):
                matrix[a, b] += w * design[q, b]


@njit(cache=True, nogil=True)
def _solved(matrix, x, count):  # type: ignore[no-untyped-def]
    """Solve for the first unknowns in place by Cholesky's factor; False if they are not told."""
    for a in range(count):
        own = matrix[a, a]
        for b in range(a + 1):
            value = matrix[a, b]
            for c in range(b):
                value -= matrix[a, c] * matrix[b, c]
            if b < a:
                matrix[a, b] = value / matrix[b, b]
            elif value <= 1e-6 * own:
                return False
            else:
                matrix[a, a] = np.sqrt(value)
    for a in range(count):
        for b in range(a):
            x[a] -= matrix[a, b] * x[b]
        x[a] /= matrix[a, a]
    for a in range(count - 1, -1, -1):
        for b in range(a + 1, count):
            x[a] -= matrix[b, a] * x[b]
        x[a] /= matrix[a, a]
    return True


@njit(cache=True, nogil=True)
def _squares(design, right, variance, number, size, x, count):  # type: ignore[no-untyped-def]
    """Weighted sum of squared residuals."""
    total = 0.0
    for q in range(len(right)):
        left = right[q]
        for a in range(count):
            left -= design[q, a] * x[a]
        total += left**2 * size**2 / variance[number[q]]
    return total
