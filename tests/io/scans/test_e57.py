"""E57 in: files written by libE57 here, with every kind of column, and files of other programs."""

import tempfile
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pye57
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pye57 import libe57
from scipy.spatial.transform import Rotation

from tribrach.errors import InputError
from tribrach.io.e57_pages import PAGE, PAYLOAD, paged, read_header, read_xml
from tribrach.io.scans.e57 import read
from tribrach.scan.scan import CHUNK, Chunk, Scan

NORMALS = "http://www.libe57.org/E57_NOR_surface_normals.txt"
ENDS = ("Minimum", "Maximum")
LAS = "http://www.astm.org/COMMIT/E57/2010-las-v1.0"


def node(image: Any, value: Any) -> Any:
    """A tree of nodes of numbers, strings and mappings."""
    if isinstance(value, Mapping):
        out = libe57.StructureNode(image)
        for name, part in value.items():
            out.set(name, node(image, part))
        return out
    if isinstance(value, str):
        return libe57.StringNode(image, value)
    kind = libe57.IntegerNode if isinstance(value, int) else libe57.FloatNode
    return kind(image, value)


def column(image: Any, kind: str) -> Any:
    """A prototype: ``double``, ``single``, ``0..255``, ``0..255*0.5+10``."""
    if kind == "double":
        return libe57.FloatNode(image, 0.0)
    if kind == "single":
        limits = libe57.E57_FLOAT_MIN, libe57.E57_FLOAT_MAX
        return libe57.FloatNode(image, 0.0, libe57.E57_SINGLE, *limits)
    limits_, _, rest = kind.partition("*")
    low, high = (int(v) for v in limits_.split(".."))
    if not rest:
        return libe57.IntegerNode(image, low, low, high)
    scale, offset = (float(v) for v in rest.split("+"))
    return libe57.ScaledIntegerNode(image, low, low, high, scale, offset)


Columns = Mapping[str, tuple[str, np.ndarray]]


def write(path: Path, scans: Sequence[tuple[Mapping[str, Any], Columns]], crs: str = "") -> None:
    """A file of scans, each of header entries and of columns by name: kind and values."""
    image = libe57.ImageFile(str(path), "w")
    image.extensionsAdd("", libe57.E57_V1_0_URI)
    image.extensionsAdd("nor", NORMALS)
    image.extensionsAdd("las", LAS)
    root, vector = image.root(), libe57.VectorNode(image, True)
    root.set("guid", libe57.StringNode(image, "file"))
    root.set("coordinateMetadata", libe57.StringNode(image, crs))
    root.set("data3D", vector)
    for entries, columns in scans:
        scan = libe57.StructureNode(image)
        vector.append(scan)
        for name, value in entries.items():
            scan.set(name, node(image, value))
        prototype, buffers = libe57.StructureNode(image), libe57.VectorSourceDestBuffer()
        held = []
        for name, (kind, values) in columns.items():
            prototype.set(name, column(image, kind))
            whole = kind not in ("double", "single")
            held.append(np.empty(len(values), dtype="q" if whole else "d"))
            held[-1][:] = values
            size = max(len(held[-1]), 1)
            buffers.append(libe57.SourceDestBuffer(image, name, held[-1], size, True, False))
        codecs = libe57.VectorNode(image, True)
        points = libe57.CompressedVectorNode(image, prototype, codecs)
        scan.set("points", points)
        writer = points.writer(buffers)
        if len(held[0]):
            writer.write(len(held[0]))
        writer.close()
    image.close()


def xyz(n: int, kind: str = "double", seed: int = 0) -> Columns:
    rng = np.random.default_rng(seed)
    return {f"cartesian{a}": (kind, rng.uniform(-9, 9, n)) for a in "XYZ"}


def whole(scan: Scan, size: int = 70) -> Chunk:
    chunks = list(scan.chunks(size))
    assert all(len(c) + c.dropped <= size for c in chunks)
    names = chunks[0].values
    return Chunk(
        np.concatenate([c.xyz for c in chunks]),
        {k: np.concatenate([c.values[k] for c in chunks]) for k in names},
        sum(c.dropped for c in chunks),
    )


