"""Single coordinates, angles and distances of a target in the frame of a station.

``u = R^T (X + ht g(X) - t)`` is the target in the station's own frame, levelled or not, with a
prism or sphere ``ht`` above the mark along the local vertical ``g``. From it

* :class:`FrameCoordinates`: one of x, y, z, where a whole target centre was not measured;
* :class:`FrameAngles`: ``atan2(y, x)`` counterclockwise, or the elevation ``atan2(z, |(x, y)|)``,
  as of a laser tracker, or of a target in a photograph with the rays of a calibrated camera;
* :class:`FrameDistances`: ``|u|``.

Method sections 2.0 to 2.2.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach.geodesy.site import FlatSite, Site
from tribrach.geometry.rotation import skew
from tribrach.network.observations.base import (
    Array,
    Block,
    Index,
    Observations,
    norm,
    per_item,
    refers,
)
from tribrach.network.unknowns import Layout, State

__all__ = ["FrameAngles", "FrameCoordinates", "FrameDistances", "FrameSights"]


@dataclass(kw_only=True)
class FrameSights(Observations):
    """Observations of ``target`` (position indices) in the frame of ``station`` (pose indices).

    height_target : height of the target over its mark [m], (n,).
    """

    station: Index = refers("pose")
    target: Index = refers("position")
    height_target: Array = per_item(0.0)
    site: Site = field(default_factory=FlatSite)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """Station and target."""
        poses, name = layout.names["pose"], layout.position_name
        return [(poses[i], name(j)) for i, j in zip(self.station, self.target, strict=True)]

    def _chord(self, state: State) -> Array:
        """Target minus station in W, (n, 3)."""
        x = state.positions[self.target]
        top = x + self.height_target[:, None] * self.site.axes(x)[:, 2]
        return top - state.pose_t[self.station]

    def in_frame(self, state: State) -> Array:
        """Targets ``u`` (n, 3) in the station's frame [m]."""
        u: Array = np.einsum("nji,nj->ni", state.pose_r[self.station], self._chord(state))
        return u

    def frame_blocks(self, state: State, by_u: Array) -> list[Block]:
        """Chain ``by_u`` (n, 1, 3), the derivative of the value by ``u``, to the unknowns."""
        layout = state.layout
        in_w = by_u @ state.pose_r[self.station].transpose(0, 2, 1)
        x = state.positions[self.target]
        # moving the target turns the vertical that its height is measured along
        turn = skew(self.site.axes(x)[:, 2]) @ self.site.turn(x)
        by_target = in_w @ (np.eye(3) - self.height_target[:, None, None] * turn)
        by_pose = np.concatenate([-in_w, in_w @ skew(self._chord(state))], axis=2)
        return [
            Block(layout.position_columns(self.target), by_target),
            Block(layout.columns("pose", self.station), by_pose),
        ]


@dataclass(kw_only=True)
class FrameCoordinates(FrameSights):
    """Coordinates [m]; ``axis`` (n,) is 0 for x, 1 for y, 2 for z of the station's frame."""

    axis: Index = field()
    kind: ClassVar[str] = "frame_coordinate"
    units: ClassVar[tuple[str, ...]] = ("m",)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.axis = np.asarray(self.axis, dtype=np.int64)

    def predict(self, state: State) -> Array:
        """Coordinates (n, 1)."""
        u = self.in_frame(state)
        return u[np.arange(len(self)), self.axis][:, None]

    def jacobian(self, state: State) -> list[Block]:
        """The observed axis by ``u``."""
        return self.frame_blocks(state, np.eye(3)[self.axis][:, None, :])


@dataclass(kw_only=True)
class FrameAngles(FrameSights):
    """Angles [rad]; ``circle`` (n,) is 0 for ``atan2(y, x)``, 1 for the elevation."""

    circle: Index = field()
    kind: ClassVar[str] = "frame_angle"
    units: ClassVar[tuple[str, ...]] = ("rad",)
    angular: ClassVar[tuple[int, ...]] = (0,)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.circle = np.asarray(self.circle, dtype=np.int64)

    def predict(self, state: State) -> Array:
        """Angles (n, 1) in (-pi, pi]."""
        x, y, z = self.in_frame(state).T
        flat = np.hypot(x, y)
        angles: Array = np.where(self.circle == 0, np.arctan2(y, x), np.arctan2(z, flat))
        return angles[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """``(-y, x, 0)/q^2`` or ``(-x z/q, -y z/q, q)/|u|^2`` by ``u``, with ``q = |(x, y)|``."""
        u = self.in_frame(state)
        x, y, z = u.T
        flat = np.hypot(x, y)
        around = np.stack([-y, x, np.zeros(len(u))], axis=1) / flat[:, None] ** 2
        upward = np.stack([-x * z / flat, -y * z / flat, flat], axis=1) / norm(u)[:, None] ** 2
        by_u = np.where((self.circle == 0)[:, None], around, upward)
        return self.frame_blocks(state, by_u[:, None, :])


@dataclass(kw_only=True)
class FrameDistances(FrameSights):
    """Distances [m] from the station's origin."""

    kind: ClassVar[str] = "frame_distance"
    units: ClassVar[tuple[str, ...]] = ("m",)

    def predict(self, state: State) -> Array:
        """Distances (n, 1)."""
        return norm(self.in_frame(state))[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """The unit vector by ``u``."""
        u = self.in_frame(state)
        return self.frame_blocks(state, (u / norm(u)[:, None])[:, None, :])
