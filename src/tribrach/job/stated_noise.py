"""The noise that is stated for a scanner against that which its own scans show, class by class.

Planar patches of all scans of an instrument (:mod:`tribrach.scan.observed_noise`, method section
5.8), those of smooth surfaces only. What is stated is what points of clouds have: the law of the
intensity where the instrument has one, else the noise of the range, over the cosine of the
incidence only where the project asks for that, with angles and footprint over the slope.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from tribrach._types import Progress
from tribrach.answers import Number, Result
from tribrach.errors import InputError
from tribrach.instruments.range_law import RangeLaw
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.job.scans import StationScan
from tribrach.job.state import Remembered
from tribrach.project.instrument import Instrument, Origin
from tribrach.scan.neighbour_correlation import smooth_correlation
from tribrach.scan.noise_law import (
    By,
    ContradictedClass,
    FittedNoise,
    NoiseClass,
    contradicted_classes,
    fit_noise,
    noise_classes,
)
from tribrach.scan.observed_noise import ObservedNoise, joined, observed_noise
from tribrach.scan.scan import Scan
from tribrach.tasks.engine import Call

Verdict = Literal["as stated", "in part", "more than stated", "less than stated", "undecided"]

#: what classes are made by
CAUSES: tuple[By, ...] = ("intensity", "range", "incidence")
#: classes of intensity and of range
_CLASSES = 6
#: factors between observed and stated that no surveyor would call a contradiction
BAND = (0.9, 1.1)
#: of all intervals of an instrument together
_LEVEL = 0.95
#: patches and records of all scans of an instrument that are looked at, and of one scan at least
_PATCHES, _RECORDS = 10_000, 2_000_000
_LEAST_PATCHES, _LEAST_RECORDS, _MOST_RECORDS = 200, 100_000, 500_000
#: who states the noise of an instrument
_BASIS: Mapping[Origin, str] = {
    "project": "the project ([instruments.{}])",
    "file": "the instrument file of {}",
    "sheet": "the data sheet of {}",
}


@dataclass(frozen=True)
class NeighbourNoise(Result, without=("words",)):
    """What neighbouring points share of the variance of their ranges, stated and seen."""

    stated: float | None  #: the share that is stated, None if nobody says
    #: as the scans show it, zero if they show none, and its standard deviation
    share: float
    sigma: float
    angle: float  #: over which they share it [rad], zero if they show none
    factor: float  #: points that count as one in a wide mean at the pitch of the scans
    words: str  #: what was seen, in words


@dataclass(frozen=True)
class NoiseOfClass(Result):
    """Noise along the beam of points of one class, stated and observed."""

    by: Literal["all", "intensity", "range", "incidence"]  #: what the class is of
    #: its limits, in the unit of the file, metres or radians; none for all points
    low: float | None
    high: float | None
    patches: int
    points: int
    #: standard deviations along the beam [m], in the same weights: the inverse of the variance that
    #: is stated for a point
    observed: float
    stated: float
    chi2_dof: float  #: squared residuals over stated variances, by their degrees of freedom
    effective: float  #: degrees of freedom that this is worth by the scatter from patch to patch
    factor: float  #: observed over stated
    #: its limits at 95 % for all classes together; none where there are too few patches
    factor_low: float | None
    factor_high: float | None
    verdict: Verdict


@dataclass(frozen=True)
class StatedNoise(
    Result,
    without=("basis", "whole", "classes", "slanted"),
    also=("rows",),
    keys={"lawful": "by_law", "why": "remark", "rows": "classes"},
):
    """Noise of an instrument as it is stated and as its scans show it."""

    instrument: str  #: its name in the project
    basis: str  #: what states the noise of its ranges where no law does, in words
    scans: tuple[str, ...]  #: names of the scans that were looked at
    #: true if the instrument has a law of the intensity, and the scans have intensities
    lawful: bool
    #: planar patches found, and those of smooth surfaces that the figures are of
    patches: int
    smooth: int
    whole: NoiseClass | None  #: all of the smooth ones together; None without any
    classes: Mapping[By, tuple[NoiseClass, ...]]  #: the same by intensity, range and incidence
    law: RangeLaw | None  #: what the scans themselves show of a law of the intensity; None if none
    #: what neighbouring points share; None with too few patches
    neighbours: NeighbourNoise | None = None
    why: str = ""  #: why there is nothing, or no law
    #: all of the smooth ones together, were the noise of ranges stated with the incidence; None
    #: where it is, or with a law
    slanted: NoiseClass | None = None
    #: classes of which even the smoothest patches contradict what is stated, rough ones counted
    beyond: tuple[ContradictedClass, ...] = ()
    #: standard deviations of every patch, those of rough surfaces too, over those stated
    every: Number | None = None

    @property
    def rows(self) -> tuple[NoiseOfClass, ...]:
        """All classes with their verdicts, the whole first."""
        own: list[tuple[By | Literal["all"], NoiseClass]] = []
        if self.whole is not None:
            own.append(("all", self.whole))
        own += [(by, one) for by, some in self.classes.items() for one in some]
        return tuple(
            NoiseOfClass(
                by,
                None if by == "all" else one.low,
                None if by == "all" else one.high,
                one.patches,
                one.points,
                one.weighted_observed,
                one.weighted,
                one.chi2_dof,
                one.effective,
                one.factor,
                ends[0],
                ends[1],
                self.verdict(one),
            )
            for by, one in own
            for ends in (self.interval(one) or (None, None),)
        )

    @property
    def level(self) -> float:
        """Probability of each interval such that all hold together (Bonferroni)."""
        count = 1 + sum(map(len, self.classes.values()))
        return 1 - (1 - _LEVEL) / count

    def interval(self, one: NoiseClass) -> tuple[float, float] | None:
        """Where the factor of a class lies, with all others in theirs in 95 % of all jobs."""
        return one.interval(self.level)

    def verdict(self, one: NoiseClass) -> Verdict:
        """What the interval of a class says against a tenth more or less than is stated."""
        ends = self.interval(one)
        if ends is None:
            return "undecided"
        if ends[0] > BAND[1]:
            return "more than stated"
        if ends[1] < BAND[0]:
            return "less than stated"
        if one is self.whole and self.beyond:
            return "in part"
        return "as stated" if BAND[0] <= one.factor <= BAND[1] else "undecided"

    @property
    def farthest(self) -> tuple[By, NoiseClass] | None:
        """The class that contradicts most, if one does and the whole does not say the same."""
        whole = None if self.whole is None else self.verdict(self.whole)
        off = [
            (by, one)
            for by, some in self.classes.items()
            for one in some
            if self.verdict(one) in ("more than stated", "less than stated")
        ]
        if not off:
            return None
        by, worst = max(off, key=lambda found: abs(np.log(found[1].factor)))
        if whole == self.verdict(worst) and self.whole is not None:
            apart = abs(np.log(worst.factor / self.whole.factor))
            return (by, worst) if apart > np.log(BAND[1]) else None
        return by, worst


def stated_noise(
    scans: Sequence[StationScan],
    whose: Mapping[str, str | None],
    instruments: Mapping[str, Instrument],
    state: Remembered,
    progress: Progress,
    *,
    incidence: bool,
) -> list[StatedNoise]:
    """Hold the noise that is stated for every scanner against its scans."""
    by_instrument: dict[str, list[StationScan]] = {}
    for scan in scans:
        name = whose.get(scan.station)
        if name is not None and scan.noise is not None and scan.origin_known:
            by_instrument.setdefault(name, []).append(scan)
    found: dict[str, StatedNoise] = {}
    keys, calls, owners = {}, [], []
    for name, members in by_instrument.items():
        basis = _BASIS[instruments[name].stated_by("range_mm")].format(name)
        source = _Source(name, basis, tuple(scan.name for scan in members), _noise(members))
        keys[name] = source, state.key(_shown, source, [scan.scan for scan in members], incidence)
        known = state.recall(f"noise-{name}", keys[name][1], StatedNoise)
        if known is not None:
            found[name] = known
            continue
        owners += [name] * len(members)
        calls += _calls(members)
    parts: dict[str, dict[int, ObservedNoise]] = {}
    for number, part in state.engine.completed(_observed, calls, progress):
        name = owners[number]
        parts.setdefault(name, {})[number] = part
        if len(parts[name]) < owners.count(name):
            continue
        # of all scans of the scanner, in their order whoever was ready first
        observed = joined([part for _, part in sorted(parts.pop(name).items())])
        source, key = keys[name]
        found[name] = state.remember(f"noise-{name}", key, _shown(source, observed, incidence))
    return [found[name] for name in by_instrument]


@dataclass(frozen=True)
class _Source:
    """Who states which noise, for which scans."""

    instrument: str
    basis: str
    scans: tuple[str, ...]
    noise: ScanNoise


def _noise(members: Sequence[StationScan]) -> ScanNoise:
    """Stated noise of the scans of one scanner."""
    noise = members[0].noise
    assert noise is not None
    return noise


def _calls(members: Sequence[StationScan]) -> list[Call]:
    """Looks at scans of one scanner, no more at each than keeps time and memory the same for many.

    All patches together are some twenty megabytes at most, however many scans there are.
    """
    records = int(np.clip(_RECORDS // len(members), _LEAST_RECORDS, _MOST_RECORDS))
    most = max(_PATCHES // len(members), _LEAST_PATCHES)
    return [
        Call(
            f"noise of {scan.name}",
            (scan.scan, records, most),
            scan.scan.path,
            min(records, scan.scan.records or records),
        )
        for scan in members
    ]


def _observed(scan: Scan, records: int, most: int, *, progress: Progress) -> ObservedNoise:
    """Patches of a scan, at most so many, from at most so many of its records."""
    found = observed_noise(scan, records=records)
    if found.patches <= most:
        return found
    kept = np.zeros(found.patches, dtype=bool)
    kept[np.linspace(0, found.patches - 1, most).astype(np.int64)] = True
    return found.of_patches(kept)


def _shown(source: _Source, observed: ObservedNoise, incidence: bool) -> StatedNoise:
    """What scans of one scanner show of the noise that is stated for them."""
    noise = source.noise
    nothing = StatedNoise(
        instrument=source.instrument,
        basis=source.basis,
        scans=source.scans,
        lawful=noise.law is not None and bool(np.isfinite(observed.intensity).any()),
        patches=observed.patches,
        smooth=0,
        whole=None,
        classes=dict.fromkeys(CAUSES, ()),
        law=None,
    )
    try:
        fitted = fit_noise(observed)
    except InputError as error:
        return replace(nothing, why=error.what)
    smooth = fitted.smooth
    stated = smooth.stated(noise, incidence=incidence)
    (whole,) = noise_classes(smooth, stated, "range", 1)
    of_all = observed.stated(noise, incidence=incidence)
    off = contradicted_classes(observed, of_all, fitted.kept, _CLASSES)
    every = np.sqrt((observed.residual**2 / of_all).sum() / observed.redundancy.sum())
    slanted = None
    if not incidence and not nothing.lawful:
        (slanted,) = noise_classes(smooth, smooth.stated(noise), "range", 1)
    return replace(
        nothing,
        smooth=smooth.patches,
        whole=whole,
        classes={by: tuple(noise_classes(smooth, stated, by, _CLASSES)) for by in CAUSES},
        law=fitted.law,
        neighbours=_neighbours(fitted, noise),
        why=fitted.why,
        slanted=slanted,
        beyond=tuple(one for one in off if one.smoothest),
        every=float(every),
    )


def _neighbours(fitted: FittedNoise, noise: ScanNoise) -> NeighbourNoise | None:
    """What neighbours share."""
    seen = smooth_correlation(fitted)
    if seen is None:
        return None
    return NeighbourNoise(
        noise.shared_share, seen.share, seen.sigma, seen.angle, seen.factor, seen.sentence()
    )
