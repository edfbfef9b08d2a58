"""A list of control that is written otherwise as a whole is one sentence, and accuses no point."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.network.test_control_mistakes import CONTROL, network
from tribrach.errors import TribrachError
from tribrach.job.opened import open_job
from tribrach.network.adjustment import adjust
from tribrach.network.blunders.control_mistakes import wrong_coordinate, wrong_list
from tribrach.network.network import Network
from tribrach.project import Project
from tribrach.questions.adjust.adjusted import adjust_job
from tribrach.solution import AdjustmentSettings, solve

SNOOP = AdjustmentSettings(snoop=True)


def written(plain: Network, change: Callable[[np.ndarray], np.ndarray]) -> Network:
    """The network with all of its control written otherwise."""
    tables = tuple(
        replace(o, values=change(o.values)) if o.group == "control" else o
        for o in plain.observations
    )
    points = plain.start.points.copy()
    control = [plain.start.layout.index("point", name) for name in CONTROL]
    points[control] = change(points[control])
    return replace(plain, observations=tables, start=replace(plain.start, points=points))


def times(*factor: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda xyz: xyz * np.array(factor)


def columns(*order: int) -> Callable[[np.ndarray], np.ndarray]:
    return lambda xyz: xyz[:, order]


FORMS = {
    "as millimetres": times(1e3, 1e3, 1e3),
    "as feet": times(3.2808399, 3.2808399, 3.2808399),
    "as centimetres": times(100, 100, 100),
    "as kilometres": times(1e-3, 1e-3, 1e-3),
    "heights fit as millimetres": times(1, 1, 1e3),
    "heights fit as feet": times(1, 1, 3.2808399),
    "northing and height look exchanged": columns(0, 2, 1),
    "easting and height look exchanged": columns(2, 1, 0),
    "easting and northing and height look exchanged": columns(2, 0, 1),
    "height looks reversed": times(1, 1, -1),
}


def said(bad: Network) -> tuple[dict[str, list[str]], int]:
    """What is said of a network by key, or why it is refused, and how much was switched off."""
    try:
        solved = solve(bad, SNOOP)
    except TribrachError as error:
        return {"refused": [str(error)]}, 0
    out: dict[str, list[str]] = {}
    for warning in solved.warnings:
        out.setdefault(warning.key, []).append(warning.text)
    off = [s for s in solved.snooping.steps if s.action == "switched off"]  # type: ignore[union-attr]
    return out, len(off)


@pytest.mark.parametrize("role", ["fixed", "control"])
@pytest.mark.parametrize("form", FORMS)
def test_another_form_of_the_whole_list_is_one_sentence(role: str, form: str) -> None:
    found, off = said(written(network(role, 3), FORMS[form]))
    found.pop("snooped", None)
    assert set(found) <= {"wrong_list", "refused"}
    (text,) = [t for texts in found.values() for t in texts]
    assert form in text
    assert "all 7 points in control.csv" in text
    assert off <= 1  # one of 108 good ones may look wrong at 0.1 %


@pytest.mark.parametrize("role", ["fixed", "control"])
def test_mirrored_networks_have_either_angles_or_axes_the_other_way(role: str) -> None:
    found, _ = said(written(network(role, 3), columns(1, 0, 2)))
    assert "wrong_coordinate" not in found
    (text,) = [t for texts in found.values() for t in texts]
    assert "easting and northing" in text


@pytest.mark.parametrize("role", ["fixed", "control"])
@pytest.mark.parametrize("ppm", [400.0, -400.0, 120.0])
def test_a_scale_of_all_points_accuses_none(role: str, ppm: float) -> None:
    """Grid coordinates of a projection, taken for lengths on the ground."""
    scaled = 1 + ppm * 1e-6
    bad = written(network(role, 5), times(scaled, scaled, 1))
    found = wrong_list(adjust(bad))
    assert found is not None
    assert found.certain
    assert abs(1e6 * found.scale - ppm) < 4e6 * found.sigma
    solved = solve(bad, SNOOP)
    keys = {w.key for w in solved.warnings}
    assert "wrong_list" in keys
    assert not keys & {"wrong_coordinate", "mistake"}
    assert solved.snooping is not None
    assert sum(step.action == "switched off" for step in solved.snooping.steps) <= 2


@pytest.mark.parametrize("role", ["fixed", "control"])
def test_one_wrong_coordinate_is_no_scale(role: str) -> None:
    for seed, (point, axis, size) in enumerate(
        [("P0", 0, 0.03), ("P3", 0, -0.05), ("P1", 1, 0.02), ("P4", 0, 53.0), ("P6", 1, 0.4)]
    ):
        first = adjust(network(role, seed, {(point, axis): size}))
        assert wrong_list(first) is None
        found = wrong_coordinate(first)
        assert found is not None
        assert {g.point for g in found.coordinates} == {point}


def test_good_lists_are_not_accused() -> None:
    found = [wrong_list(adjust(network("control", seed))) for seed in range(60)]
    assert sum(one is not None for one in found) <= 1


@pytest.mark.parametrize(
    ("folder", "word"),
    [("mm", "as millimetres"), ("usft", "as feet"), ("EN", "easting and northing look exchanged")],
)
def test_lists_of_an_independent_world(shared_data: Path, folder: str, word: str) -> None:
    case = shared_data / "faults" / "worlds" / "07-control-in-another-unit" / folder
    try:
        texts = list(adjust_job(open_job(Project.load(case / "p.toml"))).warnings)
    except TribrachError as error:
        texts = [str(error)]
    assert len([t for t in texts if word in t]) == 1
    assert not [t for t in texts if "may be wrong" in t or "are wrong" in t or "blunder" in t]
