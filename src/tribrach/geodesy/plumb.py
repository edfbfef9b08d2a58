"""The plumb line at every position of a network, and what levels follow between them.

Instruments are levelled along the plumb line, which leans against the normal of the ellipsoid by
the deflection of the vertical; levelled heights count from the geoid. Both come from the best that
is known: values of the survey for a position, then a grid of geoid heights, then one deflection for
the site, then nothing. Metres and radians. Method section 7.5.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from tribrach._types import Array, Index
from tribrach.geodesy.geoid_grid import GeoidGrid, slope
from tribrach.geodesy.site import EllipsoidSite, Site
from tribrach.geodesy.work_frame import WorkFrame


@dataclass(frozen=True)
class PlumbField:
    """Plumb line and geoid heights at any place of a site."""

    #: one deflection for the site, towards north and east [rad]
    xi: float = 0.0
    eta: float = 0.0
    grid: GeoidGrid | None = None  #: geoid heights whose slope is the deflection, instead
    frame: WorkFrame | None = None  #: the work frame; its geoid heights are those of levelling

    def deflection(self, site: Site, x: Array) -> Array:
        """Deflections xi, eta (n, 2) [rad] at points (n, 3) [m] of W."""
        if self.grid is None or not isinstance(site, EllipsoidSite):
            return np.broadcast_to(np.array([self.xi, self.eta]), (len(x), 2)).copy()
        frame = WorkFrame(site, None if self.frame is None else self.frame.grid, 0.0, self.grid)
        latitude, longitude, height = site.geodetic(x).T
        return slope(frame.undulation, latitude, longitude, height, site.ellipsoid)

    def undulation(self, site: Site, x: Array) -> Array | None:
        """Geoid heights (n,) [m] at points (n, 3) of W; None where no grid gives them."""
        if not isinstance(site, EllipsoidSite):
            return None
        own = None if self.frame is None else self.frame.geoid_grid
        grid = self.grid if own is None else own
        if grid is None:
            return None
        frame = WorkFrame(site, None if self.frame is None else self.frame.grid, 0.0, grid)
        latitude, longitude, _ = site.geodetic(x).T
        return frame.undulation(latitude, longitude)


@dataclass(frozen=True, eq=False)
class PlumbLines:
    """Plumb lines and geoid heights at the positions of a network."""

    everywhere: PlumbField = field(default_factory=PlumbField)  #: what is known at any place
    #: (n, 2), xi, eta of positions that the survey gives [rad], NaN for others; or empty
    deflections: Array = field(default_factory=lambda: np.empty((0, 2)))
    #: (n,), geoid heights of positions that the survey gives [m], NaN for others; or empty
    undulations: Array = field(default_factory=lambda: np.empty(0))

    @property
    def normal(self) -> bool:
        """True if nothing leans: plumb lines are the normals of the site."""
        one = self.everywhere
        return not (one.xi or one.eta or one.grid is not None or len(self.deflections))

    @property
    def levels(self) -> bool:
        """True if levelling is reduced: by a geoid, or by what leans."""
        return not self.normal or self.everywhere.frame is not None or len(self.undulations) > 0

    def deflection(self, site: Site, index: Index, x: Array) -> Array:
        """Deflections xi, eta (k, 2) [rad] of positions ``index`` (k,) at ``x`` (k, 3) in W [m]."""
        if self.normal:
            return np.zeros((len(index), 2))
        _, first, inverse = np.unique(index, return_index=True, return_inverse=True)
        there = self.everywhere.deflection(site, x[first])[inverse]
        if not len(self.deflections):
            return there
        given = self.deflections[index]
        return np.where(np.isnan(given), there, given)

    def rise(self, site: Site, start: Index, end: Index, xyz: Array) -> tuple[Array, Array]:
        """Rise (k,) [m] of the geoid between positions (k,), else 0, and lean (k, 2) [rad].

        The lean is the mean deflection of both ends where geoid heights are not known, else 0; it
        makes ``-(xi dN + eta dE)`` of the way between them.
        """
        rise = self._undulation(site, end, xyz[end]) - self._undulation(site, start, xyz[start])
        lean = np.zeros((len(start), 2))
        unknown = np.isnan(rise)
        if unknown.any():
            a, b = start[unknown], end[unknown]
            rise[unknown] = 0.0
            lean[unknown] = self.deflection(site, a, xyz[a]) / 2
            lean[unknown] += self.deflection(site, b, xyz[b]) / 2
        return rise, lean

    def _undulation(self, site: Site, index: Index, x: Array) -> Array:
        """Geoid heights (k,) [m], NaN where they are not known."""
        there = self.everywhere.undulation(site, x)
        if there is None:
            there = np.full(len(index), np.nan)
        if not len(self.undulations):
            return there
        given = self.undulations[index]
        return np.where(np.isnan(given), there, given)
