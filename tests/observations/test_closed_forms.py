"""Observation kinds against numbers from the books and against geometry in closed form."""

import numpy as np
import pyproj
import pytest

from tribrach.geodesy.site import (
    EllipsoidSite,
    FlatSite,
    Site,
    curvature_radii,
    ecef_from_geodetic,
)
from tribrach.geometry.rotation import exp
from tribrach.instruments.calibration import NIST, PAPER_EIGHT, PAPER_EIGHT_ELEVATION
from tribrach.observations.base import Observations
from tribrach.observations.control import Offsets
from tribrach.observations.ellipsoidal import EllipsoidArcs, EllipsoidChords
from tribrach.observations.gnss import Antennas, GnssBaselines
from tribrach.observations.planes import FittedPlanes
from tribrach.observations.scanner import Inclinations, ScannerPolar, TargetCentres
from tribrach.observations.sights import ZenithAngles
from tribrach.observations.unknowns import Layout, State

GON = np.pi / 200


def state(
    points: list | None = None,
    poses: list | None = None,
    vectors: list | None = None,
    scalars: list | None = None,
) -> State:
    """A state of these points, poses (t, rotation vector), vectors and scalars."""
    points, poses, vectors, scalars = (a or [] for a in (points, poses, vectors, scalars))
    names = [[f"{f}{i}" for i in range(len(a))] for f, a in
             zip("PSVK", (points, poses, vectors, scalars), strict=True)]  # fmt: skip
    layout = Layout(points=names[0], poses=names[1], vectors=names[2], scalars=names[3])
    return State(
        layout,
        np.array(points, dtype=float).reshape(-1, 3),
        np.array([t for t, _ in poses], dtype=float).reshape(-1, 3),
        exp(np.array([w for _, w in poses], dtype=float).reshape(-1, 3)),
        np.empty((0, 3)),
        np.empty(0),
        np.array(vectors, dtype=float).reshape(-1, 3),
        np.array(scalars, dtype=float),
    )


def given(kind: type[Observations], values: object, **columns: object) -> Observations:
    """Observations of unit covariance."""
    rows = len(kind.units)
    array = np.asarray(values, dtype=float).reshape(-1, rows)
    return kind(values=array, covariance=np.tile(np.eye(rows), (len(array), 1, 1)), **columns)


def pose_columns(observations: Observations, at: State) -> np.ndarray:
    """Derivatives (n * rows, 6) by the first pose."""
    first = at.layout.columns("pose", 0)
    blocks = [b for b in observations.jacobian(at) if b.columns[0, 0] == first[0]]
    return blocks[0].values.reshape(-1, 6)


RADIUS = 6371000.0
SITES = [FlatSite(RADIUS), EllipsoidSite(0.3, 0.2, 0.0, (RADIUS, 0.0), curvature_radius=RADIUS)]


@pytest.mark.parametrize("site", SITES, ids=["flat", "sphere"])
def test_trigonometric_height(site: Site):
    """1000 m at a zenith angle of 88 degrees and k = 0.13 is 34.9677 m upwards (AC-50)."""
    s, z = 1000.0, np.radians(88)
    # on the tangent plane of the sphere the target is lower by the curvature
    straight = z + 0.13 * s / (2 * RADIUS)
    flat, up = (s * np.sin(z), 34.9677) if isinstance(site, FlatSite) else (
        s * np.sin(straight), s * np.cos(straight))  # fmt: skip
    at = state(points=[[0, 0, 0], [0.6 * flat, 0.8 * flat, up]])
    sight = given(ZenithAngles, [z], start=[0], end=[1], refraction=0.13, site=site)
    assert sight.predict(at)[0, 0] == pytest.approx(z, abs=5e-8)
    heights = site.height(at.points)
    assert heights[1] - heights[0] == pytest.approx(34.9677, abs=1e-4)


def test_without_a_radius_a_zenith_angle_is_plain_geometry():
    at = state(points=[[0, 0, 0], [300, 400, 0]])
    sight = given(ZenithAngles, [1.5], start=[0], end=[1], refraction=0.13)
    assert sight.predict(at)[0, 0] == pytest.approx(np.pi / 2, abs=1e-15)


