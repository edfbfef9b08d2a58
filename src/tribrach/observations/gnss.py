"""A point that is mounted on a scanner, ``0 = X - t - R l``: an antenna or a prism of its own.

What is measured to the point (vectors of a GNSS session, sights of a total station) then places the
scanner through the lever arm ``l``, an unknown vector in the scanner frame (method section 2.8).
:class:`~tribrach.observations.gnss.Antennas` is the same for positions.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach._types import Array, Index
from tribrach.geodesy.site import FlatSite, Site
from tribrach.geometry.rotation import exp, right_jacobian_inverse, skew
from tribrach.observations.base import Block, Observations, per_item, refers
from tribrach.observations.unknowns import Layout, State

__all__ = ["Antennas", "GnssBaselines", "GnssPositions", "MountedPoints"]

# GNSS position of a mark or antenna in the work frame, with a common part of its session.
#
# ``y = X + a g(X) + c``: antenna height ``a`` along the local vertical, and an optional common
# shift ``c`` (a vector unknown with its own prior) shared by all positions of a session, so that
# their relative precision is better than their absolute one (method section 2.6).


@dataclass(kw_only=True)
class GnssPositions(Observations):
    """Positions (n, 3) [m] in W of ``position`` (position indices).

    antenna_height : [m] (n,) over the position; common : index (n,) of the session's shift
    vector, -1 for none.
    """

    position: Index = refers("position")
    antenna_height: Array = per_item(0.0)
    common: Index = refers("vector", optional=True)
    site: Site = field(default_factory=FlatSite)
    kind: ClassVar[str] = "gnss_position"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("E", "N", "U")

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The position."""
        return [(layout.position_name(i), "") for i in self.position]

    def predict(self, state: State) -> Array:
        """Antenna positions (n, 3)."""
        x = state.positions[self.position]
        antenna = x + self.antenna_height[:, None] * self.site.axes(x)[:, 2]
        if (self.common >= 0).any():
            shift = state.vectors[np.maximum(self.common, 0)]
            antenna = antenna + np.where(self.common[:, None] >= 0, shift, 0.0)
        return antenna

    def jacobian(self, state: State) -> list[Block]:
        """Identity by the position (and the turn of the vertical), identity by the shift."""
        x = state.positions[self.position]
        up = self.site.axes(x)[:, 2]
        tilt = self.antenna_height[:, None, None] * (skew(up) @ self.site.turn(x))
        blocks = [Block(state.layout.position_columns(self.position), np.eye(3) - tilt)]
        if (self.common >= 0).any():
            columns = state.layout.columns("vector", self.common)
            blocks.append(Block(columns, np.broadcast_to(np.eye(3), (len(self), 3, 3))))
        return blocks


# GNSS baseline ``X_b - X_a`` as a vector of the work frame, with its full covariance.
#
# ``y = (1 + m) exp(w) (X_b - X_a)``. Vectors and covariances measured in ECEF are rotated into W
# by the reader (method sections 1.1 and 2.7); antenna heights run along the local verticals. The
# scale ``m`` and the turn ``w`` of the GNSS frame against W are optional unknowns. Several
# baselines of one session are joined by a joint covariance of the network.


@dataclass(kw_only=True)
class GnssBaselines(Observations):
    """Vectors (n, 3) [m] in W from ``start`` to ``end`` (position indices).

    height_start, height_end : antenna heights [m] (n,); scale : index (n,) of a scalar that
    scales the vectors by ``1 + m``; turn_e, turn_n, turn_u : indices (n,) of the components of
    the rotation vector ``w`` [rad] about the axes of W; -1 for none.
    """

    start: Index = refers("position")
    end: Index = refers("position")
    height_start: Array = per_item(0.0)
    height_end: Array = per_item(0.0)
    scale: Index = refers("scalar", optional=True)
    turn_e: Index = refers("scalar", optional=True)
    turn_n: Index = refers("scalar", optional=True)
    turn_u: Index = refers("scalar", optional=True)
    site: Site = field(default_factory=FlatSite)
    kind: ClassVar[str] = "gnss_baseline"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("E", "N", "U")

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """From and to."""
        name = layout.position_name
        return [(name(i), name(j)) for i, j in zip(self.start, self.end, strict=True)]

    def _chord(self, state: State) -> Array:
        a, b = state.positions[self.start], state.positions[self.end]
        top_b = b + self.height_end[:, None] * self.site.axes(b)[:, 2]
        return top_b - a - self.height_start[:, None] * self.site.axes(a)[:, 2]

    def _turn(self, state: State) -> Array:
        """Rotation vectors ``w`` (n, 3)."""
        return np.stack([state.scalar(i) for i in (self.turn_e, self.turn_n, self.turn_u)], axis=1)

    def _frame(self, state: State) -> Array:
        """``(1 + m) exp(w)``, (n, 3, 3)."""
        return (1 + state.scalar(self.scale))[:, None, None] * exp(self._turn(state))

    def predict(self, state: State) -> Array:
        """Vectors (n, 3)."""
        vectors: Array = np.einsum("nij,nj->ni", self._frame(state), self._chord(state))
        return vectors

    def jacobian(self, state: State) -> list[Block]:
        """Plus the frame at the end, minus it at the start; the vector itself by the scale."""
        columns = state.layout.position_columns
        frame = self._frame(state)
        blocks = [
            Block(columns(self.end), frame @ self._by_mark(state, self.end, self.height_end)),
            Block(
                columns(self.start), -frame @ self._by_mark(state, self.start, self.height_start)
            ),
        ]
        if (self.scale >= 0).any():
            turned = exp(self._turn(state)) @ self._chord(state)[:, :, None]
            blocks.append(Block(state.layout.columns("scalar", self.scale), turned))
        return blocks + self._by_turn(state)

    def _by_turn(self, state: State) -> list[Block]:
        """``-[y]x Jl(w)``, one column for each component that is unknown."""
        parts = (self.turn_e, self.turn_n, self.turn_u)
        if not any((index >= 0).any() for index in parts):
            return []
        left = np.linalg.inv(right_jacobian_inverse(self._turn(state)).transpose(0, 2, 1))
        by_w = -skew(self.predict(state)) @ left
        return [
            Block(state.layout.columns("scalar", index), by_w[:, :, [k]])
            for k, index in enumerate(parts)
        ]

    def _by_mark(self, state: State, index: Index, height: Array) -> Array:
        """Derivative (n, 3, 3) of an antenna by its mark: identity and the vertical's turn."""
        x = state.positions[index]
        up = self.site.axes(x)[:, 2]
        return np.eye(3) - height[:, None, None] * (skew(up) @ self.site.turn(x))


