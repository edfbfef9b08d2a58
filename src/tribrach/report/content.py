"""What a report says: a head and chapters, one model that every rendering shares.

Plain numbers in metres and radians of the work frame (E, N, U), None where there is no number.
Standard deviations and covariances are already scaled as ``sigma_origin`` says. Angles are
written in the unit of ``ReportSettings.angle`` by the renderings only. Method section 11.1.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from typing import ClassVar, Literal

from tribrach.answers import Estimate, Result
from tribrach.job.results import JobResults
from tribrach.network.adjustment import Adjustment
from tribrach.network.observation_rows import ObservationRows
from tribrach.network.quality import Quality
from tribrach.network.results import Results
from tribrach.network.roles import Role, joined_positions
from tribrach.report.chapter import Chapter
from tribrach.report.columns import ColumnSet
from tribrach.report.numbers import Style
from tribrach.report.tables import ReportTable
from tribrach.sentences import Sentence

Number = float | None
Triple = tuple[Number, Number, Number]
Matrix = tuple[tuple[Number, ...], ...]


@dataclass(frozen=True)
class ReportSettings:
    """What the numbers depend on."""

    confidence: float = 0.95  #: probability that ellipses, intervals and ellipsoids hold
    posterior: bool = False  #: true if covariances are scaled by the a-posteriori variance factor
    #: error probability of the global test and of check verdicts, 1 - confidence
    alpha: float = 0.05
    angle: Literal["gon", "deg"] = "gon"  #: how angles are written


@dataclass(frozen=True)
class DatumStatement(Result, keys={"sentence": "statement"}):
    """What fixes the frame."""

    #: as in the network
    kind: str
    sentence: str
    names: tuple[str, ...]  #: points and stations that carry it


@dataclass(frozen=True)
class GlobalVerdict(Result, without=("sentence",)):
    """The weighted sum of squares against its chi-square bounds."""

    statistic: float
    lower: Number
    upper: Number
    alpha: float  #: outside of both limits; right networks are rejected half as often
    #: null where there is no redundancy
    accepted: bool | None
    sentence: str


@dataclass(frozen=True)
class KindCount:
    """Observed values of one kind and group."""

    kind: str
    group: str
    #: how many values take part, are held out, are switched off
    active: int
    check: int
    off: int
    redundancy: Number  #: sum of their redundancy numbers
    #: ``sqrt(v^T P v / r)`` of the group, a posteriori over a priori; None without redundancy
    sigma0: Number


@dataclass(frozen=True)
class Summary(
    Result,
    keys={"sigma0": "prior", "sigma0_posterior": "posterior", "test": "global_test"},
    without=(
        "kinds",
        "n_observations",
        "n_check",
        "n_off",
        "n_unknowns",
        "n_constraints",
        "defect",
    ),
):
    """Sigma of unit weight, redundancy, global test."""

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
    covariances: Literal["prior", "posterior"]  #: what all covariances of unknowns are scaled by


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
class Point(
    Result,
    without=("name", "sigma", "ellipse", "height_interval", "ellipsoid"),
    maybe=(
        "code",
        "dof",
        "doubled",
        "protection",
        "geodetic",
        "ecef",
        "ecef_covariance",
        "projected",
    ),
):
    """A point of the network."""

    name: str
    role: Role
    xyz: Triple  #: E, N, U of the work frame [m]; null where the network has no such coordinate
    sigma: Triple  #: None where held
    #: 3 x 3 [m^2]
    covariance: Matrix
    ellipse: Ellipse | None = None
    #: half its width [m]
    height_interval: Number = None
    ellipsoid: Ellipsoid | None = None
    #: degrees of freedom of the variances along E, N, U, null where they are known; left out where
    #: no sigma comes from residuals
    dof: Triple | None = None
    #: sigmas along E, N, U [m] if what observations share (centring and refraction of a set-up,
    #: tilt, common errors of targets) were twice as large; left out where they share nothing
    doubled: Triple | None = None
    #: longest semi-axis [m] of the ellipsoid at the significance of blunder tests, and the largest
    #: effect of an error of the size of its minimal detectable bias; left out where an error of a
    #: value that nothing controls would move the point, or where not every error was followed
    protection: Number = None
    #: latitude, longitude [rad] and ellipsoidal height [m]
    geodetic: tuple[float, float, float] | None = None
    ecef: tuple[float, float, float] | None = None
    ecef_covariance: Matrix | None = None
    #: easting, northing and height in the grid of the site [m]
    projected: tuple[float, float, float] | None = None
    code: str = ""  #: code or description of the files it was read from


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
    """Control or check coordinates of a point."""

    name: str
    #: held without error, weighted, held out as a check, or switched off
    use: Literal["held", "weighted", "check", "off"]
    #: given coordinates and their sigma [m]
    given: Triple
    sigma: Triple
    #: adjusted minus given [m], and what that difference should have; None if held
    difference: Triple
    difference_sigma: Triple
    verdict: CheckVerdict | None  #: the difference against its covariance, where there is one
    reason: str = ""  #: why it is off
    source: str = ""  #: ``file:line``


@dataclass(frozen=True, kw_only=True)
class SetUp(
    Result, maybe=("dof", "orientation", "geodetic", "ecef", "ecef_covariance", "projected")
):
    """A scanner station by its pose; a set-up on a point by its orientation unknowns."""

    world_from_scanner: Matrix | None = None  #: 4 x 4
    #: 6 x 6 of the translation [m] and of left rotation increments [rad]
    covariance: Matrix | None = None
    dof: Triple | None = None  #: degrees of freedom of the variances of E, N, U as those of points
    orientation: dict[str, Estimate] = field(default_factory=dict)  #: unknowns [rad] by name
    #: of the scanner's origin: latitude, longitude [rad] and ellipsoidal height [m]
    geodetic: tuple[float, float, float] | None = None
    ecef: tuple[float, float, float] | None = None
    ecef_covariance: Matrix | None = None
    #: easting, northing and height in the grid of the site [m]
    projected: tuple[float, float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class StationRow(
    SetUp,
    without=(
        "name", "xyz", "sigma", "heading", "heading_sigma", "tilt_e", "tilt_e_sigma", "tilt_n",
        "tilt_n_sigma", "tilt", "tilt_sigma", "ellipse", "height_interval",
    ),
):  # fmt: skip
    """An adjusted scanner station with what its pose means; angles in radians."""

    name: str
    xyz: Triple
    sigma: Triple
    #: azimuth of the scanner's x axis
    heading: float
    heading_sigma: Number
    #: turns of its z axis about E and N
    tilt_e: float
    tilt_e_sigma: Number
    tilt_n: float
    tilt_n_sigma: Number
    #: angle of its z axis with the vertical of the work frame
    tilt: float
    tilt_sigma: Number
    ellipse: Ellipse | None = None
    height_interval: Number = None


@dataclass(frozen=True)
class ScalarUnknown(Result, without=("name", "at")):
    """A calibration parameter, scale, refraction coefficient or the like."""

    name: str
    role: str
    value: float
    #: None where held
    sigma: Number
    unit: str
    at: str = ""  #: the position that it belongs to, "" if none

    @property
    def values(self) -> tuple[tuple[float, str], ...]:
        """Its numbers with their units."""
        return ((self.value, self.unit),)

    @property
    def sigmas(self) -> tuple[tuple[Number, str], ...]:
        """Sigmas with their units."""
        return ((self.sigma, self.unit),)


@dataclass(frozen=True)
class VectorUnknown(Result, without=("name", "sigma")):
    """A lever arm or common shift [m, m^2]."""

    name: str
    role: str
    xyz: tuple[float, ...]
    covariance: Matrix
    sigma: tuple[Number, ...]
    at: ClassVar[str] = ""

    @property
    def values(self) -> tuple[tuple[float, str], ...]:
        """Its numbers with their units."""
        return tuple((value, "m") for value in self.xyz)

    @property
    def sigmas(self) -> tuple[tuple[Number, str], ...]:
        """Sigmas with their units."""
        return tuple((sigma, "m") for sigma in self.sigma)


@dataclass(frozen=True)
class PlaneUnknown(Result, without=("name", "sigma")):
    """A plane ``n x = d``."""

    name: str
    normal: tuple[float, ...]
    offset: float
    #: of two turns of the normal [rad] and of the offset [m]
    covariance: Matrix
    sigma: tuple[Number, ...]
    role: ClassVar[str] = "plane"
    at: ClassVar[str] = ""

    @property
    def values(self) -> tuple[tuple[float, str], ...]:
        """Its numbers with their units."""
        return (*((value, "1") for value in self.normal), (self.offset, "m"))

    @property
    def sigmas(self) -> tuple[tuple[Number, str], ...]:
        """Sigmas with their units."""
        return tuple(zip(self.sigma, ("rad", "rad", "m"), strict=True))


#: any other unknown
Unknown = ScalarUnknown | VectorUnknown | PlaneUnknown


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
    """One step of iterative snooping."""

    number: int
    observation: str  #: which one, in words
    #: its test value against its limit
    test: Number
    limit: Number
    #: the estimated gross error in ``unit`` (m, rad or 1)
    error: Number
    unit: str
    action: str  #: what was done


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
    #: how lists were read that do not say everything themselves
    readings: tuple[str, ...]
    summary: Summary
    control: tuple[Control, ...]
    points: tuple[Point, ...]
    stations: tuple[StationRow, ...]
    unknowns: tuple[Unknown, ...]
    observations: ObservationRows
    components: tuple[ComponentRow, ...] = ()
    snooping: tuple[SnoopingRow, ...] = ()
    correlations: tuple[CorrelationRow, ...] = ()
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
        return Sentence("{confidence:%g}", confidence=self.settings.confidence)

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