def test_a_tilted_pole_moves_the_antenna():
    """0.329 m tilted by one degree: 5.742 mm (AC-53)."""
    upright, tilted = [[0, 0, 0], [0, 0, 0]], [[0, 0, 0], [0, np.radians(1), 0]]
    at = state(poses=[upright, tilted], vectors=[[0, 0, 0.329]])
    antennas = given(Antennas, np.zeros((2, 3)), station=[0, 1], lever_arm=[0, 0])
    first, second = antennas.predict(at)
    assert np.linalg.norm(second - first) == pytest.approx(5.742e-3, abs=5e-7)
    assert second[0] > 0  # a turn about north leans the z axis to the east


def test_an_inclinometer_error_moves_the_target():
    """0.015 degrees at 20 m: 5.236 mm (AC-53)."""
    level, tilted = [[0, 0, 0], [0, 0, 0]], [[0, 0, 0], [np.radians(0.015), 0, 0]]
    at = state(points=[[0, 20, 0]], poses=[level, tilted])
    centres = given(TargetCentres, np.zeros((2, 3)), station=[0, 1], target=[0, 0])
    first, second = centres.predict(at)
    assert np.linalg.norm(second - first) == pytest.approx(5.236e-3, abs=5e-7)


def test_inclinations_are_the_plumb_line_in_the_scanner():
    lean = 0.01
    at = state(poses=[[[0, 0, 0], [0, lean, 0]]])
    seen = given(Inclinations, [[0, 0]], station=[0]).predict(at)
    np.testing.assert_allclose(seen, [[-np.tan(lean), 0]], atol=1e-15)


def test_a_compensated_instrument_follows_the_deflected_plumb_line():
    """Deflection xi to the north, eta to the east: the axis points at (eta, xi, 1)."""
    xi, eta = 3e-5, -5e-5
    at = state(poses=[[[0, 0, 0], [-xi, eta, 0]]])
    seen = given(Inclinations, [[0, 0]], station=[0], xi=xi, eta=eta)
    assert np.abs(seen.predict(at)).max() < 1e-8


def test_two_faces_free_the_zenith_angle_of_the_index():
    """88.1234 and 311.8806 gon: 88.1214 gon, index 0.0020 gon, collimation -0.0033 gon."""
    v, h = 88.1214 * GON, 123.46 * GON
    target = 10 * np.array([np.sin(v) * np.cos(h), np.sin(v) * np.sin(h), np.cos(v)])
    at = state(
        points=[target],
        poses=[[[0, 0, 0], [0, 0, 0]]],
        scalars=[-0.0020 * GON, 0.0033 * GON * np.sin(v) / 2],
    )
    readings = np.array([[123.4567, 88.1234], [323.4633, 311.8806]]) * GON
    both = given(
        ScannerPolar,
        np.column_stack([[10, 10], readings]),
        station=[0, 0],
        target=[0, 0],
        model=NIST.select(["x4", "x6"]),
        parameters=[[0, 1], [0, 1]],
    )
    np.testing.assert_array_equal(both.face, [1, -1])
    assert np.abs(both.misclosure(at)).max() < 1e-9


def test_twin_columns_of_the_paper():
    """Elevations in place of zenith angles: a2 is a vertical shift, E_H a heading (AC-15)."""
    rng = np.random.default_rng(4)
    targets = np.column_stack([rng.uniform(-9, 9, (30, 2)), rng.uniform(-3, 3, 30)])
    n = len(targets)
    at = state(points=targets.tolist(), poses=[[[1.2, 6.1, 0], [0, 0, 0]]], scalars=[0] * 8)
    readings = np.tile([5.0, 0.0, 1.5], (n, 1))
    columns = {"station": np.zeros(n, int), "target": np.arange(n), "parameters": [range(8)] * n}
    for model in (PAPER_EIGHT, PAPER_EIGHT_ELEVATION):
        polar = given(ScannerPolar, readings, model=model, **columns)
        by_pose = pose_columns(polar, at)
        by_c = -polar.jacobian(at)[2].values.reshape(-1, 8)
        c = dict(zip(model.parameters, by_c.T, strict=True))
        np.testing.assert_allclose(c["E_R"], c["a1"], atol=1e-8)
        np.testing.assert_allclose(c["E_H"], -by_pose[:, 5], atol=1e-8)
        if model is PAPER_EIGHT_ELEVATION:
            np.testing.assert_allclose(c["a2"], -by_pose[:, 2], atol=1e-8)
        else:
            assert np.abs(c["a2"] + by_pose[:, 2]).max() > 0.5


