"""Computes the covariance of a relative pose from matched surfels, whose neighbours share errors.

Residuals are not independent: neighbours share waves of the surface, beams, and the planes that
they are compared with, and both directions compare the same points. The covariance takes this into
account in four ways (method section 2.11).

Weighted residuals are summed over cubes of growing size, and over columns: a trunk shares its
errors over its height. Where neighbours share errors the variance of the sums outgrows that of
independent residuals, until the cubes are as large as what is shared. The largest factor divides
the number of observations; the size is the correlation length. A direction that few places hold may
share more than the others: it has a factor of its own where chance does not make as much.

A scanner that moved or nodded while it scanned bends its scan as a whole; then sectors of the scan
fit differently, whatever the size of the cubes. Sums over sectors of the directions from either
scanner are compared with what the cubes allow, and widen the covariance where they exceed it.

Directions that only the noise of normals seems to hold (a slide along a corridor) have a
generalised eigenvalue near one; they are named in words and given a sigma as wide as the overlap.

A floor stands for what residuals never show: zero error, calibration, unstable surfaces.

Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import eigh

from tribrach._types import Array, Index
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import skew
from tribrach.kernels import njit
from tribrach.registration.clouds.fine import FINE, FineAlignment, Indexed, Matches
from tribrach.registration.clouds.sweep import SweepTest, sweep_test
from tribrach.sentences import Sentence, joined
from tribrach.units import SEC


@dataclass(frozen=True)
class CloudCovarianceGates:
    """What makes the covariance of a pair of clouds honest (by hand: test_covariance)."""

    #: sigmas of what residuals never show: of shifts [m] and of turns [rad]
    floor: tuple[float, float] = (1e-3, 10 * SEC)
    #: edges of the cubes over which residuals are summed [m]
    edges_m: tuple[float, ...] = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0)
    fewest_cubes: int = 40  #: a variance needs so many cubes
    #: both directions compare the same points: observations count half at most
    least_shared: float = 2.0
    #: least share of a place that is left of its residuals after the fit
    least_left: float = 0.2
    #: the correlation length is the first edge that reaches this share of the largest factor
    length_share: float = 0.8
    #: a direction is not held if noise of normals makes more than this share of what holds it ...
    noise_share: float = 0.3
    #: ... or if it has less than this share of the best held one: normals are not better than half
    #: a degree
    held_share: float = 1e-4
    #: ... or if less surface than that of a least overlap holds it, of both scans together [m^2]:
    #: the few pieces at the edges of doors and windows do not tell one door from the next
    holding_m2: float = 4.0
    holding_cosine: float = 0.3  #: a piece of surface holds a direction by this cosine or more
    #: least slope of the loss against its weight: residuals of poor fits fill the whole gate
    least_slope: float = 0.05
    #: edge of the cubes that count as places of their own [m], at most this many levers: models
    place_m: float = 1.0
    place_levers: float = 0.25
    #: a direction that fewer places than this hold is open: a pillar or two do not tell which ones
    fewest_places: float = 6.0
    #: least edge of the pieces of a sweep [m], and how many there are at most: bounds the time
    least_piece_m: float = 1.0
    most_pieces: int = 10_000
    told_part: float = 0.1  #: in words: a direction moves what has this part of it or more
    #: a depth is told from so many of its sigmas on: 0.1 % of a normal quantity
    told_sigmas: float = 3.3


GATES = CloudCovarianceGates()


@dataclass(frozen=True, eq=False)
class RelativeCovariance:
    """Covariance of a relative pose ``X_a = T X_b``."""

    #: (6, 6), of the translation in a [m] and of a rotation vector applied on the right, in b
    #: [rad] (the order of :class:`~tribrach.observations.poses.RelativePoses`)
    covariance: Array
    middle: Array  #: (3,), middle of the overlap in the frame of a [m]
    #: (6, 6), covariance of the shift of the middle [m] and the turn about it [rad], frame of a,
    #: floor included
    local: Array
    observations: int  #: number of matches of both directions
    effective: float  #: number of them that count as independent
    correlation_length: float  #: size of what neighbours share [m]
    sigma: float  #: sigma of unit weight [m]
    unheld: Array  #: (6, k), directions that nothing holds: shift [m], turn times ``lever`` [m]
    lever: float  #: length that turns are multiplied by [m]
    places: float  #: smallest number of places that hold a direction
    #: sigmas (e,) of fitted shared errors, in those of their priors
    shared: Array = field(default_factory=lambda: np.zeros(0))
    #: by how much ranges are too long after the fit, and its sigma [m]
    depth: tuple[float, float] = (0.0, np.inf)
    #: by what factor parts of the sweep fit worse than the rest of the covariance allows; it is in
    #: the covariance
    sweep: SweepTest = SweepTest()

    @property
    def factor(self) -> float:
        """How many observations count as one."""
        return self.observations / self.effective

    @property
    def rank(self) -> int:
        """Number of the six directions that the surfaces hold."""
        return 6 - int(self.unheld.shape[1])

    def sentences(self, a: str, b: str) -> list[str]:
        """Weaknesses of the relative pose, in words."""
        out: list[str] = [
            Sentence(
                "the overlap of {a} and {b} does not hold {words} (axes of {a}); there its "
                "sigma is set to " + _unheld_sigma(d),
                a=a,
                b=b,
                words=_words(d, self.lever),
                own=self,
                turn=float(np.linalg.norm(d[3:])),
            )
            for d in self.unheld.T
        ]
        if abs(self.depth[0]) > GATES.told_sigmas * self.depth[1]:
            out.append(
                Sentence(
                    "{a} and {b} agree better with ranges that are {d:mm1~} ± {s:mm1} "
                    + ("shorter" if self.depth[0] > 0 else "longer")
                    + ": a zero error of the scanner, a surface that its beams enter, or a scanner "
                    "that moved; the pose takes it into account, the points do not; calibrate the "
                    "scanner if other pairs tell the same",
                    a=a,
                    b=b,
                    d=abs(self.depth[0]),
                    s=self.depth[1],
                )
            )
        if self.sweep.factor > 1:
            factor, ratio, limit = self.sweep.factor, self.sweep.ratio, self.sweep.limit
            out.append(
                Sentence(
                    "parts of {a} and {b} fit differently (variance {factor:1} times what their "
                    "neighbours allow in the worst direction, {ratio:1} times in all together, "
                    "chance makes {limit:1}): a scanner or things moved, or the scans need "
                    "calibration or were thinned; sigmas are {factor2:1} times as wide",
                    a=a,
                    b=b,
                    factor=factor,
                    ratio=ratio,
                    limit=limit,
                    factor2=np.sqrt(factor),
                )
            )
        return out


def relative_covariance(
    a: Indexed,
    b: Indexed,
    alignment: FineAlignment,
    floor: tuple[float, float] = GATES.floor,
    *,
    sweep: bool = True,
    unheld: Array | None = None,
    shared: Array | None = None,
    least: float = 1.0,
) -> RelativeCovariance:
    """Covariance of an alignment with at least ten matches.

    ``floor`` is added to shifts of the middle and turns about it, [m] and [rad]. ``unheld`` (6, k)
    are orthonormal directions known to be open, about the middle of the matches, turns times their
    lever; None if the matches tell. ``sweep`` tests whether parts of the sweeps fit alike.
    ``shared`` (n, e) are what one sigma of fitted shared errors does to the residuals; so many
    matches count as one at ``least``.
    """
    m = alignment.matches
    middle, lever = m.about
    design = m.design((middle, lever))
    u = (m.residual / alignment.gate) ** 2
    alone = 1 / (m.sigma**2 + (alignment.gate / FINE.gate_sigmas) ** 2)
    weight = (1 - u) ** 2 * alone
    # Tukey's loss gives way: its slope, not its weight, is what holds (Huber 1981, chapter 7)
    slope = np.maximum((1 - u) * (1 - 5 * u) * alone, GATES.least_slope * weight)
    normal = (design * slope[:, None]).T @ design
    if unheld is None:
        unheld = _unheld(a, b, m, design, weight, normal, middle, lever)
    held, places = _held(m, design, weight, normal, unheld, lever)
    inner, pull = held.T @ normal @ held, weight * m.residual
    common = Shared.of(design @ held, slope, pull, inner, m)
    test = SweepTest()
    if sweep and held.shape[1] and pull.any():
        rows = design @ held @ _inverse_root(inner)
        test = _sweep(rows, slope, rows * pull[:, None], common.edge, m, alignment.pose)
    factor = common.factor * test.factor
    spread, sigmas = test.factor * held @ common.covariance @ held.T, np.zeros(0)
    if shared is not None:
        factor = max(factor, least)
        both = _with_prior(design @ held, shared, pull, slope, factor, m)
        count = held.shape[1]
        spread, sigmas = held @ both[:count, :count] @ held.T, np.sqrt(np.diag(both)[count:])
    local = spread + lever**2 * unheld @ unheld.T
    scale = np.repeat([1.0, 1 / lever], 3)
    local = local * np.outer(scale, scale)
    local = local + np.diag(np.repeat(np.square(floor), 3))
    return RelativeCovariance(
        covariance=at_origin(local, alignment.pose, middle),
        middle=middle,
        local=local,
        observations=len(m),
        effective=len(m) / factor,
        correlation_length=common.length,
        sigma=float(np.sqrt((weight * m.residual**2).sum() / weight.sum())),
        unheld=unheld,
        lever=lever,
        places=places,
        shared=sigmas,
        sweep=test,
    )


def _with_prior(
    design: Array, shared: Array, pull: Array, slope: Array, factor: float, m: Matches
) -> Array:
    """Covariance of what is fitted, behind it of shared errors with priors of one sigma.

    ``factor`` matches count as one; weighted residuals and weights (n,).
    """
    count = design.shape[1]
    design = np.concatenate([design, shared], axis=1)
    prior = factor * np.diag(np.repeat([0.0, 1.0], [count, shared.shape[1]]))
    normal = (design * slope[:, None]).T @ design + prior
    inverse = np.linalg.inv(normal)
    common = Shared.of(design, slope, pull, normal, m, factor).covariance
    return np.asarray(common + factor * inverse @ prior @ inverse)


@dataclass(frozen=True, eq=False)
class Shared:
    """The covariance of what is fitted to matches whose neighbours share errors."""

    covariance: Array  #: (k, k)
    factor: float  #: how many matches count as one
    length: float  #: size of what neighbours share [m]
    edge: float  #: edge of the cubes or columns that show the most of it [m]

    @classmethod
    def of(
        cls, design: Array, slope: Array, pull: Array, normal: Array, m: Matches, least: float = 1.0
    ) -> Shared:
        """From design (n, k), weights and weighted residuals (n,), and the normal matrix (k, k).

        So many matches count as one at ``least``. Sums over places are set right for what a place
        holds itself (Bell and McCaffrey 2002); a direction differs from the rest where its variance
        is beyond what chance makes of independent places (Marchenko and Pastur 1967).
        """
        # both directions compare the same points, whatever the residuals say
        least, k = max(least, GATES.least_shared), design.shape[1]
        root = _inverse_root(normal)
        rows = design @ root
        scores = rows * pull[:, None]
        alone = scores.T @ scores
        shapes = [(edge, upright) for edge in GATES.edges_m for upright in (False, True)]
        if not alone.any():  # nothing is held, or a scan and its copy: there is no noise to share
            return cls(root @ alone @ root.T, least, GATES.edges_m[0], GATES.edges_m[0])
        factors = [_outgrown(scores, _cubes(m.point, m.normal, *shape)) for shape in shapes]
        enough = GATES.length_share * max(1.0, *factors)
        reached = [shape[0] for shape, f in zip(shapes, factors, strict=True) if f >= enough]
        length = reached[0] if reached else GATES.edges_m[0]
        edge, upright = shapes[int(np.argmax(factors))]
        number = _cubes(m.point, m.normal, edge, upright)
        products = (rows[:, :, None] * (slope[:, None] * rows)[:, None, :]).reshape(-1, k * k)
        own = _summed(number, products).reshape(-1, k, k)
        values, vectors = np.linalg.eigh(np.eye(k) - own)
        sums = np.einsum("nji,nj->ni", vectors, _summed(number, scores))
        sums /= np.sqrt(np.maximum(values, GATES.least_left))
        sums = np.einsum("nij,nj->ni", vectors, sums)
        least_of = 1e-12 * np.trace(alone) * np.eye(k)
        times, ways = eigh(sums.T @ sums, alone + least_of)
        factor = max(least, float(times.mean()))
        holds = np.einsum("ia,nij,ja->na", ways, own, ways)
        places = holds.sum(axis=0) ** 2 / np.maximum((holds**2).sum(axis=0), 1e-300)
        chance = (1 + np.sqrt(k / np.maximum(places, 1.0))) ** 2
        times = np.where(times > chance * factor, times, factor)
        half = root @ (alone + least_of) @ ways
        return cls((half * times) @ half.T, factor, length, edge)


def _outgrown(scores: Array, number: Index) -> float:
    """By what factor the variance of sums over places outgrows that of independent residuals."""
    sums = _summed(number, scores)
    count = len(sums)
    if count < GATES.fewest_cubes:
        return 0.0
    return float((sums**2).sum() / (scores**2).sum()) * count / (count - 6)


def _unheld(
    a: Indexed,
    b: Indexed,
    m: Matches,
    design: Array,
    weight: Array,
    normal: Array,
    middle: Array,
    lever: float,
) -> Array:
    """Directions (6, k) that nothing holds."""
    tilt = np.where(m.forward, a.surfels.sigma_normal[m.first], b.surfels.sigma_normal[m.second])
    noise = _noise(m.point, m.normal, weight * tilt**2, middle, lever)
    top = float(np.linalg.eigvalsh(normal)[-1])
    # what may only be noise, against all there is
    share, vectors = eigh(
        noise + GATES.held_share * top * GATES.noise_share * np.eye(6),
        normal + 1e-12 * top * np.eye(6),
    )
    loose = share > GATES.noise_share
    unheld = np.linalg.qr(vectors[:, loose])[0] if loose.any() else np.zeros((6, 0))
    area = np.where(m.forward, b.surfels.area[m.second], a.surfels.area[m.first])
    while unheld.shape[1] < 6:
        held = across(unheld)
        weakest = held @ np.linalg.eigh(held.T @ normal @ held)[1][:, :1]
        along = design @ weakest[:, 0]
        holds = np.abs(along) > GATES.holding_cosine
        enough = area[holds].sum() >= GATES.holding_m2
        if enough and _places(m.subset(holds), weight[holds] * along[holds] ** 2, lever) >= (
            GATES.fewest_places
        ):
            break
        unheld = np.linalg.qr(np.column_stack([unheld, weakest]))[0]
    return np.asarray(unheld)


def across(unheld: Array) -> Array:
    """Orthonormal directions across others."""
    full, _ = np.linalg.qr(np.column_stack([unheld, np.eye(6)]))
    return np.asarray(full[:, unheld.shape[1] : 6])


def _held(
    m: Matches, design: Array, weight: Array, normal: Array, unheld: Array, lever: float
) -> tuple[Array, float]:
    """Directions (6, 6 - k) across the open ones (6, k), and by how many places they are held."""
    held = across(unheld)
    if held.shape[1] == 0:
        return held, 0.0
    axes = held @ np.linalg.eigh(held.T @ normal @ held)[1]
    holding = (design @ axes) ** 2 * weight[:, None]
    return held, min(_places(m, column, lever) for column in holding.T)


def _places(m: Matches, holding: Array, lever: float) -> float:
    """Over how many places what holds a direction (n,) is spread."""
    edge = min(GATES.place_m, GATES.place_levers * lever)
    sums = pieces(m.point, m.normal, holding[:, None], edge)
    return float(sums.sum() ** 2 / max((sums**2).sum(), 1e-300))


def _inverse_root(matrix: Array) -> Array:
    """``L^-T`` of ``L L^T``: columns that the matrix makes orthonormal."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(matrix)).T)


