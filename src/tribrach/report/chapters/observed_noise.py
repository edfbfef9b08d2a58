"""The chapter on the noise of scans: what is stated for each scanner and what its scans show."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from tribrach.job.stated_noise import BAND, NeighbourNoise, StatedNoise, Verdict
from tribrach.report.chapter import Chapter
from tribrach.report.content import Head
from tribrach.report.numbers import count_cell, fixed_cell, mm_cell
from tribrach.report.schema.base import DocumentPart
from tribrach.report.subject import Subject
from tribrach.report.tables import Cell, ColumnHead, ReportTable, build_table, text_cell
from tribrach.report.warnings import ReportWarning, Severity, warned
from tribrach.units import span

if TYPE_CHECKING:
    from tribrach.job.results import JobResults
    from tribrach.scan.noise_law import By, NoiseClass

__all__ = ["SUBJECT", "InstrumentNoise", "NoiseLaw", "NoiseOfClass"]

_NOTE = (
    "Along the beam, on small planar patches of smooth surfaces; what the beam sweeps over a "
    "slanted surface is in both figures. Stated is what the points of clouds have: the noise of "
    "ranges over the cosine of the incidence only where [cloud] has incidence = true. Both "
    "figures are roots of mean squares, with the points weighted alike by the inverse of the "
    "variance that is stated for each; the factor is observed over stated. Its limits hold for "
    "all rows of an instrument together in 95 of 100 jobs, by chi-square with the degrees of "
    "freedom that the scatter from patch to patch leaves. A factor of "
    f"{BAND[0]:.2f} to {BAND[1]:.2f} is as stated, where its limits do not lie beyond that "
    "altogether; only limits that do contradict what is stated. Roughness that even these "
    "surfaces have counts as noise."
)


class NoiseOfClass(DocumentPart):
    """Noise along the beam of points of one class, stated and observed."""

    by: str
    """What the class is of: all, intensity, range or incidence."""
    low: float | None
    high: float | None
    """Its limits, in the unit of the file, metres or radians; none for all points."""
    patches: int
    points: int
    observed: float
    stated: float
    """Standard deviations along the beam [m], in the same weights: the inverse of the variance
    that is stated for a point."""
    chi2_dof: float
    """Squared residuals over stated variances, by their degrees of freedom."""
    effective: float
    """Degrees of freedom that this is worth by the scatter from patch to patch."""
    factor: float
    """Observed over stated."""
    factor_low: float | None
    factor_high: float | None
    """Its limits at 95 % for all classes together; none where there are too few patches."""
    verdict: Verdict


class NoiseLaw(DocumentPart):
    """A law ``a I^b + c`` of the noise of ranges [m] for intensities I from low to high."""

    a: float
    b: float
    c: float
    low: float
    high: float


class NoiseOfNeighbours(DocumentPart):
    """What neighbouring points share of the variance of their ranges."""

    stated: float | None
    """Share that is stated, none if nobody says: means then take all of it where beams overlap."""
    share: float
    sigma: float
    """Share that the scans show, zero if none, and its standard deviation."""
    angle: float
    """Over which they share it [rad], zero if none is shown."""
    factor: float
    """Points that count as one in a wide mean at the pitch of the scans."""


class InstrumentNoise(DocumentPart):
    """Noise stated for an instrument and observed on its scans."""

    instrument: str
    scans: tuple[str, ...]
    by_law: bool
    """Is the noise of ranges stated as a law of the intensity?"""
    patches: int
    smooth: int
    """Planar patches, and those of smooth surfaces that the figures are of."""
    classes: tuple[NoiseOfClass, ...]
    law: NoiseLaw | None
    """The law that these scans show, if they show one."""
    neighbours: NoiseOfNeighbours | None
    """None with too few patches."""
    remark: str


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter, where scans of known instruments are placed."""
    placed = job.placed
    if placed is None or not placed.noise:
        return
    sentences = [words for found in placed.noise for words in _sentences(found)]
    yield Chapter(
        "observed_noise",
        "Noise of the scans, stated and observed",
        tuple(sentences),
        tables=(_table(placed.noise),),
        data=[_part(found) for found in placed.noise],
        warnings=tuple(w for found in placed.noise for w in _warnings(found)),
    )


