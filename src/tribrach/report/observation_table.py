"""The table of observations: every value, worst first, with where it was written."""

from __future__ import annotations

from operator import attrgetter

from tribrach.report.columns import ColumnSet, Spec
from tribrach.report.content import Content, Observation
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    build_table,
    number_cell,
    text_cell,
)

__all__ = ["kind_name", "observation_table", "worst_first"]


def worst_first(observations: tuple[Observation, ...]) -> list[Observation]:
    """By size of w; values without a test after them, those switched off last."""

    def rank(o: Observation) -> tuple[bool, bool, float]:
        return o.state == "off", o.w is None, -abs(o.w or 0.0)

    return sorted(observations, key=rank)


def observation_table(content: Content, columns: ColumnSet, most: int | None = None) -> ReportTable:
    """The first ``most`` observed values (all if None), worst first."""
    note = (
        "Residual v = adjusted - observed. r: redundancy number. w: test value (for check values "
        "the residual over its predicted sigma). τ: the same with sigma0 a posteriori. MDB: the "
        "smallest error that would be found; effect: the largest shift of a position if it is "
        "not. Block: test of the whole vector or target against its limit. Sigmas of "
        "observations are as given."
    )
    specs: list[Spec] = [
        columns.plain("#", "number", 0, wide=True),
        (ColumnHead("Kind", numeric=False), lambda o: text_cell(_kind(o))),
        columns.word("From", "start"),
        columns.word("To", "end"),
        (ColumnHead("value"), lambda o: number_cell(o.value, _with_unit(o, columns))),
        _small("σ", "sigma", columns),
        _small("v", "residual", columns),
        columns.plain("r", "redundancy"),
        (ColumnHead("w"), lambda o: _w(o, columns)),
        columns.plain("τ", "tau", wide=True),
        _small("MDB", "mdb", columns),
        columns.mm("effect", attrgetter("external"), 1),
        columns.word("at", "external_at"),
        (ColumnHead("block", wide=True), _block),
        (ColumnHead("state", numeric=False), lambda o: text_cell(_state(o))),
        columns.source(),
    ]
    rows = worst_first(content.observations)
    title = "Observations, worst first"
    return build_table("observations", title, note, rows, specs, _row_state, most)


def kind_name(kind: str) -> str:
    """A kind in words."""
    return kind.replace("_", " ")


def _kind(o: Observation) -> str:
    return f"{kind_name(o.kind)} {o.component}".strip()


def _with_unit(o: Observation, columns: ColumnSet) -> str:
    text = columns.style.value(o.value, o.unit, o.kind)
    unit = columns.style.value_unit(o.unit)
    return f"{text} {unit}" if unit in ("m", "gon") else text


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
