"""Lengths become metres in one place: by words, by axes, by keys; degrees are refused."""

from pathlib import Path

import laspy
import numpy as np
import pytest
from laspy.vlrs.vlr import VLR
from pyproj import CRS

from tests.io.scans.scan_files import whole, written
from tribrach.errors import InputError
from tribrach.io.scans.formats import read_scans
from tribrach.io.scans.info import describe
from tribrach.io.scans.units import as_filed, metric_crs, named_unit, stated_unit, unit_of_crs
from tribrach.scan.loading import hold

US, FOOT = 1200 / 3937, 0.3048
XYZ = np.array([[600000.0, 1200000.0, 300.0], [600010.0, 1200020.0, 303.0], [600001, 1200007, 301]])


def las(path: Path, xyz: np.ndarray = XYZ, crs: str | None = None, step: float = 1e-3) -> Path:
    """A file with a WKT of this system."""
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = np.full(3, step), np.floor(xyz[0])
    if crs is not None:
        header.add_crs(CRS.from_user_input(crs))
    data = laspy.LasData(header)
    data.x, data.y, data.z = xyz.T
    data.write(path)
    return path


def with_keys(path: Path, keys: dict[int, int]) -> Path:
    """A file of version 1.2 with keys of GeoTIFF."""
    header = laspy.LasHeader(point_format=0, version="1.2")
    header.scales, header.offsets = np.full(3, 1e-3), np.floor(XYZ[0])
    entries = [[1, 1, 0, len(keys)], *([key, 0, 1, value] for key, value in sorted(keys.items()))]
    record = np.array(entries, dtype="<u2").tobytes()
    header.vlrs.append(VLR("LASF_Projection", 34735, "keys", record))
    data = laspy.LasData(header)
    data.x, data.y, data.z = XYZ.T
    data.write(path)
    return path


@pytest.mark.parametrize(
    ("crs", "factors"),
    [
        ("EPSG:6543+6360", (US, US, US)),
        ("EPSG:6543+5703", (US, US, 1.0)),
        ("EPSG:2236", (US, US, US)),
        ("EPSG:2994", (FOOT, FOOT, FOOT)),
        ("EPSG:25832+6360", (1.0, 1.0, US)),
        ("EPSG:25832", (1.0, 1.0, 1.0)),
        ("EPSG:4978", (1.0, 1.0, 1.0)),
    ],
)
def test_axes_of_the_reference_system_make_metres(
    tmp_path: Path, crs: str, factors: tuple[float, float, float]
) -> None:
    (scan,) = read_scans(las(tmp_path / "a.las", crs=crs))
    assert scan.unit.factors == pytest.approx(factors, rel=1e-12)
    assert np.allclose(whole(scan).xyz, XYZ * np.array(factors), rtol=0, atol=1e-3)
    assert scan.bounds is not None
    assert np.allclose(scan.bounds[0], XYZ.min(axis=0) * np.array(factors), atol=1e-3)
    assert np.array_equal(hold(scan).points.xyz, whole(scan).xyz)
    assert np.array_equal(hold(scan, stored=True).points.xyz, whole(scan).xyz)
    assert scan.crs is not None
    of_metres = unit_of_crs(scan.crs)
    assert of_metres is not None
    assert of_metres.metric
    filed = as_filed(scan)
    assert filed.crs is not None
    assert CRS(filed.crs).equals(CRS(crs), ignore_axis_order=True)
    assert np.allclose(whole(filed).xyz, XYZ, rtol=0, atol=1e-6)


def test_a_system_in_metres_is_the_same_place() -> None:
    from pyproj import Transformer

    there = metric_crs("EPSG:6543+6360")
    assert there is not None
    to_metres = Transformer.from_crs("EPSG:6543", CRS(there).sub_crs_list[0], always_xy=True)
    assert to_metres.transform(600000.0, 1200000.0) == pytest.approx(
        (600000 * US, 1200000 * US), abs=1e-6
    )


@pytest.mark.parametrize("crs", ["EPSG:4326", "EPSG:4979", "EPSG:4326+5773"])
def test_degrees_are_described_and_refused_as_lengths(tmp_path: Path, crs: str) -> None:
    xyz = np.array([[11.5, 48.1, 520.0], [11.5001, 48.10009, 521.0], [11.50003, 48.10002, 520.5]])
    (scan,) = read_scans(las(tmp_path / "d.las", xyz, crs, 1e-9))
    assert scan.unit.factors is None
    with pytest.raises(InputError, match="degrees"):
        next(scan.chunks())
    with pytest.raises(InputError, match="degrees"):
        hold(scan)
    told = describe(scan)
    assert told.angles
    assert told.unit.metres is None
    assert np.allclose(told.figures.bounds, [xyz.min(axis=0), xyz.max(axis=0)], atol=1e-8)


