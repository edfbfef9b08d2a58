"""All checkerboards of known sides in a whole scan, and why the other candidates are none (8.2)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.scan.range_image import RangeImage
from tribrach.targets.checkerboard_fit import CheckerboardFit, fit_checkerboard
from tribrach.targets.detection import Detection, Rejected
from tribrach.targets.pixel_window import points_around
from tribrach.targets.saddle_search import candidates

__all__ = ["find_checkerboards"]

Array = NDArray[np.float64]

#: candidates that are refused for these reasons are texture, not worth a line in the report
_TEXTURE = (
    "light and dark do not",
    "the pattern of its quadrants",
    "the points around it",
    "only ",
)


def find_checkerboards(
    xyz: Array,
    intensity: NDArray[np.float32],
    image: RangeImage,
    sides: Sequence[float],
    *,
    sigma_range: float | None = None,
    sigma_angle: float = 2e-5,
    footprint: tuple[float, float] = (4e-3, 0.3e-3),
    floor: float = 3e-4,
    scan: str = "",
) -> tuple[list[Detection], list[Rejected]]:
    """Boards of the given sides [m] among points (n, 3) [m] with intensities (n,).

    image : of the same points; sigma_range [m] is estimated from each board and not used;
    sigma_angle [rad] : of one point; footprint : exit diameter [m] and divergence [rad, full] of
    the beam; floor [m] : of a centre in each coordinate; scan : its name. A place that fits
    several sides becomes one board, of the side whose pattern explains most.

    Raises
    ------
    InputError : a side that is not positive.
    """
    if not all(side > 0 for side in sides):
        raise InputError("the side of a checkerboard must be positive")
    found: list[tuple[CheckerboardFit, float]] = []
    rejected: list[Rejected] = []
    for side in sides:
        for row, column in candidates(image, intensity, side):
            window, start = points_around(image, int(row), int(column), side)
            if start is None or any(np.linalg.norm(f.center - start) < 0.4 * s for f, s in found):
                continue
            fit = fit_checkerboard(
                xyz[window],
                intensity[window],
                start,
                side,
                footprint=float(np.hypot(footprint[0], footprint[1] * np.linalg.norm(start))),
                sigma_angle=sigma_angle,
                floor=floor,
            )
            if isinstance(fit, CheckerboardFit):
                _keep(found, fit, side)
            elif not fit.reason.startswith(_TEXTURE):
                rejected.append(Rejected("checkerboard", np.asarray(start), fit.reason))
    kept = [_detection(fit, side, image, scan) for fit, side in found]
    return kept, [r for r in rejected if not _inside(r.center, kept)]


def _keep(found: list[tuple[CheckerboardFit, float]], fit: CheckerboardFit, side: float) -> None:
    """Add a fit unless a better one is at the same place; then it replaces a worse one."""
    for k, (other, size) in enumerate(found):
        if np.linalg.norm(other.center - fit.center) < 0.5 * max(size, side):
            if fit.explained > other.explained:
                found[k] = (fit, side)
            return
    found.append((fit, side))


def _inside(center: Array, found: Sequence[Detection]) -> bool:
    """Is a place on a board that was found?"""
    return any(np.linalg.norm(d.center - center) < 2.5 * d.radius for d in found)


def _detection(fit: CheckerboardFit, side: float, image: RangeImage, scan: str) -> Detection:
    """A fit as the network wants it."""
    away = float(np.linalg.norm(fit.center))
    sine = max(float(np.hypot(*fit.center[:2])) / away, 0.05)
    pixels = side**2 * np.cos(fit.incidence) / (away**2 * image.step_h * image.step_v * sine)
    said = () if fit.points >= 100 else (f"only {fit.points} points",)
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
        },
        sentences=said,
    )
