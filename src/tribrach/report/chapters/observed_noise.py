"""The chapter on the noise of scans: what is stated for each scanner and what its scans show."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from tribrach.job.stated_noise import BAND, NeighbourNoise, NoiseOfClass, StatedNoise
from tribrach.report.chapter import Chapter
from tribrach.report.columns import column
from tribrach.report.content import Head
from tribrach.report.subject import Subject
from tribrach.report.tables import ReportTable, build_table
from tribrach.report.warnings import ReportWarning, Severity, warned
from tribrach.sentences import Sentence
from tribrach.units import span

if TYPE_CHECKING:
    from tribrach.job.results import JobResults
    from tribrach.scan.noise_law import By, ContradictedClass, NoiseClass

_NOTE = Sentence(
    "Along the beam, on small planar patches of smooth surfaces; what the beam sweeps over a "
    "slanted surface is in both figures. Stated is the noise in the sigmas of clouds: over the "
    "cosine of the incidence only with incidence = true in [cloud]. Both are RMS values with the "
    "same weights, the inverse stated variances; the factor is observed over stated. Its limits "
    "hold for all rows of an instrument together in 95 of 100 jobs, by chi-square with the "
    "degrees of freedom that the scatter from patch to patch leaves. A factor of {band[0]:2} to "
    "{band[1]:2} agrees with what is stated; only limits that both lie beyond contradict it. "
    "Roughness of these surfaces counts as noise.",
    band=BAND,
)


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
        data=list(placed.noise),
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
        "in part": f"it is as {basis} states it there, and not everywhere",
        "undecided": f"that is too little to say that {basis} is wrong",
    }[verdict]
    out: list[str] = [
        Sentence(
            "Noise of the {found.instrument} along the beam, on {found.smooth} smooth "
            "planar patches of {counted}: {figures}: {said}.",
            found=found,
            counted=_counted(found.scans),
            figures=_figures(found, found.whole),
            said=said,
        )
    ]
    if found.beyond:
        out.append(Sentence("{beyond}.", beyond=_beyond(found)))
    worst = found.farthest
    if worst is not None:
        by, one = worst
        out.append(Sentence("{departs}.", departs=_departs(found, by, one)))
    if (better := _with_incidence(found)) is not None:
        out.append(f"{better}.")
    if found.law is not None and not found.lawful and (verdict != "as stated" or worst):
        out.append(
            Sentence(
                "What these scans show of {found.instrument} is a law of intensity: "
                "{found.law.words}; tribrach noise writes it as an instrument file.",
                found=found,
            )
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
        else Sentence(
            "The project states that they share {seen.stated:2} of the variance.", seen=seen
        )
    )
    return Sentence(
        "Neighbouring points in scans of the {instrument}: {seen.words}. {stated}",
        instrument=instrument,
        seen=seen,
        stated=stated,
    )


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
        yield from warned(
            Severity.DOUBT,
            [Sentence("{text}{figures}; {cure}", text=text, figures=figures, cure=cure)],
            "more_noise",
        )
    elif verdict == "less than stated":
        text = (
            f"{_basis(found)} states too much noise of single points, so that sigmas of clouds "
            "are too large: "
        )
        yield from warned(Severity.NOTE, [text + _figures(found, found.whole)], "less_noise")
    elif found.beyond:
        yield from warned(Severity.DOUBT, [_beyond(found)], "noise_beyond")
    elif found.farthest is not None:
        yield from warned(Severity.NOTE, [_departs(found, *found.farthest)], "noise_departs")


def _beyond(found: StatedNoise) -> str:
    """Where even the smoothest patches contradict what is stated, without the stop."""
    one = found.beyond[0]
    return Sentence(
        "{basis} states too little for points {where}: even the smoothest tenth of their "
        "{one.patches} patches has {one.factor:2} times the sigma ({one.factor_low:2} to "
        "{one.factor_high:2}). All surfaces there are rough, or sigmas of clouds are too small "
        "there. Over every patch of the scans the factor is {every:2}",
        basis=_basis(found),
        where=_where(one.by, one),
        one=one,
        every=found.every,
    )


def _with_incidence(found: StatedNoise) -> str | None:
    """What the incidence would explain of noise beyond what is stated, without the stop."""
    whole, slanted = found.whole, found.slanted
    if whole is None or slanted is None or found.verdict(whole) != "more than stated":
        return None
    if found.verdict(slanted) != "as stated":
        return None
    return Sentence(
        "with incidence = true in [cloud] the noise of ranges grows with the "
        "incidence, and {figures}",
        figures=_figures(found, slanted),
    )


def _departs(found: StatedNoise, by: By, one: NoiseClass) -> str:
    """Where the scans contradict most, without the stop."""
    more = "more" if one.factor > 1 else "less"
    return Sentence(
        "The noise of {found.instrument} departs most from what is stated {where}, "
        "where it is {more}: {figures}",
        found=found,
        where=_where(by, one),
        more=more,
        figures=_figures(found, one),
    )


def _basis(found: StatedNoise) -> str:
    """What states the noise of an instrument."""
    return f"the law of {found.instrument}" if found.lawful else found.basis


def _figures(found: StatedNoise, one: NoiseClass) -> str:
    """Observed, stated, factor and its limits."""
    ends = found.interval(one)
    limits = "" if ends is None else Sentence(", {ends[0]:2} to {ends[1]:2} at 95 %", ends=ends)
    return Sentence(
        "{one.weighted_observed:mm2} observed, {one.weighted:mm2} stated (factor "
        "{one.factor:2}{limits})",
        one=one,
        limits=limits,
    )


def _where(by: By, one: NoiseClass | ContradictedClass) -> str:
    """A class within a sentence."""
    return {
        "intensity": Sentence("at intensities {limits}", limits=_limits(by, one.low, one.high)),
        "range": Sentence("at ranges of {limits}", limits=_limits(by, one.low, one.high)),
        "incidence": Sentence(
            "at incidence angles of {limits}", limits=_limits(by, one.low, one.high)
        ),
    }[by]


def _limits(by: By, low: float, high: float) -> str:
    """The limits of a class with their unit."""
    if by == "incidence":
        return Sentence("{low:°0~} to {high:°0}", low=low, high=high)
    if by == "range":
        return Sentence("{low:m1~} to {high:m1}", low=low, high=high)
    return span(low, high)


def _counted(scans: Sequence[str]) -> str:
    """The scans, by name if they are few."""
    return ", ".join(scans) if len(scans) <= 4 else f"{len(scans)} scans"


def _table(noises: Sequence[StatedNoise]) -> ReportTable:
    """One row for each class of each instrument."""
    rows = [(found.instrument, row) for found in noises for row in found.rows]
    columns = [
        column("Instrument", lambda r: r[0]),
        column("Points", lambda r: _points(r[1])),
        column("patches", lambda r: r[1].patches, "0"),
        column("observed", lambda r: r[1].observed, "mm2"),
        column("stated", lambda r: r[1].stated, "mm2"),
        column("factor", lambda r: r[1].factor, "2"),
        column("from", lambda r: r[1].factor_low, "2"),
        column("to", lambda r: r[1].factor_high, "2"),
        column("Verdict", lambda r: r[1].verdict),
    ]
    return build_table("observed-noise", "Noise stated and observed", _NOTE, rows, columns)


def _points(row: NoiseOfClass) -> str:
    """A class as the table has it."""
    if row.by == "all" or row.low is None or row.high is None:
        return "all points"
    return Sentence("{row.by} {limits}", row=row, limits=_limits(row.by, row.low, row.high))


SUBJECT = Subject("observed_noise", _chapters, list[StatedNoise])
