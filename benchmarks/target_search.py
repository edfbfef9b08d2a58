"""All spheres of a 10-million-point scan, without knowing where.

A scan of a hall (0.04 deg, 9000 x 1250 beams) with twelve spheres of 0.145 m diameter, columns and
balls of other sizes is generated with noise; loading and compiling are not counted.

    python benchmarks/target_search.py [rows]
"""

import sys
import time

import numpy as np

from tribrach.scan.range_image import organise
from tribrach.targets.planes import find_planes
from tribrach.targets.sphere_search import find_spheres

RADIUS, SIGMA_RANGE, SIGMA_ANGLE = 0.0725, 1.5e-3, 2e-5
LOW, HIGH = np.array([-18.0, -11.0, -1.8]), np.array([15.0, 12.0, 4.0])


def ball(d, r, center, axes):
    """Shorten ranges r (rows, columns) along d (rows, columns, 3) where an ellipsoid is hit."""
    u, c = d / axes, np.asarray(center) / axes
    a, b = (u**2).sum(axis=2), u @ c
    square = b**2 - a * (c @ c - 1)
    hit = (square > 0) & (b > 0)
    r[hit] = np.minimum(r[hit], (b[hit] - np.sqrt(square[hit])) / a[hit])


def hall(rows):
    """Points (n, 3), their rows and columns, and the true centres."""
    rng = np.random.default_rng(1)
    columns = round(7.2 * rows)
    h, v = np.arange(columns) * 2 * np.pi / columns, np.linspace(0.35, 2.53, rows)
    d = np.empty((rows, columns, 3))
    d[..., 0] = np.sin(v)[:, None] * np.cos(h)
    d[..., 1] = np.sin(v)[:, None] * np.sin(h)
    d[..., 2] = np.cos(v)[:, None]
    with np.errstate(divide="ignore"):
        r = np.min(np.where(d > 0, HIGH, LOW) / np.where(d == 0, 1e-15, d), axis=2)
    centers = []
    for k in range(36):
        azimuth, away = 2 * np.pi * k / 36 + 0.05, 3 + 7 * (k % 12) / 12
        c = np.array([away * np.cos(azimuth), away * np.sin(azimuth), -1.2 + 0.15 * (k % 13)])
        axes = np.full(3, (RADIUS, 0.1, 0.06)[k % 3]) * (1, 1, 4 if k % 3 == 2 else 1)
        a, b = np.arctan2(axes[0] * 1.1, away), np.arctan2(1.1 * axes[2], away)
        middle = np.arccos(c[2] / np.linalg.norm(c))
        i = slice(*np.searchsorted(v, [middle - b, middle + b]))
        j = slice(*np.searchsorted(h, [azimuth - a, azimuth + a]))
        ball(d[i, j], r[i, j], c, axes)
        centers += [c] if k % 3 == 0 else []
    xyz = (d * (r + rng.normal(0, SIGMA_RANGE, r.shape))[..., None]).reshape(-1, 3)
    row, column = np.meshgrid(np.arange(rows, dtype=np.int32), np.arange(columns, dtype=np.int32),
                              indexing="ij")  # fmt: skip
    return xyz, row.ravel(), column.ravel(), np.array(centers)


def search(xyz, row, column):
    """Seconds of the image, the spheres and the planes, and what was found."""
    start = time.perf_counter()
    image = organise(xyz, row, column)
    made = time.perf_counter()
    noise = {"sigma_range": SIGMA_RANGE, "sigma_angle": SIGMA_ANGLE}
    found, rejected = find_spheres(xyz, image, [RADIUS], **noise)
    searched = time.perf_counter()
    planes, _ = find_planes(xyz, image, **noise)
    seconds = (made - start, searched - made, time.perf_counter() - searched)
    return seconds, found, rejected, planes


def main() -> None:
    xyz, row, column, centers = hall(int(sys.argv[1]) if len(sys.argv) > 1 else 1200)
    print(f"{len(xyz) / 1e6:.1f} million points, {len(centers)} spheres")
    small, small_row, small_column, _ = hall(200)
    search(small, small_row, small_column)  # compiles
    search(small, None, None)
    start = time.perf_counter()
    np.linalg.norm(xyz, axis=1).sum()
    bare = time.perf_counter() - start
    for name, grid in [("with the scanner's grid", (row, column)), ("without grid", (None, None))]:
        seconds, found, rejected, planes = search(xyz, *grid)
        worst = max(np.linalg.norm(centers - d.center, axis=1).min() for d in found)
        print(
            f"{name}: image {seconds[0]:.2f} s, spheres {seconds[1]:.2f} s ({len(found)} found, "
            f"{len(rejected)} rejected, worst centre {1e3 * worst:.2f} mm), planes "
            f"{seconds[2]:.2f} s ({len(planes)} found); image and spheres are "
            f"{(seconds[0] + seconds[1]) / bare:.1f} x the ranges of all points by numpy"
        )


if __name__ == "__main__":
    main()
