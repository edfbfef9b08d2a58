"""A real RiSCAN PRO project: two VZ-1000 stations, 20 flat reflectors, on-board GNSS."""

import csv
from pathlib import Path

import numpy as np
import pytest

from tribrach.errors import InputError
from tribrach.io.survey.riscan import reader as riscan
from tribrach.io.survey.riscan.records import parse
from tribrach.network.adjustment import Adjustment, adjust
from tribrach.network.quality import assess

pytestmark = pytest.mark.data


@pytest.fixture(scope="module")
def folder(shared_data) -> Path:
    """Where the project is."""
    return shared_data / "scans" / "riegl_project"


@pytest.fixture(scope="module")
def adjustment(folder) -> Adjustment:
    """The project adjusted."""
    return adjust(riscan.read(folder / "project.rsp").network())


def misfit(adjustment: Adjustment) -> np.ndarray:
    """Difference (20, 3) of each reflector between the two stations, in W."""
    centres = next(o for o in adjustment.network.observations if o.kind == "target_centre")
    state = adjustment.state
    r, t = state.pose_r[centres.station], state.pose_t[centres.station]
    world = np.einsum("nij,nj->ni", r, centres.values) + t
    places = {}
    for (station, target), x in zip(centres.ends(adjustment.layout), world, strict=True):
        places.setdefault(target, {})[station] = x
    return np.array([p["SP02"] - p["SP01"] for p in places.values()])


def suspects(adjustment: Adjustment) -> tuple[set[str], str]:
    """Reflectors whose block test fails, and the one with the largest statistic."""
    blocks = assess(adjustment).blocks
    centres = adjustment.network.observations[0]
    names = np.array([target for _, target in centres.ends(adjustment.layout)])
    mine = blocks.table == 0
    statistic, name = blocks.statistic[mine], names[blocks.item[mine]]
    return set(name[statistic > blocks.critical[mine]]), str(name[np.argmax(statistic)])


def test_records_are_those_of_the_neutral_tables(folder):
    project = parse(folder / "project.rsp")
    stations = {s.name: s for s in project.stations}
    with open(folder / "vz1000_calibration_tiepoints.csv") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 40
    for row in rows:
        point = next(t for t in stations[row["scanpos"]].targets if t.name == row["target"])
        np.testing.assert_array_equal(point.vector, [float(row[k]) for k in ("x_m", "y_m", "z_m")])
        keys = ("sigma_range_m", "sigma_lat1_m", "sigma_lat2_m")
        np.testing.assert_allclose(point.accuracy, [float(row[k]) for k in keys], rtol=1e-15)
        # the first accuracy is along the beam
        beam = -point.vector / np.linalg.norm(point.vector)
        np.testing.assert_allclose(point.direction, beam, atol=1e-6)
    with open(folder / "vz1000_calibration_sop.csv") as file:
        for row in csv.DictReader(file):
            matrix = [[float(row[f"m{i}{j}"]) for j in range(4)] for i in range(4)]
            if row["scanpos"] == "POP":
                np.testing.assert_array_equal(project.pop, matrix)
                continue
            station = stations[row["scanpos"]]
            np.testing.assert_array_equal(station.sop, matrix)
            ecef = [float(row[k]) for k in ("gnss_x", "gnss_y", "gnss_z")]
            np.testing.assert_array_equal(station.position.vector, ecef)
            assert station.position.accuracy == float(row["gnss_accuracy_m"])
            assert station.conditions["temperature_C"] == row["temp_C"]


def test_names_stand_for_the_same_reflectors(folder):
    survey = riscan.read(folder / "project.rsp")
    assert not any("@" in name for name in survey.network().start.layout.names["point"])


def test_residuals(adjustment):
    """A rigid fit without weights leaves 2.648 mm; the weighted one a little more."""
    rms = np.sqrt((misfit(adjustment) ** 2).sum(axis=1).mean())
    assert 0.002647 < rms < 0.00272
    # 120 coordinates, 6 GNSS, 2 tilts; 12 pose and 60 target unknowns
    assert adjustment.dof == 128 - 72
    assert adjustment.defect == 0


def test_start_and_result_agree_with_the_program(adjustment, folder):
    """The relative pose is RiSCAN PRO's own to a millimetre and some arc seconds."""
    sop = {s.name: s.sop for s in parse(folder / "project.rsp").stations}
    between = np.linalg.inv(sop["SP01"]) @ sop["SP02"]
    t, r = adjustment.state.pose_t, adjustment.state.pose_r
    np.testing.assert_allclose(r[0].T @ (t[1] - t[0]), between[:3, 3], atol=0.002)
    turn = r[0].T @ r[1] @ between[:3, :3].T
    assert np.degrees(np.arccos((np.trace(turn) - 1) / 2)) < 0.01


def test_gnss_gives_place_and_heading_and_no_shape(adjustment):
    """Metres and degrees of the whole, millimetres between the stations."""
    a, b, cross = (adjustment.covariance(*n) for n in (("SP01",), ("SP02",), ("SP01", "SP02")))
    place = np.sqrt(np.diag(a)[:3])
    assert (place > 1.5).all()
    assert (place < 3.0).all()
    heading = np.degrees(np.sqrt(a[5, 5]))
    assert 3.0 < heading < 15.0
    tilt = np.degrees(np.sqrt(np.diag(a)[3:5]))
    np.testing.assert_allclose(tilt, 0.01, rtol=0.05)
    vector = adjustment.state.pose_t[1] - adjustment.state.pose_t[0]
    unit = vector / np.linalg.norm(vector)
    difference = (a + b - cross - cross.T)[:3, :3]
    assert np.sqrt(unit @ difference @ unit) < 0.005
    turn = (a + b - cross - cross.T)[3:, 3:]
    assert np.degrees(np.sqrt(np.diag(turn))).max() < 0.03


def test_a_moved_reflector_stands_out(adjustment, folder, tmp_path):
    """30 mm on one reflector of one station give it the largest misfit of all by far."""
    stations = {s.name: s for s in parse(folder / "project.rsp").stations}
    point = next(t for t in stations["SP02"].targets if t.name == "tp003")
    lines = (folder / "project.rsp").read_text().splitlines()
    at = int(point.source.rpartition(":")[2])
    while "<vector" not in lines[at]:
        at += 1
    values = " ".join(repr(float(v)) for v in point.vector + np.array([0.03, 0, 0]))
    lines[at] = f'<vector length="3"> {values} </vector>'
    path = tmp_path / "project.rsp"
    path.write_text("\n".join(lines))
    adjusted = adjust(riscan.read(path).network())
    size = np.linalg.norm(misfit(adjusted), axis=1)
    assert int(np.argmax(size)) == 2
    assert size[2] > 3 * np.delete(size, 2).max()
    suspicious, largest = suspects(adjusted)
    assert suspicious == {"tp003"}
    assert largest == "tp003"
    assert suspects(adjustment)[0] == set()


@pytest.mark.parametrize(
    ("name", "sentence"),
    [("empty.rsp", "the file is empty"), ("notaproject.rsp", "root element is <notaproject>")],
)
def test_files_that_are_no_projects(folder, name, sentence):
    with pytest.raises(InputError, match=sentence):
        riscan.read(folder / name)
