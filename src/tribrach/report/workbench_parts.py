"""What the workbench needs beside the result: frames, planes, pictures of targets, covariances.

The run knows all of this and ``result.json`` does not hold it. It is written in numbers that
need neither the project nor grids of PROJ again, so that a folder of results can be looked at
anywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from tribrach._types import Array
from tribrach.answers import Form, Matrix, Result, Vector
from tribrach.geodesy.local_map import StoredMap
from tribrach.geodesy.output_frame import FrameKind, OutputFrame
from tribrach.geodesy.site import EllipsoidSite
from tribrach.geometry.rectangle import held_rectangle
from tribrach.io.arrays import joint_covariance_bytes
from tribrach.job.budget import station_shares
from tribrach.job.grouping import file_name
from tribrach.job.shared import joint_with_points
from tribrach.job.state import PICTURES
from tribrach.report.content import Report

if TYPE_CHECKING:
    from tribrach.job.steps import PlacedScans
    from tribrach.job.tie import Registered

#: the file and the matrix in a folder of results
PARTS, JOINT = "workbench.json", "workbench_covariance.npy"
#: what maps may be wrong by [m]
_TOLERANCE = 1e-4
#: the box of a map reaches so far beyond what it is for: of its extent, and at least [m]
_MARGIN, _LEAST = 0.2, 20.0
#: an angle of a map is times this radius, so that its tolerance is one in metres
_RADIUS = 6378137.0
#: numbers of the largest joint covariance with points that is written: 16 MB
_MOST = 2_000_000


@dataclass(frozen=True)
class StoredFrame(Result):
    """The frame of the clouds and its way to others."""

    kind: FrameKind
    crs: str | None
    epoch: float | None
    axes: tuple[str, str, str]  #: short names of the coordinates
    upright: Matrix  #: 3 x 3, axes of the coordinates to east, north, up
    names: dict[str, str]  #: of the frames, as a person reads them: work, projected, geodetic, ecef
    from_work: StoredMap | None  #: from the work frame; null where they are the same
    maps: dict[str, StoredMap]  #: to the other frames; latitude and longitude are times ``radius``
    radius: float  #: [m]


@dataclass(frozen=True)
class SeenPlane(Result):
    """Where a plane was seen, in the work frame [m]."""

    centre: Vector
    extent: float  #: radius about the centre that holds it
    #: unit vectors along the sides of the rectangle that holds it, and half its widths along them;
    #: results of earlier versions have none
    axes: Matrix | None = None
    half: Vector | None = None


@dataclass(frozen=True)
class JointRows(Result):
    """Rows of ``workbench_covariance.npy``: of the points, three each, along the clouds' axes.

    Its columns are the rows of ``poses_covariance.npy`` of the clouds, then those of the points.
    """

    points: tuple[str, ...]
    file: str
    shared: int  #: rows of the joint covariance of the poses


@dataclass(frozen=True)
class WorkbenchDocument(Result):
    """What ``tribrach run`` leaves for ``tribrach view`` beside ``result.json``."""

    date: str
    confidence: float
    angle: Literal["gon", "deg"]
    #: null where no clouds were placed
    frame: StoredFrame | None
    planes: dict[str, SeenPlane]
    #: by scan and number the picture of a target; rejected candidates have numbers below zero
    pictures: dict[str, dict[str, str]]
    #: covariance (6 x 6) of a station by what it comes from, along the clouds' axes
    shares: dict[str, dict[str, Matrix]]
    joint: JointRows | None


FORM = Form("workbench", WorkbenchDocument, 1, quick=True)


def workbench_texts(content: Report, folder: Path) -> dict[Path, str | bytes]:
    """Contents of the files by their paths."""
    placed, registered = content.job.placed, content.job.registered
    names, files = ({}, {}) if placed is None else _pictures(placed)
    texts: dict[Path, str | bytes] = {folder / PICTURES / name: f for name, f in files.items()}
    joint = None if placed is None else _joint(content, placed)
    rows = None
    if joint is not None:
        points, matrix, shared = joint
        rows = JointRows(tuple(points), JOINT, shared)
        texts[folder / JOINT] = joint_covariance_bytes(matrix)
    document = WorkbenchDocument(
        content.date,
        content.settings.confidence,
        content.settings.angle,
        None if placed is None else stored_frame(placed.frame, _box(content, placed)),
        {} if registered is None else _planes(content, registered),
        names,
        {} if placed is None else _shares(content, placed),
        rows,
    )
    return {**texts, folder / PARTS: FORM.text(document)}


def stored_frame(frame: OutputFrame, box: tuple[Array, Array]) -> StoredFrame:
    """The frame of clouds, what turns it upright, and maps to the frames that the site knows.

    ``box`` holds the lowest and highest coordinates of all that is drawn, in the work frame [m].
    """
    work, site = frame.work, frame.work.site
    low, high = box
    middle = ((low + high) / 2)[None]
    upright = np.eye(3)
    if frame.kind == "ecef":
        upright = site.axes(middle)[0] @ frame.rotation(middle[0]).T
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
    there = frame.from_work(corners)
    reach = there.min(axis=0), there.max(axis=0)
    to_work = _to_work(frame)
    maps: dict[str, Callable[[Array], Array]] = {}
    if frame.kind != "work":
        maps["work"] = to_work
    grid = OutputFrame(work, "projected", frame.crs) if work.grid is not None else None
    if grid is not None and frame.kind != "projected":
        maps["projected"] = lambda x: grid.from_work(to_work(x))
    if isinstance(site, EllipsoidSite):
        scale = np.array([_RADIUS, _RADIUS, 1.0])
        maps["geodetic"] = lambda x: site.geodetic(to_work(x)) * scale
        if frame.kind != "ecef":
            maps["ecef"] = lambda x: site.to_ecef(to_work(x))
    fitted = {name: StoredMap.over(exact, *reach, _TOLERANCE) for name, exact in maps.items()}
    back = None if frame.kind == "work" else StoredMap.over(frame.from_work, *box, _TOLERANCE)
    return StoredFrame(
        frame.kind,
        frame.crs,
        frame.epoch,
        frame.axes,
        upright,
        _names(frame),
        back,
        {name: m for name, m in fitted.items() if m is not None},
        _RADIUS,
    )


def _to_work(frame: OutputFrame) -> Callable[[Array], Array]:
    """From the frame of the clouds to the work frame."""
    if frame.kind == "work":
        return lambda x: x
    if frame.kind == "ecef":
        return lambda x: frame.work.from_ecef(x)[0]
    return lambda x: frame.work.from_own(x)[0]


def _names(frame: OutputFrame) -> dict[str, str]:
    """What the frames are called."""
    grid = frame.work.grid
    names = {"work": "Work frame E, N, U"}
    if grid is not None:
        names["projected"] = f"{grid.crs} easting, northing, height"
    if isinstance(frame.work.site, EllipsoidSite):
        names["geodetic"] = "Latitude, longitude, ellipsoidal height"
        names["ecef"] = "Geocentric X, Y, Z"
    return names


def _box(content: Report, placed: PlacedScans) -> tuple[Array, Array]:
    """Lowest and highest coordinates in the work frame of points, stations and clouds."""
    xyz = np.array([p.xyz for p in content.points], dtype=float).reshape(-1, 3)
    places = [np.nan_to_num(xyz), *(w.pose.translation[None] for w in placed.placements.values())]
    to_work = _to_work(placed.frame)
    for product in placed.products:
        low, high = product.summary.low, product.summary.high
        if np.isfinite(low).all() and np.isfinite(high).all():
            corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
            places.append(to_work(corners))
    every = np.concatenate(places)
    low, high = every.min(axis=0), every.max(axis=0)
    margin = np.maximum(_MARGIN * (high - low), _LEAST)
    return low - margin, high + margin


def _planes(content: Report, registered: Registered) -> dict[str, SeenPlane]:
    """Where planes of the network were seen: rectangles that hold the cells of their patches.

    A cell is a twentieth of a patch wide, so that an edge is known to half of that.
    """
    ties = registered.ties
    if ties is None:
        return {}
    adjustment = content.adjustment
    layout, state = adjustment.layout, adjustment.state
    sets = {s.name: s.planes for s in registered.stations}
    out: dict[str, SeenPlane] = {}
    for surface in range(len(ties.normal)):
        name = f"plane {surface + 1}"
        if name not in layout.names["plane"]:
            continue
        places = []
        for k in np.flatnonzero(ties.surface == surface):
            station, number = ties.station[k], int(ties.number[k])
            if station not in layout.names["pose"]:
                continue
            at = layout.index("pose", station)
            seen, turn, shift = sets[station], state.pose_r[at], state.pose_t[at]
            places.append(np.vstack([seen.center[number], seen.samples[number]]) @ turn.T + shift)
        if places:
            normal = state.plane_n[layout.index("plane", name)]
            centre, axes, half = held_rectangle(normal, np.concatenate(places))
            out[name] = SeenPlane(centre, float(np.hypot(*half)), axes, half)
    return out


def _pictures(placed: PlacedScans) -> tuple[dict[str, dict[str, str]], dict[str, bytes]]:
    """Names of the pictures of targets and candidates by scan and number, and their files."""
    names: dict[str, dict[str, str]] = {}
    files: dict[str, bytes] = {}
    for at, finding in enumerate(placed.findings, start=1):
        for number, picture in finding.pictures.items():
            file = f"{at}-{file_name(finding.scan)}-{number}.webp"
            names.setdefault(finding.scan, {})[str(number)] = file
            files[file] = picture
    return names, files


def _shares(content: Report, placed: PlacedScans) -> dict[str, dict[str, Array]]:
    """Parts of the covariance of each station, along the axes of the clouds."""
    out: dict[str, dict[str, Array]] = {}
    for where in placed.placements.values():
        if where.station in out:
            continue
        turn = np.kron(np.eye(2), placed.frame.rotation(where.pose.translation))
        shares = station_shares(content.adjustment, where, content.variance_factor)
        out[where.station] = {n: turn @ c @ turn.T for n, c in shares.items()}
    return out


def _joint(content: Report, placed: PlacedScans) -> tuple[list[str], Array, int] | None:
    """Points, rows of the joint covariance, number of stations' rows; None without stations."""
    points = [p.name for p in content.points]
    if placed.shared is None or not points:
        return None
    shared = len(placed.shared.covariance)
    if 3 * len(points) * (shared + 3 * len(points)) > _MOST:
        return None
    joint = joint_with_points(placed.scans, content.adjustment, points, content.variance_factor)
    turn = np.eye(len(joint))
    frame = placed.frame
    for name, rows in _rows_of_stations(placed).items():
        at = placed.placements[name].pose.translation
        turn[np.ix_(rows, rows)] = np.kron(np.eye(2), frame.rotation(at))
    state, layout = content.adjustment.state, content.adjustment.layout
    for k, name in enumerate(points):
        rows = shared + 3 * k + np.arange(3)
        turn[np.ix_(rows, rows)] = frame.rotation(state.points[layout.index("point", name)])
    turned = turn @ joint @ turn.T
    return points, 0.5 * (turned + turned.T)[shared:], shared


def _rows_of_stations(placed: PlacedScans) -> Mapping[str, Any]:
    """Rows of the poses, by one scan of each station."""
    assert placed.shared is not None
    return {name: placed.shared.columns[name][:6] for name in placed.shared.scans}
