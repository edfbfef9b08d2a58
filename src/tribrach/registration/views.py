"""Keeps what stations see and tests whether a relative pose puts points where others saw nothing.

A place that lies in front of the surface which a scanner sees in that direction is empty: its beam
went through. Points of another scan that fall into empty space, or into open sky, contradict the
relative pose that carries them there; points behind what the scanner sees say nothing. Of two poses
that planes alone do not tell apart, as those of a room and its half turn, the wrong one puts walls
into the air. Scanner frame, metres and radians.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tribrach._types import Array, Mask, Single
from tribrach.geometry.pose import Pose
from tribrach.kernels import njit
from tribrach.registration.planes.plane_set import PlaneSet
from tribrach.scan.range_image import RangeImage


@dataclass(frozen=True)
class ViewGates:
    """How a station's view is kept, and when a point contradicts it.

    Chosen by hand with test_station_view, test_plane_poses, benchmarks/plane_registration.
    """

    step_rad: float = float(np.radians(0.5))  #: directions that are kept apart [rad]
    most_points: int = 4000  #: points that stand for the surfaces, at most
    cell_m: float = 0.3  #: edge of the cells of space that one of them is drawn from [m]
    #: pixels of an image that are looked at for them, at most: bounds the time
    most_pixels: int = 600_000
    #: a scan with returns from this share of its image or more looked along all of it
    filled_share: float = 0.2
    #: a point agrees with a surface within this distance [m] plus this share of the range
    near_m: float = 0.15
    near_share: float = 0.005
    #: nearer points are not judged: the housing of the scanner and its legs [m]
    nearest_m: float = 0.3
    #: open sky contradicts a point that is nearer than this share of the reach of the scanner
    reach_share: float = 0.8


GATES = ViewGates()

# compiled code reads constants of the module, not attributes of an object
_NEAR_M = GATES.near_m
_NEAR_SHARE = GATES.near_share
_NEAREST_M = GATES.nearest_m
_REACH_SHARE = GATES.reach_share


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Planes and views of a station or of a group."""

    name: str  #: name of the station, of a group that of its first one
    planes: PlaneSet  #: planes in its frame
    #: what each scanner sees, with its pose in that frame
    views: Sequence[tuple[Pose, StationView]]
    levelled: bool  #: true if the third axis is plumb

    @classmethod
    def of(cls, name: str, planes: PlaneSet, view: StationView, levelled: bool) -> Surroundings:
        """Planes and view of one station."""
        return cls(name, planes, ((Pose.identity(), view),), levelled)


def merged(stations: Mapping[str, Surroundings], poses: Mapping[str, Pose]) -> Surroundings:
    """Merge stations at given poses into one."""
    parts = [(pose, stations[name]) for name, pose in poses.items()]
    return Surroundings(
        next(iter(poses)),
        PlaneSet.joined([s.planes.placed(pose) for pose, s in parts]),
        [(pose @ at, view) for pose, s in parts for at, view in s.views],
        all(s.levelled for _, s in parts),
    )


def seen(
    first: Surroundings, second: Surroundings, first_from_second: Pose
) -> tuple[Agreement, float, float]:
    """Compare the points of either station with the views of the other."""
    total, there, back = Agreement(0, 0, 0, 0, 0), 0.0, 0.0
    for at, view_a in first.views:
        for where, view_b in second.views:
            between = at.inverse @ first_from_second @ where
            forward = agreement(view_b, view_a, between)
            backward = agreement(view_a, view_b, between.inverse)
            total = total + forward + backward
            there, back = max(there, forward.overlap), max(back, backward.overlap)
    return total, there, back


_ROWS, _COLUMNS = round(np.pi / GATES.step_rad), round(2 * np.pi / GATES.step_rad)


@dataclass(frozen=True, eq=False)
class StationView:
    """Nearest and farthest range of a station by direction, and points of the surfaces."""

    #: (360, 720), ranges [m], NaN without a return
    near: Single
    far: Single
    looked: Mask  #: (360, 720), true where the scanner was pointed
    points: Array  #: (n, 3), points spread over the surfaces [m]
    reach: float  #: largest range [m]

    @classmethod
    def empty(cls) -> StationView:
        """The view of a station that saw nothing."""
        blank = np.full((_ROWS, _COLUMNS), np.nan, dtype=np.float32)
        looked = np.zeros((_ROWS, _COLUMNS), dtype=np.bool_)
        return cls(blank, blank, looked, np.zeros((0, 3)), 0.0)


@dataclass(frozen=True)
class Agreement:
    """How the points of one station stand in the view of another."""

    agree: int  #: number of points on a surface that the other sees
    hidden: int  #: number of points behind one
    through: int  #: number of points in front of one
    sky: int  #: number of points where the other looked and saw nothing
    outside: int  #: number of points where it did not look

    def __add__(self, other: Agreement) -> Agreement:
        return Agreement(
            self.agree + other.agree,
            self.hidden + other.hidden,
            self.through + other.through,
            self.sky + other.sky,
            self.outside + other.outside,
        )

    @property
    def overlap(self) -> float:
        """Share of all points that both stations see."""
        total = self.agree + self.hidden + self.through + self.sky + self.outside
        return self.agree / max(total, 1)

    @property
    def conflict(self) -> float:
        """Share of points in empty space among those that the other station should see."""
        wrong = self.through + self.sky
        return wrong / max(self.agree + wrong, 1)


