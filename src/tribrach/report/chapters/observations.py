"""The chapter on observations: every value, residual and tests, and where it was written."""

from __future__ import annotations

from collections.abc import Iterable
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Array
from tribrach.network.adjustment import Adjustment
from tribrach.network.observation_rows import observation_rows
from tribrach.network.quality import Quality
from tribrach.observations.registry import kind_named
from tribrach.report.chapter import Chapter
from tribrach.report.columns import ColumnSet
from tribrach.report.content import Head, Observation, ObservedValues
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

if TYPE_CHECKING:
    from tribrach.job.results import JobResults

__all__ = ["SUBJECT", "observations", "printed_size", "value_words", "worst_first"]

#: rows stand in this order
_WORST = Worst("those with the largest w")


def observations(adjustment: Adjustment, quality: Quality) -> ObservedValues:
    """All values in the order of the network, whatever their state."""
    return ObservedValues(observation_rows(adjustment, quality))


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter; every report has it."""
    yield Chapter("observations", "Observations", tables=(_observation_table(head),))


def worst_first(observations: ObservedValues) -> ObservedValues:
    """By size of w; values without a test after them, those switched off last.

    Those of the same printed figure keep their order: two observations that only check each other
    have one w, whose last digits depend on the order in which sums were taken.
    """
    size = printed_size(observations)
    off = observations.column("state") == "off"
    return observations.chosen(np.lexsort((-np.nan_to_num(size), np.isnan(size), off)))


def printed_size(observations: ObservedValues) -> Array:
    """Sizes (n,) of w as they are printed, NaN where a value has none."""
    return np.array([round(size, 2) for size in np.abs(observations.column("w")).tolist()])


def _observation_table(head: Head) -> ReportTable:
    """Every observed value, worst first."""
    columns = head.columns
    quality = head.quality
    judged = (
        f"Suspicious is what lies beyond the limit {quality.critical:.2f} of τ, or beyond that of "
        "its block, with sigma0 a posteriori; w, MDB and effect are a priori. "
        if quality.posterior
        else f"Suspicious is what lies beyond the limit {quality.critical:.2f} of w, or beyond "
        "that of its block. "
    )
    sigmas = (
        "Sigmas of observations are those after the estimate of variance components."
        if head.components
        else "Sigmas of observations are as given."
    )
    note = (
        "Residual v = adjusted - observed. r: redundancy number. w: test value (for check values "
        "the residual over its predicted sigma). τ: the same with sigma0 a posteriori. MDB: the "
        "smallest error that would be found; effect: the largest shift of a position if it is "
        f"not. Block: test of the whole vector or target against its limit. {judged}{sigmas}"
    )
    specs: list[Spec] = [
        columns.plain("#", "number", 0, wide=True),
        (ColumnHead("Kind", numeric=False), lambda o: text_cell(_kind(o))),
        columns.word("From", "start"),
        columns.word("To", "end"),
        (
            ColumnHead("value"),
            lambda o: number_cell(o.value, value_words(o.kind, o.value, o.unit, columns.style)),
        ),
        _small("σ", "sigma", columns),
        _small("v", "residual", columns),
        columns.plain("r", "redundancy"),
        (ColumnHead("w"), lambda o: _w(o, columns)),
        columns.plain("τ", "tau", wide=not quality.posterior),
        _small("MDB", "mdb", columns),
        columns.mm("effect", attrgetter("external"), 1),
        columns.word("at", "external_at"),
        (ColumnHead("block", wide=True), _block),
        (ColumnHead("state", numeric=False), lambda o: text_cell(_state(o))),
        columns.source(),
        columns.word("id", "id", wide=True),
    ]
    rows = worst_first(head.observations)
    title = "Observations, worst first"
    return build_table("observations", title, note, rows, specs, _row_state, worst=_WORST)


def _kind(o: Observation) -> str:
    return f"{kind_named(o.kind).facts.title} {o.component}".strip()


def value_words(kind: str, value: float, unit: str, style: Style) -> str:
    """A measured value with its unit.

    Parameters
    ----------
    kind : str
        Of the observation.
    value, unit
        In metres, radians or a ratio: ``m``, ``rad`` or ``1``.
    style : Style
        How angles are written.
    """
    facts = kind_named(kind).facts
    if unit == "1" and not facts.of_unknown:
        return style.ratio(value)
    text = style.value(value, unit, full_circle=facts.full_circle)
    named = style.value_unit(unit)
    return f"{text} {named}" if named in ("m", "gon") else text


def _small(head: str, path: str, columns: ColumnSet) -> Spec:
    """A small quantity in the unit of its observation, which the cell names."""
    get, style = attrgetter(path), columns.style

    def cell(o: Observation) -> Cell:
        text = f"{style.small(get(o), o.unit)} {style.small_unit(o.unit)}"
        return number_cell(get(o), text)

    return ColumnHead(head), cell


def _w(o: Observation, columns: ColumnSet) -> Cell:
    """The test value, sorted by its size; a value that no other controls says so."""
    if o.w is None:
        return Cell("not controlled" if o.state == "active" else "")
    return number_cell(abs(o.w), columns.style.plain(o.w), "bad" if o.suspicious else "")


def _block(o: Observation) -> Cell:
    if o.block_test is None or o.block_limit is None:
        return Cell("")
    bad = o.block_test > o.block_limit
    text = f"{o.block_test:.1f} / {o.block_limit:.1f}"
    return number_cell(o.block_test, text, "bad" if bad else "")


def _state(o: Observation) -> str:
    return f"{o.state}: {o.reason}" if o.reason else o.state


def _row_state(o: Observation) -> str:
    """Off and check rows look different; so do suspicious ones."""
    if o.state != "active":
        return o.state
    return "suspicious" if o.suspicious else ""


SUBJECT = Subject("observations", _chapters)
