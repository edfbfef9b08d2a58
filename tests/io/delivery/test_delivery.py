"""Results in the formats of offices: the same figures as in the JSON, and files that open."""

import importlib.util
import io
import json
import sqlite3
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import ezdxf
import numpy as np
import openpyxl
import pyogrio
import pytest
from lxml import etree
from pyproj import CRS, Transformer
from typer.testing import CliRunner

from tribrach.cli import app
from tribrach.errors import InputError
from tribrach.io.delivery import names
from tribrach.io.delivery.content import DeliveredPosition, Delivery, delivered_network
from tribrach.io.delivery.formats import delivered, read_delivery
from tribrach.io.delivery.names import FORMATS, DeliveryFormat, DeliveryOptions
from tribrach.job.opened import open_job
from tribrach.project import Project
from tribrach.questions.adjust.adjusted import adjust_job
from tribrach.report.json_result import network as result_of

RUN = CliRunner()
#: a square of 60 m in UTM 32, seen from its middle; the meridian is 4 degrees off there
POINTS = """\
point,easting_m,northing_m,height_m,sigma_e_mm,sigma_n_mm,sigma_u_mm,code
A,810000,5400000,300,1,4,2,BM
B,810060,5400000,301,2,1,2,BM
C,810060,5400060,302,1,1,2,
"""
SIGHTS = """\
from,to,direction_gon,zenith_gon,slope_distance_m
S,A,250,100,42.4264
S,B,150,100,42.4264
S,C,50,100,42.4264
S,P,0,100,20.0
S,Q,100,95,25.0
"""
PROJECT = """\
title = "Square"
[site]
crs = "EPSG:25832"
[instruments.tps]
direction_arcsec = 3
zenith_arcsec = 20
distance_mm = 2
[[points]]
file = "points.csv"
[[observations]]
file = "sights.csv"
instrument = "tps"
[output]
deliver = ["dxf", "landxml", "gpkg", "geojson", "kml", "xlsx", "csv", "list"]
drawing_scale = 250
list_template = "{point:<4}{easting_m:14.4f}{northing_m:14.4f}{height_m:10.4f} {code}"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("square")
    (place / "points.csv").write_text(POINTS)
    (place / "sights.csv").write_text(SIGHTS)
    (place / "square.toml").write_text(PROJECT)
    answer = RUN.invoke(app, ["run", str(place / "square.toml"), "-q"])
    assert answer.exit_code == 0, answer.output
    return place


@pytest.fixture(scope="module")
def result(folder: Path) -> dict[str, Any]:
    data: dict[str, Any] = json.loads((folder / "out" / "result.json").read_text())
    return data


def positions(result: dict[str, Any]) -> dict[str, list[float]]:
    return {name: point["projected"] for name, point in result["points"].items()}


def test_names_stand_in_one_place() -> None:
    assert set(get_args(DeliveryFormat)) == FORMATS.keys()


def test_covariances_turn_with_the_meridian(folder: Path) -> None:
    content = adjust_job(open_job(Project.load(folder / "square.toml")))
    made = delivered_network(result_of(content))
    grid = content.adjustment.network.reference.grid
    assert grid is not None
    for name, point in content.adjustment.points.items():
        turn = grid.rotation(point.xyz)
        # scale of the grid is left out
        expected = turn @ point.covariance @ turn.T
        np.testing.assert_allclose(made.by_name[name].covariance, expected, atol=1e-9)
    for said in content.points:
        if said.ellipse is not None:
            own = made.by_name[said.name].ellipse
            assert own[:2] == pytest.approx((said.ellipse.major, said.ellipse.minor), rel=1e-5)
    # four degrees of convergence are seen in what is fixed worse in one axis
    assert abs(turn[0, 1]) > 0.05


def test_a_drawing_holds_the_result(folder: Path, result: dict[str, Any]) -> None:
    drawing = ezdxf.readfile(folder / "out" / "result.dxf")
    audit = drawing.audit()
    assert not audit.errors
    assert not audit.fixes
    assert drawing.units == 6
    inserts = {i.get_attrib_text("NAME"): i for i in drawing.query("INSERT")}
    assert inserts.keys() == positions(result).keys()
    for name, xyz in positions(result).items():
        assert tuple(inserts[name].dxf.insert) == tuple(xyz)
    assert inserts["A"].dxf.layer == "POINTS CONTROL BM"
    assert inserts["A"].get_attrib_text("CODE") == "BM"
    assert inserts["P"].dxf.layer == "POINTS FREE"
    # 2.5 mm on paper at 1:250
    assert inserts["A"].get_attrib("NAME").dxf.height == pytest.approx(0.625)
    made = delivered_network(result)
    layer = next(x.dxf.name for x in drawing.layers if x.dxf.name.startswith("ELLIPSES"))
    factor = float(layer.rpartition("x")[2])
    axes = [e.dxf.major_axis.magnitude / factor for e in drawing.query("ELLIPSE")]
    assert axes == pytest.approx([p.ellipse[0] for p in made.plan])
    assert len(drawing.query('LINE[layer=="SIGHTS"]')) == 5


def test_landxml_has_points_and_reduced_observations(folder: Path, result: dict[str, Any]) -> None:
    root = etree.parse(folder / "out" / "result.xml").getroot()
    space = {"x": root.nsmap[None]}
    assert root.get("version") == "1.2"
    assert root.xpath("x:CoordinateSystem/@epsgCode", namespaces=space) == ["25832"]
    for point in root.xpath("x:CgPoints/x:CgPoint", namespaces=space):
        north, east, up = map(float, point.text.split())
        assert [east, north, up] == positions(result)[point.get("name")]
    assert root.xpath("//x:CgPoint[@name='A']/@code", namespaces=space) == ["BM"]
    ids = root.xpath("//@id", namespaces=space)
    assert len(ids) == len(set(ids))
    assert {*root.xpath("//@setupID | //@targetSetupID")} <= {*ids}
    seen = root.xpath("//x:ReducedObservation[@desc='S to P']", namespaces=space)[0]
    difference = np.subtract(positions(result)["P"], positions(result)["S"])
    assert float(seen.get("horizDistance")) == pytest.approx(np.hypot(*difference[:2]), abs=1e-9)
    assert float(seen.get("vertDistance")) == pytest.approx(difference[2], abs=1e-9)
    azimuth = np.degrees(np.arctan2(difference[0], difference[1])) % 360
    assert float(seen.get("azimuth")) == pytest.approx(azimuth)


#: elements that we write with the children in order and the attributes that version 1.2 of the
#: schema has for them, and the values that its lists allow; the schema itself may not be copied
_POINT = (
    "name desc code state pntRef featureRef pointGeometry DTMAttribute timeStamp role "
    "determinedTimeStamp ellipsoidHeight latitude longitude zone northingStdError eastingStdError "
    "elevationStdError oID surveyOrder pntSurv"
)
SCHEMA: dict[str, tuple[str, str]] = {
    "LandXML": ("Units CoordinateSystem Project Application CgPoints Survey",
                "date time version language readOnly schemaLocation"),
    "Units": ("Metric", ""),
    "Metric": ("", "areaUnit linearUnit volumeUnit temperatureUnit pressureUnit angularUnit "
                   "directionUnit"),
    "CoordinateSystem": ("", "desc name epsgCode ogcWktCode horizontalDatum verticalDatum"),
    "Project": ("", "name desc state"),
    "Application": ("", "name desc manufacturer version"),
    "CgPoints": ("CgPoint", "desc name state code"),
    "CgPoint": ("", _POINT),
    "Survey": ("SurveyHeader InstrumentSetup ObservationGroup", "desc date state"),
    "SurveyHeader": ("", "name desc purpose startTime endTime surveyor type"),
    "InstrumentSetup": ("InstrumentPoint", "id instrumentDetailsID stationName instrumentHeight "
                                           "orientationAzimuth circleAzimuth status"),
    "InstrumentPoint": ("", _POINT),
    "ObservationGroup": ("ReducedObservation", "id purpose setupID targetSetupID setID"),
    "ReducedObservation": ("", "desc purpose setupID targetSetupID azimuth horizDistance "
                               "vertDistance"),
}  # fmt: skip
LISTS = {
    "role": {"measured", "to stake out", "staked out", "calculated", "assistance point",
             "user entered point", "control point"},
    "state": {"abandoned", "destroyed", "existing", "proposed"},
    "purpose": {"normal", "check", "backsight", "foresight", "traverse", "sideshot"},
    "type": {"compiled", "computed", "surveyed"},
    "linearUnit": {"millimeter", "centimeter", "meter", "kilometer"},
    "angularUnit": {"radians", "grads", "decimal degrees", "decimal dd.mm.ss"},
    "pressureUnit": {"HPA", "milliBars", "mmHG", "millimeterHG"},
}  # fmt: skip


def test_landxml_is_built_as_its_schema_says(folder: Path, result: dict[str, Any]) -> None:
    root = etree.parse(folder / "out" / "result.xml").getroot()
    for element in root.iter(etree.Element):
        name = etree.QName(element).localname
        children, attributes = (words.split() for words in SCHEMA[name])
        own = [children.index(etree.QName(child).localname) for child in element]
        assert own == sorted(own), name
        given = {etree.QName(key).localname: value for key, value in element.attrib.items()}
        assert given.keys() <= set(attributes), name
        for key in given.keys() & LISTS.keys():
            assert given[key] in LISTS[key]
    space = {"x": root.nsmap[None]}
    (point,) = root.xpath("//x:CgPoint[@name='P']", namespaces=space)
    said = delivered_network(result).by_name["P"]
    stated = [float(point.get(f"{a}StdError")) for a in ("easting", "northing", "elevation")]
    np.testing.assert_allclose(stated, said.sigma, atol=5e-7)
    assert said.geodetic is not None
    place = [float(point.get(a)) for a in ("longitude", "latitude", "ellipsoidHeight")]
    assert place == pytest.approx(said.geodetic)
    # without a geoid the heights of the grid are those over the ellipsoid
    assert root.xpath("//@verticalDatum") == ["ellipsoidal height"]
    assert place[2] == pytest.approx(said.xyz[2], abs=1e-6)


@pytest.mark.parametrize(
    ("keys", "named", "heights"),
    [
        ("geoid_height_m = 40.0", "geoid", "height over the geoid"),
        ('geoid_height_m = 40.0\nheights = "normal"', "normal", "normal height"),
        ('geoid_height_m = 40.0\nheights = "orthometric"', "orthometric", "orthometric height"),
    ],
)
def test_heights_have_a_name(
    keys: str, named: str, heights: str, folder: Path, tmp_path: Path
) -> None:
    for name in ("points.csv", "sights.csv"):
        (tmp_path / name).write_text((folder / name).read_text())
    text = PROJECT.replace('crs = "EPSG:25832"', f'crs = "EPSG:25832"\n{keys}')
    # what fits needs no search for blunders
    for figure in ("arcsec = 3", "arcsec = 20", "mm = 2"):
        text = text.replace(f"{figure}\n", f"{figure}0000\n")
    (tmp_path / "job.toml").write_text(text)
    data = result_of(adjust_job(open_job(Project.load(tmp_path / "job.toml"))))
    assert data["reference"]["heights"] == named
    made = delivered_network(data)
    assert made.heights == heights
    root = etree.fromstring(delivered(made, "landxml"))
    assert root.xpath("//@verticalDatum") == [heights]
    over = float(root.xpath("//*[@name='P']/@ellipsoidHeight")[0])
    assert over - made.by_name["P"].xyz[2] == pytest.approx(40.0, abs=1e-6)


@pytest.mark.parametrize(
    ("keys", "what"),
    [('heights = "normal"', "need geoid"), ('heights = "ellipsoidal"\ngeoid_height_m = 4', "no")],
)
def test_heights_that_contradict_the_site_are_refused(keys: str, what: str, tmp_path: Path) -> None:
    text = PROJECT.replace('crs = "EPSG:25832"', f'crs = "EPSG:25832"\n{keys}')
    (tmp_path / "job.toml").write_text(text)
    with pytest.raises(InputError, match=what):
        Project.load(tmp_path / "job.toml")


def test_a_geopackage_opens_with_system_units_and_style(
    folder: Path, result: dict[str, Any]
) -> None:
    path = folder / "out" / "result.gpkg"
    assert [name for name, _ in pyogrio.list_layers(path)] == [
        "points", "sights", "ellipses", "layer_styles",
    ]  # fmt: skip
    about = pyogrio.read_info(path, layer="points")
    assert about["crs"] == "EPSG:25832"
    assert {"easting_m", "height_m", "sigma_easting_mm", "sigma_height_mm"} <= {*about["fields"]}
    _, _, shapes, columns = pyogrio.raw.read(path, layer="points")
    read = dict(zip(about["fields"], columns, strict=True))
    made = delivered_network(result)
    for name, shape, sigma in zip(read["point"], shapes, read["sigma_northing_mm"], strict=True):
        np.testing.assert_array_equal(np.frombuffer(shape[5:], "<f8"), positions(result)[name])
        assert sigma == pytest.approx(1e3 * made.by_name[name].sigma[1])
    with sqlite3.connect(path) as base:
        rows = base.execute("SELECT f_table_name, useAsDefault, styleQML FROM layer_styles")
        styles = {name: (default, qml) for name, default, qml in rows}
    assert styles.keys() == {"points", "ellipses"}
    for default, qml in styles.values():
        assert default == 1
        renderer = etree.fromstring(qml.encode()).find("renderer-v2")
        assert renderer is not None
        assert "sigma_height_mm" in renderer.get("attr", "")
        assert len(renderer.findall(".//range")) == len(renderer.findall(".//symbol")) == 5


def test_the_earth_is_the_same_in_geojson_and_kml(folder: Path, result: dict[str, Any]) -> None:
    there = Transformer.from_crs("EPSG:25832", "EPSG:4326", always_xy=True)
    data = json.loads((folder / "out" / "result.geojson").read_text())
    for feature in data["features"]:
        e, n, _ = positions(result)[feature["properties"]["point"]]
        assert feature["geometry"]["coordinates"][:2] == pytest.approx(
            there.transform(e, n), abs=1e-9
        )
    root = etree.parse(folder / "out" / "result.kml").getroot()
    space = {"k": "http://www.opengis.net/kml/2.2"}
    assert root.xpath("//k:Placemark/k:name/text()", namespaces=space) == [*positions(result)]


def test_lists_and_sheets_hold_the_printed_digits(folder: Path, result: dict[str, Any]) -> None:
    lines = (folder / "out" / "result.txt").read_text().splitlines()
    e, n, h = positions(result)["A"]
    assert lines[0] == f"{'A':<4}{e:14.4f}{n:14.4f}{h:10.4f} BM"
    head, first, *_ = (folder / "out" / "result.csv").read_text().splitlines()
    assert head.startswith("point,role,code,easting_m,northing_m,height_m,sigma_easting_mm")
    assert first.startswith(f"A,control,BM,{e:.5f},{n:.5f},{h:.5f},")
    sheet = openpyxl.load_workbook(folder / "out" / "result.xlsx")["points"]
    assert [c.value for c in sheet[1]][3:7] == [
        "easting [m]", "northing [m]", "height [m]", "sigma easting [mm]",
    ]  # fmt: skip
    assert [c.value for c in sheet[2]][:6] == ["A", "control", "BM", e, n, h]


def test_a_result_that_is_exported_later_is_the_same(folder: Path, tmp_path: Path) -> None:
    for format in ("dxf", "gpkg", "csv", "xlsx"):
        out = tmp_path / f"again{FORMATS[format][0]}"
        given = ["--scale", "250"] if format == "dxf" else []
        answer = RUN.invoke(app, ["export", str(folder), "--to", format, "-o", str(out), *given])
        assert answer.exit_code == 0, answer.output
        if format != "gpkg":
            assert out.read_bytes() == (folder / "out" / f"result{out.suffix}").read_bytes()
    own = RUN.invoke(app, ["export", str(folder / "square.toml"), "--to", "csv", "-o",
                           str(tmp_path / "own.csv")])  # fmt: skip
    assert own.exit_code == 0, own.output
    assert (tmp_path / "own.csv").read_text() == (folder / "out" / "result.csv").read_text()


EPOCH = """\
point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm
A,0,0,10,1,1,1
B,50,0,10,1,1,1
C,50,50,11,1,1,1
D,0,50,11,1,1,1
P,25,{n},12,1,1,1
"""


def test_displacements_are_drawn(tmp_path: Path) -> None:
    for name, n in (("a", 25.0), ("b", 25.02)):
        (tmp_path / f"{name}.csv").write_text(EPOCH.format(n=n))
    moved = tmp_path / "moved.json"
    given = ["epochs", str(tmp_path / "a.csv"), str(tmp_path / "b.csv"), "--json", str(moved)]
    answer = RUN.invoke(app, given)
    assert answer.exit_code == 0, answer.output
    result = read_delivery(moved)
    drawing = ezdxf.read(io.StringIO(delivered(result, "dxf").decode()))
    assert not drawing.audit().errors
    layer = next(x.dxf.name for x in drawing.layers if x.dxf.name.startswith("DISPLACEMENTS MOVED"))
    factor = float(layer.rpartition("x")[2])
    (line,) = drawing.query(f'LINE[layer=="{layer}"]')
    shift = next(m.vector for m in result.moves if m.name == "P")
    np.testing.assert_allclose((line.dxf.end - line.dxf.start).xyz, factor * shift, atol=1e-9)
    assert drawing.query("INSERT")[0].dxf.layer.startswith("POINTS STABLE")
    path = tmp_path / "moved.gpkg"
    path.write_bytes(delivered(result, "gpkg"))
    assert pyogrio.read_info(path, layer="displacements")["features"] == 5
    assert b"d_northing_mm" in delivered(result, "csv").splitlines()[0]
    with pytest.raises(InputError, match="displacements"):
        delivered(result, "landxml")


def _lone(name: str = "P", xyz: tuple[float, ...] = (1.0, 2.0, np.nan)) -> Delivery:
    position = DeliveredPosition(name, "free", "%%d ^ '<x>:*", np.array(xyz), np.zeros((3, 3)))
    return Delivery("One\npoint", (position,))


def test_odd_results_open_too() -> None:
    """One point, no height, no sigma, and names that the formats take for something else."""
    for name in ("P", "=1+1", "a;b|c*?", "Ä 'ß'", "%%u"):
        one = _lone(name)
        drawing = ezdxf.read(io.StringIO(delivered(one, "dxf").decode()))
        assert not drawing.audit().errors
        (insert,) = drawing.query("INSERT")
        assert insert.get_attrib_text("NAME") == name.replace("%%", "% %")
        cell = openpyxl.load_workbook(io.BytesIO(delivered(one, "xlsx")))["points"]["A2"]
        assert (cell.value, cell.data_type) == (name, "s")
        delivered(one, "gpkg")
        root = etree.fromstring(delivered(one, "landxml"))
        assert root.xpath("//*[local-name()='CgPoint']/@name") == [name]


@pytest.mark.parametrize(
    ("result", "format", "options", "what"),
    [
        (_lone(), "geojson", None, "no place on the Earth"),
        (_lone(xyz=(np.nan, np.nan, 3.0)), "dxf", None, "no point with a place in plan"),
        (_lone(), "dxf", DeliveryOptions(scale=-1.0), "scale is -1"),
        (_lone(), "list", DeliveryOptions(template="{nothing}"), "has a field 'nothing'"),
        (_lone(), "list", DeliveryOptions(template="{point:f}"), "cannot be filled for P"),
        (_lone(), "list", DeliveryOptions(template="{"), "cannot be filled for P"),
    ],
)  # fmt: skip
def test_what_cannot_be_delivered_is_refused(
    result: Delivery, format: str, options: DeliveryOptions | None, what: str
) -> None:
    with pytest.raises(InputError, match=what):
        delivered(result, format, options)


def test_a_missing_library_is_named_before_any_work(monkeypatch: pytest.MonkeyPatch) -> None:
    found = importlib.util.find_spec
    monkeypatch.setattr(names, "find_spec", lambda n: None if n == "pyogrio" else found(n))
    with pytest.raises(InputError, match=r"install tribrach\[gis\]"):
        delivered(_lone(), "gpkg")


def test_systems_in_feet_have_geometries_in_feet() -> None:
    crs = "EPSG:2249"
    foot = CRS.from_user_input(crs).axis_info[0].unit_conversion_factor
    one = replace(_lone(xyz=(235_000.0, 900_000.0, 10.0)), crs=crs)
    ((longitude, latitude, _),) = one.wgs84()
    own = Transformer.from_crs("EPSG:4326", crs, always_xy=True)
    e, n = own.transform(longitude, latitude)
    assert (e * foot, n * foot) == pytest.approx((235_000.0, 900_000.0), abs=1e-3)