def _sweep(
    design: Array, slope: Array, scores: Array, edge: float, m: Matches, pose: Pose
) -> SweepTest:
    """Whether sectors of the scans fit alike, of cubes that are as large as what neighbours share.

    Design (n, k) with a normal matrix of one, its weights (n,), scores (n, k).
    """
    edge = max(edge, GATES.least_piece_m)
    number = _cubes(m.point, m.normal, edge)
    while number.max() >= GATES.most_pieces:
        edge *= 2
        number = _cubes(m.point, m.normal, edge)
    k, count = design.shape[1], np.bincount(number)
    products = (design[:, :, None] * (slope[:, None] * design)[:, None, :]).reshape(-1, k * k)
    columns = np.concatenate([scores, products], axis=1).T
    sums = np.array([np.bincount(number, column) for column in columns], dtype=float).T
    middle = np.stack([np.bincount(number, column) / count for column in m.point.T], axis=1)
    normal = sums[:, k:].reshape(-1, k, k)
    return sweep_test(sums[:, :k], normal, (middle, pose.inverse @ middle))


def pieces(point: Array, normal: Array, values: Array, edge: float) -> Array:
    """Sums of ``values`` (n, c) over cubes, a row for the surfaces of each side in each."""
    return _summed(_cubes(point, normal, edge), values)


