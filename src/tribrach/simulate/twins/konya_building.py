"""Ten stations in a loop of 90 m by 60 m around a building, an antenna on the scanner (S3).

The scanner is not levelled. Spheres along the loop tie the stations; eleven checkerboards around
the first station, measured by GNSS, calibrate the lever arm of (0, 0, 0.329) m. Every station but
the ninth has a GNSS position of 10, 10 and 15 mm.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tribrach._types import Array
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.simulate import surveying
from tribrach.simulate.aiming import fine_scan, overview
from tribrach.simulate.instruments import PULSED
from tribrach.simulate.scene import Primitive, Scene, box, cylinder, ground, rectangle
from tribrach.simulate.setups import tilted
from tribrach.simulate.twin import Twin, TwinScan, TwinStation, TwinTarget, child_rng, steps_for
from tribrach.units import SEC

ORIGIN = np.array([4200.0, 7700.0, 1021.0])
LEVER_ARM = np.array([0.0, 0.0, 0.329])
#: sigma of the lever arm's components as known before [m]
LEVER_SIGMA = 0.004
WITHOUT_GNSS = "S9"
LOOP = (
    (-45, -30), (-15, -30), (15, -30), (45, -30), (45, 0), (45, 30), (15, 30), (-15, 30),
    (-45, 30), (-45, 0),
)  # fmt: skip
RADIUS, SIDE = 0.145, 0.3
#: the loop has a sphere about every so many metres; a station scans those within reach [m] finely
SPACING, REACH = 8.0, (6.0, 36.0)
BOARDS = 11
GNSS, GNSS_BOARDS = (0.010, 0.010, 0.015), (0.005, 0.005, 0.008)
#: antenna over the centre of a board [m]
BOARD_ANTENNA = 0.10
NOISE = ScanNoise(0.003, 1e-5, 12 * SEC, 12 * SEC, 0.004, 0.0002)
TILT = float(np.radians(1.5))
FINE_STEP = 0.0008
ZENITH = (np.radians(45.0), np.radians(125.0))

PROJECT = """\
# A building, ten scanner stations around it with an antenna on the scanner (simulated).
title = "Stations with GNSS around a building (simulated)"
confidence = 0.95
truth = "truth/truth.json"

[facts]
Data = "simulated from the sigmas of the instruments below"

[site]
kind = "flat"

[datum]
kind = "control"

[instruments.gnss]
gnss_plan_mm = 10.0
gnss_up_mm = 15.0

[instruments.scanner]
range_mm = 3.0
range_ppm = 10.0
scan_angle_arcsec = 12.0
beam_exit_mm = 4.0
beam_divergence_mrad = 0.2

[lever_arms.antenna]
x_m = 0.0
y_m = 0.0
z_m = 0.329
sigma_mm = 4.0

[[points]]
file = "check.csv"
role = "check"

[[observations]]
file = "gnss.csv"
instrument = "gnss"

[[observations]]
file = "gnss-boards.csv"
instrument = "gnss"