@pytest.mark.parametrize(
    ("normals", "rank"),
    [
        ([[1, 2, 3]], 3),
        ([[1, 2, 3], [3, 0, 1]], 5),
        ([[1, 2, 3], [3, 0, 1], [0, 1, -1]], 6),
        ([[1, 0, 0], [0, 1, 0], [1, 1, 0], [2, -1, 0]], 5),
        ([[1, 0, 0], [0, 1, 0], [0, 0, 1]], 6),
    ],
)
def test_planes_leave_open_what_geometry_says(normals: list, rank: int):
    """One plane 3, two 5, three general ones 6; vertical walls leave the height open."""
    n = np.array(normals, dtype=float)
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    layout = Layout(poses=["S"], planes=[f"L{i}" for i in range(len(n))])
    r = exp(np.array([[0.3, -0.2, 1.0]]))
    at = State(layout, np.empty((0, 3)), np.array([[3.0, 1, 2]]), r, n, np.full(len(n), 9.0),
               np.empty((0, 3)), np.empty(0))  # fmt: skip
    seen = n @ r[0]
    patches = given(FittedPlanes, np.zeros((len(n), 3)), station=np.zeros(len(n), int),
                    plane=np.arange(len(n)), normal=seen, centroid=9 * seen)  # fmt: skip
    assert np.linalg.matrix_rank(pose_columns(patches, at), tol=1e-10) == rank


def test_an_offset_runs_along_the_local_vertical():
    """A sphere 2 m over a mark 10 km from the origin stands on the plumb line of the mark."""
    site = EllipsoidSite(0.66, 0.57, 1000.0)
    mark = np.array([[7000.0, -7000.0, 30.0]])
    sphere = mark + 2 * site.axes(mark)[:, 2]
    at = state(points=[mark[0], sphere[0]])
    offset = given(Offsets, [[0, 0, 2]], start=[0], end=[1], site=site)
    np.testing.assert_allclose(offset.predict(at), [[0, 0, 2]], atol=1e-9)
    in_w = (sphere - mark)[0]
    assert np.hypot(in_w[0], in_w[1]) > 2e-3  # which is not the vertical of the work frame
    taped = given(Offsets, [[0, 0, 0]], start=[0], end=[1], height_instrument=2.0, site=site)
    assert np.abs(taped.predict(at)).max() < 1e-9


def test_a_turn_of_the_gnss_frame_moves_a_northern_baseline_west():
    at = state(points=[[0, 0, 0], [0, 1e4, 0]], scalars=[1e-6, 2e-6])
    baseline = given(GnssBaselines, np.zeros(3), start=[0], end=[1], turn_u=[0], scale=[1])
    np.testing.assert_allclose(baseline.predict(at), [[-0.01, 10000.02, 0]], atol=1e-6)


@pytest.mark.parametrize("azimuth", [0.0, 0.7, 1.571, 4.0])
@pytest.mark.parametrize("length", [100.0, 30e3, 200e3])
def test_arcs_are_geodesics(length: float, azimuth: float) -> None:
    """Arcs against PROJ's geodesics; chords against the feet; sea level by its radius."""
    geod = pyproj.Geod(ellps="GRS80")
    lon, lat, _ = geod.fwd(0.2, 0.7, azimuth, length, radians=True)
    site = EllipsoidSite(0.7, 0.2, 0.0)
    places = np.array([[0.7, 0.2, 300.0], [lat, lon, 1200.0]])
    points = site.from_ecef(ecef_from_geodetic(*places.T))
    feet = ecef_from_geodetic(*(places * [1, 1, 0]).T)
    ends = {"start": np.array([0]), "end": np.array([1]), "site": site}
    common = {"values": np.zeros((1, 1)), "covariance": np.ones((1, 1, 1)), **ends}
    here = state(list(points))
    (chord,) = EllipsoidChords(**common).predict(here)[0]
    assert chord == pytest.approx(np.linalg.norm(feet[1] - feet[0]), abs=2e-8)
    (arc,) = EllipsoidArcs(**common).predict(here)[0]
    # the radius along the line, at its middle, is that of the whole line to 0.1 mm in 200 km
    assert arc == pytest.approx(length, abs=1e-7 if length < 1e3 else 1e-4)
    (sea,) = EllipsoidArcs(**common, geoid_start=50.0, geoid_end=50.0).predict(here)[0]
    nu, m = curvature_radii(np.array((0.7 + lat) / 2))
    radius = 1 / (np.sin(azimuth) ** 2 / nu + np.cos(azimuth) ** 2 / m)
    assert sea / arc == pytest.approx(1 + 50.0 / radius, abs=2e-9)
