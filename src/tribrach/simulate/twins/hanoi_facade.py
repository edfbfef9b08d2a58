"""Two facades of a campus scanned from four levelled stations over a control traverse (S0).

Fourteen checkerboards hang on facades to the north and to the east. A total station measures ten
of them from the traverse, in two sets and both faces; four are check points, known from elsewhere
to a millimetre. Two of the stations scan sixteen test sites on the eastern facade once more, at
about the published ranges and incidence angles and almost three times as finely, so that something
is left of nearest-neighbour distances beside their sampling floor.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tribrach._types import Array
from tribrach.instruments.precision import Precision
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.simulate import raw_readings, surveying
from tribrach.simulate.aiming import fine_scan, overview
from tribrach.simulate.instruments import PULSED
from tribrach.simulate.ray_casting import SceneView
from tribrach.simulate.scene import Primitive, Scene, box, cylinder, ground, rectangle, sphere
from tribrach.simulate.setups import levelled
from tribrach.simulate.twin import Twin, TwinScan, TwinStation, TwinTarget, child_rng, steps_for
from tribrach.simulate.twins import campus
from tribrach.units import SEC

FLOOR = 6.0
NORTH, EAST = 2062.0, 1090.0
SIDE = 0.3
#: along the facade and height [m] of the boards
ON_NORTH = ((1016.2, 8.4), (1022.7, 10.2), (1033.4, 7.9), (1044.1, 11.0), (1052.3, 8.8),
            (1060.2, 10.4), (1071.5, 8.1))  # fmt: skip
ON_EAST = ((1996.3, 8.2), (2003.1, 10.7), (2012.4, 8.0), (2019.6, 9.6), (2027.3, 10.9),
           (2036.1, 8.6), (2045.4, 9.9))  # fmt: skip
CHECKS = ("N3", "N6", "E2", "E5")
#: place of each scanner over the ground plane [m], and the direction of its x axis
PLACES = {
    "S1": ((1031.4, 2031.0, FLOOR + 1.72), 0.4),
    "S2": ((1048.3, 2023.5, FLOOR + 1.65), 2.1),
    "S3": ((1060.9, 2031.8, FLOOR + 1.78), -1.3),
    "S4": ((1058.2, 2010.6, FLOOR + 1.69), 3.0),
}
NOISE = ScanNoise(0.002, 1e-5, 8 * SEC, 8 * SEC, 0.0035, 0.00023)
LEVELLING = 3 * SEC
FINE_STEP = 0.0004
#: test sites: along the eastern facade and height [m]; their radius [m], who scans them, how finely
SITES = ((1989.5, 9.2), (1992.0, 13.2), (1996.5, 12.0), (1998.5, 9.2), (2001.0, 9.2),
         (2006.0, 10.0), (2009.5, 11.2), (2013.5, 18.4), (2016.0, 10.0), (2022.5, 7.6),
         (2026.5, 15.6), (2030.5, 14.0), (2034.0, 10.0), (2038.0, 7.6), (2044.0, 17.6),
         (2049.0, 8.0))  # fmt: skip
SITE_RADIUS, SITE_STEP = 1.2, 0.0004
COMPARED = ("S3", "S4")
ZENITH = (np.radians(35.0), np.radians(125.0))
TOTAL_STATION = Precision(
    direction=3 * SEC,
    zenith=3 * SEC,
    distance=0.0015,
    scale=2e-6,
    centring=0.0003,
    height=0.0005,
    levelling=0.001,
)

PROJECT = """\
# Two facades of a campus, four levelled scanner stations over a control traverse (simulated).
title = "Facades of a campus (simulated)"
confidence = 0.95
truth = "truth/truth.json"

[facts]
Site = "Hanoi, polygon of five points with the published leg lengths"
Data = "simulated from the sigmas of the instruments below"

[site]
kind = "flat"                     # local coordinates, metres
curvature_radius_m = 6371000.0

