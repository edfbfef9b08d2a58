"""A panoramic laser scanner in a scene: its measurements, and where the echoes really came from.

Directions of the grid are what the instrument reports; its beams leave them by the errors of the
encoders and by the misalignments of a calibration model (``true = measured + Delta``). A beam has a
footprint, the uniform disc of diameter ``hypot(d0, gamma rho)``: the echo of a single surface comes
from a random place of it, as :class:`ScanNoise` says (Lichti and Gordon 2004; method section 5.1),
the intensity is its mean over the footprint, and at the border of two surfaces the range is a mean
of both, weighted by intensity, or that of the stronger echo (a mixed pixel; method section 5.6).
What scanners are built like stands in :mod:`tribrach.simulate.instruments`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from tribrach._types import Array, Index
from tribrach.geometry.polar import xyz_from_polar
from tribrach.geometry.pose import Pose
from tribrach.instruments.calibration import NIST, CalibrationModel
from tribrach.instruments.neighbours import SharedNoise
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.scan.normals import FLATTEST
from tribrach.simulate.falloff import FallOff
from tribrach.simulate.footprint import (
    Blend,
    average,
    border,
    footprints,
    offset_rays,
    uniform_disc,
    unit_vectors,
)
from tribrach.simulate.ray_casting import Hits, SceneView
from tribrach.simulate.scene import Scene

# White texture lies on the sphere of directions, finer than the beams; each beam has the mean over
# its disc. Beams have the texture in common that their discs have, so that their errors are
# correlated as method section 5.7 says. Each column of the grid draws its own texture from the seed
# of the scan, so that blocks fit together and the draws of the rest of the scan stay what they are
# without.


#: cells of texture over the diameter of a disc, about, and for a step of the grid at most
_ACROSS, _FINEST = 24, 6
#: range that the fineness is chosen for [m]
_USUAL = 10.0
#: columns that a disc reaches to either side at most; near the poles it would be all of them
_REACH = 64
#: what parts these draws from all others of a scan, and the first column of a halo
_KEY, _FIRST = 57, 1_000_000


@dataclass(frozen=True)
class SharedTexture:
    """Texture over the directions of one scan."""

    shared: SharedNoise  #: what neighbours share
    #: V of the first row, and the step of the grid [rad]
    first_v: float
    step: float
    rows: int  #: of the grid
    entropy: tuple[int, ...]  #: seed of the scan

    def mixed(self, own: Array, row: Index, column: Index, length: Array) -> Array:
        """Errors of variance one, of beams' own normal ones and of what neighbours share."""
        if not len(own):
            return own
        share = self.shared.share
        mixed: Array = np.sqrt(1 - share) * own + np.sqrt(share) * self._seen(row, column, length)
        return mixed

    def _seen(self, row: Index, column: Index, length: Array) -> Array:
        """Means (n,) of the texture over discs, times the root of their cells."""
        usual = float(self.shared.diameter(np.array([_USUAL]))[0]) / _USUAL
        fine = int(np.clip(round(_ACROSS * self.step / max(usual, 1e-12)), 1, _FINEST))
        cell = self.step / fine
        radius = self.shared.diameter(length) / length / 2 / cell
        sine = np.maximum(np.abs(np.sin(self.first_v + row * self.step)), 1e-3)
        reach = int(np.ceil(min(float((radius / sine).max()) / fine + 1, _REACH)))
        first = int(column.min()) - reach
        above = int(np.ceil(float(radius.max()))) + 1
        sums = self._sums(first, int(column.max()) + reach, fine, above)
        place, middle = row * fine + above, (column - first) * fine
        widest = reach * fine - 1
        total, cells = np.zeros(len(row)), np.zeros(len(row))
        for k in range(-above, above + 1):
            left = radius**2 - k**2
            at = np.flatnonzero(left >= 0)
            half = np.minimum(np.sqrt(left[at]) / sine[at], widest).astype(np.int64)
            line = place[at] + k
            total[at] += sums[line, middle[at] + half + 1] - sums[line, middle[at] - half]
            cells[at] += 2 * half + 1
        seen: Array = total / np.sqrt(np.maximum(cells, 1))
        return seen

    def _sums(self, first: int, last: int, fine: int, above: int) -> Array:
        """Sums along H of the texture over some columns, with ``above`` cells beyond all rows."""
        high = self.rows * fine + 2 * above + fine
        parts = []
        for column in range(first, last + 1):
            key = (_KEY, column + _FIRST)
            rng = np.random.default_rng(np.random.SeedSequence(self.entropy, spawn_key=key))
            parts.append(rng.standard_normal((fine, high)).T)
        texture = np.concatenate([np.zeros((high, 1)), *parts], axis=1)
        return np.asarray(np.cumsum(texture, axis=1))


