"""The laboratory room of the twin as a plan: its targets, its stations, its walls as a scene."""

from pathlib import Path

import numpy as np

from tribrach.project import Project
from tribrach.simulate.twins import newcastle_lab

PARAMETERS = ("x10", "x2", "x3", "x4", "x6")
ROOM = """
[[plan.scene]]
kind = "box"
center_m = [0.5, 3.1, 0.1]
size_m = [11.02, 14.62, 3.3]

[[plan.scene]]
kind = "box"
center_m = [-2.6, 3.2, -1.2]
size_m = [1.6, 0.8, 0.7]
heading_deg = 11.459

[[plan.scene]]
kind = "box"
center_m = [3.9, 2.9, -1.25]
size_m = [0.9, 0.6, 0.6]
heading_deg = 28.648
"""
BASE = """
title = "Laboratory"
datum = "free"

[instruments.scanner]
range_mm = 1.2
range_ppm = 10.0
scan_angle_arcsec = 8.0

[[points]]
file = "targets.csv"
role = "approximate"
"""


def table(places: dict[str, np.ndarray]) -> str:
    rows = [f"{n},{x[0]:.4f},{x[1]:.4f},{x[2]:.4f}" for n, x in places.items()]
    return "\n".join(["point,e_m,n_m,u_m", *rows, ""])


def laboratory(folder: Path, keys: str = "", targets: int = 52, calibration: bool = True) -> Path:
    """A project file of the room before it is measured; keys are added to [plan]."""
    twin = newcastle_lab.build(points=1000)
    kept = {t.name: t.center for t in twin.targets[:: 52 // targets][:targets]}
    (folder / "targets.csv").write_text(table(kept))
    stations = {s.name: s.pose.translation for s in twin.stations}
    (folder / "stations.csv").write_text(table(stations))
    section = f'\n[calibration]\nmodel = "nist"\nparameters = {list(PARAMETERS)}\n'
    text = BASE + (section if calibration else "")
    text += '\n[plan]\nstations = "stations.csv"\nsteepest_deg = 75\n' + keys + ROOM
    path = folder / "lab.toml"
    path.write_text(text)
    return path


def load(folder: Path, keys: str = "", **options: object) -> Project:
    return Project.load(laboratory(folder, keys, **options))
