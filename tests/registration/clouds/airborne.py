"""An airborne cloud of a scene: 8 points a square metre from both sides, with an offset."""

import numpy as np

from tribrach._types import Array
from tribrach.simulate.ray_casting import SceneView
from tribrach.simulate.scene import Scene

#: noise of a point across and along the beam [m]
SIGMA = 0.02
STRIPS = (-110.0, 110.0)
HEIGHT = 300.0


def airborne(
    scene: Scene, rng: np.random.Generator, *, density: float = 8.0, half: float = 45.0
) -> Array:
    """Points (n, 3) within a square about the origin [m], in the world."""
    out = []
    places = np.linspace(-60, 60, 5)
    for y in STRIPS:
        for x in places:
            origin = np.array([x, y, HEIGHT])
            count = int(density * (2 * half) ** 2 / (len(STRIPS) * len(places)))
            aim = np.column_stack([rng.uniform(-half, half, (count, 2)), np.zeros(count)])
            rays = aim - origin
            rays /= np.linalg.norm(rays, axis=1, keepdims=True)
            far = SceneView(scene, origin).cast(rays).range
            seen = np.isfinite(far)
            noisy = far[seen] + rng.normal(0, SIGMA, int(seen.sum()))
            out.append(origin + noisy[:, None] * rays[seen])
    points = np.concatenate(out)
    return points + rng.normal(0, SIGMA, points.shape) * [0.5, 0.5, 0.0]
