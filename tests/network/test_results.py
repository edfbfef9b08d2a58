"""Results by name say what the arrays of the solver say; edits give a new network."""

import copy
import json
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest

import tribrach as tb
from tests.network.networks import scanner_network, trilateration
from tribrach.errors import InputError, RankDefect, TribrachError, UnknownName
from tribrach.job.opened import Job
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.ellipsoids import confidence_factor, plan_ellipses
from tribrach.network.network import Datum
from tribrach.network.quality import assess

HEAD = "from,to,horizontal_distance_m,sigma_horizontal_distance_mm\n"
POINTS = "point,e_m,n_m,role\nA,0,0,fixed\nB,100,0,fixed\n"
SIGHTS = [
    "A,P,70.712,2",
    "A,Q,70.709,2",
    "B,P,70.710,2",
    "B,Q,70.711,2",
    "A,P,70.731,2",
    "P,Q,100.001,2",
    "P,A,70.710,2",
]


def project(folder: Path, lines: list[str]) -> Job:
    folder.mkdir(exist_ok=True)
    (folder / "points.csv").write_text(POINTS)
    (folder / "sights.csv").write_text(HEAD + "\n".join(lines) + "\n")
    (folder / "job.toml").write_text(
        '[[points]]\nfile = "points.csv"\n[[observations]]\nfile = "sights.csv"\n'
    )
    return tb.open_job(folder / "job.toml")


@pytest.fixture
def stations() -> Adjustment:
    return adjust(scanner_network(np.random.default_rng(7))[0].network())


def test_points_and_stations_by_name_are_those_by_index(stations: Adjustment) -> None:
    layout, state = stations.layout, stations.state
    assert list(stations.points) == list(layout.names["point"])
    for k, name in enumerate(layout.names["point"]):
        point = stations.points[name]
        np.testing.assert_array_equal(point.xyz, state.points[k])
        np.testing.assert_allclose(point.covariance, stations.covariance(name), atol=1e-18)
        np.testing.assert_allclose(point.sigma, np.sqrt(np.diag(point.covariance)))
        assert point.role == "free"
        assert point.scale == "a priori"
    for k, name in enumerate(layout.names["pose"]):
        station = stations.stations[name]
        np.testing.assert_array_equal(station.rotation, state.pose_r[k])
        np.testing.assert_array_equal(station.xyz, state.pose_t[k])
        np.testing.assert_allclose(station.covariance, stations.covariance(name), atol=1e-18)
        assert station.world_from_scanner[3].tolist() == [0, 0, 0, 1]


def test_ellipses_are_of_the_stated_confidence(stations: Adjustment) -> None:
    point = stations.results(confidence=0.99).points["T1"]
    plan = plan_ellipses(point.covariance[None], confidence_factor(2, 0.99))
    assert point.ellipse.major == pytest.approx(plan.major[0])
    assert point.ellipse.confidence == 0.99
    axes = point.ellipsoid.directions / (point.ellipsoid.axes / confidence_factor(3, 0.99))[:, None]
    np.testing.assert_allclose(axes.T @ axes, np.linalg.inv(point.covariance), rtol=1e-6)


def test_posterior_results_are_scaled_and_say_so(stations: Adjustment) -> None:
    posterior = stations.results(posterior=True)
    factor = stations.posterior_factor
    assert posterior.scale == "a posteriori"
    assert "a posteriori" in repr(posterior.points)
    for name in ("T0", "T5"):
        expected = stations.points[name].covariance * factor
        np.testing.assert_allclose(posterior.points[name].covariance, expected)
    assert (posterior.points["T0"].freedom == stations.dof).all()


def test_rows_of_observations_are_those_of_the_solver(stations: Adjustment) -> None:
    quality, rows = assess(stations), stations.observations
    assert len(rows) == stations.n_observations
    np.testing.assert_array_equal(rows.column("w"), quality.w)
    np.testing.assert_allclose(rows.column("residual"), stations.residuals, atol=1e-15)
    np.testing.assert_array_equal(rows.column("redundancy"), quality.redundancy)
    np.testing.assert_array_equal(rows.column("mdb"), quality.mdb)
    assert rows[3] == list(rows)[3]
    assert [row.id for row in rows[3:6]] == [rows[3].id] * 3
    with pytest.raises(InputError, match="has 3 values"):
        rows[rows[3].id]
    assert rows[rows[4].id, rows[4].component] == rows[4]
    assert list(rows.of(rows[4].id)) == [rows[3], rows[4], rows[5]]