def _summed(number: Index, values: Array) -> Array:
    """Sums of values (n, c) over places with numbers (n,)."""
    sums = [np.bincount(number, column) for column in values.T]
    return np.stack(sums, axis=1) if sums else np.zeros((int(number.max()) + 1, 0))


def _cubes(point: Array, normal: Array, edge: float, upright: bool = False) -> Index:
    """Numbers (n,) of the cubes of points (n, 3), surfaces that face apart kept apart.

    ``upright`` pieces of surface are taken together over their whole height.
    """
    cell = np.floor(point / edge).astype(np.int64) + (1 << 18)
    face = np.argmax(np.abs(normal), axis=1)
    if upright:
        cell[face < 2, 2] = 0
    key = ((cell[:, 0] << 38) | (cell[:, 1] << 19) | cell[:, 2]) * 3 + face
    _, number = np.unique(key, return_inverse=True)
    return np.asarray(number, dtype=np.int64)


@njit(cache=True, nogil=True)
def _noise(point, normal, weight, middle, lever):  # type: ignore[no-untyped-def]
    """What noise of normals adds to the normal matrix (6, 6); weight (n,) times its variance."""
    out = np.zeros((6, 6))
    block = np.empty((6, 3))
    for n in range(len(point)):
        x = (point[n] - middle) / lever
        block[:3] = np.eye(3)
        block[3, 0], block[3, 1], block[3, 2] = 0.0, -x[2], x[1]
        block[4, 0], block[4, 1], block[4, 2] = x[2], 0.0, -x[0]
        block[5, 0], block[5, 1], block[5, 2] = -x[1], x[0], 0.0
        along = block @ normal[n]
        out += weight[n] * (block @ block.T - np.outer(along, along))
    return out


