"""A laboratory room with 52 targets and two stations 6.2417 m apart (S2; method section 4.3).

The layout of the targets is the deterministic one of the method; with ceiling targets, twelve more
hang above. The list of polar observations, in two faces and with the scanner's misalignments, is
for self-calibration (``tribrach calibrate calibrate.toml``); the scans are free of misalignments
unless they are asked for.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from tribrach._types import Array
from tribrach.geometry.polar import polar_from_xyz
from tribrach.instruments.calibration import NIST
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.simulate import surveying
from tribrach.simulate.aiming import fine_scan, overview
from tribrach.simulate.instruments import PHASE
from tribrach.simulate.scene import Primitive, Scene, box, rectangle
from tribrach.simulate.setups import tilted
from tribrach.simulate.twin import Twin, TwinScan, TwinStation, TwinTarget, child_rng, steps_for
from tribrach.units import SEC

BASE = 6.2417
SIDE = 0.2
FLOOR, CEILING = -1.55, 1.75
NOISE = ScanNoise(0.0012, 1e-5, 8 * SEC, 8 * SEC, 0.003, 0.00022)
#: of the target list: range, its scale, both angles
LIST = (0.0012, 1e-5, 8 * SEC)
TILT = float(np.radians(1.0))
FINE_STEP, CEILING_STEP = 0.0009, 0.002
ZENITH = (np.radians(20.0), np.radians(140.0))
#: true calibration parameters of the scanner behind the list of polar observations
MISALIGNMENTS: Mapping[str, float] = {
    "x10": 0.0011,
    "x2": 0.0004,
    "x3": 0.00025,
    "x4": 14 * SEC,
    "x6": 6 * SEC,
}

PROJECT = """\
# A laboratory room, two scanner stations that are not levelled (simulated).
title = "Laboratory room with 52 targets (simulated)"
confidence = 0.95
truth = "truth/truth.json"

[facts]
Data = "simulated from the sigmas of the instruments below"

[site]
kind = "flat"

[datum]
kind = "control"

[instruments.scanner]
range_mm = 1.2
range_ppm = 10.0
scan_angle_arcsec = 8.0
beam_exit_mm = 3.0
beam_divergence_mrad = 0.22

[[points]]
file = "control.csv"
role = "control"

[[points]]
file = "check.csv"
role = "check"

[targets]
checkerboard_side_m = [0.2]
# simulated prints and spheres are perfect
floor_mm = 0.0
orientation_mm = 0.0
"""

CALIBRATE = """\
# Self-calibration of the scanner from the list of polar observations (simulated).
title = "Laboratory room: calibration of the scanner (simulated)"
datum = "free"

[instruments.scanner]
range_mm = 1.2
range_ppm = 10.0
scan_angle_arcsec = 8.0

[[observations]]
file = "polar.csv"

