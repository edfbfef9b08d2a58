"""A comparison of two clouds as people read it; what a run shows of one too is the report's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from tribrach.answers import Form
from tribrach.comparison.compared import CloudComparison
from tribrach.io.outputs import Content
from tribrach.questions.compare.motion_pictures import motions_pictures
from tribrach.questions.compare.moved import (
    ToldMotions,
    motions_findings,
    motions_front,
    motions_tables,
)
from tribrach.report.answer import Answer
from tribrach.report.comparison import (
    PREDICTED,
    comparison_findings,
    comparison_pictures,
    comparison_tables,
    offsets_finding,
)
from tribrach.report.findings import Finding
from tribrach.report.page import FrontPage
from tribrach.sentences import Sentence


@dataclass(frozen=True)
class ComparedClouds(CloudComparison):
    """A comparison of two clouds, a against the reference b."""

    #: what moved, where it was asked for
    motions: ToldMotions | None = None


FORM = Form("compare", ComparedClouds, 1)


def answer_of(
    names: tuple[str, str],
    found: ComparedClouds,
    beams: Sequence[str] = (),
    files: Mapping[Path, Content] | None = None,
) -> Answer:
    """The comparison as people read it."""
    a, b = names
    motions, moved = found.motions, found.motions is not None
    notes = comparison_findings(found, moved=moved)
    tables, pictures = comparison_tables(found, moved=moved), comparison_pictures(found)
    front = _front(found) if motions is None else motions_front(motions)
    said = [] if motions is None else motions_findings(motions)
    first = [] if motions is None else motions_tables(motions)
    if motions is not None:
        pictures = [one for one in pictures if one.name != PREDICTED]
        pictures = [*motions_pictures(motions), *pictures]
    quiet = Finding("Every site has enough points, and its figures are above sampling.", key="all")
    warned = [Finding(text, True, "beam") for text in beams]
    return Answer(
        "Comparison of clouds",
        f"{a} against {b}",
        front,
        found,
        FORM,
        findings=[*said, *notes] or [quiet],
        first=first,
        pictures=pictures,
        tables=tables,
        footer=Sentence(
            "A: {a}; B, the reference: {b}; limit {found.limit:mmg}. Nearest-neighbour "
            "distances are no accuracy: read them beside their floor.",
            a=a,
            b=b,
            found=found,
        ),
        # the question that was asked comes first
        terminal=[*said, *first, *tables, *warned, *(replace(one, warns=True) for one in notes)],
        files=files or {},
    )


def _front(found: CloudComparison) -> FrontPage:
    """Whether the clouds differ by what was predicted."""
    known = [s.prediction for s in found.sites if s.prediction is not None]
    enough, offsets = [p for p in known if p.enough], found.offsets
    signed = "The distances between these two clouds, with the sigmas stated here."
    if not known:
        sentence = "The stations are not known with their covariance: nothing was predicted."
        return FrontPage("none", "Measured, not judged", sentence, signed=signed)
    sort: Literal["good", "bad", "none"]
    if offsets is not None and offsets.statistic > offsets.limit:
        sort, verdict = "bad", "Farther apart than predicted"
    elif not all(p.noise_agrees for p in enough):
        sort, verdict = "bad", "Scatter not as predicted"
    elif offsets is not None and not offsets.agrees:
        sort, verdict = "none", "Nearer than predicted"
    elif enough:
        sort, verdict = "good", "As predicted"
    else:
        sort, verdict = "none", "Too few points to judge the scatter"
    sentence = "" if offsets is None else offsets_finding(offsets).words
    return FrontPage(sort, verdict, sentence, signed=signed)
