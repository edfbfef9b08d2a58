"""A project to start from: the control traverse of a campus survey, simulated.

Five points around a building in Hanoi with the published leg lengths 43.244, 31.631, 28.867, 30.008
and 66.711 m (method S0, Table 2). The shape of the polygon and the heights are reconstructed, the
observations are drawn from the stated sigmas with a fixed seed; nothing here is a measurement.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tribrach.geodesy.site import FlatSite
from tribrach.io.outputs import write_text
from tribrach.network.network import Network
from tribrach.network.observations.base import Observations
from tribrach.network.observations.direction import Directions
from tribrach.network.observations.height_difference import HeightDifferences
from tribrach.network.observations.slope_distance import SlopeDistances
from tribrach.network.observations.zenith import ZenithAngles
from tribrach.network.survey import Survey
from tribrach.simulate.survey import observe
from tribrach.units import GON, SEC

__all__ = ["traverse", "write_project"]

Array = NDArray[np.float64]

NAMES = ("A", "B", "C", "D", "E")
LEGS = (43.244, 31.631, 28.867, 30.008, 66.711)
HEIGHTS = (6.214, 6.391, 6.302, 6.118, 6.047)
HEIGHT_INSTRUMENT = (1.562, 1.548, 1.571, 1.590, 1.555)
HEIGHT_TARGET = 1.500
REFRACTION = 0.13
SEED = 20180921

PROJECT = """\
# A control traverse around a building: five points, two of them known.
title = "Campus control traverse (simulated)"
confidence = 0.95

[facts]
Site = "Hanoi, polygon of five points with the published leg lengths"
Data = "simulated from the sigmas of the instrument below, fixed seed"

[site]
kind = "flat"                     # local coordinates, metres
curvature_radius_m = 6371000.0

[datum]
kind = "control"

[instruments.total_station]
direction_arcsec = 3.0
zenith_arcsec = 3.0
distance_mm = 1.5
distance_ppm = 2.0
centring_mm = 0.3
height_mm = 0.5
refraction = 0.13

[instruments.level]
levelling_mm_per_sqrt_km = 1.0

[[points]]
file = "control.csv"
role = "control"

[[points]]
file = "check.csv"
role = "check"

[[observations]]
file = "traverse.csv"
instrument = "total_station"

[[observations]]
file = "levelling.csv"
instrument = "level"

[adjustment]
snoop = true

[output]
folder = "out"
angle = "gon"
"""


def traverse() -> Array:
    """True local coordinates (5, 3) E, N, U [m] of the points A to E."""
    a = np.array([1000.0, 2000.0])
    b = a + LEGS[0] * _azimuth(28.0)
    e = a + LEGS[4] * _azimuth(104.0)
    c = b + LEGS[1] * _azimuth(96.0)
    d = _intersect(c, LEGS[2], e, LEGS[3])
    return np.column_stack([np.stack([a, b, c, d, e]), HEIGHTS])


def _azimuth(degrees: float) -> Array:
    return np.array([np.sin(np.radians(degrees)), np.cos(np.radians(degrees))])


def _intersect(p: Array, r: float, q: Array, s: float) -> Array:
    """Point at distance r from p and s from q, on the left of the way from q to p."""
    base = np.linalg.norm(q - p)
    along = (r**2 - s**2 + base**2) / (2 * base)
    across = np.sqrt(r**2 - along**2)
    unit = (q - p) / base
    point: Array = p + along * unit + across * np.array([-unit[1], unit[0]])
    return point


def _network(truth: Array) -> Network:
    """The plan of the traverse with placeholder values and the truth as start."""
    survey = Survey(site=FlatSite(6371000.0))
    for name, x in zip(NAMES, truth, strict=True):
        survey.point(name, x)
    pairs = [(i, (i + step) % 5) for i in range(5) for step in (1, 4)] + [(0, 2), (4, 1)]
    pairs.sort()
    start, end = (np.array(side) for side in zip(*pairs, strict=True))
    length = np.linalg.norm(truth[start] - truth[end], axis=1)
    sights = {
        "start": [NAMES[i] for i in start],
        "end": [NAMES[i] for i in end],
        "height_instrument": np.array(HEIGHT_INSTRUMENT)[start],
        "height_target": HEIGHT_TARGET,
    }
    ones = np.ones(len(pairs))
    circles = [f"orientation {NAMES[i]}" for i in start]
    sigma = np.hypot(3 * SEC, 0.0003 / length)
    survey.add(Directions, values=ones, sigma=sigma, orientation=circles, **sights)
    sigma = np.hypot(3 * SEC, 0.0005 / length)
    survey.add(ZenithAngles, values=ones, sigma=sigma, refraction=REFRACTION, **sights)
    survey.add(SlopeDistances, values=ones, sigma=np.hypot(0.0015 + 2e-6 * length, 3e-4), **sights)
    sigma = 0.001 * np.sqrt(np.array(LEGS[:4]) / 1000)
    survey.add(HeightDifferences, values=np.ones(4), sigma=sigma, start=NAMES[:4], end=NAMES[1:])
    return survey.network()


def write_project(folder: Path) -> Path:
    """Write ``campus.toml`` and its CSV files into a folder; the path of the project file."""
    truth = traverse()
    network = _network(truth)
    rng = np.random.default_rng(SEED)
    network.start.scalars[:] = rng.uniform(0, 2 * np.pi, len(network.start.scalars))
    observed = {o.kind: o for o in observe(network, network.start, rng).observations}
    given = truth + rng.normal(0, 1, truth.shape) * [0.002, 0.002, 0.003]
    write_text(folder / "campus.toml", PROJECT)
    write_text(folder / "control.csv", _coordinates(given, (0, 4)))
    write_text(folder / "check.csv", _coordinates(given, (2,)))
    write_text(folder / "traverse.csv", _sights(network, observed))
    write_text(folder / "levelling.csv", _levelling(observed))
    return folder / "campus.toml"


def _coordinates(xyz: Array, which: tuple[int, ...]) -> str:
    rows = [
        f"{NAMES[i]},{xyz[i, 0]:.4f},{xyz[i, 1]:.4f},{xyz[i, 2]:.4f},2.0,2.0,3.0" for i in which
    ]
    return "\n".join(["point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm", *rows, ""])


def _sights(network: Network, observed: dict[str, Observations]) -> str:
    directions = observed["direction"]
    assert isinstance(directions, Directions)
    values = {kind: o.values[:, 0] for kind, o in observed.items()}
    head = "from,to,direction_gon,zenith_gon,slope_distance_m,height_instrument_m,height_target_m"
    rows = []
    for k, (start, end) in enumerate(directions.ends(network.start.layout)):
        direction = values["direction"][k] % (2 * np.pi) / GON
        zenith = values["zenith"][k] / GON
        rows.append(
            f"{start},{end},{direction:.5f},{zenith:.5f},{values['slope_distance'][k]:.4f},"
            f"{directions.height_instrument[k]:.3f},{directions.height_target[k]:.3f}"
        )
    return "\n".join([head, *rows, ""])


def _levelling(observed: dict[str, Observations]) -> str:
    rises = observed["height_difference"]
    assert isinstance(rises, HeightDifferences)
    rows = [
        f"{NAMES[i]},{NAMES[i + 1]},{rise:.5f},{LEGS[i] / 1000:.6f}"
        for i, rise in enumerate(rises.values[:, 0])
    ]
    return "\n".join(["from,to,height_difference_m,length_km", *rows, ""])
