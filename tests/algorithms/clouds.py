"""Clouds of many sorts, most of them degenerate, as PLY files of our own."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Random = np.random.Generator

#: at most so many points
MOST = 2000


def room(rng: Random, n: int, at: Array | None = None) -> Array:
    """Points on the inside of a box, seen from somewhere in it."""
    half = np.array([3.0, 2.2, 1.3])
    eye = np.zeros(3) if at is None else at
    way = rng.normal(size=(n, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    reach = np.min(np.where(way > 0, half - eye, half + eye) / np.abs(way), axis=1)
    return way * reach[:, None]


def _cylinder(rng: Random, n: int) -> Array:
    angle = rng.uniform(0, 2 * np.pi, n)
    return np.stack([2 * np.cos(angle), 2 * np.sin(angle), rng.uniform(-1, 1, n)], axis=1)


def _stairs(rng: Random, n: int) -> Array:
    xyz = rng.uniform([0, 0, 0], [5, 2, 0], (n, 3))
    xyz[:, 2] = 0.18 * np.floor(xyz[:, 0] / 0.3) - 1.5
    return xyz + np.array([1.0, -1.0, 0.0])


def _rings(rng: Random, n: int, rings: int) -> Array:
    flat = room(rng, n)
    r = np.linalg.norm(flat, axis=1)
    elevation = np.radians(np.linspace(-15, 15, rings) if rings > 1 else np.array([0.0]))
    v, h = rng.choice(elevation, n), np.arctan2(flat[:, 1], flat[:, 0])
    return r[:, None] * np.stack([np.cos(v) * np.cos(h), np.cos(v) * np.sin(h), np.sin(v)], axis=1)


def _few(rng: Random, n: int) -> Array:
    return rng.uniform(-2, 2, (int(rng.integers(1, 101)), 3))


#: shapes of up to n points, in the frame of a scanner
SHAPES: dict[str, Callable[[Random, int], Array]] = {
    "empty": lambda rng, n: np.empty((0, 3)),
    "one": lambda rng, n: np.array([[1.0, 2.0, 3.0]]),
    "few": _few,
    "at the scanner": lambda rng, n: np.zeros((n, 3)),
    "equal": lambda rng, n: np.full((n, 3), 2.0),
    "collinear": lambda rng, n: rng.uniform(1, 5, (n, 1)) * [1.0, 0.5, 0.2],
    "upright": lambda rng, n: rng.uniform(-1, 1, (n, 1)) * [0.0, 0.0, 1.0],
    "coplanar": lambda rng, n: np.column_stack([rng.uniform(-3, 3, (n, 2)), np.full(n, -1.5)]),
    "wall": lambda rng, n: np.column_stack([np.full(n, 3.0), rng.uniform(-2, 2, (n, 2))]),
    "two walls": lambda rng, n: np.where(
        rng.random((n, 1)) < 0.5,
        np.column_stack([np.full(n, 3.0), rng.uniform(-2, 2, (n, 2))]),
        np.column_stack([rng.uniform(-2, 2, n), np.full(n, 3.0), rng.uniform(-2, 2, n)]),
    ),
    "sphere": lambda rng, n: (
        (w := rng.normal(size=(n, 3))) / np.linalg.norm(w, axis=1, keepdims=True) * 2.0
    ),
    "small sphere": lambda rng, n: (
        (w := rng.normal(size=(n, 3))) / np.linalg.norm(w, axis=1, keepdims=True) * 0.07
        + [3.0, 0.0, 0.0]
    ),
    "cylinder": _cylinder,
    "stairs": _stairs,
    "room": room,
    "ring": lambda rng, n: _rings(rng, n, 1),
    "16 lines": lambda rng, n: _rings(rng, n, 16),
    "noise": lambda rng, n: rng.normal(size=(n, 3)),
    "grid": lambda rng, n: np.stack(
        np.meshgrid(*3 * [np.arange(max(round(n ** (1 / 3)), 1)) * 0.1]), axis=-1
    ).reshape(-1, 3),
}


def _doubled(rng: Random, xyz: Array) -> Array:
    return np.concatenate([xyz, xyz[: len(xyz) // 2]])


def _spoilt(value: float) -> Callable[[Random, Array], Array]:
    def change(rng: Random, xyz: Array) -> Array:
        xyz = xyz.copy()
        if len(xyz):
            xyz[rng.integers(len(xyz), size=1 + len(xyz) // 10), rng.integers(3)] = value
        return xyz

    return change


#: what happens to a cloud on its way into a file
CHANGES: dict[str, Callable[[Random, Array], Array]] = {
    "as it is": lambda rng, xyz: xyz,
    "noisy": lambda rng, xyz: xyz + rng.normal(size=xyz.shape) * 1e-3,
    "1 um off": lambda rng, xyz: xyz + 1e-6,
    "1 km off": lambda rng, xyz: xyz + 1e3,
    "1e7 m off": lambda rng, xyz: xyz + 1e7,
    "5e6 m in float32": lambda rng, xyz: (xyz + 5e6).astype("f4").astype(float),
    "some NaN": _spoilt(np.nan),
    "some infinite": _spoilt(np.inf),
    "all NaN": lambda rng, xyz: np.full_like(xyz, np.nan),
    "half doubled": _doubled,
    "in mm": lambda rng, xyz: xyz * 1e3,
    "mirrored": lambda rng, xyz: xyz * [1.0, -1.0, 1.0],
    "upside down": lambda rng, xyz: xyz * [1.0, -1.0, -1.0],
    "20 cm": lambda rng, xyz: xyz * 0.03,
    "10 km": lambda rng, xyz: xyz * 2e3,
    "1e-12 m": lambda rng, xyz: xyz * 1e-12,
    "camera": lambda rng, xyz: xyz[:, [0, 2, 1]] * [1.0, -1.0, 1.0],
}

#: intensities of a cloud; None for none
LIGHTS: dict[str, Callable[[Random, int], Array] | None] = {
    "none": None,
    "even": lambda rng, n: rng.random(n),
    "constant": lambda rng, n: np.full(n, 0.5),
    "zero": lambda rng, n: np.zeros(n),
    "NaN": lambda rng, n: np.full(n, np.nan),
    "infinite": lambda rng, n: np.full(n, np.inf),
    "negative": lambda rng, n: rng.uniform(-30, 5, n),
    "huge": lambda rng, n: rng.uniform(0, 1e30, n),
}


def write_ply(path: Path, xyz: Array, light: Array | None = None, kind: str = "double") -> Path:
    """A binary PLY file, whatever the values are."""
    names = ["x", "y", "z"] + ([] if light is None else ["intensity"])
    columns = xyz if light is None else np.column_stack([xyz, light])
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {len(xyz)}"]
    head += [f"property {kind} {name}" for name in names] + ["end_header", ""]
    with np.errstate(all="ignore"):
        body = columns.astype("<f8" if kind == "double" else "<f4").tobytes()
    path.write_bytes("\n".join(head).encode() + body)
    return path


def random_cloud(path: Path, rng: Random) -> str:
    """Write some cloud; what it is, in words."""
    shape, change = (str(rng.choice(list(table))) for table in (SHAPES, CHANGES))
    lit = str(rng.choice(list(LIGHTS)))
    n = int(rng.choice([3, 10, 100, 500, MOST]))
    xyz = CHANGES[change](rng, np.asarray(SHAPES[shape](rng, n), dtype=float))
    made = LIGHTS[lit]
    kind = str(rng.choice(["double", "float"]))
    with np.errstate(all="ignore"):
        write_ply(path, xyz, None if made is None else made(rng, len(xyz)), kind)
    return f"{shape}, {change}, intensities {lit}, {len(xyz)} points, {kind}"
