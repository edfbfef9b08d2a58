"""The command calibrate: figures, files, real data, and sentences for what is wrong."""

import json
import re
import runpy
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.network.lab import TRUTH, lab, measured
from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.geometry.polar import xyz_from_polar
from tribrach.instruments.calibration import MODELS, ORDER, find_model, meaning_of, unit_of
from tribrach.io.calibration_file import read_calibration
from tribrach.job.opened import open_job
from tribrach.network.network import Network
from tribrach.project.calibration import CalibrationSection, Hold
from tribrach.simulate.twins.newcastle_lab import MISALIGNMENTS, with_ceiling

RUN = CliRunner()
HEAD = """\
title = "Lab"
datum = "free"

[instruments.scanner]
serial = "N 1"
range_mm = 1.2
range_ppm = 10.0
scan_angle_arcsec = 8.0

[[observations]]
file = "targets.csv"

[calibration]
model = "nist"
"""
FIVE = 'parameters = ["x10", "x2", "x3", "x4", "x6"]\n'


def table(network: Network, cartesian: bool = False) -> str:
    """The readings of a network as CSV, polar or as coordinates."""
    o = network.observations[0]
    layout = network.start.layout
    if cartesian:
        head, values = "scan,point,x_m,y_m,z_m,face", xyz_from_polar(o.values)
    else:
        head = "scan,point,range_m,horizontal_deg,zenith_deg,face"
        values = np.column_stack([o.values[:, 0], np.degrees(o.values[:, 1:])])
    lines = [head]
    for station, target, v, face in zip(o.station, o.target, values, o.face, strict=True):
        names = f"{layout.names['pose'][station]},{layout.position_name(int(target))}"
        lines.append(f"{names},{v[0]:.8f},{v[1]:.8f},{v[2]:.8f},{face:.0f}")
    return "\n".join([*lines, ""])


def job(folder: Path, network: Network, text: str = HEAD + FIVE, **how: bool) -> Path:
    (folder / "targets.csv").write_text(table(network, **how))
    path = folder / "lab.toml"
    path.write_text(text)
    return path


def call(*words: object) -> tuple[int, str]:
    result = RUN.invoke(app, ["calibrate", *map(str, words)])
    return result.exit_code, result.output


def test_coordinates_weigh_as_the_readings_that_they_were_computed_from(tmp_path: Path) -> None:
    """Steep targets, an instrument with a floor and a systematic part: one adjustment."""
    network = measured(lab(tuple(MISALIGNMENTS)), dict(MISALIGNMENTS), 7)
    text = HEAD.replace('model = "nist"', 'model = "lichti"').replace(
        "scan_angle_arcsec = 8.0",
        "scan_angle_arcsec = 2.0\nscan_angle_accuracy_arcsec = 8.0\ntarget_floor_mm = 0.2",
    )
    text += 'parameters = ["A0", "B6", "B7", "B8", "C0"]\n'
    data = []
    for cartesian in (False, True):
        path = job(tmp_path, network, text, cartesian=cartesian)
        out = tmp_path / f"{cartesian}.json"
        code, said = call(path, "--json", out)
        assert code == 0, said
        assert re.search(r"B6\(scanner\) .* collimation axis error", said)
        assert re.search(r"B7\(scanner\) .* trunnion axis error", said)
        data.append(json.loads(out.read_text()))
    polar, cartesian_too = data
    for one, other in zip(polar["parameters"], cartesian_too["parameters"], strict=True):
        assert one["meaning"] == other["meaning"]
        # the tables are written to 1e-8 m and degrees
        assert other["sigma"] == pytest.approx(one["sigma"], rel=1e-6)
        assert other["value"] == pytest.approx(one["value"], abs=1e-3 * one["sigma"])
    assert cartesian_too["sigma0"]["vtpv"] == pytest.approx(polar["sigma0"]["vtpv"], rel=1e-4)


@pytest.mark.parametrize("name", MODELS)
def test_every_parameter_has_a_meaning(name: str) -> None:
    model = find_model(name, unit_lengths=(0.6, 4.8) if name == "lichti" else ())
    assert all(meaning_of(parameter) for parameter in (*model.parameters, *ORDER))


