"""Calibrating, then applying: scans of a misaligned scanner come out true, with honest sigmas."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import laspy
import numpy as np
import pytest

import tribrach as tb
from tests.job.cloud_jobs import made, opened, placed, several
from tests.network.lab import STATIONS
from tribrach import pipeline
from tribrach.errors import InputError
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.geometry.polar import polar_from_xyz, xyz_from_polar
from tribrach.geometry.rotation import exp
from tribrach.instruments.calibration import NIST
from tribrach.instruments.correction import Correction
from tribrach.io.calibration_file import calibration_text, read_calibration
from tribrach.io.scans.formats import read_scans
from tribrach.io.twins import write_twin
from tribrach.job.grouping import whole_source
from tribrach.job.opened import open_job
from tribrach.job.poses import JOINT, read_poses
from tribrach.project import Project
from tribrach.questions.calibrate.project import calibrate_project, calibrations_of
from tribrach.report import text as text_report
from tribrach.scan.prepared import corrected_scan
from tribrach.simulate.twins.newcastle_lab import MISALIGNMENTS, build, places
from tribrach.units import SEC

MODEL = NIST.select(list(MISALIGNMENTS))
VALUES = np.array(list(MISALIGNMENTS.values()))
POINTS = 4000

HEAD = """\
title = "Room"

[instruments.scanner]
range_mm = 1.2
range_ppm = 10.0
scan_angle_arcsec = 8.0
"""
CALIBRATE = (
    'datum = "free"\n'
    + HEAD
    + """\

[[observations]]
file = "readings.csv"

[calibration]
model = "nist"
parameters = ["x10", "x2", "x3", "x4", "x6"]
"""
)
JOB = (
    HEAD
    + """\
{calibration}
[[points]]
file = "control.csv"

[[observations]]
file = "front.csv"

[[scans]]
file = "S1.xyz"
origin = "scanner"

[[scans]]
file = "S2.xyz"
origin = "scanner"

[cloud]
format = "las"

[output]
folder = "{folder}"
"""
)


def measured(true: np.ndarray, face: float, rng: np.random.Generator, noise: float) -> np.ndarray:
    """Readings (n, 3) of true polar coordinates on a face."""
    faces = np.full(len(true), face)
    c = np.tile(VALUES, (len(true), 1))
    out = true.copy()
    for _ in range(4):
        out = true - MODEL.delta(out, faces, c)
    sigma = np.column_stack([0.0012 + 1e-5 * true[:, 0], np.full((len(true), 2), 8 * SEC)])
    return out + noise * sigma * rng.normal(size=out.shape)


def rows(face: float, rng: np.random.Generator, repeat: int = 1) -> list[str]:
    x = places(ceiling=True)[0]
    out = []
    for name, (t, w) in STATIONS.items():
        true = polar_from_xyz((x - t) @ exp(w))
        for _ in range(repeat):
            for i, (r, h, v) in enumerate(measured(true, face, rng, 1.0)):
                out.append(
                    f"{name},T{i},{face:.0f},{r:.6f},{np.degrees(h):.8f},{np.degrees(v):.8f}"
                )
    return out


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Readings of both faces to calibrate with, others and scans to use the calibration on."""
    place = tmp_path_factory.mktemp("job")
    rng = np.random.default_rng(11)
    head = "scan,point,face,range_m,horizontal_deg,zenith_deg"
    both = [head, *rows(1.0, rng), *rows(-1.0, rng)]
    (place / "readings.csv").write_text("\n".join(both) + "\n")
    (place / "front.csv").write_text("\n".join([head, *rows(1.0, rng, repeat=4)]) + "\n")
    x = places(ceiling=True)[0]
    control = [
        f"T{i},{','.join(f'{a:.6f}' for a in x[i] + 2e-4 * rng.normal(size=3))},0.2,0.2,0.2"
        for i in range(0, len(x), 5)
    ]
    head = "point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm"
    (place / "control.csv").write_text("\n".join([head, *control]) + "\n")
    low, high = x.min(axis=0), x.max(axis=0)
    world = rng.uniform(low - [0, 0, 0.5], high, (POINTS, 3))
    world[np.arange(POINTS), np.arange(POINTS) % 2] = np.where(
        np.arange(POINTS) % 4 < 2, low[np.arange(POINTS) % 2], high[np.arange(POINTS) % 2]
    )
    np.save(place / "world.npy", world)
    for name, (t, w) in STATIONS.items():
        true = polar_from_xyz((world - t) @ exp(w))
        xyz = xyz_from_polar(measured(true, 1.0, rng, 1.0))
        np.savetxt(place / f"{name}.xyz", xyz, fmt="%.6f")
    (place / "calibrate.toml").write_text(CALIBRATE)
    (place / "plain.toml").write_text(JOB.format(calibration="", folder="plain"))
    known = 'calibration = "scanner.calibration.toml"\n'
    (place / "known.toml").write_text(JOB.format(calibration=known, folder="known"))
    project = Project.load(place / "calibrate.toml")
    job = open_job(project)
    found = calibrate_project(job, lambda *_: None)
    (place / "scanner.calibration.toml").write_text(
        calibration_text(calibrations_of(job, found)["scanner"])
    )
    return place