#: beams of a block; a scan of any size needs the memory of one block
_BLOCK = 200_000
#: rounds in which corrections that depend on the measured range settle
_ROUNDS = 3
#: at most so many pixels around each are looked at for borders
_WIDEST = 16
#: range that stands for the footprint of beams that meet nothing [m]
_NEAR_SKY = 10.0
#: range at which footprints are as wide as they get, seen from the scanner [m]
_CLOSE = 1.0


@dataclass(frozen=True)
class ScanGrid:
    """Directions of a scan: H = first_h + column step, V = first_v + row step."""

    #: of the first column and row [rad]
    first_h: float
    first_v: float
    step: float  #: in both directions [rad]
    #: of the grid
    rows: int
    columns: int

    @classmethod
    def window(cls, h: tuple[float, float], v: tuple[float, float], step: float) -> ScanGrid:
        """A window of the sphere."""
        rows, columns = int((v[1] - v[0]) / step) + 1, int((h[1] - h[0]) / step) + 1
        return cls(h[0], v[0], step, rows, columns)

    @classmethod
    def panorama(cls, v: tuple[float, float], points: int) -> ScanGrid:
        """A full circle of H."""
        step = float(np.sqrt(2 * np.pi * (v[1] - v[0]) / points))
        columns = max(round(2 * np.pi / step), 4)
        step = 2 * np.pi / columns
        return cls(0.0, v[0], step, int((v[1] - v[0]) / step) + 1, columns)

    def __len__(self) -> int:
        return self.rows * self.columns

    def angles(self, row: Index, column: Index) -> Array:
        """H and V (n, 2) [rad] of pixels (n,)."""
        return np.stack([self.first_h + column * self.step, self.first_v + row * self.step], axis=1)


@dataclass(frozen=True)
class Scanner:
    """An instrument, and what it does to true ranges and angles."""

    #: of single points; what neighbours share of it only if its ``shared_share`` is given. A law
    #: of the intensity takes the light that is received, speckle and all, on the scale of
    #: ``intensity``, and leaves ``incidence`` nothing to do.
    noise: ScanNoise
    incidence: bool = False  #: the noise of ranges is divided by the cosine of the incidence angle
    #: noise of the intensity, which is reflectance times cosine, falls off with the range as
    #: ``fall_off`` says and goes from 0 to 1
    intensity: float = 0.01
    #: noise of the intensity that grows with it, as its share: laser light that a rough surface
    #: scatters interferes with itself (2 to 10 % for terrestrial scanners)
    speckle: float = 0.0
    fall_off: FallOff | None = None  #: how light falls off with the range, not at all if None
    #: echoes whose intensity with its noise stays below this are lost: weak ones with a
    #: probability
    weakest: float = 0.01
    #: limits of the range [m]
    nearest: float = 0.4
    farthest: float = 150.0
    #: calibration parameters by name [m and rad]
    model: CalibrationModel = NIST
    parameters: dict[str, float] = field(default_factory=dict)
    #: A ``dome`` scanner sees with its back face where H exceeds 180 degrees
    faces: Literal["front", "dome"] = "front"
    beams: int = 19  #: rays over the footprint at borders
    #: surfaces in a footprint whose ranges differ by more than this are told apart [m]
    separable: float = 0.3
    #: what a mixed pixel of such surfaces measures: a mean over all of them or the strongest of
    #: the nearest surface and what is behind it
    separated: Literal["mean", "strongest"] = "mean"
    lost: float = 0.7  #: the probability that it is lost

    def delta(self, polar: Array) -> Array:
        """Corrections (n, 3) of measured range [m], H and V [rad] (n, 3)."""
        if not self.parameters:
            return np.zeros_like(polar)
        chosen = self.model.select(tuple(self.parameters))
        values = np.tile(list(self.parameters.values()), (len(polar), 1))
        return chosen.delta(polar, self.face(polar[:, 1]), values)

    def received(self, light: Array, length: Array) -> Array:
        """Received light (n,) of light (n,), reflectance times cosine, from ranges (n,) [m]."""
        return light if self.fall_off is None else light * self.fall_off.at(length)

    @property
    def strongest_of(self) -> float:
        """Difference of ranges from which on the stronger of two echoes counts [m]."""
        return self.separable if self.separated == "strongest" else np.inf

    def face(self, h: Array) -> Array:
        """Faces (n,), 1 or -1, at horizontal angles (n,) [rad]."""
        behind = (self.faces == "dome") & (h % (2 * np.pi) >= np.pi)
        return np.where(behind, -1.0, 1.0)


