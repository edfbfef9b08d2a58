"""Folders of five offices with habits of their own, all of one simulated survey of two facades.

``python -m tests.journeys.offices german OUT`` writes one. Columns, units, axes and formats are
those of the office; the numbers are those of the simulator.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import openpyxl
import pye57
from scipy.spatial.transform import Rotation

from tests.journeys.folders import _of_station, _points, facades
from tribrach.io.clouds.formats import create
from tribrach.io.clouds.header import CloudHeader
from tribrach.io.totalstation import gsi
from tribrach.io.totalstation.records import RawFile
from tribrach.scan.scan import Field
from tribrach.simulate.twin import Twin
from tribrach.units import UNITS

#: of all marks that somebody determined: name, east, north, up
Points = list[tuple[str, float, float, float]]
JPEG = b"\xff\xd8\xff\xe0"


def _marks(twin: Twin) -> Points:
    """Control and check points, as the twin lists them."""
    rows = [
        line.split(",")
        for name in ("control.csv", "check.csv")
        for line in twin.files[name].splitlines()[1:]
    ]
    return [(row[0], float(row[1]), float(row[2]), float(row[3])) for row in rows]


def _levelled(twin: Twin) -> list[tuple[str, str, float, float]]:
    """Height differences of the levelling: from, to, difference, length [m]."""
    head, *rows = (line.split(",") for line in twin.files["levelling.csv"].splitlines())
    at = {name.rpartition("_")[0] or name: k for k, name in enumerate(head)}
    factor = 1000.0 if "length_km" in head else 1.0
    return [
        (
            row[at["from"]],
            row[at["to"]],
            float(row[at["height_difference"]]),
            factor * float(row[at["length"]]),
        )
        for row in rows
    ]


def _raw(twin: Twin, folder: Path) -> RawFile:
    """The readings of the total station."""
    path = folder / "traverse.gsi"
    path.write_text(twin.files["traverse.gsi"])
    raw = gsi.read(path)
    path.unlink()
    return raw


def _german(number: float, digits: int = 4) -> str:
    return f"{number:.{digits}f}".replace(".", ",")


def _table(path: Path, head: str, rows: Iterable[Sequence[object]], mark: str = ";") -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [head, *(mark.join(map(str, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _e57(path: Path, twin: Twin, scans: Sequence[str], points: int, *, posed: bool) -> None:
    """Scans of one set-up in one file, the panorama thinned to so many points."""
    path.parent.mkdir(parents=True, exist_ok=True)
    file = pye57.E57(str(path), mode="w")
    for name in scans:
        one = next(scan for scan in twin.scans if scan.name == name)
        if name.endswith("-targets"):
            one = replace(_of_station(twin, one.station, points), name=name)
        xyz, intensity = _points(twin, one)
        if not name.endswith("-targets"):
            take = np.sort(np.random.default_rng(1).permutation(len(xyz))[:points])
            xyz, intensity = xyz[take], intensity[take]
        pose = twin.station(one.station).pose
        x, y, z, w = Rotation.from_matrix(pose.rotation).as_quat()
        place = {
            "rotation": np.array([w, x, y, z]),
            "translation": pose.translation - [1040.0, 2020.0, 0.0],
        }
        columns = {f"cartesian{axis}": xyz[:, k] for k, axis in enumerate("XYZ")}
        file.write_scan_raw(
            columns | {"intensity": intensity.astype(float)}, name=name, **(place if posed else {})
        )
    file.close()


def _laz(folder: Path, twin: Twin, points: int) -> None:
    for station in twin.stations:
        xyz, intensity = _points(twin, _of_station(twin, station.name, points))
        header = CloudHeader(station.name, (Field("intensity", "float32", 0.0, 1.0),), step=1e-4)
        with create(folder / f"{station.name}.laz", header) as writer:
            writer.write(xyz, {"intensity": intensity})


def german(folder: Path, points: int = 40_000) -> Twin:
    """Lists with Y and X, a sheet, GSI, a levelling table; panorama and window of each set-up."""
    twin = facades()
    marks = _marks(twin)
    _table(
        folder / "Koordinaten" / "Festpunkte.csv",
        "Punkt;Y;X;H",
        [(name, _german(e), _german(n), _german(u)) for name, e, n, u in marks[:2]],
    )
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["Punktnummer", "Rechtswert", "Hochwert", "Höhe"])
    for name, e, n, u in marks[2:]:
        sheet.append([name, round(e, 4), round(n, 4), round(u, 4)])
    book.save(folder / "Koordinaten" / "Passpunkte.xlsx")
    (folder / "Messung").mkdir()
    (folder / "Messung" / "Polygonzug.gsi").write_text(twin.files["traverse.gsi"])
    _table(
        folder / "Messung" / "Nivellement.csv",
        "von;nach;Höhenunterschied;Länge",
        [(a, b, _german(dh, 5), _german(s, 1)) for a, b, dh, s in _levelled(twin)],
    )
    for station in twin.stations:
        name = station.name
        if name in ("S1", "S2"):
            scans = [[name, f"{name}-targets"]]
            paths = [folder / "Scans" / f"{name}.e57"]
        else:
            scans = [[name], [f"{name}-targets"]]
            paths = [folder / "Scans" / f"{name} {what}.e57" for what in ("Panorama", "Fenster")]
        for path, own in zip(paths, scans, strict=True):
            _e57(path, twin, own, points, posed=True)
    (folder / "Bilder").mkdir()
    (folder / "Bilder" / "IMG_0001.jpg").write_bytes(JPEG)
    return twin


def american(folder: Path, points: int = 40_000) -> Twin:
    """Northing first, US survey feet, a raw file of Carlson, scans in LAZ."""
    twin = facades()
    folder.mkdir(parents=True, exist_ok=True)
    foot = UNITS["usft"]
    _table(
        folder / "control.csv",
        "Pt,Northing (usft),Easting (usft),Elevation (usft),Desc",
        [
            (name, f"{n / foot:.4f}", f"{e / foot:.4f}", f"{u / foot:.4f}", "CP")
            for name, e, n, u in _marks(twin)[:2]
        ],
        ",",
    )
    (folder / "job.rw5").write_text(_rw5(_raw(twin, folder), dict_of(_marks(twin))))
    _laz(folder, twin, points)
    return twin


def dict_of(points: Points) -> dict[str, tuple[float, float, float]]:
    """Coordinates by name."""
    return {name: (e, n, u) for name, e, n, u in points}


def _rw5(raw: RawFile, known: dict[str, tuple[float, float, float]]) -> str:
    """The readings in US survey feet and packed degrees."""
    foot = UNITS["usft"]

    def packed(radians: float) -> str:
        tenths = round(np.degrees(radians % (2 * np.pi)) * 36000)
        seconds, tenth = divmod(tenths, 10)
        minutes, s = divmod(seconds, 60)
        d, m = divmod(minutes, 60)
        return f"{d % 360}.{m:02d}{s:02d}{tenth}"

    rows = ["JB,NMFACADES,DT11-26-2026,TM08:00:00", "MO,AD0,UN2,SF1.00000000,EC0,EO0.0,AU0"]
    setups, shots = raw.setups, raw.shots
    for k, station in enumerate(setups.station):
        own = np.flatnonzero(shots.setup == k)
        if not len(own):
            continue
        n, e, u = 0.0, 0.0, 0.0
        if station in known:
            e, n, u = (c / foot for c in known[station])
        first = str(shots.target[own[0]])
        rows.append(f"OC,OP{station},N {n:.4f},E {e:.4f},EL{u:.4f},--")
        rows.append(f"BK,OP{station},BP{first},BS0.0000,BC0.0000")
        for i in own:
            rows.append(f"LS,HI{setups.height[k] / foot:.4f},HR{shots.height[i] / foot:.4f}")
            kind = "FD" if shots.face[i] == 1 else "FR"
            rows.append(
                f"{kind},OP{station},FP{shots.target[i]},AR{packed(shots.direction[i])},"
                f"ZE{packed(shots.zenith[i])},SD{shots.distance[i] / foot:.5f},--"
            )
    return "\n".join(rows) + "\n"


def french(folder: Path, points: int = 40_000) -> Twin:
    """Tables with French heads and decimal commas; E57 without poses."""
    twin = facades()
    folder.mkdir(parents=True, exist_ok=True)
    _table(
        folder / "points d'appui.csv",
        "Matricule;X;Y;Altitude",
        [(name, _german(e), _german(n), _german(u)) for name, e, n, u in _marks(twin)[:2]],
    )
    raw = _raw(twin, folder)
    shots, gon = raw.shots, 200 / np.pi
    _table(
        folder / "levé.csv",
        "station;point visé;direction (gon);angle zénithal (gon);distance inclinée;hauteur "
        "instrument;hauteur prisme",
        [
            (
                raw.setups.station[shots.setup[i]],
                shots.target[i],
                _german(shots.direction[i] * gon),
                _german(shots.zenith[i] * gon),
                _german(shots.distance[i]),
                _german(raw.setups.height[shots.setup[i]], 3),
                _german(shots.height[i], 3),
            )
            for i in np.flatnonzero(shots.face == 1)
        ],
    )
    _table(
        folder / "nivellement.csv",
        "de;à;dénivelée;longueur",
        [(a, b, _german(dh, 5), _german(s, 1)) for a, b, dh, s in _levelled(twin)],
    )
    for station in twin.stations:
        name = station.name
        _e57(folder / f"{name}.e57", twin, [f"{name}-targets"], points, posed=False)
    return twin


def landxml(folder: Path, points: int = 40_000) -> Twin:
    """Control and readings in LandXML, scans in LAZ."""
    twin = facades()
    folder.mkdir(parents=True, exist_ok=True)
    raw = _raw(twin, folder)
    setups, shots, gon = raw.setups, raw.shots, 200 / np.pi
    rows = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<LandXML xmlns="http://www.landxml.org/schema/LandXML-1.2" version="1.2" '
        'date="2026-11-26" time="08:00:00">',
        '<Units><Metric areaUnit="squareMeter" linearUnit="meter" volumeUnit="cubicMeter" '
        'temperatureUnit="celsius" pressureUnit="milliBars" angularUnit="grads" '
        'directionUnit="grads"/></Units>',
        "<CgPoints>",
        *(
            f'<CgPoint name="{name}" role="control">{n:.4f} {e:.4f} {u:.4f}</CgPoint>'
            for name, e, n, u in _marks(twin)[:2]
        ),
        "</CgPoints><Survey><SurveyHeader/>",
    ]
    for k, station in enumerate(setups.station):
        rows.append(
            f'<InstrumentSetup id="setup{k}" stationName="{station}" '
            f'instrumentHeight="{setups.height[k]:.4f}"/>'
        )
    for k in range(len(setups)):
        rows.append(f'<ObservationGroup id="group{k}" setupID="setup{k}">')
        for i in np.flatnonzero(shots.setup == k):
            direct = "true" if shots.face[i] == 1 else "false"
            rows.append(
                f'<RawObservation setupID="setup{k}" targetHeight="{shots.height[i]:.4f}" '
                f'horizAngle="{shots.direction[i] * gon:.5f}" '
                f'zenithAngle="{shots.zenith[i] * gon:.5f}" '
                f'slopeDistance="{shots.distance[i]:.5f}" directFace="{direct}">'
                f'<TargetPoint name="{shots.target[i]}"/></RawObservation>'
            )
        rows.append("</ObservationGroup>")
    rows.append("</Survey></LandXML>")
    (folder / "job.xml").write_text("\n".join(rows))
    _laz(folder, twin, points)
    return twin


def lists_and_gsi(folder: Path, points: int = 0) -> Twin:
    """No scans: a list without heads, a GSI file, a table of levelling with a title."""
    twin = facades()
    folder.mkdir(parents=True, exist_ok=True)
    _table(
        folder / "koord.txt",
        "; Punkt Rechts Hoch Höhe".replace("; ", ""),
        [(name, f"{e:.4f}", f"{n:.4f}", f"{u:.4f}") for name, e, n, u in _marks(twin)],
        "\t",
    )
    (folder / "koord.txt").write_text(
        (folder / "koord.txt").read_text().replace("Punkt Rechts Hoch Höhe", "Nr\tY\tX\tZ")
    )
    lines = twin.files["traverse.gsi"].splitlines(keepends=True)
    begins = [k for k, line in enumerate(lines) if "88..." in line or "84..." in line]
    for number, (a, b) in enumerate(pairwise([*begins, len(lines)]), start=1):
        (folder / f"Tag{number}.gsi").write_text("".join(lines[a:b]))
    return twin


OFFICES: dict[str, Callable[..., Twin]] = {
    "german": german,
    "american": american,
    "french": french,
    "landxml": landxml,
    "lists": lists_and_gsi,
}

if __name__ == "__main__":
    OFFICES[sys.argv[1]](Path(sys.argv[2]))
