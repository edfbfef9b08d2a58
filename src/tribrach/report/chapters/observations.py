"""The chapter on observations: every value, residual and tests, and where it was written."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Array
from tribrach.network.observation_rows import ObservationRow, ObservationRows
from tribrach.observations.registry import kind_named
from tribrach.report.chapter import Chapter
from tribrach.report.columns import ColumnSet
from tribrach.report.content import Head
from tribrach.report.numbers import Style
from tribrach.report.subject import Subject
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    Spec,
    Worst,
    build_table,
    number_cell,
    text_cell,
)
from tribrach.sentences import Sentence, written

if TYPE_CHECKING:
    from tribrach.job.results import JobResults

#: rows stand in this order
_WORST = Worst("those with the largest w")
#: a source that is a line of a file
_LINE = re.compile(r":\d+$")
#: rows of the table of the worst
_SHOWN = 10
#: a redundancy number below this leaves an error hardly visible
_POOR = 0.1


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter; every report has it."""
    if len(head.observations.chosen(head.observations.column("state") != "off")):
        yield Chapter(
            "worst-observations",
            "Worst observations",
            _advice(head),
            tables=(_worst_table(head),),
            signed=True,
        )
    yield Chapter("observations", "Observations", tables=(_observation_table(head),))


def worst_first(observations: ObservationRows) -> ObservationRows:
    """By size of w; values without a test after them, those switched off last.

    Those of the same printed figure keep their order: two observations that only check each other
    have one w, whose last digits depend on the order in which sums were taken.
    """
    size = printed_size(observations)
    off = observations.column("state") == "off"
    return observations.chosen(np.lexsort((-np.nan_to_num(size), np.isnan(size), off)))


def printed_size(observations: ObservationRows) -> Array:
    """Sizes (n,) of w as they are printed, NaN where a value has none."""
    return np.array([round(size, 2) for size in np.abs(observations.column("w")).tolist()])


def _observation_table(head: Head) -> ReportTable:
    """Every observed value, worst first."""
    columns = head.columns
    quality = head.quality
    judged = (
        Sentence(
            "Suspicious is what lies beyond the limit {quality.critical:2} of τ, or beyond "
            "that of its block, with sigma0 a posteriori; w, MDB and effect are a priori. ",
            quality=quality,
        )
        if quality.posterior
        else Sentence(
            "Suspicious is what lies beyond the limit {quality.critical:2} of w, or beyond "
            "that of its block. ",
            quality=quality,
        )
    )
    sigmas = (
        "Sigmas of observations are those after the estimate of variance components."
        if head.components
        else "Sigmas of observations are as given."
    )
    note = Sentence(
        "Residual v = adjusted - observed. r: redundancy number. w: test value (for "
        "check values the residual over its predicted sigma). τ: the same with sigma0 "
        "a posteriori. MDB: the smallest error that would be found; effect: the "
        "largest shift of a position if it is not. Block: test of the whole vector or "
        "target against its limit. {judged}{sigmas}",
        judged=judged,
        sigmas=sigmas,
    )
    specs: list[Spec] = [
        columns.plain("#", "number", 0, wide=True),
        (ColumnHead("Kind", numeric=False), lambda o: text_cell(_kind(o))),
        columns.word("From", "start"),
        columns.word("To", "end"),
        (ColumnHead("value"), lambda o: _value(o, columns)),
        _small("σ", "sigma", columns),
        _small("v", "residual", columns),
        columns.plain("r", "redundancy"),
        (ColumnHead("w"), lambda o: _w(o, columns)),
        columns.plain("τ", "tau", wide=not quality.posterior),
        _small("MDB", "mdb", columns),
        columns.mm("effect", attrgetter("external")),
        columns.word("at", "external_at"),
        (ColumnHead("block", wide=True), _block),
        (ColumnHead("state", numeric=False), lambda o: text_cell(_state(o))),
        columns.source(),
        columns.word("id", "id", wide=True),
    ]
    rows = worst_first(head.observations)
    title = "Observations, worst first"
    return build_table(
        "observations", title, note, rows, specs, _row_state, worst=_WORST, ends=_ends
    )


def _ends(o: ObservationRow) -> tuple[str, ...]:
    """The positions that an observation is about."""
    return tuple(name for name in (o.start, o.end) if name)


def _advice(head: Head) -> tuple[str, ...]:
    """How the worst observations are to be read: what chance does alone."""
    chance, quality = head.quality.chance, head.quality
    if not chance.tests:
        return ("No observation is tested: nothing is measured a second time.",)
    verb = "is" if chance.beyond == 1 else "are"
    found = (
        Sentence(
            "{chance.beyond} of {chance.tests} tests {verb} beyond the limit of "
            "{quality.critical:2}",
            chance=chance,
            verb=verb,
            quality=quality,
        )
        if chance.beyond
        else Sentence(
            "None of {chance.tests} tests is beyond the limit of {quality.critical:2}",
            chance=chance,
            quality=quality,
        )
    )
    blocks = int(quality.blocks.rejected.sum())
    if blocks:
        # the table below has single values: whole targets would be looked for in vain
        verb = "is" if blocks == 1 else "are"
        own = "a whole vector or target, which has its own limit"
        found += f" for a value; {blocks} of these {verb} of {own}"
    expected = Sentence(
        "{found}; {chance.expected:1} would be by chance.", found=found, chance=chance
    )
    if chance.act:
        percent = 100 * quality.global_test.alpha
        return (
            expected,
            Sentence(
                "The worst is more than chance: fewer than {percent:g} of 100 clean networks "
                "of this size have one like it. Look it up before you sign.",
                percent=percent,
            ),
        )
    return (expected,)


