"""Start values for Comp3D's subframes and rotation axes, from points already known.

Works in W. Poses come from targets with known coordinates, targets from poses, in turns, until
nothing new comes; the rest is left to the search over the whole network.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from tribrach._types import Array
from tribrach.geometry.circles import common_axis
from tribrach.io.survey.comp3d.records import (
    AxisRecord,
    CircleRecord,
    FrameEntry,
    FrameRecord,
    Observed,
)

Pose = tuple[Array, Array]


#: rays that meet at less than this [rad] do not fix a point
_SMALLEST_ANGLE = 0.02


def frame_poses(
    frames: Sequence[FrameRecord], known: dict[str, Array], up: Array
) -> list[Pose | None]:
    """Poses of subframes.

    Returns translation (3,) and rotation world from frame (3, 3) of each; None if not located.
    """
    poses: list[Pose | None] = [None] * len(frames)
    while True:
        progress = False
        for i, frame in enumerate(frames):
            if poses[i] is None and frame.code != 19:
                poses[i] = _pose(frame, known, up)
                if poses[i] is not None:
                    progress = True
                    known.setdefault(frame.origin, poses[i][0])  # type: ignore[index]
        placed = [(f, p) for f, p in zip(frames, poses, strict=True) if p is not None]
        if not (_place_targets(placed, known) or progress):
            return poses


def _local(frame: FrameRecord, entry: FrameEntry) -> tuple[Array | None, bool]:
    """Vector (3,) to a target in the frame, a unit vector if its length is not known; True if it
    is.
    """
    if frame.code == 11:
        complete = not any(entry.off)
        return (np.array(entry.values) if complete else None), complete
    if entry.off[0] or entry.off[1]:
        return None, False
    around, elevation, distance = entry.values
    unit = np.array(
        [
            np.cos(elevation) * np.cos(around),
            np.cos(elevation) * np.sin(around),
            np.sin(elevation),
        ]
    )
    return (unit * distance, True) if not entry.off[2] else (unit, False)


def _pose(frame: FrameRecord, known: dict[str, Array], up: Array) -> Pose | None:
    """Pose of a subframe from known targets, or None."""
    seen = [(known[e.target], *_local(frame, e)) for e in frame.entries if e.target in known]
    origin = known.get(frame.origin)
    full = [(x, u) for x, u, complete in seen if complete and u is not None]
    if origin is not None:
        full.append((origin, np.zeros(3)))
    if len(full) > 1:
        world, local = (np.array(part) for part in zip(*full, strict=True))
        rotation = _align(world - world.mean(0), local - local.mean(0), frame.levelled, up)
        if rotation is not None:
            return world.mean(0) - rotation @ local.mean(0), rotation
    rays = [(x - origin, u) for x, u, _ in seen if u is not None] if origin is not None else []
    if origin is None or len(rays) < 2:
        return None
    world = np.array([x / np.linalg.norm(x) for x, _ in rays])
    local = np.array([u / np.linalg.norm(u) for _, u in rays])
    rotation = _align(world, local, frame.levelled, up)
    return None if rotation is None else (origin, rotation)


def _align(world: Array, local: Array, levelled: bool, up: Array) -> Array | None:
    """Rotation with ``world ~ rotation @ local`` (Kabsch), None if the vectors leave it open."""
    if levelled:
        size = float(np.abs(world).max()) * 10
        world = np.vstack([world, size * up])
        local = np.vstack([local, [0.0, 0.0, size]])
    singular = np.linalg.svd(local, compute_uv=False)
    if len(singular) < 2 or singular[1] < 1e-6 * singular[0]:
        return None
    matrix: Array = Rotation.align_vectors(world, local)[0].as_matrix()
    return matrix


def _place_targets(placed: list[tuple[FrameRecord, Pose]], known: dict[str, Array]) -> bool:
    """Add targets that known poses locate; True if there was one."""
    rays: dict[str, list[tuple[Array, Array]]] = {}
    located = False
    for frame, (translation, rotation) in placed:
        for entry in frame.entries:
            local, complete = _local(frame, entry)
            if entry.target in known or local is None:
                continue
            if complete:
                known[entry.target] = translation + rotation @ local
                located = True
            else:
                rays.setdefault(entry.target, []).append((translation, rotation @ local))
    for target, lines in rays.items():
        if target not in known and (point := _meet(lines)) is not None:
            known[target] = point
            located = True
    return located


def _meet(rays: list[tuple[Array, Array]]) -> Array | None:
    """Point closest to all rays (origin, unit direction), None if they are nearly parallel."""
    normal, right = np.zeros((3, 3)), np.zeros(3)
    for origin, unit in rays:
        across = np.eye(3) - np.outer(unit, unit)
        normal += across
        right += across @ origin
    if np.linalg.eigvalsh(normal)[0] < _SMALLEST_ANGLE**2:
        return None
    point: Array = np.asarray(np.linalg.solve(normal, right), dtype=float)
    return point


@dataclass(frozen=True)
class AxisStart:
    """Approximate values of a rotation axis."""

    origin: Array  #: (3,), A point on it
    main: int  #: index of its main axis
    slopes: tuple[float, float]  #: along the two other axes
    #: place on the axis and radius by target [m]
    along: dict[str, float]
    radius: dict[str, float]


def axis_start(axis: AxisRecord, known: dict[str, Array]) -> AxisStart | None:
    """The axis of all circles of known points."""
    circles: dict[str, list[CircleRecord]] = {}
    for circle in axis.circles:
        circles.setdefault(circle.target, []).append(circle)
    points = {
        target: np.array([known[c.point] for c in members if c.point in known])
        for target, members in circles.items()
    }
    if not any(len(x) > 2 for x in points.values()):
        return None
    number = np.repeat(np.arange(len(points)), [len(x) for x in points.values()])
    located = [x for x in points.values() if len(x)]
    centre, normal = common_axis(np.concatenate(located), number)
    main = int(np.argmax(np.abs(normal)))
    normal = normal / normal[main]
    origin = known.get(axis.origin, centre)
    along, radius = {}, {}
    for target, x in points.items():
        if len(x) == 0:
            return None
        foot = float((x.mean(0) - origin) @ normal / (normal @ normal))
        along[target] = foot
        radius[target] = float(np.linalg.norm(x - origin - foot * normal, axis=1).mean())
    slopes = (float(normal[(main + 1) % 3]), float(normal[(main + 2) % 3]))
    return AxisStart(origin, main, slopes, along, radius)


def offset_points(
    observed: Observed, known: dict[str, Array], given: dict[str, Array]
) -> dict[str, Array]:
    """Locate points that only height differences and offsets tie to others.

    A point with easting, northing and height offset from a known one is added to ``known``. A point
    that only height differences (or equal ones) tie to others has a height only; it is returned,
    with the plan position of its neighbour, which is close enough for its sigma.
    """
    steps = _steps(observed)
    levels: dict[str, Array] = {}
    plan = _planned(observed)
    progress = True
    while progress:
        progress = False
        for (start, end), step in steps.items():
            for a, b, sign in ((start, end, 1), (end, start, -1)):
                place = known.get(a, given.get(a, levels.get(a)))
                if place is None or b in known or b in given or b in levels:
                    continue
                complete = not np.isnan(step).any()
                if complete and a in known:
                    known[b] = place + sign * step
                elif b not in plan:
                    levels[b] = place + np.array([0.0, 0.0, sign * np.nan_to_num(step[2])])
                else:
                    continue
                progress = True
    return levels


def _steps(observed: Observed) -> dict[tuple[str, str], Array]:
    """Offsets (3,) between pairs of points, NaN where not observed."""
    steps: dict[tuple[str, str], Array] = {}
    for sight in observed.sights:
        axis = {14: 0, 15: 1, 4: 2}.get(sight.code)
        if axis is not None and not sight.off:
            step = steps.setdefault(sight.names, np.full(3, np.nan))
            step[axis] = sight.value + sight.height_instrument - sight.height_target
    for equal in observed.equals:
        for pair in equal.pairs:
            if equal.code == 21 and pair.sigma > 0:
                steps.setdefault((pair.start, pair.end), np.full(3, np.nan))
    return steps


def _planned(observed: Observed) -> set[str]:
    """Points whose plan position some active observation needs."""
    names = {n for s in observed.sights if s.code != 4 and not s.off for n in s.names}
    for frame in observed.frames:
        names |= {frame.origin, *(entry.target for entry in frame.entries)}
    for axis in observed.axes:
        names |= {axis.origin, *(c.point for c in axis.circles), *(n for n, _ in axis.feet)}
    for equal in observed.equals:
        if equal.code == 22:
            names |= {n for pair in equal.pairs for n in (pair.start, pair.end)}
    return names
