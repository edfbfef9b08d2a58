"""Quantities computed from points of a cloud, each with the sigma that it has.

Of a quantity with the gradients ``g_i`` by its points the variance is

    sum g_i^T B_i g_i  +  (sum J_i^T g_i)^T S (sum J_i^T g_i)  +  what systematic angles add

(method section 5.10): the first part falls with the number of points, the second never does.
Means, distances, areas and volumes bring their gradients with them; ``propagate`` takes those of
any other quantity. Points may be of one scan, of several, or of several results, which share
nothing; a point that comes in several times is one observation. Metres.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from tribrach._types import Array, Index, Mask
from tribrach.cloud.distinct_points import distinct_points
from tribrach.cloud.shared_part import CloudPoints, SharedPart, angle_slopes
from tribrach.errors import InputError
from tribrach.statistics import norm

#: points, or several sets of them
Patch = CloudPoints | Sequence[CloudPoints]

#: a set of points is no plane if its second extent is smaller than this share of its first
_THIN = 1e-3
#: parts of a sigma that are rounding
_ROUNDING = 1e-9
#: cells of a volume, at most
_MOST_CELLS = 50_000_000
#: points of a cell that has a plane of its own, and the share of its side by which they scatter
#: at least, across the direction in which they scatter most
_PLANE, _SPREAD = 6, 0.1


@dataclass(frozen=True, repr=False)
class PointQuantity:
    """A number computed from points, with its variance in parts."""

    value: float  #: in metres, or square or cubic metres
    own: float  #: variance of what is new with every point: more points make it smaller
    shared: float  #: variance of what points share: no number of points makes it smaller
    systematic: float = 0.0  #: largest variance that the systematic part of the angles can add
    unit: str = "m"  #: of the value

    @property
    def variance(self) -> float:
        """Sum of the parts."""
        return self.own + self.shared + self.systematic

    @property
    def sigma(self) -> float:
        """Standard deviation, in the unit of the value."""
        return float(np.sqrt(max(self.variance, 0.0)))

    @property
    def floor(self) -> float:
        """Standard deviation that remains however many points there are."""
        return float(np.sqrt(max(self.shared + self.systematic, 0.0)))

    def interval(self, confidence: float = 0.95) -> tuple[float, float]:
        """Limits that hold the true value with a probability."""
        if not 0 < confidence < 1:
            raise InputError(
                f"the confidence is {confidence:g}, which is not between 0 and 1",
                cure="give a probability such as 0.95",
            )
        reach = float(norm.ppf(0.5 * (1 + confidence))) * self.sigma
        return self.value - reach, self.value + reach

    def __repr__(self) -> str:
        least = (_ROUNDING * self.sigma) ** 2
        own, shared, angles = (
            float(np.sqrt(part)) if part > least else 0.0
            for part in (self.own, self.shared, self.systematic)
        )
        parts = f"own {own:.3g}, shared {shared:.3g}" + (f", angles {angles:.3g}" if angles else "")
        return f"<{self.value:.6g} {self.unit}, sigma {self.sigma:.3g} ({parts})>"


@dataclass(frozen=True, repr=False)
class Volume(PointQuantity):
    """A volume between two surfaces."""

    area: float = 0.0  #: of the cells that both surfaces have points in [m^2]
    #: those cells, and those that only one surface has points in
    cells: int = 0
    left_out: int = 0
    #: the part of ``own`` that comes from the surfaces themselves [m^6]: how their points scatter
    #: about the plane of each cell beyond their noise
    sampling: float = 0.0
    #: cells that count in full although a neighbour is left out or empty: the edge of the volume
    #: runs through them
    border: int = 0


@dataclass(frozen=True, eq=False, repr=False)
class PointVector:
    """A place or a difference of two places, with its covariance in parts."""

    value: Array  #: (3,): along the axes of the frame [m]
    #: (3, 3): as in :class:`PointQuantity` [m^2]
    own: Array
    shared: Array
    systematic: Array

    @property
    def covariance(self) -> Array:
        """Sum of the parts (3, 3) [m^2]."""
        return self.own + self.shared + self.systematic

    @property
    def sigma(self) -> Array:
        """Standard deviations (3,) [m]."""
        out: Array = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        return out

    def along(self, direction: ArrayLike) -> PointQuantity:
        """The component along a direction."""
        given = np.array(direction, dtype=float)
        size = float(np.linalg.norm(given))
        if given.shape != (3,) or not 0 < size < np.inf:
            raise InputError("a direction has three components that are not all zero")
        unit = given / size
        own, shared, angles = (
            float(unit @ part @ unit) for part in (self.own, self.shared, self.systematic)
        )
        return PointQuantity(float(unit @ self.value), own, shared, angles)

    @property
    def length(self) -> PointQuantity:
        """The distance [m], refused where it is zero: its sigma has no direction then."""
        if not self.value.any():
            raise InputError(
                "a distance of zero has no direction that its sigma could be along",
                cure="take the component along a direction",
            )
        return self.along(self.value)

    def __repr__(self) -> str:
        place = " ".join(f"{x:.4f}" for x in self.value)
        sigma = " ".join(f"{1e3 * s:.2f}" for s in self.sigma)
        return f"<{place} m, sigma {sigma} mm>"


def propagate(
    points: Patch, gradients: ArrayLike | Sequence[ArrayLike], value: float, unit: str = "m"
) -> PointQuantity:
    """Give a quantity that was computed from points the variance that it has.

    Parameters
    ----------
    points : CloudPoints or sequence of them
        The points.
    gradients : array_like (n, 3) or sequence of them
        Derivatives of the quantity by the coordinates of each point, set by set.
    value : float
        The quantity.
    unit : str
        Of the quantity.

    Returns
    -------
    PointQuantity
        Of systematic angles it has the largest variance of all correlations from 0 to 1.

    Raises
    ------
    InputError
        Gradients that are not one for each point.

    References
    ----------
    Method section 5.10.

    Examples
    --------
    >>> from tribrach.cloud.placement import Placement
    >>> from tribrach.geometry.pose import Pose
    >>> from tribrach.instruments.scan_noise import ScanNoise
    >>> pose = Pose(np.eye(3), np.zeros(3))
    >>> where = Placement("S1", pose, np.diag([1e-6] * 3 + [0.0] * 3), ScanNoise(0.002, 0, 0, 0))
    >>> shared = SharedPart({"S1": where}, {"S1": np.arange(6)}, where.covariance, ("S1",))
    >>> height = np.linspace(-0.01, 0.01, 400)
    >>> wall = shared.points(np.stack([0 * height + 10, 0 * height, height], axis=1), "S1")
    >>> propagate(wall, np.tile([1 / 400, 0, 0], (400, 1)), 10.0)
    <10 m, sigma 0.001 (own 0.0001, shared 0.001)>
    """
    sets = _sets(points)
    given = [gradients] if isinstance(points, CloudPoints) else list(gradients)  # type: ignore[arg-type]
    slopes = [np.array(g, dtype=float, ndmin=2) for g in given]
    if [g.shape for g in slopes] != [one.xyz.shape for one in sets]:
        raise InputError(
            "the gradients are not one for each point", cure="give an array (n, 3) for each set"
        )
    sets, slopes = distinct_points(sets, slopes)
    own, shared = _variances(sets, [g[:, None, :] for g in slopes])
    return PointQuantity(
        float(value), float(own[0, 0]), float(shared[0, 0]), _angle_bound(sets, slopes), unit
    )


def mean_of(points: Patch) -> PointVector:
    """Compute the mean place of points.

    Parameters
    ----------
    points : CloudPoints or sequence of them
        The points, all with one weight.

    Returns
    -------
    PointVector
        Its covariance is never below what the points share.

    References
    ----------
    Method section 5.10.
    """
    sets = _sets(points)
    total = sum(len(one) for one in sets)
    return _weighted(sets, [np.full(len(one), 1 / total) for one in sets])


def relative(first: Patch, second: Patch) -> PointVector:
    """Compute the mean place of points relative to that of others: second less first.

    Parameters
    ----------
    first, second : CloudPoints or sequence of them
        Single points or sets of them.

    Returns
    -------
    PointVector
        ``.length`` is the distance, ``.along(direction)`` a component. What moves both alike has
        cancelled.

    References
    ----------
    Method section 5.10.
    """
    one, two = _sets(first), _sets(second)
    weights = [np.full(len(p), -1 / sum(map(len, one))) for p in one]
    weights += [np.full(len(p), 1 / sum(map(len, two))) for p in two]
    return _weighted([*one, *two], weights)


def plane_distance(first: Patch, second: Patch) -> PointQuantity:
    """Compute how far the middle of one flat set of points is from the plane of another.

    Parameters
    ----------
    first : CloudPoints or sequence of them
        The points whose plane it is.
    second : CloudPoints or sequence of them
        The points whose middle it is.

    Returns
    -------
    PointQuantity
        Positive; what the points leave uncertain of the plane's direction is in the sigma.

    Raises
    ------
    InputError
        The first points lie on a line.

    References
    ----------
    Method section 5.10.
    """
    one, two = _sets(first), _sets(second)
    xyz = np.concatenate([p.xyz for p in one])
    other = np.concatenate([p.xyz for p in two]).mean(axis=0)
    middle = xyz.mean(axis=0)
    apart = xyz - middle
    squares, axes = np.linalg.eigh(apart.T @ apart)
    if len(xyz) < 3 or not squares[1] > _THIN**2 * squares[2]:
        raise InputError("the points of a plane lie on a line", cure="give points of a surface")
    normal = axes[:, 0] * (1.0 if axes[:, 0] @ (other - middle) >= 0 else -1.0)
    # the normal turns by -sum_k e_k sum_i (u_ki n + r_i e_k) dx_i / (l_k - l_0)
    lean = axes[:, 1:].T @ (other - middle) / (squares[1:] - squares[0])
    weights = -1 / len(xyz) - apart @ axes[:, 1:] @ lean
    every = weights[:, None] * normal - (apart @ normal)[:, None] * (axes[:, 1:] @ lean)
    gradients = np.split(every, np.cumsum([len(p) for p in one])[:-1])
    gradients += [np.tile(normal / sum(map(len, two)), (len(p), 1)) for p in two]
    return propagate([*one, *two], gradients, float(normal @ (other - middle)))


def area_of(corners: Patch) -> PointQuantity:
    """Compute the area of a plane polygon.

    Parameters
    ----------
    corners : CloudPoints or sequence of them
        The corners in their order: the points of one set, or the means of several sets.

    Returns
    -------
    PointQuantity
        In square metres.

    Raises
    ------
    InputError
        Fewer than three corners, or no area.

    References
    ----------
    Method section 5.10.
    """
    sets = _sets(corners)
    alone = len(sets) == 1
    places = sets[0].xyz if alone else np.array([one.xyz.mean(axis=0) for one in sets])
    if len(places) < 3:
        raise InputError(f"a polygon has three corners or more, not {len(places)}")
    before, after = np.roll(places, 1, axis=0), np.roll(places, -1, axis=0)
    apart = places - places[0]
    vector = 0.5 * np.cross(apart, np.roll(apart, -1, axis=0)).sum(axis=0)
    area = float(np.linalg.norm(vector))
    if not area > 0:
        raise InputError("the corners of a polygon enclose no area", cure="give them in order")
    by_corner = 0.5 * np.cross(after - before, vector / area)
    gradients = (
        [by_corner]
        if alone
        else [np.tile(g / len(p), (len(p), 1)) for g, p in zip(by_corner, sets, strict=True)]
    )
    return propagate(sets, gradients, area, "m2")


def volume_between(
    first: Patch, second: Patch, cell: float, direction: ArrayLike = (0.0, 0.0, 1.0)
) -> Volume:
    """Compute the volume between two surfaces by cells: second above first counts as positive.

    Parameters
    ----------
    first, second : CloudPoints or sequence of them
        Points of both surfaces.
    cell : float
        Side of the cells [m]; in each the planes of both surfaces are compared at its centre.
    direction : array_like (3,)
        Along which heights are counted; upwards if not given.

    Returns
    -------
    Volume
        In cubic metres, over the cells that both surfaces have points in.

    Raises
    ------
    InputError
        A cell or a direction that is none, too many cells, no cell with points of both.

    References
    ----------
    Method section 5.10.
    """
    up = np.array(direction, dtype=float)
    size = float(np.linalg.norm(up)) if up.shape == (3,) else 0.0
    if not (0 < size < np.inf and 0 < cell < np.inf):
        raise InputError("a volume needs a direction and a side of its cells above zero")
    up /= size
    sides = _sets(first), _sets(second)
    every = [np.concatenate([one.xyz for one in side]) for side in sides]
    across = np.linalg.svd(up[None])[2][1:]
    # the cells hold still whatever point comes first
    origin = np.floor(every[0][0] @ across.T / cell) * cell @ across + every[0][0] @ up * up
    flat = [np.floor((xyz - origin) @ across.T / cell).astype(np.int64) for xyz in every]
    low = np.minimum(*(f.min(axis=0) for f in flat))
    width = np.maximum(*(f.max(axis=0) for f in flat)) - low + 1
    if float(width[0]) * float(width[1]) > _MOST_CELLS:
        raise InputError(
            f"the surfaces have {width[0]} by {width[1]} cells", cure="give larger cells"
        )
    shape = (int(width[0]), int(width[1]))
    numbers = [(f[:, 0] - low[0]) * shape[1] + f[:, 1] - low[1] for f in flat]
    counts = [np.bincount(n, minlength=shape[0] * shape[1]) for n in numbers]
    both = np.minimum(*counts) > 0
    if not both.any():
        raise InputError(
            "no cell has points of both surfaces", cure="give larger cells, or surfaces that meet"
        )
    value, gradients, sampled = 0.0, [], []
    for sign, side, n, xyz in zip((-1, 1), sides, numbers, every, strict=True):
        own = np.concatenate([one.own() for one in side])
        centred = (xyz - origin) @ np.vstack([across, up]).T
        planes = _CellPlanes(centred, n, shape, low, cell, both)
        weight = sign * cell**2 * planes.weights
        value += float(weight @ centred[:, 2])
        along = up - planes.slopes @ across
        spread = planes.excess(np.einsum("ni,nij,nj->n", along, own, along), weight)
        parts = np.cumsum([len(p) for p in side])[:-1]
        # an error across moves a slanted surface up or down as well
        by_point = weight[:, None] * up + sign * cell**2 * planes.across @ across
        gradients += np.split(by_point, parts)
        sampled += np.split(weight * np.sqrt(spread), parts)
    found = propagate([*sides[0], *sides[1]], gradients, value, "m3")
    # the same points in both surfaces sample nothing
    _, alone = distinct_points([*sides[0], *sides[1]], sampled)
    sampling = float(sum(part @ part for part in alone))
    cells = int(both.sum())
    return Volume(
        value, found.own + sampling, found.shared, found.systematic, "m3",
        cell**2 * cells, cells, int((np.maximum(*counts) > 0).sum()) - cells, sampling,
        int(_at_border(both.reshape(shape)).sum()),
    )  # fmt: skip


def _at_border(inside: Mask) -> Mask:
    """Cells (a, b) inside that have one of their eight neighbours outside."""
    padded = np.pad(inside, 1)
    whole = inside.copy()
    for i, j in product(range(3), range(3)):
        whole &= padded[i : i + inside.shape[0], j : j + inside.shape[1]]
    out: Mask = inside & ~whole
    return out


class _CellPlanes:
    """The planes of one surface in the cells of a volume.

    A cell takes the slope of its own points; where those are few or in a line, that of the points
    of the cells around it, or of the whole surface. Its height is that of the plane at its centre.
    """

    def __init__(
        self, points: Array, number: Index, shape: tuple[int, int], low: Index, cell: float,
        use: Mask,
    ) -> None:  # fmt: skip
        """Planes of points (n, 3), two coordinates across and one up, in numbered cells."""
        self._number, self._use, size = number, use, shape[0] * shape[1]
        count = np.bincount(number, minlength=size)
        self._count = np.maximum(count, 1)
        mean = np.stack([self._sum(x) for x in points.T], axis=1) / self._count[:, None]
        apart = points - mean[number]
        pairs = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2))
        moments = np.stack([self._sum(apart[:, i] * apart[:, j]) for i, j in pairs])
        centre = (np.stack(np.divmod(np.arange(size), shape[1]), axis=1) + low + 0.5) * cell
        lever = mean[:, :2] - centre
        slope, at, self._free = np.zeros((size, 2)), mean.copy(), np.maximum(count - 1.0, 0.0)
        # what each point counts for in the sum of the heights of all cells in use
        self.weights = np.where(use, 1 / self._count, 0.0)[number]
        # what the sum changes by as a point moves across
        self.across = np.zeros((len(points), 2))
        waiting = (count > 0) & use
        for reach in (0, 1, max(shape)):
            if not waiting.any():
                break
            n, middle, squares = _blocks(count, mean, moments, shape, reach)
            matrix = squares[:4].T.reshape(-1, 2, 2)
            good = waiting & (n >= _PLANE)
            good[good] = np.linalg.eigvalsh(matrix[good])[:, 0] > (cell * _SPREAD) ** 2 * n[good]
            if not good.any():
                continue
            inverse = np.linalg.inv(matrix[good])
            slope[good] = np.einsum("nij,jn->ni", inverse, squares[4:, good])
            at[good] = middle[good]
            self._free[good] = count[good] * (1 - 3 / n[good])
            # the height at the centre is the mean less slope times lever; a point takes part in
            # the slopes of all cells that it is around
            turn = -np.einsum("nij,nj->in", inverse, lever[good])
            lean, (mx, my, mz) = slope[good].T, middle[good].T
            level, zero = turn[0] * mx + turn[1] * my, mz - lean[0] * mx - lean[1] * my
            parts = np.zeros((11, size))
            parts[:, good] = [*turn, level, *(a * b for a in lean for b in turn),
                              *(lean * level), *(turn * zero)]  # fmt: skip
            t0, t1, level, k00, k01, k10, k11, *rest = _boxes(
                parts.reshape(11, *shape), reach
            ).reshape(11, -1)[:, number]
            x, y, z = points.T
            self.weights += x * t0 + y * t1 - level
            # of the errors across: what they do to the plane, and to its slope by way of residuals
            self.across[:, 0] += z * t0 - 2 * x * k00 - y * (k01 + k10) + rest[0] - rest[2]
            self.across[:, 1] += z * t1 - 2 * y * k11 - x * (k01 + k10) + rest[1] - rest[3]
            waiting &= ~good
        self.slopes = slope[number]
        self.across -= np.where(use, 1 / self._count, 0.0)[number, None] * self.slopes
        off = points - at[number]
        self._left = off[:, 2] - np.einsum("ni,ni->n", self.slopes, off[:, :2])

    def _sum(self, values: Array) -> Array:
        """Sums (cells,) of values (n,) of the points."""
        return np.bincount(self._number, values, minlength=len(self._use)).astype(float)

    def excess(self, noise: Array, weight: Array) -> Array:
        """What scatter has beyond the noise (n,) [m^2] of the points, never below zero in sum."""
        free = np.where(self._free > 0, self._free, np.nan)
        cell = self._sum(self._left**2) / free - self._sum(noise) / self._count
        known = np.isfinite(cell) & self._use
        if not known.any():
            return np.zeros(len(noise))
        every = np.where(known, cell, np.median(cell[known]))[self._number]
        above = np.maximum(every, 0.0)
        total, most = float(weight**2 @ every), float(weight**2 @ above)
        return above * (total / most) if total > 0 else np.zeros(len(noise))


def _boxes(grid: Array, reach: int) -> Array:
    """Sums of a grid (k, a, b) over the cells around each cell, itself included."""
    for axis in (1, 2) if reach else ():
        length = grid.shape[axis]
        nothing = np.zeros_like(np.take(grid, [0], axis))
        summed = np.concatenate([nothing, np.cumsum(grid, axis)], axis)
        i = np.arange(length)
        ends = np.minimum(i + reach + 1, length), np.maximum(i - reach, 0)
        grid = np.take(summed, ends[0], axis) - np.take(summed, ends[1], axis)
    return grid


def _blocks(
    count: Index, mean: Array, moments: Array, shape: tuple[int, int], reach: int
) -> tuple[Array, Array, Array]:
    """Points, mean (cells, 3) and xx, xy, xy, yy, xz, yz about it (6, cells) around each cell."""
    if reach == 0:
        return count.astype(float), mean, moments[[0, 1, 1, 2, 3, 4]]
    filled = count > 0
    origin = mean[filled].mean(axis=0)
    x, y, z = np.where(filled[:, None], mean - origin, 0.0).T
    sums = [count, count * x, count * y, count * z]
    sums += list(moments + count * np.stack([x * x, x * y, y * y, x * z, y * z]))
    n, *rest = _boxes(np.stack(sums).reshape(9, *shape), reach).reshape(9, -1)
    sx, sy, sz, xx, xy, yy, xz, yz = rest
    m = np.maximum(n, 1)
    middle = np.stack([sx, sy, sz], axis=1) / m[:, None] + origin
    xy = xy - sx * sy / m
    squares = [xx - sx * sx / m, xy, xy, yy - sy * sy / m, xz - sx * sz / m, yz - sy * sz / m]
    return n, middle, np.stack(squares)


def _sets(points: Patch) -> list[CloudPoints]:
    """One set or several, at least one."""
    single = isinstance(points, CloudPoints) or not isinstance(points, Iterable)
    sets: list[CloudPoints] = [points] if single else list(points)  # type: ignore[list-item,arg-type]
    if not sets:
        raise InputError("there are no points", cure="give one set of points or more")
    for one in sets:
        if not isinstance(one, CloudPoints):
            raise InputError(
                f"a {type(one).__name__} does not say of which scan its points are, so that they "
                "have no sigma",
                cure="give what cloud_points(file) or SharedPart.points(xyz, scan) returns, or a "
                "list of such sets",
            )
    return sets


def _variances(sets: Sequence[CloudPoints], gradients: Sequence[Array]) -> tuple[Array, Array]:
    """Own and shared covariance (m, m) of m quantities with gradients (n, m, 3) by each set."""
    m = gradients[0].shape[1]
    own, shared = np.zeros((m, m)), np.zeros((m, m))
    carried: dict[bytes, tuple[SharedPart, Array]] = {}
    for one, g in zip(sets, gradients, strict=True):
        alone, moved = one.carried(g)
        own += alone
        known = carried.get(one.shared.identity)
        carried[one.shared.identity] = one.shared, moved if known is None else known[1] + moved
    for part, total in carried.values():
        shared += total @ part.covariance @ total.T
    return own, shared


def _weighted(sets: Sequence[CloudPoints], weights: Sequence[Array]) -> PointVector:
    """A sum of weighted places with its covariance."""
    origin = sets[0].xyz[0]
    total = sum(float(w.sum()) for w in weights)
    value = sum(w @ (one.xyz - origin) for w, one in zip(weights, sets, strict=True))
    sets, weights = distinct_points(sets, weights)
    gradients = [w[:, None, None] * np.eye(3) for w in weights]
    own, shared = _variances(sets, gradients)
    return PointVector(
        np.asarray(value + total * origin), own, shared, _angle_covariance(sets, weights)
    )


def _stations(sets: Sequence[CloudPoints]) -> list[tuple[bytes, str]]:
    """The station of each set, those of other results apart."""
    return [(one.shared.identity, one.placement.station) for one in sets]


def _angle_bound(sets: Sequence[CloudPoints], gradients: Sequence[Array]) -> float:
    """Largest variance of systematic angles whose errors have any correlation from 0 to 1.

    Terms of one sign count as one error, those of either sign as independent: no correlation
    between 0 and 1 gives more. Both angles, and different stations, are independent.
    """
    sums: dict[tuple[bytes, str], Array] = {}
    for whose, one, g in zip(_stations(sets), sets, gradients, strict=True):
        moved = np.einsum("ni,nik->nk", g, angle_slopes(one.xyz, one.placement))
        signs = np.stack([np.maximum(moved, 0).sum(axis=0), np.minimum(moved, 0).sum(axis=0)])
        sums[whose] = sums.get(whose, 0.0) + signs
    return float(sum((both**2).sum() for both in sums.values()))


def _angle_covariance(sets: Sequence[CloudPoints], weights: Sequence[Array]) -> Array:
    """The same for a sum of weighted places: no direction has a larger variance than it says.

    With a_i what the angle does to a place, ``(sum |c a_i|)^2 <= sum |a_i| sum (c a_i)^2 / |a_i|``
    for every direction c; the bound is reached where all a_i are parallel.
    """
    sums: dict[tuple[bytes, str, bool, int], tuple[float, Array]] = {}
    for whose, one, w in zip(_stations(sets), sets, weights, strict=True):
        moved = w[:, None, None] * angle_slopes(one.xyz, one.placement)
        for angle, positive in product(range(2), (False, True)):
            a = moved[:, :, angle]
            size = np.linalg.norm(a, axis=1)
            some = (size > 0) & ((w > 0) == positive)
            if not some.any():
                continue
            key = (*whose, positive, angle)
            length, square = sums.get(key, (0.0, np.zeros((3, 3))))
            square = square + (a[some] / size[some, None]).T @ a[some]
            sums[key] = length + float(size[some].sum()), square
    total = np.zeros((3, 3))
    for length, square in sums.values():
        total += length * square
    return total
