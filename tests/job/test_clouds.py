"""What the options of clouds do: incidence, correlations, one file for all, frames."""

import json
import re
from dataclasses import replace
from pathlib import Path

import laspy
import numpy as np
import pytest
from pyproj import Proj, Transformer

from tests.cloud.test_covariance import equation
from tests.job.cloud_jobs import NOISE, UTM, made, opened, placed, projected
from tests.targets.scenes import directions, room, scan
from tribrach.geodesy.output_frame import FrameKind, OutputFrame
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.job.scans import StationScan
from tribrach.scan.scan import Field

WORK = OutputFrame(WorkFrame())
LOW, HIGH = np.array([-6.0, -4.0, -1.6]), np.array([5.0, 7.0, 2.4])
CRS = {"work": None, "projected": UTM, "ecef": "EPSG:4978"}


def in_a_room(
    path: Path, fields: tuple[str, ...] = ("intensity",), seed: int = 0, step: float = 0.03
) -> np.ndarray:
    """A scan of the walls of a room without noise; its points."""
    rays, _, _ = directions((-3.1, 3.1), (0.9, 2.2), step)
    xyz = scan(rays, [room(rays, LOW, HIGH)], np.random.default_rng(seed), 0.0, 0.0)
    values = {name: np.arange(len(xyz)) % 200 for name in fields}
    header = CloudHeader(path.stem, tuple(Field(name, "float32") for name in fields), 1e-6)
    with create(path, header) as writer:
        writer.write(xyz, {k: v.astype(np.float32) for k, v in values.items()})
    return xyz


def frame_of(kind: FrameKind) -> OutputFrame:
    """The same place in each of the three frames."""
    return OutputFrame(projected().work, kind, CRS[kind], 2024.5)


def extra(path: Path) -> set[str]:
    return set(laspy.read(path).point_format.extra_dimension_names)


