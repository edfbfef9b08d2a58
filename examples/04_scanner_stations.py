"""Two scanner stations tied by targets: poses, their covariance, and points with theirs.

Targets are observed as x, y, z in the frame of each scanner; two of them are control points.
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
        source=[f"scan {station}"] * len(TARGETS),
    )
    # a levelled scanner: its compensator says that its axis is vertical
    survey.add(Inclinations, values=[[0.0, 0.0]], sigma=5 * SEC, station=[station])

adjustment = tb.adjust(survey.network())
s2 = adjustment.stations["S2"]
print(s2)
print(adjustment.covariance("S1", "S2"))  # cross-covariance (6, 6)

wall = np.array([[8.0, 0.5, 0.2], [15.0, -4.0, 1.0]])  # points of the scan, in its own frame
noise = ScanNoise(range=0.001, range_scale=1e-5, horizontal=3 * SEC, vertical=3 * SEC)
xyz, covariance = tb.place(wall, s2, noise)
for point, matrix in zip(xyz, covariance, strict=True):
    print(point.round(4), "sigma", (1000 * np.sqrt(np.diagonal(matrix))).round(2), "mm")
