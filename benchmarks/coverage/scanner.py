"""Three simulated scanners: what they measure of a world, and what is wrong with it.

Errors are of the kinds that real scanners have: noise of ranges that grows with the range, with
weak light and on inclined surfaces; speckle and relief within the beam; beams that enter grass and
gravel; beams that meet two surfaces; noise of angles, a part of which turns slowly; a zero error,
a scale and an index error that all scans of a scene share; readings in steps; and a tripod that
turns and sinks while it scans. Data sheets (:meth:`Scanner.sheet`) state the class of each.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.coverage.world import MATERIALS, Array, World

__all__ = ["SCANNERS", "Scan", "Scanner", "exp", "scan"]

SEC = np.pi / 180 / 3600
_ROUGHNESS = np.array([m.roughness for m in MATERIALS.values()])
_DEPTH = np.array([m.depth for m in MATERIALS.values()])
_LIGHT = np.array([m.reflectance for m in MATERIALS.values()])
_GLOSS = np.array([m.gloss for m in MATERIALS.values()])
#: beams about the middle one where it passes an edge
_PARTS = 6


@dataclass(frozen=True)
class Scanner:
    """A scanner and the classes of its errors [m, rad]; all are standard deviations."""

    name: str
    #: beams of a scan, over all directions down to ``lowest``
    beams: int
    lowest: float
    #: of ranges: on white at 10 m, and with the range
    noise: float
    noise_per_range: float
    #: of single readings of both angles
    angle_noise: float
    #: of errors that turn slowly with the horizontal circle
    angle_wobble: float
    #: of the zero error, the scale and the index of vertical angles: one of each for an instrument
    zero: float
    scale: float
    index: float
    #: radius of the beam where it leaves, and half its angle
    beam: float
    divergence: float
    #: share of the depth within the beam that coherent light errs by
    speckle: float
    #: steps of readings
    range_step: float
    angle_step: float
    #: a range with less light than white has at so many metres is not measured
    farthest: float
    #: surfaces farther apart within one beam are told apart: the brighter counts
    separates: float
    #: turn of the head for all directions: half a turn looks to both sides
    sweep: float

    def sheet(self) -> dict[str, float | str]:
        """What the maker says, in units of data sheets."""
        return {
            "name": self.name,
            "range_noise_mm": 1e3 * self.noise,
            "range_noise_ppm": 1e6 * self.noise_per_range,
            "angle_noise_arcsec": self.angle_noise / SEC,
            "angle_systematic_arcsec": float(np.hypot(self.angle_wobble, self.index) / SEC),
            "zero_error_mm": 1e3 * self.zero,
            "scale_ppm": 1e6 * self.scale,
            "beam_diameter_mm": 2e3 * self.beam,
            "beam_divergence_mrad": 2e3 * self.divergence,
        }


SCANNERS = (
    Scanner(
        "phase", 64_000, np.radians(-60), 0.0005, 2e-5, 7 * SEC, 4 * SEC, 0.0003, 5e-6, 4 * SEC,
        0.00175, 0.00015, 0.15, 0.0001, 1 * SEC, 120.0, 0.8, np.pi,
    ),
    Scanner(
        "pulsed", 56_000, np.radians(-50), 0.003, 1e-5, 12 * SEC, 5 * SEC, 0.0015, 1.5e-5, 5 * SEC,
        0.003, 0.00012, 0.2, 0.001, 2 * SEC, 300.0, 0.6, np.pi,
    ),
    Scanner(
        "small", 40_000, np.radians(-60), 0.004, 5e-5, 25 * SEC, 10 * SEC, 0.001, 2e-5, 8 * SEC,
        0.0015, 0.0002, 0.3, 0.001, 10 * SEC, 60.0, 0.5, 2 * np.pi,
    ),
)  # fmt: skip


@dataclass(frozen=True)
class Scan:
    """Points in the frame of the scanner, and what is true of them."""

    #: (n, 3) [m] and (n,) of zero to one
    xyz: Array
    intensity: Array
    #: rows and columns of the beams
    grid: Array
    #: the spot (n, 3) that each beam met, in the world, and whether it may be a check point
    spot: Array
    checkable: Array


def exp(turn: Array) -> Array:
    """Rotation matrix of a rotation vector [rad]."""
    angle = float(np.linalg.norm(turn))
    x, y, z = turn / angle if angle > 0 else turn
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def instrument(scanner: Scanner, rng: np.random.Generator) -> tuple[float, float, float]:
    """Zero error, scale and index error of one instrument of a kind."""
    zero, scale, index = rng.normal(0, [scanner.zero, scanner.scale, scanner.index])
    return zero, scale, index


def _drift(time: Array, size: tuple[float, float], rng: np.random.Generator) -> tuple[Array, Array]:
    """Shifts and turns (n, 3) of a tripod over a scan, zero in the mean of the time."""
    bent = rng.uniform(0.3, 1.5)
    course = time**bent - 1 / (1 + bent)
    shift = rng.normal(0, size[0], 3) * [0.4, 0.4, 1.0]
    turn = rng.normal(0, size[1], 3)
    return course[:, None] * shift, course[:, None] * turn


def scan(
    world: World,
    world_from_scanner: Array,
    scanner: Scanner,
    errors: tuple[float, float, float],
    drift: tuple[float, float],
    rng: np.random.Generator,
) -> Scan:
    """Scan a world from a pose (4, 4), the mean of the scan's time.

    ``errors`` are those of the instrument, ``drift`` the standard deviations of a shift [m] and a
    turn [rad] from the beginning to the end.
    """
    step = np.sqrt(2 * np.pi * (np.pi / 2 - scanner.lowest) / scanner.beams)
    up = np.arange(scanner.lowest, np.pi / 2, step)
    around = np.arange(0, 2 * np.pi, step)
    column, row = (g.ravel() for g in np.meshgrid(np.arange(len(around)), np.arange(len(up))))
    azimuth, elevation = around[column], up[row]
    time = (azimuth % scanner.sweep) / scanner.sweep
    shift, turn = _drift(time, drift, rng)

    def beams(azimuth: Array, elevation: Array, which: Array | slice) -> Array:
        """Directions in the world."""
        level = np.cos(elevation)
        d = np.column_stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])
        d = d @ world_from_scanner[:3, :3].T
        return d + np.cross(turn[which], d)

    # encoders read the nominal angles; the beam goes elsewhere
    wave = rng.normal(0, scanner.angle_wobble, (2, 2, 3))
    order = np.arange(1, 4)
    circle = np.cos(azimuth[:, None] * order), np.sin(azimuth[:, None] * order)
    off_a, off_e = (sum(c @ w for c, w in zip(circle, ways, strict=True)) / 1.7 for ways in wave)
    true_azimuth = azimuth + off_a + rng.normal(0, scanner.angle_noise, len(azimuth))
    true_elevation = elevation + off_e + rng.normal(0, scanner.angle_noise, len(azimuth))
    true_elevation = true_elevation + errors[2]
    start = world_from_scanner[:3, 3] + shift
    along = beams(true_azimuth, true_elevation, slice(None))
    seconds = 300.0 * time
    hits = world.cast(start, along, seconds, rng)
    met = np.isfinite(hits.ranges)

    # beams that pass near an edge see several surfaces
    image = np.full((len(up), len(around)), -2)
    image[row, column] = np.where(met, hits.solid, -3)
    edge = np.zeros_like(image, dtype=bool)
    for axis in (0, 1):
        for by in (-1, 1):
            edge |= np.roll(image, by, axis) != image
    edges = np.flatnonzero(edge[row, column])
    ranges, light = hits.ranges.copy(), _light(hits.cosine, hits.material, hits.ranges)
    mixed = np.zeros(len(ranges), dtype=bool)
    parts, lights = [ranges[edges]], [light[edges]]
    width = scanner.divergence + scanner.beam / np.maximum(
        np.nan_to_num(ranges[edges], posinf=30), 1
    )
    for _ in range(_PARTS):
        a, e = rng.normal(0, 0.5, (2, len(edges))) * width
        d = beams(
            true_azimuth[edges] + a / np.maximum(np.cos(elevation[edges]), 0.05),
            true_elevation[edges] + e,
            edges,
        )
        other = world.cast(start[edges], d, seconds[edges], rng)
        parts.append(other.ranges)
        lights.append(_light(other.cosine, other.material, other.ranges))
    seen, bright = np.array(parts), np.array(lights)
    bright[~np.isfinite(seen)] = 0.0
    seen[~np.isfinite(seen)] = 0.0
    strongest = seen[bright.argmax(axis=0), np.arange(len(edges))]
    bright[np.abs(seen - strongest) > scanner.separates] = 0.0
    total = bright.sum(axis=0)
    some = total > 0
    ranges[edges[some]] = (bright * seen).sum(axis=0)[some] / total[some]
    ranges[edges[~some]] = np.inf
    light[edges] = total / (_PARTS + 1)
    spread = np.where(bright > 0, np.abs(seen - strongest), 0).max(axis=0)
    # a check point is a place on one surface, away from edges
    mixed[edges] = (spread > 0.001) | (~some) | (bright == 0).any(axis=0)

    met = np.isfinite(ranges) & (light * scanner.farthest**2 > 1)
    distance = np.where(met, ranges, 1.0)
    rough, cosine = _ROUGHNESS[hits.material], np.maximum(hits.cosine, 0.08)
    relief = rng.normal(0, rough) / np.maximum(cosine, 0.3)
    footprint = scanner.beam + scanner.divergence * distance
    depth = np.hypot(rough, footprint / 2 * np.sqrt(np.clip(1 - cosine**2, 0, 1)) / cosine)
    weak = np.sqrt(np.clip(0.01 * 0.75 / np.maximum(light, 1e-9), 0.5, 25.0))
    sigma = scanner.noise * np.sqrt(weak) + scanner.noise_per_range * distance
    error = rng.normal(0, sigma) + rng.normal(0, scanner.speckle * depth)
    error += rng.exponential(np.maximum(_DEPTH[hits.material], 1e-12))
    true = distance + relief
    read = true * (1 + errors[1]) + errors[0] + error
    read = np.round(read / scanner.range_step) * scanner.range_step
    met &= read > 0.3
    a, e = (np.round(g / scanner.angle_step) * scanner.angle_step for g in (azimuth, elevation))
    xyz = read[:, None] * np.column_stack([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    spot = start + true[:, None] * along
    firm = hits.firm & ~mixed & (rough <= 0.0015) & (hits.cosine > 0.25)
    return Scan(
        xyz[met], np.clip(light * distance**2, 0, 1)[met], np.column_stack([row, column])[met],
        spot[met], firm[met],
    )  # fmt: skip


def _light(cosine: Array, material: Array, ranges: Array) -> Array:
    """Light that comes back, one for white at right incidence at one metre."""
    with np.errstate(divide="ignore"):
        light = _LIGHT[material] * cosine ** _GLOSS[material] / ranges**2
    return np.asarray(light)
