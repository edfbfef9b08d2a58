"""The noise of a scanner from its own scans: patches of all of them, laws, and how far these go."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tribrach._types import Progress
from tribrach.errors import InputError
from tribrach.instruments.beam import Beam
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.scan.neighbour_correlation import NeighbourCorrelation, smooth_correlation
from tribrach.scan.noise_law import By, FittedNoise, NoiseClass, fit_noise, noise_classes
from tribrach.scan.observed_noise import GATES, ObservedNoise, joined, observed_noise
from tribrach.scan.scan import Scan
from tribrach.units import MM, SEC

__all__ = ["NoiseEstimate", "NoiseOfWidth", "ScanPatches", "estimate_noise"]

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
#: a beam where none is stated [m]
_WIDE = 0.010
#: variance factor of the patches from which on surfaces and not a scanner scatter
_SURFACES = 2.0
#: the noise of angles and the place are known where they are so many times their sigmas
_KNOWN = 2.0
#: the least sigma that an instrument file states [m]
_LEAST = 1e-5


@dataclass(frozen=True)
class ScanPatches:
    """What one scan gave.

    Attributes
    ----------
    source
        File and scan.
    patches, points
        Planar patches and points on them.
    windows, curved, uneven
        Windows that were filled, and those of them that were curved or had points far off.
    gridded
        True if the scan has its grid of rows and columns.
    step
        Step of its coordinates [m], 0 if they are fine.
    unit
        What its intensities are, in words.
    remark
        Why it gave nothing, "" if it gave something.
    """

    source: str
    patches: int
    points: int
    windows: int
    curved: int
    uneven: int
    gridded: bool
    step: float
    unit: str
    remark: str = ""


@dataclass(frozen=True)
class NoiseOfWidth:
    """Sigmas of patches of another width.

    Attributes
    ----------
    width
        That patches grow to [m].
    patches
        Number of the smooth ones.
    factor
        What their laws give for the points of the usual patches, over what those give.
    """

    width: float
    patches: int
    factor: float


@dataclass(frozen=True, eq=False)
class NoiseEstimate:
    """The noise of a scanner by its scans.

    Attributes
    ----------
    scans
        What each of them gave.
    fitted
        The laws.
    shared
        What neighbouring points share of the noise; None with too few patches.
    stated, stated_by
        Noise that a data sheet or a project states, and which; None and "" without.
    widths
        Sigmas of narrower and wider patches, where there are such.
    """

    scans: tuple[ScanPatches, ...]
    fitted: FittedNoise
    shared: NeighbourCorrelation | None
    stated: ScanNoise | None
    stated_by: str
    widths: tuple[NoiseOfWidth, ...]

    @property
    def beam(self) -> Beam | None:
        """The beam that is stated, None if none is."""
        stated = self.stated
        return stated.beam if stated and (stated.beam_exit or stated.beam_divergence) else None

    @property
    def noise(self) -> ScanNoise:
        """Noise of single points, with the footprint that is stated."""
        return self.fitted.noise(self.beam)

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
        out = []
        spread = self.fitted.spread
        if spread > _SURFACES:
            out.append(
                f"the variances of the patches scatter {spread:.1f} times as widely about the law "
                f"as noise would make them (limit {_SURFACES:g})"
            )
        for one in self.widths:
            words = (
                f"patches of {1e3 * one.width:.0f} mm give {one.factor:.2f} times the sigma of "
                f"those of {1e3 * GATES.width:.0f} mm"
            )
            wider = one.width > GATES.width
            if one.factor > _BENT and wider:
                out.append(f"{words} (limit {_BENT:g}): surfaces bend, or points share errors")
            elif one.factor < _SHARED and not wider:
                out.append(f"{words} (limit {_SHARED:g}): surfaces bend, or points share errors")
        return out

    @property
    def filtered(self) -> tuple[float, float] | None:
        """Angle [rad] that neighbours share errors over where no beam is so wide, over its width.

        None where they share little or no more than overlapping beams do. Without a beam that is
        stated its width is taken for 10 mm at the typical range, more than survey scanners have.
        """
        shared = self.shared
        if shared is None or not shared.told or shared.share < _FILTER:
            return None
        at = self.fitted.typical_range
        beam = _WIDE if self.beam is None else float(self.beam.diameter(np.array([at]))[0])
        times = shared.angle * at / beam
        return (shared.angle, times) if times > _BEAMS else None

    @property
    def angles_known(self) -> bool:
        """True if slanted surfaces told the noise of both angles."""
        fitted = self.fitted
        angles = np.array([fitted.horizontal, fitted.vertical])
        return bool((angles > _KNOWN * fitted.angle_sigmas).any())

    def figures(self) -> dict[str, float]:
        """Keys and values of an instrument file, in the units of their names.

        The footprint is that of the sheet; where none is stated the size seen takes its place, and
        there is no divergence, which the angles hold.
        """
        noise, fitted = self.noise, self.fitted
        out = {
            "range_mm": max(noise.range, _LEAST) / MM,
            "range_ppm": 1e6 * noise.range_scale,
        }
        if noise.law is not None:
            out |= {
                "range_law_a_mm": noise.law.a / MM,
                "range_law_b": noise.law.b,
                "range_law_c_mm": noise.law.c / MM,
                "range_law_from": noise.law.low,
                "range_law_to": noise.law.high,
            }
        if self.shared is not None and self.shared.told:
            out |= self.shared.keys
        angle = float(np.hypot(noise.horizontal, noise.vertical) / np.sqrt(2))
        if self.angles_known and angle > 0:
            out["scan_angle_arcsec"] = angle / SEC
            if self.beam is None:
                known = fitted.place > _KNOWN * fitted.place_sigma
                out["beam_exit_mm"] = noise.beam_exit / MM if known else 0.0
                out["beam_divergence_mrad"] = 0.0
        return out

    def classes(self, by: By, *, stated: bool = False) -> list[NoiseClass]:
        """Observed noise of the smooth patches by class, beside the laws or what is stated.

        Parameters
        ----------
        by
            What classes are made by.
        stated
            Compare with what is stated instead of with the laws found.
        """
        smooth = self.fitted.smooth
        if stated:
            assert self.stated is not None
            return noise_classes(smooth, smooth.stated(self.stated), by)
        return noise_classes(smooth, smooth.stated(self.fitted.noise()), by)


def estimate_noise(
    scans: Sequence[Scan],
    stated: ScanNoise | None = None,
    stated_by: str = "",
    progress: Progress | None = None,
) -> NoiseEstimate:
    """Estimate the noise of a scanner from its scans.

    Parameters
    ----------
    scans
        Of one scanner in one mode.
    stated, stated_by
        Noise to compare with, and what states it.
    progress
        Told of scans that are looked at.

    Returns
    -------
    NoiseEstimate
        Laws and what they rest on.

    Raises
    ------
    InputError
        Scans that cannot be read, or show fewer than thirty planar patches together.
    """
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
        remarks = [f"{one.source}: {one.remark}" for one in told if one.remark]
        raise InputError("; ".join([error.what, *remarks[:3]]), cure=error.cure) from error
    widths = [_of_width(scans, fitted, records // 3, factor) for factor in _WIDTHS]
    return NoiseEstimate(
        tuple(told),
        fitted,
        smooth_correlation(fitted),
        stated,
        stated_by,
        tuple(one for one in widths if one is not None),
    )


def _told(scan: Scan, found: ObservedNoise) -> ScanPatches:
    """What one scan gave, and why not more."""
    remark = ""
    if scan.origin == "unknown":
        remark = "it is not known where the scanner stood"
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
    return f"a scale that the file says to go from {light.low:g} to {light.high:g}"


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
