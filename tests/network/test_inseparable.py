"""Snooping switches off what can be told from everything else, and nothing besides."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.network.accusations import random_network
from tribrach.io.survey.formats import read
from tribrach.network.blunders.snooping import SnoopingLog, snoop
from tribrach.network.network import Network
from tribrach.network.survey import Survey
from tribrach.observations.base import Use
from tribrach.observations.sights import Directions, HorizontalDistances
from tribrach.solution import AdjustmentSettings, SolvedNetwork, adjust_network, solve
from tribrach.units import GON

SNOOP = AdjustmentSettings(snoop=True)


def traverse(rng: np.random.Generator, gross: float) -> Network:
    """A traverse between two held points without tie angles; one direction is wrong.

    All angles check each other by one figure only.
    """
    count = int(rng.integers(3, 8))
    names = ["B", *(f"{k + 1}" for k in range(count)), "C"]
    place = np.zeros((count + 2, 2))
    place[:, 0] = 90.0 * np.arange(count + 2) + rng.normal(0, 10, count + 2)
    place[:, 1] = rng.normal(0, 30, count + 2)
    survey = Survey()
    for name, xy in zip(names, place, strict=True):
        held = name in "BC"
        survey.point(
            name, (*xy, 0.0) if held else (np.nan, np.nan, 0.0), free=(not held, not held, False),
            role="fixed" if held else "free",
        )  # fmt: skip
    every = dict(zip(names, place, strict=True))
    sights = [(names[k], names[j]) for k in range(1, count + 1) for j in (k - 1, k + 1)]
    e, n = np.array([every[b] - every[a] for a, b in sights]).T
    sigma = 1e-3 * GON
    value = np.arctan2(e, n) + sigma * rng.normal(size=len(e))
    value[rng.integers(0, 2 * count)] += gross
    ends = {"start": [a for a, _ in sights], "end": [b for _, b in sights]}
    survey.add(
        Directions, values=value % (2 * np.pi), sigma=sigma, orientation=ends["start"], **ends
    )
    legs = [(names[k], names[j]) for k in range(count + 2) for j in (k - 1, k + 1)
            if 0 <= j < count + 2]  # fmt: skip
    length = np.array([np.linalg.norm(every[b] - every[a]) for a, b in legs])
    survey.add(
        HorizontalDistances, values=length + 0.005 * rng.normal(size=len(legs)), sigma=0.005,
        start=[a for a, _ in legs], end=[b for _, b in legs],
    )  # fmt: skip
    return survey.network()


def off(solved: SolvedNetwork) -> int:
    """Observations that are switched off."""
    tables = solved.adjustment.network.observations
    return sum(int((o.use == Use.OFF).sum()) for o in tables)


def keys(solved: SolvedNetwork) -> set[str]:
    return {warning.key for warning in solved.warnings}


def stays(seed: int) -> None:
    """A wrong angle of a traverse without tie angles is named, and nothing is switched off."""
    rng = np.random.default_rng(seed)
    solved = solve(traverse(rng, rng.choice([-1, 1]) * rng.uniform(0.05, 0.4) * GON), SNOOP)
    assert off(solved) == 0, seed
    if solved.snooping is not None and solved.snooping.steps:
        assert "undecided_blunder" in keys(solved), seed
        assert solved.snooping.steps[0].undecided


@pytest.mark.parametrize("seed", range(8))
def test_nothing_is_switched_off_in_a_traverse_without_tie_angles(seed: int) -> None:
    stays(seed)


@pytest.mark.slow
def test_500_traverses_without_tie_angles() -> None:
    for seed in range(500):
        stays(seed)


def test_the_points_that_depend_on_it_are_named() -> None:
    log = snoop(traverse(np.random.default_rng(3), 0.2 * GON))[1]
    (step,) = log.steps
    assert step.undecided
    assert step.touched
    assert len(step.alternatives) >= 2


def planted(seed: int) -> tuple[Network, SnoopingLog, tuple[int, int]]:
    """A network with one wrong value of twelve times its detectable size, and its snooping."""
    rng = np.random.default_rng(seed)
    network = random_network(("polar", "levelling", "free", "traverse")[seed % 4], rng)
    tables = list(network.observations)
    measured = [k for k, o in enumerate(tables) if o.rows == 1 and o.group != "control"]
    table = int(rng.choice(measured))
    o = tables[table]
    item = int(rng.integers(len(o)))
    values = o.values.copy()
    values[item] += rng.choice([-1, 1]) * rng.uniform(10, 30) * np.sqrt(o.covariance[item, 0, 0])
    tables[table] = replace(o, values=values)
    network = replace(network, observations=tuple(tables))
    return network, snoop(network)[1], (table, item)


def innocents(seeds: range) -> tuple[int, int, int]:
    """How often the wrong value was switched off, a group was left open, an innocent was off."""
    right = undecided = innocent = 0
    for seed in seeds:
        _, log, key = planted(seed)
        right += key in log.removed
        undecided += any(step.undecided for step in log.steps)
        innocent += bool(log.removed) and key not in log.removed
    return right, undecided, innocent


def test_a_single_wrong_value_is_still_switched_off_where_it_stands_alone() -> None:
    right, undecided, innocent = innocents(range(16))
    assert innocent <= 1
    assert right >= 8
    assert right + undecided >= 14


@pytest.mark.slow
def test_an_innocent_is_hardly_ever_switched_off_alone() -> None:
    right, undecided, innocent = innocents(range(400))
    assert innocent <= 8, (right, undecided, innocent)
    assert right + undecided >= 380, (right, undecided, innocent)


def with_a_wrong_distance() -> Network:
    """A polar network with one wrong distance."""
    network = random_network("polar", np.random.default_rng(0))
    tables = list(network.observations)
    (number,) = [k for k, o in enumerate(tables) if o.kind == "slope_distance"]
    values = tables[number].values.copy()
    values[3] += 0.2
    tables[number] = replace(tables[number], values=values)
    return replace(network, observations=tuple(tables))


def test_snooping_is_advised_only_where_the_worst_stands_alone() -> None:
    settings = AdjustmentSettings()
    advised = [
        any("snooping decide" in text for text in adjust_network(network, settings).warnings)
        for network in (with_a_wrong_distance(), traverse(np.random.default_rng(3), 0.2 * GON))
    ]
    assert advised == [True, False]


def test_what_a_removal_moved_is_said_to_be_less_sure() -> None:
    network = with_a_wrong_distance()
    assert off(solve(network, SNOOP)) == 1
    assert "snooped" in keys(solve(network, SNOOP))
    assert "snooped" not in keys(solve(network, AdjustmentSettings()))


@pytest.mark.parametrize("name", ["small.gkf", "net.gkf"])
def test_traverses_of_others(shared_data: Path, name: str) -> None:
    path = shared_data / "faults" / "networks2" / "01-snoop-inseparable" / name
    if not path.is_file():
        pytest.skip(f"{path} is absent")
    solved = solve(read([path]).network(), SNOOP)
    assert off(solved) == 0
    # one cause is one sentence, and the coordinate that would do as well is one of the group
    assert "wrong_coordinate" not in keys(solved)
    assert [warning.key for warning in solved.warnings].count("undecided_blunder") == 1
