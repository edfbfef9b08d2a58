"""Raw readings become a network: truth comes back, faces and sets count, bad ones are told."""

import json
import re

import numpy as np
import pytest
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.instruments.precision import Precision
from tribrach.io.survey import totalstation
from tribrach.io.survey.csv import tables as csv_tables
from tribrach.io.survey.csv.reader import Context
from tribrach.io.survey.formats import read_files
from tribrach.io.totalstation.recorder import Recorder
from tribrach.job.opened import open_job
from tribrach.network.adjustment import adjust
from tribrach.network.facts import EARTH
from tribrach.observations.base import Use
from tribrach.simulate.raw_readings import gsi as simulated
from tribrach.units import GON, SEC

TRUTH = {
    "A": (0.0, 0.0, 10.0), "B": (80.0, 5.0, 12.0), "C": (60.0, 70.0, 9.0), "D": (-10.0, 65.0, 15.0),
}  # fmt: skip
HI, HT = 1.55, 1.40
HEAD = (
    "station,target,face,direction_gon,zenith_gon,slope_distance_m,height_instrument_m,"
    "height_target_m,prism_constant_mm,atmosphere_ppm"
)


def rows(rng=None, noise=0.0, sets=1, c=8 * SEC, i=-5 * SEC, stations=("A", "B", "C")):
    """CSV rows of sets in both faces with axis errors, prism constant and air left in."""
    out = []
    for k, station in enumerate(stations):
        for _ in range(sets):
            targets = [t for t in TRUTH if t != station]
            for face, order in ((1, targets), (2, targets[::-1])):
                for target in order:
                    d = np.subtract(TRUTH[target], TRUTH[station])
                    d[2] += HT - HI
                    s = np.linalg.norm(d)
                    v = np.arccos(d[2] / s)
                    sign = 1 if face == 1 else -1
                    h = np.arctan2(d[0], d[1]) - 0.3 * k + sign * c / np.sin(v)
                    h += np.pi if face == 2 else 0.0
                    z = (v if face == 1 else 2 * np.pi - v) + i
                    e = np.zeros(3) if rng is None else rng.normal(0, noise, 3)
                    raw = (s + 0.034) / (1 + 12e-6)
                    out.append(
                        f"{station},{target},{face},{(h + e[0]) % (2 * np.pi) / GON:.9f},"
                        f"{(z + e[1]) / GON:.9f},{raw:.7f},{HI},{HT},-34,12"
                    )
    return out


def table(tmp_path, lines, name="readings.csv"):
    path = tmp_path / name
    path.write_text("\n".join([HEAD, *lines]) + "\n")
    return path


INSTRUMENT = Precision(direction=3 * SEC, zenith=3 * SEC, distance=1e-3, scale=1e-6)
POINTS = "point,e_m,n_m,u_m,role\nA,0,0,10,fixed\nB,80,5,12,fixed\n"


def network(tmp_path, lines, precision=INSTRUMENT):
    survey = csv_tables.read(table(tmp_path, lines), Context(precision))
    (tmp_path / "points.csv").write_text(POINTS)
    survey.merge(csv_tables.read(tmp_path / "points.csv"))
    return survey.network()


def test_truth_comes_back(tmp_path):
    """Axis errors, prism constant and air are taken out; nothing is left."""
    adjustment = adjust(network(tmp_path, rows(sets=2)))
    for name, truth in TRUTH.items():
        xyz = adjustment.state.points[adjustment.layout.index("point", name)]
        np.testing.assert_allclose(xyz, truth, atol=2e-6)


def test_sigmas_count_the_readings(tmp_path):
    """Two faces in three sets are six readings of everything."""
    found = {o.kind: o for o in network(tmp_path, rows(sets=3)).observations}
    assert len(found["direction"]) == 9
    for kind in ("direction", "zenith"):
        np.testing.assert_allclose(found[kind].covariance[:, 0, 0], (3 * SEC) ** 2 / 6)
    distances = found["slope_distance"]
    expected = (1e-3 + 1e-6 * distances.values[:, 0]) ** 2 / 6
    np.testing.assert_allclose(distances.covariance[:, 0, 0], expected)
    assert distances.source[0] == "readings.csv:2"
    assert len(set(found["direction"].orientation.tolist())) == 3


