"""Compared epochs as people read them: verdict, findings, maps and tables of all comparisons."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from tribrach.answers import Form, Result
from tribrach.epochs.comparison import Comparison
from tribrach.job.epochs import ComparedEpochs
from tribrach.report.answer import Answer
from tribrach.report.epochs import (
    IN_LINE,
    EpochComparison,
    epochs_findings,
    epochs_pictures,
    epochs_tables,
    listed,
    moved_sentence,
)
from tribrach.report.findings import Finding
from tribrach.report.names import some_of
from tribrach.report.page import FrontPage
from tribrach.report.tables import ReportTable
from tribrach.sentences import joined


@dataclass(frozen=True)
class EpochComparisons(Result):
    """Epochs compared with the first of them, or each with the one before it."""

    comparisons: tuple[EpochComparison, ...]


FORM = Form("epochs", EpochComparisons, 1)


def answer_of(compared: Sequence[ComparedEpochs], angle: Literal["gon", "deg"] = "gon") -> Answer:
    """All comparisons as people read them."""
    findings: list[Finding] = []
    terminal: list[Finding | ReportTable] = []
    pictures, tables = [], []
    for k, one in enumerate(compared):
        first, second = one.comparison.difference.labels
        head = f"{first} to {second}: " if len(compared) > 1 else ""
        own, rows = epochs_findings(one, angle), epochs_tables(one, angle)
        findings += [replace(f, words=joined("", [head, f.words])) if head else f for f in own]
        terminal += [*rows, *own]
        pictures += [
            replace(p, name=f"{p.name}-{k}", title=f"{head}{p.title}") for p in epochs_pictures(one)
        ]
        tables += [replace(t, name=f"{t.name}-{k}") for t in rows]
    every = [one.comparison.difference.labels for one in compared]
    return Answer(
        "Comparison of epochs",
        f"{every[0][0]} to {listed([two for _, two in every])}",
        _front([one.comparison for one in compared]),
        EpochComparisons(tuple(EpochComparison.of(one, angle) for one in compared)),
        FORM,
        findings=findings,
        pictures=pictures,
        tables=tables,
        terminal=terminal,
    )


def _front(comparisons: Sequence[Comparison]) -> FrontPage:
    """What moved in any of the comparisons, and what one signs."""
    moved = list(dict.fromkeys(name for c in comparisons for name in c.moved))
    open_ = [c for c in comparisons if c.search is not None and not c.search.resolved]
    failed = [
        label
        for c in comparisons
        for label, test in zip(c.difference.labels, c.own, strict=True)
        if test.passed is False
    ]
    sort: Literal["good", "look", "bad", "none"] = "none"
    untold = any(d.answer == "cannot tell" for c in comparisons for d in c.displacements)
    if len(open_) == len(comparisons):
        sort, verdict = "bad", "What moved cannot be told"
    elif moved:
        verdict = f"{some_of(moved, IN_LINE)} moved"
    elif untold:
        verdict = "No displacement is sure"
    else:
        sort, verdict = "good", "No displacement found"
    if failed:
        sort = "bad"
        verdict += f"; {listed(list(dict.fromkeys(failed)))} by itself fails its global test"
    stable = comparisons[0].stable
    signed = (
        f"Displacements with their tests and with what would have been seen, in the datum of "
        f"{listed(stable)}."
        if len(comparisons) == 1
        else "Displacements with their tests and with what would have been seen, each in its datum."
    )
    if len(comparisons) == 1:
        # those that moved are in the verdict
        sentence = moved_sentence(comparisons[0], but_those_that_moved=bool(moved))
    else:
        sentence = " ".join(map(moved_sentence, comparisons))
    return FrontPage(sort, verdict, sentence, signed=signed)
