"""Absolute and relative accuracy: closed forms of simple networks, and the words for them."""

import json
from pathlib import Path

import numpy as np
import pytest

from tribrach.job.opened import open_job
from tribrach.network.adjustment import adjust
from tribrach.network.site_accuracy import sessions, site_accuracy
from tribrach.network.survey import Survey
from tribrach.observations.control import VectorPriors
from tribrach.observations.gnss import GnssPositions
from tribrach.pipeline import run
from tribrach.project import Project

#: a square of 40 m
PLACES = np.array([[-20.0, -20, 0], [20, -20, 0], [20, 20, 0], [-20, 20, 0]])
OWN, COMMON = np.array([0.014, 0.014, 0.035]), np.array([0.010, 0.012, 0.030])


def positions(common: bool) -> Survey:
    survey = Survey()
    survey.add(
        GnssPositions,
        values=PLACES,
        sigma=np.tile(OWN, (4, 1)),
        position=list("ABCD"),
        common=["common shift of s"] * 4 if common else [""] * 4,
    )
    if common:
        survey.vectors["common shift of s"] = (np.zeros(3), True)
        survey.add(
            VectorPriors, values=np.zeros((1, 3)), sigma=[COMMON], vector=["common shift of s"]
        )
    return survey


def test_a_common_shift_is_absolute_alone() -> None:
    """Four independent positions and what they share: mean, difference, turns in closed form."""
    alone, shared = (site_accuracy(adjust(positions(c).network())) for c in (False, True))
    assert alone is not None
    assert shared is not None
    assert alone.shift == pytest.approx(OWN / 2, rel=1e-6)
    assert shared.shift == pytest.approx(np.sqrt(OWN**2 / 4 + COMMON**2), rel=1e-6)
    for found in (alone, shared):
        assert found.pair == pytest.approx(OWN * np.sqrt(2), rel=1e-6)
        # turns about E, N by heights: sum of squares of the levers 4 * 400 m^2; heading 4 * 800
        expected = (OWN[2] / 40, OWN[2] / 40, OWN[0] / np.sqrt(3200))
        assert found.turn == pytest.approx(expected, rel=1e-6)
        # of 12 values 6 are rigid motions: in height 1 of 4 values is left
        assert found.inner[2] == pytest.approx(OWN[2] / 2, rel=1e-6)
        assert found.radius == pytest.approx(np.hypot(20, 20))
    assert shared.point == pytest.approx(np.sqrt(OWN**2 + COMMON**2), rel=1e-6)
    (session,) = sessions(adjust(positions(True).network()))
    assert (session.name, session.count) == ("common shift of s", 4)
    assert session.sigma == pytest.approx(COMMON)


def test_fewer_than_three_places_say_nothing() -> None:
    survey = Survey()
    survey.add(GnssPositions, values=PLACES[:2], sigma=np.tile(OWN, (2, 1)), position=list("AB"))
    assert site_accuracy(adjust(survey.network())) is None


PROJECT = """\
[instruments.rtk]
sheet = "NetRTK"

[[observations]]
file = "gnss.csv"
instrument = "rtk"

[[observations]]
file = "rods.csv"
instrument = "rod"

[instruments.rod]
sheet = "Target on rod"
{more}
"""


def project(folder: Path, more: str = "", session: str = "one") -> Project:
    rows = ["gnss,set,e_m,n_m,u_m,antenna_height_m"]
    rows += [f"M{k},{session},{e},{n},{u + 102},2.0" for k, (e, n, u) in enumerate(PLACES)]
    (folder / "gnss.csv").write_text("\n".join(rows))
    rods = ["mark,target,rod_m"] + [f"M{k},P{k},{1.8 + 0.1 * k}" for k in range(4)]
    (folder / "rods.csv").write_text("\n".join(rods))
    path = folder / "p.toml"
    path.write_text(PROJECT.format(more=more))
    return Project.load(path)


