"""E57: writes one scan with its pose, and copies files with new poses.

**Writing.** A scan stays in its scanner frame with its pose, coordinates as integers of a stated
step. Fields for which the standard has no column go into columns of the extension ``trb``: sigmas
as single precision, others in their own type; ``trb:descriptions`` says what they are,
``trb:facts`` holds epoch and facts as JSON. The same points and header give the same bytes:
identifiers are made from the content and no date is written. ``return_number`` is stored from 0.

**Copying** (:func:`copy_with_poses`). Only the XML section changes. Points and images lie in pages
before it; these are copied byte for byte, their checksums verified on the way. The new XML takes
the place of the old one, or comes at the end of the file where the old one is not last. Poses of
pictures are in the world of the poses of the scans. A picture that names a scan (its
``associatedData3DGuid``) moves with it by new times old inverse, so that it still lies on the
points; one that names none moves with the only scan of its file, and stays where there are several.
"""

from __future__ import annotations

import hashlib
import re
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from lxml import etree
from numpy.typing import NDArray
from pyproj import CRS
from scipy.spatial.transform import Rotation

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.clouds.header import CloudHeader, CloudWriter, exactly
from tribrach.io.clouds.staged import Staged, staged_name
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
from tribrach.io.json_text import json_text
from tribrach.io.libe57 import libe57
from tribrach.io.scans.e57 import OURS, pose_of
from tribrach.scan.scan import Field

