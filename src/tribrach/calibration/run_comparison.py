"""Compares two calibrations of the same observations under different conditions.

A condition that only chooses a datum changes sigmas of coordinates and of what is not estimable,
and leaves everything estimable as it was: distances between points and stations, the redundancy,
the residuals. A condition that adds information improves estimable quantities (method section 4.3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.calibration.datum_effects import distance_sigmas
from tribrach.calibration.self_calibration import SelfCalibration
from tribrach.errors import InputError
from tribrach.sentences import Sentence

#: ratios of estimable sigmas closer to one than this are one
_SAME = 1e-5
#: sigmas that change by more than this factor are named
_NOTICED = 1.02


@dataclass(frozen=True)
class ComparedUnknown:
    """An unknown in both runs."""

    name: str  #: the unknown in words
    unit: str  #: ``m``, ``rad`` or ``1``
    first: float  #: its values, NaN where a run has none
    #: standard deviations; zero where a run holds it
    sigma_first: float
    second: float
    sigma_second: float

    @property
    def ratio(self) -> float:
        """Second sigma over first."""
        return self.sigma_second / self.sigma_first if self.sigma_first > 0 else float("nan")


@dataclass(frozen=True)
class Compared:
    """Common and different parts of two runs."""

    lines: tuple[ComparedUnknown, ...]  #: parameters and components of the poses
    distances: Array  #: (m,), ratios of the sigmas of distances between points, second over first
    redundancy: tuple[int, int]  #: of both runs
    vtpv: tuple[float, float]  #: of both runs

    @property
    def datum_only(self) -> bool:
        """True if nothing estimable changed."""
        same = bool(np.abs(self.distances - 1).max(initial=0.0) < _SAME)
        return same and self.redundancy[0] == self.redundancy[1]

    def sentences(self) -> list[str]:
        """The changes in words."""
        low, high = self.distances.min(initial=1.0), self.distances.max(initial=1.0)
        worse = [line for line in self.lines if line.ratio > _NOTICED]
        better = [line for line in self.lines if line.ratio < 1 / _NOTICED]
        out: list[str] = [
            Sentence(
                "sigmas of distances between points: second over first {low:6} to {high:6}; "
                "redundancy {own.redundancy[0]} and {own.redundancy[1]}",
                low=low,
                high=high,
                own=self,
            )
        ]
        if self.datum_only:
            out.append(
                "nothing estimable changed: the conditions differ by a choice of the datum alone, "
                "which is no improvement of the calibration and no deterioration"
            )
        elif high < 1 + _SAME:
            out.append("the second run has more information: its distances are known better")
        if worse:
            out.append("larger sigmas in the second run: " + ", ".join(map(_factor, worse[:12])))
        if better:
            out.append("smaller sigmas in the second run: " + ", ".join(map(_factor, better[:12])))
        return out


def _factor(line: ComparedUnknown) -> str:
    """An unknown and the factor on its sigma, in words."""
    return Sentence("{line.name} ({line.ratio:g3} times)", line=line)


def compare_runs(first: SelfCalibration, second: SelfCalibration) -> Compared:
    """Compare the parameters, stations and distances of two runs."""
    lines = [*_parameters(first, second), *_stations(first, second)]
    if not lines:
        raise InputError(
            "the two runs have nothing in common", cure="compare runs of the same observations"
        )
    points = set(first.adjustment.layout.names["point"])
    same = first.adjustment.layout.names["point"] == second.adjustment.layout.names["point"]
    ratios = np.empty(0)
    if same and points:
        a, b = _distances(first), _distances(second)
        ratios = b[a > 0] / a[a > 0]
    runs = (first.adjustment, second.adjustment)
    return Compared(tuple(lines), ratios, (runs[0].dof, runs[1].dof), (runs[0].vtpv, runs[1].vtpv))


def _distances(run: SelfCalibration) -> Array:
    """Sigmas [m] of distances between points."""
    a = run.adjustment
    sigma: Array = np.sqrt(run.factor) * distance_sigmas(a.state, a.cofactor, a.reduced)
    return sigma


def _parameters(first: SelfCalibration, second: SelfCalibration) -> list[ComparedUnknown]:
    """Parameters that both runs estimated."""
    others = {p.name: p for p in second.parameters}
    return [
        ComparedUnknown(p.name, p.unit, p.value, p.sigma, q.value, q.sigma)
        for p in first.parameters
        if (q := others.get(p.name)) is not None
    ]


def _stations(first: SelfCalibration, second: SelfCalibration) -> list[ComparedUnknown]:
    """Components of the poses; the value is the translation, turns have none of their own."""
    out = []
    a, b = first.adjustment, second.adjustment
    for name in a.layout.names["pose"]:
        if not b.layout.has("pose", name):
            continue
        sigmas = [
            np.sqrt(np.maximum(np.diag(run.factor * run.adjustment.covariance(name)), 0.0))
            for run in (first, second)
        ]
        places = [
            x.state.pose_t[x.layout.index("pose", name)].tolist() + [float("nan")] * 3
            for x in (a, b)
        ]
        for k, part in enumerate(("E", "N", "U", "tilt E", "tilt N", "heading")):
            if sigmas[0][k] > 0 or sigmas[1][k] > 0:
                out.append(
                    ComparedUnknown(
                        f"{part} of {name}",
                        "m" if k < 3 else "rad",
                        places[0][k],
                        float(sigmas[0][k]),
                        places[1][k],
                        float(sigmas[1][k]),
                    )
                )
    return out
