"""What a report says: a head and chapters, one model that every rendering shares.

Plain numbers in metres and radians of the work frame (E, N, U), None where there is no number.
Standard deviations and covariances are already scaled as ``sigma_origin`` says. Angles are
written in the unit of ``ReportSettings.angle`` by the renderings only. Method section 11.1.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Index
from tribrach.job.results import JobResults
from tribrach.network.adjustment import Adjustment
from tribrach.network.observation_rows import ObservationRows
from tribrach.network.quality import Quality
from tribrach.network.results import Results
from tribrach.network.roles import Role, joined_positions
from tribrach.report.chapter import Chapter
from tribrach.report.columns import ColumnSet
from tribrach.report.numbers import Style, number
from tribrach.report.tables import ReportTable

__all__ = [
    "CheckVerdict",
    "ComponentRow",
    "Control",
    "CorrelationRow",
    "DatumStatement",
    "Ellipse",
    "Ellipsoid",
    "GlobalVerdict",
    "Head",
    "KindCount",
    "Observation",
    "ObservedValues",
    "Point",
    "Report",
    "ReportSettings",
    "SnoopingRow",
    "StationRow",
    "Summary",
    "Unknown",
]

Number = float | None
Triple = tuple[Number, Number, Number]
Matrix = tuple[tuple[Number, ...], ...]


@dataclass(frozen=True)
class ReportSettings:
    """What the numbers depend on.

    Attributes
    ----------
    confidence
        Probability that ellipses, intervals and ellipsoids hold.
    posterior
        True if covariances are scaled by the a-posteriori variance factor.
    alpha
        Error probability of the global test and of check verdicts, 1 - confidence.
    angle
        How angles are written.
    """

    confidence: float = 0.95
    posterior: bool = False
    alpha: float = 0.05
    angle: Literal["gon", "deg"] = "gon"


@dataclass(frozen=True)
class DatumStatement:
    """What fixes the frame: ``kind`` as in the network, a sentence, the names that carry it."""

    kind: str
    sentence: str
    names: tuple[str, ...]


@dataclass(frozen=True)
class GlobalVerdict:
    """Global test: ``v^T P v`` against its chi-square bounds; a sentence says how it ended."""

    statistic: float
    lower: Number
    upper: Number
    alpha: float
    accepted: bool | None
    sentence: str


@dataclass(frozen=True)
class KindCount:
    """Observed values of one kind and group.

    Attributes
    ----------
    active, check, off
        How many values take part, are held out, are switched off.
    redundancy
        Sum of their redundancy numbers.
    sigma0
        ``sqrt(v^T P v / r)`` of the group, a posteriori over a priori; None without redundancy.
    """

    kind: str
    group: str
    active: int
    check: int
    off: int
    redundancy: Number
    sigma0: Number


@dataclass(frozen=True)
class Summary:
    """The adjustment in numbers."""

    kinds: tuple[KindCount, ...]
    n_observations: int
    n_check: int
    n_off: int
    n_unknowns: int
    n_constraints: int
    defect: int
    dof: int
    iterations: int
    vtpv: float
    sigma0: float
    sigma0_posterior: Number
    test: GlobalVerdict


@dataclass(frozen=True)
class Ellipse:
    """Confidence ellipse in plan: semi-axes [m], azimuth of the major one [rad] in [0, pi)."""

    major: float
    minor: float
    azimuth: float


@dataclass(frozen=True)
class Ellipsoid:
    """Confidence ellipsoid: three semi-axes [m] from the longest, azimuth and elevation of it."""

    axes: tuple[float, float, float]
    azimuth: float
    elevation: float


@dataclass(frozen=True)
class Point:
    """An adjusted point.

    Attributes
    ----------
    xyz, sigma
        E, N, U [m], None where the network has no such coordinate; sigma None where held.
    covariance
        3 x 3 [m^2].
    ellipse, height_interval, ellipsoid
        At the confidence; the interval is its half width [m].
    geodetic
        Latitude, longitude [rad] and height [m], where the site knows them.
    ecef, ecef_covariance
        Geocentric [m, m^2].
    projected
        Easting, northing and height in the grid of the site [m].
    """

    name: str
    role: Role
    xyz: Triple
    sigma: Triple
    covariance: Matrix
    ellipse: Ellipse | None = None
    height_interval: Number = None
    ellipsoid: Ellipsoid | None = None
    geodetic: tuple[float, float, float] | None = None
    ecef: tuple[float, float, float] | None = None
    ecef_covariance: Matrix | None = None
    projected: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class CheckVerdict:
    """A squared distance in its own metric, its limit, whether it stays below, its significance.

    The limit is of chi-square a priori and of F a posteriori (method section 3.4).
    """

    statistic: float
    limit: float
    agrees: bool
    significance: float


@dataclass(frozen=True)
class Control:
    """Control or check coordinates of a point.

    Attributes
    ----------
    use
        Held without error, weighted, held out as a check, or switched off.
    given, sigma
        Given coordinates and their sigma [m].
    difference, difference_sigma
        Adjusted minus given [m], and what that difference should have; None if held.
    verdict
        The difference against its covariance, where there is one.
    reason
        Why it is off.
    source
        ``file:line``.
    """

    name: str
    use: Literal["held", "weighted", "check", "off"]
    given: Triple
    sigma: Triple
    difference: Triple
    difference_sigma: Triple
    verdict: CheckVerdict | None
    reason: str = ""
    source: str = ""


@dataclass(frozen=True)
class StationRow:
    """An adjusted scanner station; angles in radians.

    Attributes
    ----------
    world_from_scanner
        4 x 4.
    covariance
        6 x 6 of the translation [m] and of left rotation increments [rad].
    heading
        Azimuth of the scanner's x axis.
    tilt_e, tilt_n
        Turns of its z axis about E and N.
    tilt
        Angle of its z axis with the vertical of the work frame.
    """

    name: str
    world_from_scanner: Matrix
    covariance: Matrix
    xyz: Triple
    sigma: Triple
    heading: float
    heading_sigma: Number
    tilt_e: float
    tilt_e_sigma: Number
    tilt_n: float
    tilt_n_sigma: Number
    tilt: float
    tilt_sigma: Number
    ellipse: Ellipse | None = None
    height_interval: Number = None


@dataclass(frozen=True)
class Unknown:
    """Any other unknown: orientation, calibration parameter, lever arm or shift, plane.

    Attributes
    ----------
    role
        What it is: ``orientation``, ``zero``, ``refraction``, ``lever arm``, ``plane`` ...
    values, sigma, units
        One per component.
    at
        The position that it belongs to, "" if none.
    """

    name: str
    family: Literal["scalar", "vector", "plane"]
    role: str
    values: tuple[float, ...]
    sigma: tuple[Number, ...]
    units: tuple[str, ...]
    covariance: Matrix
    at: str = ""


@dataclass(frozen=True)
class Observation:
    """One observed value.

    Attributes
    ----------
    id
        Of its observation, see :mod:`tribrach.network.identity`; components of a vector share it.
    value, sigma, residual, mdb
        In ``unit`` (m, rad or 1); the residual is ``v = h(x) - l``, the minimal detectable bias
        is known for values that take part.
    redundancy, w, tau
        Of values that take part; for check values ``w`` is the difference over its predicted
        sigma.
    external, external_at
        What an undetected bias would do [m], and at which position.
    block_test, block_limit
        Test of the whole vector or target against its limit.
    state, reason
        Whether it takes part, and why not.
    source
        ``file:line``, or scan and detection.
    """

    number: int
    id: str
    kind: str
    component: str
    start: str
    end: str
    unit: str
    value: float
    sigma: float
    residual: Number
    state: Literal["active", "check", "off"]
    reason: str = ""
    source: str = ""
    group: str = ""
    redundancy: Number = None
    w: Number = None
    tau: Number = None
    mdb: Number = None
    external: Number = None
    external_at: str = ""
    block_test: Number = None
    block_limit: Number = None
    suspicious: bool = False


#: figures of which an observation may have none
_FIGURES = ("residual", "redundancy", "w", "tau", "mdb", "external", "block_test", "block_limit")


class ObservedValues(Sequence[Observation]):
    """Observed values in the order of the network, kept in columns: a large network has many.

    Parameters
    ----------
    rows : ObservationRows
        Of the adjusted network; NaN and infinities are no numbers here.
    order : array of int (k,), optional
        Which of the rows, in which order; all if not given.
    """

    def __init__(self, rows: ObservationRows, order: Index | None = None) -> None:
        self._rows = rows
        self._order = np.arange(len(rows)) if order is None else order

    def column(self, name: str) -> NDArray[Any]:
        """Array (k,) of an attribute of all rows; NaN where a figure does not exist."""
        if name == "number":
            return self._order + 1
        column = self._rows.column(name)[self._order]
        # minus zero loses its sign
        return np.where(np.isfinite(column), column + 0.0, np.nan) if name in _FIGURES else column

    def chosen(self, which: NDArray[Any]) -> ObservedValues:
        """Some of the rows, by numbers from 0 in their order, or by a mask (k,)."""
        return ObservedValues(self._rows, self._order[which])

    def __len__(self) -> int:
        return len(self._order)

    @overload
    def __getitem__(self, key: int) -> Observation: ...

    @overload
    def __getitem__(self, key: slice) -> ObservedValues: ...

    def __getitem__(self, key: int | slice) -> Observation | ObservedValues:
        if isinstance(key, slice):
            return self.chosen(np.arange(len(self))[key])
        k = int(self._order[key])
        row = self._rows[k]
        return Observation(
            number=k + 1, **vars(row) | {name: number(getattr(row, name)) for name in _FIGURES}
        )

    def __iter__(self) -> Iterator[Observation]:
        return (self[k] for k in range(len(self)))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and tuple(self) == tuple(other)

    __hash__ = None  # type: ignore[assignment]


@dataclass(frozen=True)
class ComponentRow:
    """Variance component of a group: factor on its sigmas, its own sigma, its redundancy."""

    group: str
    factor: float
    sigma: Number
    redundancy: float
    note: str = ""


@dataclass(frozen=True)
class SnoopingRow:
    """One step of iterative snooping.

    Attributes
    ----------
    observation
        Which one, in words.
    test, limit
        Its test value against its limit.
    error
        The estimated gross error in ``unit`` (m, rad or 1).
    action
        What was done.
    """

    number: int
    observation: str
    test: Number
    limit: Number
    error: Number
    unit: str
    action: str


@dataclass(frozen=True)
class CorrelationRow:
    """Two estimated unknowns, in words, and their correlation."""

    a: str
    b: str
    value: float


@dataclass(frozen=True, kw_only=True)
class Head:
    """What stands on top of a report, and the adjusted network in plain numbers.

    Chapters, the map and the JSON result are made from it. ``adjustment`` is what it was made
    from; ``quality`` its redundancy and tests; ``apart`` the same adjustment without what a warning
    has explained already: what fits in it is not warned of again.
    """

    title: str
    version: str
    date: str
    facts: tuple[tuple[str, str], ...]
    settings: ReportSettings
    datum: DatumStatement
    sigma_origin: str
    summary: Summary
    control: tuple[Control, ...]
    points: tuple[Point, ...]
    stations: tuple[StationRow, ...]
    unknowns: tuple[Unknown, ...]
    observations: ObservedValues
    components: tuple[ComponentRow, ...] = ()
    snooping: tuple[SnoopingRow, ...] = ()
    correlations: tuple[CorrelationRow, ...] = ()
    reference: tuple[tuple[str, str | float | None], ...] = ()
    adjustment: Adjustment = field(repr=False, compare=False)
    quality: Quality = field(repr=False, compare=False)
    apart: Adjustment = field(repr=False, compare=False)

    @cached_property
    def sights(self) -> tuple[tuple[str, str], ...]:
        """Pairs of positions joined by an observation that takes part, each pair once."""
        return joined_positions(self.adjustment)

    @property
    def scaled(self) -> bool:
        """True if covariances of unknowns are a posteriori."""
        return self.adjustment.scaled(posterior=self.settings.posterior)

    @property
    def variance_factor(self) -> float:
        """What a-priori covariances of unknowns are multiplied by."""
        return self.adjustment.variance_factor(posterior=self.settings.posterior)

    @property
    def origin(self) -> str:
        """Where sigmas of unknowns come from, in two words."""
        return self.adjustment.scale(posterior=self.settings.posterior)

    @property
    def percent(self) -> str:
        """The confidence of ellipses and intervals in words."""
        return f"{100 * self.settings.confidence:g} %"

    @property
    def columns(self) -> ColumnSet:
        """Kinds of columns in the style of this report."""
        return ColumnSet(Style(self.settings.angle))


@dataclass(frozen=True, kw_only=True, repr=False)
class Report(Head):
    """Everything a report says: its head, warnings by weight, chapters in their order.

    Attributes
    ----------
    adjustment : Adjustment
        What was adjusted: points, stations and observations by name, sigmas a priori.
    results : Results
        The same scaled, and at the confidence, as the report states it.
    warnings : tuple[str, ...]
        What looks wrong or weak, in sentences, the heaviest first.
    grave : int
        How many of the first warnings say that something was not read as it was meant, or that
        measurements contradict each other; the others tell what is weak or to be known.
    chapters : tuple[Chapter, ...]
        Tables and words; ``chapter("clouds")`` is one of them.
    job : JobResults
        What the chapters were made from besides the adjustment.
    """

    warnings: tuple[str, ...]
    grave: int = 0
    chapters: tuple[Chapter, ...] = ()
    job: JobResults = field(default_factory=JobResults, repr=False, compare=False)

    @cached_property
    def results(self) -> Results:
        """Points, stations and observations by name, scaled as the report states it."""
        return self.adjustment.results(
            posterior=self.settings.posterior, confidence=self.settings.confidence
        )

    def __repr__(self) -> str:
        return (
            f"<Report {self.title!r}: {len(self.chapters)} chapters, "
            f"{len(self.warnings)} warnings; {repr(self.adjustment)[1:-1]}>"
        )

    def _repr_html_(self) -> str:
        """Head, warnings and points for notebooks."""
        warnings = "".join(f"<li>{escape(text)}</li>" for text in self.warnings)
        return f"<ul>{warnings}</ul>{self.results._repr_html_()}"

    def chapter(self, name: str) -> Chapter | None:
        """The chapter of a name, None if the report has none."""
        return next((chapter for chapter in self.chapters if chapter.name == name), None)

    def tables(self, most: int | None = None) -> list[ReportTable]:
        """The tables of all chapters that have rows, each with its first ``most`` rows."""
        cut = (table.first(most) for chapter in self.chapters for table in chapter.tables)
        return [table for table in cut if table.rows]
