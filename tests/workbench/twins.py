"""Two stations in a yard with a mast: one job in local, projected and geocentric coordinates.

The truth is the same in all three: targets and poses along east, north, up of one place. Grids and
geocentric coordinates of it come from pyproj alone.
"""

from functools import cache
from pathlib import Path

import laspy
import numpy as np
from pyproj import Transformer
from scipy.spatial.transform import Rotation

from tribrach import pipeline
from tribrach.report.content import Report

#: latitude, longitude [degrees], ellipsoidal height [m] of the place
PLACE = (21.0123, 105.8451, 25.0)
GRID = "EPSG:32648"
KINDS = ("work", "projected", "ecef")
#: along east, north, up of the place; BASE and TOP are the ends of a vertical mast
TARGETS = {
    "BASE": (12.0, 9.0, 0.5),
    "TOP": (12.0, 9.0, 8.5),
    "T1": (-15.0, 4.0, 1.2),
    "T2": (6.0, -18.0, 2.4),
    "T3": (20.0, 14.0, 3.1),
    "T4": (-8.0, 22.0, 0.2),
}
#: of the floor, the eastern and the northern wall, 0 to 255
COLOURS = ((70, 140, 60), (170, 60, 40), (225, 215, 190))
POSES = {"S1": ((2.0, 1.0, 1.7), 40.0), "S2": ((-4.0, 8.0, 1.6), -110.0)}
_SCAN = """[[scans]]
file = "{name}.laz"
station = "{name}"
instrument = "scanner"
origin = "scanner"
"""
_PROJECT = """title = "Yard <b>&"
{site}
[instruments.scanner]
range_mm = 2.0
scan_angle_arcsec = 8.0
beam_exit_mm = 3.5
beam_divergence_mrad = 0.2

[[points]]
file = "control.csv"
role = "control"

[[observations]]
file = "targets.csv"

[cloud]
incidence = true
frame = "{frame}"

"""


def east_north_up() -> np.ndarray:
    """Rows east, north, up of the place in geocentric axes."""
    b, a = np.radians(PLACE[:2])
    return np.array(
        [
            [-np.sin(a), np.cos(a), 0],
            [-np.sin(b) * np.cos(a), -np.sin(b) * np.sin(a), np.cos(b)],
            [np.cos(b) * np.cos(a), np.cos(b) * np.sin(a), np.sin(b)],
        ]
    )


def geocentric(enu: np.ndarray) -> np.ndarray:
    """Geocentric coordinates (n, 3) of places (n, 3) along east, north, up."""
    to = Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
    at = np.array(to.transform(PLACE[1], PLACE[0], PLACE[2]))
    return at + enu @ east_north_up()


def of_kind(kind: str, enu: np.ndarray) -> np.ndarray:
    """Coordinates (n, 3) of places in one of the frames."""
    if kind == "work":
        return enu
    x = geocentric(enu)
    if kind == "ecef":
        return x
    back = Transformer.from_crs("EPSG:4978", "EPSG:4979", always_xy=True)
    longitude, latitude, height = back.transform(*x.T)
    plan = Transformer.from_crs("EPSG:4326", GRID, always_xy=True)
    return np.stack([*plan.transform(longitude, latitude), height], axis=1)


def write(folder: Path, kind: str) -> Path:
    """The project of one of the frames in a folder."""
    rng = np.random.default_rng(5)
    names, places = list(TARGETS), np.array(list(TARGETS.values()))
    rows = ["station,target,x_m,y_m,z_m,sigma_x_mm,sigma_y_mm,sigma_z_mm"]
    scans = ""
    for number, (station, (at, heading)) in enumerate(POSES.items()):
        turn = Rotation.from_euler("z", heading, degrees=True).as_matrix()
        local = (places - at) @ turn + rng.normal(0, 1e-3, places.shape)
        for name, xyz in zip(names, local.tolist(), strict=True):
            rows.append(f"{station},{name},{','.join(f'{v:.5f}' for v in xyz)},1,1,1")
        _scan(folder / f"{station}.laz", number, np.array(at), turn)
        scans += _SCAN.format(name=station)
    (folder / "targets.csv").write_text("\n".join([*rows, ""]))
    head = {
        "work": "point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm",
        "projected": "point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm",
        "ecef": "point,ecef_x_m,ecef_y_m,ecef_z_m,sigma_e_mm,sigma_n_mm,sigma_u_mm",
    }[kind]
    given = of_kind(kind, places)
    control = [
        f"{n},{x:.5f},{y:.5f},{z:.5f},2,2,3"
        for n, (x, y, z) in zip(names, given, strict=True)
        if n[0] == "T"
    ]
    (folder / "control.csv").write_text("\n".join([head, *control, ""]))
    site = {
        "work": '[site]\nkind = "flat"',
        "projected": f'[site]\nkind = "projected"\ncrs = "{GRID}"\nheight_m = {PLACE[2]}',
        "ecef": '[site]\nkind = "geodetic"\n'
        f"latitude_deg = {PLACE[0]}\nlongitude_deg = {PLACE[1]}\nheight_m = {PLACE[2]}",
    }[kind]
    path = folder / "yard.toml"
    path.write_text(_PROJECT.format(site=site, frame=kind) + scans)
    return path


def _scan(path: Path, seed: int, at: np.ndarray, turn: np.ndarray) -> None:
    """A floor and two walls of the yard around a station, in the frame of the scanner."""
    rng = np.random.default_rng(100 + seed)
    n = 1500
    u = rng.uniform(-20, 20, (3, n))
    floor = np.stack([u[0], u[1], np.zeros(n)], axis=1)
    east = np.stack([np.full(n, 25.0), u[0], np.abs(u[2]) / 2], axis=1)
    north = np.stack([u[1], np.full(n, 26.0), np.abs(u[0]) / 2], axis=1)
    local = (np.concatenate([floor, east, north]) - at) @ turn
    header = laspy.LasHeader(point_format=7, version="1.4")
    header.scales, header.offsets = np.full(3, 1e-4), np.zeros(3)
    with laspy.open(path, mode="w", header=header) as file:
        points = laspy.ScaleAwarePointRecord.zeros(len(local), header=header)
        points.x, points.y, points.z = local.T
        points.intensity = rng.integers(100, 2000, len(local))
        # grass, brick and plaster, each of one colour
        colours = np.repeat(np.array(COLOURS) * 257, n, axis=0)
        points.red, points.green, points.blue = colours.T
        file.write_points(points)


@cache
def _run(folder: Path, kind: str) -> Report:
    return pipeline.run(write(folder, kind), folder / "out")


def results(folder: Path, kind: str) -> Path:
    """The folder of results of the job in one of the frames, run once."""
    folder.mkdir(parents=True, exist_ok=True)
    _run(folder, kind)
    return folder / "out"
