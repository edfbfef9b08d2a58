"""Models of every format: one house of two elements, read alike; bad ones in a sentence."""

import io
import struct
from pathlib import Path

import ezdxf
import numpy as np
import pytest
import trimesh
from PIL import Image, TiffImagePlugin

from tribrach.errors import InputError
from tribrach.geometry.mesh import Mesh
from tribrach.io.models import by_trimesh
from tribrach.io.models.formats import is_model, read_model
from tribrach.io.scans.units import named_unit

#: a wall of 4 m by 3 m that faces south, and a floor of 4 m by 5 m
WALL = np.array([[[0, 0, 0], [4, 0, 0], [4, 0, 3]], [[0, 0, 0], [4, 0, 3], [0, 0, 3]]], float)
FLOOR = np.array([[[0, 0, 0], [4, 0, 0], [4, 5, 0]], [[0, 0, 0], [4, 5, 0], [0, 5, 0]]], float)
PARTS = {"wall": WALL, "floor": FLOOR}


def scene(unit: float = 1.0) -> trimesh.Scene:
    out = trimesh.Scene()
    for name, corners in PARTS.items():
        mesh = trimesh.Trimesh(
            corners.reshape(-1, 3) * unit, np.arange(6).reshape(2, 3), process=False
        )
        out.add_geometry(mesh, node_name=name, geom_name=name)
    return out


def gltf(path: Path) -> None:
    turned = scene()
    # y up, as the format has it
    upright = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], float)
    for name in PARTS:
        turned.graph.update(name, matrix=upright, geometry=name)
    path.write_bytes(turned.export(file_type="glb"))


def obj(path: Path) -> None:
    lines, count = [], 0
    for name, corners in PARTS.items():
        lines.append(f"o {name}")
        lines += [f"v {x} {y} {z}" for x, y, z in corners.reshape(-1, 3)]
        lines += [f"f {count + k} {count + k + 1} {count + k + 2}" for k in (1, 4)]
        count += 6
    path.write_text("\n".join(lines))


def stl(path: Path) -> None:
    solids = []
    for name, corners in PARTS.items():
        faces = "".join(
            "facet normal 0 0 0\nouter loop\n"
            + "".join("vertex {} {} {}\n".format(*corner) for corner in triangle)
            + "endloop\nendfacet\n"
            for triangle in corners
        )
        solids.append(f"solid {name}\n{faces}endsolid {name}\n")
    path.write_text("".join(solids))


def dxf(path: Path, unit: int = 6, scale: float = 1.0) -> None:
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = unit
    space = document.modelspace()
    for triangle in WALL * scale:
        space.add_3dface(list(triangle), dxfattribs={"layer": "wall"})
    block = document.blocks.new("slab")
    mesh = block.add_mesh(dxfattribs={"layer": "floor"})
    with mesh.edit_data() as data:
        data.vertices = [(0, 0, 0), (4 * scale, 0, 0), (4 * scale, 5 * scale, 0), (0, 5 * scale, 0)]
        data.faces = [(0, 1, 2, 3)]
    space.add_blockref("slab", (0, 0, 0))
    document.saveas(path)


def landxml(path: Path, unit: str = "meter", scale: float = 1.0) -> None:
    surfaces = []
    for name, corners in PARTS.items():
        points = "".join(
            f'<P id="{k}">{y} {x} {z}</P>'
            for k, (x, y, z) in enumerate(corners.reshape(-1, 3) * scale)
        )
        faces = '<F>0 1 2</F><F>3 4 5</F><F i="1">0 1 5</F>'
        surfaces.append(
            f'<Surface name="{name}"><Definition surfType="TIN"><Pnts>{points}</Pnts>'
            f"<Faces>{faces}</Faces></Definition></Surface>"
        )
    path.write_text(
        '<LandXML xmlns="http://www.landxml.org/schema/LandXML-1.2"><Units><Metric '
        f'linearUnit="{unit}"/></Units><Surfaces>{"".join(surfaces)}</Surfaces></LandXML>'
    )


WRITERS = {"a.glb": gltf, "a.obj": obj, "a.stl": stl, "a.dxf": dxf, "a.xml": landxml}


