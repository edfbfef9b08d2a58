"""A courtyard scanned from seven levelled stations, spheres on rods over GNSS marks (S1).

Six spheres of 0.23 m diameter stand on rods over marks with NetRTK positions of 2 cm and 5 cm that
have a part in common; two more are check points. Station S6 sees no more than ground and one wall.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tribrach._types import Array
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.simulate import surveying
from tribrach.simulate.aiming import fine_scan, overview
from tribrach.simulate.instruments import PHASE
from tribrach.simulate.scene import Primitive, Scene, box, cylinder, ground, rectangle
from tribrach.simulate.setups import levelled
from tribrach.simulate.twin import Twin, TwinScan, TwinStation, TwinTarget, child_rng, steps_for
from tribrach.units import SEC

ORIGIN = np.array([500.0, 300.0, 112.0])
RADIUS = 0.115
#: place on the ground and height of the sphere's centre above it [m]
MARKS = {
    "P1": (-14.2, -7.6, 2.05),
    "P2": (-5.1, 5.3, 1.92),
    "P3": (3.4, -8.7, 2.21),
    "P4": (12.6, 6.9, 1.87),
    "P5": (15.3, -4.2, 2.12),
    "P6": (-11.7, 9.4, 2.34),
}
CHECKS = {"K1": (1.2, 8.8, 1.98), "K2": (7.9, -2.3, 2.16)}
#: place over the ground plane [m], and the direction of the scanner's x axis
PLACES = {
    "S1": ((-9.3, -1.2, 1.71), 0.3),
    "S2": ((-0.8, -3.9, 1.66), 1.9),
    "S3": ((7.2, 3.4, 1.75), -2.2),
    "S4": ((13.1, 0.8, 1.69), 0.9),
    "S5": ((5.6, -7.4, 1.73), 2.8),
    "S6": ((-5.8, -3.1, 1.68), 0.5 * np.pi - 0.7),
    "S7": ((-13.4, 4.6, 1.70), -0.6),
}
#: the wall that S6 sees, a window of its H and V [rad]
PARTIAL = ((0.0, 1.4), (np.radians(70), np.radians(120)))
#: columns in the yard: place, radius, height [m]. Two trees and a downpipe stand before the wall
#: that S6 sees; nothing else but spheres tells its clouds where along that wall they belong
STEMS = (
    (-17.6, 1.8, 0.16, 3.4),
    (9.6, 9.7, 0.16, 3.0),
    (17.8, 10.6, 0.16, 3.8),
    (-8.6, 12.0, 0.19, 5.2),
    (2.6, 12.4, 0.15, 4.6),
    (-13.4, 13.95, 0.05, 11.8),
)
#: height of the antenna's pole [m]; sigma of a position, of a rod's length, of a bubble
ANTENNA = 2.0
RTK = (0.02, 0.02, 0.05)
ROD = 0.0005
BUBBLE = 8 * 60 * SEC
NOISE = ScanNoise(0.001, 1e-5, 10 * SEC, 10 * SEC, 0.00225, 0.00019)
LEVELLING = 15 * SEC
FINE_STEP = 0.0008
ZENITH = (np.radians(40.0), np.radians(130.0))

PROJECT = """\
# A courtyard, seven levelled scanner stations, spheres over GNSS marks (simulated).
title = "Courtyard with spheres over GNSS marks (simulated)"
confidence = 0.95
truth = "truth/truth.json"

[facts]
Data = "simulated from the sigmas of the instruments below"

[site]
kind = "flat"

[datum]
kind = "control"

# network RTK: 2 cm and 5 cm, half of the variance common to the session
[instruments.rtk]
sheet = "NetRTK"

# rods of known length with circular bubbles
[instruments.rod]
sheet = "Target on rod"

[instruments.scanner]
range_mm = 1.0
range_ppm = 10.0
scan_angle_arcsec = 10.0
beam_exit_mm = 2.25
beam_divergence_mrad = 0.19
levelling_arcsec = 15.0

[[points]]
file = "check.csv"
role = "check"

[[observations]]
file = "gnss.csv"
instrument = "rtk"

[[observations]]
file = "rods.csv"
instrument = "rod"

