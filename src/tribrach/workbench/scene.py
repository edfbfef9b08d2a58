"""The scene of a result: what the page draws, in columns, in the frame of the clouds.

A scene is made from the keys of ``result.json``: those of a file, or those of the adjustment of a
session with what the last run left of its scans. What lies beside the result (poses of the clouds,
``workbench.json``) is used where it is there, so that results without it stay readable.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Literal

import numpy as np

from tribrach._types import Array
from tribrach.answers import written
from tribrach.report.chapters.observations import observation_title, value_words
from tribrach.report.epochs import EpochComparison
from tribrach.report.numbers import Style
from tribrach.statistics import chi2
from tribrach.units import format_angle
from tribrach.workbench.epochs import scene_epochs
from tribrach.workbench.result_folder import ResultFolder
from tribrach.workbench.schema import (
    SceneCloud,
    SceneDocument,
    SceneEpochs,
    SceneObservations,
    ScenePlanes,
    ScenePoints,
    SceneRays,
    SceneRejected,
    SceneStations,
    SceneTargets,
)

Columns = dict[str, Any]

#: figures of an observation that are written with its unit
_SMALL = ("sigma", "residual", "mdb")


def scene_of(
    result: Mapping[str, Any],
    beside: ResultFolder,
    clouds: Sequence[SceneCloud] = (),
    *,
    session: bool = False,
    epochs: Sequence[EpochComparison] = (),
) -> SceneDocument:
    """Make the scene of a result."""
    style = Style(beside.angle)
    observations = _observations(result["observations"], style)
    points = _points(result, beside, style)
    frame = beside.frame
    stations = _stations(result, beside, clouds)
    targets, rejected = _targets(result.get("scans") or {}, beside, style)
    places = dict(zip(points["name"], points["xyz"], strict=True))
    return SceneDocument(
        title=result["title"],
        confidence=beside.confidence(result),
        ellipsoid=math.sqrt(float(chi2.ppf(beside.confidence(result), 3))),
        angle=beside.angle,
        crs=frame.crs,
        axes=frame.axes,
        origin=_origin(points["xyz"], stations["xyz"], clouds),
        frame=frame.upright.tolist(),
        datum=result["datum"]["statement"],
        covariances=result["sigma0"]["covariances"],
        summary={**result["sigma0"], "verdict": _verdict(result["sigma0"])},
        warnings=result["warnings"],
        points=ScenePoints(**points),
        stations=SceneStations(**stations),
        observations=SceneObservations(**observations),
        rays=SceneRays(**_rays(observations)),
        planes=ScenePlanes(**_planes(result["planes"], beside)),
        edges=(result.get("registration") or {}).get("edges", []),
        targets=SceneTargets(**targets),
        rejected=SceneRejected(**rejected),
        clouds=list(clouds),
        comparisons=_comparisons(result.get("comparisons") or []),
        epochs=[SceneEpochs(**one) for one in scene_epochs(epochs, frame, places)],
        edits=result["edits"],
        session=session,
        sigmas_of=beside.sigmas_of,
    )


def _verdict(sigma0: Mapping[str, Any]) -> str:
    """The global test in words."""
    test = sigma0["global_test"]
    if test["accepted"] is None:
        return "no redundancy, nothing is tested"
    where = f"{test['statistic']:.1f}, limits {test['lower']:.1f} to {test['upper']:.1f}"
    return f"global test {'accepted' if test['accepted'] else 'rejected'} ({where})"


def _origin(
    points: Iterable[Sequence[float | None]],
    stations: Iterable[Sequence[float | None] | None],
    clouds: Iterable[SceneCloud],
) -> tuple[int, int, int]:
    """Whole metres near the middle of everything."""
    places = [place for place in (*points, *stations) if place is not None]
    places += [corner for cloud in clouds for corner in cloud.bounds]
    known = np.array([[np.nan if v is None else v for v in place] for place in places], dtype=float)
    if not len(known):
        return 0, 0, 0
    inside = ~np.isnan(known).all(axis=0)
    middle = (np.nanmin(known[:, inside], axis=0) + np.nanmax(known[:, inside], axis=0)) / 2
    out = np.zeros(3)
    out[inside] = middle
    x, y, z = np.rint(out).astype(int).tolist()
    return x, y, z


def _points(result: Mapping[str, Any], beside: ResultFolder, style: Style) -> Columns:
    """Points of the network in the frame of the clouds, with their coordinates in others."""
    given = result["points"]
    out: Columns = {"name": list(given), "role": [p["role"] for p in given.values()]}
    xyz, covariance = beside.frame.of_points(given)
    out["xyz"], out["covariance"] = xyz, covariance
    out["frames"] = _frames(given.values(), beside, style)
    return out


def _frames(
    points: Iterable[Mapping[str, Any]], beside: ResultFolder, style: Style
) -> dict[str, list[list[str] | None]]:
    """Coordinates of points as a person reads them, by frame."""
    points = list(points)
    work = [[_metres(v) for v in p["xyz"]] for p in points]
    frames: dict[str, list[list[str] | None]] = {beside.names["work"]: [*work]}
    for key in ("projected", "geodetic", "ecef"):
        rows = [coordinate_words(key, p.get(key), style) for p in points]
        if any(row is not None for row in rows):
            frames[beside.names[key]] = rows
    return frames


def coordinate_words(kind: str, values: Sequence[float] | None, style: Style) -> list[str] | None:
    """Three coordinates with their units, None where there are none."""
    if values is None:
        return None
    if kind != "geodetic":
        return [_metres(v) for v in values]
    latitude, longitude = (format_angle(v, "dms", 5) for v in values[:2])
    return [latitude, longitude, _metres(values[2])]


def _metres(value: float | None) -> str:
    return "" if value is None else f"{value:.4f} m"


def _stations(
    result: Mapping[str, Any], beside: ResultFolder, clouds: Sequence[SceneCloud]
) -> Columns:
    """Scanner stations by their pose; set-ups at the place of their point."""
    keys = ("name", "kind", "pose", "pose_of_clouds", "xyz", "covariance", "clouds")
    out: Columns = {key: [] for key in keys}
    for name, station in result["stations"].items():
        scanner = station["world_from_scanner"] is not None
        pose, covariance = beside.frame.of_station(name, station)
        place = pose[:3, 3].tolist() if pose is not None else None
        if not scanner and name in result["points"]:
            place = beside.frame.of_points({name: result["points"][name]})[0][0]
        out["name"].append(name)
        out["kind"].append("scanner" if scanner else "set-up")
        out["pose"].append(None if pose is None else pose.tolist())
        stood = beside.frame.stations.get(name, (None, None))[0]
        out["pose_of_clouds"].append(None if stood is None else stood.tolist())
        out["xyz"].append(place)
        out["covariance"].append(None if covariance is None else covariance.tolist())
        out["clouds"].append([c.name for c in clouds if c.station == name])
    return out


def _observations(rows: Sequence[Mapping[str, Any]], style: Style) -> Columns:
    """Observed values in columns, with their words."""
    out: Columns = {
        name: [row.get("reason", "") if name == "reason" else row[key] for row in rows]
        for name, key in written(SceneObservations).items()
        if name not in ("title", "words")
    }
    out["title"] = [observation_title(row["kind"], row["component"]) for row in rows]
    words: dict[str, list[str]] = {
        "value": [value_words(r["kind"], r["value"], r["unit"], style) for r in rows],
        "external": [style.small(r["external"], "m") for r in rows],
    }
    for key in _SMALL:
        words[key] = [
            ""
            if r[key] is None
            else f"{style.small(r[key], r['unit'])} {style.small_unit(r['unit'])}"
            for r in rows
        ]
    words["external"] = [f"{text} mm" if text else "" for text in words["external"]]
    out["words"] = words
    return out


def _rays(observations: Columns) -> Columns:
    """Pairs of positions with the rows of their observations; a pair has one direction."""
    rows: dict[tuple[str, str], list[int]] = {}
    for k, pair in enumerate(zip(observations["start"], observations["end"], strict=True)):
        if all(pair):
            back = (pair[1], pair[0])
            rows.setdefault(back if back in rows else pair, []).append(k)
    w, suspicious = observations["w"], observations["suspicious"]
    return {
        "from_": [start for start, _ in rows],
        "to": [end for _, end in rows],
        "w": [
            max((abs(w[k]) for k in at if w[k] is not None), default=None) for at in rows.values()
        ],
        "suspicious": [any(suspicious[k] for k in at) for at in rows.values()],
        "rows": list(rows.values()),
    }


def _planes(planes: Mapping[str, Any], beside: ResultFolder) -> Columns:
    """Planes in the frame of the clouds, with the place where they were seen."""
    keys = ("name", "normal", "offset", "centre", "extent", "axes", "half")
    out: Columns = {key: [] for key in keys}
    for name, plane in planes.items():
        seen = beside.planes.get(name)
        centre = None if seen is None else seen.centre
        normal, offset, there = beside.frame.of_plane(
            np.array(plane["normal"]), float(plane["offset"]), centre
        )
        out["name"].append(name)
        out["normal"].append(normal.tolist())
        out["offset"].append(offset)
        out["centre"].append(None if there is None else there.tolist())
        out["extent"].append(None if seen is None else seen.extent)
        if seen is None or seen.axes is None or seen.half is None:
            out["axes"].append(None)
            out["half"].append(None)
            continue
        out["axes"].append(beside.frame.of_directions(seen.axes, seen.centre).tolist())
        out["half"].append(seen.half.tolist())
    return out


def _targets(
    scans: Mapping[str, Any], beside: ResultFolder, style: Style
) -> tuple[Columns, Columns]:
    """Targets found and rejected, placed by the poses of their scans."""
    same = (
        "scan", "number", "kind", "name", "center", "sigma", "range", "incidence", "points", "rms",
        "coverage", "remark",
    )  # fmt: skip
    found, rejections = scans.get("targets", []), scans.get("rejected", [])
    out: Columns = {key: [row[key] for row in found] for key in same}
    out["xyz"] = [_placed(row, beside) for row in found]
    out["accepted"] = [row.get("accepted", True) for row in found]
    out["picture"] = [_picture(row, row["number"], beside) for row in found]
    out["words"] = [_fit_words(row, style) for row in found]
    bad: Columns = {key: [row[key] for row in rejections] for key in ("scan", "kind", "center")}
    bad["reason"] = [row["reason"] for row in rejections]
    bad["xyz"] = [_placed(row, beside) for row in rejections]
    bad["picture"] = [_picture(row, -number, beside) for number, row in _numbered(rejections)]
    return out, bad


def _numbered(rows: Iterable[Mapping[str, Any]]) -> Iterator[tuple[int, Mapping[str, Any]]]:
    """Rows with their numbers from 1 in each scan."""
    numbers: Counter[str] = Counter()
    for row in rows:
        numbers[row["scan"]] += 1
        yield numbers[row["scan"]], row


def _picture(row: Mapping[str, Any], number: int, beside: ResultFolder) -> str | None:
    """The picture of a row, by the number that the run gave it; a session may say another."""
    of_run = row.get("pictured", number)
    return None if of_run is None else beside.picture(row["scan"], of_run)


def _fit_words(row: Mapping[str, Any], style: Style) -> dict[str, str]:
    """The numbers of a fit with their units."""
    if row["sigma"] is None:
        return {}
    mm = [style.small(value, "m") for value in (*row["sigma"], row["rms"])]
    angle: Literal["gon", "deg"] = style.angle
    incidence = row["incidence"]
    return {
        "sigma": f"{mm[0]}, {mm[1]}, {mm[2]} mm",
        "rms": f"{mm[3]} mm",
        "range": "" if row["range"] is None else _metres(row["range"]),
        "incidence": ""
        if incidence is None
        else f"{format_angle(incidence, angle, 1)} {'gon' if angle == 'gon' else '°'}",
        "coverage": "" if row["coverage"] is None else f"{100 * row['coverage']:.0f} %",
    }


def _placed(row: Mapping[str, Any], beside: ResultFolder) -> list[float] | None:
    """A centre of the scanner frame in the frame of the clouds."""
    pose: Array | None = beside.poses.get(row["scan"])
    if pose is None:
        return None
    placed: list[float] = (pose[:3, :3] @ np.array(row["center"]) + pose[:3, 3]).tolist()
    return placed


def _comparisons(comparisons: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Comparisons without what only a report needs."""
    keep = ("a", "b", "limit", "offsets", "sentences")
    return [
        {key: c[key] for key in keep if key in c}
        # results of earlier versions do not say where a site is
        | {"sites": [{**site, "xyz": site.get("center")} for site in c.get("sites", ())]}
        for c in comparisons
    ]


