"""A resection with one wrong distance: the test that names it, and the network without it.

A station sees five control points; the third distance is 30 mm too long.
"""

import numpy as np

import tribrach as tb
from tribrach.observations.sights import Directions, SlopeDistances, ZenithAngles
from tribrach.units import GON

CONTROL = {
    "1": (1020.0, 2040.0, 12.0),
    "2": (1075.0, 2010.0, 10.5),
    "3": (1060.0, 1955.0, 14.0),
    "4": (1005.0, 1950.0, 9.0),
    "5": (975.0, 2005.0, 11.0),
}
station = np.array([1025.0, 1998.0, 10.0])

MGON = GON / 1000

names = list(CONTROL)
sight = np.array(list(CONTROL.values())) - station
length = np.linalg.norm(sight, axis=1)
rng = np.random.default_rng(7)

survey = tb.Survey()
for name, xyz in CONTROL.items():
    given = xyz + 0.001 * rng.normal(size=3)
    survey.point(name, given, role="control", covariance=np.diag([1e-3] * 3) ** 2)
survey.point("T")  # where it stands follows from the observations
ends = {"start": ["T"] * 5, "end": names}
circle = np.arctan2(sight[:, 0], sight[:, 1]) - 0.8  # an orientation that nobody knows
survey.add(
    Directions,
    values=np.remainder(circle + 0.3 * MGON * rng.normal(size=5), 2 * np.pi),
    sigma=0.3 * MGON,
    orientation=["T set 1"] * 5,
    source=[f"field.book:{k}" for k in range(1, 6)],
    **ends,
)
survey.add(
    ZenithAngles,
    values=np.arccos(sight[:, 2] / length) + 0.3 * MGON * rng.normal(size=5),
    sigma=0.3 * MGON,
    source=[f"field.book:{k}" for k in range(6, 11)],
    **ends,
)
measured = length + 0.001 * rng.normal(size=5)
measured[2] += 0.030
survey.add(
    SlopeDistances,
    values=measured,
    sigma=0.001,
    source=[f"field.book:{k}" for k in range(11, 16)],
    **ends,
)

network = survey.network()
adjustment = tb.adjust(network)
worst = max(adjustment.observations, key=lambda row: abs(row.w or 0.0))
print(f"{worst.id} has w = {worst.w:.1f} and stands at {worst.source}")

without = tb.adjust(network.without(worst.id, reason="prism at the wrong point"))
print(without.summary())
moved = without.points["T"].xyz - adjustment.points["T"].xyz
print(f"T moves by {1000 * np.linalg.norm(moved):.1f} mm")
