"""Targets on rods over marks from a CSV file: ``mark, target, rod_m`` (method section 2.6).

The rod is the height of the target's centre over the mark along the plumb line. Its length has a
sigma; a bubble of some sensitivity moves the target by ``rod * bubble`` sideways, an eccentricity
of the sphere on its rod adds to that. What the file does not say comes from the instrument.
"""

from __future__ import annotations

import numpy as np

from tribrach.io.survey.csv_reader import Array, Reader
from tribrach.network.observations.offset import Offsets

__all__ = ["RodReader", "rod_covariance"]


def rod_covariance(rod: Array, sigma: Array, bubble: Array, eccentricity: Array) -> Array:
    """Covariances (n, 3, 3) [m^2] along E, N, U of targets over marks.

    rod, sigma, eccentricity (n,) [m]; bubble (n,) [rad], in each of two directions.
    """
    plan = (rod * bubble) ** 2 + eccentricity**2
    covariance: Array = np.stack([plan, plan, sigma**2], axis=1)[:, :, None] * np.eye(3)
    return covariance


class RodReader(Reader):
    """Spheres, prisms or checkerboards set up over marks."""

    def read(self) -> None:
        """All rods, as offsets from mark to target."""
        rod = self.table.columns("rod")[:, 0]
        bad = np.flatnonzero(~(rod > 0))
        if len(bad):
            row = int(bad[0])
            raise self.table.error(
                row, f"the rod is {rod[row]:g} m long", "give a length above zero"
            )
        marks = self.table.names("mark", self.all)
        targets = self.table.names("target", self.all)
        for row, (mark, target) in enumerate(zip(marks, targets, strict=True)):
            if mark == target:
                raise self.table.error(
                    row, f"mark and target are both {mark}", "give each a name of its own"
                )
        own = self.precision
        covariance = rod_covariance(
            rod,
            self.sigma(("sigma_rod",), self.all, lambda: self._all(own.rod)),
            self.sigma(("bubble",), self.all, lambda: self._all(own.bubble)),
            self.sigma(("eccentricity",), self.all, lambda: self._all(own.eccentricity)),
        )
        if not (np.einsum("nii->ni", covariance) > 0).all():
            raise self.table.error(
                0, "neither bubble nor eccentricity move the target", "give one of both above zero"
            )
        zero = np.zeros(len(rod))
        self.add(
            Offsets,
            self.all,
            values=np.stack([zero, zero, rod], axis=1),
            covariance=covariance,
            start=marks,
            end=targets,
        )

    def _all(self, value: float | None) -> Array | None:
        """One value for all rows."""
        return None if value is None else np.full(len(self.all), value)