def errors(folder: Path, job: str, station: str) -> tuple[np.ndarray, np.ndarray]:
    """Errors and stated sigmas (n, 3) [m] of a cloud."""
    cloud = laspy.read(folder / job / "clouds" / f"{station}.las")
    sigma = np.stack([cloud.sigma_x, cloud.sigma_y, cloud.sigma_z], axis=1)
    return cloud.xyz - np.load(folder / "world.npy"), sigma


def test_the_calibration_is_the_truth(folder: Path) -> None:
    known = read_calibration(folder / "scanner.calibration.toml")
    assert known.parameters == MODEL.parameters
    assert (np.abs(known.values - VALUES) < 4 * known.sigma).all()


def test_applied_to_scans_they_come_out_true(folder: Path) -> None:
    """Without the calibration errors are beyond what is stated, with it they are as stated."""
    quality = {}
    for job in ("plain", "known"):
        pipeline.run(Project.load(folder / f"{job}.toml"))
        parts = [errors(folder, job, station) for station in STATIONS]
        quality[job] = np.sqrt(np.mean([((e / s) ** 2).mean() for e, s in parts]))
    assert quality["plain"] > 1.3
    assert quality["known"] == pytest.approx(1.0, abs=0.12)


def test_the_report_says_that_scans_are_corrected(folder: Path) -> None:
    content = pipeline.run(Project.load(folder / "known.toml"))
    text = "\n".join(content.warnings)
    assert "S1 is corrected by x10, x2, x3, x4, x6, adjusted with the network" in text
    result = json.loads((folder / "known" / "result.json").read_text())
    one = result["calibrations"]["x6(scanner)"]
    assert one["unit"] == "rad"
    assert one["value"] == pytest.approx(MISALIGNMENTS["x6"], abs=4 * one["sigma"])


def test_parameters_may_be_unknowns_of_an_ordinary_project(folder: Path) -> None:
    """Where control is good enough they need no file."""
    section = '\n[calibration]\nmodel = "nist"\nparameters = ["x10", "x2", "x3", "x4", "x6"]\n'
    text = JOB.format(calibration="", folder="sought") + section
    (folder / "sought.toml").write_text(text)
    content = pipeline.run(Project.load(folder / "sought.toml"))
    assert "is corrected by x10, x2, x3, x4, x6, adjusted" in "\n".join(content.warnings)
    assert "calibration: mirror tilt (collimation)" in text_report.render(content)
    for u in content.unknowns:
        true = MISALIGNMENTS[u.name.split("(")[0]]
        assert u.value == pytest.approx(true, abs=4 * u.sigma)


