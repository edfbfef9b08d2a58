"""A project in a projection, end to end: every point where PROJ puts it, over a kilometre."""

import re
from pathlib import Path

import numpy as np
import pytest
from pyproj import Transformer

from tests.geodesy.test_geoid_grid import write_gtx
from tribrach.errors import InputError
from tribrach.geodesy.geoid_grid import GeoidGrid
from tribrach.geodesy.proj_grids import missing_grid_sentences, vertical_name
from tribrach.geodesy.site import enu_rotation
from tribrach.geometry import rotation
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.scans.formats import read_scans
from tribrach.job.opened import open_job
from tribrach.pipeline import run
from tribrach.project import Project
from tribrach.questions.adjust.adjusted import adjust_job
from tribrach.solution import AdjustmentSettings

#: 37.87 N, 32.5 E on the ellipsoid [degrees, m], the middle of the site
LATITUDE, LONGITUDE, HEIGHT = 37.87, 32.5, 1020.0
UTM = "EPSG:32636"
PROJECT = """\
[site]
crs = "{crs}"
{site}
[[points]]
file = "control.csv"
role = "control"

[[observations]]
file = "targets.csv"

[[scans]]
file = "S1.ply"
station = "S1"
origin = "scanner"

[cloud]
format = "ply"
"""


def to_utm(enu: np.ndarray) -> np.ndarray:
    """PROJ alone: topocentric to geocentric to the projection, E, N, ellipsoidal height."""
    steps = (
        f"+proj=pipeline +step +inv +proj=topocentric +lat_0={LATITUDE} +lon_0={LONGITUDE} "
        f"+h_0={HEIGHT} +ellps=WGS84 +step +inv +proj=cart +ellps=WGS84 "
        "+step +proj=utm +zone=36 +ellps=WGS84"
    )
    return np.stack(Transformer.from_pipeline(steps).transform(*enu.T), axis=1)


def write_project(
    folder: Path, crs: str = UTM, site: str = "", undulation: float = 0.0
) -> tuple[Path, np.ndarray]:
    """A tilted station with exact targets, a cloud 1 km across; true E, N, U of its points."""
    rng = np.random.default_rng(1)
    turn, place = rotation.exp(np.array([0.01, -0.02, 1.1])), np.array([40.0, -25.0, 3.0])
    cloud = rng.uniform(-500, 500, (2000, 3)) * [1, 1, 0.1]
    targets = np.array([[400.0, 300, 10], [-450, 200, -5], [300, -420, 20], [-350, -380, 8]])
    grid = to_utm(targets @ turn.T + place) - [0, 0, undulation]
    rows = [
        "point,easting_m,northing_m,height_m,sigma_easting_mm,sigma_northing_mm,sigma_height_mm"
    ]
    rows += [f"T{k},{e:.6f},{n:.6f},{h:.6f},1,1,1" for k, (e, n, h) in enumerate(grid)]
    (folder / "control.csv").write_text("\n".join(rows))
    rows = ["station,target,x_m,y_m,z_m,sigma_x_mm,sigma_y_mm,sigma_z_mm"]
    rows += [f"S1,T{k},{x:.6f},{y:.6f},{z:.6f},1,1,1" for k, (x, y, z) in enumerate(targets)]
    (folder / "targets.csv").write_text("\n".join(rows))
    with create(folder / "S1.ply", CloudHeader("S1")) as writer:
        writer.write(cloud, {})
    path = folder / "p.toml"
    path.write_text(PROJECT.format(crs=crs, site=site))
    return path, cloud @ turn.T + place


def written(folder: Path) -> np.ndarray:
    (scan,) = read_scans(folder / "out" / "clouds" / "S1.ply")
    return np.concatenate([chunk.xyz for chunk in scan.chunks()])


def test_a_cloud_in_utm_lies_where_proj_puts_it(tmp_path: Path) -> None:
    path, true = write_project(tmp_path)
    content = run(Project.load(path))
    assert content.summary.sigma0_posterior < 0.01
    expected = to_utm(true)
    assert np.ptp(expected[:, 0]) > 950
    assert np.abs(written(tmp_path) - expected).max() < 1e-4
    # taken as Cartesian the grid would be wrong by its scale: 0.9996 and 1020 m of height
    rigid = true[:, :2] - true[:, :2].mean(axis=0)
    scale = np.sqrt(
        np.square(expected[:, :2] - expected[:, :2].mean(axis=0)).sum() / (rigid**2).sum()
    )
    assert abs(scale - 1) * 500 > 0.05