def at_origin(local: Array, pose: Pose, middle: Array) -> Array:
    """Carry the covariance of a pose from the middle of the overlap to the observation.

    The order becomes that of :class:`~tribrach.observations.poses.RelativePoses` (method section
    2.11).
    """
    move = np.zeros((6, 6))
    move[:3, :3] = np.eye(3)
    # shift of the origin of b: that of the middle and the turn times the way there
    move[:3, 3:] = -skew(pose.translation - middle)
    move[3:, 3:] = pose.rotation.T
    covariance: Array = move @ local @ move.T
    return 0.5 * (covariance + covariance.T)


def _words(direction: Array, lever: float) -> str:
    """What a direction (6,) moves."""
    shift, turn = direction[:3], direction[3:]
    parts = []
    if np.linalg.norm(shift) > GATES.told_part:
        parts.append("a shift along " + _axis(shift))
    if np.linalg.norm(turn) > GATES.told_part:
        parts.append("a turn about " + _axis(turn))
    return joined(" together with ", parts)


def _unheld_sigma(direction: Array) -> str:
    """How wrong a direction (6,) that nothing holds may be: a length, or an angle."""
    if np.linalg.norm(direction[:3]) > GATES.told_part:
        return "{own.lever:1} m"
    return "{turn:degrees0}"


def _axis(vector: Array) -> str:
    """A direction in numbers, its largest component positive."""
    unit = vector / np.linalg.norm(vector)
    unit = unit * np.sign(unit[np.argmax(np.abs(unit))])
    return (
        "("
        + joined(", ", (Sentence("{v:2} {n}", v=v, n=n) for v, n in zip(unit, "xyz", strict=True)))
        + ")"
    )
