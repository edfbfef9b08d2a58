"""Values at the nodes of a grid in latitude and longitude, interpolated bilinearly as PROJ does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array

#: how far [cells] a place may lie outside by rounding
_ROUNDING = 1e-6


@dataclass(frozen=True, eq=False)
class HeightTable:
    """Nodes from south to north and from west to east; they may stay on disk until used."""

    #: latitude and longitude of the first node [degrees]
    south: float
    west: float
    #: from node to node [degrees]
    dlat: float
    dlon: float
    #: (rows, columns), as the file has them; metres are ``offset + scale * value``
    values: NDArray[Any]
    scale: float = 1.0
    offset: float = 0.0
    missing: tuple[float, ...] = ()  #: what stands where nothing is known

    def at(self, latitude: Array, longitude: Array) -> Array:
        """Values (n,) [m] at places (n,) [rad], NaN outside and beside nodes without value."""
        lat, lon = np.degrees(np.atleast_1d(latitude)), np.degrees(np.atleast_1d(longitude))
        rows, columns = self.values.shape
        y = (lat - self.south) / self.dlat
        # the same meridian may be written a circle away
        east = (lon - self.west + self.dlon * _ROUNDING) % 360.0 - self.dlon * _ROUNDING
        x = east / self.dlon
        around = columns * self.dlon > 360.0 - self.dlon * _ROUNDING
        last = columns if around else columns - 1
        inside = (y > -_ROUNDING) & (y < rows - 1 + _ROUNDING)
        inside &= (x > -_ROUNDING) & (x < last + _ROUNDING)
        y, x = (
            np.clip(np.where(inside, y, 0), 0, rows - 1),
            np.clip(np.where(inside, x, 0), 0, last),
        )
        row = np.minimum(y.astype(np.int64), max(rows - 2, 0))
        column = np.minimum(x.astype(np.int64), max(last - 1, 0))
        out = np.zeros(len(y))
        for i in (0, 1):
            for j in (0, 1):
                weight = np.abs(1 - i - (y - row)) * np.abs(1 - j - (x - column))
                r, c = np.minimum(row + i, rows - 1), (column + j) % columns
                node = self._decoded(np.asarray(self.values[r, c]))
                # a node that has no share is not asked for
                out += np.where(weight > 0, weight * node, 0.0)
        return np.where(inside, out, np.nan)

    def _decoded(self, raw: NDArray[Any]) -> Array:
        """Values of a file in metres, NaN where nothing is known."""
        number = raw.astype(float)
        unknown = ~np.isfinite(number)
        for value in self.missing:
            unknown |= np.isclose(number, value, rtol=1e-6, atol=0)
        out: Array = np.where(unknown, np.nan, self.offset + self.scale * number)
        return out
