"""A picked point: its coordinates in every frame, its covariance, and what that comes from."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.cloud.budget import PointBudget, point_budget
from tribrach.errors import InputError
from tribrach.units import format_angle
from tribrach.workbench.scene import coordinate_words
from tribrach.workbench.sources import Picked, PointSources, coordinates


def point(sources: PointSources, cloud: str, place: tuple[str, str, str]) -> dict[str, Any]:
    """Say what is known of a point of a cloud."""
    where = coordinates(",".join(place))
    if where is None:
        raise InputError("these are no coordinates", cure="give three numbers in metres")
    picked = sources.picked(cloud, where)
    placement, xyz = picked.scan.placement, picked.point.xyz
    beside, style = sources.beside, sources.style
    length = float(np.linalg.norm(xyz - placement.pose.translation))
    cosine = picked.cosine
    incidence = None if cosine is None else float(np.arccos(np.clip(cosine, -1.0, 1.0)))
    frames = {
        beside.names[kind]: coordinate_words(kind, there.tolist(), style)
        for kind, there in beside.frame.elsewhere(xyz).items()
    }
    answer: dict[str, Any] = {
        "frames": frames,
        "xyz": xyz.tolist(),
        "station": placement.station,
        "scan": picked.scan.scan,
        "range": length,
        "incidence": incidence,
        "attributes": picked.point.values,
        "covariance": None,
        "own": None,
        "shared": None,
        "budget": [],
    }
    words: dict[str, Any] = {"range": style.value(length, "m") + " m", "incidence": ""}
    if incidence is not None:
        unit = " gon" if style.angle == "gon" else "°"
        words["incidence"] = format_angle(incidence, style.angle, 1) + unit
    if placement.noise is not None and picked.scan.certain:
        budget = _budget(sources, picked)
        covariance = budget.total[0]
        own = _own(sources, picked)
        answer |= {
            "covariance": covariance.tolist(),
            "own": own.tolist(),
            "shared": (covariance - own).tolist(),
            "budget": _parts(budget),
        }
        sigmas = np.sqrt(np.diag(covariance))
        words["sigma"] = [f"{style.small(s, 'm')} mm" for s in sigmas.tolist()]
        words["sigma_3d"] = f"{style.small(float(np.sqrt(np.trace(covariance))), 'm')} mm"
        words["budget"] = [f"{style.small(row['sigma'], 'm')} mm" for row in answer["budget"]]
    answer["words"] = words
    return answer


def _budget(sources: PointSources, picked: Picked) -> PointBudget:
    """The covariance of the point, part by part."""
    placement = picked.scan.placement
    if sources.shared is not None and picked.scan.scan in sources.shared.scans:
        placement = sources.shared.scans[picked.scan.scan]
    local = ((picked.point.xyz - placement.pose.translation) @ placement.pose.rotation)[None]
    further = sources.beside.further
    shares = None if further is None else further.shares.get(placement.station)
    light = None if picked.light is None else np.array([picked.light])
    normals = _normal(local[0], picked.cosine)[None]
    try:
        return point_budget(local, placement, shares, normals, light)
    except ValueError:
        # the shares are of another run than the poses
        return point_budget(local, placement, None, normals, light)


def _normal(beam: Array, cosine: float | None) -> Array:
    """A normal that the beam meets at the stored incidence; of its direction nothing is said."""
    if cosine is None:
        return np.full(3, np.nan)
    along = beam / max(float(np.linalg.norm(beam)), np.finfo(float).tiny)
    across = np.cross(along, np.eye(3)[int(np.argmin(np.abs(along)))])
    across /= np.linalg.norm(across)
    normal: Array = cosine * along + np.sqrt(max(1.0 - cosine**2, 0.0)) * across
    return normal


def _own(sources: PointSources, picked: Picked) -> Array:
    """Covariance (3, 3) that is new with this point."""
    if sources.shared is None or picked.scan.scan not in sources.shared.scans:
        return np.full((3, 3), np.nan)
    light = None if picked.light is None else [picked.light]
    cosine = None if picked.cosine is None else [picked.cosine]
    alone = sources.shared.points(
        picked.point.xyz[None], picked.scan.scan, cosine=cosine, intensity=light
    )
    own: Array = alone.own()[0]
    return own


def _parts(budget: PointBudget) -> list[dict[str, Any]]:
    """Parts with their 3D sigma, the largest first; what takes away has a sigma below zero."""
    variances: list[float] = budget.variances[:, 0].tolist()
    sigmas = [math.copysign(math.sqrt(abs(v)), v) for v in variances]
    least = 1e-4 * max(map(abs, sigmas), default=0.0)
    named = sorted(zip(budget.names, sigmas, strict=True), key=lambda part: -part[1])
    return [{"part": name, "sigma": sigma} for name, sigma in named if abs(sigma) > least]
