"""The centre of a printed disc of known radius, from its points: plane of the print, then its edge.

Light is carried along its beams into the plane. The edge tells the centre's direction, the plane
its distance; the covariance is that of both. Discs whose print reads another range than the ground
around them by much (retroreflecting sheets) take their distance from the ground (method section
8.2). Scanner frame, metres.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import erfc, exp, log, sqrt
from typing import Any

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tribrach._types import Array, Mask
from tribrach.targets.discs.edge import PATCH, DiscShape, EdgeFit, departure, light_of, solve
from tribrach.targets.prints.edges import ASTRAY, BLUR_SHARE, BLURS, messages
from tribrach.targets.prints.plane import BoardPlane, fit_board_plane

__all__ = ["DiscFit", "fit_disc"]

# Is a print flat, and how well is the distance of its plane known? From its range residuals.


#: residuals beyond this many sigmas take no part
_TRIM = 3.5


#: cells along a side of the patch for the test of independence, points that one must hold
_CELLS, _HELD = 7, 4


#: a foretold sigma counts as much as so many points
_HELD_BY = 6


def bend(place: Array, residual: Array, bright: Mask) -> tuple[float, float]:
    """Largest departure from the plane [m] at distance 1 of a second-degree surface, its sigma.

    place (n, 2) : in units of the radius around the centre; residual (n,) : range minus plane [m];
    bright (n,) : each colour may have an offset of its own.
    """
    x, y = place.T
    a = np.column_stack([bright, ~bright, x, y, x * x, x * y, y * y]).astype(float)
    if len(a) < 12:
        return 0.0, 0.0
    found, _, rank, _ = np.linalg.lstsq(a, residual)
    if rank < a.shape[1]:
        a = np.delete(a, 1, axis=1)
        found = np.linalg.lstsq(a, residual)[0]
    left = residual - a @ found
    variance = float(left @ left) / max(len(a) - a.shape[1], 1)
    cover = np.linalg.pinv(a.T @ a) * variance
    xx, xy, yy = found[-3:]
    values, vectors = np.linalg.eigh([[xx, xy / 2], [xy / 2, yy]])
    worst = int(np.argmax(np.abs(values)))
    c, s = vectors[:, worst]
    direction = np.array([c * c, c * s, s * s])
    return float(abs(values[worst])), float(np.sqrt(direction @ cover[-3:, -3:] @ direction))


def distance(
    place: Array,
    residual: Array,
    bright: Mask,
    telling: Mask,
    radius: float,
    sigma: float,
) -> tuple[float, float]:
    """Distance of the surface at the centre minus that of the plane [m], and its sigma [m].

    Least squares with tilt and the offset of the other colour free. place (n, 2) [m] : around the
    centre; residual (n,) : range minus plane [m]; telling (n,) : of the colour whose range is the
    true one; sigma [m] : of one range, 0 if not known. Neighbours that err together (filtered
    ranges, an uneven print) show in means over cells that scatter more than their numbers allow,
    and raise the sigma.
    """
    x = place / radius
    a = np.column_stack([np.ones(len(x)), x, ~telling]).astype(float)
    if telling.all() or not telling.any():
        a = a[:, :3]
    use, found = np.ones(len(x), dtype=bool), np.zeros(a.shape[1])
    left, own = residual, np.ones(len(x))
    for turn in range(6):
        own = _sigmas(left, bright, use, sigma, robust=turn == 0)
        before, use = use, np.abs(left) < _TRIM * own
        w = use / own**2
        cover = np.linalg.pinv((a * w[:, None]).T @ a)
        found = cover @ (a.T @ (w * residual))
        left = residual - a @ found
        if turn > 1 and (before == use).all():
            break
    excess = _excess(x[use], (left / own)[use])
    return float(found[0]), float(np.sqrt(cover[0, 0] * excess))


def _sigmas(left: Array, bright: Mask, use: Mask, sigma: float, *, robust: bool) -> Array:
    """Sigma (n,) [m] of each point: that of its colour, held by what is foretold."""
    out = np.empty(len(left))
    for colour in (False, True):
        own = bright == colour
        mine = left[own & use]
        n = len(mine)
        if robust and n > 3:
            size = 1.4826 * float(np.median(np.abs(mine - np.median(mine))))
            square = max(size, sigma) ** 2 * n
        else:
            square = float(mine @ mine)
        held = _HELD_BY if sigma > 0 else 0
        # two of the four unknowns are each colour's; the spread of a spread widens what it says
        freedom = max(n - 2 + held - 2, 1)
        out[own] = np.sqrt((square + held * sigma**2) / freedom)
    return np.maximum(out, 1e-6)


def _excess(x: Array, left: Array) -> float:
    """Variance of means over cells times their numbers, over that of single points, at least 1."""
    cell = np.floor((x + 1.5) * (_CELLS / 3)).astype(int).clip(0, _CELLS - 1)
    number = cell[:, 0] * _CELLS + cell[:, 1]
    count = np.bincount(number, minlength=_CELLS**2)
    held = count >= _HELD
    if held.sum() < 12:
        return 1.0
    total = np.bincount(number, left, _CELLS**2)[held]
    ratio = float((total**2 / count[held]).sum() / (held.sum() - 4))
    # what chance makes of independent points is not taken for more
    chance = 1 + 2 * float(np.sqrt(2 / (held.sum() - 4)))
    return max(1.0, ratio) if ratio > chance else 1.0


# Where the centre of a printed disc is, and how sure that is, from the points near its edge.
#
# As with the edges of checkerboards each point's light says how far its beam was from the edge,
# or only on which side of it. The posterior of the centre is summed over a grid that closes in
# on it, for several blurs and radii, so that scans much coarser than the beam, where any circle
# between two rings of points fits and least squares has no slope, are treated like dense ones.


#: nodes of the grid in each direction, most rounds of closing in, sigmas that the grid reaches
_NODES, _ROUNDS, _REACH = 15, 6, 4.0


#: radii that are tried, in sigmas of the radius: mean and variance are right
_RADII = np.sqrt(1.5) * np.array([-1.0, 0.0, 1.0])


#: what the beams' unknown profile moves the edge by, in all directions alike, over the blur
_PROFILE = 0.1


#: blurs foretold no better than this (logarithm) are guesses
_GUESSED = 0.9


#: points that tell where the edge is, about
_PLENTY = 600


def posterior(flat: Array, light: Array, fit: EdgeFit, shape: DiscShape) -> tuple[Array, Array]:
    """Mean (2,) and covariance (2, 2) of the centre [m] over all that points allow.

    flat (n, 2) [m], light (n,) : of the points of the plane; fit : by least squares, with the
    radius known to what ``shape`` says.
    """
    d = flat - fit.p[:2]
    away = np.maximum(np.hypot(d[:, 0], d[:, 1]), 1e-9)
    stretch = np.sqrt(1 + (d @ shape.slope / away) ** 2)
    spread = np.sqrt(np.diag(fit.covariance)[:2])
    reach = np.minimum(np.maximum(5 * spread, 0.7 * shape.pitch), 0.6 * shape.radius)
    # a blur that is hardly foretold is the one that was found; it holds the jitter of places too
    blur = shape.blur if shape.blur_share < _GUESSED else float(np.exp(fit.p[4]))
    beam = float(np.sqrt(max(blur**2 - 0.25 * shape.jitter**2, 0.25 * blur**2)))
    jitter = max(shape.jitter, fit.jitter)
    tail = 3 * float(np.hypot(beam, jitter)) * stretch
    near = np.abs(away - fit.p[5]) < tail + 2 * float(reach.max())
    use = np.flatnonzero(near & (away < PATCH * shape.radius))
    use = use[:: max(1, len(use) // _PLENTY)]
    level, noise = _levels(away, light, fit, float(np.median(tail)))
    level = level[use]
    told = [
        messages(level, noise, beam * share * stretch[use], jitter * stretch[use])
        for share in BLURS
    ]
    sigma = float(np.hypot(shape.radius_sigma, _PROFILE * beam))
    radii = [fit.p[5] + sigma * k - (beam * stretch[use]) ** 2 / (2 * shape.radius) for k in _RADII]
    return _closed_in(flat[use], told, radii, fit.p[:2], reach)


def _levels(away: Array, light: Array, fit: EdgeFit, clear: float) -> tuple[Array, float]:
    """Light (n,) as -1 outside and 1 inside, from the plain parts, and its noise."""
    clear = min(clear, 0.3 * fit.p[5])
    low, high = fit.p[2], fit.p[2] + fit.p[3]
    inner, outer = light[away < fit.p[5] - clear], light[away > fit.p[5] + clear]
    if min(len(inner), len(outer)) >= 6:
        low, high = float(np.median(outer)), float(np.median(inner))
    half = (high - low) / 2
    return (light - low) / half - 1, max(fit.noise / abs(half), 0.005)


def _closed_in(
    flat: Array,
    told: list[tuple[Array, Array, NDArray[np.int8]]],
    radii: list[Array],
    mean: Array,
    reach: Array,
) -> tuple[Array, Array]:
    """Mean (2,) and covariance (2, 2) over a grid around ``mean`` that closes in."""
    covariance = np.diag(reach**2)
    for _ in range(_ROUNDS):
        nodes = [m + np.linspace(-1, 1, _NODES) * r for m, r in zip(mean, reach, strict=True)]
        score = np.empty((len(told), len(radii), _NODES, _NODES))
        for k, (place, sigma, kind) in enumerate(told):
            share = np.log(BLURS[k])
            # a density of light is one of places times the blur
            prior = (kind == 0).sum() * share - 0.5 * (share / BLUR_SHARE) ** 2
            for m, radius in enumerate(radii):
                _score(flat, radius, place, sigma, kind, nodes[0], nodes[1], score[k, m])
            score[k] += prior
        weight = np.exp(score - score.max()).sum(axis=(0, 1))
        weight /= weight.sum()
        mean = np.array([weight.sum(axis=1) @ nodes[0], weight.sum(axis=0) @ nodes[1]])
        a, b = nodes[0] - mean[0], nodes[1] - mean[1]
        cross = a @ weight @ b
        covariance = np.array(
            [[weight.sum(axis=1) @ a**2, cross], [cross, weight.sum(axis=0) @ b**2]]
        )
        step, before = 2 * reach / (_NODES - 1), reach
        reach = np.maximum(_REACH * np.sqrt(np.diag(covariance)), 1.5 * step)
        if (reach > 0.6 * before).all():
            break
    return mean, covariance


@njit(cache=True, nogil=True, parallel=True)
def _score(flat, radius, place, sigma, kind, xs, ys, out):  # type: ignore[no-untyped-def]
    """Log-likelihood of every centre."""
    for i in prange(len(xs)):
        for j in range(len(ys)):
            total = 0.0
            for n in range(len(flat)):
                dx, dy = flat[n, 0] - xs[i], flat[n, 1] - ys[j]
                z = (radius[n] - sqrt(dx * dx + dy * dy) - place[n]) / sigma[n]
                if kind[n] == 0:
                    total += log(exp(-0.5 * z * z) + ASTRAY)
                else:
                    y = kind[n] * z
                    # a side that is right beyond doubt costs nothing
                    total += log(0.5 * erfc(-y / sqrt(2.0)) + ASTRAY) if y < 6 else log(1 + ASTRAY)
            out[i, j] = total


#: fewest points around and on a disc
FEWEST, _ON_DISC = 16, 8


#: the print is not looked at more obliquely than this [rad]
_STEEPEST = np.radians(66.0)


#: least contrast over noise, least share of the variance of light that the disc explains
_CONTRAST, _EXPLAINED = 5.0, 0.75


#: the same share where points are nearer than this share of the radius and light has little noise
_CLEAR, _CLOSE = 0.86, 0.1


#: radius and roundness are right within this share of the radius, or within so many sigmas
_SHARE, _SIGMAS = 0.05, 4.0


#: the print is flat within this share of the radius, and least share of points on its plane
_FLAT, _ON_PLANE = 0.02, 0.5


#: least share of the edge that is seen, and of that where light changes as it should
_COVERAGE, _SHOWN = 0.6, 0.8


#: print and ground that differ by more in range [m]: print that throws the beam back
_RETRO = 5e-3


#: a print's radius is known to this share of it
_RADIUS_SHARE = 0.005


@dataclass(frozen=True)
class DiscFit:
    """A measured disc.

    center (3,), covariance (3, 3) : scanner frame; plane; flat (2, 2) : covariance in the plane;
    distance_sigma [m] : along the beam; rms [m] : of the range residuals; gain : light of the disc
    minus that of the ground; contrast : the same over the noise, positive; explained : share of the
    variance of light; radius, blur [m] : as seen; coverage : share of the edge; split [m] : range
    of the disc minus that of the ground; incidence [rad]; points : on and around the disc; inliers.
    """

    center: Array
    covariance: Array
    plane: BoardPlane
    flat: Array
    distance_sigma: float
    rms: float
    gain: float
    contrast: float
    explained: float
    radius: float
    blur: float
    coverage: float
    split: float
    incidence: float
    points: int
    inliers: int

    @property
    def retro(self) -> bool:
        """Does the print throw the beam back, so that the distance is that of the ground?"""
        return abs(self.split) > _RETRO


@dataclass(frozen=True)
class NoDisc:
    """Why points are no disc, in one sentence without the stop; texture : worth no line."""

    reason: str
    texture: bool = False

    def __bool__(self) -> bool:
        """A refusal is no fit."""
        return False


def fit_disc(
    xyz: Array,
    intensity: NDArray[np.floating[Any]],
    start: Array,
    radius: float,
    *,
    footprint: float | None = None,
    sigma_range: float | None = None,
    sigma_angle: float | None = None,
    floor: float = 0.0,
) -> DiscFit | NoDisc:
    """The disc of a radius [m] near a place (3,), wrong by up to half the radius.

    footprint : diameter of the beam there [m]; sigma_range [m], sigma_angle [rad] : of one point;
    each is told by the points where it is not given; floor : added to the covariance in each
    direction [m].
    """
    light = np.asarray(intensity, dtype=float)
    close = (np.linalg.norm(xyz - start, axis=1) < 1.8 * radius) & np.isfinite(light)
    if close.sum() < FEWEST:
        return NoDisc(f"only {int(close.sum())} points on and around it, {FEWEST} are needed")
    patch = _Patch(xyz[close], light[close], radius, footprint, sigma_range, sigma_angle)
    first = patch.placed(start)
    # the first plane is that of what lies around the start, the second that of the print alone
    solved = first if isinstance(first, NoDisc) else patch.placed(patch.plane.at(first.p[:2]))
    if isinstance(solved, NoDisc):
        return solved
    return patch.judged(solved, floor)


class _Patch:
    """Points around a candidate, the plane that they lie in and their places in it."""

    plane: BoardPlane
    flat: Array
    on: Mask
    shape: DiscShape

    def __init__(
        self,
        xyz: Array,
        light: Array,
        radius: float,
        footprint: float | None,
        sigma_range: float | None,
        sigma_angle: float | None,
    ) -> None:
        self.xyz, self.light, self.radius = xyz, light, radius
        self.footprint, self.sigma_range, self.sigma_angle = footprint, sigma_range, sigma_angle

    def placed(self, near: Array) -> EdgeFit | NoDisc:
        """The edge in the plane of what lies around a place (3,), its radius free."""
        refused = self.lay(near)
        return self.seek() if refused is None else refused

    def lay(self, near: Array) -> NoDisc | None:
        """Fit the plane around a place (3,) and find the points that lie on it."""
        use = np.linalg.norm(self.xyz - near, axis=1) < PATCH * self.radius
        if use.sum() < FEWEST:
            return NoDisc(f"only {int(use.sum())} points on and around it, {FEWEST} are needed")
        low, high = np.quantile(self.light[use], [0.1, 0.9])
        self.bright = self.light > (low + high) / 2
        plane = fit_board_plane(self.xyz[use], self.bright[use], near, 0.0)
        if plane is None:
            return NoDisc("it is not flat: the points around it lie in no plane")
        self.plane = plane
        away = float(np.linalg.norm(near))
        slope = abs(float(near @ plane.normal)) / away
        self.incidence = float(np.arccos(min(1.0, slope)))
        if self.incidence > _STEEPEST:
            return NoDisc(f"the beam meets it at {np.degrees(self.incidence):.0f} degrees")
        self.flat = plane.project(self.xyz)
        self.residual = self._residual()
        gate = max(5 * plane.rms, 0.03 * self.radius)
        self.on = self._clean(np.abs(self.residual) < gate, gate)
        within = np.hypot(*self.flat.T) < PATCH * self.radius
        if not (self.on & within).sum() > _ON_PLANE * within.sum():
            return NoDisc("it is not flat: most of what lies around it is off its plane")
        if plane.rms > max(0.06 * self.radius, 4 * self._range_sigma()):
            return NoDisc(f"it is not flat: its points scatter by {1e3 * plane.rms:.1f} mm")
        self.shape = self._shape(near, int((self.on & within).sum()))
        return None

    def _residual(self) -> Array:
        """Range minus that of the plane (n,) [m], dark print without its offset."""
        unit = self.xyz / np.linalg.norm(self.xyz, axis=1, keepdims=True)
        residual = (self.xyz @ self.plane.normal - self.plane.offset) / (unit @ self.plane.normal)
        return np.asarray(residual + np.where(self.bright, 0.0, self.plane.split))

    def _range_sigma(self) -> float:
        """What is known of the noise of ranges [m], 0 if nothing."""
        if self.sigma_range is None:
            return 0.0
        across = (self.sigma_angle or 0.0) * float(np.linalg.norm(self.plane.origin))
        return float(np.hypot(self.sigma_range, across * np.tan(self.incidence)))

    def _clean(self, on: Mask, gate: float) -> Mask:
        """Points on the plane whose beams do not brush something off it."""
        off = np.abs(self.residual) > max(3 * gate, 0.01)
        if not off.any() or not self.footprint or not on.any():
            return on
        reach = 0.6 * self.footprint / np.cos(self.incidence)
        distance, _ = cKDTree(self.flat[off]).query(self.flat[on], distance_upper_bound=reach)
        out = on.copy()
        out[np.flatnonzero(on)[np.isfinite(distance)]] = False
        return out

    def _shape(self, near: Array, count: int) -> DiscShape:
        """What is known of the disc before the fit."""
        away = float(np.linalg.norm(near))
        pitch = float(np.sqrt(np.pi / max(count, 1))) * PATCH * self.radius
        jitter = (2e-5 if self.sigma_angle is None else self.sigma_angle) * away
        blur = 0.3 * pitch if self.footprint is None else self.footprint / 4
        blur = max(float(np.hypot(blur, 0.5 * jitter)), 2e-3 * self.radius)
        along = self.plane.axes @ near / away
        return DiscShape(
            self.radius,
            0.2 * self.radius,
            along / np.cos(self.incidence),
            blur,
            1.0 if self.footprint is None else 0.5,
            max(jitter, 0.02 * blur),
            pitch,
        )

    def seek(self) -> EdgeFit | NoDisc:
        """The edge with a free radius, if there is one."""
        flat, light = self.flat[self.on], self.light[self.on]
        away = np.hypot(*flat.T)
        inner, ring = (
            away < 0.6 * self.radius,
            (away > 1.15 * self.radius) & (away < 1.6 * self.radius),
        )
        if inner.sum() < 3 or ring.sum() < 3:
            return NoDisc(f"only {int(inner.sum())} points on it, {_ON_DISC} are needed")
        high, low = float(np.median(light[inner])), float(np.median(light[ring]))
        centre = np.zeros(2)
        for _ in range(3):
            like = (light - low) / (high - low if high != low else 1.0) > 0.5
            like &= np.hypot(*(flat - centre).T) < 1.2 * self.radius
            if like.any():
                centre = flat[like].mean(axis=0)
        solved = solve(flat, light, np.array([*centre, low, high - low]), self.shape)
        if solved is None:
            return NoDisc("its light shows no disc", texture=True)
        return solved

    def judged(self, free: EdgeFit, floor: float) -> DiscFit | NoDisc:
        """The fit, if it passes every test; ``free`` : with a free radius."""
        flat, light = self.flat[self.on], self.light[self.on]
        reason = self._doubt(flat, light, free)
        if reason is not None:
            return reason
        known = replace(self.shape, radius_sigma=_RADIUS_SHARE * self.radius)
        solved = solve(flat, light, free.p[:4], known)
        if solved is None:
            return NoDisc("the fit of its edge does not converge")
        centre, spread = posterior(flat, light, solved, known)
        return self._measured(solved, free, centre, spread, floor)

    def _doubt(self, flat: Array, light: Array, fit: EdgeFit) -> NoDisc | None:
        """Why a converged fit is no disc of this size."""
        away = np.hypot(*(flat - fit.p[:2]).T)
        contrast = abs(fit.p[3]) / max(fit.noise, 1e-12)
        explained = _explained(flat, light, fit, self.shape)
        seen, shown = self._edge_seen(flat, light, fit)
        wrong = abs(fit.p[5] - self.radius)
        limit = max(
            _SHARE * self.radius,
            _SIGMAS * float(np.hypot(np.sqrt(fit.covariance[5, 5]), self.shape.step)),
        )
        on_disc = int((away < self.radius).sum())
        if contrast < _CONTRAST:
            text = f"its contrast is {contrast:.1f} times the noise, {_CONTRAST:g} are needed"
            return NoDisc(text, explained < 0.3)
        if seen < _COVERAGE:
            return NoDisc(
                f"its edge is seen on one side only, on {100 * seen:.0f} % of the circle, "
                f"{100 * _COVERAGE:.0f} are needed"
            )
        if on_disc < _ON_DISC:
            return NoDisc(f"only {on_disc} points on it, {_ON_DISC} are needed")
        if shown < _SHOWN:
            return NoDisc(f"light changes on {100 * shown:.0f} % of its edge only", shown < 0.5)
        needed = self._needed(contrast)
        if explained < needed:
            text = (
                f"a disc explains {100 * explained:.0f} % of its light, "
                f"{100 * needed:.0f} are needed"
            )
            return NoDisc(text, explained < 0.6)
        if wrong > limit or limit > 0.25 * self.radius:
            radii = f"{1e3 * fit.p[5]:.1f} mm, not {1e3 * self.radius:g} mm"
            return NoDisc(f"it has the wrong radius: {radii}")
        size, sigma = departure(flat, light, fit, self.shape)
        sigma = float(np.hypot(sigma, np.sqrt(2) * self.shape.step))
        if size > max(_SHARE * self.radius, _SIGMAS * sigma):
            return NoDisc(f"its edge is no circle: it departs from one by {1e3 * size:.1f} mm")
        sag, sigma = self._bend(fit)
        if sag > max(_FLAT * self.radius, _SIGMAS * sigma):
            return NoDisc(f"it is not flat: it bends by {1e3 * sag:.1f} mm over its radius")
        return None

    def _needed(self, contrast: float) -> float:
        """Least share of the variance of light that a disc of this contrast explains."""
        if self.shape.pitch > _CLOSE * self.radius:
            return _EXPLAINED
        inside = 1 / PATCH**2
        noise = 1 / (contrast**2 * inside * (1 - inside))
        return max(_EXPLAINED, _CLEAR - 2 * noise)

    def _edge_seen(self, flat: Array, light: Array, fit: EdgeFit) -> tuple[float, float]:
        """Share of the edge that is seen, and the share of that where light changes."""
        d = flat - fit.p[:2]
        away = np.hypot(d[:, 0], d[:, 1])
        ring = (away > 0.5 * self.radius) & (away < PATCH * self.radius)
        sectors = 24 if ring.sum() > 240 else 8
        sector = ((np.arctan2(d[:, 1], d[:, 0]) + np.pi) * (sectors / (2 * np.pi))).astype(int)
        sector = np.where(ring, sector % sectors, sectors)
        inside = light_of(flat, fit.p, self.shape.slope)[1][:, 3]
        n, f, i, ff, fi = (
            np.bincount(sector, x, sectors + 1)[:sectors]
            for x in (np.ones(len(d)), inside, light, inside**2, inside * light)
        )
        at = np.maximum(n, 1)
        swing, own = ff - f**2 / at, fi - f * i / at
        both = swing > 0.1 * at
        change = own[both] / swing[both] / fit.p[3]
        shown = float(np.mean(change > 0.5)) if both.any() else 0.0
        return float(np.mean(n > 0.2 * n.max())), shown

    def _bend(self, fit: EdgeFit) -> tuple[float, float]:
        near = np.hypot(*(self.flat - fit.p[:2]).T) < 1.3 * self.radius
        near &= self.on
        place = (self.flat[near] - fit.p[:2]) / self.radius
        return bend(place, self.residual[near], self.bright[near])

    def _measured(
        self, solved: EdgeFit, free: EdgeFit, centre: Array, spread: Array, floor: float
    ) -> DiscFit:
        """Centre and covariance from the edge and the plane."""
        plane, gain = self.plane, float(solved.p[3])
        split = plane.split if gain > 0 else -plane.split
        ground = abs(split) > _RETRO and gain > 0
        use = self.on & (np.hypot(*(self.flat - centre).T) < PATCH * self.radius)
        telling = ~self.bright if ground else self.bright
        shift, sigma = distance(
            self.flat[use] - centre,
            self.residual[use],
            self.bright[use],
            telling[use],
            self.radius,
            self._range_sigma(),
        )
        place = plane.at(centre)
        beam = place / np.linalg.norm(place)
        # the offset of dark print is taken out of its residuals; where the ground tells, it is back
        place = place + (shift - (plane.split if ground else 0.0)) * beam
        covariance = plane.axes.T @ spread @ plane.axes + sigma**2 * np.outer(beam, beam)
        flat, light = self.flat[self.on], self.light[self.on]
        return DiscFit(
            center=place,
            covariance=covariance + floor**2 * np.eye(3),
            plane=plane,
            flat=spread,
            distance_sigma=sigma,
            rms=float(np.sqrt(np.mean(self.residual[use] ** 2))),
            gain=gain,
            contrast=abs(gain) / max(solved.noise, 1e-12),
            explained=_explained(flat, light, solved, self.shape),
            radius=float(free.p[5]),
            blur=float(np.exp(solved.p[4])),
            coverage=self._edge_seen(flat, light, solved)[0],
            split=split,
            incidence=self.incidence,
            points=int((np.hypot(*(self.flat - centre).T) < PATCH * self.radius).sum()),
            inliers=int(solved.use.sum()),
        )


def _explained(flat: Array, light: Array, fit: EdgeFit, shape: DiscShape) -> float:
    """Share of the variance of light around a disc that is the disc's.

    Where points are far apart those next to the edge tell nothing about it and are left out.
    """
    away = np.hypot(*(flat - fit.p[:2]).T)
    near = away < PATCH * shape.radius
    if shape.coarse:
        near &= np.abs(away - shape.radius) > min(0.4 * shape.pitch, 0.2 * shape.radius)
    left = light[near] - light_of(flat[near], fit.p, shape.slope)[0]
    return 1 - float(left.var() / max(light[near].var(), 1e-12)) if near.any() else 0.0
