"""Cycles of a monitored network, adjusted one after the other and compared with a baseline."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from tribrach._types import Array, Index
from tribrach.answers import Form, Instant, Matrix, Number, Result
from tribrach.epochs.comparison import Comparison, Settings, compare
from tribrach.epochs.differences import Difference, Epoch, difference
from tribrach.epochs.series import DAY, SeriesFit, baseline, fit_together
from tribrach.epochs.wander import learned_wander, shared_factor, with_wander
from tribrach.errors import InputError, TribrachError
from tribrach.geodesy.site import FlatSite
from tribrach.instruments.precision import Precision
from tribrach.instruments.reduction import Means, reduce
from tribrach.io.epoch_files import EpochDocument
from tribrach.io.json_file import read_json
from tribrach.io.readings_through_time import TimedReadings
from tribrach.job.epochs import epoch_of
from tribrach.network.adjustment import adjust
from tribrach.network.facts import EARTH
from tribrach.network.network import Datum
from tribrach.network.survey import Survey, observed_part
from tribrach.observations.base import Observations
from tribrach.observations.control import ScalarPriors
from tribrach.observations.sights import Directions, SlopeDistances, ZenithAngles
from tribrach.report.times import clock
from tribrach.units import SEC

AXES: tuple[Literal["E", "N", "U"], ...] = ("E", "N", "U")
#: cycles of which a wander can be learned
_LEARNED = 20
#: the coefficient of refraction of a cycle
_REFRACTION = "refraction of the cycle"


@dataclass(frozen=True)
class SeriesSettings(Result):
    """How cycles are adjusted and compared [m, rad, s, 1]."""

    references: tuple[str, ...]  #: points that are taken as stable until a test says otherwise
    #: of one sight
    sigma_direction: float = 1.0 * SEC
    sigma_zenith: float = 1.0 * SEC
    #: of a slope distance, and its part that grows with the distance; they add linearly
    sigma_distance: float = 1e-3
    sigma_ppm: float = 1e-6
    #: of instruments and prisms over their marks, anew in every cycle, in plan and in height
    centring: float = 0.0
    height: float = 0.0
    #: coefficient of refraction, and how far it is off in a cycle
    refraction: float = 0.13
    sigma_refraction: float = 0.1
    pause: float = 1800.0  #: that ends a cycle
    baseline: int = 6  #: cycles that the others are compared with
    confidence: float = 0.99  #: of the tests
    #: sigmas are as they are stated; else they are multiplied by what most references scatter more,
    #: if that is more, and each reference has the wander that it was seen to have
    as_stated: bool = False
    scale: bool = False  #: a scale common to all distances of a cycle is taken out


@dataclass(frozen=True)
class PointAt(Result):
    """A point in a cycle, in the datum of the references that stayed."""

    #: since the baseline, along E, N, U [m]
    displacement: tuple[float, ...]
    sigma: tuple[float, ...]
    test: Number
    limit: float
    verdict: Literal["moved", "not moved", "cannot tell"]


@dataclass(frozen=True)
class Cycle(Result, also=("time",)):
    """A cycle of a series."""

    key: str  #: digest of its readings
    #: when it began [s since 1970]
    start: float
    sights: int
    reason: str = ""  #: why it could not be adjusted or compared; empty if it was
    #: of the reference points, with the sigmas that are used
    test: Number = math.nan
    dof: int = 0
    limit: Number = math.nan
    moved: tuple[str, ...] = ()  #: reference points that moved
    #: false where the references do not agree and no group of them explains it
    resolved: bool = True
    points: dict[str, PointAt] = field(default_factory=dict)

    @property
    def time(self) -> Instant:
        """When it began, UTC."""
        return self.start

    @property
    def when(self) -> str:
        """When it began, in words."""
        return clock(self.start)


@dataclass(frozen=True, eq=False)
class PointSeries:
    """One point through time."""

    name: str
    keys: tuple[str, ...]  #: of its cycles (n)
    days: Array  #: since 1970 (n,)
    #: displacements in E, N, U (n, 3) [m] and their standard deviations
    values: Array
    sigma: Array
    fits: tuple[SeriesFit, ...]  #: along the axes with values enough


@dataclass(frozen=True, eq=False)
class Series(Result, also=("kind", "series"), without=("reused",)):
    """All cycles in the order of time."""

    settings: SeriesSettings
    baseline: EpochDocument  #: as an epoch file
    #: what variances are multiplied by, from the scatter that most reference points share
    factor: float
    cycles: tuple[Cycle, ...]  #: also those that could not be solved
    #: covariance in E, N, U of what a reference point does within a day [m^2], where it does
    wander: dict[str, Matrix] = field(default_factory=dict)
    #: in how many cycles of the baseline each point is
    seen: dict[str, int] = field(default_factory=dict)
    reused: int = 0  #: cycles that an earlier call solved

    @property
    def kind(self) -> Literal["series"]:
        """What the file is."""
        return "series"

    @property
    def series(self) -> dict[str, tuple[SeriesFit, ...]]:
        """What the series of each point consist of."""
        return {p.name: p.fits for p in self.points}

    @cached_property
    def zero(self) -> Epoch:
        """The baseline."""
        return self.baseline.epoch

    @cached_property
    def solved(self) -> list[Cycle]:
        """Cycles that were adjusted and compared."""
        return [cycle for cycle in self.cycles if not cycle.reason]

    @cached_property
    def points(self) -> list[PointSeries]:
        """Every point through time; cycles without datum are left out."""
        parts = []
        for name in dict.fromkeys(name for cycle in self.cycles for name in cycle.points):
            seen = [c for c in self.cycles if name in c.points and c.resolved]
            seen = [c for c in seen if len(c.points[name].displacement) == len(AXES)]
            if not seen:
                continue
            days = np.array([c.start / DAY for c in seen])
            values = np.array([c.points[name].displacement for c in seen])
            sigma = np.array([c.points[name].sigma for c in seen])
            parts.append((name, tuple(c.key for c in seen), days, values, sigma))
        fits = iter(
            fit_together(
                [
                    (days, values[:, k], sigma[:, k], axis)
                    for _, _, days, values, sigma in parts
                    for k, axis in enumerate(AXES)
                ]
            )
        )
        return [
            PointSeries(*part, tuple(filter(None, (next(fits) for _ in AXES)))) for part in parts
        ]


#: the file of a series
FORM = Form("series", Series, 2, sentences=list[str])


def monitor(
    readings: TimedReadings,
    places: Mapping[str, Array],
    settings: SeriesSettings,
    *,
    earlier: Series | None = None,
    progress: Callable[[str, int, int | None], None] = lambda what, done, total: None,
) -> Series:
    """Adjust every cycle and compare it with the baseline.

    Cycles in ``earlier``, of the same settings, are not solved again; its baseline, factor and
    wander stay. ``places`` are approximate coordinates of the references at least.
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
        seen = Counter(name for k in used if (one := solved[k]) for name in one.names)
        factor = 1.0 if settings.as_stated else max(1.0, _factor(solved, settings))
    else:
        zero, factor, seen = earlier.zero, earlier.factor, Counter(earlier.seen)
    # a baseline of one cycle is that cycle: it cannot be compared with itself
    alone = used[0] if len(used) == 1 else None
    changes: dict[int, Difference] = {}
    for k, epoch in enumerate(solved):
        if epoch is None or k == alone:
            continue
        try:
            changes[k] = _changes(zero, epoch, settings, factor, k in used)
        except TribrachError as error:
            failed[k] = _first_line(error)
    wander: dict[str, Array] = {}
    if earlier is not None:
        wander = earlier.wander
    elif not settings.as_stated:
        days = {k: float(readings.seconds[parts[k][0]]) / DAY for k in changes}
        wander = _wander(changes, days, settings)
    compared: dict[int, Comparison] = {}
    for k, change in changes.items():
        try:
            compared[k] = _compared(change, settings, wander, seen, k in used)
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
        elif k == alone:
            cycles.append(Cycle(keys[k], begin, len(part)))
        else:
            cycles.append(Cycle(keys[k], begin, len(part), failed.get(k, "it was not solved")))
    # cycles of an earlier call whose readings are not given again stay
    left = [cycle for key, cycle in known.items() if key not in set(keys)]
    every = sorted([*left, *cycles], key=lambda cycle: cycle.start)
    reused = sum(key in known for key in keys) + len(left)
    kept = EpochDocument.of(zero, FlatSite(), "baseline of a series")
    return Series(settings, kept, factor, tuple(every), wander, dict(seen), reused)


