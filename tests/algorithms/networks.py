"""Networks of many sorts, most of them degenerate, as a project with two tables."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Random = np.random.Generator

PROJECT = """\
title = "Network"
{site}
[instruments.ts]
direction_arcsec = {sigma}
zenith_arcsec = {sigma}
distance_mm = {sigma}
[[points]]
file = "c.csv"
role = "{role}"
[[observations]]
file = "o.csv"
instrument = "ts"
"""

#: what is done to the places of stations and targets
PLACES = (
    "as they are", "one target", "one station", "collinear", "coplanar", "equal points",
    "1e-12 m", "upright", "danger circle", "far away", "1 km", "1e7 m", "all equal",
)  # fmt: skip
#: what is done to the tables
TABLES = (
    "as they are", "no redundancy", "zero sigmas", "tiny sigmas", "huge sigmas", "no control",
    "one control", "negated", "exchanged", "other coordinates", "feet", "disconnected", "twice",
    "zenith 0", "zenith 400", "zero distance", "blunder", "long names", "controls in names",
    "normal forms", "case alone", "signs in names", "no distances", "directions alone", "empty",
    "head alone",
)  # fmt: skip


def _places(rng: Random, what: str) -> tuple[Array, Array]:
    """Stations and targets."""
    stations = rng.uniform(-5, 5, (3, 3)) * [1, 1, 0.1]
    targets = rng.uniform(-50, 50, (6, 3)) * [1, 1, 0.1]
    if what == "one target":
        targets = targets[:1]
    elif what == "one station":
        stations = stations[:1]
    elif what == "collinear":
        way = np.array([3.0, 1.0, 0.2])
        stations = np.arange(3.0)[:, None] * way
        targets = np.arange(4.0, 10.0)[:, None] * way
    elif what == "coplanar":
        stations[:, 2] = targets[:, 2] = 0.0
    elif what == "equal points":
        targets[1] = targets[0]
    elif what == "all equal":
        targets[:] = targets[0]
    elif what == "1e-12 m":
        targets[1] = targets[0] + 1e-12
    elif what == "upright":
        targets[:, :2] = stations[0, :2]
    elif what == "danger circle":
        angle = rng.uniform(0, 2 * np.pi, 9)
        circle = 30 * np.stack([np.cos(angle), np.sin(angle), np.zeros(9)], axis=1)
        stations, targets = circle[:3], circle[3:]
    elif what == "far away":
        targets *= 1e4
    shift = {"1 km": 1e3, "1e7 m": 1e7}.get(what, 0.0)
    return stations + shift, targets + shift


def _name(k: int, what: str) -> str:
    return {
        "long names": "N" * 10_000 + str(k),
        "controls in names": f"\x01T{k}",
        "normal forms": ("A\u030a", "\u00c5")[k % 2] + str(k // 2),
        "case alone": ("t", "T")[k % 2] + str(k // 2),
        "signs in names": f"<b>{k}&'\u202e\u200b",
    }.get(what, f"T{k}")


def random_network(folder: Path, rng: Random) -> tuple[str, dict[str, Array] | None]:
    """Write a project ``p.toml``; what it is, and true places that a result has to agree with."""
    place, table = str(rng.choice(PLACES)), str(rng.choice(TABLES))
    stations, targets = _places(rng, place)
    sigma = 3.0
    true = {_name(k, table): t for k, t in enumerate(targets)}
    names = list(true)
    rows = []
    for s, station in enumerate(stations):
        turn = rng.uniform(0, 400)
        for name, target in [*true.items(), *((f"S{k}", x) for k, x in enumerate(stations[:s]))]:
            way = target - station
            r = float(np.linalg.norm(way))
            if r == 0.0:
                continue
            angle = sigma / 3600 / 0.9
            h = np.arctan2(way[0], way[1]) * 200 / np.pi + turn + rng.normal() * angle
            z = np.arccos(np.clip(way[2] / r, -1, 1)) * 200 / np.pi + rng.normal() * angle
            rows.append([f"S{s}", name, h % 400, z % 400, r + rng.normal() * sigma * 1e-3])
    control = {n: true[n] + rng.normal(size=3) * 1e-3 for n in names[: max(3, len(names) - 2)]}
    sigmas, role, columns = (1.0, 1.0, 1.0), "control", 5
    stated = sigma
    if table == "no redundancy":
        rows = rows[:3]
    elif table == "zero sigmas":
        sigmas, stated = (0.0, 0.0, 0.0), 0.0
    elif table == "tiny sigmas":
        sigmas, stated = (1e-9, 1e-9, 1e-9), 1e-9
    elif table == "huge sigmas":
        sigmas, stated = (1e9, 1e9, 1e9), 1e5
    elif table == "no control":
        role = "approximate"
    elif table == "one control":
        control = dict(list(control.items())[:1])
    elif table == "negated":
        control = {n: x * [1, -1, 1] for n, x in control.items()}
    elif table == "exchanged":
        control = {n: x[[1, 0, 2]] for n, x in control.items()}
    elif table == "other coordinates":
        control = {n: rng.uniform(-100, 100, 3) for n in control}
    elif table == "feet":
        control = {n: x / 0.3048 for n, x in control.items()}
    elif table == "disconnected":
        rows = [r for r in rows if r[0] == "S0"] + [["S9", "X1", 10.0, 100.0, 5.0]]
    elif table == "twice":
        rows = rows + rows
    elif table in ("zenith 0", "zenith 400"):
        rows[0][3] = 0.0 if table == "zenith 0" else 399.9999
    elif table == "zero distance":
        rows[0][4] = 0.0
    elif table == "blunder":
        rows[0][4] += 1.0
    elif table in ("no distances", "directions alone"):
        columns = 4 if table == "no distances" else 3
    elif table == "empty":
        rows = []
    head = ["station", "target", "direction_gon", "zenith_gon", "slope_distance_m"][:columns]
    lines = [",".join(head)]
    lines += [
        ",".join(c if isinstance(c, str) else f"{c:.7f}" for c in row[:columns]) for row in rows
    ]
    (folder / "o.csv").write_text("" if table == "empty" else "\n".join(lines) + "\n")
    lines = ["point,e_m,n_m,u_m,sigma_e_mm,sigma_n_mm,sigma_u_mm"]
    if table != "head alone":
        lines += [
            ",".join([n, *map(repr, map(float, x)), *map(str, sigmas)]) for n, x in control.items()
        ]
    (folder / "c.csv").write_text("\n".join(lines) + "\n")
    site = str(rng.choice(["", '[site]\nkind = "flat"']))
    text = PROJECT.format(site=site, sigma=stated, role=role)
    (folder / "p.toml").write_text(text)
    sound = table in ("as they are", "no redundancy", "one control", "twice", "long names") and (
        place not in ("far away", "1 km", "1e7 m") and table != "one control"
    )
    return f"{place}; {table}; {site or 'no site'}", true if sound else None
