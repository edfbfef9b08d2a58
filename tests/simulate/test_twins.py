"""Twins are what they say, and files hold what was simulated."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from tests.simulate.surfaces import distance_to_surface
from tribrach.cloud.covariance import covariances
from tribrach.cloud.placement import Placement
from tribrach.errors import InputError
from tribrach.instruments.calibration import NIST
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.scans.las import read
from tribrach.io.twins import write_twin
from tribrach.job.opened import open_job
from tribrach.project import Project
from tribrach.simulate.scanner import Scanner
from tribrach.simulate.twins import TWINS, build, campus, newcastle_lab

POINTS = 20_000


@pytest.fixture(scope="module", params=sorted(TWINS))
def twin(request):
    return build(request.param, POINTS, 3)


def test_stations_and_targets(twin):
    counts = {
        "hanoi-facade": (4, 14),
        "sphere-courtyard": (7, 8),
        "newcastle-lab": (2, 52),
        "newcastle-lab-ceiling": (2, 64),
        "konya-building": (10, 49),
        "retaining-wall": (3, 10),
    }
    assert (len(twin.stations), len(twin.targets)) == counts[twin.name]
    assert len({t.name for t in twin.targets}) == len(twin.targets)
    least = 3 if twin.name == "sphere-courtyard" else 4
    for station in twin.stations:
        assert len(twin.visible(station.name)) >= least, station.name


def test_noise_free_points_lie_on_primitives_and_targets_are_hit(twin):
    quiet = replace(twin, scanner=Scanner(ScanNoise(0, 0, 0, 0), intensity=0))
    for number in range(2):
        pose = twin.station(twin.scans[number].station).pose
        for block in quiet.measure(number):
            world = pose @ block.xyz
            assert np.abs(world - block.truth).max() < 1e-9
            assert distance_to_surface(twin.scene, block.primitive, world).max() < 1e-9
    first = twin.stations[0].name
    mine = [k for k, one in enumerate(twin.scans) if one.station == first]
    hit = np.concatenate([block.primitive for k in mine for block in quiet.measure(k)])
    offset = len(twin.scene) - len(twin.targets)
    for k, target in enumerate(twin.targets):
        if target.name in twin.visible(first):
            expected = twin.sights[first][target.name].points
            assert (hit == offset + k).sum() > 0.8 * expected or expected > 3000, target.name


def test_seeds_draw_other_errors_in_the_same_place(twin):
    same, other = build(twin.name, POINTS, 3), build(twin.name, POINTS, 4)
    assert dict(same.files) == dict(twin.files)
    assert dict(other.files) != dict(twin.files)
    centers = [np.array([t.center for t in w.targets]) for w in (twin, other)]
    assert np.array_equal(*centers) or twin.name == "konya-building"


def test_the_project_reads_the_tables(twin, tmp_path):
    for name, text in twin.files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    path = tmp_path / "project.toml"
    path.write_text(twin.project + '[[scans]]\nfile = "none.laz"\n')
    job = open_job(path)
    if twin.name.startswith("newcastle"):
        assert job.survey.points
    else:
        assert len(job.network().observations) > 0


def test_newcastle_is_the_layout_of_the_method():
    centers, normals = newcastle_lab.places()
    assert centers.shape == (52, 3)
    assert np.allclose(np.linalg.norm(normals, axis=1), 1)
    assert np.allclose(centers[0], [-5, -3.5, -0.89])
    assert np.allclose(centers[1], [-5, -3.5 + 0.13, -0.30 + 0.0])
    twin = newcastle_lab.build(POINTS, 1)
    base = twin.stations[1].pose.translation - twin.stations[0].pose.translation
    assert np.linalg.norm(base) == pytest.approx(6.2417, abs=1e-9)


def test_newcastle_list_is_consistent_with_its_misalignments():
    twin = newcastle_lab.build(POINTS, 6)
    rows = list(csv.DictReader(twin.files["polar.csv"].splitlines()))
    assert len(rows) == 2 * 2 * 52
    targets = {t.name: t.center for t in twin.targets}
    polar = np.array(
        [[float(r[n]) for n in ("range_m", "horizontal_gon", "zenith_gon")] for r in rows]
    )
    polar[:, 1:] *= np.pi / 200
    face = np.array([float(r["face"]) for r in rows])
    model = NIST.select(tuple(newcastle_lab.MISALIGNMENTS))
    values = np.tile(list(newcastle_lab.MISALIGNMENTS.values()), (len(rows), 1))
    true = polar + model.delta(polar, face, values)
    local = np.array([twin.station(r["station"]).pose.inverse @ targets[r["target"]] for r in rows])
    r = np.linalg.norm(local, axis=1)
    h, v = np.arctan2(local[:, 1], local[:, 0]), np.arccos(local[:, 2] / r)
    turn = np.angle(np.exp(1j * (true[:, 1] - h)))
    sigma = np.array([[float(x["sigma_range_mm"]) / 1e3, 8 / 206264.8, 8 / 206264.8] for x in rows])
    total = ((np.stack([true[:, 0] - r, turn, true[:, 2] - v], axis=1) / sigma) ** 2).sum()
    assert chi2.ppf(0.001, 3 * len(rows)) < total < chi2.ppf(0.999, 3 * len(rows))


def test_traverse_has_the_published_legs():
    xyz = campus.traverse()
    legs = np.linalg.norm(np.diff(np.vstack([xyz, xyz[:1]]), axis=0)[:, :2], axis=1)
    assert legs == pytest.approx(campus.LEGS, abs=1e-9)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    twin, folder = build("sphere-courtyard", POINTS, 2), tmp_path_factory.mktemp("twin")
    told = []
    path = write_twin(twin, folder, lambda *what: told.append(what), truth=5000)
    assert told[-1][1] == told[-1][2]
    return twin, folder, path


def test_files_of_a_twin(written):
    twin, folder, path = written
    truth = json.loads((folder / "truth" / "truth.json").read_text())
    assert set(truth["stations"]) == {s.name for s in twin.stations}
    assert truth["stations"]["S1"]["visible"] == twin.visible("S1")
    assert truth["points"]["P2"] == twin.targets[1].center.tolist()
    project = Project.load(path)
    assert len(project.scans) == len(twin.scans)
    for one in project.scans:
        (scan,) = read(folder / one.file)
        assert scan.records == truth["scans"][scan.name]["points"]
        assert {"intensity", "row", "column"} <= set(scan.names)
    assert [path.name for path in folder.rglob(".*")] == [".tribrach"]


def test_points_on_disk_err_as_stated(written):
    """Mean squared normalised error of points against their true places, C_int as in clouds."""
    twin, folder, _ = written
    for name in ("S1", "S6"):
        (scan,) = read(folder / "scans" / f"{name}.laz")
        (chunk,) = scan.chunks()
        with np.load(folder / "truth" / f"truth-{name}.npz") as data:
            number, place = data["point"], data["xyz"]
        assert len(number) == 5000
        assert (np.diff(number) > 0).all()
        pose = twin.station(name).pose
        where = Placement(name, pose, np.zeros((6, 6)), twin.scanner.noise)
        c = covariances(chunk.xyz[number], where)[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)
        error = pose @ chunk.xyz[number] - place
        mean = np.einsum("ni,nij,nj->", error, np.linalg.inv(c), error) / (3 * len(error))
        assert 0.96 < mean < 1.04


def test_names_and_numbers_that_make_no_sense():
    with pytest.raises(InputError, match="there is no twin 'hanoi'"):
        build("hanoi")
    with pytest.raises(InputError, match="5 points per station"):
        build("hanoi-facade", 5)
