"""Stations registered by their planes from nothing: time of each step against reading the points.

A courtyard is scanned by the simulator from seven stations. Laying the points out as an image,
where every point is looked at once, is the limit; against it stand finding planes, the view, and
the search of all pairs; with the errors of the poses before any adjustment.
"""

from collections.abc import Callable, Iterator
from itertools import combinations
from typing import TypeVar

import numpy as np

from benchmarks.figures import Cost, Figure, cost_of, run
from tribrach.registration.planes.plane_set import PlaneSet
from tribrach.registration.planes.poses import pair_poses
from tribrach.registration.planes.stations import register_by_planes
from tribrach.registration.views import Surroundings, view_of
from tribrach.scan.range_image import organise
from tribrach.simulate.twins.sphere_courtyard import build
from tribrach.targets.planes import find_planes

Result = TypeVar("Result")

NOISE = {"sigma_range": 1.15e-3, "sigma_angle": 1e-4}
STEPS = ("image", "planes", "view", "pairs")


class Spent:
    """Costs of steps, summed over the stations."""

    def __init__(self) -> None:
        self.sums = dict.fromkeys(STEPS, Cost(0.0, 0.0))
        self.points = 0

    def step(self, name: str, work: Callable[[], Result]) -> Result:
        """What the work gives; its cost is added."""
        result, cost = cost_of(work)
        old = self.sums[name]
        self.sums[name] = Cost(old.wall + cost.wall, old.processor + cost.processor, cost.memory)
        return result


def station(twin, number: int, spent: Spent) -> Surroundings:
    """One station of the twin, from its points."""
    blocks = list(twin.measure(number))
    xyz = np.concatenate([b.xyz for b in blocks])
    rows = np.concatenate([b.row for b in blocks])
    columns = np.concatenate([b.column for b in blocks])
    image = spent.step("image", lambda: organise(xyz, rows, columns))
    planes, _ = spent.step("planes", lambda: find_planes(xyz, image, **NOISE))
    view = spent.step("view", lambda: view_of(xyz, image))
    spent.points += len(xyz)
    return Surroundings.of(twin.scans[number].name, PlaneSet.of(planes), view, True)


def measure(thousands: float) -> Iterator[Figure]:
    """Every step against laying out the image, which looks at each point once."""
    warm = build(20_000)
    pair_poses(*(station(warm, k, Spent()) for k in (0, 2)))
    twin, spent = build(int(1000 * thousands)), Spent()
    whole = [k for k, one in enumerate(twin.scans) if one.name == one.station]
    stations = [station(twin, k, spent) for k in whole]
    pairs = [
        spent.step("pairs", lambda a=a, b=b: pair_poses(a, b)) for a, b in combinations(stations, 2)
    ]
    found = register_by_planes(stations)
    truth = {s.name: s.pose for s in twin.stations}
    errors = [
        np.linalg.norm(
            (truth[p.first].inverse @ truth[p.second]).translation - p.poses[0].pose.translation
        )
        for p in pairs
        if p.sure
    ]
    told = {"pairs": f"{len(pairs)} pairs, {len(errors)} decided"}
    if errors:
        told["pairs"] += f", worst {1e3 * max(errors):.2f} mm"
    told["pairs"] += f"; groups of {[len(group) for group in found.groups]} stations"
    size = f"{len(stations)} stations, {spent.points / 1e6:.1f} million points"
    for name in STEPS[1:]:
        peer = "laying out the range images"
        ours, limit = spent.sums[name], spent.sums["image"]
        yield Figure(f"stations by planes: {name}", size, ours, peer, limit, told.get(name, ""))


if __name__ == "__main__":
    run(measure, full=(500,), small=(60,))
