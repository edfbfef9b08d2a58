"""The chapter on the adjustment: kinds, weights, snooping; warnings about its quality."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tribrach.network.adjustment import Adjustment
from tribrach.network.blunders.gross import explain
from tribrach.network.blunders.rivals import rivals_of
from tribrach.network.blunders.snooping import CONTROL_GROUPS
from tribrach.network.blunders.suspects import find_suspects
from tribrach.network.facts import AssumedSigmas
from tribrach.network.observation_rows import ObservationRows, observation_rows
from tribrach.network.quality import Quality, assess
from tribrach.network.reactions import constraint_reactions
from tribrach.network.reliability import weigh
from tribrach.network.roles import assumed_sigmas
from tribrach.network.significance import sidak
from tribrach.observations.declaration import Role
from tribrach.observations.registry import kind_named
from tribrach.report.chapter import Chapter
from tribrach.report.chapters.control import control
from tribrach.report.chapters.observations import printed_size
from tribrach.report.content import Control, Head, KindCount
from tribrach.report.names import spoken
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
from tribrach.sentences import Sentence
from tribrach.statistics import largest_first

if TYPE_CHECKING:
    from tribrach.job.results import JobResults

#: redundancy numbers below this are worth a sentence
POOR = 0.1


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter; every report has it."""
    tables = (_kinds(head), _edits(head), _components(head), _snooping(head))
    yield Chapter("adjustment", "Adjustment", sentences=_remarks(head), tables=tables)


def _kinds(head: Head) -> ReportTable:
    """Groups of observations, their numbers, and whether their sigmas fit."""
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


def _edits(head: Head) -> ReportTable:
    """What somebody decided by hand."""
    columns: list[Spec] = [
        head.columns.word("Of", "id"),
        head.columns.word("Change", "action"),
        head.columns.word("Reason", "reason"),
        head.columns.word("By", "by"),
        head.columns.word("At", "at"),
    ]
    note = "What was decided by hand, in the order in which it was done, before any test."
    return build_table("edits", "Changes by hand", note, head.adjustment.network.edits, columns)


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
    note = "Suspects are switched off one at a time and stay in the list of observations."
    return build_table("snooping", "Snooping", note, head.snooping, columns)


@dataclass(frozen=True)
class _Seen:
    """Values, control and quality as they are without what a warning has explained already."""

    observations: ObservationRows
    control: Sequence[Control]
    quality: Quality

    @classmethod
    def of(cls, head: Head) -> _Seen:
        """Those of the report itself, unless something was explained."""
        if head.apart is head.adjustment:
            return cls(head.observations, head.control, head.quality)
        settings = head.settings
        quality = assess(head.apart, posterior=settings.posterior, confidence=settings.confidence)
        return cls(observation_rows(head.apart, quality), control(head.apart, settings), quality)


def adjustment_warnings(head: Head) -> tuple[ReportWarning, ...]:
    """What the reader should know of the adjustment before any number, and do about it."""
    seen = _Seen.of(head)
    test = seen.quality.global_test
    failed = (
        []
        if test.passed is not False
        else [Sentence("{test}; {cure}", test=test.sentence(), cure=_BY_KIND)]
    )
    unchecked = (
        [Sentence("{test}; observe more", test=test.sentence())] if test.passed is None else []
    )
    return (
        *warned(Severity.INPUT, head.adjustment.warnings),
        *warned(Severity.DOUBT, map(_assumed, assumed_sigmas(head.adjustment)), "assumed"),
        *warned(Severity.WEAK, unchecked),
        *warned(Severity.BLUNDER, failed),
        *warned(Severity.BLUNDER, _suspects(seen, head)),
        *warned(Severity.BLUNDER, constraint_reactions(head.apart).sentences()),
        *warned(Severity.BLUNDER, [f.sentence for f in _disagreement(seen, head) if f.act]),
        *warned(Severity.WEAK, _uncontrolled(head)),
    )


def _assumed(fact: AssumedSigmas) -> str:
    """Sigmas that nobody stated, and what to do."""
    said = (
        "{sentence}: what control is worth in this adjustment rests on them; state sigma_plan_mm "
    )
    return Sentence(
        said + "and sigma_up_mm of its points, and their source", sentence=fact.sentence
    )


