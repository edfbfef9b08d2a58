"""E57: several scans in a file, each in its scanner frame with its pose, read in chunks.

Headers come from the XML section, points through libE57. Coordinates are Cartesian or range,
azimuth (counter-clockwise from x) and elevation (from the xy plane). Records that the file marks as
invalid, or that are no finite numbers, are dropped; so are points at exactly zero in scans with a
grid but without marks, which stand for no return. ``return_number`` counts from 1 (0 in the file);
values that the file flags as invalid are zero, intensities their low limit.

The file has three parts: columns and the fields they become; the header of a scan (pose, grid,
bounds, names, origin); and the scan itself with its buffers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from lxml import etree
from numpy.typing import NDArray
from pyproj import CRS
from pyproj.exceptions import CRSError
from scipy.spatial.transform import Rotation

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.e57_pages import (
    CURE,
    child,
    damaged,
    number,
    parse,
    read_header,
    read_xml,
    verify_section,
)
from tribrach.io.libe57 import libe57
from tribrach.io.scans.facts import START, told_facts
from tribrach.kernels import njit
from tribrach.scan.scan import CHUNK, Chunk, Field, Lattice, Origin, Scan
from tribrach.sentences import Sentence

Values = NDArray[Any]

#: names of the columns of coordinates
CARTESIAN = ("cartesianX", "cartesianY", "cartesianZ")
SPHERICAL = ("sphericalRange", "sphericalAzimuth", "sphericalElevation")
_COLOURS = {"colorRed": "red", "colorGreen": "green", "colorBlue": "blue"}
#: fields and types of columns that have names of ours
_KNOWN = {
    "intensity": ("intensity", "float32"),
    **{theirs: (ours, "uint16") for theirs, ours in _COLOURS.items()},
    "timeStamp": ("time", "float64"),
    "returnIndex": ("return_number", "uint8"),
    "returnCount": ("number_of_returns", "uint8"),
    "rowIndex": ("row", "int32"),
    "columnIndex": ("column", "int32"),
    "normalX": ("normal_x", "float32"),
    "normalY": ("normal_y", "float32"),
    "normalZ": ("normal_z", "float32"),
}
#: columns that flag values of others as invalid
_FLAGS = {
    "isIntensityInvalid": ("intensity",),
    "isColorInvalid": ("red", "green", "blue"),
    "isTimeStampInvalid": ("time",),
}
#: buffers that pye57 takes by type; other integers go through "q", for "l" is 32 bits to it
_BUFFERS = {"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "float32": "f", "float64": "d"}
_INTEGERS = ("uint8", "int8", "uint16", "int16", "int32", "uint32", "int64")
#: the scanner cannot be at zero if that is farther from the points than they extend and than this
FAR = 10.0
#: stated bounds beyond this are placeholders [m]
_ENDLESS = 1e9
#: name of the extension of our own writer
OURS = "urn:tribrach:e57:1"
#: entries of the header that are kept as facts
_TEXTS = {
    "description": "description",
    "sensorVendor": "sensor vendor",
    "sensorModel": "sensor model",
    "sensorSerialNumber": "sensor serial number",
    "guid": "guid",
}
_NUMBERS = {
    "temperature": "temperature [C]",
    "relativeHumidity": "relative humidity [%]",
    "atmosphericPressure": "atmospheric pressure [Pa]",
}
#: records that libE57 decodes at a time
_BLOCK = 50_000
#: points that are looked at to tell placed ones from others
_GLANCE = 1000


@dataclass(frozen=True)
class FieldColumn:
    """A column of the file that becomes a field."""

    path: str  #: its name in the file
    field: Field  #: what it becomes
    buffer: str  #: type character of the buffer
    #: limits that colours are stretched from
    low: float = 0.0
    high: float = 65535.0
    flag: str | None = None  #: the column that invalidates it

    def values(self, raw: Values, invalid: Values | None) -> Values:
        """The field's values.

        ``raw`` (n,): content of the buffer; ``invalid`` (n,): not zero where a value means nothing;
        such values become zero, intensities the low limit.
        """
        out = self._converted(raw)
        if invalid is not None and invalid.any():
            nothing = self.field.low if self.field.name == "intensity" else None
            out[invalid.astype(bool)] = 0 if nothing is None else nothing
        return out

    def _converted(self, raw: Values) -> Values:
        """The content of the buffer in the field's type, as a new array."""
        if self.field.name in _COLOURS.values():
            if (self.low, self.high) == (0, 65535) and raw.dtype == np.uint16:
                return raw.copy()
            if (self.low, self.high) == (0, 255) and raw.dtype != np.float64:
                wide: Values = np.multiply(np.minimum(raw, 255), 257, dtype=np.uint16)
                return wide
            share = (raw.astype(np.float64) - self.low) / max(self.high - self.low, 1e-300)
            whole: Values = np.rint(65535 * np.clip(np.nan_to_num(share), 0, 1))
            return whole.astype(np.uint16)
        if self.field.name == "return_number":  # counted from zero in the file
            return np.clip(raw.astype(np.int64) + 1, 0, 255).astype(np.uint8)
        kind = np.dtype(self.field.dtype)
        if raw.dtype == np.longlong and kind.itemsize < 8 and len(raw):
            limits = np.iinfo(kind)
            if raw.min() < limits.min or raw.max() > limits.max:
                raise InputError(f"values of {self.path} do not fit {kind.name}")
        return raw.astype(kind)


