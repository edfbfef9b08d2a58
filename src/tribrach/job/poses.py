"""The poses of all scans for other programs: poses.csv and poses.json beside the clouds.

One row per scan, in the order of the project, names stable; matrices are row-major and carry
points of the scanner frame into the frame of the clouds; covariances (6, 6) are of translation [m]
and left rotation increments [rad] about the axes of that frame. poses_covariance.npy holds the
joint covariance of the n stations (6n rows, in the order of ``stations`` in poses.json) and of the
effects that scanners have on all their points (in the order of ``effects``, where there are any):
what two stations share cancels only with it. poses_given.npy has what these rows have to do with
given values (in the order of ``given``), which other runs may have been given too.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from tribrach._types import Array, Index
from tribrach.cloud.placement import Placement
from tribrach.cloud.shared_part import GivenPart, SharedPart, checked_covariance
from tribrach.comparison.station_pair import StationPair
from tribrach.errors import InputError
from tribrach.geodesy.output_frame import OutputFrame
from tribrach.geometry.pose import Pose
from tribrach.instruments.common_errors import effects_model
from tribrach.instruments.correction import Correction
from tribrach.instruments.range_law import RangeLaw
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.arrays import (
    joint_covariance_bytes,
    read_covariance_rows,
    read_joint_covariance,
)
from tribrach.io.csv_rows import name_cell
from tribrach.io.json_file import read_json
from tribrach.io.json_text import json_text
from tribrach.io.poses.names import GIVEN, JOINT, POSES, POSES_TABLE
from tribrach.job.scans import StationScan
from tribrach.units import LARGEST

__all__ = [
    "GIVEN",
    "JOINT",
    "MOST_STATIONS",
    "PLACED",
    "POSES",
    "PoseFile",
    "pose_texts",
    "pose_words",
    "read_poses",
    "station_order",
]


#: the fact of a cloud of one scan that says by which pose it was placed
PLACED = "world from scanner"
#: poses are one where they differ by no more than the digits of that fact
_TURNED, _APART = 1e-7, 1e-4
#: with more stations the joint covariance is left out: it would have more than 46 MB
MOST_STATIONS = 400
#: more parameters and common errors than any job has
_MOST_EFFECTS = 4000
_ELEMENTS = [f"m{i}{j}" for i in range(4) for j in range(4)]
_UNKNOWNS = ("tx", "ty", "tz", "rx", "ry", "rz")


def pose_words(pose: Pose) -> str:
    """Three rows of a matrix, as a cloud carries them among its facts."""
    return "; ".join(
        " ".join(f"{v:.9g}" if k < 3 else f"{v:.4f}" for k, v in enumerate(row))
        for row in pose.matrix[:3]
    )


def station_order(scans: Sequence[StationScan]) -> list[str]:
    """Names of the stations in the order of their first scans."""
    return list(dict.fromkeys(scan.station for scan in scans))


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
        where = placements[scan.name].delivered(frame)
        matrix = [repr(float(x)) for x in where.pose.matrix.ravel()]
        covariance = [f"{where.covariance[i, j]:.9e}" for i, j in triangle]
        place = [frame.kind, frame.crs or "", "" if frame.epoch is None else frame.epoch]
        names = (scan.name, scan.station, scan.scan.path.name)
        writer.writerow([*map(name_cell, names), *matrix, *covariance, *place])
    return out.getvalue()


def poses_json(
    scans: Sequence[StationScan],
    placements: Mapping[str, Placement],
    frame: OutputFrame,
    sigma_origin: str,
    shared: SharedPart | None,
) -> dict[str, Any]:
    """The same as one JSON object, with the inverse matrices and the noise of single points.

    shared : what stations share, in this frame, None if no joint covariance is written beside it.
    """
    rows = []
    for scan in scans:
        where = placements[scan.name].delivered(frame)
        rows.append(
            {
                "scan": scan.name,
                "station": scan.station,
                "file": scan.scan.path.name,
                "world_from_scanner": where.pose.matrix.tolist(),
                "scanner_from_world": where.pose.inverse.matrix.tolist(),
                "covariance": np.asarray(where.covariance).tolist(),
                "noise": None if where.noise is None else _noise_figures(where.noise),
                "effects": None if shared is None else _effects(shared, scan.name),
            }
        )
    return {
        "schema": 1,
        "frame": {"kind": frame.kind, "crs": frame.crs, "epoch": frame.epoch, "axes": frame.axes},
        "covariance_of": "translation [m], left rotation increments [rad]",
        "noise_of": "single points: range [m], range_scale [m/m], horizontal and vertical [rad], "
        "beam_exit [m], beam_divergence [rad], systematic part of both angles [rad], beam_cone; "
        "law of ranges a I^b + c [m] for intensities I from low to high, times factors at knots",
        "sigma_origin": sigma_origin,
        "stations": station_order(scans),
        "effects": [] if shared is None else list(shared.effects),
        "joint_covariance": None if shared is None else JOINT,
        "given": [] if shared is None or shared.given is None else list(shared.given.keys),
        "scans": rows,
    }


def _noise_figures(noise: ScanNoise) -> dict[str, Any]:
    """Figures of the noise of single points; what few laws have only where it is."""
    figures = asdict(noise)
    if noise.incidence == 1:
        del figures["incidence"]
    if noise.law is not None and not noise.law.knots:
        del figures["law"]["knots"], figures["law"]["factors"]
    return figures


def _effects(shared: SharedPart, name: str) -> dict[str, Any] | None:
    """What a scanner does to all points of a scan: a model, and rows of the joint covariance."""
    share = shared.scans[name].calibration
    if share is None:
        return None
    model = share.correction.model
    return {
        "model": model.key or None,
        "unit_lengths": list(model.unit_lengths),
        **({"sweep": list(model.sweep)} if model.sweep else {}),
        "faces": share.correction.faces,
        "parameters": list(model.parameters),
        "rows": shared.columns[name][6:].tolist(),
    }


def pose_texts(
    folder: Path,
    scans: Sequence[StationScan],
    placements: Mapping[str, Placement],
    frame: OutputFrame,
    sigma_origin: str,
    shared: SharedPart | None,
) -> dict[Path, str | bytes]:
    """Contents of poses.csv, poses.json and the joint covariance by their paths.

    placements : in the work frame, by the names of the scans; shared : what they share, in the
    frame of the clouds, None if that is left out.
    """
    data = poses_json(scans, placements, frame, sigma_origin, shared)
    texts: dict[Path, str | bytes] = {
        folder / POSES_TABLE: poses_csv(scans, placements, frame),
        folder / POSES: json_text(data, indent=1) + "\n",
    }
    if shared is not None:
        texts[folder / JOINT] = joint_covariance_bytes(shared.covariance)
        if shared.given is not None:
            stacked = np.concatenate([shared.given.cross, shared.given.covariance])
            texts[folder / GIVEN] = joint_covariance_bytes(stacked)
    return texts


# The poses that a run left beside its clouds, read again: where, how certain, with what noise.
#
# ``poses.json`` names scans and stations; ``poses_covariance.npy`` beside it holds their joint
# covariance. Neither file is trusted: sizes are bounded, shapes and numbers are checked, nothing is
# unpickled.


_CURE = "give the poses.json that was written beside the clouds"


@dataclass(frozen=True)
class ScanPose:
    """A scan with its placement in the frame of the clouds; certain : is a covariance given?"""

    scan: str
    file: str
    placement: Placement
    certain: bool

    def placed(self, facts: Mapping[str, str]) -> bool | None:
        """Whether the facts of a cloud say that it was placed by this pose; None if they do not."""
        try:
            rows = [[float(v) for v in row.split()] for row in facts[PLACED].split(";")]
            told = np.array(rows, dtype=np.float64)
        except (KeyError, ValueError):
            return None
        if told.shape != (3, 4) or not (np.abs(told) < LARGEST).all():
            return None
        off = np.abs(told - self.placement.pose.matrix[:3])
        return bool((off[:, :3] <= _TURNED).all() and (off[:, 3] <= _APART).all())


@dataclass(frozen=True)
class PoseFile:
    """All scans of a run; shared : what their points share, None if that is not known."""

    path: Path
    scans: tuple[ScanPose, ...]
    stations: tuple[str, ...]
    shared: SharedPart | None

    def of_cloud(self, cloud: Path) -> ScanPose | None:
        """The scan that a cloud was made of, by its name; None if none or several are."""
        stem = cloud.stem.removesuffix(".copc")
        named = [s for s in self.scans if stem in (s.scan, _plain(s.scan))]
        named = named or [s for s in self.scans if s.file == cloud.name]
        return named[0] if len(named) == 1 else None

    def pair(self, first: ScanPose, second: ScanPose) -> StationPair | None:
        """Two scans with their joint covariance; None where that is not known."""
        if self.shared is None or not {first.scan, second.scan} <= set(self.shared.scans):
            return None
        return StationPair.of(self.shared, first.scan, second.scan)


def read_poses(path: Path) -> PoseFile:
    """Poses, covariances and noise; what older files do not have is unknown."""
    try:
        data: dict[str, Any] = read_json(path)
        scans = tuple(_scan(path, row) for row in data["scans"])
        stations = tuple(str(name) for name in data.get("stations", ()))
        effects = tuple(str(name) for name in data.get("effects") or ())
        given = tuple(str(key) for key in data.get("given") or ())
        models = [_model(path, row) for row in data["scans"]]
        joint = data.get("joint_covariance") is not None
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        raise InputError("this is no file of poses", file=path, cure=_CURE) from error
    known = joint and 0 < len(stations) <= MOST_STATIONS and len(effects) <= _MOST_EFFECTS
    shared = _shared(path, scans, models, stations, effects, given) if known else None
    return PoseFile(path, scans, stations, shared)


def _shared(
    path: Path,
    scans: Sequence[ScanPose],
    models: Sequence[tuple[Correction, Index] | None],
    stations: tuple[str, ...],
    effects: tuple[str, ...],
    given: tuple[str, ...],
) -> SharedPart:
    """What the scans of a file share, with the joint covariance beside it."""
    beside = path.parent / JOINT
    covariance = read_joint_covariance(beside, len(stations), len(effects))
    count = len(covariance)
    try:
        checked_covariance(covariance, count, "the poses")
    except InputError as error:
        raise InputError(error.what, file=beside, cure="run the project again") from error
    placed, columns = {}, {}
    for scan, model in zip(scans, models, strict=True):
        where = scan.placement
        if where.station not in stations:
            continue
        rows = 6 * stations.index(where.station) + np.arange(6)
        correction = None
        if model is not None:
            correction, further = model
            if not ((further >= 6 * len(stations)) & (further < count)).all():
                raise InputError(
                    f"the effects of {scan.scan} are not in the joint covariance",
                    file=path,
                    cure=_CURE,
                )
            rows = np.concatenate([rows, further])
        columns[scan.scan] = rows
        placed[scan.scan] = where.station, where.pose, where.noise, correction
    part = _given(path, given, count)
    return SharedPart.assembled(placed, columns, covariance, stations, effects, part)


def _given(path: Path, keys: tuple[str, ...], count: int) -> GivenPart | None:
    """What the rows of the joint covariance have to do with given values, None without any."""
    m = len(keys)
    if not 0 < m <= _MOST_EFFECTS or len(set(keys)) != m:
        return None
    beside = path.parent / GIVEN
    if not beside.is_file():
        # poses that were copied without it: what other runs were given too is not known
        return None
    what = f"covariance of the stations with {m} given values"
    stacked = read_covariance_rows(beside, count + m, m, what)
    try:
        checked_covariance(stacked[count:], m, "the given values")
    except InputError as error:
        raise InputError(error.what, file=beside, cure="run the project again") from error
    return GivenPart(keys, stacked[count:], stacked[:count])


def _model(path: Path, row: Mapping[str, Any]) -> tuple[Correction, Index] | None:
    """The model of a scan's effects with their rows of the joint covariance, None without any."""
    given = row.get("effects")
    if given is None:
        return None
    names = [str(name) for name in given["parameters"]]
    rows = _numbers(path, given["rows"], (len(names),), f"the effects of {row['scan']}")
    faces = given["faces"]
    if faces not in ("front", "back", "dome") or len(names) > _MOST_EFFECTS:
        raise ValueError("faces")
    units, sweep = (
        [float(value) for value in given.get(key) or ()] for key in ("unit_lengths", "sweep")
    )
    try:
        model = effects_model(given["model"], names, units, sweep)
    except InputError as error:
        raise InputError(error.what, file=path, cure=_CURE) from error
    return Correction(model, np.zeros(len(names)), faces), rows.astype(np.int64)