@pytest.mark.parametrize("name", WRITERS)
def test_every_format_gives_the_same_triangles_by_element(tmp_path: Path, name: str) -> None:
    WRITERS[name](tmp_path / name)
    mesh = read_model(tmp_path / name)
    assert sorted(mesh.names) == ["floor", "wall"]
    for part, corners in PARTS.items():
        found = mesh.subset(mesh.element == mesh.names.index(part))
        assert found.triangles == pytest.approx(corners)
    assert mesh.areas.sum() == pytest.approx(4 * 3 + 4 * 5)


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_ply_with_faces_is_a_model_and_without_a_cloud(tmp_path: Path, encoding: str) -> None:
    path, cloud = tmp_path / "a.ply", tmp_path / "b.ply"
    whole = trimesh.Trimesh(WALL.reshape(-1, 3), np.arange(6).reshape(2, 3), process=False)
    path.write_bytes(whole.export(file_type="ply", encoding=encoding))
    assert is_model(path)
    assert read_model(path).triangles == pytest.approx(WALL)
    cloud.write_text(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
        "property float z\nend_header\n0 0 0\n"
    )
    assert not is_model(cloud)


@pytest.mark.parametrize(
    ("write", "name"),
    [
        (lambda path: dxf(path, 4, 1000.0), "a.dxf"),
        (lambda path: dxf(path, 2, 1 / 0.3048), "a.dxf"),
        (lambda path: landxml(path, "millimeter", 1000.0), "a.xml"),
        (lambda path: landxml(path, "USSurveyFoot", 3937 / 1200), "a.xml"),
    ],
)
def test_units_that_files_state_are_metres_inside(tmp_path: Path, write, name: str) -> None:
    write(tmp_path / name)
    mesh = read_model(tmp_path / name)
    assert mesh.corners[1] == pytest.approx([4, 5, 3], abs=1e-9)
    assert mesh.sentences


def test_a_unit_that_is_given_goes_first(tmp_path: Path) -> None:
    obj(tmp_path / "a.obj")
    mesh = read_model(tmp_path / "a.obj", named_unit("cm"))
    assert mesh.corners[1] == pytest.approx([0.04, 0.05, 0.03])


def geotiff(path: Path, heights: np.ndarray, keys: dict[int, int], gap: str = "-9999") -> None:
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    tags[33550] = (2.0, 2.0, 0.0)
    tags.tagtype[33550] = 12
    tags[33922] = (0.0, 0.0, 0.0, 500_000.0, 5_000_000.0, 0.0)
    tags.tagtype[33922] = 12
    tags[34735] = (1, 1, 0, len(keys), *(v for k, c in keys.items() for v in (k, 0, 1, c)))
    tags.tagtype[34735] = 3
    tags[42113] = gap
    tags.tagtype[42113] = 2
    Image.fromarray(heights.astype(np.float32)).save(path, tiffinfo=tags)


@pytest.mark.parametrize(("raster", "first"), [(1, 500_001.0), (2, 500_000.0)])
def test_heights_stand_where_the_file_says(tmp_path: Path, raster: int, first: float) -> None:
    rows, columns = np.mgrid[:4, :5]
    heights = 100 + 0.5 * columns - 0.25 * rows
    heights[3, 4] = -9999
    geotiff(tmp_path / "a.tif", heights, {1024: 1, 1025: raster, 3072: 32632})
    mesh = read_model(tmp_path / "a.tif")
    assert len(mesh) == 2 * (3 * 4 - 1)
    assert mesh.corners[0][:2] == pytest.approx([first, 5_000_000 - (first - 500_000) - 6])
    corner = mesh.triangles.reshape(-1, 3)
    row = (5_000_000 - (first - 500_000) - corner[:, 1]) / 2
    expected = 100 + 0.25 * (corner[:, 0] - first) - 0.25 * row
    assert corner[:, 2] == pytest.approx(expected)
    assert (mesh.normals[:, 2] > 0).all()
    assert "UTM zone 32N" in mesh.crs


