"""The poses of all scans for other programs: poses.csv and poses.json beside the clouds.

One row per scan, in the order of the project, names stable; matrices are row-major and carry
points of the scanner frame into the frame of the clouds; covariances (6, 6) are of translation [m]
and left rotation increments [rad] about the axes of that frame.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tribrach.cloud.placement import Placement
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geometry.pose import Pose
from tribrach.stages.scans import StationScan

__all__ = ["delivered", "pose_texts", "poses_csv", "poses_json"]

_ELEMENTS = [f"m{i}{j}" for i in range(4) for j in range(4)]
_UNKNOWNS = ("tx", "ty", "tz", "rx", "ry", "rz")


def delivered(where: Placement, frame: OutputFrame) -> Placement:
    """A placement in the frame of the clouds: exact at the station, rigid around it."""
    at = where.pose.translation
    turned = where.turned(frame.rotation(at))
    pose = Pose(turned.pose.rotation, frame.from_work(at[None])[0])
    return Placement(where.station, pose, turned.covariance, where.noise)


def poses_csv(
    scans: Sequence[StationScan], placements: Mapping[str, Placement], frame: OutputFrame
) -> str:
    """One row per scan: names, file, matrix, lower triangle of the covariance, frame."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    triangle = [(i, j) for i in range(6) for j in range(i + 1)]
    head = [f"c_{_UNKNOWNS[i]}_{_UNKNOWNS[j]}" for i, j in triangle]
    writer.writerow(["scan", "station", "file", *_ELEMENTS, *head, "frame", "crs", "epoch"])
    for scan in scans:
        where = delivered(placements[scan.name], frame)
        matrix = [repr(float(x)) for x in where.pose.matrix.ravel()]
        covariance = [f"{where.covariance[i, j]:.9e}" for i, j in triangle]
        place = [frame.kind, frame.crs or "", "" if frame.epoch is None else frame.epoch]
        writer.writerow(
            [scan.name, scan.station, scan.scan.path.name, *matrix, *covariance, *place]
        )
    return out.getvalue()


def poses_json(
    scans: Sequence[StationScan],
    placements: Mapping[str, Placement],
    frame: OutputFrame,
    sigma_origin: str,
) -> dict[str, Any]:
    """The same as one JSON object, with the inverse matrices."""
    rows = []
    for scan in scans:
        where = delivered(placements[scan.name], frame)
        rows.append(
            {
                "scan": scan.name,
                "station": scan.station,
                "file": scan.scan.path.name,
                "world_from_scanner": where.pose.matrix.tolist(),
                "scanner_from_world": where.pose.inverse.matrix.tolist(),
                "covariance": np.asarray(where.covariance).tolist(),
            }
        )
    return {
        "schema": 1,
        "frame": {"kind": frame.kind, "crs": frame.crs, "epoch": frame.epoch, "axes": frame.axes},
        "covariance_of": "translation [m], left rotation increments [rad]",
        "sigma_origin": sigma_origin,
        "scans": rows,
    }


def pose_texts(
    folder: Path,
    scans: Sequence[StationScan],
    placements: Mapping[str, Placement],
    frame: OutputFrame,
    sigma_origin: str,
) -> dict[Path, str]:
    """Texts of poses.csv and poses.json by their paths."""
    data = poses_json(scans, placements, frame, sigma_origin)
    return {
        folder / "poses.csv": poses_csv(scans, placements, frame),
        folder / "poses.json": json.dumps(data, indent=1) + "\n",
    }
