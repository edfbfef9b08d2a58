"""Spatial distance between two positions: scale bar, sphere to sphere, base length of stations.

A slope distance without instrument or target heights, under a name of its own because it is a
length standard and not a sight (method section 2.12).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from tribrach.network.observations.slope_distance import SlopeDistances

__all__ = ["Distances"]


@dataclass(kw_only=True)
class Distances(SlopeDistances):
    """Distances [m] from ``start`` to ``end`` (position indices)."""

    kind: ClassVar[str] = "distance"
