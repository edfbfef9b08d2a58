"""The layout of E57 files: pages of 1024 bytes, each with a checksum, and an XML section inside.

ASTM E2807: every page is 1020 bytes of content and their CRC-32C, big-endian. Physical offsets
count all bytes, logical ones the content only. The first 48 bytes of content are the header.
"""

from __future__ import annotations

import os
import re
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from lxml import etree
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.io.xml_file import MAX_BYTES, line_of
from tribrach.kernels import in_threads, njit

Bytes = NDArray[np.uint8]

PAGE, PAYLOAD = 1024, 1020
CURE = "copy the file again from its source"
_LAYOUT = struct.Struct("<8sIIQQQQ")
_POLYNOMIAL = 0x82F63B78  # Castagnoli, bits reversed
#: bytes that a checksum takes in at a time: a divisor of what a page holds, in whole words
_STRIDE = 12
#: the header of a binary section: its kind, its logical length, and where its data begin
_SECTION = struct.Struct("<B7xQQQ")
_POINTS = 1
#: pages whose checksums are verified at a time, 4 MB
_PAGES = 4096


@dataclass(frozen=True)
class Header:
    """The header of a file, its first 48 bytes."""

    version: tuple[int, int]  #: major and minor
    physical_length: int  #: of the file [bytes]
    xml_offset: int  #: physical
    xml_length: int  #: logical, without checksums

    @property
    def xml_start(self) -> int:
        """Logical offset of the XML."""
        return self.xml_offset // PAGE * PAYLOAD + self.xml_offset % PAGE

    @property
    def xml_is_last(self) -> bool:
        """True if nothing follows the page that the XML ends on."""
        pages = -(-(self.xml_start + self.xml_length) // PAYLOAD)
        return pages * PAGE == self.physical_length

    def to_bytes(self) -> bytes:
        """The header as 48 bytes."""
        return _LAYOUT.pack(
            b"ASTM-E57",
            *self.version,
            self.physical_length,
            self.xml_offset,
            self.xml_length,
            PAGE,
        )


def read_header(file: BinaryIO, path: Path) -> Header:
    """The header of an open file, checked against its size."""
    size = file.seek(0, os.SEEK_END)
    file.seek(0)
    head = file.read(_LAYOUT.size)
    if size == 0:
        raise InputError("the file is empty", file=path, cure=CURE)
    if len(head) < _LAYOUT.size or head[:8] != b"ASTM-E57":
        raise InputError("this is no E57 file", file=path, cure="check its name and format")
    _, major, minor, length, offset, xml_length, page = _LAYOUT.unpack(head)
    if page != PAGE:
        raise damaged(path, f"pages of {page} bytes instead of {PAGE}")
    if length != size or size % PAGE:
        raise InputError(
            f"the header states {length} bytes and the file has {size}", file=path, cure=CURE
        )
    header = Header((major, minor), length, offset, xml_length)
    within = header.xml_start + xml_length <= size // PAGE * PAYLOAD
    if offset < _LAYOUT.size or offset % PAGE >= PAYLOAD or not within or not xml_length:
        raise damaged(path, "the XML section lies outside the file")
    return header


def read_xml(file: BinaryIO, header: Header, path: Path) -> bytes:
    """The XML section of an open file, with its checksums verified."""
    if header.xml_length > MAX_BYTES:
        raise InputError(
            f"the XML has {header.xml_length / 1e6:.0f} MB, more than {MAX_BYTES / 1e6:.0f} MB",
            file=path,
        )
    first = header.xml_start // PAYLOAD
    last = -(-(header.xml_start + header.xml_length) // PAYLOAD)
    for start, count in ((0, 1), (first, last - first)):
        file.seek(start * PAGE)
        pages = np.frombuffer(file.read(count * PAGE), dtype=np.uint8).reshape(-1, PAGE)
        verify(pages, start, path)
    begin = header.xml_start - first * PAYLOAD
    return pages[:, :PAYLOAD].tobytes()[begin : begin + header.xml_length]


def parse(data: bytes, path: Path) -> etree._Element:
    """The root of an XML section; CDATA stays CDATA."""
    if re.search(rb"<!(ENTITY|DOCTYPE)", data):
        raise _entities(path)
    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False, strip_cdata=False
    )
    try:
        root = etree.fromstring(data.rstrip(b"\0"), parser)
    except (etree.XMLSyntaxError, LookupError, ValueError) as error:
        what = str(getattr(error, "msg", error)).splitlines()[0].rstrip(".")
        raise damaged(path, f"its XML cannot be read: {what}") from error
    if root.getroottree().docinfo.internalDTD is not None:
        raise _entities(path)
    if etree.QName(root).localname != "e57Root":
        raise InputError(
            f"the root element of the XML is <{root.tag}>, not <e57Root>",
            file=path,
            line=line_of(root),
        )
    return root


def child(element: etree._Element | None, *names: str) -> etree._Element | None:
    """The element down a path of names of the standard itself; None if one is missing."""
    for name in names:
        if element is None:
            return None
        element = next(
            (
                one
                for one in element
                if isinstance(one.tag, str)
                and one.prefix is None
                and etree.QName(one).localname == name
            ),
            None,
        )
    return element


def number(element: etree._Element | None) -> float | None:
    """The value of a numeric element; None if it is missing, not a number or not finite."""
    if element is None:
        return None
    try:
        value = float(element.text or 0)
        if element.get("type") == "ScaledInteger":
            value = value * float(element.get("scale", "1")) + float(element.get("offset", "0"))
    except ValueError:
        return None
    return value if np.isfinite(value) else None


def paged(content: bytes) -> bytes:
    """Logical content as whole pages with checksums; the last page is filled up with zeros."""
    count = -(-len(content) // PAYLOAD)
    pages = np.zeros((count, PAGE), dtype=np.uint8)
    flat = np.zeros(count * PAYLOAD, dtype=np.uint8)
    flat[: len(content)] = np.frombuffer(content, dtype=np.uint8)
    pages[:, :PAYLOAD] = flat.reshape(count, PAYLOAD)
    sums = _checksums(pages)
    pages[:, PAYLOAD:] = sums.astype(">u4").view(np.uint8).reshape(count, 4)
    return pages.tobytes()


def verify(pages: Bytes, first: int, path: Path) -> None:
    """Check the checksums of whole pages.

    ``pages`` (n, 1024): the pages.
    """
    stated = np.ascontiguousarray(pages[:, PAYLOAD:]).view(">u4").ravel()
    wrong = np.flatnonzero(stated != _checksums(pages))
    if len(wrong):
        raise damaged(path, f"the checksum of page {first + int(wrong[0])} is wrong")


def verify_section(path: Path, start: int) -> None:
    """Check the checksums of a section of points, which libE57 then need not do.

    Its own check is most of what it does for a scan, in one thread. A header that is none is left
    for it to refuse.
    """
    first, into = divmod(start, PAGE)
    with path.open("rb") as file:
        pages = file.seek(0, os.SEEK_END) // PAGE
        file.seek(first * PAGE)
        head = np.frombuffer(file.read(2 * PAGE), dtype=np.uint8)
        content = head[: len(head) // PAGE * PAGE].reshape(-1, PAGE)[:, :PAYLOAD].tobytes()
        if into >= PAYLOAD or len(content) < into + _SECTION.size:
            return
        kind, length, _, _ = _SECTION.unpack_from(content, into)
        if kind != _POINTS:
            return
        last = min(pages, first + -(-(into + length) // PAYLOAD))
        buffer = np.empty((min(_PAGES, last - first), PAGE), dtype=np.uint8)
        file.seek(first * PAGE)
        for at in range(first, last, _PAGES):
            some = buffer[: last - at]
            if file.readinto(some.data) < some.size:
                return
            verify(some, at, path)


def damaged(path: Path, reason: str) -> InputError:
    """The error of a damaged file."""
    return InputError(f"the file is damaged ({reason})", file=path, cure=CURE)


def _entities(path: Path) -> InputError:
    return InputError(
        "the XML declares a document type or entities, which are refused",
        file=path,
        cure="export the file again",
    )


def _tables() -> NDArray[np.uint32]:
    """CRC-32C of the 256 bytes, followed by none to eleven bytes that are zero.

    With them a checksum takes in twelve bytes at a time ("slicing", Kounavis and Berry 2008, IEEE
    Transactions on Computers 57:1550).
    """
    table = np.arange(256, dtype=np.uint32)
    for _ in range(8):
        table = np.where(table & 1, (table >> 1) ^ np.uint32(_POLYNOMIAL), table >> 1)
    tables = [table.astype(np.uint32)]
    for _ in range(_STRIDE - 1):
        tables.append(tables[0][tables[-1] & 0xFF] ^ (tables[-1] >> 8))
    return np.stack(tables)


_TABLES = _tables()


def _checksums(pages: NDArray[np.uint8]) -> NDArray[np.uint32]:
    """CRC-32C of the content of pages (n, 1024)."""
    out = np.empty(len(pages), dtype=np.uint32)
    words = np.ascontiguousarray(pages).view("<u4").astype(np.uint32, copy=False)
    in_threads(_sum_up, len(pages), words, _TABLES, out, least=256)
    return out


@njit(cache=True, nogil=True)
def _sum_up(first, last, pages, table, out):  # type: ignore[no-untyped-def]
    """Checksums of pages (n, 256) of little-endian words, without the last word of each."""
    for n in range(first, last):
        crc = np.uint32(0xFFFFFFFF)
        for k in range(0, PAYLOAD // 4, _STRIDE // 4):
            a, b, c = pages[n, k] ^ crc, pages[n, k + 1], pages[n, k + 2]
            crc = (
                table[11, a & 0xFF]
                ^ table[10, (a >> 8) & 0xFF]
                ^ table[9, (a >> 16) & 0xFF]
                ^ table[8, a >> 24]
                ^ table[7, b & 0xFF]
                ^ table[6, (b >> 8) & 0xFF]
                ^ table[5, (b >> 16) & 0xFF]
                ^ table[4, b >> 24]
                ^ table[3, c & 0xFF]
                ^ table[2, (c >> 8) & 0xFF]
                ^ table[1, (c >> 16) & 0xFF]
                ^ table[0, c >> 24]
            )
        out[n] = ~crc
