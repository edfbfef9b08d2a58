"""The centre of a printed disc of known radius, from its points: plane of the print, then its edge.

Light is carried along its beams into the plane. The edge tells the centre's direction, the plane
its distance; the covariance is that of both. Discs whose print reads another range than the ground
around them by much (retroreflecting sheets) take their distance from the ground (method section
8.2). Scanner frame, metres.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tribrach.targets.board_plane import BoardPlane, fit_board_plane
from tribrach.targets.disc_center import posterior
from tribrach.targets.disc_edge import (
    PATCH,
    DiscShape,
    EdgeFit,
    departure,
    light_of,
    solve,
)
from tribrach.targets.disc_surface import bend, distance

__all__ = ["DiscFit", "NoDisc", "fit_disc"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

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
    on: Flags
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

    def _clean(self, on: Flags, gate: float) -> Flags:
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
