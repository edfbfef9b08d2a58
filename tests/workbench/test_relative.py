"""Distances with their sigma and picked points: against closed forms, clouds and Monte Carlo."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import laspy
import numpy as np
import pytest

from tests.cloud.test_shared_part import two_stations
from tests.workbench.test_scene import scene
from tests.workbench.twins import KINDS
from tribrach.cloud.shared_part import slopes
from tribrach.errors import InputError, UnknownName
from tribrach.geometry.rotation import exp
from tribrach.io.arrays import joint_covariance_bytes
from tribrach.workbench.clouds import convert_clouds, written_clouds
from tribrach.workbench.point import point
from tribrach.workbench.relative import relative
from tribrach.workbench.result_folder import ResultFolder, read_result
from tribrach.workbench.sources import PointSources

Yard = Callable[[str], Path]


def sources(folder: Path) -> PointSources:
    """What the server answers from."""
    made, found = scene(folder), []
    convert_clouds(
        written_clouds(read_result(folder), folder), folder, lambda *_: None, found.append
    )

    def places(table) -> dict:
        return {
            name: (np.array(xyz), np.array(c)[:3, :3])
            for name, xyz, c in zip(table.name, table.xyz, table.covariance, strict=True)
        }

    return PointSources(
        ResultFolder.beside(folder),
        places(made.points),
        places(made.stations),
        {cloud.name: cloud for cloud in found},
    )


def some_point(folder: Path, name: str, number: int) -> tuple[str, dict[str, float]]:
    """A point of a delivered cloud as a text, and what the cloud says of it."""
    with laspy.open(folder / "clouds" / f"{name}.laz") as file:
        points = file.read()
    xyz = [float(points[a][number]) for a in "xyz"]
    values = {k: float(points[k][number]) for k in ("sigma_x", "sigma_y", "sigma_z", "incidence")}
    return f"{name}:{xyz[0]!r},{xyz[1]!r},{xyz[2]!r}", values


@pytest.mark.parametrize("kind", KINDS)
def test_a_picked_point_has_the_sigmas_of_its_cloud(yard: Yard, kind: str) -> None:
    folder = yard(kind)
    known = sources(folder)
    for number in (3, 700, 2500, 4000):
        text, told = some_point(folder, "S1", number)
        answer = point(known, "S1", tuple(text.partition(":")[2].split(",")))
        sigma = np.sqrt(np.diag(answer["covariance"]))
        # clouds keep ten bits of a sigma, and half a degree of incidence
        assert sigma == pytest.approx([told[f"sigma_{a}"] for a in "xyz"], rel=5e-3)
        parts = np.array(answer["own"]) + np.array(answer["shared"])
        assert parts == pytest.approx(np.array(answer["covariance"]))
        shares = sum(np.sign(p["sigma"]) * p["sigma"] ** 2 for p in answer["budget"])
        assert shares == pytest.approx(np.trace(answer["covariance"]), rel=1e-3)
        assert {"range", "beam width"} <= {p["part"] for p in answer["budget"]}
        assert answer["station"] == "S1"
        assert np.degrees(answer["incidence"]) == pytest.approx(told["incidence"], abs=1e-6)
        json.dumps(answer, allow_nan=False)


def test_a_picked_point_is_said_in_every_frame(yard: Yard) -> None:
    """Each frame's words against the twin in that frame, which pyproj made."""
    folder = yard("projected")
    text, _ = some_point(folder, "S2", 11)
    answer = point(sources(folder), "S2", tuple(text.partition(":")[2].split(",")))
    frames = answer["frames"]
    assert list(frames) == [
        "Work frame E, N, U",
        "EPSG:32648 easting, northing, height",
        "Latitude, longitude, ellipsoidal height",
        "Geocentric X, Y, Z",
    ]
    from pyproj import Transformer

    back = Transformer.from_crs("EPSG:32648", "EPSG:4979", always_xy=True)
    e, n, h = answer["xyz"]
    longitude, latitude, _ = back.transform(e, n, h)
    d, m, s = (float(x) for x in frames["Latitude, longitude, ellipsoidal height"][0].split("-"))
    assert d + m / 60 + s / 3600 == pytest.approx(latitude, abs=2e-9)
    to = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
    x = float(frames["Geocentric X, Y, Z"][0].split()[0])
    assert x == pytest.approx(to.transform(longitude, latitude, h)[0], abs=5e-4)
    assert frames["EPSG:32648 easting, northing, height"][0] == f"{e:.4f} m"


@pytest.mark.parametrize("kind", KINDS)
def test_distances_of_the_network_are_those_of_its_covariance(yard: Yard, kind: str) -> None:
    """Two points and two stations, once by the files, once by the adjustment itself."""
    from tribrach import pipeline
    from tribrach.project import Project

    folder = yard(kind)
    known = sources(folder)
    project = Project.load(folder.parent / "yard.toml")
    report = pipeline.run(project, folder)
    adjustment = report.adjustment
    for a, b in (("BASE", "TOP"), ("T1", "BASE"), ("S1", "S2"), ("S1", "TOP")):
        answer = relative(known, a, b)
        columns = np.concatenate([adjustment.columns(n)[:3] for n in (a, b)])
        joint = adjustment.covariance_columns(columns, columns)
        state, layout = adjustment.state, adjustment.layout

        def place(name: str, state=state, layout=layout) -> np.ndarray:
            if name in layout.names["point"]:
                return state.points[layout.index("point", name)]
            return state.pose_t[layout.index("pose", name)]

        d = place(b) - place(a)
        u = d / np.linalg.norm(d)
        slope = np.concatenate([-u, u])
        # a grid is shorter than the ground by its scale
        assert answer["distance"] == pytest.approx(np.linalg.norm(d), rel=6e-4)
        assert answer["sigma"] == pytest.approx(np.sqrt(slope @ joint @ slope), rel=2e-3)
        live = relative(replace(known, adjustment=adjustment), a, b)
        assert live["sigma"] == pytest.approx(answer["sigma"], rel=1e-3)


