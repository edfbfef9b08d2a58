"""Control against the rest: left out in turn, and few of many as control."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.network.adjustment import adjust
from tribrach.network.network import Network
from tribrach.network.survey import Survey
from tribrach.observations.base import Use
from tribrach.observations.gnss import GnssBaselines, GnssPositions
from tribrach.questions.leave_out import LeftOutPosition, left_out
from tribrach.statistics import chi2

RUN = CliRunner()
SIGMA = np.array([3e-3, 3e-3, 5e-3])


def silent(what: str, done: int, total: int | None) -> None:
    """Nobody is told."""


def star(n: int, seed: int, *, blunder: float = 0.0, gnss: bool = False) -> Network:
    """Points around one that has vectors to all of them; the first may be off in N."""
    rng, survey = np.random.default_rng(seed), Survey()
    places = {f"C{k}": rng.uniform(0, [200, 200, 20]) for k in range(n)}
    for k, (name, xyz) in enumerate(places.items()):
        given = xyz + rng.normal(size=3) * SIGMA + [0, blunder if k == 0 else 0, 0]
        if gnss:
            survey.point(name, xyz)
            survey.add(GnssPositions, values=given[None], sigma=SIGMA[None], position=[name])
        else:
            survey.point(name, given, role="control", covariance=np.diag(SIGMA**2))
    middle = np.array([100.0, 100.0, 5.0])
    survey.point("P", middle)
    vectors = np.array([xyz - middle for xyz in places.values()])
    survey.add(
        GnssBaselines,
        values=vectors + rng.normal(size=vectors.shape) * 2e-3,
        sigma=np.full((n, 3), 2e-3),
        start=["P"] * n,
        end=list(places),
    )
    return survey.network()


@pytest.mark.parametrize("gnss", [False, True])
def test_left_out_is_what_an_adjustment_without_it_says(gnss: bool) -> None:
    network = star(6, 1, gnss=gnss)
    found = left_out(network, silent)
    assert [p.name for p in found.in_turn] == [f"C{k}" for k in range(6)]
    place = next(
        (t, int(i))
        for t, o in enumerate(network.observations)
        if not isinstance(o, GnssBaselines)
        for i, name in enumerate(o.end_names(network.start.layout)[0])
        if name == "C2"
    )
    without = adjust(network.switched([place], Use.OFF, "out"))
    given = network.observations[place[0]].values[place[1]]
    one = found.in_turn[2]
    np.testing.assert_allclose(one.difference, without.points["C2"].xyz - given, atol=1e-9)
    own = without.points["C2"].covariance + np.diag(SIGMA**2)
    np.testing.assert_allclose(one.sigma, np.sqrt(np.diag(own)), rtol=1e-6)
    table = np.array([p.difference for p in found.in_turn])
    np.testing.assert_allclose(found.spread.mean, table.mean(axis=0), atol=1e-12)
    np.testing.assert_allclose(found.spread.sd, table.std(axis=0, ddof=1))


@pytest.mark.parametrize("surveys", [100, pytest.param(300, marks=pytest.mark.slow)])
def test_differences_are_as_large_as_their_sigmas(surveys: int) -> None:
    """The tests of one position and of the checks of three have their chi-square."""
    first, checks = 0.0, 0.0
    for seed in range(surveys):
        found = left_out(star(5, seed), silent)
        first += found.in_turn[0].test.statistic
        checks += found.chosen[0].checks[0].test.statistic
    for total in (first, checks):
        assert chi2.ppf(0.0005, 3 * surveys) < total < chi2.ppf(0.9995, 3 * surveys)


def test_few_are_control_and_the_others_checks() -> None:
    found = left_out(star(12, 3), silent)
    assert [len(c.control) for c in found.chosen] == [3, 5, 9]
    for chosen in found.chosen:
        names = {*chosen.control, *(p.name for p in chosen.checks)}
        assert names == {f"C{k}" for k in range(12)}
        assert chosen.spread.count == (12 - len(chosen.control),) * 3
    # fewer control points say less
    expected = [c.spread.expected[0] for c in found.chosen]
    assert expected == sorted(expected, reverse=True)


def _failing(positions: tuple[LeftOutPosition, ...]) -> list[str]:
    return [p.name for p in positions if not p.test.passed]


def test_a_wrong_point_shows() -> None:
    assert "C0" in _failing(left_out(star(10, 0, blunder=0.05), silent).in_turn)


def test_what_nothing_else_holds_is_needed() -> None:
    survey = Survey()
    for name, x in (("A", 0.0), ("B", 50.0)):
        xyz = np.array([x, 0.0, 0.0])
        survey.point(name, xyz, role="control", covariance=np.diag(SIGMA**2))
    survey.point("P", (20, 20, 1))
    given = {"values": [[20.0, 20.0, 1.0]], "sigma": [[1e-3] * 3], "start": ["A"], "end": ["P"]}
    survey.add(GnssBaselines, **given)
    found = left_out(survey.network(), silent)
    assert found.needed == ("A", "B")
    assert found.in_turn == ()
    assert np.isnan(found.ratio)


POINTS = """\
point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm
A,0,0,10,2,2,2
B,50,0,10,2,2,2
C,50,50,11,2,2,2
D,0,50,11,2,2,2
"""
VECTORS = """\
from,to,de_m,dn_m,du_m,sigma_de_mm,sigma_dn_mm,sigma_du_mm
A,B,50.001,0,0,1,1,1
B,C,0,50.001,1,1,1,1
C,D,-50,0.001,0,1,1,1
D,A,0,-50,-1.001,1,1,1
"""


def test_the_command_writes_its_answer(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text(POINTS)
    (tmp_path / "v.csv").write_text(VECTORS)
    files = [str(tmp_path / name) for name in ("p.csv", "v.csv")]
    out = tmp_path / "left.json"
    page = tmp_path / "left.html"
    answer = RUN.invoke(app, ["leave-out", *files, "--json", str(out), "--html", str(page)])
    assert answer.exit_code == 0, answer.output
    data = json.loads(out.read_text())
    assert [p["name"] for p in data["in_turn"]] == ["A", "B", "C", "D"]
    assert [len(c["control"]) for c in data["chosen"]] == [3]
    assert page.stat().st_size > 1000


def test_one_point_is_refused() -> None:
    survey = Survey()
    survey.point("A", (0, 0, 0), role="control", covariance=np.diag(SIGMA**2))
    survey.point("P", (20, 20, 1))
    given = {"values": [[20.0, 20.0, 1.0]], "sigma": [[1e-3] * 3], "start": ["A"], "end": ["P"]}
    survey.add(GnssBaselines, **given)
    with pytest.raises(InputError, match="1 given position "):
        left_out(survey.network(), silent)
