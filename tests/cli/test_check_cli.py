"""The command check: tables of both sorts, projects, files, sentences for what is wrong."""

import json
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.instruments.field_surveys import TARGETS, readings
from tribrach.calibration.scanner_readings import ScannerReadings
from tribrach.cli import app
from tribrach.geometry.polar import xyz_from_polar
from tribrach.instruments.precision import Precision
from tribrach.io.survey.csv import tables as csv_tables
from tribrach.io.survey.csv.reader import Context
from tribrach.questions.check import readings as job_check

RUN = CliRunner()
SIGMAS = ("--range-mm", "1.2", "--angle-arcsec", "8.25")
THREE = ("1", "2", "3")


def polar_table(given: ScannerReadings, *, raw: bool = False) -> str:
    """Range and angles; raw: the back face as its circles read."""
    rows = ["scan,point,set,face,range_m,horizontal_deg,zenith_deg"]
    for station, one, target, face, (r, h, v) in zip(
        given.station, given.series, given.target, given.face, given.polar, strict=True
    ):
        if raw and face < 0:
            h, v = h + np.pi, 2 * np.pi - v
        cell = "" if raw else f"{face:.0f}"
        rows.append(
            f"{station},{target},{one},{cell},{r:.6f},{np.degrees(h):.7f},{np.degrees(v):.7f}"
        )
    return "\n".join([*rows, ""])


def xyz_table(given: ScannerReadings) -> str:
    rows = ["scan,point,set,face,x_m,y_m,z_m"]
    xyz = xyz_from_polar(given.polar)
    for k in range(len(given)):
        x, y, z = xyz[k]
        rows.append(
            f"{given.station[k]},{given.target[k]},{given.series[k]},{given.face[k]:.0f},"
            f"{x:.6f},{y:.6f},{z:.6f}"
        )
    return "\n".join([*rows, ""])


def checked(folder: Path, text: str, *options: str) -> dict:
    table = folder / "targets.csv"
    table.write_text(text)
    out = folder / "check.json"
    result = RUN.invoke(app, ["check", str(table), *options, "--json", str(out), "-q"])
    assert result.exit_code == 0, result.output
    return json.loads(out.read_text())


def test_a_full_check_from_readings_and_from_coordinates(tmp_path: Path) -> None:
    given = readings(np.random.default_rng(3), series=THREE)
    polar = checked(tmp_path, polar_table(given), *SIGMAS)
    raw = checked(tmp_path, polar_table(given, raw=True), *SIGMAS)
    xyz = checked(tmp_path, xyz_table(given), *SIGMAS)
    assert polar["passed"]
    assert polar["series"]["dof"] == 30
    for other, tolerance in ((raw, 1e-6), (xyz, 3e-2)):
        assert other["passed"]
        for a, b in zip(
            polar["two_face"]["components"], other["two_face"]["components"], strict=True
        ):
            assert b["statistic"] == pytest.approx(a["statistic"], rel=tolerance)
        assert other["series"]["s"] == pytest.approx(polar["series"]["s"], rel=tolerance)