@pytest.mark.parametrize("turn", [3 * SEC, 60 * SEC, 150 * SEC, 250 * SEC])
def test_error_free_sets_with_a_target_missing_leave_no_residual(tmp_path, turn):
    """Eight control points, two sets with the tripod turned between, one target in one of them."""
    recorder = Recorder(tmp_path / "x", "test")
    recorder.setup(1, "S", height=0.0)
    places = {f"K{k}": 60 * np.array([np.cos(k), np.sin(k), 0.1 * (k % 3)]) for k in range(8)}
    survey_points = [f"{n},{x:.9f},{y:.9f},{z:.9f},fixed" for n, (x, y, z) in places.items()]
    line = 1
    for k, circle in enumerate((0.0, turn)):
        for name, (x, y, z) in places.items():
            if (k, name) == (1, "K3"):
                continue
            line += 1
            direction = (np.arctan2(x, y) + circle) % (2 * np.pi)
            flat = np.hypot(x, y)
            recorder.shot(
                line,
                name,
                direction=direction,
                zenith=np.arctan2(flat, z),
                distance=np.hypot(flat, z),
                height=0.0,
            )
    level = Precision(direction=3 * SEC, zenith=3 * SEC, distance=1e-3, refraction=0.0)
    survey = totalstation.survey_of([recorder.finish()], level, alone=False)
    (tmp_path / "points.csv").write_text("\n".join(["point,e_m,n_m,u_m,role", *survey_points]))
    survey.merge(csv_tables.read(tmp_path / "points.csv"))
    adjustment = adjust(survey.network())
    assert adjustment.vtpv < 1e-6
    np.testing.assert_allclose(adjustment.points["S"].xyz, 0.0, atol=1e-7)


def test_stated_sigmas_are_the_true_ones(tmp_path):
    """Monte Carlo: the global test's statistic has its expectation, the redundancy."""
    rng = np.random.default_rng(9)
    ratios = []
    for _ in range(40):
        adjustment = adjust(network(tmp_path, rows(rng, 3 * SEC, sets=2)))
        ratios.append(adjustment.vtpv / adjustment.dof)
    # distances have no noise: 9 of the 27 values say nothing
    assert np.mean(ratios) == pytest.approx(18 / 27, abs=0.12)


def test_faces_that_are_too_far_apart_are_off_and_told(tmp_path):
    lines = rows()
    cells = lines[4].split(",")
    assert cells[:3] == ["A", "C", "2"]
    cells[3] = f"{(float(cells[3]) + 1.0) % 400:.9f}"
    lines[4] = ",".join(cells)
    found = network(tmp_path, lines)
    directions = next(o for o in found.observations if o.kind == "direction")
    off = np.flatnonzero(directions.use == Use.OFF)
    assert len(off) == 1
    assert directions.reason[off[0]] == "the faces are too far apart"
    words = [w for w in found.warnings if "both faces from A to C" in w]
    assert len(words) == 1
    assert "misread, or another target" in words[0]
    assert "-3240" in words[0]


def test_a_face_that_is_no_face(tmp_path):
    lines = rows()
    lines[0] = lines[0].replace("A,B,1", "A,B,3")
    with pytest.raises(InputError, match=r"readings\.csv:2: face is 3"):
        csv_tables.read(table(tmp_path, lines))


def test_switched_off_rows(tmp_path):
    path = tmp_path / "r.csv"
    lines = [HEAD + ",use,reason"] + [f"{line},on," for line in rows()]
    lines[1] = lines[1].removesuffix("on,") + "off,bumped"
    path.write_text("\n".join(lines))
    survey = csv_tables.read(path, Context(INSTRUMENT))
    assert "In r.csv: 1 sights are off: bumped." in survey.warnings


def gsi(tmp_path, given=("A", "B"), name="field.gsi"):
    """A GSI-16 file of both faces from three stations."""
    lines = []

    def word(index, info, value):
        return f"{index}{info}{'-' if value < 0 else '+'}{abs(round(value)):016d}"

    def block(point, *words):
        return f"*11{len(lines) + 1:04d}+{point:0>16} " + " ".join(words) + " "

    for point in given:
        e, n, u = TRUTH[point]
        words = (word("81", "..40", e * 1e3), word("82", "..40", n * 1e3))
        lines.append(block(point, *words, word("83", "..40", u * 1e3)))
    before = None
    for row in rows():
        station, target, _, h, v, s, _, _, _, _ = row.split(",")
        if station != before:
            lines.append(block(station, word("88", "..10", HI * 1e3)))
            before = station
        true = (float(s) * (1 + 12e-6) - 0.034) * 1e5
        lines.append(
            block(
                target, word("21", ".322", float(h) * 1e5), word("22", ".322", float(v) * 1e5),
                word("31", "..08", true), word("87", "..10", HT * 1e3),
            )
        )  # fmt: skip
    path = tmp_path / name
    path.write_text("\r\n".join(lines))
    return path


