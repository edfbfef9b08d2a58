"""A twin: a site that is known in every detail, the measurements made there, and the truth.

World coordinates are those of a flat site, E, N, U [m].
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geometry.pose import Pose
from tribrach.simulate.ray_casting import SceneView
from tribrach.simulate.scanner import ScanGrid, Scanner, SimulatedPoints, scan
from tribrach.simulate.scene import Primitive, Scene, checkerboard, disc, sphere

TargetKind = Literal["sphere", "checkerboard", "disc"]

#: purposes of random numbers; each has a stream of its own
_PURPOSES = ("poses", "survey", "scans", "truth", "control")
#: a flat target is found if it is seen at less than this angle from its normal [rad] and takes at
#: least so many steps of the grid across; a sphere takes so many points
_STEEPEST, _ACROSS, _SPHERE_POINTS = float(np.radians(60)), 12.0, 80.0


def child_rng(seed: int, purpose: str) -> np.random.Generator:
    """The stream of random numbers of one purpose."""
    key = (_PURPOSES.index(purpose),)
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))


@dataclass(frozen=True, eq=False)
class TwinTarget:
    """A target in the world."""

    #: of the target
    name: str
    kind: TargetKind
    center: Array  #: (3,), in the world [m]
    size: float  #: side of a checkerboard, radius of a sphere or of a disc [m]
    normal: Array | None = None  #: (3,), of flat targets

    def primitive(self) -> Primitive:
        """The target as a primitive of the scene."""
        if self.normal is None:
            return sphere(self.center, self.size)
        if self.kind == "disc":
            return disc(self.center, self.normal, self.size, 4 * self.size)
        return checkerboard(self.center, self.normal, self.size)

    @property
    def reach(self) -> float:
        """Radius of a sphere around the target [m]."""
        factor = {"sphere": 1.0, "checkerboard": np.sqrt(0.5), "disc": 2 * np.sqrt(2)}
        return float(self.size * factor[self.kind])


@dataclass(frozen=True, eq=False)
class TwinStation:
    """A scanner station."""

    name: str  #: of the station
    pose: Pose  #: world from scanner, true
    levelled: bool = False  #: it was set up level


@dataclass(frozen=True, eq=False)
class TwinScan:
    """One scan of a station."""

    #: of the scan and its station
    name: str
    station: str
    grid: ScanGrid  #: directions of its pixels
    #: (rows, columns), directions that are measured, all if None
    mask: NDArray[np.bool_] | None = None

    @property
    def rays(self) -> int:
        """How many directions are measured."""
        return len(self.grid) if self.mask is None else int(self.mask.sum())


@dataclass(frozen=True)
class TargetSight:
    """How a station sees a target."""

    range: float  #: in metres
    incidence: float  #: in radians
    clear: float  #: share of the target that nothing hides
    points: float  #: expected in the finest scan
    visible: bool  #: the target can be found in that scan


@dataclass(frozen=True, eq=False)
class Twin:
    """All about a twin."""

    #: of the twin
    name: str
    title: str
    seed: int  #: of its random numbers
    #: what is scanned, and with what
    scene: Scene
    scanner: Scanner
    #: of the scanner
    stations: Sequence[TwinStation]
    scans: Sequence[TwinScan]
    targets: Sequence[TwinTarget]
    files: Mapping[str, str] = field(default_factory=dict)  #: texts of tables by file name
    project: str = ""  #: the sections of the project file
    #: true coordinates (3,) of further points by name [m]
    marks: Mapping[str, Array] = field(default_factory=dict)
    facts: Mapping[str, Any] = field(default_factory=dict)  #: further truth for the record
    suffix: str = ".laz"  #: of the files of scans
    #: of several at one site: what its project, scans and results are called after
    campaign: str = ""
    later: Sequence[Twin] = ()  #: campaigns that follow at the same site, written beside this one

    @property
    def project_file(self) -> str:
        """Name of the project file."""
        return f"{self.campaign or self.name}.toml"

    def station(self, name: str) -> TwinStation:
        """A station by its name."""
        for station in self.stations:
            if station.name == name:
                return station
        known = ", ".join(s.name for s in self.stations)
        raise InputError(f"the twin has no station {name}", cure=f"its stations are {known}")

    def measure(self, number: int) -> Iterator[SimulatedPoints]:
        """Points of the scan of this number, block by block."""
        one = self.scans[number]
        seed = (self.seed, _PURPOSES.index("scans"), number)
        pose = self.station(one.station).pose
        return scan(self.scene, pose, self.scanner, one.grid, seed, one.mask)

    @cached_property
    def sights(self) -> dict[str, dict[str, TargetSight]]:
        """How each station sees each target."""
        return {s.name: self._sights_from(s) for s in self.stations}

    def visible(self, station: str) -> list[str]:
        """Names of the targets that can be found in the scans of a station."""
        return [name for name, sight in self.sights[station].items() if sight.visible]

    def _sights_from(self, station: TwinStation) -> dict[str, TargetSight]:
        view = SceneView(self.scene, station.pose.translation)
        scans = [s for s in self.scans if s.station == station.name]
        return {t.name: sight_of(view, station.pose, scans, t) for t in self.targets}


def sight_of(
    view: SceneView, pose: Pose, scans: Sequence[TwinScan], target: TwinTarget
) -> TargetSight:
    """How a target is seen from a station."""
    line = target.center - view.origin
    length = float(np.linalg.norm(line))
    cosine = 1.0 if target.normal is None else abs(float(line @ target.normal)) / length
    clear = _clear(view, target, length)
    step = min((s.grid.step for s in scans if _covers(s, pose, target)), default=np.inf)
    across = target.size / (length * step)
    if target.kind == "sphere":
        points = float(np.pi * across**2)
        enough = points >= _SPHERE_POINTS
    else:
        points = float(across**2 * cosine) * (np.pi if target.kind == "disc" else 1.0)
        enough = across * (2 if target.kind == "disc" else 1) * cosine >= _ACROSS
    steep = float(np.arccos(min(cosine, 1.0)))
    visible = clear > 0.97 and steep < _STEEPEST and bool(enough)
    return TargetSight(length, steep, clear, points, visible)


def _clear(view: SceneView, target: TwinTarget, length: float) -> float:
    """Share of rays to places of a target that nothing nearer stops."""
    number = np.arange(60)
    turn, radius = number * 2.39996, np.sqrt((number + 0.5) / 60) * 0.95 * target.size
    line = (target.center - view.origin) / length
    if target.normal is None:
        first = np.cross(line, [0.3, 0.5, 0.8])
        second = np.cross(line, first / np.linalg.norm(first))
        first = first / np.linalg.norm(first)
    else:
        axes = target.primitive().axes
        first, second, radius = axes[0], axes[1], radius * (0.5 if target.kind != "disc" else 1)
    places = target.center + radius[:, None] * (
        np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * second
    )
    rays = places - view.origin
    far = np.linalg.norm(rays, axis=1)
    reached = view.cast(rays / far[:, None]).range
    return float((np.abs(reached - far) < target.reach + 1e-3).mean())


def _covers(one: TwinScan, pose: Pose, target: TwinTarget) -> bool:
    """True if a scan covers the whole of a target."""
    local = pose.inverse @ target.center
    h, v = np.arctan2(local[1], local[0]), np.arctan2(np.hypot(local[0], local[1]), local[2])
    half = 1.1 * target.reach / float(np.linalg.norm(local))
    grid = one.grid
    for dh, dv in ((0.0, 0.0), (half, 0.0), (-half, 0.0), (0.0, half), (0.0, -half)):
        column = int(((h + dh / np.sin(v) - grid.first_h) % (2 * np.pi)) / grid.step)
        row = int((v + dv - grid.first_v) / grid.step)
        if not (0 <= column < grid.columns and 0 <= row < grid.rows):
            return False
        if one.mask is not None and not one.mask[row, column]:
            return False
    return True


def steps_for(points: int) -> int:
    """The number of points asked for, if it makes sense."""
    if not 1_000 <= points <= 1_000_000_000:
        raise InputError(f"{points} points per station", cure="ask for 1000 to 1000000000")
    return points
