"""Networks observed without error from a truth that the tests know."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from tribrach.geometry import rotation
from tribrach.geometry.alignment import kabsch
from tribrach.network.survey import Survey
from tribrach.observations.scanner import Inclinations, TargetCentres
from tribrach.observations.sights import Directions, SlopeDistances, ZenithAngles
from tribrach.observations.unknowns import State

GON = np.pi / 200


@dataclass
class Truth:
    """True coordinates by name, true orientations by station, and a source of random poses."""

    xyz: dict[str, np.ndarray]
    rng: np.random.Generator
    orientation: dict[str, float] = field(default_factory=dict)

    @classmethod
    def random(cls, seed: int, names: Sequence[str]) -> Truth:
        """Points in a site of 100 x 100 x 20 m, at least 10 m apart in the plan."""
        rng = np.random.default_rng(seed)
        placed: list[np.ndarray] = []
        while len(placed) < len(names):
            x = rng.uniform(0, 100, 3) * [1, 1, 0.2]
            if all(np.hypot(*(x - y)[:2]) > 10 for y in placed):
                placed.append(x)
        return cls(dict(zip(names, placed, strict=True)), rng)

    def survey(self, *control: str, plan: bool = False) -> Survey:
        """A survey whose control is fixed; the other points are not even named unless in plan."""
        survey = Survey()
        for name, x in self.xyz.items():
            if name in control:
                survey.point(name, x, free=(False, False, False))
            elif plan:
                survey.point(name, free=(name == "P", name == "P", False))
        return survey

    def plan(self, a: str, b: str) -> float:
        """Horizontal distance [m]."""
        return float(np.hypot(*(self.xyz[b] - self.xyz[a])[:2]))

    def azimuth(self, a: str, b: str) -> float:
        """Azimuth [rad]."""
        e, n, _ = self.xyz[b] - self.xyz[a]
        return float(np.arctan2(e, n))

    def near(self, state: State, *names: str, atol: float = 1e-6, axes: int = 3) -> bool:
        """True if points of a state are where they should be."""
        rows = [state.layout.index("point", n) for n in names]
        truth = np.array([self.xyz[n] for n in names])
        return bool(np.allclose(state.points[rows, :axes], truth[:, :axes], atol=atol))


def total_station(
    survey: Survey,
    truth: Truth,
    station: str,
    targets: Sequence[str],
    *,
    directions: bool = True,
    distances: bool = True,
    zeniths: bool = True,
) -> None:
    """Sights from a levelled set-up with an orientation of its own."""
    n = len(targets)
    u = np.array([truth.xyz[t] - truth.xyz[station] for t in targets])
    ends = {"start": [station] * n, "end": list(targets)}
    o = truth.orientation.setdefault(station, float(truth.rng.uniform(-3, 3)))
    if directions:
        values = np.arctan2(u[:, 0], u[:, 1]) - o
        survey.add(Directions, values=values, sigma=1e-5, orientation=[f"o {station}"] * n, **ends)
    if distances:
        survey.add(SlopeDistances, values=np.linalg.norm(u, axis=1), sigma=0.001, **ends)
    if zeniths:
        z = np.arctan2(np.hypot(u[:, 0], u[:, 1]), u[:, 2])
        survey.add(ZenithAngles, values=z, sigma=1e-5, **ends)


def scanner(survey: Survey, truth: Truth, name: str, targets: Sequence[str]) -> np.ndarray:
    """Target centres from a scanner that stands anyhow; returns its rotation."""
    return _scan(survey, truth, name, targets, rotation.exp(truth.rng.uniform(-1.5, 1.5, 3)))


def levelled_scanner(survey: Survey, truth: Truth, name: str, targets: Sequence[str]) -> np.ndarray:
    """Target centres from a scanner whose tilt was read; returns its rotation."""
    heading = rotation.exp(np.array([0.0, 0.0, truth.rng.uniform(-3, 3)]))
    turn = rotation.exp(np.array([0.002, -0.003, 0.0])) @ heading
    _scan(survey, truth, name, targets, turn)
    q = turn.T @ [0.0, 0.0, 1.0]
    survey.add(Inclinations, values=[q[:2] / q[2]], sigma=np.full((1, 2), 1e-5), station=[name])
    return turn


def _scan(
    survey: Survey, truth: Truth, name: str, targets: Sequence[str], turn: np.ndarray
) -> np.ndarray:
    truth.xyz.setdefault(name, truth.rng.uniform(20, 80, 3) * [1, 1, 0.1])
    x = np.array([truth.xyz[t] for t in targets])
    survey.station(name)
    survey.add(
        TargetCentres,
        values=(x - truth.xyz[name]) @ turn,
        sigma=np.full((len(x), 3), 0.001),
        station=[name] * len(x),
        target=list(targets),
    )
    return turn


def figure_misfit(state: State, truth: Truth) -> float:
    """Root mean square [m] of all points after moving the whole figure onto the truth."""
    names = state.layout.names["point"]
    return kabsch(state.points, np.array([truth.xyz[n] for n in names])).rms