def test_unknown_names_say_which_there_are(stations: Adjustment) -> None:
    for call in (
        lambda: stations.covariance("T99"),
        lambda: stations.points["T99"],
    ):
        with pytest.raises(KeyError, match="did you mean T9"):
            call()
    with pytest.raises(UnknownName, match="no station Q; there are S0, S1, S2"):
        stations.stations["Q"]
    with pytest.raises(UnknownName, match="did you mean target_centre:S0:T3::1"):
        stations.observations["target_centre:S0:T33::1"]
    with pytest.raises(InputError, match="observations, points, stations"):
        stations.to_frame("clouds")  # type: ignore[arg-type]


def test_an_observation_switched_off_is_as_if_it_were_not_in_the_file(tmp_path: Path) -> None:
    network = project(tmp_path / "all", SIGHTS).network()
    fewer = [line for line in SIGHTS if not line.startswith("A,P,70.731")]
    expected = tb.adjust(project(tmp_path / "fewer", fewer).network())
    for selector in ("sights.csv:6", "horizontal_distance:A:P:sights.csv:2"):
        edited = network.without(selector, reason="prism tilted", by="AB")
        again = tb.adjust(edited)
        assert again.dof == expected.dof
        for name in "PQ":
            np.testing.assert_allclose(again.points[name].xyz[:2], expected.points[name].xyz[:2])
            np.testing.assert_allclose(
                again.points[name].covariance, expected.points[name].covariance, atol=1e-18
            )
        row = again.observations["horizontal_distance:A:P:sights.csv:2"]
        assert (row.state, row.reason, row.source) == ("off", "prism tilted", "sights.csv:6")
        assert np.isnan(row.w)
        (edit,) = again.network.edits
        assert (edit.id, edit.action, edit.by) == (row.id, "off", "AB")
    assert not network.edits
    assert tb.adjust(network).dof == expected.dof + 1


def test_another_sigma_is_as_if_it_were_in_the_file(tmp_path: Path) -> None:
    network = project(tmp_path / "all", SIGHTS).network()
    other = [f"{line[:-1]}20" if "70.731" in line else line for line in SIGHTS]
    expected = tb.adjust(project(tmp_path / "other", other).network())
    again = tb.adjust(network.with_sigma("sights.csv:6", 0.020))
    assert again.vtpv == pytest.approx(expected.vtpv)
    np.testing.assert_allclose(again.points["P"].xyz[:2], expected.points["P"].xyz[:2])


def test_sigmas_of_correlated_vectors_keep_their_correlation() -> None:
    survey = scanner_network(np.random.default_rng(5))[0]
    matrix = 1e-6 * (np.eye(6) + 0.3)
    row = np.tile(np.arange(3), 2)
    survey.correlate([0] * 6, [0, 0, 0, 1, 1, 1], row, matrix)
    network = survey.network()
    first, other = network.ids[0][:2]
    edited = network.with_sigma([first], [0.002, 0.003, 0.004], reason="seen at a flat angle")
    scale = np.diag([2, 3, 4, 1, 1, 1]) / np.sqrt(1.3)
    scale[3:] *= np.sqrt(1.3)
    np.testing.assert_allclose(edited.joint[0].covariance, scale @ matrix @ scale)
    np.testing.assert_allclose(edited.observations[0].sigma[0], [0.002, 0.003, 0.004])
    np.testing.assert_array_equal(
        edited.observations[0].sigma[1:], network.observations[0].sigma[1:]
    )
    assert other in network.ids[0]


def test_edits_that_make_no_sense_are_refused(tmp_path: Path) -> None:
    network = project(tmp_path / "all", SIGHTS).network()
    with pytest.raises(UnknownName, match="did you mean sights"):
        network.without("sights.csv:88", reason="wrong")
    with pytest.raises(InputError, match="no reason"):
        network.without("sights.csv:6", reason=" ")
    with pytest.raises(InputError, match="sigma is 0"):
        network.with_sigma("sights.csv:6", 0.0)
    with pytest.raises(InputError, match="1 values and 2 sigmas"):
        network.with_sigma("sights.csv:6", [0.1, 0.2])


