"""Copies with other poses: pye57 reads them, every byte before the XML is the source's."""

import re
import zlib
from pathlib import Path

import numpy as np
import pye57
import pytest
from lxml import etree
from pye57 import libe57
from scipy.spatial.transform import Rotation

from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.clouds.e57 import copy_with_poses
from tribrach.io.e57_pages import PAGE, PAYLOAD, paged, parse, read_header, read_xml
from tribrach.io.scans.e57 import pose_of, read


def pose(seed: int) -> Pose:
    rng = np.random.default_rng(seed)
    return Pose(
        Rotation.random(rng=rng).as_matrix(),
        np.array([590_000.0, 2_331_000.0, 10.0]) + rng.uniform(-100, 100, 3),
    )


def write(path: Path, scans: int = 2, points: int = 3000) -> None:
    """A file by pye57."""
    rng = np.random.default_rng(0)
    file = pye57.E57(str(path), mode="w")
    for k in range(scans):
        data = {f"cartesian{a}": rng.uniform(-9, 9, points) for a in "XYZ"}
        data["intensity"] = rng.uniform(0, 1, points)
        turn = np.array([1.0, 0, 0, 0])
        file.write_scan_raw(data, name=f"S{k}", rotation=turn, translation=np.full(3, float(k)))
    file.close()


def xml(path: Path) -> bytes:
    with path.open("rb") as file:
        return read_xml(file, read_header(file, path), path)


def content(path: Path) -> bytes:
    """Logical bytes: what is on the pages besides their checksums."""
    data = path.read_bytes()
    return b"".join(data[k : k + PAYLOAD] for k in range(0, len(data), PAGE))