_BY_KIND = "look for blunders first, then at the kinds whose ratio of sigma0 is far above one"


@dataclass(frozen=True)
class Marked:
    """Observations that take part although their tests are beyond the limits, the worst first."""

    names: tuple[str, ...]  #: each once, in words
    counted: str  #: how many tests that are, and how many would be by chance
    act: bool  #: true if they are more than chance


def marked(head: Head) -> Marked:
    """Marked observations of a report, without those that a warning explains."""
    seen = _Seen.of(head)
    active = _rejected(seen.observations, "active")
    parts = (active.column(name).tolist() for name in ("kind", "start", "end"))
    names = dict.fromkeys(
        f"{kind_named(kind).facts.title} {start}" + (f" to {end}" if end else "")
        for kind, start, end in zip(*parts, strict=True)
    )
    return Marked(tuple(names), _counted(seen), bool(names) and seen.quality.chance.act)


def _remarks(head: Head) -> tuple[str, ...]:
    """Remarks on the adjustment that ask for nothing."""
    seen = _Seen.of(head)
    found = [
        *_by_chance(seen),
        *(f.sentence for f in _disagreement(seen, head) if not f.act),
        *_off(head.observations),
    ]
    return tuple(warning.text for warning in warned(Severity.NOTE, found, "remark"))


def _words(kind: str, start: str, end: str, source: str) -> str:
    """An observation in words."""
    arrow = f"{start} -> {end}" if end else start
    title = kind_named(kind).facts.title
    return f"{title} {arrow}" + (f" ({spoken(source)})" if source else "")


def _named(observations: ObservationRows, most: int = 3) -> str:
    """The first observations by name, each once, and how many more there are."""
    parts = (observations.column(name).tolist() for name in ("kind", "start", "end", "source"))
    names = list(dict.fromkeys(zip(*parts, strict=True)))
    more = f"; and {len(names) - most} more" if len(names) > most else ""
    return "; ".join(_words(*name) for name in names[:most]) + more


def _rejected(observations: ObservationRows, state: str) -> ObservationRows:
    """Suspicious values of a state, the worst first; given coordinates are told of apart."""
    column = observations.column
    control = [kind_named(kind).facts.listed_as_control for kind in column("kind").tolist()]
    chosen = observations.chosen(
        column("suspicious").astype(bool) & (column("state") == state) & ~np.array(control, bool)
    )
    return chosen.chosen(np.argsort(-np.nan_to_num(printed_size(chosen)), kind="stable"))


_SNOOP = ", or let snooping decide (--snoop, or snoop = true in the project)"


def _decidable(adjustment: Adjustment) -> bool:
    """True if nothing else explains as much as the worst observation does, and no slip does."""
    if explain(adjustment.network, adjustment) is not None:
        return False
    suspects = find_suspects(weigh(adjustment))
    tables = adjustment.network.observations
    worst = next((s for s in suspects if tables[s.key[0]].group not in CONTROL_GROUPS), None)
    return worst is not None and not rivals_of(adjustment, worst)


def _suspects(seen: _Seen, head: Head) -> list[str]:
    """Suspicious observations that are more than chance, those held out apart."""
    out: list[str] = []
    chance, percent = seen.quality.chance, 100 * seen.quality.global_test.alpha
    active, held_out = (_rejected(seen.observations, state) for state in ("active", "check"))
    if active and chance.act:
        advised = not head.snooping and _decidable(head.apart)
        out.append(
            Sentence(
                "suspicious observations take part: {named} ({counted}, and the worst would be "
                "by chance in fewer than {percent:g} of 100 networks like this): look into the "
                "field notes{snooped}",
                named=_named(active),
                counted=_counted(seen),
                percent=percent,
                snooped=_SNOOP if advised else "",
            )
        )
    if held_out:
        out.append(
            f"observations held out as checks do not agree: {_named(held_out)}: compare them with "
            "what they are to check"
        )
    return out


def _counted(seen: _Seen) -> str:
    """How many tests are beyond their limits, and how many would be by chance."""
    chance = seen.quality.chance
    verb = "is" if chance.beyond == 1 else "are"
    expected = (
        Sentence("{chance.expected:1}", chance=chance)
        if chance.expected < 10
        else Sentence("{chance.expected:0}", chance=chance)
    )
    return Sentence(
        "{chance.beyond} of {chance.tests} tests {verb} beyond the limit, {expected} "
        "would be by chance",
        chance=chance,
        verb=verb,
        expected=expected,
    )