@pytest.mark.parametrize("cartesian", [False, True])
def test_figures_page_json_and_file(tmp_path: Path, cartesian: bool) -> None:
    network = measured(lab(tuple(MISALIGNMENTS)), dict(MISALIGNMENTS), 7)
    path = job(tmp_path, network, cartesian=cartesian)
    names = [tmp_path / name for name in ("c.json", "c.html", "scanner.toml")]
    code, text = call(path, "--json", names[0], "--html", names[1], "--out", names[2])
    assert code == 0, text
    assert "All 5 parameters are significantly different from zero" in text
    data = json.loads(names[0].read_text())
    # the text gives chi-square itself, the data that over its degrees of freedom
    together = data["tests"]["together"]
    assert f"chi²(5) = {5 * together['statistic']:.0f}" in text
    found = {p["name"]: p for p in data["parameters"]}
    for name, true in MISALIGNMENTS.items():
        p = found[f"{name}(scanner)"]
        assert abs(p["value"] - true) < 4 * p["sigma"]
        assert p["unit"] == unit_of(name)
    sigma = np.array([p["sigma"] for p in data["parameters"]])
    np.testing.assert_allclose(np.sqrt(np.diag(data["covariance"])), sigma)
    assert data["datum"] == "inner constraints over all points"
    assert data["sigma_origin"].startswith("a priori")
    assert all(len(d["points"]) == 64 for d in data["datums"])
    page = names[1].read_text()
    assert page.count("<figure") == 4
    own = page.split('id="within"')[1].split("</figure>")[0]
    shown = [p["name"] for p in data["parameters"]]
    assert all(f"{a}, {b}: " in own for a in shown for b in shown)
    for words in ("Correlations of the parameters with orientations", "Parameters in other datums"):
        assert words in page
    saved = read_calibration(names[2])
    assert (saved.instrument, saved.serial, saved.model) == ("scanner", "N 1", "nist")
    np.testing.assert_allclose(saved.covariance, data["covariance"])
    assert saved.redundancy == data["sigma0"]["dof"]


def test_what_cannot_be_separated_is_refused_and_left_out_on_request(tmp_path: Path) -> None:
    network = measured(lab(tuple(TRUTH)), TRUTH, 7)
    path = job(tmp_path, network, HEAD)
    code, text = call(path, "--json", tmp_path / "c.json")
    assert code == 2
    assert "x5n(scanner) is to be left out" in text
    assert not (tmp_path / "c.json").exists()
    code, text = call(path, "--estimable")
    assert code == 0, text
    assert "Left out because they cannot be separated" in text
    assert "x12a(scanner): it is hardly separated from x4(scanner)" in text


def test_parameters_of_stations_are_tested_and_not_saved(tmp_path: Path) -> None:
    network = measured(lab(tuple(MISALIGNMENTS)), dict(MISALIGNMENTS), 7)
    path = job(tmp_path, network, HEAD + FIVE + 'per = "station"\n')
    code, text = call(path)
    assert code == 0, text
    assert "x10(S1)" in text
    code, text = call(path, "--out", tmp_path / "scanner.toml")
    assert code == 2
    assert "hold for these set-ups only" in text
    assert not (tmp_path / "scanner.toml").exists()


def two_scanners(folder: Path, rows: dict[str, list[str]], names: str | None = None) -> Path:
    """A project with the readings of two scanners; rows : of each."""
    own = HEAD[HEAD.index("serial") : HEAD.index("[[obs")]
    title = table(lab(("x10",))).splitlines()[0]
    text = HEAD[: HEAD.index("[instruments")]
    for k, (name, lines) in enumerate(rows.items()):
        (folder / f"{k}.csv").write_text("\n".join([title, *lines, ""]))
        text += f'[instruments."{name}"]\n{own}\n'
        text += f'[[observations]]\nfile = "{k}.csv"\ninstrument = "{name}"\n\n'
    path = folder / "two.toml"
    text += HEAD[HEAD.index("[calibration]") :] + FIVE
    path.write_text(text + f"instrument = {names or json.dumps(list(rows))}\n")
    return path