def test_heights_go_through_the_geoid_and_back(tmp_path: Path) -> None:
    """Orthometric heights in, orthometric heights out, over a geoid that rises 55 mm in a km."""
    grid = GeoidGrid(write_gtx(tmp_path / "g.gtx", 6.0, -2.0))
    _, true = write_project(tmp_path)
    turned = Transformer.from_crs(UTM, "EPSG:4326", always_xy=True)
    for crs, site in ((UTM, 'geoid_grid = "g.gtx"'), (f"{UTM}+5773", 'geoid_grid = "g.gtx"')):
        path, true = write_project(tmp_path, crs, site)
        control = np.loadtxt(tmp_path / "control.csv", delimiter=",", skiprows=1, usecols=(1, 2, 3))
        longitude, latitude = turned.transform(control[:, 0], control[:, 1])
        control[:, 2] -= grid.undulation(np.radians(latitude), np.radians(longitude))
        rows = (tmp_path / "control.csv").read_text().splitlines()
        rows[1:] = [f"T{k},{e:.6f},{n:.6f},{h:.6f},1,1,1" for k, (e, n, h) in enumerate(control)]
        (tmp_path / "control.csv").write_text("\n".join(rows))
        run(Project.load(path))
        expected = to_utm(true)
        longitude, latitude = turned.transform(expected[:, 0], expected[:, 1])
        expected[:, 2] -= grid.undulation(np.radians(latitude), np.radians(longitude))
        assert np.abs(written(tmp_path) - expected).max() < 1e-4


def test_one_geoid_height_for_the_site(tmp_path: Path) -> None:
    path, true = write_project(tmp_path, site="geoid_height_m = 36.5", undulation=36.5)
    run(Project.load(path))
    assert np.abs(written(tmp_path) - to_utm(true) + [0, 0, 36.5]).max() < 1e-4


def test_geocentric_clouds(tmp_path: Path) -> None:
    path, true = write_project(tmp_path)
    path.write_text(path.read_text() + 'frame = "ecef"\n')
    run(Project.load(path))
    to_ecef = Transformer.from_pipeline(
        f"+proj=pipeline +step +inv +proj=topocentric +lat_0={LATITUDE} +lon_0={LONGITUDE} "
        f"+h_0={HEIGHT} +ellps=WGS84"
    )
    expected = np.stack(to_ecef.transform(*true.T), axis=1)
    # WGS 84 and GRS80, the ellipsoid of the work frame, differ by 0.1 mm at the poles
    assert np.abs(written(tmp_path) - expected).max() < 1.1e-4
    assert np.ptp(written(tmp_path) - expected, axis=0).max() < 1e-5


def test_the_flat_way_says_what_it_costs(tmp_path: Path) -> None:
    """0.9996 at 1020 m height and a kilometre: scale and millimetres are those of PROJ."""
    path, _ = write_project(tmp_path, site='kind = "flat"')
    job = open_job(path)
    report = adjust_job(job, AdjustmentSettings.of(job.project))
    (warning,) = [w for w in report.warnings if "taken as Cartesian" in w]
    stated, extent_mm = (float(x) for x in re.findall(r"(-?[\d.]+) (?:ppm|mm over)", warning))
    control = np.loadtxt(tmp_path / "control.csv", delimiter=",", skiprows=1, usecols=(1, 2, 3))
    up = control[:, 2].mean() - HEIGHT
    steps = np.array([[-50.0, 0, up], [50, 0, up], [0, -50, up], [0, 50, up]])
    there = to_utm(steps)[:, :2]
    lengths = np.linalg.norm(there[1::2] - there[::2], axis=1) / 100
    assert stated == pytest.approx(1e6 * (lengths.mean() - 1), abs=0.3)
    size = np.hypot(*np.ptp(control[:, :2], axis=0))
    assert extent_mm == pytest.approx(1e-3 * abs(stated) * size, rel=1e-3)


def test_missing_grids_are_named(tmp_path: Path) -> None:
    """The way from the British grid to WGS 84 needs OSTN15, which no wheel contains."""
    (sentence,) = missing_grid_sentences("EPSG:27700")
    assert "uk_os_OSTN15_NTv2_OSGBtoETRS.tif" in sentence
    assert "nothing is downloaded" in sentence
    assert missing_grid_sentences(UTM) == []
    with pytest.raises(InputError, match="is not known to PROJ"):
        missing_grid_sentences("EPSG:1")
    path, _ = write_project(tmp_path, site='geoid_grid = "absent.gtx"')
    with pytest.raises(
        InputError, match=r"absent\.gtx: the geoid grid is not there.*nothing is down"
    ):
        open_job(path).network()