def _by_chance(seen: _Seen) -> list[str]:
    """Suspicious observations that a network of this size has by chance."""
    active = _rejected(seen.observations, "active")
    if not active or seen.quality.chance.act:
        return []
    return [
        Sentence(
            "{counted}; the worst is no larger than chance makes it in a network of this "
            "size: nothing is to be done about {named}",
            counted=_counted(seen),
            named=_named(active),
        )
    ]


@dataclass(frozen=True)
class _Disagreement:
    """Points that do not agree with the network; whether that is more than chance."""

    sentence: str
    act: bool


def _disagreement(seen: _Seen, head: Head) -> list[_Disagreement]:
    """Check points and control that do not agree with the network."""
    out = []
    alpha = head.settings.alpha
    for use, noun, cure in (
        ("check", "check point", "check their coordinates against the original source"),
        ("weighted", "control point", "check their coordinates against the original source"),
    ):
        judged = [c for c in seen.control if c.use == use and c.verdict is not None]
        verdicts = {c.name: c.verdict for c in judged if c.verdict and not c.verdict.agrees}
        if not verdicts:
            continue
        names = ", ".join(list(verdicts)[:12])
        plural = "s" if len(verdicts) > 1 else ""
        verb = "do" if plural else "does"
        count = Sentence(
            "{verdicts} of {judged} where {expected:1} would be by chance",
            verdicts=len(verdicts),
            judged=len(judged),
            expected=alpha * len(judged),
        )
        least = min(v.significance for v in verdicts.values())
        act = least < sidak(alpha, len(judged))
        tail = cure if act else "no more than expected by chance, nothing to be done"
        out.append(
            _Disagreement(
                Sentence(
                    "{noun}{plural} {names} {verb} not agree with the network ({count}): {tail}",
                    noun=noun,
                    plural=plural,
                    names=names,
                    verb=verb,
                    count=count,
                    tail=tail,
                ),
                act,
            )
        )
    return out


def _uncontrolled(head: Head) -> list[str]:
    """Values that no other value controls, or hardly, by name."""
    active = head.observations.chosen(head.observations.column("state") == "active")
    shared = [kind_named(kind).facts.nuisance for kind in active.column("kind").tolist()]
    active = active.chosen(~np.array(shared, dtype=bool))
    without = np.isnan(active.column("w"))
    none, tested = active.chosen(without), active.chosen(~without)
    redundancy = np.nan_to_num(tested.column("redundancy"))
    poor = tested.chosen(largest_first(-redundancy)[: int((redundancy < POOR).sum())])
    out = []
    total = len(active)
    kinds = none.column("kind").tolist()
    prior = np.array([kind_named(kind).facts.role is Role.PRIOR for kind in kinds], bool)
    if count := int(prior.sum()):
        one = count == 1
        out.append(
            f"{count} {'value is' if one else 'values are'} stated beforehand and controlled by no "
            f"observation, so that {'it is' if one else 'they are'} only as good as what states "
            f"{'it' if one else 'them'}: {_named(none.chosen(prior))}"
        )
        none = none.chosen(~prior)
    if none:
        verb, it = ("is", "it") if len(none) == 1 else ("are", "them")
        out.append(
            f"{len(none)} of {total} values {verb} controlled by no other, so an error in {it} "
            f"stays unseen: {_named(none)}: observe these points a second time"
        )
    if poor:
        verb, it = ("has", "it") if len(poor) == 1 else ("have", "them")
        out.append(
            Sentence(
                "{count} of {total} values {verb} a redundancy number below {poor:g}, so an "
                "error in {it} hardly shows: {named}: observe these points again from elsewhere",
                count=len(poor),
                total=total,
                verb=verb,
                poor=POOR,
                it=it,
                named=_named(poor),
            )
        )
    return out


def _off(observations: ObservationRows) -> list[str]:
    """How many values are switched off."""
    n = int((observations.column("state") == "off").sum())
    if not n:
        return []
    if n == 1:
        return ["One observed value is switched off; it is listed with its reason"]
    return [f"{n} observed values are switched off; they are listed with their reasons"]


SUBJECT = Subject("adjustment", _chapters)
