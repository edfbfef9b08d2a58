"""Folders as a surveyor brings them from the site, made from a simulated survey of two facades.

Nothing in them is of this program: scans in E57 or LAZ, an Excel list with German heads and decimal
commas, the raw file of the total station or data of STAR*NET.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pye57
from scipy.ndimage import binary_dilation
from scipy.spatial.transform import Rotation

from tests.registration.clouds.scenes import points_of, yard
from tribrach.geometry.pose import Pose
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.survey.exported import export
from tribrach.job.opened import open_job
from tribrach.project import Project
from tribrach.scan.scan import Field
from tribrach.simulate.setups import levelled
from tribrach.simulate.twin import Twin, TwinScan
from tribrach.simulate.twins import build

#: where scanners stand in a yard: east, north [m] and heading [rad]
YARD = ((-4.0, 3.0, 0.3), (5.0, -2.0, 2.5), (2.0, 8.0, -1.4), (-2.0, -4.0, 1.0))


@cache
def facades() -> Twin:
    """The survey, with as few points in its overviews as it has."""
    return build("hanoi-facade", 60_000, 1)


def _of_station(twin: Twin, station: str, points: int) -> TwinScan:
    """A scan of the targets of a station and of what is around them, of about so many points."""
    (one,) = (scan for scan in twin.scans if scan.name == f"{station}-targets")
    mask = one.mask
    assert mask is not None
    while mask.sum() < points:
        mask = binary_dilation(mask, iterations=max(int(0.02 * min(mask.shape)), 1))
    return replace(one, name=station, mask=mask)


def _points(twin: Twin, one: TwinScan) -> tuple[Any, Any]:
    """Points (n, 3) [m] and intensities of a scan."""
    scans = [*twin.scans, one]
    blocks = list(replace(twin, scans=scans).measure(len(scans) - 1))
    xyz = np.concatenate([block.xyz for block in blocks])
    return xyz, np.concatenate([block.intensity for block in blocks])


def _write_e57(path: Path, twin: Twin, one: TwinScan) -> None:
    """A scan with the pose that a scanner gives it in its own project."""
    xyz, intensity = _points(twin, one)
    pose = twin.station(one.station).pose
    x, y, z, w = Rotation.from_matrix(pose.rotation).as_quat()
    file = pye57.E57(str(path), mode="w")
    columns = {f"cartesian{axis}": xyz[:, k] for k, axis in enumerate("XYZ")}
    file.write_scan_raw(
        columns | {"intensity": intensity.astype(float)},
        name=one.name,
        rotation=np.array([w, x, y, z]),
        translation=pose.translation - [1040.0, 2020.0, 0.0],
    )
    file.close()


def _write_laz(path: Path, twin: Twin, one: TwinScan) -> None:
    """A scan without its pose."""
    xyz, intensity = _points(twin, one)
    header = CloudHeader(one.name, (Field("intensity", "float32", 0.0, 1.0),), step=1e-4)
    with create(path, header) as writer:
        writer.write(xyz, {"intensity": intensity})


def _rows(text: str) -> list[list[str]]:
    return [line.split(",") for line in text.splitlines()[1:]]


def with_excel_and_gsi(folder: Path, points: int) -> Twin:
    """Four E57 scans, a list in Excel with German heads and decimal commas, a GSI file."""
    twin = facades()
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "Scans").mkdir()
    for station in twin.stations:
        one = _of_station(twin, station.name, points)
        _write_e57(folder / "Scans" / f"{station.name}.e57", twin, one)
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["Festpunkte Hof"])
    sheet.append([])
    sheet.append(["Punktnummer", "Rechtswert", "Hochwert", "Höhe", "sE [mm]", "sN [mm]", "sH [mm]"])
    for name, *cells in _rows(twin.files["control.csv"]):
        sheet.append([name, *(cell.replace(".", ",") for cell in cells)])
    book.save(folder / "Festpunkte.xlsx")
    (folder / "traverse.gsi").write_text(twin.files["traverse.gsi"])
    (folder / "Fotos.jpg").write_bytes(b"\xff\xd8\xff")
    return twin


def with_starnet_and_laz(folder: Path, points: int) -> Twin:
    """Four LAZ scans and data of STAR*NET with its control."""
    twin = facades()
    folder.mkdir(parents=True, exist_ok=True)
    for station in twin.stations:
        _write_laz(folder / f"{station.name}.laz", twin, _of_station(twin, station.name, points))
    office = folder.parent / "office"
    office.mkdir()
    for name in ("control.csv", "traverse.gsi"):
        (office / name).write_text(twin.files[name])
    text = twin.project.split("[[points]]")[0] + (
        '[[points]]\nfile = "control.csv"\n'
        '[[observations]]\nfile = "traverse.gsi"\ninstrument = "total_station"\n'
    )
    (office / "p.toml").write_text(text.replace('truth = "truth/truth.json"\n', ""))
    network = open_job(Project.load(office / "p.toml")).network()
    (folder / "site.dat").write_text(export(network, "starnet").text)
    return twin


def scans_alone(folder: Path, points: int) -> dict[str, Pose]:
    """Four E57 scans of a yard without poses and without anything else; their true poses."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(1)
    poses = {}
    for k, (x, y, heading) in enumerate(YARD):
        name = f"P{k + 1}"
        poses[name] = levelled((x, y, 1.6), heading, 5e-5, rng)
        xyz = points_of(yard(), poses[name], points, k)
        header = CloudHeader(name, step=1e-4)
        with create(folder / f"{name}.e57", header) as writer:
            writer.write(xyz, {})
    return poses
