"""A levelling loop with one benchmark: corrections, redundancy numbers, sigmas of the heights.

Lines of 1 mm per square root of a kilometre; the loop closes with 4 mm over 5 km.
"""

import numpy as np

import tribrach as tb
from tribrach.observations.levelling import HeightDifferences

survey = tb.Survey()
survey.point("BM", (0.0, 0.0, 50.0), free=(False, False, False), role="control")
for name, height in (("P", 53.2), ("Q", 51.9), ("R", 48.4)):
    survey.point(name, (0.0, 0.0, height), free=(False, False, True))

kilometres = np.array([1.0, 1.5, 0.5, 2.0])
survey.add(
    HeightDifferences,
    values=[3.2051, -1.3012, -3.5047, 1.6048],
    sigma=0.001 * np.sqrt(kilometres),
    start=["BM", "P", "Q", "R"],
    end=["P", "Q", "R", "BM"],
    source=[f"line {k}" for k in (1, 2, 3, 4)],
)

adjustment = tb.adjust(survey.network())
print(adjustment.summary())
for row in adjustment.observations:
    millimetres = f"residual {1000 * row.residual:+.2f} mm, MDB {1000 * row.mdb:.1f} mm"
    print(f"{row.id}: {millimetres}, redundancy {row.redundancy:.2f}")
