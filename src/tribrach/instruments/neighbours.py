"""What neighbouring points of a scan share of their range errors, and how many count as one.

Beams that overlap see partly the same surface through partly the same light, and some scanners
smooth their ranges along the lines. Two points at the distance s from each other, seen from the
scanner as s / rho, have ranges with the correlation (method section 5.7)

    r(s) = share o(s / w),    o(u) = 2/pi (acos u - u sqrt(1 - u^2)),    r(0) = 1

o being the common share of two discs of diameter w at the distance s. ``share`` is a property of
the instrument, 0 for noise that is new with every pulse and 1 for noise that is all of the surface;
w is the beam's diameter unless another was estimated. The mean of n points on a lattice then has
the variance ``sigma^2 f / n`` with ``f = 1 - share + share F``, F being the sum of o over the
lattice: 1 while the pitches exceed w, ``pi w^2 / (4 p q)`` for dense scans with pitches p and q
(the integral of o over the plane is the area of the disc). ``n / f`` points are independent. A fit
with rows a (the design over the sigmas) and cofactors Q has the covariance ``Q A Q`` with
``A = Sigma_ij r_ij a_i a_j^T``. Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.instruments.beam import Beam

#: axes along which discs are wider than this many pitches take the integral, right to 0.3 % there
_DENSE = 6.0
#: ratios at which sums over square lattices are tabled
_STEPS = 501
#: pairs of points that a sum is made of, at most; of more every k-th point stands for k
_PAIRS = 2_000_000


def overlap_share(u: Array) -> Array:
    """Common share (n,) of two discs at ``u`` diameters from each other; zero beyond 1."""
    inside = np.clip(u, 0.0, 1.0)
    share: Array = 2 / np.pi * (np.arccos(inside) - inside * np.sqrt(1 - inside**2))
    return share


def _lattice_sums(x: Array, y: Array) -> Array:
    """Sums (m,) of the shares over lattices, for discs of so many pitches (m,) along both axes."""
    reach = np.arange(-int(_DENSE), int(_DENSE) + 1)
    i, j = (grid.ravel() for grid in np.meshgrid(reach, reach))
    coarse = np.minimum(x, _DENSE), np.minimum(y, _DENSE)
    away = np.hypot(i / coarse[0][:, None], j / coarse[1][:, None])
    sums: Array = overlap_share(away).sum(axis=1)
    # an axis denser than that has so many more points, each with the same share
    return sums * (x / coarse[0]) * (y / coarse[1])


_RATIOS = np.linspace(1.0, _DENSE, _STEPS)
_SUMS = _lattice_sums(_RATIOS, _RATIOS)


def lattice_factor(across: Array, up: Array | None = None) -> Array:
    """Factor F on the variance of a mean if points share all that their discs have in common.

    ``across``, ``up`` (m,): diameter of the discs over the pitches of the lattice along both axes;
    a square lattice without the second. Returns (m,): factors, at least 1 (method section 5.7).
    """
    x = np.maximum(np.asarray(across, dtype=float), 1e-9)
    if up is None:
        table = np.interp(x, _RATIOS, _SUMS)
        factor: Array = np.where(x > _DENSE, np.pi / 4 * x**2, table)
        return factor
    y = np.maximum(np.asarray(up, dtype=float), 1e-9)
    both = np.broadcast_arrays(np.atleast_1d(x), np.atleast_1d(y))
    sums = _lattice_sums(both[0].ravel(), both[1].ravel())
    return sums.reshape(np.broadcast_shapes(x.shape, y.shape))


def effective_number(
    count: Array, area: float, footprint: Array, share: Array | float = 1.0
) -> Array:
    """Count the independent points among evenly spread ones, at least one.

    ``count`` (m,): points; ``area``: area of the patch that they lie on [m^2]; ``footprint`` (m,):
    area on the same surface of the discs whose overlap points share: that across the beam over the
    cosine of the incidence angle [m^2]; ``share`` (m,): share of their variance that points share
    where discs are one. Returns (m,): independent points (method section 5.7).
    """
    ratio = np.sqrt(4 / np.pi * footprint * count / area)
    factor = 1 + share * (lattice_factor(ratio) - 1)
    number: Array = np.where(count > 0, np.maximum(count / factor, 1.0), 0.0)
    return np.minimum(number, count)


@dataclass(frozen=True)
class RangeCorrelation:
    """What the neighbours of a point at one range share with it."""

    share: float  #: share of the range variance, 0 to 1
    angle: float  #: diameter of the discs whose overlap it goes with, seen from the scanner [rad]

    def correlation(self, separation: Array) -> Array:
        """Correlation (n,) of ranges whose directions are ``separation`` (n,) [rad] apart."""
        away = np.asarray(separation, dtype=float)
        shared = self.share * overlap_share(away / max(self.angle, 1e-12))
        return np.where(away > 0, shared, 1.0)

    def factor(self, across: float, up: float) -> float:
        """Factor on the variance of a mean over a wide lattice with these pitches [rad]."""
        sums = lattice_factor(np.array([self.angle / across]), np.array([self.angle / up]))
        return 1 + self.share * (float(sums[0]) - 1)

    def summed(self, directions: Array, rows: Array) -> Array:
        """Sum of ``r_ij a_i a_j^T`` over all pairs of different points.

        ``directions`` (n, 3): unit vectors to the points; ``rows`` (n, u): rows of a fit, each over
        the sigma of its range. Returns (u, u): what correlation adds to the normal matrix ``Sigma
        a_i a_i^T``, so that ``Q (N + this) Q`` is the covariance of a fit with the cofactors Q
        (method section 5.7).
        """
        u = rows.shape[1]
        if self.share <= 0 or self.angle <= 0 or len(rows) < 2:
            return np.zeros((u, u))
        # loaded here, as clouds are written without it
        from scipy.spatial import cKDTree

        tree = cKDTree(directions)
        pairs = int(tree.count_neighbors(tree, self.angle))
        step = max(1, int(np.ceil(pairs / _PAIRS)))
        some = tree if step == 1 else cKDTree(directions[::step])
        near = some.sparse_distance_matrix(tree, self.angle, output_type="ndarray")
        first, second = near["i"] * step, near["j"]
        other = first != second
        first, second = first[other], second[other]
        r = self.share * overlap_share(near["v"][other] / self.angle)
        total = step * (rows[first] * r[:, None]).T @ rows[second]
        both: Array = (total + total.T) / 2
        return both


@dataclass(frozen=True)
class SharedNoise:
    """What neighbouring points of an instrument share of their range errors."""

    share: float  #: share of the range variance that goes with the overlap, 0 to 1
    #: diameter of the discs that overlap, seen from the scanner [rad]; zero for those of the beam
    angle: float = 0.0
    beam: Beam = Beam()  #: the beam

    def __post_init__(self) -> None:
        """Refuse values that are not a share and an angle."""
        if not 0 <= self.share <= 1:
            raise InputError(
                f"neighbouring points cannot share {self.share:g} of their variance",
                cure="give a share between 0 and 1",
            )
        if not 0 <= self.angle < np.inf:
            raise InputError(
                f"neighbouring points cannot share errors over {self.angle:g} rad",
                cure="give zero, for the beam's own width, or a positive angle",
            )

    def diameter(self, length: Array) -> Array:
        """Diameters (n,) [m] of the discs at ranges (n,) [m]."""
        at = np.asarray(length, dtype=float)
        return self.angle * at if self.angle > 0 else self.beam.diameter(at)

    def at(self, length: float) -> RangeCorrelation:
        """What neighbours at a range [m] share."""
        width = float(self.diameter(np.array([length]))[0])
        return RangeCorrelation(self.share, width / max(length, 1e-9))
