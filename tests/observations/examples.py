"""One example of every observation kind, in a state with all families of unknowns.

The contract test asks for an example of each concrete kind in the package and fails where one
is missing.
"""

from collections.abc import Callable

import numpy as np

from tribrach.geodesy.plumb import PlumbField, PlumbLines
from tribrach.geodesy.site import EllipsoidSite, FlatSite, Site
from tribrach.geometry import rotation
from tribrach.instruments.calibration import NIST
from tribrach.observations.base import Observations
from tribrach.observations.unknowns import Layout, State

N = 4
LAYOUT = Layout(
    points=[f"P{i}" for i in range(6)],
    poses=["S0", "S1", "S2"],
    planes=["A", "B"],
    vectors=["arm", "session"],
    scalars=[f"k{i}" for i in range(18)],
)
SITES: tuple[Site, ...] = (
    FlatSite(),
    FlatSite(6.38e6),
    EllipsoidSite(0.7, 0.2, 150.0),
    EllipsoidSite(-0.9, 2.0, 20.0),
)


def draw_state(rng: np.random.Generator) -> State:
    """Points up to 80 m apart, rotations of any size, planes, vectors, small scalars."""
    normal = rng.normal(size=(2, 3))
    return State(
        LAYOUT,
        rng.uniform(-40, 40, (6, 3)),
        rng.uniform(-40, 40, (3, 3)),
        rotation.exp(rng.uniform(-1.7, 1.7, (3, 3))),
        normal / np.linalg.norm(normal, axis=1, keepdims=True),
        rng.uniform(-20, 20, 2),
        rng.normal(size=(2, 3)),
        rng.normal(0, 1e-3, 18),
    )


def mixed(rng: np.random.Generator, count: int) -> np.ndarray:
    """Indices of optional unknowns: some present, some absent."""
    return np.where(rng.random(N) < 0.7, rng.integers(0, count, N), -1)


def common(kind: type[Observations], rng: np.random.Generator) -> dict:
    """Values and a full random covariance; values are replaced by the truth in the tests."""
    m = len(kind.units)
    root = rng.normal(size=(N, m, m)) + 2 * np.eye(m)
    values = np.ones((N, m))
    return {"values": values, "covariance": root @ root.transpose(0, 2, 1) * 1e-6}


def pairs(rng: np.random.Generator, count: int) -> dict:
    """Two different ends each."""
    start = rng.integers(0, count, N)
    return {"start": start, "end": (start + rng.integers(1, count, N)) % count}


def plumb_lines(rng: np.random.Generator) -> PlumbLines:
    """Some positions with deflections of their own, one deflection for the others."""
    own = rng.normal(0, 1e-4, (9, 2))
    own[::2] = np.nan
    return PlumbLines(PlumbField(3e-5, -5e-5), own)


def sights(kind: type[Observations], rng: np.random.Generator, site: Site, **more: object) -> dict:
    return {
        **common(kind, rng),
        **pairs(rng, 9),
        "height_instrument": rng.uniform(0, 2, N),
        "height_target": rng.uniform(0, 2, N),
        "height_instrument_unknown": mixed(rng, 18),
        "height_target_unknown": mixed(rng, 18),
        "xi_error": mixed(rng, 18),
        "eta_error": mixed(rng, 18),
        "eccentricity_instrument": mixed(rng, 2),
        "eccentricity_target": mixed(rng, 2),
        "plumb": plumb_lines(rng),
        "site": site,
        **more,
    }


def rotations(rng: np.random.Generator) -> np.ndarray:
    return rotation.exp(rng.uniform(-1, 1, (N, 3)))


def units(rng: np.random.Generator) -> np.ndarray:
    vector = rng.normal(size=(N, 3))
    return vector / np.linalg.norm(vector, axis=1, keepdims=True)


Build = Callable[[type[Observations], np.random.Generator, Site], dict]


def angle(kind: type[Observations], rng: np.random.Generator, site: Site) -> dict:
    columns = sights(kind, rng, site)
    third = (columns["start"] + columns["end"] + 1) % 9
    clash = (third == columns["start"]) | (third == columns["end"])
    columns["foresight"] = np.where(clash, (third + 4) % 9, third)
    clash = (columns["foresight"] == columns["start"]) | (columns["foresight"] == columns["end"])
    columns["foresight"] = np.where(clash, (third + 2) % 9, columns["foresight"])
    return columns


