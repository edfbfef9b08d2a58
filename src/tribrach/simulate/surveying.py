"""Simulated survey observations: a network drawn anew, and tables as text for a project."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse.linalg as sla

from tribrach._types import Array
from tribrach.geodesy.site import FlatSite
from tribrach.instruments.precision import Precision
from tribrach.network.assembly import Assembly
from tribrach.network.network import Network
from tribrach.network.survey import Survey
from tribrach.observations.levelling import HeightDifferences
from tribrach.observations.sights import Directions, SlopeDistances, ZenithAngles
from tribrach.observations.unknowns import State
from tribrach.units import GON

#: radius of the Earth of the flat sites [m]
EARTH = 6371000.0


def observe(network: Network, truth: State, rng: np.random.Generator) -> Network:
    """A network with observations drawn anew from its own stochastic model.

    The active values become ``h(truth) + W^-1 z`` with z standard normal; inactive observations
    keep their values. Used by demonstrations, by planning and by every Monte Carlo check.
    """
    assembly = Assembly(network)
    errors = sla.spsolve_triangular(
        assembly.whitener, rng.standard_normal(len(assembly.rows)), lower=True
    )
    observations, first = [], 0
    for o, items in zip(network.observations, assembly.active, strict=True):
        size = len(items) * o.rows
        values = o.values.copy()
        values[items] = o.predict(truth)[items] + errors[first : first + size].reshape(-1, o.rows)
        observations.append(replace(o, values=values))
        first += size
    return replace(network, observations=tuple(observations), start=truth)


def sights(
    places: Mapping[str, Array],
    lines: Sequence[tuple[str, str]],
    height_instrument: Mapping[str, float],
    height_target: Mapping[str, float],
    precision: Precision,
    rng: np.random.Generator,
) -> str:
    """Directions, zeniths and slope distances with errors, one orientation for each instrument."""
    xyz = {name: np.asarray(x, dtype=float) for name, x in places.items()}
    length = np.array([np.linalg.norm(xyz[a] - xyz[b]) for a, b in lines])
    ones = np.ones(len(lines))
    sigma = [
        precision.of_directions(length, ones, 0.0),
        precision.of_zeniths(length, ones, 0.0),
        precision.of_distances(length, ones, 0.0),
    ]
    eccentric = eccentricities(lines, precision, rng)
    bent = refraction(lines, precision, rng)
    network, common = _sights(
        places, lines, height_instrument, height_target, bent, eccentric, sigma
    )
    network.start.scalars[:] = rng.uniform(0, 2 * np.pi, len(network.start.scalars))
    seen = {o.kind: o.values[:, 0] for o in observe(network, network.start, rng).observations}
    rows = ["from,to,direction_gon,zenith_gon,slope_distance_m,height_instrument_m,height_target_m"]
    for k, (a, b) in enumerate(lines):
        direction, zenith = seen["direction"][k] % (2 * np.pi) / GON, seen["zenith"][k] / GON
        rows.append(
            f"{a},{b},{direction:.5f},{zenith:.5f},{seen['slope_distance'][k]:.4f},"
            f"{common['height_instrument'][k]:.3f},{common['height_target'][k]:.3f}"
        )
    return _text(rows)


def true_sights(
    places: Mapping[str, Array],
    lines: Sequence[tuple[str, str]],
    height_instrument: Mapping[str, float],
    height_target: Mapping[str, float],
    refraction: Array | float,
    eccentric: tuple[Array, Array] | None = None,
) -> tuple[Array, Array, Array]:
    """Error-free directions, zeniths and distances; ``eccentric`` [m] vectors at both ends."""
    network, _ = _sights(
        places, lines, height_instrument, height_target, refraction, eccentric, [1.0, 1.0, 1.0]
    )
    network.start.scalars[:] = 0.0
    true = {o.kind: o.predict(network.start)[:, 0] for o in network.observations}
    return true["direction"], true["zenith"], true["slope_distance"]


def eccentricities(
    lines: Sequence[tuple[str, str]], precision: Precision, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Vectors (n, 3) [m] from marks of both ends to what stands there, by ``centring_per``."""
    sigma = np.array([precision.centring, precision.centring, precision.height])
    drawn: dict[object, Array] = {}

    def one(*occupation: object) -> Array:
        return drawn.setdefault(occupation, sigma * rng.normal(size=3))

    ends = []
    for k, (start, end) in enumerate(lines):
        if precision.centring_per == "mark":
            ends.append((one(start), one(end)))
        elif precision.centring_per == "setup":
            ends.append((one("at", start), one("of", end, start)))
        else:
            ends.append((one("at", k), one("of", k)))
    both = np.array(ends).reshape(-1, 2, 3)
    return both[:, 0], both[:, 1]