[targets]
sphere_radius_m = [0.115]
# simulated prints and spheres are perfect
floor_mm = 0.0
sphere_tolerance_mm = 0.0
"""


def build(points: int = 1_000_000, seed: int = 1) -> Twin:
    """The twin."""
    targets = [
        TwinTarget(name, "sphere", ORIGIN + place, RADIUS)
        for name, place in (MARKS | CHECKS).items()
    ]
    scene = Scene.of([*_surroundings(), *_rods(targets), *(t.primitive() for t in targets)])
    rng = child_rng(seed, "poses")
    stations = [
        TwinStation(name, levelled(ORIGIN + place, heading, LEVELLING, rng), True)
        for name, (place, heading) in PLACES.items()
    ]
    survey = child_rng(seed, "survey")
    marks = _marks(targets, survey)
    scans: list[TwinScan] = []
    for station in stations:
        scans += _scans(scene, station, targets, steps_for(points))
    return Twin(
        name="sphere-courtyard",
        title="Courtyard with spheres over GNSS marks (simulated)",
        seed=seed,
        scene=scene,
        scanner=replace(PHASE, noise=NOISE),
        stations=stations,
        scans=scans,
        targets=targets,
        files=_survey(targets, marks, survey),
        project=PROJECT,
        marks=marks,
        facts={"check": list(CHECKS), "partial": "S6"},
    )


def _scans(
    scene: Scene, station: TwinStation, targets: list[TwinTarget], points: int
) -> list[TwinScan]:
    """Overview and fine scan of a station; those of the partial one within its window."""
    if station.name != "S6":
        return [
            overview(station.name, scene, station.pose, points, ZENITH),
            fine_scan(station.name, station.pose, targets, FINE_STEP),
        ]
    h, v = PARTIAL
    local = station.pose.inverse @ np.array([t.center for t in targets])
    angle = np.arctan2(local[:, 1], local[:, 0]) % (2 * np.pi)
    seen = [t for t, a in zip(targets, angle, strict=True) if h[0] + 0.05 < a < h[1] - 0.05]
    return [
        overview(station.name, scene, station.pose, points, v, h),
        fine_scan(station.name, station.pose, seen, FINE_STEP),
    ]


def _surroundings() -> list[Primitive]:
    """Ground, four buildings around, and what stands in the yard."""
    x, y, z = ORIGIN
    out = [
        ground(ORIGIN, 300),
        box((x, y + 19, z + 6), (56, 10, 12), 0.5),
        box((x, y - 19, z + 5), (56, 10, 10), 0.45),
        box((x + 26, y, z + 4.5), (8, 28, 9), 0.6),
        box((x - 26, y, z + 5.5), (8, 28, 11), 0.55),
    ]
    for a in np.arange(-20.0, 21.0, 4.1):
        for side, face in ((14.0, -1.0), (-14.0, 1.0)):
            middle = (x + a, y + side + 0.03 * face, z + 4.6)
            out.append(rectangle(middle, (0, face, 0), 1.3, 1.7, 0.2))
    for dx, dy, radius, height in STEMS:
        out.append(cylinder((x + dx, y + dy, z + height / 2), radius, height, 0.3))
    out += [
        box((x - 16.5, y - 11.5, z + 0.25), (2.0, 0.6, 0.5), 0.4, 0.4),
        box((x + 10.4, y - 10.8, z + 0.25), (2.0, 0.6, 0.5), 0.4, -0.2),
        box((x + 18.6, y + 3.1, z + 1.1), (1.2, 2.0, 2.2), 0.35, 0.1),
    ]
    return out


def _rods(targets: list[TwinTarget]) -> list[Primitive]:
    """Rods from the ground into the spheres."""
    rods = []
    for target in targets:
        height = float(target.center[2] - ORIGIN[2]) - 0.9 * RADIUS
        foot = target.center * [1, 1, 0] + [0, 0, ORIGIN[2] + height / 2]
        rods.append(cylinder(foot, 0.0125, height, 0.25))
    return rods


def _marks(targets: list[TwinTarget], rng: np.random.Generator) -> dict[str, Array]:
    """Marks under their spheres: rods lean by their bubbles, M1 under P1."""
    out = {}
    for target in targets:
        if target.name in MARKS:
            rod = MARKS[target.name][2]
            lean = rod * BUBBLE * rng.normal(size=2)
            out["M" + target.name[1:]] = target.center - [*lean, rod]
    return out


def _survey(
    targets: list[TwinTarget], marks: dict[str, Array], rng: np.random.Generator
) -> dict[str, str]:
    """GNSS on poles over the marks, lengths of the rods; check points to 5 mm."""
    up = np.array([0.0, 0.0, ANTENNA])
    antennas = {name: x + up for name, x in marks.items()}
    over = dict.fromkeys(marks, ANTENNA)
    rods = {name: (f"P{name[1:]}", MARKS[f"P{name[1:]}"][2]) for name in marks}
    checks = {t.name: t.center for t in targets if t.name in CHECKS}
    return {
        "gnss.csv": surveying.gnss_positions(antennas, RTK, rng, antenna_height=over),
        "rods.csv": surveying.rods(rods, ROD, rng),
        "check.csv": surveying.coordinates(checks, (0.005, 0.005, 0.005), rng),
    }
