"""The chapter on the adjustment: kinds, weights, snooping; warnings about its quality."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from tribrach.job.results import JobResults
from tribrach.network.quality import Quality
from tribrach.network.reactions import constraint_reactions
from tribrach.observations.registry import kind_named
from tribrach.report.chapter import Chapter
from tribrach.report.content import Control, Head, KindCount, Observation
from tribrach.report.subject import Subject
from tribrach.report.tables import (
    ColumnHead,
    ReportTable,
    Spec,
    build_table,
    number_cell,
    text_cell,
)
from tribrach.report.warnings import ReportWarning, Severity, warned

__all__ = ["SUBJECT", "adjustment_warnings"]

#: redundancy numbers below this are worth a sentence
POOR = 0.1


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter; every report has it."""
    tables = (_kinds(head), _components(head), _snooping(head))
    yield Chapter("adjustment", "Adjustment", tables=tables)


def _kinds(head: Head) -> ReportTable:
    """What was observed, how often, and whether each group deserves its sigmas."""
    note = (
        "Counts are observed values. The ratio of sigma0 a posteriori to a priori is that of "
        "the group alone: 1 says its sigmas are right, 2 that they are half of what they "
        "should be."
    )
    columns: list[Spec] = [
        (ColumnHead("Kind", numeric=False), lambda k: text_cell(kind_named(k.kind).facts.title)),
        (ColumnHead("Group", numeric=False), lambda k: text_cell(_group(k))),
        *(head.columns.plain(state, state, 0) for state in ("active", "check", "off")),
        head.columns.plain("redundancy", "redundancy"),
        head.columns.plain("ratio of sigma0", "sigma0", 3),
    ]
    return build_table(
        "kinds",
        "Observations by kind",
        note,
        head.summary.kinds,
        columns,
    )


def _group(k: KindCount) -> str:
    return "" if k.group == k.kind else k.group


def _components(head: Head) -> ReportTable:
    """Variance components."""
    columns: list[Spec] = [
        head.columns.word("Group", "group"),
        head.columns.plain("factor on sigma", "factor", 3),
        head.columns.plain("σ of the factor", "sigma", 3),
        head.columns.plain("redundancy", "redundancy"),
        head.columns.word("Note", "note"),
    ]
    note = "Factors by which the given sigmas were multiplied before this adjustment."
    return build_table(
        "components",
        "Variance components",
        note,
        head.components,
        columns,
    )


def _snooping(head: Head) -> ReportTable:
    """What iterative snooping did."""
    style = head.columns.style
    columns: list[Spec] = [
        head.columns.plain("Step", "number", 0),
        head.columns.word("Observation", "observation"),
        head.columns.plain("test", "test"),
        head.columns.plain("limit", "limit"),
        (
            ColumnHead("estimated error"),
            lambda s: number_cell(
                s.error,
                f"{style.small(s.error, s.unit)} {style.small_unit(s.unit)}",
            ),
        ),
        head.columns.word("Action", "action"),
    ]
    note = "One suspect at a time; what was switched off stays in the list of observations."
    return build_table("snooping", "Snooping", note, head.snooping, columns)


def adjustment_warnings(head: Head) -> tuple[ReportWarning, ...]:
    """What the reader should know of the adjustment before any number."""
    quality = head.quality
    test = quality.global_test
    graver = Severity.WEAK if test.passed is None else Severity.BLUNDER
    return (
        *warned(Severity.INPUT, head.adjustment.warnings),
        *warned(graver, [] if test.passed else [test.sentence()]),
        *warned(Severity.BLUNDER, _suspects(head.observations, quality)),
        *warned(Severity.BLUNDER, constraint_reactions(head.adjustment).sentences()),
        *warned(Severity.BLUNDER, _checks(head.control)),
        *warned(Severity.WEAK, _uncontrolled(quality)),
        *warned(Severity.NOTE, _off(head.observations)),
    )


def _words(o: Observation) -> str:
    """An observation in words."""
    arrow = f"{o.start} -> {o.end}" if o.end else o.start
    return f"{o.kind.replace('_', ' ')} {arrow}" + (f" ({o.source})" if o.source else "")


def _suspects(observations: Sequence[Observation], quality: Quality) -> list[str]:
    """The suspicious observations, those held out apart, the worst by name."""
    out = []
    for state, words in (
        ("active", "suspicious observations take part"),
        ("check", "observations held out as checks do not agree"),
    ):
        names = dict.fromkeys(
            _words(o)
            for o in sorted(observations, key=lambda o: -abs(o.w or 0.0))
            if o.suspicious and o.state == state and not kind_named(o.kind).facts.listed_as_control
        )
        if names:
            more = f"; and {len(names) - 3} more" if len(names) > 3 else ""
            first = "; ".join(list(names)[:3])
            out.append(f"{words}: {first}{more}")
            chance = quality.alpha0 * len(quality.w)
            if state == "active" and chance >= 1:
                out[-1] += f" (chance alone makes about {chance:.0f} values look so)"
    return out


def _checks(control: Sequence[Control]) -> list[str]:
    """Check points and control that do not agree with the network."""
    out = []
    for use, noun in (("check", "check point"), ("weighted", "control point")):
        bad = [c.name for c in control if c.use == use and c.verdict and not c.verdict.agrees]
        if bad:
            plural = "s" if len(bad) > 1 else ""
            verb = "do" if plural else "does"
            out.append(f"{noun}{plural} {', '.join(bad[:12])} {verb} not agree with the network")
    return out


def _uncontrolled(quality: Quality) -> list[str]:
    """How many values no other value controls, or hardly."""
    none = int((~quality.controlled).sum())
    poor = int((quality.controlled & (np.nan_to_num(quality.redundancy) < POOR)).sum())
    out = []
    total = len(quality.w)
    if none:
        verb = "is" if none == 1 else "are"
        out.append(f"{none} of {total} values {verb} controlled by no other: errors stay unseen")
    if poor:
        verb = "has" if poor == 1 else "have"
        out.append(f"{poor} of {total} values {verb} a redundancy number below {POOR:g}")
    return out


def _off(observations: Sequence[Observation]) -> list[str]:
    """How many values are switched off."""
    n = sum(o.state == "off" for o in observations)
    if not n:
        return []
    if n == 1:
        return ["One observed value is switched off; it is listed with its reason"]
    return [f"{n} observed values are switched off; they are listed with their reasons"]


SUBJECT = Subject("adjustment", _chapters)