def refraction(
    lines: Sequence[tuple[str, str]], precision: Precision, rng: np.random.Generator
) -> Array:
    """Coefficients of refraction (n,) of sights, another one at every set-up."""
    starts = dict.fromkeys(start for start, _ in lines)
    change = dict.fromkeys(starts, 0.0)
    if precision.refraction_sigma:
        drawn = precision.refraction_sigma * rng.normal(size=len(starts))
        change = dict(zip(starts, drawn.tolist(), strict=True))
    return precision.refraction + np.array([change[start] for start, _ in lines])


def _sights(
    places: Mapping[str, Array],
    lines: Sequence[tuple[str, str]],
    height_instrument: Mapping[str, float],
    height_target: Mapping[str, float],
    refraction: Array | float,
    eccentric: tuple[Array, Array] | None,
    sigma: Sequence[Any],
) -> tuple[Network, dict[str, Any]]:
    """Directions, zenith angles and distances with these sigmas, at their places; heights."""
    survey = _survey(places)
    start, end = (list(side) for side in zip(*lines, strict=True))
    ones = np.ones(len(lines))
    common: dict[str, Any] = {
        "start": start,
        "end": end,
        "height_instrument": np.array([height_instrument.get(a, 0.0) for a in start]),
        "height_target": np.array([height_target.get(b, 0.0) for b in end]),
    }
    for side, moved in zip(("instrument", "target"), eccentric or (), strict=False):
        names = [f"eccentricity of {side} {k}" for k in range(len(lines))]
        survey.vectors |= {name: (v, False) for name, v in zip(names, moved, strict=True)}
        common[f"eccentricity_{side}"] = names
    circles = [f"orientation of {a}" for a in start]
    survey.add(Directions, values=ones, sigma=sigma[0], orientation=circles, **common)
    survey.add(ZenithAngles, values=ones, sigma=sigma[1], refraction=refraction, **common)
    survey.add(SlopeDistances, values=ones, sigma=sigma[2], **common)
    return survey.network(), common


def levelling(
    places: Mapping[str, Array],
    lines: Sequence[tuple[str, str]],
    length: Array,
    precision: Precision,
    rng: np.random.Generator,
) -> str:
    """Height differences with errors, as a table."""
    survey = _survey(places)
    start, end = (list(side) for side in zip(*lines, strict=True))
    sigma = precision.of_lines(np.asarray(length, dtype=float))
    survey.add(HeightDifferences, values=np.ones(len(lines)), sigma=sigma, start=start, end=end)
    network = survey.network()
    rises = observe(network, network.start, rng).observations[0].values[:, 0]
    rows = ["from,to,height_difference_m,length_km"]
    for (a, b), rise, far in zip(lines, rises, length, strict=True):
        rows.append(f"{a},{b},{rise:.5f},{far / 1000:.6f}")
    return _text(rows)


def coordinates(
    places: Mapping[str, Array], sigma: tuple[float, float, float], rng: np.random.Generator
) -> str:
    """Coordinates with errors, as a table."""
    rows = ["point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm"]
    e, n, u = (f"{1e3 * s:g}" for s in sigma)
    for name, x in places.items():
        given = x + rng.normal(size=3) * sigma
        rows.append(f"{name},{given[0]:.5f},{given[1]:.5f},{given[2]:.5f},{e},{n},{u}")
    return _text(rows)


def gnss_positions(
    places: Mapping[str, Array],
    sigma: tuple[float, float, float],
    rng: np.random.Generator,
    common: float = 0.5,
    antenna_height: Mapping[str, float] | None = None,
) -> str:
    """Antenna positions with errors, a table of one session with ``common`` share of variance."""
    shift = np.sqrt(common) * rng.normal(size=3) * sigma
    rows = ["gnss,set,e_m,n_m,u_m,antenna_height_m,sigma_e_mm,sigma_n_mm,sigma_u_mm"]
    e, n, u = (f"{1e3 * s:g}" for s in sigma)
    session = "session 1" if common > 0 else ""
    for name, x in places.items():
        given = x + shift + np.sqrt(1 - common) * rng.normal(size=3) * sigma
        height = 0.0 if antenna_height is None else antenna_height.get(name, 0.0)
        rows.append(
            f"{name},{session},{given[0]:.5f},{given[1]:.5f},{given[2]:.5f},{height:.4f},{e},{n},{u}"
        )
    return _text(rows)


def rods(over: Mapping[str, tuple[str, float]], sigma: float, rng: np.random.Generator) -> str:
    """Targets on rods, as a table, from the target and true length over each mark."""
    rows = ["mark,target,rod_m"]
    for mark, (target, length) in over.items():
        rows.append(f"{mark},{target},{length + sigma * rng.normal():.5f}")
    return _text(rows)


def _survey(places: Mapping[str, Array]) -> Survey:
    survey = Survey(site=FlatSite(EARTH))
    for name, x in places.items():
        survey.point(name, x)
    return survey


def _text(rows: list[str]) -> str:
    return "\n".join([*rows, ""])
