"""The noise of a scanner from its own scans: patches of all of them, laws, and how far these go."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array, Progress
from tribrach.answers import Matrix, Number, Result, part
from tribrach.errors import InputError
from tribrach.instruments.beam import Beam
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.scan.neighbour_correlation import NeighbourCorrelation, smooth_correlation
from tribrach.scan.noise_law import (
    By,
    ContradictedClass,
    FittedNoise,
    LastingEffect,
    fit_noise,
    held_noise,
    noise_classes,
)
from tribrach.scan.observed_noise import GATES, ObservedNoise, joined, observed_noise
from tribrach.scan.scan import Scan
from tribrach.sentences import Sentence
from tribrach.statistics import chi2
from tribrach.units import MM, SEC

_BY: tuple[By, ...] = ("intensity", "range", "incidence")
#: records of all scans together, and of one of them, that are read
_RECORDS, _OF_ONE = 6_000_000, 2_000_000
#: widths of patches that are compared with the usual one, as factors
_WIDTHS = (0.5, 2.0)
#: patches of another width tell something if they are so much larger or smaller
_OTHER = 1.5
#: sigmas of another width that speak of surfaces, or of what neighbours share, not of chance
_BENT, _SHARED = 1.25, 0.8
#: share of the variance, and width over that of a beam, from which on shared errors are no overlap
_FILTER, _BEAMS = 0.2, 2.0
#: why a scan without its station gives nothing
_NO_ORIGIN = "it is not known where the scanner stood"
#: a beam where none is stated [m]
_WIDE = 0.010
#: variance factor of the patches from which on surfaces and not a scanner scatter
_SURFACES = 2.0
#: the noise of angles beside a footprint is known where it is so many times its sigma
_KNOWN = 2.0
#: the noise across the beam is known where its relative sigma is below this at all these quantiles
#: of the ranges seen
_ACROSS, _RANGES = 0.15, (0.05, 0.5, 0.95)
#: a footprint is contradicted beyond this probability
_CONTRADICTED = 0.999
#: the least sigmas that an instrument file states [m], [rad]
_LEAST, _LEAST_ANGLE = 1e-5, 0.01 * SEC


@dataclass(frozen=True)
class ScanPatches(Result):
    """Patches of one scan."""

    source: str  #: file and scan
    #: planar patches and points on them
    patches: int
    points: int
    #: windows filled by points, of which some are curved or have points far off
    windows: int
    curved: int
    uneven: int
    gridded: bool  #: true if the scan has its grid of rows and columns
    step: Number  #: step of its coordinates [m], 0 if they are fine
    unit: str  #: what its intensities are, in words
    remark: str = ""  #: why it gave nothing, "" if it gave something


@dataclass(frozen=True)
class NoiseOfWidth:
    """Sigmas of patches of another width."""

    width: float  #: that patches grow to [m]
    patches: int  #: number of the smooth ones
    factor: float  #: what their laws give for the points of the usual patches, over what those give


@dataclass(frozen=True, eq=False)
class StatedAcross:
    """A stated footprint against the scans."""

    #: what the likelihood loses by it, as chi-square of one degree of freedom, and its limit
    chi2: float
    limit: float
    #: laws beside the stated footprint, and beside the stated angles where the scans do not tell
    #: these; None where the footprint is contradicted
    fitted: FittedNoise | None
    angle_known: bool  #: true if the scans tell the noise of the angles beside the footprint

    @property
    def contradicted(self) -> bool:
        """True if the scans contradict the footprint."""
        return self.chi2 > self.limit


@dataclass(frozen=True)
class IntensityLaw(Result):
    """``sigma = a I^b + c`` [m] for intensities I from low to high, in the unit of the files.

    Where no power describes the noise it is multiplied with factors at knots of the intensity.
    """

    a: Number
    b: Number
    c: Number
    low: Number
    high: Number
    knots: tuple[Number, ...]
    factors: tuple[Number, ...]
    covariance: Matrix  #: of a, b and c, or of the factors; null where a figure is at its limit


@dataclass(frozen=True)
class NoiseRow(Result):
    """A class of points: standard deviations along the beam [m]."""

    by: By
    #: limits, in the unit of the files, metres or radians
    low: Number
    high: Number
    patches: int
    points: int
    #: seen, by the laws, and as stated
    observed: Number
    fitted: Number
    #: squared residuals over the variances fitted, by the degrees of freedom
    chi2_dof: Number
    stated: Number


@dataclass(frozen=True, eq=False)
class NoiseEstimate(
    Result,
    without=("fitted", "stated", "widths", "across"),
    also=(
        "patches", "points", "spread", "law", "why", "range", "range_scale", "horizontal",
        "vertical", "horizontal_sigma", "vertical_sigma", "place", "place_sigma", "by_range",
        "by_incidence", "incidence", "contradicted", "classes", "instrument", "doubts",
    ),
):  # fmt: skip
    """The noise of a scanner by its scans."""

    scans: tuple[ScanPatches, ...]  #: what each of them gave
    fitted: FittedNoise  #: the laws
    #: what neighbouring points share of the noise; null with too few patches
    neighbours: NeighbourCorrelation | None
    #: noise that a data sheet or a project states, and which; None and "" without
    stated: ScanNoise | None
    stated_by: str
    widths: tuple[NoiseOfWidth, ...]  #: sigmas of narrower and wider patches, where there are such
    #: what is stated across the beam against the scans, None where nothing is stated
    across: StatedAcross | None = None

    patches = part("fitted.patches", int, "Smooth patches.")
    points = part("fitted.points", int, "Points on them.")
    spread = part("fitted.spread", Number, "Variance factor of the patches about the law.")
    why = part("fitted.why", str, "Why there is no law of the intensity.")
    range = part("fitted.range", Number, "Noise of ranges without intensity [m], over the cosine.")
    range_scale = part("fitted.range_scale", Number, "Its part that grows [m/m].")
    horizontal = part("fitted.horizontal", Number, "Noise across the beam [rad].")
    vertical = part("fitted.vertical", Number, "Noise across the beam [rad].")
    place = part("fitted.place", Number, "Noise across the beam at any range [m].")
    place_sigma = part("fitted.place_sigma", Number, "Its standard deviation [m].")
    by_range = part("fitted.by_range", LastingEffect, "At twice the range.")
    by_incidence = part("fitted.by_incidence", LastingEffect, "At 60 degrees, not straight on.")
    incidence = part("fitted.incidence", Number, "Power of the cosine that ranges are divided by.")
    contradicted = part(
        "fitted.contradicted", tuple[ContradictedClass, ...], "Classes that contradict the law."
    )

    @property
    def horizontal_sigma(self) -> Number:
        """Its standard deviation [rad]."""
        return float(self.fitted.angle_sigmas[0])

    @property
    def vertical_sigma(self) -> Number:
        """Its standard deviation [rad]."""
        return float(self.fitted.angle_sigmas[1])

    @property
    def law(self) -> IntensityLaw | None:
        """Law of the intensity."""
        law = self.fitted.law
        covariance = self.fitted.law_covariance
        return None if law is None else IntensityLaw(**vars(law), covariance=covariance)

    @property
    def beam(self) -> Beam | None:
        """The beam that is stated, None if none is."""
        stated = self.stated
        return stated.beam if stated and (stated.beam_exit or stated.beam_divergence) else None

    @property
    def taken(self) -> FittedNoise:
        """The laws that an instrument file has: beside what is stated across the beam, if it is."""
        if self.across is None or self.across.fitted is None or self._seen_instead:
            return self.fitted
        return self.across.fitted

    @property
    def _seen_instead(self) -> bool:
        """True if the scans tell the noise across the beam and no stated footprint goes with it."""
        across = self.across
        if across is None or self.beam is None or across.contradicted:
            return self.across_known
        return False

    @property
    def across_errors(self) -> Array:
        """Relative sigmas (3,) of the noise across the beam over the ranges seen."""
        return self.fitted.across_error(self.ranges)

    @property
    def ranges(self) -> Array:
        """The least, middle and largest range (3,) [m] that this is looked at."""
        found: Array = np.quantile(self.fitted.smooth.range, _RANGES)
        return found

    @property
    def across_known(self) -> bool:
        """True if the scans tell the noise across the beam at all ranges, with nothing stated."""
        return bool((self.across_errors < _ACROSS).all())

    @property
    def across_limit(self) -> float:
        """Relative sigma from which on the noise across the beam is not known."""
        return _ACROSS

    @property
    def step(self) -> float:
        """The coarsest step of coordinates [m]."""
        return max((scan.step for scan in self.scans), default=0.0)

    @property
    def units(self) -> tuple[str, ...]:
        """What the intensities of the scans are, each once."""
        return tuple(dict.fromkeys(scan.unit for scan in self.scans if scan.patches))

    @property
    def source(self) -> str:
        """Where the figures come from, for the instrument file."""
        used = [scan.source for scan in self.scans if scan.patches]
        names = ", ".join(used[:4]) + (f" and {len(used) - 4} more" if len(used) > 4 else "")
        return (
            f"estimated from planar patches of {names} ({self.fitted.patches} patches, "
            f"{self.fitted.points} points)"
        )

    @property
    def doubts(self) -> list[str]:
        """Why these figures may be those of the surfaces, or of a filter, rather than of beams."""
        out: list[str] = []
        spread = self.fitted.spread
        if spread > _SURFACES:
            out.append(
                Sentence(
                    "the variances of the patches scatter {spread:1} times as widely about the law "
                    "as noise would make them (limit {surfaces:g})",
                    spread=spread,
                    surfaces=_SURFACES,
                )
            )
        for one in self.widths:
            words = Sentence(
                "patches of {one.width:mm0} give {one.factor:2} times the sigma of those of "
                "{gates.width:mm0}",
                one=one,
                gates=GATES,
            )
            wider = one.width > GATES.width
            if one.factor > _BENT and wider:
                out.append(
                    Sentence(
                        "{words} (limit {bent:g}): surfaces bend, or points share errors",
                        words=words,
                        bent=_BENT,
                    )
                )
            elif one.factor < _SHARED and not wider:
                out.append(
                    Sentence(
                        "{words} (limit {shared:g}): surfaces bend, or points share errors",
                        words=words,
                        shared=_SHARED,
                    )
                )
        return out

    @property
    def filtered(self) -> tuple[float, float] | None:
        """Angle [rad] that neighbours share errors over where no beam is so wide, over its width.

        None where they share little or no more than overlapping beams do. Without a beam that is
        stated its width is taken for 10 mm at the typical range, more than survey scanners have.
        """
        shared = self.neighbours
        if shared is None or not shared.told or shared.share < _FILTER:
            return None
        at = self.fitted.typical_range
        beam = _WIDE if self.beam is None else float(self.beam.diameter(np.array([at]))[0])
        times = shared.angle * at / beam
        return (shared.angle, times) if times > _BEAMS else None

    @property
    def instrument(self) -> dict[str, Number | tuple[Number, ...]]:
        """Keys and values of an instrument file that the scans tell, in the units of their names.

        Noise across the beam is among them where the scans determine it: the noise of the angles
        beside a stated footprint, else both together, with a footprint of the size seen and without
        a divergence, which the angles hold.
        """
        taken = self.taken
        out: dict[str, Number | tuple[Number, ...]] = {
            "range_mm": max(taken.range, _LEAST) / MM,
            "range_ppm": 1e6 * taken.range_scale,
        }
        law = taken.law
        if law is not None:
            out |= {
                "range_law_a_mm": law.a / MM,
                "range_law_b": law.b,
                "range_law_c_mm": law.c / MM,
                "range_law_from": law.low,
                "range_law_to": law.high,
            }
            if law.knots:
                out |= {"range_law_at": law.knots, "range_law_times": law.factors}
        elif taken.incidence != 1:
            out["range_incidence"] = taken.incidence
        if self.neighbours is not None and self.neighbours.told:
            out |= self.neighbours.keys
        if self._seen_instead:
            out["scan_angle_arcsec"] = max(self.fitted.angle[0], _LEAST_ANGLE) / SEC
            out["beam_exit_mm"] = 4 * self.fitted.place / MM
            out["beam_divergence_mrad"] = 0.0
        elif self.across is not None and self.across.fitted is not None and self.across.angle_known:
            out["scan_angle_arcsec"] = taken.angle[0] / SEC
        return out

    def carried(self) -> dict[str, float | str]:
        """Stated keys and values across the beam that the scans do not determine.

        With :attr:`instrument` they make a whole instrument; empty where nothing is stated.
        """
        stated = self.stated
        if stated is None:
            return {}
        angle = float(np.hypot(stated.horizontal, stated.vertical) / np.sqrt(2))
        out: dict[str, float | str] = {
            "scan_angle_arcsec": max(angle, _LEAST_ANGLE) / SEC,
            "beam_exit_mm": stated.beam_exit / MM,
            "beam_divergence_mrad": 1e3 * stated.beam_divergence,
        }
        if stated.systematic:
            whole = float(np.hypot(angle, stated.systematic))
            out["scan_angle_accuracy_arcsec"] = whole / SEC
        if stated.beam_cone:
            out["beam_shape"] = "cone"
        return {key: value for key, value in out.items() if key not in self.instrument}

    @property
    def classes(self) -> list[NoiseRow]:
        """Noise of the smooth patches by intensity, range and incidence."""
        smooth, rows = self.fitted.smooth, list[NoiseRow]()
        for by in _BY[not self.fitted.observed.intense :]:
            seen = noise_classes(smooth, smooth.stated(self.fitted.noise()), by)
            stated = [np.nan] * len(seen)
            if self.stated is not None:
                of_stated = noise_classes(smooth, smooth.stated(self.stated), by)
                stated = [one.stated for one in of_stated]
            for a, b in zip(seen, stated, strict=True):
                figures = (a.low, a.high, a.patches, a.points, a.observed, a.stated, a.chi2_dof)
                rows.append(NoiseRow(by, *figures, b))
        return rows


def estimate_noise(
    scans: Sequence[Scan],
    stated: ScanNoise | None = None,
    stated_by: str = "",
    progress: Progress | None = None,
) -> NoiseEstimate:
    """Estimate the noise of a scanner from its scans."""
    records = min(_OF_ONE, _RECORDS // max(len(scans), 1))
    found, told = [], []
    for number, scan in enumerate(scans):
        if progress is not None:
            progress("patches", number, len(scans))
        one = observed_noise(scan, records=records)
        found.append(one)
        told.append(_told(scan, one))
    both = joined(found)
    try:
        fitted = fit_noise(both)
    except InputError as error:
        raise _too_few(scans, told, error) from error
    across = None if stated is None else _stated_across(fitted, stated)
    widths = [_of_width(scans, fitted, records // 3, factor) for factor in _WIDTHS]
    return NoiseEstimate(
        tuple(told),
        fitted,
        smooth_correlation(fitted),
        stated,
        stated_by,
        tuple(one for one in widths if one is not None),
        across,
    )


def _stated_across(fitted: FittedNoise, stated: ScanNoise) -> StatedAcross:
    """Test a stated footprint, and estimate the rest beside it."""
    held = held_noise(fitted, stated.beam)
    limit = float(chi2.ppf(_CONTRADICTED, 1))
    excess = max(2 * (held.cost - fitted.cost) / fitted.spread, 0.0)
    if np.isfinite(fitted.angle_sigmas).all():
        if excess > limit:
            return StatedAcross(excess, limit, None, False)
        size, sigma = held.angle
        if size > _KNOWN * sigma:
            return StatedAcross(excess, limit, held, True)
    else:
        excess = 0.0  # nothing parts footprint and range there, so nothing contradicts it
    angle = float(np.hypot(stated.horizontal, stated.vertical) / np.sqrt(2))
    return StatedAcross(excess, limit, held_noise(fitted, stated.beam, angle), False)


def _too_few(scans: Sequence[Scan], told: Sequence[ScanPatches], error: InputError) -> InputError:
    """Why the scans have too few patches, the cause before the number."""
    lost = [one.source for one in told if one.remark == _NO_ORIGIN]
    if len(lost) == len(told) > 0:
        more = f" and {len(lost) - 3} more" if len(lost) > 3 else ""
        return InputError(
            f"{_NO_ORIGIN} for {', '.join(lost[:3])}{more}, and without ranges and angles there "
            "are no patches",
            cure="give its place in the coordinates of the file with --origin X Y Z",
        )
    remarks = [f"{one.source}: {one.remark}" for one in told if one.remark]
    cure = error.cure
    stated = [scan.origin == "stated" for scan in scans]
    if any(by and not one.windows for by, one in zip(stated, told, strict=True)):
        cure = f"look whether --origin is where the scanner stood; {cure}"
    return InputError("; ".join([*remarks[:3], error.what]), cure=cure)


def _told(scan: Scan, found: ObservedNoise) -> ScanPatches:
    """Patches of one scan, with the reason if there are none."""
    remark = ""
    if scan.origin == "unknown":
        remark = _NO_ORIGIN
    elif not found.patches:
        remark = "no planar patches" if found.windows else "no windows that are filled by points"
    return ScanPatches(
        scan.source,
        found.patches,
        len(found),
        found.windows,
        found.curved,
        found.uneven,
        found.gridded,
        found.step,
        _unit(scan),
        remark,
    )


def _unit(scan: Scan) -> str:
    """What the intensities of a scan are, as far as its file tells."""
    if scan.path.suffix.lower() in (".las", ".laz"):
        return "the 16 bits of LAS, a scale that the program chose which wrote them"
    light = next((item for item in scan.fields if item.name == "intensity"), None)
    if light is None or light.low is None or light.high is None:
        return "a scale that the file does not name"
    return Sentence(
        "a scale that the file says to go from {light.low:g} to {light.high:g}", light=light
    )


def _of_width(
    scans: Sequence[Scan], fitted: FittedNoise, records: int, factor: float
) -> NoiseOfWidth | None:
    """What the smooth patches of another width show, None where there are none of another size."""
    width = factor * GATES.width
    other = joined([observed_noise(scan, records=records, width=width) for scan in scans])
    usual = len(fitted.observed) / fitted.observed.patches
    size = len(other) / max(other.patches, 1) / usual
    if not other.patches or max(size, 1 / size) < _OTHER:
        return None
    try:
        found = fit_noise(other)
    except InputError:
        return None
    smooth = fitted.smooth
    ratio = smooth.stated(found.noise()).mean() / smooth.stated(fitted.noise()).mean()
    return NoiseOfWidth(width, found.patches, float(np.sqrt(ratio)))
