"""A transformation by common points, weighted on both sides, and how good it is anywhere.

Its covariance grows away from the common points: that is what an RMS does not tell.
"""

import numpy as np

import tribrach as tb
from tribrach.geometry.rotation import exp

rng = np.random.default_rng(5)
local = rng.uniform([0, 0, 0], [60, 40, 12], (7, 3))
world = local @ exp(np.array([0.01, -0.02, 0.9])).T + [500_000.0, 4_200_000.0, 320.0]
sigma = np.tile(np.diag([0.002, 0.002, 0.004]) ** 2, (7, 1, 1))
measured = world + rng.normal(size=world.shape) * [0.002, 0.002, 0.004]

fit = tb.fit_transformation(local, measured, 6, covariance_b=sigma)
print(f"sigma0 {fit.sigma0:.2f} a posteriori, RMS of the differences {1000 * fit.rms:.1f} mm")
for where in ([30.0, 20.0, 6.0], [200.0, 20.0, 6.0]):
    (matrix,) = fit.predicted(np.array([where]))
    print(where, "carried over with sigma", (1000 * np.sqrt(np.diagonal(matrix))).round(1), "mm")
