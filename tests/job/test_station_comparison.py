"""A run that compares two stations, and the same again from the files that it leaves."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lxml import html as parser

from tests.cli.test_scans_cli import fails, works
from tests.comparison.hanoi_sites import with_step
from tests.network.hanoi import twin
from tribrach.cloud.placement import Placement
from tribrach.errors import InputError
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.scans.formats import read_scans
from tribrach.io.twins import write_twin
from tribrach.job.cloud_file import open_cloud
from tribrach.job.poses import JOINT, read_poses
from tribrach.job.scans import MeasuredScan
from tribrach.job.station_comparison import _cloud, _PlacedScans
from tribrach.pipeline import run
from tribrach.project import Project
from tribrach.report.content import Report
from tribrach.simulate.aiming import fine_scan
from tribrach.simulate.twins.hanoi_facade import CHECKS, FINE_STEP

SOME = (0, 4, 9, 15)


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Report]:
    """Stations S3 and S4 of the twin: their boards, and four of the sites coarsely."""
    folder, made = tmp_path_factory.mktemp("compared"), twin(1)
    stations = [made.station(name) for name in ("S3", "S4")]
    shared = [t for t in made.targets if all(t.name in made.visible(s.name) for s in stations)]
    boards = [t for t in shared if t.name not in CHECKS][:5]
    windows = [fine_scan(s.name, s.pose, boards, FINE_STEP) for s in stations]
    scans = [*windows, *with_step(made, 0.0012, SOME).scans]
    rows = made.files["sites.csv"].splitlines()
    files = dict(made.files) | {"sites.csv": "\n".join([rows[0], *(rows[k + 1] for k in SOME)])}
    # boards that nobody scans here are no check points
    project = made.project.replace('[[points]]\nfile = "check.csv"\nrole = "check"\n', "")
    small = replace(made, stations=stations, scans=scans, files=files, project=project)
    path = write_twin(small, folder)
    return folder, run(Project.load(path))


def test_every_json_that_simulation_and_run_leave_is_strict(job: tuple[Path, Report]) -> None:
    paths = sorted(job[0].rglob("*.json"))
    names = {path.name for path in paths}
    assert {"result.json", "poses.json", "truth.json", "written.json"} <= names
    assert len([path for path in paths if path.parent.name == ".tribrach"]) > 5
    words = list[str]()
    for path in paths:
        json.loads(path.read_text(), parse_constant=words.append)
        assert words == [], path


def test_intensities_are_those_of_the_scans_and_of_their_clouds(job: tuple[Path, Report]) -> None:
    """The law of a noise is of the numbers in the scan, wherever that got them from."""
    folder, _ = job
    (scan,) = read_scans(folder / "scans" / "S3-sites.laz")
    raw = np.concatenate([chunk.values["intensity"] for chunk in scan.chunks()])
    assert 0 < raw.max() < 1
    noise = ScanNoise(0.002, 0.0, 0.0, 0.0)
    where = Placement("S3", Pose(np.eye(3), np.zeros(3)), np.zeros((6, 6)), noise)
    side = _PlacedScans((MeasuredScan("S3-sites", "S3", scan, noise),), where)
    cloud = _cloud(side, OutputFrame(WorkFrame()))
    np.testing.assert_array_equal(np.concatenate(list(cloud.lit()))[:, 3], raw)
    (path,) = (folder / "out" / "clouds").glob("*S3-sites.laz")
    lit = np.concatenate(list(open_cloud(path).lit()))[:, 3]
    np.testing.assert_array_equal(np.sort(lit), np.sort(raw))


def test_the_report_has_a_chapter_of_the_comparison(job: tuple[Path, Report]) -> None:
    folder, content = job
    (chapter,) = content.job.comparisons
    assert (chapter.a, chapter.b) == ("S3 S3-sites", "S4 S4-sites")
    assert [s.name for s in chapter.sites] == [str(k + 1) for k in SOME]
    for site in chapter.sites:
        assert site.prediction is not None
        assert 0.85 < site.prediction.noise_ratio < 1.15
        assert site.c2c is not None
        assert site.c2c.floor is not None
        assert site.range is not None
    assert chapter.offsets is not None
    assert chapter.regression is not None
    data = json.loads((folder / "out" / "result.json").read_text())["comparisons"]
    assert [len(one["sites"]) for one in data] == [len(SOME)]
    assert data[0]["sites"][0]["predicted_sigma"] == chapter.sites[0].predicted_sigma
    assert data[0]["regression"]["rows"] == len(SOME)
    text = (folder / "out" / "report.txt").read_text()
    assert "Comparison between stations: S3, sites against S4, sites" in text
    assert "joint covariance of the stations says" in " ".join(text.split())
    root = parser.fromstring((folder / "out" / "report.html").read_text())
    ids = {s.get("id") for s in root.iter("section")}
    slug = "S3-S3-sites-S4-S4-sites"
    assert {
        f"{t}-{slug}" for t in ("sites", "c2c", "m3c2", "predicted", "predicted-classes", "fits")
    } <= ids
    assert f"predicted-observed-{slug}" in {f.get("id") for f in root.iter("figure")}


def test_the_joint_covariance_is_beside_the_poses(job: tuple[Path, Report]) -> None:
    folder, content = job
    poses = read_poses(folder / "out" / "clouds" / "poses.json")
    assert poses.stations == ("S3", "S4")
    assert poses.shared is not None
    joint = poses.shared.covariance
    for k, name in enumerate(poses.stations):
        (station,) = (s for s in content.stations if s.name == name)
        own = joint[6 * k : 6 * k + 6, 6 * k : 6 * k + 6]
        assert own == pytest.approx(np.array(station.covariance, dtype=float), rel=1e-9)
    # control is common to both
    between = joint[:3, 6:9]
    sigma = np.sqrt(np.diag(joint))
    assert (np.diag(between) / sigma[:3] / sigma[6:9] > 0.5).all()
    first = poses.scans[0].placement
    assert first.noise is not None
    assert first.noise.range == pytest.approx(content_noise())
    assert poses.pair(poses.scans[0], poses.scans[1]) is not None
    inside = content.job.placed.shared
    assert poses.shared.effects == inside.effects == ()
    assert {s.scan for s in poses.scans} == set(poses.shared.scans) == set(inside.scans)
    assert joint == pytest.approx(inside.covariance, rel=1e-12)


def content_noise() -> float:
    """Sigma of ranges that the project of the twin states [m]."""
    line = next(x for x in twin(1).project.splitlines() if x.startswith("range_mm"))
    return float(line.split("=")[1]) / 1e3


def test_compare_says_the_same_from_the_files(job: tuple[Path, Report], tmp_path: Path) -> None:
    folder, content = job
    clouds, out = folder / "out" / "clouds", tmp_path / "c.json"
    said = works("compare", clouds / "S3_S3-sites.laz", clouds / "S4_S4-sites.laz",
                 "--sites", folder / "sites.csv", "--json", out,
                 "--html", tmp_path / "c.html", "--alignment", tmp_path / "a.json")  # fmt: skip
    data = json.loads(out.read_text())
    (chapter,) = content.job.comparisons
    peer = json.loads((tmp_path / "a.json").read_text())
    poses = read_poses(clouds / "poses.json")
    pair = poses.pair(poses.scans[3], poses.scans[2])
    assert pair is not None
    middle = (pair.first + pair.second) / 2
    assert peer["refPointMov"] == pytest.approx(middle)
    assert np.array(peer["Cxx"])[9:, 9:] == pytest.approx(pair.relative(middle)[:3, :3])
    for site, inside in zip(data["sites"], chapter.sites, strict=True):
        assert inside.prediction is not None
        # the files are rounded to a tenth of a millimetre
        assert site["predicted_sigma"] == pytest.approx(inside.predicted_sigma, rel=0.01)
        found = site["prediction"]
        assert found["ratio"] == pytest.approx(inside.prediction.ratio, abs=0.05)
        assert found["registration"] == pytest.approx(inside.prediction.registration, rel=0.02)
        assert found["lod95"] == pytest.approx(inside.prediction.lod95, rel=0.05)
    assert data["offsets"]["count"] == len(SOME)
    assert "joint covariance" in " ".join(said.split())


def test_clouds_without_the_joint_covariance_have_no_prediction(
    job: tuple[Path, Report], tmp_path: Path
) -> None:
    folder, _ = job
    clouds = folder / "out" / "clouds"
    data = json.loads((clouds / "poses.json").read_text())
    data["joint_covariance"] = None
    (tmp_path / "poses.json").write_text(json.dumps(data))
    out = tmp_path / "c.json"
    works("compare", clouds / "S3_S3-sites.laz", clouds / "S4_S4-sites.laz", "--poses",
          tmp_path / "poses.json", "--sites", folder / "sites.csv", "--json", out)  # fmt: skip
    assert "not known with their covariance" in fails(
        "compare", clouds / "S3_S3-sites.laz", clouds / "S4_S4-sites.laz", "--poses",
        tmp_path / "poses.json", "--alignment", tmp_path / "a.json")  # fmt: skip
    assert not (tmp_path / "a.json").exists()
    assert {s["predicted_sigma"] for s in json.loads(out.read_text())["sites"]} == {None}


@pytest.mark.parametrize("harm", ["pickle", "short", "other shape", "nan", "absent", "huge"])
def test_a_joint_covariance_that_is_none_is_refused(
    job: tuple[Path, Report], tmp_path: Path, harm: str
) -> None:
    clouds = job[0] / "out" / "clouds"
    (tmp_path / "poses.json").write_bytes((clouds / "poses.json").read_bytes())
    whole, path = (clouds / JOINT).read_bytes(), tmp_path / JOINT
    if harm == "pickle":
        np.save(path, np.array([{}], dtype=object), allow_pickle=True)
    elif harm == "short":
        path.write_bytes(whole[:-8])
    elif harm == "other shape":
        np.save(path, np.eye(6))
    elif harm == "nan":
        np.save(path, np.full((12, 12), np.nan))
    elif harm == "huge":
        path.write_bytes(whole.replace(b"(12, 12)", b"(9000000, 9000000)"[:8]))
    with pytest.raises(InputError, match=JOINT.replace(".", r"\.")):
        read_poses(tmp_path / "poses.json")
    assert "Traceback" not in fails("compare", clouds / "S3_S3-sites.laz",
                                    clouds / "S4_S4-sites.laz", "--poses",
                                    tmp_path / "poses.json")  # fmt: skip


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('a = "S3 S3-sites"', 'a = "S9"', "there is no scan or station S9"),
        ('b = "S4 S4-sites"', 'b = "S3 S3-targets"', "are scans of one station, S3"),
        ('b = "S4 S4-sites"', 'b = "S3 S3-sites"', "compared with itself"),
        ('sites = "sites.csv"', 'sites = "none.csv"', "none.csv"),
        ('sites = "sites.csv"', "limit_mm = 0", "limit_mm"),
    ],
)
def test_wrong_wishes_are_refused_at_once(
    job: tuple[Path, Report], old: str, new: str, words: str
) -> None:
    text = (job[0] / "hanoi-facade.toml").read_text()
    assert old in text
    path = job[0] / "wrong.toml"
    path.write_text(text.replace(old, new))
    assert words in " ".join(fails("run", path, "--out", job[0] / "wrong").split())
    assert not (job[0] / "wrong" / "report.html").exists()


@pytest.mark.slow
def test_sites_are_chosen_where_none_are_given(job: tuple[Path, Report]) -> None:
    """Flat pieces of the facade; the four windows that both stations scanned."""
    text = (job[0] / "hanoi-facade.toml").read_text()
    path = job[0] / "chosen.toml"
    path.write_text(text.replace('sites = "sites.csv"', ""))
    content = run(Project.load(path), job[0] / "out")
    (chapter,) = content.job.comparisons
    assert len(chapter.sites) >= 4
    assert "sites were chosen on flat surfaces" in " ".join(chapter.remarks)
    for site in chapter.sites:
        assert site.c2c is not None
        assert site.c2c.places[:, 0] == pytest.approx(1090.0, abs=0.03)
        # where it is drawn: the middle of what was compared
        assert site.center == pytest.approx(site.c2c.places.mean(axis=0).tolist(), abs=0.4)
