"""Stations of a project tied by planes and targets: from scans to the report, against the truth."""

import json
import re

import numpy as np
import pytest
from scipy.stats import chi2

from tests.registration.plane_scenes import POSES, V, corridor, room, upright, yard
from tribrach import pipeline
from tribrach.errors import InputError
from tribrach.geometry import rotation
from tribrach.geometry.rotation import skew
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.twins import write_twin
from tribrach.job.opened import open_job
from tribrach.job.steps import find_and_name
from tribrach.network.adjustment import adjust
from tribrach.project import Project
from tribrach.registration.edges import edges
from tribrach.simulate.scanner import ScanGrid, Scanner
from tribrach.simulate.scene import Scene
from tribrach.simulate.twin import Twin, TwinScan, TwinStation
from tribrach.simulate.twins.sphere_courtyard import build
from tribrach.units import SEC

STEP = 0.012
PROJECT = """
title = "Planes"
truth = "truth/truth.json"
datum = "free"

[instruments.scanner]
range_mm = 1.0
range_ppm = 10.0
scan_angle_arcsec = 10.0
levelling_arcsec = 10.0

[registration]
by = ["planes"]
plane_floor_mm = 0.0

[cloud]
write = false
"""


def write(folder, scene, poses, step=STEP):
    """A simulated project of levelled stations without targets and survey."""
    grid = ScanGrid(-np.pi, V[0], step, round((V[1] - V[0]) / step), round(2 * np.pi / step))
    stations = [TwinStation(name, pose, True) for name, pose in poses.items()]
    twin = Twin(
        "planes",
        "Planes",
        1,
        scene,
        Scanner(ScanNoise(0.001, 1e-5, 10 * SEC, 10 * SEC, 0.002, 0.0002)),
        stations,
        [TwinScan(s.name, s.name, grid) for s in stations],
        [],
        project=PROJECT,
    )
    return write_twin(twin, folder, truth=0)


def relative(adjustment, truth, root):
    """Errors (36,) and covariance of all poses relative to one station, whatever the frame."""
    layout, state = adjustment.layout, adjustment.state
    names = layout.names["pose"]
    r = names.index(root)
    columns = layout.columns("pose", np.arange(len(names))).ravel()
    covariance = adjustment.covariance_columns(columns, columns)
    true = {name: np.array(truth[name]["world_from_scanner"]) for name in names}
    turn = state.pose_r[r] @ true[root][:3, :3].T
    errors, rows = [], []
    for k, name in enumerate(names):
        if k == r:
            continue
        place = state.pose_t[r] + turn @ (true[name][:3, 3] - true[root][:3, 3])
        spin = rotation.log(state.pose_r[k] @ (turn @ true[name][:3, :3]).T)
        errors.append(np.concatenate([state.pose_t[k] - place, spin]))
        row = np.zeros((6, 6 * len(names)))
        row[:, 6 * k : 6 * k + 6] = np.eye(6)
        row[:, 6 * r : 6 * r + 6] = -np.eye(6)
        row[:3, 6 * r + 3 : 6 * r + 6] = skew(state.pose_t[k] - state.pose_t[r])
        rows.append(row)
    motion = np.concatenate(rows)
    return np.array(errors), motion @ covariance @ motion.T


def statistic(errors, covariance):
    sigma = np.sqrt(np.diag(covariance))
    scaled = errors.ravel() / sigma
    return float(scaled @ np.linalg.solve(covariance / np.outer(sigma, sigma), scaled))


def solved(project, folder):
    job = open_job(project)
    work = find_and_name(job, folder, lambda *_: None)
    return work, adjust(job.network(work.registered.survey))


def quiet(*_):
    """No progress."""


