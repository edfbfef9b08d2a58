"""Small scans of rooms with spheres and things that are none, ray by ray."""

import numpy as np

from tribrach.geometry.polar import xyz_from_polar

FAR = 1e9


def directions(h, v, step):
    """Unit vectors (rows * columns, 3) of a window of directions, its rows and columns."""
    hs, vs = np.arange(*h, step), np.arange(*v, step)
    columns, rows = np.meshgrid(np.arange(len(hs)), np.arange(len(vs)))
    polar = np.stack([np.ones(columns.size), hs[columns.ravel()], vs[rows.ravel()]], axis=1)
    return xyz_from_polar(polar), rows.ravel(), columns.ravel()


def ellipsoid(d, center, axes):
    """Ranges (n,) at which beams meet an ellipsoid with axes along x, y, z."""
    center, axes = np.asarray(center, float), np.broadcast_to(np.asarray(axes, float), 3)
    u, c = d / axes, center / axes
    a, b = (u**2).sum(axis=1), u @ c
    square = b**2 - a * (c @ c - 1)
    return np.where((square > 0) & (b > 0), (b - np.sqrt(np.maximum(square, 0))) / a, FAR)


def cylinder(d, foot, radius, height):
    """Ranges of a standing cylinder on its foot (3,)."""
    a = (d[:, :2] ** 2).sum(axis=1)
    b = d[:, :2] @ np.asarray(foot[:2])
    square = b**2 - a * (np.dot(foot[:2], foot[:2]) - radius**2)
    r = np.where((square > 0) & (b > 0), (b - np.sqrt(np.maximum(square, 0))) / a, FAR)
    z = r * d[:, 2]
    return np.where((z > foot[2]) & (z < foot[2] + height), r, FAR)


def room(d, low, high):
    """Ranges to the walls of a box around the scanner."""
    with np.errstate(divide="ignore"):
        return np.min(np.where(d > 0, high, low) / np.where(d == 0, 1e-15, d), axis=1)


def scan(d, surfaces, rng, sigma_range, sigma_angle):
    """Points (n, 3) of the nearest surfaces with noise along and across the beam."""
    r = np.min(surfaces, axis=0)
    v = np.arccos(d[:, 2])
    polar = np.stack([r, np.arctan2(d[:, 1], d[:, 0]), v], axis=1)
    noise = rng.normal(size=polar.shape) * [sigma_range, sigma_angle, sigma_angle]
    noise[:, 1] /= np.sin(v)
    return xyz_from_polar(polar + noise)