def polar(kind: type[Observations], rng: np.random.Generator, site: Site) -> dict:
    values = np.column_stack(
        [rng.uniform(5, 50, N), rng.uniform(-3, 3, N), rng.uniform(0.5, 2.5, N)]
    )
    raw = rng.random(N) < 0.5
    values[raw] = values[raw] * [1, 1, -1] + [0, np.pi, 2 * np.pi]
    return {
        **common(kind, rng),
        "values": values,
        "station": rng.integers(0, 3, N),
        "target": rng.integers(0, 6, N),
        "face": rng.choice([-1.0, 1.0], N),
        "model": NIST,
        "parameters": np.where(rng.random((N, 18)) < 0.8, np.arange(18), -1),
    }


def axis(kind: type[Observations], rng: np.random.Generator, site: Site) -> dict:
    origin = rng.integers(0, 6, N)
    columns = {
        **common(kind, rng),
        "origin": origin,
        "point": (origin + rng.integers(1, 6, N)) % 6,
        "slope_1": rng.integers(0, 6, N),
        "slope_2": rng.integers(6, 12, N),
        "main": rng.integers(0, 3, N),
    }
    if kind.kind != "axis_foot":
        columns["along"] = rng.integers(12, 15, N)
    if kind.kind == "axis_radius":
        columns["radius"] = rng.integers(15, 18, N)
    return columns


def frame(kind: type[Observations], rng: np.random.Generator, site: Site, **more: object) -> dict:
    return {
        **common(kind, rng),
        "station": rng.integers(0, 3, N),
        "target": rng.integers(0, 6, N),
        "height_target": 0.3,
        "site": site,
        **more,
    }


def single(kind: type[Observations], rng: np.random.Generator, site: Site) -> dict:
    """Latitudes and longitudes, which a flat site does not have."""
    on_ellipsoid = site if isinstance(site, EllipsoidSite) else EllipsoidSite(0.7, 0.2, 150.0)
    columns = {"position": rng.integers(0, 9, N), "lean": 2e-5, "site": on_ellipsoid}
    return {**common(kind, rng), **columns}


