"""A plan network of distances and directions whose epochs are drawn with known errors."""

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.epochs.differences import Epoch

#: six pillars around an object, two points on it
XYZ = np.array(
    [
        [0, 0, 0],
        [200, 30, 5],
        [180, 190, -3],
        [20, 210, 8],
        [100, 260, 2],
        [260, 120, 0],
        [90, 100, 1],
        [120, 80, 4.0],
    ]
)
NAMES = tuple("ABCDEFGH")
PILLARS = NAMES[:6]
OPEN = ("shift in E", "shift in N", "rotation about U")


@dataclass
class Network:
    """Distances (1 mm) between all points and sets of directions (10 microrad) at all points."""

    design: Array
    cofactor: Array
    dof: int

    @classmethod
    def measured(cls) -> "Network":
        n, rows = len(XYZ), []
        for i in range(n):
            for j in range(n):
                if i == j:
                    continue
                step = XYZ[j, :2] - XYZ[i, :2]
                length = np.hypot(*step)
                along = step / length
                if i < j:
                    row = np.zeros(4 * n)
                    row[3 * i : 3 * i + 2], row[3 * j : 3 * j + 2] = -along, along
                    rows.append(row / 1e-3)
                across = np.array([-along[1], along[0]]) / length
                row = np.zeros(4 * n)
                row[3 * i : 3 * i + 2], row[3 * j : 3 * j + 2] = -across, across
                row[3 * n + i] = 1.0
                rows.append(row / 1e-5)
        design = np.array(rows)
        cofactor = np.linalg.pinv(design.T @ design, rcond=1e-11)
        return cls(design, cofactor, len(design) - int(np.linalg.matrix_rank(design)))

    def epoch(
        self, rng: np.random.Generator, shift: Array | None = None, label: str = "epoch"
    ) -> Epoch:
        """Adjusted coordinates with random errors of the readings, and true displacements."""
        error = rng.normal(size=len(self.design))
        solved = self.cofactor @ (self.design.T @ error)
        left = error - self.design @ solved
        n = len(XYZ)
        xyz = XYZ + solved[: 3 * n].reshape(-1, 3) + (0 if shift is None else shift)
        xyz[:, 2] = np.nan
        factor = float(left @ left) / self.dof
        covariance = self.cofactor[: 3 * n, : 3 * n]
        return Epoch(label, NAMES, xyz, covariance, OPEN, self.dof, factor)
