"""Tribrach by its Python, with the approximate poses that the other programs have as well."""

import tempfile
from pathlib import Path

import numpy as np

from benchmarks.coverage.programs import Found, tribrach
from benchmarks.coverage.scenes import Scene

SETTINGS = tribrach.SETTINGS.replace("no approximate poses", "approximate poses of the scene")


def register(scene: Scene) -> dict[str, Found | str]:
    """As without them; the poses stand in a list in the order of the scans."""
    rows = [np.eye(4), *(scene.approximate(scan) for scan in scene.scans[1:])]
    with tempfile.TemporaryDirectory() as folder:
        listed = Path(folder) / "approximate.txt"
        listed.write_text("".join(" ".join(f"{v:.9f}" for v in r[:3].ravel()) + "\n" for r in rows))
        return tribrach.register(scene, listed)