def integer_type(low: float | None, high: float | None) -> str:
    """The smallest integer type that holds low to high; 64 bits if a limit is not stated."""
    if low is None or high is None:
        return "int64"
    fits = (n for n in _INTEGERS if np.iinfo(n).min <= low and high <= np.iinfo(n).max)
    return next(fits, "int64")


def columns(
    scan: etree._Element, prototype: etree._Element, taken: Sequence[str], notes: dict[str, str]
) -> tuple[tuple[FieldColumn, ...], tuple[str, ...]]:
    """Columns besides those that coordinates are made of."""
    fields: list[FieldColumn] = []
    warnings: list[str] = []
    for element in prototype:
        if not isinstance(element.tag, str):
            continue
        local = etree.QName(element).localname
        path = f"{element.prefix}:{local}" if element.prefix else local
        if path in taken:
            continue
        if element.get("type") not in ("Float", "Integer", "ScaledInteger"):
            warnings.append(f"column {path} holds no numbers and is left out")
            continue
        column = _column(scan, element, local, path, notes.get(local, ""))
        if column.field.name in {one.field.name for one in fields}:
            column = replace(column, field=replace(column.field, name=path))
        fields.append(column)
        if column.field.name in _COLOURS.values() and column.high <= column.low:
            warnings.append(f"the limits of {path} are empty")
    flags = {n: f for f, names in _FLAGS.items() for n in names if f in {c.path for c in fields}}
    return tuple(replace(c, flag=flags.get(c.field.name)) for c in fields), tuple(warnings)


def _column(
    scan: etree._Element, element: etree._Element, local: str, path: str, note: str
) -> FieldColumn:
    """One column, by its element of the prototype."""
    low, high = _limits(element)
    kind = _type(element, low, high)
    known = _KNOWN.get(local) if element.prefix is None or local.startswith("normal") else None
    name, own = known or (local, kind)
    if local in _COLOURS:
        low, high = _stated(scan, "colorLimits", local, low, high)
        low, high = (0.0, 255.0) if low is None or high is None else (low, high)
        buffer = {"uint8": "B", "uint16": "H"}.get(kind, "d")
        return FieldColumn(path, Field(name, own, 0.0, 65535.0), buffer, low, high)
    if name == "intensity":
        low, high = _stated(scan, "intensityLimits", "intensity", low, high)
        step = 1.0 if element.get("type") == "Integer" else None
        return FieldColumn(path, Field(name, own, low, high, step=step), "f")
    if name == "return_number":  # its limits count from zero
        low = high = None
    buffer = _BUFFERS.get(own if np.dtype(own).kind == "f" else kind, "q")
    buffer = "d" if kind == "float64" else buffer
    return FieldColumn(path, Field(name, own, low, high, note), buffer)