def view_of(xyz: Array, image: RangeImage) -> StationView:
    """The view of one scan."""
    near = np.full((_ROWS, _COLUMNS), np.nan, dtype=np.float32)
    far, looked = near.copy(), np.zeros((_ROWS, _COLUMNS), dtype=np.bool_)
    _fill(xyz, near, far)
    seen = np.isfinite(near)
    filled = float(np.isfinite(image.range).mean())
    if filled >= GATES.filled_share:
        v, h = (
            np.arange(a[0], a[-1] + GATES.step_rad / 2, GATES.step_rad / 2)
            for a in (image.v(), image.h())
        )
        rows = np.clip((v / GATES.step_rad).astype(np.int64), 0, _ROWS - 1)
        columns = np.floor((h + np.pi) / GATES.step_rad).astype(np.int64) % _COLUMNS
        looked[np.ix_(np.unique(rows), np.unique(columns))] = True
    reach = float(np.nanmax(far)) if seen.any() else 0.0
    return StationView(near, far, looked | seen, _spread(xyz, image), reach)


def merged_view(views: Sequence[StationView]) -> StationView:
    """Merge the views of all scans of a station."""
    if len(views) == 1:
        return views[0]
    points = np.concatenate([view.points for view in views])
    return StationView(
        np.fmin.reduce([view.near for view in views]),
        np.fmax.reduce([view.far for view in views]),
        np.logical_or.reduce([view.looked for view in views]),
        _thinned(points),
        max(view.reach for view in views),
    )


def agreement(view: StationView, other: StationView, other_from_mine: Pose) -> Agreement:
    """Compare the points of one station with the view of another."""
    moved = other_from_mine @ view.points
    counts = _compare(moved, other.near, other.far, other.looked, other.reach)
    return Agreement(*(int(c) for c in counts))


def _spread(xyz: Array, image: RangeImage) -> Array:
    """Points spread over the surfaces of a scan."""
    index = image.index.ravel()
    stride = max(1, len(index) // GATES.most_pixels)
    index = index[::stride]
    return _thinned(xyz[index[index >= 0]])


def _thinned(points: Array) -> Array:
    """One point from each cell of space, some of them if there are many."""
    if len(points) == 0:
        return points
    cells = np.floor(points / GATES.cell_m).astype(np.int64)
    _, first = np.unique(cells, axis=0, return_index=True)
    if len(first) > GATES.most_points:
        first = np.random.default_rng(0).choice(first, GATES.most_points, replace=False)
    return points[np.sort(first)]


@njit(cache=True, nogil=True)
def _fill(xyz: Array, near: Single, far: Single) -> None:
    """Nearest and farthest range of every direction."""
    rows, columns = near.shape
    step = np.pi / rows
    for k in range(len(xyz)):
        x, y, z = xyz[k, 0], xyz[k, 1], xyz[k, 2]
        r = np.sqrt(x * x + y * y + z * z)
        if not np.isfinite(r) or r == 0:
            continue
        i = min(max(int(np.arccos(z / r) / step), 0), rows - 1)
        j = int((np.arctan2(y, x) + np.pi) / step) % columns
        if np.isnan(near[i, j]) or r < near[i, j]:
            near[i, j] = r
        if np.isnan(far[i, j]) or r > far[i, j]:
            far[i, j] = r


@njit(cache=True, nogil=True)
def _compare(xyz: Array, near: Single, far: Single, looked: Mask, reach: float) -> Array:
    """Numbers (5,) of points that agree, are hidden, in front, in the sky, and outside."""
    rows, columns = near.shape
    step = np.pi / rows
    out = np.zeros(5)
    for k in range(len(xyz)):
        x, y, z = xyz[k, 0], xyz[k, 1], xyz[k, 2]
        r = np.sqrt(x * x + y * y + z * z)
        if r < _NEAREST_M:
            out[4] += 1
            continue
        i = min(max(int(np.arccos(z / r) / step), 0), rows - 1)
        j = int((np.arctan2(y, x) + np.pi) / step) % columns
        low, high, all_looked = np.inf, -np.inf, True
        for a in range(max(i - 1, 0), min(i + 2, rows)):
            for b in range(j - 1, j + 2):
                c = b % columns
                if not looked[a, c]:
                    all_looked = False
                elif not np.isnan(near[a, c]):
                    low, high = min(low, near[a, c]), max(high, far[a, c])
        tolerance = _NEAR_M + _NEAR_SHARE * r
        if low > high:
            # nothing came back from all around, though the scanner reaches that far
            sky = all_looked and r < _REACH_SHARE * reach
            out[3 if sky else 4] += 1
        elif r < low - tolerance:
            out[2 if all_looked else 4] += 1
        elif r > high + tolerance:
            out[1] += 1
        else:
            out[0] += 1
    return out
