"""One mistyped coordinate of control is one sentence; nobody else is accused, nor a good one."""

from dataclasses import replace

import numpy as np
import pytest

from tribrach.network.adjustment import adjust
from tribrach.network.blunders.control_mistakes import wrong_coordinate
from tribrach.network.given_coordinates import given_coordinates, released
from tribrach.network.network import Network
from tribrach.network.survey import Survey
from tribrach.observations.control import Coordinates
from tribrach.observations.sights import Directions, SlopeDistances, ZenithAngles
from tribrach.simulate.surveying import observe
from tribrach.solution import AdjustmentSettings, adjust_network
from tribrach.units import SEC

CONTROL = tuple(f"P{k}" for k in range(7))
STATIONS = ("S0", "S1", "S2")


def places() -> dict[str, np.ndarray]:
    """Seven points around three set-ups, hundreds of metres."""
    turn = 2 * np.pi * np.arange(7) / 7
    out = {
        name: np.array([150 + 140 * np.cos(a), 100 + 110 * np.sin(a), 20 + 6 * np.sin(3 * a)])
        for name, a in zip(CONTROL, turn, strict=True)
    }
    xy = ((110, 80), (190, 90), (150, 130))
    return out | {name: np.array([*at, 18.0]) for name, at in zip(STATIONS, xy, strict=True)}


def network(role: str, seed: int = 1, error: dict[tuple[str, int], float] | None = None) -> Network:
    """Sights from three set-ups to seven control points, held or given with 3 mm."""
    truth = places()
    survey = Survey()
    for line, (name, x) in enumerate(truth.items()):
        given = x.copy()
        for (point, axis), size in (error or {}).items():
            given[axis] += size if point == name else 0.0
        if name not in CONTROL:
            survey.point(name, x)
            continue
        held = role == "fixed"
        survey.point(
            name,
            given,
            free=(not held,) * 3,
            role="fixed" if held else "control",
            covariance=None if held else 9e-6 * np.eye(3),
            source=f"control.csv:{line + 2}",
        )
    start = [s for s in STATIONS for t in truth if t != s]
    end = [t for s in STATIONS for t in truth if t != s]
    chord = np.array([truth[b] - truth[a] for a, b in zip(start, end, strict=True)])
    flat = np.hypot(chord[:, 0], chord[:, 1])
    ends = {"start": start, "end": end, "source": [f"tps.csv:{k + 2}" for k in range(len(end))]}
    circle = [f"circle {s}" for s in start]
    azimuth = np.arctan2(chord[:, 0], chord[:, 1])
    survey.add(Directions, values=azimuth, sigma=5 * SEC, orientation=circle, **ends)
    survey.add(ZenithAngles, values=np.arctan2(flat, chord[:, 2]), sigma=5 * SEC, **ends)
    survey.add(SlopeDistances, values=np.linalg.norm(chord, axis=1), sigma=0.002, **ends)
    exact = survey.network()
    tables = exact.observations
    drawn = observe(exact, adjust(network_truth(exact)).state, np.random.default_rng(seed))
    # given coordinates stay as they were written, whatever was drawn for them
    keep = [
        o if o.group == "control" else d for o, d in zip(tables, drawn.observations, strict=True)
    ]
    return replace(drawn, observations=tuple(keep), start=exact.start)


def network_truth(exact: Network) -> Network:
    """The same with true coordinates, so that observations are drawn around the truth."""
    truth, names = places(), exact.start.layout.names["point"]
    start = replace(exact.start, points=np.array([truth[name] for name in names]))
    tables = []
    for o in exact.observations:
        if o.group == "control":
            o = replace(o, values=start.points[o.position])  # type: ignore[attr-defined]
        tables.append(o)
    return replace(exact, observations=tuple(tables), start=start)


@pytest.mark.parametrize("role", ["fixed", "control"])
@pytest.mark.parametrize(("point", "axis"), [("P2", 0), ("P5", 1), ("P4", 2)])
def test_one_mistyped_coordinate_is_one_sentence(role: str, point: str, axis: int) -> None:
    bad = network(role, 3, {(point, axis): 0.031})
    found = wrong_coordinate(adjust(bad))
    assert found is not None
    assert found.certain
    (coordinate,) = found.coordinates
    assert (coordinate.point, coordinate.axis, coordinate.held) == (point, axis, role == "fixed")
    assert abs(found.error[0] - 0.031) < 4 * found.sigma[0]
    assert found.sigma[0] < 0.006
    assert found.before.sigma0_posterior > 1.25
    assert found.after.sigma0_posterior == pytest.approx(1.0, abs=0.25)
    assert found.after.dof == found.before.dof - 1
    assert f"{'ENU'[axis]} of {point} (control.csv:" in found.sentence()


@pytest.mark.parametrize("role", ["fixed", "control"])
def test_the_report_says_it_once(role: str) -> None:
    """Not the many observations that it spoils, nor the failed test, nor other control points."""
    for settings in (AdjustmentSettings(), AdjustmentSettings(posterior=True)):
        content = adjust_network(network(role, 3, {("P2", 0): 0.031}), settings)
        (warning,) = content.warnings
        assert "E of P2 (control.csv:4) is wrong: +3" in warning
        assert "sigma0 is" in warning
        assert "compare it with where the coordinates come from" in warning
        assert content.summary.test.accepted is False


