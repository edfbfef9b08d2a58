"""The public names: what Python users see is what the command line does."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import tribrach as tb
from tests.network.networks import scanner_network, trilateration
from tribrach.answers import plain
from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.network.adjustment import Options
from tribrach.network.network import Datum
from tribrach.report import json_result
from tribrach.solution import AdjustmentSettings, adjust_network

SIGHTS = (
    "from,to,horizontal_distance_m,sigma_horizontal_distance_mm\n"
    "A,P,70.712,2\nB,P,70.710,2\nA,Q,70.709,2\nB,Q,70.711,2\nA,P,70.741,2\nP,Q,100.001,2\n"
)


@pytest.fixture
def files(tmp_path: Path) -> list[Path]:
    (tmp_path / "points.csv").write_text("point,e_m,n_m,role\nA,0,0,fixed\nB,100,0,fixed\n")
    (tmp_path / "sights.csv").write_text(SIGHTS)
    (tmp_path / "job.toml").write_text(
        'confidence = 0.99\n[[points]]\nfile = "points.csv"\n'
        '[[observations]]\nfile = "sights.csv"\n'
        "[adjustment]\nsnoop = true\nposterior = true\n"
    )
    return [tmp_path / "points.csv", tmp_path / "sights.csv"]


def test_every_public_name_is_there_and_shown() -> None:
    assert set(tb.__all__) <= set(dir(tb))
    for name in tb.__all__:
        assert getattr(tb, name) is not None
    with pytest.raises(AttributeError):
        _ = tb.no_such_name


def test_importing_loads_nothing_heavy() -> None:
    heavy = "('numpy', 'scipy', 'numba', 'polars', 'pyproj')"
    code = f"import sys, tribrach; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_whatever_holds_a_network_is_adjusted_alike(files: list[Path]) -> None:
    survey = tb.read(files)
    expected = tb.adjust(files)
    for subject in (survey, [str(file) for file in files], (file for file in files)):
        again = tb.adjust(subject)
        assert again.points["P"].xyz[:2].tolist() == expected.points["P"].xyz[:2].tolist()
    with pytest.raises(InputError, match="leave options out"):
        tb.adjust(files[0].parent / "job.toml", options=Options(max_iterations=9))


def test_a_project_is_adjusted_as_it_says(files: list[Path]) -> None:
    project = files[0].parent / "job.toml"
    report = tb.run(str(project), files[0].parent / "out")
    off = [row.id for row in report.adjustment.observations if row.state == "off"]
    assert off == ["horizontal_distance:A:P:sights.csv:2"]
    for subject in (project, tb.Project.load(project), tb.open_job(project)):
        adjustment = tb.adjust(subject)
        assert adjustment.points["P"].xyz[0] == report.adjustment.points["P"].xyz[0]
        assert [row.id for row in adjustment.observations if row.state == "off"] == off


def test_the_report_of_a_run_holds_the_adjustment(files: list[Path]) -> None:
    report = tb.run(files[0].parent / "job.toml", str(files[0].parent / "out"))
    assert report.results.scale == "a posteriori"
    assert report.results.confidence == 0.99
    for row in report.points:
        point = report.results.points[row.name]
        given = [x is not None for x in row.xyz]
        np.testing.assert_array_equal(point.xyz[given], [x for x in row.xyz if x is not None])
        np.testing.assert_allclose(point.covariance, np.array(row.covariance, dtype=float))
        assert row.role == point.role
        if row.ellipse is not None:
            assert row.ellipse.major == pytest.approx(point.ellipse.major)
            assert row.ellipse.azimuth == pytest.approx(point.ellipse.azimuth)
    assert report.datum.sentence == report.results.datum
    assert "\n" not in repr(report)
    assert "<td>P</td>" in report._repr_html_()


def test_frames_are_what_the_json_says(files: list[Path], tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    done = CliRunner().invoke(app, ["adjust", *map(str, files), "--json", str(path), "-q"])
    assert done.exit_code == 0, done.output
    data = json.loads(path.read_text())
    adjustment = tb.adjust(files)
    frame = adjustment.to_frame()
    assert [row["id"] for row in data["observations"]] == frame["id"].to_list()
    for row, other in zip(data["observations"], frame.rows(named=True), strict=True):
        shared = row.keys() & other.keys()
        assert len(shared) >= 19
        for key in shared:
            same = row[key] == other[key]
            assert same or row[key] == pytest.approx(other[key], rel=1e-12), key
    for row in adjustment.to_frame("points").rows(named=True):
        entry = data["points"][row["name"]]
        assert [row["e"], row["n"], row["u"]] == entry["xyz"]
        assert row["role"] == entry["role"]
        assert row["c_en"] == pytest.approx(entry["covariance"][0][1], rel=1e-12, abs=1e-20)


def test_stations_of_the_json_are_those_by_name() -> None:
    adjustment = tb.adjust(scanner_network(np.random.default_rng(9))[0])
    frame = adjustment.to_frame("stations")
    assert frame["name"].to_list() == list(adjustment.stations)
    assert frame["sigma_rotation_u"][1] == adjustment.stations["S1"].sigma[5]


def test_edits_stand_in_the_json(files: list[Path], tmp_path: Path) -> None:
    network = tb.adjust(files).network.without("sights.csv:6", reason="prism tilted", by="AB")
    network = network.with_sigma("sights.csv:2", 0.004, reason="wind")
    content = adjust_network(network, AdjustmentSettings())
    assert json_result.network(content)["edits"] == [
        {
            "id": "horizontal_distance:A:P:sights.csv:2",
            "action": "off",
            "reason": "prism tilted",
            "by": "AB",
            "at": "",
        },
        {
            "id": "horizontal_distance:A:P:sights.csv:1",
            "action": "sigma 0.004",
            "reason": "wind",
            "by": "",
            "at": "",
        },
    ]


def test_a_survey_made_in_python_is_adjusted() -> None:
    survey = trilateration(Datum("free"))
    assert tb.adjust(survey).dof == tb.adjust(survey.network()).dof == 1


def test_adjust_takes_the_options_of_the_command(files: list[Path], tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    words = ["--snoop", "--posterior", "--confidence", "0.99", "--datum", "fixed:A,B"]
    done = CliRunner().invoke(app, ["adjust", *map(str, files), *words, "--json", str(path), "-q"])
    assert done.exit_code == 0, done.output
    data = json.loads(path.read_text())
    options = {"snoop": True, "posterior": True, "confidence": 0.99, "datum": "fixed:A,B"}
    adjustment = tb.adjust(files, **options)
    for name, point in adjustment.points.items():
        entry = data["points"][name]
        assert point.xyz[:2] == pytest.approx(entry["xyz"][:2], abs=1e-12)
        assert point.covariance[:2, :2] == pytest.approx(np.array(entry["covariance"])[:2, :2])
        assert point.scale == "a posteriori"
    off = [row["id"] for row in data["observations"] if row["state"] == "off"]
    assert [row.id for row in adjustment.observations if row.state == "off"] == off != []
    assert adjustment.points["P"].confidence == 0.99
    assert adjustment.sigma0_prior == 1.0
    assert tb.adjust(files).points["P"].scale == "a priori"
    robust = tb.adjust(tb.read(files), robust="huber", vce=True)
    assert robust.points["P"].xyz[0] == pytest.approx(50, abs=0.1)
    with pytest.raises(InputError, match="leave options out"):
        tb.adjust(files, options=Options(), snoop=True)


def test_observations_are_found_by_file_and_line(files: list[Path]) -> None:
    rows = tb.adjust(files).observations
    assert rows["sights.csv:6"].id == "horizontal_distance:A:P:sights.csv:2"
    assert [row.id for row in rows.of("sights.csv:6")] == [rows["sights.csv:6"].id]
    with pytest.raises(InputError, match=r"did you mean sights\.csv"):
        _ = rows["sight.csv:6"]


def test_differences_of_places_state_what_both_share() -> None:
    """Distance, azimuth and difference against sums by hand, of points and stations."""
    adjustment = tb.adjust(scanner_network(np.random.default_rng(7))[0].network())
    a, b = next(iter(adjustment.points)), next(iter(adjustment.stations))
    between = adjustment.difference(a, b)
    np.testing.assert_allclose(
        between.xyz, adjustment.stations[b].xyz - adjustment.points[a].xyz, rtol=1e-12
    )
    own = [adjustment.covariance(name)[:3, :3] for name in (a, b)]
    cross = adjustment.covariance(a, b)[:3, :3]
    np.testing.assert_allclose(between.covariance, sum(own) - cross - cross.T, atol=1e-15)
    length = adjustment.distance(a, b)
    step = between.xyz / length.value
    assert length.value == pytest.approx(np.linalg.norm(between.xyz))
    assert length.sigma == pytest.approx(np.sqrt(step @ between.covariance @ step))
    azimuth = adjustment.direction(a, b)
    east, north = between.xyz[:2]
    assert np.tan(azimuth.value) == pytest.approx(east / north)
    across = np.array([north, -east, 0]) / np.hypot(east, north)
    assert azimuth.sigma * np.hypot(east, north) == pytest.approx(
        np.sqrt(across @ between.covariance @ across)
    )
    assert adjustment.distance(a, b, horizontal=True).value == pytest.approx(np.hypot(east, north))
    with pytest.raises(InputError, match="one place"):
        adjustment.distance(a, a)
    with pytest.raises(InputError, match="did you mean"):
        adjustment.distance(a, b + "x")


def test_verbs_find_what_commands_write(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-3, 3, (2, 4000))
    for name, up in (("a", 0.01), ("b", 0.0)):
        xyz = np.stack([10 + x, y, up + rng.normal(0, 0.001, 4000)], axis=1)
        np.savetxt(tmp_path / f"{name}.xyz", xyz, fmt="%.5f")
    a, b = tmp_path / "a.xyz", tmp_path / "b.xyz"
    path = tmp_path / "c.json"
    done = CliRunner().invoke(app, ["compare", str(a), str(b), "--json", str(path), "-q"])
    assert done.exit_code == 0, done.output
    found = tb.compare(a, str(b))
    written = json.loads(path.read_text())
    own = json.loads(json.dumps(plain(found)))
    assert own == {key: written[key] for key in own} != {}
    with pytest.raises(InputError):
        tb.register([a])
    with pytest.raises(InputError):
        tb.noise([tmp_path / "none.e57"])
    with pytest.raises(InputError):
        tb.calibrate(tmp_path / "none.toml")