def test_words_and_page_and_comparison_with_an_earlier_check(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    before = tmp_path / "before.json"
    table = tmp_path / "good.csv"
    table.write_text(polar_table(readings(rng, series=THREE)))
    result = RUN.invoke(app, ["check", str(table), *SIGMAS, "--json", str(before)])
    assert "The scanner passes: every test is within its limit." in result.output
    assert "no conformity" in " ".join(result.output.split())
    table = tmp_path / "bad.csv"
    table.write_text(polar_table(readings(rng, {"x6": 2e-4, "x10": 6e-3}, series=THREE)))
    page = tmp_path / "check.html"
    result = RUN.invoke(
        app, ["check", str(table), *SIGMAS, "--earlier", str(before), "--html", str(page)]
    )
    assert result.exit_code == 0, result.output
    words = " ".join(result.output.split())
    assert "The scanner does not pass: horizontal of both faces" in words
    assert "point to x6, mirror tilt (collimation)" in words
    assert "point to x10, range zero" in words
    assert "a significant change" in words
    text = page.read_text()
    drawn = text.split('id="faces-chart"')[1].split("</figure>")[0]
    # three readings against zenith angle and range, each pair with its two sigmas
    assert drawn.count('class="axis"') >= 6
    assert drawn.count("(2 σ)</title>") == drawn.count('class="line faint"')
    assert "does not pass" in text


def test_known_lengths_show_a_scale(tmp_path: Path) -> None:
    """The same scale from distances, from coordinates, and from control of a project."""
    given = readings(np.random.default_rng(3), series=THREE, scale=2e-4)
    rows = polar_table(given)
    distances = ["from,to,distance_m,sigma_mm"]
    for i, j in combinations(range(4), 2):
        distances.append(f"T{i},T{j},{np.linalg.norm(TARGETS[i] - TARGETS[j]):.6f},0.3")
    points = ["point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm,role"]
    for k, (e, n, u) in enumerate(TARGETS):
        points.append(f"T{k},{e + 400_000:.6f},{n + 5_000_000:.6f},{u:.6f},0.2,0.2,0.2,control")
    found = []
    for name, lines in (("distances.csv", distances), ("points.csv", points)):
        (tmp_path / name).write_text("\n".join([*lines, ""]))
        data = checked(tmp_path, rows, *SIGMAS, "--lengths", str(tmp_path / name), "--overwrite")
        assert "distances against known lengths" in data["failures"]
        found.append(data["lengths"])
    (tmp_path / "job.toml").write_text(
        'title = "Yard"\n[instruments.scanner]\nrange_mm = 1.2\nscan_angle_arcsec = 8.25\n'
        '[[points]]\nfile = "points.csv"\n[[observations]]\nfile = "targets.csv"\n'
    )
    out = tmp_path / "job.json"
    result = RUN.invoke(app, ["check", str(tmp_path / "job.toml"), "--json", str(out)])
    assert result.exit_code == 0, result.output
    found.append(json.loads(out.read_text())["lengths"])
    for one in found:
        assert abs(one["scale"] - 2e-4) < 4 * one["sigma_scale"]
        assert len(one["rows"]) == 12
    assert found[2]["scale"] == pytest.approx(found[1]["scale"], rel=0.02)
    assert "Scale of the range beside a range zero" in " ".join(result.output.split())


def test_the_statement_says_which_part_of_the_standard_is_missing(tmp_path: Path) -> None:
    given = readings(np.random.default_rng(3), series=("1", "2"))
    table = tmp_path / "t.csv"
    table.write_text(polar_table(given))
    words = " ".join(RUN.invoke(app, ["check", str(table), *SIGMAS]).output.split())
    assert "not its procedure (it has one series from either station or three, here are 2)" in words
    table.write_text(polar_table(readings(np.random.default_rng(3))))
    words = " ".join(RUN.invoke(app, ["check", str(table), *SIGMAS]).output.split())
    assert "formulas of ISO 17123-9, simplified procedure" in words
    assert "a scale of the range cannot be tested" in words
    assert "u_ISO-TLS" not in words


def test_a_project_has_its_own_instruments(tmp_path: Path) -> None:
    (tmp_path / "targets.csv").write_text(polar_table(readings(np.random.default_rng(3))))
    (tmp_path / "job.toml").write_text(
        'title = "Yard"\n[instruments.scanner]\nrange_mm = 1.2\nscan_angle_arcsec = 8.25\n'
        '[[observations]]\nfile = "targets.csv"\n'
    )
    result = RUN.invoke(app, ["check", str(tmp_path / "job.toml")])
    assert result.exit_code == 0, result.output
    assert result.output.startswith("Yard")
    assert "The scanner passes" in result.output


@pytest.mark.slow
def test_targets_found_in_scans_are_checked(tmp_path: Path) -> None:
    out = str(tmp_path / "lab")
    simulated = RUN.invoke(app, ["simulate", "newcastle-lab", "--out", out, "--points", "10000"])
    assert simulated.exit_code == 0, simulated.output
    job = tmp_path / "lab" / "newcastle-lab.toml"
    result = RUN.invoke(app, ["check", str(job), "--json", str(tmp_path / "c.json"), "-q"])
    assert result.exit_code == 0, result.output
    data = json.loads((tmp_path / "c.json").read_text())
    # the scans of this twin have no misalignments
    assert data["passed"] is not False
    (distances,) = data["distances"]
    assert distances["stations"] == ["S1", "S2"]
    assert len(distances["pairs"]) == 40 * 39 / 2
    assert abs(distances["range_zero"]["value"]) < 4 * distances["range_zero"]["sigma"]
    assert data["two_face"] is None


def test_wrong_calls_end_in_a_sentence(tmp_path: Path) -> None:
    table = tmp_path / "t.csv"
    rows = polar_table(readings(np.random.default_rng(3)))
    earlier = tmp_path / "e.json"
    earlier.write_text('{"series": null, "title": "x"}')
    nowhere = tmp_path / "nowhere.csv"
    nowhere.write_text("from,to,distance_m,sigma_mm\nA,B,3,1\n")
    for text, options, words in (
        (rows, [*SIGMAS, "--lengths", str(nowhere)], "no length between two targets"),
        (rows, [], "there is no sigma_range"),
        (rows, ["--range-mm", "1"], "go together"),
        (rows, ["--sheet", "Nobody 5"], "there is no data sheet Nobody 5"),
        (rows, [*SIGMAS, "--earlier", str(earlier)], "has no repeated series"),
        (rows, [*SIGMAS, "--earlier", str(table)], "this is no JSON of a check"),
        (rows + rows.split("\n")[1] + "\n", SIGMAS, "twice on one face"),
        ("point,e_m,n_m,u_m\nA,1,2,3\n", SIGMAS, "no observations"),
        ("from,to,distance_m,sigma_mm\nA,B,3,1\n", SIGMAS, "no targets that a scanner saw"),
    ):
        table.write_text(text)
        result = RUN.invoke(app, ["check", str(table), *options])
        assert result.exit_code == 2, (words, result.output)
        assert words in result.output
        assert "Traceback" not in result.output


def coordinate_table(sigma: str, *, role: str = "control", errors=0.0) -> str:
    """The targets of the yard; sigma in millimetres, or empty."""
    rows = ["point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm,role"]
    for k, (e, n, u) in enumerate(TARGETS + errors):
        rows.append(f"T{k},{e:.6f},{n:.6f},{u:.6f},{sigma},{sigma},{sigma},{role}")
    return "\n".join([*rows, ""])


def known_of(folder: Path, text: str) -> job_check.KnownLengths:
    path = folder / "known.csv"
    path.write_text(text)
    survey = csv_tables.read(path, Context())
    return job_check.known_lengths(survey, [f"T{k}" for k in range(4)])


@pytest.mark.parametrize("role", ["control", "check"])
def test_sigmas_of_coordinates_are_those_of_lengths_with_common_ends(tmp_path: Path, role) -> None:
    """By the law of propagation, written out: 2 s^2, and s^2 cos of the angle at a common end."""
    known = known_of(tmp_path, coordinate_table("3", role=role))
    s = 3e-3
    np.testing.assert_allclose(np.diag(known.covariance), 2 * s**2)
    row = {pair: k for k, pair in enumerate(known.pairs)}
    a, b = TARGETS[1] - TARGETS[0], TARGETS[2] - TARGETS[0]
    cosine = a @ b / np.linalg.norm(a) / np.linalg.norm(b)
    shared = known.covariance[row["T0", "T1"], row["T0", "T2"]]
    assert shared == pytest.approx(s**2 * cosine, rel=1e-6)
    assert known.covariance[row["T0", "T1"], row["T2", "T3"]] == pytest.approx(0, abs=1e-15)


def test_a_covariance_between_points_reaches_their_lengths(tmp_path: Path) -> None:
    """Errors that all points have in common move no length."""
    path = tmp_path / "known.csv"
    path.write_text(coordinate_table("3"))
    survey = csv_tables.read(path, Context())
    common, own = 9e-6 * 0.75, 9e-6 * 0.25
    block = np.kron(np.full((4, 4), common) + own * np.eye(4), np.eye(3))
    item, row = np.repeat(np.arange(4), 3), np.tile(np.arange(3), 4)
    survey.correlate(np.zeros(12, dtype=int), item, row, block)
    known = job_check.known_lengths(survey, [f"T{k}" for k in range(4)])
    np.testing.assert_allclose(np.diag(known.covariance), 2 * own)


def test_coordinates_of_a_few_millimetres_do_not_accuse_a_scanner_in_order(tmp_path: Path) -> None:
    rng = np.random.default_rng(12)
    rows = polar_table(readings(rng, series=THREE))
    table = tmp_path / "points.csv"
    errors = 4e-3 * rng.normal(size=TARGETS.shape)
    results = {}
    for sigma in ("4", "0.2"):
        table.write_text(coordinate_table(sigma, errors=errors))
        results[sigma] = checked(tmp_path, rows, *SIGMAS, "--lengths", str(table), "--overwrite")[
            "lengths"
        ]
    assert results["4"]["passed"]
    assert results["0.2"]["statistic"] > 20 * results["4"]["statistic"]


def test_coordinates_without_sigmas_make_no_known_lengths(tmp_path: Path) -> None:
    for role in ("check", "fixed"):
        known = known_of(tmp_path, coordinate_table("", role=role))
        assert len(known) == 0
        assert known.without_sigma == ("T0", "T1", "T2", "T3")
    (tmp_path / "points.csv").write_text(coordinate_table("", role="check"))
    (tmp_path / "targets.csv").write_text(polar_table(readings(np.random.default_rng(3))))
    (tmp_path / "job.toml").write_text(
        'title = "Yard"\n[instruments.scanner]\nrange_mm = 1.2\nscan_angle_arcsec = 8.25\n'
        '[[points]]\nfile = "points.csv"\n[[observations]]\nfile = "targets.csv"\n'
    )
    words = " ".join(RUN.invoke(app, ["check", str(tmp_path / "job.toml")]).output.split())
    assert "Coordinates of T0, T1, T2, T3 state no sigmas and make no known lengths" in words
    files = [str(tmp_path / "targets.csv"), "--lengths", str(tmp_path / "points.csv")]
    given = RUN.invoke(app, ["check", *files, *SIGMAS])
    assert given.exit_code == 2
    assert "T0, T1, T2, T3 stand there without" in " ".join(given.output.split())


def test_points_of_a_project_with_scans_are_known_lengths(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "points.csv").write_text(coordinate_table("1", role="check"))
    (tmp_path / "job.toml").write_text(
        'title = "Yard"\n[instruments.scanner]\nrange_mm = 1.2\nscan_angle_arcsec = 8.25\n'
        '[[points]]\nfile = "points.csv"\n[targets]\n'
        '[[scans]]\nfile = "S1.laz"\nstation = "S1"\ninstrument = "scanner"\n'
    )
    # what scans show is tested elsewhere; here nothing was found in them
    named = SimpleNamespace(identification=SimpleNamespace(names={}), targets={})
    monkeypatch.setattr(
        job_check, "find_and_name", lambda *a: SimpleNamespace(named=named, scans=(), findings=())
    )
    _, given, title = job_check.survey_to_check(
        tmp_path / "job.toml", Precision(), lambda what, done, total: None
    )
    assert title == "Yard"
    known = job_check.known_lengths(given, ["T0", "T2", "T3", "unknown"])
    assert len(known) == 3
    np.testing.assert_allclose(np.diag(known.covariance), 2e-6)


def test_long_tables_say_where_they_end_and_the_standard_is_explained_once(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    targets = rng.uniform(-20, 20, size=(10, 3))
    places = {"A": np.zeros(3), "B": np.array([30.0, 2, 0]), "C": np.array([-3.0, 30, 1])}
    table = tmp_path / "t.csv"
    table.write_text(polar_table(readings(rng, targets=targets, stations=places)))
    words = " ".join(RUN.invoke(app, ["check", str(table), *SIGMAS]).output.split())
    assert words.count("40 of 45 rows are shown") == 3
    assert words.count("Distance statistics with the formulas of ISO 17123-9") == 1
    assert words.count("The same from") == 2
    assert "all stations share it" in words
    assert words.count("significant at 0.1 %") == 3


@pytest.mark.parametrize("name", ["t.csv", "one.csv"])
def test_no_pass_without_evidence(shared_data: Path, tmp_path: Path, name: str) -> None:
    """One target, or targets in one place, pass nothing."""
    folder = shared_data / "faults" / "algorithms" / "15-check-passes-what-it-cannot-see"
    words = ["check", str(folder / name), "--range-mm", "1.2", "--angle-arcsec", "8"]
    result = RUN.invoke(app, [*words, "--json", str(tmp_path / "c.json"), "-q"])
    assert result.exit_code == 0, result.output
    data = json.loads((tmp_path / "c.json").read_text())
    assert data["passed"] is None
    assert data["unseen"]
    assert not data["failures"]


def test_one_face_passes_nothing(tmp_path: Path) -> None:
    """Readings of the front alone show no error that changes sign with the face."""
    lines = ["scan,point,set,face,range_m,horizontal_deg,zenith_deg"]
    for station, x in (("S1", 0.0), ("S2", 6.0)):
        for k, (e, n, u) in enumerate([(3, 0, 0.5), (9, 1, 0), (2, 8, 1), (-5, 3, 2), (4, -6, 1)]):
            d = np.array([e - x, n, u])
            r = np.linalg.norm(d)
            h, z = np.degrees(np.arctan2(d[0], d[1])), np.degrees(np.arccos(d[2] / r))
            lines.append(f"{station},T{k},1,1,{r:.5f},{h % 360:.7f},{z:.7f}")
    (tmp_path / "t.csv").write_text("\n".join(lines) + "\n")
    words = ["check", str(tmp_path / "t.csv"), "--range-mm", "1.2", "--angle-arcsec", "8"]
    result = RUN.invoke(app, [*words, "--json", str(tmp_path / "c.json"), "-q"])
    assert result.exit_code == 0, result.output
    data = json.loads((tmp_path / "c.json").read_text())
    assert data["passed"] is None
    assert any("face" in words for words in data["unseen"])


@pytest.mark.parametrize("tilt", [0.0, 0.1])
def test_targets_near_the_horizon_pass_no_tilt_of_an_axis(tmp_path: Path, tilt: float) -> None:
    """Errors that both faces show at steep sights alone are named."""
    flat = TARGETS * [1.0, 1.0, tilt]
    given = readings(np.random.default_rng(3), targets=flat)
    data = checked(tmp_path, polar_table(given), *SIGMAS)
    assert data["passed"] is None
    assert "tilt of the trunnion axis" in data["unseen"][0]


def test_a_coarse_length_passes_no_range(tmp_path: Path) -> None:
    """A tape of a decimetre says nothing of a scanner's millimetre."""
    given = readings(np.random.default_rng(3), stations={"in": np.zeros(3)})
    length = np.linalg.norm(TARGETS[0] - TARGETS[1])
    tables = {}
    for sigma in (0.3, 100.0):
        (tmp_path / "d.csv").write_text(f"from,to,distance_m,sigma_mm\nT0,T1,{length},{sigma}\n")
        options = ("--lengths", str(tmp_path / "d.csv"), "--overwrite")
        tables[sigma] = checked(tmp_path, polar_table(given), *SIGMAS, *options)
    assert tables[0.3]["passed"]
    assert tables[100.0]["passed"] is None


def test_an_index_error_that_the_sheet_allows_is_named(tmp_path: Path) -> None:
    """Noise of 2 and an index of 6 arcsec: within the 8 of a sheet, and not noise."""
    rng, sec = np.random.default_rng(5), np.pi / 180 / 3600
    six = np.vstack([TARGETS, [[12.0, 9.0, -2.0], [-9.0, -8.0, 3.0]]])
    noise = np.array([1e-4, 2 * sec, 2 * sec])
    sheet = ("--sheet", "Leica ScanStation P50")
    one = {"S": np.zeros(3)}
    wrong = readings(rng, {"x4": 6 * sec}, targets=six, stations=one, sigma=noise)
    found = checked(tmp_path, polar_table(wrong), *sheet)
    assert not any("both faces" in failure for failure in found["failures"])
    assert all(c["p"] > 0.01 for c in found["two_face"]["components"])
    (cause,) = found["two_face_noise"]["explanation"]["causes"]
    assert {cause["parameter"], *cause["alternatives"]} >= {"x4"}
    assert abs(abs(cause["value"]) - 6 * sec) < 4 * cause["sigma"]
    assert not next(c for c in found["two_face_noise"]["components"] if c["reading"] == "zenith")[
        "passed"
    ]
    still = checked(
        tmp_path, polar_table(readings(rng, targets=six, stations=one, sigma=noise)), *sheet
    )
    assert still["two_face_noise"]["passed"]
    # stated as noise alone there is no second test
    alone = checked(tmp_path, polar_table(wrong), *SIGMAS)
    assert alone["two_face_noise"] is None