def decided_targets(
    scans: Mapping[str, Any] | None, decided: Sequence[Mapping[str, Any]]
) -> dict[str, Any]:
    """Targets of the last run with the names and decisions of a session."""
    known = {(row["scan"], tuple(row["center"])): row for row in (scans or {}).get("targets", ())}
    # pictures have the numbers of the run: below zero those of rejected candidates
    pictured = {place: row["number"] for place, row in known.items()}
    bad = [
        {**row, "pictured": -number} for number, row in _numbered((scans or {}).get("rejected", ()))
    ]
    pictured |= {(row["scan"], tuple(row["center"])): row["pictured"] for row in bad}
    unknown = {
        "sigma": None, "range": None, "incidence": None, "points": None, "rms": None,
        "coverage": None,
    }  # fmt: skip
    targets = [
        {
            **unknown,
            **known.get((row["scan"], tuple(row["center"])), {}),
            **{key: row[key] for key in ("scan", "number", "kind", "center", "name", "accepted")},
            "remark": row["reason"]
            or known.get((row["scan"], tuple(row["center"])), {}).get("remark", ""),
            "pictured": pictured.get((row["scan"], tuple(row["center"]))),
        }
        for row in decided
    ]
    if not decided:
        return dict(scans or {})
    # what the run lists as rejected by hand is found, and decided about here
    mine = {(row["scan"], tuple(row["center"])) for row in decided}
    others = [row for row in bad if (row["scan"], tuple(row["center"])) not in mine]
    return {**(scans or {}), "targets": targets, "rejected": others}
