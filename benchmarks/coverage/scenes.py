"""Scenes in folders: scans and what programs may know of them, and the truth apart from it.

FOLDER/scenes/room-0007/scene.json, S1.ply, S2.ply     what a program is given
FOLDER/truth/room-0007.json                            what only the scorer reads
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.coverage.scanner import SCANNERS, exp, instrument, scan
from benchmarks.coverage.sites import SITES
from benchmarks.coverage.world import Array, World, turned

__all__ = ["Scene", "Truth", "make", "names_of", "read_points", "scenes", "truths"]

#: what approximate poses are wrong by along each axis: [m], [rad]
APPROXIMATE = (0.25, float(np.radians(1.25)))
#: check points of each scan but the first
POINTS = 10
_VERTEX = np.dtype(
    [(n, "<f8") for n in "xyz"] + [("intensity", "<f4"), ("row", "<i4"), ("column", "<i4")]
)


@dataclass(frozen=True)
class Scene:
    """What a program is given of a scene."""

    name: str
    folder: Path
    #: ``scene.json``
    given: dict[str, Any]

    @property
    def scans(self) -> tuple[str, ...]:
        """Names of the scans; poses are asked of all but the first, in its frame."""
        return tuple(self.given["scans"])

    def file(self, scan: str) -> Path:
        """A scan's file."""
        return self.folder / f"{scan}.ply"

    def points(self, scan: str) -> Array:
        """Points (n, 3) in the frame of their scanner [m]."""
        return read_points(self.file(scan))[0]

    def approximate(self, scan: str) -> Array:
        """An approximate ``first_from_scan`` (4, 4)."""
        return np.array(self.given["approximate"]["first_from_scan"][scan])


@dataclass(frozen=True)
class Truth:
    """What is true of a scene."""

    name: str
    #: (4, 4) by the name of the scan
    first_from_scan: dict[str, Array]
    #: check points (3,) in the frame of the first scan [m]
    points: dict[str, Array]


def names_of(count: int, seed: int) -> list[tuple[str, int]]:
    """Names of scenes with their seeds: the sorts of sites in turn."""
    sorts = list(SITES)
    return [(f"{sorts[k % len(sorts)]}-{seed + k:04d}", seed + k) for k in range(count)]


def make(folder: Path, name: str, seed: int, thin: float = 1.0) -> None:
    """Make one scene; the same name and seed give the same bytes.

    Parameters
    ----------
    folder : Path
        Of the benchmark.
    name, seed
        Of the scene; its name begins with the sort of the site.
    thin : float
        Share of the beams.
    """
    sort = name.split("-")[0]
    rng = np.random.default_rng([seed, list(SITES).index(sort), 20261127])
    count = 3 if rng.random() < 0.35 else 2
    scanner = SCANNERS[seed // len(SITES) % len(SCANNERS)] if seed else SCANNERS[0]
    if thin != 1.0:
        scanner = type(scanner)(**{**vars(scanner), "beams": int(thin * scanner.beams)})
    site = SITES[sort](rng, count)
    errors = instrument(scanner, rng)
    # one tripod in four stands badly
    drift = (0.001, 8e-5) if rng.random() < 0.25 else (0.0001, 5e-6)
    leans = 0.12 if rng.random() < 0.2 else 0.02
    place = folder / "scenes" / name
    place.mkdir(parents=True, exist_ok=True)
    poses, points, true_points = {}, {}, {}
    for k, at in enumerate(site.stations, 1):
        pose = np.eye(4)
        pose[:3, :3] = turned(rng.uniform(0, 2 * np.pi), rng.normal(0, leans), rng.uniform(0, 6.3))
        pose[:3, 3] = at
        world = World((*site.solids, *site.passing(rng)), site.terrain)
        taken = scan(world, pose, scanner, errors, drift, rng)
        poses[f"S{k}"] = pose
        _write_points(place / f"S{k}.ply", taken.xyz, taken.intensity, taken.grid)
        if k == 1:
            continue
        may = np.flatnonzero(taken.checkable)
        for number in rng.choice(may, min(POINTS, len(may)), replace=False):
            point = f"P{k}{len(points):02d}"
            points[point] = {
                "scan": f"S{k}", "number": int(number), "xyz": taken.xyz[number].tolist()
            }  # fmt: skip
            true_points[point] = taken.spot[number]
    back = np.linalg.inv(poses["S1"])
    true = {n: back @ pose for n, pose in poses.items() if n != "S1"}
    near = {}
    for n, pose in true.items():
        off = pose.copy()
        off[:3, :3] = exp(rng.normal(0, APPROXIMATE[1], 3)) @ pose[:3, :3]
        off[:3, 3] += rng.normal(0, APPROXIMATE[0], 3)
        near[n] = off.tolist()
    given = {
        "schema": 1,
        "scene": name,
        "scans": list(poses),
        "scanner": scanner.sheet(),
        "approximate": {
            "sigma_m": APPROXIMATE[0], "sigma_rad": APPROXIMATE[1], "first_from_scan": near
        },
        "points": points,
    }  # fmt: skip
    truth = {
        "scene": name,
        "seed": seed,
        "first_from_scan": {n: pose.tolist() for n, pose in true.items()},
        "points": {
            n: (back[:3, :3] @ xyz + back[:3, 3]).tolist() for n, xyz in true_points.items()
        },
        "instrument": {"zero_m": errors[0], "scale": errors[1], "index_rad": errors[2]},
        "drift": {"sigma_m": drift[0], "sigma_rad": drift[1]},
    }
    (folder / "truth").mkdir(exist_ok=True)
    (folder / "truth" / f"{name}.json").write_text(json.dumps(truth, indent=1) + "\n")
    (place / "scene.json").write_text(json.dumps(given, indent=1) + "\n")


def scenes(folder: Path) -> Iterator[Scene]:
    """All scenes of a folder, by name of the number."""
    for file in sorted(folder.glob("scenes/*/scene.json"), key=lambda f: f.parent.name[-4:]):
        yield Scene(file.parent.name, file.parent, json.loads(file.read_text()))


def truths(folder: Path) -> dict[str, Truth]:
    """The truth of all scenes by name."""
    out = {}
    for file in sorted(folder.glob("truth/*.json"), key=lambda f: f.stem[-4:]):
        read = json.loads(file.read_text())
        poses = {n: np.array(p) for n, p in read["first_from_scan"].items()}
        out[file.stem] = Truth(
            file.stem, poses, {n: np.array(p) for n, p in read["points"].items()}
        )
    return out


def _write_points(file: Path, xyz: Array, intensity: Array, grid: Array) -> None:
    kinds = {"<f8": "double", "<f4": "float", "<i4": "int"}
    lines = ["ply", "format binary_little_endian 1.0", "comment scanner at 0 0 0"]
    lines.append(f"element vertex {len(xyz)}")
    lines += [f"property {kinds[_VERTEX[n].str]} {n}" for n in _VERTEX.names or ()]
    record = np.zeros(len(xyz), _VERTEX)
    record["x"], record["y"], record["z"] = xyz.T
    record["intensity"], (record["row"], record["column"]) = intensity, grid.T
    file.write_bytes("\n".join([*lines, "end_header\n"]).encode() + record.tobytes())


def read_points(file: Path) -> tuple[Array, Array]:
    """Points (n, 3) [m] and intensities (n,) of a scan of the benchmark."""
    data = file.read_bytes()
    begin = data.index(b"end_header\n") + len(b"end_header\n")
    record = np.frombuffer(data, _VERTEX, offset=begin)
    return np.column_stack([record[n] for n in "xyz"]), record["intensity"].astype(float)
