"""Compares distances between targets with known ones: what two stations cannot see of a scanner.

A scale of the range is the same at every station, so that no comparison of stations shows it; it
takes lengths from elsewhere, of a total station, a tracker or control points. With the measured
mean distances ``d`` of every station, the known ones ``l`` and the range zero ``x10``,

``d - l = s l + x10 c``

gives the scale s beside the range zero, whose columns c are those of the comparison of stations
(method section 11.3).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from tribrach._types import Array, Index
from tribrach.answers import Estimate, Number, Table, Test, Vector
from tribrach.calibration.misalignment_search import whitened
from tribrach.calibration.scanner_readings import ScannerReadings
from tribrach.calibration.target_distances import measured_distances
from tribrach.sentences import Sentence
from tribrach.statistics import chi2, norm

#: directions of a covariance with a smaller share of its largest variance have no own information:
#: what is left there is of second order in the errors
_DIRECTION = 1e-6
#: a difference beyond this share of a length and this many metres is no error of a range
GROSS, GROSS_METRES = 0.01, 0.1
#: error probability of naming an entry of a table that is in order, of all entries together
_ALPHA_BLUNDER = 0.001
#: the other lengths fit if they are less probable than this
_ALPHA_REST = 0.01


@dataclass(frozen=True)
class KnownLengths:
    """Distances between targets that are known."""

    pairs: tuple[tuple[str, str], ...]  #: their targets
    lengths: Array  #: (k,), distances [m]
    covariance: Array  #: (k, k), their covariance [m^2]
    #: what the table states and can state wrongly, in words, with the lengths that it makes: a
    #: distance its own, coordinates of a point all those of the point
    entries: tuple[tuple[str, tuple[int, ...]], ...] = ()
    #: targets with coordinates that state no sigma and so make no known length
    without_sigma: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.pairs)

    def without(self, rows: Collection[int]) -> KnownLengths:
        """The others, without some of the lengths."""
        keep = [k for k in range(len(self)) if k not in rows]
        new = {old: k for k, old in enumerate(keep)}
        entries = ((what, tuple(new[k] for k in own if k in new)) for what, own in self.entries)
        return replace(
            self,
            pairs=tuple(self.pairs[k] for k in keep),
            lengths=self.lengths[keep],
            covariance=self.covariance[np.ix_(keep, keep)],
            entries=tuple((what, own) for what, own in entries if own),
        )


@dataclass(frozen=True)
class LengthRows(Table):
    """A known length and what a station measured [m]."""

    station: tuple[str, ...]
    from_: tuple[str, ...]
    to: tuple[str, ...]
    #: mean over the series of the station
    measured: Vector
    known: Vector
    #: measured less known
    difference: Vector
    sigma: Vector
    limit: Vector  #: limits that hold together with 1 - alpha or more


@dataclass(frozen=True)
class LengthCheck(Test, without=("zero", "after", "after_limit", "alpha")):
    """Measured distances against known ones."""

    #: scale of the range
    scale: Number
    sigma_scale: Number
    beside_zero: bool  #: true if it was estimated beside a range zero
    zero: Estimate  #: that range zero [m]; NaN if there is none
    #: largest ratio of scale and its sigma
    t_limit: Number
    rows: LengthRows
    #: weighted sum of squares that scale and range zero leave, and its chi-square limit
    after: float
    after_limit: float
    alpha: float  #: error probability of both tests together

    @property
    def fits(self) -> bool:
        """True if the differences are noise."""
        return self.statistic <= self.limit

    @property
    def scale_passed(self) -> bool:
        """True if no scale is significant."""
        return not abs(self.scale) > self.t_limit * self.sigma_scale

    @property
    def passed(self) -> bool:
        """True if the differences are noise and there is no scale."""
        return self.fits and self.scale_passed


def compare_lengths(
    readings: ScannerReadings, known: KnownLengths, alpha: float = 0.05
) -> LengthCheck | None:
    """Compare mean distances of every station with known lengths (method section 11.3)."""
    joined = _joined(readings, known)
    if joined is None:
        return None
    row, stations, measured, covariance, (white, design, _) = joined
    difference = measured - known.lengths[row]
    half = 1 - np.sqrt(1 - alpha)
    each = 1 - (1 - alpha) ** (1 / len(row))
    sigma = np.sqrt(np.diag(covariance))
    statistic, dof = float(white @ white), len(white)
    value, sigmas, after = _scale(white, design)
    left = dof - len(value)
    return LengthCheck(
        rows=LengthRows(
            stations,
            tuple(known.pairs[k][0] for k in row),
            tuple(known.pairs[k][1] for k in row),
            measured,
            known.lengths[row],
            difference,
            sigma,
            sigma * norm.ppf(1 - each / 2),
        ),
        statistic=statistic,
        dof=dof,
        limit=float(chi2.ppf(1 - half, dof)),
        p=float(chi2.sf(statistic, dof)),
        scale=float(value[0]),
        sigma_scale=float(sigmas[0]),
        beside_zero=len(value) > 1,
        zero=Estimate(*(float(v[1]) if len(value) > 1 else math.nan for v in (value, sigmas))),
        after=after,
        after_limit=float(chi2.ppf(1 - half, left)) if left else 0.0,
        t_limit=float(norm.ppf(1 - half / 2)),
        alpha=alpha,
    )


def without_blunders(
    readings: ScannerReadings, known: KnownLengths
) -> tuple[KnownLengths, tuple[str, ...]]:
    """Take out what a table states wrongly, and say so (method section 11.3).

    A difference of more than a hundredth of a length and a tenth of a metre is no error of a range.
    A smaller one is named if its entry alone explains why the lengths do not fit, beside a scale
    and a range zero, and no other entry does: with Bonferroni's share of 0.1 %, and if the rest
    fits.
    """
    known, words = _without_gross(readings, known)
    joined = _joined(readings, known)
    if joined is None:
        return known, words
    row, _, _, _, (white, design, root) = joined
    before, taken = _rest(white, design)
    dof = len(white) - taken
    tested = [(what, own) for what, own in known.entries if np.isin(row, own).any()]
    if dof < 1 or len(tested) < 2 or chi2.sf(before, dof) > _ALPHA_BLUNDER:
        return known, words
    found = list[tuple[str, tuple[int, ...], float]]()
    for what, own in tested:
        errors = (row[:, None] == np.array(own)).astype(float)
        after, rank = _rest(white, np.hstack([design, root @ errors[:, errors.any(axis=0)]]))
        left = len(white) - rank
        if rank == taken or left < 1 or chi2.sf(after, left) < _ALPHA_REST:
            continue
        p = float(chi2.sf(before - after, rank - taken))
        if p < _ALPHA_BLUNDER / len(tested):
            found.append((what, own, p))
    if len(found) == 1:
        what, own, p = found[0]
        words += (
            Sentence(
                "{what}: the table contradicts the other known lengths there (p = {p:g1} "
                "beside a scale and a range zero), which fit without; a blunder of the table "
                "or of the names of targets, and no part of the verdict",
                what=what,
                p=p,
            ),
        )
        return known.without(set(own)), words
    if found:
        words += (
            "a blunder of the table alone would explain as well why known lengths do not fit, at "
            + " or ".join(what for what, _, _ in found),
        )
    return known, words


def _without_gross(
    readings: ScannerReadings, known: KnownLengths
) -> tuple[KnownLengths, tuple[str, ...]]:
    """The lengths without those that differ, from all stations, by more than any range can."""
    joined = _joined(readings, known)
    if joined is None:
        return known, ()
    row, stations, measured, covariance, _ = joined
    difference = np.abs(measured - known.lengths[row])
    least = np.maximum(
        GROSS_METRES + GROSS * np.maximum(measured, known.lengths[row]),
        norm.ppf(1 - _ALPHA_BLUNDER / len(row) / 2) * np.sqrt(np.diag(covariance)),
    )
    gross = [int(k) for k in np.unique(row) if (difference > least)[row == k].all()]
    words = []
    if not gross:
        return known, ()
    for k in gross:
        seen = ", ".join(stations[int(i)] for i in np.flatnonzero(row == k))
        words.append(
            Sentence(
                "{first} to {second} is {length:m3} in the table and {measured:m3} from "
                "{seen}: no range is wrong by as much; a blunder of the table or of the names "
                "of targets, and no part of the verdict",
                first=known.pairs[k][0],
                second=known.pairs[k][1],
                length=known.lengths[k],
                measured=measured[row == k].mean(),
                seen=seen,
            )
        )
    return known.without(set(gross)), tuple(words)


def _rest(white: Array, columns: Array) -> tuple[float, int]:
    """Sum of squares that columns leave of whitened differences, and how many directions they have.

    Columns are scaled to one first, for scale and range zero have different units.
    """
    size = np.linalg.norm(columns, axis=0)
    left, value, _ = np.linalg.svd(columns / np.where(size > 0, size, 1.0), full_matrices=False)
    basis = left[:, value > 1e-3 * value[0]] if value[0] > 0 else left[:, :0]
    rest = white - basis @ (basis.T @ white)
    return float(rest @ rest), basis.shape[1]


def _joined(
    readings: ScannerReadings, known: KnownLengths
) -> tuple[Index, tuple[str, ...], Array, Array, tuple[Array, ...]] | None:
    """Known length, station and measured mean of each row, covariance of the differences.

    And whitened: the differences, the columns of scale and range zero, and what whitens.
    """
    parts = [
        part
        for name in dict.fromkeys(str(s) for s in readings.station)
        if (part := _of_station(readings, known, name)) is not None
    ]
    if not parts:
        return None
    row = np.concatenate([part[0] for part in parts])
    measured = np.concatenate([part[1] for part in parts])
    zero = np.concatenate([part[3] for part in parts])
    difference = measured - known.lengths[row]
    covariance = known.covariance[np.ix_(row, row)].copy()
    at = 0
    for part in parts:
        end = at + len(part[0])
        covariance[at:end, at:end] += part[2]
        at = end
    value = np.linalg.eigvalsh(covariance)
    rank = int((value > _DIRECTION * value[-1]).sum())
    columns = np.stack([known.lengths[row], zero], axis=1)
    white = whitened(covariance, rank, difference, columns, np.eye(len(row)))
    stations = tuple(name for part in parts for name in [part[4]] * len(part[0]))
    return row, stations, measured, covariance, white


def _of_station(
    readings: ScannerReadings, known: KnownLengths, station: str
) -> tuple[Index, Array, Array, Array, str] | None:
    """Rows of the known lengths that a station has, its means, covariance and column of x10."""
    own = readings.take(readings.station == station)
    ends = {name for pair in known.pairs for name in pair}
    own = own.take(np.array([str(t) in ends for t in own.target], dtype=bool))
    scans = set(own.series)
    times: Mapping[str, int] = {t: int((own.target == t).sum()) for t in ends}
    complete = {t for t, count in times.items() if count == len(scans) and count}
    row = np.array(
        [k for k, (a, b) in enumerate(known.pairs) if a in complete and b in complete],
        dtype=np.int64,
    )
    if not len(row):
        return None
    used = {name for k in row for name in known.pairs[k]}
    own = own.take(np.array([str(t) in used for t in own.target], dtype=bool))
    measured = measured_distances(own, station, least=2, most=len(used))
    mean, covariance, columns = measured.mean(station)
    place = {frozenset(pair): k for k, pair in enumerate(measured.pairs)}
    take = np.array([place[frozenset(known.pairs[k])] for k in row])
    at = measured.parameters.index("x10")
    return row, mean[take], covariance[np.ix_(take, take)], columns[take, at], station


def _scale(white: Array, design: Array) -> tuple[Array, Array, float]:
    """Scale, beside a range zero where it can be told from it: values, sigmas, sum of squares."""
    size = np.linalg.norm(design, axis=0)
    unit = design / np.where(size > 0, size, 1.0)
    # both at once only where the columns differ by a tenth of a radian or more
    with_zero = len(white) > 1 and size[1] > 0 and 1 - (unit[:, 0] @ unit[:, 1]) ** 2 > 1e-2
    part = design if with_zero else design[:, :1]
    cofactor = np.linalg.inv(part.T @ part)
    value = cofactor @ (part.T @ white)
    rest = white - part @ value
    return value, np.sqrt(np.diag(cofactor)), float(rest @ rest)
