"""Poses that may be right: moved to where they fit best, judged, doubles put together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import log
from tribrach.registration.clouds.fine import Indexed, align
from tribrach.registration.clouds.prepared import PreparedScan
from tribrach.registration.clouds.relative_covariance import relative_covariance
from tribrach.registration.clouds.surfels import Surfels
from tribrach.registration.clouds.verdict import Verdict, judge

__all__ = ["GIVEN", "Candidate", "apart", "judged", "refined"]

Array = NDArray[np.float64]

#: origin of approximate poses that were given
GIVEN = "approximate pose"
#: gates of the first and of the second look, in coarse surfels [sizes]
_FIRST, _SECOND = (4.0, 2.0, 1.0), (1.0, 0.5)
#: surfels that the first look takes
_FEW = 2500
#: poses nearer than this are one: shift [sizes], turn [rad]
_SHIFT, _TURN = 1.5, np.radians(3.0)
#: candidates that are looked at a second time, and the share of the best score that they need
_SECONDS, _OF_BEST = 6, 0.4
#: places to either side that are tried along an open direction, one size apart; how many of them
#: are kept, and how many sizes these are apart
_SLIDE, _SLID, _APART = 60, 3, 3
#: what is open is a shift if it has this share of shift or more; matches that tell
_SHIFT_SHARE, _MATCHES = 0.9, 50
#: agreement along normals [sizes]
_TOLERANCE = 0.4


@dataclass(frozen=True, eq=False)
class Candidate:
    """A pose of b in a with its verdict; origin : what proposed it."""

    pose: Pose
    verdict: Verdict
    origin: str


def judged(
    a: PreparedScan, b: PreparedScan, proposed: Iterable[tuple[Pose, str]]
) -> list[Candidate]:
    """The proposals that fit best and where else they fit along open directions, best first."""
    size = _size(a, b)
    few = Indexed.of(_some(a.coarse)), Indexed.of(_some(b.coarse))
    looked: list[Candidate] = []
    for pose, origin in proposed:
        if any(_same(c.pose, pose, size) for c in looked):
            continue
        moved = align(few[0], few[1], pose, [k * size for k in _FIRST], steps=3).pose
        if any(_same(c.pose, moved, size) for c in looked):
            continue
        looked.append(_candidate(a, b, moved, origin, size))
    looked.sort(key=lambda c: -c.verdict.score)
    least = _OF_BEST * looked[0].verdict.score if looked else 0.0
    good = [c for c in looked[:_SECONDS] if c.verdict.score >= least]
    # what the user gave is looked at in any case
    good += [c for c in looked[_SECONDS:] if c.origin == GIVEN]
    found = refined(a, b, good)
    slid = [place for c in found for place in _slid(a, b, few, c)]
    return refined(a, b, [*found, *slid]) if slid else found


def _slid(
    a: PreparedScan, b: PreparedScan, few: tuple[Indexed, Indexed], c: Candidate
) -> list[Candidate]:
    """Other places along a direction that surfaces leave open, where a candidate fits best.

    Along a wall, plans correlate as well in one place as in the next; only what stands before it
    tells where it is right, and who looked through that.
    """
    size = _size(a, b)
    found = align(few[0], few[1], c.pose, [_SECOND[-1] * size], steps=1)
    if len(found.matches) < _MATCHES:
        return []
    unheld = relative_covariance(few[0], few[1], found).unheld
    if unheld.shape[1] != 1 or np.linalg.norm(unheld[:3, 0]) < _SHIFT_SHARE:
        return []
    along = unheld[:3, 0] / np.linalg.norm(unheld[:3, 0])
    steps = size * np.arange(-_SLIDE, _SLIDE + 1)
    places = [Pose(c.pose.rotation, c.pose.translation + s * along) for s in steps]
    seen = (a.view, b.view)
    scores = np.array([judge(*few, seen, p, _TOLERANCE * size).score for p in places])
    out = []
    for _ in range(_SLID):
        best = int(np.argmax(scores))
        if scores[best] < _OF_BEST * c.verdict.score:
            break
        out.append(_candidate(a, b, places[best], c.origin, size))
        scores[max(best - _APART, 0) : best + _APART + 1] = -np.inf
    return out


def refined(a: PreparedScan, b: PreparedScan, some: Sequence[Candidate]) -> list[Candidate]:
    """Candidates with all coarse surfels, the best first, each only once."""
    size = _size(a, b)
    out: list[Candidate] = []
    for c in some:
        pose = align(a.coarse, b.coarse, c.pose, [k * size for k in _SECOND], steps=8).pose
        if not any(_same(other.pose, pose, 0.3 * size) for other in out):
            out.append(_candidate(a, b, pose, c.origin, size))
    return sorted(out, key=lambda c: -c.verdict.score)


def apart(one: Pose, two: Pose) -> tuple[float, float]:
    """Shift [m] and turn [rad] between two poses of b in a, at the scanner of b."""
    shift = float(np.linalg.norm(one.translation - two.translation))
    return shift, float(np.linalg.norm(log(one.rotation @ two.rotation.T)))


def _size(a: PreparedScan, b: PreparedScan) -> float:
    """Typical size of the coarse surfels [m]."""
    return float(max(np.median(x.coarse.surfels.size) for x in (a, b)))


def _some(indexed: Indexed) -> Surfels:
    """Some surfels, evenly."""
    s = indexed.surfels
    return s if len(s) <= _FEW else s.subset(np.linspace(0, len(s) - 1, _FEW).astype(np.int64))


def _same(one: Pose, two: Pose, size: float) -> bool:
    shift, turn = apart(one, two)
    return shift < _SHIFT * size and turn < _TURN


def _candidate(a: PreparedScan, b: PreparedScan, pose: Pose, origin: str, size: float) -> Candidate:
    """A judged pose."""
    verdict = judge(a.coarse, b.coarse, (a.view, b.view), pose, _TOLERANCE * size)
    return Candidate(pose, verdict, origin)
