"""Tests whether parts of a sweep fit alike: a scanner that moved while it scanned has no one pose.

Cubes of matches that share no errors with each other are the pieces of the test. About either
scanner they fall into sectors and zones; if the residuals are white beyond the size of the cubes,
the sums of their scores over a part are sums of independent pieces with either sign. Signs are
drawn at random for all pieces (the wild bootstrap of Wu 1986), and what the true signs make of the
parts is compared with what the drawn ones do. Method section 2.11.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.kernels import njit


@dataclass(frozen=True)
class SweepGates:
    """Which parts of a sweep are compared.

    Sectors and zones are those that a turning, a nodding and a driving scanner bends differently.
    Tried on scans of such scanners and on simulated ones
    that stood still (tests/registration/clouds/test_no_return).
    """

    #: sectors about either scanner, each also turned by half of one
    sectors: tuple[int, ...] = (2, 3, 4, 6, 8)
    zones: tuple[int, ...] = (2, 2, 4)  #: zones along the axes of either scanner
    #: draws of signs, and the share of them that may make as much where a scanner stood still
    draws: int = 999
    level: float = 0.01
    fewest_pieces: int = 20  #: fewer pieces tell nothing


GATES = SweepGates()


@dataclass(frozen=True)
class SweepTest:
    """How parts of a sweep fit."""

    #: variance that the parts show in their worst direction over that of independent pieces, 1 if
    #: chance may have made it
    factor: float = 1.0
    #: variance of the worst parts over all directions together, in the same unit
    ratio: float = 1.0
    limit: float = 1.0  #: what chance makes of the ratio


def sweep_test(scores: Array, normal: Array, places: tuple[Array, Array]) -> SweepTest:
    """Test whether the parts of a sweep fit alike.

    ``scores`` are sums of weighted residuals times design of each piece, which total zero; the
    normal matrices total the identity. ``places`` are in the frames of both scanners [m].
    """
    if len(scores) < GATES.fewest_pieces or scores.shape[1] == 0:
        return SweepTest()
    rng = np.random.default_rng(0)
    signs = rng.integers(0, 2, (GATES.draws + 1, len(scores)), dtype=np.int8)
    signs = 2 * signs - 1
    # the first row is what was measured
    signs[0] = 1
    squares = np.stack(_squares(scores, normal, places, signs.astype(np.int8)), axis=1)
    drawn = squares[1:]
    usual, spread = drawn.mean(axis=0), drawn.std(axis=0)
    told = spread > 0
    usual, spread, squares = usual[told], spread[told], squares[:, told]
    if not told.any():
        return SweepTest()
    excess = (squares - usual) / spread
    most = float(np.quantile(excess[1:].max(axis=1), 1 - GATES.level))
    if excess[0].max() <= most:
        return SweepTest()
    ratios = np.where(excess[0] > most, squares[0] / usual, 0.0)
    worst = int(np.argmax(ratios))
    limit = 1 + most * spread[worst] / usual[worst]
    # a motion bends a sweep in one or two directions of the six: the mean over all would hide it
    root = np.linalg.inv(np.linalg.cholesky(scores.T @ scores))
    shown = np.flatnonzero(told)[excess[0] > most]
    scatter = _scatter(scores, normal, places)
    most_of = [np.linalg.eigvalsh(root @ scatter[k] @ root.T)[-1] for k in shown]
    return SweepTest(float(max(ratios[worst], *most_of)), float(ratios[worst]), float(limit))


def _scatter(scores: Array, normal: Array, places: tuple[Array, Array]) -> list[Array]:
    """Covariances (k, k) of the total score, from the scatter of the parts of each kind."""
    ones = np.ones((1, len(scores)), dtype=np.int8)
    out = []
    for sums, matrix, count in _parts(scores, normal, places, ones):
        left = _left(sums, matrix, count)[0]
        out.append(count / (count - 1) * left.T @ left)
    return out


def _squares(
    scores: Array, normal: Array, places: tuple[Array, Array], signs: NDArray[np.int8]
) -> list[Array]:
    """Squared scores (draws,) of all parts of each kind, with every draw of the signs."""
    return [
        np.asarray(np.square(_left(*part)).sum(axis=(1, 2)))
        for part in _parts(scores, normal, places, signs)
    ]


def _parts(
    scores: Array, normal: Array, places: tuple[Array, Array], signs: NDArray[np.int8]
) -> Iterator[tuple[Array, Array, int]]:
    """Fine sums of signed scores and of normal matrices, and the number of parts, of each kind."""
    finest = 2 * int(np.lcm.reduce(GATES.sectors))
    for place in places:
        turn = (np.arctan2(place[:, 1], place[:, 0]) / (2 * np.pi) + 0.5) * finest
        label = np.clip(turn.astype(np.int64), 0, finest - 1)
        sums, matrix = _by_label(label, finest, scores, normal, signs)
        for count in GATES.sectors:
            for shift in (0, finest // (2 * count)):
                turned = np.roll(sums, shift, axis=1), np.roll(matrix, shift, axis=0)
                yield *turned, count
        ways = place / np.maximum(np.linalg.norm(place, axis=1), 1e-9)[:, None]
        for axis, zones in enumerate(GATES.zones):
            limits = np.quantile(ways[:, axis], np.arange(1, zones) / zones)
            label = np.searchsorted(limits, ways[:, axis])
            yield *_by_label(label, zones, scores, normal, signs), zones


def _by_label(
    label: Index, count: int, scores: Array, normal: Array, signs: NDArray[np.int8]
) -> tuple[Array, Array]:
    """Sums by label: of signed scores (draws, count, k) and of normal matrices (count, k, k)."""
    sums = np.zeros((len(signs), count, scores.shape[1]))
    _signed(label, scores, signs, sums)
    matrix = np.zeros((count, *normal.shape[1:]))
    np.add.at(matrix, label, normal)
    return sums, matrix


def _left(sums: Array, matrix: Array, count: int) -> Array:
    """Scores (draws, count, k) of so many parts, each joined of fine ones that follow each other.

    What is fitted takes the share of the normal matrix of a part, times the total, from its sum.
    """
    draws, fine, k = sums.shape
    sums = sums.reshape(draws, count, fine // count, k).sum(axis=2)
    matrix = matrix.reshape(count, fine // count, k, k).sum(axis=1)
    return np.asarray(sums - np.einsum("nij,dj->dni", matrix, sums.sum(axis=1)))


@njit(cache=True, nogil=True)
def _signed(label, scores, signs, sums):  # type: ignore[no-untyped-def]
    for d in range(len(signs)):
        for n in range(len(label)):
            for j in range(scores.shape[1]):
                sums[d, label[n], j] += signs[d, n] * scores[n, j]
