"""Rays per second in the scene of a twin, beside rays that look at every primitive.

The ratio says what sorting the directions into cells is worth; the second number is the simulator
as a whole, with footprints, noise and truth.
"""

from collections.abc import Iterator

import numpy as np

from benchmarks.figures import Cost, Figure, cost_of, run
from tribrach.simulate.ray_casting import SceneView
from tribrach.simulate.twins import build

#: rays that look at every primitive
EVERY = 20_000


def measure(millions: float) -> Iterator[Figure]:
    """Cells against all in turn; a whole scanner against its rays alone."""
    twin = build("hanoi-facade", 1_000_000, 1)
    view = SceneView(twin.scene, twin.stations[0].pose.translation)
    rng = np.random.default_rng(1)
    rays = rng.normal(size=(int(millions * 1e6), 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    numbers = [np.full(EVERY, k) for k in range(len(twin.scene))]
    view.cast(rays[:10]), view.again(rays[:EVERY], numbers[0])
    _, cells = cost_of(lambda: view.cast(rays), 3)
    _, few = cost_of(lambda: [view.again(rays[:EVERY], k) for k in numbers], 3)
    times = len(rays) / EVERY
    every = Cost(times * few.wall, times * few.processor)
    told = f"{millions / cells.wall:.1f} million rays a second; the peer from {EVERY} of them"
    size = f"{millions:g} million rays, {len(twin.scene)} primitives"
    yield Figure("casting rays by cells", size, cells, "all primitives in turn", every, told)
    sum(len(block) for block in twin.measure(1))
    done, whole = cost_of(lambda: sum(block.rays for block in twin.measure(0)))
    share = done / len(rays)
    bare = Cost(share * cells.wall, share * cells.processor)
    size = f"{done / 1e6:.1f} million rays"
    peer = "the rays alone"
    yield Figure("a scanner with footprint, noise and truth", size, whole, peer, bare)


if __name__ == "__main__":
    run(measure, full=(2,), small=(0.5,))