# Antenna (or prism) on the scanner, ``y = t + R l + c`` with the lever arm ``l`` as an unknown.
#
# The lever arm is a vector in the scanner frame with a prior from its calibration; ``c`` is the
# optional common shift of a GNSS session (method section 2.8).


@dataclass(kw_only=True)
class Antennas(Observations):
    """Positions (n, 3) [m] in W of the antenna on ``station`` (pose indices).

    lever_arm : vector indices (n,); common : vector indices (n,) of a session's shift, -1 none.
    """

    station: Index = refers("pose")
    lever_arm: Index = refers("vector")
    common: Index = refers("vector", optional=True)
    kind: ClassVar[str] = "antenna"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("E", "N", "U")

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The station and its lever arm."""
        poses, vectors = layout.names["pose"], layout.names["vector"]
        return [(poses[i], vectors[j]) for i, j in zip(self.station, self.lever_arm, strict=True)]

    def predict(self, state: State) -> Array:
        """Antenna positions (n, 3)."""
        arm = np.einsum("nij,nj->ni", state.pose_r[self.station], state.vectors[self.lever_arm])
        shift = np.where(self.common[:, None] >= 0, state.vectors[np.maximum(self.common, 0)], 0.0)
        antenna: Array = state.pose_t[self.station] + arm + shift
        return antenna

    def jacobian(self, state: State) -> list[Block]:
        """Identity and ``-[R l]x`` by the pose, R by the lever arm, identity by the shift."""
        layout = state.layout
        r = state.pose_r[self.station]
        arm = np.einsum("nij,nj->ni", r, state.vectors[self.lever_arm])
        eye = np.broadcast_to(np.eye(3), r.shape)
        blocks = [
            Block(layout.columns("pose", self.station), np.concatenate([eye, -skew(arm)], axis=2)),
            Block(layout.columns("vector", self.lever_arm), r),
        ]
        if (self.common >= 0).any():
            blocks.append(Block(layout.columns("vector", self.common), eye))
        return blocks


@dataclass(kw_only=True)
class MountedPoints(Observations):
    """Zeros (n, 3) [m]; the covariance says how well the mounting repeats, along E, N, U of W.

    station : pose indices (n,); point : position indices (n,); lever_arm : vector indices (n,).
    """

    station: Index = refers("pose")
    point: Index = refers("position")
    lever_arm: Index = refers("vector")
    kind: ClassVar[str] = "mounted_point"
    units: ClassVar[tuple[str, ...]] = ("m", "m", "m")
    components: ClassVar[tuple[str, ...]] = ("E", "N", "U")

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The station and the point on it."""
        poses = layout.names["pose"]
        return [
            (poses[i], layout.position_name(j))
            for i, j in zip(self.station, self.point, strict=True)
        ]

    def _arm(self, state: State) -> Array:
        r, arm = state.pose_r[self.station], state.vectors[self.lever_arm]
        turned: Array = np.einsum("nij,nj->ni", r, arm)
        return turned

    def predict(self, state: State) -> Array:
        """Points relative to where their lever arms end, (n, 3)."""
        gap: Array = state.positions[self.point] - state.pose_t[self.station] - self._arm(state)
        return gap

    def jacobian(self, state: State) -> list[Block]:
        """Identity by the point, its opposite and ``[R l]x`` by the pose, -R by the lever arm."""
        layout = state.layout
        r = state.pose_r[self.station]
        eye = np.broadcast_to(np.eye(3), r.shape)
        by_pose = np.concatenate([-eye, skew(self._arm(state))], axis=2)
        return [
            Block(layout.position_columns(self.point), eye),
            Block(layout.columns("pose", self.station), by_pose),
            Block(layout.columns("vector", self.lever_arm), -r),
        ]
