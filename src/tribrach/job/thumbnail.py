"""The panorama of a scan as a picture: intensity over directions, the targets marked."""

from __future__ import annotations

import base64
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tribrach.geometry.polar import polar_from_xyz
from tribrach.report.figures import new_figure, png
from tribrach.scan.range_image import RangeImage
from tribrach.targets.detection import Detection

__all__ = ["decoded", "panorama", "thumbnail"]

#: pixels of the picture: width, and most of its height
WIDTH, HEIGHT = 900, 360


_COLOURS = {"sphere": "#d62728", "checkerboard": "#1f77b4", "disc": "#2ca02c", "plane": "#9467bd"}


def thumbnail(
    image: RangeImage,
    intensity: NDArray[np.float32] | None,
    detections: Sequence[Detection],
) -> str:
    """PNG in base64."""
    return base64.b64encode(panorama(image, intensity, detections)).decode("ascii")


def decoded(picture: str) -> bytes:
    """The PNG file of a thumbnail."""
    return base64.b64decode(picture)


def panorama(
    image: RangeImage,
    intensity: NDArray[np.float32] | None,
    detections: Sequence[Detection],
    width: int = WIDTH,
) -> bytes:
    """PNG of the scan in directions, intensity (range where there is none) in grey.

    intensity (n,) of the points behind the image; the horizontal angle grows to the left, as the
    scanner sees it.
    """
    grey = _reduced(image, intensity, width)
    height = min(HEIGHT * width / WIDTH, max(90.0, width * image.shape[0] / image.shape[1]))
    figure = new_figure(figsize=(width / 100, height / 100), dpi=100)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.imshow(grey, cmap="gray", vmin=0, vmax=1, aspect="auto", interpolation="nearest")
    axes.set_axis_off()
    scale = np.array(grey.shape) / np.array(image.shape)
    if detections:
        polar = polar_from_xyz(np.array([d.center for d in detections]))
        for number, (detection, (_, h, v)) in enumerate(zip(detections, polar, strict=True)):
            row, column = image.pixel(h, v)
            x, y = grey.shape[1] - 1 - column * scale[1], row * scale[0]
            colour = _COLOURS.get(detection.kind, "#ff7f0e")
            axes.plot(x, y, "o", mfc="none", mec=colour, ms=10, mew=1.5)
            axes.annotate(
                str(number + 1), (x, y), (6, 6), textcoords="offset points", color=colour, size=8
            )
    return png(figure)


def _reduced(
    image: RangeImage, intensity: NDArray[np.float32] | None, width: int
) -> NDArray[np.float64]:
    """Grey values 0 to 1 of every k-th pixel, stretched between the 2 and 98 % quantiles."""
    rows, columns = image.shape
    step = max(1, columns // (2 * width)), max(1, rows // (2 * HEIGHT))
    index = image.index[:: step[1], :: step[0]][:, ::-1]
    source = image.range[:: step[1], :: step[0]][:, ::-1].astype(float)
    if intensity is not None:
        source = np.where(index >= 0, intensity[np.maximum(index, 0)], np.nan).astype(float)
    known = source[np.isfinite(source)]
    low, high = np.quantile(known, [0.02, 0.98]) if len(known) else (0.0, 1.0)
    grey = np.clip((source - low) / max(high - low, 1e-12), 0, 1)
    return np.asarray(np.nan_to_num(grey, nan=0.0), dtype=np.float64)
