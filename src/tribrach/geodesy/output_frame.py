"""The frame in which results are delivered: coordinates, directions and covariances.

``work`` is the work frame as it is (E, N, U); ``projected`` is easting, northing and height of the
site's grid, converted point by point; ``ecef`` is geocentric. Metres. Method section 1.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from pyproj import CRS

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geodesy.site import EllipsoidSite
from tribrach.geodesy.work_frame import WorkFrame

FrameKind = Literal["work", "projected", "ecef"]


@dataclass(frozen=True)
class OutputFrame:
    """The frame in which results are given."""

    work: WorkFrame  #: the work frame of the network
    kind: FrameKind = "work"  #: ``work``, ``projected`` or ``ecef``
    #: name of the reference system of the coordinates, None for a local frame
    crs: str | None = None
    epoch: float | None = None  #: decimal year of a dynamic system

    def __post_init__(self) -> None:
        if self.kind == "projected" and self.work.grid is None:
            raise InputError(
                "clouds in a projection need a projected site",
                cure="give the site a crs, or leave clouds in the work frame",
            )
        if self.kind == "ecef" and not isinstance(self.work.site, EllipsoidSite):
            raise InputError(
                "geocentric clouds need a place on the ellipsoid, and the site is flat",
                cure="give the site latitude_deg and longitude_deg, or a crs",
            )

    @property
    def axes(self) -> tuple[str, str, str]:
        """Short names of the three coordinates, such as e, n, h."""
        if self.kind == "ecef":
            return "x", "y", "z"
        return ("e", "n", "u") if self.kind == "work" else ("e", "n", "h")

    @property
    def wkt(self) -> str | None:
        """WKT of the reference system, None for a local frame."""
        if self.crs is None:
            return None
        wkt: str = CRS.from_user_input(self.crs).to_wkt()
        return wkt

    def from_work(self, x: Array) -> Array:
        """Coordinates (n, 3) of points (n, 3) of the work frame."""
        if self.kind == "work":
            return x
        if self.kind == "ecef":
            assert isinstance(self.work.site, EllipsoidSite)
            return self.work.site.to_ecef(x)
        assert self.work.grid is not None
        out = self.work.grid.from_work(x)
        geodetic = self.work.grid.site.geodetic(x)
        out[:, 2] -= self.work.undulation(geodetic[:, 0], geodetic[:, 1])
        return out

    def jacobian(self, x: Array) -> Array:
        """Derivative (3, 3) of the delivered coordinates by the work frame at a point (3,)."""
        if self.kind == "work":
            return np.eye(3)
        if self.kind == "ecef":
            assert isinstance(self.work.site, EllipsoidSite)
            return self.work.site.w_from_ecef.T
        # 10 m either way: the differences are exact to 1e-9, rounding of the grid is less
        steps = 10.0 * np.concatenate([np.eye(3), -np.eye(3)])
        there = self.from_work(x + steps)
        jacobian: Array = (there[:3] - there[3:]).T / 20.0
        return jacobian

    def rotation(self, x: Array) -> Array:
        """The rotation (3, 3) nearest to the Jacobian at a point (3,): scale is left out."""
        u, _, vt = np.linalg.svd(self.jacobian(x))
        turned: Array = u @ vt
        return turned
