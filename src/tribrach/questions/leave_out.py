"""How well control fits what was measured: left out in turn, and 3, 5, 9 of n as control.

Control is what gives positions: coordinates with their sigmas, and positions of GNSS on marks or on
scanners. What is left out takes no part and is compared with what the rest says of it (method
section 3.4); the difference has the covariance of both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from tribrach._types import Array, Index, Progress
from tribrach.answers import Form, Number, Result, Table, Test, Vector
from tribrach.errors import AdjustmentError, InputError
from tribrach.io.survey.exported import ValueCovariances
from tribrach.io.survey.formats import read_files
from tribrach.job.opened import open_job
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.network import Network
from tribrach.network.survey import observed_part
from tribrach.observations.base import Use
from tribrach.observations.control import Coordinate, Coordinates
from tribrach.observations.gnss import Antennas, GnssPositions
from tribrach.questions.adjust.command import project_of
from tribrach.report.answer import Answer
from tribrach.report.columns import column
from tribrach.report.findings import Finding
from tribrach.report.names import some_of
from tribrach.report.page import FrontPage
from tribrach.report.tables import ReportTable, build_table
from tribrach.shell.command import command
from tribrach.statistics import chi2

#: kinds that give positions
_GIVE = (Coordinates, Coordinate, GnssPositions, Antennas)
_AXES = ("E", "N", "U")
#: so many of all are control, the others are checks
CHOSEN = (3, 5, 9)
_CONFIDENCE = 0.95

Place = tuple[int, int]


@dataclass(frozen=True)
class LeftOutPosition(Result):
    """A position that took no part, against what the others say of it."""

    name: str
    #: E, N, U, adjusted minus given, and its sigma [m]; null where nothing is given
    difference: Vector
    sigma: Vector
    test: Test  #: the difference in its own metric against chi-square


@dataclass(frozen=True)
class AxisSpread(Table):
    """Differences of all positions by axis [m]."""

    axis: tuple[str, ...]
    count: tuple[int, ...]
    mean: Vector
    #: standard deviation about the mean
    sd: Vector
    rms: Vector
    largest: Vector
    expected: Vector  #: root of the mean variance that the differences should have


@dataclass(frozen=True)
class ChosenControl(Result):
    """Some of the positions as control, the others as checks."""

    control: tuple[str, ...]
    checks: tuple[LeftOutPosition, ...]
    spread: AxisSpread


@dataclass(frozen=True)
class ControlLeftOut(Result):
    """Control left out in turn, and most of it at once."""

    title: str
    #: each against all others
    in_turn: tuple[LeftOutPosition, ...]
    spread: AxisSpread
    needed: tuple[str, ...]  #: without which the network cannot be adjusted
    chosen: tuple[ChosenControl, ...]  #: 3, 5, 9 of them, spread as wide as they lie
    #: mean of the squared differences in their metrics over its expectation, of those in turn
    ratio: Number


FORM = Form("leave_out", ControlLeftOut, 1)


def left_out(network: Network, progress: Progress) -> ControlLeftOut:
    """Adjust a network without each position that is given, and with few of them."""
    units = _units(network)
    if len(units) < 2:
        raise InputError(
            f"the network has {len(units)} given position{'' if len(units) == 1 else 's'} "
            "with a sigma, and nothing is left to compare it with",
            cure="give control points with their sigmas, or positions of GNSS",
        )
    whole = adjust(network)
    in_turn: list[LeftOutPosition] = []
    needed: list[str] = []
    for k, (name, places) in enumerate(units.items()):
        try:
            without = adjust(network.switched(places, Use.CHECK, "left out"))
            in_turn.append(_compared(name, places, without))
        except AdjustmentError:
            needed.append(name)
        progress("left out", k + 1, len(units))
    chosen = tuple(_chosen(network, units, whole))
    tested = [p.test for p in in_turn if p.test.dof]
    freedom = sum(t.dof for t in tested)
    ratio = sum(t.statistic for t in tested) / freedom if freedom else np.nan
    return ControlLeftOut(
        network.title or "Control left out", tuple(in_turn), _spread(in_turn), tuple(needed),
        chosen, ratio,
    )  # fmt: skip


def _units(network: Network) -> dict[str, list[Place]]:
    """Observations that give a position and take part, by its name."""
    out: dict[str, list[Place]] = {}
    for table, o in enumerate(network.observations):
        if isinstance(o, _GIVE):
            names = o.end_names(network.start.layout)[0]
            for item in np.flatnonzero(o.use == Use.ACTIVE).tolist():
                out.setdefault(str(names[item]), []).append((table, item))
    return out


def _compared(name: str, places: Sequence[Place], adjustment: Adjustment) -> LeftOutPosition:
    """Mean difference from the given position, and its expectation."""
    network = adjustment.network
    rows: list[tuple[int, float, Index, Array]] = []
    values = ValueCovariances(network)
    keys: list[tuple[int, int, int]] = []
    for table in dict.fromkeys(table for table, _ in places):
        o = network.observations[table]
        own = o.coordinate_axes()
        axes = np.tile(np.arange(3), (len(o), 1)) if own is None else own
        off = -o.misclosure(adjustment.state)
        blocks = o.jacobian(adjustment.state)
        for item in (item for t, item in places if t == table):
            columns = np.concatenate([block.columns[item] for block in blocks])
            for row in range(o.rows):
                slope = np.concatenate([block.values[item, row] for block in blocks])
                rows.append((int(axes[item, row]), float(off[item, row]), columns, slope))
                keys.append((table, item, row))
    used = np.unique(np.concatenate([columns[columns >= 0] for _, _, columns, _ in rows]))
    design = np.zeros((len(rows), len(used)))
    for k, (_, _, columns, slope) in enumerate(rows):
        good = columns >= 0
        np.add.at(design[k], np.searchsorted(used, columns[good]), slope[good])
    whole = design @ adjustment.covariance_columns(used, used) @ design.T + values.matrix(keys)
    difference, sigma = np.full(3, np.nan), np.full(3, np.nan)
    mean = np.zeros((3, len(rows)))
    for axis in range(3):
        mine = [k for k, row in enumerate(rows) if row[0] == axis]
        if mine:
            mean[axis, mine] = 1 / len(mine)
            difference[axis] = np.mean([rows[k][1] for k in mine])
    have = np.isfinite(difference)
    covariance = (mean @ whole @ mean.T)[np.ix_(have, have)]
    sigma[have] = np.sqrt(np.diag(covariance))
    statistic = float(difference[have] @ np.linalg.solve(covariance, difference[have]))
    dof = int(have.sum())
    test = Test(statistic, dof, float(chi2.ppf(_CONFIDENCE, dof)), float(chi2.sf(statistic, dof)))
    return LeftOutPosition(name, difference, sigma, test)


def _spread(positions: Sequence[LeftOutPosition]) -> AxisSpread:
    """Mean and standard deviation of differences by axis."""
    d = np.array([p.difference for p in positions]).reshape(-1, 3)
    s = np.array([p.sigma for p in positions]).reshape(-1, 3)
    columns: list[list[float]] = []
    for axis in range(3):
        own, sigma = (a[np.isfinite(d[:, axis]), axis] for a in (d, s))
        n = len(own)
        columns.append(
            [
                n,
                own.mean() if n else np.nan,
                own.std(ddof=1) if n > 1 else np.nan,
                np.sqrt((own**2).mean()) if n else np.nan,
                np.abs(own).max() if n else np.nan,
                np.sqrt((sigma**2).mean()) if n else np.nan,
            ]
        )
    count, mean, sd, rms, largest, expected = np.array(columns).T
    return AxisSpread(_AXES, tuple(int(n) for n in count), mean, sd, rms, largest, expected)


def _chosen(
    network: Network, units: dict[str, list[Place]], whole: Adjustment
) -> Iterable[ChosenControl]:
    """Few positions as control: those that lie farthest from each other."""
    names = list(units)
    at = np.array([_place(whole, name) for name in names])
    apart = np.linalg.norm(np.nan_to_num(at[:, None] - at), axis=2)
    order = [int(k) for k in np.unravel_index(np.argmax(apart), apart.shape)]
    while len(order) < len(names):
        nearest = apart[:, order].min(axis=1)
        nearest[order] = -1.0
        order.append(int(np.argmax(nearest)))
    for count in CHOSEN:
        if count >= len(names):
            return
        control = tuple(names[k] for k in sorted(order[:count]))
        checks = [names[k] for k in sorted(order[count:])]
        places = [place for name in checks for place in units[name]]
        try:
            adjusted = adjust(network.switched(places, Use.CHECK, "left out"))
        except AdjustmentError:
            continue
        compared = tuple(_compared(name, units[name], adjusted) for name in checks)
        yield ChosenControl(control, compared, _spread(compared))


def _place(adjustment: Adjustment, name: str) -> Array:
    """Where a point or station is in W."""
    if name in adjustment.points:
        return adjustment.points[name].xyz
    return adjustment.stations[name].xyz


@command()
def leave_out(
    files: Annotated[
        list[Path], typer.Argument(help="A network, as adjust takes it, or a project.")
    ],
    *,
    progress: Progress,
) -> Answer:
    """Compare control with the rest: left out in turn, and 3, 5, 9 of n as control."""
    project = project_of(files)
    network = (
        observed_part(read_files(files)).network()
        if project is None
        else open_job(project, progress).network()
    )
    result = left_out(network, progress)
    tables = list(_tables(result))
    findings = list(_findings(result))
    return Answer(
        "Control left out", result.title, FrontPage("none", "", ""), result, FORM,
        findings=findings, tables=tables, terminal=[*tables[1:], *findings],
    )  # fmt: skip


def _findings(result: ControlLeftOut) -> Iterable[Finding]:
    """What fits, what does not, and what cannot be left out."""
    bad = [p for p in result.in_turn if not p.test.passed]
    yield Finding.of(
        "left_out",
        "Of {n} given positions that were left out in turn {bad} differ from the rest by more than "
        "95 of 100 would; their squared differences are {r.ratio:2} times as large as stated.",
        n=len(result.in_turn),
        bad=len(bad),
        r=result,
    )
    for p in bad:
        yield Finding.of(
            "left_out_differs",
            "{p.name} differs from the rest: {p.test.statistic:1} against {p.test.limit:1}.",
            True,
            p=p,
        )
    if result.needed:
        yield Finding.of(
            "left_out_needed",
            "Without {names} the network cannot be adjusted: nothing else controls it.",
            True,
            names=some_of(result.needed, 5),
        )


def _tables(result: ControlLeftOut) -> Iterable[ReportTable]:
    """Positions one by one, then by axis."""
    columns = [column("Position", "name")]
    columns += [column(f"Δ{a}", _part("difference", k), "mm2") for k, a in enumerate(_AXES)]
    columns += [column(f"σ Δ{a}", _part("sigma", k), "mm2") for k, a in enumerate(_AXES)]
    columns += [column("test", "test.statistic", "2"), column("limit", "test.limit", "2")]
    note = "Given positions left out in turn: adjusted minus given, and what it should have."
    yield build_table("left-out", "Left out in turn", note, result.in_turn, columns)
    yield _by_axis("left-out-axes", "Left out in turn, by axis", result.spread)
    for one in result.chosen:
        n = len(one.control)
        title = f"{n} of {n + len(one.checks)} as control, the others as checks"
        yield _by_axis(f"control-{n}", title, one.spread)


def _part(name: str, axis: int) -> Callable[[LeftOutPosition], float]:
    """Takes one axis of a field."""
    return lambda position: float(getattr(position, name)[axis])


def _by_axis(name: str, title: str, spread: AxisSpread) -> ReportTable:
    """Mean and standard deviation for each axis."""
    columns = [column("Axis", "axis"), column("positions", "count", "0")]
    heads = ("mean", "sd", "rms", "largest", "expected")
    columns += [column(head, head, "mm2") for head in heads]
    note = "Expected: root of the mean variance that the differences should have."
    return build_table(name, title, note, spread.each(), columns)