def _scan(path: Path, row: Mapping[str, Any]) -> ScanPose:
    name = str(row["scan"])
    matrix = _numbers(path, row["world_from_scanner"], (4, 4), f"the pose of {name}")
    given = row.get("covariance")
    covariance = np.zeros((6, 6))
    if given is not None:
        covariance = _numbers(path, given, (6, 6), f"the covariance of {name}")
    pose = Pose(matrix[:3, :3], matrix[:3, 3])
    where = Placement(str(row.get("station", name)), pose, covariance, _noise(path, name, row))
    return ScanPose(name, str(row["file"]), where, given is not None)


def _noise(path: Path, name: str, row: Mapping[str, Any]) -> ScanNoise | None:
    """Noise of single points, None where the run knew none."""
    given = row.get("noise")
    if given is None:
        return None
    keys = [f.name for f in fields(ScanNoise) if f.name not in ("law", "shared_share")]
    # poses of earlier runs have no systematic part, no cones and nothing of neighbours
    later = {"systematic": 0.0, "beam_cone": 0.0, "shared_angle": 0.0, "incidence": 1.0}
    figures = [given.get(key, later[key]) if key in later else given[key] for key in keys]
    values = _numbers(path, figures, (len(keys),), f"the noise of {name}")
    if (values < 0).any():
        raise InputError(f"the noise of {name} is negative", file=path, cure=_CURE)
    noise = dict(zip(keys, values.tolist(), strict=True))
    law = _law(path, name, given.get("law"))
    share = given.get("shared_share")
    if share is not None:
        share = float(_numbers(path, [share], (1,), f"what neighbours of {name} share")[0])
    more = {"beam_cone": noise["beam_cone"] > 0, "law": law, "shared_share": share}
    try:
        return ScanNoise(**noise | more)
    except InputError as error:
        raise InputError(f"{name}: {error.what}", file=path, cure=_CURE) from error


