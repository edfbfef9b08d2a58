"""Displacements between epochs as the page draws them: from what ``tribrach epochs`` has found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.io.json_file import read_json
from tribrach.report.schema.epochs import EpochComparisonPart, EpochsDocument
from tribrach.workbench.frame import SceneFrame

__all__ = ["read_epochs", "scene_epochs"]

#: points of one name lie together within this distance, if both are in one frame [m]
_TOGETHER = 1.0
_AXES = "ENU"


def read_epochs(path: Path) -> list[EpochComparisonPart]:
    """Read comparisons of epochs.

    Parameters
    ----------
    path : Path
        What ``tribrach epochs --json`` wrote.

    Returns
    -------
    list of EpochComparisonPart
        In the order of the file.

    Raises
    ------
    InputError
        No such file, or one of something else.
    """
    try:
        return EpochsDocument.model_validate(read_json(path)).comparisons
    except ValueError as error:
        raise InputError(
            "this is no comparison of epochs",
            file=path,
            cure="give what tribrach epochs wrote with --json",
        ) from error


def scene_epochs(
    compared: Sequence[EpochComparisonPart], frame: SceneFrame, points: Mapping[str, Sequence[Any]]
) -> list[dict[str, Any]]:
    """Bring displacements into the frame of the clouds.

    Parameters
    ----------
    compared : sequence of EpochComparisonPart
        As they were read.
    frame : SceneFrame
        The frame of the clouds.
    points : mapping of str to sequence
        Coordinates of the points of the scene by name, to see whether both are in one frame.

    Returns
    -------
    list of dict
        Keys of :class:`tribrach.workbench.schema.SceneEpochs`.

    Raises
    ------
    InputError
        The epochs are in another frame than the results.
    """
    return [_scene(one, frame, points) for one in compared]


def _scene(
    one: EpochComparisonPart, frame: SceneFrame, points: Mapping[str, Sequence[Any]]
) -> dict[str, Any]:
    """One comparison in columns."""
    at = [_AXES.index(axis) for axis in one.axes]
    known = {name: p for name, p in one.points.items() if None not in p.xyz}
    rows = []
    for name, point in known.items():
        moved, covariance = np.zeros(3), np.zeros((3, 3))
        moved[at] = point.displacement
        covariance[np.ix_(at, at)] = np.array(point.covariance, dtype=float)
        rows.append(
            {"name": name, "xyz": point.xyz, "moved": moved.tolist(),
             "covariance": covariance.tolist()}
        )  # fmt: skip
    there = frame.of_adjusted({"points": rows, "stations": []})["points"]
    _refuse_elsewhere(one, there, points)
    same = ("test", "limit", "verdict", "reference", "detectable")
    return {
        "first": one.first,
        "second": one.second,
        "confidence": one.confidence,
        "axes": list(one.axes),
        "name": list(known),
        **{key: [row[key] for row in there] for key in ("xyz", "moved", "covariance")},
        **{key: [getattr(p, key) for p in known.values()] for key in same},
        "sentences": one.sentences,
    }


def _refuse_elsewhere(
    one: EpochComparisonPart, rows: Sequence[Mapping[str, Any]], points: Mapping[str, Sequence[Any]]
) -> None:
    """Refuse displacements whose points lie elsewhere than those of the scene.

    Raises
    ------
    InputError
        Half of the points that both have are far apart.
    """
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
