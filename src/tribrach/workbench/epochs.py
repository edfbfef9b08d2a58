"""Displacements between epochs as the page draws them: from what ``tribrach epochs`` has found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.json_file import read_json
from tribrach.questions.epochs.chapters import FORM, EpochComparisons
from tribrach.report.epochs import EpochComparison
from tribrach.report.numbers import number
from tribrach.workbench.frame import SceneFrame

#: points of one name lie together within this distance, if both are in one frame [m]
_TOGETHER = 1.0
_AXES = "ENU"


def read_epochs(path: Path) -> tuple[EpochComparison, ...]:
    """Read comparisons of epochs."""
    try:
        found: EpochComparisons = FORM.read(read_json(path))
    except (ValueError, AttributeError) as error:
        raise InputError(
            "this is no comparison of epochs",
            file=path,
            cure="give what tribrach epochs wrote with --json",
        ) from error
    return found.comparisons


def scene_epochs(
    compared: Sequence[EpochComparison], frame: SceneFrame, points: Mapping[str, Sequence[Any]]
) -> list[dict[str, Any]]:
    """Bring displacements into the frame of the clouds."""
    return [_scene(one, frame, points) for one in compared]


def _scene(
    one: EpochComparison, frame: SceneFrame, points: Mapping[str, Sequence[Any]]
) -> dict[str, Any]:
    """One comparison in columns."""
    at = [_AXES.index(axis) for axis in one.axes]
    known = {name: p for name, p in one.points.items() if np.isfinite(p.xyz).all()}
    rows = []
    for name, point in known.items():
        moved, covariance = np.zeros(3), np.zeros((3, 3))
        moved[at] = point.vector
        covariance[np.ix_(at, at)] = point.covariance
        rows.append(
            {"name": name, "xyz": point.xyz.tolist(), "moved": moved.tolist(),
             "covariance": covariance.tolist()}
        )  # fmt: skip
    there = frame.of_adjusted({"points": rows, "stations": []})["points"]
    _refuse_elsewhere(one, there, points)
    figures = {"test": "statistic", "limit": "limit", "detectable": "detectable"}
    return {
        "first": one.first,
        "second": one.second,
        "confidence": one.confidence,
        "axes": list(one.axes),
        "name": list(known),
        **{key: [row[key] for row in there] for key in ("xyz", "moved", "covariance")},
        **{
            key: [number(getattr(p, name)) for p in known.values()] for key, name in figures.items()
        },
        "verdict": [p.answer for p in known.values()],
        "reference": [p.reference for p in known.values()],
        "sentences": list(one.sentences),
    }


def _refuse_elsewhere(
    one: EpochComparison, rows: Sequence[Mapping[str, Any]], points: Mapping[str, Sequence[Any]]
) -> None:
    """Refuse displacements whose points lie elsewhere than those of the scene."""
    pairs = [(row["xyz"], points[row["name"]]) for row in rows if row["name"] in points]
    pairs = [(a, b) for a, b in pairs if b is not None and None not in b]
    if not pairs:
        return
    gaps: Array = np.linalg.norm(np.array([np.subtract(a, b) for a, b in pairs]), axis=1)
    if float(np.median(gaps)) > _TOGETHER:
        raise InputError(
            f"points of the epochs {one.first} and {one.second} lie {np.median(gaps):.0f} m beside "
            "those of the results",
            cure="compare epochs in the work frame of this project",
        )
