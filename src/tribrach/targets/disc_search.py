"""All flat printed discs of known radii in a whole scan, and why the other candidates are none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tribrach.errors import InputError
from tribrach.scan.range_image import RangeImage
from tribrach.targets.blob_search import blobs
from tribrach.targets.detection import Detection, Rejected
from tribrach.targets.disc_fit import DiscFit, fit_disc
from tribrach.targets.pixel_window import points_around

__all__ = ["find_discs"]

Array = NDArray[np.float64]

#: refusals of spots at least this strong are worth a line in any case
_STRONG = 4.0


def find_discs(
    xyz: Array,
    intensity: NDArray[np.float32],
    image: RangeImage,
    radii: Sequence[float],
    *,
    sigma_range: float | None = None,
    sigma_angle: float | None = None,
    footprint: tuple[float, float] | None = None,
    floor: float = 0.0,
    scan: str = "",
) -> tuple[list[Detection], list[Rejected]]:
    """Discs of the given radii [m] among points (n, 3) [m] with intensities (n,).

    White on dark, dark on white or retroreflecting; ground of one plane and shade reaches to half
    a radius beyond the edge. image : of the same points; sigma_range [m], sigma_angle [rad] : of
    one point; footprint : exit diameter [m] and divergence [rad, full] of the beam; the points
    tell what is not given; floor [m] : of a centre in each coordinate; scan : its name. A place
    that fits several radii becomes one disc, of the radius that explains most of its light.

    Raises
    ------
    InputError : a radius that is not positive.
    """
    if not all(radius > 0 for radius in radii):
        raise InputError("the radius of a disc must be positive")
    found: list[tuple[DiscFit, float]] = []
    rejected: list[Rejected] = []
    for radius in radii:
        for (row, column), strength in zip(*blobs(image, intensity, radius), strict=True):
            window, start = points_around(image, int(row), int(column), 2 * radius)
            if start is None:
                continue
            if any(np.linalg.norm(f.center - start) < 0.5 * r for f, r in found if r == radius):
                continue
            fit = fit_disc(
                xyz[window],
                intensity[window],
                start,
                radius,
                footprint=_width(footprint, start),
                sigma_range=sigma_range,
                sigma_angle=sigma_angle,
                floor=floor,
            )
            if isinstance(fit, DiscFit):
                _keep(found, fit, radius)
            elif not fit.texture or strength > _STRONG:
                rejected.append(Rejected("disc", np.asarray(start), fit.reason))
    kept = [_detection(fit, radius, scan) for fit, radius in found]
    return kept, _without_repeats(rejected, kept)


def _width(footprint: tuple[float, float] | None, place: Array) -> float | None:
    """Diameter [m] of the beam at a place (3,)."""
    if footprint is None:
        return None
    return float(np.hypot(footprint[0], footprint[1] * np.linalg.norm(place)))


def _keep(found: list[tuple[DiscFit, float]], fit: DiscFit, radius: float) -> None:
    """Add a fit unless a better one is at the same place; then it replaces a worse one."""
    for k, (other, size) in enumerate(found):
        if np.linalg.norm(other.center - fit.center) < 0.7 * max(size, radius):
            if fit.explained > other.explained:
                found[k] = (fit, radius)
            return
    found.append((fit, radius))


def _without_repeats(rejected: Sequence[Rejected], found: Sequence[Detection]) -> list[Rejected]:
    """Refusals that are not on a disc that was found, nor repeat another at the same place."""
    out: list[Rejected] = []
    for r in rejected:
        if any(np.linalg.norm(d.center - r.center) < 1.6 * d.radius for d in found):
            continue
        if any(o.reason == r.reason and np.allclose(o.center, r.center) for o in out):
            continue
        out.append(r)
    return out


def _detection(fit: DiscFit, radius: float, scan: str) -> Detection:
    """A fit as the network wants it."""
    said = []
    if fit.points < 100:
        said.append(f"only {fit.points} points on and around it")
    if fit.coverage < 0.9:
        said.append(f"its edge is seen on {100 * fit.coverage:.0f} % of the circle")
    if fit.retro:
        taken = "whose distance is taken" if fit.gain > 0 else "which is the lighter one"
        said.append(f"its print reads {1e3 * fit.split:+.1f} mm against the ground, {taken}")
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
        sentences=tuple(said),
    )