def _type(element: etree._Element, low: float | None, high: float | None) -> str:
    """Type of a column's values as numpy calls it."""
    if element.get("type") == "Integer":
        return integer_type(low, high)
    single = element.get("type") == "Float" and element.get("precision") == "single"
    return "float32" if single else "float64"


def _limits(element: etree._Element) -> tuple[float | None, float | None]:
    """Limits of a column, scaled; None where it states none."""
    try:
        low, high = (float(element.attrib[k]) for k in ("minimum", "maximum"))
        if element.get("type") == "ScaledInteger":
            scale, offset = float(element.get("scale", "1")), float(element.get("offset", "0"))
            low, high = low * scale + offset, high * scale + offset
    except (KeyError, ValueError):
        return None, None
    return (low, high) if np.isfinite([low, high]).all() else (None, None)


def _stated(
    scan: etree._Element, group: str, name: str, low: float | None, high: float | None
) -> tuple[float | None, float | None]:
    """Limits that the scan states, else those of the column."""
    stated = tuple(number(child(scan, group, f"{name}{end}")) for end in ("Minimum", "Maximum"))
    return (low, high) if None in stated else (stated[0], stated[1])


@dataclass(frozen=True)
class ScanHeader:
    """The header of a scan: all that the XML section says about it."""

    records: int  #: number of records, valid or not
    section: int | None  #: physical offset of their binary section, None if the XML states none
    pose: Pose | None  #: world from scanner, None if there is none
    #: names of the three columns of coordinates, empty if there are none
    coordinates: tuple[str, ...]
    state: str | None  #: the column that marks records without a point
    columns: tuple[FieldColumn, ...]  #: the other columns
    grid: tuple[int, int] | None  #: rows and columns
    bounds: Array | None  #: (2, 3), smallest and largest coordinates as stated [m]
    origin: Origin  #: whether the scanner is at zero
    lattice: Lattice | None  #: lattice that coordinates are stored on
    warnings: tuple[str, ...]  #: sentences
    facts: dict[str, str] = field(default_factory=dict)  #: other entries as text


def scan_header(scan: etree._Element, path: Path, index: int) -> ScanHeader:
    """The header of one child of ``data3D``."""
    warnings: list[str] = []
    records = _records(scan, path, index)
    prototype = child(scan, "points", "prototype")
    if not records:
        warnings.append("the scan holds no points")
    names = [] if prototype is None else [e.tag for e in prototype if isinstance(e.tag, str)]
    local = {etree.QName(name).localname for name in names}
    axes = next((s for s in (CARTESIAN, SPHERICAL) if set(s) <= local), ())
    if records and not axes:
        raise InputError("the points have no coordinates", file=path, record=f"scan {index + 1}")
    state = axes[0][: len("cartesian")] + "InvalidState" if axes else None
    state = state if state in local else None
    taken = (*axes, state) if state else axes
    fields: tuple[FieldColumn, ...] = ()
    if prototype is not None:
        fields, unusual = columns(scan, prototype, taken, _notes(scan))
        warnings += unusual
    pose = pose_of(scan, warnings)
    bounds = _bounds(scan)
    origin = _origin(pose, bounds if records else None, warnings)
    grid = _grid(scan, {c.field.name for c in fields})
    return ScanHeader(
        records=records,
        section=_section(scan),
        pose=pose,
        coordinates=axes,
        state=state,
        columns=fields,
        grid=grid,
        bounds=bounds,
        origin=origin,
        lattice=None if prototype is None else _lattice(prototype, axes),
        warnings=tuple(warnings),
        facts=_facts(scan),
    )


