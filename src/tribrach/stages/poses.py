"""The poses of all scans for other programs: poses.csv and poses.json beside the clouds.

One row per scan, in the order of the project, names stable; matrices are row-major and carry
points of the scanner frame into the frame of the clouds; covariances (6, 6) are of translation [m]
and left rotation increments [rad] about the axes of that frame. poses_covariance.npy holds the
joint covariance (6n, 6n) of the n stations, in the order of ``stations`` in poses.json: what two
stations share cancels only with it.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach.cloud.placement import Placement
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geometry.pose import Pose
from tribrach.network.adjustment import Adjustment
from tribrach.stages.scans import StationScan

__all__ = [
    "JOINT",
    "MOST_STATIONS",
    "delivered",
    "joint_covariance",
    "pose_texts",
    "poses_csv",
    "poses_json",
    "station_order",
]

Array = NDArray[np.float64]

#: file of the joint covariance, beside the poses
JOINT = "poses_covariance.npy"
#: with more stations the joint covariance is left out: it would have more than 46 MB
MOST_STATIONS = 400

_ELEMENTS = [f"m{i}{j}" for i in range(4) for j in range(4)]
_UNKNOWNS = ("tx", "ty", "tz", "rx", "ry", "rz")


def delivered(where: Placement, frame: OutputFrame) -> Placement:
    """A placement in the frame of the clouds: exact at the station, rigid around it."""
    at = where.pose.translation
    turned = where.turned(frame.rotation(at))
    pose = Pose(turned.pose.rotation, frame.from_work(at[None])[0])
    return Placement(where.station, pose, turned.covariance, where.noise)


def station_order(scans: Sequence[StationScan]) -> list[str]:
    """Names of the stations in the order of their first scans."""
    return list(dict.fromkeys(scan.station for scan in scans))


def joint_covariance(
    adjustment: Adjustment,
    stations: Sequence[str],
    frame: OutputFrame,
    factor: float = 1.0,
) -> Array:
    """Covariance (6n, 6n) of n stations [m, rad] about the axes of the clouds' frame.

    factor : on a-priori covariances (a posteriori variance).
    """
    columns = np.concatenate([adjustment.columns(name) for name in stations])
    state = adjustment.state
    turn = np.zeros((len(columns), len(columns)))
    for k, name in enumerate(stations):
        at = state.pose_t[state.layout.index("pose", name)]
        for part in (6 * k, 6 * k + 3):
            turn[part : part + 3, part : part + 3] = frame.rotation(at)
    joint: Array = factor * turn @ adjustment.covariance_columns(columns, columns) @ turn.T
    return 0.5 * (joint + joint.T)


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
    joint: bool = True,
) -> dict[str, Any]:
    """The same as one JSON object, with the inverse matrices and the noise of single points.

    joint : is the joint covariance written beside it?
    """
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
                "noise": None if where.noise is None else asdict(where.noise),
            }
        )
    return {
        "schema": 1,
        "frame": {"kind": frame.kind, "crs": frame.crs, "epoch": frame.epoch, "axes": frame.axes},
        "covariance_of": "translation [m], left rotation increments [rad]",
        "noise_of": "single points: range [m], range_scale [m/m], horizontal and vertical [rad], "
        "beam_exit [m], beam_divergence [rad]",
        "sigma_origin": sigma_origin,
        "stations": station_order(scans),
        "joint_covariance": JOINT if joint else None,
        "scans": rows,
    }


def pose_texts(
    folder: Path,
    scans: Sequence[StationScan],
    placements: Mapping[str, Placement],
    frame: OutputFrame,
    sigma_origin: str,
    joint: Array | None,
) -> dict[Path, str | bytes]:
    """Contents of poses.csv, poses.json and the joint covariance (6n, 6n) by their paths."""
    data = poses_json(scans, placements, frame, sigma_origin, joint is not None)
    texts: dict[Path, str | bytes] = {
        folder / "poses.csv": poses_csv(scans, placements, frame),
        folder / "poses.json": json.dumps(data, indent=1) + "\n",
    }
    if joint is not None:
        packed = io.BytesIO()
        np.save(packed, joint, allow_pickle=False)
        texts[folder / JOINT] = packed.getvalue()
    return texts
