"""All spheres, checkerboards and discs of a 10-million-point scan, without knowing where.

A hall is scanned by the simulator (footprints, mixed pixels, noise in range, angles and
intensity). It holds twelve targets of each kind and things that are none: columns, balls of other
sizes, striped panels, tiles, windows, plates and knobs. The limit is one look at every point: its
range by numpy.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np

from benchmarks.figures import Figure, cost_of, run
from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.scan.range_image import organise
from tribrach.simulate import scene as sc
from tribrach.simulate.scanner import ScanGrid, Scanner, scan
from tribrach.targets.checkerboards.search import find_checkerboards
from tribrach.targets.discs.search import find_discs
from tribrach.targets.planes import find_planes
from tribrach.targets.spheres.grid_search import find_spheres

SPHERE, SIDE, DISC = 0.0725, 0.15, 0.075
NOISE = ScanNoise(0.0012, 1e-5, 2e-5, 2e-5, 0.0035, 0.00023)
LOW, HIGH = np.array([-18.0, -11.0, -1.8]), np.array([15.0, 12.0, 4.0])


def spheres():
    """Twelve spheres, and as many larger balls and columns; the centres of the first."""
    things, centers = [], []
    for k in range(36):
        azimuth, away = 2 * np.pi * k / 36 + 0.05, 3 + 7 * (k % 12) / 12
        c = np.array([away * np.cos(azimuth), away * np.sin(azimuth), -1.2 + 0.15 * (k % 13)])
        if k % 3 == 2:
            things.append(sc.cylinder(c, 0.06, 1.2, 0.5))
        else:
            things.append(sc.sphere(c, (SPHERE, 0.1)[k % 3]))
        centers += [c] if k % 3 == 0 else []
    return things, np.array(centers)


def prints():
    """Boards and discs on panels before the walls, and patterns that are neither; their centres."""
    rng = np.random.default_rng(2)
    things, boards, discs = [], [], []
    for k in range(36):
        azimuth, away = 2 * np.pi * (k + 0.5) / 36 + 0.05, 4 + 6.5 * (k * 7 % 36) / 36
        c = np.array([away * np.cos(azimuth), away * np.sin(azimuth), -1.0 + 0.1 * (k * 5 % 36)])
        normal = -c / away + 0.4 * rng.normal(size=3)
        if k % 3 == 0:
            things.append(sc.checkerboard(c, normal, SIDE, turn=rng.uniform(0, 3), margin=0.03))
            boards.append(c)
        elif k % 3 == 1:
            things.append(sc.disc(c, normal, DISC, 0.3))
            discs.append(c)
        else:
            things += pattern(k // 3, c, -c / np.linalg.norm(c))
    return things, np.array(boards), np.array(discs)


def pattern(number, center, normal):
    """Stripes, tiles of several shades, a window, or a plate of the wrong shape."""
    axes = sc.frame_of_normal(normal)
    before = center + 2e-3 * axes[2]

    def patch(x, y, width, height, shade):
        return sc.rectangle(before + x * axes[0] + y * axes[1], normal, width, height, shade)

    panel = sc.rectangle(center, normal, 0.8, 0.8, 0.5)
    if number % 4 == 0:
        return [panel, *[patch(0.08 * i, 0, 0.04, 0.7, 0.1) for i in range(-4, 5)]]
    if number % 4 == 1:
        shades = (0.15, 0.8, 0.3, 0.6, 0.45, 0.2, 0.7, 0.9, 0.35)
        return [panel, *[patch(0.15 * (i % 3) - 0.15, 0.15 * (i // 3) - 0.15, 0.15, 0.15, s)
                         for i, s in enumerate(shades)]]  # fmt: skip
    if number % 4 == 2:
        return [panel, patch(-0.15, 0, 0.25, 0.5, 0.05), patch(0.15, 0, 0.25, 0.5, 0.05)]
    return [panel, patch(0, 0.2, 0.15, 0.15, 0.85), patch(0, -0.2, 0.2, 0.1, 0.85),
            sc.disc(before + 0.25 * axes[0], normal, 0.05, 0.2)]  # fmt: skip


def hall(points):
    """Columns of a scan by name, and the true centres by kind."""
    balls, sphere_centers = spheres()
    flat, boards, discs = prints()
    size, middle = HIGH - LOW, (LOW + HIGH) / 2
    walls = [
        sc.rectangle((x, middle[1], middle[2]), (np.sign(-x), 0, 0), size[1], size[2], 0.6)
        for x in (LOW[0], HIGH[0])
    ] + [
        sc.rectangle((middle[0], y, middle[2]), (0, np.sign(-y), 0), size[0], size[2], 0.55)
        for y in (LOW[1], HIGH[1])
    ]
    floors = [
        sc.rectangle((middle[0], middle[1], z), (0, 0, 1), size[0], size[1], 0.35)
        for z in (LOW[2], HIGH[2])
    ]
    scene = sc.Scene.of([*walls, *floors, *balls, *flat])
    grid = ScanGrid.panorama((0.35, 2.53), points)
    blocks = scan(scene, Pose(np.eye(3), np.zeros(3)), Scanner(NOISE), grid, 1)
    parts = [(b.xyz, b.intensity, b.row, b.column) for b in blocks]
    columns = [np.concatenate(p) for p in zip(*parts, strict=True)]
    return columns, {"spheres": sphere_centers, "checkerboards": boards, "discs": discs}


def searches(xyz, intensity, image):
    """What is looked for, by name, as functions without arguments."""
    noise = {"sigma_range": NOISE.range + 15 * NOISE.range_scale}
    # boards tell the noise of their ranges themselves
    board = {"sigma_angle": NOISE.vertical, "footprint": NOISE.beam}
    light = {**noise, **board}
    spot = float(np.hypot(NOISE.vertical, NOISE.beam_angle(np.array([15.0]))[0]))
    return {
        "spheres": partial(find_spheres, xyz, image, [SPHERE], **noise, sigma_angle=spot),
        "checkerboards": partial(find_checkerboards, xyz, intensity, image, [SIDE], **board),
        "discs": partial(find_discs, xyz, intensity, image, [DISC], **light),
        "planes": partial(find_planes, xyz, image, **noise, sigma_angle=spot),
    }


def searched(what, columns, truth, limit) -> Iterator[Figure]:
    """Search once for each kind."""
    xyz, intensity, row, column = columns
    size = f"{len(xyz) / 1e6:.1f} million points, {what}"
    peer = "the ranges of all points by numpy"
    image, cost = cost_of(lambda: organise(xyz, row, column))
    yield Figure("range image", size, cost, peer, limit)
    for kind, search in searches(xyz, intensity, image).items():
        (found, rejected), cost = cost_of(search)
        told = f"{len(found)} found, {len(rejected)} rejected"
        if kind in truth:
            gap = [np.linalg.norm(truth[kind] - d.center, axis=1) for d in found]
            right = {int(g.argmin()) for g in gap if g.min() < 0.01}
            worst = max((g.min() for g in gap if g.min() < 0.01), default=0.0)
            told += f", {len(right)} of {len(truth[kind])} true, worst centre {1e3 * worst:.2f} mm"
        yield Figure(f"finding {kind}", size, cost, peer, limit, told)


def measure(millions: float) -> Iterator[Figure]:
    """With the scanner's grid, and without."""
    small, _ = hall(300_000)
    for grid in (small[2:], (None, None)):
        for search in searches(*small[:2], organise(small[0], *grid)).values():
            search()  # compiled code is loaded
    columns, truth = hall(round(1e6 * millions))
    _, limit = cost_of(lambda: np.linalg.norm(columns[0], axis=1).sum(), 3)
    yield from searched("with the scanner's grid", columns, truth, limit)
    yield from searched("without its grid", [*columns[:2], None, None], truth, limit)


if __name__ == "__main__":
    run(measure, full=(10.5,), small=(0.5,))
