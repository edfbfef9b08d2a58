"""Measures a printed disc of known radius: the plane of the print, then its edge.

Intensities are carried along their beams into the plane. The edge gives the direction of the
centre, the plane its distance; the covariance is that of both. Discs whose print reads a range very
different from the ground around them (retroreflecting sheets) take their distance from the ground
(method section 8.2). Scanner frame, metres.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tribrach._types import Array, Mask
from tribrach.instruments.neighbours import RangeCorrelation, SharedNoise
from tribrach.sentences import Sentence
from tribrach.statistics import robust_sigma
from tribrach.targets.discs.edge import GATES as EDGE
from tribrach.targets.discs.edge import DiscShape, EdgeFit, departure, light_of, posterior, solve
from tribrach.targets.prints.edges import usual_noise
from tribrach.targets.prints.plane import BoardPlane, fit_board_plane
from tribrach.targets.prints.search import Refused


@dataclass(frozen=True)
class DiscGates:
    """The numbers that decide whether a fitted spot is a printed disc.

    Chosen by hand with test_discs, benchmarks/target_search.
    """

    reach_radii: float = 1.8  #: points looked at lie within this many radii of the start
    #: fewest points around a disc, and on it
    fewest_points: int = 16
    fewest_on_disc: int = 8
    fewest_for_light: int = 3  #: fewest points inside and around that tell the light of a start
    #: the start takes what lies within this as disc, what lies between the others as ground
    start_inside_radii: float = 0.6
    start_ground_radii: tuple[float, float] = (1.15, 1.6)
    #: points as light as the disc count for its start within this many radii
    start_like_radii: float = 1.2
    #: bright and dark are parted halfway between these quantiles of light
    light_quantiles: tuple[float, float] = (0.1, 0.9)

    #: the print is not looked at more obliquely than this [rad]
    steepest_rad: float = float(np.radians(66.0))
    #: points are on the plane within this many of its rms, at least within this share of the radius
    on_plane_sigmas: float = 5.0
    on_plane_radii: float = 0.03
    on_plane_share: float = 0.5  #: least share of the points around that is on the plane
    #: largest rms of the plane: over the radius, or over the known noise of ranges
    most_rms_radii: float = 0.06
    most_rms_sigmas: float = 4.0
    #: points are off the plane beyond this many widths of the gate, at least beyond this [m];
    #: beams that brush them are left out, within this many diameters of the beam
    off_plane_gates: float = 3.0
    off_plane_m: float = 0.01
    brushing_footprints: float = 0.6
    #: largest bend of the print over its radius, or in sigmas (``radius_sigmas``)
    bend_radii: float = 0.02
    bend_reach_radii: float = 1.3  #: the bend is estimated from points within this many radii
    bend_points: int = 12  #: fewer points tell no bend

    usual_angle_rad: float = 2e-5  #: sigma of the angles of a point where nobody states it [rad]
    #: blur of the edge where the beam is unknown, over the distance of points
    unknown_blur_pitches: float = 0.3
    #: how well the blur is predicted with a known beam and without, sigma of its logarithm
    blur_log_sigma: float = 0.5
    unknown_blur_log_sigma: float = 1.0
    #: sigma of the normal beam that blurs an edge as a footprint does, over its diameter
    blur_footprints: float = 0.25
    #: least blur over the radius, least jitter over the blur
    least_blur_radii: float = 2e-3
    least_jitter_blurs: float = 0.02
    #: sigma of the radius in the fit that leaves it free, over the radius
    free_radius_share: float = 0.2
    known_radius_share: float = 0.005  #: a print's radius is known to this share of it

    least_contrast: float = 5.0  #: least contrast over noise
    #: least share of the variance of light that the disc explains ...
    explained_share: float = 0.75
    #: ... and where points are nearer than ``close_pitch_radii`` and light has little noise
    clear_explained_share: float = 0.86
    close_pitch_radii: float = 0.1
    #: points so near the edge tell nothing in coarse scans: over their distance, over the radius
    edge_gap_pitches: float = 0.4
    edge_gap_radii: float = 0.2
    #: least share of the edge that is seen, and of that where light changes as it should
    edge_seen_share: float = 0.6
    edge_shown_share: float = 0.8
    #: sectors of the circle that the edge is judged in, and with so many points or fewer
    sectors: int = 24
    few_sectors: int = 8
    many_points: int = 240
    ring_radii: float = 0.5  #: the edge is judged by points beyond this many radii
    #: a sector is seen with this share of the points of the fullest
    sector_points_share: float = 0.2
    #: a sector tells of the edge if the variance of the disc's share in it is above this
    sector_swing: float = 0.1
    #: light changes in a sector if it does by this share of the gain
    sector_change_share: float = 0.5
    #: radius and roundness are right within this share of the radius, or within so many sigmas
    radius_share: float = 0.05
    radius_sigmas: float = 4.0
    #: a radius known no better than this share of itself is no evidence
    vague_radius_share: float = 0.25
    #: refusals are texture and not listed: low contrast and less explained than this ...
    texture_explained_share: float = 0.3
    #: ... less of the edge shown than this, or less explained by a disc of enough contrast
    texture_shown_share: float = 0.5
    texture_disc_share: float = 0.6
    #: print and ground that differ by more in range [m]: print that throws the beam back
    retro_m: float = 5e-3

    trim_sigmas: float = 3.5  #: residuals of the distance beyond this many sigmas take no part
    trim_rounds: int = 6  #: rounds of trimming at most
    foretold_points: int = 6  #: a predicted sigma of ranges counts as much as so many points
    least_sigma_m: float = 1e-6  #: least sigma of a range [m]
    #: cells along a side of the patch for the test of independence, points that one must hold, and
    #: cells that the test needs
    cells: int = 7
    cell_points: int = 4
    fewest_cells: int = 12
    #: variance of means over cells that chance makes of independent points, in its sigmas
    chance_sigmas: float = 2.0


GATES = DiscGates()


def bend(place: Array, residual: Array, bright: Mask) -> tuple[float, float]:
    """Largest bend [m] of a print over its radius, from a surface of second degree, and its sigma.

    Places are in units of the radius; each colour may have a range offset of its own.
    """
    x, y = place.T
    a = np.column_stack([bright, ~bright, x, y, x * x, x * y, y * y]).astype(float)
    if len(a) < GATES.bend_points:
        return 0.0, 0.0
    x_hat, _, rank, _ = np.linalg.lstsq(a, residual)
    if rank < a.shape[1]:
        a = np.delete(a, 1, axis=1)
        x_hat = np.linalg.lstsq(a, residual)[0]
    left = residual - a @ x_hat
    variance = float(left @ left) / max(len(a) - a.shape[1], 1)
    cover = np.linalg.pinv(a.T @ a) * variance
    xx, xy, yy = x_hat[-3:]
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
    shared: RangeCorrelation | None = None,
    xyz: Array | None = None,
) -> tuple[float, float]:
    """Distance [m] of the surface at the centre minus that of the plane, and its sigma.

    ``telling`` are the points of the colour whose range is the true one; ``sigma`` of a range is 0
    if not known; ``xyz`` tells who is a neighbour of whom.

    Least squares with the tilt and the range offset of the other colour free. Where neighbours err
    together (filtered ranges, an uneven print), means over cells scatter more than their numbers of
    points allow, and the sigma is raised accordingly; not below what the scanner's neighbours are
    known to share (method section 5.7).
    """
    x = place / radius
    a = np.column_stack([np.ones(len(x)), x, ~telling]).astype(float)
    if telling.all() or not telling.any():
        a = a[:, :3]
    use, estimate = np.ones(len(x), dtype=bool), np.zeros(a.shape[1])
    left, own = residual, np.ones(len(x))
    for turn in range(GATES.trim_rounds):
        own = _sigmas(left, bright, use, sigma, robust=turn == 0)
        before, use = use, np.abs(left) < GATES.trim_sigmas * own
        w = use / own**2
        cover = np.linalg.pinv((a * w[:, None]).T @ a)
        estimate = cover @ (a.T @ (w * residual))
        left = residual - a @ estimate
        if turn > 1 and (before == use).all():
            break
    variance = cover[0, 0] * _excess(x[use], (left / own)[use])
    if shared is not None and xyz is not None:
        unit = xyz[use] / np.linalg.norm(xyz[use], axis=1, keepdims=True)
        pairs = shared.summed(unit, a[use] / own[use, None])
        variance = max(variance, (cover + cover @ pairs @ cover)[0, 0])
    return float(estimate[0]), float(np.sqrt(variance))


def _sigmas(left: Array, bright: Mask, use: Mask, sigma: float, *, robust: bool) -> Array:
    """Sigma (n,) of each point [m]: that of its colour, held near the predicted one."""
    out = np.empty(len(left))
    for colour in (False, True):
        own = bright == colour
        part = left[own & use]
        n = len(part)
        if robust and n > 3:
            size = robust_sigma(part)
            square = max(size, sigma) ** 2 * n
        else:
            square = float(part @ part)
        held = GATES.foretold_points if sigma > 0 else 0
        # two of the four unknowns are each colour's; the spread of a spread widens what it says
        freedom = max(n - 2 + held - 2, 1)
        out[own] = np.sqrt((square + held * sigma**2) / freedom)
    return np.maximum(out, GATES.least_sigma_m)


def _excess(x: Array, left: Array) -> float:
    """Variance of means over cells times their numbers, over that of single points, at least 1."""
    cell = np.floor((x + 1.5) * (GATES.cells / 3)).astype(int).clip(0, GATES.cells - 1)
    number = cell[:, 0] * GATES.cells + cell[:, 1]
    count = np.bincount(number, minlength=GATES.cells**2)
    held = count >= GATES.cell_points
    if held.sum() < GATES.fewest_cells:
        return 1.0
    total = np.bincount(number, left, GATES.cells**2)[held]
    ratio = float((total**2 / count[held]).sum() / (held.sum() - 4))
    # what chance makes of independent points is not taken for more
    chance = 1 + GATES.chance_sigmas * float(np.sqrt(2 / (held.sum() - 4)))
    return max(1.0, ratio) if ratio > chance else 1.0


@dataclass(frozen=True)
class DiscFit:
    """A measured disc."""

    center: Array  #: (3,), centre in the scanner frame [m]
    covariance: Array  #: (3, 3), its covariance, floor included [m^2]
    plane: BoardPlane  #: plane of the print
    flat: Array  #: (2, 2), covariance of the centre in the plane [m^2]
    distance_sigma: float  #: sigma of the centre along the beam [m]
    rms: float  #: root mean square of the range residuals [m]
    gain: float  #: intensity of the disc minus that of the ground
    contrast: float  #: size of the gain over the noise
    explained: float  #: share of the variance of intensity that the disc explains
    radius: float  #: radius as seen [m]
    blur: float  #: sigma of the edge as seen [m]
    coverage: float  #: share of the edge that was seen
    split: float  #: range of the disc minus that of the ground [m]
    incidence: float  #: angle between beam and normal of the print [rad]
    points: int  #: number of points on and around the disc
    inliers: int  #: number of points that determined the centre

    @property
    def retro(self) -> bool:
        """True if the print is retroreflecting: its distance is taken from the ground around."""
        return abs(self.split) > GATES.retro_m


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
    shared: SharedNoise | None = None,
) -> DiscFit | Refused:
    """Fit a disc of known radius within half of it; footprint and sigmas are estimated if None."""
    light = np.asarray(intensity, dtype=float)
    close = (np.linalg.norm(xyz - start, axis=1) < GATES.reach_radii * radius) & np.isfinite(light)
    if close.sum() < GATES.fewest_points:
        return Refused(
            f"only {int(close.sum())} points on and around it, {GATES.fewest_points} are needed"
        )
    patch = _Patch(xyz[close], light[close], radius, footprint, sigma_range, sigma_angle, shared)
    first = patch.placed(start)
    # the first plane is that of what lies around the start, the second that of the print alone
    solved = first if isinstance(first, Refused) else patch.placed(patch.plane.at(first.p[:2]))
    if isinstance(solved, Refused):
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
        shared: SharedNoise | None,
    ) -> None:
        self.xyz, self.light, self.radius = xyz, light, radius
        self.footprint, self.sigma_range, self.sigma_angle = footprint, sigma_range, sigma_angle
        self.shared = shared

    def placed(self, near: Array) -> EdgeFit | Refused:
        """The edge in the plane of what lies around a place (3,), its radius free."""
        refused = self.lay(near)
        return self.seek() if refused is None else refused

    def lay(self, near: Array) -> Refused | None:
        """Fit the plane around a place (3,) and find the points that lie on it."""
        use = np.linalg.norm(self.xyz - near, axis=1) < EDGE.patch_radii * self.radius
        if use.sum() < GATES.fewest_points:
            return Refused(
                f"only {int(use.sum())} points on and around it, {GATES.fewest_points} are needed"
            )
        low, high = np.quantile(self.light[use], GATES.light_quantiles)
        self.bright = self.light > (low + high) / 2
        plane = fit_board_plane(self.xyz[use], self.bright[use], near, 0.0, self.shared)
        if plane is None:
            return Refused("it is not flat: the points around it lie in no plane")
        self.plane = plane
        away = float(np.linalg.norm(near))
        slope = abs(float(near @ plane.normal)) / away
        self.incidence = float(np.arccos(min(1.0, slope)))
        if self.incidence > GATES.steepest_rad:
            return Refused(Sentence("the beam meets it at {own.incidence:degrees0}", own=self))
        self.flat = plane.project(self.xyz)
        self.residual = self._residual()
        gate = max(GATES.on_plane_sigmas * plane.rms, GATES.on_plane_radii * self.radius)
        self.on = self._clean(np.abs(self.residual) < gate, gate)
        within = np.hypot(*self.flat.T) < EDGE.patch_radii * self.radius
        if not (self.on & within).sum() > GATES.on_plane_share * within.sum():
            return Refused("it is not flat: most of what lies around it is off its plane")
        most = max(GATES.most_rms_radii * self.radius, GATES.most_rms_sigmas * self._range_sigma())
        if plane.rms > most:
            return Refused(
                Sentence(
                    "it is not flat: its points scatter by {plane.rms:mm1} about their plane (root "
                    "mean square, limit {most:mm1})",
                    plane=plane,
                    most=most,
                )
            )
        self.shape = self._shape(near, int((self.on & within).sum()))
        return None

    def _residual(self) -> Array:
        """Range minus that of the plane (n,) [m], dark print without its offset."""
        unit = self.xyz / np.linalg.norm(self.xyz, axis=1, keepdims=True)
        residual = (self.xyz @ self.plane.normal - self.plane.offset) / (unit @ self.plane.normal)
        return np.asarray(residual + np.where(self.bright, 0.0, self.plane.split))

    def _range_sigma(self) -> float:
        """Known noise of ranges [m]; 0 if unknown."""
        if self.sigma_range is None:
            return 0.0
        across = (self.sigma_angle or 0.0) * float(np.linalg.norm(self.plane.origin))
        return float(np.hypot(self.sigma_range, across * np.tan(self.incidence)))

    def _clean(self, on: Mask, gate: float) -> Mask:
        """Points on the plane whose beams do not brush something off it."""
        off = np.abs(self.residual) > max(GATES.off_plane_gates * gate, GATES.off_plane_m)
        if not off.any() or not self.footprint or not on.any():
            return on
        reach = GATES.brushing_footprints * self.footprint / np.cos(self.incidence)
        distance, _ = cKDTree(self.flat[off]).query(self.flat[on], distance_upper_bound=reach)
        out = on.copy()
        out[np.flatnonzero(on)[np.isfinite(distance)]] = False
        return out

    def _shape(self, near: Array, count: int) -> DiscShape:
        """Prior knowledge of the disc."""
        away = float(np.linalg.norm(near))
        pitch = float(np.sqrt(np.pi / max(count, 1))) * EDGE.patch_radii * self.radius
        jitter = (GATES.usual_angle_rad if self.sigma_angle is None else self.sigma_angle) * away
        blur = (
            GATES.unknown_blur_pitches * pitch
            if self.footprint is None
            else GATES.blur_footprints * self.footprint
        )
        blur = max(float(np.hypot(blur, 0.5 * jitter)), GATES.least_blur_radii * self.radius)
        along = self.plane.axes @ near / away
        return DiscShape(
            self.radius,
            GATES.free_radius_share * self.radius,
            along / np.cos(self.incidence),
            blur,
            GATES.unknown_blur_log_sigma if self.footprint is None else GATES.blur_log_sigma,
            max(jitter, GATES.least_jitter_blurs * blur),
            pitch,
        )

    def seek(self) -> EdgeFit | Refused:
        """The edge with a free radius, if there is one."""
        flat, light = self.flat[self.on], self.light[self.on]
        away = np.hypot(*flat.T)
        low, high = GATES.start_ground_radii
        inner = away < GATES.start_inside_radii * self.radius
        ring = (away > low * self.radius) & (away < high * self.radius)
        if min(inner.sum(), ring.sum()) < GATES.fewest_for_light:
            return Refused(
                f"only {int(inner.sum())} points on it, {GATES.fewest_on_disc} are needed"
            )
        high, low = float(np.median(light[inner])), float(np.median(light[ring]))
        centre = np.zeros(2)
        for _ in range(3):
            like = (light - low) / (high - low if high != low else 1.0) > 0.5
            like &= np.hypot(*(flat - centre).T) < GATES.start_like_radii * self.radius
            if like.any():
                centre = flat[like].mean(axis=0)
        solved = solve(flat, light, np.array([*centre, low, high - low]), self.shape)
        if solved is None:
            return Refused("its light shows no disc", texture=True)
        return solved

    def judged(self, free: EdgeFit, floor: float) -> DiscFit | Refused:
        """The fit if it passes every test; ``free`` is the edge with a free radius."""
        flat, light = self.flat[self.on], self.light[self.on]
        reason = self._doubt(flat, light, free)
        if reason is not None:
            return reason
        known = replace(self.shape, radius_sigma=GATES.known_radius_share * self.radius)
        solved = solve(flat, light, free.p[:4], known)
        if solved is None:
            return Refused("the fit of its edge does not converge")
        centre, spread = posterior(flat, light, solved, known)
        return self._measured(solved, free, centre, spread, floor)

    def _doubt(self, flat: Array, light: Array, fit: EdgeFit) -> Refused | None:
        """Reason why a converged fit is not a disc of this size."""
        away = np.hypot(*(flat - fit.p[:2]).T)
        contrast = abs(fit.p[3]) / max(usual_noise(fit.noise), 1e-12)
        explained = _explained(flat, light, fit, self.shape)
        seen, shown = self._edge_seen(flat, light, fit)
        wrong = abs(fit.p[5] - self.radius)
        limit = max(
            GATES.radius_share * self.radius,
            GATES.radius_sigmas * float(np.hypot(np.sqrt(fit.covariance[5, 5]), self.shape.step)),
        )
        on_disc = int((away < self.radius).sum())
        if contrast < GATES.least_contrast:
            text = Sentence("its contrast is {contrast:1} times the noise, ", contrast=contrast)
            text += Sentence("{gates.least_contrast:g} are needed", gates=GATES)
            return Refused(text, explained < GATES.texture_explained_share)
        if seen < GATES.edge_seen_share:
            return Refused(
                Sentence(
                    "its edge is seen on one side only, on {seen:%0} of the circle, "
                    "{edge_seen_share:0} are needed",
                    seen=seen,
                    edge_seen_share=100 * GATES.edge_seen_share,
                )
            )
        if on_disc < GATES.fewest_on_disc:
            return Refused(f"only {on_disc} points on it, {GATES.fewest_on_disc} are needed")
        if shown < GATES.edge_shown_share:
            return Refused(
                Sentence("light changes on {shown:%0} of its edge only", shown=shown),
                shown < GATES.texture_shown_share,
            )
        needed = self._needed(contrast)
        if explained < needed:
            text = Sentence(
                "a disc explains {explained:%0} of its light, {needed:0} are needed",
                explained=explained,
                needed=100 * needed,
            )
            return Refused(text, explained < GATES.texture_disc_share)
        if wrong > limit or limit > GATES.vague_radius_share * self.radius:
            radii = Sentence("{fit.p[5]:mm1}, not {own.radius:mmg}", fit=fit, own=self)
            return Refused(Sentence("it has the wrong radius: {radii}", radii=radii))
        size, sigma = departure(flat, light, fit, self.shape)
        sigma = float(np.hypot(sigma, np.sqrt(2) * self.shape.step))
        most = max(GATES.radius_share * self.radius, GATES.radius_sigmas * sigma)
        if size > most:
            return Refused(
                Sentence(
                    "its edge is no circle: it departs from one by {size:mm1} (largest amplitude "
                    "of a wave around it, limit {most:mm1})",
                    size=size,
                    most=most,
                )
            )
        sag, sigma = self._bend(fit)
        if sag > max(GATES.bend_radii * self.radius, GATES.radius_sigmas * sigma):
            return Refused(
                Sentence("it is not flat: it bends by {sag:mm1} over its radius", sag=sag)
            )
        return None

    def _needed(self, contrast: float) -> float:
        """Least share of the variance of light that a disc of this contrast explains."""
        if self.shape.pitch > GATES.close_pitch_radii * self.radius:
            return GATES.explained_share
        inside = 1 / EDGE.patch_radii**2
        noise = 1 / (contrast**2 * inside * (1 - inside))
        return max(GATES.explained_share, GATES.clear_explained_share - 2 * noise)

    def _edge_seen(self, flat: Array, light: Array, fit: EdgeFit) -> tuple[float, float]:
        """Share of the edge that is seen, and the share of that where light changes."""
        d = flat - fit.p[:2]
        away = np.hypot(d[:, 0], d[:, 1])
        ring = (away > GATES.ring_radii * self.radius) & (away < EDGE.patch_radii * self.radius)
        sectors = GATES.sectors if ring.sum() > GATES.many_points else GATES.few_sectors
        sector = ((np.arctan2(d[:, 1], d[:, 0]) + np.pi) * (sectors / (2 * np.pi))).astype(int)
        sector = np.where(ring, sector % sectors, sectors)
        inside = light_of(flat, fit.p, self.shape.slope)[1][:, 3]
        n, f, i, ff, fi = (
            np.bincount(sector, x, sectors + 1)[:sectors]
            for x in (np.ones(len(d)), inside, light, inside**2, inside * light)
        )
        at = np.maximum(n, 1)
        swing, own = ff - f**2 / at, fi - f * i / at
        both = swing > GATES.sector_swing * at
        change = own[both] / swing[both] / fit.p[3]
        shown = float(np.mean(change > GATES.sector_change_share)) if both.any() else 0.0
        return float(np.mean(n > GATES.sector_points_share * n.max())), shown

    def _bend(self, fit: EdgeFit) -> tuple[float, float]:
        near = np.hypot(*(self.flat - fit.p[:2]).T) < GATES.bend_reach_radii * self.radius
        near &= self.on
        place = (self.flat[near] - fit.p[:2]) / self.radius
        return bend(place, self.residual[near], self.bright[near])

    def _measured(
        self, solved: EdgeFit, free: EdgeFit, centre: Array, spread: Array, floor: float
    ) -> DiscFit:
        """Centre and covariance from the edge and the plane."""
        plane, gain = self.plane, float(solved.p[3])
        split = plane.split if gain > 0 else -plane.split
        ground = abs(split) > GATES.retro_m and gain > 0
        use = self.on & (np.hypot(*(self.flat - centre).T) < EDGE.patch_radii * self.radius)
        telling = ~self.bright if ground else self.bright
        shift, sigma = distance(
            self.flat[use] - centre,
            self.residual[use],
            self.bright[use],
            telling[use],
            self.radius,
            self._range_sigma(),
            None if self.shared is None else self.shared.at(float(np.linalg.norm(plane.origin))),
            self.xyz[use],
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
            contrast=abs(gain) / max(usual_noise(solved.noise), 1e-12),
            explained=_explained(flat, light, solved, self.shape),
            radius=float(free.p[5]),
            blur=float(np.exp(solved.p[4])),
            coverage=self._edge_seen(flat, light, solved)[0],
            split=split,
            incidence=self.incidence,
            points=int((np.hypot(*(self.flat - centre).T) < EDGE.patch_radii * self.radius).sum()),
            inliers=int(solved.use.sum()),
        )


def _explained(flat: Array, light: Array, fit: EdgeFit, shape: DiscShape) -> float:
    """Share of variance that a disc explains, without distant points next to its edge."""
    away = np.hypot(*(flat - fit.p[:2]).T)
    near = away < EDGE.patch_radii * shape.radius
    if shape.coarse:
        near &= np.abs(away - shape.radius) > min(
            GATES.edge_gap_pitches * shape.pitch, GATES.edge_gap_radii * shape.radius
        )
    left = light[near] - light_of(flat[near], fit.p, shape.slope)[0]
    return 1 - float(left.var() / max(light[near].var(), 1e-12)) if near.any() else 0.0