#: columns of each kind by its name
BUILDERS: dict[str, Build] = {
    "slope_distance": lambda k, g, s: sights(k, g, s, zero=mixed(g, 18), scale=mixed(g, 18)),
    "distance": lambda k, g, s: sights(k, g, s, zero=mixed(g, 18), scale=mixed(g, 18)),
    "horizontal_distance": lambda k, g, s: sights(
        k, g, s, zero=mixed(g, 18), scale=mixed(g, 18), reduction=g.uniform(0.9, 1.1, N)
    ),
    "direction": lambda k, g, s: sights(k, g, s, orientation=g.integers(0, 18, N)),
    "zenith": lambda k, g, s: sights(k, g, s, refraction=0.13, refraction_unknown=mixed(g, 18)),
    "azimuth": lambda k, g, s: sights(k, g, s, convergence=0.01, offset=mixed(g, 18)),
    "angle": angle,
    "local_offset": lambda k, g, s: sights(k, g, s, azimuth=g.uniform(0, 6, N), reduction=0.9),
    "height_difference": lambda k, g, s: {
        **common(k, g),
        **pairs(g, 9),
        "height_end": 1.5,
        "geoid_start": [40.0, np.nan, 40.0, np.nan],
        "geoid_end": [41.0, np.nan, 40.5, np.nan],
        "xi_error": mixed(g, 18),
        "eta_error": mixed(g, 18),
        "plumb": plumb_lines(g),
        "site": s,
    },
    "gnss_baseline": lambda k, g, s: {
        **common(k, g),
        **pairs(g, 9),
        "height_start": 1.2,
        "height_end": 1.6,
        "scale": mixed(g, 6),
        "turn_e": mixed(g, 18),
        "turn_n": mixed(g, 18),
        "turn_u": mixed(g, 18),
        "site": s,
    },
    "offset": lambda k, g, s: sights(k, g, s),
    "gnss_position": lambda k, g, s: {
        **common(k, g),
        "position": g.integers(0, 9, N),
        "antenna_height": 1.8,
        "common": mixed(g, 2),
        "site": s,
    },
    "coordinates": lambda k, g, s: {**common(k, g), "position": g.integers(0, 9, N)},
    "coordinate": lambda k, g, s: {
        **common(k, g),
        "position": g.integers(0, 9, N),
        "axis": g.integers(0, 3, N),
    },
    "component": lambda k, g, s: {
        **common(k, g),
        "position": g.integers(0, 9, N),
        "direction": units(g),
    },
    "target_centre": lambda k, g, s: {
        **common(k, g),
        "station": g.integers(0, 3, N),
        "target": g.integers(0, 6, N),
        "scale": mixed(g, 18),
    },
    "scanner_polar": polar,
    "antenna": lambda k, g, s: {
        **common(k, g),
        "station": g.integers(0, 3, N),
        "lever_arm": np.zeros(N, int),
        "common": mixed(g, 2),
    },
    "mounted_point": lambda k, g, s: {
        **common(k, g),
        "station": g.integers(0, 3, N),
        "point": g.integers(0, 6, N),
        "lever_arm": g.integers(0, 2, N),
    },
    "inclination": lambda k, g, s: {
        **common(k, g),
        "station": g.integers(0, 3, N),
        "xi": 1e-4,
        "eta": -2e-4,
        "offset_x": mixed(g, 18),
        "offset_y": mixed(g, 18),
        "xi_error": mixed(g, 18),
        "eta_error": mixed(g, 18),
        "site": s,
    },
    "heading": lambda k, g, s: {
        **common(k, g),
        "station": g.integers(0, 3, N),
        "direction": g.uniform(-3, 3, N),
        "offset": mixed(g, 18),
        "site": s,
    },
    "plane": lambda k, g, s: {
        **common(k, g),
        "station": g.integers(0, 3, N),
        "plane": g.integers(0, 2, N),
        "normal": units(g),
        "centroid": g.uniform(-9, 9, (N, 3)),
    },
    "point_on_plane": lambda k, g, s: {
        **common(k, g),
        "station": g.integers(0, 3, N),
        "plane": g.integers(0, 2, N),
        "point": g.uniform(-9, 9, (N, 3)),
    },
    "relative_pose": lambda k, g, s: {**common(k, g), **pairs(g, 3), "rotation": rotations(g)},
    "rotation_component": lambda k, g, s: {
        **common(k, g),
        "station": g.integers(0, 3, N),
        "axis": units(g),
        "reference": rotations(g),
    },
    "relative_translation": lambda k, g, s: {**common(k, g), **pairs(g, 3), "axis": units(g)},
    "relative_rotation": lambda k, g, s: {
        **common(k, g),
        **pairs(g, 3),
        "axis": units(g),
        "reference": rotations(g),
    },
    "axis_radius": axis,
    "axis_plane": axis,
    "axis_foot": axis,
    "telescope_target": lambda k, g, s: {
        **common(k, g),
        **dict(zip(("reference", "point"), pairs(g, 6).values(), strict=True)),
        "body": g.integers(0, 2, N),
        "azimuth": g.integers(0, 3, N),
        "elevation": g.integers(3, 6, N),
        "tilt_east": g.integers(6, 9, N),
        "tilt_north": g.integers(9, 12, N),
        "axis_offset": g.integers(12, 15, N),
        "axis_skew": g.integers(15, 18, N),
        "site": s,
    },
    "ellipsoid_chord": lambda k, g, s: {**common(k, g), **pairs(g, 9), "site": s},
    "ellipsoid_arc": lambda k, g, s: {
        **common(k, g),
        **pairs(g, 9),
        "geoid_start": 40.0,
        "geoid_end": g.uniform(39, 41, N),
        "site": s,
    },
    "latitude": single,
    "longitude": single,
    "circle_reading": lambda k, g, s: {
        **common(k, g),
        "angle": g.integers(0, 9, N),
        "zero": np.where(g.random(N) < 0.7, g.integers(9, 18, N), -1),
    },
    "equal_distance": lambda k, g, s: sights(k, g, s, common=g.integers(0, 18, N)),
    "equal_height_difference": lambda k, g, s: {
        **common(k, g),
        **pairs(g, 9),
        "common": g.integers(0, 18, N),
        "site": s,
    },
    "height": lambda k, g, s: {**common(k, g), "position": g.integers(0, 9, N), "site": s},
    "frame_coordinate": lambda k, g, s: frame(k, g, s, axis=g.integers(0, 3, N)),
    "frame_angle": lambda k, g, s: frame(k, g, s, circle=g.integers(0, 2, N)),
    "frame_distance": lambda k, g, s: frame(k, g, s),
    **dict.fromkeys(
        ("scalar_prior", "refraction_change"),
        lambda k, g, s: {**common(k, g), "scalar": g.integers(0, 18, N)},
    ),
    "vector_prior": lambda k, g, s: {**common(k, g), "vector": g.integers(0, 2, N)},
    **dict.fromkeys(
        ("vector_component_prior", "centring"),
        lambda k, g, s: {
            **common(k, g),
            "vector": g.integers(0, 2, N),
            "axis": g.integers(0, 3, N),
        },
    ),
}


def build(kind: type[Observations], rng: np.random.Generator, site: Site) -> Observations:
    """N observations of a kind."""
    return kind(**BUILDERS[kind.kind](kind, rng, site))
