"""SP3 files out of the broadcast orbits of a navigation file, for what the shared data lack.

Satellite positions by the algorithm of IS-GPS-200, table 20-IV, written for these tests alone.
"""

from __future__ import annotations

import re
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

#: gravitational constant of WGS 84 [m^3/s^2] and rotation of the Earth [rad/s]
MU, OMEGA = 3.986005e14, 7.2921151467e-5
Elements = dict[str, float]
KEYS = (
    "af0", "af1", "af2", "iode", "crs", "dn", "m0", "cuc", "e", "cus", "roota", "toe", "cic",
    "node", "cis", "i0", "crc", "perigee", "nodedot", "idot", "codes", "week",
)  # fmt: skip


def broadcast(path: Path) -> dict[str, list[Elements]]:
    """Records of a GPS navigation file in RINEX 2 by satellite."""
    text = path.read_text().split("END OF HEADER", 1)[1]
    lines = [line for line in text.splitlines() if line.strip()]
    out: dict[str, list[Elements]] = {}
    for k in range(0, len(lines), 8):
        numbers = re.findall(r"[ -]\d\.\d+D[+-]\d\d", lines[k][22:] + "".join(lines[k + 1 : k + 8]))
        values = [float(word.replace("D", "e")) for word in numbers]
        name = f"G{int(lines[k][:2]):02d}"
        out.setdefault(name, []).append(dict(zip(KEYS, values, strict=False)))
    return out


def position(orbit: Elements, time: float) -> tuple[np.ndarray, float]:
    """ECEF (3,) [m] and clock [s] at a GPS time in seconds of the week."""
    a, t = orbit["roota"] ** 2, time - orbit["toe"]
    mean = orbit["m0"] + (np.sqrt(MU / a**3) + orbit["dn"]) * t
    eccentric = mean
    for _ in range(12):
        eccentric = mean + orbit["e"] * np.sin(eccentric)
    e = orbit["e"]
    true = np.arctan2(np.sqrt(1 - e * e) * np.sin(eccentric), np.cos(eccentric) - e)
    u = true + orbit["perigee"]
    c, s = np.cos(2 * u), np.sin(2 * u)
    u += orbit["cuc"] * c + orbit["cus"] * s
    r = a * (1 - e * np.cos(eccentric)) + orbit["crc"] * c + orbit["crs"] * s
    i = orbit["i0"] + orbit["idot"] * t + orbit["cic"] * c + orbit["cis"] * s
    node = orbit["node"] + (orbit["nodedot"] - OMEGA) * t - OMEGA * orbit["toe"]
    x, y = r * np.cos(u), r * np.sin(u)
    xyz = np.array(
        [
            x * np.cos(node) - y * np.cos(i) * np.sin(node),
            x * np.sin(node) + y * np.cos(i) * np.cos(node),
            y * np.sin(i),
        ]
    )
    return xyz, orbit["af0"] + orbit["af1"] * t + orbit["af2"] * t**2


def sp3(
    orbits: dict[str, list[Elements]],
    first: datetime,
    epochs: int = 33,
    step: float = 300.0,
    *,
    version: str = "c",
    system: str = "GPS",
    moved: float = 0.0,
    turned: float = 0.0,
    further: int = 0,
) -> str:
    """A file of all satellites, one set of elements each: the one nearest to the middle.

    moved : farther out [m]; turned : about the axis of the Earth [rad]; further : so many
    satellites more that nobody observes, with lines of velocities and comments as SP3-d may have.
    """
    start = (first - datetime(1980, 1, 6)).total_seconds()
    middle = (start + step * epochs / 2) % 604800
    best = {n: min(o, key=lambda r: abs(r["toe"] - middle)) for n, o in sorted(orbits.items())}
    names = [*best, *(f"C{k + 1:02d}" for k in range(further))]
    c, s = np.cos(turned), np.sin(turned)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])

    def date(at: datetime) -> str:
        return f"{at.year} {at.month:2d} {at.day:2d} {at.hour:2d} {at.minute:2d} {at.second:11.8f}"

    rows = max(5, -(-len(names) // 17))
    listed = [n.replace("G0", "  ") if version == "a" else n for n in names]
    listed = [n.replace("G", " ") for n in listed] if version == "a" else listed
    fill = [*listed, *["  0"] * (17 * rows - len(names))]
    kind = "V" if further else "P"
    lines = [
        f"#{version}{kind}{date(first)} {epochs:7d} ORBIT IGS00 HLM  TST",
        f"## {int(start // 604800):4d} {start % 604800:15.8f} {step:14.8f} 53462 0.0000000000000",
    ]
    for k in range(rows):
        head = f"+  {len(names):3d}   " if k == 0 else "+        "
        lines.append(head + "".join(fill[17 * k : 17 * k + 17]))
    lines += ["++       " + "  0" * 17] * rows
    lines += [f"%c M  cc {system} ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc"]
    lines += ["%c cc cc ccc ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc"]
    lines += ["%f  1.2500000  1.025000000  0.00000000000  0.000000000000000"] * 2
    lines += ["%i    0    0    0    0      0      0      0      0         0"] * 2
    lines += ["/* a remark"] * (12 if further else 4)
    for k in range(epochs):
        lines.append(f"*  {date(first + timedelta(seconds=step * k))}")
        for name, record in zip(listed, [*best.values()] + [None] * further, strict=False):
            if record is None:
                xyz, clock = np.array([2.0e7, 1.5e7, 1.0e7]), 0.0
            else:
                xyz, clock = position(record, (start + step * k) % 604800)
                xyz = turn @ xyz * (1 + moved / np.linalg.norm(xyz))
            x, y, z = xyz / 1e3
            lines.append(f"P{name}{x:14.6f}{y:14.6f}{z:14.6f}{1e6 * clock:14.6f}")
            if further:
                lines.append("EP  55  55  55     222")
                lines.append(f"V{name}" + f"{0.0:14.6f}" * 4)
    return "\n".join([*lines, "EOF", ""])
