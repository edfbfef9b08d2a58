"""Cycles of a monitored network, adjusted one after the other and compared with a baseline."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from tribrach._types import Array, Index
from tribrach.epochs.comparison import Comparison, Settings, compare
from tribrach.epochs.differences import Difference, Epoch, difference
from tribrach.epochs.series import SeriesFit, baseline, fit_series
from tribrach.epochs.wander import learned_wander, shared_factor, with_wander
from tribrach.errors import InputError, TribrachError
from tribrach.io.epoch_files import epoch_of_data
from tribrach.io.json_file import read_json
from tribrach.io.readings_through_time import TimedReadings
from tribrach.job.epochs import epoch_of
from tribrach.network.adjustment import adjust
from tribrach.network.network import Datum
from tribrach.network.observed_part import observed_part
from tribrach.network.survey import Survey
from tribrach.observations.sights import Directions, SlopeDistances, ZenithAngles
from tribrach.units import SEC

__all__ = [
    "Cycle",
    "PointAt",
    "PointSeries",
    "Series",
    "SeriesSettings",
    "monitor",
    "read_series",
    "series_of",
]

#: seconds of a day
DAY = 86400.0
#: cycles of which a wander can be learned
_LEARNED = 20
#: version of the file
SCHEMA = 2


@dataclass(frozen=True)
class SeriesSettings:
    """How cycles are adjusted and compared.

    Attributes
    ----------
    references
        Points that are taken as stable until a test says otherwise.
    sigma_direction, sigma_zenith
        Of one sight [rad].
    sigma_distance, sigma_ppm
        Of a slope distance [m], [1].
    pause
        That ends a cycle [s].
    baseline
        Cycles that the others are compared with.
    confidence
        Of the tests.
    as_stated
        Sigmas are as they are stated; else they are multiplied by what most references scatter
        more, if that is more, and each reference has the wander that it was seen to have.
    scale
        A scale common to all distances of a cycle is taken out.
    """

    references: tuple[str, ...]
    sigma_direction: float = 1.0 * SEC
    sigma_zenith: float = 1.0 * SEC
    sigma_distance: float = 1e-3
    sigma_ppm: float = 1e-6
    pause: float = 1800.0
    baseline: int = 6
    confidence: float = 0.99
    as_stated: bool = False
    scale: bool = False


@dataclass(frozen=True)
class PointAt:
    """A point in one cycle, in the datum of the references that stayed.

    Attributes
    ----------
    vector, sigma
        Displacement since the baseline in E, N, U and its standard deviations [m].
    test, limit
        Of the displacement.
    answer
        Moved, not moved, or cannot tell.
    """

    vector: tuple[float, ...]
    sigma: tuple[float, ...]
    test: float
    limit: float
    answer: str


@dataclass(frozen=True)
class Cycle:
    """What became of one cycle.

    Attributes
    ----------
    key
        Digest of its readings.
    start, sights
        When it began [s since 1970], and its number of sights.
    reason
        Why it could not be adjusted or compared; "" if it was.
    test, dof, limit
        Of the reference points, with the sigmas that are used.
    moved
        Reference points that moved.
    resolved
        False where the references do not agree and no group of them explains it.
    points
        By name.
    """

    key: str
    start: float
    sights: int
    reason: str = ""
    test: float = float("nan")
    dof: int = 0
    limit: float = float("nan")
    moved: tuple[str, ...] = ()
    resolved: bool = True
    points: Mapping[str, PointAt] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Series:
    """All cycles in the order of time.

    Attributes
    ----------
    settings
        How.
    zero
        The baseline.
    factor
        By what variances are multiplied.
    wander
        Covariance (3, 3) of what each reference point does within a day [m^2].
    cycles
        Also those that could not be solved.
    reused
        Cycles that an earlier call solved.
    """

    settings: SeriesSettings
    zero: Epoch
    factor: float
    cycles: tuple[Cycle, ...]
    wander: Mapping[str, Array] = field(default_factory=dict)
    reused: int = 0


@dataclass(frozen=True, eq=False)
class PointSeries:
    """One point through time.

    Attributes
    ----------
    name
        Of the point.
    days : array (n,)
        Since 1970.
    values, sigma : array (n, 3)
        Displacements in E, N, U and their standard deviations [m].
    fits
        Along each axis; None where there are too few values.
    """

    name: str
    days: Array
    values: Array
    sigma: Array
    fits: tuple[SeriesFit | None, ...]


def monitor(
    readings: TimedReadings,
    places: Mapping[str, Array],
    settings: SeriesSettings,
    *,
    earlier: Series | None = None,
    progress: Callable[[str, int, int | None], None] = lambda what, done, total: None,
) -> Series:
    """Adjust every cycle and compare it with the baseline.

    Parameters
    ----------
    readings
        Of all cycles.
    places
        Approximate coordinates (3,) of the references at least [m].
    settings
        How.
    earlier
        What an earlier call found with the same settings: its cycles are not solved again, and
        its baseline, factor and wander stay.
    progress
        Told of each cycle.

    Raises
    ------
    InputError
        No cycle for the baseline can be solved; references that are not observed.
    """
    parts = readings.cycles(settings.pause)
    keys = [readings.digest(part) for part in parts]
    known = {} if earlier is None else {cycle.key: cycle for cycle in earlier.cycles}
    start = dict(places)
    if earlier is not None:
        start |= dict(zip(earlier.zero.names, earlier.zero.xyz, strict=True))
    solved: list[Epoch | None] = [None] * len(parts)
    failed: dict[int, str] = {}
    for k, part in enumerate(parts):
        if keys[k] in known:
            continue
        progress("cycles", k + 1, len(parts))
        try:
            found = _solved(readings, part, start, settings)
        except TribrachError as error:
            failed[k] = _first_line(error)
            continue
        solved[k] = found
        # later cycles start from these coordinates
        for name, xyz in zip(found.names, found.xyz, strict=True):
            start.setdefault(name, xyz)
    used: list[int] = []
    if earlier is None:
        zero, used = _zero(solved, settings)
        factor = 1.0 if settings.as_stated else max(1.0, _factor(solved, settings))
    else:
        zero, factor = earlier.zero, earlier.factor
    changes: dict[int, Difference] = {}
    for k, epoch in enumerate(solved):
        if epoch is None:
            continue
        try:
            changes[k] = _changes(zero, epoch, settings, factor, k in used)
        except TribrachError as error:
            failed[k] = _first_line(error)
    wander: Mapping[str, Array] = {}
    if earlier is not None:
        wander = earlier.wander
    elif not settings.as_stated:
        days = {k: float(readings.seconds[parts[k][0]]) / DAY for k in changes}
        wander = _wander(changes, days, settings)
    compared: dict[int, Comparison] = {}
    for k, change in changes.items():
        try:
            compared[k] = _compared(change, settings, wander, k in used)
        except TribrachError as error:
            failed[k] = _first_line(error)
    cycles = []
    for k, part in enumerate(parts):
        if keys[k] in known:
            cycles.append(known[keys[k]])
            continue
        begin = float(readings.seconds[part[0]])
        if k in compared:
            cycles.append(_cycle(keys[k], begin, len(part), compared[k]))
        else:
            cycles.append(Cycle(keys[k], begin, len(part), failed.get(k, "it was not solved")))
    # cycles of an earlier call whose readings are not given again stay
    left = [cycle for key, cycle in known.items() if key not in set(keys)]
    every = sorted([*left, *cycles], key=lambda cycle: cycle.start)
    reused = sum(key in known for key in keys) + len(left)
    return Series(settings, zero, factor, tuple(every), wander, reused)


def _first_line(error: TribrachError) -> str:
    lines = [line.strip(" -") for line in str(error).splitlines() if line.strip()]
    return "; ".join(lines[:2])[:400]


def _solved(
    readings: TimedReadings, part: Index, places: Mapping[str, Array], settings: SeriesSettings
) -> Epoch:
    """One cycle as a free network."""
    survey = Survey()
    stations = [readings.stations[k] for k in part.tolist()]
    targets = [readings.targets[k] for k in part.tolist()]
    for name in dict.fromkeys([*stations, *targets]):
        if name in places:
            survey.point(name, places[name], role="approximate")
    source = [f"{readings.path.name}:{readings.lines[k]}" for k in part.tolist()]
    ends: dict[str, Any] = {"start": stations, "end": targets, "source": source}
    heights: dict[str, Any] = {"height_target": readings.height_target[part]}
    n = len(part)
    distance = readings.distance[part]
    survey.add(
        Directions,
        values=readings.direction[part],
        sigma=np.full(n, settings.sigma_direction),
        orientation=[f"orientation of {name}" for name in stations],
        **ends,
    )
    survey.add(
        ZenithAngles,
        values=readings.zenith[part],
        sigma=np.full(n, settings.sigma_zenith),
        **ends,
        **heights,
    )
    survey.add(
        SlopeDistances,
        values=distance,
        sigma=np.hypot(settings.sigma_distance, settings.sigma_ppm * distance),
        **ends,
        **heights,
    )
    network = observed_part(survey).network().with_datum(Datum("free"))
    return epoch_of(adjust(network), "cycle").epoch


def _zero(solved: Sequence[Epoch | None], settings: SeriesSettings) -> tuple[Epoch, list[int]]:
    """The baseline, and the numbers of its cycles: the first with all references.

    Raises
    ------
    InputError
        There is none.
    """
    wanted = set(settings.references)
    shares = [0 if e is None else len(wanted & set(e.names)) for e in solved]
    most = max(shares, default=0)
    if most < 3:
        raise InputError(
            "no cycle has three of the reference points",
            cure="check their names and the readings",
        )
    used = [k for k, share in enumerate(shares) if share == most][: settings.baseline]
    cycles = [epoch for k in used if (epoch := solved[k]) is not None]
    return baseline(cycles, "baseline", settings.references), used


def _free(settings: SeriesSettings) -> tuple[str, ...]:
    """Motions that are taken out of a cycle although its network does not leave them open."""
    return ("scale",) if settings.scale else ()


def _factor(solved: Sequence[Epoch | None], settings: SeriesSettings) -> float:
    """What variances are larger by than stated, from references in cycles that follow each other.

    A point that moved and stays there is in one of these differences, not in all.
    """
    cycles = [epoch for epoch in solved if epoch is not None]
    changes = []
    for one, two in zip(cycles[::2], cycles[1::2], strict=False):
        common = [n for n in settings.references if n in one.names and n in two.names]
        if len(common) >= 3:
            changes.append(difference(one, two, free=_free(settings), points=common))
    return shared_factor(changes)


def _wander(
    changes: Mapping[int, Difference], days: Mapping[int, float], settings: SeriesSettings
) -> dict[str, Array]:
    """The wander of the references, where there are cycles enough to tell it."""
    parts, times = [], []
    for k, change in changes.items():
        chosen = [i for i, name in enumerate(change.names) if name in settings.references]
        if len(chosen) < 3:
            continue
        rows = change.rows(chosen)
        parts.append(
            replace(
                change,
                names=tuple(change.names[i] for i in chosen),
                xyz=change.xyz[chosen],
                values=change.values[chosen],
                covariance=change.covariance[np.ix_(rows, rows)],
            )
        )
        times.append(days[k])
    if len(parts) < _LEARNED:
        return {}
    return learned_wander(parts, np.array(times), settings.references)


def _changes(
    zero: Epoch, epoch: Epoch, settings: SeriesSettings, factor: float, inside: bool
) -> Difference:
    """A cycle against the baseline; one that is part of it shares its errors."""
    references = [n for n in settings.references if n in epoch.names and n in zero.names]
    cross = None
    if inside:
        place = [zero.names.index(name) for name in epoch.names]
        columns = (np.array(place)[:, None] * 3 + np.arange(3)).ravel()
        # of the mean of several, a single one has the covariance of the mean with it
        cross = zero.covariance[:, columns]
    changes = difference(
        zero, epoch, free=_free(settings), cross=cross, align_by=references or None
    )
    return replace(changes, covariance=changes.covariance * factor)


def _compared(
    changes: Difference, settings: SeriesSettings, wander: Mapping[str, Array], inside: bool
) -> Comparison:
    """The test of a cycle, in which references may wander as they do."""
    references = tuple(n for n in settings.references if n in changes.names)
    share = 1 / settings.baseline * (-1 if inside else 1) + 1
    changes = replace(changes, covariance=with_wander(changes, wander, share))
    tests = Settings(references=references, confidence=settings.confidence)
    return compare(changes, tests, _free(settings))


def _cycle(key: str, start: float, sights: int, found: Comparison) -> Cycle:
    search = found.search
    points = {}
    for d in found.displacements:
        sigma = np.sqrt(np.maximum(np.diag(d.covariance), 0.0))
        points[d.name] = PointAt(
            tuple(d.vector.tolist()), tuple(sigma.tolist()), d.statistic, d.limit, d.answer
        )
    if search is None:
        return Cycle(key, start, sights, "", points=points, resolved=False)
    return Cycle(
        key,
        start,
        sights,
        "",
        search.before.statistic,
        search.before.dof,
        search.before.limit,
        tuple(d.name for d in found.displacements if d.reference and d.answer == "moved"),
        search.resolved,
        points,
    )


def series_of(found: Series) -> list[PointSeries]:
    """Every point through time with what its series consists of; cycles without datum left out."""
    out = []
    names = dict.fromkeys(name for cycle in found.cycles for name in cycle.points)
    for name in names:
        rows = [
            (cycle.start / DAY, cycle.points[name])
            for cycle in found.cycles
            if name in cycle.points and cycle.resolved
        ]
        rows = [(day, p) for day, p in rows if len(p.vector) == 3]
        if not rows:
            continue
        days = np.array([day for day, _ in rows])
        values = np.array([p.vector for _, p in rows])
        sigma = np.array([p.sigma for _, p in rows])
        fits = tuple(fit_series(days, values[:, k], sigma[:, k]) for k in range(3))
        out.append(PointSeries(name, days, values, sigma, fits))
    return out


def read_series(path: Path, settings: SeriesSettings) -> Series:
    """What an earlier call left, to go on with.

    Raises
    ------
    InputError
        No series, or one with other settings.
    """
    cure = "give the file that tribrach series --json wrote, or leave --resume out"
    try:
        data = read_json(path)
        if data["kind"] != "series" or data["schema"] != SCHEMA:
            raise InputError("this is no series of this version", file=path, cure=cure)
        given = dict(data["settings"])
        given["references"] = tuple(given["references"])
        earlier = SeriesSettings(**given)
        zero = epoch_of_data(data["baseline"])
        cycles = tuple(_stored(cycle) for cycle in data["cycles"])
        factor = float(data["factor"])
        wander = {
            str(name): np.array(matrix, dtype=float).reshape(3, 3)
            for name, matrix in data["wander"].items()
        }
    except (ValueError, TypeError, KeyError, IndexError, AttributeError) as error:
        raise InputError("this is no series", file=path, cure=cure) from error
    if earlier != settings:
        other = [
            name
            for name in SeriesSettings.__dataclass_fields__
            if getattr(earlier, name) != getattr(settings, name)
        ]
        raise InputError(
            f"the series was made with another {other[0].replace('_', ' ')}",
            file=path,
            cure="use the same options, or leave --resume out",
        )
    return Series(earlier, zero, factor, cycles, wander)


def _stored(data: Mapping[str, Any]) -> Cycle:
    """A cycle from JSON."""

    def value(part: Any) -> float:
        return float("nan") if part is None else float(part)

    points = {
        str(name): PointAt(
            tuple(float(v) for v in p["displacement"]),
            tuple(float(v) for v in p["sigma"]),
            value(p["test"]),
            float(p["limit"]),
            str(p["verdict"]),
        )
        for name, p in data["points"].items()
    }
    return Cycle(
        str(data["key"]),
        float(data["start"]),
        int(data["sights"]),
        str(data["reason"]),
        value(data["test"]),
        int(data["dof"]),
        value(data["limit"]),
        tuple(str(name) for name in data["moved"]),
        bool(data["resolved"]),
        points,
    )
