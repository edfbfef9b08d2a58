"""Coordinates on their way out: exact, and the fast map against the exact one."""

import numpy as np
import pytest
from pyproj import Geod, Transformer

from tribrach.errors import InputError
from tribrach.geodesy.local_map import LocalMap
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geodesy.projection import ProjectedGrid
from tribrach.geodesy.site import EllipsoidSite
from tribrach.geodesy.work_frame import WorkFrame

UTM = "EPSG:32648"


def projected() -> OutputFrame:
    grid = ProjectedGrid(UTM, 590000.0, 2330000.0, 20.0)
    return OutputFrame(WorkFrame(grid.site, grid), "projected")


def test_projected_coordinates_are_those_of_proj() -> None:
    """An independent way: the length on the ellipsoid and the azimuth between two points."""
    frame = projected()
    x = np.array([[0.0, 0.0, 0.0], [300.0, 400.0, -20.0]])
    out = frame.from_work(x)
    to_geographic = Transformer.from_crs(UTM, "EPSG:4326", always_xy=True)
    longitude, latitude = to_geographic.transform(out[:, 0], out[:, 1])
    _, _, length = Geod(ellps="WGS84").inv(longitude[0], latitude[0], longitude[1], latitude[1])
    # 500 m at about 20 m and 0 m height: reduced to the ellipsoid by 20 / 6.37e6 at most
    assert length == pytest.approx(500.0, abs=2e-3)
    assert out[0] == pytest.approx([590000.0, 2330000.0, 20.0], abs=1e-6)


def test_the_jacobian_is_the_slope() -> None:
    frame = projected()
    x, d = np.array([40.0, -30.0, 5.0]), np.array([0.3, 0.2, -0.4])
    moved = frame.from_work(np.stack([x + d, x - d]))
    assert frame.jacobian(x) @ (2 * d) == pytest.approx(moved[0] - moved[1], abs=1e-8)
    assert frame.rotation(x) @ frame.rotation(x).T == pytest.approx(np.eye(3), abs=1e-12)


def test_the_fast_map_is_the_exact_one() -> None:
    frame, rng = projected(), np.random.default_rng(1)
    quick = LocalMap(frame.from_work)
    for spread in (50.0, 300.0):  # the second cloud leaves the first one's box
        x = rng.uniform(-spread, spread, (1000, 3))
        assert np.abs(quick(x) - frame.from_work(x)).max() < 1e-6


def test_the_fast_map_gives_way_where_it_does_not_hold() -> None:
    quick = LocalMap(lambda x: np.sin(x))
    x = np.random.default_rng(2).uniform(-40, 40, (100, 3))
    assert quick(x) == pytest.approx(np.sin(x), abs=1e-15)


def test_geocentric_coordinates() -> None:
    site = EllipsoidSite(0.4, 1.8, 20.0)
    frame = OutputFrame(WorkFrame(site), "ecef")
    x = np.array([[1.0, 2.0, 3.0]])
    assert frame.from_work(x) == pytest.approx(site.to_ecef(x), abs=1e-9)
    assert frame.jacobian(x[0]) == pytest.approx(site.w_from_ecef.T)


def test_what_a_flat_site_cannot_give() -> None:
    for kind in ("projected", "ecef"):
        with pytest.raises(InputError, match="site"):
            OutputFrame(WorkFrame(), kind)  # type: ignore[arg-type]


def test_grid_and_geocentric_coordinates_meet_in_the_work_frame() -> None:
    """One place given in two ways is one point."""
    frame = projected()
    site = frame.work.site
    assert isinstance(site, EllipsoidSite)
    enh = np.array([[590010.0, 2330020.0, 25.0]])
    x, _ = frame.work.from_own(enh)
    to_ecef = Transformer.from_crs(UTM, "EPSG:4978")
    # PROJ takes the height as ellipsoidal
    ecef = np.array(to_ecef.transform(*enh[0])).reshape(1, 3)
    assert frame.work.from_ecef(ecef)[0] == pytest.approx(x, abs=1e-4)
    assert site.height(x) == pytest.approx(25.0, abs=1e-6)
