"""A network in ten lines: two distances between a control point and a new one.

Every figure comes with its datum and says whether its sigma is a priori or a posteriori.
"""

import tribrach as tb
from tribrach.observations.sights import Distances

survey = tb.Survey()
survey.point("A", (0.0, 0.0, 0.0), free=(False, False, False), role="control")
survey.point("B", (100.0, 0.0, 0.0), free=(True, False, False))
survey.add(Distances, values=[100.003, 100.005], sigma=0.002, start=["A", "A"], end=["B", "B"])

adjustment = tb.adjust(survey.network())
print(adjustment)
print(adjustment.points["B"])
print(adjustment.points["B"].covariance)  # (3, 3), metres squared
