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

from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.clouds.e57_tree import replace_crs, replace_poses
from tribrach.io.clouds.staged import Staged
from tribrach.io.e57_pages import (
    PAGE,
    PAYLOAD,
    Header,
    damaged,
    paged,
    parse,
    read_header,
    read_xml,
    verify,
)

__all__ = ["copy_with_poses"]

#: pages copied at a time, 4 MB
_BLOCK = 4096
_DECLARATION = b'<?xml version="1.0" encoding="UTF-8"?>\n'


def copy_with_poses(
    source: Path, destination: Path, poses: Mapping[int, Pose], crs: str | None
) -> tuple[str, ...]:
    """Write a copy of an E57 file with these poses, world from scanner, by index of the scan.

    crs : WKT that replaces ``coordinateMetadata``; the old text stays if it is None. Pictures move
    with the scan that they hang on; everything else passes through. Returns sentences about what
    could not follow.

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
        said = replace_poses(root, poses, source)
        if crs is not None:
            replace_crs(root, crs)
        xml = _DECLARATION + etree.tostring(root, encoding="UTF-8", xml_declaration=False)
        xml += b" " * (-len(xml) % 4)  # the standard wants multiples of four
        with Staged(destination) as staged:
            _write(file, header, xml, staged.file, source)
    return said


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