def table(columns: Columns) -> np.ndarray:
    return np.stack([columns[f"cartesian{a}"][1] for a in "XYZ"], axis=1)


def test_several_scans_with_names_poses_and_crs(tmp_path: Path) -> None:
    path = tmp_path / "site.e57"
    x, y, z, w = Rotation.from_euler("z", 30, degrees=True).as_quat()
    turn = {"w": 2 * w, "x": 2 * x, "y": 2 * y, "z": 2 * z}
    entries = [
        {"name": "hall", "guid": "{1}", "sensorModel": "Z+F", "temperature": 21.5},
        {"name": "hall", "pose": {"rotation": turn, "translation": {"x": 4e5, "y": 5e6, "z": 9.0}}},
        {"pose": {"translation": {"x": 1.0, "y": 2.0, "z": 3.0}}},
        {"name": "  ", "pose": {"rotation": {"w": w, "x": x, "y": y, "z": z}}},
        {"pose": {"rotation": {"w": 0.0, "x": 0.0, "y": 0.0, "z": 0.0}}},
    ]
    columns = [xyz(100 + k, seed=k) for k in range(5)]
    write(path, list(zip(entries, columns, strict=True)), crs="EPSG:25832")
    scans = read(path)
    assert [s.name for s in scans] == ["hall", "hall-2", "site-3", "site-4", "site-5"]
    assert [s.index for s in scans] == [0, 1, 2, 3, 4]
    for scan, truth in zip(scans, columns, strict=True):
        assert (whole(scan).xyz == table(truth)).all()
        assert scan.crs is not None
        assert "ETRS89" in scan.crs
        assert scan.origin == "stated"
    assert scans[0].pose is None
    assert scans[0].warnings == ()
    assert scans[0].facts["sensor model"] == "Z+F"
    assert scans[0].facts["temperature [C]"] == "21.5"
    poses = [s.pose for s in scans[1:]]
    assert all(p is not None for p in poses)
    by_hand = np.array([[np.sqrt(0.75), -0.5, 0], [0.5, np.sqrt(0.75), 0], [0, 0, 1]])
    for k, rotation, translation in (
        (0, by_hand, [4e5, 5e6, 9]),
        (1, np.eye(3), [1, 2, 3]),
        (2, by_hand, [0, 0, 0]),
        (3, np.eye(3), [0, 0, 0]),
    ):
        assert poses[k].rotation == pytest.approx(rotation, abs=1e-15)
        assert (poses[k].translation == translation).all()
    said = [" ".join(s.warnings) for s in scans[1:]]
    assert "another scan has the name 'hall'" in said[0]
    assert "length 2.0000" in said[0]
    assert "no rotation" in said[1]
    assert "no translation" in said[2]
    assert "quaternion of the pose is zero" in said[3]
    assert "no translation" in said[3]


