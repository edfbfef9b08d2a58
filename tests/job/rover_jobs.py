"""A scanner under the antenna of a rover: RINEX of two receivers, a simulated scan, their truth."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.gnss.test_baseline import BASE_3040, ROVER_0759, SPIRENT_BASE, SPIRENT_ROVER
from tests.gnss.test_baseline import geonet as geonet_files
from tests.gnss.test_baseline import spirent as spirent_files
from tribrach.geodesy.site import EllipsoidSite
from tribrach.geometry import rotation
from tribrach.geometry.pose import Pose
from tribrach.instruments.scan_noise import ScanNoise
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.simulate.aiming import fine_scan
from tribrach.simulate.scanner import Scanner, scan
from tribrach.simulate.scene import Scene, box, cylinder, ground
from tribrach.simulate.twin import TwinTarget
from tribrach.units import SEC

Array = np.ndarray

#: true lever arm [m], sigma that is stated of it, and radius of the spheres
ARM, ARM_SIGMA = np.array([0.004, -0.003, 0.331]), 0.004
RADIUS = 0.1
NOISE = ScanNoise(0.002, 1e-5, 8 * SEC, 8 * SEC, 0.004, 0.0002)
#: spheres: east, north, up from the antenna [m]; two of them are surveyed
SPHERES = {
    "T1": (9.0, 4.0, -1.0),
    "T2": (-6.0, 8.5, 0.4),
    "C1": (3.0, -11.0, -1.3),
    "C2": (-12.0, -5.0, 0.8),
    "C3": (12.5, -3.0, 0.2),
}
SURVEYED = ("T1", "T2")
#: of coordinates of spheres, E, N, U [m] (method section 7.4)
SIGMA = np.array([0.008, 0.008, 0.012])


@dataclass(frozen=True)
class Receivers:
    """A baseline: ECEF of base and rover [m], files, keys of [gnss], grid and epoch."""

    base: Array
    rover: Array
    files: tuple[Path, Path]
    orbits: Sequence[Path]
    keys: str
    grid: str
    epoch: float

    @property
    def local(self) -> EllipsoidSite:
        """East, north, up at the rover."""
        return EllipsoidSite.centred(self.rover[None])


def spirent(data: Path) -> Receivers:
    """The simulator: 2 km, exact truth, no atmosphere."""
    base, rover, orbits = spirent_files(data)
    keys = "atmosphere = false"
    place = np.array(SPIRENT_BASE), SPIRENT_ROVER
    return Receivers(*place, (base, rover), orbits, keys, "EPSG:32632", 2023.02)


def geonet(data: Path) -> Receivers:
    """Real receivers: 3.3 km, published coordinates."""
    base, rover, orbits = geonet_files(data)
    place = np.array(BASE_3040), ROVER_0759
    return Receivers(*place, (base, rover), orbits, "", "EPSG:32654", 2005.25)


def under_the_antenna(seed: int, lean: float) -> Pose:
    """A scanner with the antenna at zero; lean : how far it stands from upright [rad]."""
    rng = np.random.default_rng(seed)
    turn = rotation.exp(np.array([0, 0, 0.8])) @ rotation.exp(rng.uniform(-lean, lean, 3))
    return Pose(turn, -turn @ ARM)


def scanned(folder: Path, name: str, pose: Pose, seed: int) -> Array:
    """Points (n, 3) that a scanner saw: a file of windows around the spheres."""
    targets = [TwinTarget(name, "sphere", np.array(x), RADIUS) for name, x in SPHERES.items()]
    foot = -2.2
    stands = [
        cylinder(
            [*t.center[:2], (t.center[2] - RADIUS + foot) / 2], 0.015, t.center[2] - foot, 0.25
        )
        for t in targets
    ]
    bodies = [ground((0, 0, foot), 300), box((20, 10, 2), (8, 12, 8), 0.5)]
    scene = Scene.of([*bodies, *stands, *(t.primitive() for t in targets)])
    one = fine_scan(name, pose, targets, 0.001)
    parts = []
    with create(folder / f"{name}.ply", CloudHeader(name)) as writer:
        for block in scan(scene, pose, Scanner(NOISE), one.grid, (seed, 2, 0), one.mask):
            writer.write(block.xyz, {})
            parts.append(block.xyz)
    return np.concatenate(parts)


PROJECT = """\
title = "A scanner under a rover"

[site]
{site}

[instruments.scanner]
range_mm = 2.0
range_ppm = 10.0
scan_angle_arcsec = 8.0
beam_exit_mm = 4.0
beam_divergence_mrad = 0.2