def _first_line(error: TribrachError) -> str:
    lines = [line.strip(" -") for line in str(error).splitlines() if line.strip()]
    return "; ".join(lines[:2])[:400]


def _solved(
    readings: TimedReadings, part: Index, places: Mapping[str, Array], settings: SeriesSettings
) -> Epoch:
    """One cycle as a free network, with the curvature of the Earth and a refraction of its own."""
    survey = Survey(site=FlatSite(curvature_radius=EARTH))
    stations, setup = _numbered([readings.stations[k] for k in part.tolist()])
    targets, target = _numbered([readings.targets[k] for k in part.tolist()])
    heights, height = np.unique(readings.height_target[part], return_inverse=True)
    for name in dict.fromkeys([*stations, *targets]):
        if name in places:
            survey.point(name, places[name], role="approximate")
    zenith = readings.zenith[part]
    means = reduce(
        setup=setup,
        target=target * len(heights) + height,
        face=np.where(zenith > np.pi, 2, 1).astype(np.int8),
        direction=readings.direction[part],
        zenith=zenith,
        distance=readings.distance[part],
        series=np.zeros(len(part), dtype=np.int64),
    )
    precision = Precision(
        direction=settings.sigma_direction,
        zenith=settings.sigma_zenith,
        distance=settings.sigma_distance,
        scale=settings.sigma_ppm,
    )
    lines = readings.lines[part]

    def add(kind: type[Observations], of: Means, sigma: Array | None, **further: Any) -> None:
        """Add the means of one kind."""
        assert sigma is not None
        good = ~of.far
        columns: dict[str, Any] = {name: np.asarray(c)[good] for name, c in further.items()}
        survey.add(
            kind,
            values=of.value[good],
            sigma=sigma[good],
            start=[stations[k] for k in of.setup[good].tolist()],
            end=[targets[k] for k in (of.target[good] // len(heights)).tolist()],
            source=[f"{readings.path.name}:{lines[k]}" for k in of.first[good]],
            **columns,
        )

    def level(of: Means) -> Array:
        """Heights of the targets."""
        out: Array = heights[of.target % len(heights)]
        return out

    d, z, s = means.directions, means.zeniths, means.distances
    n = [of.readings.astype(float) for of in (d, z, s)]
    # centring is no part of a sight: it is one vector of a cycle
    nowhere = [np.full(len(of.value), np.nan) for of in (d, z)]
    circles = [
        f"orientation of {stations[k]}" + (f", round {c + 1}" if c else "")
        for k, c in zip(d.setup.tolist(), d.circle.tolist(), strict=True)
    ]
    add(Directions, d, precision.of_directions(nowhere[0], n[0]), orientation=circles)
    refraction = [_REFRACTION] * len(z.value)
    add(
        ZenithAngles,
        z,
        precision.of_zeniths(nowhere[1], n[1]),
        refraction_unknown=refraction,
        height_target=level(z),
    )
    add(SlopeDistances, s, precision.of_distances(s.value, n[2]), height_target=level(s))
    held = settings.sigma_refraction == 0
    survey.scalars[_REFRACTION] = (settings.refraction, not held)
    if not held:
        survey.add(
            ScalarPriors,
            values=[settings.refraction],
            sigma=[settings.sigma_refraction],
            scalar=[_REFRACTION],
        )
    network = observed_part(survey).network().with_datum(Datum("free"))
    epoch = epoch_of(adjust(network), "cycle").epoch
    if not (settings.centring or settings.height):
        return epoch
    # every instrument and every prism stands beside its mark by one vector in all of its sights
    own = np.tile(
        np.square([settings.centring, settings.centring, settings.height]), len(epoch.names)
    )
    return replace(epoch, covariance=epoch.covariance + np.diag(own))


def _numbered(names: Sequence[str]) -> tuple[list[str], Index]:
    """Names in the order in which they come first, and the number of each (n,)."""
    number = {name: k for k, name in enumerate(dict.fromkeys(names))}
    return list(number), np.array([number[name] for name in names], dtype=np.int64)


def _zero(solved: Sequence[Epoch | None], settings: SeriesSettings) -> tuple[Epoch, list[int]]:
    """The baseline, and the numbers of its cycles: the first of those with most references.

    As many cycles as are wanted decide how many references they must have, and at least three.
    """
    wanted = set(settings.references)
    shares = [0 if e is None else len(wanted & set(e.names)) for e in solved]
    if max(shares, default=0) < 3:
        raise InputError(
            "no cycle has three of the reference points",
            cure="check their names and the readings",
        )
    enough = sorted(shares, reverse=True)[: settings.baseline]
    least = max(3, enough[-1])
    used = [k for k, share in enumerate(shares) if share >= least][: settings.baseline]
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
    changes: Difference,
    settings: SeriesSettings,
    wander: Mapping[str, Array],
    seen: Mapping[str, int],
    inside: bool,
) -> Comparison:
    """The test of a cycle, in which references may wander as they do."""
    references = tuple(n for n in settings.references if n in changes.names)
    share = {n: 1 + (-1 if inside else 1) / max(seen.get(n, 0), 1) for n in references}
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


def read_series(path: Path, settings: SeriesSettings) -> Series:
    """What an earlier call left, to go on with."""
    cure = "give the file that tribrach series --json wrote, or leave --resume out"
    try:
        data = read_json(path)
        if data["kind"] != "series" or data["schema"] != FORM.schema:
            raise InputError("this is no series of this version", file=path, cure=cure)
        earlier: Series = FORM.read(data)
        if any(matrix.shape != (3, 3) for matrix in earlier.wander.values()):
            raise ValueError("a wander has three axes")
        # a baseline that is none is refused too
        earlier.zero  # noqa: B018
    except (ValueError, TypeError, KeyError, IndexError, AttributeError) as error:
        raise InputError("this is no series", file=path, cure=cure) from error
    if earlier.settings != settings:
        given, now = vars(earlier.settings), vars(settings)
        other = next(name for name in now if given[name] != now[name])
        raise InputError(
            f"the series was made with another {other.replace('_', ' ')}",
            file=path,
            cure="use the same options, or leave --resume out",
        )
    return earlier