#: representations of a picture that have a place; a visual reference does not
_PLACED = ("pinholeRepresentation", "sphericalRepresentation", "cylindricalRepresentation")
#: pages copied at a time, 4 MB
_POSE_BLOCK = 4096
_DECLARATION = b'<?xml version="1.0" encoding="UTF-8"?>\n'
#: extensions: prefix and name
_OURS = ("trb", OURS)
_NORMALS = ("nor", "http://www.libe57.org/E57_NOR_surface_normals.txt")
_AXES = ("cartesianX", "cartesianY", "cartesianZ")
_RGB = {"red": "colorRed", "green": "colorGreen", "blue": "colorBlue"}
_COLOUR_ENDS = (("Minimum", 0), ("Maximum", 65535))
#: column and integer type or precision by name of a field
_KNOWN = {
    "intensity": ("intensity", "float32"),
    **{ours: (theirs, "uint16") for ours, theirs in _RGB.items()},
    "time": ("timeStamp", "float64"),
    "return_number": ("returnIndex", "uint8"),
    "number_of_returns": ("returnCount", "uint8"),
    "row": ("rowIndex", "int32"),
    "column": ("columnIndex", "int32"),
    **{f"normal_{a}": (f"nor:normal{a.upper()}", "float32") for a in "xyz"},
}
#: buffers that pye57 takes by type; other integers go through "q", for "l" is 32 bits to it
_BUFFERS = {"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "float32": "f", "float64": "d"}
#: largest number of steps of a coordinate
_REACH = 2**31 - 1
#: points handed to libE57 at a time
_BLOCK = 100_000


def replace_poses(root: etree._Element, poses: Mapping[int, Pose], source: Path) -> tuple[str, ...]:
    """Put new poses of scans, and of the pictures that belong to them, into the tree of a file."""
    scans = _children(root, "data3D")
    moves: dict[int, tuple[Pose, Pose]] = {}
    for index, pose in poses.items():
        if not 0 <= index < len(scans):
            raise InputError(
                f"the file has {len(scans)} scans, none is number {index + 1}", file=source
            )
        moves[index] = (pose_of(scans[index], []) or Pose.identity(), pose)
    sentences = _move_pictures(root, scans, moves)
    for index, pose in poses.items():
        _set_pose(scans[index], pose, before=child(scans[index], "points"))
    return sentences


def _move_pictures(
    root: etree._Element,
    scans: Sequence[etree._Element],
    moves: Mapping[int, tuple[Pose, Pose]],
) -> tuple[str, ...]:
    """Move pictures with their scans."""
    guids = [_text(scan, "guid") for scan in scans]
    stay = 0
    for picture in _children(root, "images2D"):
        named = _text(picture, "associatedData3DGuid")
        owners = [k for k, guid in enumerate(guids) if guid == named] if named else []
        if not named and len(scans) == 1:
            owners = [0]
        pose = pose_of(picture, [])
        if pose is None and all(child(picture, kind) is None for kind in _PLACED):
            continue
        if len(owners) == 1 and owners[0] in moves:
            _set_pose(picture, _moved(pose or Pose.identity(), *moves[owners[0]]), before=None)
        elif len(owners) != 1:
            stay += 1
    if not stay:
        return ()
    words = "a picture names no scan" if stay == 1 else f"{stay} pictures name no scan"
    return (f"{words} of the file and did not move with the points",)


def _moved(pose: Pose, old: Pose, new: Pose) -> Pose:
    """``new old^-1 pose``, differences first: translations may be millions of metres."""
    turn = new.rotation @ old.rotation.T
    shift = turn @ (pose.translation - old.translation)
    return Pose(turn @ pose.rotation, new.translation + shift)


def _children(root: etree._Element, name: str) -> list[etree._Element]:
    """The members of a vector of the tree."""
    group = child(root, name)
    return [] if group is None else [e for e in group if isinstance(e.tag, str)]


def _text(element: etree._Element, name: str) -> str:
    """The text of a child; "" if there is none."""
    named = child(element, name)
    return "" if named is None else (named.text or "").strip()


def _set_pose(owner: etree._Element, pose: Pose, before: etree._Element | None) -> None:
    """Put a pose into a scan or picture, replacing the old one."""
    element = child(owner, "pose")
    if element is None:
        element = _structure(owner, "pose", before=before)
    x, y, z, w = quaternion(pose)
    _numbers(element, "rotation", {"w": w, "x": x, "y": y, "z": z})
    _numbers(element, "translation", dict(zip("xyz", pose.translation.tolist(), strict=True)))


def quaternion(pose: Pose) -> list[float]:
    """x, y, z, w of a pose's rotation, w not negative."""
    q: list[float] = Rotation.from_matrix(pose.rotation).as_quat(canonical=True).tolist()
    return q


def _numbers(pose: etree._Element, name: str, values: Mapping[str, float]) -> None:
    """Put one part of a pose, replacing the old one."""
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


def replace_crs(root: etree._Element, crs: str) -> None:
    """Put the reference system into the tree of a file."""
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


def copy_with_poses(
    source: Path, destination: Path, poses: Mapping[int, Pose], crs: str | None
) -> tuple[str, ...]:
    """Write a copy of an E57 file with new poses; pictures move with the scan they belong to."""
    try:
        file = source.open("rb")
    except OSError as error:
        raise InputError(
            f"the file cannot be read ({error.strerror})", file=source, cure="check the path"
        ) from error
    with file:
        header = read_header(file, source)
        root = parse(read_xml(file, header, source), source)
        sentences = replace_poses(root, poses, source)
        if crs is not None:
            replace_crs(root, crs)
        xml = _DECLARATION + etree.tostring(root, encoding="UTF-8", xml_declaration=False)
        xml += b" " * (-len(xml) % 4)  # the standard wants multiples of four
        with Staged(destination) as staged, staged.writing():
            _write(file, header, xml, staged.file, source)
    return sentences


def _write(file: BinaryIO, header: Header, xml: bytes, out: BinaryIO, source: Path) -> None:
    """Write the pages before the XML, the XML, and the header again."""
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
    """Copy pages from the beginning."""
    first = b""
    for done in range(0, count, _POSE_BLOCK):
        data = _pages(file, done, min(_POSE_BLOCK, count - done), source)
        first = first or data[:PAGE]
        out.write(data)
    return first


def _pages(file: BinaryIO, first: int, count: int, source: Path) -> bytes:
    """Some pages of a file, verified."""
    file.seek(first * PAGE)
    data = file.read(count * PAGE)
    if len(data) < count * PAGE:
        raise damaged(source, "it ended while it was read")
    verify(np.frombuffer(data, dtype=np.uint8).reshape(-1, PAGE), first, source)
    return data


@dataclass(frozen=True)
class _Column:
    """A field's column."""

    field: Field  #: the field
    path: str  #: name of the column in the file
    dtype: np.dtype[Any]  #: type of the column
    buffer: NDArray[Any]  #: memory that is filled for every block


class E57Writer(CloudWriter):
    """Writes points chunk by chunk, in the scanner frame where the header has a pose."""

    def __init__(self, path: Path, header: CloudHeader) -> None:
        self._header, self._staged = header, Staged(path)
        self._image: Any = None
        self._hash = hashlib.blake2b(digest_size=16)
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)
        self._limits: dict[str, tuple[float, float]] = {}
        self._columns = _columns(header.fields)
        self._whole = np.empty((3, _BLOCK), dtype="q")
        try:
            with self._refusals():
                self._image = libe57.ImageFile(str(staged_name(path)), "w")
                self._begin()
        except BaseException:
            self._discard()
            raise

    def _begin(self) -> None:
        """Build the tree down to the points."""
        image, root = self._image, self._image.root()
        image.extensionsAdd("", libe57.E57_V1_0_URI)
        for prefix, uri in (_NORMALS, _OURS):
            image.extensionsAdd(prefix, uri)
        root.set("formatName", self._text("ASTM E57 3D Imaging Data File"))
        root.set("versionMajor", libe57.IntegerNode(image, libe57.E57_FORMAT_MAJOR))
        root.set("versionMinor", libe57.IntegerNode(image, libe57.E57_FORMAT_MINOR))
        root.set("e57LibraryVersion", self._text(libe57.E57_LIBRARY_ID))
        crs = self._header.crs
        wkt = "" if crs is None else CRS.from_user_input(crs).to_wkt()
        root.set("coordinateMetadata", self._text(wkt))
        scans = libe57.VectorNode(image, True)
        root.set("data3D", scans)
        root.set("images2D", libe57.VectorNode(image, True))
        self._scan = libe57.StructureNode(image)
        scans.append(self._scan)
        self._scan.set("name", self._text(self._header.name))
        if self._header.pose is not None:
            x, y, z, w = quaternion(self._header.pose)
            self._numbers("pose/rotation", {"w": w, "x": x, "y": y, "z": z})
            t = self._header.pose.translation.tolist()
            self._numbers("pose/translation", dict(zip("xyz", t, strict=True)))
        prototype, buffers = self._prototype(), self._buffers()
        points = libe57.CompressedVectorNode(image, prototype, libe57.VectorNode(image, True))
        self._scan.set("points", points)
        self._writer = points.writer(buffers)

    def _prototype(self) -> Any:
        """The structure of a record."""
        out = libe57.StructureNode(self._image)
        header = self._header
        for axis, step, offset in zip(_AXES, header.steps, header.offset, strict=True):
            node = libe57.ScaledIntegerNode(
                self._image, 0, -_REACH, _REACH, float(step), float(offset)
            )
            out.set(axis, node)
        for column in self._columns:
            out.set(column.path, self._node(column))
        return out

    def _node(self, column: _Column) -> Any:
        """The node that gives the type of a column."""
        if column.dtype.kind == "f":
            if column.dtype.itemsize == 8:
                return libe57.FloatNode(self._image, 0.0, libe57.E57_DOUBLE)
            unit = column.path.startswith("nor:")
            low, high = (-1.0, 1.0) if unit else (libe57.E57_FLOAT_MIN, libe57.E57_FLOAT_MAX)
            return libe57.FloatNode(self._image, 0.0, libe57.E57_SINGLE, low, high)
        limits = np.iinfo(column.dtype)
        low, high = int(limits.min), int(limits.max)
        if column.path == "returnIndex":
            low, high = -1, high - 1
        return libe57.IntegerNode(self._image, 0, low, high)

    def _buffers(self) -> Any:
        """The memory from which libE57 takes blocks."""
        out = libe57.VectorSourceDestBuffer()
        paths = [*_AXES, *(c.path for c in self._columns)]
        arrays = [*self._whole, *(c.buffer for c in self._columns)]
        for path, array in zip(paths, arrays, strict=True):
            out.append(libe57.SourceDestBuffer(self._image, path, array, _BLOCK, True, False))
        return out

    def write(self, xyz: Array, values: Mapping[str, NDArray[Any]]) -> None:
        """Append points.

        ``xyz`` (n, 3): coordinates [m]; ``values``: (n,) by name of the field.
        """
        for first in range(0, len(xyz), _BLOCK):
            part = slice(first, first + _BLOCK)
            count = self._fill(xyz[part], {name: v[part] for name, v in values.items()})
            with self._refusals():
                self._writer.write(count)

    def _fill(self, xyz: Array, values: Mapping[str, NDArray[Any]]) -> int:
        """Put one block into the buffers."""
        n, step, offset = len(xyz), self._header.steps, self._header.offset
        steps = np.rint((xyz - offset) / step)
        if not (np.abs(steps) <= _REACH).all():
            self._refuse(xyz)
        self._whole[:, :n] = steps.T
        self._low = np.minimum(self._low, steps.min(axis=0))
        self._high = np.maximum(self._high, steps.max(axis=0))
        self._hash.update(self._whole[:, :n].tobytes())
        for column in self._columns:
            given = values.get(column.field.name)
            column.buffer[:n] = 0 if given is None else self._stored(column, given)
            self._hash.update(column.buffer[:n].tobytes())
            self._note(column, n)
        return n

    def _stored(self, column: _Column, given: NDArray[Any]) -> NDArray[Any]:
        """The values of a field as its column has them."""
        if given.ndim != 1:
            raise InputError(
                f"{column.field.name} has several values per point", file=self._staged.path
            )
        given = exactly(given, column.dtype, column.field.name, self._staged.path)
        if column.path == "returnIndex":  # counted from 0; -1 is a return without a number
            return given.astype(np.int16) - 1
        return given

    def _note(self, column: _Column, n: int) -> None:
        """Keep the limits of columns whose limits the header of a scan states."""
        if column.path not in ("intensity", "rowIndex", "columnIndex"):
            return
        finite = column.buffer[:n][np.isfinite(column.buffer[:n])]
        if len(finite):
            low, high = self._limits.get(column.path, (np.inf, -np.inf))
            self._limits[column.path] = (
                min(low, float(finite.min())),
                max(high, float(finite.max())),
            )

    def _refuse(self, xyz: Array) -> None:
        """Raise the error that tells which coordinates do not fit."""
        if not np.isfinite(xyz).all():
            raise InputError("a coordinate is not a number", file=self._staged.path)
        far = float(np.abs(xyz - self._header.offset).max())
        raise InputError(
            f"coordinates {far:.0f} m from the origin do not fit steps of "
            f"{1e3 * self._header.steps.max():g} mm",
            file=self._staged.path,
            cure="take a coarser step",
        )

    def _conclude(self) -> None:
        """Write what is known only after the last point: bounds and limits."""
        self._writer.close()
        ends = {}
        if np.isfinite(self._low).all():
            for k, axis in enumerate("xyz"):
                for name, steps in (("Minimum", self._low), ("Maximum", self._high)):
                    value = steps[k] * self._header.steps[k] + self._header.offset[k]
                    ends[f"{axis}{name}"] = float(value)
            self._numbers("cartesianBounds", ends)
        names = {c.field.name: c.field for c in self._columns}
        if "intensity" in names:
            low, high = names["intensity"].low, names["intensity"].high
            if low is None or high is None:
                low, high = self._limits.get("intensity", (0.0, 0.0))
            limits = {"intensityMinimum": low, "intensityMaximum": high}
            self._numbers("intensityLimits", limits)
        if set(_RGB) <= set(names):
            limits = {f"{c}{e}": v for c in _RGB.values() for e, v in _COLOUR_ENDS}
            self._numbers("colorLimits", limits, whole=True)
        if {"rowIndex", "columnIndex"} <= set(self._limits):
            axes = (("row", "rowIndex"), ("column", "columnIndex"))
            grid = {
                f"{axis}{end}": self._limits[path][k]
                for axis, path in axes
                for k, end in enumerate(("Minimum", "Maximum"))
            }
            self._numbers("indexBounds", grid, whole=True)
        self._describe()

    def _describe(self) -> None:
        """Write descriptions, facts, and identifiers made from everything that was written."""
        header = self._header
        own = [c for c in self._columns if c.path.startswith("trb:") and c.field.description]
        if own:
            self._scan.set("trb:descriptions", libe57.StructureNode(self._image))
            for column in own:
                path = f"trb:descriptions/{column.path}"
                self._scan.set(path, self._text(column.field.description))
        facts = json_text({"epoch": header.epoch} | dict(header.facts), sort_keys=True)
        self._image.root().set("trb:facts", self._text(facts))
        pose = None if header.pose is None else header.pose.matrix.tolist()
        known = [header.name, header.step, list(header.offset), header.crs, pose, facts]
        self._hash.update(repr([*known, [c.path for c in self._columns]]).encode())
        for node, salt in ((self._image.root(), b"file"), (self._scan, b"scan")):
            made = hashlib.blake2b(self._hash.digest(), digest_size=16, key=salt).digest()
            node.set("guid", self._text(f"{{{uuid.UUID(bytes=made, version=4)}}}"))

    def _text(self, text: str) -> Any:
        return libe57.StringNode(self._image, text)

    def _numbers(self, path: str, values: Mapping[str, float], whole: bool = False) -> None:
        """Put a structure of numbers into the scan, with the structures above it."""
        parts = path.split("/")
        for k in range(len(parts)):
            above = "/".join(parts[: k + 1])
            if not self._scan.isDefined(above):
                self._scan.set(above, libe57.StructureNode(self._image))
        for name, value in values.items():
            node = (
                libe57.IntegerNode(self._image, int(value))
                if whole
                else libe57.FloatNode(self._image, float(value))
            )
            self._scan.set(f"{path}/{name}", node)

    @contextmanager
    def _refusals(self) -> Iterator[None]:
        """Turn what libE57 raises into an InputError."""
        try:
            yield
        except libe57.E57Exception as error:
            words = str(error).strip().splitlines()[0].split(" (Error")[0].rstrip(".")
            raise InputError(
                f"the file cannot be written ({words})",
                file=self._staged.path,
                cure="check the folder and the space on its disk",
            ) from error

    def _discard(self) -> None:
        """Remove what was written."""
        if self._image is not None:
            with suppress(libe57.E57Exception):
                self._image.cancel()
            self._image = None
        super()._discard()

    def _finish(self) -> None:
        try:
            with self._refusals():
                self._conclude()
                self._image.close()
                self._image = None
        except BaseException:
            self._discard()
            raise


def _columns(fields: tuple[Field, ...]) -> list[_Column]:
    """A column for each field; those of the extension get names that are allowed in XML."""
    out: list[_Column] = []
    for field in fields:
        path, kind = _KNOWN.get(field.name, ("", field.dtype))
        dtype = np.dtype(kind)
        if dtype.kind not in "iuf":
            dtype = np.dtype(np.uint8 if dtype.kind == "b" else np.float64)
        if dtype in (np.float16, np.longdouble):
            dtype = np.dtype(np.float64)
        dtype = np.dtype(np.int64) if dtype == np.uint64 else dtype
        path = path or _free(field.name, {c.path for c in out})
        name = "int16" if path == "returnIndex" else dtype.name
        buffer = np.zeros(_BLOCK, dtype=_BUFFERS.get(name, "q"))
        out.append(_Column(field, path, dtype, buffer))
    return out


def _free(name: str, taken: set[str]) -> str:
    """A name in the extension that no other column has."""
    plain = re.sub(r"[^A-Za-z0-9_.-]", "_", name)
    plain = plain if re.match(r"[A-Za-z_]", plain) else f"_{plain}"
    path, number = f"trb:{plain}", 2
    while path in taken:
        path, number = f"trb:{plain}_{number}", number + 1
    return path
