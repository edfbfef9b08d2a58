"""A retaining wall measured in two campaigns, and what moved between them.

Six concrete panels along a road. Between both campaigns the western two tilt together about their
foot, the fourth is pushed forward and settles, and one of five reference pillars is moved. A total
station measures all pillars and the boards on wall and houses from three pillars, whose
coordinates are given once for both campaigns; three scanner stations stand on the road, in each
campaign elsewhere. Nothing is published of it: it is made up to have a truth of motions.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tribrach._types import Array
from tribrach.geometry.pose import Pose
from tribrach.geometry.rotation import exp
from tribrach.instruments.precision import Precision
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.simulate import raw_readings, surveying
from tribrach.simulate.aiming import fine_scan, overview
from tribrach.simulate.instruments import PULSED
from tribrach.simulate.scene import Primitive, Scene, box, carried, cylinder, ground
from tribrach.simulate.setups import levelled
from tribrach.simulate.sight_lines import sight_lines
from tribrach.simulate.twin import Twin, TwinScan, TwinStation, TwinTarget, child_rng, steps_for
from tribrach.units import SEC

CAMPAIGNS = ("epoch1", "epoch2")
ROAD = 50.0
#: the face of the wall is this plane, its panels stand beside each other along E [m]
FACE, WEST, WIDTH, HEIGHT, THICK = 220.0, 100.0, 6.0, 4.5, 0.4
PANELS = ("P1", "P2", "P3", "P4", "P5", "P6")
#: between two panels [m]
JOINT = 0.02
#: house on the other side of the road: its face [m]
HOUSE = 196.0
SIDE = 0.3
#: boards on panels: along E from the panel's western edge and height over the road [m]
ON_WALL = {"W1": ("P1", 4.1, 2.6), "W2": ("P2", 3.4, 1.7), "W3": ("P3", 2.2, 3.1),
           "W4": ("P4", 3.3, 2.0), "W5": ("P5", 3.6, 3.2), "W6": ("P6", 1.9, 1.8)}  # fmt: skip
#: boards on the house: E and height over the road [m]
ON_HOUSE = {"H1": (107.4, 3.6), "H2": (116.2, 2.4), "H3": (123.1, 4.1), "H4": (131.7, 2.9)}
#: pillars: place, and height of their top over the road [m]. The first three carry the instrument
#: and have given coordinates; all five are taken as stable
REFERENCES = {
    "R1": (95.3, 206.1, 1.18),
    "R2": (141.8, 204.4, 1.21),
    "R3": (118.6, 199.7, 1.15),
    "R4": (91.7, 214.9, 1.24),
    "R5": (145.2, 215.8, 1.19),
}
CONTROL = ("R1", "R2", "R3")
#: the pillar that is moved, and by what [m]
MOVED = {"R5": (0.0062, -0.0041, 0.0)}
HEIGHT_INSTRUMENT = dict(zip(CONTROL, (0.238, 0.241, 0.236), strict=True))
HEIGHT_TARGET = 0.105
GIVEN = (0.0005, 0.0005, 0.0005)
#: boards are measured at less than this from their normal [rad]
STEEPEST = float(np.radians(62))
#: places of the scanners over the road [m] and directions of their x axes; later ones stand off
PLACES = {
    "S1": ((107.2, 208.3, ROAD + 1.74), 0.6),
    "S2": ((118.9, 206.9, ROAD + 1.69), 2.3),
    "S3": ((129.6, 208.8, ROAD + 1.72), -1.4),
}
STEP_ASIDE = np.array([0.8, -0.5, 0.03])
NOISE = ScanNoise(0.0012, 1e-5, 8 * SEC, 8 * SEC, 0.0035, 0.00023)
LEVELLING = 3 * SEC
FINE_STEP = 0.0006
ZENITH = (np.radians(45.0), np.radians(125.0))
TOTAL_STATION = Precision(
    direction=1.5 * SEC,
    zenith=1.5 * SEC,
    distance=0.0008,
    scale=1e-6,
    centring=0.0001,
    height=0.0002,
)


def _tilt(angle: float) -> Pose:
    """Forward, about the foot of the wall, by an angle [rad]."""
    rotation = exp(np.array([angle, 0.0, 0.0]))
    foot = np.array([0.0, FACE, ROAD])
    return Pose(rotation, foot - rotation @ foot)


#: motions of panels, in the world; the others stay. The tilt moves the top by 9.9 mm
MOTIONS = {
    "P1": _tilt(0.0022),
    "P2": _tilt(0.0022),
    "P4": Pose(np.eye(3), np.array([0.001, -0.012, -0.004])),
}

PROJECT = """\
# A retaining wall, three levelled scanner stations, control from pillars: {campaign} (simulated).
title = "Retaining wall, {campaign} (simulated)"
confidence = 0.95
truth = "{campaign}/truth/truth.json"