def _lattice(prototype: etree._Element, axes: Sequence[str]) -> Lattice | None:
    """Steps and offsets of Cartesian coordinates that are scaled integers."""
    if tuple(axes) != CARTESIAN:
        return None
    found: list[tuple[float, float]] = []
    for axis in axes:
        element = child(prototype, axis)
        if element is None or element.get("type") != "ScaledInteger":
            return None
        try:
            step, offset = float(element.get("scale", "1")), float(element.get("offset", "0"))
        except ValueError:
            return None
        if not (0 < step < np.inf and abs(offset) < np.inf):
            return None
        found.append((step, offset))
    (a, x), (b, y), (c, z) = found
    return Lattice((a, b, c), (x, y, z))


def _records(scan: etree._Element, path: Path, index: int) -> int:
    """The stated number of points."""
    points = child(scan, "points")
    text = "0" if points is None else points.get("recordCount", "0")
    if not _whole(text):
        raise damaged(path, f"scan {index + 1} states {text[:30]!r} points")
    return int(text)


def _section(scan: etree._Element) -> int | None:
    """Where the binary section of the points begins, if that is stated as a number."""
    points = child(scan, "points")
    text = "" if points is None else points.get("fileOffset", "")
    return int(text) if _whole(text) else None


def _whole(text: str) -> bool:
    """True for a number of bytes or points."""
    return text.isascii() and text.isdigit() and len(text) < 19


def pose_of(scan: etree._Element, warnings: list[str]) -> Pose | None:
    """World from the frame of a scan or picture; None without a pose.

    A part that is missing or is no motion is replaced by the identity.
    """
    if child(scan, "pose") is None:
        return None
    rotation, translation = np.eye(3), np.zeros(3)
    q = [number(child(scan, "pose", "rotation", k)) for k in "xyzw"]
    t = [number(child(scan, "pose", "translation", k)) for k in "xyz"]
    turn = np.array([np.nan if v is None else v for v in q])
    length = float(np.linalg.norm(turn))
    if not np.isfinite(length):
        warnings.append("the pose has no rotation, none is taken")
    elif length < 1e-6:
        warnings.append("the quaternion of the pose is zero, no rotation is taken")
    else:
        rotation = Rotation.from_quat(turn).as_matrix()
        if abs(length - 1) > 1e-3:
            warnings.append(
                Sentence(
                    "the quaternion of the pose has length {length:4}, scaled to 1", length=length
                )
            )
    if None in t:
        warnings.append("the pose has no translation, zero is taken")
    else:
        translation = np.array(t, dtype=float)
    return Pose(rotation, translation)


def _bounds(scan: etree._Element) -> Array | None:
    """Stated Cartesian bounds (2, 3); None if there are none or they are placeholders."""
    ends = [
        [number(child(scan, "cartesianBounds", f"{axis}{end}")) for axis in "xyz"]
        for end in ("Minimum", "Maximum")
    ]
    bounds = np.array([[np.nan if v is None else v for v in row] for row in ends])
    good = (np.abs(bounds) < _ENDLESS).all() and (bounds[0] <= bounds[1]).all()
    return bounds if good else None


def distance(bounds: Array, point: Array) -> float:
    """How far [m] a point (3,) lies outside bounds (2, 3), less what is allowed; positive if too
    far.
    """
    away = float(np.linalg.norm(np.maximum(np.maximum(bounds[0] - point, point - bounds[1]), 0)))
    return away - max(FAR, float(np.linalg.norm(bounds[1] - bounds[0])))


def _origin(pose: Pose | None, bounds: Array | None, warnings: list[str]) -> Origin:
    """E57 has points in the scanner frame, unless they are far from zero and no pose moves them."""
    moved = pose is not None and not np.allclose(pose.matrix, np.eye(4), rtol=0, atol=1e-9)
    if moved or bounds is None or distance(bounds, np.zeros(3)) <= 0:
        return "stated"
    warnings.append(
        "the points are far from (0, 0, 0) and no pose places them: they are probably placed "
        "already, so where the scanner stood is unknown"
    )
    return "unknown"


