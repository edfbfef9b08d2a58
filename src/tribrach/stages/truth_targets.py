"""Targets of a simulated project, station by station: visible, missed, invented, misnamed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from tribrach.stages.naming import Named

__all__ = ["Bookkeeping", "bookkeeping", "true_ties"]

#: a detection this near to a target's true place is that target [m]
_NEAR = 0.05


@dataclass(frozen=True)
class Bookkeeping:
    """Targets of one station: names that should be found, were missed, invented, misnamed."""

    station: str
    visible: tuple[str, ...]
    missed: tuple[str, ...]
    invented: int
    misnamed: tuple[str, ...]

    @property
    def clean(self) -> bool:
        """True if everything visible was found, nothing invented, every name right."""
        return not (self.missed or self.invented or self.misnamed)


def _true_names(truth: Mapping[str, Any], named: Named) -> dict[str, list[str]]:
    """True name of each detection by station, "" for what is no target."""
    targets = {n: np.array(truth["points"][n]) for n in truth["targets"]}
    names, xyz = list(targets), np.array(list(targets.values()))
    out = {}
    for station, found in named.targets.items():
        matrix = np.array(truth["stations"][station]["world_from_scanner"])
        here = []
        for d in found:
            distance = np.linalg.norm(xyz - matrix[:3, :3] @ d.center - matrix[:3, 3], axis=1)
            k = int(np.argmin(distance))
            here.append(names[k] if distance[k] < _NEAR else "")
        out[station] = here
    return out


def true_ties(truth: Mapping[str, Any], named: Named) -> dict[str, str]:
    """True names of tie points."""
    out = {}
    for station, trues in _true_names(truth, named).items():
        for given, true in zip(named.identification.names.get(station, ()), trues, strict=False):
            if given.startswith("tie ") and true:
                out[given] = true
    return out


def bookkeeping(truth: Mapping[str, Any], named: Named) -> list[Bookkeeping]:
    """Targets station by station."""
    ties, trues = true_ties(truth, named), _true_names(truth, named)
    out = []
    for station, data in truth["stations"].items():
        here, names = trues.get(station, []), named.identification.names.get(station, ())
        wrong = [
            true
            for given, true in zip(names, here, strict=False)
            if given and true and ties.get(given, given) != true
        ]
        out.append(
            Bookkeeping(
                station,
                tuple(data["visible"]),
                tuple(n for n in data["visible"] if n not in here),
                here.count(""),
                tuple(wrong),
            )
        )
    return out
