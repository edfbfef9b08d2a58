"""Simulated windows around one printed target, and rooms with several: footprints and noise."""

from dataclasses import replace

import numpy as np

from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.scan.range_image import organise
from tribrach.simulate import scene as sc
from tribrach.simulate.instruments import PULSED
from tribrach.simulate.scanner import ScanGrid, Scanner, scan
from tribrach.targets.discs.search import find_discs

#: of single points: 8'' angles, a beam of 3.5 mm and 0.23 mrad
NOISE = ScanNoise(0.0012, 1e-5, 3.9e-5, 3.9e-5, 0.0035, 0.00023)
#: what the searches are told of it; no floor, so that covariances are those of the fits
TOLD = {
    "sigma_angle": NOISE.vertical,
    "footprint": NOISE.beam,
    "floor": 0.0,
}
#: the same and the noise of ranges, for the search for discs
TOLD_DISCS = TOLD | {"sigma_range": NOISE.range + 15 * NOISE.range_scale}


def scanned(primitives, h, v, step, seed, speckle=0.0):
    """Points (n, 3), intensities (n,) and range image of a window of directions [rad].

    speckle : noise of light, its share, of a pulsed scanner with all that its light does; without
    it a scanner that measures reflectances.
    """
    scanner = replace(PULSED, noise=NOISE, speckle=speckle) if speckle else Scanner(NOISE)
    blocks = list(
        scan(
            sc.Scene.of(primitives),
            Pose(np.eye(3), np.zeros(3)),
            scanner,
            ScanGrid.window(h, v, step),
            seed,
        )
    )
    xyz, light, row, column = (
        np.concatenate([getattr(b, name) for b in blocks])
        for name in ("xyz", "intensity", "row", "column")
    )
    return xyz, light, organise(xyz, row, column)


def alone(kind, away, incidence, size, pitch, seed, speckle=0.0):
    """One target of a kind before a wall, anywhere in front, turned anyhow: centre and scan.

    size : side of a board, radius of a disc [m]; pitch : of points across the beam [m].
    """
    rng = np.random.default_rng(seed)
    azimuth, elevation = rng.uniform(-0.6, 0.6), rng.uniform(-0.3, 0.3)
    level = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    beam = np.array([np.cos(azimuth), np.sin(azimuth), 0.0]) * np.cos(elevation)
    beam[2] = np.sin(elevation)
    spin = rng.uniform(0, 2 * np.pi)
    across = np.cos(spin) * level + np.sin(spin) * np.cross(beam, level)
    normal = np.sin(incidence) * across - np.cos(incidence) * beam
    center = away * beam + rng.uniform(-pitch, pitch, 3)
    if kind == "disc":
        target = sc.disc(center, normal, size, 4 * size)
        half = 3 * size / away
    else:
        turn = rng.uniform(0, np.pi)
        target = sc.checkerboard(center, normal, size, turn=turn, margin=0.02)
        half = 1.2 * size / away
    wall = sc.rectangle(center * (1 + 0.6 / away), -beam, 9, 9, 0.4)
    h, v = (azimuth - half, azimuth + half), (np.pi / 2 - elevation - half,) * 2
    return center, *scanned([target, wall], h, (v[0], v[0] + 2 * half), pitch / away, seed, speckle)


def told(search):
    """What a search is told of the scanner."""
    return TOLD_DISCS if search is find_discs else TOLD


def squares(search, kind, size, cases, repeats):
    """``e C^-1 e`` (cases, repeats) of simulated targets, NaN where one was not found.

    search : with points, intensities, image and sizes; cases : range, incidence [rad], pitch.
    """
    out = np.full((len(cases), repeats), np.nan)
    for i, (away, incidence, pitch) in enumerate(cases):
        for k in range(repeats):
            center, xyz, light, image = alone(kind, away, incidence, size, pitch, 1000 + k)
            found, _ = search(xyz, light, image, [size], **told(search))
            assert len(found) <= 1
            if found:
                e = found[0].center - center
                out[i, k] = e @ np.linalg.solve(found[0].covariance, e)
    return out


def gap(a, b):
    """Distance [m] of two places."""
    return float(np.linalg.norm(np.asarray(a) - np.asarray(b)))