def with_xml(source: Path, target: Path, text: bytes, behind: bytes = b"") -> None:
    """A file whose XML is another, perhaps followed by something else."""
    with source.open("rb") as file:
        header = read_header(file, source)
    before = content(source)[: header.xml_start]
    whole = before + text
    pages = -(-len(whole + behind) // PAYLOAD)
    head = type(header)(header.version, pages * PAGE, header.xml_offset, len(text)).to_bytes()
    target.write_bytes(paged(head + whole[48:] + behind))


def unchanged(source: Path, copy: Path) -> bool:
    """Are all bytes before the XML the same, but for the header's and its page's checksum?"""
    with source.open("rb") as file:
        header = read_header(file, source)
    a, b = source.read_bytes(), copy.read_bytes()
    end = min(PAYLOAD, header.xml_offset)
    return a[48:end] == b[48:end] and a[PAGE : header.xml_offset] == b[PAGE : header.xml_offset]


def test_poses_are_others_and_points_the_same(tmp_path: Path) -> None:
    source, copy = tmp_path / "a.e57", tmp_path / "b.e57"
    write(source)
    poses = {0: pose(1), 1: pose(2)}
    copy_with_poses(source, copy, poses, "EPSG:32648")
    assert unchanged(source, copy)
    old, new = pye57.E57(str(source)), pye57.E57(str(copy))
    assert new.root["coordinateMetadata"].value() == "EPSG:32648"
    for k, one in poses.items():
        header = new.get_header(k)
        assert header.rotation_matrix == pytest.approx(one.rotation, abs=1e-15)
        assert (header.translation == one.translation).all()
        before, after = old.read_scan_raw(k), new.read_scan_raw(k)
        assert all((before[name] == after[name]).all() for name in before)
        world = new.read_scan(k, ignore_missing_fields=True)
        local = np.stack([after[f"cartesian{a}"] for a in "XYZ"], axis=1)
        got = np.stack([world[f"cartesian{a}"] for a in "XYZ"], axis=1)
        assert np.abs(got - one @ local).max() < 2e-9
    old.close()
    new.close()


def test_only_the_poses_asked_for(tmp_path: Path) -> None:
    """The rest of the XML, the CRS included, stays as it is."""
    source, copy = tmp_path / "a.e57", tmp_path / "b.e57"
    write(source)
    copy_with_poses(source, copy, {1: pose(1)}, None)
    trees = [parse(xml(path), path) for path in (source, copy)]
    scans = [tree.findall(".//{*}data3D/{*}vectorChild") for tree in trees]
    assert etree.tostring(scans[0][0]) == etree.tostring(scans[1][0])
    for scan in (scans[0][1], scans[1][1]):
        for number in scan.find("{*}pose").iter("{*}w", "{*}x", "{*}y", "{*}z"):
            number.getparent().remove(number)
    stripped = ["".join(etree.tostring(t, encoding="unicode").split()) for t in trees]
    assert stripped[0] == stripped[1]


def test_a_scan_without_pose_gets_one(tmp_path: Path) -> None:
    source, bare, copy = (tmp_path / f"{k}.e57" for k in "abc")
    write(source, scans=1)
    tree = parse(xml(source), source)
    (scan,) = tree.findall(".//{*}data3D/{*}vectorChild")
    scan.remove(scan.find("{*}pose"))
    with_xml(source, bare, etree.tostring(tree, encoding="UTF-8"))
    assert read(bare)[0].pose is None
    copy_with_poses(bare, copy, {0: pose(1)}, None)
    (scan,) = read(copy)
    assert scan.pose is not None
    assert scan.pose.matrix == pytest.approx(pose(1).matrix, abs=1e-15)


def test_an_extension_passes_through(tmp_path: Path) -> None:
    source, odd, copy = (tmp_path / f"{k}.e57" for k in "abc")
    write(source)
    extra = b'<odd:thing xmlns:odd="urn:odd" type="String"><![CDATA[a <b> & c]]></odd:thing>'
    text = xml(source).replace(b"</e57Root>", extra + b"</e57Root>")
    with_xml(source, odd, text)
    copy_with_poses(odd, copy, {0: pose(1)}, None)
    assert extra in xml(copy)


def test_xml_that_is_not_last_comes_last(tmp_path: Path) -> None:
    """The old XML and what follows it stay where they are."""
    source, odd, copy = (tmp_path / f"{k}.e57" for k in "abc")
    write(source)
    with_xml(source, odd, xml(source), behind=bytes(range(256)) * 9)
    copy_with_poses(odd, copy, {0: pose(1)}, None)
    a, b = odd.read_bytes(), copy.read_bytes()
    assert a[PAGE:] == b[PAGE : len(a)]
    assert a[48:PAYLOAD] == b[48:PAYLOAD]
    assert len(b) > len(a)
    for before, after in zip(read(odd), read(copy), strict=True):
        assert (next(before.chunks()).xyz == next(after.chunks()).xyz).all()
    assert read(copy)[0].pose.matrix == pytest.approx(pose(1).matrix, abs=1e-15)
    again = tmp_path / "d.e57"
    copy_with_poses(copy, again, {0: pose(2)}, None)
    assert read(again)[0].pose.matrix == pytest.approx(pose(2).matrix, abs=1e-15)


def test_the_same_poses_are_the_same_bytes(tmp_path: Path) -> None:
    source = tmp_path / "a.e57"
    write(source)
    sums = set()
    for name in ("b.e57", "c.e57"):
        copy_with_poses(source, tmp_path / name, {0: pose(1)}, None)
        sums.add(zlib.crc32((tmp_path / name).read_bytes()))
    assert len(sums) == 1


def test_a_damaged_page_is_said_and_nothing_written(tmp_path: Path) -> None:
    source = tmp_path / "a.e57"
    write(source)
    data = bytearray(source.read_bytes())
    data[7 * PAGE + 100] ^= 1
    source.write_bytes(data)
    with pytest.raises(InputError, match="checksum of page 7 is wrong"):
        copy_with_poses(source, tmp_path / "b.e57", {0: pose(1)}, None)
    assert list(tmp_path.iterdir()) == [source]


def test_what_cannot_be_copied_is_a_sentence(tmp_path: Path) -> None:
    source, odd = tmp_path / "a.e57", tmp_path / "b.e57"
    write(source)
    with pytest.raises(InputError, match="has 2 scans, none is number 3"):
        copy_with_poses(source, odd, {2: pose(1)}, None)
    with pytest.raises(InputError, match="cannot be read"):
        copy_with_poses(tmp_path / "none.e57", odd, {}, None)
    text = xml(source)
    bomb = b'<!DOCTYPE e57Root [<!ENTITY a "b">]>'
    with_xml(source, odd, text.replace(b"<e57Root", bomb + b"<e57Root", 1))
    with pytest.raises(InputError, match="entities, which are refused"):
        copy_with_poses(odd, tmp_path / "c.e57", {0: pose(1)}, None)
    with pytest.raises(InputError, match="entities, which are refused"):
        read(odd)


@pytest.mark.data
def test_files_of_other_programs(shared_data: Path, tmp_path: Path) -> None:
    files = [
        shared_data / "scans" / "e57" / "pump.e57",
        shared_data / "scans" / "e57" / "translationWithoutRotation.e57",
        *(shared_data / "scans" / "formats" / "pdal_tiny").glob("*.e57"),
        *(shared_data / "scans" / "formats" / "slope").glob("*.e57"),
        shared_data / "scans" / "formats" / "e57_edge" / "bunnyInt32.e57",
        shared_data / "scans" / "formats" / "e57_edge" / "ColourRepresentation.e57",
    ]
    assert len(files) == 13
    copy = tmp_path / "copy.e57"
    for source in files:
        scans = read(source)
        copy_with_poses(source, copy, {s.index: pose(s.index) for s in scans}, None)
        assert unchanged(source, copy), source
        for before, after in zip(scans, read(copy), strict=True):
            assert after.pose is not None
            assert after.pose.matrix == pytest.approx(pose(before.index).matrix, abs=1e-15)
            for a, b in zip(before.chunks(), after.chunks(), strict=True):
                assert (a.xyz == b.xyz).all()
                assert all((a.values[k] == b.values[k]).all() for k in a.values)


@pytest.mark.data
def test_images_pass_through(shared_data: Path, tmp_path: Path) -> None:
    source, copy = shared_data / "scans" / "e57" / "pump.e57", tmp_path / "copy.e57"
    copy_with_poses(source, copy, {0: pose(1)}, None)
    images = []
    for path in (source, copy):
        file = libe57.ImageFile(str(path), "r")
        blob = file.root()["images2D"][0]["visualReferenceRepresentation"]["jpegImage"]
        images.append(blob.read_buffer().tobytes())
        file.close()
    assert images[0] == images[1]
    assert len(images[0]) == 1_504_576


def numbers(name: str, values: dict[str, float]) -> str:
    inside = "".join(f'<{k} type="Float">{v!r}</{k}>' for k, v in values.items())
    return f'<{name} type="Structure">{inside}</{name}>'


def picture(guid: str | None, where: Pose | None, kind: str = "pinholeRepresentation") -> str:
    """A picture in XML, with the scan that it hangs on and its place in the world."""
    text = '<vectorChild type="Structure">'
    if guid is not None:
        text += f'<associatedData3DGuid type="String"><![CDATA[{guid}]]></associatedData3DGuid>'
    if where is not None:
        x, y, z, w = Rotation.from_matrix(where.rotation).as_quat().tolist()
        rotation = numbers("rotation", {"w": w, "x": x, "y": y, "z": z})
        x, y, z = where.translation.tolist()
        rotation += numbers("translation", {"x": x, "y": y, "z": z})
        text += f'<pose type="Structure">{rotation}</pose>'
    return text + f'<{kind} type="Structure"/></vectorChild>'


def with_pictures(source: Path, target: Path, pictures: list[str]) -> None:
    inside = "".join(pictures).encode()
    text, found = re.subn(
        rb"<images2D([^>]*?)/?>(\s*</images2D>)?",
        rb"<images2D\1>" + inside.replace(b"\\", b"\\\\") + b"</images2D>",
        xml(source),
    )
    assert found == 1
    with_xml(source, target, text)


def of_pictures(path: Path) -> list[Pose | None]:
    root = parse(xml(path), path)
    return [pose_of(one, []) for one in root.findall("{*}images2D/{*}vectorChild")]


def test_pictures_stay_on_the_scans_that_they_hang_on(tmp_path: Path) -> None:
    """Seen from its scan a camera stands where it stood, though both are thousands of km away."""
    source, placed, odd, copy = (tmp_path / f"{k}.e57" for k in "abcd")
    write(source)
    copy_with_poses(source, placed, {0: pose(1), 1: pose(2)}, None)
    root = parse(xml(placed), placed)
    guids = [e.text for e in root.findall(".//{*}data3D/{*}vectorChild/{*}guid")]
    cameras = [pose(3), pose(4), pose(5), pose(6)]
    hung = [guids[1], guids[0], None, "{no scan}"]
    with_pictures(placed, odd, [picture(g, c) for g, c in zip(hung, cameras, strict=True)])
    new = {0: pose(7), 1: pose(8)}
    said = copy_with_poses(odd, copy, new, None)
    assert unchanged(odd, copy)
    before, after = of_pictures(odd), of_pictures(copy)
    old = {s.index: s.pose for s in read(odd)}
    for k, scan in ((0, 1), (1, 0)):
        a, b, world = before[k], after[k], old[scan]
        seen = world.rotation.T @ (a.translation - world.translation)
        now = new[scan].rotation.T @ (b.translation - new[scan].translation)
        assert np.abs(now - seen).max() < 3e-9
        turn = world.rotation.T @ a.rotation - new[scan].rotation.T @ b.rotation
        assert np.abs(turn).max() < 1e-14
    for k in (2, 3):
        a, b = before[k], after[k]
        assert (a.matrix == b.matrix).all()
    assert said == ("2 pictures name no scan of the file and did not move with the points",)


def test_a_picture_of_the_only_scan_needs_no_name(tmp_path: Path) -> None:
    source, odd, copy = (tmp_path / f"{k}.e57" for k in "abc")
    write(source, scans=1)
    nowhere = [picture(None, None, "visualReferenceRepresentation"), picture(None, None)]
    with_pictures(source, odd, [*nowhere, picture(None, pose(3))])
    assert copy_with_poses(odd, copy, {0: pose(7)}, None) == ()
    visual, first, second = of_pictures(copy)
    assert visual is None  # it lies nowhere
    (old,) = (s.pose for s in read(odd))
    assert first.matrix == pytest.approx((pose(7) @ old.inverse).matrix, abs=1e-9)
    assert second.matrix == pytest.approx((pose(7) @ old.inverse @ pose(3)).matrix, abs=1e-8)


def test_a_picture_of_a_scan_that_stays_stays(tmp_path: Path) -> None:
    source, odd, copy = (tmp_path / f"{k}.e57" for k in "abc")
    write(source)
    guid = parse(xml(source), source).findall(".//{*}data3D/{*}vectorChild/{*}guid")[0].text
    with_pictures(source, odd, [picture(guid, pose(3))])
    assert copy_with_poses(odd, copy, {1: pose(7)}, None) == ()
    (a,), (b,) = of_pictures(odd), of_pictures(copy)
    assert (a.matrix == b.matrix).all()
