"""Small networks that several tests adjust."""

import numpy as np

from tribrach.geometry import rotation
from tribrach.network.network import Datum
from tribrach.network.observations.slope_distance import SlopeDistances
from tribrach.network.observations.target_centre import TargetCentres
from tribrach.network.survey import Survey

#: Strang & Borre 1997, example 12.4: a free trilateration, metres
STRANG_BORRE = {"P": (170.71, 170.71), "1": (170.71, 270.71), "2": (100.0, 100.0), "3": (241.42, 100.0)}
STRANG_BORRE_DISTANCES = [
    ("1", "P", 100.01),
    ("2", "P", 100.02),
    ("3", "P", 100.03),
    ("1", "2", 184.785),
    ("2", "3", 141.44),
    ("1", "3", 184.805),
]


def trilateration(datum: Datum) -> Survey:
    """Strang & Borre's network in the plane, sigma 1 cm."""
    survey = Survey(datum=datum)
    for name, (e, n) in STRANG_BORRE.items():
        survey.point(name, (e, n, 0.0), free=(True, True, False))
    start, end, value = zip(*STRANG_BORRE_DISTANCES, strict=True)
    survey.add(SlopeDistances, values=value, sigma=0.01, start=start, end=end)
    return survey


def scanner_network(
    rng: np.random.Generator, *, targets: int = 12, stations: int = 3, sigma: float = 0.001
) -> tuple[Survey, np.ndarray]:
    """Free scanner stations that all see all targets; also the true target coordinates."""
    truth = rng.uniform(-10, 10, (targets, 3))
    survey = Survey(datum=Datum("free"))
    names = [f"T{i}" for i in range(targets)]
    for name, x in zip(names, truth, strict=True):
        survey.point(name, x)
    for j in range(stations):
        t, r = rng.uniform(-3, 3, 3), rotation.exp(rng.uniform(-2, 2, 3))
        survey.station(f"S{j}", translation=t, rotation=r)
        seen = (truth - t) @ r + rng.normal(0, sigma, (targets, 3))
        survey.add(
            TargetCentres,
            values=seen,
            sigma=np.full((targets, 3), sigma),
            station=[f"S{j}"] * targets,
            target=names,
        )
    return survey, truth