def test_two_scanners_in_one_project_have_a_file_each(tmp_path: Path) -> None:
    """Every scanner at a station of its own: parameters are those of single stations."""
    network = measured(lab(tuple(MISALIGNMENTS)), dict(MISALIGNMENTS), 7)
    path = job(tmp_path, network, HEAD + FIVE + 'per = "station"\n')
    assert call(path, "--json", tmp_path / "single.json")[0] == 0
    single = json.loads((tmp_path / "single.json").read_text())
    rows = table(network).splitlines()[1:]
    mine = {
        "one": [row for row in rows if row.startswith("S1,")],
        "the/other": [row for row in rows if row.startswith("S2,")],
    }
    path = two_scanners(tmp_path, mine)
    code, text = call(path, "--json", tmp_path / "two.json", "--out", tmp_path / "kept.toml")
    assert code == 0, text
    both = json.loads((tmp_path / "two.json").read_text())
    assert [p["name"] for p in both["parameters"]][::5] == ["x10(one)", "x10(the/other)"]
    for name in ("value", "sigma"):
        expected = [p[name] for p in single["parameters"]]
        np.testing.assert_allclose([p[name] for p in both["parameters"]], expected, rtol=1e-6)
    for k, (name, plain) in enumerate((("one", "one"), ("the/other", "the_other"))):
        saved = read_calibration(tmp_path / f"kept-{plain}.toml")
        assert saved.instrument == name
        block = slice(5 * k, 5 * k + 5)
        np.testing.assert_allclose(saved.covariance, np.array(both["covariance"])[block, block])
    code, text = call(two_scanners(tmp_path, mine, '["one", "no"]'))
    assert code == 2
    assert "instrument no is not defined" in text


def test_stations_of_the_same_scanner_are_compared_with_each_other(tmp_path: Path) -> None:
    """Two scanners at two stations each; then one of the stations has another zero of ranges."""
    network = measured(lab(tuple(MISALIGNMENTS)), dict(MISALIGNMENTS), 7)
    other = dict(MISALIGNMENTS) | {"x10": 0.004}
    again = table(measured(lab(tuple(MISALIGNMENTS)), other, 8)).splitlines()[1:]
    again = [r.replace("S1,", "S3,", 1).replace("S2,", "S4,", 1) for r in again]
    differ = []
    for shift in (0.0, 0.003):
        cells = [row.split(",") for row in again]
        for row in cells:
            row[2] = f"{float(row[2]) + shift * (row[0] == 'S4'):.8f}"
        mine = {"one": table(network).splitlines()[1:], "two": [",".join(row) for row in cells]}
        code, said = call(two_scanners(tmp_path, mine), "--json", tmp_path / "c.json")
        assert code == 0, said
        differ.append(json.loads((tmp_path / "c.json").read_text())["tests"]["stations_differ"])
    # five deviations for a second station of either scanner, none between the scanners
    assert [test["freedom"] for test in differ] == [10, 10]
    assert differ[0]["p"] > 0.001
    assert differ[1]["p"] < 1e-6


def test_a_station_that_too_few_targets_tie(tmp_path: Path) -> None:
    """Two targets leave the turn about their line open."""
    network = measured(lab(tuple(MISALIGNMENTS)), dict(MISALIGNMENTS), 7)
    path = job(tmp_path, network)
    lines = (tmp_path / "targets.csv").read_text().splitlines()
    third = [
        line.replace("S1,", "S3,") for line in lines[1:] if line.startswith(("S1,T4,", "S1,T9,"))
    ]
    (tmp_path / "targets.csv").write_text("\n".join([*lines, *third]) + "\n")
    code, text = call(path)
    assert code == 2, text
    assert "S3" in text
    assert "Traceback" not in text


def test_a_hybrid_scanner_has_no_back_face(tmp_path: Path) -> None:
    network = measured(lab(tuple(MISALIGNMENTS)), dict(MISALIGNMENTS), 7)
    path = job(tmp_path, network, HEAD + FIVE + 'scanner = "hybrid"\n')
    code, text = call(path)
    assert code == 2
    assert "hybrid scanner and has no back face" in text
    assert "targets.csv" in text
    front = measured(lab(("x10",), faces=(1.0,)), {"x10": 0.001}, 7)
    text = HEAD + 'parameters = ["x10", "x6"]\nscanner = "hybrid"\n'
    code, text = call(job(tmp_path, front, text))
    assert code == 0, text


def test_weighted_conditions_of_orientation(tmp_path: Path) -> None:
    """A tilt that is known well improves the vertical index of a scanner with one face."""
    network = measured(lab(("x10", "x4"), faces=(1.0,)), {"x10": 0.001, "x4": 7e-5}, 3)
    text = HEAD + 'parameters = ["x10", "x4"]\n'
    sigma = []
    levelled = (
        '[[calibration.hold]]\nstation = "S2"\ncomponent = "tilt_e"\nrelative_to = "S1"\n'
        "value_deg = {:.6f}\nsigma_arcsec = 0.5\n"
    )
    r1, r2 = network.start.pose_r
    turn = r1.T @ r2
    angle = np.arccos((np.trace(turn) - 1) / 2)
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    about_x = float(np.degrees(axis[0] / 2 / np.sin(angle) * angle))
    for more in ("", levelled.format(about_x)):
        out = tmp_path / "c.json"
        code, words = call(job(tmp_path, network, text + more), "--json", out)
        assert code == 0, words
        parameters = {p["name"]: p for p in json.loads(out.read_text())["parameters"]}
        sigma.append(parameters["x4(scanner)"]["sigma"])
        x4 = parameters["x4(scanner)"]
        assert abs(x4["value"] - 7e-5) < 4 * x4["sigma"]
    assert sigma[1] < 0.7 * sigma[0]


