"""Writes large simulated networks to files that ``tribrach adjust`` and other programs read.

    python -m benchmarks.network_files grid SIDE FILE
    python -m benchmarks.network_files scanner STATIONS TARGETS FOLDER

The grid has SIDE x SIDE set-ups that sight their neighbours, some of them with GNSS; its file is
that of Gama (.gkf), STAR*NET (.dat) or DynAdjust (.xml). The hall has scanner stations that see
the 60 nearest of its targets each, as polar readings without any approximate values:
``polar.csv``, and ``control.csv`` with the coordinates of some targets.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from tribrach.io.survey.exported import export
from tribrach.network.network import Network
from tribrach.network.survey import Survey
from tribrach.observations.gnss import GnssPositions
from tribrach.observations.sights import Directions, SlopeDistances, ZenithAngles

#: formats of a grid by the suffix of its file
FORMATS = {".gkf": "gkf", ".dat": "starnet", ".xml": "dynaml"}
#: targets that a scanner station sees
SEEN = 60


def grid(side: int, seed: int = 0) -> Network:
    """A grid of side x side set-ups 100 m apart; every set-up sights its four neighbours."""
    rng = np.random.default_rng(seed)
    count = side * side
    e, n = (a.ravel() * 100.0 for a in np.meshgrid(np.arange(side), np.arange(side)))
    truth = np.c_[e, n, 10 * np.sin(e / 300) * np.cos(n / 200)] + rng.normal(0, 3, (count, 3))
    index = np.arange(count).reshape(side, side)
    pairs = [(index[:, :-1], index[:, 1:]), (index[:-1], index[1:])]
    one = np.concatenate([np.c_[a.ravel(), b.ravel()] for a, b in pairs])
    both = np.concatenate([one, one[:, ::-1]])
    names = np.array([f"P{i}" for i in range(count)], dtype=object)
    circles = np.array([f"orientation {name}" for name in names], dtype=object)

    survey = Survey()
    for name, x in zip(names, truth + rng.normal(0, 0.05, truth.shape), strict=True):
        survey.point(name, x)

    def sights(pair: np.ndarray) -> dict[str, np.ndarray]:
        return {"start": names[pair[:, 0]], "end": names[pair[:, 1]]}

    chord = truth[both[:, 1]] - truth[both[:, 0]]
    azimuth = np.arctan2(chord[:, 0], chord[:, 1]) - rng.uniform(-3, 3, count)[both[:, 0]]
    survey.add(
        Directions,
        values=azimuth + rng.normal(0, 5e-6, len(both)),
        sigma=5e-6,
        orientation=circles[both[:, 0]],
        **sights(both),
    )
    chord = truth[one[:, 1]] - truth[one[:, 0]]
    zenith = np.arctan2(np.hypot(chord[:, 0], chord[:, 1]), chord[:, 2])
    noise = rng.normal(0, 1, (2, len(one)))
    survey.add(ZenithAngles, values=zenith + 1e-5 * noise[0], sigma=1e-5, **sights(one))
    length = np.linalg.norm(chord, axis=1)
    survey.add(SlopeDistances, values=length + 0.002 * noise[1], sigma=0.002, **sights(one))
    antenna = np.arange(0, count, max(1, count // 100))
    survey.add(
        GnssPositions,
        values=truth[antenna] + rng.normal(0, 0.01, (len(antenna), 3)),
        sigma=0.01,
        position=names[antenna],
    )
    return survey.network()


def write_grid(side: int, file: Path) -> int:
    """Write a grid; its observed values."""
    network = grid(side)
    for path, text in export(network, FORMATS[file.suffix]).files(file).items():
        path.write_text(text, encoding="utf-8")
    return network.count()


def write_scanner(
    stations: int, targets: int, folder: Path, seed: int = 0, seen: int = SEEN
) -> int:
    """Write the readings of a hall of scanner stations; their number of values."""
    rng = np.random.default_rng(seed)
    size = 10.0 * np.sqrt(targets)
    place = rng.uniform(0, 1, (targets, 3)) * [size, size, 12]
    stand = rng.uniform(0, 1, (stations, 3)) * [size, size, 2]
    turn = rng.uniform(0, 2 * np.pi, stations)
    _, near = cKDTree(place).query(stand, k=min(seen, targets))
    station, target = np.repeat(np.arange(stations), near.shape[1]), near.ravel()
    chord = place[target] - stand[station]
    # what stands at the scanner or above it is not seen
    seen_well = np.hypot(chord[:, 0], chord[:, 1]) > np.maximum(0.5, 0.02 * np.abs(chord[:, 2]))
    station, target = station[seen_well], target[seen_well]
    e, n, u = chord[seen_well].T
    flat = np.hypot(e, n)
    noise = rng.normal(0, 1, (3, len(station)))
    distance = np.hypot(flat, u) + 0.002 * noise[0]
    circle = np.rad2deg(np.arctan2(n, e) - turn[station]) + 8 / 3600 * noise[1]
    zenith = np.rad2deg(np.arctan2(flat, u)) + 8 / 3600 * noise[2]
    folder.mkdir(parents=True, exist_ok=True)
    readings = zip(station, target, distance, circle % 360, zenith, strict=True)
    head = "station,target,range_m,horizontal_deg,zenith_deg,sigma_range_mm,"
    lines = [head + "sigma_horizontal_arcsec,sigma_zenith_arcsec"]
    lines += [f"S{s},T{t},{r:.5f},{a:.7f},{z:.7f},2,8,8" for s, t, r, a, z in readings]
    (folder / "polar.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    control = np.unique(near[:: max(1, stations // 10), :3])
    lines = ["point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm,role"]
    given = place[control] + rng.normal(0, 0.002, (len(control), 3))
    for name, (x, y, z) in zip(control, given, strict=True):
        lines.append(f"T{name},{x:.4f},{y:.4f},{z:.4f},2,2,2,control")
    (folder / "control.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return 3 * (len(station) + len(control))


def main() -> None:
    """Write what is asked for."""
    match sys.argv[1:]:
        case ["grid", side, file] if Path(file).suffix in FORMATS:
            count = write_grid(int(side), Path(file))
        case ["scanner", stations, targets, folder]:
            count = write_scanner(int(stations), int(targets), Path(folder))
        case _:
            sys.exit(__doc__)
    print(f"{sys.argv[-1]}: {count} observed values")


if __name__ == "__main__":
    main()
