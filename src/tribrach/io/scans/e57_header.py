"""What does an E57 file say of a scan besides its points: pose, grid, bounds, names, origin?"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from lxml import etree
from numpy.typing import NDArray
from pyproj import CRS
from pyproj.exceptions import CRSError
from scipy.spatial.transform import Rotation

from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.io.e57_pages import child, damaged, number
from tribrach.io.scans.e57_columns import CARTESIAN, SPHERICAL, Column, columns
from tribrach.scan.scan import Origin

__all__ = ["ScanHeader", "crs_of", "distance", "pose_of", "scan_header", "unique_names"]

Array = NDArray[np.float64]

#: the scanner cannot be at zero if that is farther from the points than they extend and than this
FAR = 10.0
#: stated bounds beyond this are placeholders [m]
_ENDLESS = 1e9
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


@dataclass(frozen=True)
class ScanHeader:
    """A scan's header.

    coordinates : names of the three columns, empty if there are none; state : the column that
    marks records without a point; bounds (2, 3) [m] as stated.
    """

    records: int
    pose: Pose | None
    coordinates: tuple[str, ...]
    state: str | None
    columns: tuple[Column, ...]
    grid: tuple[int, int] | None
    bounds: Array | None
    origin: Origin
    warnings: tuple[str, ...]
    facts: dict[str, str] = field(default_factory=dict)


def scan_header(scan: etree._Element, path: Path, index: int) -> ScanHeader:
    """The header of one child of ``data3D``.

    Raises
    ------
    InputError : a count that is none, or points without coordinates.
    """
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
    found: tuple[Column, ...] = ()
    if prototype is not None:
        found, odd = columns(scan, prototype, taken, _notes(scan))
        warnings += odd
    pose = pose_of(scan, warnings)
    bounds = _bounds(scan)
    origin = _origin(pose, bounds if records else None, warnings)
    grid = _grid(scan, {c.field.name for c in found})
    return ScanHeader(
        records, pose, axes, state, found, grid, bounds, origin, tuple(warnings), _facts(scan)
    )


def _records(scan: etree._Element, path: Path, index: int) -> int:
    """The stated number of points."""
    points = child(scan, "points")
    text = "0" if points is None else points.get("recordCount", "0")
    if not (text.isascii() and text.isdigit() and len(text) < 19):
        raise damaged(path, f"scan {index + 1} states {text[:30]!r} points")
    return int(text)


def pose_of(scan: etree._Element, warnings: list[str]) -> Pose | None:
    """World from the frame of a scan or picture; None without a pose.

    A part that is missing or no motion is the identity, with a warning added.
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
            warnings.append(f"the quaternion of the pose has length {length:.4f}, scaled to 1")
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
    """How far a point (3,) lies outside bounds, less what is allowed; positive if too far [m]."""
    away = float(np.linalg.norm(np.maximum(np.maximum(bounds[0] - point, point - bounds[1]), 0)))
    return away - max(FAR, float(np.linalg.norm(bounds[1] - bounds[0])))


def _origin(pose: Pose | None, bounds: Array | None, warnings: list[str]) -> Origin:
    """E57 has points in the scanner frame; unless they are placed already and no pose says so."""
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
    """What else the header says."""
    facts = {}
    for name, title in _TEXTS.items():
        element = child(scan, name)
        if element is not None and (element.text or "").strip():
            facts[title] = str(element.text).strip()
    for name, title in _NUMBERS.items():
        value = number(child(scan, name))
        if value:  # zero stands for unknown in most files
            facts[title] = f"{value:g}"
    start = number(child(scan, "acquisitionStart", "dateTimeValue"))
    if start:
        facts["start [GPS s]"] = f"{start:.3f}"
    return facts


def _notes(scan: etree._Element) -> dict[str, str]:
    """Descriptions of our own columns."""
    group = next(
        (e for e in scan if isinstance(e.tag, str) and etree.QName(e).localname == "descriptions"),
        None,
    )
    if group is None:
        return {}
    return {etree.QName(e).localname: e.text or "" for e in group if isinstance(e.tag, str)}


def crs_of(root: etree._Element) -> tuple[str | None, str]:
    """WKT of the file's reference system, None if PROJ does not know it; and the text itself."""
    element = child(root, "coordinateMetadata")
    text = "" if element is None else (element.text or "").strip()
    if not text:
        return None, ""
    try:
        return str(CRS.from_user_input(text).to_wkt()), text
    except CRSError:
        return None, text


def unique_names(scans: list[etree._Element], path: Path) -> list[tuple[str, tuple[str, ...]]]:
    """A name for each scan and what is to be said of it.

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
        said = f"another scan has the name {name!r} too, this one is called {free!r}"
        out.append((free, (said,) if free != name else ()))
    return out