#: of the inner faces of the yard: normal, coordinate along it, spans of the others; what rises
#: above a lower wall goes on behind it, so that its span is open
FACES = (
    ((0, -1, 0), 10, {0: (-15, 15), 2: (0, 8)}),
    ((0, 1, 0), -8, {0: (-15, 15), 2: (0, 6)}),
    ((1, 0, 0), -15, {2: (0, 7)}),
    ((-1, 0, 0), 15, {2: (0, 5)}),
)


def drawn_on_faces(planes, station, true):
    """What a viewer draws of every wall is its face, to a cell of the patches that were seen."""
    turn = np.array(true["world_from_scanner"]) @ np.linalg.inv(station["world_from_scanner"])
    found = 0
    for plane in planes.values():
        axes, half = np.array(plane["axes"]), np.array(plane["half"])
        normal = turn[:3, :3] @ np.cross(*axes)
        signs = np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]])
        corners = np.array(plane["centre"]) + (signs * half) @ axes
        places = corners @ turn[:3, :3].T + turn[:3, 3]
        for way, at, spans in FACES:
            if np.dot(way, normal) < 0.999:
                continue
            found += 1
            assert axes[1][2] > 0.999
            assert places @ np.abs(way) == pytest.approx(np.full(4, at), abs=0.03)
            for axis, (low, high) in spans.items():
                assert places[:, axis].min() == pytest.approx(low, abs=0.9)
                assert places[:, axis].max() == pytest.approx(high, abs=0.9)
    assert found == len(FACES)


def test_a_yard_is_registered_by_planes_alone(tmp_path):
    """From scans to the report; poses relative to each other as exact as stated."""
    project = Project.load(write(tmp_path, yard(), POSES))
    content = pipeline.run(project, tmp_path / "out")
    chapter = next(c for c in content.chapters if c.name == "registration")
    assert len(chapter.data.edges) == 3
    assert not any(edge.outlying for edge in chapter.data.edges)
    assert {edge.kind for edge in chapter.data.edges} == {"plane"}
    assert "Planes join" in chapter.sentences[0]
    assert content.chapter("scans").data.truth == []
    assert any("not compared" in text for text in content.warnings)
    result = json.loads((tmp_path / "out" / "result.json").read_text())
    assert len(result["stations"]) == 3
    assert "Pairs of stations" in (tmp_path / "out" / "report.html").read_text()
    _, adjustment = solved(project, tmp_path / "out")
    truth = json.loads((tmp_path / "truth" / "truth.json").read_text())["stations"]
    beside = json.loads((tmp_path / "out" / "workbench.json").read_text())
    drawn_on_faces(beside["planes"], result["stations"]["S1"], truth["S1"])
    errors, covariance = relative(adjustment, truth, "S1")
    least, most = chi2.ppf([0.005, 0.995], errors.size)
    assert least < statistic(errors, covariance) < most


def test_planes_are_remembered_and_found_anew_when_the_settings_change(tmp_path):
    file = write(tmp_path, yard(), {k: POSES[k] for k in ("S1", "S2")})
    out = tmp_path / "out"
    find_and_name(open_job(file), out, quiet)
    said = []
    find_and_name(open_job(file), out, lambda what, *_: said.append(what))
    assert not any(what.startswith("planes of") for what in said)
    file.write_text(file.read_text().replace("plane_floor_mm = 0.0", "plane_floor_mm = 0.5"))
    find_and_name(open_job(file), out, lambda what, *_: said.append(what))
    assert "planes of S1" in said
    record = out / ".tribrach" / "planes-S1.json"
    record.write_text(record.read_text().replace('"packed": "', '"packed": "AAAA'))
    said.clear()
    find_and_name(open_job(file), out, lambda what, *_: said.append(what))
    assert said.count("planes of S1") == 1


