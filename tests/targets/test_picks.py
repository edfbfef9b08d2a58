"""Natural points: corners, edges, holes, discs and axes are as sure as they say."""

import numpy as np
import pytest
from scipy.stats import chi2

from tribrach.geometry.rotation import exp
from tribrach.targets.detection import Detection, Rejected
from tribrach.targets.picks import NaturalPoint, PickKind, find_pick

#: noise of ranges [m] and of angles [rad], step of the scanner [rad]
RANGE, ANGLE, STEP = 1.0e-3, 2.0e-5, 1.2e-3


def beams(towards: np.ndarray, half: float) -> np.ndarray:
    """Directions (n, 3) of a window around a place."""
    h = np.arctan2(towards[1], towards[0])
    v = np.arccos(towards[2] / np.linalg.norm(towards))
    wide = np.arctan(half / np.linalg.norm(towards))
    grid = np.arange(-wide, wide, STEP)
    hh, vv = np.meshgrid(h + grid / np.sin(v), v + grid)
    return directions(hh.ravel(), vv.ravel())


def directions(h: np.ndarray, v: np.ndarray) -> np.ndarray:
    return np.stack([np.sin(v) * np.cos(h), np.sin(v) * np.sin(h), np.cos(v)], axis=-1)


def read(unit: np.ndarray, r: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Points as they are read along beams with noise; what returns nothing is left out."""
    there = np.isfinite(r) & (r > 0)
    unit, r = unit[there], r[there] + rng.normal(0, RANGE, there.sum())
    h = np.arctan2(unit[:, 1], unit[:, 0])
    v = np.arccos(unit[:, 2])
    h = h + rng.normal(0, ANGLE, len(h)) / np.sin(v)
    points: np.ndarray = r[:, None] * directions(h, v + rng.normal(0, ANGLE, len(h)))
    return points


def turned(rng: np.random.Generator, towards: np.ndarray) -> np.ndarray:
    """Axes (3, 3) of a body whose faces all look at the scanner, each a little askew."""
    while True:
        axes: np.ndarray = exp(rng.normal(0, 2, 3))
        axes = axes * np.where(axes @ towards > 0, -1, 1)[:, None]
        if np.abs(axes @ towards / np.linalg.norm(towards)).min() > 0.3:
            return axes


def solid(unit: np.ndarray, normals: np.ndarray, at: np.ndarray, hollow: bool) -> np.ndarray:
    """Ranges to a convex body with these faces through a place, or to the room in them."""
    lengths = (normals @ at) / (unit @ normals.T)
    if hollow:
        out: np.ndarray = np.where(lengths > 0, lengths, np.inf).min(axis=1)
        return out
    entering = unit @ normals.T < 0
    far = np.where(entering, np.inf, lengths).min(axis=1)
    near: np.ndarray = np.where(entering, lengths, -np.inf).max(axis=1)
    return np.where(near < far, near, np.nan)


def scene(kind: PickKind, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of a scan, where it was picked, and where the natural point is."""
    at = directions(rng.uniform(-np.pi, np.pi), rng.uniform(0.9, 2.0)) * rng.uniform(6, 15)
    axes = turned(rng, at)
    place = at + rng.normal(0, 0.01, 3)
    unit = beams(at, 0.45)
    if kind in ("corner", "edge"):
        faces = axes[: 3 if kind == "corner" else 2]
        true = at
        if kind == "edge":
            true = at + axes[2] * (axes[2] @ (place - at))
        hollow = bool(rng.integers(2))
        return read(unit, solid(unit, faces, at, hollow), rng), place, true
    if kind == "axis":
        size = rng.uniform(0.06, 0.15)
        axis = np.cross(at, rng.normal(size=3))
        axis = axis / np.linalg.norm(axis) + 0.3 * at / np.linalg.norm(at)
        axis /= np.linalg.norm(axis)
        flat = unit - np.outer(unit @ axis, axis)
        middle = at - axis * (axis @ at)
        a, b, c = (flat**2).sum(axis=1), flat @ middle, middle @ middle - size**2
        with np.errstate(invalid="ignore"):
            r = (b - np.sqrt(b**2 - a * c)) / a
        front = at * (1 - size / np.linalg.norm(at))
        place = front + rng.normal(0, 0.01, 3)
        return read(unit, r, rng), place, at + axis * (axis @ (place - at))
    r = (axes[0] @ at) / (unit @ axes[0])
    inside = np.linalg.norm(unit * r[:, None] - at, axis=1) < rng.uniform(0.1, 0.2)
    return read(unit, np.where(inside == (kind == "disc"), r, np.nan), rng), place, at


def misses(kind: PickKind, count: int, seed: int) -> np.ndarray:
    """Weighted squares of errors, across an edge or axis where it is one."""
    rng = np.random.default_rng(seed)
    squares = []
    for _ in range(count):
        xyz, place, true = scene(kind, rng)
        found = find_pick(xyz, NaturalPoint(kind, tuple(place), 0.4))
        assert isinstance(found, Detection), found.reason
        squares.append(
            (found.center - true) @ np.linalg.solve(found.covariance, found.center - true)
        )
    return np.array(squares)


#: directions in which a natural point is determined
FREEDOM: dict[PickKind, int] = {"corner": 3, "edge": 2, "axis": 2, "hole": 3, "disc": 3}


@pytest.mark.parametrize("kind", FREEDOM)
def test_errors_are_as_large_as_stated(kind: PickKind) -> None:
    squares = misses(kind, 12, 7)
    assert chi2.ppf(1e-3, 12 * FREEDOM[kind]) < squares.sum() < chi2.ppf(0.999, 12 * FREEDOM[kind])


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["corner", "edge", "axis"])
def test_three_hundred_regions_hold_the_truth_in_95_percent(kind: PickKind) -> None:
    inside = (misses(kind, 300, 1) < chi2.ppf(0.95, FREEDOM[kind])).mean()
    assert abs(inside - 0.95) < 0.02


@pytest.mark.parametrize("kind", ["corner", "edge", "axis", "hole", "disc"])
@pytest.mark.parametrize("square", [False, True])
def test_a_bare_wall_and_a_square_hole_are_nothing_else(kind: PickKind, square: bool) -> None:
    rng = np.random.default_rng(3)
    for _ in range(4):
        at = directions(rng.uniform(-np.pi, np.pi), rng.uniform(0.9, 2.0)) * rng.uniform(6, 15)
        axes = turned(rng, at)
        unit = beams(at, 0.45)
        r = (axes[0] @ at) / (unit @ axes[0])
        if square:
            flat = (unit * r[:, None] - at) @ axes[1:].T
            r = np.where(np.abs(flat).max(axis=1) < 0.15, np.nan, r)
        xyz = read(unit, r, rng)
        assert isinstance(find_pick(xyz, NaturalPoint(kind, tuple(at), 0.4)), Rejected)


@pytest.mark.parametrize(
    ("seen", "picked"), [("axis", "edge"), ("axis", "corner"), ("edge", "axis"), ("edge", "hole")]
)
def test_one_thing_is_not_found_as_another(seen: PickKind, picked: PickKind) -> None:
    rng = np.random.default_rng(8)
    for _ in range(8):
        xyz, place, _ = scene(seen, rng)
        found = find_pick(xyz, NaturalPoint(picked, tuple(place), 0.4))
        assert isinstance(found, Rejected)