def test_what_points_share_stands_beside_the_clouds(folder: Path) -> None:
    """Poses, parameters and common errors with one covariance, read again as it was written."""
    text = JOB.format(calibration='calibration = "scanner.calibration.toml"\n', folder="shared")
    more = "scan_angle_arcsec = 8.0\nrange_scale_common_ppm = 20\nrefraction_sigma = 0.1\n"
    (folder / "shared.toml").write_text(text.replace("scan_angle_arcsec = 8.0\n", more))
    content = pipeline.run(Project.load(folder / "shared.toml"))
    placed = content.job.placed
    assert placed is not None
    inside = placed.shared
    assert inside is not None
    names = [f"{p}(scanner)" for p in MODEL.parameters]
    common = ["range scale(scanner)", "refraction(S1)", "refraction(S2)"]
    assert sorted(inside.effects) == sorted([*names, *common])
    clouds = folder / "shared" / "clouds"
    known = read_poses(clouds / "poses.json").shared
    assert known is not None
    assert known.effects == inside.effects
    assert known.covariance == pytest.approx(inside.covariance, rel=1e-12)
    pose = inside.covariance[:3, inside.columns["S1"][6:]]
    assert np.abs(pose).max() > 0
    # one point by itself has the sigmas of the cloud, all points of a wall what they share
    cloud = laspy.read(clouds / "S1.las")
    sigma = np.stack([cloud.sigma_x, cloud.sigma_y, cloud.sigma_z], axis=1)
    for k in (3, 77):
        point = tb.cloud_points(clouds / "S1.las", ball=(cloud.xyz[k], 1e-6))
        assert tb.mean_of(point).sigma == pytest.approx(sigma[k], rel=2e-3)
    whole = [tb.cloud_points(clouds / f"{name}.las") for name in STATIONS]
    mean = tb.mean_of(whole[0])
    assert (mean.sigma < 0.5 * sigma.min(axis=0)).all()
    assert (np.diag(mean.shared) > 0.9 * np.diag(mean.covariance)).all()
    # both stations saw the same points: their means agree as is stated
    miss = tb.relative(*whole)
    assert (np.abs(miss.value) < 4 * miss.sigma).all()
    apart = np.diag(tb.mean_of(whole[0]).covariance + tb.mean_of(whole[1]).covariance)
    assert np.trace(miss.covariance) < apart.sum()
    with pytest.raises(InputError, match="in the region"):
        tb.cloud_points(clouds / "S1.las", box=([1e6, 0, 0], [1e6 + 1, 1, 1]))
    with pytest.raises(InputError, match="one of them"):
        tb.cloud_points(clouds / "S1.las", box=([0, 0, 0], [1, 1, 1]), ball=([0, 0, 0], 1))
    with pytest.raises(InputError, match="not one scan"):
        tb.cloud_points(shutil.copy(folder / "S1.xyz", folder / "S9.xyz"), poses=clouds)
    with pytest.raises(InputError, match=r"S8\.las: there is no such file"):
        tb.cloud_points(clouds / "S8.las")
    with pytest.raises(InputError, match=r"nowhere.poses\.json: there is no such file of poses"):
        tb.cloud_points(clouds / "S1.las", poses=folder / "nowhere" / "poses.json")
    with pytest.raises(InputError, match=r"radius of -1 m"):
        tb.cloud_points(clouds / "S1.las", ball=([0, 0, 0], -1.0))
    assert len(tb.cloud_points(clouds / "S1.las", poses=clouds)) == len(whole[0])
    # a cloud under the name of another is not taken for it
    alone = folder / "alone"
    alone.mkdir()
    with pytest.raises(InputError, match="not placed by the pose of scan S1"):
        tb.cloud_points(shutil.copy(clouds / "S2.las", alone / "S1.las"), poses=clouds)
    # other programs leave no word of the pose in it
    las = laspy.read(clouds / "S1.las")
    las.vlrs = [v for v in las.vlrs if v.description != "facts as JSON"]
    las.write(alone / "S1.las")
    assert len(tb.cloud_points(alone / "S1.las", poses=clouds)) == len(whole[0])
    with pytest.raises(InputError, match=r"no poses\.json"):
        tb.cloud_points(folder / "S1.xyz")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"nist"', '"none"', "there is no calibration model none"),
        ('"x10"', '"x99"', "has no parameter x99"),
        ('"faces": "front"', '"faces": "top"', "no file of poses"),
        ('"rows": [', '"rows": [7, ', "not made of"),
        ('"rows": [\n     12', '"rows": [\n     2', "not in the joint covariance"),
    ],
)
def test_effects_that_are_none_are_refused(
    folder: Path, tmp_path: Path, old: str, new: str, words: str
) -> None:
    clouds = folder / "known" / "clouds"
    if not clouds.exists():
        pipeline.run(Project.load(folder / "known.toml"))
    text = (clouds / "poses.json").read_text()
    assert old in text
    (tmp_path / "poses.json").write_text(text.replace(old, new))
    (tmp_path / JOINT).write_bytes((clouds / JOINT).read_bytes())
    with pytest.raises(InputError, match=words):
        read_poses(tmp_path / "poses.json")


