"""Clouds of one run in other programs: every sigma under its name, every fact read back."""

from pathlib import Path

import laspy
import numpy as np
import pye57
import pytest
from laspy.copc import CopcReader
from pye57 import libe57

from tests.job.cloud_jobs import NOISE, UTM, made, opened, placed, projected
from tests.job.test_clouds import in_a_room
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.scans.facts import told_facts
from tribrach.io.scans.formats import read_scans
from tribrach.io.scans.info import describe
from tribrach.scan.scan import Field

SIGMAS = ("sigma_x", "sigma_y", "sigma_z", "sigma")
ADDED = (*SIGMAS, "incidence")


@pytest.fixture(scope="module")
def clouds(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A cloud in every format, from a LAZ scan of a room."""
    folder = tmp_path_factory.mktemp("run")
    in_a_room(folder / "S1.laz")
    scans = opened(folder / "S1.laz")
    places = placed(scans)
    out = {}
    for kind in ("las", "laz", "copc", "ply", "e57"):
        wish = {"format": kind, "incidence": True}
        (product,) = made(scans, places, projected(), folder / kind, **wish)
        out[kind] = product.path
    return out


def las_sigmas(path: Path) -> dict[str, np.ndarray]:
    las = laspy.read(path)
    return {name: np.asarray(las[name]) for name in ADDED}


def ply_sigmas(path: Path) -> dict[str, np.ndarray]:
    """By the header alone, as a program does that knows nothing of us."""
    data = path.read_bytes()
    head, body = data.split(b"end_header\n", 1)
    kinds = {"double": "<f8", "float": "<f4", "ushort": "<u2", "uchar": "u1", "short": "<i2"}
    rows = [line.split() for line in head.decode("ascii").splitlines()]
    types = [(row[2], kinds[row[1]]) for row in rows if row[0] == "property"]
    table = np.frombuffer(body, dtype=types)
    # CloudCompare takes properties for scalar fields that begin so, and drops the beginning
    return {name: table[f"scalar_{name}"] for name in ADDED}


def e57_sigmas(path: Path) -> dict[str, np.ndarray]:
    """By libE57 itself."""
    image = libe57.ImageFile(str(path), "r")
    points = image.root()["data3D"][0]["points"]
    count = points.childCount()
    out = {name: np.empty(count, dtype=np.float32) for name in ADDED}
    buffers = libe57.VectorSourceDestBuffer()
    for name, array in out.items():
        buffers.append(libe57.SourceDestBuffer(image, f"trb:{name}", array, count, True, True))
    assert points.reader(buffers).read() == count
    return out


def test_sigmas_are_there_under_their_names(clouds: dict[str, Path]) -> None:
    tables = {kind: las_sigmas(clouds[kind]) for kind in ("las", "laz", "copc")}
    tables["ply"] = ply_sigmas(clouds["ply"])
    for name in ADDED:
        expected = np.sort(tables["las"][name])
        assert expected.max() > 0
        for kind, table in tables.items():
            assert np.array_equal(np.sort(table[name]), expected), (kind, name)
    # E57 is in the axes of the scanner with a pose; its sigmas are along those of the frame too
    e57 = e57_sigmas(clouds["e57"])
    for name in ADDED:
        assert np.array_equal(np.sort(e57[name]), np.sort(tables["las"][name])), name
    for table in (*tables.values(), e57):
        three = np.sqrt(sum(table[name].astype(float) ** 2 for name in SIGMAS[:3]))
        assert table["sigma"] == pytest.approx(three, rel=1e-3)
        assert table["incidence"].min() >= 0
        assert 50 < table["incidence"].max() <= 90


def test_e57_by_pye57(clouds: dict[str, Path]) -> None:
    """Also raw; nothing of LAS is in it."""
    file = pye57.E57(str(clouds["e57"]))
    points = laspy.read(clouds["las"])
    raw = file.read_scan_raw(0, ignore_unsupported_fields=True)
    assert len(raw["cartesianX"]) == len(points)
    placed_points = file.read_scan(0, intensity=True, ignore_missing_fields=True)
    xyz = np.column_stack([placed_points[f"cartesian{a}"] for a in "XYZ"])
    # the pose is rigid and the projection has a scale of 0.4 per mille
    assert np.abs(np.sort(xyz, axis=0) - np.sort(points.xyz, axis=0)).max() < 0.01
    fields = set(file.get_header(0).point_fields)
    axes = {f"cartesian{a}" for a in "XYZ"}
    assert fields == {*axes, "intensity", "trb:classification", *(f"trb:{n}" for n in ADDED)} | (
        fields & {"returnIndex", "returnCount", "timeStamp"}
    )


def test_copc_by_laspy(clouds: dict[str, Path]) -> None:
    with CopcReader.open(clouds["copc"]) as reader:
        found = reader.query()
        assert set(ADDED) <= set(found.point_format.extra_dimension_names)
        assert len(found) == len(laspy.read(clouds["las"]))


@pytest.mark.parametrize("kind", ["las", "laz", "copc"])
def test_las_says_its_reference_system_and_its_station(clouds: dict[str, Path], kind: str) -> None:
    with laspy.open(clouds[kind]) as file:
        assert file.header.global_encoding.wkt
        (record,) = file.header.vlrs.get("WktCoordinateSystemVlr")
        assert record.string.startswith("PROJCS[")
        assert file.header.parse_crs().to_epsg() == int(UTM.split(":")[1])
        points = file.read()
    assert (points.point_source_id == 1).all()
    extra = {d.name: d.description for d in points.point_format.extra_dimensions}
    assert extra["incidence"] == "incidence angle [deg]"
    assert extra["sigma"] == "3D sigma [m]"


def test_stations_are_numbered_by_the_file_of_poses(tmp_path: Path) -> None:
    for name in ("S1", "S2"):
        in_a_room(tmp_path / f"{name}.las", seed=int(name[1]))
    scans = opened(tmp_path / "S1.las", tmp_path / "S2.las")
    places = placed(scans)
    (merged,) = made(scans, places, projected(), tmp_path / "m", format="las", merged=True)
    points = laspy.read(merged.path)
    assert np.array_equal(points.point_source_id, np.asarray(points["station"]) + 1)
    single = made(scans, places, projected(), tmp_path / "s", format="laz")
    assert [set(laspy.read(p.path).point_source_id) for p in single] == [{1}, {2}]
    (scan,) = read_scans(merged.path)
    assert scan.facts["point_source_id"] == f"1 {scans[0].station}; 2 {scans[1].station}"
    assert "world from scanner" not in scan.facts


@pytest.mark.parametrize("kind", ["las", "laz", "copc", "ply", "e57"])
def test_info_reads_the_facts_back(clouds: dict[str, Path], kind: str) -> None:
    (scan,) = read_scans(clouds[kind])
    found = describe(scan)
    rows = dict(found.rows())
    assert rows["frame"] == "projected"
    assert rows["axes"] == "e, n, h"
    assert rows["station"] == "S1 S1"
    assert rows["sigmas"] == f"pose of the station (a priori); {NOISE.words}"
    assert 'ranges 1.2 mm + 10 ppm, angles 8.25" and 8.25"' in rows["sigmas"]
    matrix = np.array([row.split() for row in rows["world from scanner"].split(";")], dtype=float)
    assert matrix.shape == (3, 4)
    assert matrix[:, :3] @ matrix[:, :3].T == pytest.approx(np.eye(3), abs=1e-7)
    low, high = found.figures.bounds if found.figures.bounds is not None else (0, 0)
    if kind != "e57":
        assert (matrix[:, 3] > low).all()
        assert (matrix[:, 3] < high).all()
    assert set(ADDED) <= set(scan.names)
    assert "incidence angle [deg]" in rows["field incidence"]
    assert "32648" in rows["CRS"]
    assert not any("uncertainty" in sentence for sentence in found.sentences)


def test_facts_that_are_none_are_no_harm(tmp_path: Path) -> None:
    """A record of the same name with anything in it; points without sigmas are warned of."""
    for text in (b"", b"[1]", b"\xff\xfe", b"{" * 100_000, b'{"a": {"b": 1}, "c": null}', b"1e999"):
        assert told_facts(text) == {}
    assert told_facts('{"epoch": 2020.5, "intensity": [0, 1.5]}') == {
        "epoch": "2020.5",
        "intensity": "0 to 1.5",
    }
    path = tmp_path / "a.las"
    with create(path, CloudHeader("a", (Field("intensity", "float32"),))) as writer:
        writer.write(np.random.default_rng(1).uniform(500, 510, (100, 3)), {})
    (scan,) = read_scans(path)
    assert any("no uncertainty" in sentence for sentence in describe(scan).sentences)