def test_columns_become_fields(tmp_path: Path) -> None:
    path, n = tmp_path / "a.e57", 200
    rng = np.random.default_rng(1)
    rows, columns = np.divmod(np.arange(n), 20)
    bad = rng.integers(0, 2, n)
    truth: Columns = {
        **xyz(n, "single"),
        "intensity": ("0..2047*0.5+10", rng.integers(0, 2048, n)),
        "isIntensityInvalid": ("0..1", bad),
        "colorRed": ("0..255", rng.integers(0, 256, n)),
        "colorGreen": ("0..65535", rng.integers(0, 65536, n)),
        "colorBlue": ("0..1023", rng.integers(0, 1024, n)),
        "timeStamp": ("double", rng.uniform(0, 1e9, n)),
        "returnIndex": ("0..3", rng.integers(0, 4, n)),
        "returnCount": ("1..4", np.full(n, 4)),
        "rowIndex": ("0..70000", rows + 60_000),
        "columnIndex": ("0..70", columns),
        "nor:normalX": ("single", rng.uniform(-1, 1, n)),
        "nor:normalY": ("single", rng.uniform(-1, 1, n)),
        "nor:normalZ": ("single", rng.uniform(-1, 1, n)),
        "las:pointSourceId": ("0..65535", rng.integers(0, 65536, n)),
        "amplitude": ("-5000..5000*0.01+0", rng.integers(-5000, 5001, n)),
        "counter": (f"{-(2**40)}..{2**40}", rng.integers(-(2**40), 2**40, n)),
    }
    bounds = {"rowMinimum": 60_000, "rowMaximum": 60_009, "columnMinimum": 0, "columnMaximum": 19}
    limits = {"intensityMinimum": 0.0, "intensityMaximum": 1000.0}
    write(path, [({"indexBounds": bounds, "intensityLimits": limits}, truth)])
    (scan,) = read(path)
    got = whole(scan)
    raw = {name: values for name, (_, values) in truth.items()}
    want = {
        "intensity": np.where(bad == 1, 0, raw["intensity"] * 0.5 + 10).astype(np.float32),
        "isIntensityInvalid": bad.astype(np.uint8),
        "red": (raw["colorRed"] * 257).astype(np.uint16),
        "green": raw["colorGreen"].astype(np.uint16),
        "blue": np.rint(raw["colorBlue"] * (65535 / 1023)).astype(np.uint16),
        "time": raw["timeStamp"],
        "return_number": (raw["returnIndex"] + 1).astype(np.uint8),
        "number_of_returns": raw["returnCount"].astype(np.uint8),
        "row": (rows + 60_000).astype(np.int32),
        "column": columns.astype(np.int32),
        **{f"normal_{a}": raw[f"nor:normal{a.upper()}"].astype(np.float32) for a in "xyz"},
        "pointSourceId": raw["las:pointSourceId"].astype(np.uint16),
        "counter": raw["counter"],
    }
    assert set(got.values) == {*want, "amplitude"} == set(scan.names)
    for name, values in want.items():
        assert got.values[name].dtype == values.dtype, name
        assert (got.values[name] == values).all(), name
    assert got.values["amplitude"] == pytest.approx(raw["amplitude"] * 0.01, abs=1e-12)
    assert {f.name: f.dtype for f in scan.fields} == {k: v.dtype for k, v in got.values.items()}
    by_name = {f.name: f for f in scan.fields}
    assert (by_name["intensity"].low, by_name["intensity"].high) == (0.0, 1000.0)
    assert (by_name["red"].low, by_name["red"].high) == (0.0, 65535.0)
    assert scan.grid == (10, 20)


def test_stated_colour_limits_go_before_the_column(tmp_path: Path) -> None:
    path, red = tmp_path / "a.e57", np.array([0, 100, 255, 300])
    columns = xyz(4) | {"colorRed": ("0..65535", red), "colorBlue": ("double", red / 300)}
    names = ("Red", 0.0, 255.0), ("Blue", 0.0, 1.0)
    limits = {f"color{c}{e}": v for c, *r in names for e, v in zip(ENDS, r, strict=True)}
    write(path, [({"colorLimits": limits}, columns)])
    values = whole(read(path)[0]).values
    assert values["red"].tolist() == [0, 25_700, 65_535, 65_535]
    assert values["blue"].tolist() == np.rint(65535 * red / 300).tolist()


def test_range_azimuth_and_elevation(tmp_path: Path) -> None:
    """Azimuth from x towards y, elevation from the xy plane upwards."""
    path = tmp_path / "a.e57"
    r, azimuth = np.array([2.0, 2, 2, 2, 5]), np.radians([0, 90, 180, -90, 30])
    elevation = np.radians([0, 0, 60, -90, 0])
    names = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
    columns = {k: ("double", v) for k, v in zip(names, (r, azimuth, elevation), strict=True)}
    columns["sphericalInvalidState"] = ("0..2", np.array([0, 0, 0, 0, 1]))
    write(path, [({}, columns)])
    got = whole(read(path)[0])
    want = [[2, 0, 0], [0, 2, 0], [-1, 0, np.sqrt(3)], [0, 0, -2]]
    assert got.xyz == pytest.approx(np.array(want), abs=1e-12)
    assert got.dropped == 1