def test_a_calibration_needs_the_place_of_the_scanner(folder: Path) -> None:
    """Points far from zero without an origin cannot be corrected."""
    np.savetxt(folder / "far.xyz", np.load(folder / "world.npy") + 1000.0, fmt="%.4f")
    known = 'calibration = "scanner.calibration.toml"\n'
    text = JOB.format(calibration=known, folder="far")
    text = text.replace('file = "S1.xyz"\norigin = "scanner"', 'file = "far.xyz"\nstation = "S1"')
    (folder / "far.toml").write_text(text)
    with pytest.raises(Exception, match="calibration cannot be applied"):
        pipeline.run(Project.load(folder / "far.toml"))


def test_corrected_scans_of_an_e57_file_are_written_anew(tmp_path: Path) -> None:
    """A copy with new poses would have the points as they were."""
    xyz = several(tmp_path / "two.e57", 2)
    scans = opened(tmp_path / "two.e57")
    correction = Correction(MODEL, VALUES)
    corrected = [replace(s, scan=corrected_scan(s.scan, correction)) for s in scans]
    assert whole_source(scans)
    assert not whole_source(corrected)
    frame = OutputFrame(WorkFrame(), "work", None)
    products = made(corrected, placed(corrected), frame, tmp_path / "out", format="e57")
    assert len(products) == 2
    for k, product in enumerate(products):
        (back,) = read_scans(product.path)
        found = np.concatenate([chunk.xyz for chunk in back.chunks()])
        np.testing.assert_allclose(found, correction.corrected(xyz[k]), atol=2e-4)
        assert np.abs(found - xyz[k]).max() > 5e-4


@pytest.mark.slow
def test_check_points_of_the_twin_drop_to_the_noise(tmp_path: Path) -> None:
    """Scans with injected misalignments, targets found in them, calibrated from the target list."""
    twin = build(60_000, 1, ceiling=True, parameters=MISALIGNMENTS)
    path = write_twin(twin, tmp_path)
    (tmp_path / "calibrate.toml").write_text(CALIBRATE.replace("readings.csv", "polar.csv"))
    project = Project.load(tmp_path / "calibrate.toml")
    job = open_job(project)
    found = calibrate_project(job, lambda *_: None)
    text = calibration_text(calibrations_of(job, found)["scanner"])
    (tmp_path / "scanner.calibration.toml").write_text(text)
    plain = path.read_text()
    head = "[instruments.scanner]\n"
    known = plain.replace(head, head + 'calibration = "scanner.calibration.toml"\n')
    (tmp_path / "known.toml").write_text(known.replace('folder = "out"', 'folder = "known"'))
    truth = json.loads((tmp_path / "truth" / "truth.json").read_text())
    checks = [f"T{k:02d}" for k in range(4, 53, 6)]
    rms = {}
    for job in (path.name, "known.toml"):
        pipeline.run(Project.load(tmp_path / job))
        folder = tmp_path / ("known" if job == "known.toml" else "out")
        points = json.loads((folder / "result.json").read_text())["points"]
        error = [np.subtract(points[n]["xyz"], truth["points"][n]) for n in checks]
        stated = [np.trace(np.array(points[n]["covariance"])) for n in checks]
        rms[job] = np.sqrt((np.array(error) ** 2).sum(axis=1).mean()), np.sqrt(np.mean(stated))
    assert rms[path.name][0] > 2 * rms[path.name][1]
    assert rms["known.toml"][0] < 1.3 * rms["known.toml"][1]
