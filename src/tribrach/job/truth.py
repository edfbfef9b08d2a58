"""A simulated project against its truth: every error tested against its stated covariance.

For each station and point ``e^T C^-1 e`` against chi-square, at a level at which the largest of
them all passes in 99 % of all jobs; for all of them jointly on both sides, since errors smaller
than stated tell of overstated covariances; for each scan the mean squared normalised error of
points whose true place is known, which is 1 if the stated covariance is right; and the bookkeeping
of targets: visible, found, invented, wrongly named. Only simulated projects have a truth file.
The errors of the points of a scan are remembered, so that a second run reads none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from tribrach._types import Array, Progress
from tribrach.answers import Result
from tribrach.cloud.covariance import covariances
from tribrach.cloud.placement import Placement
from tribrach.errors import InputError
from tribrach.geometry import rotation
from tribrach.geometry.pose import Pose
from tribrach.io.arrays import read_named
from tribrach.io.json_file import read_json
from tribrach.io.keeping import keep
from tribrach.job.each import Item, each
from tribrach.job.name_targets import Named
from tribrach.job.scans import MeasuredScan, StationScan
from tribrach.job.state import Remembered
from tribrach.network.adjustment import Adjustment
from tribrach.registration.identify import is_tie_point
from tribrach.scan.normals import incidence_cosines
from tribrach.sentences import Sentence
from tribrach.statistics import chi2

Side = Literal["within", "above", "below", "wrong"]


@dataclass(frozen=True)
class TruthRow(Result, also=("agrees",)):
    """A comparison of a simulated project with its truth: error, test, limits, verdict."""

    what: str
    name: str
    words: str  #: the error beside what was expected
    #: the test value and its limits; ``least`` is None where only large ones are wrong
    statistic: float | None = None
    least: float | None = None
    limit: float | None = None
    dof: int = 0  #: of chi-square, 0 where it is none
    side: Side = "within"  #: of the limits that the statistic is on; "wrong" of what is counted

    @property
    def agrees(self) -> bool:
        """True if the errors are as large as stated, and the counts right."""
        return self.side == "within"

    @property
    def verdict(self) -> str:
        """The same in words."""
        return {
            "within": "as stated",
            "above": "not so: larger than stated",
            "below": "not so: smaller than stated",
            "wrong": "not so",
        }[self.side]


# Targets of a simulated project, station by station: visible, missed, invented, misnamed.


#: a detection this near to a target's true place is that target [m]
_NEAR = 0.05


@dataclass(frozen=True)
class Bookkeeping:
    """Targets of one station: names that should be found, were missed, invented, misnamed."""

    station: str
    visible: tuple[str, ...]
    missed: tuple[str, ...]
    invented: int
    misnamed: tuple[str, ...]

    @property
    def clean(self) -> bool:
        """True if everything visible was found, nothing invented, every name right."""
        return not (self.missed or self.invented or self.misnamed)


def _true_names(truth: Mapping[str, Any], named: Named) -> dict[str, list[str]]:
    """True name of each detection by station; "" for false detections."""
    targets = {n: np.array(truth["points"][n]) for n in truth["targets"]}
    names, xyz = list(targets), np.array(list(targets.values()))
    out = {}
    for station, detections in named.targets.items():
        matrix = np.array(truth["stations"][station]["world_from_scanner"])
        here = []
        for d in detections:
            distance = np.linalg.norm(xyz - matrix[:3, :3] @ d.center - matrix[:3, 3], axis=1)
            k = int(np.argmin(distance))
            here.append(names[k] if distance[k] < _NEAR else "")
        out[station] = here
    return out


def true_ties(truth: Mapping[str, Any], named: Named) -> dict[str, str]:
    """True names of tie points."""
    out = {}
    for station, trues in _true_names(truth, named).items():
        for given, true in zip(named.identification.names.get(station, ()), trues, strict=False):
            if is_tie_point(given) and true:
                out[given] = true
    return out


def bookkeeping(truth: Mapping[str, Any], named: Named) -> list[Bookkeeping]:
    """Targets station by station."""
    ties, trues = true_ties(truth, named), _true_names(truth, named)
    out = []
    for station, data in truth["stations"].items():
        here, names = trues.get(station, []), named.identification.names.get(station, ())
        wrong = [
            true
            for given, true in zip(names, here, strict=False)
            if given and true and ties.get(given, given) != true
        ]
        out.append(
            Bookkeeping(
                station,
                tuple(data["visible"]),
                tuple(n for n in data["visible"] if n not in here),
                here.count(""),
                tuple(wrong),
            )
        )
    return out


#: share of jobs whose errors, if as stated, keep within the limits of one kind of test
LEVEL = 0.99
#: the stated covariance of points is right if their mean squared normalised error is within
BAND = (0.95, 1.05)


def read_truth(path: Path) -> dict[str, Any]:
    """A truth file."""
    try:
        data = read_json(path)
    except (InputError, ValueError) as error:
        raise InputError(
            "the truth file cannot be read", file=path, cure="simulate again"
        ) from error
    if not isinstance(data, dict) or "stations" not in data or "points" not in data:
        raise InputError("the truth file has no stations and points", file=path)
    return data


def against_truth(
    truth: Mapping[str, Any],
    folder: Path,
    adjustment: Adjustment,
    scans: Sequence[StationScan],
    placements: Mapping[str, Placement],
    named: Named | None,
    incidence: bool = False,
    *,
    state: Remembered,
    progress: Progress = lambda what, done, total: None,
) -> list[TruthRow]:
    """All comparisons, one row each."""
    rows = [*_stations(truth, adjustment), *_points(truth, adjustment, named)]
    rows += _lever_arms(truth, adjustment)
    items = []
    for scan in scans:
        file = folder / f"truth-{scan.name}.npz"
        where = placements[scan.name]
        if file.is_file() and where.noise is not None:
            keep([file])
            matrix = np.array(truth["stations"][scan.station]["world_from_scanner"])
            items.append(_item(scan, where, Pose.from_matrix(matrix), file, incidence))
    errors = each(_cloud_error, items, state=state, progress=progress)
    for item, error in zip(items, errors, strict=True):
        rows += _cloud(item.values[0].name, error)
    if named is not None:
        rows += [_counted(b) for b in bookkeeping(truth, named)]
    return rows


def _single(what: str, name: str, error: Array, covariance: Array) -> TruthRow:
    """One error against its covariance; :func:`_family` sets its limit."""
    size = float(np.linalg.norm(error[:3]))
    expected = float(np.sqrt(np.trace(covariance[:3, :3])))
    words = Sentence("{size:mm2}, expected {expected:mm2}", size=size, expected=expected)
    return TruthRow(what, name, words, _square(error, covariance), dof=len(error))


def _square(error: Array, covariance: Array) -> float:
    """``e^T C^-1 e``, metres and radians scaled to the same size."""
    scale = np.sqrt(np.diag(covariance))
    whole = covariance / np.outer(scale, scale)
    return float(error / scale @ np.linalg.solve(whole, error / scale))


def _family(rows: Sequence[TruthRow]) -> list[TruthRow]:
    """Single errors with the limit that all of them together keep in ``LEVEL`` of all jobs."""
    level = LEVEL ** (1 / max(1, len(rows)))
    limits = [float(chi2.ppf(level, row.dof)) for row in rows]
    return [
        replace(row, limit=limit, side=_side(row.statistic, None, limit))
        for row, limit in zip(rows, limits, strict=True)
    ]


def _jointly(what: str, errors: Sequence[Array], covariance: Array) -> TruthRow:
    """All errors with their correlations: too large is as bad as too small."""
    error = np.concatenate(errors)
    n, square = len(error), _square(error, covariance)
    least, limit = (float(chi2.ppf(q, n)) for q in ((1 - LEVEL) / 2, (1 + LEVEL) / 2))
    words = Sentence(
        "{n} numbers, {square:2} times what is stated", n=n, square=np.sqrt(square / n)
    )
    return TruthRow(what, "jointly", words, square, least, limit, n, _side(square, least, limit))


def _side(value: float | None, least: float | None, limit: float) -> Side:
    """On which side of its limits is a number?"""
    if value is None or value > limit or not np.isfinite(value):
        return "above"
    return "below" if least is not None and value < least else "within"


def _stations(truth: Mapping[str, Any], adjustment: Adjustment) -> list[TruthRow]:
    """Each station, and all of them jointly with their correlations."""
    layout, state = adjustment.layout, adjustment.state
    errors, columns, rows = [], [], []
    for name in layout.names["pose"]:
        known = truth["stations"].get(name)
        if known is None:
            continue
        matrix, k = np.array(known["world_from_scanner"]), layout.index("pose", name)
        turn = rotation.log(state.pose_r[k] @ matrix[:3, :3].T)
        error = np.concatenate([state.pose_t[k] - matrix[:3, 3], turn])
        errors.append(error)
        columns.append(layout.columns("pose", k))
        rows.append(_single("station", name, error, adjustment.covariance(name)))
    if len(rows) > 1:
        where = np.concatenate(columns)
        joint = adjustment.covariance_columns(where, where)
        return [*_family(rows), _jointly("stations", errors, joint)]
    return _family(rows)


def _lever_arms(truth: Mapping[str, Any], adjustment: Adjustment) -> list[TruthRow]:
    """Each lever arm that was estimated, against the one that all simulated stations carry."""
    facts, layout = truth.get("facts", {}), adjustment.layout
    arm = facts.get("lever_arm_m")
    if arm is None:
        return []
    rows = []
    for name in sorted(set(facts.get("lever_arms", {}).values()) & set(layout.names["vector"])):
        covariance = adjustment.covariance(name)
        free = np.diag(covariance) > 0
        if free.any():
            error = adjustment.state.vectors[layout.index("vector", name)] - np.array(arm)
            rows.append(_single("lever arm", name, error[free], covariance[np.ix_(free, free)]))
    return _family(rows)


def _points(
    truth: Mapping[str, Any], adjustment: Adjustment, named: Named | None
) -> list[TruthRow]:
    """Each adjusted point whose truth is known, tie points by the target that they are."""
    layout, state = adjustment.layout, adjustment.state
    alias = {} if named is None else true_ties(truth, named)
    errors, columns, rows = [], [], []
    for k, name in enumerate(layout.names["point"]):
        known = truth["points"].get(alias.get(name, name))
        covariance = adjustment.covariance(name)
        if known is None or np.diag(covariance).min() <= 0:
            continue
        error = state.points[k] - np.array(known)
        errors.append(error)
        columns.append(layout.columns("point", k))
        shown = f"{name} ({alias[name]})" if name in alias else name
        rows.append(_single("point", shown, error, covariance))
    if len(rows) > 1:
        where = np.concatenate(columns)
        joint = adjustment.covariance_columns(where, where)
        return [*_family(rows), _jointly("points", errors, joint)]
    return _family(rows)


@dataclass(frozen=True)
class CloudError:
    """Points of one scan against their true places."""

    points: int
    #: mean of ``e^T C_int^-1 e / 3`` with the true station: what remains are the points' own
    #: errors
    noise: float
    #: the same with the adjusted station and the whole covariance, and 99 % of what that may be,
    #: since the error of the station is common to all points
    whole: float
    whole_bounds: tuple[float, float]


def cloud_error(
    scan: MeasuredScan, where: Placement, true: Pose, file: Path, incidence: bool = False
) -> CloudError:
    """The errors of the points of a scan whose truth is in a file."""
    truth = read_named(file, "point", "xyz")
    number, place = truth["point"], truth["xyz"]
    alone = Placement(where.station, true, np.zeros((6, 6)), where.noise)
    noise, whole, first, used = 0.0, 0.0, 0, 0
    shared = np.zeros((6, 6))
    for chunk in scan.scan.chunks():
        a, b = np.searchsorted(number, [first, first + len(chunk)])
        rows = number[a:b] - first
        xyz = chunk.xyz[rows]
        first += len(chunk)
        if a == b:
            continue
        cosine = incidence_cosines(chunk.xyz, rows=rows) if incidence else None
        light = chunk.values["intensity"][rows] if "intensity" in chunk.values else None
        noise += _squares(xyz, alone, place[a:b], cosine, light)[0]
        square, part = _squares(xyz, where, place[a:b], cosine, light)
        whole, shared, used = whole + square, shared + part, used + b - a
    n = 3 * max(1, used)
    bounds = _bounds(shared / n, where.covariance)
    return CloudError(int(used), float(noise / n), float(whole / n), bounds)


def _squares(
    xyz: Array, where: Placement, true: Array, cosine: Array | None, intensity: Array | None
) -> tuple[float, Array]:
    """Sum of ``e^T C^-1 e``, and of ``J^T C^-1 J`` (6, 6) over the points."""
    c = covariances(xyz, where, cosine, intensity)[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)
    weight = np.linalg.inv(c)
    error = where.pose @ xyz - true
    lever = xyz @ where.pose.rotation.T
    geo = np.concatenate(
        [np.broadcast_to(np.eye(3), (len(xyz), 3, 3)), -rotation.skew(lever)], axis=2
    )
    square = float(np.einsum("ni,nij,nj->", error, weight, error))
    return square, np.einsum("nik,nij,njl->kl", geo, weight, geo, optimize=True)


def _bounds(shared: Array, covariance: Array) -> tuple[float, float]:
    """0.5 and 99.5 % quantiles of the mean squared normalised error.

    It is ``1 - tr(A C) + q^T A q`` with q the station's error: a mixture of chi-squares.
    """
    root = np.linalg.cholesky(covariance + 1e-24 * np.eye(6))
    weights = np.linalg.eigvalsh(root.T @ shared @ root)
    draws = np.random.default_rng(0).chisquare(1, (20_000, 6)) @ weights
    low, high = np.quantile(draws, [0.005, 0.995]) + 1 - weights.sum()
    return max(float(low) - 0.05, 0.0), float(high) + 0.05


def _item(scan: StationScan, where: Placement, true: Pose, file: Path, incidence: bool) -> Item:
    """The errors of the points of a scan as a product."""
    return Item(
        f"truth-{scan.name}",
        f"truth of {scan.name}",
        (scan.measured, where, true, file, incidence),
        source=scan.scan.path,
        cost=scan.scan.records or 0,
    )


def _cloud_error(
    scan: MeasuredScan,
    where: Placement,
    true: Pose,
    file: Path,
    incidence: bool,
    *,
    progress: Progress,
) -> CloudError:
    """Errors of the points of a scan, without progress messages."""
    return cloud_error(scan, where, true, file, incidence)


def _cloud(scan: str, error: CloudError) -> list[TruthRow]:
    """The points' own errors, and the whole with the station's."""
    low, high = error.whole_bounds
    own = Sentence(
        "own noise: mean squared error {error.noise:3} times what is stated, "
        "{error.points:,} points",
        error=error,
    )
    whole = Sentence(
        "whole error: mean square {error.whole:3} times what is stated; {low:2} to "
        "{high:2} is to be expected, since the station's own error is common to all "
        "points",
        error=error,
        low=low,
        high=high,
    )
    return [
        TruthRow(what, scan, words, value, *limits, side=_side(value, *limits))
        for what, words, value, limits in (
            ("points of", own, error.noise, BAND),
            ("cloud", whole, error.whole, (low, high)),
        )
    ]


def _counted(b: Bookkeeping) -> TruthRow:
    """Targets of a station."""
    words = (
        f"of {len(b.visible)} in clear sight {len(b.missed) or 'none'} missed, "
        f"{b.invented or 'none'} invented, {len(b.misnamed) or 'none'} misnamed"
    )
    missed = f": {', '.join(b.missed)}" if b.missed else ""
    return TruthRow("targets", b.station, words + missed, side="within" if b.clean else "wrong")