@pytest.mark.parametrize("size", [1, 64, 100, 1000])
def test_records_without_a_point_are_dropped_and_counted(tmp_path: Path, size: int) -> None:
    path, n = tmp_path / "a.e57", 500
    columns = dict(xyz(n))
    columns["cartesianX"][1][7], columns["cartesianY"][1][8] = np.nan, -np.inf
    state = np.random.default_rng(3).integers(0, 3, n)
    columns |= {"cartesianInvalidState": ("0..2", state), "k": ("0..499", np.arange(n))}
    write(path, [({}, columns)])
    got = whole(read(path)[0], size)
    valid = (state == 0) & np.isfinite(table(columns)).all(axis=1)
    assert (got.xyz == table(columns)[valid]).all()
    assert (got.values["k"] == np.flatnonzero(valid)).all()
    assert got.dropped == n - valid.sum()


def test_zeros_are_no_points_in_a_grid_without_marks(tmp_path: Path) -> None:
    columns = dict(xyz(6))
    for axis in "XYZ":
        columns[f"cartesian{axis}"][1][2:4] = 0
    grid = {"rowIndex": ("0..1", [0, 0, 0, 1, 1, 1]), "columnIndex": ("0..2", [0, 1, 2, 0, 1, 2])}
    bounds = {"rowMinimum": 0, "rowMaximum": 1, "columnMinimum": 0, "columnMaximum": 2}
    write(tmp_path / "a.e57", [({"indexBounds": bounds}, columns | grid), ({}, columns)])
    with_grid, without = (whole(s) for s in read(tmp_path / "a.e57"))
    assert (len(with_grid), with_grid.dropped) == (4, 2)
    assert (len(without), without.dropped) == (6, 0)


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 130), st.integers(0, 320))
def test_reading_goes_on_where_it_stopped(size: int, start: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path, columns = Path(folder) / "a.e57", xyz(300, "-2000000..2000000*1e-5+0.5")
        columns = {k: (kind, np.rint(v * 1e5)) for k, (kind, v) in columns.items()}
        write(path, [({}, columns)])
        chunks = list(read(path)[0].chunks(size, start))
        got = np.concatenate([np.empty((0, 3)), *(c.xyz for c in chunks)])
        assert got == pytest.approx(0.5 + 1e-5 * table(columns)[start:], abs=1e-12)
        assert all(0 < len(c) <= size for c in chunks)


def bounds_of(points: np.ndarray) -> dict[str, float]:
    ends = (("Minimum", points.min(axis=0)), ("Maximum", points.max(axis=0)))
    return {f"{a}{name}": float(v) for name, row in ends for a, v in zip("xyz", row, strict=True)}


def test_where_the_scanner_stood(tmp_path: Path) -> None:
    """Scanner frame is the rule; placed points and placed bounds are told from it."""
    path, local = tmp_path / "a.e57", dict(xyz(50))
    t = np.array([500.0, 400.0, 30.0])
    placed = {k: (kind, v + t[i]) for i, (k, (kind, v)) in enumerate(local.items())}
    pose = {"translation": dict(zip("xyz", t.tolist(), strict=True)),
            "rotation": {"w": 1.0, "x": 0.0, "y": 0.0, "z": 0.0}}  # fmt: skip
    near, far = bounds_of(table(local)), bounds_of(table(placed))
    scans = [
        ({"cartesianBounds": near, "pose": pose}, local),
        ({"cartesianBounds": far}, placed),
        ({"cartesianBounds": far, "pose": pose}, placed),
        ({"cartesianBounds": far, "pose": pose}, local),
    ]
    write(path, scans)
    good, world, twice, odd = read(path)
    assert (good.origin, good.warnings) == ("stated", ())
    assert good.bounds == pytest.approx(np.stack([table(local).min(0), table(local).max(0)]))
    assert world.origin == "unknown"
    assert "far from (0, 0, 0)" in world.warnings[0]
    assert twice.origin == "unknown"
    assert "placed already" in twice.warnings[0]
    assert (odd.origin, odd.bounds) == ("stated", None)
    assert "not those of the points" in odd.warnings[0]


def changed(path: Path, old: bytes, new: bytes) -> None:
    """Replace text of the XML and mend the checksums."""
    with path.open("rb") as file:
        header = read_header(file, path)
        text = read_xml(file, header, path)
    assert old in text
    data = path.read_bytes()
    logical = b"".join(data[k : k + PAYLOAD] for k in range(0, len(data), PAGE))
    text = text.replace(old, new)
    body = logical[: header.xml_start] + text
    pages = -(-len(body) // PAYLOAD)
    head = type(header)(header.version, pages * PAGE, header.xml_offset, len(text)).to_bytes()
    path.write_bytes(paged(head + body[48:]))


@pytest.mark.parametrize(
    ("new", "said"),
    [
        (b'recordCount="1000000000000000"', "states 1000000000000000 points and the file holds"),
        (b'recordCount="-5"', "states '-5' points"),
        (b'recordCount="99999999999999999999"', "points"),
        (b'recordCount="many"', "states 'many' points"),
    ],
)
def test_counts_are_not_trusted(tmp_path: Path, new: bytes, said: str) -> None:
    path = tmp_path / "a.e57"
    write(path, [({}, xyz(1234))])
    changed(path, b'recordCount="1234"', new)
    with pytest.raises(InputError, match=said):
        list(read(path)[0].chunks(100))


def test_points_without_coordinates_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.e57"
    write(
        path, [({}, {"cartesianX": ("double", np.ones(3)), "cartesianY": ("double", np.ones(3))})]
    )
    with pytest.raises(InputError, match="no coordinates"):
        read(path)


def test_files_without_scans(tmp_path: Path) -> None:
    path = tmp_path / "a.e57"
    write(path, [])
    with pytest.raises(InputError, match="holds no scan"):
        read(path)
    for data, said in ((b"", "is empty"), (b"x" * 3000, "no E57 file"), (b"ASTM-E57", "no E57")):
        path.write_bytes(data)
        with pytest.raises(InputError, match=said):
            read(path)
    with pytest.raises(InputError, match="cannot be read"):
        read(tmp_path / "none.e57")


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**31), st.integers(0, 255), st.booleans(), st.sampled_from([100, CHUNK]))
def test_damage_is_a_sentence(where: int, value: int, cut: bool, size: int) -> None:
    """Any byte that is another, or is missing with all behind it, whoever checks the pages."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.e57"
        write(path, [({"name": "S"}, xyz(300))])
        data = bytearray(path.read_bytes())
        where %= len(data)
        if cut:
            data = data[:where]
        else:
            data[where] = (data[where] + 1 + value % 255) % 256
        path.write_bytes(data)
        with pytest.raises(InputError):
            sum(len(c) for s in read(path) for c in s.chunks(size))


def test_a_damaged_scan_is_refused_before_its_first_point(tmp_path: Path) -> None:
    """Even in its last page; who only looks at the beginning is told nothing of it."""
    path = tmp_path / "a.e57"
    write(path, [({"name": "S"}, xyz(200_000))])
    with path.open("rb") as file:
        last = read_header(file, path).xml_offset // PAGE - 1
    data = bytearray(path.read_bytes())
    data[last * PAGE + 500] ^= 1
    path.write_bytes(data)
    (scan,) = read(path)
    with pytest.raises(InputError, match=f"the checksum of page {last} is wrong"):
        next(scan.chunks())
    assert len(next(scan.chunks(1000))) == 1000


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_nonsense_with_right_checksums_is_a_sentence_or_read(data: st.DataObject) -> None:
    """Damage before the checksums were made: no traceback, no more points than stated."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.e57"
        write(path, [({"name": "S"}, xyz(100))])
        raw = path.read_bytes()
        logical = bytearray(b"".join(raw[k : k + PAYLOAD] for k in range(0, len(raw), PAGE)))
        for _ in range(data.draw(st.integers(1, 4))):
            logical[data.draw(st.integers(48, len(logical) - 1))] = data.draw(st.integers(0, 255))
        path.write_bytes(paged(bytes(logical)))
        with suppress(InputError):
            for scan in read(path):
                count = sum(len(c) + c.dropped for c in scan.chunks(64))
                assert count == scan.records