def test_two_points_of_clouds_by_monte_carlo(tmp_path: Path) -> None:
    """Poses are drawn from their joint covariance: the distance scatters as it is said to."""
    shared = two_stations()
    rng = np.random.default_rng(3)
    a, b = np.array([10.0, 9.0, 2.0]), np.array([22.0, 4.0, 3.0])
    one, two = shared.points(a[None], "A"), shared.points(b[None], "B")
    from tribrach.cloud.quantities import relative as of_points

    stated = of_points(one, two).length
    root = np.linalg.cholesky(shared.covariance + 1e-20 * np.eye(12))
    own = [np.linalg.cholesky(p.own()[0]) for p in (one, two)]
    lengths = []
    for _ in range(4000):
        d = root @ rng.normal(size=12)
        ends = []
        for k, (x, name) in enumerate(((a, "A"), (b, "B"))):
            at = shared.scans[name].pose.translation
            moved = exp(d[6 * k + 3 : 6 * k + 6]) @ (x - at) + at + d[6 * k : 6 * k + 3]
            ends.append(moved + own[k] @ rng.normal(size=3))
        lengths.append(np.linalg.norm(ends[1] - ends[0]))
    assert np.std(lengths) == pytest.approx(stated.sigma, rel=0.04)


def test_a_point_of_a_cloud_and_one_of_the_network(yard: Yard) -> None:
    """The joint covariance of the run by hand: what both share cancels, own noise stays."""
    folder = yard("work")
    known = sources(folder)
    text, _ = some_point(folder, "S1", 40)
    answer = relative(known, "TOP", text)
    names, rows = known.joint
    shared = known.shared
    q, k = len(shared.covariance), names.index("TOP")
    total = np.zeros((q + 3 * len(names),) * 2)
    total[:q, :q], total[q:], total[:q, q:] = shared.covariance, rows, rows[:, :q].T
    assert np.linalg.eigvalsh(total)[0] > -1e-12
    picked = known.picked("S1", np.array([float(v) for v in text.partition(":")[2].split(",")]))
    j = np.zeros((3, len(total)))
    j[:, :6] = slopes(picked.point.xyz[None], shared.scans["S1"])[0]
    j[:, q + 3 * k : q + 3 * k + 3] -= np.eye(3)
    expected = j @ total @ j.T
    u = np.array(answer["difference"]) / answer["distance"]
    assert answer["sigma_shared"] == pytest.approx(np.sqrt(u @ expected @ u))
    assert answer["sigma"] ** 2 == pytest.approx(
        answer["sigma_own"] ** 2 + answer["sigma_shared"] ** 2
    )


def test_points_side_by_side_share_their_station(yard: Yard) -> None:
    folder = yard("work")
    known = sources(folder)
    with laspy.open(folder / "clouds" / "S1.laz") as file:
        points = file.read()
    xyz = np.stack([points.x, points.y, points.z], axis=1)
    apart = np.linalg.norm(xyz - xyz[0], axis=1)
    near = int(np.argsort(apart)[1])
    ends = [f"S1:{p[0]!r},{p[1]!r},{p[2]!r}" for p in xyz[[0, near]].tolist()]
    answer = relative(known, *ends)
    alone = relative(known, "T1", ends[0])
    assert answer["sigma_shared"] < 0.2 * alone["sigma_shared"]


def test_what_is_not_there_is_said(yard: Yard, tmp_path: Path) -> None:
    known = sources(yard("work"))
    with pytest.raises(UnknownName, match="T9"):
        relative(known, "T9", "T1")
    with pytest.raises(InputError, match="one place"):
        relative(known, "T1", "T1")
    with pytest.raises(InputError, match="no cloud"):
        relative(known, "T1", "S7:1,2,3")
    with pytest.raises(InputError, match="no point of the cloud"):
        relative(known, "T1", "S1:1,2,300")
    with pytest.raises(InputError, match="coordinates"):
        point(known, "S1", ("1", "nan", "2"))
    with pytest.raises(UnknownName):
        relative(known, "T1", "S1:1,2")


def test_a_joint_covariance_of_another_run_is_not_taken(yard: Yard, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    (folder / "clouds").mkdir(parents=True)
    for name in (
        "result.json",
        "workbench.json",
        "clouds/poses.json",
        "clouds/poses_covariance.npy",
    ):
        (folder / name).write_bytes((yard("work") / name).read_bytes())
    (folder / "workbench_covariance.npy").write_bytes(joint_covariance_bytes(np.zeros((3, 3))))
    beside = ResultFolder.beside(folder)
    known = PointSources(beside, sources(yard("work")).points, {})
    with pytest.raises(InputError, match="joint covariance"):
        relative(known, "T1", "TOP")
