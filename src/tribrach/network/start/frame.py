"""A frame in which places are being determined: the work frame, or one of its own for a part.

Four kinds differ in what they know beforehand: ``world`` everything given; ``oriented`` north and
the vertical; ``levelled`` the vertical (an unknown heading and shift); ``rigid`` nothing. Plan
coordinates and heights are kept apart, because most observations tie only one of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from tribrach._types import Array, Index, Mask
from tribrach.geodesy.site import FlatSite, Site
from tribrach.network.start.grouping import grouped_median, pair_key, wrap
from tribrach.network.start.ties import Ties
from tribrach.observations.ties import Lengths, Rays

Kind = Literal["world", "oriented", "levelled", "rigid"]


@dataclass
class Frame:
    """Places and orientations as far as they are known; NaN where they are not."""

    kind: Kind  #: what the frame knows beforehand
    ties: Ties  #: all ties of the network
    site: Site  #: how verticals run over the site
    plan: Array  #: (n, 2), E, N of the nodes [m]
    up: Array  #: (n,), heights of the nodes above the site [m]
    turn: Array  #: (S, 3, 3), rotations world from scanner
    orientation: Array  #: (K,), orientations of sets [rad]
    normal: Array  #: (L, 3), unit normals of planes
    offset: Array  #: (L,), offsets of planes [m]
    open_set: Mask  #: (K,), sets that may be placed in this frame
    open_pose: Mask  #: (S,), poses that may be placed in this frame
    floating: bool = False  #: true if heights count from an arbitrary zero
    scaled: bool = True  #: true if lengths are true
    handed: bool = True  #: false if it may be a mirror image
    relaxed: bool = False  #: true if weak figures are taken
    guess: bool = False  #: true if one of two equally good places may be chosen

    def __post_init__(self) -> None:
        ties = self.ties
        self.rays: Rays = ties.rays[self.open_set[ties.rays.set]]
        none = np.zeros(0, dtype=np.int64)
        self.lengths: Lengths = ties.lengths if self.scaled else ties.lengths[none]
        self._pair_lengths()
        self.rises = ties.rises if self.scaled else ties.rises[none]
        self.zeniths = ties.zeniths if self.scaled else ties.zeniths[none]
        self.shots = ties.shots[self.open_pose[ties.shots.pose]]

    def _pair_lengths(self) -> None:
        """Number the pairs of nodes between which lengths were measured."""
        key = pair_key(self.lengths.start, self.lengths.end, self.ties.n_nodes)
        self._pairs, self._pair_of_length = np.unique(key, return_inverse=True)
        self._needs_up = np.isnan(self.lengths.flat)
        self._flats = np.full(len(self._pairs), np.nan)
        self._seen = -1

    @property
    def known_plan(self) -> Mask:
        """Nodes whose E and N are known."""
        return np.isfinite(self.plan[:, 0]) & np.isfinite(self.plan[:, 1])

    @property
    def known_up(self) -> Mask:
        """Nodes whose height is known."""
        return np.isfinite(self.up)

    @property
    def known(self) -> Mask:
        """Nodes whose three coordinates are known."""
        return self.known_plan & self.known_up

    def count(self) -> int:
        """Everything known so far: grows while the frame does."""
        parts = (self.plan, self.up, self.turn, self.orientation, self.normal)
        return sum(int(np.isfinite(p).sum()) for p in parts)

    def complete(self) -> bool:
        """True if every tied position, pose, plane and orientation that is sought is known."""
        ties = self.ties
        sets = np.unique(ties.rays.set)
        return bool(
            self.known[: ties.n_positions][ties.tied[: ties.n_positions]].all()
            and np.isfinite(self.turn).all()
            and np.isfinite(self.offset).all()
            and np.isfinite(self.orientation[sets[sets < ties.n_scalars]]).all()
        )

    @property
    def curved(self) -> bool:
        """True if verticals of this frame are not parallel."""
        return self.kind in ("world", "oriented") and not isinstance(self.site, FlatSite)

    def space(self, nodes: Index) -> Array:
        """Cartesian coordinates (n, 3) of known nodes."""
        xyz = np.concatenate([self.plan[nodes], self.up[nodes, None]], axis=1)
        if self.curved and len(xyz):
            good = np.isfinite(xyz).all(axis=1)
            for _ in range(3):
                xyz[good, 2] += self.up[nodes[good]] - self.site.height(xyz[good])
        return xyz

    def heights(self, xyz: Array) -> Array:
        """Heights (n,) of Cartesian coordinates (n, 3); U itself where the plan is not known."""
        up: Array = xyz[:, 2].copy()
        if self.curved:
            good = np.isfinite(xyz).all(axis=1)
            if good.any():
                up[good] = self.site.height(xyz[good])
        return up

    @property
    def bent(self) -> bool:
        """True if zenith angles are reduced for the Earth's curvature."""
        return self.site.curvature_radius is not None or not isinstance(self.site, FlatSite)

    def upright(self, nodes: Index) -> Array:
        """Local axes (n, 3, 3) at nodes, rows east, north, up."""
        if not self.curved:
            return np.broadcast_to(np.eye(3), (len(nodes), 3, 3))
        return self.site.axes(np.nan_to_num(self.space(nodes)))

    def convergence(self, nodes: Index) -> Array:
        """Azimuth (n,) of local north in the frame's plan [rad]."""
        if not self.curved or len(nodes) == 0:
            return np.zeros(len(nodes))
        north = self.upright(nodes)[:, 1]
        out: Array = np.arctan2(north[:, 0], north[:, 1])
        return out

    def place_plan(self, nodes: Index, plan: Array) -> None:
        """Set unknown plan coordinates to the medians of what is proposed (n,), (n, 2)."""
        if len(nodes):
            keys, medians, _ = grouped_median(nodes, plan)
            self.plan[keys] = np.where(np.isnan(self.plan[keys]), medians, self.plan[keys])

    def place_up(self, nodes: Index, up: Array) -> None:
        """Set unknown heights to the medians of what is proposed (n,), (n,)."""
        if len(nodes):
            keys, medians, _ = grouped_median(nodes, up[:, None])
            self.up[keys] = np.where(np.isnan(self.up[keys]), medians[:, 0], self.up[keys])

    def place(self, nodes: Index, xyz: Array) -> None:
        """Set unknown coordinates to the medians of what is proposed (n,), (n, 3)."""
        self.place_plan(nodes, xyz[:, :2])
        self.place_up(nodes, self.heights(xyz))

    def flats(self) -> Array:
        """Horizontal lengths (n,) of the frame's lengths, NaN where heights are still missing."""
        flat = self.lengths.flat.copy()
        rows = np.flatnonzero(self._needs_up)
        if len(rows):
            a, b = self.lengths.start[rows], self.lengths.end[rows]
            rise = self.up[b] - self.up[a] + self.lengths.lift[rows]
            square = self.lengths.value[rows] ** 2 - rise**2
            dynamic = np.sqrt(np.maximum(square, 0.0))
            flat[rows] = np.where(self.relaxed & np.isnan(rise), self.lengths.value[rows], dynamic)
        return flat

    def pair_flats(self, a: Index, b: Index) -> Array:
        """Horizontal lengths (n,) between nodes, NaN where none was measured."""
        if len(self._pairs) == 0:
            return np.full(len(a), np.nan)
        stamp = int(np.isfinite(self.up).sum()) * 2 + self.relaxed if self._needs_up.any() else 0
        if stamp != self._seen:
            self._seen = stamp
            flat = self.flats()
            good = np.isfinite(flat)
            keys, medians, _ = grouped_median(self._pair_of_length[good], flat[good, None])
            self._flats[keys] = medians[:, 0]
        wanted = pair_key(a, b, self.ties.n_nodes)
        at = np.minimum(np.searchsorted(self._pairs, wanted), len(self._pairs) - 1)
        return np.where(self._pairs[at] == wanted, self._flats[at], np.nan)

    def azimuths(self, rays: Rays) -> Array:
        """Azimuths (n,) of rays in the frame's plan, NaN where the set is not oriented."""
        return wrap(self.orientation[rays.set] + rays.reading + self.convergence(rays.start))

    def prune(self) -> None:
        """Forget ties that can tell nothing more."""
        plan, up = self.known_plan, self.known_up
        r = self.rays
        done = plan[r.start] & plan[r.end] & np.isfinite(self.orientation[r.set])
        self.rays = r[~done]
        self.rises = self.rises[~(up[self.rises.start] & up[self.rises.end])]
        self.zeniths = self.zeniths[~(up[self.zeniths.start] & up[self.zeniths.end])]
        both = plan & up
        placed = np.isfinite(self.turn[:, 0, 0]) & both[self.ties.n_points : self.ties.n_positions]
        self.shots = self.shots[~(placed[self.shots.pose] & both[self.shots.target])]
