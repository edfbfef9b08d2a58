"""What is kept of a state of a session: places, covariances and tests by name, to compare later."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry import rotation
from tribrach.io.result_file import RESULT, read_result_file
from tribrach.network.adjustment import Adjustment
from tribrach.network.observation_rows import ObservationRows
from tribrach.network.quality import global_test
from tribrach.network.roles import used_axes
from tribrach.sentences import capital

#: columns of the table of observations that are kept for comparison
FIGURES = ("id", "component", "state", "residual", "w")


@dataclass(frozen=True)
class Snapshot:
    """Positions and poses of one state, by name, in the work frame."""

    #: name to coordinates (3,) [m], NaN along axes that the network does not have
    points: Mapping[str, Array]
    point_covariances: Mapping[str, Array]  #: name to covariance (3, 3) [m^2]
    stations: Mapping[str, Array]  #: name to pose (4, 4), world from scanner
    #: name to covariance (6, 6), translation and then left rotation increments [m, rad]
    station_covariances: Mapping[str, Array]
    #: sigma of unit weight, redundancy and global test, by the keys of ``result.json``
    sigma0: Mapping[str, Any] = field(default_factory=dict)
    #: columns of the observations with their ids, components and figures; empty until it was
    #: tested
    tests: Mapping[str, Sequence[Any] | NDArray[Any]] = field(default_factory=dict)


def snapshot(adjustment: Adjustment, posterior: bool, confidence: float) -> Snapshot:
    """Places and covariances of an adjustment, scaled as reports state them."""
    layout, state = adjustment.layout, adjustment.state
    factor = adjustment.variance_factor(posterior=posterior)
    names, stations = layout.names["point"], layout.names["pose"]
    xyz = np.where(used_axes(adjustment), state.points, np.nan)
    poses = np.tile(np.eye(4), (len(stations), 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = state.pose_r, state.pose_t
    return Snapshot(
        dict(zip(names, xyz, strict=True)),
        dict(zip(names, factor * adjustment.family_covariances("point"), strict=True)),
        dict(zip(stations, poses, strict=True)),
        dict(zip(stations, factor * adjustment.family_covariances("pose"), strict=True)),
        sigma0_block(adjustment, posterior, confidence),
    )


def sigma0_block(adjustment: Adjustment, posterior: bool, confidence: float) -> dict[str, Any]:
    """Sigma of unit weight, redundancy, global test, by the keys of ``result.json``."""
    test = global_test(adjustment, 1 - confidence)
    words = test.sentence()
    return {
        "prior": adjustment.sigma0,
        "posterior": _number(adjustment.sigma0_posterior),
        "dof": adjustment.dof,
        "vtpv": adjustment.vtpv,
        "covariances": "posterior" if adjustment.scaled(posterior=posterior) else "prior",
        "global_test": {
            "statistic": test.vtpv,
            "lower": _number(test.lower),
            "upper": _number(test.upper),
            "alpha": test.alpha,
            "accepted": test.passed,
        },
        "words": f"{capital(words)}. {adjustment.network.edits_sentence}".rstrip(),
    }


def with_tests(snap: Snapshot, observations: ObservationRows) -> Snapshot:
    """A state with the figures of its observations."""
    return replace(snap, tests={name: observations.column(name) for name in FIGURES})


def last_run(folder: Path) -> Snapshot | None:
    """What the last run left in its folder; None if there is nothing that can be read."""
    try:
        data = read_result_file(folder / RESULT)
        stations = {
            str(name): station
            for name, station in data["stations"].items()
            if station["world_from_scanner"] is not None
        }
        return Snapshot(
            {str(n): _array(p["xyz"], (3,)) for n, p in data["points"].items()},
            {str(n): _array(p["covariance"], (3, 3)) for n, p in data["points"].items()},
            {n: _array(s["world_from_scanner"], (4, 4)) for n, s in stations.items()},
            {n: _array(s["covariance"], (6, 6)) for n, s in stations.items()},
            dict(data["sigma0"]),
            {name: [row[name] for row in data["observations"]] for name in FIGURES},
        )
    except (InputError, ValueError, KeyError, TypeError, AttributeError):
        return None


def _array(values: Any, shape: tuple[int, ...]) -> Array:
    """Numbers of a file, null as NaN."""
    # None becomes NaN
    numbers = np.array(values, dtype=float)
    if numbers.shape != shape:
        raise ValueError(f"an array of the shape {numbers.shape}")
    return numbers


def moves(now: Snapshot, before: Snapshot) -> dict[str, Any]:
    """How points and stations moved; ``before`` holds covariances, None of those without."""
    points = _rows(now.points, before.points, (3,))
    covariances = _blocks(now.point_covariances, now.points, 3)
    old = _blocks(before.point_covariances, now.points, 3)
    for row, own, was in zip(points, covariances, old, strict=True):
        row["covariance"], row["before"] = own, was
    here = {name: pose[:3, 3] for name, pose in now.stations.items()}
    there = {name: pose[:3, 3] for name, pose in before.stations.items()}
    stations = _rows(here, there, (3,))
    covariances = _blocks(now.station_covariances, now.stations, 6)
    old = _blocks(before.station_covariances, now.stations, 6)
    for row, own, was in zip(stations, covariances, old, strict=True):
        row["covariance"], row["before"] = own, was
        pose, last = now.stations[row["name"]], before.stations.get(row["name"])
        del row["xyz"]
        row["world_from_scanner"], row["turned"] = plain(pose), None
        if last is not None:
            turn = rotation.log((pose[:3, :3] @ last[:3, :3].T)[None])[0]
            row["turned"] = float(np.linalg.norm(turn))
    most = max(
        (row for row in (*points, *stations) if row["moved_length"]),
        key=lambda row: float(row["moved_length"]),
        default={"name": "", "moved_length": 0.0},
    )
    largest = {"name": most["name"], "moved": most["moved_length"]}
    return {"points": points, "stations": stations, "largest": largest}


def _rows(
    now: Mapping[str, Array], before: Mapping[str, Array], shape: tuple[int, ...]
) -> list[dict[str, Any]]:
    """Name, place and move of everything that there is now."""
    if not now:
        return []
    unknown = np.full(shape, np.nan)
    places = np.array(list(now.values()))
    shift = places - np.array([before.get(name, unknown) for name in now])
    # along the axes that both states have
    length = np.linalg.norm(np.nan_to_num(shift), axis=1).tolist()
    columns = zip(now, plain(places), plain(shift), length, strict=True)
    return [
        {
            "name": name,
            "xyz": xyz,
            "moved": moved if name in before else None,
            "moved_length": far if name in before else None,
        }
        for name, xyz, moved, far in columns
    ]


def _blocks(blocks: Mapping[str, Array], names: Iterable[str], width: int) -> list[Any]:
    """Covariances of names as nested lists, None where one is not known."""
    unknown = np.full((width, width), np.nan)
    known = [blocks.get(name, unknown) for name in names]
    if not known:
        return []
    return [
        rows if name in blocks else None
        for name, rows in zip(names, plain(np.array(known)), strict=True)
    ]


def compared(a: Snapshot, b: Snapshot) -> dict[str, Any]:
    """Two states side by side: moves from a to b with old and new covariances, sigma0, tests."""
    sides = {"a": _by_key(a), "b": _by_key(b)}
    keys = list(dict.fromkeys((*sides["a"], *sides["b"])))
    columns: dict[str, list[Any]] = {
        "id": [key[0] for key in keys],
        "component": [key[1] for key in keys],
    }
    for side, found in sides.items():
        rows = [found.get(key, (None, None, None)) for key in keys]
        for k, name in enumerate(("state", "residual", "w")):
            columns[f"{name}_{side}"] = [_number(row[k]) for row in rows]
    return {
        **moves(b, a),
        "sigma0": {"a": dict(a.sigma0), "b": dict(b.sigma0)},
        "observations": columns,
        "tested": {side: bool(found) for side, found in sides.items()},
    }


def _by_key(snap: Snapshot) -> dict[tuple[str, str], tuple[Any, Any, Any]]:
    """State, residual and w of a state by id and component."""
    columns = [np.asarray(snap.tests.get(name, ()), dtype=object).tolist() for name in FIGURES]
    return {(row[0], row[1]): row[2:] for row in zip(*columns, strict=True)}


def _number(value: Any) -> Any:
    """A value as JSON takes it: no NaN."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def plain(array: Array) -> list[Any]:
    """An array as nested lists, None for NaN."""
    if np.isfinite(array).all():
        return list(array.tolist())
    out = array.astype(object)
    out[~np.isfinite(array)] = None
    return list(out.tolist())
