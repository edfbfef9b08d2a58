"""What a network leaves open is said in words, and inner constraints close it.

Distances alone know neither where the network lies nor how it is turned.
"""

from itertools import combinations

import numpy as np

import tribrach as tb
from tribrach.errors import RankDefect
from tribrach.observations.sights import Distances

PLACES = {
    "A": (0, 0, 0), "B": (40, 5, 2), "C": (35, 42, -1), "D": (-4, 38, 3), "E": (18, 20, 15),
}  # fmt: skip

pairs = list(combinations(PLACES, 2))
lengths = np.array([np.linalg.norm(np.subtract(PLACES[a], PLACES[b])) for a, b in pairs])
measured = lengths + 0.002 * np.random.default_rng(2).normal(size=len(pairs))
survey = tb.Survey()
for name, xyz in PLACES.items():
    survey.point(name, xyz)
survey.add(
    Distances,
    values=measured,
    sigma=0.002,
    start=[a for a, _ in pairs],
    end=[b for _, b in pairs],
)

try:
    tb.adjust(survey.network())
except RankDefect as defect:
    print(defect)

free = tb.adjust(survey.network().with_datum(tb.Datum("free")))
print(free)
for name, point in free.points.items():
    axes = (1000 * point.ellipsoid.axes).round(2)
    print(f"{name}: semi-axes of the 95 % ellipsoid {axes} mm")