@pytest.mark.parametrize(
    ("section", "match"),
    [
        ('model = "nest"\n', "calibration.model"),
        ('model = "nist"\nparameters = ["x99"]\n', "no parameter x99"),
        ('model = "nist"\nparameters = ["x10", "x10"]\n', "named twice"),
        ('model = "lichti"\nparameters = ["B1"]\n', "the circle closes"),
        ('model = "lichti"\nparameters = ["A3"]\n', "needs the unit lengths"),
        ('model = "nist"\nunit_lengths_m = [1.0, 2.0]\n', "has no unit lengths"),
        ('instrument = "other"\n', "instrument other is not defined"),
        ('model = "nist"\nparameters = ["x10"]\nleave_out = ["x10"]\n', "no parameter is left"),
        ("near_correlation = 1.0\n", "a correlation is below 1"),
        (
            '[[calibration.hold]]\nstation = "S2"\ncomponent = "e"\nvalue_deg = 1.0\n',
            "value_m and sigma_mm",
        ),
        ('[[calibration.hold]]\nstation = "S9"\ncomponent = "e"\n', "S9 is observed by nothing"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(tmp_path: Path, section: str, match: str) -> None:
    network = lab(("x10",))
    text = HEAD.replace('model = "nist"\n', "") + section
    code, words = call(job(tmp_path, network, text))
    assert code == 2, words
    assert match in " ".join(words.split())
    assert "lab.toml:" in words


def test_a_project_without_the_section(tmp_path: Path) -> None:
    path = job(tmp_path, lab(("x10",)), HEAD.split("[calibration]")[0])
    code, text = call(path)
    assert code == 2
    assert "no section calibration" in text


def test_a_known_calibration_holds_for_all_stations(tmp_path: Path) -> None:
    network = measured(lab(tuple(MISALIGNMENTS)), dict(MISALIGNMENTS), 7)
    path = job(tmp_path, network)
    assert call(path, "--out", tmp_path / "scanner.toml")[0] == 0
    known = HEAD.replace("range_mm", 'calibration = "scanner.toml"\nrange_mm')
    code, text = call(job(tmp_path, network, known + FIVE + 'per = "station"\n'))
    assert code == 2
    assert "holds for all of its stations" in text
    # the same observations again, with what is known of the parameters before
    code, text = call(job(tmp_path, network, known + FIVE), "--json", tmp_path / "again.json")
    assert code == 0, text
    before = read_calibration(tmp_path / "scanner.toml").sigma
    after = [p["sigma"] for p in json.loads((tmp_path / "again.json").read_text())["parameters"]]
    np.testing.assert_allclose(after, before / np.sqrt(2), rtol=0.02)


def test_models_by_name() -> None:
    for name in MODELS:
        model = find_model(name)
        assert set(model.parameters) <= set(ORDER)
    assert "A3" not in find_model("lichti").parameters
    assert "A3" in find_model("lichti", (), (1.0, 8.0)).parameters
    assert find_model("high-end", ("x5n",)).parameters == ("x5n",)
    with pytest.raises(InputError, match="no calibration model"):
        find_model("nobody")


ETH = {
    1: {"A0": -4e-3, "B6": 1e-3, "B7": -1e-3, "C0": -2e-3},
    2: {"A0": 3e-3, "B6": -0.5e-3, "B7": 0.5e-3, "C0": 0.0},
}


@pytest.mark.data
@pytest.mark.parametrize("number", [1, 2])
def test_simulated_data_of_another_program(shared_data: Path, tmp_path: Path, number: int) -> None:
    """True parameters within three sigma; the first set to the rounding of its coordinates."""
    rows = ["scan,point,x_m,y_m,z_m,face,cxx_m2,cyy_m2,czz_m2,cxy_m2,cxz_m2,cyz_m2"]
    if number == 2:
        rows = ["scan,point,x_m,y_m,z_m,face"]
    for setup in (1, 2):
        name = f"Testdata_{number}/Scans/PPE_TLS_T{number}_Scan{setup}.dat"
        for point, x, y, z in np.loadtxt(shared_data / "selfcal" / name)[:, :4]:
            row = f"Setup{setup},{point:.0f},{x},{y},{z},1"
            rounding = ",".join(["8.3333e-10"] * 3 + ["0"] * 3)
            rows.append(row if number == 2 else f"{row},{rounding}")
    (tmp_path / "targets.csv").write_text("\n".join(rows) + "\n")
    text = HEAD.replace('model = "nist"', 'model = "lichti"')
    text = text.replace("range_mm = 1.2\nrange_ppm = 10.0", "range_mm = 10.0")
    text += 'parameters = ["A0", "B6", "B7", "C0"]\n'
    if number == 2:
        text = text.replace('file = "targets.csv"', 'file = "polar.csv"')
        _polar(tmp_path)
    path = tmp_path / "lab.toml"
    path.write_text(text)
    code, words = call(path, "--json", tmp_path / "c.json")
    assert code == 0, words
    data = json.loads((tmp_path / "c.json").read_text())
    for p in data["parameters"]:
        true = ETH[number][p["name"].split("(")[0]]
        assert abs(p["value"] - true) < 3 * p["sigma"], p
    assert not data["open"]
    if number == 1:
        # residuals are those of coordinates rounded to 0.1 mm
        assert data["sigma0"]["posterior"] == pytest.approx(1.0, abs=0.25)


def _polar(folder: Path) -> None:
    """The second set with its sigmas: 10 mm, 0.01 and 0.001 degrees."""
    lines = (folder / "targets.csv").read_text().splitlines()[1:]
    rows = [
        "scan,point,range_m,horizontal_deg,zenith_deg,"
        "sigma_range_mm,sigma_horizontal_deg,sigma_zenith_deg"
    ]
    for line in lines:
        scan, point, *xyz = line.split(",")[:5]
        x, y, z = map(float, xyz)
        flat = np.hypot(x, y)
        h, v = np.degrees(np.arctan2(y, x)), np.degrees(np.arctan2(flat, z))
        rows.append(f"{scan},{point},{np.hypot(flat, z):.9f},{h:.9f},{v:.9f},10,0.01,0.001")
    (folder / "polar.csv").write_text("\n".join(rows) + "\n")


@pytest.mark.data
def test_reflectors_of_a_real_hybrid_scanner(shared_data: Path, tmp_path: Path) -> None:
    """RiSCAN PRO: the range zero can be estimated, its sigma says how well."""
    project = shared_data / "scans" / "riegl_project" / "project.rsp"
    text = f"""
title = "Reflectors"
datum = "free"
[instruments.vz]
range_mm = 5.0
scan_angle_arcsec = 8.0
[[observations]]
file = "{project}"
[calibration]
model = "nist"
parameters = ["x10"]
scanner = "hybrid"
"""
    path = tmp_path / "vz.toml"
    path.write_text(text)
    code, words = call(path, "--json", tmp_path / "c.json")
    assert code == 0, words
    (p,) = json.loads((tmp_path / "c.json").read_text())["parameters"]
    assert abs(p["value"]) < 0.02
    assert 0 < p["sigma"] < 0.02


def test_the_project_model_knows_its_names(tmp_path: Path) -> None:
    path = job(tmp_path, lab(("x10",)))
    network = open_job(path).network()
    assert set(network.start.layout.names["scalar"]) == {f"{p}(scanner)" for p in MISALIGNMENTS}


def test_the_project_of_the_simulated_laboratory(tmp_path: Path) -> None:
    twin = with_ceiling(10_000)
    for name in ("polar.csv", "calibrate.toml"):
        (tmp_path / name).write_text(twin.files[name])
    code, text = call(tmp_path / "calibrate.toml", "--json", tmp_path / "c.json")
    assert code == 0, text
    for p in json.loads((tmp_path / "c.json").read_text())["parameters"]:
        assert abs(p["value"] - MISALIGNMENTS[p["name"].split("(")[0]]) < 4 * p["sigma"]


def test_keys_are_documented() -> None:
    docs = Path(__file__).parents[2] / "docs"
    keys = runpy.run_path(str(docs / "project_keys.py"))["tables"]()
    page = (docs / "calibration.md").read_text()
    for head, section in (("[calibration]", CalibrationSection), ("[[calibration.hold]]", Hold)):
        rows = keys.split(f"\n## `{head}`\n")[1].split("\n## ")[0]
        listed = set(re.findall(r"[a-z_0-9]+", " ".join(re.findall(r"`([^`]+)`", rows))))
        assert set(section.model_fields) - {"hold"} <= listed
    for name in MODELS:
        assert f"`{name}`" in page
