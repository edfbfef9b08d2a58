"""A design: the precision that a network will have, before anyone drives out.

The same observations with and without a fifth target; nothing is measured yet.
"""

import numpy as np

import tribrach as tb
from tribrach.geometry.rotation import exp
from tribrach.observations.scanner import TargetCentres
from tribrach.planning.prediction import predict

TARGETS = {
    "T1": (3.0, 12.0, 1.2), "T2": (11.0, 9.0, 2.5), "T3": (14.0, -2.0, 0.8),
    "T4": (12.0, 12.0, 3.1), "T5": (-8.0, -7.0, 2.0),
}  # fmt: skip


def planned(names: list[str]) -> tb.Network:
    """A scanner at (2, 1, 1.5) that will see these control points as targets."""
    survey = tb.Survey()
    for name in names:
        survey.point(name, TARGETS[name], role="control", covariance=np.diag([2e-3] * 3) ** 2)
    survey.station("S1", translation=(2.0, 1.0, 1.5), rotation=exp(np.array([0.0, 0.0, 0.3])))
    survey.add(
        TargetCentres,
        values=np.zeros((len(names), 3)),  # what will be measured is not known and not needed
        sigma=0.001,
        station=["S1"] * len(names),
        target=names,
    )
    return survey.network()


for names in (["T1", "T2", "T3", "T4"], list(TARGETS)):
    design = predict(planned(names))
    sigma = design.stations["S1"].sigma
    place, turns = (1000 * sigma[:3]).round(2), np.degrees(sigma[3:] * 3600).round(1)
    print(f"{len(names)} targets: station {place} mm, turns {turns} arcsec")
