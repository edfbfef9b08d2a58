"""A folder of results as the workbench reads it: the result, poses of its clouds, what is beside.

Nothing in it is trusted: files are bounded and checked where they are read. A folder of an earlier
version has less beside its result; what is missing is unknown and nothing else.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geodesy.site import enu_rotation
from tribrach.io.json_file import read_json
from tribrach.io.result_file import RESULT, read_result_file
from tribrach.job.poses import POSES, PoseFile, read_poses
from tribrach.job.state import PICTURES
from tribrach.report.workbench_parts import FORM, PARTS, SeenPlane, StoredFrame, WorkbenchDocument
from tribrach.workbench.frame import SceneFrame

__all__ = ["CLOUDS", "RESULT", "ResultFolder", "read_result"]

#: name in a folder of results
CLOUDS = "clouds"


def read_result(folder: Path) -> dict[str, Any]:
    """The result of a run."""
    return read_result_file(folder / RESULT)


@dataclass(frozen=True)
class ResultFolder:
    """What lies beside a result."""

    folder: Path | None = None  #: the folder; None where nothing was run yet
    frame: SceneFrame = field(default_factory=SceneFrame)  #: the frame of the clouds
    pose_file: PoseFile | None = None  #: poses of the scans with what their points share
    #: content of ``workbench.json``, None where a run left none
    further: WorkbenchDocument | None = None

    @classmethod
    def beside(cls, folder: Path) -> ResultFolder:
        """Read what lies beside the result of a folder."""
        path = folder / PARTS
        further = _further(path) if path.is_file() else None
        beside = folder / CLOUDS / POSES
        poses = read_poses(beside) if beside.is_file() else None
        frame = _frame(None if further is None else further.frame, beside, poses, path)
        return cls(folder, frame, poses, further)

    @property
    def poses(self) -> Mapping[str, Array]:
        """World from scanner (4, 4) by the names of the scans."""
        if self.pose_file is None:
            return {}
        return {scan.scan: scan.placement.pose.matrix for scan in self.pose_file.scans}

    @property
    def angle(self) -> Literal["gon", "deg"]:
        """How angles are written."""
        return "gon" if self.further is None else self.further.angle

    def confidence(self, result: Mapping[str, Any]) -> float:
        """Probability of ellipsoids: one less the error probability of the global test."""
        if self.further is not None:
            return self.further.confidence
        return round(1.0 - float(result["sigma0"]["global_test"]["alpha"]), 12)

    @property
    def names(self) -> Mapping[str, str]:
        """Names of frames as a person reads them."""
        frame = None if self.further is None else self.further.frame
        own = {
            "work": "Work frame E, N, U",
            "projected": "Grid easting, northing, height",
            "geodetic": "Latitude, longitude, ellipsoidal height",
            "ecef": "Geocentric X, Y, Z",
        }
        return own if frame is None else {**own, **frame.names}

    @property
    def planes(self) -> Mapping[str, SeenPlane]:
        """Where planes were seen in the work frame, by name."""
        return {} if self.further is None else self.further.planes

    @property
    def _pictures(self) -> Mapping[str, Mapping[str, str]]:
        """Names of pictures by scan and number of the target."""
        return {} if self.further is None else self.further.pictures

    def picture(self, scan: str, number: int) -> str | None:
        """Where the picture of a target is; rejected candidates have numbers below zero."""
        name = self._pictures.get(scan, {}).get(str(number))
        return None if name is None else f"pictures/{name}"

    def picture_file(self, name: str) -> Path | None:
        """The file of a picture that the run listed, None if there is none of that name."""
        known = self.folder is not None and name in self.picture_names
        return self.folder / PICTURES / name if self.folder is not None and known else None

    @cached_property
    def picture_names(self) -> frozenset[str]:
        """Files of pictures that the run listed, those that are names and lead nowhere else."""
        files = {file for of_scan in self._pictures.values() for file in of_scan.values()}
        return frozenset(f for f in files if Path(f).name == f and f not in ("", ".", ".."))

    @property
    def sigmas_of(self) -> str:
        """Of which run the sigmas in the clouds are."""
        when = "of the last run" if self.further is None else f"run of {self.further.date}"
        return f"sigmas of points: {when}"


def _further(path: Path) -> WorkbenchDocument:
    """What a run left for the workbench."""
    cure = "run the project again"
    try:
        data = read_json(path)
        if isinstance(data, dict) and data.get("schema") != FORM.schema:
            raise InputError(f"the layout {data.get('schema')} is not known", file=path, cure=cure)
        found: WorkbenchDocument = FORM.read(data)
    except (ValueError, AttributeError) as error:
        first = str(error).splitlines()[0]
        raise InputError(f"this file is damaged ({first})", file=path, cure=cure) from error
    return found


def _frame(
    told: StoredFrame | None, beside: Path, poses: PoseFile | None, path: Path
) -> SceneFrame:
    """The frame of the clouds, as the run stored it or as the poses name it."""
    stations: dict[str, tuple[Array, Array]] = {}
    for scan in () if poses is None else poses.scans:
        where = scan.placement
        stations.setdefault(where.station, (where.pose.matrix, where.covariance))
    if told is None and poses is None:
        return SceneFrame()
    try:
        if told is None:
            named = read_json(beside)["frame"]
            kind, crs, axes = named["kind"], named["crs"], tuple(named["axes"])
            if kind not in ("work", "projected", "ecef") or len(axes) != 3:
                raise ValueError(f"a frame {kind!r}")
            upright = _upright(kind, stations)
            return SceneFrame(kind, crs, axes, upright, stations)
        maps = told.from_work, told.maps, told.radius
        return SceneFrame(told.kind, told.crs, told.axes, told.upright, stations, *maps)
    except (ValueError, KeyError, TypeError) as error:
        file = path if told is not None else beside
        raise InputError(
            f"the frame of the clouds is not understood ({error})",
            file=file,
            cure="run the project again",
        ) from error


def _upright(kind: str, stations: Mapping[str, tuple[Array, Array]]) -> Array:
    """Axes of geocentric coordinates to east, north, up at the stations; others are upright."""
    if kind != "ecef" or not stations:
        return np.eye(3)
    x, y, z = np.mean([pose[:3, 3] for pose, _ in stations.values()], axis=0)
    latitude, longitude = np.arctan2(z, np.hypot(x, y)), np.arctan2(y, x)
    turned: Array = enu_rotation(latitude, longitude)
    return turned