def _grid(scan: etree._Element, names: set[str]) -> tuple[int, int] | None:
    """Rows and columns, if every point has both."""
    if not {"row", "column"} <= names:
        return None
    low_high = [
        number(child(scan, "indexBounds", f"{axis}{end}"))
        for axis in ("row", "column")
        for end in ("Minimum", "Maximum")
    ]
    if None in low_high:
        return None
    a, b, c, d = (int(v) for v in low_high if v is not None)
    return (b - a + 1, d - c + 1) if b >= a and d >= c else None


def _facts(scan: etree._Element) -> dict[str, str]:
    """Texts, numbers and the date of the header."""
    facts = {}
    for name, title in _TEXTS.items():
        element = child(scan, name)
        if element is not None and (element.text or "").strip():
            facts[title] = str(element.text).strip()
    for name, title in _NUMBERS.items():
        value = number(child(scan, name))
        if value:  # zero stands for unknown in most files
            facts[title] = Sentence("{value:g}", value=value)
    start = number(child(scan, "acquisitionStart", "dateTimeValue"))
    if start:
        facts[START] = Sentence("{start:3}", start=start)
    return facts


def _notes(scan: etree._Element) -> dict[str, str]:
    """Descriptions of the columns that our own writer adds."""
    group = next(
        (e for e in scan if isinstance(e.tag, str) and etree.QName(e).localname == "descriptions"),
        None,
    )
    if group is None:
        return {}
    return {etree.QName(e).localname: e.text or "" for e in group if isinstance(e.tag, str)}


def crs_of(root: etree._Element) -> tuple[str | None, str]:
    """WKT of the file's reference system, None if PROJ does not know it, and the file's own
    text.
    """
    element = child(root, "coordinateMetadata")
    text = "" if element is None else (element.text or "").strip()
    if not text:
        return None, ""
    try:
        return str(CRS.from_user_input(text).to_wkt()), text
    except CRSError:
        return None, text


def unique_names(scans: list[etree._Element], path: Path) -> list[tuple[str, tuple[str, ...]]]:
    """A name for each scan, and warnings about it.

    Scans without a name take the file's, and their number if there are several.
    """
    stated = [(child(scan, "name"), k) for k, scan in enumerate(scans)]
    out: list[tuple[str, tuple[str, ...]]] = []
    given: set[str] = set()
    for element, k in stated:
        wanted = "" if element is None else (element.text or "").strip()
        name = wanted or (path.stem if len(scans) == 1 else f"{path.stem}-{k + 1}")
        free, number_ = name, 2
        while free in given:
            free, number_ = f"{name}-{number_}", number_ + 1
        given.add(free)
        warning = f"another scan has the name {name!r} too, this one is called {free!r}"
        out.append((free, (warning,) if free != name else ()))
    return out


