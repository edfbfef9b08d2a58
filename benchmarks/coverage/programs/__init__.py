"""One file for each program that is measured; one that is not installed is left out with a word.

A file has ``SETTINGS``, a sentence on how the program is called and where its covariance comes
from, and ``register(scene)``, which gives a :class:`Found` or the reason of a refusal for each scan
but the first. Where the program has no covariance, ``Found.covariance`` is None, and a constant one
stands in its place that makes 95 % of the scenes of calibration right.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from types import ModuleType

import numpy as np

from benchmarks.coverage.scenes import Scene
from benchmarks.coverage.submission import Point, Pose
from benchmarks.coverage.world import Array

__all__ = ["PROGRAMS", "Found", "load", "moved", "placed"]

#: files of this folder, in the order of the table
PROGRAMS = (
    "tribrach", "tribrach_started", "small_gicp", "open3d", "kiss_matcher", "kiss_icp",
    "cloudcompare",
)  # fmt: skip
ARCSEC = np.pi / 180 / 3600


@dataclass(frozen=True)
class Found:
    """``first_from_scan`` (4, 4), and its covariance (6, 6) if the program has one."""

    matrix: Array
    covariance: Array | None = None


def load(name: str) -> ModuleType | str:
    """The file of a program, or why it cannot be run here."""
    try:
        return import_module(f"benchmarks.coverage.programs.{name}")
    except (ImportError, OSError) as error:
        return str(error)


def moved(points: Array, pose: Array) -> Array:
    """Points (n, 3) by a pose (4, 4)."""
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])


def placed(scene: Scene, poses: Mapping[str, Pose]) -> dict[str, Point]:
    """Check points by poses and their covariances, and the noise that the data sheet states."""
    sheet, out = scene.given["scanner"], {}
    for name, point in scene.given["points"].items():
        pose = poses.get(point["scan"])
        if pose is None:
            continue
        local = np.array(point["xyz"])
        distance = float(np.linalg.norm(local))
        along = local / distance
        ranges = sheet["range_noise_mm"] / 1e3 + sheet["range_noise_ppm"] * 1e-6 * distance
        turns = np.hypot(sheet["angle_noise_arcsec"], sheet["angle_systematic_arcsec"]) * ARCSEC
        beam = sheet["beam_diameter_mm"] / 1e3 + sheet["beam_divergence_mrad"] / 1e3 * distance
        across = (turns * distance) ** 2 + (beam / 4) ** 2
        own = across * np.eye(3) + (ranges**2 - across) * np.outer(along, along)
        rotation = pose.matrix[:3, :3]
        x, y, z = rotation @ local
        effect = np.hstack([np.eye(3), [[0, z, -y], [-z, 0, x], [y, -x, 0]]])
        covariance = effect @ pose.covariance @ effect.T + rotation @ own @ rotation.T
        out[name] = Point(moved(local, pose.matrix), covariance)
    return out
