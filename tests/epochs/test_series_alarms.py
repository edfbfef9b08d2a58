"""Alarms of series: as seldom by chance as they are stated, and soon where something moves."""

import json

import numpy as np
import pytest

from tests.epochs.simulated import Network
from tribrach.epochs.series import DAY
from tribrach.geodesy.site import FlatSite
from tribrach.io.epoch_files import EpochDocument
from tribrach.questions.series.command import alarm_lines
from tribrach.questions.series.cycles import Cycle, PointAt, PointSeries, Series, SeriesSettings

BASELINE = 6
#: of a sight of a point along each axis [m]
SIGMA = 1e-3


def site(rng: np.random.Generator, cycles: int, points: int, step: float = 0.0) -> Series:
    """White cycles of one day against a baseline of six; the first point steps halfway."""
    names = [f"P{k}" for k in range(points)]
    values = rng.normal(0, SIGMA, (cycles, points, 3))
    values -= values[:BASELINE].mean(axis=0)
    values[cycles // 2 :, 0, 0] += step
    sign = np.where(np.arange(cycles) < BASELINE, -1, 1)
    sigma = SIGMA * np.sqrt(1 + sign / BASELINE)[:, None, None] * np.ones(values.shape)
    tests = ((values / sigma) ** 2).sum(axis=2)
    rows = [
        Cycle(
            f"c{k}",
            k * DAY,
            points,
            points={
                name: PointAt(
                    tuple(values[k, j]), tuple(sigma[k, j]), float(tests[k, j]), 11.34,
                    "moved" if tests[k, j] > 11.34 else "not moved",
                )
                for j, name in enumerate(names)
            },
        )
        for k in range(cycles)
    ]  # fmt: skip
    zero = EpochDocument.of(Network.measured().epoch(rng), FlatSite(), "")
    out = Series(
        SeriesSettings(references=("R",), baseline=BASELINE), zero, 1.0, tuple(rows),
        seen=dict.fromkeys(names, BASELINE),
    )  # fmt: skip
    keys = tuple(cycle.key for cycle in rows)
    out.__dict__["points"] = [
        PointSeries(name, keys, np.arange(cycles) * 1.0, values[:, j], sigma[:, j], ())
        for j, name in enumerate(names)
    ]
    return out


def alarmed(series: Series, run_length: float) -> list[int]:
    """Days with an alarm."""
    lines = alarm_lines(series, {c.key for c in series.cycles}, 0.0, run_length).splitlines()
    return sorted({int(json.loads(line)["time"][8:10]) for line in lines} if lines else set())


@pytest.mark.parametrize("run_length", [20.0, 100.0])
def test_alarms_by_chance_are_as_seldom_as_stated(run_length: float) -> None:
    """The first alarm of 25 days comes no sooner, and not ten times later."""
    rng, runs, days = np.random.default_rng(1), 400, 25
    first = [alarmed(site(rng, days, 5), run_length) for _ in range(runs)]
    never = sum(not one for one in first)
    # geometric: (1 - 1/run length) to the power of the days
    expected = (1 - 1 / run_length) ** days
    assert never / runs >= expected - 3 * np.sqrt(expected * (1 - expected) / runs)
    assert never / runs <= (1 - 0.1 / run_length) ** days


def test_a_small_step_that_stays_is_found_by_means() -> None:
    """3 sigmas of a cycle, which one cycle seldom shows at one alarm a year."""
    rng = np.random.default_rng(2)
    runs = [alarmed(site(rng, 30, 5, 3 * SIGMA), 365.0) for _ in range(40)]
    assert sum(bool(run) for run in runs) >= 38
    assert all(day > 15 for run in runs for day in run)
