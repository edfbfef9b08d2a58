"""A copy of an E57 file in which only the poses of its scans are others.

Points and images lie in pages before the XML section; these are copied byte for byte, their
checksums verified on the way. The new XML takes the place of the old one, or comes at the end of
the file where the old one is not last.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import numpy as np
from lxml import etree
from scipy.spatial.transform import Rotation

from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.clouds.staged import Staged
from tribrach.io.e57_pages import (
    PAGE,
    PAYLOAD,
    Header,
    child,
    damaged,
    paged,
    parse,
    read_header,
    read_xml,
    verify,
)

__all__ = ["copy_with_poses", "quaternion"]

#: pages copied at a time, 4 MB
_BLOCK = 4096
_DECLARATION = b'<?xml version="1.0" encoding="UTF-8"?>\n'


def copy_with_poses(
    source: Path, destination: Path, poses: Mapping[int, Pose], crs: str | None
) -> None:
    """Write a copy of an E57 file with these poses, world from scanner, by index of the scan.

    crs : WKT that replaces ``coordinateMetadata``; the old text stays if it is None. Everything
    else passes through, so poses of images, which are in the world of the old poses, stay too.

    Raises
    ------
    InputError : no E57 file, truncated, damaged, a scan that it has not, or nowhere to write.
    """
    try:
        file = source.open("rb")
    except OSError as error:
        raise InputError(
            f"the file cannot be read ({error.strerror})", file=source, cure="check the path"
        ) from error
    with file:
        header = read_header(file, source)
        root = parse(read_xml(file, header, source), source)
        _replace_poses(root, poses, source)
        if crs is not None:
            _replace_crs(root, crs)
        xml = _DECLARATION + etree.tostring(root, encoding="UTF-8", xml_declaration=False)
        xml += b" " * (-len(xml) % 4)  # the standard wants multiples of four
        with Staged(destination) as staged:
            _write(file, header, xml, staged.file, source)


def _write(file: BinaryIO, header: Header, xml: bytes, out: BinaryIO, source: Path) -> None:
    """The pages before the XML, the XML, and the header again."""
    start = header.xml_start if header.xml_is_last else header.physical_length // PAGE * PAYLOAD
    whole, rest = divmod(start, PAYLOAD)
    first = _copy(file, out, whole, source)
    before = b""
    if rest:  # the XML begins within a page
        before = _pages(file, whole, 1, source)[:rest]
    tail = paged(before + xml)
    out.write(tail)
    new = replace(
        header,
        physical_length=whole * PAGE + len(tail),
        xml_offset=whole * PAGE + rest,
        xml_length=len(xml),
    ).to_bytes()
    page = first if whole else tail[:PAGE]
    out.seek(0)
    out.write(paged(new + page[len(new) : PAYLOAD]))


def _copy(file: BinaryIO, out: BinaryIO, count: int, source: Path) -> bytes:
    """Copy pages from the beginning; the first of them."""
    first = b""
    for done in range(0, count, _BLOCK):
        data = _pages(file, done, min(_BLOCK, count - done), source)
        first = first or data[:PAGE]
        out.write(data)
    return first


def _pages(file: BinaryIO, first: int, count: int, source: Path) -> bytes:
    """Verified pages of a file."""
    file.seek(first * PAGE)
    data = file.read(count * PAGE)
    if len(data) < count * PAGE:
        raise damaged(source, "it ended while it was read")
    verify(np.frombuffer(data, dtype=np.uint8).reshape(-1, PAGE), first, source)
    return data


def _replace_poses(root: etree._Element, poses: Mapping[int, Pose], source: Path) -> None:
    """Put poses into the scans of a tree."""
    group = child(root, "data3D")
    scans = [] if group is None else [e for e in group if isinstance(e.tag, str)]
    for index, pose in poses.items():
        if not 0 <= index < len(scans):
            raise InputError(
                f"the file has {len(scans)} scans, none is number {index + 1}", file=source
            )
        scan = scans[index]
        element = child(scan, "pose")
        if element is None:
            element = _structure(scan, "pose", before=child(scan, "points"))
        x, y, z, w = quaternion(pose)
        _numbers(element, "rotation", {"w": w, "x": x, "y": y, "z": z})
        _numbers(element, "translation", dict(zip("xyz", pose.translation.tolist(), strict=True)))


def quaternion(pose: Pose) -> list[float]:
    """x, y, z, w of a pose's rotation, w not negative."""
    q: list[float] = Rotation.from_matrix(pose.rotation).as_quat(canonical=True).tolist()
    return q


def _numbers(pose: etree._Element, name: str, values: Mapping[str, float]) -> None:
    """One part of a pose, in the place of the old one."""
    old = child(pose, name)
    if old is None:
        part = _structure(pose, name, before=None)
    else:
        part = old
        for one in values:
            stale = child(part, one)
            if stale is not None:
                part.remove(stale)
    for one, value in values.items():
        element = etree.SubElement(part, _tag(pose, one), type="Float")
        element.text = repr(float(value))


def _structure(parent: etree._Element, name: str, before: etree._Element | None) -> etree._Element:
    """A new structure in a parent, before one of its children or at its end."""
    element = etree.Element(_tag(parent, name), type="Structure")
    if before is None:
        parent.append(element)
    else:
        before.addprevious(element)
    return element


def _tag(near: etree._Element, name: str) -> str:
    """A name in the namespace of the standard, as the file writes it."""
    space = near.nsmap.get(None)
    return f"{{{space}}}{name}" if space else name


def _replace_crs(root: etree._Element, crs: str) -> None:
    """Put the reference system into a tree."""
    element = child(root, "coordinateMetadata")
    if element is None:
        element = etree.Element(_tag(root, "coordinateMetadata"), type="String")
        group = child(root, "data3D")
        if group is None:
            root.append(element)
        else:
            group.addprevious(element)
    for one in list(element):
        element.remove(one)
    element.set("type", "String")
    element.text = etree.CDATA(crs) if "]]>" not in crs else crs
