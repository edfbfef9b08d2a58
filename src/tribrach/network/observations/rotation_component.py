"""One component of a station's rotation, fixed or weighted: ``a . log(R R0^T)``.

``a`` is a unit vector of the work frame and ``R0`` the rotation the component is measured from: a
known heading, a tilt taken as zero, a component fixed as a datum (method section 2.13).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from tribrach.geometry.rotation import log, right_jacobian_inverse
from tribrach.network.observations.base import Array, Block, Index, Observations, refers
from tribrach.network.unknowns import Layout, State

__all__ = ["RotationComponents"]


@dataclass(kw_only=True)
class RotationComponents(Observations):
    """Components [rad] of the turn of ``station`` from a reference, along an axis.

    axis (n, 3) unit vectors of W, reference (n, 3, 3) rotations.
    """

    station: Index = refers("pose")
    axis: Array = field()
    reference: Array = field()
    kind: ClassVar[str] = "rotation_component"
    units: ClassVar[tuple[str, ...]] = ("rad",)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.axis = np.asarray(self.axis, dtype=float).reshape(-1, 3)
        self.reference = np.asarray(self.reference, dtype=float).reshape(-1, 3, 3)

    def ends(self, layout: Layout) -> list[tuple[str, str]]:
        """The station."""
        return [(layout.names["pose"][i], "") for i in self.station]

    def _turn(self, state: State) -> Array:
        turn: Array = log(state.pose_r[self.station] @ self.reference.transpose(0, 2, 1))
        return turn

    def predict(self, state: State) -> Array:
        """Components (n, 1)."""
        values: Array = np.einsum("ni,ni->n", self.axis, self._turn(state))
        return values[:, None]

    def jacobian(self, state: State) -> list[Block]:
        """``a^T Jl^-1`` by the rotation."""
        left = right_jacobian_inverse(self._turn(state)).transpose(0, 2, 1)
        columns = state.layout.columns("pose", self.station)[:, 3:]
        return [Block(columns, self.axis[:, None, :] @ left)]
