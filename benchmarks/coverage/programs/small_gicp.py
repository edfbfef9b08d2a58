"""small_gicp from the approximate poses; the inverse of its Hessian as covariance."""

from importlib.metadata import version

import numpy as np
import small_gicp

from benchmarks.coverage.programs import Found
from benchmarks.coverage.scenes import Scene
from benchmarks.coverage.world import Array

SETTINGS = (
    f"small_gicp {version('small_gicp')}, GICP on a grid of 0.1 m from the approximate poses; "
    "inverse Hessian times the variance of its residuals"
)


def fitted(first: Array, other: Array, start: Array) -> Found | str:
    """One scan fitted to the first, coarsely and then finely."""
    pose = start
    for reach in (1.0, 0.3):
        found = small_gicp.align(
            first, other, pose, "GICP", downsampling_resolution=0.1,
            max_correspondence_distance=reach, max_iterations=100,
            rotation_epsilon=1e-6, translation_epsilon=1e-5,
        )  # fmt: skip
        pose = found.T_target_source
    if not found.converged or found.num_inliers < 100:
        return "not converged"
    # its increments stand on the right: turn, then shift, along the axes of the scan
    back = np.zeros((6, 6))
    back[:3, 3:] = back[3:, :3] = pose[:3, :3]
    variance = 2 * found.error / (3 * found.num_inliers - 6)
    try:
        covariance = variance * back @ np.linalg.inv(found.H) @ back.T
    except np.linalg.LinAlgError:
        return "its Hessian is singular"
    return Found(pose, (covariance + covariance.T) / 2)


def register(scene: Scene) -> dict[str, Found | str]:
    """Each scan by itself."""
    first = scene.points(scene.scans[0])
    return {s: fitted(first, scene.points(s), scene.approximate(s)) for s in scene.scans[1:]}