def _sentences(found: StatedNoise) -> list[str]:
    """What the scans of an instrument say, each in a sentence."""
    if found.whole is None:
        return [f"Noise of the {found.instrument}: {found.why or 'its scans show no planes'}."]
    verdict, basis = found.verdict(found.whole), _basis(found)
    said = {
        "as stated": f"it is as {basis} states it",
        "more than stated": f"{basis} states too little noise",
        "less than stated": f"{basis} states too much noise",
        "undecided": f"that is too little to say that {basis} is wrong",
    }[verdict]
    out = [
        f"Noise of the {found.instrument} along the beam, on {found.smooth} smooth planar patches "
        f"of {_counted(found.scans)}: {_figures(found, found.whole)}: {said}."
    ]
    worst = found.farthest
    if worst is not None:
        by, one = worst
        out.append(f"{_departs(found, by, one)}.")
    if (better := _with_incidence(found)) is not None:
        out.append(f"{better}.")
    if found.law is not None and not found.lawful and (verdict != "as stated" or worst):
        out.append(
            f"What these scans show of {found.instrument} is a law of intensity: "
            f"{found.law.words}; tribrach noise writes it as an instrument file."
        )
    if found.neighbours is not None:
        out.append(_neighbours(found.instrument, found.neighbours))
    return out


def _neighbours(instrument: str, seen: NeighbourNoise) -> str:
    """What neighbours share in the scans of an instrument, and what is stated of it."""
    stated = (
        "The project does not state what they share: a mean counts points whose beams overlap as "
        "one."
        if seen.stated is None
        else f"The project states that they share {seen.stated:.2f} of the variance."
    )
    return f"Neighbouring points in scans of the {instrument}: {seen.words}. {stated}"


def _warnings(found: StatedNoise) -> Iterable[ReportWarning]:
    """A contradiction belongs on top: sigmas of points are too small or too large."""
    if found.whole is None:
        return
    verdict = found.verdict(found.whole)
    if verdict == "more than stated":
        text = (
            f"{_basis(found)} states too little noise of single points, so that sigmas of clouds "
            "are too small: "
        )
        cure = _with_incidence(found) or (
            "tribrach noise writes what the scans show as an instrument file"
        )
        figures = _figures(found, found.whole)
        yield from warned(Severity.WEAK, [f"{text}{figures}; {cure}"])
    elif verdict == "less than stated":
        text = (
            f"{_basis(found)} states too much noise of single points, so that sigmas of clouds "
            "are too large: "
        )
        yield from warned(Severity.NOTE, [text + _figures(found, found.whole)])
    elif found.farthest is not None:
        yield from warned(Severity.NOTE, [_departs(found, *found.farthest)])


def _with_incidence(found: StatedNoise) -> str | None:
    """What the incidence would explain of noise beyond what is stated, without the stop."""
    whole, slanted = found.whole, found.slanted
    if whole is None or slanted is None or found.verdict(whole) != "more than stated":
        return None
    if found.verdict(slanted) != "as stated":
        return None
    return (
        "with incidence = true in [cloud] the noise of ranges grows with the incidence, and "
        f"{_figures(found, slanted)}"
    )


def _departs(found: StatedNoise, by: By, one: NoiseClass) -> str:
    """Where the scans contradict most, without the stop."""
    more = "more" if one.factor > 1 else "less"
    return (
        f"The noise of {found.instrument} departs most from what is stated {_where(by, one)}, "
        f"where it is {more}: "
        f"{_figures(found, one)}"
    )


def _basis(found: StatedNoise) -> str:
    """What states the noise of an instrument."""
    return f"the law of {found.instrument}" if found.lawful else found.basis


def _figures(found: StatedNoise, one: NoiseClass) -> str:
    """Observed, stated, factor and its limits."""
    ends = found.interval(one)
    limits = "" if ends is None else f", {ends[0]:.2f} to {ends[1]:.2f} at 95 %"
    return (
        f"{1e3 * one.weighted_observed:.2f} mm observed, {1e3 * one.weighted:.2f} mm stated "
        f"(factor {one.factor:.2f}{limits})"
    )


