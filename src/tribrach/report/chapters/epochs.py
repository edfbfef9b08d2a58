"""The chapters on what moved since earlier epochs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

from tribrach.report.chapter import Chapter
from tribrach.report.characters import anchor
from tribrach.report.content import Head
from tribrach.report.epochs import (
    EpochComparison,
    epochs_findings,
    epochs_pictures,
    epochs_tables,
)
from tribrach.report.findings import words
from tribrach.report.subject import Subject

if TYPE_CHECKING:
    from tribrach.job.epochs import ComparedEpochs
    from tribrach.job.results import JobResults

_KEY = "epochs"


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """One chapter for each earlier epoch."""
    return [_chapter(one, k, head) for k, one in enumerate(job.epochs)]


def _chapter(one: ComparedEpochs, number: int, head: Head) -> Chapter:
    angle = head.settings.angle
    first, second = one.comparison.difference.labels
    slug = anchor(f"{first}-{number}")
    return Chapter(
        f"epochs-{slug}",
        f"What moved: {first} to {second}",
        tuple(words(epochs_findings(one, angle))),
        tuple(replace(p, name=f"{p.name}-{slug}") for p in epochs_pictures(one)),
        tuple(replace(t, name=f"{t.name}-{slug}") for t in epochs_tables(one, angle)),
        EpochComparison.of(one, angle),
        key=_KEY,
    )


SUBJECT = Subject(_KEY, _chapters, list[EpochComparison], several=True)
