"""Results as tables and pictures: data frames, a plan with ellipses, residuals.

Run it with a folder to leave the pictures in: ``python 05_tables_and_pictures.py pictures``.
"""

import sys
from pathlib import Path

import numpy as np

import tribrach as tb
from tribrach.observations.sights import HorizontalDistances

rng = np.random.default_rng(1)
names = [f"P{row}{column}" for row in range(3) for column in range(4)]
places = {name: (25.0 * int(name[2]), 20.0 * int(name[1]), 0.0) for name in names}
near = [
    (a, b) for k, a in enumerate(names) for b in names[k + 1 :]
    if np.linalg.norm(np.subtract(places[a], places[b])) < 40
]  # fmt: skip

survey = tb.Survey()
for name, xyz in places.items():
    held = name in ("P00", "P23")
    survey.point(name, xyz, free=(not held, not held, False), role="control" if held else "free")
lengths = np.array([np.linalg.norm(np.subtract(places[a], places[b])) for a, b in near])
survey.add(
    HorizontalDistances,
    values=lengths + 0.003 * rng.normal(size=len(near)),
    sigma=0.003,
    start=[a for a, _ in near],
    end=[b for _, b in near],
)

adjustment = tb.adjust(survey.network())
print(adjustment.to_frame("points"))
print(adjustment.to_frame("observations").sort("w").head(3))
if len(sys.argv) > 1:
    folder = Path(sys.argv[1])
    folder.mkdir(exist_ok=True)
    for what in ("plan", "residuals"):
        adjustment.plot(what).figure.savefig(folder / f"{what}.png", dpi=120)