def test_conditions_that_hold_exactly_are_not_switched_off() -> None:
    survey = trilateration(Datum("free"))
    survey.add(
        type(survey.network().observations[0]),
        values=[100.0], hard=True, start=["1"], end=["P"], source=["net.csv:9"],
    )  # fmt: skip
    with pytest.raises(InputError, match="holds exactly"):
        survey.network().without("net.csv:9", reason="wrong")


def test_frames_hold_what_the_rows_hold(stations: Adjustment) -> None:
    frame = stations.to_frame()
    rows = stations.observations
    assert frame.columns[:2] == ["id", "kind"]
    assert {"from", "to"} <= set(frame.columns)
    assert frame["id"].to_list() == [row.id for row in rows]
    assert frame["w"].to_list() == [row.w for row in rows]
    points = stations.to_frame("points")
    assert points["name"].to_list() == list(stations.points)
    assert points["sigma_u"].to_list() == [p.sigma[2] for p in stations.points.values()]
    assert set(points["scale"]) == {"a priori"}
    poses = stations.to_frame("stations")
    np.testing.assert_array_equal(poses["r_31"], stations.state.pose_r[:, 2, 0])


def test_a_frame_without_its_library_is_refused(
    stations: Adjustment, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("polars", "pandas"):
        monkeypatch.setitem(sys.modules, name, None)
        with pytest.raises(InputError, match=f"{name} is not installed.*pip install {name}"):
            stations.to_frame("points", name)
    monkeypatch.setattr("tribrach.network.results.find_spec", lambda name: None)
    with pytest.raises(InputError, match="polars is not installed"):
        stations.to_frame()


def test_numbers_that_do_not_exist_are_null_in_frames(tmp_path: Path) -> None:
    network = project(tmp_path / "all", SIGHTS).network().without("sights.csv:6", reason="tilted")
    frame = tb.adjust(network).to_frame()
    (off,) = frame.filter(frame["state"] == "off").rows(named=True)
    assert off["w"] is None
    assert off["residual"] == pytest.approx(-0.02, abs=0.005)
    assert json.dumps(off)


def test_a_summary_names_datum_sigmas_tests_and_points(tmp_path: Path) -> None:
    adjustment = tb.adjust(project(tmp_path / "all", SIGHTS).network())
    text = adjustment.summary()
    assert "A, B held without error" in text
    assert "sigma0 a priori 1, a posteriori" in text
    assert "redundancy 3" in text
    assert "sigmas [mm] a priori" in text
    worst = adjustment.observations.worst(1)[0]
    assert worst.id == "horizontal_distance:A:P:sights.csv:2"
    assert worst.id in text
    assert adjustment.observations.suspicious[0].id == worst.id
    assert str(adjustment) == text


def test_coordinates_that_a_network_does_not_have_are_dashes(tmp_path: Path) -> None:
    adjustment = tb.adjust(project(tmp_path / "all", SIGHTS).network())
    e, n, u = adjustment.points["P"].xyz
    assert np.isnan(u)
    (line,) = (s for s in adjustment.summary().splitlines() if s.startswith("  P "))
    cells = line.split()
    assert cells[:4] == ["P", f"{e:.4f}", f"{n:.4f}", "-"]
    assert cells[6:] == ["-", "free"]
    html = adjustment._repr_html_()
    assert f"<td>{n:.4f}</td><td>-</td>" in html
    assert "nan" not in adjustment.summary() + html


def test_one_line_says_what_there_is(tmp_path: Path) -> None:
    network = project(tmp_path / "all", SIGHTS).network()
    adjustment = tb.adjust(network)
    objects = [network, adjustment, adjustment.points, adjustment.points["P"]]
    objects += [adjustment.observations, adjustment.observations[0], adjustment.stations]
    for thing in objects:
        assert "\n" not in repr(thing)
        assert len(repr(thing)) < 160
    assert repr(network) == "<Network: 4 points, 7 observations; datum control>"
    assert "sigmas a priori" in repr(adjustment.points)
    html = adjustment._repr_html_()
    assert "<td>P</td>" in html
    assert "a priori" in html


def test_dir_shows_what_a_surveyor_asks_for(stations: Adjustment) -> None:
    shown = dir(stations)
    assert "points" in shown
    assert "cofactor" not in shown
    assert all(hasattr(stations, name) for name in shown)


def test_plots_show_ellipses_and_limits(stations: Adjustment) -> None:
    from matplotlib.figure import Figure

    axes = stations.plot(axes=Figure().subplots())
    assert len(axes.patches) == len(stations.points) + len(stations.stations)
    assert "95 %, a priori" in axes.get_title()
    ellipse = stations.points["T0"].ellipse
    patch = axes.patches[0]
    assert patch.width / patch.height == pytest.approx(ellipse.major / ellipse.minor)
    axes = stations.plot("residuals", axes=Figure().subplots())
    assert sum(len(line.get_xdata()) for line in axes.lines[:2]) == len(stations.observations)


def test_a_whole_table_of_observations_is_quick() -> None:
    survey = scanner_network(np.random.default_rng(1), targets=150, stations=8)[0]
    adjustment = adjust(survey.network())
    assert len(adjustment.to_frame()) == 3600


def test_projects_jobs_and_surveys_say_in_one_line_what_they_hold(tmp_path: Path) -> None:
    job = project(tmp_path / "all", SIGHTS)
    files = [str(tmp_path / "all" / name) for name in ("points.csv", "sights.csv")]
    for thing in (job, job.project, job.survey, tb.read(files)):
        assert "\n" not in repr(thing)
    assert repr(job.project).startswith(
        "<Project 'Untitled project': 1 files of points, 1 files of"
    )
    assert repr(tb.read(files)) == "<Survey: 2 given points; 7 horizontal distance>"


def test_survey_files_are_read_from_one_path_or_several(tmp_path: Path) -> None:
    project(tmp_path / "all", SIGHTS)
    sights = tmp_path / "all" / "sights.csv"
    assert tb.read(str(sights)).network().count() == tb.read(sights).network().count() == 7
    with pytest.raises(InputError, match="no files"):
        tb.read([])
    with pytest.raises(UnknownName, match="did you mean gama"):
        tb.read(sights, format="gamma")


@pytest.mark.parametrize("confidence", [0.0, 1.0, 95.0, -0.5, float("nan")])
def test_a_confidence_that_is_no_probability_is_refused(
    stations: Adjustment, confidence: float
) -> None:
    with pytest.raises(InputError, match="not between 0 and 1; give a probability"):
        stations.results(confidence=confidence)


def test_an_adjustment_is_pickled_after_its_results_were_read(stations: Adjustment) -> None:
    stations.summary()
    for again in (pickle.loads(pickle.dumps(stations)), copy.deepcopy(stations)):
        assert again.summary() == stations.summary()
        assert np.array_equal(again.points["T1"].covariance, stations.points["T1"].covariance)
        assert np.array_equal(again.covariance("S1", "T1"), stations.covariance("S1", "T1"))
    posterior = stations.results(posterior=True, confidence=0.99)
    assert posterior.points
    again = pickle.loads(pickle.dumps(posterior))
    assert again.points["T1"].ellipse == posterior.points["T1"].ellipse
    assert set(vars(pickle.loads(pickle.dumps(posterior)))) == {
        "adjustment",
        "posterior",
        "confidence",
    }


def test_names_and_rows_are_pickled_with_their_results(stations: Adjustment) -> None:
    points = pickle.loads(pickle.dumps(stations.points))
    assert (repr(points), list(points)) == (repr(stations.points), list(stations.points))
    assert repr(points["T1"]) == repr(stations.points["T1"])
    with pytest.raises(UnknownName, match="there is no point T99"):
        points["T99"]
    rows = pickle.loads(pickle.dumps(stations.observations))
    assert [str(row) for row in rows] == [str(row) for row in stations.observations]


@pytest.mark.parametrize(
    "error",
    [
        UnknownName("point", "A10", ["A1", "B"]),
        InputError("wrong", file=Path("a.csv"), line=3, cure="correct it"),
        RankDefect("no datum", ["nothing fixes A"]),
    ],
)
def test_errors_are_pickled_with_their_words(error: TribrachError) -> None:
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), vars(again)) == (type(error), str(error), vars(error))
