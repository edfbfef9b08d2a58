"""Finds the flat printed discs of known radii in a scan and lists the refused ones.

At every pixel the surface is taken as the plane through its neighbours at the distance of the
disc's radius, so that a circle in metres on the surface becomes its ellipse in pixels. Intensity on
a circle inside of the disc is compared with that on a circle outside of it: where both differ much,
a round spot, lighter or darker than its ground, is a candidate and is fitted (method section 8.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.instruments.beam import Beam
from tribrach.instruments.neighbours import SharedNoise
from tribrach.kernels import in_threads, njit
from tribrach.scan.range_image import RangeImage
from tribrach.sentences import Sentence
from tribrach.targets.detection import Detection, Rejected, lies_on
from tribrach.targets.discs.fit import DiscFit, fit_disc
from tribrach.targets.prints.search import PrintCandidate, PrintSearch, Refused, footprint_at
from tribrach.targets.prints.windows import on_circle, shortening, slope


@dataclass(frozen=True)
class SpotGates:
    """Which round spots of intensity are candidates for discs, and how many of them are fitted.

    Chosen by hand with test_discs, benchmarks/target_search.
    """

    #: radii of the circles inside of the disc and on its ground, over its radius
    inner_circle_radii: float = 0.5
    outer_circle_radii: float = 1.4
    #: directions along the outer circle; the inner one has every second of them
    circle_samples: int = 16
    #: smaller discs are not sought; seen obliquely they may be smaller by half
    least_radius_px: float = 1.2
    #: nearer pixels are not looked at: the housing of the scanner and its legs
    nearest_m: float = 0.3
    #: from one pixel that is looked at to the next, over the radius of the disc
    stride_radii: float = 0.2
    #: least difference of light on both circles over the sum of the spreads along them
    least_strength: float = 1.6
    #: least share of the samples of a circle that lies on the surface
    samples_on_surface_share: float = 0.65
    #: a sample lies on the surface within this, over the radius of the disc
    surface_tolerance_radii: float = 0.35
    #: squared tangent of the steepest incidence that a candidate may have (70 degrees, some more
    #: than the fit accepts)
    steepest_tangent_squared: float = float(np.tan(np.radians(70.0)) ** 2)
    #: spots of one radius that are followed up, the strongest first: bounds the time
    most_spots: int = 600
    #: least spread of light along a circle, over the swing of the light of the whole scan
    least_spread_share: float = 1e-3
    #: refusals of spots at least this strong are listed even if they look like texture
    listed_strength: float = 4.0
    #: candidates nearer than this to a disc of the same radius are that disc [radii]
    same_start_radii: float = 0.5
    #: fits nearer than this are one disc, the one that explains more light [larger radii]
    same_disc_radii: float = 0.7
    #: refusals nearer than this to a disc are not listed [its radii]
    refused_beside_radii: float = 1.6
    few_points: int = 100  #: a disc on fewer points says so
    part_seen_share: float = 0.9  #: a disc whose edge is seen on less of the circle says so


GATES = SpotGates()

# compiled code reads constants of the module, not attributes of an object
_INNER_CIRCLE_RADII = GATES.inner_circle_radii
_OUTER_CIRCLE_RADII = GATES.outer_circle_radii
_LEAST_RADIUS_PX = GATES.least_radius_px
_NEAREST_M = GATES.nearest_m
_STRIDE_RADII = GATES.stride_radii
_SAMPLES_ON_SURFACE_SHARE = GATES.samples_on_surface_share
_SURFACE_TOLERANCE_RADII = GATES.surface_tolerance_radii
_STEEPEST_TANGENT_SQUARED = GATES.steepest_tangent_squared


def candidates(
    image: RangeImage, intensity: NDArray[np.float32], radius: float
) -> list[PrintCandidate]:
    """Pixels at the middle of round spots of a given radius."""
    light = np.where(image.index >= 0, intensity[np.maximum(image.index, 0)], np.nan)
    light = light.astype(np.float32)
    ranges = image.filled()
    sines = np.maximum(np.abs(np.sin(image.v())), 0.05)
    steps = np.stack([np.full_like(sines, image.step_v), image.step_h * sines], axis=1)
    turns = 2 * np.pi * np.arange(GATES.circle_samples) / GATES.circle_samples
    wave = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    score = np.zeros(image.shape, dtype=np.float32)
    given = light, ranges, steps, wave, radius, _least_spread(intensity), image.wraps
    in_threads(_score, len(score), *given, score, least=16)
    rows, columns = np.nonzero(score > GATES.least_strength)
    strength = score[rows, columns].astype(float)
    order = np.argsort(-strength, kind="stable")
    rows, columns, strength = rows[order], columns[order], strength[order]
    kept = _apart(rows, columns, ranges, steps, radius, image.wraps, GATES.most_spots)
    return [
        PrintCandidate(
            int(rows[k]), int(columns[k]), notable=bool(strength[k] > GATES.listed_strength)
        )
        for k in kept
    ]


def _least_spread(intensity: NDArray[np.float32]) -> float:
    """A spread of light that plain print has at least: a thousandth of that of the scan."""
    some = intensity[:: max(1, len(intensity) // 100_000)]
    some = some[np.isfinite(some)]
    if len(some) == 0:
        return 1.0
    low, high = np.quantile(some, [0.01, 0.99])
    return max(GATES.least_spread_share * float(high - low), 1e-12)


@njit(cache=True, nogil=True)
def _score(first, last, light, ranges, steps, wave, radius, least, wraps, out):  # type: ignore[no-untyped-def]
    """Strength of the spot around every pixel that is looked at, 0 where there is none."""
    for i in range(first, last):
        for j in range(light.shape[1]):
            r = ranges[i, j]
            if not r > _NEAREST_M:
                continue
            ry, rx = radius / (r * steps[i, 0]), radius / (r * steps[i, 1])
            if min(rx, ry) < _LEAST_RADIUS_PX:
                continue
            # large discs need not be tried at every pixel
            if i % max(1, int(_STRIDE_RADII * ry)) or j % max(1, int(_STRIDE_RADII * rx)):
                continue
            p, q = slope(ranges, i, j, rx, ry, steps, wraps)
            if p * p + q * q < _STEEPEST_TANGENT_SQUARED:
                out[i, j] = _spot(light, ranges, i, j, p, q, steps[i], wave, radius, least, wraps)


@njit(cache=True, nogil=True, inline="always")
def _spot(light, ranges, i, j, p, q, step, wave, radius, least, wraps):  # type: ignore[no-untyped-def]
    """Difference of the light on both circles over the sum of its spreads along them."""
    rows, columns = light.shape
    r = ranges[i, j]
    short = shortening(p, q)
    mean, spread = np.zeros(2), np.zeros(2)
    for circle in range(2):
        size = radius * (_OUTER_CIRCLE_RADII if circle else _INNER_CIRCLE_RADII)
        count, total, squares = 0, 0.0, 0.0
        stride = 1 if circle else 2
        for k in range(0, len(wave), stride):
            x, y = on_circle(wave[k, 0], wave[k, 1], size, p, q, short)
            a = int(np.rint(i + y / (r * step[0])))
            b = int(np.rint(j + x / (r * step[1])))
            if wraps:
                b %= columns
            if a < 0 or a >= rows or b < 0 or b >= columns:
                continue
            value = light[a, b]
            depth = ranges[a, b] - r - p * x - q * y
            if np.isnan(value) or not abs(depth) < _SURFACE_TOLERANCE_RADII * radius:
                continue
            count += 1
            total += value
            squares += value * value
        if count < _SAMPLES_ON_SURFACE_SHARE * len(wave) / stride:
            return 0.0
        mean[circle] = total / count
        spread[circle] = np.sqrt(max(squares / count - mean[circle] ** 2, 0.0))
    strength: float = abs(mean[0] - mean[1]) / (spread[0] + spread[1] + least)
    return strength


@njit(cache=True, nogil=True)
def _apart(rows, columns, ranges, steps, radius, wraps, most):  # type: ignore[no-untyped-def]
    """Numbers of the spots, strongest first, that are a radius from all before."""
    taken = np.zeros(ranges.shape, dtype=np.bool_)
    height, width = ranges.shape
    kept = np.empty(min(most, len(rows)), dtype=np.int64)
    count = 0
    for n in range(len(rows)):
        i, j = rows[n], columns[n]
        if taken[i, j]:
            continue
        kept[count] = n
        count += 1
        if count == most:
            break
        ry = radius / (ranges[i, j] * steps[i, 0])
        rx = min(radius / (ranges[i, j] * steps[i, 1]), width / 2 - 1)
        for a in range(max(0, int(i - ry)), min(height, int(i + ry) + 1)):
            half = rx * np.sqrt(max(0.0, 1 - ((a - i) / ry) ** 2))
            for b in range(int(np.ceil(j - half)), int(j + half) + 1):
                if wraps:
                    taken[a, b % width] = True
                elif 0 <= b < width:
                    taken[a, b] = True
    return kept[:count]


def find_discs(
    xyz: Array,
    intensity: NDArray[np.float32],
    image: RangeImage,
    radii: Sequence[float],
    *,
    sigma_range: float | None = None,
    sigma_angle: float | None = None,
    footprint: Beam | None = None,
    floor: float = 0.0,
    shared: SharedNoise | None = None,
    scan: str = "",
) -> tuple[list[Detection], list[Rejected]]:
    """Find printed discs of given radii in a scan; sigmas and beam that are None are estimated.

    Discs may be white on dark, dark on white or retroreflecting. The ground must be of one plane
    and one shade to half a radius beyond the edge.
    """
    if not all(radius > 0 for radius in radii):
        raise InputError("the radius of a disc must be positive")

    def fit(window: NDArray[np.int32], start: Array, radius: float) -> DiscFit | Refused:
        return fit_disc(
            xyz[window],
            intensity[window],
            start,
            radius,
            footprint=None if footprint is None else footprint_at(footprint, start),
            sigma_range=sigma_range,
            sigma_angle=sigma_angle,
            floor=floor,
            shared=shared,
        )

    search = PrintSearch(
        kind="disc",
        candidates=lambda radius: candidates(image, intensity, radius),
        fit=fit,
        reach_sizes=2.0,
        same_start_sizes=GATES.same_start_radii,
        same_size_only=True,
        same_target_sizes=GATES.same_disc_radii,
    )
    fits, rejected = search.run(image, radii)
    discs = [_detection(fit, radius, scan) for fit, radius in fits]
    return discs, _without_repeats(rejected, discs)


def _without_repeats(rejected: Sequence[Rejected], discs: Sequence[Detection]) -> list[Rejected]:
    """Refusals that are not on a disc, nor repeat another at the same place."""
    out: list[Rejected] = []
    for r in rejected:
        if lies_on(r.center, discs, GATES.refused_beside_radii):
            continue
        if any(o.reason == r.reason and np.allclose(o.center, r.center) for o in out):
            continue
        out.append(r)
    return out


def _detection(fit: DiscFit, radius: float, scan: str) -> Detection:
    """A fit as the network wants it."""
    sentences = []
    if fit.points < GATES.few_points:
        sentences.append(f"only {fit.points} points on and around it")
    if fit.coverage < GATES.part_seen_share:
        sentences.append(Sentence("its edge is seen on {fit.coverage:%0} of the circle", fit=fit))
    if fit.retro:
        taken = "whose distance is taken" if fit.gain > 0 else "which is the lighter one"
        sentences.append(
            Sentence(
                "its print reads {fit.split:mm+1} against the ground, {taken}", fit=fit, taken=taken
            )
        )
    return Detection(
        kind="disc",
        scan=scan,
        center=fit.center,
        covariance=fit.covariance,
        radius=radius,
        rms=fit.rms,
        points=fit.points,
        inliers=fit.inliers,
        range=float(np.linalg.norm(fit.center)),
        incidence=fit.incidence,
        coverage=fit.coverage,
        facts={
            "contrast": fit.contrast,
            "gain": fit.gain,
            "explained": fit.explained,
            "seen_radius_m": fit.radius,
            "blur_m": fit.blur,
            "disc_minus_ground_m": fit.split,
        },
        sentences=tuple(sentences),
    )
