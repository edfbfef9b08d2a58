"""Judges a relative pose: what agrees, what is seen through, and what has no counterpart.

Every surfel of either scan is looked up in the other: it agrees if a surfel with a like normal lies
there, it is seen through if the other scanner looked through its place, it is missed if something
else lies about there. Behind other surfaces and outside the view it says nothing. Areas in m^2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach.geometry.pose import Pose
from tribrach.registration.clouds.fine import Indexed
from tribrach.registration.clouds.prepared import AT_SURFACE, SEEN_THROUGH, RangeView


@dataclass(frozen=True)
class VerdictGates:
    """When surfels of one scan agree with another, and what that is worth (by hand: test_pair)."""

    #: what may lie nearer without being seen through [m], and per metre of range
    margin_m: float = 0.12
    margin_per_metre: float = 0.01
    alike_cosine: float = 0.85  #: agreeing normals [cosine]
    floor_cosine: float = 0.7  #: normals steeper than this cosine are those of floors
    #: weights of what is seen through and of what is missed against what agrees
    through_weight: float = 50.0
    missed_weight: float = 0.1
    #: sigmas of the number of pieces that chance may make of what is seen through
    chance_sigmas: float = 2.0


GATES = VerdictGates()


@dataclass(frozen=True)
class Verdict:
    """Areas that agree with a relative pose or contradict it, of both directions together."""

    agree: float  #: area that agrees [m^2]
    standing: float  #: part of it that is no floor and no ceiling, which agree anywhere [m^2]
    through: float  #: area that is seen through [m^2]
    missed: float  #: area where the other scan has something else [m^2]
    overlap: tuple[float, float]  #: share of a seen in b, and of b in a
    pieces: float  #: number of surfels that are seen through

    @property
    def surely_through(self) -> float:
        """Area that is seen through, less what chance makes of so few pieces (two sigmas) [m^2]."""
        doubt = GATES.chance_sigmas / float(np.sqrt(max(self.pieces, 1.0)))
        return self.through * max(1.0 - doubt, 0.0)

    @property
    def consistency(self) -> float:
        """Share of the judged area that agrees."""
        return self.agree / max(self.agree + self.through + self.missed, 1e-9)

    @property
    def score(self) -> float:
        """Evidence for the pose, with seen-through areas weighted more than agreeing ones [m^2].

        A wrong pose agrees in much that is alike everywhere (ground, parallel walls), but beams go
        through nothing of a right one, except what has moved.
        """
        return self.agree - GATES.through_weight * self.through - GATES.missed_weight * self.missed


def judge(
    a: Indexed, b: Indexed, views: tuple[RangeView, RangeView], pose: Pose, tolerance: float
) -> Verdict:
    """Judge a pose of scan b in scan a; surfels within a tolerance along normals agree [m]."""
    # what no scanner saw is coarser: beside what was seen it is no contradiction
    whole = not any(view.blind for view in views)
    one = _direction(a, b, views[0], pose, tolerance, whole)
    two = _direction(b, a, views[1], pose.inverse, tolerance, whole)
    totals = [float(x.surfels.area.sum()) for x in (a, b)]
    agree, standing, through, missed, pieces = (x + y for x, y in zip(one, two, strict=True))
    overlap = (two[0] / max(totals[0], 1e-9), one[0] / max(totals[1], 1e-9))
    return Verdict(agree, standing, through, missed, overlap, pieces)


def _direction(
    there: Indexed, here: Indexed, view: RangeView, pose: Pose, tolerance: float, whole: bool
) -> tuple[float, ...]:
    """Areas of ``here`` that agree, stand and agree, are seen through, are missed; pieces."""
    s, t = here.surfels, there.surfels
    points, normals = pose @ s.center, s.normal @ pose.rotation.T
    far, nearest = there.tree.query(np.ascontiguousarray(points), sqr_dists=False)
    nearest = nearest.astype(np.int64)
    off = np.abs(np.einsum("ni,ni->n", t.normal[nearest], points - t.center[nearest]))
    cosine = np.einsum("ni,ni->n", normals, t.normal[nearest])
    alike = s.facing(t, cosine) > GATES.alike_cosine
    near = far < np.hypot(tolerance, np.maximum(s.size, t.size[nearest]))
    agree = near & alike & (off < tolerance)
    ranges = np.linalg.norm(points, axis=1)
    seen = view.judge(points, GATES.margin_m + GATES.margin_per_metre * ranges + s.size)
    through = ~agree & (seen == SEEN_THROUGH)
    missed = ~agree & (seen == AT_SURFACE) & whole
    standing = agree & (np.abs(s.normal[:, 2]) < GATES.floor_cosine)
    flags = (agree, standing, through, missed)
    return (*(float(s.area[flag].sum()) for flag in flags), float(through.sum()))
