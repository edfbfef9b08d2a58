"""Where places are told apart by nothing: no pose, or one whose open direction is said to be open.

Two stations before a facade of equal windows, in a corridor without ends and in one with equal
doors, a period apart or not, levelled or not. A pose wrong by a period is never called sure, and
errors of what is said to be held are as large as their covariance says.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from tests.registration.clouds.scenes import corridor, doors, scanned, windows
from tribrach._types import Array
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import log
from tribrach.registration.clouds import open_directions, pair
from tribrach.registration.clouds.pair import CloudPair, PairFit, register_pair
from tribrach.registration.clouds.prepared import PreparedScan
from tribrach.simulate.scene import Scene

NO_FLOOR = (0.0, 0.0)
#: reach of the scanner, ways along and across the world's x axis between stations [m]
PLACES = {"windows": (30.0, 6.0, 2.0), "corridor": (25.0, 5.0, 0.4), "doors": (25.0, 5.0, 0.4)}


def stations(name: str, seed: int, points: int) -> tuple[list[PreparedScan], list[Pose]]:
    """Two stations; every third time whole periods apart, every other time nobody levelled them."""
    rng = np.random.default_rng(seed)
    reach, along, across = PLACES[name]
    period = rng.uniform(2.0, 4.5)
    gap = rng.uniform(-along, along)
    if seed % 3 == 0:
        gap = period * round(gap / period)
    x = rng.uniform(-2, 2)
    places = [(at, rng.uniform(-across, across), rng.uniform(-np.pi, np.pi)) for at in (x, x + gap)]
    scene: Scene = {"windows": windows, "doors": doors}.get(name, lambda _: corridor())(period)
    tilt = 0.3 if seed % 2 else 0.0
    return scanned(scene, places, points=points, seed=seed, farthest=reach, tilt=tilt)


@dataclass(frozen=True)
class Outcome:
    """A pose against the truth.

    ``square`` is the squared error in what is held over its covariance, with ``freedom`` degrees of
    freedom; ``slid`` is how far the pose is from the truth along the world's x axis [m].
    """

    square: float
    freedom: int
    slid: float


def outcome(fit: PairFit, poses: list[Pose]) -> Outcome:
    true = poses[0].inverse @ poses[1]
    p = fit.precision
    scale = np.diag(np.repeat([1.0, p.lever], 3))
    off = scale @ np.concatenate(
        [fit.pose @ (true.inverse @ p.middle) - p.middle, log(fit.pose.rotation @ true.rotation.T)]
    )
    full, _ = np.linalg.qr(np.column_stack([p.unheld, np.eye(6)]))
    held: Array = full[:, p.unheld.shape[1] : 6]
    spread = held.T @ scale @ p.local @ scale @ held
    square = float(held.T @ off @ np.linalg.solve(spread, held.T @ off))
    along = poses[0].rotation.T @ [1.0, 0.0, 0.0]
    return Outcome(square, held.shape[1], float(abs(off[:3] @ along)))


def approximate(poses: list[Pose], seed: int) -> Pose:
    """The true pose with errors of 0.2 m, less than half a period."""
    true = poses[0].inverse @ poses[1]
    error = np.random.default_rng(seed).normal(0, 0.2, 3)
    return Pose(true.rotation, true.translation + error)


def judged(found: CloudPair, poses: list[Pose]) -> Outcome | None:
    """What was taken, None if nothing was; a pose that is wrong by a period is not called sure."""
    if found.fit is None:
        assert len(found.rivals) > 1
        assert found.rivals
        return None
    got = outcome(found.fit, poses)
    if found.fit.precision.rank == 6:
        assert got.slid < 0.1
    else:
        assert found.fit.precision.rank == 5
        (shift,) = found.fit.precision.unheld[:3].T
        assert abs(shift @ poses[0].rotation.T @ [1.0, 0.0, 0.0]) > 0.999
        assert any("does not hold a shift along" in text for text in found.sentences)
    return got


def test_a_direction_whose_bend_nothing_shows_stays_open(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a move along it leaves one match, what was known before is all that is known."""
    whole, calls = open_directions._moved, []

    def bare(*given: Any) -> Any:
        ends, far = whole(*given)
        calls.append(far)
        few = [replace(end, matches=end.matches.subset(one_of(end))) for end in ends]
        return few, far

    def one_of(end: Any) -> Any:
        return np.arange(len(end.matches)) == 0

    monkeypatch.setattr(open_directions, "_moved", bare)
    scans, poses = stations("windows", 1, 40_000)
    found = register_pair(*scans, floor=NO_FLOOR)
    assert calls
    if found.fit is not None:
        judged(found, poses)
        assert found.fit.precision.rank < 6


def test_a_facade_leaves_its_own_direction_open_alone() -> None:
    """The pose is a period off, and everything else about it is right."""
    scans, poses = stations("windows", 1, 40_000)
    found = register_pair(*scans, floor=NO_FLOOR)
    got = judged(found, poses)
    assert got is not None
    assert found.fit is not None
    assert got.freedom == 5
    assert got.slid > 1.0
    assert got.square < chi2.ppf(0.999, 5)


@pytest.mark.slow
@pytest.mark.parametrize("known", [False, True])
@pytest.mark.parametrize("name", list(PLACES))
def test_what_is_held_is_right_wherever_the_scans_came_to_rest(name: str, known: bool) -> None:
    """Twenty runs: none is surely wrong, and the joint chi-square of all that is held (99 %)."""
    total, freedom = 0.0, 0
    for seed in range(1, 21):
        scans, poses = stations(name, seed, 60_000)
        prior = approximate(poses, seed) if known else None
        got = judged(register_pair(*scans, prior, floor=NO_FLOOR), poses)
        if got is not None:
            total, freedom = total + got.square, freedom + got.freedom
            # an approximate pose decides which window or door it is; a bare corridor has none
            assert got.slid < 1.0 or not known or name == "corridor"
    # neighbours are taken to halve the number of observations at least, which may be too cautious
    assert freedom == 0 or chi2.ppf(0.005, freedom) / 2 < total < chi2.ppf(0.995, freedom)


def test_the_next_bay_is_among_the_places_that_are_tried() -> None:
    """A pose that is wrong by one window of a facade has the right one among its rivals."""
    scans, poses = scanned(windows(3.0), ((-2.0, 0.0, 0.3), (6.0, 1.0, 2.0)), points=100_000)
    true = poses[0].inverse @ poses[1]
    bay = poses[0].rotation.T @ np.array([3.0, 0.0, 0.0])
    wrong = Pose(true.rotation, true.translation + bay)
    size = pair._size(*scans)
    fit = pair._fitted(
        *scans, pair._candidate(*scans, wrong, pair.Origin.GIVEN, size), (1e-3, 5e-5)
    )
    assert fit is not None
    assert np.linalg.norm(fit.pose.translation - true.translation) > 2.0
    places = [place.pose.translation for place in pair._bays(*scans, fit)]
    assert min(np.linalg.norm(place - true.translation) for place in places) < 0.3
