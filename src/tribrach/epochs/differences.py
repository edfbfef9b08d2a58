"""Two epochs of one network as differences of coordinates with their joint covariance.

Coordinates of an epoch hold in its own datum. What each network leaves open (shifts, turns, scale)
is no displacement: :func:`difference` turns the second epoch onto the first as far as the motions
are large, and hands the motions on, so that the test can take out what is left of them to first
order (method section 12.1).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from tribrach._types import Array, Index
from tribrach.errors import InputError
from tribrach.geometry.rotation import exp, skew

#: coordinates that are compared
Space = Literal["heights", "plan", "3D"]

#: motions of a whole network, in the order of its similarity generators
MOTIONS = (
    "shift in E",
    "shift in N",
    "shift in U",
    "rotation about E",
    "rotation about N",
    "rotation about U",
    "scale",
)
#: motions that move a network in plan, and in height
_OF_PLAN, _OF_HEIGHT = (0, 1, 5, 6), (2,)
#: iterations of the alignment; each squares the angle that is left
_TURNS = 8


@dataclass(frozen=True, eq=False)
class Epoch:
    """Adjusted coordinates of one epoch."""

    label: str  #: what the epoch is called
    names: tuple[str, ...]  #: of the n points
    xyz: Array  #: (n, 3), E, N, U [m]; NaN where the network has no such coordinate
    #: (3 n, 3 n), A priori, of all coordinates together [m^2]; zero where one is held
    covariance: Array
    motions: tuple[str, ...] = ()  #: those of :data:`MOTIONS` that the observations leave open
    dof: int = 0  #: redundancy of the adjustment; 0 where it is not known
    #: ``v^T P v / r``, the a-posteriori variance factor; NaN where it is not known
    factor: float = float("nan")

    def __post_init__(self) -> None:
        """Refuse arrays that do not fit and motions that are none."""
        n = len(self.names)
        if self.xyz.shape != (n, 3) or self.covariance.shape != (3 * n, 3 * n):
            raise InputError(
                f"epoch {self.label}: coordinates {self.xyz.shape} and covariance "
                f"{self.covariance.shape} do not fit {n} points"
            )
        strange = [m for m in self.motions if m not in MOTIONS]
        if strange:
            raise InputError(f"{strange[0]} is no motion", cure=f"give {', '.join(MOTIONS)}")


@dataclass(frozen=True, eq=False)
class Difference:
    """Changes between two epochs: second minus first."""

    labels: tuple[str, str]  #: of both epochs
    names: tuple[str, ...]  #: of the n points that both have
    xyz: Array  #: (n, 3), where they are, at the first epoch [m]
    axes: tuple[int, ...]  #: coordinates that are compared, of 0, 1, 2 for E, N, U
    values: Array  #: (n, d), differences [m]
    covariance: Array  #: (n d, n d), of all differences together, a priori [m^2]
    motions: tuple[str, ...]  #: what is taken out of them
    #: redundancy and variance factor of both together; 0 and NaN where they are not known
    dof: int = 0
    factor: float = float("nan")
    factors: tuple[float, float] = (float("nan"), float("nan"))
    dofs: tuple[int, int] = (0, 0)
    #: names that only one of both has
    alone: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())
    sentences: tuple[str, ...] = field(default=())

    def rows(self, points: Sequence[int] | Index) -> Index:
        """Rows (k d,) of the points (k,) among all differences."""
        d = len(self.axes)
        out: Index = (np.asarray(points, dtype=np.int64)[:, None] * d + np.arange(d)).ravel()
        return out

    @property
    def basis(self) -> Array:
        """The motions (n d, m) as columns; turns about the middle of the points."""
        return motion_columns(self.xyz, self.axes, self.motions)


def motion_columns(xyz: Array, axes: Sequence[int], motions: Sequence[str]) -> Array:
    """Displacements (n d, m) of points by unit motions of the whole, in the order of the names.

    Motions that move no coordinate that is compared are left out. Columns have the length of a
    shift of all points by a metre: turns and scale act at the mean distance from the middle.
    """
    n = len(xyz)
    out = _unit_motions(xyz, axes, motions)
    length = np.linalg.norm(out, axis=0)
    alive = length > 1e-9 * max(1.0, float(length.max(initial=0.0)))
    scaled: Array = out[:, alive] / length[alive] * np.sqrt(max(n, 1))
    return scaled


def motion_length(xyz: Array, axes: Sequence[int], motion: str) -> float:
    """How far [m] a unit of a motion moves the points, as a root mean square."""
    column = _unit_motions(xyz, axes, [motion])[:, 0]
    return float(np.linalg.norm(column) / np.sqrt(max(len(xyz), 1)))


def _unit_motions(xyz: Array, axes: Sequence[int], motions: Sequence[str]) -> Array:
    """Displacements (n d, m) by a metre, a radian, a unit of scale."""
    n = len(xyz)
    arm = np.nan_to_num(xyz - _middle(xyz))
    whole = np.zeros((n, 3, 7))
    whole[:, :, :3] = np.eye(3)
    whole[:, :, 3:6] = -skew(arm)
    whole[:, :, 6] = arm
    chosen = [MOTIONS.index(m) for m in motions]
    out: Array = whole[:, list(axes)][:, :, chosen].reshape(n * len(axes), len(chosen))
    return out


def laid_on(
    target: Array, xyz: Array, axes: tuple[int, ...], motions: tuple[str, ...], by: Array
) -> Array:
    """Coordinates (n, 3) moved as a whole by finite turns so that points ``by`` lie on others."""
    return _aligned(target, xyz, axes, motions, by)[0]


def _middle(xyz: Array) -> Array:
    """Mean (3,) of the coordinates that are known; zero where none is."""
    known = np.isfinite(xyz)
    total = np.where(known, xyz, 0.0).sum(axis=0)
    out: Array = total / np.maximum(known.sum(axis=0), 1)
    return out


def difference(
    first: Epoch,
    second: Epoch,
    *,
    space: Space | None = None,
    free: Collection[str] = (),
    points: Collection[str] | None = None,
    cross: Array | None = None,
    align_by: Collection[str] | None = None,
) -> Difference:
    """The differences of two epochs (method section 12.1).

    Compared are coordinates and points that both have, if not given. ``free`` are further motions
    that are taken out, as if the networks had left them open. ``cross`` is the covariance between
    both epochs, from control or instruments that they share; ``align_by`` names by which the second
    is turned onto the first.
    """
    strange = [m for m in free if m not in MOTIONS]
    if strange:
        raise InputError(f"{strange[0]!r} is no motion", cure=f"give {', '.join(MOTIONS)}")
    there = {name: k for k, name in enumerate(second.names)}
    rows = [k for k, name in enumerate(first.names) if name in there]
    if points is not None:
        rows = [k for k in rows if first.names[k] in set(points)]
    if not rows:
        raise InputError(
            f"{first.label} and {second.label} have no point in common",
            cure="name the same points alike in both epochs",
        )
    mates = [there[first.names[k]] for k in rows]
    axes = _axes(first.xyz[rows], second.xyz[mates], space, (first.label, second.label))
    known = np.isfinite(first.xyz[rows][:, axes]).all(1)
    known &= np.isfinite(second.xyz[mates][:, axes]).all(1)
    rows, mates = (list(np.asarray(k)[known]) for k in (rows, mates))
    names = tuple(first.names[k] for k in rows)
    open_ = set(first.motions) | set(second.motions) | set(free)
    motions = tuple(m for k, m in enumerate(MOTIONS) if m in open_ and _moves(k, axes))
    one, two = first.xyz[rows], second.xyz[mates]
    by = np.array([align_by is None or name in align_by for name in names])
    # a motion that is taken out by choice is small, and its size is of interest
    networks = set(first.motions) | set(second.motions)
    large = tuple(m for m in motions if m in networks)
    two, turn = _aligned(one, two, axes, large, by if by.any() else np.ones(len(by), bool))
    i, j = (_columns(k, axes) for k in (rows, mates))
    # the turn is that of the datum, exact; covariances turn with it
    turned = _turned(second.covariance, mates, turn, axes)
    total = first.covariance[np.ix_(i, i)] + turned
    if cross is not None:
        mixed = cross[np.ix_(i, j)]
        total = total - mixed - mixed.T
    dof, factor = _together(first, second)
    alone = tuple(tuple(n for n in epoch.names if n not in set(names)) for epoch in (first, second))
    return Difference(
        labels=(first.label, second.label),
        names=names,
        xyz=one,
        axes=axes,
        values=(two - one)[:, axes],
        covariance=(total + total.T) / 2,
        motions=motions,
        dof=dof,
        factor=factor,
        factors=(first.factor, second.factor),
        dofs=(first.dof, second.dof),
        alone=(alone[0], alone[1]),
    )


def _axes(one: Array, two: Array, space: Space | None, labels: tuple[str, str]) -> tuple[int, ...]:
    """The coordinates that are compared."""
    both = np.isfinite(one) & np.isfinite(two)
    if space is None:
        # what half of the common points have is what the epochs are about
        axes = tuple(int(k) for k in np.flatnonzero(both.mean(axis=0) >= 0.5))
        if 0 in axes and 1 in axes:
            return axes
        if 2 in axes:
            return (2,)
        raise InputError(
            f"{labels[0]} and {labels[1]} have no coordinates in common",
            cure="give epochs in plan, in height or in space",
        )
    if space not in get_args(Space):
        raise InputError(f"{space!r} is no space", cure="give heights, plan or 3D")
    axes = {"heights": (2,), "plan": (0, 1), "3D": (0, 1, 2)}[space]
    if not both[:, axes].all(axis=1).any():
        raise InputError(
            f"no point of {labels[0]} and {labels[1]} has what {space} needs in both",
            cure="compare what they have: heights, plan or 3D",
        )
    return axes


def _moves(motion: int, axes: tuple[int, ...]) -> bool:
    """Does a motion move any of these coordinates of a network that is about level?"""
    plan, height = 0 in axes, 2 in axes
    if motion in _OF_PLAN and plan:
        return True
    if motion in _OF_HEIGHT or motion in (3, 4):
        return height
    return motion == 6 and height and plan


def _columns(points: Sequence[int], axes: tuple[int, ...]) -> Index:
    """Columns of the coordinates of points among three for each."""
    out: Index = (np.asarray(points, dtype=np.int64)[:, None] * 3 + np.asarray(axes)).ravel()
    return out


def _turned(covariance: Array, points: Sequence[int], turn: Array, axes: tuple[int, ...]) -> Array:
    """The covariance of points in turned axes."""
    columns = _columns(points, (0, 1, 2))
    part = covariance[np.ix_(columns, columns)]
    n = len(points)
    blocks = np.einsum("ab,ibjc,dc->iajd", turn, part.reshape(n, 3, n, 3), turn)
    k = len(axes)
    chosen: Array = blocks[:, axes][:, :, :, axes].reshape(n * k, n * k)
    return chosen


def _aligned(
    one: Array, two: Array, axes: tuple[int, ...], motions: tuple[str, ...], by: Array
) -> tuple[Array, Array]:
    """The second epoch on the first by the motions, and the turn (3, 3) with scale of it."""
    turn = np.eye(3)
    if not motions:
        return two, turn
    centre = _middle(one)
    for _ in range(_TURNS):
        chosen = [MOTIONS.index(m) for m in motions]
        arm = np.nan_to_num(two - centre)
        whole = np.zeros((len(two), 3, 7))
        whole[:, :, :3], whole[:, :, 3:6], whole[:, :, 6] = np.eye(3), -skew(arm), arm
        a = whole[:, axes][:, :, chosen][by].reshape(-1, len(chosen))
        b = (one - two)[:, axes][by].ravel()
        size = np.linalg.norm(a, axis=0)
        size[size == 0] = 1.0
        t = np.zeros(7)
        t[chosen] = np.linalg.lstsq(a / size, b, rcond=1e-9)[0] / size
        step = np.exp(t[6]) * exp(t[3:6])
        flat = np.where(np.isnan(two), 0.0, two - centre)
        moved = flat @ step.T + centre + t[:3]
        two = np.where(np.isnan(two), np.nan, moved)
        turn = step @ turn
        if np.abs(t[3:]).max() < 1e-12 and np.abs(t[:3]).max() < 1e-9:
            break
    return two, turn


def _together(first: Epoch, second: Epoch) -> tuple[int, float]:
    """Redundancy and variance factor of both epochs; 0 and NaN if one is not known."""
    parts = [(e.dof, e.factor) for e in (first, second)]
    if any(dof <= 0 or not np.isfinite(factor) for dof, factor in parts):
        return 0, float("nan")
    dof = sum(d for d, _ in parts)
    return dof, float(sum(d * f for d, f in parts) / dof)