[datum]
kind = "control"

[instruments.total_station]
direction_arcsec = 3.0
zenith_arcsec = 3.0
distance_mm = 1.5
distance_ppm = 2.0
centring_mm = 0.3
height_mm = 0.5
refraction = 0.13

[instruments.level]
levelling_mm_per_sqrt_km = 1.0

[instruments.scanner]
range_mm = 2.0
range_ppm = 10.0
scan_angle_arcsec = 8.0
beam_exit_mm = 3.5
beam_divergence_mrad = 0.23
levelling_arcsec = 3.0

[[points]]
file = "control.csv"
role = "control"

[[points]]
file = "check.csv"
role = "check"

[[observations]]
file = "traverse.gsi"
instrument = "total_station"

[[observations]]
file = "levelling.csv"
instrument = "level"

[targets]
checkerboard_side_m = [0.3]
# simulated prints and spheres are perfect
floor_mm = 0.0
orientation_mm = 0.0

[cloud]
incidence = true

[[comparison]]
a = "S3 S3-sites"
b = "S4 S4-sites"
sites = "sites.csv"
"""


def build(points: int = 1_000_000, seed: int = 1) -> Twin:
    """The twin."""
    targets = _targets()
    scene = Scene.of([*_surroundings(), *(t.primitive() for t in targets)])
    rng = child_rng(seed, "poses")
    stations = [
        TwinStation(name, levelled(place, heading, LEVELLING, rng), True)
        for name, (place, heading) in PLACES.items()
    ]
    scans: list[TwinScan] = []
    for station in stations:
        scans.append(overview(station.name, scene, station.pose, steps_for(points), ZENITH))
        scans.append(fine_scan(station.name, station.pose, targets, FINE_STEP))
    for station in (s for s in stations if s.name in COMPARED):
        name = f"{station.name}-sites"
        scans.append(fine_scan(station.name, station.pose, _windows(), SITE_STEP, name))
    marks = dict(zip(campus.NAMES, campus.traverse(), strict=True))
    return Twin(
        name="hanoi-facade",
        title="Facades of a campus (simulated)",
        seed=seed,
        scene=scene,
        scanner=replace(PULSED, noise=NOISE, incidence=True),
        stations=stations,
        scans=scans,
        targets=targets,
        files=_survey(scene, marks, targets, child_rng(seed, "survey")),
        project=PROJECT,
        marks=marks,
        facts={"check": ["C", *CHECKS]},
    )


def _windows() -> list[TwinTarget]:
    """The test sites as targets around which windows are scanned."""
    return [
        TwinTarget(str(k), "sphere", np.array([EAST, y, z]), SITE_RADIUS / 1.5)
        for k, (y, z) in enumerate(SITES, start=1)
    ]


def sites_table() -> str:
    """The test sites as a table of balls."""
    rows = [f"{k},{EAST},{y},{z},{SITE_RADIUS}" for k, (y, z) in enumerate(SITES, start=1)]
    return "\n".join(["name,x,y,z,radius", *rows, ""])


def _targets() -> list[TwinTarget]:
    """Boards a centimetre in front of the facades."""
    south, west = np.array([0.0, -1.0, 0.0]), np.array([-1.0, 0.0, 0.0])
    north = [np.array([x, NORTH - 0.01, z]) for x, z in ON_NORTH]
    east = [np.array([EAST - 0.01, y, z]) for y, z in ON_EAST]
    return [
        *(
            TwinTarget(f"N{k}", "checkerboard", c, SIDE, south)
            for k, c in enumerate(north, start=1)
        ),
        *(TwinTarget(f"E{k}", "checkerboard", c, SIDE, west) for k, c in enumerate(east, start=1)),
    ]


def _surroundings() -> list[Primitive]:
    """Ground, two facades with windows and pillars, street furniture."""
    out = [
        ground((1040, 2020, FLOOR), 400),
        box((1041, NORTH + 6, FLOOR + 8), (76, 12, 16), 0.55),
        box((EAST + 6, 2019, FLOOR + 7), (12, 64, 14), 0.48),
    ]
    for floor in (6.5, 10.0, 13.0):
        for x in np.arange(1008.0, 1078.0, 4.7):
            out.append(rectangle((x, NORTH - 0.02, FLOOR + floor), (0, -1, 0), 1.4, 1.5, 0.18))
        for y in np.arange(1990.0, 2050.0, 4.3):
            out.append(rectangle((EAST - 0.02, y, FLOOR + floor - 0.4), (-1, 0, 0), 1.2, 1.6, 0.2))
    for x in np.arange(1012.0, 1074.0, 12.4):
        out.append(box((x, NORTH - 0.2, FLOOR + 8), (0.4, 0.4, 16), 0.6))
    for k, (x, y) in enumerate([(1038, 2048), (1076, 2034), (1070, 2002), (1022, 2050)]):
        out.append(cylinder((x, y, FLOOR + 2.5), 0.09 + 0.02 * k, 5, 0.3))
        out.append(sphere((x, y, FLOOR + 5.2), 0.25, 0.5))
    for x, y, turn in [(1030, 2044, 0.1), (1078, 2012, 1.5), (1050, 2050, 0.2), (1012, 2020, 1.1)]:
        out.append(box((x, y, FLOOR + 0.7), (4.4, 1.8, 1.4), 0.4, turn))
    return out


def _survey(
    scene: Scene, marks: dict[str, Array], targets: list[TwinTarget], rng: np.random.Generator
) -> dict[str, str]:
    """Tables of control, check points, traverse and levelling."""
    measured = [t for t in targets if t.name not in CHECKS]
    checks = {t.name: t.center for t in targets if t.name in CHECKS}
    lines = campus.lines() + _lines_to_targets(scene, marks, measured)
    prisms = dict.fromkeys(marks, campus.HEIGHT_TARGET)
    places = {**marks, **{t.name: t.center for t in measured}}
    legs = list(zip(campus.NAMES[:4], campus.NAMES[1:], strict=True))
    length = np.array(campus.LEGS[:4])
    given = (0.001, 0.001, 0.0015)
    check = surveying.coordinates(checks, (0.001, 0.001, 0.001), rng).splitlines()
    known = surveying.coordinates({"C": marks["C"]}, given, rng).splitlines()
    return {
        "control.csv": surveying.coordinates({n: marks[n] for n in "AE"}, given, rng),
        "check.csv": "\n".join([*known, *check[1:], ""]),
        "traverse.gsi": raw_readings.gsi(
            places,
            lines,
            campus.HEIGHT_INSTRUMENT,
            prisms,
            TOTAL_STATION,
            rng,
            # the published pages and pictures are of this day
            raw_readings.STILL,
        ),
        "levelling.csv": surveying.levelling(marks, legs, length, TOTAL_STATION, rng),
        "sites.csv": sites_table(),
    }


def _lines_to_targets(
    scene: Scene, marks: dict[str, Array], targets: list[TwinTarget]
) -> list[tuple[str, str]]:
    """Sights to each target from the two nearest marks that see it at less than 65 degrees."""
    eyes = {n: x + np.array([0, 0, campus.HEIGHT_INSTRUMENT[n]]) for n, x in marks.items()}
    views = {name: SceneView(scene, eye) for name, eye in eyes.items()}
    lines = []
    for target in targets:
        seen = []
        for name, view in views.items():
            ray = target.center - view.origin
            length = float(np.linalg.norm(ray))
            hits = view.cast(ray[None] / length)
            steep = target.normal is None or abs(ray @ target.normal) < 0.42 * length
            if not steep and abs(hits.range[0] - length) < 1e-6:
                seen.append((length, name))
        lines += [(name, target.name) for _, name in sorted(seen)[:2]]
    return sorted(lines)
