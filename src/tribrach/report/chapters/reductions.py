"""The chapter on raw files: axis errors of the day, rounds of each set-up, closures."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tribrach.answers import Number, Result
from tribrach.io.survey.totalstation import ReducedFile
from tribrach.network.facts import Fact, facts_of
from tribrach.report.chapter import Chapter
from tribrach.report.columns import ColumnSet
from tribrach.report.content import Head
from tribrach.report.subject import Subject
from tribrach.report.tables import ColumnHead, ReportTable, Spec, build_table, text_cell

if TYPE_CHECKING:
    from tribrach.job.results import JobResults


@dataclass(frozen=True, kw_only=True)
class ReductionDay(Result):
    """A file: what was read, axis errors with their sigmas, sigmas of one face [rad]."""

    file: str
    format: str
    instrument: str
    setups: int
    sights: int
    pairs: int
    collimation: Number
    sigma_collimation: Number
    trunnion: Number
    sigma_trunnion: Number
    index: Number
    sigma_index: Number
    sigma_direction: Number
    sigma_zenith: Number
    left_out: int


@dataclass(frozen=True, kw_only=True)
class Round(Result):
    """A set-up: targets and sets, sigmas of values of one set, the largest residual [m, rad]."""

    station: str
    height: Number
    targets: int
    sets: int
    dof: int
    sigma_direction: Number
    sigma_zenith: Number
    sigma_distance: Number
    largest: Number
    source: str


@dataclass(frozen=True, kw_only=True)
class SetRow(Result):
    """A target in a set: half differences of the faces and residuals against all sets [m, rad]."""

    station: str
    target: str
    set: int
    half_direction: Number
    half_zenith: Number
    direction: Number
    zenith: Number
    distance: Number
    far: bool
    source: str


@dataclass(frozen=True, kw_only=True)
class Closure(Result):
    """A horizon that was closed: last less first reading [rad]."""

    station: str
    target: str
    set: int
    face: int
    difference: Number


@dataclass(frozen=True, kw_only=True)
class Reductions(Result):
    """All that there is to say of the reduction of raw files."""

    days: tuple[ReductionDay, ...]
    rounds: tuple[Round, ...]
    sets: tuple[SetRow, ...]
    closures: tuple[Closure, ...]

    def tables(self, columns: ColumnSet) -> tuple[ReportTable, ...]:
        """The tables of the chapter, empty ones as well."""
        return (
            _day_table(self, columns),
            _round_table(self, columns),
            _set_table(self, columns),
            _closure_table(self, columns),
        )


def _chapters(head: Head, job: JobResults) -> Iterable[Chapter]:
    """The chapter, where files of total stations were reduced."""
    reduced = reductions(head.adjustment.network.facts)
    if reduced is not None:
        tables = reduced.tables(head.columns)
        yield Chapter("reductions", "Raw files", tables=tables, data=reduced)


def reductions(facts: Iterable[Fact]) -> Reductions | None:
    """What the survey remembers of raw files; None if there are none."""
    files = facts_of(facts, ReducedFile)
    if not files:
        return None
    return Reductions(
        days=tuple(_day(file) for file in files),
        rounds=tuple(row for file in files for row in _rounds(file)),
        sets=tuple(row for file in files for row in _sets(file)),
        closures=tuple(row for file in files for row in _closures(file)),
    )


def _day(file: ReducedFile) -> ReductionDay:
    raw, axes = file.raw, file.reduction.axes
    return ReductionDay(
        file=raw.name,
        format=raw.format,
        instrument=raw.instrument,
        setups=len(raw.setups),
        sights=len(raw.shots),
        pairs=axes.pairs,
        collimation=axes.collimation,
        sigma_collimation=axes.sigma_collimation,
        trunnion=axes.trunnion,
        sigma_trunnion=axes.sigma_trunnion,
        index=axes.index,
        sigma_index=axes.sigma_index,
        sigma_direction=axes.sigma_direction,
        sigma_zenith=axes.sigma_zenith,
        left_out=len(raw.problems),
    )


def _rounds(file: ReducedFile) -> list[Round]:
    rows = []
    for setup in file.reduction.setups:
        residual = setup.rounds.residual[np.isfinite(setup.rounds.residual)]
        worst = np.abs(residual).max() if setup.rounds.dof and len(residual) else np.nan
        rows.append(
            Round(
                station=str(file.station[setup.setup]),
                height=file.raw.setups.height[setup.setup],
                targets=len(setup.targets),
                sets=len(setup.sets),
                dof=setup.rounds.dof,
                sigma_direction=setup.rounds.sigma,
                sigma_zenith=setup.zeniths.sigma,
                sigma_distance=setup.distances.sigma,
                largest=worst,
                source=file.raw.source(int(file.raw.setups.line[setup.setup])),
            )
        )
    return rows


def _sets(file: ReducedFile) -> list[SetRow]:
    """Rows where faces were paired or sets repeated."""
    cells, level, _ = file.reduction.cells
    axes = file.reduction.axes
    rows = []
    for setup in file.reduction.setups:
        for i in np.flatnonzero(cells.setup == setup.setup):
            s = int(np.searchsorted(setup.sets, cells.circle[i]))
            t = int(np.searchsorted(setup.targets, cells.target[i]))
            repeated = len(setup.sets) > 1 and setup.zeniths.dof + setup.rounds.dof > 0
            if not repeated and np.isnan(axes.half_direction[i]):
                continue
            parts = (setup.rounds, setup.zeniths, setup.distances)
            direction, zenith, distance = (p.residual[s, t] if p.dof else np.nan for p in parts)
            rows.append(
                SetRow(
                    station=str(file.station[setup.setup]),
                    target=str(file.target[cells.target[i]]),
                    set=int(cells.circle[i]) + 1,
                    half_direction=axes.half_direction[i],
                    half_zenith=axes.half_zenith[i],
                    direction=direction,
                    zenith=zenith,
                    distance=distance,
                    far=bool(cells.far[i] or level.far[i]),
                    source=file.source(int(cells.first[i])),
                )
            )
    return rows


def _closures(file: ReducedFile) -> list[Closure]:
    closures = file.reduction.closures
    return [
        Closure(
            station=str(file.station[closures.setup[i]]),
            target=str(file.target[closures.target[i]]),
            set=int(closures.set[i]) + 1,
            face=int(closures.face[i]),
            difference=closures.difference[i],
        )
        for i in range(len(closures.setup))
    ]


def _day_table(chapter: Reductions, columns: ColumnSet) -> ReportTable:
    note = (
        "From half the differences of the faces. The mean of both faces is free of these errors; "
        "sigmas are of one reading in one face."
    )
    specs: list[Spec] = [
        columns.word("File", "file"),
        columns.word("Format", "format", wide=True),
        columns.word("Instrument", "instrument", wide=True),
        columns.plain("set-ups", "setups", 0),
        columns.plain("sights", "sights", 0),
        columns.plain("left out", "left_out", 0, wide=True),
        columns.plain("pairs", "pairs", 0),
        columns.small_angle("collimation", lambda d: d.collimation),
        columns.small_angle("σ", lambda d: d.sigma_collimation),
        columns.small_angle("trunnion", lambda d: d.trunnion, wide=True),
        columns.small_angle("σ", lambda d: d.sigma_trunnion, wide=True),
        columns.small_angle("index", lambda d: d.index),
        columns.small_angle("σ", lambda d: d.sigma_index),
        columns.small_angle("σ direction", lambda d: d.sigma_direction),
        columns.small_angle("σ zenith", lambda d: d.sigma_zenith),
    ]
    return build_table("axes", "Axis errors of the day", note, chapter.days, specs)


def _round_table(chapter: Reductions, columns: ColumnSet) -> ReportTable:
    note = (
        "Sigmas are of the mean of the faces in one set, from the residuals of all sets and the "
        "redundancy. The largest residual is that of all directions of the round, none left out by "
        "a limit."
    )
    specs: list[Spec] = [
        columns.word("Station", "station"),
        columns.metres("height", lambda r: r.height),
        columns.plain("targets", "targets", 0),
        columns.plain("sets", "sets", 0),
        columns.plain("redundancy", "dof", 0),
        columns.small_angle("s direction", lambda r: r.sigma_direction),
        columns.small_angle("s zenith", lambda r: r.sigma_zenith),
        columns.mm("s distance", lambda r: r.sigma_distance),
        columns.small_angle("largest residual", lambda r: r.largest),
        columns.source(),
    ]
    return build_table("rounds", "Rounds of angles", note, chapter.rounds, specs)


def _set_table(chapter: Reductions, columns: ColumnSet) -> ReportTable:
    note = "Half differences of the faces, and residuals of each set against the adjusted rounds."
    specs: list[Spec] = [
        columns.word("Station", "station"),
        columns.word("Target", "target"),
        columns.plain("set", "set", 0),
        columns.small_angle("half Δ Hz", lambda r: r.half_direction),
        columns.small_angle("half Δ V", lambda r: r.half_zenith),
        columns.small_angle("v direction", lambda r: r.direction),
        columns.small_angle("v zenith", lambda r: r.zenith),
        columns.mm("v distance", lambda r: r.distance),
        (
            ColumnHead("faces", numeric=False),
            lambda r: text_cell("too far apart", "bad") if r.far else text_cell(""),
        ),
        columns.source(),
    ]
    return build_table("sets", "Faces and sets", note, chapter.sets, specs)


def _closure_table(chapter: Reductions, columns: ColumnSet) -> ReportTable:
    note = "Last less first reading of the target that a half-set began with."
    specs: list[Spec] = [
        columns.word("Station", "station"),
        columns.word("Target", "target"),
        columns.plain("set", "set", 0),
        columns.plain("face", "face", 0),
        columns.small_angle("closure", lambda r: r.difference),
    ]
    return build_table("closures", "Closed horizons", note, chapter.closures, specs)


SUBJECT = Subject("reductions", _chapters, Reductions)