@pytest.mark.parametrize("role", ["fixed", "control"])
def test_snooping_leaves_the_coordinate_and_the_good_observations_alone(role: str) -> None:
    """With one direction wrong as well: that one goes, and nothing else."""
    bad = network(role, 3, {("P2", 0): 0.031})
    tables = list(bad.observations)
    values = tables[0].values.copy()
    values[3] += 60 * SEC
    tables[0] = replace(tables[0], values=values)
    bad = replace(bad, observations=tuple(tables))
    content = adjust_network(bad, AdjustmentSettings(snoop=True))
    steps = content.snooping
    assert steps[0].action == "suspicious control, kept"
    assert "E of P2" in steps[0].observation
    assert {step.action for step in steps[1:]} == {"switched off"}
    off = [o.source for o in content.observations if o.state == "off"]
    assert "tps.csv:5" in off
    assert len(off) <= 2  # one of 108 good ones may look wrong at 0.1 %
    assert not any("uspicious observations take part" in text for text in content.warnings)
    # it stays in the network, and its point where it was given
    if role == "fixed":
        assert content.adjustment.points["P2"].xyz[0] == places()["P2"][0] + 0.031


def test_a_wrong_reading_does_not_accuse_control() -> None:
    """A distance 30 mm off explains itself better than any coordinate does."""
    for role in ("fixed", "control"):
        good = network(role, 4)
        tables = list(good.observations)
        values = tables[2].values.copy()
        values[5] += 0.03
        tables[2] = replace(tables[2], values=values)
        assert wrong_coordinate(adjust(replace(good, observations=tuple(tables)))) is None


def test_sigmas_that_are_too_small_everywhere_accuse_nobody() -> None:
    for role in ("fixed", "control"):
        good = network(role, 5)
        tight = tuple(replace(o, covariance=o.covariance / 16) for o in good.observations)
        adjustment = adjust(replace(good, observations=tight))
        assert adjustment.sigma0_posterior > 3
        assert wrong_coordinate(adjustment) is None


def test_what_a_single_sight_could_explain_as_well_is_named_beside_it() -> None:
    """P6 is sighted along one line only: its coordinate there or that distance, nobody can tell."""
    truth = network("fixed", 6, {("P0", 0): 0.05})
    tables = []
    layout = truth.start.layout
    target, setup = layout.position_index("P0"), layout.position_index("S0")
    for o in truth.observations:
        use = np.where((o.end == target) & (o.start != setup), 2, o.use)  # type: ignore[attr-defined]
        tables.append(replace(o, use=use.astype(np.int8)))
    found = wrong_coordinate(adjust(replace(truth, observations=tuple(tables))))
    assert found is not None
    assert not found.certain
    assert any("S0 -> P0" in words for words in found.alternatives)
    assert "may be wrong" in found.sentence()
    assert "look at both" in found.sentence()


@pytest.mark.parametrize("seed", range(6))
def test_good_networks_accuse_nobody(seed: int) -> None:
    for role in ("fixed", "control"):
        assert wrong_coordinate(adjust(network(role, 100 + seed))) is None


def test_a_point_that_moved_is_named_as_a_whole() -> None:
    found = wrong_coordinate(
        adjust(network("control", 7, {("P1", 0): 0.05, ("P1", 1): -0.06, ("P1", 2): 0.04}))
    )
    assert found is not None
    assert [g.axis for g in found.coordinates] == [0, 1, 2]
    assert found.error == pytest.approx([0.05, -0.06, 0.04], abs=0.012)
    assert "E, N and U of P1 (control.csv:3) are wrong" in found.sentence()


def test_a_held_coordinate_is_tested_as_if_it_were_an_unknown() -> None:
    """The estimated bias and its sigma are those of the adjustment that frees the coordinate."""
    adjustment = adjust(network("fixed", 8, {("P3", 1): 0.004}))
    given = given_coordinates(adjustment)
    k = next(k for k, g in enumerate(given.items) if (g.point, g.axis) == ("P3", 1))
    statistic, freedom, error, sigma = given.test(np.array([k]))
    after = adjust(released(adjustment.network, (given.items[k],)))
    column = given.items[k].column
    moved = adjustment.state.points[3, 1] - after.state.points[3, 1]
    assert freedom == 1
    assert error[0] == pytest.approx(moved, rel=1e-3)
    assert sigma[0] == pytest.approx(np.sqrt(after.covariance("P3")[1, 1]), rel=1e-4)
    assert statistic == pytest.approx(adjustment.vtpv - after.vtpv, rel=1e-3)
    assert after.network.free[column]


def test_what_is_left_of_a_released_point_keeps_its_covariance() -> None:
    """Correlated control: E goes, N and U stay with theirs, also in a joint covariance."""
    correlated = 1e-6 * np.array([[9.0, 3.0, 1.0], [3.0, 8.0, 2.0], [1.0, 2.0, 7.0]])
    survey = Survey()
    survey.point("A", (0.0, 0.0, 0.0), covariance=correlated)
    survey.add(Coordinates, values=[[0.0, 0.0, 0.0]], sigma=0.001, position=["A"])
    adjustment = adjust(survey.network())
    item = next(g for g in given_coordinates(adjustment).items if g.axis == 0)
    after = adjust(released(adjustment.network, (item,)))
    (joint,) = after.network.joint
    assert joint.covariance == pytest.approx(correlated[1:, 1:])
    assert after.dof == adjustment.dof - 1
    expected = np.linalg.inv(np.linalg.inv(correlated[1:, 1:]) + 1e6 * np.eye(2))
    assert after.covariance("A")[1:, 1:] == pytest.approx(expected)


@pytest.mark.parametrize("role", ["fixed", "control"])
def test_a_wrong_digit_of_tens_of_metres_is_the_same_sentence(role: str) -> None:
    """Also where everything is bent so far that names might be thought exchanged."""
    content = adjust_network(network(role, 3, {("P2", 0): 10.0}), AdjustmentSettings())
    (warning,) = content.warnings
    assert "E of P2 (control.csv:4) is wrong: +10.00" in warning
    assert "m ± " in warning