@pytest.mark.parametrize(
    ("scene", "places", "words"),
    [
        (corridor(), [(-5, 0.2, 1.5), (0, -0.3, 1.6)], "leave open the shift level along H ="),
        (Scene.of(room()), [(1, 0.5, 1.5), (-1.5, -0.3, 1.6)], "in 2 ways .turned by 180 deg"),
        (
            Scene.of([*room(), *room(30, (7, 5, 3.4))]),
            [(1, 0.5, 1.5), (29, -0.3, 1.6)],
            "overlaps with none, or too little",
        ),
    ],
)
def test_what_planes_do_not_hold_is_refused_with_its_sentence(tmp_path, scene, places, words):
    poses = {f"S{k + 1}": upright(0.2 + k, place) for k, place in enumerate(places)}
    file = write(tmp_path, scene, poses, 0.016)
    with pytest.raises(InputError, match=words) as caught:
        pipeline.run(Project.load(file), tmp_path / "out")
    assert "cannot be registered: by planes" in caught.value.what
    assert not (tmp_path / "out" / "report.html").exists()


def courtyard(folder, by, *, free=False, without=(), more=""):
    """The courtyard's project with another section registration."""
    text = (folder / "sphere-courtyard.toml").read_text()
    if free:
        text = text.replace('kind = "control"', 'kind = "free"')
        text = re.sub(r"\[\[(points|observations)\]\][^\[]*", "", text)
    for name in without:
        text = re.sub(rf'\[\[scans\]\]\nfile = "scans/{name}[^\[]*', "", text)
        text = re.sub(rf"\[stations.{name}\][^\[]*", "", text)
    text += f"\n[registration]\nby = {json.dumps(by)}\nplane_floor_mm = 0.0\n{more}\n"
    file = folder / f"{'-'.join(by)}{'-free' * free}{''.join(without)}.toml"
    file.write_text(text)
    return Project.load(file)


#: simulated scanners have nothing of what the floor of clouds stands for
NO_FLOOR = "cloud_floor_mm = 0.0\ncloud_floor_arcsec = 0.0"
#: how the yard's stations are registered; six of them by planes, which leave the seventh open
WAYS = {
    "planes": (["planes"], {"free": True, "without": ("S6",)}),
    "targets": (["targets"], {}),
    "clouds": (
        ["clouds"],
        {"free": True, "more": "cloud_floor_mm = 0.0\ncloud_floor_arcsec = 0.0"},
    ),
    "targets and planes": (["targets", "planes"], {}),
    "all": (["targets", "planes", "clouds"], {}),
}


@pytest.mark.slow
def test_the_courtyard_by_planes_by_targets_by_clouds_and_by_all(tmp_path):
    """Five seeds. The partial station is explained and placed by its spheres; all ties are best."""
    squares = {way: [] for way in WAYS}
    for seed in range(1, 6):
        folder = tmp_path / str(seed)
        write_twin(build(400_000, seed), folder, truth=0)
        truth = json.loads((folder / "truth" / "truth.json").read_text())["stations"]
        with pytest.raises(InputError, match=r"S6 .* only 2 independent directions and leave open"):
            solved(courtyard(folder, ["planes"], free=True), folder / "out")
        for way, (by, more) in WAYS.items():
            work, adjustment = solved(courtyard(folder, by, **more), folder / "out")
            names = [n for n in adjustment.layout.names["pose"] if n != "S1"]
            assert len(names) == (5 if way == "planes" else 6)
            errors, covariance = relative(adjustment, truth, "S1")
            least, most = chi2.ppf([0.005, 0.995], errors.size)
            assert least < statistic(errors, covariance) < most, (seed, way)
            assert not any(edge.outlying for edge in edges(adjustment))
            whole = np.array([name != "S6" for name in names])
            squares[way].append((errors[:, :3] ** 2).sum(axis=1)[whole].mean())
            if way == "targets and planes":
                assert "its targets place it" in " ".join(work.registered.sentences)
                assert "S6" in work.registered.ties.station
    size = {way: float(np.sqrt(np.mean(x))) for way, x in squares.items()}
    assert size["all"] <= min(size.values()) * 1.001, size
    assert size["all"] < 0.2 * size["targets"]
    assert size["all"] < 0.8 * size["clouds"]