def _worst_table(head: Head) -> ReportTable:
    """The worst observations, each with what to do about it."""
    columns, chance = head.columns, head.quality.chance
    rows = worst_first(head.observations)
    rows = rows.chosen(rows.column("state") != "off")[:_SHOWN]
    note = "By the size of the test value w."
    if any(_likely(o, columns).text for o in rows):
        note += " Likely error: what the reading would be wrong by if it alone were wrong, - v / r."
    specs: list[Spec] = [
        (ColumnHead("Observation", numeric=False), lambda o: text_cell(_kind(o))),
        columns.word("From", "start"),
        columns.word("To", "end"),
        (ColumnHead("w"), lambda o: _w(o, columns)),
        _small("v", "residual", columns),
        (ColumnHead("likely error"), lambda o: _likely(o, columns)),
        columns.plain("r", "redundancy"),
        (ColumnHead("What to do", numeric=False), lambda o: text_cell(_to_do(o, chance.act))),
        columns.source(),
    ]
    return build_table("worst", "Worst observations", note, rows, specs, _row_state, ends=_ends)


def _likely(o: ObservationRow, columns: ColumnSet) -> Cell:
    """The estimated gross error of a suspicious value, if it alone is wrong."""
    if not o.suspicious or math.isnan(o.residual) or not o.redundancy >= _POOR:
        return Cell("")
    error, style = -o.residual / o.redundancy, columns.style
    return number_cell(error, style.small(error, o.unit), unit=style.small_unit(o.unit))


def _to_do(o: ObservationRow, act: bool) -> str:
    """What to do about an observation, by its test alone."""
    where = "field notes" if _LINE.search(o.source) else "scan"
    if o.state == "check":
        if o.suspicious:
            return "It is held out and does not agree: compare it with what it is to check."
        return "Nothing: held out as a check, within its limit."
    if o.suspicious:
        look = f"Look into the {where}"
        if not act:
            return f"Beyond the limit, as chance makes some: {look.lower()} if they are at hand."
        return f"{look}: name, height, pointing. Switch it off only with a reason."
    if o.redundancy < _POOR:
        return "Within the limit, but hardly controlled: observe this once more from elsewhere."
    return "Nothing: within the limit."


def observation_title(kind: str, component: str) -> str:
    """What a report calls a kind of observations, with the component."""
    return f"{kind_named(kind).facts.title} {component}".strip()


def _kind(o: ObservationRow) -> str:
    return observation_title(o.kind, o.component)


def value_words(kind: str, value: float, unit: str, style: Style) -> str:
    """A measured value with its unit."""
    return _value_cell(kind, value, unit, style).words


def _value(o: ObservationRow, columns: ColumnSet) -> Cell:
    return _value_cell(o.kind, o.value, o.unit, columns.style)


def _value_cell(kind: str, value: float, unit: str, style: Style) -> Cell:
    """A measured value as a cell with its unit."""
    facts = kind_named(kind).facts
    if unit == "1" and not facts.of_unknown:
        return number_cell(value, style.ratio(value))
    text = style.value(value, unit, full_circle=facts.full_circle)
    named = style.value_unit(unit)
    return number_cell(value, text, unit=named if named in ("m", "gon") else "")


def _small(head: str, path: str, columns: ColumnSet) -> Spec:
    """A small quantity in the unit of its observation, which the cell names."""
    get, style = attrgetter(path), columns.style

    def cell(o: ObservationRow) -> Cell:
        text = style.small(get(o), o.unit)
        return number_cell(get(o), text, unit=style.small_unit(o.unit))

    return ColumnHead(head), cell


def _w(o: ObservationRow, columns: ColumnSet) -> Cell:
    """The test value, sorted by its size; a value that no other controls says so."""
    if math.isnan(o.w):
        return Cell("not controlled" if o.state == "active" else "")
    return number_cell(abs(o.w), columns.style.plain(o.w), "bad" if o.suspicious else "")


def _block(o: ObservationRow) -> Cell:
    if math.isnan(o.block_test) or math.isnan(o.block_limit):
        return Cell("")
    bad = o.block_test > o.block_limit
    digits = 2 if bad and written(o.block_test, "1") == written(o.block_limit, "1") else 1
    text = Sentence(f"{{o.block_test:{digits}}} / {{o.block_limit:{digits}}}", o=o)
    return number_cell(o.block_test, text, "bad" if bad else "")


def _state(o: ObservationRow) -> str:
    return Sentence("{o.state}: {o.reason}", o=o) if o.reason else o.state


def _row_state(o: ObservationRow) -> str:
    """Off and check rows look different; so do suspicious ones."""
    if o.state != "active":
        return o.state
    return "suspicious" if o.suspicious else ""


SUBJECT = Subject("observations", _chapters)