[calibration]
model = "nist"
parameters = ["x10", "x2", "x3", "x4", "x6"]
"""


def places(ceiling: bool = False) -> tuple[Array, Array]:
    """Centres (n, 3) of the targets and their normals (n, 3): 52 on walls, 12 on the ceiling."""
    rows: list[tuple[float, ...]] = []
    for x in (-5.0, 6.0):
        for i in range(6):
            for z in (-0.85, -0.30, 0.40):
                k = len(rows)
                y = -3.5 + 2.6 * i + (0.13 * k) % 0.5
                rows.append((x, y, z + 0.02 * ((7 * k) % 5 - 2), -np.sign(x), 0.0, 0.0))
        for i in range(4):
            y = -4.2 if x < 0 else 10.4
            for z in (-0.85, 0.40):
                k = len(rows)
                across = -3.6 + 2.6 * i + 0.05 * (k % 3)
                normal = 1.0 if y < 0 else -1.0
                rows.append((across, y, z + 0.02 * ((7 * k) % 5 - 2), 0.0, normal, 0.0))
    if ceiling:
        for i, y in enumerate((-1.2, 1.6, 4.5, 7.3)):
            for j, x in enumerate((-1.4, 0.5, 2.7)):
                rows.append((x + 0.11 * i, y + 0.17 * j, CEILING - 0.01, 0.0, 0.0, -1.0))
    table = np.array(rows)
    return table[:, :3], table[:, 3:]


def with_ceiling(points: int = 1_000_000, seed: int = 1) -> Twin:
    """The twin with ceiling targets."""
    return build(points, seed, ceiling=True)


def build(
    points: int = 1_000_000,
    seed: int = 1,
    *,
    ceiling: bool = False,
    parameters: Mapping[str, float] | None = None,
) -> Twin:
    """The twin."""
    centers, normals = places(ceiling)
    targets = [
        TwinTarget(f"T{k:02d}", "checkerboard", c, SIDE, n)
        for k, (c, n) in enumerate(zip(centers, normals, strict=True), start=1)
    ]
    scene = Scene.of([*_room(), *(t.primitive() for t in targets)])
    rng = child_rng(seed, "poses")
    second = (1.2, float(np.sqrt(BASE**2 - 1.2**2)), 0.0)
    stations = [
        TwinStation("S1", tilted((0, 0, 0), 0.2, TILT, rng)),
        TwinStation("S2", tilted(second, -1.1, TILT, rng)),
    ]
    scans: list[TwinScan] = []
    for station in stations:
        scans += _scans(scene, station, targets, steps_for(points))
    return Twin(
        name="newcastle-lab-ceiling" if ceiling else "newcastle-lab",
        title="Laboratory room (simulated)",
        seed=seed,
        scene=scene,
        scanner=replace(PHASE, noise=NOISE, parameters=dict(parameters or {})),
        stations=stations,
        scans=scans,
        targets=targets,
        files=_survey(targets, stations, child_rng(seed, "survey")),
        project=PROJECT,
        facts={"misalignments_of_list": dict(MISALIGNMENTS), "check": _names(targets, 3)},
    )


def _scans(
    scene: Scene, station: TwinStation, targets: list[TwinTarget], points: int
) -> list[TwinScan]:
    """Overview, fine scan of the walls, fine scan of the ceiling."""
    walls, above = targets[:52], targets[52:]
    scans = [
        overview(station.name, scene, station.pose, points, ZENITH),
        fine_scan(station.name, station.pose, walls, FINE_STEP),
    ]
    if above:
        name = f"{station.name}-ceiling"
        scans.append(fine_scan(station.name, station.pose, above, CEILING_STEP, name))
    return scans


def _room() -> list[Primitive]:
    """Walls a centimetre behind the targets, floor, ceiling, a bench and a cupboard."""
    middle, across, along = (0.5, 3.1), 11.02, 14.62
    low, high = (middle[0] - across / 2, middle[1] - along / 2), FLOOR
    height = CEILING - FLOOR
    z = (FLOOR + CEILING) / 2
    return [
        rectangle((low[0], middle[1], z), (1, 0, 0), along, height, 0.6),
        rectangle((low[0] + across, middle[1], z), (-1, 0, 0), along, height, 0.6),
        rectangle((middle[0], low[1], z), (0, 1, 0), across, height, 0.55),
        rectangle((middle[0], low[1] + along, z), (0, -1, 0), across, height, 0.55),
        rectangle((*middle, high), (0, 0, 1), across, along, 0.35),
        rectangle((*middle, CEILING), (0, 0, -1), across, along, 0.7),
        box((-2.6, 3.2, FLOOR + 0.35), (1.6, 0.8, 0.7), 0.4, 0.2),
        box((3.9, 2.9, FLOOR + 0.3), (0.9, 0.6, 0.6), 0.5, 0.5),
    ]


def _names(targets: list[TwinTarget], first: int) -> list[str]:
    """Names of control (first 0) and check targets (first 3): every sixth one on the walls."""
    return [t.name for t in targets[first:52:6]]


def _survey(
    targets: list[TwinTarget], stations: list[TwinStation], rng: np.random.Generator
) -> dict[str, str]:
    """Control and check targets to half a millimetre; the list of polar observations."""
    known = {t.name: t.center for t in targets}
    sigma = (0.0005, 0.0005, 0.0005)
    control = {n: known[n] for n in _names(targets, 0)}
    check = {n: known[n] for n in _names(targets, 3)}
    return {
        "control.csv": surveying.coordinates(control, sigma, rng),
        "check.csv": surveying.coordinates(check, sigma, rng),
        "polar.csv": _polar(targets, stations, rng),
        "calibrate.toml": CALIBRATE,
    }


def _polar(targets: list[TwinTarget], stations: list[TwinStation], rng: np.random.Generator) -> str:
    """Polar observations of all targets from all stations in two faces, as a table."""
    model = NIST.select(tuple(MISALIGNMENTS))
    values = np.tile(list(MISALIGNMENTS.values()), (len(targets), 1))
    rows = ["station,target,face,range_m,horizontal_gon,zenith_gon,sigma_range_mm,"
            "sigma_horizontal_arcsec,sigma_zenith_arcsec"]  # fmt: skip
    for station in stations:
        true = polar_from_xyz(station.pose.inverse @ np.array([t.center for t in targets]))
        for face in (1, -1):
            faces, measured = np.full(len(targets), float(face)), true.copy()
            for _ in range(4):
                measured = true - model.delta(measured, faces, values)
            sigma = np.tile([0.0, LIST[2], LIST[2]], (len(targets), 1))
            sigma[:, 0] = LIST[0] + LIST[1] * true[:, 0]
            measured += sigma * rng.normal(size=sigma.shape)
            for target, m, s in zip(targets, measured, sigma, strict=True):
                h, v = m[1] % (2 * np.pi) * 200 / np.pi, m[2] * 200 / np.pi
                rows.append(
                    f"{station.name},{target.name},{face},{m[0]:.6f},{h:.6f},{v:.6f},"
                    f"{1e3 * s[0]:.4f},{s[1] / SEC:.3f},{s[2] / SEC:.3f}"
                )
    return "\n".join([*rows, ""])
