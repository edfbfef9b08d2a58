"""The frame that a scene is drawn in, that of the clouds: what is in the work frame comes into it.

The adjustment works in the work frame. Clouds may be in it as well; in a projection every point was
converted by itself, in a geocentric frame it was moved and turned. The run stores these changes of
coordinates in numbers, see :mod:`tribrach.report.workbench_parts`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tribrach._types import Array
from tribrach.geodesy.local_map import StoredMap
from tribrach.geodesy.output_frame import FrameKind


@dataclass(frozen=True)
class SceneFrame:
    """The frame of the clouds."""

    kind: FrameKind = "work"  #: ``work``, ``projected`` or ``ecef``
    crs: str | None = None  #: name of the reference system
    axes: tuple[str, str, str] = ("e", "n", "u")  #: short names of the coordinates
    #: (3, 3), axes of the coordinates to east, north, up
    upright: Array = field(default_factory=lambda: np.eye(3))
    #: pose (4, 4) and covariance (6, 6) in this frame of stations that have a scan
    stations: Mapping[str, tuple[Array, Array]] = field(default_factory=dict)
    #: from the work frame; None where they are the same, or where an older run did not store it
    from_work: StoredMap | None = None
    #: to other frames by name: ``work``, ``projected``, ``geodetic`` (angles times ``radius``),
    #: ``ecef``
    maps: Mapping[str, StoredMap] = field(default_factory=dict)
    radius: float = 1.0  #: what latitudes and longitudes of a map are multiplied by [m]

    def of_points(self, points: Mapping[str, Any]) -> tuple[list[Any], list[Any]]:
        """Coordinates and covariances of points of the network in this frame."""
        given = list(points.values())
        xyz, covariance = [p["xyz"] for p in given], [p["covariance"] for p in given]
        if self.kind == "work" or not given:
            return xyz, covariance
        if self.from_work is None:
            # an older run: coordinates as the result has them, their covariances near enough
            key = self.kind
            return (
                [p.get(key, p["xyz"]) for p in given],
                [p.get(f"{key}_covariance", p["covariance"]) for p in given],
            )
        places = np.nan_to_num(np.array(xyz, dtype=float))
        turn = self.from_work.rotation(places)
        blocks = turn @ np.array(covariance, dtype=float) @ turn.transpose(0, 2, 1)
        return _nothing(self.from_work(places)), blocks.tolist()

    def of_station(
        self, name: str, station: Mapping[str, Any]
    ) -> tuple[Array | None, Array | None]:
        """Pose and covariance of a station in this frame; None of set-ups on points."""
        if station["world_from_scanner"] is None:
            return None, None
        pose, covariance = (np.array(station[k]) for k in ("world_from_scanner", "covariance"))
        if self.kind == "work":
            return pose, covariance
        if self.from_work is None:
            return self.stations.get(name, (None, None))
        turn = self.from_work.rotation(pose[None, :3, 3])[0]
        out = np.eye(4)
        out[:3, :3] = turn @ pose[:3, :3]
        out[:3, 3] = self.from_work(pose[None, :3, 3])[0]
        both = np.kron(np.eye(2), turn)
        return out, both @ covariance @ both.T

    def of_plane(
        self, normal: Array, offset: float, centre: Array | None
    ) -> tuple[Array, float, Array | None]:
        """A plane ``normal x = offset`` in this frame, with its centre."""
        if self.kind == "work" or self.from_work is None:
            return normal, offset, centre
        at = centre if centre is not None else (self.from_work.low + self.from_work.high) / 2
        at = at + (offset - normal @ at) * normal
        turned = self.from_work.rotation(at[None])[0] @ normal
        there = self.from_work(at[None])[0]
        return turned, float(turned @ there), None if centre is None else there

    def of_directions(self, directions: Array, at: Array) -> Array:
        """Directions (n, 3) of the work frame at a place of it, in this frame."""
        if self.kind == "work" or self.from_work is None:
            return directions
        turned: Array = directions @ self.from_work.rotation(at[None])[0].T
        return turned

    def of_adjusted(self, adjusted: Mapping[str, Any]) -> dict[str, Any]:
        """What an adjustment of a session moved, in this frame."""
        out = dict(adjusted)
        if self.kind == "work" or self.from_work is None:
            return out
        out["points"] = [self._moved(row) for row in adjusted["points"]]
        out["stations"] = [self._moved(row) for row in adjusted["stations"]]
        return out

    def _moved(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """A row of what moved in this frame."""
        assert self.from_work is not None
        if row.get("world_from_scanner") is not None:
            pose, covariance = self.of_station("", row)
            assert pose is not None
            assert covariance is not None
            place = np.array(row["world_from_scanner"])[:3, 3]
            new = {"world_from_scanner": pose.tolist(), "covariance": covariance.tolist()}
        elif row.get("xyz") is not None:
            xyz, blocks = self.of_points({"": row})
            place = np.nan_to_num(np.array(row["xyz"], dtype=float))
            new = {"xyz": xyz[0], "covariance": blocks[0]}
        else:
            return dict(row)
        if row.get("moved") is not None:
            moved = np.nan_to_num(np.array(row["moved"], dtype=float))
            new["moved"] = (self.from_work.rotation(place[None])[0] @ moved).tolist()
        if row.get("before") is not None:
            before = np.array(row["before"], dtype=float)
            turn = np.kron(np.eye(len(before) // 3), self.from_work.rotation(place[None])[0])
            new["before"] = (turn @ before @ turn.T).tolist()
        return {**row, **new}

    def elsewhere(self, place: Array) -> dict[str, Array]:
        """A place (3,) of this frame in all frames that are known, angles in radians."""
        out: dict[str, Array] = {self.kind: place}
        for name, to in self.maps.items():
            there = to(place[None])[0]
            if np.isfinite(there).all():
                scale = np.array([self.radius, self.radius, 1.0]) if name == "geodetic" else 1.0
                out[name] = there / scale
        return {key: out[key] for key in ("work", "projected", "geodetic", "ecef") if key in out}


def _nothing(xyz: Array) -> list[list[float | None]]:
    """Rows of coordinates; None replaces NaN."""
    return [[float(v) if np.isfinite(v) else None for v in row] for row in xyz]
