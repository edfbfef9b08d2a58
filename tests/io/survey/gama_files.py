"""GNU Gama files written for the tests, with observations computed from the file's own x, y."""

from pathlib import Path

import numpy as np

from tribrach.io.survey.gama import reader as gama
from tribrach.network.survey import Survey

#: E, N, U [m] of a small network
TRUTH = {
    "A": (100.0, 200.0, 10.0),
    "B": (183.0, 171.0, 14.0),
    "C": (161.0, 262.0, 22.0),
    "D": (92.0, 283.0, 7.0),
}
#: x and y in terms of E and N, and whether the axes are right-handed, by axes-xy
FILE_AXES = {
    "ne": (lambda e, n: (n, e), False),
    "sw": (lambda e, n: (-n, -e), False),
    "es": (lambda e, n: (e, -n), False),
    "wn": (lambda e, n: (-e, n), False),
    "en": (lambda e, n: (e, n), True),
    "nw": (lambda e, n: (n, -e), True),
    "se": (lambda e, n: (-n, e), True),
    "ws": (lambda e, n: (-e, -n), True),
}
HEAD = '<?xml version="1.0"?>\n'
XMLNS = 'xmlns="http://www.gnu.org/software/gama/gama-local"'


def document(body: str, network: str = "", parameters: str = "", section: str = "") -> str:
    """A whole file; ``body`` starts on line 6."""
    return (
        f"{HEAD}<gama-local {XMLNS}>\n<network {network}>\n<parameters {parameters}/>\n"
        f"<points-observations {section}>\n{body}\n</points-observations>\n</network>\n"
        "</gama-local>\n"
    )


def read(folder: Path, text: str) -> Survey:
    """The survey of a file with this text."""
    path = folder / "net.gkf"
    path.write_text(text)
    return gama.read(path)


def file_coordinates(axes: str) -> dict[str, np.ndarray]:
    """x, y, z of the truth in a file's axes."""
    to_file = FILE_AXES[axes][0]
    return {name: np.array([*to_file(e, n), u]) for name, (e, n, u) in TRUTH.items()}


def turn(xyz: dict[str, np.ndarray], at: str, to: str) -> float:
    """Angle [gon] from the x axis to a line, in the sense from x to y."""
    d = xyz[to] - xyz[at]
    return float(np.degrees(np.arctan2(d[1], d[0]))) / 0.9


def full_network(axes: str, hand: str) -> str:
    """All kinds of observations, free of errors; A is fixed, B has observed coordinates."""
    xyz = file_coordinates(axes)
    # x to y is clockwise in left-handed axes; circle readings turn as the attribute says
    sense = 1 if FILE_AXES[axes][1] == (hand == "right-handed") else -1
    lines = ['<point id="A" x="{:.4f}" y="{:.4f}" z="{:.4f}" fix="xyz"/>'.format(*xyz["A"])]
    lines += [f'<point id="{name}" adj="xyz"/>' for name in "BCD"]
    for station, zero in (("A", 17.0), ("B", 310.0)):
        lines.append(f'<obs from="{station}" from_dh="1.5">')
        for target in sorted(set(TRUTH) - {station}):
            d = xyz[target] - xyz[station] + (0, 0, 0.2 - 1.5)
            flat, slope = np.hypot(d[0], d[1]), np.linalg.norm(d)
            reading = (sense * (turn(xyz, station, target) - zero)) % 400
            zenith = np.degrees(np.arctan2(flat, d[2])) / 0.9
            lines += [
                f'<direction to="{target}" val="{reading:.10f}" stdev="3" to_dh="0.2"/>',
                f'<z-angle to="{target}" val="{zenith:.10f}" stdev="5" to_dh="0.2"/>',
                f'<s-distance to="{target}" val="{slope:.9f}" stdev="2" to_dh="0.2"/>',
                f'<distance to="{target}" val="{flat:.9f}" stdev="2"/>',
            ]
        lines.append("</obs>")
    e, n, _ = np.subtract(TRUTH["D"], TRUTH["C"])
    azimuth = np.degrees(np.arctan2(e, n)) / 0.9 * (1 if hand == "left-handed" else -1)
    angle = (sense * (turn(xyz, "C", "D") - turn(xyz, "C", "B"))) % 400
    vector = xyz["D"] - xyz["A"] + (0, 0, 0.1 - 0.3)
    lines += [
        "<obs>",
        f'<azimuth from="C" to="D" val="{azimuth:.10f}" stdev="9"/>',
        f'<angle from="C" bs="B" fs="D" val="{angle:.10f}" stdev="9"/>',
        f'<dh from="B" to="C" val="{xyz["C"][2] - xyz["B"][2]:.4f}" stdev="1"/>',
        "</obs>",
        '<coordinates><point id="B" x="{:.4f}" y="{:.4f}"/>'.format(*xyz["B"]),
        '<cov-mat dim="2" band="1">9 2 4</cov-mat></coordinates>',
        '<vectors><vec from="A" to="D" dx="{:.4f}" dy="{:.4f}" dz="{:.4f}"'.format(*vector),
        'from_dh="0.3" to_dh="0.1"/><cov-mat dim="3" band="2">4 1 2 9 3 16</cov-mat></vectors>',
    ]
    return document("\n".join(lines), f'axes-xy="{axes}" angles="{hand}"')
