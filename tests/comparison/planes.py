"""Planes that are sampled with noise, for tests of comparisons."""

import numpy as np

Array = np.ndarray


def frame(normal: Array) -> Array:
    """Rotation (3, 3) whose columns are two directions in a plane and its unit normal."""
    normal = np.asarray(normal, float) / np.linalg.norm(normal)
    first = np.cross(normal, [0.3, 0.5, 0.8])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first), normal], axis=1)


def plane(rng, normal, offset, n, size=2.0, sigma=0.0, origin=(0, 0, 0)) -> Array:
    """Points (n, 3) of a square of a plane at an offset along its normal, with noise along it."""
    uv = rng.uniform(-size / 2, size / 2, (n, 2))
    w = offset + sigma * rng.normal(size=n)
    return np.asarray(origin, float) + np.column_stack([uv, w]) @ frame(normal).T
