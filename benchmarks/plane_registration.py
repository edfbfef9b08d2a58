"""Stations registered by their planes from nothing: time of each step against reading the points.

A courtyard is scanned by the simulator from seven stations. Printed are processor seconds for a
million points: laying them out as an image (every point is looked at once: the limit), finding
planes, the view, and for every pair the search; and the errors of the poses before any adjustment.

    python benchmarks/plane_registration.py [thousand points for each station]
"""

import sys
import time
from itertools import combinations

import numpy as np

from tribrach.registration.planes.plane_set import PlaneSet
from tribrach.registration.planes.poses import pair_poses
from tribrach.registration.planes.stations import register_by_planes
from tribrach.registration.views import Surroundings, view_of
from tribrach.scan.range_image import organise
from tribrach.simulate.twins.sphere_courtyard import build
from tribrach.targets.planes import find_planes

NOISE = {"sigma_range": 1.15e-3, "sigma_angle": 1e-4}


def timed(what, spent):
    """What a call returns; its processor time is added."""
    start = time.process_time()
    out = what()
    spent.append(time.process_time() - start)
    return out


def station(twin, number, spent):
    """One station of the twin, from its points."""
    blocks = list(twin.measure(number))
    xyz = np.concatenate([b.xyz for b in blocks])
    rows = np.concatenate([b.row for b in blocks])
    columns = np.concatenate([b.column for b in blocks])
    image = timed(lambda: organise(xyz, rows, columns), spent["image"])
    planes, _ = timed(lambda: find_planes(xyz, image, **NOISE), spent["planes"])
    view = timed(lambda: view_of(xyz, image), spent["view"])
    name = twin.scans[number].name
    spent["points"].append(len(xyz))
    return Surroundings.of(name, PlaneSet.of(planes), view, True)


def main():
    """Print the table."""
    points = 1000 * int(sys.argv[1]) if len(sys.argv) > 1 else 500_000
    warm = build(20_000)
    pair_poses(*(station(warm, k, {n: [] for n in NAMES}) for k in (0, 2)))
    twin = build(points)
    spent = {name: [] for name in NAMES}
    whole = [k for k, one in enumerate(twin.scans) if one.name == one.station]
    stations = [station(twin, k, spent) for k in whole]
    pairs = [
        timed(lambda a=a, b=b: pair_poses(a, b), spent["pair"])
        for a, b in combinations(stations, 2)
    ]
    found = register_by_planes(stations)
    million = sum(spent["points"]) / 1e6
    limit = sum(spent["image"])
    print(f"{len(stations)} stations, {million:.1f} million points")
    for name in ("image", "planes", "view"):
        used = sum(spent[name])
        print(f"{name:8}{used / million:8.2f} s per million points {used / limit:8.1f} x image")
    print(f"{'pair':8}{np.mean(spent['pair']):8.3f} s per pair of stations")
    truth = {s.name: s.pose for s in twin.stations}
    errors = [
        np.linalg.norm(
            (truth[p.first].inverse @ truth[p.second]).translation - p.poses[0].pose.translation
        )
        for p in pairs
        if p.sure
    ]
    print(f"{len(errors)} of {len(pairs)} pairs decided, worst {1e3 * max(errors):.2f} mm")
    print(f"groups of {[len(group) for group in found.groups]} stations")
    for name, why in found.obstacles.items():
        print(f"{name}: {why}")


NAMES = ("image", "planes", "view", "pair", "points")

if __name__ == "__main__":
    main()
