"""Planned scans: which targets a scanner sees from where, and how precisely.

A planned station sees every target that the scene, the range and the incidence let it see, besides
the scans that a table of planned observations names. Every scan has the sigmas of its instrument,
divided by the root of the number of sets and of points on a target; the target's own is not.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.geometry.polar import polar_from_xyz
from tribrach.job.whose_instrument import Instruments
from tribrach.network.survey import Survey
from tribrach.observations.scanner import ScannerPolar
from tribrach.simulate.scene import Scene
from tribrach.simulate.sight_lines import SightLines, sight_lines

#: what scans of a plan are called as sources
_SOURCE = "planned scan"


@dataclass(frozen=True)
class ScannerPlace:
    """Where a scanner stands: position (3,) [m] and rotation (3, 3) world from scanner."""

    position: Array
    rotation: Array


class PlannedScans:
    """Scans of a plan; ``named`` pairs (station, target) are scanned whatever hides the target."""

    def __init__(self, instruments: Instruments, named: set[tuple[str, str]]) -> None:
        project = instruments.project
        assert project.plan is not None
        self.instruments, self.plan, self.named = instruments, project.plan, named
        bodies = [body.primitive() for body in project.plan.scene]
        self.scene = Scene.of(bodies) if bodies else None

    def lines(self, stations: Mapping[str, ScannerPlace], places: Array) -> SightLines:
        """Lines of sight from stations (s,) to places (n, 3)."""
        origins = np.array([s.position for s in stations.values()]).reshape(-1, 3)
        return sight_lines(
            origins,
            places,
            self.scene,
            longest=self.plan.longest_m,
            steepest=float(np.radians(self.plan.steepest_deg)),
        )

    def seen(
        self, stations: Mapping[str, ScannerPlace], targets: Mapping[str, Array]
    ) -> NDArray[np.bool_]:
        """Which targets (n,) the stations (s,) see, (s, n), with the scans named in tables."""
        if not targets or not stations:
            return np.zeros((len(stations), len(targets)), dtype=bool)
        out = self.lines(stations, np.array(list(targets.values()))).seen
        for i, station in enumerate(stations):
            named = [target for start, target in self.named if start == station]
            if named:
                out[i] |= np.isin(np.array(list(targets), dtype=object), named)
        return out

    def add(
        self,
        survey: Survey,
        stations: Mapping[str, ScannerPlace],
        targets: Mapping[str, Array],
        seen: NDArray[np.bool_],
    ) -> None:
        """Add the planned scans of stations (s,) to targets (n,) that they see (s, n)."""
        xyz, names = np.array(list(targets.values())).reshape(-1, 3), np.array(list(targets))
        for (station, place), visible in zip(stations.items(), seen, strict=True):
            if not visible.any():
                continue
            polar = polar_from_xyz((xyz[visible] - place.position) @ place.rotation)
            sigma = self._sigma(station, polar)
            for face in (1.0, -1.0)[: self.plan.faces]:
                survey.add(
                    ScannerPolar,
                    values=polar,
                    sigma=sigma,
                    station=[station] * len(polar),
                    target=[str(n) for n in names[visible]],
                    face=np.full(len(polar), face),
                    source=[f"{_SOURCE} {station}"] * len(polar),
                )

    def _sigma(self, station: str, polar: Array) -> Array:
        """Sigmas (n, 3) of range and angles: the mean of the sets, and the target's own."""
        precision = self.instruments.precision(self.instruments.of_planned(station))
        sigma = precision.of_polar(polar, self.plan.sets * self.plan.target_points)
        if sigma is None:
            raise self.instruments.project.error(
                ("plan", "instrument"),
                f"the scanner of station {station} is not known",
                "give an instrument with range_mm and scan_angle_arcsec",
            )
        return precision.with_floor(polar, sigma)
