"""Rays per second in the scene of a twin, beside rays that look at every primitive.

The ratio says what sorting the directions into cells is worth; the second number is the simulator
as a whole, with footprints, noise and truth. Run: ``python benchmarks/ray_casting.py``.
"""

import time

import numpy as np

from tribrach.simulate.ray_casting import SceneView
from tribrach.simulate.twins import build

RAYS = 2_000_000
EVERY = 20_000


def timed(work) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def main() -> None:
    twin = build("hanoi-facade", 1_000_000, 1)
    view = SceneView(twin.scene, twin.stations[0].pose.translation)
    rng = np.random.default_rng(1)
    rays = rng.normal(size=(RAYS, 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    numbers = [np.full(EVERY, k) for k in range(len(twin.scene))]
    view.cast(rays[:10]), view.again(rays[:EVERY], numbers[0])
    sorting = timed(lambda: SceneView(twin.scene, view.origin))
    cells = min(timed(lambda: view.cast(rays)) for _ in range(3))
    every = timed(lambda: [view.again(rays[:EVERY], k) for k in numbers])
    rate, slow = RAYS / cells, EVERY / every
    print(f"{len(twin.scene)} primitives, sorted into cells in {1e3 * sorting:.0f} ms")
    print(f"ray caster: {rate / 1e6:.1f} million rays per second, {rate / slow:.0f} x all in turn")
    sum(len(block) for block in twin.measure(1))
    done = [0]

    def simulate() -> None:
        done[0] = sum(block.rays for block in twin.measure(0))

    whole = timed(simulate)
    print(f"scanner with footprint, noise and truth: {done[0] / whole / 1e6:.2f} million a second")


if __name__ == "__main__":
    main()
