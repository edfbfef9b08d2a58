"""Finds the checkerboards of known sides in a scan and lists the refused ones (method section 8.2).

Around the centre of a 2x2 checkerboard intensity changes sign at every quarter turn: the second
harmonic along a circle is strong and opposite samples are alike. The circle has a size in metres on
the surface that the neighbours of a pixel define, and is an ellipse of pixels where the surface is
seen obliquely. The pixels with the strongest harmonics are candidates and are fitted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Single
from tribrach.errors import InputError
from tribrach.instruments.beam import Beam
from tribrach.instruments.neighbours import SharedNoise
from tribrach.kernels import in_threads, njit
from tribrach.scan.range_image import RangeImage
from tribrach.targets.checkerboards.fit import CheckerboardFit, fit_checkerboard
from tribrach.targets.detection import Detection, Rejected, lies_on
from tribrach.targets.prints.search import PrintCandidate, PrintSearch, Refused, footprint_at
from tribrach.targets.prints.windows import on_circle, shortening, slope

#: a beam of which nothing is published (method section 5.2)
_USUAL = Beam(4e-3, 0.3e-3)


@dataclass(frozen=True)
class SaddleGates:
    """What the search for boards takes for a saddle of light, and how many it follows up.

    Chosen by hand with test_checkerboards, benchmarks/target_search.
    """

    #: radii of the two circles over the side of the board
    circle_sides: tuple[float, float] = (0.22, 0.36)
    circle_samples: int = 16  #: samples along a circle
    least_circle_px: float = 1.3  #: smaller circles cannot be judged
    #: nearer pixels are not looked at: the housing of the scanner and its legs
    nearest_m: float = 0.3
    slope_sides: float = 0.5  #: the slope of the surface is taken over this part of the side
    #: least strength of the second harmonic over the amplitude; 2/pi for an ideal board
    least_strength: float = 0.30
    #: from one pixel that is looked at to the next, over the side; where that is every second
    #: pixel this larger share has to allow it
    stride_sides: float = 0.06
    second_stride_sides: float = 0.11
    least_change: float = 0.08  #: least half swing of light over its mean along both circles ...
    #: ... and in a few places of the inner one: these exclude most of a scan
    plain_change: float = 0.05
    #: mean distance of a circle from the surface, over the side: print is flat
    surface_tolerance_sides: float = 0.25
    #: opposite samples may differ by this share of the swing; what is more costs by half
    unlike_share: float = 0.25
    unlike_cost: float = 0.5
    #: squared tangent of the steepest incidence that a candidate may have (70 degrees, some more
    #: than the fit accepts)
    steepest_tangent_squared: float = float(np.tan(np.radians(70.0)) ** 2)
    #: candidates of one side that are followed up, the strongest first: bounds the time
    most_candidates: int = 400
    apart_sides: float = 0.5  #: candidates nearer than this are one [sides]
    #: candidates nearer than this to a board are that board [its sides]
    same_start_sides: float = 0.4
    #: fits nearer than this are one board, the one that explains more light [larger sides]
    same_board_sides: float = 0.5
    #: refusals nearer than this to a board are not listed [half its side]
    refused_beside_halves: float = 2.5
    few_points: int = 100  #: a board on fewer points says so


GATES = SaddleGates()

# compiled code reads constants of the module, not attributes of an object
_LEAST_CIRCLE_PX = GATES.least_circle_px
_NEAREST_M = GATES.nearest_m
_SLOPE_SIDES = GATES.slope_sides
_STRIDE_SIDES = GATES.stride_sides
_SECOND_STRIDE_SIDES = GATES.second_stride_sides
_LEAST_CHANGE = GATES.least_change
_PLAIN_CHANGE = GATES.plain_change
_SURFACE_TOLERANCE_SIDES = GATES.surface_tolerance_sides
_UNLIKE_SHARE = GATES.unlike_share
_UNLIKE_COST = GATES.unlike_cost
_STEEPEST_TANGENT_SQUARED = GATES.steepest_tangent_squared
_APART_SIDES = GATES.apart_sides


def candidates(
    image: RangeImage, intensity: NDArray[np.float32], side: float
) -> list[PrintCandidate]:
    """Pixels where intensity has a saddle, as at the centre of a board."""
    light = _light(image.index, intensity)
    sv = np.maximum(np.abs(np.sin(image.v())), 0.05)
    steps = np.stack([np.full_like(sv, image.step_v), image.step_h * sv], axis=1)
    score = np.zeros(image.shape, dtype=np.float32)
    turns = 2 * np.pi * np.arange(GATES.circle_samples) / GATES.circle_samples
    wave = np.stack([np.sin(turns), np.cos(turns), np.sin(2 * turns), np.cos(2 * turns)])
    ranges = image.filled()
    given = light, ranges, steps, wave, np.array(GATES.circle_sides), side, image.wraps
    in_threads(_score, len(score), *given, score, least=16)
    rows, columns = np.nonzero(score > GATES.least_strength)
    order = np.argsort(-score[rows, columns], kind="stable")
    kept = _apart(
        rows[order].astype(np.int64),
        columns[order].astype(np.int64),
        ranges,
        steps,
        side,
        image.wraps,
        GATES.most_candidates,
    )
    chosen = order[kept]
    return [
        PrintCandidate(int(i), int(j)) for i, j in zip(rows[chosen], columns[chosen], strict=True)
    ]


def _light(index: NDArray[np.int32], intensity: NDArray[np.float32]) -> Single:
    """Intensity image, single holes filled by a neighbour, NaN elsewhere."""
    light = np.where(index >= 0, intensity[np.maximum(index, 0)], np.nan).astype(np.float32)
    for axis in (1, 0):
        hole = np.isnan(light)
        shifted = np.roll(light, 1, axis=axis)
        light[hole] = shifted[hole]
    return light


@njit(cache=True, nogil=True)
def _score(first, last, light, ranges, steps, wave, radii, side, wraps, out):  # type: ignore[no-untyped-def]
    """Strength of the saddle at every pixel, 0 where there is none."""
    for i in range(first, last):
        for j in range(light.shape[1]):
            r = ranges[i, j]
            if not r > _NEAREST_M:
                continue
            ry, rx = side / (r * steps[i, 0]), side / (r * steps[i, 1])
            if radii[0] * min(rx, ry) < _LEAST_CIRCLE_PX:
                continue
            if i % _stride(ry) or j % _stride(rx):
                continue
            p, q = slope(ranges, i, j, _SLOPE_SIDES * rx, _SLOPE_SIDES * ry, steps, wraps)
            if p * p + q * q < _STEEPEST_TANGENT_SQUARED:
                step = steps[i] * r
                out[i, j] = _saddle(light, ranges, i, j, p, q, step, wave, radii, side, wraps)


@njit(cache=True, nogil=True, inline="always")
def _stride(size):  # type: ignore[no-untyped-def]
    """Pixels from one that is looked at to the next for boards of this side [pixels]."""
    return max(1, int(_STRIDE_SIDES * size), min(2, int(_SECOND_STRIDE_SIDES * size)))


@njit(cache=True, nogil=True, inline="always")
def _saddle(light, ranges, i, j, p, q, step, wave, radii, side, wraps):  # type: ignore[no-untyped-def]
    """Strength of one pixel: mean second harmonic of the circles over the amplitude of light."""
    rows, columns = light.shape
    count = wave.shape[1]
    short = shortening(p, q)
    if _plain(light, i, j, p, q, short, step, wave, radii[0] * side, wraps):
        return 0.0
    re, im, odd, low, high, mean = 0.0, 0.0, 0.0, np.inf, -np.inf, 0.0
    values = np.empty(count)
    for radius in radii:
        bend = 0.0
        for k in range(count):
            x, y = on_circle(wave[1, k], wave[0, k], radius * side, p, q, short)
            a, b = int(np.rint(i + y / step[0])), int(np.rint(j + x / step[1]))
            if wraps:
                b %= columns
            if a < 0 or a >= rows or b < 0 or b >= columns:
                return 0.0
            value, depth = light[a, b], ranges[a, b]
            if np.isnan(value) or np.isnan(depth):
                return 0.0
            values[k] = value
            bend += abs(depth - ranges[i, j] - p * x - q * y)
            re += value * wave[3, k]
            im += value * wave[2, k]
            mean += value
            low, high = min(low, value), max(high, value)
        # the print is flat
        if bend / count > _SURFACE_TOLERANCE_SIDES * side:
            return 0.0
        for k in range(count // 2):
            odd += abs(values[k] - values[k + count // 2])
    n = count * len(radii)
    half = 0.5 * (high - low)
    if half < _LEAST_CHANGE * abs(mean / n) or half <= 0:
        return 0.0
    strength = np.sqrt(re * re + im * im) / n / half
    unlike = odd / (n / 2) / (2 * half)
    return strength - _UNLIKE_COST * max(0.0, unlike - _UNLIKE_SHARE)


@njit(cache=True, nogil=True, inline="always")
def _plain(light, i, j, p, q, short, step, wave, size, wraps):  # type: ignore[no-untyped-def]
    """Does light hardly change between some places of a circle? Most of a scan is like that."""
    rows, columns = light.shape
    low, high = np.inf, -np.inf
    for k in range(0, wave.shape[1], 2):
        x, y = on_circle(wave[1, k], wave[0, k], size, p, q, short)
        a, b = int(np.rint(i + y / step[0])), int(np.rint(j + x / step[1]))
        if wraps:
            b %= columns
        if a < 0 or a >= rows or b < 0 or b >= columns or np.isnan(light[a, b]):
            return True
        low, high = min(low, light[a, b]), max(high, light[a, b])
    return high - low < _PLAIN_CHANGE * abs(high + low)


@njit(cache=True, nogil=True)
def _apart(rows, columns, ranges, steps, side, wraps, most):  # type: ignore[no-untyped-def]
    """Numbers of the candidates, strongest first, that are half a side from all before."""
    kept = np.empty(len(rows), dtype=np.int64)
    count = 0
    width = ranges.shape[1]
    for n in range(len(rows)):
        i, j = rows[n], columns[n]
        reach_y = _APART_SIDES * side / (ranges[i, j] * steps[i, 0])
        reach_x = _APART_SIDES * side / (ranges[i, j] * steps[i, 1])
        free = True
        for m in range(count):
            dy = abs(rows[kept[m]] - i)
            dx = abs(columns[kept[m]] - j)
            if wraps:
                dx = min(dx, width - dx)
            if (dx / reach_x) ** 2 + (dy / reach_y) ** 2 < 1:
                free = False
                break
        if free:
            kept[count] = n
            count += 1
            if count == most:
                break
    return kept[:count]


def find_checkerboards(
    xyz: Array,
    intensity: NDArray[np.float32],
    image: RangeImage,
    sides: Sequence[float],
    *,
    sigma_angle: float = 2e-5,
    footprint: Beam = _USUAL,
    floor: float = 3e-4,
    shared: SharedNoise | None = None,
    scan: str = "",
) -> tuple[list[Detection], list[Rejected]]:
    """Find checkerboards of given sides in a scan; ``floor`` is added to sigmas of centres [m]."""
    if not all(side > 0 for side in sides):
        raise InputError("the side of a checkerboard must be positive")

    def fit(window: NDArray[np.int32], start: Array, side: float) -> CheckerboardFit | Refused:
        return fit_checkerboard(
            xyz[window],
            intensity[window],
            start,
            side,
            footprint=footprint_at(footprint, start),
            sigma_angle=sigma_angle,
            floor=floor,
            shared=shared,
        )

    search = PrintSearch(
        kind="checkerboard",
        candidates=lambda side: candidates(image, intensity, side),
        fit=fit,
        reach_sizes=1.0,
        same_start_sizes=GATES.same_start_sides,
        same_size_only=False,
        same_target_sizes=GATES.same_board_sides,
    )
    fits, rejected = search.run(image, sides)
    boards = [_detection(fit, side, image, scan) for fit, side in fits]
    beside = GATES.refused_beside_halves
    return boards, [r for r in rejected if not lies_on(r.center, boards, beside)]


def _detection(fit: CheckerboardFit, side: float, image: RangeImage, scan: str) -> Detection:
    """A fit as the network wants it."""
    away = float(np.linalg.norm(fit.center))
    sine = max(float(np.hypot(*fit.center[:2])) / away, 0.05)
    pixels = side**2 * np.cos(fit.incidence) / (away**2 * image.step_h * image.step_v * sine)
    density = np.radians(1) / np.sqrt(image.step_h * image.step_v * sine)
    sentences = () if fit.points >= GATES.few_points else (f"only {fit.points} points",)
    return Detection(
        kind="checkerboard",
        scan=scan,
        center=fit.center,
        covariance=fit.covariance,
        radius=side / 2,
        rms=fit.rms,
        points=fit.points,
        inliers=fit.points,
        range=away,
        incidence=fit.incidence,
        coverage=float(min(1.0, fit.points / max(pixels, 1.0))),
        facts={
            "contrast": fit.contrast,
            "explained": fit.explained,
            "turn_rad": fit.turn,
            "skew_rad": fit.skew,
            "blur_m": fit.blur,
            "white_minus_black_m": fit.plane.split,
            "points_per_degree": float(density),
        },
        sentences=sentences,
    )
