"""Which work frame does a RiSCAN PRO project get, and where are its stations to begin with?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach.geodesy.site import EllipsoidSite, FlatSite
from tribrach.io.survey.riscan_records import Project, ScanPosition

__all__ = ["Frames", "is_geocentric"]

Array = NDArray[np.float64]

#: semi-major axis [m] and flattening of WGS 84
WGS84 = (6378137.0, 1 / 298.257223563)
#: a project frame whose z axis is this close to the vertical stands upright [rad]
UPRIGHT = 3e-4


def is_geocentric(vector: Array) -> bool:
    """True if the length of a vector (3,) [m] is that of a place near the Earth's surface."""
    return bool(6.3e6 < np.linalg.norm(vector) < 6.42e6)


class Frames:
    """From the project's frames to the work frame W.

    site : W; upright : the project's z axis is known to be vertical.
    """

    def __init__(self, project: Project) -> None:
        self.project = project
        pop = np.eye(4) if project.pop is None else project.pop
        places = [
            s.position.vector
            for s in project.stations
            if s.position is not None and is_geocentric(s.position.vector)
        ]
        control = [p.vector for p in project.glcs if is_geocentric(p.vector)]
        origin = [pop[:3, 3]] if is_geocentric(pop[:3, 3]) else []
        # control in a projected or local frame cannot be joined with geocentric positions
        local = bool(project.glcs) and not control
        geocentric = [] if local else places or control or origin
        self.site: EllipsoidSite | FlatSite = FlatSite()
        self.upright = False
        #: (4, 4) from the project's frame to W
        self.w_from_prcs = pop if project.glcs else np.eye(4)
        if geocentric:
            self.site = EllipsoidSite.centred(np.array(geocentric), WGS84)
            self.w_from_prcs = self._oriented(self.site, pop, bool(origin))
            self.upright = bool(origin) and self.w_from_prcs[2, 2] > np.cos(UPRIGHT)
            self._to_gnss(self.site)

    def _oriented(self, site: EllipsoidSite, pop: Array, known: bool) -> Array:
        """Project frame in W by the POP, or as an East-North-Up frame if that is not known."""
        out = np.eye(4)
        if known:
            out[:3, :3] = site.w_from_ecef @ pop[:3, :3]
            out[:3, 3] = site.from_ecef(pop[None, :3, 3])[0]
        return out

    def _to_gnss(self, site: EllipsoidSite) -> None:
        """Turn about the vertical and shift the project so that it fits the GNSS positions."""
        both = [
            (s.sop[:3, 3], s.position.vector)
            for s in self.project.stations
            if s.sop is not None
            and s.registered
            and s.position is not None
            and s.position.enabled
            and is_geocentric(s.position.vector)
        ]
        if not both:
            return
        here = np.array([p for p, _ in both]) @ self.w_from_prcs[:3, :3].T
        there = site.from_ecef(np.array([g for _, g in both]))
        a, b = here - here.mean(axis=0), there - there.mean(axis=0)
        turn = np.arctan2(
            np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a[:, :2] * b[:, :2])
        )
        rotation = np.eye(3)
        rotation[:2, :2] = [[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]
        self.w_from_prcs[:3, :3] = rotation @ self.w_from_prcs[:3, :3]
        self.w_from_prcs[:3, 3] = there.mean(axis=0) - rotation @ here.mean(axis=0)

    @property
    def geocentric(self) -> bool:
        """True if W is tied to the Earth."""
        return isinstance(self.site, EllipsoidSite)

    def start(self, station: ScanPosition) -> tuple[Array, Array]:
        """Translation (3,) and rotation (3, 3) world from scanner; NaN if not registered."""
        if station.sop is None or not station.registered:
            return np.full(3, np.nan), np.full((3, 3), np.nan)
        pose = self.w_from_prcs @ station.sop
        return pose[:3, 3], pose[:3, :3]

    def from_ecef(self, xyz: Array) -> Array:
        """W of ECEF (n, 3); only where there are geocentric positions."""
        assert isinstance(self.site, EllipsoidSite)
        return self.site.from_ecef(xyz)

    def from_global(self, vector: Array) -> Array:
        """W of a vector (3,) of the global frame."""
        if isinstance(self.site, EllipsoidSite):
            inside: Array = self.site.from_ecef(vector[None])[0]
            return inside
        return vector

    def global_covariance(self, sigma: Array) -> Array:
        """Covariance (3, 3) in W of standard deviations (3,) along the global axes."""
        if isinstance(self.site, EllipsoidSite):
            r = self.site.w_from_ecef
            out: Array = r @ np.diag(sigma**2) @ r.T
            return out
        return np.diag(sigma**2)
