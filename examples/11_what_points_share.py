"""What points share: the mean of a wall is never better known than its station.

Two stations in a network of targets; points of two walls with the sigmas of means and distances.
"""

import numpy as np

import tribrach as tb
from tribrach.geometry.rotation import exp
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.observations.scanner import Inclinations, TargetCentres
from tribrach.units import SEC

TARGETS = {
    "T1": (3.0, 12.0, 1.2), "T2": (11.0, 9.0, 2.5), "T3": (14.0, -2.0, 0.8),
    "T4": (5.0, -6.0, 3.1), "T5": (-3.0, 4.0, 2.0),
}  # fmt: skip
STATIONS = {"S1": ((0.0, 0.0, 1.5), 0.4), "S2": ((9.0, 3.0, 1.6), -1.9)}

rng = np.random.default_rng(3)
survey = tb.Survey()
for name in ("T1", "T4"):
    survey.point(name, TARGETS[name], role="control", covariance=np.diag([1e-3] * 3) ** 2)
for station, (place, heading) in STATIONS.items():
    seen = (np.array(list(TARGETS.values())) - place) @ exp(np.array([0.0, 0.0, heading]))
    survey.station(station)
    survey.add(
        TargetCentres,
        values=seen + 0.0005 * rng.normal(size=seen.shape),
        sigma=0.0005,
        station=[station] * len(TARGETS),
        target=list(TARGETS),
    )
    survey.add(Inclinations, values=[[0.0, 0.0]], sigma=5 * SEC, station=[station])

noise = ScanNoise(range=0.002, range_scale=1e-5, horizontal=8 * SEC, vertical=8 * SEC)
shared = tb.SharedPart.of_adjustment(tb.adjust(survey.network()), noise)


def wall(count, y, station):
    """Points of a wall that stands at y, scanned from a station."""
    x, z = rng.uniform(4, 8, count), rng.uniform(0, 3, count)
    return shared.points(np.column_stack([x, np.full(count, y), z]), station)


normal = (0.0, 1.0, 0.0)
for count in (1, 100, 10_000, 1_000_000):
    mean = tb.mean_of(wall(count, 10.0, "S1")).along(normal)
    print(f"mean of {count} points: sigma {1e3 * mean.sigma:.2f} mm, floor {1e3 * mean.floor:.2f}")

print("walls from one station", tb.plane_distance(wall(5000, 10, "S1"), wall(5000, 4, "S1")))
print("walls from two stations", tb.plane_distance(wall(5000, 10, "S1"), wall(5000, 4, "S2")))
corners = shared.points([[4, 10, 0], [8, 10, 0], [8, 10, 3], [4, 10, 3]], "S1")
print("area of a window", tb.area_of(corners))