def _law(path: Path, name: str, given: Mapping[str, Any] | None) -> RangeLaw | None:
    """The law of the noise of ranges, None without one, as in poses of earlier runs."""
    if given is None:
        return None
    keys = ("a", "b", "c", "low", "high")
    values = _numbers(path, [given[key] for key in keys], (len(keys),), f"the noise of {name}")
    term = [given.get(key) or () for key in ("knots", "factors")]
    knots, factors = (_numbers(path, x, (len(x),), f"the noise of {name}").tolist() for x in term)
    try:
        a, b, c, low, high = values.tolist()
        return RangeLaw(a, b, c, low, high, tuple(knots), tuple(factors))
    except InputError as error:
        raise InputError(f"{name}: {error.what}", file=path, cure=_CURE) from error


def _numbers(path: Path, given: Any, shape: tuple[int, ...], what: str) -> Array:
    """Finite numbers of a shape."""
    try:
        values = np.array(given, dtype=np.float64)
    except (ValueError, TypeError) as error:
        raise InputError(f"{what} is not made of numbers", file=path, cure=_CURE) from error
    if values.shape != shape or not (np.abs(values) < LARGEST).all():
        size = "x".join(str(n) for n in shape)
        raise InputError(f"{what} is not made of {size} numbers", file=path, cure=_CURE)
    return values


def _plain(name: str) -> str:
    """The name of a scan as files are named after it."""
    return re.sub(r"[^\w.-]", "_", name).strip(".")
