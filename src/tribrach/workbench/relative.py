"""The distance of two places with its sigma, from what they have in common.

A place is a point of the network, a station, or a point of a cloud. With the joint covariance S of
all of them and of the effects of the scanners the difference d of two places has

    C_d = B_a + B_b + (J_b - J_a) S (J_b - J_a)^T

(method section 5.10): B is what is new with a point of a cloud, zero for others; J are the
derivatives of a place by what S holds. What moves both alike cancels.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.cloud import quantities
from tribrach.cloud.shared_part import CloudPoints, angle_slopes, slopes
from tribrach.errors import InputError, UnknownName
from tribrach.workbench.sources import PointSources, coordinates


@dataclass(frozen=True)
class _End:
    """A place ``xyz`` (3,) [m] in the clouds' frame, of the network by name or a cloud's point."""

    name: str
    xyz: Array
    kind: str
    point: CloudPoints | None = None


def relative(sources: PointSources, a: str, b: str) -> dict[str, Any]:
    """Distance and sigma of two places, names or ``CLOUD:x,y,z`` of points of clouds."""
    one, two = _end(sources, a), _end(sources, b)
    difference = two.xyz - one.xyz
    length = float(np.linalg.norm(difference))
    if length == 0.0:
        raise InputError("both are one place", cure="choose two that are apart")
    own, shared, note = _covariance(sources, one, two)
    along, covariance = difference / length, own + shared
    parts = [float(np.sqrt(max(float(along @ c @ along), 0.0))) for c in (covariance, own, shared)]
    style = sources.style
    return {
        "a": one.name,
        "b": two.name,
        "difference": difference.tolist(),
        "distance": length,
        "sigma": parts[0],
        "sigma_own": parts[1],
        "sigma_shared": parts[2],
        "covariance": covariance.tolist(),
        "words": {
            "distance": f"{style.value(length, 'm')} m",
            "sigma": f"{style.small(parts[0], 'm')} mm",
            "note": note,
        },
    }


def named_joint(sources: PointSources) -> tuple[list[str], Array] | None:
    """Names, and joint covariance of places in the clouds' axes; None where the run kept none."""
    joint, shared = sources.joint, sources.shared
    if joint is None or shared is None:
        return None
    names, total = joint[0], _total(sources)
    stations = [name for name in shared.stations if name not in names]
    first = [len(shared.covariance) + 3 * k for k in range(len(names))]
    first += [6 * shared.stations.index(name) for name in stations]
    rows = (np.array(first)[:, None] + np.arange(3)).ravel()
    return [*names, *stations], total[np.ix_(rows, rows)]


def _total(sources: PointSources) -> Array:
    """Joint covariance of clouds and points of the network."""
    assert sources.shared is not None
    q = len(sources.shared.covariance)
    names, rows = sources.joint or ([], np.zeros((0, q)))
    total = np.zeros((q + 3 * len(names),) * 2)
    total[:q, :q] = sources.shared.covariance
    if len(names):
        total[q:, :] = rows
        total[:q, q:] = rows[:, :q].T
    return total


def _end(sources: PointSources, text: str) -> _End:
    """The place that a text names."""
    if text in sources.points:
        return _End(text, sources.points[text][0], "point")
    if text in sources.stations:
        return _End(text, sources.stations[text][0], "station")
    cloud, _, numbers = text.rpartition(":")
    place = coordinates(numbers)
    if not cloud or place is None:
        raise UnknownName("point or station", text, [*sources.points, *sources.stations])
    picked = sources.picked(cloud, place)
    shared, scan = sources.shared, picked.scan.scan
    if shared is None or scan not in shared.scans:
        raise InputError(
            "what the points of the clouds have in common is not known",
            cure="run the project again: the joint covariance of the stations is not there",
        )
    light = None if picked.light is None else [picked.light]
    cosine = None if picked.cosine is None else [picked.cosine]
    point = shared.points(picked.point.xyz[None], scan, cosine=cosine, intensity=light)
    return _End(f"a point of {cloud}", picked.point.xyz, "cloud", point)


def _covariance(sources: PointSources, one: _End, two: _End) -> tuple[Array, Array, str]:
    """Covariance (3, 3) of the difference, what is new with points and what is shared, a note."""
    if one.point is not None and two.point is not None:
        vector = quantities.relative(one.point, two.point)
        return vector.own, vector.shared + vector.systematic, sources.beside.sigmas_of
    if one.point is None and two.point is None and sources.adjustment is not None:
        shared = _of_adjustment(sources, one, two)
        return np.zeros((3, 3)), shared, "from the network as it is now"
    joint = sources.joint
    if sources.shared is None:
        raise _unknown()
    names = [] if joint is None else joint[0]
    if any(end.kind == "point" and end.name not in names for end in (one, two)):
        raise _unknown()
    total = _total(sources)
    slope = _slopes(sources, two, names) - _slopes(sources, one, names)
    own = np.zeros((3, 3))
    systematic = np.zeros((3, 3))
    for end in (one, two):
        if end.point is not None:
            own += end.point.own()[0]
            angles = angle_slopes(end.point.xyz, end.point.placement)[0]
            systematic += angles @ angles.T
    return own, slope @ total @ slope.T + systematic, sources.beside.sigmas_of


def _slopes(sources: PointSources, end: _End, names: list[str]) -> Array:
    """Derivatives (3, q + 3p) of a place by the rows of the joint covariance."""
    shared = sources.shared
    assert shared is not None
    q = len(shared.covariance)
    out = np.zeros((3, q + 3 * len(names)))
    if end.point is not None:
        out[:, shared.columns[end.point.scan]] = slopes(end.point.xyz, end.point.placement)[0]
    elif end.kind == "point":
        out[:, q + 3 * names.index(end.name) + np.arange(3)] = np.eye(3)
    else:
        if end.name not in shared.stations:
            raise _unknown()
        out[:, 6 * shared.stations.index(end.name) + np.arange(3)] = np.eye(3)
    return out


def _of_adjustment(sources: PointSources, one: _End, two: _End) -> Array:
    """Covariance (3, 3) of the difference of two places of the network of a session."""
    adjustment, turn = sources.adjustment, []
    assert adjustment is not None
    columns = [adjustment.columns(end.name)[:3] for end in (one, two)]
    for end in (one, two):
        back = sources.beside.frame
        here = back.elsewhere(end.xyz).get("work", end.xyz)
        turn.append(np.eye(3) if back.from_work is None else back.from_work.rotation(here[None])[0])
    both = np.concatenate(columns)
    joint = sources.factor * adjustment.covariance_columns(both, both)
    slope = np.concatenate([-turn[0], turn[1]], axis=1)
    covariance: Array = slope @ joint @ slope.T
    return covariance


def _unknown() -> InputError:
    return InputError(
        "what these two places have in common is not known here",
        cure="open the project with tribrach workbench, or run it again",
    )