[facts]
Data = "simulated from the sigmas of the instruments below"

[site]
kind = "flat"                     # local coordinates, metres
curvature_radius_m = 6371000.0

[datum]
kind = "control"

[instruments.total_station]
direction_arcsec = 1.5
zenith_arcsec = 1.5
distance_mm = 0.8
distance_ppm = 1.0
centring_mm = 0.1
height_mm = 0.2
refraction = 0.13

[instruments.scanner]
range_mm = 1.2
range_ppm = 10.0
scan_angle_arcsec = 8.0
beam_exit_mm = 3.5
beam_divergence_mrad = 0.23
levelling_arcsec = 3.0

# three pillars, the same values in both campaigns
[[points]]
file = "control.csv"
role = "control"

[[observations]]
file = "{campaign}/network.gsi"
instrument = "total_station"

[targets]
checkerboard_side_m = [0.3]
# simulated prints are perfect
floor_mm = 0.0
orientation_mm = 0.0

[cloud]
incidence = true
"""

#: of the second campaign: what it is compared with when it is run
AGAINST = f"""
[[epochs]]
against = ["out/{CAMPAIGNS[0]}/epoch.json"]
references = [{", ".join(f'"{name}"' for name in REFERENCES)}]
"""


def build(points: int = 1_000_000, seed: int = 1) -> Twin:
    """The first campaign, and the second as the one that is later."""
    control = surveying.coordinates(
        {name: _pillars()[name] for name in CONTROL}, GIVEN, child_rng(seed, "control")
    )
    first, second = (_campaign(k, steps_for(points), seed, control) for k in range(2))
    return replace(first, later=(second,))


def _campaign(number: int, points: int, seed: int, control: str) -> Twin:
    """One campaign; each has errors of its own."""
    moved, name = number > 0, CAMPAIGNS[number]
    # no campaign of one seed draws what any of another does
    drawn = 2 * seed + number
    motions = {panel: MOTIONS.get(panel, Pose.identity()) for panel in PANELS}
    shifts = {panel: motions[panel] if moved else Pose.identity() for panel in PANELS}
    targets = _targets(shifts)
    scene = Scene.of([*_surroundings(), *_wall(shifts), *(t.primitive() for t in targets)])
    rng = child_rng(drawn, "poses")
    stations = [
        TwinStation(station, levelled(place + number * STEP_ASIDE, heading, LEVELLING, rng), True)
        for station, (place, heading) in PLACES.items()
    ]
    scans: list[TwinScan] = []
    for station in stations:
        scans.append(overview(station.name, scene, station.pose, points, ZENITH))
        mine = _measured_by(scene, station.pose.translation, targets)
        scans.append(fine_scan(station.name, station.pose, mine, FINE_STEP))
    marks = _pillars(MOVED if moved else {})
    network = _network(scene, marks, targets, child_rng(drawn, "survey"))
    return Twin(
        name="retaining-wall",
        title=f"Retaining wall, {name} (simulated)",
        seed=drawn,
        scene=scene,
        scanner=replace(PULSED, noise=NOISE, incidence=True),
        stations=stations,
        scans=scans,
        targets=targets,
        files={"control.csv": control, f"{name}/network.gsi": network},
        project=PROJECT.format(campaign=name) + (AGAINST if moved else ""),
        marks=marks,
        facts={
            "references": list(REFERENCES),
            "panels": {
                panel: {
                    "face": _face(k).tolist(),
                    "motion": shifts[panel].matrix.tolist(),
                }
                for k, panel in enumerate(PANELS)
            },
            "moved": {point: list(by) for point, by in MOVED.items()} if moved else {},
        },
        campaign=name,
    )


def _pillars(moved: dict[str, tuple[float, float, float]] | None = None) -> dict[str, Array]:
    """Marks (3,) on top of the pillars [m]."""
    zero = (0.0, 0.0, 0.0)
    return {
        name: np.array([e, n, ROAD + top]) + (moved or {}).get(name, zero)
        for name, (e, n, top) in REFERENCES.items()
    }


def _face(number: int) -> Array:
    """Lowest and highest corner (2, 3) of a panel's face before anything moved [m]."""
    west = WEST + number * WIDTH
    return np.array(
        [[west + JOINT / 2, FACE, ROAD], [west + WIDTH - JOINT / 2, FACE, ROAD + HEIGHT]]
    )