def test_wrong_grids(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "a.tif"
    geotiff(path, np.zeros((3, 3)), {1024: 2, 2048: 4326})
    with pytest.raises(InputError, match="degrees"):
        read_model(path)
    Image.fromarray(np.arange(4096, dtype=np.float32).reshape(64, 64)).save(
        path, compression="tiff_lzw"
    )
    data = bytearray(path.read_bytes())
    data[300:320] = bytes(20)
    path.write_bytes(data)
    with pytest.raises(InputError, match="cannot be read"):
        read_model(path)
    assert capfd.readouterr() == ("", "")
    Image.new("RGB", (3, 3)).save(path)
    with pytest.raises(InputError, match="colours"):
        read_model(path)
    Image.fromarray(np.zeros((3, 3), np.float32)).save(path)
    with pytest.raises(InputError, match="cannot be read"):
        read_model(path)
    path.write_bytes(path.read_bytes()[:60])
    with pytest.raises(InputError, match="cannot be read"):
        read_model(path)


def test_faces_of_a_box_are_elements(tmp_path: Path) -> None:
    box = trimesh.creation.box((2, 3, 4))
    mesh = Mesh.of([("box", np.asarray(box.triangles))])
    faces = mesh.by_faces()
    assert faces.names == tuple(f"box/{k}" for k in range(1, 7))
    areas = [faces.areas[faces.element == k].sum() for k in range(6)]
    assert sorted(areas) == pytest.approx([6, 6, 8, 8, 12, 12])
    for k in range(6):
        assert np.ptp(faces.normals[faces.element == k], axis=0) == pytest.approx(np.zeros(3))


def test_triangles_without_area_are_left_out_with_a_word(tmp_path: Path) -> None:
    path = tmp_path / "a.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nf 1 2 3\nf 1 2 4\nf 1 1 2\n")
    mesh = read_model(path)
    assert len(mesh) == 1
    assert next(s for s in mesh.sentences if "no area" in s).values["count"] == 2


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("a.glb", b"glTF" + struct.pack("<II", 2, 12), "cannot be read"),
        ("a.gltf", b'{"asset": {"version": "2.0"}, "buffers": [{"uri": "../x.bin"}]}', "model"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement face 3\nend_header\n", "model"),
        ("a.dxf", b"0\nSECTION\n2\nENTITIES\n0\nENDSEC\n0\nEOF\n", "no triangles"),
        ("a.dxf", b"no drawing", "drawing cannot be read"),
        ("a.xml", b"<LandXML><Surfaces/></LandXML>", "no triangles"),
        ("a.xml", b"<LandXML><Surface><P id='1'>1 2</P></Surface></LandXML>", "no point and no"),
        ("a.xml", b"<LandXML><Surface><F>1 2 3</F></Surface></LandXML>", "no point and no"),
        ("a.obj", b"v 0 0 0\nv 1e9 0 0\nv 0 1e9 0\nf 1 2 3\n", "m large"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", "has an area"),
    ],
)
def test_wrong_models(tmp_path: Path, name: str, data: bytes, words: str) -> None:
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=words):
        read_model(tmp_path / name)


def test_what_is_not_installed_is_named(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(by_trimesh, "find_spec", lambda name: None)
    (tmp_path / "a.glb").write_bytes(io.BytesIO(b"glTF").getvalue())
    with pytest.raises(InputError, match="trimesh") as error:
        read_model(tmp_path / "a.glb")
    assert "tribrach[models]" in str(error.value)


def test_sides_of_closed_bodies_and_of_terrain_are_known() -> None:
    box = np.asarray(trimesh.creation.box((2, 3, 4)).triangles)
    other = box[:, ::-1] + [10, 0, 0]
    mesh = Mesh.of([("a", box), ("b", other)])
    turned, known = mesh.outwards()
    assert known
    middle = np.where(mesh.element[:, None] == 0, [[0, 0, 0]], [[10, 0, 0]])
    assert (np.einsum("ni,ni->n", turned.normals, turned.triangles[:, 0] - middle) > 0).all()
    sheet, known = Mesh.of([("floor", FLOOR[:, ::-1])]).outwards()
    assert known
    assert (sheet.normals[:, 2] > 0).all()
    # an open box, and one with a triangle that is wound the other way
    assert not Mesh.of([("a", box[:-1])]).outwards()[1]
    wrong = box.copy()
    wrong[0] = wrong[0, ::-1]
    assert not Mesh.of([("a", wrong)]).outwards()[1]