[lever_arms.antenna]
x_m = {x:.4f}
y_m = {y:.4f}
z_m = {z:.4f}
sigma_mm = {sigma}

[stations.S1]
lever_arm = "antenna"
{station}

[[points]]
file = "control.csv"

{measured}

[targets]
sphere_radius_m = [0.1]

{scans}
[cloud]
format = "ply"
{cloud}
"""

SCAN = """\
[[scans]]
file = "{name}.ply"
station = "{name}"
origin = "scanner"
"""

SESSION = """\
[gnss]
navigation = {orbits}
{keys}

[[gnss.sessions]]
name = "one"
receivers = [
  {{ point = "BASE", file = "{base}" }},
  {{ point = "ROVER", file = "{rover}", antenna_height_m = 0.0 }},
]
"""


def control(
    place: Receivers, rng: np.random.Generator, known: Sequence[str], checks: Sequence[str]
) -> str:
    """The base, known spheres and check points with the errors of their sigmas."""
    e, n, u = 1e3 * SIGMA
    rows = [
        "point,ecef_x_m,ecef_y_m,ecef_z_m,sigma_e_mm,sigma_n_mm,sigma_u_mm,role",
        "BASE,{:.4f},{:.4f},{:.4f},,,,fixed".format(*place.base),
    ]
    for name, enu in SPHERES.items():
        x, y, z = place.local.to_ecef((np.array(enu) + rng.normal(0, SIGMA))[None])[0]
        role = {**dict.fromkeys(checks, "check"), **dict.fromkeys(known, "control")}.get(name)
        if role:
            rows.append(f"{name},{x:.4f},{y:.4f},{z:.4f},{e:g},{n:g},{u:g},{role}")
    return "\n".join([*rows, ""])


def by_rinex(folder: Path, place: Receivers, pose: Pose, rng: np.random.Generator) -> str:
    """Sections of what gives the antenna's place: the files of the receivers."""
    base, rover = place.files
    return SESSION.format(
        orbits=[str(path) for path in place.orbits], keys=place.keys, base=base, rover=rover
    )


def by_position(folder: Path, place: Receivers, pose: Pose, rng: np.random.Generator) -> str:
    """The same by a position that another program computed."""
    x, y, z = place.local.to_ecef(rng.normal(0, SIGMA)[None])[0]
    e, n, u = 1e3 * SIGMA
    (folder / "gnss.csv").write_text(
        "gnss,ecef_x_m,ecef_y_m,ecef_z_m,sigma_e_mm,sigma_n_mm,sigma_u_mm\n"
        f"S1,{x:.4f},{y:.4f},{z:.4f},{e:g},{n:g},{u:g}\n"
    )
    return '[[observations]]\nfile = "gnss.csv"'


@dataclass(frozen=True)
class Job:
    """A project and its truth: poses of the scanners from the antenna in E, N, U there.

    points : (n, 3) of the scan of each station.
    """

    path: Path
    place: Receivers
    poses: dict[str, Pose]
    points: dict[str, Array]

    def geocentric(self, station: str) -> Pose:
        """The true pose of a station in ECEF."""
        local, pose = self.place.local, self.poses[station]
        at = local.to_ecef(pose.translation[None])[0]
        return Pose(local.w_from_ecef.T @ pose.rotation, at)


def write_project(
    folder: Path,
    place: Receivers,
    site: str,
    *,
    cloud: str = "",
    station: str = 'mounted_point = "ROVER"',
    measured: Callable[..., str] = by_rinex,
    seed: int = 1,
    known: Sequence[str] = SURVEYED,
    checks: Sequence[str] = (),
    lean: float = 0.02,
    others: dict[str, Pose] | None = None,
) -> Job:
    """A project file, its scans and tables.

    known and checks : spheres with coordinates; others : stations without an antenna.
    """
    pose = under_the_antenna(seed, lean)
    poses = {"S1": pose} | (others or {})
    points = {n: scanned(folder, n, p, seed + k) for k, (n, p) in enumerate(poses.items())}
    rng = np.random.default_rng(seed + 1000)
    (folder / "control.csv").write_text(control(place, rng, known, checks))
    x, y, z = ARM + rng.normal(0, ARM_SIGMA, 3)
    path = folder / "p.toml"
    path.write_text(
        PROJECT.format(
            site=site,
            x=x,
            y=y,
            z=z,
            sigma=1e3 * ARM_SIGMA,
            station=station,
            measured=measured(folder, place, pose, rng),
            scans="".join(SCAN.format(name=name) for name in poses),
            cloud=cloud,
        )
    )
    return Job(path, place, poses, points)