[targets]
sphere_radius_m = [0.145]
checkerboard_side_m = [0.3]
# simulated prints and spheres are perfect
floor_mm = 0.0
sphere_tolerance_mm = 0.0
orientation_mm = 0.0
"""


def build(points: int = 1_000_000, seed: int = 1) -> Twin:
    """The twin."""
    rng = child_rng(seed, "poses")
    arm = LEVER_ARM + rng.normal(0, LEVER_SIGMA, 3)
    stations = _stations(rng)
    targets = [*_boards(stations[0].pose.translation), *_spheres()]
    scene = Scene.of(
        [*_surroundings(), *_stands(targets), *(target.primitive() for target in targets)]
    )
    scans: list[TwinScan] = []
    for station in stations:
        far = [float(np.linalg.norm(t.center - station.pose.translation)) for t in targets]
        near = [t for t, r in zip(targets, far, strict=True) if REACH[0] < r < REACH[1]]
        scans.append(overview(station.name, scene, station.pose, steps_for(points), ZENITH))
        scans.append(fine_scan(station.name, station.pose, near, FINE_STEP))
    measured = [s.name for s in stations if s.name != WITHOUT_GNSS]
    antennas = {s.name: s.pose @ arm for s in stations}
    return Twin(
        name="konya-building",
        title="Stations with GNSS around a building (simulated)",
        seed=seed,
        scene=scene,
        scanner=replace(PULSED, noise=NOISE),
        stations=stations,
        scans=scans,
        targets=targets,
        files=_survey(antennas, targets, child_rng(seed, "survey")),
        project=PROJECT,
        marks={f"antenna {name}": place for name, place in antennas.items()},
        facts={
            "lever_arm_m": arm.tolist(),
            "lever_arms": dict.fromkeys(measured, "antenna"),
            "check": ["T5", "T17", "T29"],
        },
    )


def _stations(rng: np.random.Generator) -> list[TwinStation]:
    """Stations on the loop, a little beside it, headings and tilts as they come."""
    out = []
    for k, (x, y) in enumerate(LOOP, start=1):
        place = np.array([x + 0.7 * np.sin(3.1 * k), y + 0.9 * np.cos(2.3 * k), 1.6 + 0.02 * k])
        out.append(TwinStation(f"S{k}", tilted(ORIGIN + place, 2.4 * k % 6.2, TILT, rng)))
    return out


def _boards(station: Array) -> list[TwinTarget]:
    """Boards around a station, 9 to 24 m away, facing it."""
    out = []
    for k in range(BOARDS):
        turn, length = 2 * np.pi * (k + 0.3 * np.sin(1.7 * k)) / BOARDS, 9 + 1.5 * (7 * k % 11)
        place = station + length * np.array([np.cos(turn), np.sin(turn), 0])
        place[2] = ORIGIN[2] + 1.2 + 0.21 * (5 * k % 11)
        normal = (station - place) * [1, 1, 0]
        out.append(
            TwinTarget(f"C{k + 1}", "checkerboard", place, SIDE, normal / np.linalg.norm(normal))
        )
    return out


def _spheres() -> list[TwinTarget]:
    """Spheres scattered along the loop, the same ones whatever the seed."""
    rng = np.random.default_rng(2017)
    corners = np.array([(-45, -30), (45, -30), (45, 30), (-45, 30), (-45, -30)], dtype=float)
    reached = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    out: list[TwinTarget] = []
    for along in np.arange(3.0, reached[-1], SPACING):
        x, y = (np.interp(along, reached, corners[:, k]) for k in (0, 1))
        while True:
            dx, dy, up = rng.uniform([-5, -5, 0.6], [5, 5, 3.2])
            place = np.array([x + dx, y + dy, up])
            far = min(np.hypot(place[0] - a, place[1] - b) for a, b in LOOP) > 3.0
            if far and not (abs(place[0]) < 31 and abs(place[1]) < 19):
                break
        out.append(TwinTarget(f"T{len(out) + 1}", "sphere", ORIGIN + place, RADIUS))
    return out


def _surroundings() -> list[Primitive]:
    """Ground, the building with an annexe and windows, and fences far out."""
    x, y, z = ORIGIN
    out = [
        ground(ORIGIN, 500),
        box((x, y, z + 7), (54, 26, 14), 0.5),
        box((x + 20, y + 15, z + 3), (14, 6, 6), 0.6),
        box((x - 8, y - 14.5, z + 1.8), (6, 3, 3.6), 0.45),
    ]
    for a in np.arange(-24.0, 25.0, 4.6):
        for up in (4.9, 9.1):
            out.append(rectangle((x + a, y - 13.03, z + up), (0, -1, 0), 1.6, 1.8, 0.2))
            out.append(rectangle((x + a, y + 13.03, z + up + 2), (0, 1, 0), 1.6, 1.8, 0.2))
    for side in (-1, 1):
        out.append(box((x, y + 58 * side, z + 1.5), (150, 0.3, 3.0), 0.3))
        out.append(box((x + 75 * side, y, z + 1.5), (0.3, 116, 3.0), 0.35))
    for dx, dy in ((-30, -41), (8, 42), (57, -12), (-58, 14)):
        out.append(cylinder((x + dx, y + dy, z + 3), 0.2, 6, 0.3))
    return out


def _stands(targets: list[TwinTarget]) -> list[Primitive]:
    """Rods below the targets."""
    rods = []
    for target in targets:
        below = 0.9 * RADIUS if target.kind == "sphere" else SIDE / 2
        height = float(target.center[2] - ORIGIN[2]) - below
        foot = target.center * [1, 1, 0] + [0, 0, ORIGIN[2] + height / 2]
        rods.append(cylinder(foot, 0.015, height, 0.25))
    return rods


def _survey(
    antennas: dict[str, Array], targets: list[TwinTarget], rng: np.random.Generator
) -> dict[str, str]:
    """GNSS positions of the antennas and of the boards; three spheres as check points."""
    checks = {t.name: t.center for t in targets if t.name in ("T5", "T17", "T29")}
    boards = [t for t in targets if t.kind == "checkerboard"]
    over = {t.name: BOARD_ANTENNA for t in boards}
    places = {t.name: t.center + np.array([0, 0, BOARD_ANTENNA]) for t in boards}
    stations = {name: place for name, place in antennas.items() if name != WITHOUT_GNSS}
    return {
        "gnss.csv": surveying.gnss_positions(stations, GNSS, rng, common=0.0),
        "gnss-boards.csv": surveying.gnss_positions(places, GNSS_BOARDS, rng, 0.0, over),
        "check.csv": surveying.coordinates(checks, (0.005, 0.005, 0.005), rng),
    }
