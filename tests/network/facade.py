"""A levelled scanner resected from targets that a total station measured from weighted control."""

import numpy as np

from tribrach.geometry import rotation
from tribrach.network.survey import Survey
from tribrach.observations.control import Coordinates
from tribrach.observations.scanner import Inclinations, TargetCentres
from tribrach.observations.sights import Directions, SlopeDistances, ZenithAngles
from tribrach.units import SEC

CONTROL = {"A": (0.0, 0.0, 5.0), "B": (45.0, 3.0, 5.4), "C": (20.0, -14.0, 5.1)}
TARGETS = np.array(
    [[2, 30, 8], [14, 31, 11], [26, 30, 7], [38, 31.5, 10], [44, 22, 6.5], [-4, 18, 9]], dtype=float
)
STATIONS = {"S1": ((12.0, 6.0, 6.6), 0.4), "S2": ((30.0, 8.0, 6.5), 2.0)}
SIGMA = {"control": 0.002, "direction": 3 * SEC, "distance": 0.0015, "target": 0.001,
         "level": 3 * SEC}  # fmt: skip


def facade(noise: dict[str, float] | None = None, seed: int = 0) -> Survey:
    """The survey; noise : factor on the errors drawn for each part of SIGMA, none if left out."""
    rng, noise = np.random.default_rng(seed), noise or {}

    def error(part: str, *shape: int) -> np.ndarray:
        return noise.get(part, 0.0) * SIGMA[part] * rng.normal(size=shape)

    survey = Survey()
    names = [f"T{k}" for k in range(len(TARGETS))]
    for name, x in CONTROL.items():
        survey.point(name, x)
    for name, x in zip(names, TARGETS, strict=True):
        survey.point(name, x)
    given = np.array(list(CONTROL.values())) + error("control", 3, 3)
    survey.add(
        Coordinates, values=given, sigma=SIGMA["control"], position=list(CONTROL), group="control"
    )
    everything = np.vstack([list(CONTROL.values()), TARGETS])
    labels = [*CONTROL, *names]
    pairs = [(i, j) for i in range(3) for j in range(len(labels)) if i != j]
    i, j = np.array(pairs).T
    chord = everything[j] - everything[i]
    ends = {"start": [labels[k] for k in i], "end": [labels[k] for k in j]}
    azimuth = np.arctan2(chord[:, 0], chord[:, 1]) + error("direction", len(i))
    circle = [f"circle {labels[k]}" for k in i]
    survey.add(Directions, values=azimuth, sigma=SIGMA["direction"], orientation=circle, **ends)
    zenith = np.arctan2(np.hypot(chord[:, 0], chord[:, 1]), chord[:, 2])
    zenith = zenith + error("direction", len(i))
    survey.add(ZenithAngles, values=zenith, sigma=SIGMA["direction"], refraction=1.0, **ends)
    length = np.linalg.norm(chord, axis=1) + error("distance", len(i))
    survey.add(SlopeDistances, values=length, sigma=SIGMA["distance"], **ends)
    for name, (place, heading) in STATIONS.items():
        r = rotation.exp(np.array([0.0, 0.0, heading]))
        survey.station(name, translation=np.array(place), rotation=r)
        seen = (TARGETS - place) @ r + error("target", len(TARGETS), 3)
        survey.add(
            TargetCentres, values=seen, sigma=np.full((len(TARGETS), 3), SIGMA["target"]),
            station=[name] * len(TARGETS), target=names,
        )  # fmt: skip
        survey.add(Inclinations, values=[error("level", 2)], sigma=SIGMA["level"], station=[name])
    return survey