def _wall(shifts: dict[str, Pose]) -> list[Primitive]:
    """The panels."""
    out = []
    for number, panel in enumerate(PANELS):
        low, high = _face(number)
        center = (low + high) / 2 + np.array([0.0, THICK / 2, 0.0])
        size = high - low + np.array([0.0, THICK, 0.0])
        out.append(carried(box(center, size, 0.5 + 0.02 * (number % 3)), shifts[panel]))
    return out


def _targets(shifts: dict[str, Pose]) -> list[TwinTarget]:
    """Boards a centimetre in front of their surfaces; those on panels go with them."""
    out = []
    for name, (panel, along, height) in ON_WALL.items():
        west = WEST + PANELS.index(panel) * WIDTH
        center = shifts[panel] @ np.array([west + along, FACE - 0.01, ROAD + height])
        normal = shifts[panel].rotation @ np.array([0.0, -1.0, 0.0])
        out.append(TwinTarget(name, "checkerboard", center, SIDE, normal))
    for name, (e, height) in ON_HOUSE.items():
        center = np.array([e, HOUSE + 0.01, ROAD + height])
        out.append(TwinTarget(name, "checkerboard", center, SIDE, np.array([0.0, 1.0, 0.0])))
    return out


def _surroundings() -> list[Primitive]:
    """Road, the fill behind the wall, abutments, a house, pillars, a lamp and a fence."""
    out = [
        ground((118, 210, ROAD), 300),
        box((118, FACE + 8.6, ROAD + 2.2), (60, 16, 4.4), 0.3),
        box((WEST - 2.1, FACE + 0.1, ROAD + 2.7), (3, 1.4, 5.4), 0.45),
        box((WEST + 6 * WIDTH + 2.1, FACE + 0.1, ROAD + 2.6), (3, 1.4, 5.2), 0.42),
        box((119, HOUSE - 5, ROAD + 4), (38, 10, 8), 0.6),
        cylinder((112.6, 215.9, ROAD + 3), 0.08, 6, 0.3),
        cylinder((126.9, 216.3, ROAD + 3), 0.08, 6, 0.3),
        box((136.4, 199.1, ROAD + 0.7), (4.3, 1.8, 1.4), 0.4, 0.2),
    ]
    # a pillar that moves a few millimetres is too small a thing to be seen by scans
    for e, n, top in REFERENCES.values():
        out.append(cylinder((e, n, ROAD + top / 2), 0.14, top, 0.5))
    return out


def _measured_by(scene: Scene, origin: Array, targets: list[TwinTarget]) -> list[TwinTarget]:
    """The targets that nothing hides from a place (3,) [m] and that are not too oblique."""
    centers = np.array([t.center for t in targets])
    seen = sight_lines(origin[None], centers, scene, steepest=STEEPEST).seen[0]
    return [t for t, sees in zip(targets, seen, strict=True) if sees]


def _network(
    scene: Scene, marks: dict[str, Array], targets: list[TwinTarget], rng: np.random.Generator
) -> str:
    """The raw file of the total station: all pillars, and the boards, from the control pillars."""
    lines = [(a, b) for a in CONTROL for b in REFERENCES if a != b]
    for name in CONTROL:
        eye = marks[name] + np.array([0.0, 0.0, HEIGHT_INSTRUMENT[name]])
        lines += [(name, target.name) for target in _measured_by(scene, eye, targets)]
    places = {**marks, **{t.name: t.center for t in targets}}
    prisms = dict.fromkeys(marks, HEIGHT_TARGET)
    # the published pages and pictures are of this day
    still = raw_readings.STILL
    heights = HEIGHT_INSTRUMENT
    return raw_readings.gsi(places, sorted(lines), heights, prisms, TOTAL_STATION, rng, still)
