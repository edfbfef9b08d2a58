"""What a program says of the scenes: one JSON file, read strictly (README.md has its form)."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.coverage.world import Array

__all__ = ["Answer", "BadSubmission", "Point", "Pose", "Submission", "read"]


class BadSubmission(ValueError):
    """A file that is not a submission; the text says where and why."""


@dataclass(frozen=True)
class Pose:
    """``first_from_scan`` (4, 4) and the covariance (6, 6) of shift [m] and left turn [rad]."""

    matrix: Array
    covariance: Array

    def as_json(self) -> dict[str, Any]:
        """As it stands in a submission."""
        return {"first_from_scan": self.matrix.tolist(), "covariance": self.covariance.tolist()}


@dataclass(frozen=True)
class Point:
    """A place (3,) in the frame of the first scan [m] and its covariance (3, 3)."""

    xyz: Array
    covariance: Array

    def as_json(self) -> dict[str, Any]:
        """As it stands in a submission."""
        return {"xyz": self.xyz.tolist(), "covariance": self.covariance.tolist()}


@dataclass(frozen=True)
class Answer:
    """What is said of one scene; a text instead of a pose is the reason of a refusal."""

    seconds: float
    poses: dict[str, Pose | str]
    points: dict[str, Point]

    def as_json(self) -> dict[str, Any]:
        """As it stands in a submission."""
        poses = {
            n: {"refused": p} if isinstance(p, str) else p.as_json() for n, p in self.poses.items()
        }
        points = {n: p.as_json() for n, p in self.points.items()}
        return {"seconds": self.seconds, "poses": poses, "points": points}


@dataclass(frozen=True)
class Submission:
    """What one program says of all scenes."""

    program: str
    scenes: dict[str, Answer]
    #: a sentence on where its covariances come from
    settings: str = ""

    def write(self, file: Path) -> None:
        """Write it as JSON."""
        scenes = {n: answer.as_json() for n, answer in self.scenes.items()}
        whole = {"schema": 1, "program": self.program, "settings": self.settings, "scenes": scenes}
        file.write_text(json.dumps(whole, indent=1) + "\n")


def read(file: Path) -> Submission:
    """Read a submission.

    Raises
    ------
    BadSubmission
        Something is not in the form of the README.
    """
    try:
        whole = json.loads(file.read_text())
        if whole["schema"] != 1:
            raise BadSubmission(f"{file}: schema {whole['schema']} is not known; it is 1")
        scenes = {n: answer(a, f"{file}: {n}") for n, a in whole["scenes"].items()}
        return Submission(str(whole["program"]), scenes, str(whole.get("settings", "")))
    except (KeyError, TypeError, AttributeError, json.JSONDecodeError) as error:
        raise BadSubmission(f"{file} is not a submission: {error!r}") from None


def answer(given: dict[str, Any], where: str) -> Answer:
    """An answer of a submission."""
    poses: dict[str, Pose | str] = {}
    for scan, pose in given["poses"].items():
        if pose is None or "refused" in pose:
            poses[scan] = str(pose["refused"]) if pose else "no reason given"
        else:
            place = f"{where}, {scan}"
            poses[scan] = Pose(_matrix(pose, place), _covariance(pose["covariance"], 6, place))
    points = {
        n: Point(_array(p["xyz"], (3,), f"{where}, {n}"), _covariance(p["covariance"], 3, where))
        for n, p in (given.get("points") or {}).items()
    }
    return Answer(float(given.get("seconds", 0.0)), poses, points)


def _array(given: object, shape: tuple[int, ...], where: str) -> Array:
    try:
        out = np.array(given, dtype=float)
    except (TypeError, ValueError):
        raise BadSubmission(f"{where}: {given!r} is not an array of numbers") from None
    if out.shape != shape or not np.isfinite(out).all():
        raise BadSubmission(f"{where}: an array {shape} of finite numbers is needed")
    return out


def _matrix(pose: dict[str, Any], where: str) -> Array:
    if "first_from_scan" not in pose:
        out = np.eye(4)
        out[:3, 3] = _array(pose["translation"], (3,), where)
        turn = _array(pose["rotation_vector"], (3,), where)
        out[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
        return out
    out = _array(pose["first_from_scan"], (4, 4), where)
    rotation = out[:3, :3]
    if np.abs(out[3] - [0, 0, 0, 1]).max() > 1e-9:
        raise BadSubmission(f"{where}: the last row of the matrix is not 0 0 0 1 (transposed?)")
    if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-6:
        raise BadSubmission(f"{where}: the matrix shears or scales")
    if np.linalg.det(rotation) < 0:
        raise BadSubmission(f"{where}: the matrix mirrors (a left-handed frame?)")
    return out


def _covariance(given: object, size: int, where: str) -> Array:
    out = _array(given, (size, size), where)
    scale = np.sqrt(np.abs(np.diag(out)))
    if not (np.diag(out) > 0).all():
        raise BadSubmission(f"{where}: a variance is zero or negative")
    correlation = out / np.outer(scale, scale)
    if np.abs(correlation - correlation.T).max() > 1e-6:
        raise BadSubmission(f"{where}: the covariance is not symmetric")
    if np.linalg.eigvalsh(correlation)[0] <= 1e-12:
        raise BadSubmission(f"{where}: the covariance is not positive definite")
    return out