@pytest.mark.data
def test_the_slope_is_the_same_in_every_file(shared_data: Path) -> None:
    folder = shared_data / "scans" / "formats" / "slope"
    truth = np.loadtxt(folder / "XYZ_RGB_Intensity.txt", usecols=(0, 1, 2), skiprows=2)
    for name in ("XYZ_Intensity.e57", "XYZ_RGB_Normals_Intensity.e57"):
        (scan,) = read(folder / name)
        got = whole(scan, 10_000)
        assert got.xyz.shape == (54_202, 3)
        assert np.abs(np.sort(got.xyz, axis=0) - np.sort(truth, axis=0)).max() < 1e-3
        assert scan.origin == "unknown"
    assert np.linalg.norm([got.values[f"normal_{a}"] for a in "xyz"], axis=0).mean() > 0.99


@pytest.mark.data
def test_pump_against_pye57(shared_data: Path) -> None:
    path = shared_data / "scans" / "e57" / "pump.e57"
    (scan,) = read(path)
    got = whole(scan, 40_000)
    file = pye57.E57(str(path))
    truth = file.read_scan_raw(0)
    file.close()
    assert (scan.grid, scan.pose, scan.name) == ((1074, 345), None, "pumpA")
    assert len(got.xyz) == 155_201
    for k, axis in enumerate("XYZ"):
        assert (got.xyz[:, k] == truth[f"cartesian{axis}"]).all()
    assert (got.values["red"] == truth["colorRed"].astype(int) * 257).all()
    assert (got.values["row"] == truth["rowIndex"]).all()
    assert (got.values["intensity"] == truth["intensity"]).all()


