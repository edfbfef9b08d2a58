"""What is known of points of a scene: places, covariances, and what they have in common."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tribrach._types import Array
from tribrach.cloud.shared_part import SharedPart
from tribrach.errors import InputError
from tribrach.io.arrays import read_covariance_rows
from tribrach.io.clouds.copc_head import CloudPoint, nearest_point
from tribrach.job.cloud_file import stated_light
from tribrach.job.poses import ScanPose
from tribrach.report.numbers import Style
from tribrach.report.workbench_parts import JOINT
from tribrach.workbench.result_folder import ResultFolder

if TYPE_CHECKING:
    from tribrach.network.adjustment import Adjustment
    from tribrach.workbench.clouds import SceneCloudFile

#: a picked place is a point of the cloud within this distance [m]
_NEAR = 0.01


@dataclass(frozen=True)
class Picked:
    """A point of a cloud that somebody pointed at."""

    scan: ScanPose  #: where its scan stands, in the frame of the clouds
    point: CloudPoint  #: the point as the cloud has it

    @property
    def cosine(self) -> float | None:
        """Of the incidence angle, None where the cloud does not say."""
        angle = self.point.values.get("incidence")
        return None if angle is None or not np.isfinite(angle) else float(np.cos(np.radians(angle)))

    @property
    def light(self) -> float | None:
        """Intensity in the units of the scan, None where the cloud has none."""
        stored = self.point.values.get("intensity")
        if stored is None:
            return None
        return float(stated_light(self.point.facts, np.array([stored]))[0])


@dataclass(frozen=True)
class PointSources:
    """What queries about points are answered from."""

    beside: ResultFolder  #: what lies beside the result
    #: of the scene: coordinates and covariances in the frame of the clouds, by name
    points: Mapping[str, tuple[Array, Array]]
    stations: Mapping[str, tuple[Array, Array]]
    #: clouds by the name that the page has for them
    clouds: Mapping[str, SceneCloudFile] = field(default_factory=dict)
    adjustment: Adjustment | None = None  #: the network of a session as it is now
    factor: float = 1.0  #: on its covariances

    @property
    def style(self) -> Style:
        """How numbers are written."""
        return Style(self.beside.angle)

    @property
    def shared(self) -> SharedPart | None:
        """What the points of the clouds share, None where the run keeps no joint covariance."""
        return None if self.beside.pose_file is None else self.beside.pose_file.shared

    @cached_property
    def joint(self) -> tuple[list[str], Array] | None:
        """Points of the run, and their rows (3p, q + 3p) of the joint covariance; None without."""
        told = None if self.beside.further is None else self.beside.further.joint
        if told is None or self.beside.folder is None or self.shared is None:
            return None
        names, q = list(told.points), len(self.shared.covariance)
        if told.shared != q:
            return None
        path = self.beside.folder / JOINT
        return names, read_covariance_rows(path, 3 * len(names), q + 3 * len(names))

    def picked(self, cloud: str, place: Array) -> Picked:
        """The point of a cloud at a place (3,)."""
        file = self.clouds.get(cloud)
        if file is None:
            raise InputError(f"there is no cloud {cloud}", cure="pick a point that is shown")
        poses = self.beside.pose_file
        at = None if poses is None else poses.of_cloud(Path(file.source))
        if at is None:
            raise InputError(
                f"which scan the points of {cloud} are from is not known",
                cure="write one cloud for each scan: merged = false in [cloud]",
            )
        point = nearest_point(file.path, place, _NEAR)
        if point is None:
            raise InputError("no point of the cloud is there", cure="pick a point that is shown")
        return Picked(at, point)


def coordinates(text: str) -> Array | None:
    """Three numbers that are separated by commas, None of anything else."""
    parts = text.split(",")
    try:
        place = np.array([float(part) for part in parts])
    except ValueError:
        return None
    return place if len(place) == 3 and np.isfinite(place).all() else None
