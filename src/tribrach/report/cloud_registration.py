"""The registration of clouds as tables: pairs, loops, stations."""

from __future__ import annotations

import numpy as np

from tribrach.registration.clouds.graph import StationLoop
from tribrach.registration.clouds.pair import CloudPair, PairFit
from tribrach.registration.clouds.together import CloudGroup, CloudRegistration
from tribrach.report.numbers import arcsec_cell, count_cell, mm_cell
from tribrach.report.tables import (
    Cell,
    ColumnHead,
    ReportTable,
    build_table,
    number_cell,
    text_cell,
)

__all__ = ["cloud_registration_tables"]


def cloud_registration_tables(registration: CloudRegistration) -> list[ReportTable]:
    """Pairs that were registered, loops, and the stations of each group."""
    out = [_pairs(registration)]
    if registration.consistency.loops:
        out.append(_loops(registration))
    return out + [_stations(group) for group in registration.groups if group.adjustment is not None]


def _pairs(registration: CloudRegistration) -> ReportTable:
    """One row for each registered pair."""
    pairs = [p for p in registration.pairs if p.fit is not None]
    placed = {
        frozenset(k): d for group in registration.groups for k, d in group.differences.items()
    }

    def fit(p: CloudPair) -> PairFit:
        assert p.fit is not None
        return p.fit

    def sigma(p: CloudPair, first: int) -> float:
        part = np.diag(fit(p).precision.local)[first : first + 3]
        return float(np.sqrt(part.sum()))

    def difference(p: CloudPair, which: str) -> Cell:
        one = placed.get(frozenset((p.a, p.b)))
        return text_cell("") if one is None else _mm(getattr(one, which))

    columns = [
        (ColumnHead("Pair", numeric=False), lambda p: text_cell(f"{p.a} - {p.b}")),
        (
            ColumnHead("Overlap", "%"),
            lambda p: number_cell(
                max(fit(p).verdict.overlap), f"{100 * max(fit(p).verdict.overlap):.0f}"
            ),
        ),
        (ColumnHead("RMS", "mm"), lambda p: _mm(fit(p).alignment.rms)),
        (
            ColumnHead("Matches", wide=True),
            lambda p: number_cell(
                len(fit(p).alignment.matches), str(len(fit(p).alignment.matches))
            ),
        ),
        (
            ColumnHead("Effective", wide=True),
            lambda p: number_cell(fit(p).precision.effective, f"{fit(p).precision.effective:.0f}"),
        ),
        (ColumnHead("Sigma shift", "mm"), lambda p: _mm(sigma(p, 0))),
        (ColumnHead("Sigma turn", '"'), lambda p: _arcsec(sigma(p, 3))),
        (ColumnHead("Held", "of 6"), lambda p: _held(fit(p).precision.rank)),
        (ColumnHead("Observed", "mm", wide=True), lambda p: difference(p, "observed")),
        (ColumnHead("Predicted", "mm", wide=True), lambda p: difference(p, "predicted")),
    ]
    tried = len(registration.pairs)
    title = f"Registered pairs ({len(pairs)} of {tried} tried)"
    note = "Sigmas a priori, of the middle of the overlap, with the floor."
    return build_table("cloud_pairs", title, note, pairs, columns)


def _loops(registration: CloudRegistration) -> ReportTable:
    """One row for each loop."""
    columns = [
        (
            ColumnHead("Loop", numeric=False),
            lambda x: text_cell(" - ".join((*x.stations, x.stations[0]))),
        ),
        (ColumnHead("Shift", "mm"), lambda x: _mm(x.shift)),
        (ColumnHead("Predicted", "mm"), lambda x: _mm(x.shift_sigma)),
        (ColumnHead("Turn", '"'), lambda x: _arcsec(x.turn)),
        (ColumnHead("Predicted", '"'), lambda x: _arcsec(x.turn_sigma)),
        (ColumnHead("Test"), lambda x: number_cell(x.statistic, f"{x.statistic:.1f}")),
        (ColumnHead("Limit", wide=True), lambda x: number_cell(x.limit, f"{x.limit:.1f}")),
        (ColumnHead("Closes", numeric=False), _closes),
    ]
    return build_table("cloud_loops", "Loops", "", list(registration.consistency.loops), columns)


def _stations(group: CloudGroup) -> ReportTable:
    """One row for each station."""
    first = group.stations[0]

    def sigma(name: str, begin: int) -> float:
        part = np.diag(group.covariances[name])[begin : begin + 3]
        return float(np.sqrt(np.maximum(part, 0.0).sum()))

    def coordinate(axis: int) -> tuple[ColumnHead, object]:
        def cell(name: str) -> Cell:
            value = float(group.poses[name].translation[axis])
            return number_cell(value, f"{value:.4f}")

        return ColumnHead("xyz"[axis], "m"), cell

    def heading(name: str) -> Cell:
        r = group.poses[name].rotation
        value = float(np.degrees(np.arctan2(r[1, 0], r[0, 0])))
        return number_cell(value, f"{value:.4f}")

    columns = [
        (ColumnHead("Station", numeric=False), text_cell),
        *(coordinate(axis) for axis in range(3)),
        (ColumnHead("Turn about z", "deg"), heading),
        (ColumnHead("Sigma place", "mm"), lambda name: _mm(sigma(name, 0))),
        (ColumnHead("Sigma turn", '"'), lambda name: _arcsec(sigma(name, 3))),
    ]
    title = f"Stations in the frame of {first}, which is held"
    return build_table("cloud_stations", title, "", list(group.stations), columns)  # type: ignore[arg-type]


def _mm(value: float) -> Cell:
    """Millimetres, without decimals where they would be more than a metre."""
    return mm_cell(value, 2 if value < 1 else 0)


def _arcsec(value: float) -> Cell:
    """Arc seconds, without decimals where the angle is large."""
    return arcsec_cell(value, 1 if value < 0.1 else 0)


def _held(rank: int) -> Cell:
    return count_cell(rank, "" if rank == 6 else "bad")


def _closes(loop: StationLoop) -> Cell:
    return text_cell("yes" if loop.closes else "no", "" if loop.closes else "bad")
