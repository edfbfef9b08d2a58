"""Scenes: the same yard in three frames looks the same, up is up, old files stay readable."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import laspy
import numpy as np
import pytest
from jsonschema import Draft202012Validator

from tests.workbench.twins import KINDS, POSES, TARGETS, of_kind
from tribrach.errors import InputError
from tribrach.workbench.clouds import (
    SceneCloudFile,
    cloud_parts,
    convert_clouds,
    convert_further,
    lacking_clouds,
    written_clouds,
)
from tribrach.workbench.further import further_names
from tribrach.workbench.result_folder import ResultFolder, read_result
from tribrach.workbench.scene import scene_of
from tribrach.workbench.schema import FORM, SceneDocument

ROOT = Path(__file__).resolve().parents[2]
STORED = Path(__file__).parent / "scene_schema_1.json"
Yard = Callable[[str], Path]


def scene(folder: Path, clouds: bool = False) -> SceneDocument:
    result, beside = read_result(folder), ResultFolder.beside(folder)
    parts = []
    if clouds:
        found: list[SceneCloudFile] = []
        convert_clouds(written_clouds(result, folder), folder, lambda *_: None, found.append)
        parts = cloud_parts(found, beside.pose_file)
    return scene_of(result, beside, parts)


def drawn(one: SceneDocument, xyz: np.ndarray) -> np.ndarray:
    """Places as the page draws them."""
    return (np.asarray(xyz, dtype=float) - one.origin) @ np.array(one.frame).T


@pytest.mark.parametrize("kind", KINDS)
def test_points_lie_where_pyproj_puts_them(yard: Yard, kind: str) -> None:
    made = scene(yard(kind))
    expected = of_kind(kind, np.array([TARGETS[name] for name in made.points.name]))
    sigma = np.sqrt([np.trace(c) for c in made.points.covariance])
    away = np.linalg.norm(np.array(made.points.xyz) - expected, axis=1)
    assert (away < 5 * sigma).all()
    assert made.axes == {"work": ("e", "n", "u"), "projected": ("e", "n", "h")}.get(
        kind, ("x", "y", "z")
    )


@pytest.mark.parametrize("kind", KINDS)
def test_the_mast_stands_upright(yard: Yard, kind: str) -> None:
    made = scene(yard(kind))
    place = dict(zip(made.points.name, drawn(made, np.array(made.points.xyz)), strict=True))
    mast = place["TOP"] - place["BASE"]
    # a millimetre or two of noise over eight metres; drawn axes are east, north, up
    assert mast == pytest.approx([0.0, 0.0, 8.0], abs=0.006)
    # grid north is not true north: 8 mrad at most here
    east = place["T3"] - place["T1"]
    assert east == pytest.approx([35.0, 10.0, 1.9], abs=0.5)


def test_geocentric_and_projected_twins_look_like_the_local_one(yard: Yard) -> None:
    """Turned into east, north, up the geocentric one is the local one; the grid is flatter."""
    local = scene(yard("work"))
    names = local.points.name
    base = drawn(local, np.array(local.points.xyz))
    for kind, scale, turn in (("ecef", 1e-6, 1e-6), ("projected", 5e-4, 1e-2)):
        other = scene(yard(kind))
        assert other.points.name == names
        place = drawn(other, np.array(other.points.xyz))
        a, b = base - base.mean(axis=0), place - place.mean(axis=0)
        assert np.linalg.norm(b, axis=1) == pytest.approx(
            np.linalg.norm(a, axis=1), rel=scale + 2e-4
        )
        assert np.abs(a - b).max() < 25 * turn + 0.003
        for one, two in zip(local.points.covariance, other.points.covariance, strict=True):
            f = np.array(other.frame)
            assert f @ np.array(two) @ f.T == pytest.approx(np.array(one), abs=2e-7)


@pytest.mark.parametrize("kind", KINDS)
def test_stations_lie_where_their_clouds_were_placed(yard: Yard, kind: str) -> None:
    """Pose by the adjustment through the stored map, and by the poses beside the clouds."""
    folder = yard(kind)
    made, beside = scene(folder), ResultFolder.beside(folder)
    for name, pose, covariance in zip(
        made.stations.name, made.stations.pose, made.stations.covariance, strict=True
    ):
        there, block = beside.frame.stations[name]
        assert np.array(pose) == pytest.approx(there, abs=2e-4)
        assert np.array(covariance) == pytest.approx(block, rel=1e-3, abs=1e-13)
        true = of_kind(kind, np.array([POSES[name][0]]))[0]
        assert np.array(pose)[:3, 3] == pytest.approx(true, abs=0.01)


def test_a_scene_follows_its_schema_and_says_all_the_result_says(yard: Yard) -> None:
    folder = yard("work")
    text = FORM.text(scene(folder, clouds=True))
    told, result = json.loads(text), read_result(folder)
    schema = json.loads((ROOT / "docs/schema/scene.json").read_text())
    Draft202012Validator(schema).validate(told)
    rows = result["observations"]
    for key in ("id", "value", "residual", "w", "mdb", "state", "source"):
        assert told["observations"][key] == [row[key] for row in rows]
    assert told["title"] == "Yard <b>&"
    assert told["summary"]["dof"] == result["sigma0"]["dof"]
    assert set(told["points"]["name"]) == set(result["points"])
    rays = {frozenset(pair) for pair in zip(told["rays"]["from"], told["rays"]["to"], strict=True)}
    assert rays == {frozenset((r["from"], r["to"])) for r in rows if r["to"]}
    assert sorted(k for at in told["rays"]["rows"] for k in at) == [
        k for k, r in enumerate(rows) if r["to"]
    ]
    clouds = {c["name"]: c for c in told["clouds"]}
    assert {c["station"] for c in clouds.values()} == set(POSES)
    sigma = clouds["S1"]["attributes"]["sigma_z"]
    assert 0.0005 < sigma["low"] < sigma["high"] < 0.05
    assert clouds["S1"]["attributes"]["rgb"] is True
    assert clouds["S1"]["points"] == 4500


def test_clouds_are_converted_once(yard: Yard) -> None:
    folder = yard("projected")
    paths, found = written_clouds(read_result(folder), folder), []
    for _ in range(2):
        found.clear()
        convert_clouds(paths, folder, lambda *_: None, found.append)
    before = [cloud.path.stat().st_mtime_ns for cloud in found]
    convert_clouds(paths, folder, lambda *_: None, lambda cloud: None)
    assert [cloud.path.stat().st_mtime_ns for cloud in found] == before
    assert {cloud.file for cloud in found} == {"S1.copc.laz", "S2.copc.laz"}


def test_clouds_given_besides_have_names_that_no_scan_has(yard: Yard, tmp_path: Path) -> None:
    paths = [tmp_path / name for name in ("S1.laz", "a/S1.copc.laz")]
    paths[1].parent.mkdir()
    source = written_clouds(read_result(yard("work")), yard("work"))[0]
    for path in paths:
        path.write_bytes(source.read_bytes())
    names = further_names(paths)
    assert names == ["+S1", "+S1 2"]
    found: list[SceneCloudFile] = []
    for path, name in zip(paths, names, strict=True):
        convert_further(path, name, tmp_path / "out", lambda *_: None, found.append)
    poses = ResultFolder.beside(yard("work")).pose_file
    parts = cloud_parts(found, poses)
    assert [part.name for part in parts] == names
    assert [part.points for part in parts] == [4500, 4500]
    # whatever its file is called, it is no cloud of that scan
    assert [part.station for part in parts] == ["", ""]
    with pytest.raises(InputError, match="no such cloud"):
        further_names([tmp_path / "gone.laz"])


def test_distances_have_a_range_about_nothing_and_their_level(tmp_path: Path) -> None:
    path = tmp_path / "moved.laz"
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales = np.full(3, 1e-4)
    for name in ("distance", "sigma", "lod95"):
        header.add_extra_dim(laspy.ExtraBytesParams(name, "float32"))
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = np.random.default_rng(0).uniform(0, 5, (3, 1000))
    cloud.distance = np.linspace(-0.002, 0.010, 1000)
    cloud.sigma, cloud.lod95 = np.full(1000, 0.001), np.full(1000, 0.002)
    cloud.write(path)
    found: list[SceneCloudFile] = []
    convert_further(path, "+moved", tmp_path / "out", lambda *_: None, found.append)
    known = cloud_parts(found, None)[0].attributes
    # 95 % of the values are below 9.4 mm
    assert known["distance"].high == pytest.approx(0.0094, abs=1e-5)
    assert known["distance"].low == -known["distance"].high
    assert known["significance"].unit == ""
    # its sigma is that of a distance and none of a position
    assert "sigma" not in known


def test_sites_of_comparisons_lie_where_the_result_says(yard: Yard) -> None:
    result, beside = read_result(yard("work")), ResultFolder.beside(yard("work"))
    site = {"name": "1", "n": 3, "center": [1.0, 2.0, 3.0]}
    other = {"a": "S1", "b": "S2", "limit": 0.1, "sentences": [], "offsets": None}
    made = scene_of({**result, "comparisons": [{**other, "sites": [site]}]}, beside)
    assert made.comparisons[0]["sites"][0]["xyz"] == [1.0, 2.0, 3.0]
    # results of earlier versions do not say it
    del site["center"]
    made = scene_of({**result, "comparisons": [{**other, "sites": [site]}]}, beside)
    assert made.comparisons[0]["sites"][0]["xyz"] is None


def test_only_files_of_the_folder_of_clouds_are_given(tmp_path: Path) -> None:
    place = tmp_path / "clouds"
    place.mkdir()
    (tmp_path / "secret.laz").write_bytes(b"LASF")
    (place / "a.laz").write_bytes(b"LASF")
    (place / "link.laz").symlink_to(tmp_path / "secret.laz")
    names = ["../secret.laz", "/etc/passwd", "..", "", "link.laz", "gone.laz", "a.laz"]
    result = {"scans": {"clouds": [{"file": name} for name in names]}}
    assert written_clouds(result, tmp_path) == [place / "a.laz"]


def test_clouds_that_are_gone_are_said_with_what_to_do(tmp_path: Path) -> None:
    (tmp_path / "clouds").mkdir()
    files = [{"file": name} for name in ("S1.laz", "S2.laz", "S3.laz")]
    result = {"scans": {"clouds": files}}
    assert lacking_clouds(result, tmp_path, None).startswith("S1.laz and 2 more are not in clouds")
    (tmp_path / "clouds" / "S1.laz").write_bytes(b"LASF")
    (tmp_path / "clouds" / "S3.laz").write_bytes(b"LASF")
    said = lacking_clouds(result, tmp_path, None)
    assert said.startswith("S2.laz is not in clouds")
    assert "run the project again" in said
    (tmp_path / "clouds" / "S2.laz").write_bytes(b"LASF")
    assert lacking_clouds(result, tmp_path, None) == ""
    assert lacking_clouds({"scans": None}, tmp_path, None) == ""


def test_clouds_of_another_run_than_the_poses_are_said(yard: Yard, tmp_path: Path) -> None:
    """A run that was stopped has left its poses, and clouds of the run before."""
    folder = tmp_path / "out"
    shutil.copytree(yard("work"), folder)
    result = read_result(folder)
    poses = ResultFolder.beside(folder).pose_file
    assert lacking_clouds(result, folder, poses) == ""
    file = folder / "clouds" / "poses.json"
    told = json.loads(file.read_text())
    first = told["scans"][0]
    first["world_from_scanner"][0][3] += 0.002
    file.write_text(json.dumps(told))
    said = lacking_clouds(result, folder, ResultFolder.beside(folder).pose_file)
    assert said.startswith(f"{first['scan']}.")
    assert "was not placed by the poses beside the clouds" in said


def test_a_result_of_an_older_run_is_drawn_without_what_it_lacks(
    yard: Yard, tmp_path: Path
) -> None:
    """No workbench.json: the frame of the poses is taken, and the coordinates of the result."""
    for kind in KINDS:
        folder = tmp_path / kind
        (folder / "clouds").mkdir(parents=True)
        for name in ("result.json", "clouds/poses.json", "clouds/poses_covariance.npy"):
            (folder / name).write_bytes((yard(kind) / name).read_bytes())
        made, whole = scene(folder), scene(yard(kind))
        assert np.array(made.points.xyz) == pytest.approx(np.array(whole.points.xyz), abs=2e-4)
        assert np.array(made.frame) == pytest.approx(np.array(whole.frame), abs=0.005)


def test_a_stored_scene_of_schema_1_is_still_read() -> None:
    """Whatever is added must have a value that older scenes mean by leaving it out."""
    stored = FORM.read(json.loads(STORED.read_text()))
    assert {"T1", "TOP"} <= set(stored.points.name)


@pytest.mark.parametrize(
    ("text", "words"),
    [("", "empty"), ("[1]", "no result"), ('{"points": {}, "observations": []}', "layout")],
)
def test_what_is_no_result_is_refused(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "result.json").write_text(text)
    with pytest.raises(InputError, match=words):
        read_result(tmp_path)
    with pytest.raises(InputError, match="no result"):
        read_result(tmp_path / "nowhere")
    (tmp_path / "demo" / "out").mkdir(parents=True)
    (tmp_path / "demo" / "out" / "result.json").write_text(text)
    with pytest.raises(InputError, match=r"give .*out"):
        read_result(tmp_path / "demo")


@pytest.mark.parametrize("text", ["{", '{"schema": 9}', '{"schema": 1, "frame": 3}'])
def test_damaged_parts_are_refused(yard: Yard, tmp_path: Path, text: str) -> None:
    (tmp_path / "workbench.json").write_text(text)
    with pytest.raises(InputError, match=r"workbench\.json"):
        ResultFolder.beside(tmp_path)
