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
from tribrach.geodesy.local_map import StoredMap
from tribrach.geodesy.site import enu_rotation
from tribrach.io.json_file import read_json
from tribrach.io.result_file import RESULT, read_result_file
from tribrach.job.poses import POSES, PoseFile, read_poses
from tribrach.job.state import PICTURES
from tribrach.report.schema.workbench import WorkbenchDocument
from tribrach.report.workbench_parts import PARTS
from tribrach.workbench.frame import SceneFrame

__all__ = ["CLOUDS", "RESULT", "ResultFolder", "read_result"]

#: name in a folder of results
CLOUDS = "clouds"
#: layouts of what lies beside a result that are read
_BESIDE = (1,)


def read_result(folder: Path) -> dict[str, Any]:
    """The result of a run."""
    return read_result_file(folder / RESULT)


@dataclass(frozen=True)
class ResultFolder:
    """What lies beside a result."""

    #: the folder; None where nothing was run yet
    folder: Path | None = None
    #: the frame of the clouds
    frame: SceneFrame = field(default_factory=SceneFrame)
    #: poses of the scans with what their points share
    pose_file: PoseFile | None = None
    #: content of ``workbench.json``, empty where a run left none
    further: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def beside(cls, folder: Path) -> ResultFolder:
        """Read what lies beside the result of a folder."""
        path = folder / PARTS
        further = _further(path) if path.is_file() else {}
        beside = folder / CLOUDS / POSES
        poses = read_poses(beside) if beside.is_file() else None
        frame = _frame(further.get("frame"), beside, poses, path)
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
        return "deg" if self.further.get("angle") == "deg" else "gon"

    def confidence(self, result: Mapping[str, Any]) -> float:
        """Probability of ellipsoids: one less the error probability of the global test."""
        told = self.further.get("confidence")
        if told is not None:
            return float(told)
        return round(1.0 - float(result["sigma0"]["global_test"]["alpha"]), 12)

    @property
    def names(self) -> Mapping[str, str]:
        """Names of frames as a person reads them."""
        given = (self.further.get("frame") or {}).get("names", {})
        own = {
            "work": "Work frame E, N, U",
            "projected": "Grid easting, northing, height",
            "geodetic": "Latitude, longitude, ellipsoidal height",
            "ecef": "Geocentric X, Y, Z",
        }
        return {**own, **given}

    @property
    def planes(self) -> Mapping[str, Mapping[str, Any]]:
        """Centre and extent of planes in the work frame, by name."""
        planes: Mapping[str, Mapping[str, Any]] = self.further.get("planes", {})
        return planes

    def picture(self, scan: str, number: int) -> str | None:
        """Where the picture of a target is; rejected candidates have numbers below zero."""
        pictures = self.further.get("pictures", {}).get(scan, {})
        name = pictures.get(str(number))
        return None if name is None else f"pictures/{name}"

    def picture_file(self, name: str) -> Path | None:
        """The file of a picture that the run listed, None if there is none of that name."""
        known = self.folder is not None and name in self.picture_names
        return self.folder / PICTURES / name if self.folder is not None and known else None

    @cached_property
    def picture_names(self) -> frozenset[str]:
        """Files of pictures that the run listed, those that are names and lead nowhere else."""
        pictures = self.further.get("pictures", {})
        files = {str(file) for of_scan in pictures.values() for file in of_scan.values()}
        return frozenset(f for f in files if Path(f).name == f and f not in ("", ".", ".."))

    @property
    def sigmas_of(self) -> str:
        """Of which run the sigmas in the clouds are."""
        when = self.further.get("date")
        return f"sigmas of points: run of {when}" if when else "sigmas of points: of the last run"


def _further(path: Path) -> Mapping[str, Any]:
    """What a run left for the workbench."""
    cure = "run the project again"
    try:
        data = read_json(path)
        if isinstance(data, dict) and data.get("schema") not in _BESIDE:
            raise InputError(f"the layout {data.get('schema')} is not known", file=path, cure=cure)
        return WorkbenchDocument.model_validate(data).model_dump(by_alias=True)
    except ValueError as error:
        first = str(error).splitlines()[0]
        raise InputError(f"this file is damaged ({first})", file=path, cure=cure) from error


def _frame(
    told: Mapping[str, Any] | None, beside: Path, poses: PoseFile | None, path: Path
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
        back = told["from_work"]
        return SceneFrame(
            told["kind"],
            told["crs"],
            tuple(told["axes"]),
            np.array(told["upright"], dtype=float),
            stations,
            None if back is None else StoredMap.from_facts(back),
            {name: StoredMap.from_facts(facts) for name, facts in told["maps"].items()},
            float(told["radius"]),
        )
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
