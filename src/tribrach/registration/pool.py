"""The points known so far while stations are being matched: given ones and seen ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

__all__ = ["Pool"]

Array = NDArray[np.float64]

#: a target and a point are the same within this many sigmas of their distance ...
_GATE = 6.0
#: ... plus what an approximate pose may be wrong by [m], and this many sigmas of its drift
_POSE_ERROR = 0.02
_DRIFT = 4.0


class Pool:
    """Points with coordinates (m, 3) and sigmas (m,) [m]; what stations saw is added to them.

    points : name to coordinates and sigma of those that are given.
    """

    def __init__(self, points: Mapping[str, tuple[Array, float]]) -> None:
        self.names: list[str] = list(points)
        self.xyz: Array = np.array([xyz for xyz, _ in points.values()]).reshape(-1, 3)
        self.sigmas: Array = np.array([sigma for _, sigma in points.values()], dtype=np.float64)
        self._drift: Array = np.zeros(len(points))
        self._kinds: list[str] = [""] * len(points)
        self._given = len(points)
        self._seen: dict[str, NDArray[np.int64]] = {}

    def add(
        self, station: str, xyz: Array, sigmas: Array, kinds: Sequence[str], drift: Array
    ) -> None:
        """Assign targets (n, 3) of a placed station, one to one; the rest become new points.

        drift (n,) : how uncertain the station's place makes them [m]. It is common to what one
        station saw, so it counts when a chain of stations meets its beginning, and not in the
        distances between points of one station.
        """
        place = self._assign(xyz, sigmas, kinds, drift)
        for i in np.flatnonzero(place < 0).tolist():
            place[i] = len(self.names)
            self.names.append(f"tie {len(self.names) - self._given + 1}")
            self.xyz = np.vstack([self.xyz, xyz[i]])
            self.sigmas = np.append(self.sigmas, sigmas[i])
            self._drift = np.append(self._drift, drift[i])
            self._kinds.append(kinds[i])
        for i, j in enumerate(place.tolist()):
            self._kinds[j] = kinds[i]
        self._seen[station] = place

    def drift_of(self, places: NDArray[np.int64]) -> float:
        """Drift that points (k,) have on the average [m]."""
        return float(np.sqrt((self._drift[places] ** 2).mean())) if len(places) else 0.0

    def seen_by(self, station: str) -> NDArray[np.int64]:
        """Numbers of the points that a station saw."""
        return self._seen[station]

    @property
    def stations(self) -> list[str]:
        """Stations that were added."""
        return list(self._seen)

    def names_of(self, station: str) -> list[str]:
        """Name of each target of a station; "" for those that nothing else saw."""
        used = np.bincount(np.concatenate(list(self._seen.values())), minlength=len(self.names))
        alone = (used < 2) & (np.arange(len(self.names)) >= self._given)
        return ["" if alone[j] else self._final(int(j), alone) for j in self._seen[station]]

    def _final(self, j: int, alone: NDArray[np.bool_]) -> str:
        """The name of a point; tie points are numbered without those seen only once."""
        if j < self._given:
            return self.names[j]
        return f"tie {int((~alone[self._given : j]).sum()) + 1}"

    def _assign(
        self, xyz: Array, sigmas: Array, kinds: Sequence[str], drift: Array
    ) -> NDArray[np.int64]:
        """Number of the point of each target, -1 for none."""
        place = np.full(len(xyz), -1, dtype=np.int64)
        if len(self.names) == 0 or len(xyz) == 0:
            return place
        distance = np.linalg.norm(xyz[:, None] - self.xyz[None], axis=2)
        gate = _GATE * np.hypot(sigmas[:, None], self.sigmas[None]) + _POSE_ERROR
        gate += _DRIFT * np.hypot(drift[:, None], self._drift[None])
        alike = np.array([[k in ("", kind) for k in self._kinds] for kind in kinds])
        cost = np.where(alike & (distance < gate), distance / gate, 1e3)
        rows, columns = linear_sum_assignment(cost)
        fits = cost[rows, columns] < 1e3
        place[rows[fits]] = columns[fits]
        return place
