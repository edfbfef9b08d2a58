"""Small networks that several tests adjust."""

import numpy as np

from tribrach.geodesy.site import FlatSite
from tribrach.geometry import rotation
from tribrach.network.network import Datum
from tribrach.network.survey import Survey
from tribrach.observations.control import VectorPriors
from tribrach.observations.gnss import GnssBaselines, GnssPositions
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.scanner import TargetCentres
from tribrach.observations.sights import Directions, SlopeDistances, ZenithAngles
from tribrach.units import SEC

#: Strang & Borre 1997, example 12.4: a free trilateration, metres
STRANG_BORRE = {
    "P": (170.71, 170.71),
    "1": (170.71, 270.71),
    "2": (100.0, 100.0),
    "3": (241.42, 100.0),
}
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


def mixed_network() -> Survey:
    """Levelling, total station (directions, zeniths, distances, hi and ht) and GNSS, weighted."""
    rng = np.random.default_rng(21)
    truth = np.c_[rng.uniform(0, 300, (6, 2)), rng.uniform(10, 40, 6)]
    names = [f"N{i}" for i in range(6)]
    survey = Survey(site=FlatSite(6.37e6))
    for name, x in zip(names, truth, strict=True):
        survey.point(name, x)
    pairs = [(i, j) for i in range(6) for j in range(6) if i != j and (i + j) % 2]
    i, j = np.array(pairs).T
    ends = {"start": [names[k] for k in i], "end": [names[k] for k in j]}
    chord = truth[j] - truth[i] + [0, 0, 0.1]
    flat = np.hypot(chord[:, 0], chord[:, 1])
    heights = {"height_instrument": 1.6, "height_target": 1.7}
    azimuth = np.arctan2(chord[:, 0], chord[:, 1])
    circle = {"orientation": [f"circle {names[k]}" for k in i]}
    survey.add(Directions, values=azimuth, sigma=1e-5, **ends, **heights, **circle)
    zenith = np.arctan2(flat, chord[:, 2] - 0.87 * flat**2 / 2 / 6.37e6)
    survey.add(ZenithAngles, values=zenith, sigma=2e-5, refraction=0.13, **ends, **heights)
    length = np.hypot(flat, chord[:, 2])
    survey.add(SlopeDistances, values=length, sigma=0.002, **ends, **heights)
    rise = truth[1:, 2] - truth[:-1, 2]
    lines = {"start": names[:-1], "end": names[1:]}
    survey.add(HeightDifferences, values=rise, sigma=0.0007, **lines)
    own = np.diag([0.008, 0.008, 0.015]) ** 2 + 2e-5
    antennas = {"position": names[:3], "antenna_height": 1.2, "common": "session 1"}
    values = truth[:3] + np.array([0, 0, 1.2])
    survey.add(GnssPositions, values=values, covariance=np.array([own] * 3), **antennas)
    survey.add(VectorPriors, values=[[0, 0, 0]], sigma=0.01, vector=["session 1"])
    table = survey.add(
        GnssBaselines,
        values=truth[[4, 5]] - truth[0],
        sigma=0.005,
        start=[names[0]] * 2,
        end=names[4:],
    )
    joint = 0.005**2 * (np.eye(6) + np.kron(np.ones((2, 2)), np.eye(3))) / 2
    survey.correlate([table] * 6, [0, 0, 0, 1, 1, 1], [0, 1, 2, 0, 1, 2], joint)
    return survey


def constrained_network() -> Survey:
    """Scanner stations with a true base length and a point held on a known height."""
    survey, truth = scanner_network(np.random.default_rng(8), targets=7, stations=2)
    chord = survey.stations["S1"].translation - survey.stations["S0"].translation
    base = float(np.linalg.norm(chord))
    survey.add(SlopeDistances, values=[base], hard=True, start=["S0"], end=["S1"])
    survey.add(
        HeightDifferences, values=[truth[1, 2] - truth[0, 2]], hard=True, start=["T0"], end=["T1"]
    )
    return survey


def free_stations(stations, targets, *, rng, sigma=3 * SEC, metres=2e-3, known=1e-3, wild=None):
    """Free set-ups of a total station that see all targets, which are control of ``known`` metres.

    wild : name of a target and what is added to its distance from the first set-up [m].
    """
    survey = Survey()
    for name, place in targets.items():
        given = np.asarray(place) + known * rng.standard_normal(3)
        survey.point(name, given, covariance=known**2 * np.eye(3), role="control")
    start, end, sight = [], [], []
    for a, place in stations.items():
        survey.point(a)
        for b, target in targets.items():
            start.append(a)
            end.append(b)
            sight.append(np.subtract(target, place))
    e, n, u = np.array(sight).T
    distance = np.sqrt(e**2 + n**2 + u**2)
    noise = rng.standard_normal((3, len(e)))
    direction = (np.arctan2(e, n) + 1.0 + sigma * noise[0]) % (2 * np.pi)
    zenith = np.abs(np.arccos(u / distance) + sigma * noise[1])
    distance = distance + metres * noise[2]
    if wild is not None:
        distance[end.index(wild[0])] += wild[1]
    ends = {"start": start, "end": end}
    survey.add(Directions, values=direction, sigma=sigma, orientation=start, **ends)
    survey.add(ZenithAngles, values=zenith, sigma=sigma, **ends)
    survey.add(SlopeDistances, values=distance, sigma=metres, **ends)
    return survey
