"""Scanner polar observation of a point: range, horizontal angle, zenith angle, with calibration.

``h = g - Delta(g; c, k)`` with ``g = (r, H, V)`` of ``u = R^T (X - t)``: true = measured + Delta.
H is counter-clockwise from the scanner's x axis, V the zenith angle, k the face (method section 2.1).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tribrach.geometry.rotation import skew
from tribrach.instruments.calibration import CalibrationModel
from tribrach.network.observations.base import (
    Array,
    Block,
    Index,
    Observations,
    per_item,
    refers,
    shared,
    wrap,
)
from tribrach.network.unknowns import Layout, State

__all__ = ["ScannerPolar"]

#: nearer than this [m], or closer to a pole than this [rad], the angles are not defined
NEAREST, POLE = 0.3, np.radians(0.5)


@dataclass(kw_only=True)
class ScannerPolar(Observations):
    """Values (n, 3) r [m], H, V [rad] of ``target`` (position indices) from ``station`` (poses).

    face : +1 front, -1 back (n,); back-face readings are folded to the front before.
    model : calibration model, or None; parameters : scalar indices (n, k) of its parameters.

    Raises
    ------
    ValueError : ranges below 0.3 m or zenith angles within 0.5 degrees of a pole.
    """

    station: Index = refers("pose")
    target: Index = refers("position")
    face: Array = per_item(1.0)
    parameters: Index = refers("scalar", optional=True)
    model: CalibrationModel | None = shared()
    kind: ClassVar[str] = "scanner_polar"
    units: ClassVar[tuple[str, ...]] = ("m", "rad", "rad")
    components: ClassVar[tuple[str, ...]] = ("range", "horizontal", "zenith")
    angular: ClassVar[tuple[int, ...]] = (1,)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.model is None:
            self.parameters = np.empty((len(self), 0), dtype=np.int64)
        pole = np.abs(np.sin(self.values[:, 2])) < np.sin(POLE)
        bad = np.flatnonzero((self.values[:, 0] < NEAREST) | pole)
        if len(bad):
            source = self.source[bad[0]] or f"observation {bad[0] + 1}"
            raise ValueError(f"{source}: nearer than {NEAREST} m or within 0.5 deg of a pole")

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """Station and target."""
        poses = layout.names["pose"]
        return [
            (poses[i], layout.position_name(j))
            for i, j in zip(self.station, self.target, strict=True)
        ]

    def _geometry(self, state: State) -> tuple[Array, Array, Array]:
        """Chord in W, vector in the scanner frame, polar coordinates; (n, 3) each."""
        chord = state.positions[self.target] - state.pose_t[self.station]
        u = np.einsum("nji,nj->ni", state.pose_r[self.station], chord)
        flat = np.hypot(u[:, 0], u[:, 1])
        r = np.hypot(flat, u[:, 2])
        polar = np.stack([r, np.arctan2(u[:, 1], u[:, 0]), np.arctan2(flat, u[:, 2])], axis=1)
        return chord, u, polar

    def predict(self, state: State) -> Array:
        """r, H, V (n, 3)."""
        _, _, polar = self._geometry(state)
        if self.model is not None:
            polar = polar - self.model.delta(polar, self.face, state.scalars[self.parameters])
        polar[:, 1] = wrap(polar[:, 1])
        return polar

    def jacobian(self, state: State) -> list[Block]:
        """``T Jp R^T`` by the point, ``-T Jp R^T`` and ``T Jp R^T [D]x`` by the pose, -B by c."""
        layout = state.layout
        chord, u, polar = self._geometry(state)
        by_x = polar_by_xyz(u) @ state.pose_r[self.station].transpose(0, 2, 1)
        blocks = []
        if self.model is not None:
            c = state.scalars[self.parameters]
            by_x = by_x - self.model.derivative(polar, self.face, c) @ by_x
            columns = layout.columns("scalar", self.parameters)[..., 0]
            r, h, v = polar.T
            blocks.append(Block(columns, -self.model.columns(r, h, v, self.face)))
        by_pose = np.concatenate([-by_x, by_x @ skew(chord)], axis=2)
        return [
            Block(layout.position_columns(self.target), by_x),
            Block(layout.columns("pose", self.station), by_pose),
            *blocks,
        ]


def polar_by_xyz(u: Array) -> Array:
    """Derivative (n, 3, 3) of (r, H, V) by the vector (n, 3)."""
    x, y, z = u.T
    h2 = x**2 + y**2
    h = np.sqrt(h2)
    r = np.sqrt(h2 + z**2)
    zero = np.zeros_like(x)
    return np.stack(
        [
            np.stack([x / r, y / r, z / r], axis=1),
            np.stack([-y / h2, x / h2, zero], axis=1),
            np.stack([x * z / (h * r**2), y * z / (h * r**2), -h / r**2], axis=1),
        ],
        axis=1,
    )