def test_what_is_wider_than_any_scan_is_not_in_degrees(tmp_path: Path) -> None:
    """Programs put the system of the globe beside coordinates of the scanner."""
    xyz = np.array([[-12.5, 48.1, 5.0], [11.5, -60.0, 2.0]])
    (scan,) = read_scans(las(tmp_path / "d.las", xyz, "EPSG:4326"))
    assert scan.unit.metric
    assert len(scan.warnings) == 1
    assert np.allclose(whole(scan).xyz, xyz, atol=1e-3)


@pytest.mark.parametrize(
    ("keys", "factors"),
    [
        ({1024: 1, 3072: 2236}, (US, US, US)),
        ({1024: 1, 3072: 2236, 4096: 5703}, (US, US, 1.0)),
        ({1024: 1, 3072: 2236, 4096: 6360}, (US, US, US)),
        ({1024: 1, 3072: 32767, 3076: 9003}, (US, US, US)),
        ({1024: 1, 3072: 32767, 3076: 9002, 4099: 9001}, (FOOT, FOOT, 1.0)),
        ({1024: 1, 3072: 25832, 3076: 9001}, (1.0, 1.0, 1.0)),
        ({1024: 1, 3072: 25832, 4099: 9003}, (1.0, 1.0, US)),
    ],
)
def test_keys_of_geotiff_make_metres(
    tmp_path: Path, keys: dict[int, int], factors: tuple[float, float, float]
) -> None:
    (scan,) = read_scans(with_keys(tmp_path / "a.las", keys))
    assert scan.unit.factors == pytest.approx(factors, rel=1e-12)
    assert np.allclose(whole(scan).xyz, XYZ * np.array(factors), rtol=0, atol=1e-3)


@pytest.mark.parametrize(
    ("comment", "metres"),
    [
        ("units: mm", 1e-3),
        ("unit=feet", FOOT),
        ("Units are US survey feet", US),
        ("coordinates in centimetres", 1e-2),
        ("Coordinate units: millimeters.", 1e-3),
        ("unit: ftUS", US),
        ("X, Y, Z in mm", 1e-3),
        ("units [inch]", 0.0254),
        ("unit: m", 1.0),
    ],
)
def test_comments_that_state_a_unit(comment: str, metres: float) -> None:
    unit = stated_unit([comment])
    assert unit is not None
    assert unit.factors == (metres,) * 3


@pytest.mark.parametrize("comment", ["unit vector normals", "in situ", "United Scans", "mm", ""])
def test_other_comments_state_none(comment: str) -> None:
    assert stated_unit([comment]) is None
    assert named_unit("m2") is None


@pytest.mark.parametrize(
    ("name", "head"),
    [
        ("a.pcd", "# .PCD v0.7\n# unit: inch\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n"
         "COUNT 1 1 1\nWIDTH 3\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 3\nDATA ascii\n"),
        ("a.txt", '"X, in"\t"Y, in"\t"Z, in"\n'),
        ("a.csv", "X[in] Y[in] Z[in]\n"),
    ],
)  # fmt: skip
def test_headers_that_state_inches(tmp_path: Path, name: str, head: str) -> None:
    mark = "\t" if "\t" in head else " "
    rows = "\n".join(mark.join(str(v) for v in row) for row in XYZ - XYZ[0])
    (scan,) = read_scans(written(tmp_path, name, head + rows + "\n"))
    assert whole(scan).xyz == pytest.approx((XYZ - XYZ[0]) * 0.0254)


def test_a_ply_in_millimetres(tmp_path: Path) -> None:
    head = "ply\nformat ascii 1.0\ncomment units: mm\nelement vertex 2\n"
    head += "".join(f"property double {c}\n" for c in "xyz") + "end_header\n"
    (scan,) = read_scans(written(tmp_path, "a.ply", head + "1000 2000 3000\n-500 0 250\n"))
    assert np.allclose(whole(scan).xyz, [[1, 2, 3], [-0.5, 0, 0.25]], rtol=1e-15)
    assert describe(scan).unit.metres == (1e-3,) * 3