@pytest.mark.data
def test_edge_cases_end_right_or_with_a_sentence(shared_data: Path) -> None:
    folder = shared_data / "scans" / "formats" / "e57_edge"
    counts = {
        "ColourRepresentation": 153,
        "ColouredCubeDouble": 7680,
        "ColouredCubeFloat": 7680,
        "bunnyDouble": 30_571,
        "bunnyFloat": 30_571,
        "bunnyInt19": 30_571,
        "bunnyInt21": 30_571,
        "bunnyInt24": 30_571,
        "bunnyInt32": 30_571,
        "cartesian_invalid_state_single": 1,
        "empty_pc": 0,
        "float_intensity_without_min_max": 1,
        "integer_intensity": 2,
        "las2e57_no_images_tag": 153,
        "no_ext_namespace": 1,
        "original_guids": 1,
        "read_error": 2651,
        "scaled_integer_intensity": 2,
        "tinyCartesianFloatRgb": 2090,
        "tiny_pc_and_images": 2,
        "tiny_pc_with_extension": 1,
        "tiny_spherical": 180,
        "InvalidCVHeader": 0,
        "ZeroPoints": 0,
        "ZeroPointsInvalid": 0,
    }
    sentences = {
        "PinholeImageWithDistortionParameters": "holds no scan but 3 images",
        "bad-crc": "checksum of page 0 is wrong",
        "corrupt_crc": "checksum of page 33 is wrong",
        "empty": "holds no scan",
        "test filename äöü": "holds no scan",
        "测试点云": "holds no scan",
    }
    assert {p.stem for p in folder.glob("*.e57")} == {*counts, *sentences}
    for name, count in counts.items():
        assert sum(len(c) for c in read(folder / f"{name}.e57")[0].chunks()) == count
    for name, said in sentences.items():
        with pytest.raises(InputError, match=said):
            read(folder / f"{name}.e57")


@pytest.mark.data
def test_several_scans_of_other_programs(shared_data: Path) -> None:
    folder = shared_data / "scans" / "formats" / "pdal_tiny"
    counts = {"A4": [4], "A4_moved": [4], "A_B": [2, 4], "A_B_different_dims": [1, 1]}
    counts |= {"A_merged_B": [6], "A_moved_B": [2, 4], "B2": [2]}
    for name, want in counts.items():
        scans = read(folder / f"{name}.e57")
        assert [len(whole(s)) for s in scans] == want, name
        assert len({s.name for s in scans}) == len(scans)
    a, b = read(folder / "A_B_different_dims.e57")
    assert (a.names, b.names) == (("intensity",), ("red", "green", "blue"))
    (scan,) = read(shared_data / "scans" / "e57" / "translationWithoutRotation.e57")
    assert scan.pose is not None
    assert scan.pose.translation.tolist() == [4, 5, 6]
    assert (scan.pose.rotation == np.eye(3)).all()
    assert "no rotation" in scan.warnings[0]
