"""The chapter on lever arms: what the job estimated, how well, and what that rests on."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tribrach.job.antenna_lever_arms import EstimatedLeverArm
from tribrach.report.chapter import Chapter
from tribrach.report.columns import component
from tribrach.report.content import Head
from tribrach.report.subject import Subject
from tribrach.report.tables import build_table
from tribrach.report.warnings import ReportWarning, Severity, warned
from tribrach.sentences import Sentence, joined

if TYPE_CHECKING:
    from tribrach.job.results import JobResults

_NAME = "lever_arm_calibration"

#: targets that leave a wider part of the horizon free than this are not all around [rad]
_GAP = np.radians(180.0)
#: a component is not zero from here on (99 %)
_SIGNIFICANT = 2.58


@dataclass(frozen=True)
class _Row:
    name: str
    how: str
    values: tuple[float, ...]
    sigmas: tuple[float, ...]


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter, where stations carry antennas or prisms on lever arms that were estimated."""
    if job.antennas is None:
        return
    warnings = warned(Severity.BLUNDER, job.antennas.heights, "antenna_height")
    if job.antennas.lever_arms:
        yield _chapter(job.antennas.lever_arms, head, warnings)
    elif warnings:
        yield Chapter(_NAME, "Lever arms", warnings=warnings)


def _chapter(
    arms: Sequence[EstimatedLeverArm], head: Head, warnings: tuple[ReportWarning, ...]
) -> Chapter:
    """What the job says of its lever arms, of which there is at least one."""
    rows = []
    for arm in arms:
        how = "as adjusted" if arm.free is None else "with levelling, as adjusted"
        rows.append(_Row(arm.name, how, tuple(arm.vector), tuple(arm.sigma)))
        if arm.free is not None:
            vector, covariance = arm.free.vector, arm.free.covariance
            sigma = np.sqrt(np.diag(covariance))
            rows.append(_Row(arm.name, "without levelling", tuple(vector), tuple(sigma)))
    columns = head.columns
    specs = [columns.word("Lever arm", "name"), columns.word("Solution", "how")]
    for k, axis in enumerate("xyz"):
        specs.append(columns.mm(axis, component("values", k)))
        specs.append(columns.mm(f"σ {axis}", component("sigmas", k)))
    note = Sentence(
        "From the origin of the scanner to the antenna or prism, in the scanner frame. "
        "{head.sigma_origin}",
        head=head,
    )
    sentences = [sentence for arm in arms for sentence in _sentences(arm)]
    return Chapter(
        _NAME,
        "Lever arms",
        tuple(sentences),
        (),
        (build_table("lever-arms", "Lever arms", note, rows, specs),),
        {arm.name: arm for arm in arms},
        warnings,
    )


def _sentences(arm: EstimatedLeverArm) -> list[str]:
    """What a surveyor should know of a lever arm."""
    size = joined(
        ", ",
        (
            Sentence("{axis} {v:mm1} (held)", axis=axis, v=v)
            if s == 0
            else Sentence("{axis} {v:mm1~} ± {s:mm1}", axis=axis, v=v, s=s)
            for axis, v, s in zip("xyz", arm.vector, arm.sigma, strict=True)
        ),
    )
    carriers = f"{len(arm.stations)} station{'s' if len(arm.stations) > 1 else ''}"
    out: list[str] = [
        Sentence(
            "Lever arm {arm.name}, carried by {carriers}: {size}.",
            arm=arm,
            carriers=carriers,
            size=size,
        )
    ]
    odd = [
        axis
        for axis, v, s in zip("xy", arm.vector, arm.sigma, strict=False)
        if s > 0 and abs(v) > _SIGNIFICANT * s
    ]
    if odd:
        out.append(
            f"Lever arm {arm.name} is not zero in {' and '.join(odd)}: the antenna does not stand "
            "over the scanner's axis."
        )
    if arm.gap is not None and arm.gap > _GAP:
        out.append(
            Sentence(
                "The targets that determine lever arm {arm.name} leave {gap:degrees0} of "
                "the horizon free: the scanner's place is extrapolated from them; with targets "
                "all around z and the component across the view become two to three times "
                "better.",
                arm=arm,
                gap=arm.gap,
            )
        )
    if arm.free is not None:
        vector, covariance = arm.free.vector, arm.free.covariance
        change, sigma = vector - arm.vector, np.sqrt(np.diag(covariance))
        worst = int(np.argmax(np.abs(change)))
        out.append(
            Sentence(
                "Without levelling lever arm {arm.name} changes by {change:mm+1} in {xyz} "
                "(sigma there {sigma:mm1}).",
                arm=arm,
                change=change[worst],
                xyz="xyz"[worst],
                sigma=sigma[worst],
            )
        )
    return out


SUBJECT = Subject(_NAME, _chapters, dict[str, EstimatedLeverArm])