def _where(by: By, one: NoiseClass) -> str:
    """A class within a sentence."""
    return {
        "intensity": f"at intensities {_limits(by, one)}",
        "range": f"at ranges of {_limits(by, one)}",
        "incidence": f"at incidence angles of {_limits(by, one)}",
    }[by]


def _limits(by: By, one: NoiseClass) -> str:
    """The limits of a class with their unit."""
    if by == "incidence":
        return f"{np.degrees(one.low):.0f} to {np.degrees(one.high):.0f}°"
    if by == "range":
        return f"{one.low:.1f} to {one.high:.1f} m"
    return span(one.low, one.high)


def _counted(scans: Sequence[str]) -> str:
    """The scans, by name if they are few."""
    return ", ".join(scans) if len(scans) <= 4 else f"{len(scans)} scans"


def _part(found: StatedNoise) -> InstrumentNoise:
    """Numbers for the JSON result."""
    return InstrumentNoise(
        instrument=found.instrument,
        scans=found.scans,
        by_law=found.lawful,
        patches=found.patches,
        smooth=found.smooth,
        classes=tuple(_classes(found)),
        law=None if found.law is None else NoiseLaw.model_validate(found.law),
        neighbours=None
        if found.neighbours is None
        else NoiseOfNeighbours.model_validate(found.neighbours),
        remark=found.why,
    )


def _classes(found: StatedNoise) -> Iterable[NoiseOfClass]:
    """All rows of an instrument, the whole first."""
    rows: list[tuple[str, NoiseClass]] = []
    if found.whole is not None:
        rows.append(("all", found.whole))
    rows += [(by, one) for by, some in found.classes.items() for one in some]
    for by, one in rows:
        ends = found.interval(one)
        yield NoiseOfClass(
            by=by,
            low=None if by == "all" else one.low,
            high=None if by == "all" else one.high,
            patches=one.patches,
            points=one.points,
            observed=one.weighted_observed,
            stated=one.weighted,
            chi2_dof=one.chi2_dof,
            effective=one.effective,
            factor=one.factor,
            factor_low=None if ends is None else ends[0],
            factor_high=None if ends is None else ends[1],
            verdict=found.verdict(one),
        )


def _table(noises: Sequence[StatedNoise]) -> ReportTable:
    """One row for each class of each instrument."""
    rows: list[tuple[StatedNoise, str, NoiseClass]] = []
    for found in noises:
        if found.whole is not None:
            rows.append((found, "all points", found.whole))
        for by, some in found.classes.items():
            rows += [(found, f"{by} {_limits(by, one)}", one) for one in some]
    columns = [
        (ColumnHead("Instrument", numeric=False), lambda r: text_cell(r[0].instrument)),
        (ColumnHead("Points", numeric=False), lambda r: text_cell(r[1])),
        (ColumnHead("patches"), lambda r: count_cell(r[2].patches)),
        (ColumnHead("observed", "mm"), lambda r: mm_cell(r[2].weighted_observed)),
        (ColumnHead("stated", "mm"), lambda r: mm_cell(r[2].weighted)),
        (ColumnHead("factor"), lambda r: fixed_cell(r[2].factor, 2)),
        (ColumnHead("from"), lambda r: _end(r, 0)),
        (ColumnHead("to"), lambda r: _end(r, 1)),
        (ColumnHead("Verdict", numeric=False), lambda r: text_cell(r[0].verdict(r[2]))),
    ]
    return build_table("observed-noise", "Noise stated and observed", _NOTE, rows, columns)


def _end(row: tuple[StatedNoise, str, NoiseClass], k: int) -> Cell:
    """A limit of the factor, empty where there is none."""
    ends = row[0].interval(row[2])
    return text_cell("") if ends is None else fixed_cell(ends[k], 2)


SUBJECT = Subject("observed_noise", _chapters, list[InstrumentNoise])