def test_a_raw_file_alone_is_fitted_to_its_coordinates(tmp_path):
    adjustment = adjust(read_files([gsi(tmp_path)]).network())
    assert any("fitted to the 2 points" in w for w in adjustment.network.warnings)
    for name, truth in TRUTH.items():
        xyz = adjustment.state.points[adjustment.layout.index("point", name)]
        np.testing.assert_allclose(xyz, truth, atol=2e-3)


def test_a_raw_file_without_coordinates_is_free(tmp_path):
    adjustment = adjust(read_files([gsi(tmp_path, given=())]).network())
    place = [adjustment.state.points[adjustment.layout.index("point", n)] for n in "AD"]
    truth = np.linalg.norm(np.subtract(TRUTH["A"], TRUTH["D"]))
    assert np.linalg.norm(place[0] - place[1]) == pytest.approx(truth, abs=1e-4)


def test_an_instrument_that_nobody_described(tmp_path):
    survey = totalstation.read([gsi(tmp_path)])
    assert any("instrument is not described" in w for w in survey.warnings)
    survey = totalstation.read([gsi(tmp_path)], INSTRUMENT)
    assert not any("instrument is not described" in w for w in survey.warnings)
    with pytest.raises(InputError, match="no sigma of a slope distance"):
        totalstation.read([gsi(tmp_path)], Precision(direction=SEC, zenith=SEC))


def test_coordinates_alone_are_no_observations(tmp_path):
    path = gsi(tmp_path)
    path.write_text("\r\n".join(path.read_text().splitlines()[:2]))
    with pytest.raises(InputError, match="coordinates and no sights"):
        totalstation.read([path])


PROJECT = """title = "Raw"
[instruments.TS]
direction_arcsec = 3
zenith_arcsec = 3
distance_mm = 1
distance_ppm = 1
[[points]]
file = "points.csv"
[[observations]]
file = "field.gsi"
instrument = "TS"
"""


def test_a_project_with_a_raw_file(tmp_path):
    gsi(tmp_path, given=("C",))
    (tmp_path / "points.csv").write_text(POINTS)
    (tmp_path / "job.toml").write_text(PROJECT)
    adjustment = adjust(open_job(tmp_path / "job.toml").network())
    # the coordinates of C in the raw file are not control here
    for name, truth in TRUTH.items():
        xyz = adjustment.state.points[adjustment.layout.index("point", name)]
        np.testing.assert_allclose(xyz, truth, atol=1e-3)
    result = CliRunner().invoke(app, ["run", str(tmp_path / "job.toml")])
    assert result.exit_code == 0, result.output
    found = tmp_path / "out" / "result.json"
    (day,) = json.loads(found.read_text())["reductions"]["days"]
    assert day["collimation"] == pytest.approx(8 * SEC, abs=0.2 * SEC)
    assert day["index"] == pytest.approx(-5 * SEC, abs=0.2 * SEC)
    assert day["pairs"] == 9


def raw(path, shots, heights=None):
    recorder = Recorder(path, "test")
    recorder.setup(1, "S", height=1.5)
    for k, (target, direction) in enumerate(shots):
        height = 1.5 if heights is None else heights[k]
        recorder.shot(k + 2, target, direction=direction, zenith=1.5, distance=20.0, height=height)
    return recorder.finish()


def test_a_target_with_two_heights_counts_as_two(tmp_path):
    file = raw(tmp_path / "x", [("P", 0.1), ("P", 0.1), ("Q", 1.0)], [1.5, 1.6, 1.5])
    survey = totalstation.survey_of([file])
    found = {o.kind: o for o in survey.network().observations}
    assert sorted(found["zenith"].height_target.tolist()) == [1.5, 1.5, 1.6]


def test_a_station_that_sights_itself(tmp_path):
    survey = totalstation.survey_of([raw(tmp_path / "x", [("S", 0.1), ("P", 0.2), ("Q", 0.3)])])
    assert any("sights go to the point that they come from" in w for w in survey.warnings)
    assert {o.kind: len(o) for o in survey.network().observations}["direction"] == 2