def on_a_wall(xyz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Axis of the wall of each point, and which points are 60 cm and more from the next one."""
    away = np.minimum(np.abs(xyz - LOW), np.abs(xyz - HIGH))
    return away.argmin(axis=1), np.sort(away, axis=1)[:, 1] > 0.6


def test_incidence_is_that_on_the_walls_and_makes_ranges_worse(tmp_path: Path) -> None:
    xyz = in_a_room(tmp_path / "S1.las", step=0.015)
    scans = opened(tmp_path / "S1.las")
    places = placed(scans)
    (plain,) = made(scans, places, WORK, tmp_path / "a", format="las")
    (wished,) = made(scans, places, WORK, tmp_path / "b", format="las", incidence=True)
    assert extra(wished.path) - extra(plain.path) == {"incidence"}
    without, with_it = laspy.read(plain.path), laspy.read(wished.path)
    wall, inner = on_a_wall(xyz)
    length = np.linalg.norm(xyz, axis=1)
    cosine = np.abs(xyz[np.arange(len(xyz)), wall]) / length
    inner &= cosine > 0.5
    assert inner.sum() > 10_000
    angle = np.radians(np.array(with_it["incidence"]))
    assert np.abs(angle - np.arccos(cosine))[inner].max() < 2e-3
    trace = [sum(np.array(c[f"sigma_{a}"], float) ** 2 for a in "xyz") for c in (without, with_it)]
    more = NOISE.range_sigma(length) ** 2 * (1 / cosine**2 - 1)
    assert (trace[1] - trace[0])[inner] == pytest.approx(more[inner], rel=0.03, abs=3e-8)
    assert wished.summary.rms.sum() > plain.summary.rms.sum()


@pytest.mark.parametrize("kind", ["work", "projected", "ecef"])
def test_sigmas_and_correlations_are_along_the_axes_of_the_frame(
    tmp_path: Path, kind: FrameKind
) -> None:
    """Axes by other means: meridian convergence from PROJ, east, north and up on the ellipsoid."""
    xyz = in_a_room(tmp_path / "S1.las")
    scans = opened(tmp_path / "S1.las")
    places, frame = placed(scans), frame_of(kind)
    (product,) = made(scans, places, frame, tmp_path, format="las", correlations=True)
    cloud = laspy.read(product.path)
    turn = axes(places[scans[0].name].pose.translation, kind)
    for k in range(0, len(xyz), 997):
        c = turn @ equation(xyz[k], places[scans[0].name]) @ turn.T
        s = np.sqrt(np.diag(c))
        sigma = [float(cloud[f"sigma_{a}"][k]) for a in "xyz"]
        assert sigma == pytest.approx(s, rel=1e-3)
        for i, j, name in ((0, 1, "xy"), (0, 2, "xz"), (1, 2, "yz")):
            found = float(cloud[f"correlation_{name}"][k])
            assert found == pytest.approx(c[i, j] / (s[i] * s[j]), abs=2e-3)
    names = {"work": "enu", "projected": "enh", "ecef": "xyz"}[kind]
    for a, name in zip("xyz", names, strict=True):
        assert (
            cloud.point_format.dimension_by_name(f"sigma_{a}").description == f"sigma of {name} [m]"
        )


def origin() -> tuple[float, float]:
    """Longitude and latitude [rad] of the origin of the work frame."""
    to_geographic = Transformer.from_crs(UTM, "EPSG:4326", always_xy=True)
    longitude, latitude = to_geographic.transform(505_000.0, 2_331_000.0)
    return float(np.radians(longitude)), float(np.radians(latitude))


def ecef_from_enu() -> np.ndarray:
    longitude, latitude = origin()
    cl, sl, cp, sp = np.cos(longitude), np.sin(longitude), np.cos(latitude), np.sin(latitude)
    return np.array([[-sl, -sp * cl, cp * cl], [cl, -sp * sl, cp * sl], [0.0, cp, sp]])


def axes(at: np.ndarray, kind: FrameKind) -> np.ndarray:
    """Rotation from the work frame; plumb lines turn by 1e-5 over the 50 m and are left out."""
    if kind == "work":
        return np.eye(3)
    if kind == "ecef":
        return ecef_from_enu()
    longitude, latitude = np.degrees(origin())
    turn = np.radians(Proj(UTM).get_factors(longitude, latitude).meridian_convergence)
    return np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])


@pytest.mark.parametrize("kind", ["work", "projected", "ecef"])
@pytest.mark.parametrize("format_", ["las", "laz", "ply"])
def test_points_in_each_frame(tmp_path: Path, kind: FrameKind, format_: str) -> None:
    """Geocentric by the rotation of the textbook, then projected by PROJ, point by point."""
    xyz = in_a_room(tmp_path / "S1.las")
    scans = opened(tmp_path / "S1.las")
    places = placed(scans)
    (product,) = made(scans, places, frame_of(kind), tmp_path, format=format_)
    expected = places[scans[0].name].pose @ xyz
    if kind != "work":
        longitude, latitude = np.degrees(origin())
        to_ecef = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
        at = np.array(to_ecef.transform(longitude, latitude, 20.0))
        expected = expected @ ecef_from_enu().T + at
    if kind == "projected":
        geodetic = to_ecef.transform(*expected.T, direction="INVERSE")
        plan = Transformer.from_crs("EPSG:4326", UTM, always_xy=True).transform(*geodetic[:2])
        expected = np.stack([*plan, geodetic[2]], axis=1)
    (found,) = opened(product.path)
    assert product.step is not None
    off = next(found.scan.chunks()).xyz - expected
    # GRS80 and WGS 84 differ by 0.1 mm in the polar axis
    assert np.abs(off).max() < product.step / 2 + (0 if kind == "work" else 2e-4) + 1e-6
    if kind == "work":
        assert found.scan.crs is None
    else:
        assert found.scan.crs is not None
        assert re.search(r"32648|4978", found.scan.crs)
    if format_ != "ply":
        (facts,) = [v for v in laspy.read(product.path).vlrs if v.user_id == "tribrach"]
        said = json.loads(facts.record_data)
        assert (said["frame"], said["epoch"]) == (kind, 2024.5)


def two(tmp_path: Path) -> list[StationScan]:
    in_a_room(tmp_path / "S1.las", ("intensity", "height", "first"), 1)
    in_a_room(tmp_path / "S2.las", ("height", "second", "intensity"), 2)
    return opened(tmp_path / "S1.las", tmp_path / "S2.las")


def test_merged_is_all_scans_in_one_file(tmp_path: Path) -> None:
    scans = two(tmp_path)
    places = placed(scans, 3e5)
    alone = made(scans, places, WORK, tmp_path / "a", format="las")
    (merged,) = made(scans, places, WORK, tmp_path / "b", format="las", merged=True)
    assert merged.path.name == "cloud.las"
    assert merged.scans == tuple(s.name for s in scans)
    cloud, parts = laspy.read(merged.path), [laspy.read(p.path) for p in alone]
    number = np.array(cloud["station"])
    assert [int((number == k).sum()) for k in (0, 1)] == [len(p) for p in parts]
    for k, part in enumerate(parts):
        assert np.abs(cloud.xyz[number == k] - part.xyz).max() <= merged.step + 1e-9
        for name in ("height", "sigma_x", "sigma_y", "sigma_z"):
            assert (np.array(cloud[name])[number == k] == np.array(part[name])).all()
    sigmas = {"sigma_x", "sigma_y", "sigma_z", "sigma"}
    assert extra(merged.path) == {"height", "station", "intensity_as_measured"} | sigmas
    (facts,) = [v for v in cloud.vlrs if v.user_id == "tribrach"]
    said = json.loads(facts.record_data)
    assert said["stations"] == f"0 {scans[0].name}; 1 {scans[1].name}"
    assert merged.summary.points == sum(p.summary.points for p in alone)


def test_one_unknown_scanner_leaves_the_whole_without_sigmas(tmp_path: Path) -> None:
    first, second = two(tmp_path)
    scans = [first, replace(second, noise=None)]
    places = placed(scans)
    (merged,) = made(scans, places, WORK, tmp_path / "b", format="las", merged=True)
    assert extra(merged.path) == {"height", "station", "intensity_as_measured"}
    (said,) = merged.sentences
    assert f"because of scan {second.name}: no instrument" in said
    known, unknown = made(scans, places, WORK, tmp_path / "a", format="las")
    assert "sigma_x" in extra(known.path)
    assert "sigma_x" not in extra(unknown.path)
    assert (known.sentences, len(unknown.sentences)) == ((), 1)