def test_heights_that_are_not_ellipsoidal_want_a_geoid(tmp_path: Path) -> None:
    assert vertical_name(f"{UTM}+5773") == "EGM96 height"
    assert vertical_name(UTM) is None
    path, _ = write_project(tmp_path, crs=f"{UTM}+5773")
    with pytest.raises(InputError, match=r"p\.toml:2: .*heights of EGM96 height"):
        open_job(path).network()
    for site, words in (
        ('geoid_grid = "g.gtx"\ngeoid_height_m = 1.0', "either geoid_grid or geoid_height_m"),
        ('geoid_grid = "g.gtx"\nkind = "flat"', "the site is flat"),
    ):
        path, _ = write_project(tmp_path, site=site)
        with pytest.raises(InputError, match=words):
            Project.load(path)


def test_rods_stand_along_the_plumb_line_of_the_place(tmp_path: Path) -> None:
    """GNSS of marks as geocentric coordinates, rods on top: same latitude, height and rod more."""
    place = np.array([[37.871, 32.502, 1018.0], [37.874, 32.505, 1025.0], [37.868, 32.497, 1011.0]])
    to_ecef = Transformer.from_crs("EPSG:4979", "EPSG:4978")
    ecef = np.stack(to_ecef.transform(*place.T), axis=1)
    rows = ["gnss,set,ecef_x_m,ecef_y_m,ecef_z_m"]
    rows += [f"M{k},one,{x:.5f},{y:.5f},{z:.5f}" for k, (x, y, z) in enumerate(ecef)]
    (tmp_path / "gnss.csv").write_text("\n".join(rows))
    rods = [1.5, 2.0, 2.5]
    (tmp_path / "rods.csv").write_text(
        "\n".join(["mark,target,rod_m", *(f"M{k},P{k},{rod}" for k, rod in enumerate(rods))])
    )
    path = tmp_path / "p.toml"
    path.write_text(
        f"[site]\nlatitude_deg = {LATITUDE}\nlongitude_deg = {LONGITUDE}\nheight_m = {HEIGHT}\n"
        '[instruments.rtk]\nsheet = "NetRTK"\n[instruments.rod]\nsheet = "Target on rod"\n'
        '[[observations]]\nfile = "gnss.csv"\ninstrument = "rtk"\n'
        '[[observations]]\nfile = "rods.csv"\ninstrument = "rod"\n'
    )
    content = run(Project.load(path))
    points = {p.name: p for p in content.points}
    for k, rod in enumerate(rods):
        geodetic = points[f"P{k}"].geodetic
        assert geodetic is not None
        assert np.degrees(geodetic[:2]) == pytest.approx(place[k, :2], abs=2e-9)
        assert geodetic[2] == pytest.approx(place[k, 2] + rod, abs=2e-4)
        # 2 cm, 5 cm along the axes of the place, with a bubble of 8 arc minutes on top
        up = points[f"P{k}"].sigma[2]
        assert up == pytest.approx(np.hypot(0.05, 0.0005), rel=1e-3)


@pytest.mark.parametrize(
    "title", ["sigma_e_mm,sigma_n_mm,sigma_u_mm", "sigma_x_mm,sigma_y_mm,sigma_z_mm"]
)
def test_sigmas_of_geocentric_coordinates_are_along_their_titles(
    tmp_path: Path, title: str
) -> None:
    """Method 1.1: 1.1, 1.5, 2.7 mm in E, N, U at Konya are 2.05, 1.55, 2.04 mm in X, Y, Z."""
    to_ecef = Transformer.from_crs("EPSG:4979", "EPSG:4978")
    x, y, z = to_ecef.transform(LATITUDE, LONGITUDE, HEIGHT)
    local = (1.1, 1.5, 2.7)
    enu = enu_rotation(np.radians(LATITUDE), np.radians(LONGITUDE))
    (tmp_path / "gnss.csv").write_text(
        f"gnss,ecef_x_m,ecef_y_m,ecef_z_m,{title}\nA,{x},{y},{z},1.1,1.5,2.7\n"
    )
    path = tmp_path / "p.toml"
    path.write_text(
        f"[site]\nlatitude_deg = {LATITUDE}\nlongitude_deg = {LONGITUDE}\nheight_m = {HEIGHT}\n"
        '[[observations]]\nfile = "gnss.csv"\n'
    )
    (o,) = open_job(path).network().observations
    given = np.diag(np.square(local)) * 1e-6
    expected = given if title.startswith("sigma_e") else enu @ given @ enu.T
    assert o.covariance[0] == pytest.approx(expected, abs=1e-12)
    if title.startswith("sigma_e"):
        turned = enu.T @ o.covariance[0] @ enu
        assert 1e3 * np.sqrt(np.diag(turned)) == pytest.approx([2.05, 1.55, 2.04], abs=0.01)