def test_points_that_angles_alone_see(tmp_path):
    recorder = Recorder(tmp_path / "x", "test")
    recorder.setup(1, "S", height=1.5)
    recorder.shot(2, "P", direction=0.1, zenith=1.5, distance=20.0)
    recorder.shot(3, "Q", direction=0.2, zenith=1.5, distance=20.0)
    recorder.shot(4, "H", direction=0.3, zenith=1.5)
    survey = totalstation.survey_of([recorder.finish()])
    assert any("1 point is seen by angles from one station only" in w for w in survey.warnings)
    assert "H" not in survey.network().start.layout.names["point"]
    survey = totalstation.survey_of([recorder.finish()], alone=False, known=["H"])
    assert "H" in survey.network().start.layout.names["point"]


def test_closures_and_sets_that_disagree_are_told(tmp_path):
    closing = [("A", 0.0), ("B", 1.0), ("C", 2.0), ("A", 60 * SEC)]
    words = totalstation.survey_of([raw(tmp_path / "x", closing)]).warnings
    assert any("closes on A with +60.0" in w for w in words)
    circle = (("A", 0.0), ("B", 1.0), ("C", 2.0), ("D", 3.0))
    sets = [(t, d + 300 * SEC * ((k, t) == (2, "B"))) for k in range(4) for t, d in circle]
    words = totalstation.survey_of([raw(tmp_path / "x", sets)]).warnings
    assert any("from S to B in set 3" in w for w in words)


@pytest.mark.parametrize("apart", [True, False])
def test_files_of_one_name_in_two_folders(tmp_path, apart):
    """Each day keeps its own orientations, lines and row of the report."""
    for day in ("monday", "tuesday"):
        (tmp_path / day).mkdir()
        gsi(tmp_path / day, given=())
    # on Tuesday the circle of the first station was read 0.5 gon further on
    path = tmp_path / "tuesday" / "field.gsi"
    path.write_text(turned(path.read_text(), 0.5))
    (tmp_path / "points.csv").write_text(POINTS)
    entry = '[[observations]]\nfile = "{}/field.gsi"\ninstrument = "TS"\n'
    both = (
        '[[observations]]\nfiles = ["monday/field.gsi", "tuesday/field.gsi"]\ninstrument = "TS"\n'
    )
    entries = entry.format("monday") + entry.format("tuesday") if apart else both
    (tmp_path / "job.toml").write_text(PROJECT.partition("[[observations]]")[0] + entries)
    result = CliRunner().invoke(app, ["run", str(tmp_path / "job.toml")])
    assert result.exit_code == 0, result.output
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    days = [day["file"] for day in result["reductions"]["days"]]
    assert days == ["monday/field.gsi", "tuesday/field.gsi"]
    sources = {row["source"].rpartition(":")[0] for row in result["observations"]}
    assert set(days) <= sources
    assert max(abs(row["w"]) for row in result["observations"] if row["w"] is not None) < 5


def turned(text: str, gon: float) -> str:
    """A GSI file whose directions were all read this much further on."""

    def word(match):
        reading = (int(match[2]) + round(gon * 1e5)) % 40_000_000
        return f"{match[1]}{reading:016d}"

    return re.sub(r"(21\.322\+)(\d{16})", word, text)


@pytest.mark.parametrize("beside", [False, True])
def test_long_sights_of_a_file_alone_are_on_a_round_earth(tmp_path, beside):
    """600 m: 25 mm of curvature and refraction accused the heights of the set-ups."""
    places = {"A": (0.0, 0, 0), "B": (600.0, 50, 5), "C": (300.0, 500, -4), "D": (100.0, 300, 3)}
    lines = [(a, b) for a in "AB" for b in "ABCD" if a != b]
    quiet = Precision(direction=SEC, zenith=SEC, distance=1e-3)
    path = tmp_path / "far.gsi"
    path.write_text(simulated(places, lines, {}, {}, quiet, np.random.default_rng(0)))
    files = [path]
    if beside:
        rows = [f"{n},{x},{y},{z}" for n, (x, y, z) in places.items()]
        files.append(tmp_path / "list.csv")
        files[1].write_text("\n".join(["point,e_m,n_m,u_m", *rows, ""]))
    network = read_files(files).network()
    assert network.site.curvature_radius == EARTH
    found = adjust(network)
    assert found.vtpv < 1.2 * found.dof
    near = {name: np.array(x) / 6 for name, x in places.items()}
    path.write_text(simulated(near, lines, {}, {}, quiet, np.random.default_rng(0)))
    assert read_files([path]).site.curvature_radius is None