def test_the_report_says_what_is_absolute(tmp_path: Path) -> None:
    """2 cm and 5 cm, half of it common, rods with bubbles of 8 arc minutes: 2.3 mm per metre."""
    run(project(tmp_path))
    data = json.loads((tmp_path / "out" / "result.json").read_text())["georeferencing"]
    # marks under targets are left out: four spheres
    assert data["relative"]["worst_between"][0].startswith("P")
    common = data["absolute"]["common"]["common shift of one"]
    assert common["sigma"] == pytest.approx(np.sqrt(0.5) * np.array([0.02, 0.02, 0.05]), rel=1e-9)
    assert common["positions"] == 4
    lean = np.radians(8 / 60) * np.array([1.8, 1.9, 2.0, 2.1])
    expected = np.sqrt(0.02**2 / 2 + (0.02**2 / 2 + (lean**2).mean()) / 4)
    assert data["absolute"]["shift"][0] == pytest.approx(expected, rel=1e-3)
    up = np.sqrt(0.05**2 / 2 + (0.05**2 / 2 + 0.0005**2) / 4)
    assert data["absolute"]["shift"][2] == pytest.approx(up, rel=1e-3)
    text = " ".join((tmp_path / "out" / "report.txt").read_text().split())
    assert "Absolute: the site as a whole is known to" in text
    assert "no measurement on the site makes it smaller" in text
    assert "There are no check points" in text
    assert "Absolute and relative accuracy" in (tmp_path / "out" / "report.html").read_text()


def test_positions_without_a_session_are_doubted(tmp_path: Path) -> None:
    run(project(tmp_path, session=""))
    text = " ".join((tmp_path / "out" / "report.txt").read_text().split())
    assert "taken as independent of each other" in text


def test_check_points_are_independent(tmp_path: Path) -> None:
    (tmp_path / "c.csv").write_text(
        "point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm\nP0,-20.003,-19.996,101.812,1,1,1\n"
    )
    run(project(tmp_path, '[[points]]\nfile = "c.csv"\nrole = "check"\n'))
    data = json.loads((tmp_path / "out" / "result.json").read_text())["georeferencing"]
    assert data["check"]["points"] == 1
    assert data["check"]["rmse"] == pytest.approx([0.003, 0.004, 0.012], abs=1e-6)


def test_the_common_share_is_the_instruments(tmp_path: Path) -> None:
    own = project(tmp_path)
    own_text = (tmp_path / "p.toml").read_text()
    for share in (0.0, 0.8):
        (tmp_path / "p.toml").write_text(
            own_text.replace('sheet = "NetRTK"', f'sheet = "NetRTK"\ngnss_common_share = {share}')
        )
        found = sessions(adjust(open_job(tmp_path / "p.toml").network()))
        if share:
            assert found[0].sigma[2] == pytest.approx(0.05 * np.sqrt(share))
        else:
            assert found == []
    assert sessions(adjust(open_job(own).network()))[0].sigma[2] == pytest.approx(
        0.05 * np.sqrt(0.5)
    )


def test_a_free_network_has_no_absolute_accuracy(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    places = rng.uniform(-10, 10, (5, 3))
    rows = ["station,target,x_m,y_m,z_m,sigma_x_mm,sigma_y_mm,sigma_z_mm"]
    for station, shift in (("S1", 0.0), ("S2", 3.0)):
        rows += [
            f"{station},T{k},{x - shift:.4f},{y:.4f},{z:.4f},1,1,1"
            for k, (x, y, z) in enumerate(places)
        ]
    (tmp_path / "t.csv").write_text("\n".join(rows))
    path = tmp_path / "p.toml"
    path.write_text('datum = "free"\n[[observations]]\nfile = "t.csv"\n')
    content = run(Project.load(path))
    (chapter,) = [c for c in content.chapters if c.name == "georeferencing"]
    assert any("There is no absolute accuracy" in text for text in chapter.sentences)
    assert chapter.data.absolute is None
    assert chapter.data.relative.pair[0] < 0.002


def test_held_points_count_as_free_of_errors(tmp_path: Path) -> None:
    project(tmp_path)
    (tmp_path / "c.csv").write_text("point,e_m,n_m,u_m\nP0,-20,-20,101.8\n")
    path = tmp_path / "p.toml"
    path.write_text(path.read_text() + '[[points]]\nfile = "c.csv"\nrole = "fixed"\n')
    (chapter,) = [c for c in run(Project.load(path)).chapters if c.name == "georeferencing"]
    assert any("count as free of errors" in text for text in chapter.sentences)
    # three free spheres are left; the common shift is known through the held one
    assert chapter.data.absolute.shift[2] < 0.05 * np.sqrt(0.5 + 0.5 / 3)
