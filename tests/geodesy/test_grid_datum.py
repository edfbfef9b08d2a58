"""Projected grids stay in their own datum: places, ellipsoids, geoid heights, GNSS vectors."""

from pathlib import Path

import numpy as np
import pytest
from pyproj import Transformer

from tests.geodesy.test_geoid_grid import write_gtx
from tribrach.errors import InputError
from tribrach.geodesy.geoid_grid import GeoidGrid
from tribrach.geodesy.grid_datum import GridDatum
from tribrach.geodesy.projection import ProjectedGrid
from tribrach.geodesy.work_frame import WorkFrame
from tribrach.network.adjustment import adjust
from tribrach.network.survey import Survey
from tribrach.observations.gnss import GnssBaselines

NEW_BRUNSWICK = "EPSG:2953"


@pytest.mark.parametrize(
    ("crs", "frame", "ellipsoid", "easting", "northing"),
    [
        (NEW_BRUNSWICK, "NAD83(CSRS)", "GRS80", 2487601.211, 7437047.544),
        ("EPSG:27572", "NTF", "clrk80ign", 600000.0, 2200000.0),
        ("EPSG:31467", "DHDN", "bessel", 3500000.0, 5500000.0),
        ("EPSG:5897", "VN-2000", "WGS84", 500000.0, 2330000.0),
        ("EPSG:25832+7837", "ETRS89", "GRS80", 500000.0, 5500000.0),
    ],
)
def test_geocentric_coordinates_are_of_the_grid(
    crs: str, frame: str, ellipsoid: str, easting: float, northing: float
) -> None:
    """PROJ's own projection and conversion on the ellipsoid of the grid, without any datum."""
    grid = ProjectedGrid(crs, easting, northing, 100.0)
    assert grid.datum.frame == frame
    enh = np.array([[easting + 900.0, northing - 700.0, 130.0]])
    projected = Transformer.from_crs(grid.datum.geographic, grid.datum.projected, always_xy=True)
    longitude, latitude = projected.transform(enh[:, 0], enh[:, 1], direction="INVERSE")
    unit = grid.datum.unit
    degrees = np.degrees(unit * longitude + grid.datum.meridian), np.degrees(unit * latitude)
    cart = Transformer.from_pipeline(f"+proj=cart +ellps={ellipsoid}")
    expected = np.stack(cart.transform(*np.radians(degrees), enh[:, 2], radians=True), axis=1)
    x = grid.to_work(enh)
    # rounding of the ellipsoids' axes in PROJ's names: micrometres
    np.testing.assert_allclose(grid.site.to_ecef(x), expected, atol=1e-5)
    np.testing.assert_allclose(grid.from_work(x), enh, atol=2e-8)


def test_paris_is_not_greenwich() -> None:
    """The origin of Lambert II lies on the meridian of Paris, 46.8 degrees (52 grads) north."""
    grid = ProjectedGrid("EPSG:27572", 600000.0, 2200000.0)
    assert np.degrees(grid.place) == pytest.approx([46.8, 2.33722917], abs=1e-8)


def test_geoid_heights_of_older_datums_count_from_their_ellipsoid(tmp_path: Path) -> None:
    """Published: NTF lies at -168, -60, 320 m from WGS 84; a geoid height less the gap between."""
    site = ProjectedGrid("EPSG:27572", 600000.0, 2200000.0).site
    shift = np.array([-168.0, -60.0, 320.0])
    there = site.to_ecef(np.zeros((1, 3)))[0] + shift
    back = Transformer.from_crs("EPSG:4978", "EPSG:4979", always_xy=True)
    longitude, latitude, gap = back.transform(*there)
    grid = GeoidGrid(write_gtx(tmp_path / "g.gtx", 2.0, -3.0, south=45.0, west=1.0))
    place = np.array([site.latitude]), np.array([site.longitude])
    for work, above in (
        (WorkFrame(site, ProjectedGrid("EPSG:27572", 6e5, 2.2e6), 48.0), 48.0),
        (
            WorkFrame(site, ProjectedGrid("EPSG:27572", 6e5, 2.2e6), 0.0, grid),
            grid.undulation(*np.radians([[latitude], [longitude]]))[0],
        ),
    ):
        assert work.undulation(*place)[0] == pytest.approx(above - gap, abs=1e-6)
    # a country's own geoid belongs to its own geocentric datum, though EPSG says a metre
    grid_of_today = ProjectedGrid(NEW_BRUNSWICK, 2487601.0, 7437047.0)
    today = WorkFrame(grid_of_today.site, grid_of_today, -22.0)
    assert today.undulation(*np.array([grid_of_today.place]).T)[0] == -22.0


