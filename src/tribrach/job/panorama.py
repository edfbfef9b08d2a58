"""The panorama of a scan: its intensity over directions, small, and where its targets are in it."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Single
from tribrach.geometry.polar import polar_from_xyz
from tribrach.scan.range_image import RangeImage
from tribrach.targets.detection import Detection

#: pixels of a panorama as it is shown: width, and most of its height
WIDTH, HEIGHT = 1400, 560
#: pixels of which less is seen stay dark
_SEEN = 1e-3


@dataclass(frozen=True, eq=False)
class Panorama:
    """A scan as its scanner saw it; the horizontal angle grows to the left."""

    #: (rows, columns), intensity, or range where there is none, the mean of what is seen in a
    #: pixel, stretched between its 2 and 98 % quantiles; no larger than it is shown
    grey: NDArray[np.uint8]
    #: (n, 2), column and row of each target in ``grey``, in the order of the detections
    marks: Array
    kinds: tuple[str, ...]  #: their kinds
    shape: tuple[float, float]  #: (float, float), width and height in pixels as it is to be shown
    #: (float, float), horizontal angles [rad] at the left and at the right margin
    window: tuple[float, float] = (np.pi, -np.pi)

    def chosen(self, keep: Sequence[bool]) -> Panorama:
        """The same with some of its targets, by a mask (n,)."""
        kinds = tuple(kind for kind, kept in zip(self.kinds, keep, strict=True) if kept)
        return replace(self, marks=self.marks[np.array(keep, dtype=bool)], kinds=kinds)


def panorama(
    image: RangeImage,
    intensity: NDArray[np.float32] | None,
    detections: Sequence[Detection],
    width: int = WIDTH,
) -> Panorama:
    """The panorama of a scan."""
    height = min(HEIGHT * width / WIDTH, max(140.0, width * image.shape[0] / image.shape[1]))
    grey = _reduced(image, intensity, width, round(height))
    scale = np.array(grey.shape) / np.array(image.shape)
    marks = np.zeros((len(detections), 2))
    if detections:
        polar = polar_from_xyz(np.array([d.center for d in detections]))
        for k, (_, h, v) in enumerate(polar):
            row, column = image.pixel(h, v)
            # from centres of pixels to centres of larger ones, mirrored
            marks[k] = grey.shape[1] - 0.5 - (column + 0.5) * scale[1], (row + 0.5) * scale[0] - 0.5
    first, last = image.first_h - image.step_h / 2, image.shape[1] * image.step_h
    window = float(first + last), float(first)
    return Panorama(grey, marks, tuple(d.kind for d in detections), (width, height), window)


#: a close-up shows so much around a centre: times the radius, and at least [m]
_AROUND, _LEAST = 2.0, 0.35
#: pixels of a close-up, and of the scan that it shows at most
_SIDE, _MOST_SEEN = 160, 400


def close_up(
    image: RangeImage, intensity: NDArray[np.float32] | None, center: Array, radius: float
) -> bytes | None:
    """The scan around a place as its scanner saw it; without values it shows ranges."""
    length, h, v = polar_from_xyz(center[None])[0]
    half = max(_AROUND * radius, _LEAST) if np.isfinite(radius) else _LEAST
    flat = max(length * np.sin(v), 1e-3)
    across = int(np.clip(half / (flat * abs(image.step_h)), 4, _MOST_SEEN / 2))
    up = int(np.clip(half / (length * abs(image.step_v)), 4, _MOST_SEEN / 2))
    row, column = image.pixel(h, v)
    rows = round(row) + np.arange(-up, up + 1)
    columns = round(column) + np.arange(-across, across + 1)
    if image.wraps:
        columns = columns % image.shape[1]
    inside = ((rows >= 0) & (rows < image.shape[0]))[:, None] & (
        (columns >= 0) & (columns < image.shape[1])
    )[None]
    place = np.ix_(np.clip(rows, 0, image.shape[0] - 1), np.clip(columns, 0, image.shape[1] - 1))
    index = np.where(inside, image.index[place], -1)
    seen = index >= 0
    if not seen.any():
        return None
    source = image.range[place]
    if intensity is not None:
        source = intensity[np.maximum(index, 0)]
    low, high = np.quantile(source[seen], [0.02, 0.98])
    grey = np.clip((source - low) / max(high - low, 1e-12), 0, 1)
    shown = np.round(255 * np.where(seen, np.nan_to_num(grey), 0.0)).astype(np.uint8)
    if image.step_v < 0:
        shown = shown[::-1]
    if image.step_h > 0:
        # horizontal angles grow to the left
        shown = shown[:, ::-1]
    images = _image()
    made = images.fromarray(np.ascontiguousarray(shown)).resize(
        (_SIDE, _SIDE), images.Resampling.BICUBIC
    )
    out = io.BytesIO()
    made.save(out, "WEBP", quality=75, method=4)
    return out.getvalue()


def _image() -> Any:
    """Pillow's images, loaded with the first panorama."""
    return import_module("PIL.Image")


def _reduced(
    image: RangeImage, intensity: NDArray[np.float32] | None, width: int, height: int
) -> NDArray[np.uint8]:
    """Grey values 0 to 255: means over pixels, stretched between the 2 and 98 % quantiles."""
    rows, columns = image.shape
    # two by two pixels of the scan tell enough of a mean
    step = max(1, columns // (2 * width)), max(1, rows // (2 * height))
    source = np.ascontiguousarray(image.range[:: step[1], :: step[0]][:, ::-1])
    if intensity is not None:
        index = image.index[:: step[1], :: step[0]][:, ::-1]
        source = np.where(index >= 0, intensity[np.maximum(index, 0)], np.float32(np.nan))
    seen = np.isfinite(source)
    size = min(source.shape[1], width), min(source.shape[0], height)
    share = _smaller(seen.astype(np.float32), size)
    total = _smaller(np.where(seen, source, np.float32(0)), size)
    mean = np.full(share.shape, np.nan, dtype=np.float32)
    np.divide(total, share, out=mean, where=share > _SEEN)
    known = mean[np.isfinite(mean)]
    low, high = np.quantile(known, [0.02, 0.98]) if len(known) else (0.0, 1.0)
    grey = np.nan_to_num(np.clip((mean - low) / max(high - low, 1e-12), 0, 1), nan=0.0)
    return np.asarray(np.round(255 * grey), dtype=np.uint8)


def _smaller(values: Single, size: tuple[int, int]) -> Single:
    """Means of an image over the pixels of a smaller one (columns, rows)."""
    images = _image()
    made = images.fromarray(values).resize(size, images.Resampling.BOX)
    return np.asarray(made, dtype=np.float32)