@dataclass(frozen=True)
class E57Scan(Scan):
    """One scan of an E57 file."""

    coordinates: tuple[str, ...] = CARTESIAN  #: names of the three columns of coordinates
    state: str | None = None  #: the column that marks records without a point
    columns: tuple[FieldColumn, ...] = ()  #: the other columns
    #: physical offset of the binary section of the points, None if it is not stated
    section: int | None = None

    even_chunks = False
    standard_metres = True

    def stored(self, size: int = CHUNK, start: int = 0) -> Iterator[Chunk]:
        """Read the points in the file's order.

        A chunk has a little fewer than ``size`` points if that is many blocks.
        """
        records = self.records or 0
        if start >= records:
            return
        many = -(-min(size, records) // _BLOCK)
        block = min(size, records) // many
        # who asks for few looks at the beginning, and libE57 itself checks what it reads there
        checks = libe57.CHECKSUM_POLICY_ALL
        if size > _BLOCK and self.section is not None:
            verify_section(self.path, self.section)
            checks = libe57.CHECKSUM_POLICY_NONE
        with _damage(self.path):
            image = libe57.ImageFile(str(self.path), "r", checks)
        try:
            buffers = _Buffers(self, image, block)
            with _damage(self.path):
                reader = image.root()["data3D"][self.index]["points"].reader(buffers.vector)
            done = 0
            while done < records:
                gathered = _Gathered(self, min(many * block, records - done))
                for _ in range(-(-gathered.size // block)):
                    count = self._read(reader, done)
                    done += count
                    if done > start:
                        gathered.add(buffers, max(count - done + start, 0), count)
                if done > start:
                    yield gathered.chunk()
            reader.close()
        finally:
            image.close()

    def _read(self, reader: Any, done: int) -> int:
        """Fill the buffers with the next records."""
        with _damage(self.path):
            count = int(reader.read())
        if count == 0:
            raise InputError(
                f"the header states {self.records} points and the file holds {done}",
                file=self.path,
                record=self.name,
                cure=CURE,
            )
        return count


class _Gathered:
    """A chunk that grows block by block; blocks stay in the processor's cache."""

    def __init__(self, scan: E57Scan, size: int) -> None:
        self.scan, self.size, self.points, self.dropped = scan, size, 0, 0
        self.xyz = np.empty((size, 3))
        self.values = [np.empty(size, dtype=c.field.dtype) for c in scan.columns]

    def add(self, buffers: _Buffers, first: int, last: int) -> None:
        """Add the valid ones among the records first to last of the buffers."""
        scan, raw = self.scan, buffers.xyz[first:last]
        xyz = raw if scan.coordinates == CARTESIAN else _cartesian(raw)
        kept = _kept(xyz, buffers.state[first:last], scan.state is None and scan.grid is not None)
        some = len(kept) < len(xyz)
        to = slice(self.points, self.points + len(kept))
        if some:
            xyz.take(kept, axis=0, out=self.xyz[to], mode="clip")
        else:
            self.xyz[to] = xyz
        for column, whole, out in zip(scan.columns, buffers.values, self.values, strict=True):
            part, wrong = whole[first:last], buffers.flags.get(column.flag or "")
            wrong = None if wrong is None else wrong[first:last]
            if some:
                part, wrong = part.take(kept), None if wrong is None else wrong.take(kept)
            try:
                out[to] = column.values(part, wrong)
            except InputError as error:
                raise damaged(scan.path, error.what) from error
        self.points = to.stop
        self.dropped += len(xyz) - len(kept)

    def chunk(self) -> Chunk:
        """The chunk of everything that was added."""
        names = (c.field.name for c in self.scan.columns)
        values = {n: v[: self.points] for n, v in zip(names, self.values, strict=True)}
        return Chunk(self.xyz[: self.points], values, self.dropped)


class _Buffers:
    """Arrays that libE57 fills again and again; they live as long as its reader."""

    def __init__(self, scan: E57Scan, image: Any, size: int) -> None:
        self.vector = libe57.VectorSourceDestBuffer()
        self.xyz = np.empty((size, 3))
        for k, path in enumerate(scan.coordinates):
            self._add(scan, image, path, self.xyz[:, k], stride=self.xyz.strides[0])
        self.state = np.zeros(size, dtype=np.int8)
        if scan.state is not None:
            self._add(scan, image, scan.state, self.state)
        self.values = [np.empty(size, dtype=np.dtype(c.buffer)) for c in scan.columns]
        for column, values in zip(scan.columns, self.values, strict=True):
            self._add(scan, image, column.path, values)
        by_path = {c.path: v for c, v in zip(scan.columns, self.values, strict=True)}
        self.flags = {c.flag: by_path[c.flag] for c in scan.columns if c.flag is not None}

    def _add(
        self, scan: E57Scan, image: Any, path: str, values: NDArray[Any], stride: int = 0
    ) -> None:
        stride = stride or values.itemsize
        with _damage(scan.path):
            self.vector.append(
                libe57.SourceDestBuffer(image, path, values, len(values), True, True, stride)
            )


@njit(cache=True, nogil=True)
def _kept(xyz, state, zeros):  # type: ignore[no-untyped-def]
    """Indices of the records that hold a point; with ``zeros`` a point at 0, 0, 0 is none."""
    out = np.empty(len(xyz), dtype=np.intp)
    count = 0
    for n in range(len(xyz)):
        x, y, z = xyz[n]
        if state[n] != 0 or not np.isfinite(x + y + z):
            continue
        if zeros and x == 0 and y == 0 and z == 0:
            continue
        out[count] = n
        count += 1
    return out[:count]


def _cartesian(polar: Array) -> Array:
    """Coordinates of range [m], azimuth and elevation [rad] (n, 3)."""
    r, azimuth, elevation = polar.T
    out = np.empty_like(polar)
    # an infinite angle makes NaN, which is no point
    with np.errstate(invalid="ignore"):
        flat = r * np.cos(elevation)
        out[:, 0] = flat * np.cos(azimuth)
        out[:, 1] = flat * np.sin(azimuth)
        out[:, 2] = r * np.sin(elevation)
    return out


def read(path: Path) -> tuple[Scan, ...]:
    """All scans of a file."""
    root = xml_of(path)
    elements = scan_elements(root)
    if not elements:
        images = child(root, "images2D")
        besides = f" but {len(images)} images" if images is not None and len(images) else ""
        raise InputError(f"the file holds no scan{besides}", file=path, cure="give another file")
    crs, text = crs_of(root)
    told = root.find(f"{{{OURS}}}facts")
    ours = {} if told is None else told_facts(told.text or "")
    scans: list[Scan] = []
    for k, (element, (name, notes)) in enumerate(
        zip(elements, unique_names(elements, path), strict=True)
    ):
        header = scan_header(element, path, k)
        facts = header.facts | ({"coordinate metadata": text} if text and crs is None else {})
        facts |= ours
        scan = E57Scan(
            name=name,
            path=path,
            index=k,
            records=header.records,
            fields=tuple(c.field for c in header.columns),
            pose=header.pose,
            origin=header.origin,
            grid=header.grid,
            crs=crs,
            bounds=header.bounds if header.records else None,
            warnings=(*notes, *header.warnings),
            facts=facts,
            lattice=header.lattice,
            coordinates=header.coordinates,
            state=header.state,
            columns=header.columns,
            section=header.section,
        )
        scans.append(_glanced(scan, header))
    return tuple(scans)


def xml_of(path: Path) -> etree._Element:
    """The root of the file's XML section."""
    try:
        with path.open("rb") as file:
            return parse(read_xml(file, read_header(file, path), path), path)
    except OSError as error:
        raise InputError(
            f"the file cannot be read ({error.strerror})", file=path, cure="check the path"
        ) from error


def scan_elements(root: etree._Element) -> list[etree._Element]:
    """The children of ``data3D``, in order."""
    group = child(root, "data3D")
    return [] if group is None else [e for e in group if isinstance(e.tag, str)]


def _glanced(scan: E57Scan, header: ScanHeader) -> E57Scan:
    """The scan with its origin or bounds corrected where they lie around the pose's position.

    Some programs place the points and keep the pose; others place only the bounds. A few points
    tell.
    """
    if header.pose is None or scan.bounds is None or distance(scan.bounds, np.zeros(3)) <= 0:
        return scan
    if distance(scan.bounds, header.pose.translation) > 0:
        return scan
    first = next(scan.chunks(min(_GLANCE, header.records)))
    if len(first) and distance(scan.bounds, np.median(first.xyz, axis=0)) <= 0:
        warning = "the points lie around the pose's position: they seem to be placed already"
        return replace(scan, origin="unknown", warnings=(*scan.warnings, warning))
    warning = "the stated bounds are not those of the points and are left out"
    return replace(scan, bounds=None, warnings=(*scan.warnings, warning))


@contextmanager
def _damage(path: Path) -> Iterator[None]:
    """Turn what libE57 raises into an InputError."""
    try:
        yield
    except libe57.E57Exception as error:
        words = str(error).strip().splitlines()[0].split(" (Error")[0].rstrip(".")
        raise damaged(path, words) from error
    except (IndexError, KeyError, RuntimeError, ValueError) as error:
        raise damaged(path, str(error) or type(error).__name__) from error
