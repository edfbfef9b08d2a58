"""Fits what surfaces hold where they leave directions of a relative pose open.

Along a wall with equal windows, in a corridor, over a floor, one scan may be anywhere on a line or
in a plane. What can be said is how the scans lie on each other across it, and that must not depend
on where they came to rest: the sides of windows that were matched by chance are left out, and the
direction itself is measured. Normals of pieces of surface tell it to a tenth of a milliradian,
which is a millimetre after ten metres; so the scans are moved along it to either side, fitted anew
in what is held, and the line through both places is the direction. Its uncertainty, and the bend of
that line, are part of the covariance. Method section 2.11; metres and radians.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tribrach._types import Array
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import log, skew
from tribrach.registration.clouds.fine import (
    FINE,
    FineAlignment,
    Indexed,
    Matches,
    displaced,
    matched,
)
from tribrach.registration.clouds.relative_covariance import (
    RelativeCovariance,
    across,
    at_origin,
    relative_covariance,
)
from tribrach.statistics import chi2


@dataclass(frozen=True)
class OpenDirectionGates:
    """How what is held is fitted, and how open directions are measured (by hand: test_repeats)."""

    #: matches say where along an open direction if they hold it by more than this, and by more than
    #: so many sigmas of their normals
    holds: float = 0.05
    normal_sigmas: float = 3.0
    #: how far to either side the scans are moved [levers], the first that leaves this share of the
    #: matches, and the largest turn [rad]
    moved_levers: tuple[float, ...] = (2.0, 1.0, 0.5)
    matches_share: float = 0.5
    most_turn_rad: float = 0.3
    #: steps at one gate, the smallest step [m at the lever], and rounds of looking what is open
    steps: int = 8
    settled_m: float = 5e-6
    rounds: int = 3
    alpha: float = 0.001  #: probability that a straight way is called bent


GATES = OpenDirectionGates()


def fit_held(
    all_of: tuple[Indexed, Indexed],
    some_of: tuple[Indexed, Indexed],
    alignment: FineAlignment,
    precision: RelativeCovariance,
    floor: tuple[float, float],
) -> tuple[FineAlignment, RelativeCovariance]:
    """Fit the directions of a relative pose that surfaces hold, whatever the others are.

    ``some_of`` are some of all surfels, to measure the open directions with. ``floor`` holds sigmas
    [m], [rad] of what residuals never show.

    With the open direction u (unit, turns times the lever L), places y of the middle fitted after
    moves by +s and -s along it, and their covariances C across it, ``u = (y+ - y-) / |y+ - y-|``
    has the covariance ``(C+ + C-) / |y+ - y-|^2``, and a pose that is somewhere within L along u
    has across it ``C + L^2 (C+ + C-) / |y+ - y-|^2``. What the middle is off the line of both,
    ``b = -(y+ + y-) / 2``, is the bend of a way that is not straight; where it is beyond chance
    ``(L / s)^4 b b^T`` is added.
    """
    u, about = precision.unheld, (precision.middle, precision.lever)
    for _ in range(GATES.rounds):
        base = _fitted(*some_of, alignment.pose, u, about, alignment.gate)
        if len(base.matches) < FINE.fewest_matches:
            return alignment, precision
        found = relative_covariance(*some_of, base, (0.0, 0.0), sweep=False)
        if found.unheld.shape[1] <= u.shape[1]:
            break
        # what only the matches held that were left out is open as well
        u = _carried(found.unheld, (found.middle, found.lever), about)
    if u.shape[1] == 6:
        return alignment, precision
    held = across(u)
    own = _local(some_of, base, u, about)
    ways, loose = [], np.zeros((6, 6))
    for one in u.T:
        ends, far = _moved(some_of, base, one, u, about, alignment.gate)
        if min(len(end.matches) for end in ends) < FINE.fewest_matches:
            # too little is left after the moves to see the bend of the way
            return alignment, precision
        there = [_off(base.pose, e.pose, about) for e in ends]
        way = there[0] - there[1]
        length = float(np.linalg.norm(way))
        spread = sum(_local(some_of, e, u, about) for e in ends)
        ways.append(way / length)
        loose += (about[1] / length) ** 2 * spread
        bend = held.T @ (there[0] + there[1]) / 2
        chance = held.T @ (own + spread / 4) @ held
        if bend @ np.linalg.solve(chance, bend) > chi2.ppf(1 - GATES.alpha, held.shape[1]):
            bend = held @ bend * (about[1] / far) ** 2
            loose += np.outer(bend, bend)
    u, _ = np.linalg.qr(np.stack(ways, axis=1))
    fit = _fitted(*all_of, base.pose, u, about, alignment.gate)
    middle, lever = fit.matches.about
    out = relative_covariance(*all_of, fit, floor, unheld=_carried(u, about, (middle, lever)))
    scale = np.diag(np.repeat([1.0, 1 / about[1]], 3))
    move = _to_middle(about[0], middle) @ scale
    local = out.local + move @ loose @ move.T
    return fit, replace(out, local=local, covariance=at_origin(local, fit.pose, middle))


def slid_to(pose: Pose, prior: Pose, precision: RelativeCovariance) -> Pose:
    """The pose moved along its open directions to where an approximate pose has it."""
    u, about = precision.unheld, (precision.middle, precision.lever)
    return displaced(pose, u @ (u.T @ _off(pose, prior, about)), about)


def _moved(
    scans: tuple[Indexed, Indexed],
    base: FineAlignment,
    one: Array,
    u: Array,
    about: tuple[Array, float],
    gate: float,
) -> tuple[list[FineAlignment], float]:
    """Fits after moves to either side along an open direction, and how far they were [m]."""
    turn = float(np.linalg.norm(one[3:]))
    ends: list[FineAlignment] = []
    far = 0.0
    for levers in GATES.moved_levers:
        far = about[1] * min(levers, GATES.most_turn_rad / max(turn, 1e-9))
        ends = [
            _fitted(*scans, displaced(base.pose, side * far * one, about), u, about, gate)
            for side in (1.0, -1.0)
        ]
        if min(len(e.matches) for e in ends) >= GATES.matches_share * len(base.matches):
            break
    return ends, far


def _fitted(
    a: Indexed,
    b: Indexed,
    start: Pose,
    u: Array,
    about: tuple[Array, float],
    gate: float,
) -> FineAlignment:
    """A fit that moves nothing along open directions (6, k), of matches that do not hold them."""
    pose, held, settled = start, across(u), False
    for limit in (max(FINE.gates_m[1], gate), gate):
        for _ in range(GATES.steps):
            m = _indifferent(a, b, matched(a, b, pose, limit), u, about)
            if len(m) < FINE.fewest_matches:
                return FineAlignment(pose, m, gate, False)
            design = m.design(about) @ held
            weight = (1 - (m.residual / limit) ** 2) ** 2
            weight = weight / (m.sigma**2 + (limit / FINE.gate_sigmas) ** 2)
            normal = (design * weight[:, None]).T @ design
            step = -held @ np.linalg.lstsq(normal, design.T @ (weight * m.residual), rcond=None)[0]
            pose = displaced(pose, step, about)
            settled = bool(np.linalg.norm(step) < GATES.settled_m)
            if settled:
                break
    return FineAlignment(
        pose, _indifferent(a, b, matched(a, b, pose, gate), u, about), gate, settled
    )


def _indifferent(
    a: Indexed, b: Indexed, m: Matches, u: Array, about: tuple[Array, float]
) -> Matches:
    """Matches that do not say where along open directions (6, k) the scans are."""
    tilt = np.where(m.forward, a.surfels.sigma_normal[m.first], b.surfels.sigma_normal[m.second])
    far = np.linalg.norm(m.point - about[0], axis=1) / about[1]
    noise = GATES.normal_sigmas * tilt * np.hypot(1.0, far)
    along = np.linalg.norm(m.design(about) @ u, axis=1)
    return m.subset(along < np.hypot(GATES.holds, noise))


def _off(one: Pose, two: Pose, about: tuple[Array, float]) -> Array:
    """Shift of the middle and turn about it (6,) [m] from one pose to the other."""
    middle, lever = about
    shift = two @ (one.inverse @ middle) - middle
    return np.concatenate([shift, lever * log(two.rotation @ one.rotation.T)])


def _to_middle(one: Array, two: Array) -> Array:
    """From the shift of one place and a turn about it (6,) to those of another."""
    move = np.eye(6)
    move[:3, 3:] = -skew(two - one)
    return move


def _carried(u: Array, one: tuple[Array, float], two: tuple[Array, float]) -> Array:
    """The same directions (6, k) about another middle, with another lever."""
    scales = [np.diag(np.repeat([1.0, 1 / lever], 3)) for _, lever in (one, two)]
    moved = np.linalg.inv(scales[1]) @ _to_middle(one[0], two[0]) @ scales[0] @ u
    return np.asarray(np.linalg.qr(moved)[0])


def _local(
    scans: Sequence[Indexed], fit: FineAlignment, u: Array, about: tuple[Array, float]
) -> Array:
    """Covariance (6, 6) across open directions, of shifts of the middle and turns about it [m]."""
    own = fit.matches.about
    found = relative_covariance(
        scans[0], scans[1], fit, (0.0, 0.0), sweep=False, unheld=_carried(u, about, own)
    )
    scale = np.diag(np.repeat([1.0, about[1]], 3))
    move = scale @ _to_middle(own[0], about[0])
    held = across(u)
    move = held @ held.T @ move
    return np.asarray(move @ found.local @ move.T)