def test_what_is_no_grid() -> None:
    with pytest.raises(InputError, match="EPSG:4326 is not a projected grid"):
        GridDatum.of("EPSG:4326")
    assert GridDatum.of("+proj=sterea +lat_0=48 +ellps=GRS80 +type=crs").frame is None


@pytest.mark.data
def test_gnss_vectors_in_the_frame_of_their_grid(shared_data: Path) -> None:
    """STAR*NET's listing of a network in NAD83(CSRS): factor 1.225, coordinates, ellipsoid.

    Vectors are geocentric differences in the datum of the grid; 0.16 ppm of a turn, which a place
    of WGS 84 would bring, are 0.4 mm over this network. By its correlations the listing is of a run
    in which two vectors, V28 and V29, had a horizontal factor of 1.2 instead of 1.
    """
    folder = shared_data / "networks" / "starnet"
    grid = ProjectedGrid(NEW_BRUNSWICK, 2487601.211, 7437047.544, 117.93)
    survey = Survey(site=grid.site)
    factor = np.ones(2)
    turn = grid.site.w_from_ecef
    for line in (folder / "industry_case_gnss_input.txt").read_text().splitlines():
        words = line.split()
        match words[:1]:
            case ["C"]:
                north, east, up = map(float, words[2:5])
                x = grid.to_work(np.array([[east, north, up]]))[0]
                held = words[1] == "FRDN"
                role = "fixed" if held else "approximate"
                survey.point(words[1], x, role=role, free=[not held] * 3)
            case [".GPS"] if words[1] == "FACTOR":
                factor = np.array([float(words[2]), float(words[4])])
            case ["G0"] if words[1] in ("'V28", "'V29"):
                factor = np.array([1.2, 1.0])
            case ["G1"]:
                ends, vector = words[1].split("-"), np.array(words[2:5], dtype=float)
            case ["G2"]:
                xx, yy, zz = map(float, words[1:4])
            case ["G3"]:
                xy, zx, zy = map(float, words[1:4])
                c = np.array([[xx, xy, zx], [xy, yy, zy], [zx, zy, zz]])
                axes = grid.site.axes(survey.points[ends[0]].xyz[None])[0] @ turn
                scale = np.diag([factor[0], factor[0], factor[1]])
                local = scale @ axes @ c @ axes.T @ scale
                survey.add(
                    GnssBaselines,
                    values=(turn @ vector)[None],
                    covariance=(turn @ axes.T @ local @ axes @ turn.T)[None],
                    start=[ends[0]],
                    end=[ends[1]],
                )
    adjustment = adjust(survey.network())
    assert adjustment.dof == 27
    assert adjustment.sigma0_posterior == pytest.approx(1.225, abs=1e-3)
    listing = (folder / "industry_case_gnss_output.txt").read_text().splitlines()
    first = next(k for k, line in enumerate(listing) if "Adjusted Coordinates (Meters)" in line)
    rows = [line.split() for line in listing[first + 3 : first + 10]]
    found = grid.from_work(adjustment.state.points)
    names = adjustment.layout.names["point"]
    for name, north, east, up in rows:
        expected = [float(east), float(north), float(up)]
        # the listing has four decimals
        assert found[names.index(name)] == pytest.approx(expected, abs=1e-4)
    first = next(k for k, line in enumerate(listing) if "Adjusted Positions and Ell" in line)
    geodetic = np.degrees(grid.site.geodetic(adjustment.state.points)[:, :2])
    for line in listing[first + 4 : first + 11]:
        name, *place, _ = line.split()
        for k, text in enumerate(place):
            d, m, s = map(float, text.split("-"))
            # the listing counts longitudes positive west, to a microarcsecond
            value = (d + m / 60 + s / 3600) * (1, -1)[k]
            assert geodetic[names.index(name), k] == pytest.approx(value, abs=2e-9)
