"""Clouds in E57: copies keep every point, others the scanner frame; both lie where they must."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pye57
import pytest
from scipy.spatial.transform import Rotation

from tests.job import cloud_jobs as jobs
from tests.job.cloud_jobs import NOISE, made, opened, projected, several
from tribrach.cloud.placement import Placement
from tribrach.errors import InputError
from tribrach.geodesy.output_frame import FrameKind, OutputFrame
from tribrach.geodesy.projection import grid_scale
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.geometry.pose import Pose
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.scans.formats import read_scans
from tribrach.job.clouds import CloudProduct
from tribrach.job.scans import StationScan
from tribrach.project.sections import CloudSection
from tribrach.scan.scan import Field

WORK = OutputFrame(WorkFrame())
FIELDS = (
    Field("intensity", "float32", 0, 65535),
    *(Field(f"normal_{a}", "float32") for a in "xyz"),
)


def source(path: Path, seed: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """A scan in its frame."""
    rng = np.random.default_rng(seed)
    xyz, normals = rng.uniform(-30, 30, (2000, 3)), rng.normal(size=(2000, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    values = {f"normal_{a}": normals[:, k].astype(np.float32) for k, a in enumerate("xyz")}
    values["intensity"] = rng.integers(0, 65536, 2000).astype(np.float32)
    with create(path, CloudHeader(path.stem, FIELDS, 1e-4)) as writer:
        writer.write(xyz, values)
    return xyz, values


def station(path: Path, seed: int) -> tuple[StationScan, Placement]:
    rng = np.random.default_rng(seed)
    pose = Pose(
        Rotation.from_euler("z", seed).as_matrix(),
        np.array([590_000.0, 2_331_000.0, 9.0]) + rng.uniform(-50, 50, 3),
    )
    a = rng.normal(size=(6, 6)) * 1e-4
    scan = read_scans(path)[0]
    one = StationScan(path.stem, path.stem, scan, NOISE, True, {})
    return one, Placement(path.stem, pose, a @ a.T, NOISE)


def write(paths: list[Path], target: Path) -> list[Placement]:
    """A cloud of scans in the work frame."""
    made = [station(path, k + 1) for k, path in enumerate(paths)]
    frame, wish = OutputFrame(WorkFrame()), CloudSection(format=target.suffix[1:])
    scans, places = [one for one, _ in made], [where for _, where in made]
    numbers = range(1, len(scans) + 1)
    CloudProduct(target.name, target.stem, scans, places, frame, wish, numbers, "prior").write(
        target, lambda *_: None
    )
    return places


def placed(path: Path, index: int = 0) -> np.ndarray:
    """World coordinates as another reader makes them."""
    file = pye57.E57(str(path))
    data = file.read_scan(index, ignore_missing_fields=True)
    file.close()
    return np.stack([data[f"cartesian{a}"] for a in "XYZ"], axis=1)


@pytest.mark.parametrize("suffix", [".las", ".e57"])
def test_points_lie_where_they_must(tmp_path: Path, suffix: str) -> None:
    path, out = tmp_path / f"S1{suffix}", tmp_path / "out.e57"
    xyz, values = source(path, 1)
    (where,) = write([path], out)
    assert np.abs(placed(out) - where.pose @ xyz).max() < 3e-4
    (scan,) = read_scans(out)
    chunk = next(scan.chunks())
    assert np.abs(chunk.xyz - xyz).max() < 2e-4
    for axis in "xyz":
        name = f"normal_{axis}"
        assert (chunk.values[name] == values[name]).all()


def test_the_sigmas_are_those_of_other_formats(tmp_path: Path) -> None:
    path = tmp_path / "S1.las"
    source(path, 1)
    for suffix in (".e57", ".las"):
        write([path], tmp_path / f"out{suffix}")
    e57, las = (next(read_scans(tmp_path / f"out{k}")[0].chunks()) for k in (".e57", ".las"))
    for name in ("sigma_x", "sigma_y", "sigma_z"):
        assert (e57.values[name] == las.values[name]).all()
    by_name = {f.name: f for f in read_scans(tmp_path / "out.e57")[0].fields}
    assert by_name["sigma_x"].description == "sigma of e [m]"


def test_a_copy_has_the_points_of_the_source(tmp_path: Path) -> None:
    path, out = tmp_path / "S1.e57", tmp_path / "out.e57"
    source(path, 1)
    write([path], out)
    assert path.read_bytes()[1024:30_000] == out.read_bytes()[1024:30_000]


def test_one_scan_of_several_is_written_alone(tmp_path: Path) -> None:
    """A copy of the whole file would show the other scan where it is not."""
    path, out = tmp_path / "both.e57", tmp_path / "out.e57"
    xyz = several(path, 2)
    (where,) = write([path], out)
    assert len(read_scans(out)) == 1
    assert np.abs(placed(out) - where.pose @ xyz[0]).max() < 3e-4


@pytest.mark.parametrize("merged", [False, True])
def test_scans_of_one_file_stay_together(tmp_path: Path, merged: bool) -> None:
    """One copy for each source, each scan where its own station is."""
    path = tmp_path / "both.e57"
    several(path, 2)
    scans = opened(path)
    xyz = [next(scan.scan.chunks()).xyz for scan in scans]
    places = jobs.placed(scans, 5e5)
    (product,) = made(scans, places, WORK, tmp_path, format="e57", merged=merged)
    assert product.path.name == ("cloud.e57" if merged else "both.e57")
    assert product.scans == tuple(scan.name for scan in scans)
    assert product.summary.points == 1000
    assert product.step is None
    for k, scan in enumerate(scans):
        assert np.abs(placed(product.path, k) - places[scan.name].pose @ xyz[k]).max() < 1e-8
    assert path.read_bytes()[1024:12_000] == product.path.read_bytes()[1024:12_000]
    assert not made(scans, places, WORK, tmp_path, format="e57", merged=merged)[0].new


def test_each_source_has_its_copy(tmp_path: Path) -> None:
    """Files of one name, a file of another format, and one of which a scan is not wanted."""
    paths = [tmp_path / "a" / "job.e57", tmp_path / "b" / "job.e57", tmp_path / "part.e57"]
    for k, path in enumerate(paths):
        path.parent.mkdir(exist_ok=True)
        several(path, 2 + (k == 2), seed=k)
    las = tmp_path / "JOB.las"
    source(las, 1)
    scans = [*opened(*paths)[:-1], *opened(las)]
    renamed = [replace(s, name=f"{k}", station=f"{k}") for k, s in enumerate(scans)]
    places = jobs.placed(renamed)
    products = made(renamed, places, WORK, tmp_path, format="e57")
    assert [(p.path.name, p.scans) for p in products] == [
        ("job.e57", ("0", "1")),
        ("job-2.e57", ("2", "3")),
        ("4.e57", ("4",)),
        ("5.e57", ("5",)),
        ("6.e57", ("6",)),
    ]
    assert [p.step is None for p in products] == [True, True, False, False, False]
    for product in products:
        for k, name in enumerate(product.scans):
            points = next(renamed[int(name)].scan.chunks()).xyz
            found = placed(product.path, k)
            assert np.abs(found - places[name].pose @ points).max() < 3e-4


def test_names_that_disks_take_for_one_are_two_files(tmp_path: Path) -> None:
    path = tmp_path / "S1.las"
    source(path, 1)
    names = ("A/1", "A_1", "a?1", "../../A")
    scans = [replace(opened(path)[0], name=name, station=name) for name in names]
    products = made(scans, jobs.placed(scans), WORK, tmp_path / "out", format="las")
    found = [p.path.name for p in products]
    assert found == ["A_1.las", "A_1-2.las", "a_1-3.las", "_.._A.las"]
    again = made(scans, jobs.placed(scans), WORK, tmp_path / "out", format="las")
    assert not any(product.new for product in again)
    assert {p.parent.parent for p in (tmp_path / "out").glob("*/*")} == {tmp_path / "out"}
    assert {p.name for p in tmp_path.iterdir()} == {"S1.las", "out"}


@pytest.mark.parametrize("asked", [(), ("incidence",), ("correlations", "incidence")])
def test_what_a_copy_cannot_hold_is_said(tmp_path: Path, asked: tuple[str, ...]) -> None:
    path = tmp_path / "one.e57"
    several(path, 1)
    scans = opened(path)
    wish = {"format": "e57"} | dict.fromkeys(asked, True)
    (product,) = made(scans, jobs.placed(scans), WORK, tmp_path, **wish)
    (said,) = product.sentences
    assert said.startswith("one_S0.e57 has the points of one.e57 byte for byte: sigmas")
    assert all(name in said for name in asked)
    assert {"correlations", "incidence"} & set(said.replace(",", "").split()) == set(asked)
    assert product.summary.rms.min() > 0  # the report has them all the same
    (again,) = made(scans, jobs.placed(scans), WORK, tmp_path, **wish)
    assert again.sentences == product.sentences


@pytest.mark.parametrize("suffix", [".las", ".e57"])
def test_a_rigid_pose_in_a_projection_costs_its_scale(tmp_path: Path, suffix: str) -> None:
    """EPSG:32648 near its central meridian is 0.9996 of the ellipsoid, so 4 cm in 100 m."""
    path, frame = tmp_path / f"S1{suffix}", projected()
    xyz, _ = source(path, 1)
    scans = opened(path)
    places = jobs.placed(scans)
    (product,) = made(scans, places, frame, tmp_path, format="e57")
    at = places[scans[0].name].pose
    exact = frame.from_work(at @ xyz)
    off = np.linalg.norm(placed(product.path) - exact, axis=1)
    (said,) = [s for s in product.sentences if "ppm" in s]
    stated = re.search(
        r"\(([-+.\d]+) ppm at this site, ([.\d]+) mm in 100 m\).* up to ([.\d]+) mm", said
    )
    assert stated is not None
    ppm, hundred, most = map(float, stated.groups())
    scale = 1e6 * grid_scale(jobs.UTM, frame.from_work(at.translation[None])[0])
    assert ppm == pytest.approx(scale, abs=0.3)
    assert ppm == pytest.approx(-400, abs=10)
    assert hundred == pytest.approx(0.1 * abs(scale), abs=0.1)
    assert most == pytest.approx(1e3 * off.max(), abs=0.2)
    assert off.max() == pytest.approx(4e-4 * np.linalg.norm(xyz[:, :2], axis=1).max(), rel=0.1)


@pytest.mark.parametrize("kind", ["work", "ecef"])
def test_rigid_poses_are_exact_in_cartesian_frames(tmp_path: Path, kind: FrameKind) -> None:
    path = tmp_path / "S1.e57"
    xyz, _ = source(path, 1)
    scans = opened(path)
    places = jobs.placed(scans)
    crs = {"ecef": "EPSG:4978"}.get(kind)
    frame = OutputFrame(projected().work, kind, crs)
    (product,) = made(scans, places, frame, tmp_path, format="e57")
    assert not [s for s in product.sentences if "ppm" in s]
    exact = frame.from_work(places[scans[0].name].pose @ xyz)
    assert np.abs(placed(product.path) - exact).max() < 2e-4  # the step of the source


def test_a_copy_forgets_the_reference_system_of_its_source(tmp_path: Path) -> None:
    path = tmp_path / "S1.e57"
    with create(path, CloudHeader("S1", (), 1e-4, crs="EPSG:2154")) as writer:
        writer.write(np.eye(3), {})
    scans = opened(path)
    assert scans[0].scan.crs is not None
    (product,) = made(scans, jobs.placed(scans), WORK, tmp_path, format="e57")
    assert read_scans(product.path)[0].crs is None


def test_scans_of_several_files_are_not_merged(tmp_path: Path) -> None:
    paths = [tmp_path / "S1.las", tmp_path / "S2.e57"]
    for k, path in enumerate(paths):
        source(path, k)
    with pytest.raises(InputError, match="one scan per file"):
        write(paths, tmp_path / "out.e57")
    assert sorted(tmp_path.iterdir()) == paths