@dataclass(frozen=True, eq=False)
class SimulatedPoints:
    """Consecutive points of a simulated scan."""

    xyz: Array  #: (n, 3), as measured, in the scanner frame [m]
    intensity: NDArray[np.float32]  #: (n,), float32, 0 to 1
    #: (n,), int32, of the grid
    row: NDArray[np.int32]
    column: NDArray[np.int32]
    truth: Array  #: (n, 3), place in the world that the echo came from [m]
    primitive: Index  #: (n,), what it hit
    #: (n,), several surfaces are in the footprint, and the range is a mean over them or that of
    #: one of them; the truth is then where the middle of the beam hit, or the nearest place hit
    mixed: NDArray[np.bool_]
    rays: int  #: directions that were measured, hit or not

    def __len__(self) -> int:
        return len(self.xyz)


def scan(
    scene: Scene,
    pose: Pose,
    scanner: Scanner,
    grid: ScanGrid,
    seed: int | tuple[int, ...],
    mask: NDArray[np.bool_] | None = None,
) -> Iterator[SimulatedPoints]:
    """Scan a grid, masked directions alone, by columns and blocks; one seed gives one scan."""
    view = SceneView(scene, pose.translation)
    width = max(1, _BLOCK // grid.rows)
    entropy = (seed,) if isinstance(seed, int) else seed
    shared = scanner.noise.estimated_shared
    texture = None
    if shared is not None and shared.share > 0:
        texture = SharedTexture(shared, grid.first_v, grid.step, grid.rows, entropy)
    for number, first in enumerate(range(0, grid.columns, width)):
        columns = np.arange(first, min(first + width, grid.columns))
        if mask is not None and not mask[:, columns].any():
            continue
        rng = np.random.default_rng(np.random.SeedSequence(entropy, spawn_key=(number,)))
        yield _Beams(view, pose, scanner, grid, columns, mask, rng, texture).block()


class _Beams:
    """The beams of one block of columns."""

    def __init__(
        self,
        view: SceneView,
        pose: Pose,
        scanner: Scanner,
        grid: ScanGrid,
        columns: Index,
        mask: NDArray[np.bool_] | None,
        rng: np.random.Generator,
        texture: SharedTexture | None,
    ) -> None:
        self._view, self._pose, self._scanner, self._grid = view, pose, scanner, grid
        self._texture = texture
        self._columns, self._mask, self._rng = columns, mask, rng
        self._halo = int(self._reach(np.array([_CLOSE]), _WIDEST)[0])

    def block(self) -> SimulatedPoints:
        """Cast all beams and measure."""
        s, noise = self._scanner, self._scanner.noise
        pixels = self._pixels()
        reported = self._grid.angles(pixels.row, pixels.column)
        errors = self._rng.standard_normal((len(pixels.row), 4))
        turned = reported - errors[:, 1:3] * [noise.horizontal, noise.vertical]
        true = turned + self._angle_correction(pixels.range, reported)
        for _ in range(_ROUNDS if s.parameters else 0):
            met = self._near(self._world(true), pixels.primitive, pixels.edge)
            true = turned + self._angle_correction(met.range, reported)
        echo = self._echoes(self._world(true), pixels)
        light = echo.intensity
        strength = light + errors[:, 3] * s.intensity
        if s.speckle:
            # drawn only where asked for: scans without it stay as they were
            grain = light * s.speckle * self._rng.standard_normal(len(strength))
            strength += grain
            light = light + grain
        cosine = np.maximum(echo.cosine, FLATTEST) if s.incidence else 1.0
        length = np.minimum(echo.range, s.farthest)
        sigma = noise.range_sigma(length, cosine, None if noise.law is None else light)
        error = errors[:, 0]
        if self._texture is not None:
            error = self._texture.mixed(error, pixels.row, pixels.column, length)
        measured = self._measured_range(echo.range, reported) + error * sigma
        keep = echo.kept & (strength > s.weakest)
        keep &= (measured > s.nearest) & (measured < s.farthest)
        return SimulatedPoints(
            xyz_from_polar(np.column_stack([measured, reported])[keep]),
            np.clip(strength[keep], 0, 1).astype(np.float32),
            pixels.row[keep].astype(np.int32),
            pixels.column[keep].astype(np.int32),
            echo.truth[keep],
            echo.primitive[keep],
            echo.mixed[keep],
            pixels.rays,
        )

    def _echoes(self, beam: Array, pixels: _Pixels) -> _Echoes:
        """What comes back along beams (n, 3)."""
        s = self._scanner
        middle = self._near(beam, pixels.primitive, pixels.edge)
        edge = pixels.edge | (middle.primitive < 0)
        length = np.where(np.isfinite(middle.range), middle.range, pixels.near)
        diameter = s.noise.beam_diameter(length)
        place = uniform_disc(self._rng, len(beam)) * (diameter / 2)[:, None]
        ray = offset_rays(beam, place, length)
        hits = self._near(ray, middle.primitive, edge)
        met = np.isfinite(hits.range)
        echo = _Echoes(
            range=np.where(met, hits.range, np.inf),
            cosine=hits.cosine,
            intensity=s.received(middle.reflectance * middle.cosine, middle.range),
            truth=self._view.origin + np.where(met, hits.range, 0)[:, None] * ray,
            primitive=hits.primitive,
            mixed=np.zeros(len(beam), dtype=bool),
            kept=met,
        )
        at = np.flatnonzero(edge | ~met)
        if len(at):
            rays = footprints(beam[at], length[at], diameter[at], s.beams, self._rng)
            blend = average(self._view, rays, s.received, s.strongest_of)
            echo.blend(at, blend)
            wide = blend.several & (blend.spread > s.separable)
            echo.kept[at] &= ~(wide & (self._rng.random(len(at)) < s.lost))
        return echo

    def _near(self, rays: Array, number: Index, edge: NDArray[np.bool_]) -> Hits:
        """Hits with the expected primitives; with any where these are missed or near a border."""
        hits = self._view.again(rays, number)
        at = np.flatnonzero(edge | (hits.primitive < 0))
        if len(at):
            fresh = self._view.cast(rays[at])
            for old, new in zip(_columns(hits), _columns(fresh), strict=True):
                old[at] = new
        return hits

    def _pixels(self) -> _Pixels:
        """The block's pixels that hit something, from undisturbed beams with a rim around them."""
        grid, halo = self._grid, self._halo
        columns = np.arange(self._columns[0] - halo, self._columns[-1] + halo + 1)
        shape = (len(columns), grid.rows)
        row = np.tile(np.arange(grid.rows), len(columns))
        column = np.repeat(columns, grid.rows)
        inner = np.zeros(shape, dtype=bool)
        inner[halo:-halo] = True
        wanted = np.ones(shape, dtype=bool)
        if self._mask is not None:
            wanted = _grown(self._mask, columns, halo)
            inner[halo:-halo] &= self._mask[:, self._columns].T
        use = np.flatnonzero(wanted.ravel())
        hits = self._cast_nominal(grid.angles(row[use], column[use]))
        image = np.full((3, *shape), -2.0)
        lengths = np.full(shape, np.inf)
        flat = image.reshape(3, -1)
        flat[0, use], flat[1, use], flat[2, use] = (
            hits.primitive,
            hits.reflectance,
            self._reach(hits.range, halo),
        )
        lengths.ravel()[use] = hits.range
        edge, near = border(image[0], image[1], image[2], lengths)
        seen = inner.ravel()[use] & ((hits.primitive >= 0) | edge.ravel()[use])
        at = use[seen]
        return _Pixels(
            row[at],
            column[at],
            hits.range[seen],
            hits.primitive[seen],
            edge.ravel()[at],
            near.ravel()[at],
            int(inner.ravel()[use].sum()),
        )

    def _reach(self, length: Array, most: int) -> Array:
        """Half width (n,) [pixels] of the window whose surfaces a pixel's footprint may meet."""
        noise = self._scanner.noise
        at = np.where(np.isfinite(length), length, _NEAR_SKY)
        reach = 0.5 * noise.beam_diameter(at) / at + 4 * max(noise.horizontal, noise.vertical)
        return np.asarray(np.clip(np.ceil(reach / self._grid.step), 1, most))

    def _cast_nominal(self, reported: Array) -> Hits:
        """Hits along reported directions (n, 2), corrected for misalignments."""
        hits = self._view.cast(self._world(reported))
        if self._scanner.parameters:
            moved = reported + self._angle_correction(hits.range, reported)
            hits = self._view.cast(self._world(moved))
        return hits

    def _angle_correction(self, length: Array, reported: Array) -> Array:
        """``Delta`` (n, 2) of H and V at true ranges (n,)."""
        if not self._scanner.parameters:
            return np.zeros_like(reported)
        measured = self._measured_range(length, reported)
        return self._scanner.delta(np.column_stack([measured, reported]))[:, 1:]

    def _measured_range(self, length: Array, reported: Array) -> Array:
        """What the instrument reads at true ranges (n,): true less Delta at what it reads."""
        true = np.where(np.isfinite(length), length, self._scanner.farthest)
        measured = true.copy()
        for _ in range(_ROUNDS if self._scanner.parameters else 0):
            measured = true - self._scanner.delta(np.column_stack([measured, reported]))[:, 0]
        return measured

    def _world(self, angles: Array) -> Array:
        """Unit vectors (n, 3), world, of H and V (n, 2)."""
        return unit_vectors(angles, self._pose.rotation)


@dataclass(frozen=True, eq=False)
class _Pixels:
    """Pixels (n,) with the hits of undisturbed beams."""

    #: of the grid
    row: Index
    column: Index
    #: of the hit
    range: Array
    primitive: Index
    edge: NDArray[np.bool_]  #: another surface is within reach
    near: Array  #: shortest range within reach [m]
    rays: int  #: directions that were measured, those without a hit included


@dataclass(frozen=True, eq=False)
class _Echoes:
    """Echoes (n,) before noise of range and intensity; fields as in :class:`SimulatedPoints`."""

    range: Array
    cosine: Array
    intensity: Array
    truth: Array
    primitive: Index
    mixed: NDArray[np.bool_]
    kept: NDArray[np.bool_]

    def blend(self, at: Index, means: Blend) -> None:
        """Replace the echoes ``at`` (k,) by means over footprints.

        One surface keeps the echo of one place of it, with the mean intensity.
        """
        self.intensity[at] = means.intensity
        swap = means.met & (means.several | ~self.kept[at])
        to = at[swap]
        self.range[to], self.cosine[to] = means.range[swap], means.cosine[swap]
        self.truth[to], self.mixed[to], self.primitive[to] = means.truth[swap], True, -1
        self.kept[at] = means.met


def _columns(hits: Hits) -> tuple[NDArray[Any], ...]:
    return hits.range, hits.cosine, hits.reflectance, hits.primitive


def _grown(mask: NDArray[np.bool_], columns: Index, by: int) -> NDArray[np.bool_]:
    """The mask (columns, rows) of some columns, grown so that borders of windows are seen."""
    inside = (columns >= 0) & (columns < mask.shape[1])
    part = np.zeros((len(columns), mask.shape[0]), dtype=bool)
    part[inside] = mask[:, columns[inside]].T
    return np.asarray(binary_dilation(part, np.ones((2 * by + 1, 2 * by + 1), dtype=bool)))
